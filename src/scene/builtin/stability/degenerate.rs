//! Scenes of shapes that break readers, trees and kernels.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::{
    pieces::{LAMP, WALL, empty, grey, lit_room, plain_room, rectangle},
    stiff::sheet,
};
use crate::scene::{
    SceneBuilder,
    builtin::shapes::{
        Facing, Mesh, Numbers, bar, cuboid, lattice_box, lines_through, painted_cuboid, prism,
    },
};

/// A room with a lamp; what is put into it comes after its faces.
fn room(name: &str) -> SceneBuilder {
    let mut builder = empty(name);
    let wall = grey(&mut builder, WALL, 0.7, 0.0);
    let lamp = grey(&mut builder, LAMP, 0.5, 1.0);
    lit_room(DVec3::ZERO, wall, lamp).add_to(&mut builder, "room");
    builder
}

/// The lit room with `count` triangles in it, a million times as long as wide.
pub fn needles(count: usize) -> SceneBuilder {
    const LENGTH: f64 = 0.8;
    let mut builder = room("needles");
    let steel = grey(&mut builder, "steel", 0.5, 0.0);
    let mut mesh = Mesh::default();
    let mut numbers = Numbers(7);
    for _ in 0..count {
        let along = numbers.direction();
        let across = along.any_orthonormal_vector() * (0.5e-6 * LENGTH);
        let middle = DVec3::splat(0.5);
        let tip = mesh.vertex(middle + along * (0.5 * LENGTH));
        let [left, right] =
            [across, -across].map(|side| mesh.vertex(middle - along * (0.5 * LENGTH) + side));
        mesh.triangle([tip, left, right], steel);
    }
    mesh.add_to(&mut builder, "needles");
    builder
}

/// A furnace of which four walls are cut into `count` strips each.
pub fn sliver_furnace(reflectance: f32, count: u32) -> SceneBuilder {
    let mut builder = empty("slivers");
    let wall = grey(&mut builder, WALL, reflectance, 1.0);
    let strips = lines_through(&[0.0, 1.0], 1.0 / f64::from(count));
    let whole = [0.0, 1.0];
    lattice_box([&strips, &whole, &whole], Facing::Inward, |_, _| Some(wall))
        .add_to(&mut builder, "furnace");
    builder
}

/// The scene with faces of no area among its own: corners that repeat, and corners in line.
pub fn with_collapsed_faces(mut builder: SceneBuilder) -> SceneBuilder {
    for number in (0..builder.faces.len()).rev() {
        let face = builder.faces[number];
        let [a, b, _] = face.corners;
        let ends = [a, b].map(|corner| builder.positions[corner as usize]);
        let between = builder.push_position((ends[0] + ends[1]) * 0.5);
        for corners in [[a, a, b], [a, a, a], [a, between, b]] {
            builder
                .faces
                .insert(number + 1, crate::scene::Face { corners, ..face });
        }
    }
    // The faces of each object have become four times as many.
    for (_, first) in &mut builder.objects {
        *first *= 4;
    }
    builder
}

/// A furnace with every face given twice.
pub fn doubled_furnace(reflectance: f32) -> SceneBuilder {
    let mut builder = empty("duplicates");
    let wall = grey(&mut builder, WALL, reflectance, 1.0);
    for name in ["furnace", "again"] {
        plain_room(DVec3::ZERO, wall).add_to(&mut builder, name);
    }
    builder
}

/// Where a sheet hangs in the lit room: low corner and edges.
const SHEET: [DVec3; 3] = [
    DVec3::new(0.2, 0.45, 0.2),
    DVec3::new(0.0, 0.0, 0.45),
    DVec3::new(0.45, 0.1, 0.0),
];

/// The lit room with a sheet in it made of faces back to back.
pub fn twin_sheet() -> SceneBuilder {
    let mut builder = room("twin-sheet");
    let cloth = grey(&mut builder, "cloth", 0.6, 0.0);
    let [origin, u, v] = SHEET;
    sheet(origin, u, v, 3, cloth).add_to(&mut builder, "sheet");
    builder
}

/// The lit room with the same sheet made of faces that are lit on both sides.
pub fn two_sided_sheet() -> SceneBuilder {
    let mut builder = room("two-sided-sheet");
    let cloth = grey(&mut builder, "cloth", 0.6, 0.0);
    let [origin, u, v] = SHEET;
    rectangle(origin, u, v, 3, cloth).add_to(&mut builder, "sheet");
    builder
}

/// The lit room with boxes that stand on each other, share a side, and stand within each other.
pub fn crossing_boxes() -> SceneBuilder {
    let mut builder = room("boxes");
    let wood = grey(&mut builder, "wood", 0.6, 0.0);
    for (name, low, high) in [
        ("on the floor", [0.1, 0.0, 0.1], [0.4, 0.3, 0.4]),
        ("on a box", [0.15, 0.3, 0.15], [0.35, 0.5, 0.35]),
        ("beside a box", [0.4, 0.0, 0.1], [0.6, 0.3, 0.4]),
        ("through the floor", [0.6, -0.2, 0.6], [0.9, 0.3, 0.9]),
        ("through a box", [0.5, 0.1, 0.7], [0.95, 0.2, 0.8]),
        ("through the wall", [0.2, 0.6, 0.7], [0.4, 0.8, 1.1]),
    ] {
        let [low, high] = [low, high].map(DVec3::from_array);
        cuboid(low, high, wood).add_to(&mut builder, name);
    }
    builder
}

