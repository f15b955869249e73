//! Light from outside, against closed forms: sky and sun, sampled and linked, with every method.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::{f32::consts::PI, sync::Arc};

use common::{assert_close, prepare, solve, step_to_end};
use glam::{DVec3, Vec3};
use vecrad::{
    geometry::{barycentric, barycentric_in_plane},
    metrics::MeshLookup,
    reference::ReferencePoint,
    scene::{
        Environment, Material, MaterialId, Scene, SceneBuilder, SceneOptions, Sides, Sky,
        SkyPicture, Sun, Texture, TriangleId, UpAxis,
    },
    solver::{Cancel, Direct, Method, SolveSettings, Solver},
};

const METHODS: [Method; 5] = [
    Method::Bounded,
    Method::SixFace,
    Method::Single,
    Method::Exact,
    Method::Isotropic,
];

/// A parallelogram in `count` by `count` quads.
fn plate(
    builder: &mut SceneBuilder,
    material: MaterialId,
    count: u32,
    origin: DVec3,
    [u, v]: [DVec3; 2],
) {
    let part = |index: u32| f64::from(index) / f64::from(count);
    for (i, j) in (0..count).flat_map(|i| (0..count).map(move |j| (i, j))) {
        let corner = |i, j| origin + u * part(i) + v * part(j);
        let corners = [
            corner(i, j),
            corner(i + 1, j),
            corner(i + 1, j + 1),
            corner(i, j + 1),
        ];
        let [a, b, c, d] = corners.map(|at| builder.push_position(at));
        builder.push_triangle([a, b, c], material);
        builder.push_triangle([a, c, d], material);
    }
}

fn material(builder: &mut SceneBuilder, reflectance: f32, emission: f32) -> MaterialId {
    builder.push_material(Material::plain(
        "",
        Vec3::splat(reflectance),
        Vec3::splat(emission),
    ))
}

fn under(builder: SceneBuilder, sides: Sides, environment: Environment) -> Arc<Scene> {
    let scene = builder.finish(&SceneOptions::with_sides(sides)).unwrap();
    Arc::new(scene.in_environment(environment))
}

fn uniform(radiance: f32) -> Environment {
    Environment {
        sky: Sky::Uniform(Vec3::splat(radiance)),
        ..Environment::default()
    }
}

fn sunny(direction: Vec3, degrees: f32) -> Environment {
    Environment {
        sky: Sky::Dark,
        sun: Some(Sun {
            direction: direction.normalize_or_zero(),
            irradiance: Vec3::new(2.0, 1.0, 0.5),
            diameter: degrees.to_radians(),
        }),
        is_default: false,
    }
}

/// A sky of one colour, of a radiance that depends on the sine of the elevation over +Y; dark below.
fn picture(radiance: impl Fn(f32) -> f32) -> Environment {
    let (width, height) = (16, 256);
    let row = |row: u32| (PI * (row as f32 + 0.5) / height as f32).cos();
    let texture = Texture {
        name: String::new(),
        width,
        height,
        pixels: (0..width * height)
            .map(|index| match row(index / width) {
                sine if sine > 0.0 => Vec3::splat(radiance(sine)),
                _ => Vec3::ZERO,
            })
            .collect(),
        ..Texture::default()
    };
    let sky = SkyPicture::new(Arc::new(texture), Vec3::ONE, UpAxis::Y, 0.0);
    Environment {
        sky: Sky::Picture(sky),
        ..Environment::default()
    }
}

/// Irradiance at places in file units on sides with this normal, W/m².
fn irradiance_at(scene: &Scene, solver: &Solver, places: &[DVec3], normal: Vec3) -> Vec<Vec3> {
    let snapshot = solver.snapshot();
    let point = |&place: &DVec3| {
        let position = scene.frame.from_world(place);
        let lies_on = |id: &TriangleId| {
            let corners = scene.corners(*id);
            let front = scene.surfaces[id.index()].area_vector.normalize_or_zero();
            let is_seen = if scene.triangles[id.index()].two_sided {
                front.dot(normal).abs() > 0.99
            } else {
                front.dot(normal) > 0.99
            };
            let within = barycentric_in_plane(position, corners).min_element() >= -1e-4;
            is_seen && within && (corners[0] - position).dot(front).abs() < 1e-3
        };
        let triangle = scene.triangle_ids().find(lies_on).unwrap();
        ReferencePoint {
            triangle,
            is_back: scene.surfaces[triangle.index()].area_vector.dot(normal) < 0.0,
            barycentric: barycentric(position, scene.corners(triangle)),
            position,
            normal,
            // Radiance is then irradiance.
            reflectance: Vec3::splat(PI),
            emission: Vec3::ZERO,
            irradiance: Vec3::ZERO,
            irradiance_error: 0.0,
            standard_error: 0.0,
        }
    };
    let points: Vec<ReferencePoint> = places.iter().map(point).collect();
    let lookup = MeshLookup::new(scene, &snapshot.mesh);
    let found = lookup.radiance(&snapshot.light, &points);
    found.into_iter().map(Option::unwrap).collect()
}

