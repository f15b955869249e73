//! The way from the root to a node.

use crate::hierarchy::{Hierarchy, Kind, NodeId};

/// The path from the root to a node.
pub(crate) fn path_to(hierarchy: &Hierarchy, node: NodeId) -> Vec<NodeId> {
    let as_nodes = |clusters: Vec<usize>| clusters.into_iter().map(|at| NodeId(at as u32));
    match hierarchy.kind(node) {
        Kind::Cluster(index) => {
            let first_patch = hierarchy.clusters[index].start as usize;
            let mut path: Vec<NodeId> =
                as_nodes(hierarchy.clusters_over(first_patch).collect()).collect();
            // All ancestors of its first patch that are not descendants of the cluster.
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
