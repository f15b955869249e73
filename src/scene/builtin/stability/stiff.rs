//! Scenes in which light hardly dies, or hardly gets through.

use glam::{DVec3, Vec3};

use super::pieces::{LAMP, WALL, empty, grey, lit_room, plain_room, rectangle};
use crate::scene::{
    Material, SceneBuilder,
    builtin::shapes::{Facing, Mesh, Side, geodesic_sphere, lattice_box, lines_through},
};

/// Openings of [`maze`]. No straight line passes more than two of them, so that light needs 20 bounces to its end.
pub const MAZE_OPENINGS: u32 = 42;

/// Length of a chamber of the maze.
const CHAMBER: f64 = 0.5;

/// Edge of the square hole between two rooms.
pub const PIN_HOLE: f64 = 0.1;

/// Radius of the inner of two spheres about one centre, of which the outer has 1.
pub const INNER_SPHERE: f64 = 0.5;

/// One in so many triangles is missing in a [`leaking_sphere`].
pub const LEAK_EVERY: usize = 100;

/// A tube with baffles that leave its left and its right half open in turn; the near end is the lamp. Baffles are sheets:
/// two faces back to back.
pub fn maze(reflectance: f32) -> SceneBuilder {
    let mut builder = empty("maze");
    let wall = grey(&mut builder, WALL, reflectance, 0.0);
    let lamp = grey(&mut builder, LAMP, reflectance, 1.0);
    let halves = [0.0, 0.5, 1.0];
    let end = CHAMBER * f64::from(MAZE_OPENINGS + 1);
    let along = lines_through(&[0.0, end], CHAMBER);
    lattice_box([&halves, &halves, &along], Facing::Inward, |side, _| {
        Some(if side == Side::Near { lamp } else { wall })
    })
    .add_to(&mut builder, "tube");
    let mut baffles = Mesh::default();
    for number in 0..MAZE_OPENINGS {
        let left = if number % 2 == 0 { 0.5 } else { 0.0 };
        let corner = DVec3::new(left, 0.0, CHAMBER * f64::from(number + 1));
        baffles.append(sheet(corner, DVec3::X * 0.5, DVec3::Y, 1, wall));
    }
    baffles.add_to(&mut builder, "baffles");
    builder
}

/// Two faces back to back.
pub(super) fn sheet(
    origin: DVec3,
    u: DVec3,
    v: DVec3,
    n: u32,
    material: crate::scene::MaterialId,
) -> Mesh {
    let mut mesh = rectangle(origin, u, v, n, material);
    mesh.append(rectangle(origin, v, u, n, material));
    mesh
}

/// Two unit rooms that share a wall without thickness, which has a hole. All of the first glows, with radiance 1; the
/// materials are named `first` and `second`.
pub fn rooms_with_pin_hole(reflectance: f32) -> SceneBuilder {
    let mut builder = empty("pin-hole");
    let (low, high) = (0.5 - 0.5 * PIN_HOLE, 0.5 + 0.5 * PIN_HOLE);
    let lines = lines_through(&[0.0, low, high, 1.0], 0.25);
    let is_hole = |centre: DVec3| {
        let within = |x: f64| x > low && x < high;
        within(centre.y) && within(centre.z)
    };
    for (name, emission, open, corner) in [
        ("first", 1.0, Side::Right, DVec3::ZERO),
        ("second", 0.0, Side::Left, DVec3::X),
    ] {
        let wall = grey(&mut builder, name, reflectance, emission);
        lattice_box([&lines, &lines, &lines], Facing::Inward, |side, centre| {
            (side != open || !is_hole(centre)).then_some(wall)
        })
        .moved(|point| point + corner)
        .add_to(&mut builder, name);
    }
    builder
}

/// A sphere within a sphere, both white and made of `20 · frequency²` triangles; the `inner` one glows with radiance 1,
/// the `outer` one does not.
pub fn nested_spheres(reflectance: f32, frequency: u32) -> SceneBuilder {
    let mut builder = empty("nested-spheres");
    let outer = grey(&mut builder, "outer", reflectance, 0.0);
    let inner = grey(&mut builder, "inner", reflectance, 1.0);
    // A point reflection turns the sphere inside out.
    geodesic_sphere(frequency, outer)
        .moved(|point| -point)
        .add_to(&mut builder, "outer");
    geodesic_sphere(frequency, inner)
        .moved(|point| point * INNER_SPHERE)
        .add_to(&mut builder, "inner");
    builder
}

/// A glowing sphere seen from inside that lacks one triangle in [`LEAK_EVERY`].
pub fn leaking_sphere(reflectance: f32, frequency: u32) -> SceneBuilder {
    let mut builder = empty("leaking-sphere");
    let wall = grey(&mut builder, WALL, reflectance, 1.0);
    let mut sphere = geodesic_sphere(frequency, wall).moved(|point| -point);
    let mut number = 0;
    sphere.faces.retain(|_| {
        number += 1;
        number % LEAK_EVERY != 0
    });
    sphere.add_to(&mut builder, "sphere");
    builder
}

/// A furnace whose three channels reflect differently; all emit radiance 1.
pub fn colored_furnace(reflectance: Vec3) -> SceneBuilder {
    let mut builder = empty("colored-furnace");
    let wall = builder.push_material(Material::plain(WALL, reflectance, Vec3::ONE));
    plain_room(DVec3::ZERO, wall).add_to(&mut builder, "furnace");
    builder
}

/// A room with a lamp in its ceiling, all black.
pub fn black_room() -> SceneBuilder {
    let mut builder = empty("black-room");
    let wall = grey(&mut builder, WALL, 0.0, 0.0);
    let lamp = grey(&mut builder, LAMP, 0.0, 1.0);
    lit_room(DVec3::ZERO, wall, lamp).add_to(&mut builder, "room");
    builder
}
