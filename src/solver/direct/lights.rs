//! Direct light: irradiance from the emitters at points, by exact form factors and shadow rays.
//!
//! Unoccluded, the irradiance of the emitters is exact, or that of many far ones together nearly so (see `light_tree`).
//! Shadow rays only tell which part of it arrives: they are spread over the emitters in proportion to that irradiance,
//! stratified, and weighed by the transfer that each stands for.

use std::{f32::consts::PI, ops::Range};

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::{
    emitter::Emitter,
    light_tree::{Arriving, LightTree, Target},
    panel::panels,
};
use crate::{
    geometry::{Random, RayTree, SphericalTriangle, low_discrepancy_2d},
    hierarchy::Hierarchy,
    scene::{MaterialId, Scene, TriangleId},
    solver::{Cancel, Direct, places::Receiver},
    transport::luminance,
};

/// Places of random streams per frame unit: single precision tells 2^17 of them apart at the rim of the frame.
const PLACES: f32 = 16_384.0;

/// The emitters that are sampled.
pub(crate) struct Lights {
    tree: LightTree,
    /// Largest radiosity of an emitter by channel: no irradiance can be larger.
    brightest: Vec4,
    /// By patch.
    is_sampled: Vec<bool>,
}

impl Lights {
    /// The emitting patches of a hierarchy: all of them, or none.
    pub(crate) fn new(scene: &Scene, hierarchy: &Hierarchy, mode: Direct) -> Self {
        let is_sampled: Vec<bool> = hierarchy
            .patches
            .iter()
            .enumerate()
            .map(|(index, patch)| {
                let is_seen = hierarchy.active_patches().contains(&index);
                is_seen && patch.emission != Vec3::ZERO && mode != Direct::Linked
            })
            .collect();
        let sampled = (0..is_sampled.len()).filter(|&patch| is_sampled[patch]);
        let emitters: Vec<Emitter> = sampled
            .flat_map(|patch| hierarchy.emitting_parts(patch))
            .map(|part| Emitter::new(scene, hierarchy, part))
            .collect();
        Self::of(&emitters, is_sampled)
    }

    fn of(emitters: &[Emitter], is_sampled: Vec<bool>) -> Self {
        let (emitters, panels) = panels(emitters);
        Self {
            brightest: brightest(&emitters),
            tree: LightTree::new(&emitters, &panels),
            is_sampled,
        }
    }

    /// The emitters whose materials `emission` knows, with that emitted radiance times their texture.
    pub(crate) fn repainted(&self, emission: impl Fn(MaterialId) -> Option<Vec3>) -> Self {
        let emitters: Vec<Emitter> = self
            .tree
            .emitters
            .iter()
            .filter_map(|emitter| {
                let emission = emission(emitter.material)? * emitter.texture;
                let radiosity = (emission * PI).extend(0.0);
                Some(Emitter {
                    radiosity,
                    ..*emitter
                })
            })
            .collect();
        Self::of(&emitters, self.is_sampled.clone())
    }

    /// Irradiance no larger than any surroundings can give. Of many emitters behind each other, few rays tell badly how
    /// much is seen.
    pub(crate) fn bounded(&self, irradiance: Vec4) -> Vec4 {
        irradiance.min(self.brightest)
    }

    /// Largest radiosity of an emitter by channel.
    pub(crate) fn brightest(&self) -> Vec4 {
        self.brightest
    }

    /// Whether nothing is sampled.
    pub(crate) fn is_empty(&self) -> bool {
        self.tree.emitters.is_empty()
    }

    /// Whether the emission of a patch is sampled and so must not travel over links.
    pub(crate) fn is_sampled(&self, patch: usize) -> bool {
        self.is_sampled[patch]
    }

