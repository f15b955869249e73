//! Scenes to be lit from outside: what they hold, and how much light of the sky reaches them.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::{f32::consts::PI, path::Path, sync::Arc};

use glam::Vec3;
use vecrad::{
    geometry::RayTree,
    reference::{PathSettings, PathTracer},
    scene::{Environment, Lighting, Scene, SceneOptions, Sky, builtin::builtin, read_scene},
};

/// Mean irradiance (green) over the reflecting surfaces, W/m².
fn mean_irradiance(scene: Scene) -> f32 {
    let scene = Arc::new(scene);
    let rays = Arc::new(RayTree::new(&scene));
    let settings = PathSettings {
        point_count: 500,
        samples_per_pass: 64,
        seed: 1,
    };
    let mut tracer = PathTracer::new(scene, rays, settings);
    assert!(tracer.pass(&|| false));
    let points = tracer.result().points;
    let sum: f32 = points.iter().map(|point| point.irradiance.y).sum();
    sum / points.len() as f32
}

fn colonnade() -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/colonnade.obj");
    read_scene(&path, &SceneOptions::default()).unwrap()
}

#[test]
fn the_colonnade_is_lit_by_the_default_sky() {
    let scene = Lighting::default().apply(colonnade());
    assert!(scene.environment.is_default);
    assert_eq!(scene.textures.len(), 2);
    // Columns, beams and rafters are closed and look outward: only ground and leaves have two sides.
    let is_sheet = |name: &str| name == "leaf" || name == "slabs";
    for triangle in &scene.triangles {
        let name = &scene.materials[triangle.material.index()].name;
        assert_eq!(triangle.two_sided, is_sheet(name), "{name}");
    }
    let mean = mean_irradiance(scene);
    assert!(mean > 0.4 * PI && mean < PI, "{mean}");
}

#[test]
fn built_in_scenes_bring_their_sky_and_sun_along() {
    for name in ["courtyard", "glazed-room"] {
        let scene = builtin(name, &SceneOptions::default()).unwrap().unwrap();
        let environment = (*scene.environment).clone();
        assert!(
            !environment.sky.is_dark() && environment.sun.is_some(),
            "{name}"
        );
        let lit = mean_irradiance(scene.clone());
        let sky_only = Environment {
            sun: None,
            ..environment
        };
        let overcast = mean_irradiance(scene.clone().in_environment(sky_only));
        assert!(
            overcast > 0.1 && lit > 1.2 * overcast,
            "{name}: {lit} {overcast}"
        );
        let uniform = Environment {
            sky: Sky::Uniform(Vec3::ONE),
            ..Environment::default()
        };
        let under_one = mean_irradiance(scene.in_environment(uniform));
        assert!(
            (under_one * 0.9 / overcast - 1.0).abs() < 0.2,
            "{name}: {under_one} {overcast}"
        );
    }
}
