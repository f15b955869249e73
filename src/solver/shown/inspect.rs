//! What a solve knows of one node: the links that light it, and the clusters above it.
//!
//! A leaf receives over its own links and those of everything above it. Each link is read at the leaf's centroid, as
//! `reconstruct` reads it, so that the shares add to the light that is shown. A cluster is read as one receiver: the
//! mean over its faces of what its links, and those above, bring to its centroid.

use std::f32::consts::PI;

use glam::{Vec3, Vec4};

use crate::{
    hierarchy::{Hierarchy, Kind, NodeId, Reading},
    solver::{
        ClusterBox, InspectedLink, Inspection, PathNode, Place, Subject,
        coverage::Closures,
        direct::Surfaces,
        iteration::LinkedLight,
        vertices::{LeafLight, link_irradiance, own_irradiance},
    },
    transport::{Kernel, Link, luminance},
};

/// What is looked into.
#[derive(Clone, Copy)]
pub(crate) struct Inspector<'a> {
    /// The nodes, and the light that falls on them straight from emitters.
    pub surfaces: Surfaces<'a>,
    /// Light over links.
    pub linked: &'a LinkedLight,
    /// How tables are read.
    pub reading: Option<Reading>,
    /// What form factors are scaled to.
    pub closures: &'a Closures,
    /// What leaves found when they gathered last.
    pub leaves: &'a [LeafLight],
    /// Boxes of the clusters after the last whole step.
    pub boxes: &'a [ClusterBox],
    /// That step.
    pub step: u32,
}

