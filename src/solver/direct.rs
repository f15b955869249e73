//! Direct light: irradiance from the emitters at points, by exact form factors and shadow rays.
//!
//! Unoccluded, each emitting patch gives its exact irradiance. Shadow rays only tell which part of it arrives: they are
//! spread over the patches in proportion to that irradiance, stratified, and weighed by the transfer that each stands
//! for. Where the first few agree there is no penumbra, and they are enough.

use std::f32::consts::PI;

use glam::{Vec3, Vec3A};
use rayon::prelude::*;

use crate::{
    geometry::{Random, RayTree, low_discrepancy_2d, point_irradiance, triangle_point},
    hierarchy::{Hierarchy, Patch},
    scene::{Scene, TriangleId},
    transport::luminance,
};

/// More emitting patches than this are linked instead: each point would have to look at all of them.
const MOST_SAMPLED: usize = 512;

/// Share of the shadow rays that is shot first. If they agree, the rest is saved.
const PROBING_SHARE: f32 = 0.25;

/// An emitting patch.
#[derive(Clone, Copy, Debug)]
struct Emitter {
    corners: [Vec3; 3],
    normal: Vec3,
    area: f32,
    triangle: TriangleId,
    radiosity: Vec3A,
}

/// Where direct light is wanted.
#[derive(Clone, Copy, Debug)]
pub(super) struct Receiver {
    /// A point of a surface.
    pub point: Vec3,
    /// Unit normal there.
    pub normal: Vec3,
    /// The triangle that the point lies on.
    pub triangle: TriangleId,
}

/// Direct irradiance at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct DirectLight {
    /// Irradiance.
    pub irradiance: Vec3A,
    /// Rays shot.
    pub ray_count: u32,
    /// Standard error of the luminance.
    pub error: f32,
}

/// The emitters that are sampled.
pub(super) struct Lights {
    emitters: Vec<Emitter>,
}

impl Lights {
    /// All emitting patches of a hierarchy.
    pub(super) fn new(scene: &Scene, hierarchy: &Hierarchy) -> Self {
        let emits = |patch: &&Patch| patch.emission != Vec3::ZERO;
        let emitters = hierarchy.patches.iter().filter(emits).map(|patch| {
            let [a, b, c] = scene.corners(patch.triangle);
            Emitter {
                corners: if patch.is_back { [a, c, b] } else { [a, b, c] },
                normal: patch.normal,
                area: patch.area,
                triangle: patch.triangle,
                radiosity: Vec3A::from(patch.emission * PI),
            }
        });
        Self {
            emitters: emitters.collect(),
        }
    }

    /// Whether few enough patches emit for sampling them at every vertex.
    pub(super) fn are_few(&self) -> bool {
        self.emitters.len() <= MOST_SAMPLED
    }

    /// Direct light at many points; `first` numbers their random streams.
    pub(super) fn at_all(
        &self,
        rays: &RayTree,
        receivers: &[Receiver],
        count: u32,
        seed: u64,
    ) -> Vec<DirectLight> {
        receivers
            .par_iter()
            .with_min_len(16)
            .map_init(Vec::new, |sums, receiver| {
                // The stream belongs to the place, so that the order of points does not matter.
                let [x, y, z] = receiver.point.to_array().map(|x| u64::from(x.to_bits()));
                let stream = x ^ (y << 21) ^ (z << 42) ^ (z >> 22);
                self.at(rays, receiver, count, &mut Random::new(seed, stream), sums)
            })
            .collect()
    }

