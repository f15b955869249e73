//! The error of the light shown, estimated without a reference: the residual of the radiosity equation.
//!
//! At random points x of the reflecting surfaces the irradiance is gathered once more by rays, directly from emitters and
//! sky, and over the hemisphere from the light shown, E′ = D + T b. The light shown is b, the truth b*, its error
//! e = b − b*. From b* = D + T b* follows e = s + T e with the residual s = b − E′. So the residual alone is not the
//! error: light that is wrong everywhere by a little has a small residual. The residual is measured also where rays from the
//! points arrive, and all these rays know which places send light to which: so the equation is solved for the mean errors of
//! groups of such places and of the points (`groups`), and e follows at each point.
//!
//! Two independent sets of rays give two estimates e₁ and e₂ with independent noise, and e₁e₂ is e² in expectation for any
//! number of rays (`statistics`). The noise of a group's error is in all points that see it, so intervals count the
//! influence of each place on the whole, and not only how much points differ. The hits are kept, so that later steps only
//! look up their light again and add rays where their errors are smaller.

mod groups;
mod samples;
mod statistics;

use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;

use self::{
    groups::{Groups, Residual, Solution},
    samples::{Appearances, Place, Point, Samples, Scenery},
    statistics::{Influences, Reflected},
};
use super::{
    Cancel, Direct, ErrorPoint, EstimatedError, SolveSettings,
    direct::{DirectFields, Surfaces},
};
use crate::{
    geometry::{Random, RayTree},
    hierarchy::{Hierarchy, luminance},
    sampling::sample_points,
    scene::{Appearance, Scene},
};

/// How many points, and how many rays over the hemisphere from each in each of the two sets, from few to many. With few
/// points the interval is wide because errors differ from place to place, and misses what they do not meet; with few rays it
/// is wide by their noise, which counts squared. Errors of coarse steps are larger than noise, so that points come first;
/// from there on rays.
const LEVELS: [(usize, u32); 8] = [
    (256, 16),
    (256, 32),
    (256, 64),
    (256, 128),
    (256, 256),
    (512, 256),
    (512, 512),
    (1024, 512),
];

/// Points at which only stored light is looked up, among them those with rays: a few bright places beside lamps hold much
/// of its mean square, and no interval tells that they were missed. Fewer miss them; more take longer.
const STORED_POINTS: u32 = 8192;

/// Rays of the estimate by the rays of the solve. More takes longer; fewer makes the interval wide.
const RAY_SHARE: f64 = 0.05;

/// Most of them where the interval holds the error that is asked for. More takes longer than a further step would; fewer
/// takes that step though the error is reached.
const MOST_RAY_SHARE: f64 = 0.4;

/// The error of a step relative to that of the second before, below which steps still help. Smaller, and slow progress is
/// given up; larger, and noise is taken for progress.
const ADVANCE: f64 = 0.9;

/// Rays of a point for each ray from a place that it sees. Smaller takes longer; larger makes the errors of groups noisy.
const SEEN_DIVISOR: u32 = 4;

/// Combined with the seed for the points, so that they are not those of a reference.
const POINT_SEED: u64 = 0x9d39_247e_3377_6d41;

/// Likewise for the rays of each half: from its points, and from what they see. Random numbers, so that no set of rays is
/// that of another, of the solve or of a reference, whatever the seed: two sets with the same rays have the same noise, and
/// the product of their errors is too large.
const RAY_SEEDS: [[u64; 2]; 2] = [
    [0x2af7_3980_05aa_a5c7, 0x44db_0150_2462_3547],
    [0x9c15_f73e_62a7_6ae2, 0x7583_4465_489c_0c89],
];

/// What an estimate is made from.
#[derive(Clone, Copy)]
pub(super) struct Shown<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Settings of the solve.
    pub settings: &'a SolveSettings,
    /// Present appearance by material.
    pub appearances: &'a [Appearance],
    /// The elements, with their direct light.
    pub surfaces: Surfaces<'a>,
    /// Whether light from outside arrives.
    pub sees_outside: bool,
    /// Irradiance shown at each vertex of the mesh, W/m².
    pub irradiance: &'a [Vec3],
    /// Rays of the solve so far.
    pub solve_rays: u64,
    /// The request to stop.
    pub cancel: &'a Cancel,
}

