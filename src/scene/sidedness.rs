//! Which faces are two-sided: sheets are, faces of a consistently wound closed shell are not. And whether a shell
//! around a light looks the wrong way.
//!
//! A shell is a set of triangles connected by shared edges. It is closed and consistently wound when every directed
//! edge meets its opposite exactly once.

use std::f32::consts::PI;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::edges::sorted_by;
use super::{DisjointSets, Sides, Triangle, half_edges};

/// The shells of a scene.
#[derive(Clone, Debug)]
pub(super) struct Shells {
    /// Shell of each triangle.
    pub(super) of_triangle: Vec<u32>,
    /// By shell: whether it is closed and consistently wound.
    pub(super) closed: Vec<bool>,
}

/// One flag per triangle. One that has a twin looking the other way is one-sided: each is the other's back.
pub(super) fn two_sided(shells: &Shells, triangles: &[Triangle], sides: Sides) -> Vec<bool> {
    let flag = |&shell: &u32| match sides {
        Sides::Auto => !shells.closed[shell as usize],
        Sides::One => false,
        Sides::Two => true,
    };
    let mut flags: Vec<bool> = shells.of_triangle.iter().map(flag).collect();
    if flags.contains(&true) {
        let corners: Vec<[u32; 3]> = triangles.iter().map(|triangle| triangle.corners).collect();
        let coincident = Coincident::of(&corners);
        for (triangle, flag) in flags.iter_mut().enumerate() {
            *flag &= !coincident.has_opposite(triangle);
        }
    }
    flags
}

/// Which triangles share all their corners with others.
pub(super) struct Coincident {
    doubles: Vec<bool>,
    opposites: Vec<bool>,
}

impl Coincident {
    /// Compare the corners of triangles.
    pub(super) fn of(corners: &[[u32; 3]]) -> Self {
        let keyed = corners.iter().enumerate().map(|(triangle, corners)| {
            let (key, is_turned) = sorted_corners(*corners);
            (key, is_turned, triangle as u32)
        });
        let keyed: Vec<([u32; 3], bool, u32)> = sorted_by(keyed, |&(key, _, _)| key[0]);
        let mut found = Self {
            doubles: vec![false; corners.len()],
            opposites: vec![false; corners.len()],
        };
        for equals in keyed.chunk_by(|a, b| a.0 == b.0) {
            for ways in equals.chunk_by(|a, b| a.1 == b.1) {
                for &(_, _, triangle) in &ways[1..] {
                    found.doubles[triangle as usize] = true;
                }
                for &(_, _, triangle) in ways {
                    found.opposites[triangle as usize] = ways.len() < equals.len();
                }
            }
        }
        found
    }

    /// Whether an earlier triangle has the same corners in the same sense.
    pub(super) fn is_double(&self, triangle: usize) -> bool {
        self.doubles[triangle]
    }

    /// Whether a triangle has the same corners in the opposite sense.
    pub(super) fn has_opposite(&self, triangle: usize) -> bool {
        self.opposites[triangle]
    }
}

/// Corners in ascending order, and whether that turns the triangle round.
fn sorted_corners([a, b, c]: [u32; 3]) -> ([u32; 3], bool) {
    let mut sorted = [a, b, c];
    sorted.sort_unstable();
    let is_rotated = [[a, b, c], [b, c, a], [c, a, b]].contains(&sorted);
    (sorted, !is_rotated)
}

