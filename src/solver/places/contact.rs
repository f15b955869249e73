//! Contacts: where one object stands on another or reaches into it.
//!
//! A contact element is one that lies partly inside a solid, behind a wall or in a gap that is closed but for its edges, as
//! between a cabinet and the wall behind it: this part gets no light, and is not visible. Its mean would be too dark beside
//! the object, so it is divided until it is small, and then takes the light of its corners outside.

use glam::Vec3;
use rayon::prelude::*;

use super::receivers::inset;
use crate::{
    geometry::RayTree,
    hierarchy::{Element, Hierarchy},
    scene::{CLOSED_GAP, Scene, TriangleId},
    solver::{Cancel, limits::Limits},
};

/// Elements are probed if they, or their whole patches, are this many times larger than the smallest contact elements
/// that are divided, or if their parents are inside solids in part. Smaller costs rays on every triangle of dense
/// meshes, whose contacts are fine anyway; larger misses contacts.
const PROBED_SIZE: f32 = 64.0;

/// Tangents of the angles between the probe rays and the normal, along two axes. The others, which are flatter, are
/// shot only if one of the first meets a back.
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

/// Tangents of the rays that count the solids about a point: along no edge of usual scenes.
const SOLID_PROBES: [[f32; 2]; 3] = [[0.173, 0.291], [-0.419, 0.137], [0.083, -0.531]];

/// Tangents of the rays that look whether a gap is closed for far around. Smaller, and low rooms count as gaps; larger,
/// and light is lost from elements that reach far into them.
const GAP_PROBES: [[f32; 2]; 4] = [[8.0, 0.7], [-0.7, 8.0], [-8.0, -0.7], [0.7, -8.0]];

/// Cosine of the angle within which two surfaces count as parallel. Smaller takes narrow corners for gaps; larger misses gaps
/// behind what stands askew.
const PARALLEL_COSINE: f32 = 0.9;

/// Number of the first rays of [`PROBES`]. Fewer miss contacts; more cost rays everywhere.
const FIRST_PROBES: usize = 4;

/// Fewest backs that the probe rays must meet, and as many again for each that meets a lit side. Smaller takes places
/// before walls for places behind them; larger misses those that are behind.
const LEAST_BACKS: usize = 2;

/// Most probe rays that may meet a lit side. Smaller misses places behind walls into which another object reaches;
/// larger takes places before walls for places behind them.
const MOST_LIT: usize = 1;

/// Divide contact elements; `limits` are those of the last step. Returns the rays shot, and whether memory allowed all
/// divisions; `None` when cancelled.
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

/// Find which new leaves lie inside solids or behind walls; `limits` are those of the last step. Small ones are probed
/// only if their parents are contact elements (see [`PROBED_SIZE`]). Returns the rays shot; `None` when cancelled.
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

/// Find which of some leaves lie inside solids, behind walls or in closed gaps. Returns the rays shot; `None` when
/// cancelled.
fn probe_leaves(
    scene: &Scene,
    hierarchy: &mut Hierarchy,
    rays: &RayTree,
    leaves: &[usize],
    cancel: &Cancel,
) -> Option<u64> {
    let mut triangles = scene.triangles.iter();
    let prober = Prober {
        scene,
        has_solids: triangles.any(|triangle| triangle.bounds_solid),
        rays,
        hierarchy,
        gap: (CLOSED_GAP * hierarchy.importance.area.sqrt()) as f32,
    };
    let probed: Vec<(u8, bool, u64)> = leaves
        .par_iter()
        .map(|&leaf| match cancel.is_cancelled() {
            true => (0, false, 0),
            false => prober.probe(leaf),
        })
        .collect();
    cancel.proceed()?;
    let mut ray_count = 0;
    for (&leaf, (inside_solid, is_covered, shot)) in leaves.iter().zip(probed) {
        let element = &mut hierarchy.mesh.elements[leaf];
        (element.inside_solid, element.is_covered) = (inside_solid, is_covered);
        ray_count += shot;
    }
    Some(ray_count)
}

/// Probe the leaves of some elements, whatever their size, after other rays from them began inside a solid. Returns the
/// rays shot; `None` when cancelled.
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

/// Area up to which contact elements are not divided, square frame units: the square root of their share of the area is
/// the tolerance of the mesh. Smaller costs elements along every contact; larger leaves visible dark patches beside it.
/// The same in all steps, by the limits of the last.
fn least_contact(hierarchy: &Hierarchy, limits: Limits) -> f32 {
    let root = limits.tolerance;
    (root * root * hierarchy.importance.area as f32).max(limits.min_area)
}

