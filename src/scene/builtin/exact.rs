//! Scenes whose light is known in closed form. Lengths are in metres.
//!
//! The rooms of CIE 171:2006 have z up, and y away from the wall that is measured: 4 m square and 3 m high.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};

use super::shapes::{Facing, Mesh, Side, geodesic_sphere, lattice_box, lines_through};
use crate::scene::{Material, MaterialId, SceneBuilder, UpAxis};

/// Edge of the floor of a CIE room.
const WIDTH: f64 = 4.0;

/// Height of a CIE room.
const HEIGHT: f64 = 3.0;

/// Lines of a CIE room about a square metre in the middle of its ceiling.
const MIDDLE: [f64; 4] = [0.0, 1.5, 2.5, WIDTH];

/// Where the screen of [`cie_room_with_screen`] stands: y of its near and its far face.
pub const SCREEN: [f64; 2] = [2.5, 2.7];

/// Height of that screen.
pub const SCREEN_HEIGHT: f64 = 1.0;

/// Edges of the discs of [`discs`].
const DISC_EDGES: u32 = 64;

fn empty(name: &str, up: UpAxis) -> SceneBuilder {
    let mut builder = SceneBuilder::default();
    name.clone_into(&mut builder.source.name);
    builder.source.up = Some(up);
    builder
}

/// Add a grey material.
fn grey(builder: &mut SceneBuilder, name: &str, reflectance: f32, emission: f32) -> MaterialId {
    let [reflectance, emission] = [reflectance, emission].map(Vec3::splat);
    builder.push_material(Material::plain(name, reflectance, emission))
}

/// A black CIE room with a lamp of 1 m² and this radiance in the middle of its ceiling.
pub fn cie_room_with_lamp(radiance: f32) -> SceneBuilder {
    let mut builder = empty("cie-lamp", UpAxis::Z);
    let wall = grey(&mut builder, "wall", 0.0, 0.0);
    let lamp = grey(&mut builder, "lamp", 0.0, radiance);
    room_about_the_middle(wall, Some(lamp)).add_to(&mut builder, "room");
    builder
}

/// A black CIE room with an opening of 1 m² in the middle of its ceiling.
pub fn cie_room_with_skylight() -> SceneBuilder {
    let mut builder = empty("cie-skylight", UpAxis::Z);
    let wall = grey(&mut builder, "wall", 0.0, 0.0);
    room_about_the_middle(wall, None).add_to(&mut builder, "room");
    builder
}

fn room_about_the_middle(wall: MaterialId, middle: Option<MaterialId>) -> Mesh {
    let is_middle = |x: f64| x > MIDDLE[1] && x < MIDDLE[2];
    lattice_box(
        [&MIDDLE, &MIDDLE, &[0.0, HEIGHT]],
        Facing::Inward,
        |side, at| {
            if side == Side::Far && is_middle(at.x) && is_middle(at.y) {
                middle
            } else {
                Some(wall)
            }
        },
    )
}

/// A black CIE room whose floor has this radiosity.
pub fn cie_room_with_lit_floor(radiosity: f64) -> SceneBuilder {
    let mut builder = empty("cie-floor", UpAxis::Z);
    let wall = grey(&mut builder, "wall", 0.0, 0.0);
    let floor = grey(&mut builder, "floor", 0.0, (radiosity / PI) as f32);
    let lines = [0.0, WIDTH];
    lattice_box(
        [&lines, &lines, &[0.0, HEIGHT]],
        Facing::Inward,
        |side, _| Some(if side == Side::Near { floor } else { wall }),
    )
    .add_to(&mut builder, "room");
    builder
}

/// A black CIE room whose wall at the highest y has this radiosity, behind a screen from wall to wall on the floor.
pub fn cie_room_with_screen(radiosity: f64) -> SceneBuilder {
    let mut builder = empty("cie-screen", UpAxis::Z);
    let wall = grey(&mut builder, "wall", 0.0, 0.0);
    let lit = grey(&mut builder, "lit", 0.0, (radiosity / PI) as f32);
    let [near, far] = SCREEN;
    let along = [0.0, near, far, WIDTH];
    let upward = [0.0, SCREEN_HEIGHT, HEIGHT];
    let is_in_screen = |at: DVec3| at.y > near && at.y < far && at.z < SCREEN_HEIGHT;
    lattice_box(
        [&[0.0, WIDTH], &along, &upward],
        Facing::Inward,
        |side, at| {
            match side {
                Side::Top => Some(lit),
                // What the screen covers is not there.
                _ if is_in_screen(at) => None,
                _ => Some(wall),
            }
        },
    )
    .add_to(&mut builder, "room");
    let lines = [[0.0, WIDTH], [near, far], [0.0, SCREEN_HEIGHT]];
    lattice_box(
        lines.each_ref().map(|line| &line[..]),
        Facing::Outward,
        |side, _| matches!(side, Side::Bottom | Side::Top | Side::Far).then_some(wall),
    )
    .add_to(&mut builder, "screen");
    builder
}

/// A cube with an edge of 4 m of one reflectance, about a small ball of the same reflectance that has radiance 1.
pub fn cube_about_ball(reflectance: f32) -> SceneBuilder {
    let mut builder = empty("cube", UpAxis::Z);
    let wall = grey(&mut builder, "wall", reflectance, 0.0);
    let lines = lines_through(&[0.0, 4.0], 1.0);
    lattice_box([&lines, &lines, &lines], Facing::Inward, |_, _| Some(wall))
        .add_to(&mut builder, "cube");
    let ball = grey(&mut builder, "ball", reflectance, 1.0);
    geodesic_sphere(2, ball)
        .moved(|point| DVec3::splat(2.0) + 0.2 * point)
        .add_to(&mut builder, "ball");
    builder
}

