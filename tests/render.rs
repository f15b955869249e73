//! Pictures of a small scene, drawn without a window, have the colours that the light says.

#![cfg(feature = "viewer")]

mod display_scenes;
mod pictures;

use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};
use image::RgbaImage;
use pictures::{assert_near, unless_no_adapter};
use vecrad::{
    export::{ColorOptions, ToneMap},
    scene::{
        Environment, Material, Scene, SceneBuilder, SceneOptions, Sides, Sky, SkyPicture, Texture,
        UpAxis, builtin::find_builtin,
    },
    solver::{ClusterBox, ErrorPoint, Snapshot, VertexLight},
    viewer::{
        camera::Camera,
        cluster_lines,
        headless::{self, HeadlessError, HeadlessPicture, Subject},
        light_range::false_color_range,
        render::{Gpu, Overlay, Picture, ReadError, RenderError, Renderer, Target},
        view::{ClusterOverlay, ViewMode, ViewSettings},
    },
};

const SIZE: [u32; 2] = [128, 128];

/// A red wall that fills the left half of a picture taken from +z, and a green one in the right half that shows its back.
fn scene() -> Arc<Scene> {
    let mut builder = SceneBuilder::default();
    let colors = [Vec3::new(0.8, 0.1, 0.1), Vec3::new(0.1, 0.8, 0.1)];
    for (index, color) in colors.into_iter().enumerate() {
        let material = builder.push_material(Material::plain("wall", color, Vec3::ZERO));
        let left = index as f64 - 1.0;
        let corners = [(0.0, -1.0), (1.0, -1.0), (1.0, 1.0), (0.0, 1.0)]
            .map(|(x, y)| builder.push_position(DVec3::new(left + x, y, 0.0)));
        let triangles: [[usize; 3]; 2] = match index {
            0 => [[0, 1, 2], [0, 2, 3]],
            _ => [[0, 2, 1], [0, 3, 2]],
        };
        for triangle in triangles {
            builder.push_triangle(triangle.map(|corner| corners[corner]), material);
        }
    }
    // Both copies of a two-sided face would be needed.
    Arc::new(
        builder
            .finish(&SceneOptions::with_sides(Sides::One))
            .expect("two walls"),
    )
}

/// The scene's own triangles under even light.
fn snapshot(scene: &Scene, irradiance: Vec3) -> Snapshot {
    let mesh = display_scenes::own_triangles(scene);
    let count = mesh.positions.len();
    let root = ClusterBox {
        min: Vec3::new(-30.0, -30.0, -1.0),
        max: Vec3::new(30.0, 30.0, 1.0),
        level: 0,
        parent: u32::MAX,
        patch_count: 4,
        area: 1.0,
        power: 1.0,
        direction_spread: 0.0,
        link_count: 0,
        source_count: 0,
        error: 0.0,
        face_power: [0.0; 6],
    };
    Snapshot {
        step: 1,
        mesh: Arc::new(mesh),
        light: Arc::new(VertexLight {
            irradiance: vec![irradiance; count],
            direct: vec![irradiance * 0.5; count],
        }),
        clusters: Arc::new(vec![root]),
        omitted: Arc::default(),
        lights: None,
        errors: Arc::default(),
    }
}

fn camera() -> Camera {
    let eye = Vec3::new(0.0, 0.0, 130.0);
    Camera::looking(eye, Vec3::ZERO, Vec3::Y)
}

/// Exposure 0 and no tone map, so that colours can be computed by hand.
fn plain(mode: ViewMode) -> ViewSettings {
    ViewSettings {
        mode,
        auto_exposure: false,
        tone_map: ToneMap::None,
        ..ViewSettings::default()
    }
}

/// A picture, or `None` on a machine that cannot draw; CI must be able to.
fn draw(snapshot: &Snapshot, scene: &Arc<Scene>, view: &ViewSettings) -> Option<HeadlessPicture> {
    let subject = Subject {
        scene,
        snapshot,
        errors: None,
        interior: None,
        is_dark: false,
    };
    unless_no_adapter(headless::picture(subject, &camera(), view, SIZE))
}

/// The pixel in the middle of the left wall.
fn left(picture: &RgbaImage) -> [u8; 3] {
    let [r, g, b, _] = picture.get_pixel(40, 64).0;
    [r, g, b]
}

/// The pixel in the middle of the right wall.
fn right(picture: &RgbaImage) -> [u8; 3] {
    let [r, g, b, _] = picture.get_pixel(88, 64).0;
    [r, g, b]
}