/// An estimate.
pub(super) struct Estimate {
    /// Its figures.
    pub figures: EstimatedError,
    /// The error at each point that takes part in the solve.
    pub points: Vec<ErrorPoint>,
}

/// Points and rays of the estimates of a solve, kept from step to step.
pub(super) struct ErrorEstimator {
    /// The points, in the order of their patches.
    points: Vec<Option<Point>>,
    /// Appearances of the scene, by material.
    of_scene: Vec<Appearance>,
    rays: Arc<RayTree>,
    seed: u64,
    /// Index in [`LEVELS`].
    level: usize,
    /// Two independent sets of rays.
    halves: [Half; 2],
    ray_count: u64,
    /// Trimmed errors of steps beyond the settings.
    errors: Vec<f64>,
}

/// One set of rays.
struct Half {
    /// From the points.
    from_points: Samples,
    /// From what a ray of each point met: these places are distributed as those whose errors reach the points.
    from_seen: Samples,
}

impl ErrorEstimator {
    /// Choose the points.
    pub(super) fn new(
        scene: &Scene,
        hierarchy: &Hierarchy,
        rays: &Arc<RayTree>,
        seed: u64,
    ) -> Self {
        let rays = match rays.is_clear() {
            true => Arc::new(RayTree::new(scene)),
            false => rays.clone(),
        };
        let (points, _) = sample_points(scene, &rays, STORED_POINTS, seed ^ POINT_SEED);
        let mut points: Vec<Option<Point>> = points
            .iter()
            .map(|point| Point::of(scene, hierarchy, point))
            .collect();
        // Neighbours lie beside each other.
        points.sort_by_key(|point| point.map_or(u32::MAX, |point| point.place.patch));
        let half = |own: [u64; 2]| {
            let [from_points, from_seen] = own.map(|own| Samples::new(points.len(), seed ^ own));
            Half {
                from_points,
                from_seen,
            }
        };
        Self {
            halves: RAY_SEEDS.map(half),
            points,
            of_scene: scene.appearances(),
            rays,
            seed: seed ^ POINT_SEED,
            level: 0,
            ray_count: 0,
            errors: Vec::new(),
        }
    }

    /// Forget direct light, when emitters have changed.
    pub(super) fn forget_direct_light(&mut self) {
        for half in &mut self.halves {
            half.from_points.forget_direct_light();
            half.from_seen.forget_direct_light();
        }
    }

    /// Count a step beyond the settings. Returns whether the error has become smaller within the last two of them.
    pub(super) fn advances(&mut self, estimated: EstimatedError) -> bool {
        self.errors.push(estimated.trimmed_rms);
        let count = self.errors.len();
        count < 3 || estimated.trimmed_rms < ADVANCE * self.errors[count - 3]
    }

    /// The error of the light shown; `None` when cancelled. Where it is not clear whether an error that is asked for is
    /// reached, more rays are shot, as long as these are fewer than those of a further step.
    pub(super) fn estimate(&mut self, shown: Shown<'_>) -> Option<Estimate> {
        let mut share = RAY_SHARE;
        loop {
            let estimate = self.estimate_by(shown, share)?;
            let is_open = shown.settings.error.is_some_and(|wanted| {
                let within = estimate.figures.trimmed_low..estimate.figures.trimmed_high;
                within.contains(&f64::from(wanted))
            });
            if !is_open || share >= MOST_RAY_SHARE || self.level + 1 == LEVELS.len() {
                return Some(estimate);
            }
            share *= 2.0;
        }
    }

