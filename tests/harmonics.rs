//! Light by direction at vertices against closed forms and the reference.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::{f32::consts::PI, sync::Arc};

use common::{finish, solve};
use glam::{DVec3, Vec2, Vec3};
use vecrad::{
    geometry::{Harmonics, RayTree},
    picture::harmonics_at_vertices,
    reference::{BakePoint, bake},
    scene::{
        Environment, Material, MaterialId, Scene, SceneBuilder, SceneOptions, Sides, Sky,
        SkyPicture, Specular, Sun, Texture, TriangleId, UpAxis, builtin,
    },
    solver::{Cancel, Snapshot, SolveSettings},
};

/// Light by direction at the vertices of a scene, and the snapshot that it is of.
fn harmonics(scene: &Arc<Scene>) -> (Snapshot, Vec<Harmonics>) {
    let snapshot = solve(scene, SolveSettings::default()).0.snapshot();
    let rays = RayTree::new(scene);
    let found = harmonics_at_vertices(scene, &rays, &snapshot, 1, &Cancel::default());
    (snapshot, found.unwrap())
}

/// A quadrilateral, counter-clockwise from its front.
fn quad(builder: &mut SceneBuilder, corners: [[f64; 3]; 4], material: MaterialId) {
    let [a, b, c, d] = corners.map(|corner| builder.push_position(DVec3::from_array(corner)));
    builder.push_triangle([a, b, c], material);
    builder.push_triangle([a, c, d], material);
}

/// A square that looks up, or down, with its middle over a place.
fn level(builder: &mut SceneBuilder, middle: [f64; 3], half: f64, up: bool, material: MaterialId) {
    let [x, y, z] = middle;
    let mut corners = [[-half, half], [half, half], [half, -half], [-half, -half]];
    if !up {
        corners.reverse();
    }
    quad(
        builder,
        corners.map(|[across, along]| [x + across, y, z + along]),
        material,
    );
}

fn grey(builder: &mut SceneBuilder, reflectance: f32, emission: f32) -> MaterialId {
    let [reflectance, emission] = [reflectance, emission].map(Vec3::splat);
    builder.push_material(Material::plain("", reflectance, emission))
}

/// A floor under a sky and a sun.
fn floor_under(sky: Sky, sun: Option<Sun>) -> Arc<Scene> {
    let mut builder = SceneBuilder::default();
    let floor = grey(&mut builder, 0.5, 0.0);
    level(&mut builder, [0.0; 3], 1.0, true, floor);
    let scene = finish(builder, Sides::One);
    let environment = Environment {
        sky,
        sun,
        is_default: false,
    };
    Arc::new((*scene).clone().in_environment(environment))
}

/// Y₀₀, Y₁₋₁, Y₁₀ and Y₁₁.
fn basis(direction: Vec3) -> [f32; 4] {
    let Vec3 { x, y, z } = direction;
    [
        0.282_094_8,
        0.488_602_5 * y,
        0.488_602_5 * z,
        0.488_602_5 * x,
    ]
}

/// Fails unless the coefficients of a channel differ by less than a part of the first.
fn assert_near(found: &Harmonics, expected: [f32; 4], part: f32, what: &str) {
    for (found, wanted) in found.0.iter().zip(expected) {
        assert!(
            (found.x - wanted).abs() < part * expected[0],
            "{what}: {found} instead of {expected:?}"
        );
    }
}

#[test]
fn an_even_sky_over_a_floor_has_the_coefficients_of_a_hemisphere() {
    let (_, found) = harmonics(&floor_under(Sky::Uniform(Vec3::ONE), None));
    for found in found {
        // 2 π Y₀₀ and π Y₁₋₁: the mean of the heights of a hemisphere is a half.
        assert_near(&found, [1.772_454, 1.534_99, 0.0, 0.0], 3e-3, "floor");
        assert!(found.irradiance(Vec3::Y).abs_diff_eq(Vec3::splat(PI), 0.01));
    }
}

