//! Parts that several of these scenes share.

use glam::{DVec3, Vec3};

use crate::scene::{
    Material, MaterialId, SceneBuilder,
    builtin::shapes::{Facing, Mesh, Side, lattice_box},
};

/// Name of the material of plain walls.
pub const WALL: &str = "wall";

/// Name of the material of lamps.
pub const LAMP: &str = "lamp";

/// Where walls of a room with a lamp are cut: the middle of the ceiling is the lamp.
const CUTS: [f64; 4] = [0.0, 0.35, 0.65, 1.0];

/// A scene of this name without faces.
pub(super) fn empty(name: &str) -> SceneBuilder {
    let mut builder = SceneBuilder::default();
    name.clone_into(&mut builder.source.name);
    builder
}

/// Add a grey material.
pub(super) fn grey(
    builder: &mut SceneBuilder,
    name: &str,
    reflectance: f32,
    emission: f32,
) -> MaterialId {
    builder.push_material(Material::plain(
        name,
        Vec3::splat(reflectance),
        Vec3::splat(emission),
    ))
}

/// The inside of a unit cube with its low corner at `corner` and a lamp in the middle of its ceiling.
pub(super) fn lit_room(corner: DVec3, wall: MaterialId, lamp: MaterialId) -> Mesh {
    let middle = |x: f64| x > CUTS[1] && x < CUTS[2];
    lattice_box([&CUTS, &CUTS, &CUTS], Facing::Inward, |side, centre| {
        let is_lamp = side == Side::Top && middle(centre.x) && middle(centre.z);
        Some(if is_lamp { lamp } else { wall })
    })
    .moved(|point| point + corner)
}

/// The inside of a unit cube with its low corner at `corner`.
pub(super) fn plain_room(corner: DVec3, wall: MaterialId) -> Mesh {
    lit_room(corner, wall, wall)
}

/// A rectangle of `2 n²` triangles; its front shows along `u × v`.
pub(super) fn rectangle(origin: DVec3, u: DVec3, v: DVec3, n: u32, material: MaterialId) -> Mesh {
    let mut mesh = Mesh::default();
    let share = |i: u32| f64::from(i) / f64::from(n);
    for j in 0..=n {
        for i in 0..=n {
            mesh.vertex(origin + u * share(i) + v * share(j));
        }
    }
    for j in 0..n {
        for i in 0..n {
            let first = j * (n + 1) + i;
            mesh.quad([first, first + 1, first + n + 2, first + n + 1], material);
        }
    }
    mesh
}
