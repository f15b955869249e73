//! Lights of `KHR_lights_punctual` against closed forms.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use serde_json::{Value, json};
use vecrad::{
    scene::{Lighting, Scene, Sun},
    solver::SolveSettings,
};

use super::{
    common::{assert_close, solve},
    glb::{Glb, HALVES},
    read, said,
};

/// Edge of the floor.
const FLOOR: f32 = 8.0;

/// A black floor at height 0, and a light over it.
fn floor(light: Value, node: Value) -> Glb {
    let mut glb = Glb::new();
    let black =
        json!({ "name": "floor", "pbrMetallicRoughness": { "baseColorFactor": [0, 0, 0, 1] } });
    let material = glb.push("materials", black);
    let half = 0.5 * FLOOR;
    let corners = [
        [-half, 0.0, half],
        [half, 0.0, half],
        [half, 0.0, -half],
        [-half, 0.0, -half],
    ];
    let mesh = glb.mesh(&corners, &HALVES, &json!({ "material": material }));
    glb.root(json!({ "mesh": mesh }));
    glb.light(light, node);
    glb
}

/// Places on the floor with their irradiance and area.
fn lit(scene: Scene, settings: SolveSettings) -> Vec<(DVec3, Vec3, f64)> {
    let scene = Arc::new(Lighting::default().apply(scene));
    let (solver, _) = solve(&scene, settings);
    let snapshot = solver.snapshot();
    let mesh = &snapshot.mesh;
    let triangles = mesh.indices.iter().zip(&mesh.triangle_of);
    triangles
        .filter(|(_, triangle)| {
            scene.material(vecrad::scene::TriangleId(**triangle)).name == "floor"
        })
        .flat_map(|(vertices, _)| {
            let corners = vertices.map(|vertex| mesh.positions[vertex as usize]);
            let area = vecrad::geometry::area_vector(corners).length();
            let area = scene.frame.area_to_world(f64::from(area)) / 3.0;
            vertices.map(|vertex| {
                let vertex = vertex as usize;
                let light = snapshot.light.irradiance[vertex] * scene.radiance_unit;
                (scene.frame.to_world(mesh.positions[vertex]), light, area)
            })
        })
        .collect()
}

/// Compares the light of places within a distance from the middle with its closed form, and the power there.
fn assert_lit(lit: &[(DVec3, Vec3, f64)], within: f64, expected: impl Fn(DVec3) -> f64) {
    let (mut found, mut right, mut worst) = (0.0, 0.0, 0.0_f64);
    let inside = |place: &DVec3| place.x.abs().max(place.z.abs()) <= within;
    for (place, light, area) in lit.iter().filter(|(place, ..)| inside(place)) {
        let expected = expected(*place);
        found += f64::from(light.x) * area;
        right += expected * area;
        worst = worst.max((f64::from(light.x) / expected - 1.0).abs());
    }
    assert!(worst < 0.02, "a place is wrong by {worst}");
    assert_close(found, right, 0.005, "power");
}

/// Irradiance of the floor from a light at a height with this intensity towards it.
fn from_point(place: DVec3, height: f64, intensity: f64) -> f64 {
    let square = place.x * place.x + place.z * place.z + height * height;
    intensity * height / square.powf(1.5)
}

#[test]
fn a_point_light_obeys_the_square_of_the_distance() {
    // The scale of a node changes no light.
    for (scale, parent) in [(1.0, 1.0), (5.0, 2.0)] {
        let mut glb = floor(
            json!({ "type": "point", "color": [1, 0.5, 0.25], "intensity": 40, "name": "bulb" }),
            json!({ "translation": [0, 2.0 / parent, 0], "scale": [scale, scale, scale] }),
        );
        glb.json["nodes"][1]["name"] = json!("inner");
        let outer = glb.push(
            "nodes",
            json!({ "children": [1], "scale": [parent, parent, parent] }),
        );
        glb.json["scenes"][0]["nodes"] = json!([0, outer]);
        let scene = read(&glb);
        assert!(
            scene
                .objects
                .iter()
                .any(|object| object.name.label() == "bulb")
        );
        let lit = lit(scene, SolveSettings::default());
        assert_lit(&lit, 3.0, |place| from_point(place, 2.0, 40.0));
        let (_, light, _) = lit[0];
        assert!((light.y / light.x - 0.5).abs() < 1e-4 && (light.z / light.x - 0.25).abs() < 1e-4);
    }
}

