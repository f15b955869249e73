//! Values at vertices: carried over to those that nothing tells of, and moved until they add to what elements receive.

use glam::Vec4;

use crate::hierarchy::{Element, Hierarchy, Mesh};

/// Elements over which light is carried at most: vertices under an object and those beside them.
const CARRIED: u32 = 2;

/// Give vertices of elements that lie within a solid in part, at which no leaf `is_known` what its corner there receives,
/// the mean of those of these elements at which one does.
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
    // Vertices that some leaf tells of.
    let mut known = vec![false; values.len()];
    for leaf in mesh.active_leaves() {
        let element = &mesh.elements[leaf];
        for (side, vertex) in element.vertices.into_iter().enumerate() {
            known[vertex as usize] |= is_known(element, side);
        }
    }
    // Means over the elements in contact, from vertices that are known to those that are not.
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

/// Share of an element's mean that its centroid tells by the rule of degree 2; the corners tell the rest.
const CENTRE_SHARE: f32 = 0.75;

/// Move the values of vertices so that, taken linearly between them, they add to what the elements receive. Vertices lie
/// in corners and at contacts, where light is less: as they are, they would show all surfaces too dark. Of each element
/// with a known centroid: index and value there. Values stay between those around them.
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
