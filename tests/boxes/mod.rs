//! Scenes of boxes and rectangles in code, and their light.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(dead_code, reason = "each test uses some of it")]

use std::sync::Arc;

use glam::{DVec3, Vec3};
use vecrad::{
    scene::{MaterialId, SceneBuilder, Sides},
    solver::{Snapshot, SolveSettings},
};

use crate::common::{finish, solve};

/// Six sides of a box, seen from outside or from inside.
pub(crate) fn cuboid(
    builder: &mut SceneBuilder,
    low: DVec3,
    high: DVec3,
    inward: bool,
    paint: MaterialId,
) {
    let corner = |index: usize| {
        let pick = |bit: usize, axis: usize| {
            if index & bit == 0 {
                low[axis]
            } else {
                high[axis]
            }
        };
        DVec3::new(pick(1, 0), pick(2, 1), pick(4, 2))
    };
    let corners: Vec<u32> = (0..8)
        .map(|index| builder.push_position(corner(index)))
        .collect();
    for [a, b, c, d] in [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ] {
        for [a, b, c] in [[a, b, c], [a, c, d]] {
            let triangle = if inward { [a, c, b] } else { [a, b, c] };
            builder.push_triangle(triangle.map(|index: usize| corners[index]), paint);
        }
    }
}

/// A rectangle from a corner along two edges; its front is where these turn counter-clockwise.
pub(crate) fn rectangle(
    builder: &mut SceneBuilder,
    corner: DVec3,
    [first, second]: [DVec3; 2],
    paint: MaterialId,
) {
    let corners = [
        corner,
        corner + first,
        corner + first + second,
        corner + second,
    ];
    let [a, b, c, d] = corners.map(|corner| builder.push_position(corner));
    builder.push_triangle([a, b, c], paint);
    builder.push_triangle([a, c, d], paint);
}

/// The light of a scene; places as in the file.
pub(crate) fn solved(builder: SceneBuilder, sides: Sides, settings: SolveSettings) -> Snapshot {
    let scene = finish(builder, sides);
    let frame = scene.frame;
    let (solver, _) = solve(&scene, settings);
    let mut snapshot = solver.snapshot();
    let mesh = Arc::make_mut(&mut snapshot.mesh);
    for position in &mut mesh.positions {
        *position = frame.to_world(*position).as_vec3();
    }
    snapshot
}

/// Area-weighted mean of the irradiance (red) over the triangles that are chosen by centroid and unit normal, and their area
/// and largest value; places as in the file.
pub(crate) fn mean_irradiance(
    snapshot: &Snapshot,
    is_chosen: impl Fn(Vec3, Vec3) -> bool,
) -> (f64, f64, f32) {
    let (mesh, light) = (&snapshot.mesh, &snapshot.light);
    let (mut sum, mut whole, mut most) = (0.0, 0.0, 0.0f32);
    for vertices in &mesh.indices {
        let [a, b, c] = vertices.map(|vertex| mesh.positions[vertex as usize].as_dvec3());
        let vector = (b - a).cross(c - a) * 0.5;
        let centroid = (a + b + c) / 3.0;
        if !is_chosen(centroid.as_vec3(), vector.normalize_or_zero().as_vec3()) {
            continue;
        }
        let shown = vertices.map(|vertex| light.irradiance[vertex as usize].x);
        sum += f64::from(shown.iter().sum::<f32>()) / 3.0 * vector.length();
        whole += vector.length();
        most = shown.into_iter().fold(most, f32::max);
    }
    (sum / whole, whole, most)
}

/// Irradiance (red) at the vertex nearest to a place with a normal like this one.
pub(crate) fn irradiance_at(snapshot: &Snapshot, place: Vec3, normal: Vec3) -> f32 {
    let (mesh, light) = (&snapshot.mesh, &snapshot.light);
    let facing = (0..mesh.positions.len()).filter(|&vertex| mesh.normals[vertex].dot(normal) > 0.9);
    let nearest = facing.min_by(|&a, &b| {
        let distance = |vertex: usize| mesh.positions[vertex].distance(place);
        distance(a).total_cmp(&distance(b))
    });
    light.irradiance[nearest.unwrap()].x
}
