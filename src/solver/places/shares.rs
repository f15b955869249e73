//! What light at an element or a vertex counts: by its share of the scene's area, and beside what is emitted there.

use std::f32::consts::PI;

use glam::Vec3;

use crate::hierarchy::{Hierarchy, luminance};

/// Smallest part of the light leaving a vertex for which a part of the irradiance is computed well: the light that a lamp
/// reflects is not visible beside its emission. Smaller costs rays; larger leaves noise and errors of links on bright
/// surfaces.
pub(crate) const LEAST_PART: f32 = 0.1;

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

/// By vertex, the irradiance (luminance) for which the elements about it would reflect as much light as they emit.
pub(crate) fn emitted_as_irradiance(hierarchy: &Hierarchy) -> Vec<f32> {
    let mesh = &hierarchy.mesh;
    let power = |leaf: usize, radiosity: Vec3| {
        mesh.elements[leaf].area_vector.length() * luminance(radiosity.extend(0.0))
    };
    let emitted = mesh.sums_about_vertices(|leaf| power(leaf, hierarchy.emission_of(leaf) * PI));
    let reflected = mesh.sums_about_vertices(|leaf| power(leaf, hierarchy.reflectance_of(leaf)));
    let ratios = emitted.into_iter().zip(reflected);
    ratios
        .map(|(emitted, reflected)| emitted / reflected.max(f32::MIN_POSITIVE))
        .collect()
}
