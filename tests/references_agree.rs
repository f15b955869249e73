//! The references against each other: matrix, path tracing, and the lookup and error measures that compare with them.

mod truth_scenes;

use std::{f32::consts::PI, sync::Arc};

use glam::{DVec3, Vec3};
use truth_scenes::{Plates, never};
use vecrad::{
    geometry::RayTree,
    metrics::{MeshLookup, measure_error},
    reference::{
        MatrixSettings, PathSettings, PathTraced, PathTracer, ReferencePoint, solve_matrix,
    },
    scene::{Scene, Sides, TriangleId},
    solver::{DisplayMesh, VertexLight},
};

/// A closed room with a bright ceiling and a two-sided grey sheet that hangs in it and shadows the floor.
fn room_with_sheet() -> Scene {
    let mut room = Plates::default();
    let wall = room.material(0.5, 0.0);
    let ceiling = room.material(0.3, 2.0);
    room.room(5, [wall, wall, wall, wall, wall, ceiling]);
    let (u, v) = (DVec3::X * 0.5, DVec3::Y * 0.5);
    room.rectangle(DVec3::new(0.25, 0.25, 0.5), u, v, 3, wall);
    room.finish(Sides::Two)
}

fn traced(scene: &Arc<Scene>, point_count: u32, samples: u32, seed: u64) -> PathTraced {
    let settings = PathSettings {
        point_count,
        samples_per_pass: samples,
        seed,
    };
    let mut tracer = PathTracer::new(scene.clone(), Arc::new(RayTree::new(scene)), settings);
    assert!(tracer.pass(&never));
    tracer.result()
}

#[test]
fn matrix_agrees_with_path_tracing() {
    let scene = Arc::new(room_with_sheet());
    let rays = RayTree::new(&scene);
    let matrix = solve_matrix(&scene, &rays, &MatrixSettings::default(), &never).unwrap();
    let paths = traced(&scene, 4000, 32, 7);
    // Mean irradiance over each wall and each side of the sheet: 50 triangles a wall, 18 the sheet.
    let region = |triangle: TriangleId, is_back: bool| {
        let wall = (triangle.index() / 50).min(6);
        // The room's outside is lit by nothing but the back of the ceiling, which sees nothing.
        if wall < 6 {
            (!is_back).then_some(wall)
        } else {
            Some(6 + usize::from(is_back))
        }
    };
    const CEILING: usize = 5;
    for wanted in 0..8 {
        let patches: Vec<f64> = matrix
            .patches
            .iter()
            .filter(|patch| region(patch.triangle, patch.is_back) == Some(wanted))
            .map(|patch| f64::from(patch.irradiance.x))
            .collect();
        let points: Vec<&ReferencePoint> = paths
            .points
            .iter()
            .filter(|point| region(point.triangle, point.is_back) == Some(wanted))
            .collect();
        // Of the ceiling, which emits, light that arrives is not asked for.
        if wanted == CEILING {
            assert!(points.is_empty());
            continue;
        }
        let expected = patches.iter().sum::<f64>() / patches.len() as f64;
        let count = points.len() as f64;
        let mean = points
            .iter()
            .map(|p| f64::from(p.irradiance.x))
            .sum::<f64>()
            / count;
        // Points fall differently into the light's gradient than patches: their scatter counts as well as their noise.
        let scatter = points
            .iter()
            .map(|p| (f64::from(p.irradiance.x) - mean).powi(2))
            .sum::<f64>();
        let sigma = scatter.sqrt() / count;
        // Constant radiosity over patches of a fifth of the wall is good to about 1 % of a mean.
        let tolerance = 4.0 * sigma + 0.01 * expected;
        assert!(
            (mean - expected).abs() < tolerance,
            "region {wanted}: {mean} ± {sigma}, matrix {expected}"
        );
        assert!(
            sigma < 0.03 * expected,
            "region {wanted}: {sigma} of {expected}"
        );
    }
}

#[test]
fn nothing_escapes_from_a_closed_room() {
    // Lit from inside, the outside of a closed room of two-sided walls stays black: every ray that slips through a
    // seam would show there, and as light missing inside.
    let mut room = Plates::default();
    let wall = room.material(0.9, 0.0);
    room.room(7, [wall; 6]);
    let lamp = room.material(0.0, 10.0);
    room.rectangle(
        DVec3::new(0.4, 0.4, 0.5),
        DVec3::X * 0.2,
        DVec3::Y * 0.2,
        1,
        lamp,
    );
    let scene = Arc::new(room.finish(Sides::Two));
    let paths = traced(&scene, 2000, 16, 11);
    let outside = |point: &&ReferencePoint| point.is_back && point.triangle.index() < 6 * 98;
    let dark = paths.points.iter().filter(outside);
    assert!(dark.clone().count() > 900);
    for point in dark {
        assert_eq!(point.irradiance, Vec3::ZERO, "{point:?}");
    }
}