/// What is known of the light at a place.
#[derive(Clone, Copy, Default)]
struct Darkness {
    /// Whether it lies inside a solid, behind a wall or in a closed gap, and so gets no light from the room before it.
    is_dark: bool,
    /// Whether it gets none from elsewhere, either.
    is_covered: bool,
}

impl Darkness {
    /// Of places where nothing else shines.
    fn all(is_dark: bool) -> Self {
        Self {
            is_dark,
            is_covered: is_dark,
        }
    }
}

/// Looks for places without light.
struct Prober<'a> {
    scene: &'a Scene,
    has_solids: bool,
    rays: &'a RayTree,
    hierarchy: &'a Hierarchy,
    /// Width of the gaps that count as closed, frame units.
    gap: f32,
}

impl Prober<'_> {
    /// The corners of an element, and its centroid, that lie inside a solid, behind a wall or in a closed gap, as bits of
    /// [`Element::inside_solid`]; whether all are covered; and the rays shot.
    fn probe(&self, element: usize) -> (u8, bool, u64) {
        if self.rays.is_clear() {
            return (0, false, 0);
        }
        let (mut inside_solid, mut is_covered, mut shot) = (0, true, 0);
        for (place, point) in places(self.hierarchy, element).into_iter().enumerate() {
            let mut found = Darkness::default();
            let looks = [Self::in_solid, Self::behind_wall, Self::in_gap];
            for look in looks {
                if !found.is_dark {
                    let count;
                    (found, count) = look(self, element, point);
                    shot += count;
                }
            }
            inside_solid |= u8::from(found.is_dark) << place;
            is_covered &= found.is_covered;
        }
        (inside_solid, is_covered, shot)
    }

    /// See [`Self::is_in_solid`].
    fn in_solid(&self, element: usize, point: Vec3) -> (Darkness, u64) {
        let (is_dark, shot) = self.is_in_solid(element, point);
        (Darkness::all(is_dark), shot)
    }

    /// See [`Self::is_in_gap`].
    fn in_gap(&self, element: usize, point: Vec3) -> (Darkness, u64) {
        let (is_dark, shot) = self.is_in_gap(element, point);
        (Darkness::all(is_dark), shot)
    }

    /// Whether a point of an element lies inside a solid of the scene, by two of three rays, since a ray may slip through
    /// an edge; and the rays shot.
    fn is_in_solid(&self, element: usize, point: Vec3) -> (bool, u64) {
        if !self.has_solids {
            return (false, 0);
        }
        let patch = self.hierarchy.patch_of(element);
        let is_left = |tangents| {
            let direction = tilted(patch.normal, tangents);
            let bounds = |triangle: TriangleId| self.scene.triangles[triangle.index()].bounds_solid;
            let start = Some(patch.triangle);
            self.rays.solids_left(point, direction, start, bounds) > 0
        };
        let [first, second, third] = SOLID_PROBES;
        if is_left(first) {
            (is_left(second) || is_left(third), 3)
        } else {
            (false, 1)
        }
    }

    /// See [`behind_wall`].
    fn behind_wall(&self, element: usize, point: Vec3) -> (Darkness, u64) {
        behind_wall(self.rays, self.hierarchy, element, point)
    }

    /// Whether the side of a triangle that a ray meets has no light of its own; backs never have.
    fn is_dark(&self, triangle: TriangleId, direction: Vec3) -> bool {
        let met = self.hierarchy.side_met(triangle, direction);
        met.is_none_or(|patch| self.hierarchy.patches[patch].emission == Vec3::ZERO)
    }

    /// Whether a point of an element lies in a gap that is closed far around: something without light of its own stands
    /// parallel before it. And the rays shot.
    fn is_in_gap(&self, element: usize, point: Vec3) -> (bool, u64) {
        let patch = self.hierarchy.patch_of(element);
        if patch.emission != Vec3::ZERO {
            return (false, 0);
        }
        let start = Some(patch.triangle);
        let across = point + patch.normal * self.gap;
        if !self.rays.occluded(point, across, [start, None]) {
            return (false, 1);
        }
        // The width of the gap in a direction, where it is closed there.
        let width = |tangents: [f32; 2]| {
            let direction = tilted(patch.normal, tangents);
            let hit = self.rays.closest(point, direction, start)?;
            let surface = &self.scene.surfaces[hit.triangle.index()];
            let normal = surface.area_vector.normalize_or_zero();
            let is_closed = normal.dot(patch.normal).abs() > PARALLEL_COSINE
                && self.is_dark(hit.triangle, direction)
                && !self.rays.is_see_through(hit.triangle);
            is_closed.then_some(hit.distance * direction.dot(patch.normal))
        };
        let Some(before) = width([0.0, 0.0]).filter(|&width| width <= self.gap) else {
            return (false, 2);
        };
        let is_closed = |tangents: &[f32; 2]| width(*tangents).is_some_and(|w| w < 2.0 * before);
        let count = 2 + GAP_PROBES.len() as u64;
        (GAP_PROBES.iter().all(is_closed), count)
    }
}

