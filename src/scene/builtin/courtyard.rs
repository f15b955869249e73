//! Scenes that are lit from outside: a courtyard with an arcade, and a room behind panes.
//!
//! North is -z. Walls are thick and closed, so that nothing shines through their edges.

use glam::{DVec2, DVec3, Vec3};

use super::palette::{glass, plain, textured};
use super::pictures;
use super::shapes::{
    Facing, Mesh, Side, cuboid, geodesic_sphere, lathe, lattice_box, windowed_shell,
};
use crate::scene::{Environment, MaterialId, SceneBuilder, Sky, Sun, UpAxis};

/// A sky and a sun in it that stands at a place in degrees.
pub(super) fn day(sky: [f32; 3], [azimuth, elevation]: [f32; 2], sun: [f32; 3]) -> Environment {
    Environment {
        sky: Sky::Uniform(Vec3::from_array(sky)),
        sun: Some(Sun {
            direction: Sun::towards(azimuth, elevation, UpAxis::Y),
            irradiance: Vec3::from_array(sun),
            diameter: Sun::DEGREES.to_radians(),
        }),
        is_default: false,
    }
}

/// An afternoon in the courtyard.
pub(super) fn afternoon() -> Environment {
    day([0.7, 0.9, 1.2], [205.0, 50.0], [11.0, 10.0, 8.5])
}

/// A morning in the glazed room: the sun shines far into it.
pub(super) fn morning() -> Environment {
    day([0.8, 0.95, 1.15], [150.0, 35.0], [11.0, 9.5, 7.5])
}

/// A box by its corners.
fn block(min: [f64; 3], max: [f64; 3], paint: MaterialId) -> Mesh {
    cuboid(DVec3::from_array(min), DVec3::from_array(max), paint)
}

/// Four walls about 10 x 8 m, one of them low, with an arcade before the north wall.
pub(super) fn courtyard() -> SceneBuilder {
    let mut builder = SceneBuilder::default();
    let paving = pictures::stone_tiles(
        "paving.png",
        Vec3::new(0.74, 0.7, 0.63),
        Vec3::new(0.5, 0.46, 0.42),
    );
    let paving = textured(&mut builder, "paving", paving);
    let earth = plain(&mut builder, "earth", [0.3, 0.24, 0.17]);
    let plaster = plain(&mut builder, "plaster", [0.76, 0.7, 0.6]);
    let ochre = plain(&mut builder, "ochre wall", [0.62, 0.4, 0.2]);
    let stone = plain(&mut builder, "stone", [0.62, 0.59, 0.53]);
    let foliage = plain(&mut builder, "foliage", [0.12, 0.25, 0.07]);

    let (low, high) = (DVec3::new(-7.0, -0.4, -6.0), DVec3::new(7.0, 0.0, 6.0));
    lattice_box(
        [
            &[low.x, -5.0, 5.0, high.x],
            &[low.y, high.y],
            &[low.z, -4.0, 4.0, high.z],
        ],
        Facing::Outward,
        |side, centre| {
            let is_inside = centre.x.abs() < 5.0 && centre.z.abs() < 4.0;
            Some(if side == Side::Top && is_inside {
                paving
            } else {
                earth
            })
        },
    )
    .textured(paving, |p| glam::Vec2::new(p.x as f32, p.z as f32) * 0.4)
    .add_to(&mut builder, "ground");
    for (name, min, max, paint) in [
        ("west wall", [-5.4, -0.1, -4.5], [-5.0, 6.5, 4.5], ochre),
        ("east wall", [5.0, -0.1, -4.5], [5.4, 6.5, 4.5], plaster),
        ("north wall", [-5.2, -0.1, -4.4], [5.2, 6.4, -4.0], plaster),
        ("south wall", [-5.2, -0.1, 4.0], [5.2, 3.2, 4.4], plaster),
        ("arcade roof", [-5.1, 3.0, -4.2], [5.1, 3.3, -2.0], stone),
        ("bench", [-4.4, -0.05, 1.0], [-3.8, 0.45, 3.2], stone),
        ("planter", [2.2, -0.05, 0.4], [3.6, 0.6, 1.8], stone),
    ] {
        block(min, max, paint).add_to(&mut builder, name);
    }
    for x in [-3.75, -1.25, 1.25, 3.75] {
        let profile = [
            (0.26, -0.05),
            (0.26, 0.15),
            (0.16, 0.3),
            (0.15, 2.75),
            (0.26, 2.9),
            (0.26, 3.05),
        ];
        lathe(
            &profile.map(|(radius, y)| DVec2::new(radius, y)),
            16,
            stone,
            |_, _| 1.0,
        )
        .moved(|p| p + DVec3::new(x, 0.0, -2.4))
        .add_to(&mut builder, "column");
    }
    geodesic_sphere(6, foliage)
        .moved(|p| p * DVec3::new(0.9, 1.1, 0.9) + DVec3::new(2.9, 1.5, 1.1))
        .add_to(&mut builder, "shrub");
    builder
}

/// A room of 5 x 4 x 2.8 m with one window of two panes to the south.
pub(super) fn glazed_room() -> SceneBuilder {
    let mut builder = SceneBuilder::default();
    let earth = plain(&mut builder, "earth", [0.28, 0.3, 0.18]);
    let facade = plain(&mut builder, "facade", [0.6, 0.56, 0.5]);
    let wall = plain(&mut builder, "wall", [0.75, 0.73, 0.68]);
    let side_wall = plain(&mut builder, "side wall", [0.6, 0.3, 0.2]);
    let boards = plain(&mut builder, "boards", [0.45, 0.28, 0.15]);
    let frame = plain(&mut builder, "frame", [0.8, 0.8, 0.78]);
    let wood = plain(&mut builder, "wood", [0.4, 0.24, 0.12]);
    let glaze = plain(&mut builder, "glaze", [0.15, 0.32, 0.45]);
    let glass = glass(&mut builder, 0.12, 0.6);

    block([-6.0, -0.6, -6.0], [11.0, -0.25, 13.0], earth).add_to(&mut builder, "ground");
    let (xs, ys) = ([1.0, 4.0], [0.9, 2.4]);
    windowed_shell(
        [0.0, xs[0], xs[1], 5.0],
        [0.0, ys[0], ys[1], 2.8],
        &[0.0, 2.0, 4.0],
        0.3,
        |side| match side {
            Side::Bottom => boards,
            Side::Left | Side::Right => side_wall,
            _ => wall,
        },
        [facade, frame],
    )
    .add_to(&mut builder, "room");
    block([2.46, 0.88, 4.1], [2.54, 2.42, 4.2], frame).add_to(&mut builder, "mullion");
    let mut panes = Mesh::default();
    for [left, right] in [[xs[0], 2.5], [2.5, xs[1]]] {
        let corners = [(left, ys[0]), (right, ys[0]), (right, ys[1]), (left, ys[1])]
            .map(|(x, y)| panes.vertex(DVec3::new(x, y, 4.15)));
        panes.quad(corners, glass);
    }
    panes.welded().add_to(&mut builder, "panes");

    block([1.2, 0.7, 1.4], [3.2, 0.76, 2.4], wood).add_to(&mut builder, "table top");
    for (x, z) in [(1.3, 1.5), (3.04, 1.5), (1.3, 2.24), (3.04, 2.24)] {
        block([x, -0.01, z], [x + 0.06, 0.71, z + 0.06], wood).add_to(&mut builder, "table leg");
    }
    geodesic_sphere(5, glaze)
        .moved(|p| p * 0.18 + DVec3::new(2.6, 0.935, 1.8))
        .add_to(&mut builder, "vase");
    builder
}