    /// Direct light at one point. `sums` is scratch space.
    fn at(
        &self,
        rays: &RayTree,
        receiver: &Receiver,
        count: u32,
        random: &mut Random,
        sums: &mut Vec<f32>,
    ) -> DirectLight {
        let mut exact = Vec3A::ZERO;
        let mut total = 0.0;
        sums.clear();
        for emitter in &self.emitters {
            let arrives = if emitter.triangle == receiver.triangle {
                Vec3A::ZERO
            } else {
                emitter.radiosity
                    * point_irradiance(receiver.point, receiver.normal, emitter.corners)
            };
            exact += arrives;
            total += luminance(arrives);
            sums.push(total);
        }
        if total <= 0.0 {
            return DirectLight::default();
        }
        let mut tally = Tally::default();
        let shift = random.uniform_2d();
        let probing = ((count as f32 * PROBING_SHARE).ceil() as u32)
            .clamp(1, count)
            .max(4.min(count));
        self.shoot(
            rays,
            receiver,
            sums,
            probing,
            shift,
            random.uniform(),
            0,
            &mut tally,
        );
        if tally.is_split() && count > probing {
            self.shoot(
                rays,
                receiver,
                sums,
                count - probing,
                shift,
                random.uniform(),
                probing,
                &mut tally,
            );
        }
        let fraction = tally.fraction();
        DirectLight {
            irradiance: exact * fraction,
            ray_count: tally.shot,
            error: luminance(exact) * tally.deviation(),
        }
    }

    /// Shoot rays spread over the emitters; `sums` are the running sums of their irradiance.
    #[expect(
        clippy::too_many_arguments,
        reason = "one stratified set of rays; every value differs between the two calls"
    )]
    fn shoot(
        &self,
        rays: &RayTree,
        receiver: &Receiver,
        sums: &[f32],
        count: u32,
        shift: glam::Vec2,
        offset: f32,
        first: u32,
        tally: &mut Tally,
    ) {
        let total = sums[sums.len() - 1];
        for index in 0..count {
            let target = (index as f32 + offset) / count as f32 * total;
            let chosen = sums
                .partition_point(|&sum| sum <= target)
                .min(sums.len() - 1);
            let emitter = &self.emitters[chosen];
            let share = sums[chosen] - if chosen > 0 { sums[chosen - 1] } else { 0.0 };
            let at = triangle_point(low_discrepancy_2d(first + index, shift));
            let [a, b, c] = emitter.corners;
            let point = a * at.x + b * at.y + c * at.z;
            let separation = point - receiver.point;
            let squared = separation.length_squared();
            let cosines = separation.dot(receiver.normal).max(0.0)
                * (-separation.dot(emitter.normal)).max(0.0);
            let transfer =
                luminance(emitter.radiosity) * emitter.area * cosines / (PI * squared * squared);
            // The share is the mean of the transfer over the patch: about 1 where the patch is small.
            let weight = transfer / share;
            if !(weight.is_finite() && weight > 0.0) {
                continue;
            }
            let ends = [Some(receiver.triangle), Some(emitter.triangle)];
            let is_visible = !rays.occluded(receiver.point, point, ends);
            tally.count(
                weight,
                emitter.radiosity / luminance(emitter.radiosity),
                is_visible,
            );
        }
    }
}

/// Weights of shadow rays by outcome.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    sent: Vec3A,
    arrived: Vec3A,
    weight: f32,
    visible_weight: f32,
    shot: u32,
    visible: u32,
}

impl Tally {
    fn count(&mut self, weight: f32, color: Vec3A, is_visible: bool) {
        self.sent += color * weight;
        self.weight += weight;
        self.shot += 1;
        if is_visible {
            self.arrived += color * weight;
            self.visible_weight += weight;
            self.visible += 1;
        }
    }

    /// Whether some rays got through and some did not.
    fn is_split(&self) -> bool {
        self.visible > 0 && self.visible < self.shot
    }

    /// Unoccluded fraction per channel.
    fn fraction(&self) -> Vec3A {
        let ratio = |arrived: f32, sent: f32| {
            if sent > 0.0 {
                (arrived / sent).clamp(0.0, 1.0)
            } else {
                0.0
            }
        };
        Vec3A::new(
            ratio(self.arrived.x, self.sent.x),
            ratio(self.arrived.y, self.sent.y),
            ratio(self.arrived.z, self.sent.z),
        )
    }

    /// Standard deviation of the fraction, as if the rays were independent: stratification makes it smaller.
    fn deviation(&self) -> f32 {
        if self.shot == 0 || self.weight <= 0.0 {
            return 0.0;
        }
        let fraction = (self.visible_weight / self.weight).clamp(0.0, 1.0);
        (fraction * (1.0 - fraction) / self.shot as f32).sqrt()
    }
}
