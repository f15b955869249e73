//! The full radiosity matrix over the scene's triangles, solved by Gauss–Seidel.
//!
//! Radiosity is taken as constant over each side of each triangle, with textures averaged: on a coarse mesh this is
//! not the truth, but it is exactly what a radiosity method over the same triangles converges to.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{
    form_factor::{Side, exchange_area},
    outside::{Outside, OutsideSquares, Place},
};
use crate::{
    geometry::{Random, RayTree, low_discrepancy_2d, triangle_point},
    scene::{Scene, TriangleId},
};

/// How a matrix is filled and solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MatrixSettings {
    /// Largest matrix in bytes, at 4 per entry; the default holds 10,000 patches.
    pub memory_limit: u64,
    /// Rays for the visibility of a pair, at least 1. Pairs with an emitter get 16 times as many, and near pairs up
    /// to 64 times, since few such pairs carry most of the light.
    pub rays_per_pair: u32,
    /// Same seed, same bits.
    pub seed: u64,
}

impl Default for MatrixSettings {
    fn default() -> Self {
        Self {
            memory_limit: 400_000_000,
            rays_per_pair: 4,
            seed: 0,
        }
    }
}

/// Why there is no solution.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MatrixError {
    /// The matrix would not fit.
    #[error(
        "the matrix of {patches} patches takes {mebibytes} MiB (at most {limit_mebibytes}); use path tracing as the reference"
    )]
    TooLarge {
        /// Sides of triangles that receive light.
        patches: usize,
        /// The memory it would take.
        mebibytes: u64,
        /// The memory it may take.
        limit_mebibytes: u64,
    },
    /// The caller asked to stop.
    #[error("cancelled")]
    Cancelled,
}

/// One side of a triangle in the solution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MatrixPatch {
    /// The triangle.
    pub triangle: TriangleId,
    /// Whether it is the back of a two-sided triangle.
    pub is_back: bool,
    /// Mean irradiance, W/m².
    pub irradiance: Vec3,
    /// Radiosity `π·Le + ρ·E`, W/m².
    pub radiosity: Vec3,
    /// Sum of its form factors as computed; 1 in a closed scene.
    pub row_sum: f32,
}

/// Radiosity of every lit side.
#[derive(Clone, Debug, PartialEq)]
pub struct MatrixSolution {
    /// Fronts in the order of the triangles, each followed by its back where that is lit.
    pub patches: Vec<MatrixPatch>,
    /// Sweeps that the iteration took.
    pub sweeps: u32,
    /// Largest change in the last sweep, relative to the largest radiosity.
    pub residual: f64,
}

/// Change relative to the largest radiosity at which the iteration ends: about the digits of a form factor in f32.
const TOLERANCE: f64 = 1e-7;

/// Sweeps after which the iteration ends anyway; a reflectance of 0.98 takes some 400.
const MAX_SWEEPS: u32 = 5000;

/// Samples of the light from outside at each side: where a fifth of the sky is seen, their noise is some 1 %. Fewer show;
/// more take longer than all form factors. A power of two.
const OUTSIDE_SAMPLES: u32 = 4096;

/// Odd, so that it orders the samples anew.
const SCRAMBLE: u32 = 0x9e37_79b1;