    /// The triangles of the emitters.
    pub(crate) fn triangles(&self) -> impl Iterator<Item = TriangleId> + '_ {
        self.tree.emitters.iter().map(|emitter| emitter.triangle)
    }

    /// Whether all emission that light is computed from is sampled.
    pub(crate) fn are_all(&self, hierarchy: &Hierarchy) -> bool {
        let mut held = hierarchy.active_patches();
        held.all(|index| hierarchy.patches[index].emission == Vec3::ZERO || self.is_sampled(index))
    }

    /// Luminance of the power of the emitters per area of the scene: the mean irradiance if all of it arrives, where that is
    /// no more than can.
    pub(crate) fn mean_power(&self, hierarchy: &Hierarchy) -> f32 {
        let power = |emitter: &Emitter| f64::from(luminance(emitter.radiosity) * emitter.area);
        let sum: f64 = self.tree.emitters.iter().map(power).sum();
        let mean = (sum / hierarchy.importance.area.max(f64::MIN_POSITIVE)) as f32;
        mean.min(luminance(self.brightest))
    }

    /// The patches that are sampled.
    pub(crate) fn sampled_patches(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.is_sampled.len()).filter(|&patch| self.is_sampled[patch])
    }

    /// Shoot shadow rays from many points until each has had `wanted` of them, and add what they find to what is known of
    /// each. When cancelled, some points are left out and all must be asked again.
    pub(crate) fn shoot(
        &self,
        rays: &RayTree,
        receivers: &[Receiver],
        wanted: impl Fn(&DirectLight) -> u32 + Sync,
        seed: u64,
        known: &mut [DirectLight],
        cancel: &Cancel,
    ) {
        known
            .par_iter_mut()
            .zip(receivers)
            .with_min_len(16)
            .for_each_init(Vec::new, |cut, (light, receiver)| {
                if !cancel.is_cancelled() {
                    self.shoot_at(rays, receiver, light.tried..wanted(light), seed, cut, light);
                }
            });
    }

    /// Shoot a range of the shadow rays of one point. `cut` is scratch space.
    fn shoot_at(
        &self,
        rays: &RayTree,
        receiver: &Receiver,
        samples: Range<u32>,
        seed: u64,
        cut: &mut Vec<Arriving>,
        light: &mut DirectLight,
    ) {
        if samples.is_empty() {
            return;
        }
        let expected = luminance(light.exact);
        let scale = (expected > 0.0 || light.tried > 0).then_some(expected);
        light.exact = self.unoccluded(receiver, scale, cut);
        light.tried = samples.end.max(light.tried);
        if rays.is_clear() {
            light.arrive_whole();
            return;
        }
        let total = cut.last().map_or(0.0, |last| last.until);
        if total <= 0.0 {
            return;
        }
        // The stream belongs to the place, so that the order of points does not matter, nor the last digit.
        let [x, y, z] = (receiver.point * PLACES)
            .round()
            .to_array()
            .map(|x| u64::from(x.to_bits()));
        let place = x ^ (y << 21) ^ (z << 42) ^ (z >> 22);
        let shift = Random::new(seed, place).uniform_2d();
        // Each range of the rays is stratified by itself, and those to one target follow each other.
        let mut random = Random::new(seed ^ (u64::from(samples.start + 1) << 32), place);
        let count = samples.len() as f32;
        let (mut target, mut bundle) = (usize::MAX, Bundle::default());
        for (stratum, sample) in samples.enumerate() {
            let at = (stratum as f32 + random.uniform()) / count * total;
            let chosen = cut.partition_point(|part| part.until <= at);
            let chosen = chosen.min(cut.len() - 1);
            if chosen != target {
                light.count(&bundle);
                (target, bundle) = (chosen, self.bundle(receiver, cut[chosen].target));
            }
            let before = chosen.checked_sub(1).map_or(0.0, |last| cut[last].until);
            let place = (at - before) / (cut[chosen].until - before);
            let (emitter, per_chance) = self.tree.pick(cut[chosen].target, receiver, place);
            let emitter = &self.tree.emitters[emitter];
            bundle.rays += 1;
            let square = low_discrepancy_2d(sample, shift);
            let (point, weight) = emitter.aim(receiver, bundle.seen.as_ref(), square);
            let weight = weight * per_chance;
            if !(weight.is_finite() && weight > 0.0) {
                continue;
            }
            let ends = [Some(receiver.triangle), Some(emitter.triangle)];
            let color = emitter.radiosity / luminance(emitter.radiosity);
            bundle.count(weight, color, !rays.occluded(receiver.point, point, ends));
        }
        light.count(&bundle);
    }

    /// Rays that are about to be shot to a target.
    fn bundle(&self, receiver: &Receiver, target: Target) -> Bundle {
        let seen = match target {
            Target::Emitter(emitter) => {
                let corners = self.tree.emitters[emitter as usize].corners;
                SphericalTriangle::new(receiver.point, corners)
            }
            Target::Node(_) => None,
        };
        Bundle {
            seen,
            ..Bundle::default()
        }
    }

    /// As [`LightTree::unoccluded`].
    pub(crate) fn unoccluded(
        &self,
        receiver: &Receiver,
        scale: Option<f32>,
        cut: &mut Vec<Arriving>,
    ) -> Vec4 {
        self.tree.unoccluded(receiver, scale, cut)
    }
}