/// Mean of the irradiance at places along a line.
fn mean_along(scene: &Scene, solver: &Solver, centre: DVec3, step: DVec3, normal: Vec3) -> Vec3 {
    let places: Vec<DVec3> = (-20..=20).map(|at| centre + step * f64::from(at)).collect();
    irradiance_at(scene, solver, &places, normal)
        .into_iter()
        .sum::<Vec3>()
        / 41.0
}

/// Direct light of all kinds and methods at draft, for a scene.
fn variants() -> impl Iterator<Item = SolveSettings> {
    let of = |direct, method| SolveSettings {
        direct,
        method,
        ..SolveSettings::draft()
    };
    let sampled = METHODS
        .into_iter()
        .map(move |method| of(Direct::Sampled, method));
    let linked = [Method::Bounded, Method::Exact].into_iter();
    sampled.chain(linked.map(move |method| of(Direct::Linked, method)))
}

#[test]
fn an_open_ground_has_the_irradiance_of_the_sky_without_a_ray() {
    let mut builder = SceneBuilder::default();
    let grey = material(&mut builder, 0.5, 0.0);
    plate(&mut builder, grey, 1, DVec3::ZERO, [DVec3::Z, DVec3::X]);
    let scene = under(builder, Sides::One, uniform(3.0));
    for settings in variants() {
        let (solver, report) = solve(&scene, settings.clone());
        for light in &solver.snapshot().light.irradiance {
            // The table of the sky is right to 0.5 %.
            let is_table = settings.direct == Direct::Linked;
            let tolerance = if is_table { 7e-3 } else { 1e-3 };
            assert_close(light.x, 3.0 * PI, tolerance, format!("{settings:?}"));
        }
        if settings.method == Method::Bounded {
            assert_eq!(report.shadow_rays, 0);
        }
    }
    // The same under a picture of that sky, from above.
    let mut builder = SceneBuilder::default();
    let grey = material(&mut builder, 0.5, 0.0);
    plate(&mut builder, grey, 1, DVec3::ZERO, [DVec3::Z, DVec3::X]);
    let scene = under(builder, Sides::One, picture(|_| 3.0));
    let (solver, _) = solve(&scene, SolveSettings::draft());
    for light in &solver.snapshot().light.irradiance {
        assert_close(light.x, 3.0 * PI, 3e-3, "picture");
    }
}

#[test]
fn an_overcast_sky_gives_walls_the_share_of_the_ground_that_it_should() {
    // Irradiance 7π/9 Lz on the ground, and 0.396 of that on walls that see no ground.
    let mut builder = SceneBuilder::default();
    let black = material(&mut builder, 0.0, 0.0);
    plate(&mut builder, black, 1, DVec3::ZERO, [DVec3::Z, DVec3::X]);
    plate(
        &mut builder,
        black,
        1,
        DVec3::X * 40.0,
        [DVec3::Y, DVec3::Z],
    );
    let overcast = picture(|sine| (1.0 + 2.0 * sine) / 3.0);
    let scene = under(builder, Sides::One, overcast);
    let (solver, _) = solve(&scene, SolveSettings::draft());
    let at = |place, normal| irradiance_at(&scene, &solver, &[place], normal)[0].x;
    let ground = at(DVec3::new(0.3, 0.0, 0.4), Vec3::Y);
    let wall = at(DVec3::new(40.0, 0.4, 0.3), Vec3::X);
    assert_close(ground, 7.0 * PI / 9.0, 5e-3, "ground");
    assert_close(wall / ground, 0.396, 5e-3, "wall");
}

