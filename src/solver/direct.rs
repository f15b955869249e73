//! Direct light: irradiance from the emitters at points, by exact form factors and shadow rays.
//!
//! Unoccluded, the irradiance of the emitters is exact, or that of many far ones together nearly so (see `light_tree`).
//! Shadow rays only tell which part of it arrives: they are spread over the emitters in proportion to that irradiance,
//! stratified, and weighed by the transfer that each stands for.

use std::{f32::consts::PI, ops::Range};

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::{
    Cancel, Direct,
    emitter::Emitter,
    light_tree::{Arriving, LightTree, Target},
    panel::panels,
    places::Receiver,
};
use crate::{
    geometry::{Random, RayTree, SphericalTriangle, low_discrepancy_1d, low_discrepancy_2d},
    hierarchy::Hierarchy,
    scene::{MaterialId, Scene, TriangleId},
    transport::luminance,
};

/// Places of random streams per frame unit: single precision tells 2^17 of them apart at the rim of the frame.
const PLACES: f32 = 16_384.0;

/// The emitters that are sampled.
pub(super) struct Lights {
    tree: LightTree,
    /// Largest radiosity of an emitter by channel: no irradiance can be larger.
    brightest: Vec4,
    /// By patch.
    is_sampled: Vec<bool>,
}

impl Lights {
    /// The emitting patches of a hierarchy: all of them, or none.
    pub(super) fn new(scene: &Scene, hierarchy: &Hierarchy, mode: Direct) -> Self {
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
    pub(super) fn repainted(&self, emission: impl Fn(MaterialId) -> Option<Vec3>) -> Self {
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
    pub(super) fn bounded(&self, irradiance: Vec4) -> Vec4 {
        irradiance.min(self.brightest)
    }

    /// Largest radiosity of an emitter by channel.
    pub(super) fn brightest(&self) -> Vec4 {
        self.brightest
    }

    /// Whether nothing is sampled.
    pub(super) fn is_empty(&self) -> bool {
        self.tree.emitters.is_empty()
    }

    /// Whether the emission of a patch is sampled and so must not travel over links.
    pub(super) fn is_sampled(&self, patch: usize) -> bool {
        self.is_sampled[patch]
    }

    /// The triangles of the emitters.
    pub(super) fn triangles(&self) -> impl Iterator<Item = TriangleId> + '_ {
        self.tree.emitters.iter().map(|emitter| emitter.triangle)
    }

    /// Whether all emission that light is computed from is sampled.
    pub(super) fn are_all(&self, hierarchy: &Hierarchy) -> bool {
        let mut held = hierarchy.active_patches();
        held.all(|index| hierarchy.patches[index].emission == Vec3::ZERO || self.is_sampled(index))
    }

    /// Luminance of the power of the emitters per area of the scene: the mean irradiance if all of it arrives, where that is
    /// no more than can.
    pub(super) fn mean_power(&self, hierarchy: &Hierarchy) -> f32 {
        let power = |emitter: &Emitter| f64::from(luminance(emitter.radiosity) * emitter.area);
        let sum: f64 = self.tree.emitters.iter().map(power).sum();
        let mean = (sum / hierarchy.importance.area.max(f64::MIN_POSITIVE)) as f32;
        mean.min(luminance(self.brightest))
    }

    /// The patches that are sampled.
    pub(super) fn sampled_patches(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.is_sampled.len()).filter(|&patch| self.is_sampled[patch])
    }

    /// Shoot shadow rays from many points until each has had as many as are `wanted` of a point of this index of which so much is
    /// known, and add what they find to that. When cancelled, some points are left out and all must be asked again.
    pub(super) fn shoot(
        &self,
        rays: &RayTree,
        receivers: &[Receiver],
        wanted: impl Fn(usize, &DirectLight) -> u32 + Sync,
        seed: u64,
        known: &mut [DirectLight],
        cancel: &Cancel,
    ) {
        known
            .par_iter_mut()
            .zip(receivers)
            .enumerate()
            .with_min_len(16)
            .for_each_init(Shot::default, |shot, (index, (light, receiver))| {
                let mut samples = light.tried..wanted(index, light);
                if samples.is_empty() || cancel.is_cancelled() {
                    return;
                }
                let expected = luminance(light.exact);
                let scale = (expected > 0.0 || light.tried > 0).then_some(expected);
                light.exact = self.unoccluded(receiver, scale, &mut shot.cut);
                while !samples.is_empty() {
                    light.tried = samples.end;
                    self.shoot_at(rays, receiver, samples, seed, shot, light);
                    samples = light.tried..wanted(index, light);
                }
            });
    }

