//! The error of the light shown, estimated without a reference: the residual of the radiosity equation.
//!
//! At random points x of the reflecting surfaces the irradiance is gathered once more by rays, directly from emitters and
//! sky, and over the hemisphere from the light shown, E′ = D + T b. The light shown is b, the truth b*, its error
//! e = b − b*. From b* = D + T b* follows e = s + T e with the residual s = b − E′. So the residual alone is not the
//! error: light that is wrong everywhere by a little has a small residual. The rays that measured the residual know which
//! surfaces send light to which, so the equation is solved for the mean errors of groups of neighbouring points (`groups`), and
//! e follows at each point.
//!
//! Two independent sets of rays give two estimates e₁ and e₂ with independent noise, and e₁e₂ is e² in expectation for any
//! number of rays (`statistics`). The hits are kept, so that later steps only look up their light again and add rays where
//! their errors are smaller.

mod groups;
mod samples;
mod statistics;

use std::sync::Arc;

use glam::Vec3;

use self::{
    groups::{Gather, Groups},
    samples::Samples,
    statistics::Reflected,
};
use super::{
    Cancel, Direct, EstimatedError, SolveSettings,
    direct::{DirectFields, Surfaces},
    places::Receiver,
};
use crate::{
    geometry::{Random, RayTree},
    hierarchy::Hierarchy,
    sampling::{SurfacePoint, sample_points},
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
    (MOST_POINTS, 512),
];

/// Points in the finest level.
const MOST_POINTS: usize = 1024;

/// Rays of the estimate by the rays of the solve. More takes longer; fewer makes the interval wide.
const RAY_SHARE: f64 = 0.05;

/// Most of them where the interval holds the error that is asked for. More takes longer than a further step would; fewer
/// takes that step though the error is reached.
const MOST_RAY_SHARE: f64 = 0.4;

/// The error of a step relative to that of the second before, below which steps still help. Smaller, and slow progress is
/// given up; larger, and noise is taken for progress.
const ADVANCE: f64 = 0.9;

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
    points: Vec<Receiver>,
    /// The patch that each point lies on; `None` where it is omitted.
    patches: Vec<Option<u32>>,
    rays: Arc<RayTree>,
    seed: u64,
    /// Index in [`LEVELS`].
    level: usize,
    /// Two independent sets of rays.
    halves: [Samples; 2],
    ray_count: u64,
    /// Trimmed errors of steps beyond the settings.
    errors: Vec<f64>,
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
        let (points, _) = sample_points(scene, &rays, MOST_POINTS as u32, seed ^ SEEDS[0]);
        let mut placed: Vec<(Option<u32>, Receiver)> = points
            .iter()
            .map(|point| (patch_of(hierarchy, point), receiver(point)))
            .collect();
        // In the order of the patches, neighbours lie beside each other.
        placed.sort_by_key(|(patch, _)| patch.unwrap_or(u32::MAX));
        let (patches, points): (Vec<Option<u32>>, Vec<Receiver>) = placed.into_iter().unzip();
        let halves = [SEEDS[1], SEEDS[2]].map(|own| Samples::new(points.len(), seed ^ own));
        Self {
            points,
            patches,
            rays,
            seed: seed ^ SEEDS[0],
            level: 0,
            halves,
            ray_count: 0,
            errors: Vec::new(),
        }
    }

    /// Forget direct light, when emitters have changed.
    pub(super) fn forget_direct_light(&mut self) {
        for half in &mut self.halves {
            half.forget_direct_light();
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
        let direct = own.as_ref().unwrap_or(direct);
        // As many points and rays as the solve pays for.
        let affordable = (shown.solve_rays as f64 * share) as u64;
        self.level = self.affordable_level(direct, affordable);
        let (_, count) = LEVELS[self.level];
        let chosen = self.chosen();
        for half in &mut self.halves {
            let meet = samples::Meet {
                hierarchy,
                rays: &self.rays,
                points: &self.points,
                cancel: shown.cancel,
            };
            self.ray_count += half.shoot(meet, &chosen, direct, count)?;
        }
        // Residuals, and the errors that explain them.
        let light = samples::Light {
            hierarchy,
            irradiance: shown.irradiance,
        };
        let stored = |&point: &usize| {
            let patch = self.patches[point]?;
            light.at(patch, self.points[point].point)
        };
        let stored: Vec<_> = chosen.iter().map(stored).collect();
        let patches: Vec<_> = chosen.iter().map(|&point| self.patches[point]).collect();
        let groups = Groups::new(&patches);
        let [first, second] = [0, 1].map(|half| {
            let gathers = self.halves[half].gathers(light, &chosen, &groups);
            let residual = |(index, gather): (usize, &Gather)| match stored[index] {
                Some(stored) => {
                    let direct = self.halves[half].direct(direct, chosen[index]);
                    stored.irradiance - gather.irradiance - direct
                }
                None => Vec3::ZERO,
            };
            let residuals: Vec<Vec3> = gathers.iter().enumerate().map(residual).collect();
            groups.errors(&gathers, &residuals)
        });
        let errors = first.into_iter().zip(second);
        let reflected: Vec<Reflected> = stored
            .iter()
            .zip(errors)
            .map(|(stored, (first, second))| match stored {
                Some(stored) => Reflected::new(stored, [first, second]),
                None => Reflected::default(),
            })
            .collect();
        Some(EstimatedError {
            points: chosen.len() as u64,
            rays: self.ray_count,
            ..statistics::estimated(&reflected)
        })
    }

    /// The points of the present level: one by chance of as many neighbours as there are times more points. Those of a
    /// level are among those of the next.
    fn chosen(&self) -> Vec<usize> {
        let step = MOST_POINTS / LEVELS[self.level].0;
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
        let cost = |&(points, count): &(usize, u32)| {
            let each = count + samples::shadow_rays(count) * direct.count() as u32;
            (points * self.halves.len()) as u64 * u64::from(each)
        };
        let within = LEVELS.iter().rposition(|level| cost(level) <= affordable);
        within.unwrap_or(0).max(self.level)
    }

    /// Memory in bytes.
    pub(super) fn memory_bytes(&self) -> usize {
        self.halves.iter().map(Samples::memory_bytes).sum()
    }
}

/// The patch under a point; `None` where it takes no part in the solve.
fn patch_of(hierarchy: &Hierarchy, point: &SurfacePoint) -> Option<u32> {
    let patch = hierarchy.side_met(point.triangle, -point.normal)?;
    hierarchy
        .active_patches()
        .contains(&patch)
        .then_some(patch as u32)
}

fn receiver(point: &SurfacePoint) -> Receiver {
    Receiver {
        point: point.position,
        normal: point.normal,
        triangle: point.triangle,
    }
}