#[test]
fn light_has_the_colours_of_the_exported_vertices() {
    let scene = scene();
    let irradiance = Vec3::new(3.0, 2.0, 1.0);
    let snapshot = snapshot(&scene, irradiance);
    let reflectance = Vec3::new(0.8, 0.1, 0.1);
    let radiance = reflectance * irradiance / std::f32::consts::PI;
    for (exposure, tone_map) in [
        (0.0, ToneMap::None),
        (0.0, ToneMap::Neutral),
        (2.5, ToneMap::Neutral),
        (-3.0, ToneMap::None),
    ] {
        let export = ColorOptions {
            exposure_ev: exposure,
            tone_map,
        };
        let mut view = plain(ViewMode::Radiance);
        view.exposure = exposure;
        view.tone_map = tone_map;
        let Some(picture) = draw(&snapshot, &scene, &view) else {
            return;
        };
        let what = format!("{tone_map:?} at {exposure} EV");
        assert_near(left(&picture.display), export.encode(radiance), &what);
    }
}

#[test]
fn light_modes_show_what_they_say() {
    let scene = scene();
    let irradiance = Vec3::splat(1.0);
    let snapshot = snapshot(&scene, irradiance);
    let plain_color = ColorOptions {
        exposure_ev: 0.0,
        tone_map: ToneMap::None,
    };
    let reflectance = Vec3::new(0.8, 0.1, 0.1);
    let over_pi = 1.0 / std::f32::consts::PI;
    for (mode, expected) in [
        (ViewMode::LightOnly, irradiance * over_pi),
        (ViewMode::DirectOnly, reflectance * 0.5 * over_pi),
        (ViewMode::Reflectance, reflectance),
    ] {
        let Some(picture) = draw(&snapshot, &scene, &plain(mode)) else {
            return;
        };
        assert_near(
            left(&picture.display),
            plain_color.encode(expected),
            mode.label(),
        );
    }
}

#[test]
fn backs_are_looked_through_unless_shown() {
    let scene = scene();
    let snapshot = snapshot(&scene, Vec3::splat(2.0));
    let mut view = plain(ViewMode::Radiance);
    let Some(hidden) = draw(&snapshot, &scene, &view) else {
        return;
    };
    let corner = hidden.display.get_pixel(1, 1).0;
    assert_near(
        right(&hidden.display),
        [corner[0], corner[1], corner[2]],
        "the background behind a back",
    );
    view.backs = true;
    let shown = draw(&snapshot, &scene, &view).expect("drawn before");
    assert_ne!(right(&shown.display), right(&hidden.display));
    assert_eq!(left(&shown.display), left(&hidden.display));
    // Face orientation shows both, fronts blue and backs red.
    let faces = draw(&snapshot, &scene, &plain(ViewMode::FaceOrientation)).expect("drawn before");
    let ([r, _, b], [back_r, _, back_b]) = (left(&faces.display), right(&faces.display));
    assert!(b > r && back_r > back_b, "{:?}", left(&faces.display));
}

#[test]
fn false_colours_mark_what_is_out_of_range() {
    let scene = scene();
    let snapshot = snapshot(&scene, Vec3::splat(2.0));
    let with_range = |low, high, logarithmic| ViewSettings {
        fixed_range: Some([low, high]),
        logarithmic,
        ..plain(ViewMode::FalseIrradiance)
    };
    for (range, expected) in [
        (with_range(0.1, 1.0, false), [255; 3]),
        (with_range(3.0, 9.0, false), [0; 3]),
        (with_range(0.1, 1.0, true), [255; 3]),
        (with_range(3.0, 9.0, true), [0; 3]),
    ] {
        let Some(picture) = draw(&snapshot, &scene, &range) else {
            return;
        };
        assert_near(left(&picture.display), expected, "out of range");
    }
    let inside = draw(&snapshot, &scene, &with_range(0.0, 4.0, false)).expect("drawn before");
    // The middle of the ramp is green.
    let [r, g, b] = left(&inside.display);
    assert!(g > r && g > b, "{r} {g} {b}");
    let middle = draw(&snapshot, &scene, &with_range(1.0, 4.0, true)).expect("drawn before");
    assert_near(
        left(&middle.display),
        [r, g, b],
        "2 is the middle of 1 to 4",
    );
}

