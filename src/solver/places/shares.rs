//! Shares of the scene's area by element and by vertex.

use crate::hierarchy::Hierarchy;

/// Square root of an element's share of the area: the weight of an error on it.
pub(crate) fn share_root(hierarchy: &Hierarchy, element: usize) -> f32 {
    let area = hierarchy.mesh.elements[element].area_vector.length();
    hierarchy.share_of_area(element, area).sqrt()
}

/// The same by vertex, whose area is a third of that of the leaves about it.
pub(crate) fn vertex_share_roots(hierarchy: &Hierarchy) -> Vec<f32> {
    let mesh = &hierarchy.mesh;
    let shares = mesh.sums_about_vertices(|leaf| {
        hierarchy.share_of_area(leaf, mesh.elements[leaf].area_vector.length())
    });
    shares.into_iter().map(|sum| (sum / 3.0).sqrt()).collect()
}
