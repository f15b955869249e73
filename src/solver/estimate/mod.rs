//! The error of the light shown, estimated without a reference: the residual of the radiosity equation.
//!
//! At random points x of the reflecting surfaces the irradiance is gathered once more by rays, directly from emitters and
//! sky, and over the hemisphere from the light shown, E′ = D + T b. The light shown is b, the truth b*, its error
//! e = b − b*. From b* = D + T b* follows e = s + T e with the residual s = b − E′. So the residual alone is not the
//! error: light that is wrong everywhere by a little has a small residual. The residual is measured also where rays from the
//! points arrive, and the rays from there know which places send light to which: so the equation is solved for the mean
//! errors of groups of such places (`groups`), and e follows at each point.
//!
//! Two independent sets of rays give two estimates e₁ and e₂ with independent noise, and e₁e₂ is e² in expectation for any
//! number of rays (`statistics`). The hits are kept, so that later steps only look up their light again and add rays where
//! their errors are smaller.

mod groups;
mod samples;
mod statistics;

use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;

use self::{
    groups::{Groups, Residual},
    samples::{Place, Samples, Scenery},
    statistics::Reflected,
};
use super::{
    Cancel, Direct, EstimatedError, SolveSettings,
    direct::{DirectFields, Surfaces},
};
use crate::{
    geometry::{Random, RayTree},
    hierarchy::Hierarchy,
    sampling::sample_points,
    scene::Scene,
};

/// How many points, and how many rays over the hemisphere from each in each of the two sets, from few to many. With few
/// points the interval is wide because errors differ from place to place; with few rays it is wide by their noise, which
/// counts squared. So rays come first, but for points enough to meet every surface.
const LEVELS: [(usize, u32); 9] = [
    (64, 32),
    (128, 32),
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

/// Added to the seed, so that neither these points nor their rays are those of the solve or of a reference.
const SEEDS: [u64; 3] = [
    0x51f1_5eed_0000_0001,
    0x51f1_5eed_0000_0002,
    0x51f1_5eed_0000_0003,
];

/// What an estimate is made from.
#[derive(Clone, Copy)]
pub(super) struct Shown<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Settings of the solve.
    pub settings: &'a SolveSettings,
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

/// Points and rays of the estimates of a solve, kept from step to step.
pub(super) struct ErrorEstimator {
    /// The points, in the order of their patches.
    places: Vec<Option<Place>>,
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
        let (points, _) = sample_points(scene, &rays, STORED_POINTS, seed ^ SEEDS[0]);
        let mut places: Vec<Option<Place>> = points
            .iter()
            .map(|point| Place::of(hierarchy, point))
            .collect();
        // Neighbours lie beside each other.
        places.sort_by_key(|place| place.map_or(u32::MAX, |place| place.patch));
        let half = |own: u64| Half {
            from_points: Samples::new(places.len(), seed ^ own),
            from_seen: Samples::new(places.len(), (seed ^ own).wrapping_add(1)),
        };
        Self {
            halves: [SEEDS[1], SEEDS[2]].map(half),
            places,
            rays,
            seed: seed ^ SEEDS[0],
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
    pub(super) fn estimate(&mut self, shown: Shown<'_>) -> Option<EstimatedError> {
        let mut share = RAY_SHARE;
        loop {
            let estimated = self.estimate_by(shown, share)?;
            let is_open = shown.settings.error.is_some_and(|wanted| {
                let within = estimated.trimmed_low..estimated.trimmed_high;
                within.contains(&f64::from(wanted))
            });
            if !is_open || share >= MOST_RAY_SHARE || self.level + 1 == LEVELS.len() {
                return Some(estimated);
            }
            share *= 2.0;
        }
    }

    /// The error, by at most this share of the rays of the solve.
    fn estimate_by(&mut self, shown: Shown<'_>, share: f64) -> Option<EstimatedError> {
        let Surfaces { hierarchy, direct } = shown.surfaces;
        // All direct light is sampled here, also that which the solve links.
        let own = (shown.settings.direct == Direct::Linked).then(|| {
            let settings = SolveSettings {
                direct: Direct::Sampled,
                ..shown.settings.clone()
            };
            DirectFields::new(shown.scene, hierarchy, &settings, shown.sees_outside)
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
        let places: Vec<Option<Place>> = chosen.iter().map(|&point| self.places[point]).collect();
        let mut errors = Vec::with_capacity(self.halves.len());
        for half in &mut self.halves {
            let (found, shot) = half.errors(scene, &places, &chosen, count)?;
            errors.push(found);
            self.ray_count += shot;
        }
        let stored = |place: Option<Place>| {
            place.and_then(|place| scene.stored(place.patch, place.receiver.point))
        };
        let reflected = |(point, place): (usize, &Option<Place>)| {
            let errors = [0, 1].map(|half| errors[half][point]);
            stored(*place).map_or_else(Reflected::default, |stored| Reflected::new(&stored, errors))
        };
        let reflected: Vec<Reflected> = places.iter().enumerate().map(reflected).collect();
        let all = self.places.par_iter();
        let all: Vec<f64> = all
            .map(|place| stored(*place).map_or(0.0, |stored| statistics::stored_light(&stored)))
            .collect();
        Some(EstimatedError {
            points: chosen.len() as u64,
            rays: self.ray_count,
            ..statistics::estimated(&reflected, &all)
        })
    }

    /// The points of the present level: one by chance of as many neighbours as there are times more points. Those of a
    /// level are among those of the next.
    fn chosen(&self) -> Vec<usize> {
        let step = (STORED_POINTS as usize).div_ceil(LEVELS[self.level].0);
        let chance = |point: &usize| Random::new(self.seed, *point as u64).next_u32();
        (0..self.places.len())
            .step_by(step)
            .filter_map(|first| {
                let end = (first + step).min(self.places.len());
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

    /// Memory in bytes.
    pub(super) fn memory_bytes(&self) -> usize {
        let of = |half: &Half| half.from_points.memory_bytes() + half.from_seen.memory_bytes();
        self.halves.iter().map(of).sum()
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
    ) -> Option<(Vec<Vec3>, u64)> {
        let mut shot = self.from_points.shoot(scene, places, chosen, count)?;
        // What the points see, in the order of the patches.
        let first_seen = |&point: &usize| self.from_points.first_met(scene.hierarchy, point);
        let seen = chosen.iter().map(|point| (*point, first_seen(point)));
        let mut seen: Vec<(usize, Option<Place>)> = seen.collect();
        seen.retain(|(_, place)| place.is_some());
        seen.sort_by_key(|(_, place)| place.map(|place| place.patch));
        let (indices, seen): (Vec<usize>, Vec<Option<Place>>) = seen.into_iter().unzip();
        shot += self
            .from_seen
            .shoot(scene, &seen, &indices, rays_from_seen(count))?;
        // Errors of groups of it, and of the points.
        let groups = Groups::new(seen.iter().flatten().map(|place| place.patch));
        let of_seen = self.from_seen.residuals(scene, &seen, &indices, &groups);
        let errors = groups.errors(&of_seen);
        let of_points = self.from_points.residuals(scene, places, chosen, &groups);
        let at_point = |residual: &Residual| residual.explained_by(&errors);
        Some((of_points.iter().map(at_point).collect(), shot))
    }
}

#[cfg(test)]
mod tests;
