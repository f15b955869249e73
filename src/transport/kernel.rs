//! What a source sends to a point: eqs 11–15 of the paper for every kind of pair.
//!
//! A cluster is seen from its centroid through its directional table. An element that is near is integrated exactly,
//! since the point-to-point kernel grows without bound where faces touch.

use std::f32::consts::PI;

use glam::{Vec3, Vec4};

use crate::{
    geometry::{Vectors4, centroid, irradiance_vector, point_irradiance, point_irradiances},
    hierarchy::{Channels as _, Hierarchy, Kind, Moments, NodeId, Quantity as _, Reading, Tables},
};

/// Where on the way to its corners a receiver is looked at, beside its centroid.
const TOWARDS_CORNER: f32 = 0.6;

/// An element nearer than this many of its radii is integrated exactly.
/// At 4 the point kernel errs by about 1 %; much larger, and most links pay for arctangents.
const NEAR: f32 = 4.0;

/// A vector irradiance: light that arrives at a point, and where from.
///
/// The paper's has one direction. That is wrong for a source that is as near as it is large: faces edge-on to its centre
/// would get nothing, though half of it stands above their horizon. `spread` tells which part comes from a whole
/// half-space instead, and gives a face at angle θ the share (1 + cos θ)/2.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Incident {
    /// Unit direction from the receiving point towards the source: −r of the paper.
    pub towards_source: Vec3,
    /// Irradiance of a face that looks that way.
    pub strength: Vec4,
    /// Part of it that comes from everywhere in the half-space about the direction, 0…1; 0 in the paper's methods.
    pub spread: f32,
}

impl Incident {
    /// Irradiance of a face of unit normal (eq. 15).
    pub fn on_face(&self, normal: Vec3) -> Vec4 {
        let cosine = self.towards_source.dot(normal);
        self.strength * (cosine.max(0.0) * (1.0 - self.spread) + 0.5 * (1.0 + cosine) * self.spread)
    }

    /// Add it, times a transmission, to the moments of what arrives.
    pub fn add_to(&self, moments: &mut Moments<Vec4>, transmission: Vec4) {
        moments.add_spread(
            self.towards_source,
            self.strength * transmission,
            self.spread,
        );
    }
}

/// A cluster as it looks from about a point: what it sends there, by which its light is known at all points near by.
#[derive(Clone, Copy, Debug)]
pub struct Sight {
    /// Where the power comes from.
    pub(super) centre: Vec3,
    /// Projected power along the way to the point.
    pub(super) power: Vec4,
    /// Largest radiosity.
    pub(super) brightest: Vec4,
    /// Square of the radius over which the light spreads, 0 if it does not.
    pub(super) extent: f32,
}

impl Sight {
    /// Vector irradiance at a point so near to that of the sight that the power along the way is the same.
    pub fn incident(&self, point: Vec3) -> Incident {
        let separation = point - self.centre;
        let squared = separation.length_squared();
        let towards_source = -separation / squared.sqrt();
        if squared <= 0.0 || !towards_source.is_finite() {
            return Incident::default();
        }
        Incident {
            towards_source,
            strength: (self.power * (1.0 / (PI * squared))).saturated(self.brightest),
            spread: spread(self.extent, squared),
        }
    }
}

/// Share of the light of a source of this squared extent that comes from the half-space about the way to it; 0…1.
fn spread(extent: f32, squared_distance: f32) -> f32 {
    (extent / squared_distance.max(f32::MIN_POSITIVE)).min(1.0)
}

/// Reads the source tables of a hierarchy by one method.
#[derive(Clone, Copy)]
pub struct Kernel<'a> {
    /// Where the nodes are.
    pub hierarchy: &'a Hierarchy,
    /// What they send.
    pub tables: &'a Tables,
    /// How moments are read; `None` sums over the patches of a cluster (eq. 3).
    pub reading: Option<Reading>,
}

