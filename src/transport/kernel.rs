//! What a source sends to a point: eqs 11–15 of the paper for every kind of pair.
//!
//! A cluster is seen from its centroid through its directional table. An element that is near is integrated exactly,
//! since the point-to-point kernel grows without bound where faces touch.

use std::f32::consts::PI;

use glam::Vec3;

use crate::{
    geometry::{irradiance_vector, point_irradiance},
    hierarchy::{Hierarchy, Kind, NodeId, Quantity, Reading, Tables},
};

/// An element nearer than this many of its radii is integrated exactly.
/// At 4 the point kernel errs by about 1 %; much larger, and most links pay for arctangents.
const NEAR: f32 = 4.0;

/// A vector irradiance: light that arrives at a point, and where from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Incident<Q> {
    /// Unit direction from the receiving point towards the source: −r of the paper.
    pub towards_source: Vec3,
    /// Irradiance of a face that looks that way.
    pub strength: Q,
}

/// Reads the source tables of a hierarchy by one method.
#[derive(Clone, Copy)]
pub struct Kernel<'a, Q> {
    /// Where the nodes are.
    pub hierarchy: &'a Hierarchy,
    /// What they send.
    pub tables: &'a Tables<Q>,
    /// How moments are read; `None` sums over the patches of a cluster (eq. 3).
    pub reading: Option<Reading>,
}

impl<Q: Quantity> Kernel<'_, Q> {
    /// ProjectPower (eq. 8): the power that a node sends along a unit direction, per unit solid angle and times π.
    pub fn projected_power(&self, node: NodeId, unit: Vec3) -> Q {
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

    fn cluster_power(&self, index: usize, unit: Vec3) -> Q {
        if let Some(reading) = self.reading {
            return self.tables.clusters[index].project(unit, reading);
        }
        let mut sum = Q::default();
        for patch in self.hierarchy.clusters[index].patches() {
            sum += self.tables.elements[patch]
                * self.hierarchy.patches[patch].area_vector.dot(unit).max(0.0);
        }
        sum
    }

    /// Vector irradiance (eq. 14, unoccluded) of a node at a point.
    /// No more than the brightest patch of the source gives when it fills the view.
    pub fn vector_irradiance(&self, source: NodeId, point: Vec3) -> Incident<Q> {
        match self.hierarchy.kind(source) {
            Kind::Cluster(index) => {
                let separation = point - self.hierarchy.clusters[index].centroid;
                let squared = separation.length_squared();
                let unit = separation / squared.sqrt();
                if squared <= 0.0 || !unit.is_finite() {
                    return Incident {
                        towards_source: Vec3::ZERO,
                        strength: Q::default(),
                    };
                }
                let strength = self.cluster_power(index, unit) * (1.0 / (PI * squared));
                Incident {
                    towards_source: -unit,
                    strength: strength.lower_of(self.tables.brightest[index]),
                }
            }
            Kind::Element(index) => {
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
                }
            }
        }
    }

    /// Irradiance (eqs 12 and 15, unoccluded) of a face of unit normal at a point.
    pub fn irradiance(&self, source: NodeId, point: Vec3, normal: Vec3) -> Q {
        match self.hierarchy.kind(source) {
            Kind::Cluster(_) => {
                let incident = self.vector_irradiance(source, point);
                incident.strength * incident.towards_source.dot(normal).max(0.0)
            }
            Kind::Element(index) => {
                self.tables.elements[index]
                    * element_form_factor(self.hierarchy, index, point, normal)
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