#[test]
fn a_street_between_black_walls_sees_the_strip_of_sky_between_them() {
    // A canyon of width 2 and height 3, so long that its ends do not matter, open to both sides of +Y.
    let (width, height, length) = (2.0, 3.0, 60.0);
    let mut builder = SceneBuilder::default();
    let black = material(&mut builder, 0.0, 0.0);
    let start = DVec3::NEG_Z * length * 0.5;
    let along = DVec3::Z * length;
    plate(&mut builder, black, 10, start, [along, DVec3::X * width]);
    plate(&mut builder, black, 10, start, [DVec3::Y * height, along]);
    let other = start + DVec3::X * width;
    plate(&mut builder, black, 10, other, [along, DVec3::Y * height]);
    let scene = under(builder, Sides::One, uniform(1.0));
    let expected_ground = |x: f64| {
        let right = width - x;
        0.5 * (x / x.hypot(height) + right / right.hypot(height))
    };
    let expected_wall = |depth: f64| 0.5 * (1.0 - depth / depth.hypot(width));
    for settings in [
        SolveSettings::normal(),
        SolveSettings {
            direct: Direct::Linked,
            ..SolveSettings::normal()
        },
    ] {
        let (solver, _) = solve(&scene, settings);
        // Means along the street: the noise of one place is that of its rays.
        let mean = |place: DVec3, normal| {
            f64::from(mean_along(&scene, &solver, place, DVec3::Z, normal).x / PI)
        };
        for x in [0.3, 1.0, 1.6] {
            let found = mean(DVec3::new(x, 0.0, 0.0), Vec3::Y);
            assert_close(found, expected_ground(x), 0.015, format!("ground at {x}"));
        }
        for depth in [0.5, 1.5, 2.5] {
            let found = mean(DVec3::new(0.0, height - depth, 0.0), Vec3::X);
            assert_close(
                found,
                expected_wall(depth),
                0.015,
                format!("wall at {depth}"),
            );
        }
    }
}

#[test]
fn the_sun_lights_by_the_cosine_and_casts_a_penumbra_of_its_width() {
    // A ground, and a half plane at height 10 whose edge runs along Z.
    let mut builder = SceneBuilder::default();
    let black = material(&mut builder, 0.0, 0.0);
    let corner = DVec3::new(-30.0, 0.0, -30.0);
    plate(
        &mut builder,
        black,
        1,
        corner,
        [DVec3::Z * 60.0, DVec3::X * 60.0],
    );
    let edge = DVec3::new(0.0, 10.0, -60.0);
    plate(
        &mut builder,
        black,
        1,
        edge,
        [DVec3::X * 60.0, DVec3::Z * 120.0],
    );
    let degrees = 20.0;
    let scene = under(builder, Sides::Two, sunny(Vec3::Y, degrees));
    let (solver, _) = solve(&scene, SolveSettings::finest());
    let mean = |x: f64| mean_along(&scene, &solver, DVec3::X * x, DVec3::Z * 0.51, Vec3::Y);
    let half = 10.0 * (0.5 * degrees.to_radians()).tan();
    assert_close(mean(-2.0 * f64::from(half)).x, 2.0, 1e-3, "lit");
    assert!(mean(2.0 * f64::from(half)).x < 1e-3);
    // Inside, the share of the disc beyond the edge: a circle's segment.
    for place in [-0.6f32, -0.3, 0.0, 0.3, 0.6] {
        let segment = 0.5 - (place * (1.0 - place * place).sqrt() + place.asin()) / PI;
        let found = mean(f64::from(place * half)) / Vec3::new(2.0, 1.0, 0.5);
        let error = (found - segment).abs().max_element();
        assert!(error < 0.03, "{found} for {segment} at {place}");
    }
    // Slanted.
    let mut builder = SceneBuilder::default();
    let black = material(&mut builder, 0.0, 0.0);
    plate(&mut builder, black, 1, DVec3::ZERO, [DVec3::Z, DVec3::X]);
    let slanted = Vec3::new(3.0, 4.0, 0.0);
    let scene = under(builder, Sides::One, sunny(slanted, Sun::DEGREES));
    for settings in variants() {
        let (solver, _) = solve(&scene, settings.clone());
        for light in &solver.snapshot().light.irradiance {
            let error = (*light / Vec3::new(1.6, 0.8, 0.4) - 1.0)
                .abs()
                .max_element();
            let is_rough = settings.direct == Direct::Linked;
            assert!(
                error < if is_rough { 0.05 } else { 1e-3 },
                "{light} {settings:?}"
            );
        }
    }
}

