//! Faces that lie over each other in one plane are cut, so that no light is counted twice and no two of them flicker.
//!
//! Of faces that look the same way one stays whole, and others lose what it covers: lamps go before what they lie on, and
//! smaller flat regions, as rugs, pictures and tiles are, before larger ones; of those that are alike, the first in the file.
//! Of faces that look opposite ways each is the other's back: where it is covered, it is one-sided. Faces that are covered in
//! part are cut along the edges of what covers them. What light passes through covers only what has its material.

use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

use super::clip::{cut_out, turned_left};
use super::coplanar::{Overlaps, TOUCHING, TOUCHING_SHARE, flat_areas, in_plane, projected, reach};
use super::shells::ShelledTriangles;
use super::{Face, Frame, SceneBuilder, Triangle};

/// Why a face is skipped that lies on earlier ones.
pub(super) const DOUBLED: &str = "it lies on another one that looks the same way";

/// Why a part of a face is skipped.
const PARTLY_DOUBLED: &str = "it lay on another face that looks the same way, and was cut off";

/// The treatment of a face.
enum Fate {
    /// Its back is covered.
    OneSided,
    /// All of it is covered by others.
    Dropped,
    /// Only these pieces of it are left.
    Cut {
        pieces: Vec<Piece>,
        /// Whether something is covered by others.
        is_doubled: bool,
    },
}

/// A triangle of a face, by barycentric coordinates of its corners.
struct Piece {
    corners: [DVec3; 3],
    has_back: bool,
}

/// What goes before what: the least stays.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Rank {
    /// Whether it emits nothing.
    is_dark: bool,
    /// Size class of the flat region that it belongs to.
    size: i32,
    /// Its place in the file.
    face: u32,
}

/// Size classes of regions to a factor of two of their areas. With fewer, a rug is as large as its floor; with more, rounding
/// tells which of two copies stays.
const CLASSES: f64 = 4.0;

/// Faces that have the corners of another one in the same sense; `covers` tells whether the second of two faces covers the
/// first where it lies on it.
pub(super) fn repeated(
    overlaps: &Overlaps,
    corners: &[[u32; 3]],
    covers: impl Fn(u32, u32) -> bool,
) -> Vec<u32> {
    let sorted = |triangle: u32| sorted_corners(corners[triangle as usize]);
    overlaps
        .by_triangle()
        .filter_map(|(face, mut others)| {
            let repeats = |other| sorted(other) == sorted(face) && covers(face, other);
            others.any(repeats).then_some(face)
        })
        .collect()
}

/// Corners in ascending order, and whether that turns the triangle round.
fn sorted_corners([a, b, c]: [u32; 3]) -> ([u32; 3], bool) {
    let mut sorted = [a, b, c];
    sorted.sort_unstable();
    let is_rotated = [[a, b, c], [b, c, a], [c, a, b]].contains(&sorted);
    (sorted, !is_rotated)
}

