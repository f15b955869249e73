//! Light at vertices from that of leaves: a vertex takes the mean of the leaves that share it; vertices are not shared across
//! creases and borders of materials. Where linear interpolation between vertices errs, leaves are divided.

use glam::Vec4;

use super::reconstruct::LeafLight;
use crate::{
    hierarchy::Hierarchy,
    solver::{
        direct::SPREAD_SHARE,
        limits::Limits,
        places::{carry_over, project, share_root},
    },
    transport::luminance,
};

/// Weight of a contact element beside others at a vertex: links see it as a whole. Smaller, and rounding decides;
/// larger, and vertices beside contacts are too dark.
const CONTACT_TRUST: f32 = 1e-3;

/// Linked irradiance at each vertex: the area-weighted mean of the leaves about it. It is multiplied by `factors`, or by 1 if
/// they are empty. Vertices that only prevent cracks take the mean of the ends of their edge.
pub(crate) fn vertex_means(
    hierarchy: &Hierarchy,
    leaves: &[LeafLight],
    factors: &[Vec4],
) -> Vec<Vec4> {
    let count = hierarchy.mesh.vertices.len();
    let mut irradiance = vec![Vec4::ZERO; count];
    let mut weight = vec![0.0f32; count];
    // Sums over the leaves about each vertex.
    for leaf in leaves {
        let element = &hierarchy.mesh.elements[leaf.element as usize];
        let trust = if element.is_outside_solids() {
            1.0
        } else {
            CONTACT_TRUST
        };
        let area = (element.area_vector.length() * trust).max(f32::MIN_POSITIVE);
        for (&vertex, &value) in element.vertices.iter().zip(&leaf.corners) {
            irradiance[vertex as usize] += value * area;
            weight[vertex as usize] += area;
        }
    }
    // Patches that no light reaches receive nothing.
    for patch in hierarchy.active_patches().end..hierarchy.patches.len() {
        for &vertex in &hierarchy.mesh.elements[patch].vertices {
            weight[vertex as usize] += hierarchy.patches[patch].area;
        }
    }
    for index in (0..count).filter(|&index| weight[index] > 0.0) {
        irradiance[index] /= weight[index];
    }
    // Vertices of contact elements only, and the means of elements.
    carry_over(
        &hierarchy.mesh,
        |element, _| element.is_outside_solids(),
        &mut irradiance,
    );
    let centres = leaves
        .iter()
        .map(|leaf| (leaf.element as usize, leaf.centre))
        .filter(|&(element, _)| hierarchy.mesh.elements[element].is_outside_solids());
    project(hierarchy, &mut irradiance, centres);
    // The factors of the final gather.
    for (value, factor) in irradiance.iter_mut().zip(factors) {
        *value *= *factor;
    }
    for index in (0..count).filter(|&index| weight[index] <= 0.0) {
        if let Some([a, b]) = hierarchy.mesh.vertices[index].ends {
            // Ends were made before the vertices between them.
            irradiance[index] = (irradiance[a as usize] + irradiance[b as usize]) * 0.5;
        }
    }
    irradiance
}

/// Divide leaves whose linked light has an interpolation error above the tolerance. Returns whether memory allowed it;
/// otherwise none is divided.
pub(crate) fn divide_by_interpolation_error(
    hierarchy: &mut Hierarchy,
    found: &[LeafLight],
    limits: Limits,
    mean: f32,
) -> bool {
    let has_error = |light: &LeafLight| {
        let corners = light.corners.map(luminance);
        let [least, most] = [f32::min, f32::max].map(|of| corners.into_iter().fold(corners[0], of));
        let error = (luminance(light.centre) - corners.iter().sum::<f32>() / 3.0).abs();
        let weight = share_root(hierarchy, light.element as usize) / mean.max(f32::MIN_POSITIVE);
        hierarchy.mesh.size_of_parts(light.element as usize) >= limits.min_area
            && (error + SPREAD_SHARE * (most - least)) * weight > limits.tolerance
    };
    let divided = found.iter().filter(|light| has_error(light));
    let wanted: Vec<u32> = divided.map(|light| light.element).collect();
    let fits = hierarchy.mesh.fits(&wanted, limits.most_elements);
    if fits {
        hierarchy.mesh.divide(&wanted);
    }
    fits
}