/// Blocks on a ground, some of them hollow and open.
fn blocks(reflectance: f32, emission: f32) -> SceneBuilder {
    let mut builder = SceneBuilder::default();
    let grey = material(&mut builder, reflectance, emission);
    let corner = DVec3::new(-4.0, 0.0, -4.0);
    plate(
        &mut builder,
        grey,
        4,
        corner,
        [DVec3::Z * 8.0, DVec3::X * 8.0],
    );
    for (x, z, size) in [(-2.0, -1.0, 1.5), (1.0, 0.5, 2.0)] {
        let at = DVec3::new(x, 0.0, z);
        let [u, v, w] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * size);
        plate(&mut builder, grey, 2, at, [v, u]);
        plate(&mut builder, grey, 2, at + w, [u, v]);
        plate(&mut builder, grey, 2, at, [w, v]);
        plate(&mut builder, grey, 2, at + u, [v, w]);
    }
    builder
}

/// A box without a lid, between these edges, of plates of `count` by `count` quads.
fn lidless(builder: &mut SceneBuilder, paint: MaterialId, count: u32, [u, v, w]: [DVec3; 3]) {
    for (origin, edges) in [
        (DVec3::ZERO, [w, u]),
        (DVec3::ZERO, [v, w]),
        (DVec3::ZERO, [u, v]),
        (u, [w, v]),
        (w, [v, u]),
    ] {
        plate(builder, paint, count, origin, edges);
    }
}

/// A cube without a lid.
fn open_box(reflectance: f32, emission: f32) -> SceneBuilder {
    let mut builder = SceneBuilder::default();
    let grey = material(&mut builder, reflectance, emission);
    let edges = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * 4.0);
    lidless(&mut builder, grey, 2, edges);
    builder
}

/// Columns on a ground under a roof.
fn columns(reflectance: f32, emission: f32) -> SceneBuilder {
    let mut builder = SceneBuilder::default();
    let grey = material(&mut builder, reflectance, emission);
    let corner = DVec3::new(-4.0, 0.0, -2.0);
    let sides = [DVec3::Z * 4.0, DVec3::X * 8.0];
    plate(&mut builder, grey, 2, corner, sides);
    plate(&mut builder, grey, 2, corner + DVec3::Y * 2.5, sides);
    for number in 0..4 {
        let at = DVec3::new(-3.0 + 2.0 * f64::from(number), 0.2, 1.0);
        let [u, v, w] = [DVec3::X * 0.5, DVec3::Y * 2.0, DVec3::Z * 0.5];
        plate(&mut builder, grey, 1, at, [v, u]);
        plate(&mut builder, grey, 1, at + w, [u, v]);
        plate(&mut builder, grey, 1, at, [w, v]);
        plate(&mut builder, grey, 1, at + u, [v, w]);
    }
    builder
}

/// Checks that everything shows the level of the sky, on average within `most` of it, and in root mean square within twice that.
fn assert_even(builder: SceneBuilder, level: f32, settings: SolveSettings, name: &str, most: f32) {
    let scene = under(builder, Sides::Two, uniform(level));
    let what = format!(
        "{name}, {:?}, {:?}, {}",
        settings.direct, settings.method, scene.materials[0].reflectance.x
    );
    let (solver, _) = solve(&scene, settings);
    let light = &solver.snapshot().light.irradiance;
    let count = light.len() as f32;
    let mean = light.iter().map(|light| light.x / PI).sum::<f32>() / count;
    assert_close(mean, level, most.into(), format!("mean of {what}"));
    let squares = light
        .iter()
        .map(|light| (light.x / PI / level - 1.0).powi(2));
    let deviation = (squares.sum::<f32>() / count).sqrt();
    assert!(deviation < 2.0 * most, "{deviation} of {what}");
}

#[test]
fn radiance_is_the_same_everywhere_where_surfaces_complete_the_sky() {
    // Emission L (1 − ρ) under a sky L: everything shows L, whatever stands where.
    type Build = fn(f32, f32) -> SceneBuilder;
    let scenes: [(&str, Build, f32); 3] = [
        ("blocks", blocks, 0.005),
        ("box", open_box, 0.005),
        ("columns", columns, 0.02),
    ];
    for (name, scene, most) in scenes {
        for (reflectance, level) in [(0.5, 1.0), (0.9, 2.0), (0.95, 0.5)] {
            for direct in [Direct::Sampled, Direct::Linked] {
                let settings = SolveSettings {
                    direct,
                    ..SolveSettings::normal()
                };
                let builder = scene(reflectance, level * (1.0 - reflectance));
                assert_even(builder, level, settings, name, most);
            }
        }
    }
    for settings in variants() {
        assert_even(open_box(0.9, 0.2), 2.0, settings, "box", 0.005);
    }
}

