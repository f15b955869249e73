//! Scenes for questions of scale: copies in other units, far away, of other brightness, and extremes side by side.

use glam::{DVec3, Vec3};

use super::pieces::{LAMP, WALL, empty, grey, lit_room};
use crate::scene::{
    Material, SceneBuilder,
    builtin::shapes::{Mesh, bar, cuboid, geodesic_sphere},
};

/// Edge of the lamp over the terrain.
const TINY_LAMP: f64 = 1e-3;

/// Height of the lamp over the ground below it.
const LAMP_HEIGHT: f64 = 20.0;

/// Cells along an edge of the terrain.
const TERRAIN_CELLS: u32 = 40;

/// A room with coloured things in it, which is compared with copies of itself.
pub fn furnished_room() -> SceneBuilder {
    let mut builder = empty("furnished-room");
    let wall = grey(&mut builder, WALL, 0.7, 0.0);
    let lamp = grey(&mut builder, LAMP, 0.5, 1.0);
    let paint =
        |name: &str, color: [f32; 3]| Material::plain(name, Vec3::from_array(color), Vec3::ZERO);
    let red = builder.push_material(paint("red", [0.7, 0.1, 0.08]));
    let blue = builder.push_material(paint("blue", [0.1, 0.3, 0.8]));
    lit_room(DVec3::ZERO, wall, lamp).add_to(&mut builder, "room");
    cuboid(
        DVec3::new(0.15, -0.001, 0.55),
        DVec3::new(0.45, 0.5, 0.8),
        red,
    )
    .add_to(&mut builder, "box");
    geodesic_sphere(3, blue)
        .moved(|point| DVec3::new(0.7, 0.2, 0.4) + point * 0.18)
        .add_to(&mut builder, "ball");
    bar(
        DVec3::new(0.2, 0.02, 0.2),
        DVec3::new(0.9, 0.7, 0.85),
        0.01,
        6,
        red,
    )
    .add_to(&mut builder, "stick");
    builder
}

/// The same scene with every position scaled, then shifted.
pub fn moved(mut builder: SceneBuilder, factor: f64, shift: DVec3) -> SceneBuilder {
    for position in &mut builder.positions {
        *position = *position * factor + shift;
    }
    builder
}

/// The same scene with all emission scaled.
pub fn relit(mut builder: SceneBuilder, factor: f32) -> SceneBuilder {
    for material in &mut builder.materials {
        material.emission *= factor;
    }
    builder
}

/// A kilometre of hills, and over its middle a lamp of a millimetre.
pub fn terrain_with_lamp() -> SceneBuilder {
    let mut builder = empty("terrain");
    let ground = grey(&mut builder, WALL, 0.4, 0.0);
    let lamp = grey(&mut builder, LAMP, 0.5, 1e9);
    let height = |x: f64, z: f64| 30.0 * (x / 90.0).sin() * (z / 130.0).cos();
    let mut terrain = Mesh::default();
    let coordinate = |i: u32| 1000.0 * (f64::from(i) / f64::from(TERRAIN_CELLS) - 0.5);
    for j in 0..=TERRAIN_CELLS {
        for i in 0..=TERRAIN_CELLS {
            let (x, z) = (coordinate(i), coordinate(j));
            terrain.vertex(DVec3::new(x, height(x, z), z));
        }
    }
    for j in 0..TERRAIN_CELLS {
        for i in 0..TERRAIN_CELLS {
            let first = j * (TERRAIN_CELLS + 1) + i;
            let above = first + TERRAIN_CELLS + 1;
            terrain.quad([first, above, above + 1, first + 1], ground);
        }
    }
    terrain.add_to(&mut builder, "terrain");
    let corner = DVec3::new(0.0, height(0.0, 0.0) + LAMP_HEIGHT, 0.0);
    cuboid(corner, corner + DVec3::splat(TINY_LAMP), lamp).add_to(&mut builder, "lamp");
    builder
}

/// A room with a lamp of radiance `bright` in the ceiling and a small cube of radiance `dim` on the floor.
pub fn two_lamps(bright: f32, dim: f32) -> SceneBuilder {
    let mut builder = empty("two-lamps");
    let wall = grey(&mut builder, WALL, 0.7, 0.0);
    let lamp = grey(&mut builder, LAMP, 0.5, bright);
    let glow = grey(&mut builder, "glow", 0.5, dim);
    lit_room(DVec3::ZERO, wall, lamp).add_to(&mut builder, "room");
    cuboid(DVec3::new(0.6, 0.05, 0.2), DVec3::new(0.8, 0.25, 0.4), glow)
        .add_to(&mut builder, "cube");
    builder
}