/// Fill and solve the matrix of a scene. `rays` is its ray tree; `cancel` is asked before every row.
///
/// # Errors
/// [`MatrixError::TooLarge`] above the memory limit, [`MatrixError::Cancelled`] when `cancel` came true.
pub fn solve_matrix(
    scene: &Scene,
    rays: &RayTree,
    settings: &MatrixSettings,
    cancel: &(dyn Fn() -> bool + Sync),
) -> Result<MatrixSolution, MatrixError> {
    let (mut patches, sides) = lit_sides(scene);
    let bytes = 4 * (sides.len() as u64).pow(2);
    if bytes > settings.memory_limit {
        return Err(MatrixError::TooLarge {
            patches: sides.len(),
            mebibytes: bytes.div_ceil(1 << 20),
            limit_mebibytes: settings.memory_limit >> 20,
        });
    }
    let mut matrix = exchange_areas(scene, &sides, rays, settings, cancel)?;
    let row_sums = into_form_factors(&mut matrix, &sides);
    for (patch, row_sum) in patches.iter_mut().zip(row_sums) {
        patch.row_sum = row_sum;
    }
    let direct = irradiance_from_outside(scene, &sides, rays, settings.seed, cancel)?;
    let (sweeps, residual) = gauss_seidel(scene, &matrix, &direct, &mut patches, cancel)?;
    Ok(MatrixSolution {
        patches,
        sweeps,
        residual,
    })
}

/// All sides that receive light.
fn lit_sides(scene: &Scene) -> (Vec<MatrixPatch>, Vec<Side>) {
    let (mut patches, mut sides) = (Vec::new(), Vec::new());
    for id in scene.triangle_ids() {
        let area_vector = scene.surfaces[id.index()].area_vector;
        let [a, b, c] = scene.corners(id);
        let front = area_vector.normalize_or_zero();
        let backs = 1 + usize::from(scene.triangles[id.index()].two_sided);
        for is_back in [false, true].into_iter().take(backs) {
            patches.push(MatrixPatch {
                triangle: id,
                is_back,
                irradiance: Vec3::ZERO,
                radiosity: Vec3::ZERO,
                row_sum: 0.0,
            });
            sides.push(Side {
                triangle: id,
                corners: if is_back { [a, c, b] } else { [a, b, c] },
                normal: if is_back { -front } else { front },
                area: area_vector.length(),
            });
        }
    }
    (patches, sides)
}

/// The symmetric matrix of exchange areas, row by row; only entries right of the diagonal are filled.
fn exchange_areas(
    scene: &Scene,
    sides: &[Side],
    tree: &RayTree,
    settings: &MatrixSettings,
    cancel: &(dyn Fn() -> bool + Sync),
) -> Result<Vec<f32>, MatrixError> {
    let count = sides.len();
    let emits: Vec<bool> = sides
        .iter()
        .map(|side| scene.surfaces[side.triangle.index()].emission != Vec3::ZERO)
        .collect();
    let mut matrix = vec![0.0; count * count];
    matrix
        .par_chunks_mut(count.max(1))
        .enumerate()
        .try_for_each(|(i, row)| {
            if cancel() {
                return Err(MatrixError::Cancelled);
            }
            for j in i + 1..count {
                let mut random = Random::new(settings.seed, (i * count + j) as u64);
                let emitter = if emits[i] || emits[j] { 16 } else { 1 };
                let near = nearness(&sides[i], &sides[j]);
                let rays = settings.rays_per_pair.max(1) * near.max(emitter);
                row[j] = exchange_area(&sides[i], &sides[j], tree, rays, &mut random);
            }
            Ok(())
        })?;
    Ok(matrix)
}

/// How many times more rays than a far pair this one deserves: its form factor over a hundredth, 1…64.
fn nearness(a: &Side, b: &Side) -> u32 {
    let distance_squared = a.corners[0].distance_squared(b.corners[0]);
    let factor =
        a.area.max(b.area) / (std::f32::consts::PI * distance_squared.max(f32::MIN_POSITIVE));
    (100.0 * factor).clamp(1.0, 64.0) as u32
}

/// Mirror the exchange areas, divide them by the receiver's area, and return the row sums.
/// Rows that sampling left above 1 are scaled to 1, which keeps the iteration contracting.
fn into_form_factors(matrix: &mut [f32], sides: &[Side]) -> Vec<f32> {
    let count = sides.len();
    for i in 0..count {
        for j in 0..i {
            matrix[i * count + j] = matrix[j * count + i];
        }
    }
    matrix
        .par_chunks_mut(count.max(1))
        .zip(sides)
        .map(|(row, side)| {
            let sum = row.iter().map(|&entry| f64::from(entry)).sum::<f64>() / f64::from(side.area);
            let divisor = side.area * sum.max(1.0) as f32;
            for entry in row {
                *entry /= divisor;
            }
            sum as f32
        })
        .collect()
}