impl Shells {
    /// Find the shells.
    pub(super) fn of(triangles: &[Triangle]) -> Self {
        let edges = half_edges(triangles.iter().map(|triangle| triangle.corners));
        // Connect triangles over shared edges.
        let mut forest = DisjointSets::new(triangles.len());
        let mut open = Vec::new();
        for group in edges.chunk_by(|a, b| a.ends == b.ends) {
            for pair in group.windows(2) {
                forest.join(pair[0].triangle, pair[1].triangle);
            }
            if group.len() != 2 || group[0].is_forward == group[1].is_forward {
                open.push(group[0].triangle);
            }
        }
        // Number the shells in the order of their first triangles.
        let mut number = vec![u32::MAX; triangles.len()];
        let mut count = 0;
        let mut of_triangle = Vec::with_capacity(triangles.len());
        for triangle in 0..triangles.len() as u32 {
            let root = forest.root(triangle) as usize;
            if number[root] == u32::MAX {
                number[root] = count;
                count += 1;
            }
            of_triangle.push(number[root]);
        }
        let mut closed = vec![true; count as usize];
        for triangle in open {
            closed[of_triangle[triangle as usize] as usize] = false;
        }
        Self {
            of_triangle,
            closed,
        }
    }

    /// By shell: whether it bounds a solid. Of closed shells those do that look outward, unless a light of another shell
    /// lies wholly in their box: they may be rooms that are turned inside out. And those that look inward within the box of one
    /// that does: others are rooms around what is in them.
    pub(super) fn bound_solids(
        &self,
        triangles: &[Triangle],
        positions: &[Vec3],
        emits: impl Fn(usize) -> bool,
    ) -> Vec<bool> {
        let volumes = self.volumes(triangles, positions);
        let boxes = self.boxes(triangles, positions);
        let lights = some_emitters(triangles.len(), emits, MAX_INNER_LIGHTS);
        let is_lit_within = |shell: usize| {
            lights.iter().any(|&light| {
                let corners = triangles[light].corners;
                self.of_triangle[light] as usize != shell
                    && corners
                        .iter()
                        .all(|&corner| holds(boxes[shell], positions[corner as usize]))
            })
        };
        let is_solid: Vec<bool> = (0..self.closed.len())
            .into_par_iter()
            .map(|shell| self.closed[shell] && volumes[shell] > 0.0 && !is_lit_within(shell))
            .collect();
        let outward: Vec<[Vec3; 2]> = (0..self.closed.len())
            .filter(|&shell| is_solid[shell])
            .map(|shell| boxes[shell])
            .collect();
        let is_hollow = |shell: usize| {
            let [min, max] = boxes[shell];
            let is_around = |&outer: &[Vec3; 2]| holds(outer, min) && holds(outer, max);
            self.closed[shell] && outward.iter().any(is_around)
        };
        (0..self.closed.len())
            .into_par_iter()
            .map(|shell| is_solid[shell] || volumes[shell] < 0.0 && is_hollow(shell))
            .collect()
    }

    /// Six times the volume in each closed shell, negative where it looks inward; of others it says nothing.
    fn volumes(&self, triangles: &[Triangle], positions: &[Vec3]) -> Vec<f64> {
        let mut volumes = vec![0.0; self.closed.len()];
        for (triangle, &shell) in triangles.iter().zip(&self.of_triangle) {
            let [a, b, c] = triangle
                .corners
                .map(|corner| positions[corner as usize].as_dvec3());
            volumes[shell as usize] += a.dot(b.cross(c));
        }
        volumes
    }

    /// The box about each shell, least corner first.
    fn boxes(&self, triangles: &[Triangle], positions: &[Vec3]) -> Vec<[Vec3; 2]> {
        let mut boxes = vec![[Vec3::MAX, Vec3::MIN]; self.closed.len()];
        for (triangle, &shell) in triangles.iter().zip(&self.of_triangle) {
            let [min, max] = &mut boxes[shell as usize];
            for corner in triangle.corners.map(|corner| positions[corner as usize]) {
                (*min, *max) = (min.min(corner), max.max(corner));
            }
        }
        boxes
    }
}

/// Whether a point lies in a box, least corner first.
fn holds([min, max]: [Vec3; 2], point: Vec3) -> bool {
    (point.cmpge(min) & point.cmple(max)).all()
}

