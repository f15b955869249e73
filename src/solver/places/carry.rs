//! Values at vertices: carried over to vertices without a value, and projected to the means of elements.

use glam::Vec4;

use crate::hierarchy::{Element, Hierarchy, Mesh};

/// Most elements over which light is carried: to vertices under an object, and to those beside them. Fewer leave dark
/// vertices; more cost time for vertices that are not visible.
const CARRIED: u32 = 2;

/// Give vertices of contact elements whose value is unknown the mean of the known vertices of these elements. The value
/// of a vertex is known if `is_known` holds for an element and its corner there (0…2).
pub(crate) fn carry_over(
    mesh: &Mesh,
    is_known: impl Fn(&Element, usize) -> bool,
    values: &mut [Vec4],
) {
    let is_contact = |leaf: &usize| mesh.elements[*leaf].is_contact();
    let contacts: Vec<usize> = mesh.active_leaves().filter(is_contact).collect();
    if contacts.is_empty() {
        return;
    }
    // Vertices whose value some leaf knows.
    let mut known = vec![false; values.len()];
    for leaf in mesh.active_leaves() {
        let element = &mesh.elements[leaf];
        for (side, vertex) in element.vertices.into_iter().enumerate() {
            known[vertex as usize] |= is_known(element, side);
        }
    }
    // Means over the contact elements, from known vertices to unknown ones.
    for _ in 0..CARRIED {
        let mut sums = vec![(Vec4::ZERO, 0.0f32); values.len()];
        for &leaf in &contacts {
            let element = &mesh.elements[leaf];
            let area = element.area_vector.length();
            let (from, to): (Vec<usize>, Vec<usize>) = element
                .vertices
                .into_iter()
                .map(|vertex| vertex as usize)
                .partition(|&vertex| known[vertex]);
            for &from in &from {
                for &to in &to {
                    sums[to].0 += values[from] * area;
                    sums[to].1 += area;
                }
            }
        }
        for (vertex, (sum, weight)) in sums.into_iter().enumerate() {
            if weight > 0.0 {
                (values[vertex], known[vertex]) = (sum / weight, true);
            }
        }
    }
}

/// Weight of the centroid in the quadrature rule of degree 2 over a triangle; the corners share the rest.
const CENTRE_SHARE: f32 = 0.75;

/// Change the values of vertices so that their linear interpolation has the means of the elements. Vertices lie in
/// corners and at contacts, where light is less: without the change all surfaces would be too dark. `centres` has the
/// index of each element with a value at its centroid, and that value. Values stay within the range of those about
/// them.
pub(crate) fn project(
    hierarchy: &Hierarchy,
    values: &mut [Vec4],
    centres: impl Iterator<Item = (usize, Vec4)>,
) {
    let mut moves = vec![(Vec4::ZERO, Vec4::INFINITY, Vec4::NEG_INFINITY); values.len()];
    let areas = hierarchy.mesh.areas_about_vertices();
    for (element, centre) in centres {
        let element = &hierarchy.mesh.elements[element];
        let (corners, area) = (element.vertices, element.area_vector.length());
        let [a, b, c] = corners.map(|vertex| values[vertex as usize]);
        let missing = (centre - (a + b + c) / 3.0) * (CENTRE_SHARE * area);
        let (least, most) = (a.min(b).min(c).min(centre), a.max(b).max(c).max(centre));
        for vertex in corners {
            let (sum, lower, upper) = &mut moves[vertex as usize];
            *sum += missing;
            (*lower, *upper) = (lower.min(least), upper.max(most));
        }
    }
    for ((value, (sum, lower, upper)), area) in values.iter_mut().zip(moves).zip(areas) {
        if area > 0.0 && lower.x <= upper.x {
            *value = (*value + sum / area).clamp(lower, upper);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{builtin::furnace, test_shapes::one_sided};

    fn hierarchy() -> Hierarchy {
        let mut hierarchy = Hierarchy::new(&one_sided(furnace(0.5, 1.0, 1)), 30.0);
        let leaves: Vec<u32> = hierarchy.mesh.leaves().map(|leaf| leaf as u32).collect();
        hierarchy.mesh.divide(&leaves);
        hierarchy
    }

    #[test]
    fn unknown_vertices_of_contacts_take_the_mean_of_known_ones() {
        let mut hierarchy = hierarchy();
        let leaf = hierarchy.mesh.leaves().next().unwrap();
        hierarchy.mesh.elements[leaf].inside_solid = 0b0001;
        let [hidden, b, c] = hierarchy.mesh.elements[leaf].vertices;
        // The value of the hidden vertex is unknown to all elements about it.
        let mut values: Vec<Vec4> = (0..hierarchy.mesh.vertices.len())
            .map(|vertex| Vec4::splat(vertex as f32 + 1.0))
            .collect();
        let before = values.clone();
        let is_known = |element: &Element, side: usize| element.vertices[side] != hidden;
        carry_over(&hierarchy.mesh, is_known, &mut values);
        let mean = (before[b as usize] + before[c as usize]) * 0.5;
        for (vertex, (value, before)) in values.iter().zip(&before).enumerate() {
            let expected = if vertex == hidden as usize {
                mean
            } else {
                *before
            };
            assert!((*value - expected).abs().max_element() < 1e-5, "{vertex}");
        }
    }

    #[test]
    fn projection_brings_linear_interpolation_to_the_means_of_elements() {
        let hierarchy = hierarchy();
        let elements = &hierarchy.mesh.elements;
        let total = |values: &[Vec4]| -> f32 {
            let of_leaf = |leaf: usize| {
                let corners = elements[leaf]
                    .vertices
                    .map(|vertex| values[vertex as usize].x);
                corners.iter().sum::<f32>() / 3.0 * elements[leaf].area_vector.length()
            };
            hierarchy.mesh.leaves().map(of_leaf).sum()
        };
        // Centroids that are brighter than all corners: the rule of degree 2 gives a quarter to the corners.
        let mut values = vec![Vec4::splat(1.0); hierarchy.mesh.vertices.len()];
        let area = total(&values);
        let centres = hierarchy.mesh.leaves().map(|leaf| (leaf, Vec4::splat(2.0)));
        project(&hierarchy, &mut values, centres);
        assert!((total(&values) / area - 1.75).abs() < 1e-4);
        assert!(values.iter().all(|value| (1.0..=2.0).contains(&value.x)));
        // Centroids that agree change nothing.
        let mut even = vec![Vec4::splat(3.0); values.len()];
        let centres = hierarchy.mesh.leaves().map(|leaf| (leaf, Vec4::splat(3.0)));
        project(&hierarchy, &mut even, centres);
        assert!(even.iter().all(|value| (value.x - 3.0).abs() < 1e-5));
    }
}