/// Largest radiosity by channel.
fn brightest(emitters: &[Emitter]) -> Vec4 {
    emitters
        .iter()
        .fold(Vec4::ZERO, |most, emitter| most.max(emitter.radiosity))
}

/// Shadow rays from a point to one target. How much unoccluded light comes from there is known, so of their weights only the
/// ratios count: else a few rays that weigh much would speak for all targets.
#[derive(Clone, Copy, Debug, Default)]
struct Bundle {
    /// The emitter, where it fills a large angle.
    seen: Option<SphericalTriangle>,
    /// Rays tried.
    rays: u32,
    shot: u32,
    visible: u32,
    /// Weights of the rays shot.
    weight: f32,
    /// The same by colour, each with a luminance of 1.
    sent: Vec4,
    /// Of those that got through.
    arrived: Vec4,
}

impl Bundle {
    fn count(&mut self, weight: f32, color: Vec4, is_visible: bool) {
        self.weight += weight;
        self.sent += color * weight;
        self.shot += 1;
        if is_visible {
            self.arrived += color * weight;
            self.visible += 1;
        }
    }
}

/// How many shadow rays of one or several points got through.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Tally {
    pub shot: u32,
    pub visible: u32,
}

/// Standard errors by which rays of one point may differ from those of its neighbours. Smaller takes chance for a border,
/// which biases the light where few rays get through; larger shoots more rays beside the borders of shadows.
const LIKELY_DEVIATIONS: f32 = 3.0;

impl Tally {
    /// Whether some got through and others did not.
    pub(crate) fn is_mixed(self) -> bool {
        self.visible > 0 && self.visible < self.shot
    }

    /// The part that got through; 0 of none.
    fn fraction(self) -> f32 {
        self.visible as f32 / self.shot.max(1) as f32
    }

    /// Whether chance explains how these rays differ from others: by the part of the others, with half a hit and half a miss more.
    pub(crate) fn is_like(self, others: Self) -> bool {
        let (own, count) = (self.shot.max(1) as f32, others.shot as f32 + 1.0);
        let expected = (others.visible as f32 + 0.5) / count;
        let variance = expected * (1.0 - expected) * (1.0 / own + 1.0 / count);
        let gap = self.fraction() - expected;
        self.shot == 0 || gap * gap <= LIKELY_DEVIATIONS * LIKELY_DEVIATIONS * variance
    }
}

impl std::ops::AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        self.shot += other.shot;
        self.visible += other.visible;
    }
}

/// What the shadow rays of a point found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct DirectLight {
    /// Irradiance without occlusion; before the first ray what is expected, 0 for nothing.
    exact: Vec4,
    /// Weights of all rays by colour.
    sent: Vec4,
    /// Weights of the rays that got through by colour.
    arrived: Vec4,
    /// Rays tried: those that carry nothing are not shot.
    pub tried: u32,
    /// Rays shot.
    pub shot: u32,
    /// Rays that got through.
    visible: u32,
}

impl DirectLight {
    /// Before the first ray, where about this irradiance is expected without occlusion: the light of many emitters is then
    /// evaluated no finer than that calls for, without asking first how much there is.
    pub(crate) fn expected(exact: Vec4) -> Self {
        Self {
            exact,
            ..Self::default()
        }
    }

