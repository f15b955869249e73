//! The places at which light of the mesh is evaluated: near the corners of leaves, and at their centroids.

use std::ops::Range;

use glam::Vec3;

use crate::{
    geometry::RAY_OFFSET,
    hierarchy::{Element, Hierarchy},
    scene::TriangleId,
};

/// Share of the way to the centroid at which light of a corner is evaluated: exactly on an edge, a neighbour at an
/// angle would be seen edge-on, or the place would be inside the object that stands on it. Smaller, and rounding
/// decides that; larger, and corners get light of another place.
pub(crate) const INSET: f32 = 0.02;

/// Least distance from the edges at which light of a wide element is evaluated: rays do not see surfaces nearer than
/// [`RAY_OFFSET`], and walls often stand on edges. Smaller, and light leaks through walls; larger, and corners of small
/// elements get light of another place.
const CLEARANCE: f32 = 2.0 * RAY_OFFSET;

/// Largest share of the way to the centroid for that distance. Larger, and small elements get light of another place;
/// smaller, and narrow ones along walls get light from behind these.
const MOST_INSET: f32 = 0.2;

/// A place at which light is evaluated.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Receiver {
    /// A point of a surface, frame units.
    pub point: Vec3,
    /// Unit normal there.
    pub normal: Vec3,
    /// The triangle that the point lies on.
    pub triangle: TriangleId,
}

/// Share of the way to the centroid at which light of the corners of an element is evaluated, 0…1.
pub(crate) fn inset(element: &Element, [a, b, c]: [Vec3; 3]) -> f32 {
    let longest = (a - b).length().max((b - c).length()).max((c - a).length());
    // From the centroid to an edge is a third of the height above that.
    let distance = 2.0 / 3.0 * element.area_vector.length() / longest.max(f32::MIN_POSITIVE);
    if distance * INSET >= CLEARANCE {
        INSET
    } else {
        (CLEARANCE / distance.max(f32::MIN_POSITIVE)).min(MOST_INSET)
    }
}

/// The place of each wanted vertex of the leaves among some elements: near the vertex, inside the leaf whose normal is
/// nearest to the mean normal about the vertex; leaves that are outside solids at that corner come first.
pub(crate) fn vertex_places(
    hierarchy: &Hierarchy,
    elements: Range<usize>,
    is_wanted: &[bool],
) -> Vec<(u32, Receiver)> {
    let mesh = &hierarchy.mesh;
    // The leaves about the wanted vertices, and mean normals there.
    let about_wanted: Vec<usize> = mesh
        .leaves_among(elements)
        .filter(|&leaf| {
            let corners = mesh.elements[leaf].vertices;
            corners.iter().any(|&vertex| is_wanted[vertex as usize])
        })
        .collect();
    let mut normals = vec![Vec3::ZERO; mesh.vertices.len()];
    for &leaf in &about_wanted {
        for &vertex in &mesh.elements[leaf].vertices {
            normals[vertex as usize] += mesh.elements[leaf].area_vector;
        }
    }
    // The best leaf by vertex.
    /// The fitness of a leaf, and its index.
    type Choice = ((bool, f32), u32);
    let mut chosen: Vec<Option<Choice>> = vec![None; mesh.vertices.len()];
    for leaf in about_wanted
        .into_iter()
        .filter(|&leaf| mesh.is_active(leaf))
    {
        let (element, normal) = (&mesh.elements[leaf], hierarchy.patch_of(leaf).normal);
        for (side, vertex) in element.vertices.into_iter().enumerate() {
            let vertex = vertex as usize;
            let fitness = (
                !element.is_inside_solid_at(side),
                normals[vertex].dot(normal),
            );
            let is_best = chosen[vertex].is_none_or(|(best, _)| fitness > best);
            if is_best && is_wanted[vertex] {
                chosen[vertex] = Some((fitness, leaf as u32));
            }
        }
    }
    // The place inside the chosen leaf.
    let receiver = |(vertex, choice): (usize, Option<Choice>)| {
        let (_, leaf) = choice?;
        let patch = hierarchy.patch_of(leaf as usize);
        let element = &mesh.elements[leaf as usize];
        let inset = inset(element, mesh.corners(leaf as usize));
        let point = mesh.position(vertex as u32).lerp(element.centroid, inset);
        let normal = normals[vertex].try_normalize().unwrap_or(patch.normal);
        Some((
            vertex as u32,
            Receiver {
                point,
                normal,
                triangle: patch.triangle,
            },
        ))
    };
    chosen
        .into_iter()
        .enumerate()
        .filter_map(receiver)
        .collect()
}

/// The centroid of an element.
pub(crate) fn centre_of(hierarchy: &Hierarchy, element: usize) -> Receiver {
    let patch = hierarchy.patch_of(element);
    Receiver {
        point: hierarchy.mesh.elements[element].centroid,
        normal: patch.normal,
        triangle: patch.triangle,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        geometry::barycentric_in_plane,
        scene::{
            Scene,
            builtin::{empty_cornell, furnace},
            test_shapes::one_sided,
        },
    };

    fn divided(scene: &Scene) -> Hierarchy {
        let mut hierarchy = Hierarchy::new(scene, 30.0);
        let leaves: Vec<u32> = hierarchy.mesh.leaves().map(|leaf| leaf as u32).collect();
        hierarchy.mesh.divide(&leaves);
        hierarchy
    }

    #[test]
    fn places_of_vertices_lie_inside_an_element_about_them() {
        for scene in [one_sided(furnace(0.5, 1.0, 2)), one_sided(empty_cornell())] {
            let hierarchy = divided(&scene);
            let mesh = &hierarchy.mesh;
            let wanted: Vec<bool> = (0..mesh.vertices.len())
                .map(|vertex| vertex % 3 > 0)
                .collect();
            let places = vertex_places(&hierarchy, 0..mesh.elements.len(), &wanted);
            let expected = wanted.iter().filter(|is_wanted| **is_wanted).count();
            assert_eq!(places.len(), expected, "each vertex once");
            for (vertex, receiver) in places {
                assert!(wanted[vertex as usize]);
                assert!((receiver.normal.length() - 1.0).abs() < 1e-5);
                let mut leaves = mesh.leaves().filter(|&leaf| {
                    mesh.elements[leaf].vertices.contains(&vertex)
                        && hierarchy.patch_of(leaf).triangle == receiver.triangle
                });
                let is_inside = |leaf: usize| {
                    let at = barycentric_in_plane(receiver.point, mesh.corners(leaf));
                    at.min_element() > 0.5 * INSET / 3.0
                };
                assert!(leaves.any(is_inside), "vertex {vertex}");
            }
        }
    }

    #[test]
    fn narrow_elements_are_evaluated_further_inside() {
        // Of a triangle of height h over its longest edge, the centroid is h / 3 away from that.
        let hierarchy = divided(&one_sided(furnace(0.5, 1.0, 1)));
        let element = hierarchy.mesh.elements[0];
        let inset_of = |height: f32| {
            let corners = [Vec3::ZERO, Vec3::X, Vec3::new(0.5, height, 0.0)];
            let area_vector = Vec3::Z * (0.5 * height);
            inset(
                &Element {
                    area_vector,
                    ..element
                },
                corners,
            )
        };
        assert_eq!(inset_of(0.5), INSET);
        assert_eq!(inset_of(1e-9), MOST_INSET);
        // At least the clearance between.
        let height = 3.0 * CLEARANCE / (0.5 * (INSET + MOST_INSET));
        let distance = inset_of(height) * height / 3.0;
        assert!((distance / CLEARANCE - 1.0).abs() < 1e-3, "{distance}");
    }
}