#[test]
fn linear_picture_holds_radiance_at_any_exposure() {
    let scene = scene();
    let irradiance = Vec3::new(30.0, 20.0, 10.0);
    let snapshot = snapshot(&scene, irradiance);
    let expected = Vec3::new(0.8, 0.1, 0.1) * irradiance / std::f32::consts::PI;
    for exposure in [-4.0, 0.0, 3.0] {
        let mut view = plain(ViewMode::Radiance);
        view.exposure = exposure;
        let Some(picture) = draw(&snapshot, &scene, &view) else {
            return;
        };
        let Some(radiance) = picture.radiance else {
            return;
        };
        let seen = Vec3::from_array(radiance.get_pixel(40, 64).0);
        // A half float has 11 bits.
        let near = (seen - expected).abs().cmple(expected * 2e-3).all();
        assert!(near, "{seen} instead of {expected} at {exposure} EV");
    }
}

/// A renderer in software may filter without end along what is not finite.
#[test]
fn textures_of_slivers_with_wild_coordinates_are_drawn() {
    let builder = find_builtin("tiled-room").expect("it is there").builder();
    let mut scene = builder
        .finish(&SceneOptions::default())
        .expect("it is sound");
    let wild = [
        0.0,
        0.3,
        1e-30,
        1e30,
        -7e8,
        f32::MAX,
        f32::INFINITY,
        f32::NAN,
    ];
    let pick = |index: usize| wild[index * 7 / 3 % wild.len()];
    for (index, place) in scene.texcoords.iter_mut().flatten().enumerate() {
        *place = Vec2::new(pick(index), pick(index + 5));
    }
    let scene = Arc::new(scene);
    let mut snapshot = snapshot(&scene, Vec3::ONE);
    let mesh = Arc::make_mut(&mut snapshot.mesh);
    mesh.texcoords = scene.texcoords.iter().flatten().copied().collect();
    let Some(picture) = draw(&snapshot, &scene, &plain(ViewMode::Radiance)) else {
        return;
    };
    let first = picture.display.get_pixel(0, 0);
    assert!(picture.display.pixels().any(|pixel| pixel != first));
}

#[test]
fn cluster_boxes_are_drawn_over_the_surfaces() {
    let scene = scene();
    let snapshot = snapshot(&scene, Vec3::splat(1.0));
    let mut view = plain(ViewMode::LightOnly);
    let Some(without) = draw(&snapshot, &scene, &view) else {
        return;
    };
    view.clusters = ClusterOverlay {
        shown: true,
        level: 0,
        ..ClusterOverlay::default()
    };
    let with = draw(&snapshot, &scene, &view).expect("drawn before");
    let changed = without
        .display
        .pixels()
        .zip(with.display.pixels())
        .filter(|(a, b)| a != b)
        .count();
    // Four long edges before and four behind, in a picture of 128 pixels; surfaces hide some of them.
    assert!((100..3000).contains(&changed), "{changed} pixels");
}

#[test]
fn the_selected_cluster_is_outlined() {
    let scene = scene();
    let snapshot = snapshot(&scene, Vec3::splat(1.0));
    let Some(gpu) = gpu() else { return };
    let mut renderer = Renderer::new(gpu);
    let target = Target::new(renderer.gpu(), SIZE).expect("a small picture");
    let overlay = Overlay {
        boxes: Arc::default(),
        segments: Arc::new(cluster_lines::outline(
            snapshot.clusters[0].min,
            snapshot.clusters[0].max,
            Vec3::new(0.0, 0.0, 1.0),
        )),
    };
    let view = plain(ViewMode::LightOnly);
    let picture = Picture {
        scene: &scene,
        mesh: &snapshot.mesh,
        light: &snapshot.light,
        errors: None,
        gloss: None,
        camera: &camera(),
        view: &view,
        is_unlit: false,
        range: [0.0, 1.0],
        interior: None,
        overlay: &overlay,
        background: Vec3::ZERO,
        pixels_per_point: 1.0,
    };
    renderer.render(&target, &picture).expect("a small mesh");
    let display = target.read_display(renderer.gpu()).expect("read back");
    let is_blue = |x, y| display.get_pixel(x, y).0[2] > 200 && display.get_pixel(x, y).0[0] < 60;
    // Each of the four sides crosses one of these lines through the middle, at about 35 and 93.
    let across = (0..128).filter(|x| is_blue(*x, 64)).count();
    let down = (0..128).filter(|y| is_blue(64, *y)).count();
    assert!((2..20).contains(&across), "{across}");
    assert!((2..20).contains(&down), "{down}");
}