    /// The error, by at most this share of the rays of the solve.
    fn estimate_by(&mut self, shown: Shown<'_>, share: f64) -> Option<Estimate> {
        let Surfaces {
            hierarchy, direct, ..
        } = shown.surfaces;
        // All direct light is sampled here, also that which the solve links.
        let own = (shown.settings.direct == Direct::Linked).then(|| {
            let settings = SolveSettings {
                direct: Direct::Sampled,
                ..shown.settings.clone()
            };
            DirectFields::new(
                shown.scene,
                hierarchy,
                &settings,
                shown.sees_outside,
                &self.rays,
            )
        });
        let scene = Scenery {
            hierarchy,
            direct: own.as_ref().unwrap_or(direct),
            rays: &self.rays,
            irradiance: shown.irradiance,
            cancel: shown.cancel,
        };
        // As many points and rays as the solve pays for.
        let affordable = (shown.solve_rays as f64 * share) as u64;
        self.level = self.affordable_level(scene.direct, affordable);
        let (_, count) = LEVELS[self.level];
        let chosen = self.chosen();
        // The errors of the points by each set of rays.
        let points: Vec<Option<Point>> = chosen.iter().map(|&point| self.points[point]).collect();
        let places: Vec<Option<Place>> = points
            .iter()
            .map(|point| point.map(|point| point.place))
            .collect();
        let mut found = Vec::with_capacity(self.halves.len());
        for half in &mut self.halves {
            let (of_half, shot) = half.errors(scene, &places, &chosen, count)?;
            found.push(of_half);
            self.ray_count += shot;
        }
        let appearances = Appearances {
            now: shown.appearances,
            of_scene: &self.of_scene,
        };
        let stored = |point: Option<Point>| point?.stored(scene, appearances);
        let reflected = |(index, point): (usize, &Option<Point>)| {
            let errors = [0, 1].map(|half: usize| found[half].at_point(index));
            let stored = stored(*point).unwrap_or_default();
            Reflected::new(index, &stored, errors)
        };
        let reflected: Vec<Reflected> = points.iter().enumerate().map(reflected).collect();
        let all = self.points.par_iter();
        let all: Vec<f64> = all
            .map(|point| stored(*point).map_or(0.0, |stored| statistics::stored_light(&stored)))
            .collect();
        let scale = statistics::true_rms(&reflected, &all);
        let reflectances = points
            .iter()
            .map(|point| stored(*point).unwrap_or_default());
        let common = Common {
            halves: &found,
            reflectances: reflectances.map(|stored| stored.reflectance).collect(),
        };
        let figures = EstimatedError {
            points: chosen.len() as u64,
            rays: self.ray_count,
            ..statistics::estimated(&reflected, &all, scale, &common)
        };
        let of_place = |(place, reflected): (&Option<Place>, &Reflected)| {
            let receiver = place.as_ref()?.receiver;
            let [light, first, second] = reflected.over(scale);
            Some(ErrorPoint {
                position: receiver.point,
                normal: receiver.normal,
                light,
                errors: [first, second],
            })
        };
        let points = places.iter().zip(&reflected).filter_map(of_place).collect();
        Some(Estimate { figures, points })
    }

    /// The points of the present level: one by chance of as many neighbours as there are times more points. Those of a
    /// level are among those of the next.
    fn chosen(&self) -> Vec<usize> {
        let step = (STORED_POINTS as usize).div_ceil(LEVELS[self.level].0);
        let chance = |point: &usize| Random::new(self.seed, *point as u64).next_u32();
        (0..self.points.len())
            .step_by(step)
            .filter_map(|first| {
                let end = (first + step).min(self.points.len());
                (first..end).min_by_key(chance)
            })
            .collect()
    }

    /// The finest level whose rays are affordable; never one before the present.
    fn affordable_level(&self, direct: &DirectFields, affordable: u64) -> usize {
        let rays = |count: u32| count + samples::shadow_rays(count) * direct.count() as u32;
        let cost = |&(points, count): &(usize, u32)| {
            let each = rays(count) + rays(rays_from_seen(count));
            (points * self.halves.len()) as u64 * u64::from(each)
        };
        let within = LEVELS.iter().rposition(|level| cost(level) <= affordable);
        within.unwrap_or(0).max(self.level)
    }

    /// Memory in bytes, without the ray tree of the solve.
    pub(super) fn memory_bytes(&self, of_solve: &Arc<RayTree>) -> usize {
        let of = |half: &Half| half.from_points.memory_bytes() + half.from_seen.memory_bytes();
        let own_tree = match Arc::ptr_eq(&self.rays, of_solve) {
            true => 0,
            false => self.rays.memory_bytes(),
        };
        own_tree + size_of_val(self.points.as_slice()) + self.halves.iter().map(of).sum::<usize>()
    }
}