/// A dark room of 4 × 4 × 4 m, closed but for a square window of this side, in a wall.
fn room_with_a_window(side: f64) -> SceneBuilder {
    let mut builder = SceneBuilder::default();
    let dark = material(&mut builder, 0.001, 0.0);
    let [u, v, w] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * 4.0);
    let end = u + v + w;
    for (origin, edges) in [
        (DVec3::ZERO, [u, v]),
        (DVec3::ZERO, [v, w]),
        (DVec3::ZERO, [w, u]),
        (end, [-v, -u]),
        (end, [-u, -w]),
    ] {
        plate(&mut builder, dark, 4, origin, edges);
    }
    // The wall about the window.
    let places = [0.0, 2.0 - 0.5 * side, 2.0 + 0.5 * side, 4.0];
    for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
        if (i, j) != (1, 1) {
            let origin = DVec3::new(4.0, places[i], places[j]);
            let across = DVec3::Z * (places[j + 1] - places[j]);
            let up = DVec3::Y * (places[i + 1] - places[i]);
            plate(&mut builder, dark, 1, origin, [across, up]);
        }
    }
    builder
}

#[test]
fn all_light_through_a_window_arrives_however_small_it_is() {
    // A sky of radiance L sends π L A through a window of the area A, onto walls that reflect nothing.
    for (side, most) in [(2.0, 0.02), (1.0, 0.02), (0.32, 0.03), (0.1, 0.1)] {
        let scene = under(room_with_a_window(side), Sides::One, uniform(1.0));
        let (solver, _) = solve(&scene, SolveSettings::draft());
        let snapshot = solver.snapshot();
        let mesh = &snapshot.mesh;
        let power = mesh.indices.iter().map(|corners| {
            let [a, b, c] = corners.map(|vertex| mesh.positions[vertex as usize]);
            let area = (b - a).cross(c - a).length() * 0.5;
            let light = corners.map(|vertex| snapshot.light.irradiance[vertex as usize].x);
            f64::from(area * light.iter().sum::<f32>() / 3.0)
        });
        let found = scene.frame.area_to_world(power.sum());
        let expected = f64::from(PI) * side * side;
        assert_close(found, expected, most, format!("window of {side} m"));
    }
}

/// The irradiance of a floor below a room's window of this side in the sky of radiance 1, by summing over its area, W/m².
fn through_window(place: DVec3, side: f64) -> f64 {
    let count = 64;
    let step = side / f64::from(count);
    let at = |index: i32| 2.0 - 0.5 * side + (f64::from(index) + 0.5) * step;
    let all = (0..count).flat_map(|i| (0..count).map(move |j| (i, j)));
    all.map(|(i, j)| {
        let ray = DVec3::new(4.0, at(i), at(j)) - place;
        ray.y * ray.x / ray.length_squared().powi(2) * step * step
    })
    .sum()
}

#[test]
fn a_dark_room_is_as_precise_within_walls_that_the_sky_lights() {
    let mut builder = room_with_a_window(1.0);
    let walls = material(&mut builder, 0.5, 0.0);
    let [u, v, w] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * 4.02);
    let corner = DVec3::splat(-0.01);
    let end = DVec3::splat(4.01);
    for (origin, edges) in [
        (corner, [v, u]),
        (corner, [w, v]),
        (corner, [u, w]),
        (end, [-u, -v]),
        (end, [-w, -u]),
    ] {
        plate(&mut builder, walls, 1, origin, edges);
    }
    let strips = [
        (DVec3::new(4.01, -0.01, -0.01), DVec3::Y * 1.51, w),
        (DVec3::new(4.01, 2.5, -0.01), DVec3::Y * 1.51, w),
        (DVec3::new(4.01, 1.5, -0.01), DVec3::Y, DVec3::Z * 1.51),
        (DVec3::new(4.01, 1.5, 2.5), DVec3::Y, DVec3::Z * 1.51),
    ];
    for (origin, up, across) in strips {
        plate(&mut builder, walls, 1, origin, [up, across]);
    }
    let scene = under(builder, Sides::One, uniform(1.0));
    let (solver, _) = solve(&scene, SolveSettings::normal());
    let at = |index: i32| 0.2 + 0.4 * f64::from(index);
    let places = (0..10).flat_map(|i| (0..10).map(move |j| DVec3::new(at(i), 0.0, at(j))));
    let places: Vec<DVec3> = places.collect();
    let found = irradiance_at(&scene, &solver, &places, Vec3::Y);
    let pairs = found.iter().zip(&places);
    let (mut squares, mut expected) = (0.0, 0.0);
    for (found, &place) in pairs {
        let exact = through_window(place, 1.0);
        squares += (f64::from(found.x) - exact).powi(2);
        expected += exact.powi(2);
    }
    let error = (squares / expected).sqrt();
    assert!(error < 0.06, "{error}");
}

