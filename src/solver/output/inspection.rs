//! A query about a node and its answer: links, path, sum of form factors.

use glam::Vec3;

use crate::hierarchy::NodeId;

/// The node to inspect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Subject {
    /// The leaf of an element that contains a point: the element may be divided after the snapshot.
    Element {
        /// The element, as a node.
        node: NodeId,
        /// A point of it, frame units.
        point: Vec3,
    },
    /// A cluster.
    Cluster(NodeId),
}

/// The position of a node, frame units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The node.
    pub node: NodeId,
    /// Lower corner of its box.
    pub min: Vec3,
    /// Upper corner of its box.
    pub max: Vec3,
    /// Its centroid.
    pub centre: Vec3,
}

/// A link that lights the inspected node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InspectedLink {
    /// The sending node; equal to the receiver for light within a cluster.
    pub source: Place,
    /// The receiver of the link: the inspected node or an ancestor.
    pub receiver: Place,
    /// Factor of the unoccluded light (see [`Link::light_factor`](crate::transport::Link::light_factor)).
    pub visibility: f32,
    /// Its part of the irradiance of the inspected node, W/m², linear RGB.
    pub irradiance: Vec3,
    /// Its part of the sum of form factors, visibility included.
    pub form_factor: f32,
    /// Bound of the error of its irradiance of the inspected node (luminance), W/m²; of a cluster, at any face below it.
    pub error: f32,
}

/// One node on the path from the root.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathNode {
    /// Its position.
    pub place: Place,
    /// Depth; the root has 0. Elements continue below the clusters.
    pub level: u32,
    /// Number of its patches, or `None` for an element.
    pub patch_count: Option<u32>,
    /// Area of its patches, or its own, square frame units.
    pub area: f32,
    /// Luminance of the power that leaves it, over links and by sampled emission, W/m² times square frame units.
    pub power: f32,
    /// Mean direction of the power that links carry from it, a unit vector; +z if it has none.
    pub main_direction: Vec3,
    /// Lower and upper bound of the luminance of the projected power along that direction (eq. 8).
    pub power_bounds: [f32; 2],
    /// Number of links over which it receives.
    pub link_count: u32,
    /// Sum of their estimated errors (luminance of the irradiance).
    pub error: f32,
}

/// The answer to a query.
#[derive(Clone, Debug, PartialEq)]
pub struct Inspection {
    /// The query.
    pub subject: Subject,
    /// The last whole step.
    pub step: u32,
    /// All links that light the node, the strongest first.
    pub links: Vec<InspectedLink>,
    /// Irradiance over links: the sum of their parts, W/m².
    pub linked: Vec3,
    /// Direct irradiance of sampled emitters, W/m²; 0 for clusters.
    pub direct: Vec3,
    /// Sum of form factors: about 1 for a leaf of an enclosed scene; less for a cluster, whose descendants have links
    /// of their own.
    pub row_sum: f32,
    /// Bound of the error of the light over links, before it is scaled to the coverage (luminance of the irradiance,
    /// W/m²), for what the sources send: the kernel's by bounds, and twice the standard error of the visibilities. Of a
    /// cluster, the sum of the errors of the links.
    pub error_bound: f32,
    /// The path from the root to the inspected node.
    pub path: Vec<PathNode>,
}