#[test]
fn a_sun_has_the_coefficients_of_its_direction() {
    let direction = Vec3::new(0.48, 0.6, -0.64);
    let sun = Sun {
        direction,
        irradiance: Vec3::splat(3.0),
        diameter: Sun::DEGREES.to_radians(),
    };
    let (_, found) = harmonics(&floor_under(Sky::Dark, Some(sun)));
    for found in found {
        assert_near(&found, basis(direction).map(|y| 3.0 * y), 2e-3, "sun");
    }
}

/// A picture that is bright in a spot, dim elsewhere and black below the horizon.
fn spotted_sky() -> SkyPicture {
    let (width, height) = (64, 32);
    let pixel = |index: u32| {
        let (column, row) = (index % width, index / width);
        let is_spot = (20..23).contains(&column) && (6..8).contains(&row);
        match (is_spot, row < height / 2) {
            (true, _) => Vec3::splat(300.0),
            (_, true) => Vec3::splat(1.0 + 0.02 * column as f32),
            _ => Vec3::ZERO,
        }
    };
    let picture = Texture {
        name: String::new(),
        width,
        height,
        pixels: (0..width * height).map(pixel).collect(),
        ..Texture::default()
    };
    SkyPicture::new(Arc::new(picture), Vec3::ONE, UpAxis::Y, 0.0)
}

#[test]
fn a_sky_that_varies_has_the_coefficients_of_its_picture() {
    let sky = spotted_sky();
    let mut expected = [0.0; 4];
    for part in sky.samples(1 << 16) {
        if part.direction.y > 0.0 {
            let light = part.radiance.x * part.solid_angle;
            for (sum, y) in expected.iter_mut().zip(basis(part.direction)) {
                *sum += light * y;
            }
        }
    }
    let (_, found) = harmonics(&floor_under(Sky::Picture(sky), None));
    for found in found {
        // 0.031 at most: a spot of 17° that 32 of the points meet.
        assert_near(&found, expected, 0.045, "sky");
    }
}

/// Coefficients that a small lamp of radiance 100 gives, which looks down: L Ω Y.
fn of_lamp(lamp: DVec3, half: f64, point: DVec3) -> [f32; 4] {
    let away = lamp - point;
    let solid_angle = 4.0 * half * half * away.y.abs() / away.length().powi(3);
    basis(away.normalize_or_zero().as_vec3()).map(|y| 100.0 * solid_angle as f32 * y)
}

/// Vertices that look up, with their places in the world.
fn on_floors(scene: &Scene, snapshot: &Snapshot) -> Vec<(usize, DVec3)> {
    let mesh = &snapshot.mesh;
    let is_floor = |&vertex: &usize| mesh.normals[vertex].y > 0.99;
    let vertices = (0..mesh.positions.len()).filter(is_floor);
    vertices
        .map(|vertex| (vertex, scene.frame.to_world(mesh.positions[vertex])))
        .collect()
}

#[test]
fn a_small_lamp_and_its_image_have_the_coefficients_of_their_directions() {
    let (lamp, half) = (DVec3::new(1.2, 1.5, 0.1), 0.01);
    for has_mirror in [false, true] {
        let mut builder = SceneBuilder::default();
        let floor = grey(&mut builder, 0.0, 0.0);
        let light = grey(&mut builder, 0.0, 100.0);
        level(&mut builder, [1.0, 0.0, 0.0], 1.0, true, floor);
        level(&mut builder, lamp.to_array(), half, false, light);
        if has_mirror {
            let mirror = builder.push_material(Material {
                specular: Some(Specular::Mirror {
                    reflectance: Vec3::splat(0.75),
                }),
                ..Material::plain("mirror", Vec3::ZERO, Vec3::ZERO)
            });
            // In the plane x = 0, towards +x.
            let corners = [
                [0.0, 0.0, 5.0],
                [0.0, 0.0, -5.0],
                [0.0, 5.0, -5.0],
                [0.0, 5.0, 5.0],
            ];
            quad(&mut builder, corners, mirror);
        }
        let scene = finish(builder, Sides::One);
        let (snapshot, found) = harmonics(&scene);
        let floors = on_floors(&scene, &snapshot);
        assert!(floors.len() > 8);
        for (vertex, point) in floors {
            let mut expected = of_lamp(lamp, half, point);
            if has_mirror {
                // On the mirror's edge a vertex sees neither the lamp in it nor light along it.
                if point.x < 0.1 {
                    continue;
                }
                let image = DVec3::new(-lamp.x, lamp.y, lamp.z);
                for (sum, more) in expected.iter_mut().zip(of_lamp(image, half, point)) {
                    *sum += 0.75 * more;
                }
            }
            let what = format!("mirror {has_mirror}, {point}");
            assert_near(&found[vertex], expected, 0.01, &what);
        }
    }
}