/// A device, or `None` on a machine that cannot draw.
fn gpu() -> Option<Gpu> {
    match headless::open_gpu() {
        Ok(gpu) => Some(gpu),
        Err(reason) => {
            assert!(std::env::var_os("CI").is_none(), "CI must draw: {reason}");
            eprintln!("skipped, no graphics adapter: {reason}");
            None
        }
    }
}

/// Draw a snapshot with a device, lost or not; what the renderer said, and the picture that came back.
fn draw_with(
    gpu: Gpu,
    scene: &Arc<Scene>,
    snapshot: &Snapshot,
    errors: Option<&Arc<Vec<f32>>>,
    mode: ViewMode,
    is_lost: bool,
) -> (Result<(), RenderError>, Result<RgbaImage, ReadError>) {
    let mut renderer = Renderer::new(gpu);
    let target = Target::new(renderer.gpu(), SIZE).expect("a small picture");
    if is_lost {
        renderer.gpu().device.destroy();
    }
    let drawn = Picture {
        scene,
        mesh: &snapshot.mesh,
        light: &snapshot.light,
        errors,
        gloss: None,
        camera: &camera(),
        view: &plain(mode),
        is_unlit: false,
        range: [if mode.is_signed() { -100.0 } else { 0.0 }, 100.0],
        interior: None,
        overlay: &Overlay::default(),
        background: Vec3::ZERO,
        pixels_per_point: 1.0,
    };
    let said = renderer.render(&target, &drawn);
    (said, target.read_display(renderer.gpu()))
}

#[test]
fn measured_errors_are_shown_where_they_are_known() {
    let Some(gpu) = gpu() else { return };
    let scene = scene();
    let snapshot = snapshot(&scene, Vec3::ONE);
    let count = snapshot.mesh.positions.len();
    let mut pictures = Vec::new();
    for percent in [None, Some(0.0), Some(99.0), Some(200.0)] {
        let errors = percent.map(|percent| Arc::new(vec![percent; count]));
        let (said, picture) = draw_with(
            gpu.clone(),
            &scene,
            &snapshot,
            errors.as_ref(),
            ViewMode::Error,
            false,
        );
        said.expect("a small mesh");
        pictures.push(left(&picture.expect("read back")));
    }
    let [unknown, none, much, excess] = pictures[..] else {
        panic!("four pictures")
    };
    assert!(unknown[0] > 2 * unknown[1], "the red wall: {unknown:?}");
    assert!(none[2] > none[1], "the low end is blue: {none:?}");
    assert!(much[0] > 2 * much[2], "the high end is red: {much:?}");
    assert_eq!(excess, [255; 3]);
}

#[test]
fn estimated_errors_are_red_where_too_bright_and_blue_where_too_dark() {
    let Some(gpu) = gpu() else { return };
    let scene = scene();
    let snapshot = snapshot(&scene, Vec3::ONE);
    let count = snapshot.mesh.positions.len();
    let pictures = [-99.0, 0.0, 99.0, 200.0].map(|percent| {
        let errors = Arc::new(vec![percent; count]);
        let (gpu, mode) = (gpu.clone(), ViewMode::EstimatedError);
        let (said, picture) = draw_with(gpu, &scene, &snapshot, Some(&errors), mode, false);
        said.expect("a small mesh");
        left(&picture.expect("read back"))
    });
    let [dark, none, bright, excess] = pictures;
    assert!(dark[2] > 2 * dark[0], "blue: {dark:?}");
    assert!(none[0].abs_diff(none[2]) < 3, "grey: {none:?}");
    assert!(bright[0] > 2 * bright[2], "red: {bright:?}");
    assert!(
        excess[0] > 240 && excess[0] == excess[2],
        "white: {excess:?}"
    );
}

#[test]
fn the_range_of_estimated_errors_is_as_far_below_0_as_above_it() {
    let scene = scene();
    let mut lit = snapshot(&scene, Vec3::ONE);
    let mut view = ViewSettings {
        logarithmic: true,
        ..plain(ViewMode::EstimatedError)
    };
    let range = |lit: &Snapshot, view: &ViewSettings| false_color_range(lit, view, None);
    assert_eq!(range(&lit, &view), [-1.0, 1.0], "nothing is known");
    let point = ErrorPoint {
        position: Vec3::ZERO,
        normal: Vec3::Z,
        light: 1.0,
        errors: [-0.07; 2],
    };
    lit.errors = Arc::new(vec![point; 64]);
    let [low, high] = range(&lit, &view);
    assert!((high - 7.0).abs() < 1e-3 && low == -high, "{low} {high}");
    view.fixed_range = Some([2.0, 5.0]);
    assert_eq!(range(&lit, &view), [-5.0, 5.0]);
}