    /// Shoot a range of the shadow rays of one point, of which the cut is known.
    fn shoot_at(
        &self,
        rays: &RayTree,
        receiver: &Receiver,
        samples: Range<u32>,
        seed: u64,
        Shot { cut, strata }: &mut Shot,
        light: &mut DirectLight,
    ) {
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
        let mut random = Random::new(seed, place);
        let (shift, scramble) = (random.uniform_2d(), random.next_u32());
        // All rays so far are stratified together. Those to one target follow each other.
        strata.clear();
        strata.extend(samples.map(|sample| (low_discrepancy_1d(sample, scramble), sample)));
        strata.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let (mut target, mut bundle) = (usize::MAX, Bundle::default());
        let mut outcomes = Outcomes::default();
        for &(at, sample) in &*strata {
            let at = at * total;
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
            let is_visible = !rays.occluded(receiver.point, point, ends);
            outcomes.count(is_visible);
            bundle.count(weight, color, is_visible);
        }
        light.count(&bundle);
        light.changes += outcomes.changes();
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
    pub(super) fn unoccluded(
        &self,
        receiver: &Receiver,
        scale: Option<f32>,
        cut: &mut Vec<Arriving>,
    ) -> Vec4 {
        self.tree.unoccluded(receiver, scale, cut)
    }
}

/// Scratch space for the shadow rays of one point.
#[derive(Default)]
struct Shot {
    cut: Vec<Arriving>,
    /// Places of rays in the light of the cut, 0 to 1, and their numbers.
    strata: Vec<(f32, u32)>,
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

/// How often successive rays of one range had different outcomes.
#[derive(Clone, Copy, Debug, Default)]
struct Outcomes {
    /// Of the first ray and the last one so far.
    ends: Option<(bool, bool)>,
    changes: u32,
}

impl Outcomes {
    fn count(&mut self, is_visible: bool) {
        let (first, last) = self.ends.unwrap_or((is_visible, is_visible));
        self.changes += u32::from(last != is_visible);
        self.ends = Some((first, is_visible));
    }

    /// The first ray follows the last one, so that there are as many pairs as rays.
    fn changes(&self) -> u32 {
        self.changes
            + self
                .ends
                .map_or(0, |(first, last)| u32::from(first != last))
    }
}

/// How many shadow rays of one or several points got through.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Tally {
    pub shot: u32,
    pub visible: u32,
    /// Pairs of rays to neighbouring strata, as many as rays, of which one got through and the other did not.
    pub changes: u32,
}

/// Standard errors by which rays of one point may differ from those of its neighbours. Smaller takes chance for a border,
/// which biases the light where few rays get through; larger shoots more rays beside the borders of shadows.
const LIKELY_DEVIATIONS: f32 = 3.0;

impl Tally {
    /// Whether some got through and others did not.
    pub(super) fn is_mixed(self) -> bool {
        self.visible > 0 && self.visible < self.shot
    }

    /// The part that got through; 0 of none.
    fn fraction(self) -> f32 {
        self.visible as f32 / self.shot.max(1) as f32
    }

    /// Variance of a ray within its stratum, 0…¼: half the mean square of the differences between neighbouring strata (the
    /// estimator of successive differences; Wolter, "Introduction to Variance Estimation", ch. 8), and no more than among all
    /// strata, since a sequence of low discrepancy alternates. `more` adds half a hit and half a miss.
    fn variance(self, more: f32) -> f32 {
        let shot = (self.shot as f32 + more).max(1.0);
        let fraction = (self.visible as f32 + 0.5 * more) / shot;
        let within = 0.5 * (self.changes as f32 + more) / shot;
        within.min(fraction * (1.0 - fraction))
    }

    /// Whether chance explains how these rays differ from others: by the part of the others, with half a hit and half a miss more.
    pub(super) fn is_like(self, others: Self) -> bool {
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
        self.changes += other.changes;
    }
}

/// What the shadow rays of a point found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct DirectLight {
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
    /// As [`Tally::changes`].
    changes: u32,
}

impl DirectLight {
    /// Before the first ray, where about this irradiance is expected without occlusion: the light of many emitters is then
    /// evaluated no finer than that calls for, without asking first how much there is.
    pub(super) fn expected(exact: Vec4) -> Self {
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
    pub(super) fn mixed(parts: impl Iterator<Item = (Self, Vec4)>) -> Self {
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
            mixed.changes += part.changes;
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
    pub(super) fn irradiance(&self) -> Vec4 {
        self.exact * self.fraction()
    }

    /// Unoccluded irradiance.
    pub(super) fn unoccluded(&self) -> Vec4 {
        self.exact
    }

    /// The part of the unoccluded irradiance that arrives, by colour, 0…1.
    pub(super) fn fraction(&self) -> Vec4 {
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
    pub(super) fn tally(&self) -> Tally {
        Tally {
            shot: self.shot,
            visible: self.visible,
            changes: self.changes,
        }
    }

    /// Standard error of the luminance as the rays of its neighbours have it, unless its own are unlikely beside them. So
    /// whether more rays are shot does not depend on what its own found, which would bias the light: where few get through, most
    /// points would take their first rays for all, and the others would lose by more.
    pub(super) fn error_among(&self, neighbours: Tally) -> f32 {
        let own = self.tally();
        if neighbours.shot == 0 || !own.is_like(neighbours) {
            return self.error();
        }
        let variance = neighbours.variance(0.0) / self.shot.max(1) as f32;
        luminance(self.exact) * variance.sqrt()
    }

    /// Square of the standard error of the fraction: 0 where all rays agree.
    fn fraction_variance(&self) -> f32 {
        self.tally().variance(0.0) / self.shot.max(1) as f32
    }

    /// Standard error of the fraction as far as so few rays can tell, with half a hit and half a miss more: so that it is
    /// above 0 where all agree.
    pub(super) fn fraction_doubt(&self) -> f32 {
        (self.tally().variance(1.0) / (self.shot as f32 + 1.0)).sqrt()
    }

    /// As [`Self::fraction_doubt`] for the luminance.
    pub(super) fn doubt(&self) -> f32 {
        luminance(self.exact) * self.fraction_doubt()
    }

    /// Standard error of the luminance.
    pub(super) fn error(&self) -> f32 {
        luminance(self.exact) * self.fraction_variance().sqrt()
    }
}
