//! How much of the area of the scene elements and vertices stand for.

use crate::hierarchy::Hierarchy;

/// Root of an element's share of the area: what an error on it counts.
pub(crate) fn share_root(hierarchy: &Hierarchy, element: usize) -> f32 {
    let area = hierarchy.mesh.elements[element].area_vector.length();
    hierarchy.share_of_area(element, area).sqrt()
}

/// The same for each vertex: a third of the leaves about it is its own.
pub(crate) fn vertex_share_roots(hierarchy: &Hierarchy) -> Vec<f32> {
    let mesh = &hierarchy.mesh;
    let shares = mesh.sums_about_vertices(|leaf| {
        hierarchy.share_of_area(leaf, mesh.elements[leaf].area_vector.length())
    });
    shares.into_iter().map(|sum| (sum / 3.0).sqrt()).collect()
}
