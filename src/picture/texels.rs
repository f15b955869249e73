//! Light at the texels of lightmaps: records of their places, shared between the texels of one chart as those of a picture are
//! between pixels.

use std::{
    ops::Range,
    sync::atomic::{AtomicU32, Ordering},
};

use glam::Vec3;
use rayon::prelude::*;

use super::{
    record::{Record, Recorder},
    sampler::Sampler,
    share::SHARED_ROWS,
    surface::{LitScene, Surface},
    survey::Survey,
};
use crate::{
    geometry::RayTree,
    scene::{Scene, TriangleId, luminance},
    solver::{Cancel, Snapshot},
};

/// Tangents of the directions in which a texel looks for a solid that it lies in: it does by two of three, since a ray may
/// slip through an edge.
const SOLID_PROBES: [[f32; 2]; 3] = [[0.07, 0.04], [-0.38, 0.31], [0.29, -0.42]];

/// Texels that are made at once, about. Fewer share less work; more take more memory: about 500 bytes for each.
const BAND: u32 = 1 << 20;

/// The place of a texel on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TexelPlace {
    /// The triangle.
    pub triangle: TriangleId,
    /// Whether it lies on the back.
    pub is_back: bool,
    /// Position in frame units.
    pub position: Vec3,
    /// The chart that it belongs to: light is shared within one only.
    pub chart: u32,
}

/// The texels of a lightmap.
#[derive(Clone, Copy)]
pub struct TexelGrid<'a> {
    /// Width and height.
    pub size: [u32; 2],
    /// Distance between neighbouring texels, frame units.
    pub spacing: f32,
    /// The place of a texel by column and row, if it has one.
    pub place: &'a (dyn Fn([u32; 2]) -> Option<TexelPlace> + Sync),
}

/// Light at the texels of a lightmap.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TexelLight {
    /// Irradiance, W/m², row by row; finite and not negative. Nothing where a texel has no place, or lies inside a solid.
    pub irradiance: Vec<Option<Vec3>>,
    /// By how much its luminance differs from that of the light stored at vertices: root mean square over the texels,
    /// relative to that of the light.
    pub beside_vertices: f64,
}

/// A scene and its light.
#[derive(Clone, Copy)]
pub struct TexelSource<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// All of its triangles.
    pub rays: &'a RayTree,
    /// Its light.
    pub snapshot: &'a Snapshot,
    /// Of all random numbers.
    pub seed: u64,
}

/// The light at the texels of a grid; `None` when cancelled. `told` hears the part that is done, 0…1.
pub fn light_texels(
    source: &TexelSource<'_>,
    grid: &TexelGrid<'_>,
    told: &(dyn Fn(f32) + Sync),
    cancel: &Cancel,
) -> Option<TexelLight> {
    let lit = LitScene::new(source.scene, source.rays, source.snapshot);
    cancel.proceed()?;
    let [width, height] = grid.size;
    let rows = (BAND / width.max(1)).max(1);
    let bands: Vec<Range<u32>> = (0..height)
        .step_by(rows as usize)
        .map(|top| top..(top + rows).min(height))
        .collect();
    // Every row is told of twice.
    let all: usize = bands.iter().map(|band| 2 * about(band, height).len()).sum();
    let done = AtomicU32::new(0);
    let row_done = || {
        let done = 1 + done.fetch_add(1, Ordering::Relaxed);
        told(done as f32 / all.max(1) as f32);
    };
    let triangles = &source.scene.triangles;
    let lighting = Lighting {
        lit: &lit,
        has_solids: triangles.iter().any(|triangle| triangle.bounds_solid),
        grid,
        seed: source.seed,
        told: &row_done,
        cancel,
    };
    let mut light = TexelLight::default();
    let (mut apart, mut whole) = (0.0, 0.0);
    for band in bands {
        for lit in lighting.band(band, height)? {
            light.irradiance.push(lit.map(|[irradiance, _]| irradiance));
            if let Some(values) = lit {
                let [found, stored] = values.map(|value| f64::from(luminance(value)));
                apart += (found - stored).powi(2);
                whole += found.powi(2);
            }
        }
    }
    if whole > 0.0 {
        light.beside_vertices = (apart / whole).sqrt();
    }
    Some(light)
}

