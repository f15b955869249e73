//! The scenes of the table: some where omissions apply, and some that need everything.

use crate::scene::{
    BuildError, Scene, SceneBuilder, SceneOptions, Sides,
    builtin::{empty_cornell, find_builtin, furnace, perpendicular_plates, plates, sphere_furnace},
};

/// A scene of the table.
#[derive(Clone, Copy, Debug)]
pub struct Exhibit {
    /// Its name; unique.
    pub name: &'static str,
    /// Whether all its runs take no more than a second or two in a build without optimisation.
    pub is_quick: bool,
    sides: Sides,
    builder: fn() -> SceneBuilder,
}

impl Exhibit {
    /// The finished scene.
    ///
    /// # Errors
    /// As [`SceneBuilder::finish`]; not for the scenes in this module.
    pub fn scene(&self) -> Result<Scene, BuildError> {
        let mut builder = (self.builder)();
        self.name.clone_into(&mut builder.source.name);
        builder.finish(&SceneOptions::with_sides(self.sides))
    }
}

/// All scenes of the table.
pub fn exhibits() -> &'static [Exhibit] {
    &EXHIBITS
}

fn builtin(name: &str) -> SceneBuilder {
    find_builtin(name).map_or_else(SceneBuilder::default, |builtin| builtin.builder())
}

static EXHIBITS: [Exhibit; 11] = [
    Exhibit {
        name: "plates",
        is_quick: true,
        sides: Sides::Auto,
        builder: || plates(1.0),
    },
    Exhibit {
        name: "perpendicular-plates",
        is_quick: true,
        sides: Sides::Auto,
        builder: perpendicular_plates,
    },
    Exhibit {
        name: "furnace",
        is_quick: false,
        sides: Sides::Auto,
        builder: || furnace(0.5, 0.5, 4),
    },
    Exhibit {
        name: "furnace, two-sided",
        is_quick: false,
        sides: Sides::Two,
        builder: || furnace(0.5, 0.5, 4),
    },
    Exhibit {
        name: "sphere from inside",
        is_quick: false,
        sides: Sides::One,
        builder: || sphere_furnace(0.5, 0.5, 4),
    },
    Exhibit {
        name: "empty cornell",
        is_quick: false,
        sides: Sides::Auto,
        builder: empty_cornell,
    },
    Exhibit {
        name: "cornell, sides by shape",
        is_quick: false,
        sides: Sides::Auto,
        builder: || builtin("cornell"),
    },
    Exhibit {
        name: "tiled-room",
        is_quick: false,
        sides: Sides::Auto,
        builder: || builtin("tiled-room"),
    },
    Exhibit {
        name: "cornell, one-sided",
        is_quick: false,
        sides: Sides::One,
        builder: || builtin("cornell"),
    },
    Exhibit {
        name: "room-1022, one-sided",
        is_quick: false,
        sides: Sides::One,
        builder: || builtin("room-1022"),
    },
    Exhibit {
        name: "room-42879, one-sided",
        is_quick: false,
        sides: Sides::One,
        builder: || builtin("room-42879"),
    },
];
