//! Automatic exposure is taken from the pixels of a picture: not from its vertices, its lamps or its background.

#![cfg(feature = "viewer")]

mod display_scenes;
mod pictures;

use std::sync::Arc;

use glam::{DVec3, Vec3};
use image::RgbaImage;
use pictures::{assert_near, unless_no_adapter};
use vecrad::{
    export::ToneMap,
    scene::{Material, Scene, SceneBuilder, SceneOptions, Sides},
    solver::{Snapshot, VertexLight},
    viewer::{
        camera::Camera,
        headless::{self, Subject},
        view::{ViewMode, ViewSettings},
    },
};

const SIZE: [u32; 2] = [160, 120];

/// The radiance that a square reflects at the light of this scene, or emits.
#[derive(Clone, Copy)]
enum Square {
    Reflects(f32),
    Emits(f32),
}

/// Squares side by side along x, each cut into so many rows and columns.
fn squares(kinds: &[(Square, usize)]) -> (Arc<Scene>, Snapshot) {
    let mut builder = SceneBuilder::default();
    for (place, &(kind, cuts)) in kinds.iter().enumerate() {
        // Reflectance is 0.5; light is what makes the difference.
        let emission = match kind {
            Square::Reflects(_) => 0.0,
            Square::Emits(radiance) => radiance,
        };
        let name = format!("square {place}");
        let material = Material::plain(&name, Vec3::splat(0.5), Vec3::splat(emission));
        let material = builder.push_material(material);
        let at = |column: usize, row: usize| {
            let x = place as f64 + column as f64 / cuts as f64;
            DVec3::new(x, row as f64 / cuts as f64, 0.0)
        };
        for column in 0..cuts {
            for row in 0..cuts {
                let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)]
                    .map(|(x, y)| builder.push_position(at(column + x, row + y)));
                builder.push_triangle([a, b, c], material);
                builder.push_triangle([a, c, d], material);
            }
        }
    }
    let scene = builder
        .finish(&SceneOptions::with_sides(Sides::One))
        .expect("squares");
    let mesh = display_scenes::own_triangles(&scene);
    let mut irradiance = Vec::new();
    for &triangle in &mesh.triangle_of {
        let material = scene.triangles[triangle as usize].material;
        let radiance = match kinds[material.index()].0 {
            Square::Reflects(radiance) => radiance,
            Square::Emits(_) => 0.0,
        };
        let light = Vec3::splat(radiance * std::f32::consts::PI / 0.5);
        irradiance.extend([light; 3]);
    }
    let snapshot = Snapshot {
        step: 1,
        light: Arc::new(VertexLight {
            direct: irradiance.clone(),
            irradiance,
        }),
        mesh: Arc::new(mesh),
        ..Snapshot::default()
    };
    (Arc::new(scene), snapshot)
}

/// A picture with automatic exposure and without tone curve, or `None` on a machine that cannot draw.
fn draw(squares: &(Arc<Scene>, Snapshot), camera: &Camera, mode: ViewMode) -> Option<RgbaImage> {
    let subject = Subject {
        scene: &squares.0,
        snapshot: &squares.1,
        errors: None,
        interior: None,
        is_dark: false,
    };
    let view = ViewSettings {
        mode,
        tone_map: ToneMap::None,
        ..ViewSettings::default()
    };
    let drawn = unless_no_adapter(headless::picture(subject, camera, &view, SIZE))?;
    Some(drawn.display)
}

/// From straight before the middle of a square, so near that it fills the picture, or so far that all are in it.
fn before(squares: &(Arc<Scene>, Snapshot), place: f64, distance: f32) -> Camera {
    let target = squares
        .0
        .frame
        .from_world(DVec3::new(place + 0.5, 0.5, 0.0));
    Camera::looking(target + Vec3::Z * distance, target, Vec3::Y)
}

/// Linear value of the pixel in the middle.
fn middle(picture: &RgbaImage) -> f32 {
    let byte = picture.get_pixel(SIZE[0] / 2, SIZE[1] / 2).0[1];
    vecrad::scene::linear_from_srgb(f32::from(byte) / 255.0)
}

/// Whether a linear value is the middle gray that light is exposed to, within a bin, the rounding, and a byte.
fn assert_middle_gray(value: f32, what: &str) {
    assert!((value / 0.24).log2().abs() < 0.15, "{what}: {value}");
}

#[test]
fn what_is_seen_decides_and_not_where_vertices_are() {
    // A hundredth of the wall is bright and holds nearly all vertices, as where light is divided at a border.
    for luminance in [1e-6, 0.03, 1.0, 1e3] {
        let dim = Square::Reflects(luminance);
        let fine = squares(&[(dim, 1), (Square::Reflects(100.0 * luminance), 40)]);
        let camera = before(&fine, 0.0, 40.0);
        let Some(picture) = draw(&fine, &camera, ViewMode::Radiance) else {
            return;
        };
        assert_middle_gray(middle(&picture), "the dim square");
        let bright = before(&fine, 1.0, 40.0);
        let picture = draw(&fine, &bright, ViewMode::Radiance).expect("drawn before");
        assert_middle_gray(middle(&picture), "the bright square");
    }
}

#[test]
fn the_same_light_on_a_finer_mesh_is_exposed_alike() {
    let cuts = |fine: usize| squares(&[(Square::Reflects(0.2), fine), (Square::Reflects(2.0), 1)]);
    let (coarse, fine) = (cuts(1), cuts(50));
    let camera = before(&coarse, 0.5, 150.0);
    let Some(draft) = draw(&coarse, &camera, ViewMode::Radiance) else {
        return;
    };
    let last = draw(&fine, &camera, ViewMode::Radiance).expect("drawn before");
    for (one, other) in draft.pixels().zip(last.pixels()) {
        let [one, other] = [one, other].map(|pixel| [0, 1, 2].map(|channel| pixel.0[channel]));
        assert_near(other, one, "the finer mesh");
    }
    let again = draw(&fine, &camera, ViewMode::Radiance).expect("drawn before");
    assert!(last == again, "the same picture every time");
}

#[test]
fn lamps_and_background_do_not_count() {
    let wall = Square::Reflects(0.01);
    let with_lamps = squares(&[
        (Square::Emits(300.0), 30),
        (wall, 1),
        (Square::Emits(300.0), 30),
    ]);
    let camera = before(&with_lamps, 1.0, 100.0);
    let Some(picture) = draw(&with_lamps, &camera, ViewMode::Radiance) else {
        return;
    };
    assert_middle_gray(
        middle(&picture),
        "between two lamps, small before the background",
    );
    // Only lamps: they are shown just below white.
    let lamps = squares(&[(Square::Emits(300.0), 2)]);
    let camera = before(&lamps, 0.0, 40.0);
    let picture = draw(&lamps, &camera, ViewMode::Radiance).expect("drawn before");
    assert!(middle(&picture) > 0.9, "{}", middle(&picture));
}

#[test]
fn each_mode_of_light_is_exposed_by_what_it_shows() {
    let wall = squares(&[(Square::Reflects(3.0), 1)]);
    let camera = before(&wall, 0.0, 40.0);
    for mode in [
        ViewMode::Radiance,
        ViewMode::LightOnly,
        ViewMode::DirectOnly,
    ] {
        let Some(picture) = draw(&wall, &camera, mode) else {
            return;
        };
        assert_middle_gray(middle(&picture), mode.label());
    }
}