impl SceneBuilder {
    /// Take apart what lies over each other. New corners go to the ends of the positions in the frame and in the world.
    pub(super) fn resolve_overlaps(
        &mut self,
        overlaps: &Overlaps,
        triangles: &mut ShelledTriangles,
        frame: &Frame,
        positions: &mut Vec<Vec3>,
        corner_of: &mut Vec<u32>,
    ) {
        let overlapping: Vec<(u32, Vec<u32>)> = overlaps
            .by_triangle()
            .map(|(face, others)| (face, others.collect()))
            .collect();
        if overlapping.is_empty() {
            return;
        }
        let ranks = self.ranks(&overlapping, triangles, positions);
        let fates: Vec<(u32, Fate)> = overlapping
            .par_iter()
            .filter_map(|(face, others)| {
                let may_cover = |&other: &u32| self.may_cover(*face, other);
                let others: Vec<u32> = others.iter().copied().filter(may_cover).collect();
                let fate = fate(*face, &others, &ranks, triangles, positions)?;
                Some((*face, fate))
            })
            .collect();
        if fates.is_empty() {
            return;
        }
        let mut made = Made {
            faces: Vec::with_capacity(self.faces.len()),
            list: Vec::with_capacity(self.faces.len()),
            of_triangle: Vec::with_capacity(self.faces.len()),
        };
        let (mut dropped, mut cut) = (Vec::new(), Vec::new());
        let mut fates = fates.into_iter().peekable();
        let mut next_object = 0;
        for index in 0..self.faces.len() {
            while let Some(object) = self.objects.get_mut(next_object)
                && object.1 <= index
            {
                object.1 = made.faces.len();
                next_object += 1;
            }
            let face = self.faces[index];
            let mut triangle = triangles.list[index];
            let shell = triangles.shells.of_triangle[index];
            match fates.next_if(|(face, _)| *face as usize == index) {
                None => made.push(face, triangle, shell),
                Some((_, Fate::OneSided)) => {
                    triangle.two_sided = false;
                    made.push(face, triangle, shell);
                }
                Some((_, Fate::Dropped)) => dropped.push(face.line),
                Some((_, Fate::Cut { pieces, is_doubled })) => {
                    if is_doubled {
                        cut.push(face.line);
                    }
                    for piece in pieces {
                        let corners = piece
                            .corners
                            .map(|at| self.corner_at(&face, at, frame, positions, corner_of));
                        let new = cut_face(&face, &piece, corners);
                        let at = corners.map(|corner| corner_of[corner as usize]);
                        if at[0] == at[1] || at[1] == at[2] || at[2] == at[0] {
                            continue;
                        }
                        triangle.corners = at;
                        triangle.two_sided = piece.has_back;
                        made.push(new, triangle, shell);
                    }
                }
            }
        }
        for object in &mut self.objects[next_object..] {
            object.1 = made.faces.len();
        }
        self.faces = made.faces;
        triangles.list = made.list;
        triangles.shells.of_triangle = made.of_triangle;
        self.doubled_faces += dropped.len();
        self.warn_of_lines("a face", DOUBLED, &dropped);
        self.warn_of_lines("a part of a face", PARTLY_DOUBLED, &cut);
    }

    /// Whether a face emits light.
    fn emits(&self, face: u32) -> bool {
        let material = self.faces[face as usize].material.index();
        self.materials[material].emission != Vec3::ZERO
    }

    /// What goes before what, by face; of faces in shells without an overlap, not told.
    fn ranks(
        &self,
        overlapping: &[(u32, Vec<u32>)],
        triangles: &ShelledTriangles,
        positions: &[Vec3],
    ) -> Vec<Rank> {
        let shell_of = &triangles.shells.of_triangle;
        let mut is_shell_meant = vec![false; triangles.shells.closed.len()];
        for (face, _) in overlapping {
            is_shell_meant[shell_of[*face as usize] as usize] = true;
        }
        let is_meant = |face: u32| is_shell_meant[shell_of[face as usize] as usize];
        let areas = flat_areas(&triangles.list, positions, is_meant);
        let faces = (0..).zip(areas);
        faces
            .map(|(face, area)| Rank {
                is_dark: !self.emits(face),
                size: (CLASSES * area.log2()).round() as i32,
                face,
            })
            .collect()
    }

    /// Which of two faces with the same corners stays: a lamp, else the first in the file.
    pub(super) fn goes_before(&self, other: u32, face: u32) -> bool {
        (!self.emits(other), other) < (!self.emits(face), face)
    }

    /// Whether nothing of a face is seen through another one that lies on it.
    pub(super) fn may_cover(&self, face: u32, other: u32) -> bool {
        let [material, covering] =
            [face, other].map(|face| self.faces[face as usize].material.index());
        material == covering || !self.materials[covering].is_see_through()
    }

    /// The corner at a place of a face: one that it has, or a new one.
    fn corner_at(
        &mut self,
        face: &Face,
        at: DVec3,
        frame: &Frame,
        positions: &mut Vec<Vec3>,
        corner_of: &mut Vec<u32>,
    ) -> u32 {
        for (corner, share) in face.corners.into_iter().zip(at.to_array()) {
            if share == 1.0 {
                return corner;
            }
        }
        let [a, b, c] = face.corners.map(|corner| self.positions[corner as usize]);
        let world = a * at.x + b * at.y + c * at.z;
        positions.push(frame.from_world(world) + 0.0);
        corner_of.push(positions.len() as u32 - 1);
        self.push_position(world)
    }
}

/// The faces of the scene, anew.
struct Made {
    faces: Vec<Face>,
    list: Vec<Triangle>,
    of_triangle: Vec<u32>,
}

