//! Visibility: the unoccluded fraction of a transfer.
//!
//! The visible fraction of area-uniform rays is biased, since most of them carry little light. Here each ray counts by
//! the light that it carries: points of the source are sampled by power and by area in turn, one of a few candidate
//! pairs of points is chosen with probability proportional to its unoccluded transfer, and its ray counts with the mean
//! weight of the candidates (resampled importance sampling, Talbot 2005).

use std::ops::Range;

use glam::{Vec3, Vec4};

use super::{arrival::Share, luminance, patch_sums::PatchSums};
use crate::{
    geometry::{
        Followed, Image, Random, RayTree, Vectors4, barycentric_in_plane, cosine_direction,
        point_irradiances, triangle_point,
    },
    hierarchy::{Channels as _, Hierarchy, Kind, NodeId, Tables},
    scene::TriangleId,
};

/// Candidate pairs of points for each ray. Fewer lose light, since a ratio of few weights is biased; more cost time and
/// change little from eight on.
const CANDIDATES: u32 = 6;

/// Share of the points of a source that are sampled by power; the others are sampled by area. Smaller, and the few
/// bright patches that carry most of the light, and often stand free, seem occluded; larger, and the visible area is
/// noisy.
const POWER_SHARE: f32 = 0.5;

/// Points of a receiver at which form factors to clusters are summed. Fewer miss their variation near an edge; more
/// cost time for links that later steps divide.
const POINTS: usize = 4;

/// A point on a patch of a node.
#[derive(Clone, Copy, Debug)]
struct Sample {
    point: Vec3,
    normal: Vec3,
    triangle: TriangleId,
    radiosity: f32,
}

/// An element to sample points on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    corners: [Vec3; 3],
    normal: Vec3,
    triangle: TriangleId,
    radiosity: f32,
}

impl Facet {
    /// A point, uniform over the area.
    fn sample(&self, random: &mut Random) -> Sample {
        let [a, b, c] = self.corners;
        let at = triangle_point(random.uniform_2d());
        Sample {
            point: a * at.x + b * at.y + c * at.z,
            normal: self.normal,
            triangle: self.triangle,
            radiosity: self.radiosity,
        }
    }
}

/// A node whose points are sampled by area.
pub(super) enum Receiver {
    /// An element as a whole, without regard to its children.
    Element(Facet),
    /// An element with inactive parts.
    Parts(usize),
    /// The patches of a cluster.
    Patches(Range<usize>),
}

/// A node whose points are sampled by power and by area in turn.
pub(super) struct Source {
    kind: Kind,
    /// The element if it is a leaf; otherwise a leaf is chosen for each point.
    leaf: Option<Facet>,
    /// Whether it sends anything at all.
    has_power: bool,
    /// Mean radiosity (luminance).
    mean: f32,
}

/// A candidate point of a source.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    from: Sample,
    /// Light that the point stands for, relative to that of a point sampled by area on a source of uniform radiosity.
    pub(super) light: f32,
    /// Area that the point stands for, likewise.
    area: f32,
}

/// Samples pairs of points on pairs of nodes.
#[derive(Clone, Copy)]
pub struct PairSampler<'a> {
    /// Where the nodes are.
    pub hierarchy: &'a Hierarchy,
    /// Their radiosities.
    pub tables: &'a Tables,
    /// Areas of the patches.
    pub areas: &'a PatchSums,
    /// Powers of the patches by the tables.
    pub powers: &'a PatchSums,
    /// The occluders.
    pub rays: &'a RayTree,
    /// The image of the sources that receivers see instead of them.
    pub image: Option<&'a Image>,
}

