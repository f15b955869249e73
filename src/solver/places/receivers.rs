//! Where light of the mesh is evaluated: a little inside the corners of leaves, and at their centroids; and what counts how
//! much there.

use std::ops::Range;

use glam::Vec3;

use crate::{
    geometry::RAY_OFFSET,
    hierarchy::{Element, Hierarchy},
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
    // The leaves about the vertices, and mean normals there.
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
    // By vertex, the leaf that fits best.
    /// How fit a leaf is, and which one it is.
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
    // A little inside the leaf that was chosen.
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