impl Kernel<'_> {
    /// ProjectPower (eq. 8): the power that a node sends along a unit direction, per unit solid angle and times π.
    pub fn projected_power(&self, node: NodeId, unit: Vec3) -> Vec4 {
        match self.hierarchy.kind(node) {
            Kind::Cluster(index) => self.cluster_power(index, unit),
            Kind::Element(index) => {
                self.tables.elements[index]
                    * self.hierarchy.mesh.elements[index]
                        .area_vector
                        .dot(unit)
                        .max(0.0)
            }
        }
    }

    /// Lower and upper bound of the power that a node sends along a unit direction, whatever the reading.
    pub fn power_bounds(&self, node: NodeId, unit: Vec3) -> (Vec4, Vec4) {
        match self.hierarchy.kind(node) {
            Kind::Cluster(index) => self.tables.clusters[index].bounds(unit),
            Kind::Element(_) => {
                let power = self.projected_power(node, unit);
                (power, power)
            }
        }
    }

    fn cluster_power(&self, index: usize, unit: Vec3) -> Vec4 {
        if let Some(reading) = self.reading {
            return self.tables.clusters[index].project(unit, reading);
        }
        let mut sum = Vec4::ZERO;
        for patch in self.hierarchy.clusters[index].patches() {
            sum += self.tables.elements[patch]
                * self.hierarchy.patches[patch].area_vector.dot(unit).max(0.0);
        }
        sum
    }

    /// A cluster as it looks from about a point.
    pub fn sight(&self, cluster: usize, point: Vec3) -> Sight {
        let centre = self.tables.centres[cluster];
        let extent = self.extent(self.hierarchy.clusters[cluster].radius);
        let separation = point - centre;
        let squared = separation.length_squared();
        let unit = separation / squared.sqrt();
        let spread = spread(extent, squared);
        let power = if squared <= 0.0 || !unit.is_finite() {
            Vec4::ZERO
        } else if spread == 0.0 {
            self.cluster_power(cluster, unit)
        } else {
            self.tables.clusters[cluster].project_spread(unit, spread)
        };
        Sight {
            centre,
            power,
            brightest: self.tables.brightest[cluster],
            extent,
        }
    }

    /// Square of the radius over which the light of a node spreads: the paper's methods take it for a point.
    fn extent(&self, radius: f32) -> f32 {
        match self.reading {
            Some(Reading::Bounded) => radius * radius,
            _ => 0.0,
        }
    }

    /// Vector irradiance (eq. 14, unoccluded) of a node at a point. Near the source the strength saturates towards its
    /// brightest patch, as that of a disc does exactly on its axis: A/π r² becomes A/(π r² + A).
    pub fn vector_irradiance(&self, source: NodeId, point: Vec3) -> Incident {
        match self.hierarchy.kind(source) {
            Kind::Cluster(index) => self.sight(index, point).incident(point),
            Kind::Element(index) => {
                let squared = point.distance_squared(self.tables.centre(self.hierarchy, source));
                let spread = spread(self.extent(self.hierarchy.radius(source)), squared);
                let vector = element_vector(self.hierarchy, index, point);
                let length = vector.length();
                let towards_source = if length > 0.0 {
                    vector / length
                } else {
                    Vec3::ZERO
                };
                Incident {
                    towards_source,
                    strength: self.tables.elements[index] * length,
                    spread,
                }
            }
        }
    }

    /// Mean form factor (unoccluded) from the patches of a receiver to a source, as tables tell it: what the receiver's
    /// links would give if everything sent 1.
    pub fn mean_form_factor(&self, source: NodeId, receiver: NodeId) -> f32 {
        let point = self.hierarchy.centroid(receiver);
        match self.hierarchy.kind(receiver) {
            Kind::Element(index) => {
                let normal = self.hierarchy.patch_of(index).normal;
                self.irradiance(source, point, normal).form_factor_sum()
            }
            Kind::Cluster(index) => {
                let incident = self.vector_irradiance(source, point);
                let moments = &self.tables.clusters[index];
                let area = moments.total().area();
                let vector = moments.area_vector();
                let facing = self.cluster_power(index, incident.towards_source).area();
                let cosine = vector.dot(incident.towards_source);
                let about = 0.5 * (area + cosine);
                if area > 0.0 {
                    incident.strength.form_factor_sum()
                        * (facing * (1.0 - incident.spread) + about * incident.spread)
                        / area
                } else {
                    0.0
                }
            }
        }
    }

    /// Irradiance (eqs 12 and 15, unoccluded) of a face of unit normal at a point.
    pub fn irradiance(&self, source: NodeId, point: Vec3, normal: Vec3) -> Vec4 {
        match self.hierarchy.kind(source) {
            Kind::Cluster(_) => self.vector_irradiance(source, point).on_face(normal),
            Kind::Element(index) => {
                self.tables.elements[index]
                    * element_form_factor(self.hierarchy, index, point, normal)
            }
        }
    }

    /// As [`Self::irradiance`], at four points of one unit normal.
    pub fn irradiances(&self, source: NodeId, points: &Vectors4, normal: Vec3) -> [Vec4; 4] {
        match self.hierarchy.kind(source) {
            Kind::Cluster(index) => points
                .to_array()
                .map(|point| self.sight(index, point).incident(point).on_face(normal)),
            Kind::Element(index) => {
                let normals = Vectors4::splat(normal);
                let factors = element_form_factors(self.hierarchy, index, points, &normals);
                let radiosity = self.tables.elements[index];
                // Written out: as a `map` it becomes a call for every link.
                [
                    radiosity * factors.x,
                    radiosity * factors.y,
                    radiosity * factors.z,
                    radiosity * factors.w,
                ]
            }
        }
    }
}

