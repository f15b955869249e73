//! The error oracle: bounds or samples of the irradiance that a receiver gets from a source.
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
    /// From bounds over both nodes.
    Interval,
    /// From this many sample pairs.
    Samples(u32),
}

/// The oracle's judgement of a pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Judgement {
    /// No point of the source can light any point of the receiver.
    Nothing,
    /// Luminance of the irradiance, unoccluded.
    Transfer {
        /// Its expected value.
        irradiance: f32,
        /// Its variation over both nodes, for faces normal to the direction of the source. Decides about division.
        error: f32,
        /// Bound of the error of the irradiance pushed to any face, at any point of the receiver, against the exact
        /// unoccluded one. Guaranteed by `Interval` with tables read as `Bounded`; with `Samples` the range of the
        /// samples.
        bound: f32,
    },
}

/// Points nearer to a plane than this, relative to the pair's size, lie in it. Smaller, and rounding tilts flat meshes
/// so that they face themselves; larger, and real angles are lost.
pub(super) const IN_PLANE: f32 = 1e-5;

/// Judges pairs of nodes.
#[derive(Clone, Copy)]
pub struct Judge<'a> {
    /// Reads projected powers of sources and projected areas of receivers.
    pub kernel: Kernel<'a>,
    /// How errors are estimated.
    pub estimate: Estimate,
    /// Radiosity (luminance) that is added to every source when it is judged, at least 0. Light is scaled by sums of
    /// form factors, which must be right for dark sources, too; judged by their own light alone, these would have
    /// coarse links.
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

    /// Judge a pair of different nodes, neither of which is an ancestor of the other.
    pub fn judge(&self, source: NodeId, receiver: NodeId, random: &mut Random) -> Judgement {
        if !self.face_each_other(source, receiver) {
            return Judgement::Nothing;
        }
        match self.estimate {
            Estimate::Interval => self.interval(source, receiver),
            Estimate::Samples(count) => self.samples(source, receiver, count, random),
        }
    }

    /// Whether some point of each node can face the other.
    pub(super) fn face_each_other(&self, source: NodeId, receiver: NodeId) -> bool {
        let Some(image) = self.kernel.image else {
            let is_there = |point: Vec3| point;
            return self.can_face(source, receiver, is_there, |bounds| bounds)
                && self.can_face(receiver, source, is_there, |bounds| bounds);
        };
        let as_source = |point: Vec3| image.source_of(point);
        let as_seen = |point: Vec3| image.place(point);
        self.can_face(source, receiver, as_source, |bounds| {
            placed(bounds, as_source)
        }) && self.can_face(receiver, source, as_seen, |bounds| placed(bounds, as_seen))
    }

    /// Luminance of a quantity of light, with the ambient radiosity added.
    fn judged(&self, light: Vec4) -> f32 {
        luminance(light) + self.ambient * light.unit_response()
    }

    /// Luminance of the brightest patch of a node, with the ambient radiosity added.
    pub fn judged_brightest(&self, node: NodeId) -> f32 {
        self.judged(self.tables().brightest(self.hierarchy(), node))
    }

    /// Luminance of the brightest patch of a node.
    pub fn brightest(&self, node: NodeId) -> f32 {
        luminance(self.tables().brightest(self.hierarchy(), node))
    }

    /// Whether any face of `from` can face any point of `to`, which it sees where `place` and `placed` put points and boxes.
    fn can_face(
        &self,
        from: NodeId,
        to: NodeId,
        place: impl Fn(Vec3) -> Vec3,
        placed: impl Fn((Vec3, Vec3)) -> (Vec3, Vec3),
    ) -> bool {
        let hierarchy = self.hierarchy();
        match hierarchy.kind(from) {
            // Some corner of the other node, or of its box, must stand above the plane of the element.
            Kind::Element(index) => {
                let element = &hierarchy.mesh.elements[index];
                let normal = hierarchy.patch_of(index).normal;
                let least = IN_PLANE * (element.radius + hierarchy.radius(to));
                let height_of = |point: Vec3| (place(point) - element.centroid).dot(normal);
                match hierarchy.kind(to) {
                    // Some corner is at least as high as the centroid, which is cheaper to read.
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
                        let (min, max) = placed((cluster.min, cluster.max));
                        let (middle, half) = ((min + max) * 0.5, (max - min) * 0.5);
                        (middle - element.centroid).dot(normal) + half.dot(normal.abs()) > least
                    }
                }
            }
            // Along some axis the cluster must have projected area towards a part of the other node's box.
            Kind::Cluster(index) => {
                let cluster = &hierarchy.clusters[index];
                let (min, max) = placed(hierarchy.bounds(to));
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

    /// Judge by bounds of distance and direction.
    fn interval(&self, source: NodeId, receiver: NodeId) -> Judgement {
        let hierarchy = self.hierarchy();
        let brightest = self.judged_brightest(source);
        let to = self.kernel.source_of(hierarchy.centroid(receiver));
        let from = hierarchy.centroid(source);
        let reach = hierarchy.radius(source) + hierarchy.radius(receiver);
        let distance = from.distance(to);
        if distance <= reach {
            // The nodes may touch: any irradiance up to the radiosity of the brightest patch is possible.
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

    /// Bound of the error of a face's irradiance (luminance).
    ///
    /// At any point of the receiver, light of the source arrives along directions within an angle α of the one between
    /// the centres. So the irradiance of a face normal to it lies between (L − α T)/π far² and (U + α T)/π near², with
    /// T the total power and L, U the bounds of the table; the cosine at a face is off by at most α; and the spread of
    /// a near source adds half of itself.
    pub(super) fn bound(&self, source: NodeId, receiver: NodeId) -> f32 {
        let hierarchy = self.hierarchy();
        let brightest = self.brightest(source);
        let (from, to) = (
            self.tables().centre(hierarchy, source),
            self.kernel.source_of(hierarchy.centroid(receiver)),
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

    /// Judge by the paper's EstimateEnergy, per area of the receiver.
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
            let to = self.kernel.source_of(to);
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
        let toward_source = self.kernel.seen_direction(-unit);
        let turned = self.kernel.projected_power(receiver, toward_source).area();
        power * turned / (PI * squared * area)
    }
}

/// The box about a box whose points are moved by an isometry.
fn placed((min, max): (Vec3, Vec3), place: impl Fn(Vec3) -> Vec3) -> (Vec3, Vec3) {
    let (middle, half) = ((min + max) * 0.5, (max - min) * 0.5);
    let centre = place(middle);
    let along = |axis: Vec3| (place(middle + axis) - centre).abs();
    let reach = along(Vec3::X * half.x) + along(Vec3::Y * half.y) + along(Vec3::Z * half.z);
    (centre - reach, centre + reach)
}

/// Mean irradiance of a cluster that received all of this power itself.
pub(crate) fn self_irradiance(hierarchy: &Hierarchy, index: usize, power: Vec4) -> Vec4 {
    let area = hierarchy.clusters[index].area;
    if area > 0.0 {
        power * (1.0 / area)
    } else {
        Vec4::ZERO
    }
}