#[test]
fn the_outside_of_a_deep_shaft_sees_the_whole_sky_though_little_reaches_its_inside() {
    // Walls that are lit on both sides; deep within, rays are guided to the opening.
    let mut builder = SceneBuilder::default();
    let grey = material(&mut builder, 0.8, 0.0);
    lidless(&mut builder, grey, 1, [DVec3::X, DVec3::Y * 8.0, DVec3::Z]);
    let scene = under(builder, Sides::Two, uniform(1.0));
    let (solver, _) = solve(&scene, SolveSettings::default());
    let places: Vec<DVec3> = (0..200)
        .map(|step| {
            let [along, up] = [0.618, 0.754].map(|part| (0.5 + part * f64::from(step)).fract());
            DVec3::new(0.0, 8.0 * up, along)
        })
        .collect();
    for found in irradiance_at(&scene, &solver, &places, Vec3::NEG_X) {
        assert_close(found.x, PI, 1e-3, "outside");
    }
}

#[test]
fn a_closed_room_shoots_no_ray_to_the_sky() {
    let mut builder = SceneBuilder::default();
    let grey = material(&mut builder, 0.5, 0.0);
    let lamp = material(&mut builder, 0.0, 1.0);
    let [u, v, w] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * 4.0);
    let end = u + v + w;
    for (origin, edges, material) in [
        (DVec3::ZERO, [u, v], grey),
        (DVec3::ZERO, [v, w], grey),
        (DVec3::ZERO, [w, u], grey),
        (end, [-v, -u], grey),
        (end, [-w, -v], grey),
        (end, [-u, -w], lamp),
    ] {
        plate(&mut builder, material, 1, origin, edges);
    }
    // Something that occludes.
    plate(
        &mut builder,
        grey,
        1,
        DVec3::new(1.0, 1.0, 1.0),
        [DVec3::X, DVec3::Z],
    );
    let dark = under(builder.clone(), Sides::One, Environment::default());
    let lit = under(builder, Sides::One, uniform(1.0));
    let settings = SolveSettings::draft();
    let (without, with) = (solve(&dark, settings.clone()), solve(&lit, settings));
    assert_eq!(
        without.0.snapshot().light.irradiance,
        with.0.snapshot().light.irradiance
    );
    let names: Vec<&str> = with
        .0
        .snapshot()
        .omitted
        .iter()
        .map(|omitted| omitted.name)
        .collect();
    assert!(names.contains(&"outside"), "{names:?}");
}

#[test]
fn lamps_and_materials_change_under_a_sky_as_if_solved_anew() {
    let mut builder = blocks(0.5, 0.0);
    let lamp = material(&mut builder, 0.0, 30.0);
    plate(
        &mut builder,
        lamp,
        1,
        DVec3::new(0.0, 4.0, 0.0),
        [DVec3::X * 0.5, DVec3::Z * 0.5],
    );
    let scene = under(builder, Sides::One, uniform(1.0));
    let settings = SolveSettings::normal();
    let mut solver = prepare(&scene, settings.clone());
    step_to_end(&mut solver, |_, _| {});
    let mut appearances = scene.appearances();
    appearances[lamp.index()].emission *= 0.5;
    appearances[0].reflectance = Vec3::splat(0.7);
    let cancel = Cancel::default();
    solver.relight(&appearances, &cancel).unwrap();
    solver.finish_relighting(&cancel).unwrap();
    let (anew, _) = solve(&Arc::new(scene.relit(&appearances)), settings);
    let places = [(-3.0, 3.0), (3.5, 3.0), (0.2, 0.3)].map(|(x, z)| DVec3::new(x, 0.0, z));
    let [changed, anew] =
        [&solver, &anew].map(|solver| irradiance_at(&scene, solver, &places, Vec3::Y));
    for (changed, anew) in changed.into_iter().zip(anew) {
        assert_close(changed.x, anew.x, 0.03, "relit");
    }
}
