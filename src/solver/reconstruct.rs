//! From links to light at vertices.
//!
//! Each leaf gathers once more, over its own links and those of everything above it, now at its own place and not at
//! the clusters' centroids: light of clusters at its centroid, light of links to elements at each of its corners. A
//! vertex takes the mean of the leaves that share it, so light is never carried over a crease or a material border.

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::{
    Cancel,
    closure::{Closure, Closures},
};
use crate::{
    hierarchy::{Hierarchy, Kind, NodeId},
    transport::{Kernel, Link, LinkStore, self_irradiance},
};

/// Corners are moved this share of the way to the centroid before light is evaluated there: exactly on an edge, a
/// neighbour at an angle would be seen edge-on, or from within the object that stands on it.
pub(super) const INSET: f32 = 0.02;

/// What a leaf found.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LeafLight {
    /// The leaf.
    pub element: u32,
    /// Linked irradiance at its corners.
    pub corners: [Vec4; 3],
    /// Linked irradiance at its centroid.
    pub centre: Vec4,
    /// Sum of the errors of its links (luminance).
    pub error: f32,
}

/// Linked irradiance of all leaves, in the order of the tree; `None` when cancelled.
pub(super) fn gather_leaves(
    kernel: Kernel<'_>,
    links: &LinkStore,
    closures: &Closures,
    cancel: &Cancel,
) -> Option<Vec<LeafLight>> {
    let hierarchy = kernel.hierarchy;
    let leaf_clusters: Vec<usize> = (0..hierarchy.clusters.len())
        .filter(|&index| hierarchy.clusters[index].is_leaf())
        .collect();
    let found: Vec<Vec<LeafLight>> = leaf_clusters
        .par_iter()
        .with_min_len(8)
        .map(|&cluster| {
            let mut found = Vec::new();
            if cancel.is_cancelled() {
                return found;
            }
            let chain = chain_above(hierarchy, links, cluster);
            for patch in hierarchy.clusters[cluster].patches() {
                let first = found.len();
                gather_patch(kernel, links, &chain, patch, &mut found);
                // Leaves come depth first, so those of a cell follow each other.
                let cell = |leaf: &LeafLight| closures.cell(hierarchy, leaf.element as usize);
                for leaves in found[first..].chunk_by_mut(|a, b| cell(a) == cell(b)) {
                    scale_to_closure(hierarchy, closures.of(cell(&leaves[0])), leaves);
                }
            }
            found
        })
        .collect();
    cancel.proceed()?;
    Some(found.into_iter().flatten().collect())
}

/// Scale the light of the leaves of one cell so that their form factors add to the closure.
fn scale_to_closure(hierarchy: &Hierarchy, closure: Closure, leaves: &mut [LeafLight]) {
    let sums = leaves.iter().fold((0.0, 0.0), |(areas, rows), leaf| {
        let area = hierarchy.mesh.elements[leaf.element as usize]
            .area_vector
            .length();
        (areas + area, rows + area * leaf.centre.w)
    });
    for leaf in leaves {
        for value in leaf.corners.iter_mut().chain([&mut leaf.centre]) {
            *value = (value.truncate() * closure.factor_for(value.w, sums)).extend(value.w);
        }
    }
}

/// The links of a cluster and of all above it, each with the cluster that receives over it.
fn chain_above<'a>(
    hierarchy: &Hierarchy,
    links: &'a LinkStore,
    cluster: usize,
) -> Vec<(usize, &'a [Link])> {
    let mut chain = Vec::new();
    let mut at = cluster;
    loop {
        let here = links.of(NodeId(at as u32));
        if !here.is_empty() {
            chain.push((at, here));
        }
        match hierarchy.clusters[at].parent {
            u32::MAX => return chain,
            parent => at = parent as usize,
        }
    }
}