impl Made {
    fn push(&mut self, face: Face, triangle: Triangle, shell: u32) {
        self.faces.push(face);
        self.list.push(triangle);
        self.of_triangle.push(shell);
    }
}

/// A piece of a face with values interpolated from its corners.
fn cut_face(face: &Face, piece: &Piece, corners: [u32; 3]) -> Face {
    let shares = piece.corners.map(|at| at.as_vec3());
    Face {
        corners,
        texcoords: face
            .texcoords
            .map(|[a, b, c]| shares.map(|share| a * share.x + b * share.y + c * share.z)),
        normals: face
            .normals
            .map(|[a, b, c]| shares.map(|share| a * share.x + b * share.y + c * share.z)),
        ..*face
    }
}

/// The treatment of a face that overlaps others; `None` where it stays as it is.
fn fate(
    face: u32,
    others: &[u32],
    ranks: &[Rank],
    triangles: &ShelledTriangles,
    positions: &[Vec3],
) -> Option<Fate> {
    let corners = |face: u32| {
        triangles.list[face as usize]
            .corners
            .map(|corner| positions[corner as usize].as_dvec3())
    };
    let normal = |face: u32| {
        let [a, b, c] = corners(face);
        (b - a).cross(c - a)
    };
    let own = normal(face);
    let axes = in_plane(own);
    let flat = |face: u32| turned_left(corners(face).map(|corner| projected(corner, axes)));
    let is_solid = |face: u32| triangles.list[face as usize].bounds_solid;
    let (mut same, mut cutting) = (Vec::new(), Vec::new());
    let (mut backs, mut sheets) = (Vec::new(), Vec::new());
    let has_back = triangles.list[face as usize].two_sided;
    for &other in others {
        if own.dot(normal(other)) > 0.0 {
            if ranks[other as usize] < ranks[face as usize] {
                same.push(flat(other));
                if !(is_solid(face) && is_solid(other)) {
                    cutting.push(flat(other));
                }
            }
        } else if has_back {
            let shell = triangles.shells.of_triangle[other as usize];
            if !triangles.shells.closed[shell as usize] {
                sheets.push(flat(other));
            }
            backs.push(flat(other));
        }
    }
    let whole = corners(face).map(|corner| projected(corner, axes));
    let [a, b, c] = whole;
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
    let width = (b - a).perp_dot(c - a) / longest;
    let reach = reach(corners(face)[0]);
    let least = (TOUCHING * reach).min(TOUCHING_SHARE * width);
    if cut_out(whole.to_vec(), &same, least).open.is_empty() {
        return Some(Fate::Dropped);
    }
    // Solids that reach into each other stay whole: what lies inside them is told by their faces.
    let left = cut_out(whole.to_vec(), &cutting, least);
    let is_doubled = !left.covered.is_empty();
    let mut polygons: Vec<(Vec<DVec2>, bool)> = Vec::new();
    let is_backed = !backs.is_empty()
        && left
            .open
            .iter()
            .all(|part| cut_out(part.clone(), &backs, least).open.is_empty());
    if is_backed {
        if !is_doubled {
            return Some(Fate::OneSided);
        }
        polygons.extend(left.open.into_iter().map(|part| (part, false)));
    } else {
        // A solid that stands on a sheet covers its back, too, but only where nobody looks: the sheet need not be cut.
        let mut is_cut = is_doubled;
        for part in left.open {
            let parts = cut_out(part, &sheets, least);
            is_cut |= !parts.covered.is_empty();
            polygons.extend(parts.covered.into_iter().map(|part| (part, false)));
            polygons.extend(parts.open.into_iter().map(|part| (part, has_back)));
        }
        if !is_cut {
            return None;
        }
    }
    let pieces = polygons
        .iter()
        .flat_map(|(polygon, has_back)| {
            let shares: Vec<DVec3> = polygon.iter().map(|&at| barycentric(at, whole)).collect();
            let fan = (2..shares.len()).map(move |third| Piece {
                corners: [shares[0], shares[third - 1], shares[third]],
                has_back: *has_back,
            });
            fan.collect::<Vec<Piece>>()
        })
        .filter(Piece::has_area)
        .collect();
    Some(Fate::Cut { pieces, is_doubled })
}

