//! Gloss of drawn pictures, which shoot no rays from the eye, against closed forms.

#![cfg(feature = "viewer")]
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod display_scenes;
mod pictures;

use std::sync::Arc;

use glam::{DVec3, Vec3};
use image::Rgb32FImage;
use pictures::unless_no_adapter;
use vecrad::{
    export::ToneMap,
    scene::{
        Environment, Material, MaterialId, Scene, SceneBuilder, SceneOptions, Sides, Sky, Specular,
        luminance,
    },
    solver::{Snapshot, VertexLight},
    viewer::{
        camera::Camera,
        headless::{self, Subject},
        view::ViewSettings,
    },
};

const SIZE: [u32; 2] = [128, 128];

/// A square of side 2 about the origin that faces +z, in parts so that its vertices are close.
fn board(builder: &mut SceneBuilder, material: MaterialId) {
    const PARTS: u32 = 16;
    let at = |step: u32| 2.0 * f64::from(step) / f64::from(PARTS) - 1.0;
    for (row, column) in (0..PARTS).flat_map(|row| (0..PARTS).map(move |column| (row, column))) {
        let corners = [(0, 0), (1, 0), (1, 1), (0, 1)];
        let corners = corners.map(|(x, y)| DVec3::new(at(column + x), at(row + y), 0.0));
        let [a, b, c, d] = corners.map(|corner| builder.push_position(corner));
        builder.push_triangle([a, b, c], material);
        builder.push_triangle([a, c, d], material);
    }
}

fn scene_of(builder: SceneBuilder, sky: Sky) -> Arc<Scene> {
    let options = SceneOptions::with_sides(Sides::One);
    let environment = Environment {
        sky,
        sun: None,
        is_default: false,
    };
    Arc::new(
        builder
            .finish(&options)
            .unwrap()
            .in_environment(environment),
    )
}

/// Radiance of a scene whose vertices get this irradiance, seen in a direction.
fn radiance(scene: &Arc<Scene>, irradiance: f32, eye: Vec3, gloss: bool) -> Option<Rgb32FImage> {
    let mesh = display_scenes::own_triangles(scene);
    let light = VertexLight {
        irradiance: vec![Vec3::splat(irradiance); mesh.positions.len()],
        direct: vec![Vec3::ZERO; mesh.positions.len()],
    };
    let snapshot = Snapshot {
        step: 1,
        mesh: Arc::new(mesh),
        light: Arc::new(light),
        ..Snapshot::default()
    };
    let subject = Subject {
        scene,
        snapshot: &snapshot,
        errors: None,
        interior: None,
        is_dark: false,
    };
    let view = ViewSettings {
        auto_exposure: false,
        tone_map: ToneMap::None,
        gloss,
        ..ViewSettings::default()
    };
    let middle = scene.frame.from_world(DVec3::ZERO);
    let camera = Camera::looking(middle + eye, middle, Vec3::Y);
    unless_no_adapter(headless::picture(subject, &camera, &view, SIZE))?.radiance
}

fn middle(picture: &Rgb32FImage) -> Vec3 {
    Vec3::from_array(picture.get_pixel(SIZE[0] / 2, SIZE[1] / 2).0)
}

#[test]
fn under_an_even_sky_the_lobe_reflects_its_albedo() {
    let color = Vec3::new(0.8, 0.5, 0.2);
    for (specular, tolerance) in [
        (Specular::Mirror { reflectance: color }, 0.01),
        (
            Specular::Gloss {
                reflectance: color,
                roughness: 0.4,
            },
            0.02,
        ),
    ] {
        let mut builder = SceneBuilder::default();
        let material = builder.push_material(Material {
            specular: Some(specular),
            ..Material::plain("board", Vec3::splat(0.2), Vec3::ZERO)
        });
        board(&mut builder, material);
        let scene = scene_of(builder, Sky::Uniform(Vec3::ONE));
        for direction in [Vec3::Z, Vec3::new(0.8, 0.0, 0.6)] {
            let Some(picture) = radiance(&scene, 0.0, direction * 80.0, true) else {
                return;
            };
            let expected = color * specular.moments(direction.z).albedo;
            let found = middle(&picture);
            let error = (found / expected - Vec3::ONE).abs().max_element();
            assert!(error < tolerance, "{specular:?}: {found} for {expected}");
        }
    }
}