/// The rows that a band needs records of.
fn about(band: &Range<u32>, height: u32) -> Range<u32> {
    band.start.saturating_sub(SHARED_ROWS)..(band.end + SHARED_ROWS).min(height)
}

/// What all texels share.
struct Lighting<'a> {
    lit: &'a LitScene<'a>,
    has_solids: bool,
    grid: &'a TexelGrid<'a>,
    seed: u64,
    told: &'a (dyn Fn() + Sync),
    cancel: &'a Cancel,
}

impl<'a> Lighting<'a> {
    /// The irradiance at the texels of some rows, and what of it is stored at vertices.
    fn band(&self, rows: Range<u32>, height: u32) -> Option<Vec<Option<[Vec3; 2]>>> {
        let width = self.grid.size[0];
        let about = about(&rows, height);
        let survey = Survey {
            width,
            seed: self.seed,
            cancel: self.cancel,
            tools: &|| Recorder::new(self.lit),
            record: &|recorder, at, sampler, counts| self.record(recorder, at, sampler, counts),
            told: self.told,
        };
        let records = survey.rows(about.clone())?;
        let shared = records.shared(self.cancel)?;
        let texels = rows.len() as u32 * width;
        let light = |texel: u32| {
            let at = [texel % width, rows.start + texel / width];
            let more = shared.of(((at[1] - about.start) * width + at[0]) as usize)?;
            let (surface, _) = self.surface(at)?;
            let [all, direct] = self.lit.stored(&surface);
            let light = (all - direct).max(Vec3::ZERO) + more;
            // Not a number becomes 0.
            Some([light.max(Vec3::ZERO).min(Vec3::MAX), all])
        };
        Some((0..texels).into_par_iter().map(light).collect())
    }

    /// The record of a texel, unless it lies inside a solid.
    fn record(
        &self,
        recorder: &mut Recorder<'a>,
        at: [u32; 2],
        sampler: &Sampler,
        counts: [u32; 2],
    ) -> Option<Record> {
        let (surface, chart) = self.surface(at)?;
        if self.has_solids && self.is_in_solid(&surface) {
            return None;
        }
        let numbers = sampler.sample(at, 0);
        let spacing = self.grid.spacing;
        let record = recorder.record(&surface, spacing, sampler, numbers, counts);
        Some(Record {
            group: chart,
            ..record
        })
    }

    /// The surface at a texel, and its chart.
    fn surface(&self, at: [u32; 2]) -> Option<(Surface, u32)> {
        let place = (self.grid.place)(at)?;
        let area = self.lit.scene.surfaces[place.triangle.index()].area_vector;
        let front = area.normalize_or(Vec3::Y);
        let normal = if place.is_back { -front } else { front };
        let surface = self
            .lit
            .surface_at(place.triangle, place.is_back, normal, place.position);
        Some((surface, place.chart))
    }

    /// Whether a surface lies inside a solid there, where nobody sees it, but its neighbours would be blended with its darkness.
    fn is_in_solid(&self, surface: &Surface) -> bool {
        let triangles = &self.lit.scene.triangles;
        let bounds = |triangle: TriangleId| triangles[triangle.index()].bounds_solid;
        let normal = surface.flat_normal;
        let tangent = normal.any_orthonormal_vector();
        let is_left = |[x, y]: [f32; 2]| {
            let direction = normal + tangent * x + normal.cross(tangent) * y;
            let direction = direction.normalize_or(normal);
            let (from, own) = (surface.position, Some(surface.triangle));
            self.lit.rays.solids_left(from, direction, own, bounds) > 0
        };
        let [first, second, third] = SOLID_PROBES;
        is_left(first) && (is_left(second) || is_left(third))
    }
}
