//! Shadow rays from points: distributed over the emitters, the sky or the sun in proportion to their unoccluded light,
//! stratified, and weighted by their transfer.

use std::ops::Range;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::{
    light_tree::{Arriving, LightTree, Target},
    lights::{Guidance, Lights, Source},
    samples::{Bundle, DirectLight},
    sky::OutsideRay,
    sky_guide::{Lobes, Mixture},
    tally::Outcomes,
};
use crate::{
    geometry::{
        Image, Passage, RAY_OFFSET, Random, RayTree, Shuffle, SphericalTriangle, low_discrepancy_2d,
    },
    scene::TriangleId,
    solver::{Cancel, places::Receiver},
    transport::luminance,
};

/// Positions of random streams per frame unit: single precision resolves 2^17 at the rim of the frame. Larger, and
/// rounding changes the streams; smaller, and neighbouring points share them.
const PLACES: f32 = 16_384.0;

impl Lights {
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
                    let shuffle = shuffle_at(receiver.point, seed);
                    self.shoot_at(rays, receiver, samples, shuffle, shot, light);
                    samples = light.tried..wanted(index, light);
                }
            });
    }

    /// Shoot a range of the shadow rays of one point with a known cut.
    pub(super) fn shoot_at(
        &self,
        rays: &RayTree,
        receiver: &Receiver,
        samples: Range<u32>,
        shuffle: Shuffle,
        Shot {
            cut,
            strata,
            lobes,
            seen,
            blocked,
        }: &mut Shot,
        light: &mut DirectLight,
    ) {
        let way = Way {
            rays,
            image: self.image.as_deref(),
            from: *receiver,
        };
        let receiver = &self.facing(receiver);
        seen.clear();
        *blocked = Blocked::default();
        if rays.is_clear() {
            light.arrive_whole();
            return;
        }
        let light_of_cut = cut.last().map_or(0.0, |last| last.until);
        if light_of_cut <= 0.0 {
            return;
        }
        let own = cut.len();
        let mixture = match &self.source {
            Source::Sky(sky, Guidance::Known(guide)) => {
                guide.mix(sky, receiver.point, receiver.normal, cut, lobes)
            }
            _ => None,
        };
        light.expect_square(mixture.as_ref().map_or(1.0, |mixture| mixture.square));
        let total = cut.last().map_or(0.0, |last| last.until);
        // All rays so far are stratified together. Those to one target are consecutive.
        strata.clear();
        strata.extend(samples.map(|sample| (shuffle.place(sample), sample)));
        strata.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        // Shoot them, each into its part of the cut.
        let shots = strata.iter().map(|&(at, sample)| {
            let at = at * total;
            let (chosen, share, place) = Arriving::choose(cut, at);
            Ray {
                part: chosen,
                target: cut[chosen].target,
                irradiance: chosen
                    .checked_sub(own)
                    .map_or(share, |place| lobes.irradiance(place)),
                place,
                square: low_discrepancy_2d(sample, shuffle.shift),
            }
        });
        match &self.source {
            Source::Emitters(tree) => {
                shoot_at_emitters(tree, way, receiver, shots, light, blocked);
            }
            Source::Sky(sky, _) => {
                let aim = |ray: Ray| match ray.target {
                    Target::Node(node) => {
                        let (index, normal) = (node as usize, receiver.normal);
                        sky.aim(index, ray.irradiance, normal, ray.place, ray.square)
                    }
                    Target::Emitter(_) => None,
                };
                let shots = shots.map(aim);
                let mixture = mixture.as_ref().map(|mixture| (mixture, &*lobes));
                let blocked = (sky.width(), blocked);
                shoot_outside(way, shots, mixture, light, seen, blocked);
            }
            Source::Sun(sun) => {
                let aim = |ray: Ray| sun.aim(receiver.normal, ray.square);
                let blocked = (sun.width(), blocked);
                shoot_outside(way, shots.map(aim), None, light, seen, blocked);
            }
        }
        cut.truncate(own);
    }
}

/// The way of the light to a receiver.
#[derive(Clone, Copy)]
struct Way<'a> {
    rays: &'a RayTree,
    /// The image in which it is seen.
    image: Option<&'a Image>,
    from: Receiver,
}

impl Way<'_> {
    /// What passes from a point of a triangle.
    fn passage(&self, point: Vec3, triangle: TriangleId) -> Passage {
        let ends = [Some(self.from.triangle), Some(triangle)];
        match self.image {
            None => self.rays.passage(self.from.point, point, ends),
            Some(image) => self.rays.passage_over(image, self.from.point, point, ends),
        }
    }

    /// What passes from outside.
    fn passage_outward(&self, direction: Vec3) -> Passage {
        let (point, start) = (self.from.point, Some(self.from.triangle));
        match self.image {
            None => self.rays.passage_outward(point, direction, start),
            Some(image) => self
                .rays
                .passage_outward_over(image, point, direction, start),
        }
    }
}