    fn count(&mut self, bundle: &Bundle) {
        self.shot += bundle.shot;
        self.visible += bundle.visible;
        if bundle.weight > 0.0 {
            let by_ray = bundle.rays as f32 / bundle.weight;
            self.sent += bundle.sent * by_ray;
            self.arrived += bundle.arrived * by_ray;
        }
    }

    /// The light of several parts of the emitters together, the colours of each multiplied by a factor. Of parts that
    /// are switched off nothing remains but that rays were tried.
    pub(crate) fn mixed(parts: impl Iterator<Item = (Self, Vec4)>) -> Self {
        let mut mixed = Self::default();
        for (part, factor) in parts {
            let exact = part.exact * factor;
            mixed.tried += part.tried;
            if luminance(exact) <= 0.0 {
                continue;
            }
            mixed.exact += exact;
            // As rays of the new colours would have been counted: each with a luminance of about 1.
            mixed.sent += exact;
            mixed.arrived += exact * part.fraction();
            mixed.shot += part.shot;
            mixed.visible += part.visible;
        }
        let total = luminance(mixed.exact);
        if total > 0.0 {
            // Of what arrives whole without a ray only the ratio counts.
            let by_ray = mixed.shot.max(1) as f32 / total;
            mixed.sent *= by_ray;
            mixed.arrived *= by_ray;
        }
        mixed
    }

    /// Nothing blocks: no ray is needed to know that everything arrives.
    fn arrive_whole(&mut self) {
        (self.sent, self.arrived) = (Vec4::ONE, Vec4::ONE);
    }

    /// Direct irradiance.
    pub(crate) fn irradiance(&self) -> Vec4 {
        self.exact * self.fraction()
    }

    /// Unoccluded irradiance.
    pub(crate) fn unoccluded(&self) -> Vec4 {
        self.exact
    }

    /// The part of the unoccluded irradiance that arrives, by colour, 0…1.
    pub(crate) fn fraction(&self) -> Vec4 {
        let ratio = |arrived: f32, sent: f32| {
            if sent > 0.0 {
                (arrived / sent).clamp(0.0, 1.0)
            } else {
                0.0
            }
        };
        Vec4::new(
            ratio(self.arrived.x, self.sent.x),
            ratio(self.arrived.y, self.sent.y),
            ratio(self.arrived.z, self.sent.z),
            0.0,
        )
    }

    /// What its rays found.
    pub(crate) fn tally(&self) -> Tally {
        Tally {
            shot: self.shot,
            visible: self.visible,
        }
    }

    /// Standard error of the luminance as the rays of its neighbours have it, unless its own are unlikely beside them. So
    /// whether more rays are shot does not depend on what its own found, which would bias the light: where few get through, most
    /// points would take their first rays for all, and the others would lose by more.
    pub(crate) fn error_among(&self, neighbours: Tally) -> f32 {
        let own = self.tally();
        if neighbours.shot == 0 || !own.is_like(neighbours) {
            return self.error();
        }
        let fraction = neighbours.fraction();
        let variance = fraction * (1.0 - fraction) / self.shot.max(1) as f32;
        luminance(self.exact) * variance.sqrt()
    }

    /// Square of the standard error of the fraction, as if the rays were independent: 0 where all agree.
    pub(crate) fn fraction_variance(&self) -> f32 {
        let shot = self.shot.max(1) as f32;
        let fraction = self.visible as f32 / shot;
        fraction * (1.0 - fraction) / shot
    }

    /// Standard error of the fraction as far as so few rays can tell, with half a hit and half a miss more: so that it is
    /// above 0 where all agree.
    pub(crate) fn fraction_doubt(&self) -> f32 {
        let shot = self.shot as f32 + 1.0;
        let fraction = (self.visible as f32 + 0.5) / shot;
        (fraction * (1.0 - fraction) / shot).sqrt()
    }

    /// As [`Self::fraction_doubt`] for the luminance.
    pub(crate) fn doubt(&self) -> f32 {
        luminance(self.exact) * self.fraction_doubt()
    }

    /// Standard error of the luminance, as if the rays were independent: stratification makes it smaller.
    pub(crate) fn error(&self) -> f32 {
        luminance(self.exact) * self.fraction_variance().sqrt()
    }
}