/// The places at which an element is probed: its corners, offset inwards, and its centroid.
fn places(hierarchy: &Hierarchy, element: usize) -> [Vec3; 4] {
    let corners = hierarchy.mesh.corners(element);
    let element = &hierarchy.mesh.elements[element];
    let inset = inset(element, corners);
    let [a, b, c] = corners.map(|corner| corner.lerp(element.centroid, inset));
    [a, b, c, element.centroid]
}

/// The probed places of a contact element that are outside solids; none of other elements.
pub(crate) fn outside_places(hierarchy: &Hierarchy, element: usize) -> Vec<Vec3> {
    let inside_solid = hierarchy.mesh.elements[element].inside_solid;
    if !hierarchy.mesh.elements[element].is_contact() {
        return Vec::new();
    }
    let is_outside = |(place, _): &(usize, Vec3)| inside_solid & (1 << place) == 0;
    let places = places(hierarchy, element).into_iter().enumerate();
    places.filter(is_outside).map(|(_, point)| point).collect()
}

/// A unit direction tilted from a normal by these tangents along two axes of its plane.
fn tilted(normal: Vec3, [x, y]: [f32; 2]) -> Vec3 {
    let tangent = normal.any_orthonormal_vector();
    (normal + tangent * x + normal.cross(tangent) * y).normalize_or_zero()
}

/// Whether a point of an element lies behind a wall (see [`behind_wall`]), and the rays shot.
pub(crate) fn is_behind_wall(
    rays: &RayTree,
    hierarchy: &Hierarchy,
    element: usize,
    point: Vec3,
) -> (bool, u64) {
    let (place, shot) = behind_wall(rays, hierarchy, element, point);
    (place.is_dark, shot)
}