/// Rays over the hemisphere from each place that a point sees, for so many from the point. Only means over groups of them
/// count.
fn rays_from_seen(count: u32) -> u32 {
    count / SEEN_DIVISOR
}

impl Half {
    /// The error of the irradiance at some places, W/m² (0 where there is none), and the rays shot; `None` when cancelled.
    fn errors(
        &mut self,
        scene: Scenery<'_>,
        places: &[Option<Place>],
        chosen: &[usize],
        count: u32,
    ) -> Option<(HalfErrors, u64)> {
        let mut shot = self.from_points.shoot(scene, places, chosen, count)?;
        // What the points see.
        let first_seen = |&point: &usize| self.from_points.first_met(scene.hierarchy, point);
        let seen = chosen.iter().map(|point| (*point, first_seen(point)));
        let mut seen: Vec<(usize, Option<Place>)> = seen.collect();
        seen.retain(|(_, place)| place.is_some());
        let (indices, seen): (Vec<usize>, Vec<Option<Place>>) = seen.into_iter().unzip();
        shot += self
            .from_seen
            .shoot(scene, &seen, &indices, rays_from_seen(count))?;
        // Groups of both.
        let both = places.iter().chain(&seen).enumerate();
        let ordered = both.filter_map(|(number, place)| {
            let place = place.as_ref()?;
            Some((scene.order(place.patch, place.receiver.point), number))
        });
        let mut ordered: Vec<(u64, usize)> = ordered.collect();
        ordered.sort_unstable();
        let (orders, order): (Vec<u64>, Vec<usize>) = ordered.into_iter().unzip();
        let groups = Groups::new(&orders);
        let of_points = self.from_points.residuals(scene, places, chosen, &groups);
        let of_seen = self.from_seen.residuals(scene, &seen, &indices, &groups);
        let residual = |&number: &usize| {
            let of_point = of_points.get(number);
            of_point.unwrap_or_else(|| &of_seen[number - of_points.len()])
        };
        let grouped = order.iter().map(residual).cloned().collect();
        let solution = groups.solve(grouped);
        let found = HalfErrors {
            of_points,
            order,
            solution,
        };
        Some((found, shot))
    }
}

/// Errors by one set of rays.
struct HalfErrors {
    /// The residuals at the points.
    of_points: Vec<Residual>,
    /// The places whose groups have errors: points by their number, and from there on what they see.
    order: Vec<usize>,
    solution: Solution,
}

impl HalfErrors {
    /// The error of the irradiance at a point, W/m².
    fn at_point(&self, point: usize) -> Vec3 {
        self.of_points[point].explained_by(self.solution.errors())
    }
}

/// What the errors of points have in common: those of the groups that they see.
struct Common<'a> {
    halves: &'a [HalfErrors],
    /// By point.
    reflectances: Vec<Vec3>,
}

impl Influences for Common<'_> {
    fn of(&self, derivatives: [Vec<f64>; 2]) -> (Vec<f64>, f64) {
        let count = self.reflectances.len();
        let (mut of_points, mut elsewhere) = (vec![0.0; count], 0.0);
        for (half, derivatives) in self.halves.iter().zip(derivatives) {
            let mut of_groups = vec![Vec3::ZERO; half.solution.errors().len()];
            let points = half.of_points.iter().zip(&self.reflectances);
            for ((residual, reflectance), derivative) in points.zip(derivatives) {
                let factor = luminance_weights(*reflectance) * derivative as f32;
                for (sum, row) in of_groups.iter_mut().zip(&residual.row) {
                    *sum += factor * row;
                }
            }
            let influences = half.solution.influences(&of_groups);
            for (&number, influence) in half.order.iter().zip(influences) {
                match of_points.get_mut(number) {
                    Some(sum) => *sum += influence,
                    None => elsewhere += influence * influence,
                }
            }
        }
        (of_points, elsewhere)
    }
}

/// The factors of the channels of an irradiance in the luminance of what is reflected of it.
fn luminance_weights(reflectance: Vec3) -> Vec3 {
    let channels = [Vec3::X, Vec3::Y, Vec3::Z];
    Vec3::from_array(channels.map(|channel| luminance((reflectance * channel).extend(0.0))))
}

#[cfg(test)]
mod tests;
