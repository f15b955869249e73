//! Rooms far from the origin, as surveyors place them: the light in them is that of the same room at the origin.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod boxes;
mod common;

use std::{fmt::Write as _, fs, sync::Arc};

use boxes::{cuboid, rectangle};
use common::solve;
use glam::{DMat3, DVec3, Vec3};
use vecrad::{
    scene::{Material, SceneBuilder, SceneOptions, read_scene},
    solver::SolveSettings,
};

/// A room of 4 × 4 × 3 with a lamp under its ceiling and a box on its floor, turned and moved, as an OBJ file.
fn room(turned: DMat3, origin: DVec3) -> String {
    let mut builder = SceneBuilder::default();
    let [grey, lamp] = ["grey", "lamp"]
        .map(|name| builder.push_material(Material::plain(name, Vec3::ZERO, Vec3::ZERO)));
    let (low, high) = (DVec3::ZERO, DVec3::new(4.0, 4.0, 3.0));
    cuboid(&mut builder, low, high, true, grey);
    let (low, high) = (DVec3::new(1.0, 1.2, 0.0), DVec3::new(1.5, 2.0, 0.8));
    cuboid(&mut builder, low, high, false, grey);
    let corner = DVec3::new(1.5, 1.5, 2.9);
    rectangle(&mut builder, corner, [DVec3::Y, DVec3::X], lamp);
    let mut text = String::from("mtllib a.mtl\n");
    for position in &builder.positions {
        let at = turned * *position + origin;
        writeln!(text, "v {:.7} {:.7} {:.7}", at.x, at.y, at.z).unwrap();
    }
    for face in &builder.faces {
        let [a, b, c] = face.corners.map(|corner| corner + 1);
        let name = &builder.materials[face.material.index()].name;
        writeln!(text, "usemtl {name}\nf {a} {b} {c}").unwrap();
    }
    text
}

/// Irradiance at the vertices, and where these are from the middle of the room.
fn lit(turned: DMat3, origin: DVec3) -> Vec<(Vec3, Vec3)> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("room.obj");
    fs::write(&path, room(turned, origin)).unwrap();
    fs::write(
        folder.path().join("a.mtl"),
        "newmtl grey\nKd 0.5\nnewmtl lamp\nKd 0\nKe 10\n",
    )
    .unwrap();
    let scene = Arc::new(read_scene(&path, &SceneOptions::default()).unwrap());
    let settings = SolveSettings {
        epsilon: 0.2,
        max_steps: 1,
        ..SolveSettings::draft()
    };
    let snapshot = solve(&scene, settings).0.snapshot();
    let positions = snapshot.mesh.positions.iter().copied();
    let irradiance = snapshot.light.irradiance.iter().copied();
    positions.zip(irradiance).collect()
}

/// Mean irradiance over the vertices.
fn mean(light: &[(Vec3, Vec3)]) -> Vec3 {
    light
        .iter()
        .map(|(_, irradiance)| *irradiance)
        .sum::<Vec3>()
        / light.len() as f32
}

#[test]
fn light_does_not_depend_on_where_the_room_lies() {
    // Sides parallel to the axes and not.
    let tilted = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, 2.0) / 3.0, 0.7);
    for (turned, origins) in [
        (
            DMat3::IDENTITY,
            &[DVec3::new(412_345.678, 5_812_345.432, 123.4)][..],
        ),
        (
            tilted,
            &[
                DVec3::new(4_075_539.8, 931_735.2, 4_801_629.6),
                DVec3::new(-1e9, 1e9 + 0.5, 1e9),
            ],
        ),
    ] {
        let expected = lit(turned, DVec3::ZERO);
        for &origin in origins {
            let found = lit(turned, origin);
            // Rounding decides how faces are cut where they just touch, and which shadow rays meet an edge.
            let ratio = mean(&found) / mean(&expected);
            assert!(ratio.abs_diff_eq(Vec3::ONE, 0.01), "{origin}: {ratio}");
            let extent = |light: &[(Vec3, Vec3)]| {
                let places = light.iter().map(|(place, _)| *place);
                let (low, high) = (places.clone().reduce(Vec3::min), places.reduce(Vec3::max));
                high.unwrap() - low.unwrap()
            };
            // In frame units, of which the room is 100 long.
            assert!(
                extent(&found).abs_diff_eq(extent(&expected), 1e-2),
                "{origin}"
            );
        }
    }
}
