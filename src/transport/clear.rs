//! Pairs in scenes that need less: those of few patches, and those where nothing blocks.
//!
//! Where nothing blocks, the form factor between two elements is known exactly, however near they are. What is left to
//! err is that the source is not evenly bright, which its own elements tell, and that the receiver's part of the form
//! factor varies, which matters only for what it reflects: what is shown is evaluated at its corners. So a pair can be
//! kept that bounds from spheres would divide again and again, and elements are left to be divided where light bends.

use super::{
    Judgement, Link, PairSampler,
    kernel::element_form_factor,
    luminance,
    refine::{Decision, Refiner},
};
use crate::{
    geometry::{Random, point_irradiance},
    hierarchy::{Hierarchy, Kind, NodeId},
};

/// Points of a receiver at which form factors of clusters are summed. One would miss how uneven they are near an edge; many
/// cost time for links that later steps divide.
const POINTS: u32 = 4;

/// Beyond this many radii of both, form factors are those of the centroids: they vary by less than half.
const NEAR: f32 = 2.0;

/// Relative change of a form factor per radius of the receiver over the distance: of the two cosines one, and of the
/// squared distance two.
const FAR_CHANGE: f32 = 4.0;

/// Where on the way to its corners a receiver is looked at, beside its centroid.
const TOWARDS_CORNER: f32 = 0.6;

/// Share of the change over the receiver that counts as error: what one part gets too little another gets too much, so
/// that only near by it is seen in what they reflect. Smaller blurs corners, larger links what is not seen.
const CHANGE_SHARE: f32 = 0.25;

/// The unoccluded form factor from points of a receiver to a source.
struct InView {
    mean: f32,
    /// Largest minus smallest.
    change: f32,
}

impl InView {
    fn between(hierarchy: &Hierarchy, source: usize, receiver: usize) -> Self {
        let (from, to) = (
            &hierarchy.mesh.elements[source],
            &hierarchy.mesh.elements[receiver],
        );
        let normal = hierarchy.patch_of(receiver).normal;
        let at = |point| element_form_factor(hierarchy, source, point, normal);
        let middle = at(to.centroid);
        let distance = from.centroid.distance(to.centroid);
        if distance > NEAR * (from.radius + to.radius) {
            return Self {
                mean: middle,
                change: middle * (FAR_CHANGE * to.radius / distance).min(1.0),
            };
        }
        let corners = hierarchy.mesh.corners(receiver);
        let around = corners.map(|corner| at(to.centroid.lerp(corner, TOWARDS_CORNER)));
        let least = around.into_iter().fold(middle, f32::min);
        let most = around.into_iter().fold(middle, f32::max);
        Self {
            mean: (middle + around.iter().sum::<f32>()) * 0.25,
            change: most - least,
        }
    }
}

impl<'a, F: Fn(NodeId) -> &'a [Link] + Sync> Refiner<'a, F> {
    /// What becomes of a pair for which the scene needs less than in general; `None` for the others.
    pub(super) fn decide_by_plan(
        &self,
        source: NodeId,
        receiver: NodeId,
        weight: f32,
    ) -> Option<Decision> {
        let kinds = [source, receiver].map(|node| self.hierarchy().kind(node));
        match kinds {
            [Kind::Cluster(_), _] if self.is_by_patch && source != receiver => {
                Some(Decision::DivideSource)
            }
            [_, Kind::Cluster(_)] if self.is_by_patch => Some(Decision::DivideReceiver),
            [Kind::Element(from), Kind::Element(to)] if self.follows_light && from != to => {
                let mut random = self.random(source, receiver);
                match self.judge.judge(source, receiver, &mut random) {
                    Judgement::Nothing => Some(Decision::Drop),
                    Judgement::Transfer { bound, .. } => {
                        Some(self.decide_in_view(from, to, weight, bound))
                    }
                }
            }
            _ => None,
        }
    }

    /// What becomes of two elements in full view of each other.
    fn decide_in_view(&self, from: usize, to: usize, weight: f32, bound: f32) -> Decision {
        let hierarchy = self.hierarchy();
        let (source, receiver) = (&hierarchy.mesh.elements[from], &hierarchy.mesh.elements[to]);
        let tables = self.judge.kernel.tables;
        let seen = InView::between(hierarchy, from, to);
        let mean = luminance(tables.elements[from]);
        let spread = (luminance(tables.brightest_in_elements[from]) - mean).max(0.0);
        let reflected = luminance(hierarchy.patch_of(to).reflectance.extend(0.0));
        let of_source = spread * (seen.mean + seen.change);
        let of_receiver = CHANGE_SHARE * reflected * mean * seen.change;
        let exceeds = |error: f32| error * weight > self.threshold;
        if !source.is_leaf() && exceeds(of_source) {
            Decision::DivideSource
        } else if !receiver.is_leaf() && exceeds(of_receiver) {
            Decision::DivideReceiver
        } else {
            Decision::Keep(Link {
                source: NodeId((hierarchy.clusters.len() + from) as u32),
                visibility: 1.0,
                error: bound,
                form_factor: seen.mean,
            })
        }
    }
}

impl PairSampler<'_> {
    /// Mean form factor from a receiver to a source where nothing blocks: the exact form factors of all patches of the
    /// source from a few points.
    pub(super) fn form_factor_in_clear(
        &self,
        source: NodeId,
        receiver: NodeId,
        random: &mut Random,
    ) -> f32 {
        let hierarchy = self.hierarchy;
        let elements = match hierarchy.kind(source) {
            Kind::Cluster(index) => hierarchy.clusters[index].patches(),
            Kind::Element(index) => index..index + 1,
        };
        let mut sum = 0.0;
        for _ in 0..POINTS {
            let (point, normal) = self.point_on(receiver, random);
            let seen = elements
                .clone()
                .map(|element| point_irradiance(point, normal, hierarchy.mesh.corners(element)));
            sum += seen.sum::<f32>().min(1.0);
        }
        sum / POINTS as f32
    }
}
