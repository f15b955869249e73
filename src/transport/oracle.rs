//! Is a pair good enough? Bounds or samples of what a receiver gets from a source.
//!
//! `interval` bounds the transfer over all points of both nodes, from spheres about their centroids: the distance lies
//! in d ± (r_s + r_r), the direction in a cone of sine (r_s + r_r) / d, and a projection changes by at most its total
//! per radian. `samples` is the paper's EstimateEnergy: largest minus smallest transfer over p sample vectors.

use std::f32::consts::PI;

use glam::{Vec3, Vec4};

use super::{Kernel, PairSampler, luminance};
use crate::{
    geometry::Random,
    hierarchy::{Channels, Hierarchy, Kind, NodeId, Tables},
};

/// How errors are estimated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Estimate {
    /// From bounds.
    Interval,
    /// From this many sample pairs.
    Samples(u32),
}

/// What the oracle says of a pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Judgement {
    /// No point of the source can light any point of the receiver.
    Nothing,
    /// Luminance of the irradiance, unoccluded.
    Transfer {
        /// Its likely value.
        irradiance: f32,
        /// How far it may be off, or vary over the receiver, towards the source: what decides about division.
        error: f32,
        /// How far the irradiance that is pushed to any face, at any point of the receiver, may be from the unoccluded
        /// one. Guaranteed by `Interval` with tables read as `Bounded`; with `Samples` no more than they have seen.
        bound: f32,
    },
}

/// A point nearer to a plane than this, relative to the pair's size, lies in it: rounding tilts flat meshes.
const IN_PLANE: f32 = 1e-5;

/// Judges pairs of nodes.
#[derive(Clone, Copy)]
pub struct Judge<'a> {
    /// Reads what sources send, and the area that receivers show.
    pub kernel: Kernel<'a>,
    /// How errors are estimated.
    pub estimate: Estimate,
    /// Radiosity that everything is taken to have beside its own, 0 for none. Light is scaled by sums of form factors, so
    /// they must be known of dark sources, too: those that are judged by nothing but their light keep coarse links.
    pub ambient: f32,
    /// Draws sample points.
    pub sampler: PairSampler<'a>,
}

