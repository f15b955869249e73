//! The references under light from outside, against closed forms.

mod truth_scenes;

use std::{
    f64::consts::{FRAC_PI_2, PI},
    sync::Arc,
};

use glam::{DVec3, Vec2, Vec3};
use truth_scenes::{Plates, never};
use vecrad::{
    geometry::RayTree,
    reference::{
        JacobiSettings, MatrixSettings, PathSettings, PathTracer, ReferencePoint, StochasticJacobi,
        solve_matrix,
    },
    scene::{Environment, Scene, Sides, Sky, SkyPicture, Sun, Texture, UpAxis},
};

/// A place with its irradiance (red) as a reference finds it, and the share that it may be off.
struct Found {
    position: DVec3,
    normal: Vec3,
    irradiance: f64,
    tolerance: f64,
}

fn traced(scene: &Arc<Scene>, point_count: u32, samples: u32) -> Vec<ReferencePoint> {
    let settings = PathSettings {
        point_count,
        samples_per_pass: samples,
        seed: 3,
    };
    let rays = Arc::new(RayTree::new(scene));
    let mut tracer = PathTracer::new(scene.clone(), rays, settings);
    assert!(tracer.pass(&never));
    tracer.result().points
}

/// The light of all three references: at points by paths, over triangles by matrix and stochastic Jacobi.
fn found(scene: Scene) -> [(&'static str, Vec<Found>); 3] {
    let scene = Arc::new(scene);
    let rays = Arc::new(RayTree::new(&scene));
    let to_world = |position: Vec3| scene.frame.to_world(position);
    let paths = traced(&scene, 300, 1024).into_iter().map(|point| Found {
        position: to_world(point.position),
        normal: point.normal,
        irradiance: f64::from(point.irradiance.x),
        tolerance: 5.0 * f64::from(point.irradiance_error),
    });
    let solution = solve_matrix(&scene, &rays, &MatrixSettings::default(), &never);
    let patches = solution
        .map(|solution| solution.patches)
        .unwrap_or_default();
    assert!(!patches.is_empty());
    // Elements of stochastic Jacobi are the triangles: none is larger than the whole.
    let settings = JacobiSettings {
        element_count: 1,
        seed: 5,
    };
    let mut jacobi = StochasticJacobi::new(scene.clone(), rays, settings);
    let element_count = jacobi.element_count() as u32;
    assert!(jacobi.pass(4000 * element_count, &never) && jacobi.pass(4000 * element_count, &never));
    let of_patch = |irradiance: Vec3, index: usize| {
        let patch = &patches[index];
        let [a, b, c] = scene.corners(patch.triangle);
        let front = scene.surfaces[patch.triangle.index()]
            .area_vector
            .normalize_or_zero();
        Found {
            position: to_world((a + b + c) / 3.0),
            normal: if patch.is_back { -front } else { front },
            irradiance: f64::from(irradiance.x),
            tolerance: 0.0,
        }
    };
    let elements = jacobi.element_irradiance();
    assert_eq!(elements.len(), patches.len());
    let indices = || 0..patches.len();
    [
        ("paths", paths.collect()),
        (
            "matrix",
            indices()
                .map(|index| of_patch(patches[index].irradiance, index))
                .collect(),
        ),
        (
            "jacobi",
            indices()
                .map(|index| of_patch(elements[index], index))
                .collect(),
        ),
    ]
}

/// Whether every place has the irradiance that it should, to `relative`.
fn assert_light(scene: Scene, relative: f64, expected: impl Fn(DVec3, Vec3) -> f64) {
    assert_light_where(scene, relative, |position, normal| {
        Some(expected(position, normal))
    });
}

/// The same for places of which something is expected.
fn assert_light_where(scene: Scene, relative: f64, expected: impl Fn(DVec3, Vec3) -> Option<f64>) {
    for (how, places) in found(scene) {
        assert!(!places.is_empty());
        for place in places {
            let Some(expected) = expected(place.position, place.normal) else {
                continue;
            };
            let off = (place.irradiance - expected).abs();
            assert!(
                off <= relative * expected + place.tolerance + 1e-5,
                "{how}: {} for {expected} at {}, normal {}",
                place.irradiance,
                place.position,
                place.normal
            );
        }
    }
}

fn uniform(radiance: f32) -> Environment {
    Environment {
        sky: Sky::Uniform(Vec3::splat(radiance)),
        ..Environment::default()
    }
}

/// A sky of this radiance by height above the horizon (sine), from a picture.
fn picture(rows: u32, radiance: impl Fn(f64) -> f64) -> Environment {
    let columns = 2 * rows;
    let pixel = |index: u32| {
        let down = (f64::from(index / columns) + 0.5) / f64::from(rows);
        Vec3::splat(radiance((down * PI).cos()) as f32)
    };
    let picture = Texture {
        name: String::new(),
        width: columns,
        height: rows,
        pixels: (0..columns * rows).map(pixel).collect(),
        ..Texture::default()
    };
    let picture = SkyPicture::new(Arc::new(picture), Vec3::ONE, UpAxis::Y, 0.0);
    Environment {
        sky: Sky::Picture(picture),
        ..Environment::default()
    }
}

/// A piece of level ground that looks up, in the middle of nothing.
fn ground(reflectance: f32) -> Scene {
    let mut plates = Plates::default();
    let paint = plates.material(reflectance, 0.0);
    plates.rectangle(DVec3::ZERO, DVec3::Z, DVec3::X, 3, paint);
    plates.finish(Sides::One)
}

#[test]
fn open_ground_sees_all_of_the_sky() {
    assert_light(ground(0.5).in_environment(uniform(2.0)), 1e-5, |_, _| {
        2.0 * PI
    });
}

#[test]
fn overcast_sky_is_three_times_as_bright_in_the_zenith() {
    // CIE: L = Lz (1 + 2 sin γ) / 3. Level ground has 7π/9 Lz, a wall 0.396 of that from the sky alone.
    let overcast = || {
        picture(128, |sine| {
            if sine > 0.0 {
                (1.0 + 2.0 * sine) / 3.0
            } else {
                0.0
            }
        })
    };
    let level = 7.0 * PI / 9.0;
    assert_light(ground(0.3).in_environment(overcast()), 0.01, |_, _| level);
    let mut wall = Plates::default();
    let paint = wall.material(0.3, 0.0);
    wall.rectangle(DVec3::ZERO, DVec3::X, DVec3::Y, 3, paint);
    let wall = wall.finish(Sides::One).in_environment(overcast());
    assert_light(wall, 0.015, |_, _| 0.396 * level);
}

#[test]
fn a_street_between_black_walls_sees_a_strip_of_the_sky() {
    // Width 1, height 1, and so long that its ends count little: 0.5 % of the light at most.
    let length = 40.0;
    let mut street = Plates::default();
    // Black but for the last digits, so that points are chosen there.
    let floor = street.material(1e-4, 0.0);
    let wall = street.material(0.0, 0.0);
    // Ends are far from the middle, of which alone something is asked.
    for (start, end) in [(-0.5, -0.05), (-0.05, 0.05), (0.05, 0.5)] {
        let (start, along) = (
            DVec3::Z * (length * start),
            DVec3::Z * (length * (end - start)),
        );
        let (third, is_middle) = (1.0 / 6.0, start.z < 0.0 && along.z < 10.0);
        for strip in (0..6).map(|strip| f64::from(strip) * third) {
            let at = start + DVec3::Y * strip;
            street.rectangle(at, DVec3::Y * third, along, 2, wall);
            street.rectangle(at + DVec3::X, along, DVec3::Y * third, 2, wall);
            let paint = if is_middle { floor } else { wall };
            let at = start + DVec3::X * strip;
            street.rectangle(at, along, DVec3::X * third, 2, paint);
        }
    }
    let street = street.finish(Sides::One).in_environment(uniform(1.0));
    // Three times the noise where least of the sky is seen.
    assert_light_where(street, 0.03, |position, normal| {
        // In the middle only.
        if position.z.abs() > 2.0 {
            return None;
        }
        if normal.y > 0.5 {
            let part = |x: f64| x / x.hypot(1.0);
            return Some(0.5 * PI * (part(position.x) + part(1.0 - position.x)));
        }
        let depth = 1.0 - position.y;
        // At the foot less of the sky is seen than is missing at the ends.
        let is_asked = depth < 0.9;
        is_asked.then(|| 0.5 * PI * (1.0 - depth / depth.hypot(1.0)))
    });
}

#[test]
fn the_sun_gives_its_irradiance_times_the_cosine() {
    for (azimuth, elevation) in [(0.0, 90.0), (30.0, 45.0), (200.0, 20.0)] {
        let sun = Sun {
            direction: Sun::towards(azimuth, elevation, UpAxis::Y),
            irradiance: Vec3::splat(5.0),
            diameter: Sun::DEGREES.to_radians(),
        };
        let environment = Environment {
            sun: Some(sun),
            ..Environment::default()
        };
        let expected = 5.0 * f64::from(elevation).to_radians().sin();
        assert_light(ground(0.5).in_environment(environment), 0.002, |_, _| {
            expected
        });
    }
}

#[test]
fn a_pane_lets_its_part_of_sky_and_sun_through() {
    let mut plates = Plates::default();
    let paint = plates.material(0.5, 0.0);
    let pane = plates.pane(0.25);
    plates.rectangle(DVec3::ZERO, DVec3::Z, DVec3::X, 2, paint);
    // So wide and low that less than a thousandth of the light passes beside it.
    let corner = DVec3::new(-10.0, 0.1, -10.0);
    plates.rectangle(corner, DVec3::Z * 20.0, DVec3::X * 20.0, 1, pane);
    let environment = Environment {
        sun: Some(Sun {
            direction: Sun::towards(40.0, 50.0, UpAxis::Y),
            irradiance: Vec3::splat(6.0),
            diameter: Sun::DEGREES.to_radians(),
        }),
        ..uniform(1.0)
    };
    let expected = 0.75 * (PI + 6.0 * 50f64.to_radians().sin());
    let scene = plates.finish(Sides::Two).in_environment(environment);
    assert_light_where(scene, 0.02, |position, normal| {
        (normal.y > 0.5 && position.y < 0.05).then_some(expected)
    });
}

/// Part of a disc of radius 1 to the right of a line at `x` from its centre, -1 to 1.
fn disc_beyond(x: f64) -> f64 {
    let x = x.clamp(-1.0, 1.0);
    (FRAC_PI_2 - x.asin() - x * (1.0 - x * x).sqrt()) / PI
}

#[test]
fn the_penumbra_of_an_edge_is_as_wide_as_the_sun_looks() {
    // The sun in the zenith, 4° wide; half a roof at height 10 over x > 0, so that its shadow is 0.7 wide. A sky of the
    // radiance 0 elsewhere.
    let half = 2f64.to_radians();
    let mut plates = Plates::default();
    let ground = plates.material(0.0, 0.0);
    let lit = plates.material(0.5, 0.0);
    plates.rectangle(
        DVec3::new(-1.0, 0.0, -0.1),
        DVec3::Z * 0.2,
        DVec3::X * 2.0,
        1,
        lit,
    );
    let roof = DVec3::new(0.0, 10.0, -50.0);
    plates.rectangle(roof, DVec3::Z * 100.0, DVec3::X * 50.0, 1, ground);
    let scene = plates.finish(Sides::One).in_environment(Environment {
        sun: Some(Sun {
            direction: Vec3::Y,
            irradiance: Vec3::splat(1.0),
            diameter: 2.0 * half as f32,
        }),
        ..Environment::default()
    });
    let scene = Arc::new(scene);
    let points = traced(&scene, 400, 2048);
    let mut between = 0;
    for point in points.iter().filter(|point| point.reflectance.x > 0.0) {
        let x = scene.frame.to_world(point.position).x;
        let expected = disc_beyond(x / (10.0 * half.tan()));
        let found = f64::from(point.irradiance.x);
        let tolerance = 5.0 * f64::from(point.irradiance_error) + 0.005;
        assert!(
            (found - expected).abs() < tolerance,
            "{x}: {found} for {expected}"
        );
        between += u32::from((0.05..0.95).contains(&expected));
    }
    assert!(between > 50, "{between}");
}

#[test]
fn surfaces_that_replace_the_light_they_take_have_the_radiance_of_the_sky() {
    // Le = L0 (1 - ρ): L0 everywhere, and π L0 arrives everywhere, inside and outside.
    let mut plates = Plates::default();
    let paints = [0.2f32, 0.5, 0.8, 0.3, 0.6, 0.4].map(|r| plates.material(r, 3.0 * (1.0 - r)));
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let walls = [
        (DVec3::ZERO, y, z),
        (x, z, y),
        (DVec3::ZERO, z, x),
        (DVec3::ZERO, x, y),
        (z, y, x),
    ];
    // A box without a lid, and a sheet before its opening.
    for ((origin, u, v), paint) in walls.into_iter().zip(paints) {
        plates.rectangle(origin, u, v, 2, paint);
    }
    plates.rectangle(y * 1.3 + x * 0.3, z, x, 1, paints[5]);
    let scene = plates.finish(Sides::Two);
    for environment in [uniform(3.0), picture(16, |_| 3.0)] {
        let scene = scene.clone().in_environment(environment);
        assert_light(scene, 0.02, |_, _| 3.0 * PI);
    }
}

#[test]
fn a_small_sun_in_a_picture_is_as_bright_as_a_disc() {
    // One pixel of 512 x 256 in the zenith's row would be at the pole: it stands at 45°.
    let (rows, bright) = (256u32, 1e4f32);
    let columns = 2 * rows;
    let (column, row) = (columns / 4, rows / 4);
    let mut pixels = vec![Vec3::splat(0.1); (columns * rows) as usize];
    pixels[(row * columns + column) as usize] = Vec3::splat(bright);
    let texture = Texture {
        name: String::new(),
        width: columns,
        height: rows,
        pixels,
        ..Texture::default()
    };
    let sky = SkyPicture::new(Arc::new(texture), Vec3::ONE, UpAxis::Y, 0.0);
    // Bilinear between pixels: a pyramid of the volume of one pixel, about its centre.
    let at =
        Vec2::new(column as f32 + 0.5, row as f32 + 0.5) / Vec2::new(columns as f32, rows as f32);
    let pixel = (PI / f64::from(rows)).powi(2) * (f64::from(at.y) * PI).sin();
    let cosine = f64::from(sky.direction(at).y);
    let expected = 0.1 * PI + f64::from(bright - 0.1) * pixel * cosine;
    let environment = Environment {
        sky: Sky::Picture(sky),
        ..Environment::default()
    };
    assert_light(ground(0.5).in_environment(environment), 0.02, |_, _| {
        expected
    });
}
