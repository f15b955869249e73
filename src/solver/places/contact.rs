//! Where one object stands on another or reaches into it: what lies within a solid gets no light, and nobody sees it.
//!
//! An element that reaches out from under an object is dark in part. As a whole it would show a smudge beside the
//! object; so it is divided until what is left of it is small, and that shows the light of its open corners.

use glam::Vec3;
use rayon::prelude::*;

use super::receivers::inset;
use crate::{
    geometry::RayTree,
    hierarchy::{Element, Hierarchy},
    scene::{Scene, TriangleId},
    solver::{Cancel, limits::Limits},
};

/// Elements that lie under an object in part are divided while the root of their share of the area is more than this
/// many times the tolerance of the mesh. Smaller costs elements along every contact; larger shows through beside it.
const CONTACT_TOLERANCE: f32 = 1.0;

/// Whether an element lies within a solid is looked at if it is this many times larger than those that are not divided
/// for it, or a whole patch was, or what was divided did. Smaller costs rays on every triangle of dense meshes, whose
/// contacts are fine anyway.
const PROBED_SIZE: f32 = 64.0;

/// Tangents of the probes' directions against the normal. Of the first, one at least must meet a back before the others
/// are shot; they look further down, between the first.
const PROBES: [[f32; 2]; 8] = [
    [0.0, 0.0],
    [0.9, 0.1],
    [-0.4, 0.8],
    [-0.5, -0.7],
    [1.3, 1.5],
    [-2.0, 0.1],
    [0.9, -1.8],
    [0.1, 2.6],
];

/// Tangents of the directions in which it is counted how many solids a point lies in: along no edge of usual scenes.
const SOLID_PROBES: [[f32; 2]; 3] = [[0.173, 0.291], [-0.419, 0.137], [0.083, -0.531]];

/// See [`PROBES`].
const FIRST_PROBES: usize = 4;

/// Backs that the probes must meet, and as many again for each that meets what may be lit.
const LEAST_BACKS: usize = 2;

/// Probes that may meet what may be lit.
const MOST_LIT: usize = 1;

/// Divide elements that lie under an object in part; `limits` are those of the last step. Returns the rays shot, and whether
/// all could be divided; `None` when cancelled.
pub(crate) fn divide_contacts(
    scene: &Scene,
    hierarchy: &mut Hierarchy,
    rays: &RayTree,
    limits: Limits,
    cancel: &Cancel,
) -> Option<(u64, bool)> {
    let mut ray_count = 0;
    let least = least_contact(hierarchy, limits);
    loop {
        ray_count += probe_contacts(scene, hierarchy, rays, limits, cancel)?;
        let mesh = &mut hierarchy.mesh;
        let is_wanted = |leaf: &usize| {
            let element = &mesh.elements[*leaf];
            element.is_contact() && element.area_vector.length() > least
        };
        let wanted: Vec<u32> = mesh
            .active_leaves()
            .filter(is_wanted)
            .map(|leaf| leaf as u32)
            .collect();
        let fits = mesh.fits(&wanted, limits.most_elements);
        if !fits || !mesh.divide(&wanted) {
            return Some((ray_count, fits));
        }
    }
}

/// Find out which leaves lie within solids; `limits` are those of the last step. Of small ones it is only asked where what
/// was divided did. Returns the rays shot; `None` when cancelled.
pub(crate) fn probe_contacts(
    scene: &Scene,
    hierarchy: &mut Hierarchy,
    rays: &RayTree,
    limits: Limits,
    cancel: &Cancel,
) -> Option<u64> {
    let least = least_contact(hierarchy, limits);
    let elements = &hierarchy.mesh.elements;
    let fresh: Vec<usize> = hierarchy
        .mesh
        .active_leaves()
        .filter(|&leaf| elements[leaf].inside_solid == Element::UNPROBED)
        .collect();
    let is_probed = |leaf: usize| {
        let element = &elements[leaf];
        let above = elements.get(element.parent as usize);
        let whole = elements[element.patch as usize].area_vector.length();
        element.area_vector.length() > PROBED_SIZE * least
            || above.is_some_and(|parent| match parent.inside_solid {
                Element::UNPROBED => whole > PROBED_SIZE * least,
                inside_solid => inside_solid != 0,
            })
    };
    let (wanted, skipped): (Vec<usize>, Vec<usize>) =
        fresh.into_iter().partition(|&leaf| is_probed(leaf));
    let ray_count = probe_leaves(scene, hierarchy, rays, &wanted, cancel)?;
    for leaf in skipped {
        hierarchy.mesh.elements[leaf].inside_solid = 0;
    }
    Some(ray_count)
}

/// Find out which of some leaves lie within solids. Returns the rays shot; `None` when cancelled.
fn probe_leaves(
    scene: &Scene,
    hierarchy: &mut Hierarchy,
    rays: &RayTree,
    leaves: &[usize],
    cancel: &Cancel,
) -> Option<u64> {
    let mut triangles = scene.triangles.iter();
    let solids = triangles
        .any(|triangle| triangle.bounds_solid)
        .then_some(scene);
    let probed: Vec<(u8, u64)> = leaves
        .par_iter()
        .map(|&leaf| match cancel.is_cancelled() {
            true => (0, 0),
            false => probe(solids, rays, hierarchy, leaf),
        })
        .collect();
    cancel.proceed()?;
    let mut ray_count = 0;
    for (&leaf, (inside_solid, shot)) in leaves.iter().zip(probed) {
        hierarchy.mesh.elements[leaf].inside_solid = inside_solid;
        ray_count += shot;
    }
    Some(ray_count)
}