/// `count` triangles of one size and any direction about one centroid; one in ten glows.
pub fn one_centroid(count: usize) -> SceneBuilder {
    let mut builder = empty("one-centroid");
    let wall = grey(&mut builder, WALL, 0.5, 0.0);
    let lamp = grey(&mut builder, LAMP, 0.5, 1.0);
    let mut mesh = Mesh::default();
    let mut numbers = Numbers(11);
    for number in 0..count {
        let (u, v) = numbers.direction().any_orthonormal_pair();
        let start = numbers.between(0.0, TAU);
        let corners = [0.0, 1.0, 2.0].map(|k| {
            let (sine, cosine) = (start + TAU * k / 3.0).sin_cos();
            mesh.vertex(u * cosine + v * sine)
        });
        mesh.triangle(corners, if number % 10 == 0 { lamp } else { wall });
    }
    mesh.add_to(&mut builder, "triangles");
    builder
}

/// One triangle that glows.
pub fn one_triangle() -> SceneBuilder {
    let mut builder = empty("one-triangle");
    let lamp = grey(&mut builder, LAMP, 0.5, 1.0);
    let mut mesh = Mesh::default();
    let corners = [DVec3::ZERO, DVec3::X, DVec3::Y].map(|corner| mesh.vertex(corner));
    mesh.triangle(corners, lamp);
    mesh.add_to(&mut builder, "triangle");
    builder
}

/// A dark room with a closed box in it, whose inside is lit by a lamp.
pub fn lamp_in_a_box() -> SceneBuilder {
    let mut builder = empty("lamp-in-a-box");
    let wall = grey(&mut builder, WALL, 0.7, 0.0);
    let inside = grey(&mut builder, "inside", 0.7, 0.0);
    let lamp = grey(&mut builder, LAMP, 0.5, 1.0);
    plain_room(DVec3::ZERO, wall).add_to(&mut builder, "room");
    let (low, high) = (DVec3::splat(0.3), DVec3::splat(0.7));
    painted_cuboid(low, high, |_| wall).add_to(&mut builder, "box");
    // The inside is a millimetre from the outside.
    lit_room(DVec3::ZERO, inside, lamp)
        .moved(|point| DVec3::splat(0.301) + point * 0.398)
        .add_to(&mut builder, "inside");
    builder
}

/// A furnace that is a round prism: its floor and its ceiling are polygons of `corners` corners.
pub fn polygon_furnace(reflectance: f32, corners: u32) -> SceneBuilder {
    let mut builder = empty("polygon");
    let wall = grey(&mut builder, WALL, reflectance, 1.0);
    let polygon: Vec<DVec2> = (0..corners)
        .map(|corner| DVec2::from_angle(TAU * f64::from(corner) / f64::from(corners)))
        .collect();
    // A point reflection turns the prism inside out.
    prism(&polygon, -0.5, 0.5, wall)
        .moved(|point| -point)
        .add_to(&mut builder, "furnace");
    builder
}

/// A unit square lit from both sides: from above by a square of radiance 3, from below by one of radiance 1, both at
/// distance 1. All are black.
pub fn sheet_between_lamps() -> SceneBuilder {
    let mut builder = empty("sheet-between-lamps");
    let cloth = grey(&mut builder, "cloth", 0.0, 0.0);
    let above = grey(&mut builder, "above", 0.0, 3.0);
    let below = grey(&mut builder, "below", 0.0, 1.0);
    rectangle(DVec3::ZERO, DVec3::Z, DVec3::X, 4, cloth).add_to(&mut builder, "cloth");
    rectangle(DVec3::Y, DVec3::X, DVec3::Z, 1, above).add_to(&mut builder, "above");
    rectangle(-DVec3::Y, DVec3::Z, DVec3::X, 1, below).add_to(&mut builder, "below");
    builder
}

/// A lit room beside a dark one of material `dark`, a tenth of a millimetre between their walls.
pub fn wall_between_rooms() -> SceneBuilder {
    let mut builder = room("thin-wall");
    let dark = grey(&mut builder, "dark", 0.7, 0.0);
    plain_room(DVec3::X * 1.0001, dark).add_to(&mut builder, "dark room");
    builder
}

/// A dark room with `count` tiny triangles of light under its ceiling.
pub fn many_lamps(count: u32) -> SceneBuilder {
    const SIZE: f64 = 2e-3;
    let mut builder = empty("many-lamps");
    let wall = grey(&mut builder, WALL, 0.7, 0.0);
    let lamp = grey(&mut builder, LAMP, 0.0, 100.0);
    plain_room(DVec3::ZERO, wall).add_to(&mut builder, "room");
    // A post, so that there are shadows.
    bar(
        DVec3::new(0.5, -0.01, 0.5),
        DVec3::new(0.5, 0.6, 0.5),
        0.05,
        8,
        wall,
    )
    .add_to(&mut builder, "post");
    let mut mesh = Mesh::default();
    let mut numbers = Numbers(13);
    for _ in 0..count {
        let (x, z) = (numbers.between(0.05, 0.95), numbers.between(0.05, 0.95));
        let corner = DVec3::new(x, 0.95, z);
        let corners = [corner, corner + DVec3::X * SIZE, corner + DVec3::Z * SIZE];
        let corners = corners.map(|corner| mesh.vertex(corner));
        mesh.triangle(corners, lamp);
    }
    mesh.add_to(&mut builder, "lamps");
    builder
}
