//! Which axis of a scene points up, where that is plain.
//!
//! OBJ files do not say it. Most programs turn their scenes so that +Y is up; some do not. Where the program that wrote
//! the file is known to do the one or the other, that decides. Otherwise +Z is up where there is a floor along Z and
//! nothing like it along Y, or where a closed scene is as flat along Z as only buildings are. In doubt it is +Y.

use glam::Vec3;

use super::{Frame, Scene, Surface, Triangle, UpAxis};

/// What shows that an axis points up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UpEvidence {
    /// The comment of the program that wrote the file.
    Exporter,
    /// Where the floor lies.
    Floor,
}

impl UpEvidence {
    /// In a sentence: "+Z is up, as … shows".
    fn name(self) -> &'static str {
        match self {
            Self::Exporter => "the program that wrote the file",
            Self::Floor => "the floor",
        }
    }
}

/// Words of comments at the head of a file, in small letters, and the axis that points up in what their program writes
/// unless told otherwise.
const EXPORTERS: [(&[u8], UpAxis); 14] = [
    (b"z-up", UpAxis::Z),
    (b"z up", UpAxis::Z),
    (b"up axis: z", UpAxis::Z),
    (b"freecad", UpAxis::Z),
    (b"openscad", UpAxis::Z),
    (b"open cascade", UpAxis::Z),
    (b"y-up", UpAxis::Y),
    (b"y up", UpAxis::Y),
    (b"blender", UpAxis::Y),
    (b"3ds max", UpAxis::Y),
    (b"this file uses centimeters as units", UpAxis::Y),
    (b"cinema 4d", UpAxis::Y),
    (b"sketchup", UpAxis::Y),
    (b"zbrush", UpAxis::Y),
];

/// The up axis that a comment tells.
pub(super) fn told_by(comment: &[u8]) -> Option<UpAxis> {
    let comment = comment.to_ascii_lowercase();
    let says = |words: &[u8]| comment.windows(words.len()).any(|part| part == words);
    let told = EXPORTERS.iter().find(|(words, _)| says(words));
    told.map(|&(_, up)| up)
}

/// Sine of the angle up to which a face counts as level: what is built level is level within rounding.
const LEVEL: f32 = 0.02;
/// A floor lies within this share of the extent above the lowest point. Less misses floors with a step or a slab; more
/// takes benches for floors.
const LOWEST: f32 = 0.05;
/// A floor covers at least this share of the ground that the scene takes up …
const FLOOR: f32 = 0.5;
/// … and what covers less than this share is none.
const NO_FLOOR: f32 = 0.02;
/// A sheet with less standing on it, relative to the larger of its sides, may as well be a wall.
const LEAST_HEIGHT: f32 = 0.05;
/// A closed scene is plainly flat where it is this much lower than it is wide and deep …
const FLAT: f32 = 0.4;
/// … and has this much more area across its height than across width or depth. A narrow corridor in Y-up is as flat along
/// Z, but its walls have less.
const FLAT_AREA: f32 = 1.8;

impl Scene {
    /// One sentence that says which axis points up, where that was recognised and is not the usual one.
    pub fn up_sentence(&self) -> Option<String> {
        let evidence = self.up_evidence?;
        let (up, shown_by) = (self.up.name(), evidence.name());
        Some(format!(
            "{up} is up, as {shown_by} shows; if it is not, choose --up +Y"
        ))
    }

    /// Find out which axis points up, where the program that wrote the file may tell.
    pub(super) fn find_up(&mut self, told: Option<UpAxis>) {
        (self.up, self.up_evidence) = match told {
            Some(UpAxis::Y) => (UpAxis::Y, None),
            Some(UpAxis::Z) => (UpAxis::Z, Some(UpEvidence::Exporter)),
            None if has_floor_along_z(self) => (UpAxis::Z, Some(UpEvidence::Floor)),
            None => (UpAxis::default(), None),
        };
    }
}

/// Whether +Z plainly points up, by where the floor lies.
fn has_floor_along_z(scene: &Scene) -> bool {
    let Some(built) = Built::of(scene) else {
        return false;
    };
    let [_, y, z] = built.floors;
    let extent = built.extent;
    let widest = extent.x.max(extent.y);
    let is_alone = y < NO_FLOOR && extent.z > LEAST_HEIGHT * widest;
    let is_flat = extent.z < FLAT * extent.x.min(extent.y)
        && extent.z > LEAST_HEIGHT * widest
        && built.level.z > FLAT_AREA * built.level.x.max(built.level.y);
    z > FLOOR && (is_alone || is_flat)
}

/// What is built along the axes.
struct Built {
    /// Size of the box about it.
    extent: Vec3,
    /// Area of faces square to each axis.
    level: Vec3,
    /// By axis: area of what would be its floor, relative to the ground.
    floors: [f32; 3],
}