/// Triangles that emit, at most so many spread over all of them.
fn some_emitters(count: usize, emits: impl Fn(usize) -> bool, most: usize) -> Vec<usize> {
    let emitters: Vec<usize> = (0..count).filter(|&triangle| emits(triangle)).collect();
    let step = emitters.len().div_ceil(most).max(1);
    emitters.into_iter().step_by(step).collect()
}

/// Lights that are looked for within shells; each is compared with the box of every shell.
const MAX_INNER_LIGHTS: usize = 256;

/// Lights that are looked at; each costs a pass over the triangles.
const MAX_LIGHTS: usize = 16;

/// How many closed shells hold a light of another shell inside while their faces look outward, so that its light
/// falls on their black backs. A shell that is the whole scene and emits outward counts, too.
pub(super) fn inverted_shell_count(
    triangles: &[Triangle],
    positions: &[Vec3],
    emits: impl Fn(usize) -> bool,
    shells: &Shells,
) -> usize {
    let lights = some_emitters(triangles.len(), emits, MAX_LIGHTS);
    let corners = |triangle: usize| triangles[triangle].corners.map(|i| positions[i as usize]);
    if shells.closed == [true] && !lights.is_empty() {
        return usize::from(shells.volumes(triangles, positions)[0] > 0.0);
    }
    let boxes = shells.boxes(triangles, positions);
    let around = |light: usize| {
        let [a, b, c] = corners(light);
        let point = (a + b + c) / 3.0;
        // Others than its own that may hold it.
        let mut may_hold: Vec<bool> = boxes
            .iter()
            .zip(&shells.closed)
            .map(|(&extent, &closed)| closed && holds(extent, point))
            .collect();
        may_hold[shells.of_triangle[light] as usize] = false;
        // The solid angle under which a closed shell is seen from inside is the full sphere, signed by its winding.
        let mut solid_angle = vec![0.0_f64; shells.closed.len()];
        for (triangle, &shell) in shells.of_triangle.iter().enumerate() {
            if may_hold[shell as usize] {
                solid_angle[shell as usize] += signed_solid_angle(corners(triangle), point);
            }
        }
        let is_inverted = move |&shell: &usize| solid_angle[shell] > f64::from(2.0 * PI);
        (0..shells.closed.len()).filter(is_inverted)
    };
    let mut inverted: Vec<usize> = lights.into_par_iter().flat_map_iter(around).collect();
    inverted.sort_unstable();
    inverted.dedup();
    inverted.len()
}

