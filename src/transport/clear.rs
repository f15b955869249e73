//! Pairs that need less work: those of scenes with few patches, and those of scenes without occlusion.
//!
//! Without occlusion, the form factor between two elements is known exactly at any distance. Two errors remain. The
//! source is not uniformly bright: its elements say by how much. The form factor varies over the receiver: that matters
//! only for the reflected light, because the displayed light is evaluated at the corners. So a pair can become a link
//! that bounds from spheres would divide again and again, and elements are divided only where interpolation errs.

use glam::{Vec3, Vec4};

use super::{
    Link, element_form_factor, element_form_factors,
    kernel::inner_points,
    luminance,
    refiner::{Decision, Refinement, Refiner},
};
use crate::{
    geometry::Vectors4,
    hierarchy::{ElementId, Hierarchy, Kind, NodeId},
};

/// Form factors of pairs further apart than this many times the sum of their radii are evaluated at the centroid of the
/// receiver: over it they vary by less than half. Smaller, and that is wrong near the source; larger, and points are
/// evaluated that agree.
const NEAR: f32 = 2.0;

/// Relative change of a form factor over the receiver, in multiples of the receiver's radius over the distance: one for
/// each of the two cosines, two for the squared distance.
const FAR_CHANGE: f32 = 4.0;

/// Where a form factor varies by more than this share of its mean, it is averaged over more points: it has a peak where
/// receiver and source touch. Smaller, and smooth form factors cost time; larger, and part of the peak is missed.
const PEAKED: f32 = 0.5;

/// Share of the threshold that the error of an unoccluded pair may have: its error is an estimate, while those of other
/// pairs are bounds that are hardly ever reached. Larger, and light from uneven walls smears into the corners of a
/// room; smaller, and time goes into invisible errors.
const ESTIMATE_SHARE: f32 = 0.02;

/// The unoccluded form factor from points of a receiver to a source, 0…1.
struct InView {
    mean: f32,
    /// Largest minus smallest.
    change: f32,
}

impl InView {
    /// Of a pair that has a link: near the source the form factor may be up to twice the mean.
    fn known(form_factor: f32) -> Self {
        Self {
            mean: form_factor,
            change: form_factor,
        }
    }

    fn between(hierarchy: &Hierarchy, source: usize, receiver: usize) -> Self {
        let (from, to) = (
            &hierarchy.mesh.elements[source],
            &hierarchy.mesh.elements[receiver],
        );
        let normal = hierarchy.patch_of(receiver).normal;
        let distance = from.centroid.distance(to.centroid);
        if distance > NEAR * (from.radius + to.radius) {
            let middle = element_form_factor(hierarchy, source, to.centroid, normal);
            return Self {
                mean: middle,
                change: middle * (FAR_CHANGE * to.radius / distance).min(1.0),
            };
        }
        let [a, b, c] = hierarchy.mesh.corners(receiver);
        let normals = Vectors4::splat(normal);
        let within = |corners: [Vec3; 3]| {
            let points = inner_points(corners);
            element_form_factors(hierarchy, source, &points, &normals)
        };
        let coarse = within([a, b, c]);
        let mean = coarse.element_sum() * 0.25;
        let change = coarse.max_element() - coarse.min_element();
        if change <= PEAKED * mean {
            return Self { mean, change };
        }
        // Four quarters, each by its own points.
        let (ab, bc, ca) = ((a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5);
        let quarters = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [bc, ca, ab]];
        let sum: Vec4 = quarters.into_iter().map(within).sum();
        Self {
            mean: sum.element_sum() / 16.0,
            change,
        }
    }
}

impl<'a, F: Fn(NodeId) -> &'a [Link] + Sync> Refiner<'a, F> {
    /// The decision on a pair to which a simplification of the plan applies; `None` for other pairs.
    pub(super) fn decide_by_plan(
        &self,
        source: NodeId,
        receiver: NodeId,
        known: Option<&Link>,
        weight: f32,
        out: &mut Refinement,
    ) -> Option<Decision> {
        let kinds = [source, receiver].map(|node| self.hierarchy().kind(node));
        match kinds {
            [Kind::Cluster(_), _] if self.is_by_patch && source != receiver => {
                Some(Decision::DivideSource)
            }
            [_, Kind::Cluster(_)] if self.is_by_patch => Some(Decision::DivideReceiver),
            [Kind::Element(from), Kind::Element(to)] if self.follows_light && from != to => {
                if !self.judge.face_each_other(source, receiver) {
                    return Some(Decision::Drop);
                }
                Some(self.decide_in_view([from, to], known, weight, out))
            }
            _ => None,
        }
    }

    /// The decision on two elements with nothing between them; `known` is their link if they have one.
    fn decide_in_view(
        &self,
        [from, to]: [usize; 2],
        known: Option<&Link>,
        weight: f32,
        out: &mut Refinement,
    ) -> Decision {
        let hierarchy = self.hierarchy();
        let [source_node, receiver_node] =
            [from, to].map(|element| hierarchy.element_node(ElementId(element as u32)));
        let (source, receiver) = (&hierarchy.mesh.elements[from], &hierarchy.mesh.elements[to]);
        // The form factor, the error from the unevenness of the source, and that from the variation over the receiver.
        let seen = match known {
            // The form factor of a linked leaf is known; only the source may have become less even.
            Some(link) if receiver.is_leaf() => InView::known(link.form_factor()),
            _ => InView::between(hierarchy, from, to),
        };
        let reflected = luminance(hierarchy.reflectance_of(to).extend(0.0));
        let mean = luminance(self.judge.kernel.tables.elements[from]);
        let of_source = self.unevenness(from) * (seen.mean + seen.change);
        let of_receiver = reflected * mean * seen.change;
        // Divide where an error exceeds the threshold: existing children now, leaves after this pass.
        let exceeds = |error: f32| error * weight > ESTIMATE_SHARE * self.threshold;
        if !source.is_leaf() && exceeds(of_source) {
            return Decision::DivideSource;
        }
        if !receiver.is_leaf() && exceeds(of_receiver) {
            return Decision::DivideReceiver;
        }
        if exceeds(of_source) && hierarchy.mesh.size_of_parts(from) >= self.min_area {
            out.wanted.push(from as u32);
        }
        // The estimate from a few points is usually tighter than the bound over all points.
        let error = self
            .judge
            .bound(source_node, receiver_node)
            .min(of_source + mean * seen.change);
        Decision::Keep(Link::between_elements(source_node, 1.0, seen.mean, error))
    }

    /// Largest excess of the radiosity of an element over its mean (luminance).
    fn unevenness(&self, element: usize) -> f32 {
        let tables = self.judge.kernel.tables;
        if self.hierarchy().mesh.elements[element].is_leaf() {
            return self.spreads.get(element).copied().unwrap_or(0.0);
        }
        let brightest = luminance(tables.brightest_in_elements[element]);
        (brightest - luminance(tables.elements[element])).max(0.0)
    }
}