/// Barycentric coordinates of a point of a triangle; at a corner, 1 for it.
fn barycentric(point: DVec2, [a, b, c]: [DVec2; 3]) -> DVec3 {
    let whole = (b - a).perp_dot(c - a);
    let second = (point - a).perp_dot(c - a) / whole;
    let third = (b - a).perp_dot(point - a) / whole;
    DVec3::new(1.0 - second - third, second, third)
}

impl Piece {
    /// Whether it is more than a line.
    fn has_area(&self) -> bool {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a).length() > LEAST_SHARE
    }
}

/// Pieces of less than about this share of their face are omitted: between corners that lie on a line.
const LEAST_SHARE: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{
        Material, MaterialId, Scene, SceneOptions, Sides, Warning, WarningKind,
        shells::tests::CUBOID,
    };

    /// A scene of rectangles in the plane z = 0, turned about an axis; a corner apart makes the frame large.
    #[derive(Clone)]
    struct Sheets(SceneBuilder);

    /// A point of the plane of the sheets, or above it, in the world.
    fn placed(point: DVec3) -> DVec3 {
        glam::DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.7) * point + DVec3::splat(3.0)
    }

    impl Sheets {
        fn new() -> Self {
            let mut builder = SceneBuilder::default();
            builder.push_material(Material::plain("front", Vec3::splat(0.5), Vec3::ZERO));
            builder.push_material(Material::plain("back", Vec3::splat(0.1), Vec3::ONE));
            Self(builder)
        }

        /// A rectangle as `count` by `count` quads, upward or downward.
        fn rectangle(mut self, min: [f64; 2], max: [f64; 2], count: u32, is_up: bool) -> Self {
            let corner = |column: u32, row: u32| {
                let [u, v] = [column, row].map(|step| f64::from(step) / f64::from(count));
                let flat =
                    DVec2::from(min) + (DVec2::from(max) - DVec2::from(min)) * DVec2::new(u, v);
                placed(flat.extend(0.0))
            };
            let material = MaterialId(u32::from(!is_up));
            for row in 0..count {
                for column in 0..count {
                    let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)]
                        .map(|(x, y)| self.0.push_position(corner(column + x, row + y)));
                    // Other diagonals on either side.
                    let halves = match is_up {
                        true => [[a, b, c], [a, c, d]],
                        false => [[b, a, d], [b, d, c]],
                    };
                    for half in halves {
                        self.0.push_triangle(half, material);
                    }
                }
            }
            self
        }

        /// A closed box below the plane, whose top lies in it.
        fn tile(mut self, min: [f64; 2], max: [f64; 2], depth: f64, material: MaterialId) -> Self {
            let corners: [u32; 8] = std::array::from_fn(|corner| {
                let along = |axis: usize| [min, max][corner >> axis & 1][axis];
                let z = [-depth, 0.0][corner >> 2];
                self.0
                    .push_position(placed(DVec3::new(along(0), along(1), z)))
            });
            for [a, b, c, d] in CUBOID.map(|side| side.map(|corner| corners[corner])) {
                self.0.push_triangle([a, b, c], material);
                self.0.push_triangle([a, c, d], material);
            }
            self
        }

        fn scene(&self, sides: Sides) -> Scene {
            self.0
                .clone()
                .finish(&SceneOptions::with_sides(sides))
                .expect("it has faces")
        }
    }

    /// World area of the sides of each material that are lit: upper fronts, lower backs, lower fronts, upper backs.
    fn areas(scene: &Scene) -> [f64; 4] {
        let mut areas = [0.0; 4];
        for (triangle, surface) in scene.triangles.iter().zip(&scene.surfaces) {
            let area = f64::from(surface.area_vector.length());
            let area = scene.frame.area_to_world(area);
            let first = 2 * triangle.material.index();
            if first >= areas.len() {
                continue;
            }
            areas[first] += area;
            areas[first + 1] += if triangle.two_sided { area } else { 0.0 };
        }
        areas
    }

    fn assert_areas(scene: &Scene, expected: [f64; 4]) {
        for (area, expected) in areas(scene).into_iter().zip(expected) {
            assert!(
                (area - expected).abs() < 1e-3,
                "{:?} for {expected:?}",
                areas(scene)
            );
        }
    }

    #[test]
    fn backs_are_found_however_they_are_cut() {
        for (front, back) in [(1, 1), (1, 10), (7, 3), (40, 1)] {
            let wall = Sheets::new()
                .rectangle([0.0, 0.0], [4.0, 3.0], front, true)
                .rectangle([0.0, 0.0], [4.0, 3.0], back, false);
            for sides in [Sides::Auto, Sides::One, Sides::Two] {
                assert_areas(&wall.scene(sides), [12.0, 0.0, 12.0, 0.0]);
            }
            let warnings = wall.scene(Sides::Auto).warnings;
            let skipped = |warning: &Warning| warning.kind == WarningKind::FaceSkipped;
            assert!(!warnings.iter().any(skipped));
        }
    }

    #[test]
    fn faces_stay_two_sided_beyond_their_backs() {
        let wall = Sheets::new()
            .rectangle([0.0, 0.0], [4.0, 3.0], 1, true)
            .rectangle([1.0, 1.0], [5.0, 2.0], 3, false);
        assert_areas(&wall.scene(Sides::Auto), [12.0, 9.0, 4.0, 1.0]);
        assert_areas(&wall.scene(Sides::One), [12.0, 0.0, 4.0, 0.0]);
    }

    #[test]
    fn what_looks_the_same_way_is_there_once() {
        let count = |scene: &Scene| -> usize {
            let skipped = scene.warnings.iter().filter(|warning| {
                warning.message.contains(DOUBLED) || warning.message.contains(PARTLY_DOUBLED)
            });
            skipped.map(|warning| warning.count).sum()
        };
        let again = Sheets::new()
            .rectangle([0.0, 0.0], [4.0, 3.0], 1, true)
            .rectangle([0.0, 0.0], [4.0, 3.0], 5, true);
        let scene = again.scene(Sides::Auto);
        assert_areas(&scene, [12.0, 12.0, 0.0, 0.0]);
        assert_eq!((scene.triangles.len(), count(&scene)), (2, 50));
        // A carpet before the floor, and floors that overlap.
        let carpet = Sheets::new()
            .rectangle([1.0, 1.0], [2.0, 2.0], 2, true)
            .rectangle([0.0, 0.0], [4.0, 3.0], 1, true);
        let scene = carpet.scene(Sides::Auto);
        assert_areas(&scene, [12.0, 12.0, 0.0, 0.0]);
        assert_eq!(count(&scene), 2);
        let floors = Sheets::new()
            .rectangle([0.0, 0.0], [4.0, 3.0], 3, true)
            .rectangle([3.5, 1.0], [6.0, 4.0], 1, true);
        assert_areas(&floors.scene(Sides::Auto), [18.5, 18.5, 0.0, 0.0]);
    }

    #[test]
    fn lamps_and_what_is_small_stay_whole_wherever_they_stand_in_the_file() {
        let sheets = |is_small_first: bool, small_is_lamp: bool, small_size: f64| {
            let mut sheets = Sheets::new();
            let lamp = sheets.0.push_material(Material::plain(
                "lamp",
                Vec3::ZERO,
                Vec3::splat(f32::from(u8::from(small_is_lamp))),
            ));
            for is_small in [is_small_first, !is_small_first] {
                let first = sheets.0.faces.len();
                sheets = match is_small {
                    true => sheets.rectangle([0.0, 0.0], [small_size, small_size], 1, true),
                    false => sheets.rectangle([0.0, 0.0], [4.0, 4.0], 5, true),
                };
                if is_small {
                    sheets.0.faces[first..]
                        .iter_mut()
                        .for_each(|face| face.material = lamp);
                }
            }
            sheets.scene(Sides::One)
        };
        for is_small_first in [false, true] {
            let rug = sheets(is_small_first, false, 1.5);
            assert_areas(&rug, [16.0 - 2.25, 0.0, 0.0, 0.0]);
            let spot = sheets(is_small_first, true, 1.5);
            let of_lamp = |scene: &Scene| -> f64 {
                let surfaces = scene.triangles.iter().zip(&scene.surfaces);
                let emitting = surfaces.filter(|(triangle, _)| triangle.material.index() == 2);
                let areas = emitting.map(|(_, surface)| f64::from(surface.area_vector.length()));
                scene.frame.area_to_world(areas.sum())
            };
            assert!((of_lamp(&spot) - 2.25).abs() < 1e-3);
            // A ceiling that is a lamp, once more as a ceiling.
            let panel = sheets(is_small_first, true, 4.0);
            assert!((of_lamp(&panel) - 16.0).abs() < 1e-3);
        }
    }

    #[test]
    fn a_solid_let_into_a_floor_stays_whole() {
        for is_first in [false, true] {
            let mut sheets = Sheets::new();
            let stone =
                sheets
                    .0
                    .push_material(Material::plain("stone", Vec3::splat(0.3), Vec3::ZERO));
            let floor = |sheets: Sheets| sheets.rectangle([0.0, 0.0], [4.0, 4.0], 5, true);
            let tile = |sheets: Sheets| sheets.tile([1.0, 1.0], [2.5, 2.0], 0.25, stone);
            let sheets = match is_first {
                true => floor(tile(sheets)),
                false => tile(floor(sheets)),
            };
            let scene = sheets.scene(Sides::Auto);
            let front_of = |material: usize| -> f64 {
                let surfaces = scene.triangles.iter().zip(&scene.surfaces);
                surfaces
                    .filter(|(triangle, _)| triangle.material.index() == material)
                    .map(|(_, surface)| f64::from(surface.area_vector.length()))
                    .sum()
            };
            let [floor, stone] =
                [0, 2].map(|material| scene.frame.area_to_world(front_of(material)));
            assert!((floor - (16.0 - 1.5)).abs() < 1e-3, "{floor}");
            assert!((stone - (2.0 * 1.5 + 0.25 * 5.0)).abs() < 1e-3, "{stone}");
        }
    }

    #[test]
    fn what_only_touches_or_lies_apart_stays_as_it_is() {
        let sheets = Sheets::new()
            .rectangle([0.0, 0.0], [1.0, 1.0], 3, true)
            .rectangle([1.0, 0.0], [2.0, 1.0], 2, false)
            .rectangle([0.0, 1.0], [2.0, 2.0], 1, true);
        assert_areas(&sheets.scene(Sides::Auto), [3.0, 3.0, 1.0, 1.0]);
        assert_eq!(sheets.scene(Sides::Auto).triangles.len(), 28);
        // A picture a millimetre before its wall.
        let mut picture = Sheets::new().rectangle([0.0, 0.0], [4.0, 3.0], 1, true);
        picture = picture.rectangle([1.0, 1.0], [2.0, 2.0], 1, true);
        let normal = glam::DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.7) * DVec3::Z;
        for position in &mut picture.0.positions[4..] {
            *position += normal * 1e-3;
        }
        assert_areas(&picture.scene(Sides::Auto), [13.0, 13.0, 0.0, 0.0]);
    }

    #[test]
    fn pieces_keep_what_their_face_says_and_objects_their_faces() {
        let mut sheets = Sheets::new()
            .rectangle([1.0, 1.0], [2.0, 2.0], 1, true)
            .rectangle([0.0, 0.0], [4.0, 4.0], 1, true)
            .rectangle([0.0, 5.0], [4.0, 6.0], 1, true);
        let builder = &mut sheets.0;
        for (name, start) in [("carpet", 0), ("floor", 2), ("other", 4)] {
            builder.objects.push((name.into(), start));
        }
        builder.textures.push(crate::scene::Texture {
            name: String::new(),
            width: 2,
            height: 1,
            pixels: vec![Vec3::ZERO, Vec3::ONE],
            ..crate::scene::Texture::default()
        });
        builder.materials[0].reflectance_texture = Some(crate::scene::TextureId(0));
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(glam::Vec2::from);
        for pair in builder.faces.chunks_mut(2) {
            let [a, b, c, d] = corners;
            (pair[0].texcoords, pair[1].texcoords) = (Some([a, b, c]), Some([a, c, d]));
        }
        let scene = sheets.scene(Sides::Auto);
        let floor = &scene.objects[1];
        assert_eq!(
            (floor.name.label(), scene.objects[2].name.label()),
            ("floor", "other")
        );
        assert_eq!(
            scene.objects[2].end.index() - scene.objects[2].start.index(),
            2
        );
        let inverse = glam::DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.7).inverse();
        for index in floor.start.index()..floor.end.index() {
            let at = scene.triangles[index].corners.map(|corner| {
                inverse
                    * (scene.frame.to_world(scene.positions[corner as usize]) - DVec3::splat(3.0))
            });
            for (at, uv) in at.into_iter().zip(scene.texcoords[index]) {
                assert!((at.truncate() / 4.0 - uv.as_dvec2()).length() < 1e-5);
            }
        }
    }
}