/// The corners of an icosahedron: sums over them are exact for harmonics up to the fifth band.
fn directions() -> Vec<Vec3> {
    let golden = 0.5 * (1.0 + 5.0f32.sqrt());
    let corner = |a: f32, b: f32| Vec2::new(a, b * golden) / golden.hypot(1.0);
    let signs = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
    let corners = signs.map(|(a, b)| corner(a, b));
    let turned = |corner: Vec2| {
        [
            Vec3::new(0.0, corner.x, corner.y),
            Vec3::new(corner.y, 0.0, corner.x),
            Vec3::new(corner.x, corner.y, 0.0),
        ]
    };
    corners.into_iter().flat_map(turned).collect()
}

/// Relative RMS errors of coefficients against those of the irradiance that the reference finds for turned normals, of the
/// irradiance that they tell for these normals, and of what the reference's own two bands tell.
fn errors(scene: &Arc<Scene>, stride: usize, samples: u32) -> [f64; 3] {
    let (snapshot, found) = harmonics(scene);
    let (mesh, rays, directions) = (&snapshot.mesh, RayTree::new(scene), directions());
    let mut sums = [0.0; 5];
    for triangle in (0..mesh.indices.len()).step_by(stride) {
        let vertex = mesh.indices[triangle][0] as usize;
        let points: Vec<BakePoint> = directions
            .iter()
            .map(|&normal| BakePoint {
                position: mesh.positions[vertex],
                normal,
                triangle: TriangleId(mesh.triangle_of[triangle]),
            })
            .collect();
        let truth = bake(scene, &rays, &points, samples, 7, &|| false).unwrap();
        // ∫ E(n) Y(n) dn is A times the coefficient, with A = π in band 0 and 2 π / 3 in band 1.
        let mut expected = [Vec3::ZERO; 4];
        for (&direction, irradiance) in directions.iter().zip(&truth) {
            for (order, y) in basis(direction).into_iter().enumerate() {
                let factor = if order == 0 { PI } else { 2.0 * PI / 3.0 };
                expected[order] += irradiance * (4.0 * PI / 12.0 * y / factor);
            }
        }
        for (&direction, &irradiance) in directions.iter().zip(&truth) {
            let told = [found[vertex], Harmonics(expected)].map(|of| of.irradiance(direction));
            let [own, best] = told.map(|told| f64::from((told - irradiance).length_squared()));
            sums[2] += own;
            sums[3] += best;
            sums[4] += f64::from(irradiance.length_squared());
        }
        for (found, expected) in found[vertex].0.iter().zip(expected) {
            sums[0] += f64::from((found - expected).length_squared());
            sums[1] += f64::from(expected.length_squared());
        }
    }
    let [own, best] = [sums[2], sums[3]].map(|sum| (sum / sums[4]).sqrt());
    [(sums[0] / sums[1]).sqrt(), own, best]
}

#[test]
fn coefficients_are_those_of_the_reference() {
    let options = SceneOptions::with_sides(Sides::One);
    let scene = Arc::new(builtin::builtin("cornell", &options).unwrap().unwrap());
    let [coefficients, turned, best] = errors(&scene, 97, 1024);
    println!("coefficients {coefficients:.4}, turned normals {turned:.4}, best {best:.4}");
    // 0.046, and 0.255: two bands cannot tell more of what a lamp casts on turned normals.
    assert!(coefficients < 0.065, "{coefficients}");
    assert!(turned < best + 0.02, "{turned} {best}");
}
