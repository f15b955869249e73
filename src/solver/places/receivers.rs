//! Where light of the mesh is evaluated: a little inside the corners of leaves, and at their centroids; and what counts how
//! much there.

use std::ops::Range;

use glam::{Vec3, Vec4};

use crate::{
    geometry::RAY_OFFSET,
    hierarchy::{Element, Hierarchy, Mesh},
    scene::TriangleId,
};

/// Corners are moved this share of the way to the centroid before light is evaluated there: exactly on an edge, a
/// neighbour at an angle would be seen edge-on, or from within the object that stands on it.
pub(crate) const INSET: f32 = 0.02;

/// Distance from its edges at which light of an element is evaluated at least, if it is so wide: what is nearer than
/// [`RAY_OFFSET`] a ray does not see, and a wall stands on many an edge.
const CLEARANCE: f32 = 2.0 * RAY_OFFSET;

/// But never further than this share of the way to the centroid. More, and small elements show light of another place; less,
/// and narrow ones along walls show light of beyond.
const MOST_INSET: f32 = 0.2;

/// Elements over which light is carried at most: vertices under an object and those beside them.
const CARRIED: u32 = 2;

/// Where direct light is wanted.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Receiver {
    /// A point of a surface.
    pub point: Vec3,
    /// Unit normal there.
    pub normal: Vec3,
    /// The triangle that the point lies on.
    pub triangle: TriangleId,
}

/// Share of the way to the centroid at which light of the corners of an element is evaluated; `corners` are where they are.
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

/// Where to sample each corner that is wanted of the leaves among some elements: a little inside the leaf whose normal
/// is nearest to the mean normal about the vertex, of those that are not within a solid there.
pub(crate) fn vertex_places(
    hierarchy: &Hierarchy,
    elements: Range<usize>,
    is_wanted: &[bool],
) -> Vec<(u32, Receiver)> {
    let mesh = &hierarchy.mesh;
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
    /// How fit a leaf is, and which one it is.
    type Choice = ((bool, f32), u32);
    let mut chosen: Vec<Option<Choice>> = vec![None; mesh.vertices.len()];
    for leaf in about_wanted.into_iter().filter(|&leaf| mesh.is_held(leaf)) {
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

/// The centroid of an element, as a place to be lit.
pub(crate) fn centre_of(hierarchy: &Hierarchy, element: usize) -> Receiver {
    let patch = hierarchy.patch_of(element);
    Receiver {
        point: hierarchy.mesh.elements[element].centroid,
        normal: patch.normal,
        triangle: patch.triangle,
    }
}

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

/// Give vertices of elements that lie within a solid in part, at which no leaf `tells` what its corner there receives,
/// the mean of those of these elements at which one does.
pub(crate) fn carry_over(
    mesh: &Mesh,
    tells: impl Fn(&Element, usize) -> bool,
    values: &mut [Vec4],
) {
    let is_contact = |leaf: &usize| mesh.elements[*leaf].is_contact();
    let contacts: Vec<usize> = mesh.active_leaves().filter(is_contact).collect();
    if contacts.is_empty() {
        return;
    }
    let mut told = vec![false; values.len()];
    for leaf in mesh.active_leaves() {
        let element = &mesh.elements[leaf];
        for (side, vertex) in element.vertices.into_iter().enumerate() {
            told[vertex as usize] |= tells(element, side);
        }
    }
    for _ in 0..CARRIED {
        let mut sums = vec![(Vec4::ZERO, 0.0f32); values.len()];
        for &leaf in &contacts {
            let element = &mesh.elements[leaf];
            let area = element.area_vector.length();
            let (from, to): (Vec<usize>, Vec<usize>) = element
                .vertices
                .into_iter()
                .map(|vertex| vertex as usize)
                .partition(|&vertex| told[vertex]);
            for &from in &from {
                for &to in &to {
                    sums[to].0 += values[from] * area;
                    sums[to].1 += area;
                }
            }
        }
        for (vertex, (sum, weight)) in sums.into_iter().enumerate() {
            if weight > 0.0 {
                (values[vertex], told[vertex]) = (sum / weight, true);
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
