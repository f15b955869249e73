//! The decision on a pair: it is dropped, becomes a link, or is replaced by pairs with the children of one of its
//! nodes.

use super::{
    Judgement, Kernel, Link,
    kernel::inner_points,
    link::LEAST_RAYS,
    refiner::{Decision, Refinement, Refiner},
};
use crate::hierarchy::{Channels as _, Kind, NodeId};

/// Most visibility rays of a link. Fewer, and strong links are noisy; more cost time.
const MOST_RAYS: u32 = 8;

/// Rays that estimate which part of its own light a cluster receives. Fewer, and these links, which are few and carry
/// much light, are noisy; more cost time.
const SELF_RAYS: u32 = 16;

/// Assumed error of the light that a cluster exchanges within itself, as a share of the radiosity of its brightest
/// patch. Larger, and links within convex objects are refined in vain; smaller, and bright corners are blurred.
const SELF_SHARE: f32 = 0.2;

/// Largest factor by which rays may raise the form factor that tables give for near nodes. Larger, and a few rays that
/// hit by chance make a firefly; smaller, and light is lost where tables see a source edge-on.
const MOST_CORRECTION: f32 = 64.0;

/// Fewest and most rays of a link between near nodes. Fewer, and their form factors are noisy; more cost time.
const NEAR_RAYS: std::ops::RangeInclusive<u32> = 4..=16;

/// Share of a partly visible transfer that counts as error: shadows vary over the receiver, and the tables do not
/// resolve them. Smaller, and shadows are blurred; larger, and links are divided at every shadow.
const PARTIAL_VISIBILITY: f32 = 0.5;

/// Smallest visibility that refinement assumes: a few occluded rays do not prove that a pair is occluded. Smaller, and
/// pairs whose rays were all occluded stay as they are; larger, and refinement goes on behind walls.
const DOUBT: f32 = 0.1;

/// The source is divided unless its radius is smaller than this share of the receiver's: rounding must not choose
/// between equal nodes.
const TIE: f32 = 0.999;

/// Normals agree when the length of the summed area vectors is within this relative difference of the summed areas.
const SAME_DIRECTION: f32 = 1e-6;

impl<'a, F: Fn(NodeId) -> &'a [Link] + Sync> Refiner<'a, F> {
    /// The decision on a pair; `known` is its link if it has one.
    pub(super) fn decide(
        &self,
        source: NodeId,
        receiver: NodeId,
        known: Option<&Link>,
        out: &mut Refinement,
    ) -> Decision {
        let weight = self.weight(receiver);
        if let Some(decision) = self.decide_by_plan(source, receiver, known, weight, out) {
            return decision;
        }
        if self.judge.kernel.is_own(source, receiver) {
            return self.decide_self(source, weight, known, out);
        }
        let mut random = self.random(source, receiver);
        let (irradiance, error, bound) = match self.judge.judge(source, receiver, &mut random) {
            Judgement::Nothing => return Decision::Drop,
            Judgement::Transfer {
                irradiance,
                error,
                bound,
            } => (irradiance, error, bound),
        };
        let fits = |error: f32| error * weight <= self.threshold;
        let divide = self.division(source, receiver);
        if let (false, Some(decision)) = (fits(error), divide) {
            return decision;
        }
        let link = match known {
            Some(link) => *link,
            None => {
                let ray_count = self.ray_count(irradiance * weight, MOST_RAYS);
                self.link(source, receiver, error, ray_count, out)
            }
        };
        if self.judge.kernel.is_too_near_for_tables(source, receiver) {
            // A few rays must not decide: among pairs of low visibility, only those without any hit would stay.
            return Decision::Keep(link.with_error(bound));
        }
        let visibility = link.light_factor();
        let partial = 2.0 * (visibility * (1.0 - visibility)).max(0.0).sqrt();
        let error = error * visibility.max(DOUBT) + PARTIAL_VISIBILITY * irradiance * partial;
        if let (false, Some(decision)) = (fits(error), self.division(source, receiver)) {
            return decision;
        }
        // The bound of the transfer, and twice the standard error of the visibility.
        let deviation = link.visibility_variance().sqrt();
        Decision::Keep(link.with_error(bound + 2.0 * deviation * irradiance))
    }

    /// The decision on a cluster and itself.
    fn decide_self(
        &self,
        cluster: NodeId,
        weight: f32,
        known: Option<&Link>,
        out: &mut Refinement,
    ) -> Decision {
        let judged = self.judge.judged_brightest(cluster);
        if judged <= 0.0 || self.faces_one_way(cluster) {
            return Decision::Drop;
        }
        // A few rays must not decide: among clusters that exchange little within themselves, only those without any hit
        // would stay.
        if judged * SELF_SHARE * weight > self.threshold {
            return Decision::DivideReceiver;
        }
        let fraction = match known {
            Some(link) => link.light_factor(),
            None => {
                out.ray_count += u64::from(SELF_RAYS);
                self.judge.sampler.seen_fraction(
                    cluster,
                    cluster,
                    SELF_RAYS,
                    &mut self.random(cluster, cluster),
                ) / self.judge.sampler.opacity(cluster)
            }
        };
        Decision::Keep(Link::over_tables(
            cluster,
            fraction,
            fraction,
            self.judge.brightest(cluster),
        ))
    }

    /// Whether all faces of a cluster have the same normal: then none sees another.
    fn faces_one_way(&self, cluster: NodeId) -> bool {
        let Kind::Cluster(index) = self.hierarchy().kind(cluster) else {
            return true;
        };
        let moments = &self.judge.kernel.tables.clusters[index];
        let vector = moments.area_vector();
        vector.length() >= (1.0 - SAME_DIRECTION) * moments.total().area()
    }

    /// Number of rays of a transfer, in proportion to its weighted irradiance over the threshold.
    fn ray_count(&self, weighted: f32, most: u32) -> u32 {
        let importance = weighted / self.threshold.max(f32::MIN_POSITIVE);
        (importance.min(64.0).ceil() as u32).clamp(LEAST_RAYS, most)
    }

    /// Which node to divide: the larger of those that can be divided; `None` where neither can.
    fn division(&self, source: NodeId, receiver: NodeId) -> Option<Decision> {
        let hierarchy = self.hierarchy();
        let can_divide_source = !hierarchy.children(source).is_empty();
        let can_divide_receiver = match hierarchy.kind(receiver) {
            Kind::Cluster(_) => true,
            Kind::Element(index) => {
                !hierarchy.mesh.elements[index].is_leaf()
                    || hierarchy.mesh.size_of_parts(index) >= self.min_area
            }
        };
        let prefers_source = hierarchy.radius(source) >= TIE * hierarchy.radius(receiver);
        match (can_divide_source, can_divide_receiver) {
            (true, true) => Some(if prefers_source {
                Decision::DivideSource
            } else {
                Decision::DivideReceiver
            }),
            (true, false) => Some(Decision::DivideSource),
            (false, true) => Some(Decision::DivideReceiver),
            (false, false) => None,
        }
    }

    /// Square root of the receiver's share of the area: squares of errors are summed over the area.
    fn weight(&self, receiver: NodeId) -> f32 {
        self.hierarchy().node_share_of_area(receiver).sqrt()
    }

    /// The link of a pair, with the visibility that `ray_count` rays estimate; near nodes get up to twice as many.
    pub(super) fn link(
        &self,
        source: NodeId,
        receiver: NodeId,
        error: f32,
        ray_count: u32,
        out: &mut Refinement,
    ) -> Link {
        let mut random = self.random(source, receiver);
        let hierarchy = self.hierarchy();
        let sampler = self.judge.sampler;
        let (visibility, of_area) = if self.judge.kernel.is_too_near_for_tables(source, receiver) {
            let ray_count = (2 * ray_count).clamp(*NEAR_RAYS.start(), *NEAR_RAYS.end());
            out.ray_count += u64::from(ray_count);
            let seen = sampler.seen_fraction(source, receiver, ray_count, &mut random);
            let expected = self.judge.kernel.mean_form_factor(source, receiver);
            let correction = if expected > 0.0 {
                (seen / expected).min(MOST_CORRECTION)
            } else {
                0.0
            };
            (correction, correction)
        } else {
            out.ray_count += u64::from(ray_count);
            sampler.visibility(source, receiver, ray_count, &mut random)
        };
        match (hierarchy.kind(source), hierarchy.kind(receiver)) {
            (Kind::Element(from), Kind::Element(to)) => {
                let form_factor = visibility * area_form_factor(self.judge.kernel, from, to);
                Link::between_elements(source, visibility, form_factor, error)
            }
            _ => Link::over_tables(source, visibility, of_area, error),
        }
    }
}