#[test]
fn emission_scales_light_and_false_colours_alike() {
    let scene = scene();
    let bright = snapshot(&scene, Vec3::splat(3.0));
    let dim = snapshot(&scene, Vec3::ONE);
    for mode in [ViewMode::LightOnly, ViewMode::FalseIrradiance] {
        let as_it_is = ViewSettings {
            fixed_range: Some([0.0, 4.0]),
            ..plain(mode)
        };
        let scaled = ViewSettings {
            emission_scale: 3.0,
            ..as_it_is.clone()
        };
        let (Some(a), Some(b)) = (
            draw(&bright, &scene, &as_it_is),
            draw(&dim, &scene, &scaled),
        ) else {
            return;
        };
        assert_near(left(&b.display), left(&a.display), "three times the light");
    }
}

#[test]
fn a_mesh_above_the_largest_buffer_is_one_sentence() {
    let Some(gpu) = gpu() else { return };
    let scene = scene();
    let snapshot = snapshot(&scene, Vec3::ONE);
    let small = Gpu {
        max_buffer_size: 100,
        ..gpu
    };
    let (said, picture) = draw_with(small, &scene, &snapshot, None, ViewMode::Radiance, false);
    let error = said.expect_err("144 bytes of positions").to_string();
    assert!(error.contains("smallest element area"), "{error}");
    assert_eq!(left(&picture.expect("the background")), [0; 3]);
}

#[test]
fn a_lost_device_is_one_sentence() {
    let Some(gpu) = gpu() else { return };
    let scene = scene();
    let snapshot = snapshot(&scene, Vec3::ONE);
    let (_, picture) = draw_with(gpu, &scene, &snapshot, None, ViewMode::Radiance, true);
    let error = picture.expect_err("nothing is left").to_string();
    assert!(error.starts_with("the graphics adapter"), "{error}");
    assert!(!error.contains('\n'), "{error}");
}

#[test]
fn a_picture_that_is_too_large_is_one_sentence() {
    let scene = scene();
    let snapshot = snapshot(&scene, Vec3::ONE);
    let view = plain(ViewMode::Radiance);
    let subject = Subject {
        scene: &scene,
        snapshot: &snapshot,
        errors: None,
        interior: None,
        is_dark: false,
    };
    match headless::picture(subject, &camera(), &view, [1_000_000, 2]) {
        Err(HeadlessError::NoAdapter(_)) => {}
        Err(error) => assert!(error.to_string().contains("too large"), "{error}"),
        Ok(_) => panic!("no adapter takes a million pixels on a side"),
    }
}

#[test]
fn edges_of_lamps_are_smooth() {
    // A lamp far brighter than white beside a dark wall: pixels on its slanted edge are as bright as the part of them that it
    // covers.
    let mut builder = SceneBuilder::default();
    let lamp = builder.push_material(Material::plain("lamp", Vec3::ZERO, Vec3::splat(50.0)));
    let corners = [(-1.0, -1.0), (0.3, -1.0), (-0.1, 1.0), (-1.0, 1.0)]
        .map(|(x, y)| builder.push_position(DVec3::new(x, y, 0.0)));
    let [a, b, c, d] = corners;
    builder.push_triangle([a, b, c], lamp);
    builder.push_triangle([a, c, d], lamp);
    let options = SceneOptions::with_sides(Sides::One);
    let scene = Arc::new(builder.finish(&options).expect("a lamp"));
    let snapshot = snapshot(&scene, Vec3::ZERO);
    for tone_map in [ToneMap::None, ToneMap::Neutral] {
        let view = ViewSettings {
            tone_map,
            ..plain(ViewMode::Radiance)
        };
        let Some(picture) = draw(&snapshot, &scene, &view) else {
            return;
        };
        let between = picture.display.rows().filter(|row| {
            let row: Vec<u8> = row.clone().map(|pixel| pixel.0[0]).collect();
            let (most, least) = (row.iter().max(), row.iter().min());
            row.iter().any(|shown| {
                let is_above = least.is_some_and(|least| *shown > least + 30);
                is_above && most.is_some_and(|most| *shown + 15 < *most)
            })
        });
        let rows = between.count();
        assert!(rows > 40, "{tone_map:?}: {rows} rows have a pixel between");
    }
}

