//! Inspection of one node: the links that light it, and its ancestors.
//!
//! A leaf receives over its own links and those of its ancestors. Each link is evaluated at the leaf's centroid, as
//! `reconstruct` does, so that the parts add to the displayed light. A cluster is evaluated as one receiver: the mean
//! over its faces of the irradiance at its centroid over its own links and those of its ancestors.

#[cfg(test)]
mod tests;

use std::f32::consts::PI;

use glam::{Vec3, Vec4};

use super::{
    leaf_bounds::{BoundedLink, Bounding},
    path::path_to,
};
use crate::{
    hierarchy::{Channels as _, Hierarchy, Kind, NodeId, Reading},
    solver::{
        ClusterBox, InspectedLink, Inspection, PathNode, Place, Subject,
        coverage::CoverageMap,
        direct::Surfaces,
        iteration::LinkedLight,
        vertices::{LeafLight, own_irradiance},
    },
    transport::{Kernel, TintedLink, luminance},
};

/// The state that is inspected.
#[derive(Clone, Copy)]
pub(crate) struct Inspector<'a> {
    /// The nodes, with their direct light.
    pub surfaces: Surfaces<'a>,
    /// Light over links.
    pub linked: &'a LinkedLight,
    /// Bounds of the light over links, and the kernel that it follows from.
    pub bounding: Bounding<'a>,
    /// Coverage to which form factors are scaled.
    pub coverage: &'a CoverageMap,
    /// Linked light of the leaves when they gathered last.
    pub leaves: &'a [LeafLight],
    /// Figures of the clusters after the last whole step.
    pub boxes: &'a [ClusterBox],
    /// Number of that step.
    pub step: u32,
}

impl<'a> Inspector<'a> {
    /// Inspect a node; `None` if there is no such node.
    pub(crate) fn inspect(&self, subject: &Subject) -> Option<Inspection> {
        let hierarchy = self.hierarchy();
        let node = match *subject {
            Subject::Cluster(node) => (node.index() < hierarchy.clusters.len()).then_some(node)?,
            Subject::Element { node, point } => self.leaf_at(node, point)?,
        };
        let path = path_to(hierarchy, node);
        let (mut links, error_bound) = self.links_along(&path, node);
        let row_sum = links.iter().map(|link| link.form_factor).sum();
        let (direct, scale) = match hierarchy.kind(node) {
            Kind::Element(leaf) => {
                let light: Vec3 = links.iter().map(|link| link.irradiance).sum();
                (
                    self.surfaces.direct(leaf).color(),
                    self.coverage_scale(leaf, light.extend(row_sum)),
                )
            }
            Kind::Cluster(_) => (Vec3::ZERO, Vec3::ONE),
        };
        for link in &mut links {
            link.irradiance *= scale;
        }
        links.sort_by(|a, b| strength(b).total_cmp(&strength(a)));
        Some(Inspection {
            subject: *subject,
            step: self.step,
            linked: links.iter().map(|link| link.irradiance).sum(),
            direct,
            row_sum,
            error_bound,
            path: path
                .iter()
                .enumerate()
                .map(|(level, &node)| self.path_node(node, level as u32))
                .collect(),
            links,
        })
    }