/// A board under a lamp over its middle: a square of this half side at the height 1 that looks down.
fn under_lamp(specular: Specular, half: f64) -> Arc<Scene> {
    let mut builder = SceneBuilder::default();
    let material = builder.push_material(Material {
        specular: Some(specular),
        ..Material::plain("board", Vec3::ZERO, Vec3::ZERO)
    });
    board(&mut builder, material);
    let lamp = builder.push_material(Material::plain("lamp", Vec3::ZERO, Vec3::splat(10.0)));
    let corners = [(-half, -half), (-half, half), (half, half), (half, -half)];
    let [a, b, c, d] = corners.map(|(x, y)| builder.push_position(DVec3::new(x, y, 1.0)));
    builder.push_triangle([a, b, c], lamp);
    builder.push_triangle([a, c, d], lamp);
    scene_of(builder, Sky::Dark)
}

/// Column and row of the brightest pixel, and its luminance.
fn brightest(picture: &Rgb32FImage) -> ([u32; 2], f32) {
    let light = |pixel: &image::Rgb<f32>| luminance(Vec3::from_array(pixel.0));
    let pixels = picture.enumerate_pixels();
    let all = pixels.map(|(x, y, pixel)| ([x, y], light(pixel)));
    all.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap()
}

#[test]
fn highlights_stand_where_a_mirror_shows_the_lamp() {
    let white = Vec3::ONE;
    for (specular, half) in [
        (Specular::Mirror { reflectance: white }, 0.05),
        (
            Specular::Gloss {
                reflectance: white,
                roughness: 0.1,
            },
            0.01,
        ),
    ] {
        let scene = under_lamp(specular, half);
        // From a height of 1 beside the lamp, the mirrored lamp is seen half way: from 0.6 at 0.3.
        let eye = Vec3::new(0.6, 0.0, 1.0) * scene.frame.scale as f32;
        let Some(picture) = radiance(&scene, 0.0, eye, true) else {
            return;
        };
        let ([x, y], most) = brightest(&picture);
        let dark = radiance(&scene, 0.0, eye, false).unwrap();
        assert_eq!(middle(&dark), Vec3::ZERO);
        // The camera looks at the middle; the lobe lies to its side, towards the eye.
        let camera = Camera::looking(eye, Vec3::ZERO, Vec3::Y);
        let place =
            scene.frame.from_world(DVec3::new(0.3, 0.0, 0.0)) - scene.frame.from_world(DVec3::ZERO);
        let clip = camera.clip_from_frame(1.0) * place.extend(1.0);
        let expected = [
            (clip.x / clip.w + 1.0) * 0.5 * SIZE[0] as f32,
            (1.0 - clip.y / clip.w) * 0.5 * SIZE[1] as f32,
        ];
        let distance = (x as f32 + 0.5 - expected[0]).hypot(y as f32 + 0.5 - expected[1]);
        assert!(distance < 4.0, "{specular:?}: {x} {y} for {expected:?}");
        if matches!(specular, Specular::Mirror { .. }) {
            // In a mirror a lamp is as bright as it is.
            assert!((most / 10.0 - 1.0).abs() < 0.1, "{most}");
        }
    }
}

#[test]
fn what_is_diffuse_only_is_drawn_as_without_gloss() {
    let mut builder = SceneBuilder::default();
    let material = builder.push_material(Material::plain("board", Vec3::splat(0.5), Vec3::ZERO));
    board(&mut builder, material);
    let scene = scene_of(builder, Sky::Uniform(Vec3::ONE));
    let pictures = [true, false].map(|gloss| radiance(&scene, 3.0, Vec3::Z * 80.0, gloss));
    assert_eq!(pictures[0], pictures[1]);
}
