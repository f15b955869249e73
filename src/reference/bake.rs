//! Irradiance at given points by path tracing, pass by pass: vertex baking as artists' tools do it.
//!
//! Each point runs through one low-discrepancy sequence of its own shift, whatever passes it is cut into, so that no
//! sample is lost to an early look. Random numbers belong to a point and a sample, so the result does not depend on
//! threads.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{
    estimator::{Bounce, Estimator, bending_rays},
    outside::{Outside, Place},
};
use crate::{
    geometry::{Random, RayTree, centroid, low_discrepancy_2d},
    sampling::Emitters,
    scene::{Scene, TriangleId},
};

/// How far a baked vertex is drawn into its triangle, in frame units: at the vertex itself, rays would start in the
/// plane of the wall beside it and pass through. Far above the offset of rays, far below what can be seen.
const BAKE_INSET: f32 = 2e-3;

/// Step of the sequence that chooses emitters: the golden ratio, which no sum of the planar steps can follow.
const CHOICE_STEP: f64 = 0.618_033_988_749_894_9;

/// A point to bake: a vertex of one of the triangles that share it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BakePoint {
    /// Position in frame units.
    pub position: Vec3,
    /// Unit normal towards the lit side.
    pub normal: Vec3,
    /// The triangle it belongs to.
    pub triangle: TriangleId,
}

/// A bake in progress.
pub struct VertexBake<'a> {
    scene: &'a Scene,
    rays: &'a RayTree,
    /// The rays of a scene with glass: paths bend in it, where the rays of others pass straight on.
    bending: Option<RayTree>,
    emitters: Emitters,
    outside: Outside,
    starts: Vec<Place>,
    /// Sums over the samples; in f64, since thousands of terms are added.
    sums: Vec<DVec3>,
    samples: u32,
    ray_count: u64,
    seed: u64,
}

impl<'a> VertexBake<'a> {
    /// A bake without samples. `rays` is the ray tree of the scene; different seeds are independent.
    pub fn new(scene: &'a Scene, rays: &'a RayTree, points: &[BakePoint], seed: u64) -> Self {
        Self {
            scene,
            rays,
            bending: bending_rays(scene),
            emitters: Emitters::new(scene),
            outside: Outside::new(scene),
            starts: points.iter().map(|point| inset(scene, point)).collect(),
            sums: vec![DVec3::ZERO; points.len()],
            samples: 0,
            ray_count: 0,
            seed,
        }
    }

    /// `samples` more paths from every point. `false` when `cancel` came true on the way; the pass then leaves no trace.
    pub fn pass(&mut self, samples: u32, cancel: &(dyn Fn() -> bool + Sync)) -> bool {
        let until = self.samples.saturating_add(samples);
        let added: Option<Vec<(DVec3, u64)>> = self
            .starts
            .par_iter()
            .enumerate()
            .map(|(index, &start)| {
                (!cancel()).then(|| self.sample(index, start, self.samples..until))
            })
            .collect();
        let Some(added) = added else {
            return false;
        };
        for (sum, (more, rays)) in self.sums.iter_mut().zip(added) {
            *sum += more;
            self.ray_count += rays;
        }
        self.samples = until;
        true
    }

    /// Irradiance at each point so far, W/m²; black before the first pass.
    pub fn irradiance(&self) -> Vec<Vec3> {
        let count = f64::from(self.samples.max(1));
        self.sums
            .iter()
            .map(|sum| (sum / count).as_vec3())
            .collect()
    }

    /// Paths from each point so far.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Rays shot so far.
    pub fn ray_count(&self) -> u64 {
        self.ray_count
    }

    /// Bytes in use, with the ray tree.
    pub fn memory_bytes(&self) -> usize {
        let bending = self.bending.as_ref().map_or(0, RayTree::memory_bytes);
        self.rays.memory_bytes()
            + bending
            + size_of_val(self.starts.as_slice())
            + size_of_val(self.sums.as_slice())
    }

    /// Sum of these samples at a point, and the rays that they took.
    fn sample(&self, index: usize, start: Place, samples: std::ops::Range<u32>) -> (DVec3, u64) {
        let estimator = Estimator {
            scene: self.scene,
            rays: self.bending.as_ref().unwrap_or(self.rays),
            emitters: &self.emitters,
            outside: &self.outside,
        };
        if estimator.is_dark() {
            return (DVec3::ZERO, 0);
        }
        let mut shifts = Random::new(self.seed, (index as u64) << 32 | u64::from(u32::MAX));
        let (direction_shift, emitter_shift) = (shifts.uniform_2d(), shifts.uniform_2d());
        let choice_shift = f64::from(shifts.next_u32()) / 4_294_967_296.0;
        let outside_shift = self.outside.squares(|| shifts.uniform_2d());
        let (mut sum, mut ray_count) = (DVec3::ZERO, 0);
        for sample in samples {
            let first = Bounce {
                direction: low_discrepancy_2d(sample, direction_shift),
                choice: (f64::from(sample) * CHOICE_STEP + choice_shift).fract(),
                emitter: low_discrepancy_2d(sample, emitter_shift),
                outside: outside_shift.moved(sample),
            };
            let mut random = Random::new(self.seed, (index as u64) << 32 | u64::from(sample));
            let (irradiance, rays) = estimator.irradiance(start, first, &mut random);
            sum += irradiance.as_dvec3();
            ray_count += u64::from(rays);
        }
        (sum, ray_count)
    }
}

/// Irradiance at given points, each by `samples` paths; `None` when cancelled.
/// Calls with different seeds are independent, so their means may be averaged.
pub fn bake(
    scene: &Scene,
    rays: &RayTree,
    points: &[BakePoint],
    samples: u32,
    seed: u64,
    cancel: &(dyn Fn() -> bool + Sync),
) -> Option<Vec<Vec3>> {
    let mut bake = VertexBake::new(scene, rays, points, seed);
    bake.pass(samples, cancel).then(|| bake.irradiance())
}

/// Where the paths of a baked vertex start: a little inside its triangle.
fn inset(scene: &Scene, point: &BakePoint) -> Place {
    let inward = centroid(scene.corners(point.triangle)) - point.position;
    let distance = BAKE_INSET.min(inward.length() / 3.0);
    Place {
        position: point.position + inward.normalize_or_zero() * distance,
        normal: point.normal,
        triangle: point.triangle,
    }
}