/// Mean irradiance of each side straight from sky and sun.
fn irradiance_from_outside(
    scene: &Scene,
    sides: &[Side],
    rays: &RayTree,
    seed: u64,
    cancel: &(dyn Fn() -> bool + Sync),
) -> Result<Vec<Vec3>, MatrixError> {
    let outside = Outside::new(scene);
    if outside.is_dark() {
        return Ok(vec![Vec3::ZERO; sides.len()]);
    }
    let of_side = |(index, side): (usize, &Side)| {
        if cancel() {
            return Err(MatrixError::Cancelled);
        }
        let mut random = Random::new(seed, (index as u64) | 1 << 63);
        let [on, toward, sky, sun] = [(); 4].map(|()| random.uniform_2d());
        let (shift, [a, b, c]) = (OutsideSquares { sky, sun }, side.corners);
        let mut sum = DVec3::ZERO;
        for sample in 0..OUTSIDE_SAMPLES {
            // The place follows a sequence of its own order, so that no direction belongs to a place.
            let scrambled = sample.wrapping_mul(SCRAMBLE) % OUTSIDE_SAMPLES;
            let place = triangle_point(low_discrepancy_2d(scrambled, on));
            let at = Place {
                position: a * place.x + b * place.y + c * place.z,
                normal: side.normal,
                triangle: side.triangle,
            };
            let toward = low_discrepancy_2d(sample, toward);
            let found = outside.irradiance(rays, at, toward, shift.moved(sample));
            sum += found.as_dvec3();
        }
        Ok((sum / f64::from(OUTSIDE_SAMPLES)).as_vec3())
    };
    sides.par_iter().enumerate().map(of_side).collect()
}

/// Solve `B = π·Le + ρ (F B + D)` in f64, where D comes straight from outside; returns the sweeps taken and the last change.
fn gauss_seidel(
    scene: &Scene,
    matrix: &[f32],
    direct: &[Vec3],
    patches: &mut [MatrixPatch],
    cancel: &(dyn Fn() -> bool + Sync),
) -> Result<(u32, f64), MatrixError> {
    let count = patches.len();
    let surfaces: Vec<(DVec3, DVec3)> = patches
        .iter()
        .map(|patch| {
            let surface = &scene.surfaces[patch.triangle.index()];
            let emitted = surface.emission.as_dvec3() * std::f64::consts::PI;
            (emitted, surface.reflectance.as_dvec3())
        })
        .collect();
    let mut radiosity: Vec<DVec3> = surfaces.iter().map(|&(emitted, _)| emitted).collect();
    let (mut sweeps, mut residual) = (0, f64::INFINITY);
    while residual > TOLERANCE && sweeps < MAX_SWEEPS {
        let (mut change, mut largest) = (0.0_f64, 0.0_f64);
        for (i, row) in matrix.chunks(count).enumerate() {
            if cancel() {
                return Err(MatrixError::Cancelled);
            }
            let irradiance: DVec3 = row
                .iter()
                .zip(&radiosity)
                .map(|(&factor, &source)| source * f64::from(factor))
                .sum();
            let irradiance = irradiance + direct[i].as_dvec3();
            let (emitted, reflectance) = surfaces[i];
            let updated = emitted + reflectance * irradiance;
            change = change.max((updated - radiosity[i]).abs().max_element());
            largest = largest.max(updated.max_element());
            radiosity[i] = updated;
            patches[i].irradiance = irradiance.as_vec3();
            patches[i].radiosity = updated.as_vec3();
        }
        sweeps += 1;
        residual = if largest > 0.0 { change / largest } else { 0.0 };
    }
    Ok((sweeps, residual))
}