/// Solid angle of a triangle (Van Oosterom and Strackee 1983), positive where its back is seen.
fn signed_solid_angle(corners: [Vec3; 3], point: Vec3) -> f64 {
    let [a, b, c]: [DVec3; 3] = corners.map(|corner| (corner - point).as_dvec3());
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let triple = a.dot(b.cross(c));
    let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * triple.atan2(denominator)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::MaterialId;

    fn triangles(corners: &[[u32; 3]]) -> Vec<Triangle> {
        let make = |&corners: &[u32; 3]| Triangle {
            corners,
            material: MaterialId(0),
            two_sided: false,
            bounds_solid: false,
        };
        corners.iter().map(make).collect()
    }

    const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

    fn flags(corners: &[[u32; 3]]) -> Vec<bool> {
        let triangles = triangles(corners);
        two_sided(&Shells::of(&triangles), &triangles, Sides::Auto)
    }

    #[test]
    fn twins_are_each_others_backs_and_doubles_are_found() {
        // A sheet of two triangles, each with a twin, beside one without.
        let corners = [
            [0, 1, 2],
            [1, 0, 2],
            [2, 1, 3],
            [1, 2, 3],
            [1, 3, 4],
            [2, 0, 1],
        ];
        let coincident = Coincident::of(&corners);
        let found: Vec<bool> = (0..6).map(|i| coincident.is_double(i)).collect();
        assert_eq!(found, [false, false, false, false, false, true]);
        let list = triangles(&corners);
        for sides in [Sides::Auto, Sides::Two] {
            let flags = two_sided(&Shells::of(&list), &list, sides);
            assert_eq!(
                flags,
                [false, false, false, false, true, false],
                "{sides:?}"
            );
        }
    }

    #[test]
    fn closed_shells_are_one_sided_and_sheets_are_not() {
        assert_eq!(flags(&TETRAHEDRON), [false; 4]);
        assert_eq!(flags(&TETRAHEDRON[..3]), [true; 3]);
        let mut with_sheet = TETRAHEDRON.to_vec();
        with_sheet.push([4, 5, 6]);
        assert_eq!(flags(&with_sheet), [false, false, false, false, true]);
        assert!(flags(&[]).is_empty());
    }

    #[test]
    fn one_flipped_or_doubled_face_opens_the_shell() {
        let mut flipped = TETRAHEDRON;
        flipped[2].swap(0, 1);
        assert_eq!(flags(&flipped), [true; 4]);
        let mut doubled = TETRAHEDRON.to_vec();
        doubled.push(TETRAHEDRON[0]);
        assert_eq!(flags(&doubled), [true; 5]);
    }

    #[test]
    fn solids_and_their_hollows_are_told_from_rooms() {
        // Tetrahedra of edge 8, 4 and 1 within each other, and one beside them; some are turned inward.
        let edges = [8.0, 4.0, 1.0, 1.0];
        let corner =
            |edge: f32, at: Vec3| [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z].map(|c| at + c * edge);
        let places = [Vec3::ZERO, Vec3::splat(0.5), Vec3::ONE, Vec3::splat(9.0)];
        let positions: Vec<Vec3> = edges
            .into_iter()
            .zip(places)
            .flat_map(|(edge, at)| corner(edge, at))
            .collect();
        let solids = |inward: [bool; 4], lit: bool| {
            let faces: Vec<[u32; 3]> = (0..4)
                .flat_map(|shell| TETRAHEDRON.map(|face| (shell, face)))
                .map(|(shell, [a, b, c])| {
                    let face = if inward[shell as usize] {
                        [a, c, b]
                    } else {
                        [a, b, c]
                    };
                    face.map(|vertex| vertex + 4 * shell)
                })
                .collect();
            let list = triangles(&faces);
            let shells = Shells::of(&list);
            let emits = |triangle: usize| lit && triangle / 4 == 2;
            shells.bound_solids(&list, &positions, emits)
        };
        let (outward, inward) = (false, true);
        assert_eq!(solids([outward; 4], false), [true; 4]);
        assert_eq!(
            solids([inward, outward, inward, inward], false),
            [false, true, true, false]
        );
        assert_eq!(
            solids([outward; 4], true),
            [false, false, true, true],
            "around a light there is a room"
        );
    }

    #[test]
    fn shells_that_look_outward_around_a_light_are_found() {
        let mut positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
        let inner = [
            Vec3::splat(0.1),
            Vec3::new(0.2, 0.1, 0.1),
            Vec3::new(0.1, 0.2, 0.1),
        ];
        positions.extend(inner);
        let mut corners = TETRAHEDRON.to_vec();
        corners.push([4, 5, 6]);
        let count = |corners: &[[u32; 3]], positions: &[Vec3]| {
            let triangles = triangles(corners);
            let shells = Shells::of(&triangles);
            inverted_shell_count(&triangles, positions, |triangle| triangle == 4, &shells)
        };
        assert_eq!(count(&corners, &positions), 1);
        let inward = corners
            .iter()
            .map(|&[a, b, c]| [a, c, b])
            .collect::<Vec<_>>();
        assert_eq!(count(&inward, &positions), 0);
        for position in &mut positions[4..] {
            *position += 5.0;
        }
        assert_eq!(count(&corners, &positions), 0);
    }
}