#[test]
fn a_spot_has_its_intensity_on_the_axis_and_ends_at_its_cone() {
    // A quarter turn about X makes -Z of the node look down.
    let down = [
        -std::f64::consts::FRAC_1_SQRT_2,
        0.0,
        0.0,
        std::f64::consts::FRAC_1_SQRT_2,
    ];
    let [inner, outer] = [0.3_f64, 0.6];
    let scene = read(&floor(
        json!({
            "type": "spot", "intensity": 40, "name": "spot",
            "spot": { "innerConeAngle": inner, "outerConeAngle": outer },
        }),
        json!({ "translation": [0, 2, 0], "rotation": down, "scale": [3, 3, 3] }),
    ));
    let lit = lit(scene, SolveSettings::draft());
    let (mut beyond, mut found, mut right) = (0.0_f64, 0.0, 0.0);
    for &(place, light, area) in &lit {
        let angle = (place.x.hypot(place.z) / 2.0).atan();
        if angle < inner - 0.03 {
            found += f64::from(light.x) * area;
            right += from_point(place, 2.0, 40.0) * area;
        }
        if angle > outer + 0.05 {
            beyond = beyond.max(f64::from(light.x));
        }
    }
    assert_close(found, right, 0.02, "power within the inner cone");
    assert!(beyond < 0.02 * 10.0, "{beyond} beyond the cone");
}

#[test]
fn the_brightest_directional_light_is_the_sun() {
    let mut glb = floor(
        json!({ "type": "directional", "intensity": 3, "name": "noon" }),
        // -Z of the node looks 30 degrees off straight down.
        json!({ "rotation": [-(60.0_f64.to_radians() / 2.0).sin(), 0, 0, (60.0_f64.to_radians() / 2.0).cos()], "scale": [9, 9, 9] }),
    );
    glb.light(
        json!({ "type": "directional", "intensity": 1, "name": "moon" }),
        json!({}),
    );
    let scene = read(&glb);
    let sun = scene.environment.sun.unwrap();
    let expected = Vec3::new(
        0.0,
        60.0_f32.to_radians().sin(),
        60.0_f32.to_radians().cos(),
    );
    assert!(
        (sun.direction - expected).length() < 1e-6,
        "{:?}",
        sun.direction
    );
    assert!((sun.diameter.to_degrees() - Sun::DEGREES).abs() < 1e-4);
    let told = said(&scene);
    assert!(
        told.contains("only 'noon', the brightest directional light, is the sun; left out: 'moon'"),
        "{told}"
    );
    assert_lit(&lit(scene, SolveSettings::draft()), 4.0, |_| {
        3.0 * 60.0_f64.to_radians().sin()
    });
}

#[test]
fn lamps_fit_between_surfaces() {
    // A hand's breadth over the floor of a large scene.
    let mut glb = floor(
        json!({ "type": "point" }),
        json!({ "translation": [0, 0.01, 0] }),
    );
    glb.light(json!({ "type": "point", "intensity": 0 }), json!({}));
    glb.light(json!({ "type": "laser" }), json!({}));
    let scene = read(&glb);
    let lamp = scene
        .objects
        .iter()
        .find(|object| object.name.label() == "light 0")
        .unwrap();
    for triangle in lamp.start.0..lamp.end.0 {
        for corner in scene.corners(vecrad::scene::TriangleId(triangle)) {
            let world = scene.frame.to_world(corner);
            assert!((world - DVec3::Y * 0.01).length() < 0.0026, "{world}");
        }
    }
    assert_eq!(lamp.end.0 - lamp.start.0, 80);
    assert!(said(&scene).contains("lights of a type that glTF does not know were left out"));
}