impl<'a> Inspector<'a> {
    /// What is known of a node, or `None` where there is no such node.
    pub(crate) fn inspect(&self, subject: &Subject) -> Option<Inspection> {
        let hierarchy = self.hierarchy();
        let node = match *subject {
            Subject::Cluster(node) => (node.index() < hierarchy.clusters.len()).then_some(node)?,
            Subject::Element { node, point } => self.leaf_at(node, point)?,
        };
        let path = self.path_to(node);
        let mut links = self.links_along(&path, node);
        let row_sum = links.iter().map(|link| link.form_factor).sum();
        let (direct, scale) = match hierarchy.kind(node) {
            Kind::Element(leaf) => {
                let light: Vec3 = links.iter().map(|link| link.irradiance).sum();
                (
                    self.surfaces.direct(leaf).truncate(),
                    self.closure_scale(leaf, light.extend(row_sum)),
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
        self.linked.kernel(self.hierarchy(), self.reading)
    }

    /// The leaf below an element that holds a point of it.
    fn leaf_at(&self, node: NodeId, point: Vec3) -> Option<NodeId> {
        let base = self.hierarchy().clusters.len();
        let element = node.index().checked_sub(base)?;
        let leaf = self.hierarchy().mesh.leaf_at(element, point)?;
        Some(NodeId((base + leaf) as u32))
    }

    /// From the root to a node.
    fn path_to(&self, node: NodeId) -> Vec<NodeId> {
        let hierarchy = self.hierarchy();
        let as_nodes = |clusters: Vec<usize>| clusters.into_iter().map(|at| NodeId(at as u32));
        match hierarchy.kind(node) {
            Kind::Cluster(index) => {
                let first_patch = hierarchy.clusters[index].start as usize;
                let mut path: Vec<NodeId> =
                    as_nodes(hierarchy.clusters_over(first_patch).collect()).collect();
                // All clusters over its first patch that are not below it.
                path.retain(|above| *above <= node);
                path
            }
            Kind::Element(index) => {
                let elements = &hierarchy.mesh.elements;
                let mut below = vec![index];
                let mut at = index;
                while elements[at].parent != u32::MAX {
                    at = elements[at].parent as usize;
                    below.push(at);
                }
                let base = hierarchy.clusters.len();
                let mut path: Vec<NodeId> = as_nodes(
                    hierarchy
                        .clusters_over(elements[index].patch as usize)
                        .collect(),
                )
                .collect();
                path.extend(below.iter().rev().map(|at| NodeId((base + at) as u32)));
                path
            }
        }
    }

    /// The links of all nodes of a path, as its end receives over them; not yet scaled to the closure.
    fn links_along(&self, path: &[NodeId], node: NodeId) -> Vec<InspectedLink> {
        let kernel = self.kernel();
        let mut found = Vec::new();
        for &receiver in path {
            let place = self.place(receiver);
            for link in self.linked.links.of(receiver) {
                let share = match self.hierarchy().kind(node) {
                    Kind::Cluster(index) => mean_irradiance(kernel, index, receiver, link),
                    Kind::Element(leaf) => {
                        if link.source == receiver {
                            own_irradiance(kernel, receiver.index(), link)
                        } else {
                            let point = self.hierarchy().mesh.elements[leaf].centroid;
                            let normal = self.hierarchy().patch_of(leaf).normal;
                            link_irradiance(kernel, link, point, normal)
                        }
                    }
                };
                found.push(InspectedLink {
                    source: self.place(link.source),
                    receiver: place,
                    visibility: link.visibility,
                    irradiance: share.truncate(),
                    form_factor: share.w,
                    error: link.error,
                });
            }
        }
        found
    }

    /// By what the light of a leaf, with its form factors in `w`, is scaled in all so that they add to the closure.
    fn closure_scale(&self, leaf: usize, light: Vec4) -> Vec3 {
        if self.leaves.is_empty() {
            return Vec3::ONE;
        }
        let elements = &self.hierarchy().mesh.elements;
        let cell_of = |element| self.closures.cell(self.hierarchy(), element);
        let cell = cell_of(leaf);
        let sums = self
            .leaves
            .iter()
            .filter(|other| cell_of(other.element as usize) == cell)
            .fold((0.0, 0.0), |(areas, rows), other| {
                let area = elements[other.element as usize].area_vector.length();
                (areas + area, rows + area * other.centre.w)
            });
        let patch = elements[leaf].patch as usize;
        let nearby = self.closures.nearby(&self.linked.power, patch);
        let scaled = self.closures.of(cell).scaled(light, sums, nearby);
        let ratio = (scaled / light).truncate();
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
            // Boxes are renewed with each whole step.
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

    /// Bounds of the linked power along a direction; those of an element are one.
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

/// Mean irradiance over the faces of a cluster, at its centroid, by a link of itself or of a cluster above.
fn mean_irradiance(kernel: Kernel<'_>, index: usize, receiver: NodeId, link: &Link) -> Vec4 {
    let hierarchy: &Hierarchy = kernel.hierarchy;
    let cluster = &hierarchy.clusters[index];
    if link.source == receiver {
        // Light within a cluster comes from everywhere alike.
        return own_irradiance(kernel, receiver.index(), link);
    }
    let incident = kernel.vector_irradiance(link.source, cluster.centroid);
    let moments = &kernel.tables.clusters[index];
    let area = cluster.area.max(f32::MIN_POSITIVE);
    // The shares that faces take by `Incident::on_face`, in the mean.
    let reading = kernel.reading.unwrap_or(Reading::Bounded);
    let towards = incident.towards_source;
    let facing = moments.project(towards, reading).w / area;
    let cosine = Vec3::from_array(moments.linear.map(|along| along.w)).dot(towards) / area;
    let share = facing * (1.0 - incident.spread) + 0.5 * (1.0 + cosine) * incident.spread;
    incident.strength * (link.transmission() * share)
}

/// By which links are ordered: luminance of what they bring.
fn strength(link: &InspectedLink) -> f32 {
    luminance(link.irradiance.extend(0.0))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{
        scene::{SceneOptions, Sides, builtin},
        solver::{Cancel, SolveSettings, Solver},
    };

    fn solved(name: &str, settings: SolveSettings) -> Solver {
        let options = SceneOptions {
            sides: Sides::One,
            ..SceneOptions::default()
        };
        let scene = builtin::builtin(name, &options)
            .expect("the scene is valid")
            .expect("the scene is known");
        let mut solver = Solver::new(Arc::new(scene), settings, None, &Cancel::default())
            .expect("nobody cancels");
        while !solver
            .step(&Cancel::default())
            .expect("nobody cancels")
            .is_final
        {}
        solver
    }

    fn inspect_leaf(solver: &Solver, leaf: usize) -> Inspection {
        let element = &solver.hierarchy.mesh.elements[leaf];
        // Asked for by its patch: the leaf must be found by the point.
        let node = NodeId(solver.hierarchy.clusters.len() as u32 + element.patch);
        let point = element.centroid;
        let inspection = solver.inspect(&Subject::Element { node, point });
        inspection.expect("the patch exists")
    }

    #[test]
    fn links_of_a_leaf_add_to_the_light_that_is_shown() {
        let solver = solved("cornell", SolveSettings::draft());
        assert!(solver.leaves.len() > 100);
        for light in solver.leaves.iter().step_by(7) {
            let inspection = inspect_leaf(&solver, light.element as usize);
            let expected = light.centre.truncate();
            // Sums of some hundred terms in another order.
            let slack = 1e-3 * expected.max_element() + 1e-9;
            assert!(
                (inspection.linked - expected).abs().max_element() <= slack,
                "element {}: {} instead of {expected}",
                light.element,
                inspection.linked
            );
            assert!((inspection.row_sum - light.centre.w).abs() <= 1e-3);
            let ordered = inspection
                .links
                .is_sorted_by(|a, b| strength(a) >= strength(b));
            assert!(ordered, "the strongest come first");
            let error: f32 = inspection.path.iter().map(|node| node.error).sum();
            assert!((error - light.error).abs() <= 1e-3 * light.error + 1e-9);
        }
    }

    #[test]
    fn a_path_leads_from_the_root_through_nested_boxes() {
        let solver = solved("cornell", SolveSettings::draft());
        let base = solver.hierarchy.clusters.len();
        let leaf = solver.leaves[solver.leaves.len() / 2].element as usize;
        let inspection = inspect_leaf(&solver, leaf);
        let path = &inspection.path;
        assert_eq!(path[0].place.node, Hierarchy::ROOT);
        assert_eq!(path[path.len() - 1].place.node.index(), base + leaf);
        // Corners of divided elements are midpoints, rounded.
        let slack = Vec3::splat(1e-4);
        for pair in path.windows(2) {
            let (above, below) = (pair[0].place, pair[1].place);
            assert!(
                solver
                    .hierarchy
                    .children(above.node)
                    .contains(&below.node.0)
            );
            assert!(above.min.cmple(below.min + slack).all());
            assert!(above.max.cmpge(below.max - slack).all());
            assert!(pair[0].area >= pair[1].area * 0.999);
            assert_eq!(pair[0].level + 1, pair[1].level);
        }
        for node in path {
            let [least, most] = node.power_bounds;
            let value = luminance(
                solver
                    .linked
                    .kernel(&solver.hierarchy, Some(Reading::Bounded))
                    .projected_power(node.place.node, node.main_direction),
            );
            let slack = 1e-4 * most + 1e-9;
            assert!(least <= value + slack && value <= most + slack, "{node:?}");
            assert!(node.power.is_finite() && node.power >= 0.0);
        }
        let receivers = inspection.links.iter().map(|link| link.receiver.node);
        for receiver in receivers {
            assert!(path.iter().any(|node| node.place.node == receiver));
        }
    }

    #[test]
    fn rows_of_a_closed_scene_add_to_one() {
        let solver = solved("furnace", SolveSettings::normal());
        let leaves: Vec<usize> = solver.hierarchy.mesh.leaves().collect();
        let mut sum = 0.0;
        for &leaf in &leaves {
            let row = inspect_leaf(&solver, leaf).row_sum;
            assert!((row - 1.0).abs() < 0.1, "element {leaf}: {row}");
            sum += row;
        }
        let mean = sum / leaves.len() as f32;
        assert!((mean - 1.0).abs() < 0.02, "{mean}");
    }

    #[test]
    fn a_cluster_receives_over_its_own_links_and_those_above() {
        let solver = solved("cornell", SolveSettings::draft());
        for index in 0..solver.hierarchy.clusters.len() {
            let node = NodeId(index as u32);
            let inspection = solver.inspect(&Subject::Cluster(node)).expect("it exists");
            let count: u32 = inspection.path.iter().map(|node| node.link_count).sum();
            assert_eq!(inspection.links.len(), count as usize);
            let last = inspection.path.last().map(|last| last.place.node);
            assert_eq!(last, Some(node));
            assert!(inspection.linked.is_finite() && inspection.linked.min_element() >= 0.0);
            // What comes over clusters is a part of what comes at all.
            assert!(
                inspection.row_sum < 1.2,
                "cluster {index}: {}",
                inspection.row_sum
            );
        }
        let beyond = NodeId(solver.hierarchy.clusters.len() as u32);
        assert!(solver.inspect(&Subject::Cluster(beyond)).is_none());
    }

    #[test]
    fn boxes_tell_who_sends_and_the_power_of_sampled_lamps() {
        let solver = solved("cornell", SolveSettings::draft());
        assert!(solver.direct.is_some(), "the lamp is sampled");
        let boxes = &solver.snapshot.clusters;
        let clusters = solver.hierarchy.clusters.len();
        let sent: u32 = boxes.iter().map(|shown| shown.source_count).sum();
        let of_clusters = solver.linked.links.all().iter();
        let expected = of_clusters
            .filter(|link| link.source.index() < clusters)
            .count();
        assert_eq!(sent as usize, expected);
        let emitted: f32 = solver
            .hierarchy
            .patches
            .iter()
            .map(|patch| luminance((patch.emission * PI).extend(0.0)) * patch.area)
            .sum();
        let reflected = luminance(solver.linked.power.clusters[0].total());
        assert!((boxes[0].power - emitted - reflected).abs() <= 1e-3 * boxes[0].power);
        // The lamp looks down, and nothing emits upwards.
        let linked = solver.linked.power.clusters[0].six_faces().map(luminance);
        let added: Vec<f32> = boxes[0]
            .face_power
            .iter()
            .zip(linked)
            .map(|(a, b)| a - b)
            .collect();
        let slack = 1e-3 * boxes[0].power;
        assert!(
            (added.iter().sum::<f32>() - emitted).abs() < slack,
            "{added:?}"
        );
        assert!(
            added.iter().filter(|part| **part > slack).count() == 1,
            "{added:?}"
        );
    }
}