/// Whether a point of an element lies behind a wall: rays from there meet backs, and no lit side except one of another
/// object that reaches into the wall. It is covered if they meet nothing else. And the rays shot.
fn behind_wall(
    rays: &RayTree,
    hierarchy: &Hierarchy,
    element: usize,
    point: Vec3,
) -> (Darkness, u64) {
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
                    return (Darkness::default(), shot as u64);
                }
            }
            Some(hit) if !rays.is_see_through(hit.triangle) => backs += 1,
            _ => {}
        }
    }
    let place = Darkness {
        is_dark: backs >= LEAST_BACKS * (1 + lit),
        is_covered: backs == PROBES.len(),
    };
    (place, shot as u64)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::{
        scene::{
            SceneOptions,
            test_shapes::{builder, cuboid, rectangle},
        },
        solver::SolveSettings,
    };

    /// A box that stands on a floor, sunk into it if `depth` is above 0, or closely above it.
    fn standing(depth: f64) -> Scene {
        let (mut builder, wall, lamp) = builder();
        let floor = [DVec3::Z * 4.0, DVec3::X * 4.0];
        rectangle(&mut builder, DVec3::new(-2.0, 0.0, -2.0), floor, wall);
        let ends = [DVec3::new(-0.7, -depth, -0.4), DVec3::new(0.3, 1.0, 0.8)];
        cuboid(&mut builder, ends, false, |_| true, wall);
        let edges = [DVec3::X, DVec3::Z];
        rectangle(&mut builder, DVec3::new(-0.5, 3.0, -0.5), edges, lamp);
        builder.finish(&SceneOptions::default()).unwrap()
    }

    #[test]
    fn what_lies_under_a_box_is_inside_and_nothing_else_on_the_floor_is() {
        for depth in [0.0, 0.05, -0.001, -0.006] {
            let scene = standing(depth);
            let mut hierarchy = Hierarchy::new(&scene, 30.0);
            let rays = RayTree::new(&scene);
            let settings = SolveSettings::draft();
            let limits = Limits::new(&settings, &hierarchy, 1.0, u64::MAX);
            let cancel = Cancel::default();
            let (_, fits) =
                divide_contacts(&scene, &mut hierarchy, &rays, limits, &cancel).unwrap();
            assert!(fits);
            let mut inside = 0;
            for leaf in hierarchy.mesh.active_leaves() {
                let element = &hierarchy.mesh.elements[leaf];
                let is_floor = hierarchy.patch_of(leaf).normal.y > 0.9
                    && scene.frame.to_world(element.centroid).y < 0.5;
                if !is_floor {
                    continue;
                }
                for (bit, place) in places(&hierarchy, leaf).into_iter().enumerate() {
                    let at = scene.frame.to_world(place);
                    // How far within the walls of the box.
                    let depth = (at.x + 0.7).min(0.3 - at.x).min(at.z + 0.4).min(0.8 - at.z);
                    let is_inside = element.inside_solid & (1 << bit) != 0;
                    assert!(!is_inside || depth > -1e-3, "{at}");
                    // Small corners of elements are not probed.
                    assert!(is_inside || depth < 0.15, "{at}");
                    inside += u32::from(is_inside);
                }
                let least = least_contact(&hierarchy, limits);
                assert!(!element.is_contact() || element.area_vector.length() <= least);
            }
            assert!(inside > 3, "{inside}");
        }
    }

    #[test]
    fn a_face_under_the_floor_of_a_room_is_behind_a_wall_and_one_in_the_room_is_not() {
        let (mut builder, wall, _) = builder();
        cuboid(
            &mut builder,
            [DVec3::ZERO, DVec3::ONE],
            true,
            |_| true,
            wall,
        );
        let edges = [DVec3::Z * 0.1, DVec3::X * 0.1];
        for height in [-0.05, 0.3] {
            rectangle(&mut builder, DVec3::new(0.4, height, 0.4), edges, wall);
        }
        let scene = crate::scene::test_shapes::one_sided(builder);
        let (hierarchy, rays) = (Hierarchy::new(&scene, 30.0), RayTree::new(&scene));
        let mut found = Vec::new();
        for patch in 0..hierarchy.patches.len() {
            let element = &hierarchy.mesh.elements[patch];
            let height = scene.frame.to_world(element.centroid).y;
            if hierarchy.patches[patch].normal.y > 0.9 && height != 0.0 {
                let (is_behind, shot) = is_behind_wall(&rays, &hierarchy, patch, element.centroid);
                assert_eq!(is_behind, height < 0.0, "{height}");
                assert!(shot > 1);
                found.push(is_behind);
            }
        }
        assert!(found.contains(&true) && found.contains(&false));
    }

    #[test]
    fn gaps_are_narrow_closed_and_dark() {
        // The floor under the middle of a sheet of this size and height, which may shine.
        for (size, height, shines, is_gap) in [
            (0.4, 0.004, false, true),
            (0.4, 0.004, true, false),
            (0.02, 0.004, false, false),
            (0.4, 0.2, false, false),
        ] {
            let (mut builder, wall, lamp) = builder();
            let floor = [DVec3::Z * 4.0, DVec3::X * 4.0];
            rectangle(&mut builder, DVec3::new(-2.0, 0.0, -2.0), floor, wall);
            let corner = DVec3::new(-0.5 * size, height, -0.5 * size);
            let sheet = [DVec3::X * size, DVec3::Z * size];
            rectangle(
                &mut builder,
                corner,
                sheet,
                if shines { lamp } else { wall },
            );
            let scene = crate::scene::test_shapes::one_sided(builder);
            let (hierarchy, rays) = (Hierarchy::new(&scene, 30.0), RayTree::new(&scene));
            let prober = Prober {
                scene: &scene,
                has_solids: false,
                rays: &rays,
                hierarchy: &hierarchy,
                gap: (CLOSED_GAP * hierarchy.importance.area.sqrt()) as f32,
            };
            let middle = scene.frame.from_world(DVec3::new(0.001, 0.0, 0.001));
            let is_floor = |&element: &usize| {
                let elements = &hierarchy.mesh.elements;
                let height = scene.frame.to_world(elements[element].centroid).y;
                height < 1e-3
            };
            let element = (0..hierarchy.mesh.elements.len()).find(is_floor).unwrap();
            let (found, _) = prober.is_in_gap(element, middle);
            assert_eq!(found, is_gap, "{size} {height} {shines}");
        }
    }
}
