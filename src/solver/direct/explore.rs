//! Learning where the sky is seen from places that see little of it.

use rayon::prelude::*;

use super::{
    lights::{Guidance, Lights, Source},
    openings::{SkyHit, openings},
    samples::DirectLight,
    shooting::{Shot, shuffle_at},
    sky::SkyTree,
    sky_guide::{Explored, SkyGuide},
};
use crate::{
    geometry::RayTree,
    solver::{Cancel, places::Receiver},
    transport::luminance,
};

/// Most rounds. Fewer, and the guide is coarse where it began with a few hits; more take time.
const MOST_ROUNDS: u64 = 4;

/// Most rays of a round, and most from a point. Fewer, and small openings are not found; more take time.
const MOST_RAYS: usize = 1 << 16;
const MOST_RAYS_FROM_POINT: u32 = 64;

/// Hits of a round from which the guide is not learnt anew. Fewer, and cells are few; more take time, and places found by
/// guided rays have uneven weights.
const ENOUGH_HITS: usize = 512;

/// Fewest rays from a point. Fewer, and a point tells little about its light; more leave points out.
const LEAST_RAYS: u32 = 8;

/// Change of the seed from round to round.
const SEED_STEP: u64 = 0x9e37_79b9_7f4a_7c15;

impl Lights {
    /// Whether places that see little of this light may be guided, but none was explored.
    pub(super) fn is_unexplored(&self) -> bool {
        matches!(self.source, Source::Sky(_, Guidance::Unknown))
    }

    /// Whether rays from places are guided.
    pub(super) fn is_guided(&self, receiver: &Receiver) -> bool {
        match &self.source {
            Source::Sky(_, Guidance::Known(guide)) => guide.guides(receiver.point),
            _ => false,
        }
    }

    /// Learn where the sky is seen from places that see little of it. Returns the rays shot; `None` when cancelled.
    pub(super) fn explore(
        &mut self,
        rays: &RayTree,
        receivers: &[Receiver],
        seed: u64,
        cancel: &Cancel,
    ) -> Option<u64> {
        let (mut shot, mut hits_so_far) = (0, 0);
        for round in 1..=MOST_ROUNDS {
            let seed = seed.wrapping_add(round.wrapping_mul(SEED_STEP));
            let Source::Sky(sky, guidance) = &self.source else {
                break;
            };
            let (points, hits, tried) = self.explored(sky, rays, receivers, seed, cancel);
            cancel.proceed()?;
            shot += tried;
            // The last round tells where the guide pays.
            let is_last = hits_so_far >= ENOUGH_HITS || round == MOST_ROUNDS;
            let guide = match guidance {
                Guidance::Known(guide) if is_last => guide.clone().proven(&points),
                _ => SkyGuide::new(with_openings(points, &hits)),
            };
            hits_so_far = hits.len();
            let is_known = guide.is_some();
            if let Source::Sky(_, guidance) = &mut self.source {
                *guidance = guide.map_or(Guidance::None, Guidance::Known);
            }
            if is_last || !is_known {
                break;
            }
        }
        Some(shot)
    }

    /// Rays from some of the receivers: these with the moments of their light, the rays that reached the sky with the index
    /// of their point, and the number of rays tried.
    fn explored(
        &self,
        sky: &SkyTree,
        rays: &RayTree,
        receivers: &[Receiver],
        seed: u64,
        cancel: &Cancel,
    ) -> (Vec<Explored>, Vec<(usize, SkyHit)>, u64) {
        let step = receivers.len().div_ceil(MOST_RAYS / LEAST_RAYS as usize);
        let points: Vec<&Receiver> = receivers.iter().step_by(step.max(1)).collect();
        let count = (MOST_RAYS / points.len().max(1)) as u32;
        let count = count.min(MOST_RAYS_FROM_POINT);
        let explore = |shot: &mut Shot, receiver: &Receiver| {
            let mut light = DirectLight::default();
            if !cancel.is_cancelled() {
                light.exact = self.unoccluded(receiver, None, &mut shot.cut);
                let shuffle = shuffle_at(receiver.point, seed);
                self.shoot_at(rays, receiver, 0..count, shuffle, shot, &mut light);
            }
            let whole = luminance(light.exact);
            let hits = shot.seen.iter().map(|(ray, weight)| SkyHit {
                from: receiver.point,
                direction: ray.direction,
                visible: weight * whole / sky.least_irradiance(ray.leaf, receiver.normal),
            });
            let hits: Vec<SkyHit> = hits.collect();
            let moment = |power: i32| {
                let weights = shot.seen.iter().map(|(_, weight)| weight.powi(power));
                weights.sum::<f32>() / count as f32
            };
            (moment(1), moment(2), hits)
        };
        let found: Vec<(f32, f32, Vec<SkyHit>)> = points
            .par_iter()
            .with_min_len(16)
            .map_init(Shot::default, |shot, receiver| explore(shot, receiver))
            .collect();
        let tried = found.len() as u64 * u64::from(count);
        let (mut explored, mut all) = (Vec::new(), Vec::new());
        for (index, (receiver, (fraction, square, hits))) in
            points.into_iter().zip(found).enumerate()
        {
            explored.push(Explored {
                point: receiver.point,
                openings: Vec::new(),
                fraction,
                square,
            });
            all.extend(hits.into_iter().map(|hit| (index, hit)));
        }
        (explored, all, tried)
    }
}

/// The points with the openings that their rays found.
fn with_openings(mut points: Vec<Explored>, hits: &[(usize, SkyHit)]) -> Vec<Explored> {
    let rays: Vec<SkyHit> = hits.iter().map(|&(_, hit)| hit).collect();
    for (ray, opening) in openings(&rays) {
        points[hits[ray].0].openings.push(opening);
    }
    points
}
