//! Pictures without a background: what is covered, and that nothing of the background is left in the colours.

#![cfg(feature = "viewer")]

mod common;
mod display_scenes;
mod pictures;

use std::{path::Path, process::Command, sync::Arc};

use common::assert_close;
use glam::{DVec3, Vec3};
use image::{DynamicImage, Rgba};
use pictures::{assert_near, unless_no_adapter};
use vecrad::{
    export::ToneMap,
    scene::{Material, Scene, SceneBuilder, SceneOptions, linear_from_srgb, srgb_byte},
    solver::{ClusterBox, Snapshot, VertexLight},
    viewer::{
        camera::Camera,
        headless::{self, HeadlessPicture, Subject},
        render::Cutout,
        theme::PICTURE_BACKGROUND,
        view::{ClusterOverlay, ViewMode, ViewSettings},
    },
};

const SIZE: [u32; 2] = [128, 128];
/// In the middle of the wall.
const INSIDE: (u32, u32) = (64, 64);
/// Beside the wall.
const OUTSIDE: (u32, u32) = (3, 3);

/// A wall of one colour that stands on a corner in the middle of the picture, so that its edges are slanted.
fn wall() -> Arc<Scene> {
    let mut builder = SceneBuilder::default();
    let color = Vec3::new(0.8, 0.4, 0.2);
    let material = builder.push_material(Material::plain("wall", color, Vec3::ZERO));
    let corners = [(0.1, -1.0), (1.0, 0.1), (-0.1, 1.0), (-1.0, -0.1)]
        .map(|(x, y)| builder.push_position(DVec3::new(x, y, 0.0)));
    for triangle in [[0, 1, 2], [0, 2, 3]] {
        builder.push_triangle(triangle.map(|corner: usize| corners[corner]), material);
    }
    Arc::new(builder.finish(&SceneOptions::default()).expect("a wall"))
}

/// The wall under even light, in a box that is larger than it.
fn lit(scene: &Scene, irradiance: f32) -> Snapshot {
    let mesh = display_scenes::own_triangles(scene);
    let count = mesh.positions.len();
    let irradiance = vec![Vec3::splat(irradiance); count];
    Snapshot {
        step: 1,
        omitted: Arc::default(),
        lights: None,
        errors: Arc::default(),
        mesh: Arc::new(mesh),
        light: Arc::new(VertexLight {
            direct: irradiance.clone(),
            irradiance,
        }),
        clusters: Arc::new(vec![ClusterBox {
            min: Vec3::new(-55.0, -55.0, -1.0),
            max: Vec3::new(55.0, 55.0, 1.0),
            level: 0,
            parent: u32::MAX,
            patch_count: 2,
            area: 1.0,
            power: 1.0,
            direction_spread: 0.0,
            link_count: 0,
            source_count: 0,
            error: 0.0,
            face_power: [0.0; 6],
        }]),
    }
}

/// Exposure 0, so that colours can be computed by hand.
fn view(tone_map: ToneMap) -> ViewSettings {
    ViewSettings {
        auto_exposure: false,
        tone_map,
        ..ViewSettings::default()
    }
}

/// With and without background, or `None` on a machine that cannot draw; CI must be able to.
fn draw(irradiance: f32, view: &ViewSettings) -> Option<(HeadlessPicture, Cutout)> {
    let scene = wall();
    let snapshot = lit(&scene, irradiance);
    let subject = Subject {
        scene: &scene,
        snapshot: &snapshot,
        errors: None,
        interior: None,
        is_dark: false,
    };
    let camera = Camera::looking(Vec3::new(0.0, 0.0, 160.0), Vec3::ZERO, Vec3::Y);
    let opaque = unless_no_adapter(headless::picture(subject, &camera, view, SIZE))?;
    let cutout = headless::cutout(subject, &camera, view, SIZE).expect("drawn before");
    Some((opaque, cutout))
}

#[test]
fn laid_over_the_background_it_is_the_opaque_picture() {
    // Below 1 and without a tone curve, colours mix in linear light, at edges, too.
    let Some((opaque, cutout)) = draw(1.5, &view(ToneMap::None)) else {
        return;
    };
    for (x, y, Rgba([r, g, b, a])) in cutout.display.enumerate_pixels() {
        let alpha = f32::from(*a) / 255.0;
        let over = [*r, *g, *b].map(|byte| {
            let front = linear_from_srgb(f32::from(byte) / 255.0);
            let mixed = alpha * front + (1.0 - alpha) * PICTURE_BACKGROUND;
            srgb_byte(mixed)
        });
        let [red, green, blue, _] = opaque.display.get_pixel(x, y).0;
        assert_near(over, [red, green, blue], &format!("at {x}, {y}"));
    }
}

#[test]
fn what_is_covered_is_opaque_and_the_rest_is_clear() {
    for tone_map in [ToneMap::None, ToneMap::Neutral] {
        // Bright enough for the tone map to matter.
        let Some((opaque, cutout)) = draw(9.0, &view(tone_map)) else {
            return;
        };
        assert_eq!(cutout.display.get_pixel(OUTSIDE.0, OUTSIDE.1).0, [0; 4]);
        assert_eq!(cutout.radiance.get_pixel(OUTSIDE.0, OUTSIDE.1).0, [0.0; 4]);
        let Rgba([r, g, b, a]) = *cutout.display.get_pixel(INSIDE.0, INSIDE.1);
        assert_eq!(a, 255);
        let [red, green, blue, _] = opaque.display.get_pixel(INSIDE.0, INSIDE.1).0;
        assert_near([r, g, b], [red, green, blue], &format!("{tone_map:?}"));
    }
}

