//! Soup: 20,000 small triangles and quadrilaterals of any orientation, half of each, floating in a room.
//! No two neighbours agree on anything: the hardest case for clusters and the easiest for no method.

use std::f64::consts::TAU;

use glam::{DVec3, Vec3};

use super::shapes::{Facing, Mesh, Numbers, Side, lattice_box, lines_through};
use crate::scene::{Material, SceneBuilder};

const POLYGON_COUNT: usize = 20_000;
/// Radius of the circle that holds a polygon's corners, in metres. Light crosses about a metre between two of them.
const RADIUS: f64 = 0.035;
const ROOM: DVec3 = DVec3::new(4.0, 3.0, 4.0);

pub(super) fn soup() -> SceneBuilder {
    let mut builder = SceneBuilder::default();
    let mut paint = |name: &str, reflectance: [f32; 3], emission: f32| {
        builder.push_material(Material::plain(
            name,
            Vec3::from_array(reflectance),
            Vec3::splat(emission),
        ))
    };
    let wall = paint("wall", [0.7, 0.7, 0.68], 0.0);
    let left = paint("left wall", [0.6, 0.2, 0.15], 0.0);
    let right = paint("right wall", [0.15, 0.3, 0.55], 0.0);
    let light = paint("light", [0.5; 3], 40.0);
    let colours = [
        paint("paper", [0.8, 0.78, 0.7], 0.0),
        paint("brick", [0.65, 0.3, 0.2], 0.0),
        paint("leaf", [0.3, 0.55, 0.2], 0.0),
        paint("sky", [0.3, 0.45, 0.7], 0.0),
    ];

    let sides = [0.0, 1.6, 2.4, ROOM.x];
    let (across, up) = (
        lines_through(&sides, 0.8),
        lines_through(&[0.0, ROOM.y], 0.75),
    );
    lattice_box([&across, &up, &across], Facing::Inward, |side, centre| {
        let is_middle = (centre - ROOM * 0.5).abs().max_element() < 1.51
            && (centre.x - 2.0).abs().max((centre.z - 2.0).abs()) < 0.4;
        Some(match side {
            Side::Top if is_middle => light,
            Side::Left => left,
            Side::Right => right,
            _ => wall,
        })
    })
    .add_to(&mut builder, "room");

    let mut mesh = Mesh::default();
    let mut numbers = Numbers(20_000);
    for index in 0..POLYGON_COUNT {
        let corners = polygon(&mut numbers, 3 + index % 2).map(|corner| mesh.vertex(corner));
        let material = colours[index / 2 % colours.len()];
        if index % 2 == 0 {
            mesh.triangle([corners[0], corners[1], corners[2]], material);
        } else {
            mesh.quad(corners, material);
        }
    }
    mesh.add_to(&mut builder, "polygons");
    builder
}

/// Corners of a flat convex polygon at a random place in the room; the last one is spare in a triangle.
fn polygon(numbers: &mut Numbers, corner_count: usize) -> [DVec3; 4] {
    let margin = DVec3::splat(1.1 * RADIUS);
    let centre = DVec3::from_array(
        [0, 1, 2].map(|axis| numbers.between(margin[axis], ROOM[axis] - margin[axis])),
    );
    let (u, v) = numbers.direction().any_orthonormal_pair();
    let start = numbers.between(0.0, TAU);
    [0, 1, 2, 3].map(|k| {
        // Less than half a step to either side, so that the corners keep their order.
        let step = f64::from(k) + numbers.between(-0.3, 0.3);
        let (sine, cosine) = (start + TAU * step / corner_count as f64).sin_cos();
        centre + (u * cosine + v * sine) * RADIUS
    })
}