/// The random numbers of a point: they depend on its rounded position, not on the order of points.
pub(super) fn shuffle_at(point: Vec3, seed: u64) -> Shuffle {
    let [x, y, z] = (point * PLACES)
        .round()
        .to_array()
        .map(|x| u64::from(x.to_bits()));
    let place = x ^ (y << 21) ^ (z << 42) ^ (z >> 22);
    Shuffle::next(&mut Random::new(seed, place))
}

/// Random numbers of a shadow ray.
struct Ray {
    /// The part of the cut, its target and the luminance of its irradiance.
    part: usize,
    target: Target,
    irradiance: f32,
    /// Place in the part, 0…1.
    place: f32,
    square: Vec2,
}

/// Shoot shadow rays from a receiver, as the emitters see it, to these.
fn shoot_at_emitters(
    tree: &LightTree,
    way: Way<'_>,
    receiver: &Receiver,
    shots: impl Iterator<Item = Ray>,
    light: &mut DirectLight,
    blocked: &mut Blocked,
) {
    let (mut part, mut bundle) = (usize::MAX, Bundle::default());
    let mut outcomes = Outcomes::default();
    for ray in shots {
        if ray.part != part {
            light.count(&bundle);
            (part, bundle) = (ray.part, bundle_towards(tree, receiver, ray.target));
        }
        let (emitter, per_chance) = tree.pick(ray.target, receiver, ray.place);
        let emitter = &tree.emitters[emitter];
        bundle.rays += 1;
        let (point, weight) = emitter.aim(receiver, bundle.seen.as_ref(), ray.square);
        let weight = weight * per_chance;
        if !(weight.is_finite() && weight > 0.0) {
            continue;
        }
        let color = emitter.radiosity / luminance(emitter.radiosity);
        let passage = way.passage(point, emitter.triangle);
        let passing = passage.transmittance;
        if passing == Vec3::ZERO {
            // As wide as two of these triangles, of which lamps are mostly made.
            let distance = (point - receiver.point).length();
            let width = (2.0 * emitter.area).sqrt() / distance;
            blocked.count(passage, distance, width);
        }
        outcomes.count(passing != Vec3::ZERO);
        bundle.count(weight, 1.0, color, passing);
    }
    light.count(&bundle);
    light.changes += outcomes.changes();
}

/// An empty bundle of rays to a target.
fn bundle_towards(tree: &LightTree, receiver: &Receiver, target: Target) -> Bundle {
    let seen = match target {
        Target::Emitter(emitter) => {
            let corners = tree.emitters[emitter as usize].corners;
            SphericalTriangle::new(receiver.point, corners)
        }
        Target::Node(_) => None,
    };
    Bundle::towards(seen)
}

/// Shoot shadow rays from a receiver out of the scene, and add what they see.
fn shoot_outside(
    way: Way<'_>,
    shots: impl Iterator<Item = Option<OutsideRay>>,
    mixture: Option<(&Mixture, &Lobes)>,
    light: &mut DirectLight,
    seen: &mut Vec<(OutsideRay, f32)>,
    (width, blocked): (f32, &mut Blocked),
) {
    let (mut bundle, mut outcomes) = (Bundle::default(), Outcomes::default());
    for ray in shots {
        bundle.rays += 1;
        let Some(ray) = ray else { continue };
        let passage = way.passage_outward(ray.direction);
        let passing = passage.transmittance;
        let is_visible = passing != Vec3::ZERO;
        outcomes.count(is_visible);
        if !is_visible {
            blocked.count(passage, f32::INFINITY, width);
        }
        let worth = mixture.map_or(1.0, |(mixture, lobes)| mixture.weight(lobes, ray.leaf));
        bundle.count(ray.weight, worth, ray.color, passing);
        if is_visible {
            seen.push((ray, ray.weight * worth));
        }
    }
    light.count(&bundle);
    light.changes += outcomes.changes();
}

/// Scratch space for the shadow rays of one point.
#[derive(Default)]
pub(super) struct Shot {
    pub(super) cut: Vec<Arriving>,
    /// Positions of rays in the light of the cut, 0…1, and their numbers.
    strata: Vec<(f32, u32)>,
    /// Leaves of the sky to which rays are guided.
    lobes: Lobes,
    /// Rays of the last point that reached the sky or the sun, with their weights relative to rays that follow the unoccluded light.
    pub(super) seen: Vec<(OutsideRay, f32)>,
    pub(super) blocked: Blocked,
}

/// The rays of the last point that were blocked.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Blocked {
    pub(super) count: u32,
    /// Sum of their sharpness: the inverse of the distance over which a point has to move until it sees another part of what
    /// blocks before all of the light.
    pub(super) sharpness: f32,
}

impl Blocked {
    /// Count a ray that ends before the light at a distance, of an angular width in radians.
    fn count(&mut self, passage: Passage, distance: f32, width: f32) {
        let before = 1.0 / passage.end.max(RAY_OFFSET) - 1.0 / distance;
        self.count += 1;
        self.sharpness += before.max(0.0) / width.max(f32::MIN_POSITIVE);
    }
}