#[test]
fn edges_have_no_fringe_and_radiance_is_multiplied_by_alpha() {
    let Some((opaque, cutout)) = draw(1.5, &view(ToneMap::Neutral)) else {
        return;
    };
    let Rgba(inside) = *cutout.display.get_pixel(INSIDE.0, INSIDE.1);
    let radiance = opaque.radiance.expect("it can be read where cutouts can");
    let whole = Vec3::from_array(radiance.get_pixel(INSIDE.0, INSIDE.1).0);
    let mut covered = 0.0;
    for (straight, multiplied) in cutout.display.pixels().zip(cutout.radiance.pixels()) {
        let (Rgba([r, g, b, a]), Rgba([.., alpha])) = (*straight, *multiplied);
        assert_eq!(a, (alpha * 255.0).round() as u8);
        covered += alpha;
        if a > 0 {
            let [red, green, blue, _] = inside;
            assert_near([r, g, b], [red, green, blue], "one colour up to the edge");
        }
        let seen = Vec3::from_slice(&multiplied.0);
        // A half float has 11 bits.
        let near = (seen - alpha * whole).abs().cmple(whole * 2e-3).all();
        assert!(near, "{seen} at alpha {alpha} of {whole}");
    }
    // Half of the square about the wall, which is 100 of the 160 · 2 · tan(fov / 2) units that the picture shows.
    let fov = Camera::looking(Vec3::Z, Vec3::ZERO, Vec3::Y).fov_y_radians;
    let side = 128.0 * 100.0 / (320.0 * (0.5 * fov).tan());
    let expected = 0.5 * side * side;
    assert_close(covered, expected, 0.03, "covered pixels");
}

#[test]
fn lines_count_as_covered() {
    let mut view = view(ToneMap::Neutral);
    view.mode = ViewMode::LightOnly;
    let Some((_, without)) = draw(1.0, &view) else {
        return;
    };
    view.clusters = ClusterOverlay {
        shown: true,
        level: 0,
        ..ClusterOverlay::default()
    };
    let (opaque, with) = draw(1.0, &view).expect("drawn before");
    let solid = |cutout: &Cutout| cutout.display.pixels().filter(|p| p.0[3] > 0).count();
    assert!(solid(&with) > solid(&without) + 100);
    let background = opaque.display.get_pixel(OUTSIDE.0, OUTSIDE.1);
    for (x, y, pixel) in with.display.enumerate_pixels() {
        let is_background = opaque.display.get_pixel(x, y) == background;
        assert_eq!(pixel.0[3] == 0, is_background, "at {x}, {y}");
    }
}

#[test]
fn files_hold_the_alpha() {
    let Some((_, cutout)) = draw(1.0, &view(ToneMap::Neutral)) else {
        return;
    };
    let inside = cutout.radiance.get_pixel(INSIDE.0, INSIDE.1).0;
    let bytes = cutout.encode(Path::new("a.exr")).expect("EXR has alpha");
    let read = image::load_from_memory(&bytes).expect("our own file");
    assert!(matches!(read, DynamicImage::ImageRgba32F(_)));
    assert_eq!(read.to_rgba32f().get_pixel(INSIDE.0, INSIDE.1).0, inside);

    let (_, cutout) = draw(1.0, &view(ToneMap::Neutral)).expect("drawn before");
    let bytes = cutout.encode(Path::new("a.png")).expect("PNG has alpha");
    let read = image::load_from_memory(&bytes).expect("our own file");
    assert!(matches!(read, DynamicImage::ImageRgba8(_)));
    let alpha_of = |(x, y)| read.to_rgba8().get_pixel(x, y).0[3];
    assert_eq!([INSIDE, OUTSIDE].map(alpha_of), [255, 0]);
}

#[test]
fn the_command_line_leaves_the_background_out() {
    let folder = tempfile::tempdir().expect("a folder can be made");
    let run = |more: &[&str]| {
        let start = ["solve", "--scene", "plates", "--preset", "draft"];
        Command::new(env!("CARGO_BIN_EXE_vecrad"))
            .args(start.iter().chain(more))
            .current_dir(folder.path())
            .output()
            .expect("it can be run")
    };
    // Nothing is drawn, so there is nothing to omit.
    assert_eq!(run(&["--transparent"]).status.code(), Some(2));
    let flags = ["--screenshot", "a.png", "--transparent", "--size", "64x64"];
    let output = run(&flags);
    if output.status.code() == Some(5) && std::env::var_os("CI").is_none() {
        eprintln!("skipped, no graphics adapter");
        return;
    }
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{said}");
    let read = image::open(folder.path().join("a.png")).expect("it was written");
    let alphas: Vec<u8> = read.to_rgba8().pixels().map(|pixel| pixel.0[3]).collect();
    assert!(alphas.contains(&0) && alphas.contains(&255));
}