#[test]
fn one_sided_backs_are_black_but_block() {
    // A lamp shines down; a one-sided sheet that shows its back to the lamp shadows the floor.
    let mut plates = Plates::default();
    let black = plates.material(0.0, 0.0);
    let lamp = plates.material(0.0, 1.0);
    let (x, y) = (DVec3::X, DVec3::Y);
    plates.rectangle(DVec3::ZERO, x, y, 1, black);
    plates.rectangle(DVec3::Z, y, x, 1, lamp);
    plates.rectangle(DVec3::new(-1.0, -1.0, 0.5), y * 3.0, x * 3.0, 1, lamp);
    let scene = Arc::new(plates.finish(Sides::One));
    let paths = traced(&scene, 400, 64, 13);
    assert!(paths.points.iter().all(|point| !point.is_back));
    for point in paths
        .points
        .iter()
        .filter(|point| point.triangle.index() < 2)
    {
        // The sheet's front covers most of the floor's sky: between half and all of π.
        assert!(
            point.irradiance.x > 0.5 * PI && point.irradiance.x < 1.05 * PI,
            "{point:?}"
        );
    }
    for point in paths
        .points
        .iter()
        .filter(|point| point.triangle.index() >= 2)
    {
        assert_eq!(point.irradiance, Vec3::ZERO, "{point:?}");
    }
}

#[test]
fn a_seed_gives_the_same_bits_on_any_number_of_threads() {
    let scene = Arc::new(room_with_sheet());
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| traced(&scene, 200, 16, 17))
    };
    let one = on(1);
    assert_eq!(one, on(8));
    assert_ne!(one, traced(&scene, 200, 16, 18));
    assert!(one.rays > 200 * 16 && one.samples == 16);
}

#[test]
fn passes_continue_and_a_cancelled_one_leaves_no_trace() {
    let scene = Arc::new(room_with_sheet());
    let settings = PathSettings {
        point_count: 100,
        samples_per_pass: 16,
        seed: 19,
    };
    let mut tracer = PathTracer::new(scene.clone(), Arc::new(RayTree::new(&scene)), settings);
    assert!(!tracer.pass(&|| true));
    assert_eq!(tracer.result().samples, 0);
    assert!(tracer.pass(&never) && tracer.pass(&never));
    assert_eq!(tracer.result(), traced(&scene, 100, 32, 19));
}

/// A display mesh with every side of every triangle divided in four, and an irradiance linear in space.
fn display(scene: &Scene) -> (DisplayMesh, VertexLight) {
    let (mut mesh, mut light) = (DisplayMesh::default(), VertexLight::default());
    for triangle in scene.triangle_ids() {
        let [a, b, c] = scene.corners(triangle);
        let [ab, bc, ca] = [a.midpoint(b), b.midpoint(c), c.midpoint(a)];
        for is_back in [false, true] {
            for corners in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
                let base = mesh.positions.len() as u32;
                mesh.indices.push([base, base + 1, base + 2]);
                mesh.triangle_of.push(triangle.0);
                mesh.is_back.push(is_back);
                mesh.element_of.push(0);
                for corner in corners {
                    mesh.positions.push(corner);
                    mesh.reflectance.push(Vec3::splat(0.5));
                    mesh.emission.push(Vec3::ZERO);
                    light.irradiance.push(linear(corner, is_back));
                }
            }
        }
    }
    (mesh, light)
}

fn linear(position: Vec3, is_back: bool) -> Vec3 {
    let side = if is_back { 300.0 } else { 0.0 };
    position + Vec3::splat(100.0 + side)
}

#[test]
fn lookup_reads_what_the_mesh_shows() {
    let scene = Arc::new(room_with_sheet());
    let (mesh, light) = display(&scene);
    let settings = PathSettings {
        point_count: 500,
        ..PathSettings::default()
    };
    let tracer = PathTracer::new(scene.clone(), Arc::new(RayTree::new(&scene)), settings);
    let mut points = tracer.result().points;
    let found = MeshLookup::new(&scene, &mesh).radiance(&light, &points);
    for (point, found) in points.iter_mut().zip(&found) {
        let irradiance = linear(point.position, point.is_back);
        let expected = point.emission + point.reflectance * irradiance / PI;
        assert!(
            (found.unwrap() - expected).length() < 1e-3,
            "{point:?}: {found:?}"
        );
        // Let the points show the same light, so that the measures must find no error.
        point.irradiance = linear(point.position, point.is_back);
    }
    let error = measure_error(&found, &points).unwrap();
    assert!(
        error.relative_rms < 1e-5 && error.unmatched == 0 && error.nonfinite == 0,
        "{error:?}"
    );
    // A mesh that covers nothing matches nothing.
    let empty = DisplayMesh::default();
    let missed = MeshLookup::new(&scene, &empty).radiance(&light, &points);
    assert!(missed.iter().all(Option::is_none));
}
