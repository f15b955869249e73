//! `--reference`: the error of every step against path tracing or the full matrix.

use std::{
    collections::{BTreeMap, HashMap},
    sync::{Arc, Mutex, PoisonError},
};

use glam::{Vec2, Vec3};

use super::{observed::observed_solvers, report::ReferenceFacts};
#[cfg(feature = "viewer")]
use crate::metrics::VertexReference;
use crate::{
    geometry::{RayTree, low_discrepancy_2d, triangle_point},
    metrics::{ErrorMeasures, MeshLookup, measure_error},
    reference::{
        MatrixError, MatrixPatch, MatrixSettings, PathSettings, PathTracer, ReferencePoint,
        solve_matrix,
    },
    sampling::{SurfacePoint, sample_points},
    scene::{Scene, TriangleId},
    solver::Snapshot,
    worker::MakeStepper,
};

/// Errors by step, filled while the solve runs.
pub(super) type Errors = Arc<Mutex<BTreeMap<u32, ErrorMeasures>>>;

/// The reference that light is compared with.
pub(super) struct Truth {
    /// Its description.
    pub(super) facts: ReferenceFacts,
    /// Random points with their light.
    points: Vec<ReferencePoint>,
    /// Where the measured light of each point is looked up and averaged: as many places in turn for every point.
    probes: Vec<ReferencePoint>,
}

/// Patches drawn, as points of the path-traced reference are, to stand for the matrix.
const MATRIX_POINTS: u32 = 4000;

/// Places per drawn patch: the matrix knows means of patches only, so the mean of the mesh is compared.
const MATRIX_PROBES: u32 = 8;

impl Truth {
    /// By path tracing; `None` when cancelled.
    pub(super) fn traced(
        scene: &Arc<Scene>,
        samples: u32,
        seed: u64,
        cancel: &(dyn Fn() -> bool + Sync),
    ) -> Option<Self> {
        let rays = Arc::new(RayTree::new(scene));
        let settings = PathSettings {
            samples_per_pass: samples,
            seed,
            ..PathSettings::default()
        };
        let mut tracer = PathTracer::new(scene.clone(), rays, settings);
        let traced = tracer.pass(cancel).then(|| tracer.result())?;
        Some(Self {
            facts: ReferenceFacts {
                method: "paths",
                samples: Some(traced.samples),
                points: traced.points.len(),
                surfaces: traced.surfaces,
                error_of: traced.surfaces.to_string(),
            },
            probes: traced.points.clone(),
            points: traced.points,
        })
    }

    /// By the full matrix.
    ///
    /// # Errors
    /// As [`solve_matrix`].
    pub(super) fn by_matrix(
        scene: &Scene,
        seed: u64,
        cancel: &(dyn Fn() -> bool + Sync),
    ) -> Result<Self, MatrixError> {
        let settings = MatrixSettings {
            seed,
            ..MatrixSettings::default()
        };
        let rays = RayTree::new(scene);
        let solution = solve_matrix(scene, &rays, &settings, cancel)?;
        let patches: HashMap<(TriangleId, bool), &MatrixPatch> = solution
            .patches
            .iter()
            .map(|patch| ((patch.triangle, patch.is_back), patch))
            .collect();
        let (chosen, surfaces) = sample_points(scene, &rays, MATRIX_POINTS, seed);
        let (mut points, mut probes) = (Vec::new(), Vec::new());
        let patch_of = |point: &SurfacePoint| patches.get(&(point.triangle, point.is_back));
        for patch in chosen.iter().filter_map(patch_of) {
            points.push(matrix_point(scene, patch, Vec3::splat(1.0 / 3.0)));
            for probe in 0..MATRIX_PROBES {
                let at = triangle_point(low_discrepancy_2d(probe, Vec2::ZERO));
                probes.push(matrix_point(scene, patch, at));
            }
        }
        Ok(Self {
            facts: ReferenceFacts {
                method: "matrix",
                samples: None,
                points: points.len(),
                surfaces,
                error_of: surfaces.to_string(),
            },
            points,
            probes,
        })
    }

    /// Error of what a snapshot shows.
    fn measure(&self, scene: &Scene, snapshot: &Snapshot) -> Option<ErrorMeasures> {
        let lookup = MeshLookup::new(scene, &snapshot.mesh);
        let found = lookup.radiance(&snapshot.light, &self.probes);
        let count = self
            .probes
            .len()
            .checked_div(self.points.len())
            .filter(|&count| count > 0)?;
        let mean = |probes: &[Option<Vec3>]| -> Option<Vec3> {
            let sum: Option<Vec3> = probes.iter().copied().sum();
            sum.map(|sum| sum / count as f32)
        };
        let measured: Vec<Option<Vec3>> = found.chunks(count).map(mean).collect();
        measure_error(&measured, &self.points)
    }
}

/// Measured error at each vertex of a snapshot, in per cent of the reference's root mean square; `None` when cancelled.
#[cfg(feature = "viewer")]
pub(super) fn vertex_errors(
    scene: &Scene,
    snapshot: &Snapshot,
    (samples, seed): (u32, u64),
    reference_rms: f64,
    cancel: &(dyn Fn() -> bool + Sync),
) -> Option<Vec<f32>> {
    let rays = RayTree::new(scene);
    let mut reference = VertexReference::new(&snapshot.mesh, !seed);
    // Noise cannot be told from fewer than two passes.
    while reference.samples() < samples.max(2 * VertexReference::SAMPLES_PER_PASS) {
        reference.advance(scene, &rays, cancel)?;
    }
    reference.errors(&snapshot.light, 0.01 * reference_rms)
}

/// A point that stands for a patch of the matrix.
fn matrix_point(scene: &Scene, patch: &MatrixPatch, barycentric: Vec3) -> ReferencePoint {
    let [a, b, c] = scene.corners(patch.triangle);
    let surface = scene.surfaces[patch.triangle.index()];
    let front = surface.area_vector.normalize_or_zero();
    // Points stand for what rays meet.
    let met = 1.0 / surface.opacity.max(f32::MIN_POSITIVE);
    ReferencePoint {
        triangle: patch.triangle,
        is_back: patch.is_back,
        barycentric,
        position: a * barycentric.x + b * barycentric.y + c * barycentric.z,
        normal: if patch.is_back { -front } else { front },
        reflectance: surface.reflectance * met,
        emission: surface.emission * met,
        irradiance: patch.irradiance,
        irradiance_error: 0.0,
        standard_error: 0.0,
    }
}

/// Makes solvers that measure the error of each snapshot. The measuring counts as elapsed, not as solved time.
pub(super) fn measured_solvers(truth: Truth, errors: Errors) -> MakeStepper {
    observed_solvers(move |scene, snapshot| {
        if let Some(error) = truth.measure(scene, snapshot) {
            errors
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .insert(snapshot.step, error);
        }
    })
}
