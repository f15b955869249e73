//! Direct light: irradiance from the emitters at points, by exact form factors and shadow rays.
//!
//! The unoccluded irradiance of the emitters is exact, that of many far ones together nearly so (see `light_tree`).
//! Shadow rays only estimate its visible fraction: they are distributed over the emitters in proportion to that
//! irradiance, stratified, and weighted by their transfer.

use std::{f32::consts::PI, ops::Range};

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::{
    emitter::Emitter,
    light_tree::{Arriving, LightTree, Target},
    panel::panels,
    samples::{Bundle, DirectLight, Outcomes},
};
use crate::{
    geometry::{Random, RayTree, SphericalTriangle, low_discrepancy_1d, low_discrepancy_2d},
    hierarchy::Hierarchy,
    scene::{MaterialId, Scene, TriangleId},
    solver::{Cancel, Direct, places::Receiver},
    transport::luminance,
};

/// Positions of random streams per frame unit: single precision resolves 2^17 at the rim of the frame. Larger, and
/// rounding changes the streams; smaller, and neighbouring points share them.
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
    /// The active emitting patches of a hierarchy, or none if emission is linked.
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

    /// The emitters for whose materials `emission` gives an emitted radiance, with that radiance times their texture.
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

    /// The irradiance, bounded by the largest radiosity: with many emitters behind each other, few rays estimate their
    /// visibility badly.
    pub(super) fn bounded(&self, irradiance: Vec4) -> Vec4 {
        irradiance.min(self.brightest)
    }

    /// Largest radiosity of an emitter by channel.
    pub(super) fn brightest(&self) -> Vec4 {
        self.brightest
    }

    /// Whether no emitter is sampled.
    pub(crate) fn is_empty(&self) -> bool {
        self.tree.emitters.is_empty()
    }

    /// Whether the emission of a patch is sampled, and so must not be linked.
    pub(crate) fn is_sampled(&self, patch: usize) -> bool {
        self.is_sampled[patch]
    }

    /// The triangles of the emitters.
    pub(super) fn triangles(&self) -> impl Iterator<Item = TriangleId> + '_ {
        self.tree.emitters.iter().map(|emitter| emitter.triangle)
    }

    /// Whether the emission of all active patches is sampled.
    pub(super) fn are_all(&self, hierarchy: &Hierarchy) -> bool {
        let mut active = hierarchy.active_patches();
        active
            .all(|index| hierarchy.patches[index].emission == Vec3::ZERO || self.is_sampled(index))
    }

    /// Luminance of the power of the emitters per area of the scene, which is the mean irradiance if all of it arrives;
    /// at most the largest radiosity.
    pub(super) fn mean_power(&self, hierarchy: &Hierarchy) -> f32 {
        let power = |emitter: &Emitter| f64::from(luminance(emitter.radiosity) * emitter.area);
        let sum: f64 = self.tree.emitters.iter().map(power).sum();
        let mean = (sum / hierarchy.importance.area.max(f64::MIN_POSITIVE)) as f32;
        mean.min(luminance(self.brightest))
    }

    /// The patches that are sampled.
    pub(crate) fn sampled_patches(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.is_sampled.len()).filter(|&patch| self.is_sampled[patch])
    }

    /// Shoot shadow rays from many points until each has had the number `wanted` for its index and light so far, and
    /// add them to its `known` light. When cancelled, some points are omitted, and all must be sampled again.
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

    /// Shoot a range of the shadow rays of one point with a known cut.
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
        // The random stream depends on the rounded position, not on the order of points.
        let [x, y, z] = (receiver.point * PLACES)
            .round()
            .to_array()
            .map(|x| u64::from(x.to_bits()));
        let place = x ^ (y << 21) ^ (z << 42) ^ (z >> 22);
        let mut random = Random::new(seed, place);
        let (shift, scramble) = (random.uniform_2d(), random.next_u32());
        // All rays so far are stratified together. Those to one target are consecutive.
        strata.clear();
        strata.extend(samples.map(|sample| (low_discrepancy_1d(sample, scramble), sample)));
        strata.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        // Shoot them, each to an emitter of its part of the cut.
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
            let passing = rays.transmittance(receiver.point, point, ends);
            outcomes.count(passing != Vec3::ZERO);
            bundle.count(weight, color, passing);
        }
        light.count(&bundle);
        light.changes += outcomes.changes();
    }

    /// An empty bundle of rays to a target.
    fn bundle(&self, receiver: &Receiver, target: Target) -> Bundle {
        let seen = match target {
            Target::Emitter(emitter) => {
                let corners = self.tree.emitters[emitter as usize].corners;
                SphericalTriangle::new(receiver.point, corners)
            }
            Target::Node(_) => None,
        };
        Bundle::towards(seen)
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
    /// Positions of rays in the light of the cut, 0…1, and their numbers.
    strata: Vec<(f32, u32)>,
}

/// Largest radiosity by channel.
fn brightest(emitters: &[Emitter]) -> Vec4 {
    emitters
        .iter()
        .fold(Vec4::ZERO, |most, emitter| most.max(emitter.radiosity))
}