/// Irradiance vector at a point of an element of radiosity 1 (eq. 14 for a patch).
fn element_vector(hierarchy: &Hierarchy, index: usize, point: Vec3) -> Vec3 {
    let element = &hierarchy.mesh.elements[index];
    let separation = point - element.centroid;
    let squared = separation.length_squared();
    if squared < NEAR * NEAR * element.radius * element.radius {
        return irradiance_vector(point, hierarchy.mesh.corners(index));
    }
    let projected = element.area_vector.dot(separation).max(0.0);
    -separation * (projected / (PI * squared * squared))
}

/// Form factor from a point with unit normal to an element (eq. 1 per area of the receiver), unoccluded; 0…1.
pub fn element_form_factor(hierarchy: &Hierarchy, index: usize, point: Vec3, normal: Vec3) -> f32 {
    let element = &hierarchy.mesh.elements[index];
    let separation = point - element.centroid;
    let squared = separation.length_squared();
    if squared < NEAR * NEAR * element.radius * element.radius {
        return point_irradiance(point, normal, hierarchy.mesh.corners(index));
    }
    let projected =
        element.area_vector.dot(separation).max(0.0) * (-separation.dot(normal)).max(0.0);
    projected / (PI * squared * squared)
}

/// As [`element_form_factor`], from each of four points with its unit normal.
pub fn element_form_factors(
    hierarchy: &Hierarchy,
    index: usize,
    points: &Vectors4,
    normals: &Vectors4,
) -> Vec4 {
    let element = &hierarchy.mesh.elements[index];
    let separation = *points - Vectors4::splat(element.centroid);
    let squared = separation.dot(&separation);
    let emitted = Vectors4::splat(element.area_vector).dot(&separation);
    let received = -separation.dot(normals);
    let projected = emitted.max(Vec4::ZERO) * received.max(Vec4::ZERO);
    let far = projected / (squared * squared * PI);
    let is_near = squared.cmplt(Vec4::splat(NEAR * NEAR * element.radius * element.radius));
    if is_near.any() {
        let exact = point_irradiances(points, normals, hierarchy.mesh.corners(index));
        Vec4::select(is_near, exact, far)
    } else {
        far
    }
}

/// The centroid of a triangle, and three points on the way to its corners. Weighed alike they are nearly a rule of degree
/// 2 whose points lie inside.
pub(super) fn inner_points(corners: [Vec3; 3]) -> Vectors4 {
    let middle = centroid(corners);
    let [a, b, c] = corners.map(|corner| middle.lerp(corner, TOWARDS_CORNER));
    Vectors4::new([middle, a, b, c])
}
