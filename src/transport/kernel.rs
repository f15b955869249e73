//! The irradiance that a source causes at a point: eqs 11–15 of the paper for every kind of pair.
//!
//! A cluster sends its projected power, by its directional table, from its centre. A near element is integrated
//! exactly, since the point-to-point kernel grows without bound where faces touch.

use std::f32::consts::PI;

use glam::{Vec3, Vec4};

use crate::{
    geometry::{Image, Vectors4, centroid, irradiance_vector, point_irradiance, point_irradiances},
    hierarchy::{Channels as _, Hierarchy, Kind, Moments, NodeId, Quantity as _, Reading, Tables},
};

/// Share of the way from the centroid to the corners at which a receiver is evaluated, beside its centroid. Smaller,
/// and the variation over the receiver is missed; larger, and edges that touch the source count too much.
const TOWARDS_CORNER: f32 = 0.6;

/// Elements nearer than this many of their radii are integrated exactly. Smaller, and the point-to-point kernel is
/// wrong by more than the 1 % that it is at 4; larger, and most links pay for arctangents.
const NEAR: f32 = 4.0;

/// A vector irradiance: the light that arrives at a point, and its direction.
///
/// The paper's has one direction. That is wrong for a source that is as near as it is large: faces edge-on to its
/// centre would get nothing, though half of it stands above their horizon. `spread` is the part that comes from a whole
/// half-space instead; a face at angle θ receives the share (1 + cos θ)/2 of it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Incident {
    /// Unit direction from the receiving point towards the source: −r of the paper.
    pub towards_source: Vec3,
    /// Irradiance of a face with that normal.
    pub strength: Vec4,
    /// Part of it that comes uniformly from the half-space about the direction, 0…1; 0 in the paper's methods.
    pub spread: f32,
}

impl Incident {
    /// Irradiance of a face with this unit normal (eq. 15).
    pub fn on_face(&self, normal: Vec3) -> Vec4 {
        let cosine = self.towards_source.dot(normal);
        self.strength * (cosine.max(0.0) * (1.0 - self.spread) + 0.5 * (1.0 + cosine) * self.spread)
    }

    /// Add this irradiance, times a transmission, to moments of incident light.
    pub fn add_to(&self, moments: &mut Moments<Vec4>, transmission: Vec4) {
        moments.add_spread(
            self.towards_source,
            self.strength * transmission,
            self.spread,
        );
    }
}

/// A cluster as seen from a point: its projected power in that direction, from which its irradiance at all points near
/// by follows.
#[derive(Clone, Copy, Debug)]
pub struct Sight {
    /// Where the power comes from.
    pub(super) centre: Vec3,
    /// Projected power in the direction of the point.
    pub(super) power: Vec4,
    /// Largest radiosity.
    pub(super) brightest: Vec4,
    /// Square of the radius of the source; 0 where it counts as a point.
    pub(super) extent: f32,
}

impl Sight {
    /// Vector irradiance at a point near enough to that of the sight for the projected power to be the same.
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

/// Part of the light of a source of this squared radius that counts as uniform over the half-space about the direction
/// to it; 0…1.
fn spread(extent: f32, squared_distance: f32) -> f32 {
    (extent / squared_distance.max(f32::MIN_POSITIVE)).min(1.0)
}

/// The transport kernel: reads the source tables of a hierarchy by one method.
#[derive(Clone, Copy)]
pub struct Kernel<'a> {
    /// Where the nodes are.
    pub hierarchy: &'a Hierarchy,
    /// Their radiosities and moments.
    pub tables: &'a Tables,
    /// How moments are read; `None` sums over the patches of a cluster (eq. 3).
    pub reading: Option<Reading>,
    /// The image of the sources that receivers see instead of them, without what mirrors take of its light. A mirrored source
    /// has the same tables, read in mirrored directions.
    pub image: Option<&'a Image>,
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

    /// The place of a source that a place of receivers stands for.
    #[inline]
    pub(super) fn source_of(&self, place: Vec3) -> Vec3 {
        self.image.map_or(place, |image| image.source_of(place))
    }

    /// The same of directions.
    #[inline]
    pub(super) fn source_direction(&self, direction: Vec3) -> Vec3 {
        self.image
            .map_or(direction, |image| image.source_direction(direction))
    }

    /// Where receivers see a place of a source.
    #[inline]
    pub(super) fn seen_at(&self, point: Vec3) -> Vec3 {
        self.image.map_or(point, |image| image.place(point))
    }

    /// In which direction they see one.
    #[inline]
    pub(super) fn seen_direction(&self, direction: Vec3) -> Vec3 {
        self.image
            .map_or(direction, |image| image.direction(direction))
    }

    /// Where receivers see the centre of the power of a cluster.
    #[inline]
    pub fn centre(&self, cluster: usize) -> Vec3 {
        self.seen_at(self.tables.centres[cluster])
    }