impl Built {
    /// Of all faces near the origin, where what matters lies; `None` where there are none.
    fn of(scene: &Scene) -> Option<Self> {
        let reach = Frame::EXTENT as f32;
        let near = |id| {
            let corners = scene.corners(id);
            let is_near = |corner: &Vec3| corner.abs().max_element() <= reach;
            corners.iter().all(is_near).then_some((id, corners))
        };
        let near = || scene.triangle_ids().filter_map(near);
        let (mut min, mut max) = (Vec3::MAX, Vec3::MIN);
        for corner in near().flat_map(|(_, corners)| corners) {
            (min, max) = (min.min(corner), max.max(corner));
        }
        if min.cmpgt(max).any() {
            return None;
        }
        let extent = max - min;
        let mut built = Self {
            extent,
            level: Vec3::ZERO,
            floors: [0.0; 3],
        };
        for (id, corners) in near() {
            let highest = corners[0].max(corners[1]).max(corners[2]) - min;
            let (surface, triangle) = (&scene.surfaces[id.index()], &scene.triangles[id.index()]);
            built.add(surface, triangle, highest);
        }
        for axis in 0..3 {
            let ground = extent[(axis + 1) % 3] * extent[(axis + 2) % 3];
            built.floors[axis] /= ground.max(f32::MIN_POSITIVE);
        }
        Some(built)
    }

    fn add(&mut self, surface: &Surface, triangle: &Triangle, highest: Vec3) {
        let vector = surface.area_vector;
        let area = vector.length();
        for axis in 0..3 {
            let along = vector[axis];
            if area * area - along * along > (LEVEL * area).powi(2) {
                continue;
            }
            self.level[axis] += area;
            let shows_up = along > 0.0 || triangle.two_sided;
            if shows_up && highest[axis] <= LOWEST * self.extent[axis] {
                self.floors[axis] += area;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::{
        SceneOptions, builtin,
        test_shapes::{builder, cuboid},
    };

    /// Boxes, each with its lower and upper corner, turned so that the axis points up.
    fn scene(up: UpAxis, boxes: &[([f64; 3], [f64; 3], bool)]) -> Scene {
        let (mut builder, wall, _) = builder();
        for &(min, max, faces_inward) in boxes {
            let corners = [min, max].map(DVec3::from_array);
            cuboid(&mut builder, corners, faces_inward, |_| true, wall);
        }
        for position in &mut builder.positions {
            if up == UpAxis::Z {
                *position = DVec3::new(position.x, -position.z, position.y);
            }
        }
        builder.finish(&SceneOptions::default()).expect("boxes")
    }

    /// A slab to stand on, with houses.
    const YARD: [([f64; 3], [f64; 3], bool); 4] = [
        ([0.0, -0.1, 0.0], [20.0, 0.0, 15.0], false),
        ([2.0, -0.05, 2.0], [6.0, 5.0, 5.0], false),
        ([10.0, -0.05, 3.0], [16.0, 3.0, 6.0], false),
        ([4.0, -0.05, 9.0], [9.0, 8.0, 13.0], false),
    ];

    #[test]
    fn a_floor_shows_which_way_is_up() {
        let hall = [([0.0, 0.0, 0.0], [10.0, 2.8, 8.0], true)];
        for boxes in [&YARD[..], &hall] {
            assert!(has_floor_along_z(&scene(UpAxis::Z, boxes)), "{boxes:?}");
            assert!(!has_floor_along_z(&scene(UpAxis::Y, boxes)), "{boxes:?}");
        }
    }

    #[test]
    fn what_may_stand_either_way_stands_along_y() {
        let shapes = [
            ([0.0, 0.0, 0.0], [3.0, 2.5, 4.0], true),
            ([0.0, 0.0, 0.0], [3.0, 9.0, 3.0], false),
            ([0.0, 0.0, 0.0], [10.0, 3.0, 1.5], true),
            ([0.0, 0.0, 0.0], [1.0, 1.0, 0.001], false),
        ];
        for shape in shapes {
            assert!(!has_floor_along_z(&scene(UpAxis::Y, &[shape])), "{shape:?}");
        }
        for found in builtin::builtins() {
            if found.name != "room-1m" {
                let scene = found.scene(&SceneOptions::default()).expect("built in");
                assert!(!has_floor_along_z(&scene), "{}", found.name);
            }
        }
    }

    #[test]
    fn comments_tell_what_their_programs_write() {
        for (comment, up) in [
            (
                &b"# Blender v2.79 (sub 0) OBJ File: 'hall.blend'"[..],
                Some(UpAxis::Y),
            ),
            (b"# FreeCAD v0.19 build24291", Some(UpAxis::Z)),
            (b"# exported with Z-up", Some(UpAxis::Z)),
            (b"# 12 vertices", None),
            (b"#", None),
        ] {
            assert_eq!(told_by(comment), up);
        }
    }
}
