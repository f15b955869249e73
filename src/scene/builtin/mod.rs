//! Scenes generated in code, for trying the program, for tests and for measurements. The same bits on every run.
//!
//! Rooms are closed shells that face inward, with their light cut into the ceiling and their fixtures welded into the
//! floor; what stands in them is closed and faces outward, sunk a little into what carries it. Y is up.

mod cornell;
mod courtyard;
pub mod exact;
mod furnace;
mod gallery;
mod glossy;
mod interiors;
mod palette;
mod pictures;
mod plates;
mod room;
mod shapes;
mod soup;
pub mod stability;
mod tiled_room;

pub use cornell::empty_cornell;
pub use furnace::{furnace, sphere_furnace};
pub use plates::{perpendicular_plates, plates};
pub use room::room_of;

use glam::DVec3;

use super::{BuildError, Environment, Scene, SceneBuilder, SceneOptions, UpAxis};

/// Where to look at a scene from, in world units, with y up and a vertical field of view of about 45°.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewpoint {
    /// The eye.
    pub position: DVec3,
    /// The point in the middle of the picture.
    pub target: DVec3,
}

/// A scene that needs no file.
#[derive(Clone, Copy, Debug)]
pub struct Builtin {
    /// Its name on the command line.
    pub name: &'static str,
    /// Its description, in a line.
    pub summary: &'static str,
    /// The viewpoint for its picture.
    pub viewpoint: Viewpoint,
    faces: fn() -> SceneBuilder,
    environment: Option<fn() -> Environment>,
}

impl Builtin {
    /// Its faces and materials, not yet cleaned and scaled.
    pub fn builder(&self) -> SceneBuilder {
        let mut builder = (self.faces)();
        builder.source.name = self.name.to_owned();
        builder.source.up = Some(UpAxis::Y);
        builder
    }

    /// The finished scene, in an environment where it brings one along.
    ///
    /// # Errors
    /// As [`SceneBuilder::finish`]; not for the scenes in this module.
    pub fn scene(&self, options: &SceneOptions) -> Result<Scene, BuildError> {
        let scene = self.builder().finish(options)?;
        Ok(match self.environment {
            Some(environment) => scene.in_environment(environment()),
            None => scene,
        })
    }
}

/// All built-in scenes, those for looking at first.
pub fn builtins() -> &'static [Builtin] {
    &BUILTINS
}

/// The names of all built-in scenes.
pub fn builtin_names() -> impl ExactSizeIterator<Item = &'static str> {
    BUILTINS.iter().map(|builtin| builtin.name)
}

/// The built-in scene of this name.
pub fn find_builtin(name: &str) -> Option<&'static Builtin> {
    BUILTINS.iter().find(|builtin| builtin.name == name)
}

/// Generate the built-in scene of this name.
pub fn builtin(name: &str, options: &SceneOptions) -> Option<Result<Scene, BuildError>> {
    find_builtin(name).map(|builtin| builtin.scene(options))
}

const fn view(position: [f64; 3], target: [f64; 3]) -> Viewpoint {
    Viewpoint {
        position: DVec3::from_array(position),
        target: DVec3::from_array(target),
    }
}