/// A black disc of radius `radii[0]` about the origin facing up y, and one of radius `radii[1]` and radiance 1 at height
/// 1 that faces it. Both are regular polygons of the area of the circle.
pub fn discs(radii: [f64; 2]) -> SceneBuilder {
    let mut builder = empty("discs", UpAxis::Y);
    let receiver = grey(&mut builder, "receiver", 0.0, 0.0);
    let emitter = grey(&mut builder, "emitter", 0.0, 1.0);
    for (name, material, radius, height, turn) in [
        ("receiver", receiver, radii[0], 0.0, -1.0),
        ("emitter", emitter, radii[1], 1.0, 1.0),
    ] {
        let sector = TAU / f64::from(DISC_EDGES);
        let radius = radius * (sector / sector.sin()).sqrt();
        let mut mesh = Mesh::default();
        let middle = mesh.vertex(DVec3::Y * height);
        let rim: Vec<u32> = (0..DISC_EDGES)
            .map(|edge| {
                let (sin, cos) = (turn * sector * f64::from(edge)).sin_cos();
                mesh.vertex(DVec3::new(radius * cos, height, radius * sin))
            })
            .collect();
        for (edge, &corner) in rim.iter().enumerate() {
            mesh.triangle([middle, corner, rim[(edge + 1) % rim.len()]], material);
        }
        mesh.add_to(&mut builder, name);
    }
    builder
}

/// The inside of a unit sphere in three patterns: a bright cap of radiance 1 and reflectance 0.2, a white belt of 0.9,
/// and the rest of 0.4.
pub fn patterned_sphere(frequency: u32) -> SceneBuilder {
    let mut builder = empty("patterned-sphere", UpAxis::Y);
    let [cap, belt, rest] = [("cap", 0.2, 1.0), ("belt", 0.9, 0.0), ("rest", 0.4, 0.0)]
        .map(|(name, reflectance, emission)| grey(&mut builder, name, reflectance, emission));
    // A point reflection turns the sphere inside out.
    let mut mesh = geodesic_sphere(frequency, rest).moved(|point| -point);
    for face in &mut mesh.faces {
        let corners = face.corners.map(|corner| mesh.positions[corner as usize]);
        let middle = (corners[0] + corners[1] + corners[2]).normalize_or_zero();
        if middle.y > 0.7 {
            face.material = cap;
        } else if middle.x.abs() < 0.3 {
            face.material = belt;
        }
    }
    mesh.add_to(&mut builder, "sphere");
    builder
}

/// A ball of radius 1, reflectance 0.5 and radiosity 1 in a sphere of radius 2 and reflectance 0.8.
pub fn concentric_spheres(frequency: u32) -> SceneBuilder {
    let mut builder = empty("concentric-spheres", UpAxis::Y);
    let inner = grey(&mut builder, "inner", 0.5, (1.0 / PI) as f32);
    let outer = grey(&mut builder, "outer", 0.8, 0.0);
    geodesic_sphere(frequency, inner).add_to(&mut builder, "inner");
    geodesic_sphere(frequency, outer)
        .moved(|point| -2.0 * point)
        .add_to(&mut builder, "outer");
    builder
}

/// A box without a lid, about a block that floats in it, under a sky of radiance 1: each of seven reflectances comes with
/// as much emission as makes its radiance 1 likewise, so that there is radiance 1 everywhere.
pub fn even_court() -> SceneBuilder {
    let mut builder = empty("even-court", UpAxis::Z);
    let materials = [0.0, 0.9, 0.2, 0.7, 0.5, 0.3, 0.8].map(|reflectance: f32| {
        let name = format!("reflectance {reflectance}");
        grey(&mut builder, &name, reflectance, 1.0 - reflectance)
    });
    let lines = [0.0, 2.0];
    lattice_box([&lines, &lines, &lines], Facing::Inward, |side, _| {
        (side != Side::Far).then(|| materials[side as usize])
    })
    .add_to(&mut builder, "court");
    let block = [[0.5, 1.2], [0.8, 1.6], [0.4, 1.0]];
    lattice_box(
        block.each_ref().map(|line| &line[..]),
        Facing::Outward,
        |side, _| {
            let is_upright = matches!(side, Side::Left | Side::Right | Side::Bottom | Side::Top);
            Some(materials[if is_upright { 5 } else { 6 }])
        },
    )
    .add_to(&mut builder, "block");
    builder
}

/// A builder whose surfaces all have this reflectance.
pub fn with_one_reflectance(mut builder: SceneBuilder, reflectance: f32) -> SceneBuilder {
    for material in &mut builder.materials {
        material.reflectance = Vec3::splat(reflectance);
        material.reflectance_texture = None;
    }
    builder
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{SceneOptions, Sides};

    #[test]
    fn scenes_are_whole() {
        for (builder, triangles) in [
            (cie_room_with_lamp(1.0), 4 * 6 + 2 * 18),
            (cie_room_with_skylight(), 4 * 6 + 2 * 17),
            (cie_room_with_lit_floor(1.0), 12),
            (cie_room_with_screen(1.0), 2 * (2 * 2 + 2 * 5 + 3 + 2 + 3)),
            (cube_about_ball(0.5), 6 * 32 + 80),
            (discs([1.0, 0.5]), 128),
            (patterned_sphere(4), 320),
            (concentric_spheres(4), 640),
            (even_court(), 22),
        ] {
            let name = builder.source.name.clone();
            let scene = builder.finish(&SceneOptions::with_sides(Sides::One));
            let scene = scene.expect("it has faces");
            assert_eq!(scene.triangles.len(), triangles, "{name}");
        }
    }
}