#[test]
fn edges_within_a_picture_are_the_same_without_its_background() {
    let mut builder = SceneBuilder::default();
    let lamp = builder.push_material(Material::plain("lamp", Vec3::ZERO, Vec3::splat(50.0)));
    let wall = builder.push_material(Material::plain("wall", Vec3::splat(0.5), Vec3::ZERO));
    for (depth, corners, material) in [
        (0.1, [(-0.8, -0.8), (0.3, -0.8), (-0.1, 0.8)], lamp),
        (0.0, [(-1.0, -1.0), (3.0, -1.0), (-1.0, 3.0)], wall),
    ] {
        let corners = corners.map(|(x, y)| builder.push_position(DVec3::new(x, y, depth)));
        builder.push_triangle(corners, material);
    }
    let options = SceneOptions::with_sides(Sides::One);
    let scene = Arc::new(builder.finish(&options).expect("a lamp before a wall"));
    let snapshot = snapshot(&scene, Vec3::splat(0.2));
    let view = ViewSettings {
        tone_map: ToneMap::Neutral,
        ..plain(ViewMode::Radiance)
    };
    let Some(opaque) = draw(&snapshot, &scene, &view) else {
        return;
    };
    let subject = Subject {
        scene: &scene,
        snapshot: &snapshot,
        errors: None,
        interior: None,
        is_dark: false,
    };
    let cutout = headless::cutout(subject, &camera(), &view, SIZE).expect("drawn before");
    let (mut between, mut covered) = (0, 0);
    for (seen, alone) in opaque.display.pixels().zip(cutout.display.pixels()) {
        if alone.0[3] == 255 {
            covered += 1;
            between += usize::from((60..200).contains(&seen.0[0]));
            assert_eq!(seen, alone);
        }
    }
    assert!(covered > 1000 && between > 20, "{covered}, {between}");
}

/// A picture of a sky that differs everywhere, but smoothly.
fn sky_texture() -> Arc<Texture> {
    let (width, height) = (64, 32);
    let pixel = |index: u32| {
        let [x, y] = [index % width, index / width].map(|at| at as f32);
        let turn = x / width as f32 * std::f32::consts::TAU;
        Vec3::new(2.0 + turn.sin(), 2.0 + turn.cos(), 0.1 * y)
    };
    Arc::new(Texture {
        name: "sky".to_owned(),
        width,
        height,
        pixels: (0..width * height).map(pixel).collect(),
        ..Texture::default()
    })
}

#[test]
fn the_sky_is_seen_behind_the_scene_from_where_its_light_comes() {
    let dark = Scene::clone(&scene());
    let skies = [UpAxis::Y, UpAxis::Z].into_iter().flat_map(|up| {
        let picture = |rotation| {
            Sky::Picture(SkyPicture::new(
                sky_texture(),
                Vec3::new(1.0, 0.5, 2.0),
                up,
                rotation,
            ))
        };
        [0.0, 70.0].map(picture)
    });
    for sky in skies.chain([Sky::Uniform(Vec3::new(0.5, 1.0, 2.0))]) {
        let environment = Environment {
            sky: sky.clone(),
            ..Environment::default()
        };
        let scene = Arc::new(dark.clone().in_environment(environment));
        let snapshot = snapshot(&scene, Vec3::ONE);
        let subject = Subject {
            scene: &scene,
            snapshot: &snapshot,
            errors: None,
            interior: None,
            is_dark: false,
        };
        // Away from the walls, and slanted.
        let camera = Camera::looking(
            Vec3::new(0.0, 0.0, 130.0),
            Vec3::new(30.0, 40.0, 200.0),
            Vec3::Y,
        );
        for exposure in [0.0, 3.0] {
            let view = ViewSettings {
                exposure,
                ..plain(ViewMode::Radiance)
            };
            let drawn = unless_no_adapter(headless::picture(subject, &camera, &view, SIZE));
            let Some(picture) = drawn else {
                return;
            };
            let radiance = picture.radiance.expect("it can be read");
            for (x, y) in [(3, 5), (64, 64), (120, 17), (40, 126)] {
                let place = Vec2::new(x as f32 + 0.5, y as f32 + 0.5) / 64.0 - 1.0;
                let (_, direction) = camera.ray(Vec2::new(place.x, -place.y), 1.0);
                let expected = sky.radiance(direction);
                let found = Vec3::from_array(radiance.get_pixel(x, y).0);
                // Half floats have 11 bits.
                let error = (found - expected).abs().max_element();
                assert!(
                    error < 2e-3 * expected.max_element(),
                    "{found} for {expected}"
                );
            }
        }
    }
}
