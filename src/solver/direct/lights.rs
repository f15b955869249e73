//! Direct light at points: irradiance from the emitters, from the sky, or from the sun, by exact form factors and shadow
//! rays.
//!
//! The unoccluded irradiance of the emitters is exact, that of many far ones together nearly so (see `light_tree`).
//! Shadow rays only estimate its visible fraction: they are distributed over the emitters in proportion to that
//! irradiance, stratified, and weighted by their transfer.

use std::{f32::consts::PI, ops::Range, sync::Arc};

use glam::{Vec2, Vec3, Vec4};
use rayon::prelude::*;

use super::{
    emitter::Emitter,
    light_tree::{Arriving, LightTree, Target},
    panel::panels,
    samples::{Bundle, DirectLight, Outcomes},
    sky::{OutsideRay, SkyTree},
    sky_guide::{Lobe, Mixture, SkyGuide},
    sun::SunDisc,
};
use crate::{
    geometry::{
        Image, Passage, RAY_OFFSET, Random, RayTree, Shuffle, SphericalTriangle, low_discrepancy_2d,
    },
    hierarchy::{Hierarchy, Reading},
    scene::{MaterialId, Scene, Sky, Sun, TriangleId},
    solver::{Cancel, Direct, places::Receiver},
    transport::luminance,
};

/// Positions of random streams per frame unit: single precision resolves 2^17 at the rim of the frame. Larger, and
/// rounding changes the streams; smaller, and neighbouring points share them.
const PLACES: f32 = 16_384.0;

/// A kind of light that is sampled; as a number, its place among the kinds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LightKind {
    Emitters,
    Sky,
    Sun,
}

/// What gives the light.
#[derive(Clone, Debug)]
pub(super) enum Source {
    Emitters(LightTree),
    Sky(SkyTree, Guidance),
    Sun(SunDisc),
}

/// Where places that see little of the sky see it.
#[derive(Clone, Debug)]
pub(super) enum Guidance {
    /// Nothing was learnt yet.
    Unknown,
    /// No place needs a guide, or none is known.
    None,
    Known(SkyGuide),
}

/// The light of one kind that is sampled: that of all emitters, of the sky, or of the sun.
#[derive(Clone, Debug)]
pub(crate) struct Lights {
    pub(super) source: Source,
    /// Largest radiosity by channel, or largest irradiance from outside: no irradiance can be larger.
    brightest: Vec4,
    /// Patches whose emission is sampled; empty for light from outside.
    is_sampled: Vec<bool>,
    /// The image in which this light is seen, where it comes over mirrors.
    image: Option<Arc<Image>>,
}

impl Lights {
    /// The active emitting patches of a hierarchy; `None` if there are none, or if emission is linked.
    pub(super) fn of_emitters(scene: &Scene, hierarchy: &Hierarchy, mode: Direct) -> Option<Self> {
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
        (!emitters.is_empty()).then(|| Self::of(&emitters, is_sampled))
    }

    fn of(emitters: &[Emitter], is_sampled: Vec<bool>) -> Self {
        let (emitters, panels) = panels(emitters);
        Self {
            brightest: brightest(&emitters),
            source: Source::Emitters(LightTree::new(&emitters, &panels)),
            is_sampled,
            image: None,
        }
    }

    /// The sky; `None` if it is dark. With a reading its unoccluded irradiance is that of a directional table.
    pub(super) fn of_sky(sky: &Sky, reading: Option<Reading>) -> Option<Self> {
        let tree = SkyTree::new(sky, reading)?;
        Some(Self {
            brightest: tree.brightest(),
            source: Source::Sky(tree, Guidance::Unknown),
            is_sampled: Vec::new(),
            image: None,
        })
    }

    /// The sun; `None` if it is dark. The reading as in [`Self::of_sky`].
    pub(super) fn of_sun(sun: &Sun, reading: Option<Reading>) -> Option<Self> {
        let disc = SunDisc::new(sun, reading)?;
        Some(Self {
            brightest: disc.brightest(),
            source: Source::Sun(disc),
            is_sampled: Vec::new(),
            image: None,
        })
    }

    /// The same light as an image shows it.
    pub(super) fn in_image(&self, image: &Arc<Image>) -> Self {
        let mut source = self.source.clone();
        if let Source::Sky(_, guidance) = &mut source {
            *guidance = Guidance::None;
        }
        Self {
            source,
            brightest: self.brightest * image.reflectance().extend(1.0),
            is_sampled: Vec::new(),
            image: Some(image.clone()),
        }
    }