/// Unoccluded form factor from a receiving element to a source, 0…1; averaged over the receiver where they are near.
fn area_form_factor(kernel: Kernel<'_>, source: usize, receiver: usize) -> f32 {
    let hierarchy = kernel.hierarchy;
    let (from, to) = (
        &hierarchy.mesh.elements[source],
        &hierarchy.mesh.elements[receiver],
    );
    let normal = hierarchy.patch_of(receiver).normal;
    let distance = kernel.seen_at(from.centroid).distance(to.centroid);
    if distance > 2.0 * (from.radius + to.radius) {
        return kernel.element_form_factor(source, to.centroid, normal);
    }
    let points = inner_points(hierarchy.mesh.corners(receiver)).to_array();
    kernel.mean_element_form_factor(source, points, normal)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        hierarchy::{Hierarchy, Tables},
        scene::{SceneOptions, Sides, builtin},
    };

    #[test]
    fn form_factors_of_plates_are_those_of_closed_forms() {
        let perpendicular = (builtin::perpendicular_plates(), 0.200044);
        for (builder, expected) in [(builtin::plates(1.0), 0.199825), perpendicular] {
            let scene = builder
                .finish(&SceneOptions::with_sides(Sides::One))
                .unwrap();
            let mut hierarchy = Hierarchy::new(&scene, 30.0);
            for _ in 0..3 {
                let leaves: Vec<u32> = hierarchy.mesh.leaves().map(|leaf| leaf as u32).collect();
                hierarchy.mesh.divide(&leaves);
            }
            let kernel = Kernel {
                hierarchy: &hierarchy,
                tables: &Tables::default(),
                reading: None,
                image: None,
            };
            let emits = |leaf: &usize| hierarchy.patch_of(*leaf).emission.x > 0.0;
            let (sources, receivers): (Vec<usize>, Vec<usize>) =
                hierarchy.mesh.leaves().partition(emits);
            let sum: f32 = receivers
                .iter()
                .flat_map(|&receiver| sources.iter().map(move |&source| (source, receiver)))
                .map(|(source, receiver)| area_form_factor(kernel, source, receiver))
                .sum();
            let mean = sum / receivers.len() as f32;
            assert!(
                (mean / expected - 1.0).abs() < 0.01,
                "{mean} for {expected}"
            );
        }
    }
}