    fn hierarchy(&self) -> &'a Hierarchy {
        self.surfaces.hierarchy
    }

    fn kernel(&self) -> Kernel<'a> {
        self.bounding.kernel
    }

    /// The leaf of an element that contains a point.
    fn leaf_at(&self, node: NodeId, point: Vec3) -> Option<NodeId> {
        let base = self.hierarchy().clusters.len();
        let element = node.index().checked_sub(base)?;
        let leaf = self.hierarchy().mesh.leaf_at(element, point)?;
        Some(NodeId((base + leaf) as u32))
    }

    /// The links of all nodes of a path with their irradiance at its last node, not yet scaled to the coverage, and the
    /// bound of the error of their sum.
    fn links_along(&self, path: &[NodeId], node: NodeId) -> (Vec<InspectedLink>, f32) {
        let (kernel, store) = (self.kernel(), &self.linked.links);
        let inspected = |link: TintedLink<'_>, receiver, share: Vec4, error| InspectedLink {
            source: self.place(link.source),
            receiver: self.place(receiver),
            visibility: link.light_factor(),
            irradiance: share.color(),
            form_factor: share.form_factor_sum(),
            error,
        };
        match self.hierarchy().kind(node) {
            Kind::Element(leaf) => {
                let bounds = self.bounding.leaf(path, leaf);
                let of = |bound: &BoundedLink<'_>| {
                    inspected(bound.link, bound.receiver, bound.irradiance, bound.error())
                };
                (bounds.links.iter().map(of).collect(), bounds.error())
            }
            Kind::Cluster(index) => {
                let mut found = Vec::new();
                for &receiver in path {
                    store.tinted(receiver).for_each(|link| {
                        let share = mean_irradiance(kernel, index, receiver, link);
                        found.push(inspected(link, receiver, share, link.error));
                    });
                }
                let error = found.iter().map(|link| link.error).sum();
                (found, error)
            }
        }
    }

    /// Factor by colour of the light of a leaf, with the sum of its form factors, so that these add to the coverage.
    fn coverage_scale(&self, leaf: usize, light: Vec4) -> Vec3 {
        if self.leaves.is_empty() {
            return Vec3::ONE;
        }
        let elements = &self.hierarchy().mesh.elements;
        let cell_of = |element| self.coverage.cell(self.hierarchy(), element);
        let cell = cell_of(leaf);
        let sums = self
            .leaves
            .iter()
            .filter(|other| cell_of(other.element as usize) == cell)
            .fold((0.0, 0.0), |(areas, rows), other| {
                let area = elements[other.element as usize].area_vector.length();
                (areas + area, rows + area * other.centre.form_factor_sum())
            });
        let patch = elements[leaf].patch as usize;
        let nearby = self.coverage.nearby(&self.linked.power, patch);
        let scaled = self
            .coverage
            .of(self.hierarchy(), leaf)
            .scaled(light, sums, nearby);
        let ratio = (scaled / light).color();
        Vec3::select(ratio.is_finite_mask(), ratio, Vec3::ONE)
    }

    fn place(&self, node: NodeId) -> Place {
        let (min, max) = self.hierarchy().bounds(node);
        Place {
            node,
            min,
            max,
            centre: self.hierarchy().centroid(node),
        }
    }

    fn path_node(&self, node: NodeId, level: u32) -> PathNode {
        let (patch_count, main_direction) = match self.hierarchy().kind(node) {
            Kind::Cluster(index) => {
                let cluster = &self.hierarchy().clusters[index];
                let linear = self.linked.power.clusters[index].linear.map(luminance);
                (
                    Some(cluster.end - cluster.start),
                    Vec3::from_array(linear).try_normalize().unwrap_or(Vec3::Z),
                )
            }
            Kind::Element(index) => (None, self.hierarchy().patch_of(index).normal),
        };
        let links = self.linked.links.of(node);
        PathNode {
            place: self.place(node),
            level,
            patch_count,
            area: self.hierarchy().node_area(node),
            power: self.power_of(node),
            main_direction,
            power_bounds: self.power_bounds(node, main_direction),
            link_count: links.len() as u32,
            error: links.iter().map(|link| link.error).sum(),
        }
    }

    /// Luminance of the power that leaves a node, sampled emission included.
    fn power_of(&self, node: NodeId) -> f32 {
        match self.hierarchy().kind(node) {
            // Figures of clusters are renewed with each whole step.
            Kind::Cluster(index) => self.boxes[index].power,
            Kind::Element(index) => {
                let emission = if self.surfaces.is_sampled(index) {
                    self.hierarchy().emission_of(index) * PI
                } else {
                    Vec3::ZERO
                };
                let radiosity = self.linked.power.elements[index] + emission.extend(0.0);
                luminance(radiosity) * self.hierarchy().node_area(node)
            }
        }
    }

    /// Lower and upper bound of the linked power along a direction; equal for an element.
    fn power_bounds(&self, node: NodeId, direction: Vec3) -> [f32; 2] {
        match self.hierarchy().kind(node) {
            Kind::Cluster(index) => {
                let (least, most) = self.linked.power.clusters[index].bounds(direction);
                [luminance(least), luminance(most)]
            }
            Kind::Element(_) => [luminance(self.kernel().projected_power(node, direction)); 2],
        }
    }
}

/// Mean irradiance over the faces of a cluster, at its centroid, over a link of itself or of an ancestor.
fn mean_irradiance(
    kernel: Kernel<'_>,
    index: usize,
    receiver: NodeId,
    link: TintedLink<'_>,
) -> Vec4 {
    let hierarchy: &Hierarchy = kernel.hierarchy;
    let cluster = &hierarchy.clusters[index];
    if link.source == receiver {
        // Light within a cluster is isotropic.
        return own_irradiance(kernel, receiver.index(), link);
    }
    let incident = kernel.vector_irradiance(link.source, cluster.centroid);
    let moments = &kernel.tables.clusters[index];
    let area = cluster.area.max(f32::MIN_POSITIVE);
    // The mean over the faces of `Incident::on_face`.
    let reading = kernel.reading.unwrap_or(Reading::Bounded);
    let towards = incident.towards_source;
    let facing = moments.project(towards, reading).area() / area;
    let cosine = moments.area_vector().dot(towards) / area;
    let share = facing * (1.0 - incident.spread) + 0.5 * (1.0 + cosine) * incident.spread;
    incident.strength * (link.tinted_transmission() * share)
}

/// Luminance of the irradiance over a link, by which links are ordered.
fn strength(link: &InspectedLink) -> f32 {
    luminance(link.irradiance.extend(0.0))
}
