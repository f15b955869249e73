//! A question about a node and its answer: links, path, row sum. Plain values, for whoever draws them.

use glam::Vec3;

use crate::hierarchy::NodeId;

/// What to look into.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Subject {
    /// The leaf below an element that holds a point: elements may be divided between a picture and a question.
    Element {
        /// The element, as a node.
        node: NodeId,
        /// A point of it, frame units.
        point: Vec3,
    },
    /// A cluster.
    Cluster(NodeId),
}

/// Where a node is, frame units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The node.
    pub node: NodeId,
    /// Lower corner of its box.
    pub min: Vec3,
    /// Upper corner of its box.
    pub max: Vec3,
    /// The point that stands for it.
    pub centre: Vec3,
}

/// A link that lights what is inspected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InspectedLink {
    /// Where the light comes from; equal to the receiver for light within a cluster.
    pub source: Place,
    /// Who holds the link: what is inspected, or a node above it.
    pub receiver: Place,
    /// Unoccluded fraction, 0…1.
    pub visibility: f32,
    /// Its share of the irradiance of what is inspected, W/m², linear RGB.
    pub irradiance: Vec3,
    /// Its share of the sum of form factors, visibility included.
    pub form_factor: f32,
    /// Estimated error of the receiver's irradiance (luminance); infinite where it is not known.
    pub error: f32,
}

/// One node on the way from the root.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathNode {
    /// Where it is.
    pub place: Place,
    /// Depth; the root has 0. Elements go on below the clusters.
    pub level: u32,
    /// Patches below it, or `None` for an element.
    pub patch_count: Option<u32>,
    /// Area of its patches, or its own, square frame units.
    pub area: f32,
    /// Luminance of the power that leaves it, over links and over samples, frame units.
    pub power: f32,
    /// Where most of what links carry from it goes, a unit vector; +z where it goes everywhere alike.
    pub main_direction: Vec3,
    /// Lower and upper bound of the luminance of the power that links carry from it along that direction (eq. 8).
    pub power_bounds: [f32; 2],
    /// Links that it receives over.
    pub link_count: u32,
    /// Sum of their estimated errors (luminance irradiance).
    pub error: f32,
}

/// The answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Inspection {
    /// What was asked.
    pub subject: Subject,
    /// The last whole step.
    pub step: u32,
    /// All links that light it, the strongest first.
    pub links: Vec<InspectedLink>,
    /// Irradiance over links: the sum of their shares, W/m².
    pub linked: Vec3,
    /// Irradiance by samples, straight from emitters, W/m²; 0 for clusters.
    pub direct: Vec3,
    /// Sum of form factors. 1 for a leaf of a closed scene; a cluster also receives below itself, and has less.
    pub row_sum: f32,
    /// From the root to what is inspected.
    pub path: Vec<PathNode>,
}
