//! Irradiance at random surface points by path tracing, pass by pass, with its standard error.
//!
//! For the points, and the surfaces that they stand for, see [`crate::sampling`]. Each takes its samples in
//! groups; a group covers the hemisphere with a randomly shifted low-discrepancy sequence, and since groups are
//! independent their scatter gives an unbiased variance. All random numbers belong to a point and a group, so the
//! result does not depend on threads.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{
    estimator::{Bounce, Estimator, bending_rays},
    outside::{Outside, Place},
    point::ReferencePoint,
};
use crate::{
    geometry::{Random, RayTree, low_discrepancy_2d},
    sampling::{Emitters, SampledSurfaces, sample_points},
    scene::{Scene, luminance},
};

/// Samples of a group. Fewer lose stratification, more leave too few groups to estimate the variance.
const GROUP: u32 = 8;

/// How a path-traced reference is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathSettings {
    /// Number of surface points; the error of a relative RMS over them is about `1/√(2·points)` of itself.
    pub point_count: u32,
    /// Samples per point and pass, rounded up to at least two groups of 8.
    pub samples_per_pass: u32,
    /// Same seed, same points and same samples.
    pub seed: u64,
}

impl Default for PathSettings {
    fn default() -> Self {
        Self {
            point_count: 4000,
            samples_per_pass: 32,
            seed: 0,
        }
    }
}

/// A reference as it stands.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PathTraced {
    /// Random points.
    pub points: Vec<ReferencePoint>,
    /// The surfaces that they stand for.
    pub surfaces: SampledSurfaces,
    /// Samples taken at each point so far.
    pub samples: u32,
    /// Rays shot so far.
    pub rays: u64,
}

/// Sums over the groups of a point; in f64, since squares of thousands of terms are subtracted.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    irradiance: DVec3,
    irradiance_squared: f64,
    radiance_squared: f64,
}

/// A path-traced reference in progress.
pub struct PathTracer {
    scene: Arc<Scene>,
    rays: Arc<RayTree>,
    emitters: Emitters,
    outside: Outside,
    settings: PathSettings,
    points: Vec<ReferencePoint>,
    surfaces: SampledSurfaces,
    sums: Vec<Sums>,
    group_count: u32,
    ray_count: u64,
}

impl PathTracer {
    /// Choose the points. `rays` is the ray tree of the scene.
    pub fn new(scene: Arc<Scene>, rays: Arc<RayTree>, settings: PathSettings) -> Self {
        let (points, surfaces) = sample_points(&scene, &rays, settings.point_count, settings.seed);
        let rays = bending_rays(&scene).map_or(rays, Arc::new);
        let points: Vec<ReferencePoint> = points.into_iter().map(ReferencePoint::from).collect();
        Self {
            emitters: Emitters::new(&scene),
            outside: Outside::new(&scene),
            sums: vec![Sums::default(); points.len()],
            scene,
            rays,
            settings,
            points,
            surfaces,
            group_count: 0,
            ray_count: 0,
        }
    }

    /// One more pass over all points. `false` when `cancel` came true on the way; the pass then leaves no trace.
    pub fn pass(&mut self, cancel: &(dyn Fn() -> bool + Sync)) -> bool {
        let groups = self.settings.samples_per_pass.div_ceil(GROUP).max(2);
        let first = self.group_count;
        let estimator = Estimator {
            scene: &self.scene,
            rays: &self.rays,
            emitters: &self.emitters,
            outside: &self.outside,
        };
        let seed = self.settings.seed;
        let added: Option<Vec<(Sums, u64)>> = (&self.points, &self.sums)
            .into_par_iter()
            .enumerate()
            .map(|(index, (point, &sums))| {
                (!cancel()).then(|| {
                    add_groups(
                        &estimator,
                        point,
                        sums,
                        seed,
                        (index, first..first + groups),
                    )
                })
            })
            .collect();
        let Some(added) = added else {
            return false;
        };
        self.ray_count += added.iter().map(|(_, rays)| rays).sum::<u64>();
        self.sums = added.into_iter().map(|(sums, _)| sums).collect();
        self.group_count += groups;
        true
    }

    /// The points with what is known of them so far.
    pub fn result(&self) -> PathTraced {
        let mut points = self.points.clone();
        if self.group_count > 0 {
            for (point, sums) in points.iter_mut().zip(&self.sums) {
                sums.write(self.group_count, point);
            }
        }
        PathTraced {
            points,
            surfaces: self.surfaces,
            samples: self.group_count * GROUP,
            rays: self.ray_count,
        }
    }
}

impl Sums {
    /// Add the value of a group.
    fn add(&mut self, irradiance: Vec3, reflectance: Vec3) {
        self.irradiance += irradiance.as_dvec3();
        let [received, reflected] = [irradiance, irradiance * reflectance].map(luminance);
        self.irradiance_squared += f64::from(received).powi(2);
        self.radiance_squared += f64::from(reflected).powi(2);
    }

    /// Means and standard errors of `count` groups (at least 2).
    fn write(&self, count: u32, point: &mut ReferencePoint) {
        let count = f64::from(count);
        let mean = (self.irradiance / count).as_vec3();
        let error_of = |squares: f64, mean: f32| {
            let variance = (squares / count - f64::from(mean).powi(2)).max(0.0) / (count - 1.0);
            variance.sqrt() as f32
        };
        point.irradiance = mean;
        point.irradiance_error = error_of(self.irradiance_squared, luminance(mean));
        point.standard_error = error_of(self.radiance_squared, luminance(mean * point.reflectance))
            * std::f32::consts::FRAC_1_PI;
    }
}

/// Add groups of samples to the sums of the point with this index; also the rays that it took.
fn add_groups(
    estimator: &Estimator<'_>,
    point: &ReferencePoint,
    mut sums: Sums,
    seed: u64,
    (index, groups): (usize, std::ops::Range<u32>),
) -> (Sums, u64) {
    let start = Place {
        position: point.position,
        normal: point.normal,
        triangle: point.triangle,
    };
    let mut ray_count = 0;
    for group in groups {
        let mut random = Random::new(seed, (index as u64) << 32 | u64::from(group));
        let (irradiance, rays) = estimate_group(estimator, start, &mut random);
        sums.add(irradiance, point.reflectance);
        ray_count += rays;
    }
    (sums, ray_count)
}

/// Mean of a group of samples whose first bounces are spread evenly, and the rays that it took.
fn estimate_group(estimator: &Estimator<'_>, start: Place, random: &mut Random) -> (Vec3, u64) {
    if estimator.is_dark() {
        return (Vec3::ZERO, 0);
    }
    let (direction_shift, emitter_shift) = (random.uniform_2d(), random.uniform_2d());
    let choice_shift = f64::from(random.next_u32()) / 4_294_967_296.0;
    let outside_shift = estimator.outside.squares(|| random.uniform_2d());
    let (mut sum, mut ray_count) = (Vec3::ZERO, 0);
    for sample in 0..GROUP {
        let first = Bounce {
            direction: low_discrepancy_2d(sample, direction_shift),
            choice: (f64::from(sample) + choice_shift) / f64::from(GROUP),
            emitter: low_discrepancy_2d(sample, emitter_shift),
            outside: outside_shift.moved(sample),
        };
        let (irradiance, rays) = estimator.irradiance(start, first, random);
        sum += irradiance;
        ray_count += u64::from(rays);
    }
    (sum / GROUP as f32, ray_count)
}