    /// Whether it comes over mirrors.
    pub(super) fn is_mirrored(&self) -> bool {
        self.image.is_some()
    }

    /// Its kind.
    pub(super) fn kind(&self) -> LightKind {
        match self.source {
            Source::Emitters(_) => LightKind::Emitters,
            Source::Sky(..) => LightKind::Sky,
            Source::Sun(_) => LightKind::Sun,
        }
    }

    /// A receiver as the light sees it.
    fn facing(&self, receiver: &Receiver) -> Receiver {
        match &self.image {
            None => *receiver,
            Some(image) => Receiver {
                point: image.source_of(receiver.point),
                normal: image.source_direction(receiver.normal),
                ..*receiver
            },
        }
    }

    /// Whether it comes from outside the scene.
    pub(super) fn is_outside(&self) -> bool {
        !matches!(self.source, Source::Emitters(_))
    }

    /// As [`SkyTree::even_radiosity`]; `None` for other light.
    pub(super) fn even_radiosity(&self) -> Option<f32> {
        match &self.source {
            Source::Sky(sky, _) if !self.is_mirrored() => sky.even_radiosity(),
            Source::Sky(..) | Source::Emitters(_) | Source::Sun(_) => None,
        }
    }

    /// The emitters; none for light from outside.
    fn emitters(&self) -> &[Emitter] {
        match &self.source {
            Source::Emitters(tree) => &tree.emitters,
            Source::Sky(..) | Source::Sun(_) => &[],
        }
    }

    /// The emitters for whose materials `emission` gives an emitted radiance, with that radiance times their texture.
    pub(super) fn repainted(&self, emission: impl Fn(MaterialId) -> Option<Vec3>) -> Self {
        let emitters: Vec<Emitter> = self
            .emitters()
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
        let repainted = Self::of(&emitters, self.is_sampled.clone());
        match &self.image {
            None => repainted,
            Some(image) => repainted.in_image(image),
        }
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

    /// Whether the emission of a patch is sampled, and so must not be linked.
    pub(crate) fn is_sampled(&self, patch: usize) -> bool {
        self.is_sampled.get(patch) == Some(&true)
    }

    /// The triangles of the emitters.
    pub(super) fn triangles(&self) -> impl Iterator<Item = TriangleId> + '_ {
        self.emitters().iter().map(|emitter| emitter.triangle)
    }

    /// Luminance of the mean irradiance if all light arrives: the power of the emitters per area of the scene, at most
    /// the largest radiosity.
    pub(super) fn mean_power(&self, hierarchy: &Hierarchy) -> f32 {
        let tree = match &self.source {
            Source::Emitters(tree) => tree,
            Source::Sky(sky, _) => return luminance(sky.mean_irradiance()),
            Source::Sun(sun) => return luminance(sun.mean_irradiance()),
        };
        let power = |emitter: &Emitter| f64::from(luminance(emitter.radiosity) * emitter.area);
        let sum: f64 = tree.emitters.iter().map(power).sum();
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
                    .map_or(share, |lobe| lobes[lobe].irradiance),
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
                let mixture = mixture.as_ref().map(|mixture| (mixture, &**lobes));
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

    /// Unoccluded irradiance at a receiver, W/m²; the other arguments as in [`LightTree::unoccluded`].
    pub(super) fn unoccluded(
        &self,
        receiver: &Receiver,
        scale: Option<f32>,
        cut: &mut Vec<Arriving>,
    ) -> Vec4 {
        let receiver = &self.facing(receiver);
        let light = match &self.source {
            Source::Emitters(tree) => tree.unoccluded(receiver, scale, cut),
            Source::Sky(sky, _) => sky.unoccluded(receiver.normal, cut),
            Source::Sun(sun) => sun.unoccluded(receiver.normal, cut),
        };
        match &self.image {
            None => light,
            Some(image) => light * image.reflectance().extend(1.0),
        }
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
    mixture: Option<(&Mixture, &[Lobe])>,
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
    lobes: Vec<Lobe>,
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

/// Largest radiosity by channel.
fn brightest(emitters: &[Emitter]) -> Vec4 {
    emitters
        .iter()
        .fold(Vec4::ZERO, |most, emitter| most.max(emitter.radiosity))
}