static BUILTINS: [Builtin; 17] = [
    Builtin {
        name: "gallery",
        summary: "a hall with columns, a staircase, furniture and pictures, lit by windows and warm spots",
        viewpoint: view([7.3, 1.7, 0.7], [4.3, 1.75, 9.0]),
        faces: gallery::gallery,
        environment: None,
    },
    Builtin {
        name: "cornell",
        summary: "the Cornell box by its published measurements, in millimetres",
        viewpoint: view([278.0, 273.0, -800.0], [278.0, 273.0, 279.6]),
        faces: cornell::cornell,
        environment: None,
    },
    Builtin {
        name: "room-1022",
        summary: "a coloured room with two organic bodies and one small light, 1,022 triangles",
        viewpoint: room::VIEWPOINT,
        faces: room::room_1022,
        environment: None,
    },
    Builtin {
        name: "room-8621",
        summary: "the same room in 8,621 triangles",
        viewpoint: room::VIEWPOINT,
        faces: room::room_8621,
        environment: None,
    },
    Builtin {
        name: "room-42879",
        summary: "the same room in 42,879 triangles",
        viewpoint: room::VIEWPOINT,
        faces: room::room_42879,
        environment: None,
    },
    Builtin {
        name: "room-1m",
        summary: "the same room in 1,000,000 triangles",
        viewpoint: room::VIEWPOINT,
        faces: room::room_1m,
        environment: None,
    },
    Builtin {
        name: "tiled-room",
        summary: "a small room with textures: floor tiles, a poster and a patterned light",
        viewpoint: view([2.6, 1.5, 0.25], [1.1, 1.0, 3.0]),
        faces: tiled_room::tiled_room,
        environment: None,
    },
    Builtin {
        name: "glossy",
        summary: "a room with a mirror as one wall, a polished floor, a sphere of glass and leaves in a pot of brass",
        viewpoint: view([3.3, 1.55, 0.25], [1.35, 0.9, 3.0]),
        faces: glossy::glossy,
        environment: None,
    },
    Builtin {
        name: "courtyard",
        summary: "a courtyard with an arcade, under a blue sky and the afternoon's sun",
        viewpoint: view([-4.2, 1.7, 3.4], [1.6, 1.6, -3.2]),
        faces: courtyard::courtyard,
        environment: Some(courtyard::afternoon),
    },
    Builtin {
        name: "glazed-room",
        summary: "a room with a window of two panes, lit through it by sky and sun",
        viewpoint: view([0.5, 1.6, 0.4], [3.0, 1.1, 4.0]),
        faces: courtyard::glazed_room,
        environment: Some(courtyard::morning),
    },
    Builtin {
        name: "living-room",
        summary: "a living room with cushions, books, curtains and plants, lit by lamps and low sun through a window",
        viewpoint: view([3.9, 1.65, 0.2], [2.7, 0.95, 4.0]),
        faces: interiors::living_room,
        environment: Some(interiors::late_afternoon),
    },
    Builtin {
        name: "office",
        summary: "an open-plan office of 24 desks under 64 ceiling lamps, with a meeting room behind glass",
        viewpoint: view([0.5, 1.75, 0.5], [8.0, 0.7, 6.5]),
        faces: interiors::office,
        environment: None,
    },
    Builtin {
        name: "carriage",
        summary: "a subway carriage with poles, rails, straps and benches, lit by two strips of many small lamps",
        viewpoint: view([0.25, 1.65, 0.4], [0.0, 1.2, 8.0]),
        faces: interiors::carriage,
        environment: None,
    },
    Builtin {
        name: "soup",
        summary: "20,000 small triangles and quadrilaterals of any orientation in a room",
        viewpoint: view([3.8, 1.7, 0.2], [1.4, 1.4, 3.0]),
        faces: soup::soup,
        environment: None,
    },
    Builtin {
        name: "plates",
        summary: "two unit squares that face each other at distance 1; the upper one emits",
        viewpoint: view([2.6, 1.1, 2.3], [0.5, 0.45, 0.5]),
        faces: || plates(1.0),
        environment: None,
    },
    Builtin {
        name: "perpendicular-plates",
        summary: "two unit squares that share an edge at a right angle; the upright one emits",
        viewpoint: view([2.4, 1.3, 2.1], [0.4, 0.35, 0.5]),
        faces: perpendicular_plates,
        environment: None,
    },
    Builtin {
        name: "furnace",
        summary: "a closed cube that glows and reflects alike everywhere: every point has radiance 1",
        viewpoint: view([0.9, 0.55, 0.9], [0.2, 0.45, 0.2]),
        faces: || furnace(0.5, 0.5, 4),
        environment: None,
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{SceneOptions, WarningKind};

    #[test]
    fn every_scene_has_light_and_nothing_to_warn_of() {
        // The largest are made elsewhere.
        for builtin in builtins()
            .iter()
            .filter(|builtin| builtin.name != "room-1m")
        {
            let scene = builtin
                .scene(&SceneOptions::default())
                .expect("it has faces");
            assert!(scene.has_light(), "{}", builtin.name);
            let is_odd = |kind| kind != WarningKind::Orientation;
            let odd = scene.warnings.iter().find(|warning| is_odd(warning.kind));
            assert!(odd.is_none(), "{}: {odd:?}", builtin.name);
        }
    }

    #[test]
    fn walls_of_scenes_lit_from_outside_are_closed() {
        for name in ["courtyard", "glazed-room"] {
            let scene = builtin(name, &SceneOptions::default()).expect("it is there");
            let scene = scene.expect("it has faces");
            for triangle in &scene.triangles {
                let paint = &scene.materials[triangle.material.index()].name;
                assert_eq!(triangle.two_sided, paint == "glass", "{name}: {paint}");
            }
        }
    }
}