impl Judge<'_> {
    fn hierarchy(&self) -> &Hierarchy {
        self.kernel.hierarchy
    }

    fn tables(&self) -> &Tables {
        self.kernel.tables
    }

    /// Judge a pair of different nodes, neither above the other.
    pub fn judge(&self, source: NodeId, receiver: NodeId, random: &mut Random) -> Judgement {
        if !self.face_each_other(source, receiver) {
            return Judgement::Nothing;
        }
        match self.estimate {
            Estimate::Interval => self.interval(source, receiver),
            Estimate::Samples(count) => self.samples(source, receiver, count, random),
        }
    }

    /// Whether some point of each node can look at the other.
    pub(super) fn face_each_other(&self, source: NodeId, receiver: NodeId) -> bool {
        self.can_face(source, receiver) && self.can_face(receiver, source)
    }

    /// Whether two nodes may touch, and at least one of them is a cluster: then neither knows the other as more than a
    /// direction that may be any.
    pub fn is_too_near_for_tables(&self, source: NodeId, receiver: NodeId) -> bool {
        let hierarchy = self.hierarchy();
        let reach = hierarchy.radius(source) + hierarchy.radius(receiver);
        let are_elements = [source, receiver]
            .iter()
            .all(|&node| matches!(hierarchy.kind(node), Kind::Element(_)));
        !are_elements
            && hierarchy
                .centroid(source)
                .distance(hierarchy.centroid(receiver))
                <= reach
    }

    /// Luminance of a quantity of light as it is judged.
    fn judged(&self, light: Vec4) -> f32 {
        luminance(light) + self.ambient * light.unit_response()
    }

    /// Luminance of the brightest patch of a node, as it is judged.
    pub fn judged_brightest(&self, node: NodeId) -> f32 {
        self.judged(self.tables().brightest(self.hierarchy(), node))
    }

    /// Luminance of the brightest patch of a node.
    pub fn brightest(&self, node: NodeId) -> f32 {
        luminance(self.tables().brightest(self.hierarchy(), node))
    }

    /// Whether any face of `from` can look at any point of `to`.
    fn can_face(&self, from: NodeId, to: NodeId) -> bool {
        let hierarchy = self.hierarchy();
        match hierarchy.kind(from) {
            // Some corner of the other node, or of its box, must stand above the plane of the element.
            Kind::Element(index) => {
                let element = &hierarchy.mesh.elements[index];
                let normal = hierarchy.patch_of(index).normal;
                let least = IN_PLANE * (element.radius + hierarchy.radius(to));
                let height_of = |point: Vec3| (point - element.centroid).dot(normal);
                match hierarchy.kind(to) {
                    // Some corner is at least as high as the centroid, which is at hand.
                    Kind::Element(other) => {
                        height_of(hierarchy.mesh.elements[other].centroid) > least
                            || hierarchy
                                .mesh
                                .corners(other)
                                .iter()
                                .any(|&corner| height_of(corner) > least)
                    }
                    Kind::Cluster(other) => {
                        let cluster = &hierarchy.clusters[other];
                        let middle = (cluster.min + cluster.max) * 0.5;
                        let half = (cluster.max - cluster.min) * 0.5;
                        height_of(middle) + half.dot(normal.abs()) > least
                    }
                }
            }
            // Along some axis the cluster must show area towards a part of the other node's box.
            Kind::Cluster(index) => {
                let cluster = &hierarchy.clusters[index];
                let (min, max) = hierarchy.bounds(to);
                let (least, most) = (min - cluster.max, max - cluster.min);
                let faces = self.tables().clusters[index]
                    .six_faces()
                    .map(Channels::area);
                let slack = IN_PLANE * cluster.area;
                (0..3).any(|axis| {
                    (most[axis] > 0.0 && faces[2 * axis] > slack)
                        || (least[axis] < 0.0 && faces[2 * axis + 1] > slack)
                })
            }
        }
    }

    /// From bounds of distance and direction.
    fn interval(&self, source: NodeId, receiver: NodeId) -> Judgement {
        let hierarchy = self.hierarchy();
        let brightest = self.judged_brightest(source);
        let (from, to) = (hierarchy.centroid(source), hierarchy.centroid(receiver));
        let reach = hierarchy.radius(source) + hierarchy.radius(receiver);
        let distance = from.distance(to);
        if distance <= reach {
            // The nodes may touch: anything up to the brightest patch is possible.
            return Judgement::Transfer {
                irradiance: 0.5 * brightest,
                error: brightest,
                bound: self.brightest(source),
            };
        }
        let unit = (to - from) / distance;
        let total = self.judged(self.tables().power(hierarchy, source));
        let value = self.judged(self.kernel.projected_power(source, unit));
        let swing = total * (reach / distance).asin();
        let (near, far) = (distance - reach, distance + reach);
        let upper = ((value + swing).min(total) / (PI * near * near)).min(brightest);
        let lower = (value - swing).max(0.0) / (PI * far * far);
        let irradiance = (value / (PI * distance * distance)).min(brightest);
        Judgement::Transfer {
            irradiance,
            error: (upper - lower).max(0.0),
            bound: self.bound(source, receiver),
        }
    }

    /// Bound of the error of a face's irradiance.
    ///
    /// Seen from any point of the receiver, light of the source comes along directions within an angle α of the one
    /// between the centres. So what arrives per area facing it lies between (L − α T)/π far² and (U + α T)/π near², with
    /// T the total and L, U the bounds of the table; a cosine at the face is off by at most α; and the spread of a near
    /// source adds half of itself.
    pub(super) fn bound(&self, source: NodeId, receiver: NodeId) -> f32 {
        let hierarchy = self.hierarchy();
        let brightest = self.brightest(source);
        let (from, to) = (
            self.tables().centre(hierarchy, source),
            hierarchy.centroid(receiver),
        );
        // The centre of power need not be that of the sphere about the source.
        let offset = from.distance(hierarchy.centroid(source));
        let reach = hierarchy.radius(source) + hierarchy.radius(receiver) + offset;
        let distance = from.distance(to);
        if distance <= reach {
            return brightest;
        }
        let unit = (to - from) / distance;
        let total = luminance(self.tables().power(hierarchy, source));
        let (least, most) = self.kernel.power_bounds(source, unit);
        let tilt = (reach / distance).asin();
        let (near, far) = (distance - reach, distance + reach);
        let upper = (luminance(most) + tilt * total).min(total) / (PI * near * near);
        let lower = (luminance(least) - tilt * total).max(0.0) / (PI * far * far);
        let spread = (hierarchy.radius(source) / distance).powi(2);
        let bound = (upper - lower).max(0.0) + upper * (tilt + 0.5 * spread);
        bound.min(brightest)
    }

    /// The paper's EstimateEnergy, per area of the receiver.
    fn samples(
        &self,
        source: NodeId,
        receiver: NodeId,
        count: u32,
        random: &mut Random,
    ) -> Judgement {
        let hierarchy = self.hierarchy();
        let brightest = self.judged_brightest(source);
        let area = hierarchy.node_area(receiver);
        let (mut least, mut most, mut sum) = (f32::INFINITY, 0.0f32, 0.0);
        for _ in 0..count {
            let (from, _) = self.sampler.point_on(source, random);
            let (to, _) = self.sampler.point_on(receiver, random);
            let irradiance = self
                .transferred(source, receiver, to - from, area)
                .min(brightest);
            least = least.min(irradiance);
            most = most.max(irradiance);
            sum += irradiance;
        }
        Judgement::Transfer {
            irradiance: sum / count as f32,
            error: most - least.min(most),
            bound: most - least.min(most),
        }
    }

    /// Eq. 11 divided by the receiver's area: mean irradiance for one separation.
    fn transferred(&self, source: NodeId, receiver: NodeId, separation: Vec3, area: f32) -> f32 {
        let squared = separation.length_squared();
        let unit = separation / squared.sqrt();
        if squared <= 0.0 || !unit.is_finite() || area <= 0.0 {
            return f32::INFINITY;
        }
        let power = self.judged(self.kernel.projected_power(source, unit));
        power * self.kernel.projected_power(receiver, -unit).area() / (PI * squared * area)
    }
}

/// Mean irradiance that a cluster of the given power would give itself if all of its light fell on it.
pub(crate) fn self_irradiance(hierarchy: &Hierarchy, index: usize, power: Vec4) -> Vec4 {
    let area = hierarchy.clusters[index].area;
    if area > 0.0 {
        power * (1.0 / area)
    } else {
        Vec4::ZERO
    }
}