    /// A cluster as seen from a point.
    #[inline]
    pub fn sight(&self, cluster: usize, point: Vec3) -> Sight {
        if let Some(image) = self.image {
            return self.sight_in(image, cluster, point);
        }
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

    /// Square of the radius of a node as a source: 0 in the paper's methods, which take it for a point.
    fn extent(&self, radius: f32) -> f32 {
        match self.reading {
            Some(Reading::Bounded) => radius * radius,
            _ => 0.0,
        }
    }

    /// Vector irradiance (eq. 14, unoccluded) of a node at a point. Near the source the strength saturates towards the
    /// radiosity of its brightest patch, as that of a disc does on its axis: A/π r² becomes A/(π r² + A).
    pub fn vector_irradiance(&self, source: NodeId, point: Vec3) -> Incident {
        if let Some(image) = self.image {
            return self.vector_irradiance_in(image, source, point);
        }
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

    /// Mean unoccluded form factor from the patches of a receiver to a source by the tables: the irradiance over such a
    /// link if every radiosity were 1.
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

    /// Irradiance (eqs 12 and 15, unoccluded) of a face with this unit normal at a point.
    pub fn irradiance(&self, source: NodeId, point: Vec3, normal: Vec3) -> Vec4 {
        if let Some(image) = self.image {
            let (point, normal) = (image.source_of(point), image.source_direction(normal));
            return self.of_sources().irradiance(source, point, normal);
        }
        match self.hierarchy.kind(source) {
            Kind::Cluster(_) => self.vector_irradiance(source, point).on_face(normal),
            Kind::Element(index) => {
                self.tables.elements[index]
                    * element_form_factor(self.hierarchy, index, point, normal)
            }
        }
    }

    /// As [`Self::irradiance`], at four points with a unit normal each.
    pub fn irradiances(&self, source: NodeId, points: &Vectors4, normals: &Vectors4) -> [Vec4; 4] {
        if let Some(image) = self.image {
            return self.irradiances_in(image, source, points, normals);
        }
        match self.hierarchy.kind(source) {
            Kind::Cluster(index) => {
                let (points, normals) = (points.to_array(), normals.to_array());
                [0, 1, 2, 3].map(|lane| {
                    let sight = self.sight(index, points[lane]);
                    sight.incident(points[lane]).on_face(normals[lane])
                })
            }
            Kind::Element(index) => {
                let factors = element_form_factors(self.hierarchy, index, points, normals);
                let radiosity = self.tables.elements[index];
                // Written out: a `map` compiles to a call for every link.
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

impl Kernel<'_> {
    /// The same without an image: for receivers at the places of sources that theirs stand for.
    fn of_sources(&self) -> Self {
        Self {
            image: None,
            ..*self
        }
    }

    // Apart from the functions that call them: those run for every link of scenes without mirrors.

    #[cold]
    fn sight_in(&self, image: &Image, cluster: usize, point: Vec3) -> Sight {
        let sight = self.of_sources().sight(cluster, image.source_of(point));
        Sight {
            centre: image.place(sight.centre),
            ..sight
        }
    }

    #[cold]
    fn vector_irradiance_in(&self, image: &Image, source: NodeId, point: Vec3) -> Incident {
        let incident = self
            .of_sources()
            .vector_irradiance(source, image.source_of(point));
        Incident {
            towards_source: image.direction(incident.towards_source),
            ..incident
        }
    }

    #[cold]
    fn irradiances_in(
        &self,
        image: &Image,
        source: NodeId,
        points: &Vectors4,
        normals: &Vectors4,
    ) -> [Vec4; 4] {
        let points = points.to_array().map(|point| image.source_of(point));
        let normals = normals
            .to_array()
            .map(|normal| image.source_direction(normal));
        let (points, normals) = (Vectors4::new(points), Vectors4::new(normals));
        self.of_sources().irradiances(source, &points, &normals)
    }

    /// As the function of this name.
    pub(super) fn element_form_factor(&self, source: usize, point: Vec3, normal: Vec3) -> f32 {
        let (point, normal) = (self.source_of(point), self.source_direction(normal));
        element_form_factor(self.hierarchy, source, point, normal)
    }

    /// Mean of the form factors at four points of a normal.
    pub(super) fn mean_element_form_factor(
        &self,
        source: usize,
        points: [Vec3; 4],
        normal: Vec3,
    ) -> f32 {
        let points = Vectors4::new(points.map(|point| self.source_of(point)));
        let normals = Vectors4::splat(self.source_direction(normal));
        element_form_factors(self.hierarchy, source, &points, &normals).element_sum() * 0.25
    }

    /// Whether a pair is a cluster and itself, and not what a mirror shows it of itself.
    pub fn is_own(&self, source: NodeId, receiver: NodeId) -> bool {
        source == receiver && self.image.is_none()
    }

    /// Whether two nodes may touch and one of them at least is a cluster: then the direction between them is undetermined,
    /// and the tables say nothing.
    pub fn is_too_near_for_tables(&self, source: NodeId, receiver: NodeId) -> bool {
        let hierarchy = self.hierarchy;
        let reach = hierarchy.radius(source) + hierarchy.radius(receiver);
        let is_element = |&node: &NodeId| matches!(hierarchy.kind(node), Kind::Element(_));
        let centre = self.seen_at(hierarchy.centroid(source));
        !([source, receiver].iter().all(is_element))
            && centre.distance(hierarchy.centroid(receiver)) <= reach
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

/// The centroid of a triangle, and three points on the way to its corners. With equal weights they are nearly a
/// quadrature rule of degree 2 whose points lie inside.
pub(super) fn inner_points(corners: [Vec3; 3]) -> Vectors4 {
    let middle = centroid(corners);
    let [a, b, c] = corners.map(|corner| middle.lerp(corner, TOWARDS_CORNER));
    Vectors4::new([middle, a, b, c])
}