/// Look at some elements, however small, and at all that lies on them: rays from there told that they lie within a solid.
/// Returns the rays shot; `None` when cancelled.
pub(crate) fn probe_within(
    scene: &Scene,
    hierarchy: &mut Hierarchy,
    rays: &RayTree,
    elements: &[usize],
    cancel: &Cancel,
) -> Option<u64> {
    if elements.is_empty() || rays.is_clear() {
        return Some(0);
    }
    let mesh = &hierarchy.mesh;
    let mut pending = elements.to_vec();
    let mut leaves = Vec::new();
    while let Some(element) = pending.pop() {
        pending.extend(mesh.elements[element].children());
        if mesh.elements[element].is_leaf() {
            leaves.push(element);
        }
    }
    probe_leaves(scene, hierarchy, rays, &leaves, cancel)
}

/// Elements in contact that are no larger are not divided, frame units. The same in all steps, by the limits of the last.
fn least_contact(hierarchy: &Hierarchy, limits: Limits) -> f32 {
    let root = CONTACT_TOLERANCE * limits.tolerance;
    (root * root * hierarchy.importance.area as f32).max(limits.min_area)
}

/// Which corners of an element, and whether its centroid, lie within a solid or behind a wall, as [`Element::inside_solid`] has
/// it; and the rays shot. `scene` where it has solids.
fn probe(
    scene: Option<&Scene>,
    rays: &RayTree,
    hierarchy: &Hierarchy,
    element: usize,
) -> (u8, u64) {
    if rays.is_clear() {
        return (0, 0);
    }
    let (mut inside_solid, mut shot) = (0, 0);
    for (place, point) in places(hierarchy, element).into_iter().enumerate() {
        let in_solid = scene.map_or((false, 0), |scene| {
            is_in_solid(scene, rays, hierarchy, element, point)
        });
        let (is_inside, count) = match in_solid {
            (true, count) => (true, count),
            (false, count) => {
                let (is_behind, more) = is_behind_wall(rays, hierarchy, element, point);
                (is_behind, count + more)
            }
        };
        inside_solid |= u8::from(is_inside) << place;
        shot += count;
    }
    (inside_solid, shot)
}

/// Where an element is probed: its corners, a little inside, and its centroid.
fn places(hierarchy: &Hierarchy, element: usize) -> [Vec3; 4] {
    let corners = hierarchy.mesh.corners(element);
    let element = &hierarchy.mesh.elements[element];
    let inset = inset(element, corners);
    let [a, b, c] = corners.map(|corner| corner.lerp(element.centroid, inset));
    [a, b, c, element.centroid]
}

/// Of an element that lies within a solid in part, the probed places that do not; nothing of others.
pub(crate) fn outside_places(hierarchy: &Hierarchy, element: usize) -> Vec<Vec3> {
    let inside_solid = hierarchy.mesh.elements[element].inside_solid;
    if !hierarchy.mesh.elements[element].is_contact() {
        return Vec::new();
    }
    let is_outside = |(place, _): &(usize, Vec3)| inside_solid & (1 << place) == 0;
    let places = places(hierarchy, element).into_iter().enumerate();
    places.filter(is_outside).map(|(_, point)| point).collect()
}

/// A unit direction off a normal, by the tangents of its angles with it along two axes of the plane.
fn tilted(normal: Vec3, [x, y]: [f32; 2]) -> Vec3 {
    let tangent = normal.any_orthonormal_vector();
    (normal + tangent * x + normal.cross(tangent) * y).normalize_or_zero()
}

/// Whether a point of an element lies within a solid of the scene. A ray may slip through an edge: so if one says that it
/// does, two of three must. And the rays shot.
fn is_in_solid(
    scene: &Scene,
    rays: &RayTree,
    hierarchy: &Hierarchy,
    element: usize,
    point: Vec3,
) -> (bool, u64) {
    let patch = hierarchy.patch_of(element);
    let is_left = |tangents| {
        let direction = tilted(patch.normal, tangents);
        let bounds = |triangle: TriangleId| scene.triangles[triangle.index()].bounds_solid;
        rays.solids_left(point, direction, Some(patch.triangle), bounds) > 0
    };
    let [first, second, third] = SOLID_PROBES;
    if is_left(first) {
        (is_left(second) || is_left(third), 3)
    } else {
        (false, 1)
    }
}

/// Whether a point of an element lies behind a wall: backs are met from there and nothing that is lit, or one among many:
/// another that reaches into the wall. And the rays shot.
pub(crate) fn is_behind_wall(
    rays: &RayTree,
    hierarchy: &Hierarchy,
    element: usize,
    point: Vec3,
) -> (bool, u64) {
    let patch = hierarchy.patch_of(element);
    let (mut backs, mut lit, mut shot) = (0, 0, 0);
    for tangents in PROBES {
        if shot == FIRST_PROBES && backs == 0 {
            break;
        }
        let direction = tilted(patch.normal, tangents);
        shot += 1;
        match rays.closest(point, direction, Some(patch.triangle)) {
            Some(hit) if hierarchy.patch_met(hit.triangle, direction).is_some() => {
                lit += 1;
                if lit > MOST_LIT {
                    return (false, shot as u64);
                }
            }
            hit => backs += usize::from(hit.is_some()),
        }
    }
    (backs >= LEAST_BACKS * (1 + lit), shot as u64)
}