impl PairSampler<'_> {
    /// A random point of a node, uniform over its area (frame units), and its unit normal.
    pub fn point_on(&self, node: NodeId, random: &mut Random) -> (Vec3, Vec3) {
        let sample = self.sample(&self.receiver(node), random);
        (sample.point, sample.normal)
    }

    pub(super) fn receiver(&self, node: NodeId) -> Receiver {
        match self.hierarchy.kind(node) {
            Kind::Element(index) if self.is_whole(index) => Receiver::Element(self.facet(index)),
            Kind::Element(index) => Receiver::Parts(index),
            Kind::Cluster(index) => Receiver::Patches(self.hierarchy.clusters[index].patches()),
        }
    }

    /// Whether an element is active or inactive as a whole, or a leaf.
    fn is_whole(&self, element: usize) -> bool {
        let part = self.tables.elements[element].active_share();
        part >= 1.0 || part <= 0.0 || self.hierarchy.mesh.elements[element].is_leaf()
    }

    /// A point, uniform over the active area of a node.
    fn sample(&self, receiver: &Receiver, random: &mut Random) -> Sample {
        match receiver {
            Receiver::Element(facet) => facet.sample(random),
            Receiver::Parts(element) => self.sample_leaf(*element, false, random),
            Receiver::Patches(patches) => {
                let patch = self.areas.choose(patches, random.uniform());
                if self.is_whole(patch) {
                    self.facet(patch).sample(random)
                } else {
                    self.sample_leaf(patch, false, random)
                }
            }
        }
    }

    pub(super) fn source(&self, node: NodeId) -> Source {
        let kind = self.hierarchy.kind(node);
        let (leaf, area, power) = match kind {
            Kind::Element(index) => {
                let element = &self.hierarchy.mesh.elements[index];
                let (area, sent) = (element.area_vector.length(), self.tables.elements[index]);
                let leaf = element.is_leaf().then(|| self.facet(index));
                (leaf, area * sent.active_share(), luminance(sent) * area)
            }
            Kind::Cluster(index) => {
                let patches = self.hierarchy.clusters[index].patches();
                let area = self.areas.total(&patches) as f32;
                (None, area, self.powers.total(&patches) as f32)
            }
        };
        Source {
            kind,
            leaf,
            has_power: power > 0.0,
            mean: power / area.max(f32::MIN_POSITIVE),
        }
    }

    /// A point of a source, sampled by power or by area.
    fn sample_source(&self, source: &Source, random: &mut Random) -> Candidate {
        let by_power = random.uniform() < POWER_SHARE;
        let sample = match (&source.leaf, source.kind) {
            (Some(facet), _) => facet.sample(random),
            (None, Kind::Element(index)) => self.sample_leaf(index, by_power, random),
            (None, Kind::Cluster(index)) => {
                let sums = if by_power && source.has_power {
                    self.powers
                } else {
                    self.areas
                };
                let patches = self.hierarchy.clusters[index].patches();
                let patch = sums.choose(&patches, random.uniform());
                self.sample_leaf(patch, by_power, random)
            }
        };
        let relative = if source.mean > 0.0 {
            sample.radiosity / source.mean
        } else {
            1.0
        };
        let density = (1.0 - POWER_SHARE) + POWER_SHARE * relative;
        Candidate {
            from: sample,
            light: relative / density,
            area: 1.0 / density,
        }
    }

    /// A point on one of the leaves of an element, chosen by power or by area.
    fn sample_leaf(&self, mut element: usize, by_power: bool, random: &mut Random) -> Sample {
        while !self.hierarchy.mesh.elements[element].is_leaf() {
            element = self.choose_child(element, by_power, random.uniform());
        }
        self.facet(element).sample(random)
    }

    /// One of the children of an element, which all have the same area.
    fn choose_child(&self, element: usize, by_power: bool, at: f32) -> usize {
        let children = self.hierarchy.mesh.elements[element].children();
        let weight = |child: usize| {
            if by_power {
                luminance(self.tables.elements[child]).max(0.0)
            } else {
                self.tables.elements[child].active_share()
            }
        };
        let target = at * children.clone().map(weight).sum::<f32>();
        let mut sum = 0.0;
        let chosen = children.clone().find(|&child| {
            sum += weight(child);
            sum > target
        });
        let even = (at * children.len() as f32) as usize;
        chosen.unwrap_or(children.start + even.min(children.len() - 1))
    }

    fn facet(&self, element: usize) -> Facet {
        let patch = self.hierarchy.patch_of(element);
        Facet {
            corners: self.hierarchy.mesh.corners(element),
            normal: patch.normal,
            triangle: patch.triangle,
            radiosity: luminance(self.tables.elements[element]),
        }
    }

    /// Unoccluded fractions of the light and of the area that a source turns to a receiver, by `ray_count` rays; both
    /// 0…1.5, since an unbiased estimate may exceed 1. Where no sampled pair transfers light, all pairs count alike.
    pub fn visibility(
        &self,
        source: NodeId,
        receiver: NodeId,
        ray_count: u32,
        random: &mut Random,
    ) -> (f32, f32) {
        if self.rays.is_clear() {
            return (1.0, 1.0);
        }
        let (mut light, mut area) = (Share::default(), Share::default());
        let mut all = Share::default();
        let (source, receiver) = (self.source(source), self.receiver(receiver));
        for _ in 0..ray_count {
            let Some((candidate, sum, passing)) = self.pair(&source, &receiver, random) else {
                continue;
            };
            let visible = passing.element_sum() / 3.0;
            all.count(1.0, visible);
            light.count(sum * candidate.light, visible);
            area.count(sum * candidate.area, visible);
        }
        let area = area.part().or(all.part()).unwrap_or(1.0);
        (light.part().unwrap_or(area), area)
    }

    /// A pair of points by their unoccluded transfer, with the summed transfer of its candidates and what passes between
    /// them, by channel, 0…1.
    pub(super) fn pair(
        &self,
        source: &Source,
        receiver: &Receiver,
        random: &mut Random,
    ) -> Option<(Candidate, f32, Vec3)> {
        let (mut chosen, mut sum) = (None, 0.0);
        for _ in 0..CANDIDATES {
            let candidate = self.sample_source(source, random);
            let to = self.sample(receiver, random);
            let weight = match self.image {
                None => transfer(&candidate.from, &to),
                Some(image) => transfer(&candidate.from, &Self::as_sources_see(image, &to)),
            };
            sum += weight;
            if chosen.is_none() || random.uniform() * sum < weight {
                chosen = Some((candidate, to));
            }
        }
        let (candidate, to) = chosen?;
        let from = candidate.from;
        let ends = [Some(to.triangle), Some(from.triangle)];
        let passing = match self.image {
            None => self.rays.transmittance(to.point, from.point, ends),
            Some(image) => {
                let passage = self.rays.passage_over(image, to.point, from.point, ends);
                passage.transmittance
            }
        };
        Some((candidate, sum, passing))
    }

    /// A point of a receiver where the sources see it, in an image.
    #[cold]
    fn as_sources_see(image: &Image, to: &Sample) -> Sample {
        Sample {
            point: image.source_of(to.point),
            normal: image.source_direction(to.normal),
            ..*to
        }
    }

    /// Mean form factor from a receiver to a source, occlusion included, by cosine-weighted rays from random points of
    /// the receiver; 0…1. For a cluster and itself it is the part of its light that it receives itself: 0 where it is
    /// flat or convex.
    pub fn seen_fraction(
        &self,
        source: NodeId,
        receiver: NodeId,
        ray_count: u32,
        random: &mut Random,
    ) -> f32 {
        if self.rays.is_clear() {
            return self.form_factor_in_clear(source, receiver, random);
        }
        let mut met = 0.0;
        let receiver = self.receiver(receiver);
        for _ in 0..ray_count {
            let from = self.sample(&receiver, random);
            let direction = cosine_direction(from.normal, random.uniform_2d());
            let Some(end) = self.end_of(&from, direction) else {
                continue;
            };
            let is_met = end.hit.is_some_and(|hit| {
                let point = end.origin + end.direction * hit.distance;
                self.hierarchy
                    .patch_met(hit.triangle, end.direction)
                    .is_some_and(|patch| self.holds(source, patch, point))
            });
            if is_met {
                met += end.tint.element_sum() / 3.0;
            }
        }
        // What coloured panes make of single rays may add to more.
        (met / ray_count.max(1) as f32).min(1.0)
    }

    /// The end of a ray from a receiver, behind the mirrors of the image; `None` where it misses them.
    fn end_of(&self, from: &Sample, direction: Vec3) -> Option<Followed> {
        let start = Some(from.triangle);
        match self.image {
            Some(image) => self.rays.met_over(image, from.point, direction, start),
            None => Some(self.rays.met(from.point, direction, start)),
        }
    }

    /// The part of the area of a cluster that rays meet, above 0: its radiosity is a mean over all of the area.
    pub fn opacity(&self, cluster: NodeId) -> f32 {
        let (true, Kind::Cluster(index)) = (self.rays.has_panes(), self.hierarchy.kind(cluster))
        else {
            return 1.0;
        };
        let cluster = &self.hierarchy.clusters[index];
        let met = self.areas.total(&cluster.patches()) as f32;
        if met > 0.0 { met / cluster.area } else { 1.0 }
    }

    /// Mean form factor from a receiver to a source without occlusion, 0…1: the exact form factors of all patches of
    /// the source from a few points.
    fn form_factor_in_clear(&self, source: NodeId, receiver: NodeId, random: &mut Random) -> f32 {
        let hierarchy = self.hierarchy;
        let elements = match hierarchy.kind(source) {
            Kind::Cluster(index) => hierarchy.clusters[index].patches(),
            Kind::Element(index) => index..index + 1,
        };
        let samples = [(); POINTS].map(|()| self.point_on(receiver, random));
        let (points, normals) = (
            Vectors4::new(samples.map(|(point, _)| point)),
            Vectors4::new(samples.map(|(_, normal)| normal)),
        );
        let seen = elements
            .map(|element| point_irradiances(&points, &normals, hierarchy.mesh.corners(element)));
        seen.sum::<Vec4>().min(Vec4::ONE).element_sum() / POINTS as f32
    }

    /// Whether a point of a patch belongs to a node.
    fn holds(&self, node: NodeId, patch: usize, point: Vec3) -> bool {
        match self.hierarchy.kind(node) {
            Kind::Cluster(index) => self.hierarchy.clusters[index].patches().contains(&patch),
            Kind::Element(index) => {
                let element = &self.hierarchy.mesh.elements[index];
                element.patch as usize == patch
                    && (element.parent == u32::MAX
                        || barycentric_in_plane(point, self.hierarchy.mesh.corners(index))
                            .min_element()
                            >= 0.0)
            }
        }
    }
}

/// Unoccluded transfer between two points for a radiosity of 1, up to a factor common to all pairs of points.
fn transfer(from: &Sample, to: &Sample) -> f32 {
    let separation = to.point - from.point;
    let squared = separation.length_squared();
    if squared <= f32::MIN_POSITIVE {
        return 0.0;
    }
    let cosines = from.normal.dot(separation).max(0.0) * (-to.normal.dot(separation)).max(0.0);
    let value = cosines / (squared * squared);
    if value.is_finite() { value } else { 0.0 }
}

#[cfg(test)]
mod tests;