/// Light of all leaves of one patch.
fn gather_patch(
    kernel: Kernel<'_>,
    links: &LinkStore,
    chain: &[(usize, &[Link])],
    patch: usize,
    found: &mut Vec<LeafLight>,
) {
    let hierarchy = kernel.hierarchy;
    let normal = hierarchy.patches[patch].normal;
    let base = hierarchy.clusters.len() as u32;
    let mut path: Vec<&[Link]> = Vec::new();
    // Elements with the length of the path above them: depth first, without recursion.
    let mut pending = vec![(patch, 0)];
    while let Some((index, depth)) = pending.pop() {
        let element = &hierarchy.mesh.elements[index];
        path.truncate(depth);
        path.push(links.of(NodeId(base + index as u32)));
        if !element.is_leaf() {
            pending.extend(
                (0..4)
                    .rev()
                    .map(|child| (element.first_child as usize + child, depth + 1)),
            );
            continue;
        }
        let mut light = LeafLight {
            element: index as u32,
            ..LeafLight::default()
        };
        for &(receiver, links) in chain {
            for link in links {
                light.error += link.error;
                light.centre += chain_irradiance(kernel, receiver, link, element.centroid, normal);
            }
        }
        light.corners = [light.centre; 3];
        let corners = hierarchy
            .mesh
            .corners(index)
            .map(|corner| corner.lerp(element.centroid, INSET));
        for link in path.iter().copied().flatten() {
            light.error += link.error;
            let transmission = match hierarchy.kind(link.source) {
                Kind::Cluster(_) => link.transmission(),
                Kind::Element(_) => Vec4::splat(link.visibility),
            };
            light.centre += kernel.irradiance(link.source, element.centroid, normal) * transmission;
            for (sum, &corner) in light.corners.iter_mut().zip(&corners) {
                *sum += kernel.irradiance(link.source, corner, normal) * transmission;
            }
        }
        found.push(light);
    }
}

/// What a face receives over a link of a cluster above it.
pub(super) fn chain_irradiance(
    kernel: Kernel<'_>,
    receiver: usize,
    link: &Link,
    point: Vec3,
    normal: Vec3,
) -> Vec4 {
    if link.source.index() == receiver {
        return self_irradiance(
            kernel.hierarchy,
            receiver,
            kernel.tables.clusters[receiver].total(),
        ) * link.transmission();
    }
    debug_assert!(
        !matches!(kernel.hierarchy.kind(link.source), Kind::Cluster(index) if index == receiver)
    );
    kernel.irradiance(link.source, point, normal) * link.transmission()
}

/// Area-weighted means of the leaves about each vertex.
pub(super) struct VertexMeans {
    /// Linked irradiance.
    pub irradiance: Vec<Vec4>,
    /// Sum of link errors.
    pub error: Vec<f32>,
}

impl VertexMeans {
    /// Average what leaves found over the vertices that they share. Vertices that only close an edge take the mean of
    /// its ends.
    pub(super) fn new(hierarchy: &Hierarchy, leaves: &[LeafLight]) -> Self {
        let count = hierarchy.mesh.vertices.len();
        let (mut irradiance, mut error) = (vec![Vec4::ZERO; count], vec![0.0f32; count]);
        let mut weight = vec![0.0f32; count];
        for leaf in leaves {
            let element = &hierarchy.mesh.elements[leaf.element as usize];
            let area = element.area_vector.length().max(f32::MIN_POSITIVE);
            for (&vertex, &value) in element.vertices.iter().zip(&leaf.corners) {
                irradiance[vertex as usize] += value * area;
                error[vertex as usize] += leaf.error * area;
                weight[vertex as usize] += area;
            }
        }
        for index in 0..count {
            if weight[index] > 0.0 {
                irradiance[index] /= weight[index];
                error[index] /= weight[index];
            } else if let Some([a, b]) = hierarchy.mesh.vertices[index].ends {
                // Ends were made before the vertices between them.
                irradiance[index] = (irradiance[a as usize] + irradiance[b as usize]) * 0.5;
                error[index] = (error[a as usize] + error[b as usize]) * 0.5;
            }
        }
        Self { irradiance, error }
    }
}
