//! The solvers to race against: stochastic Jacobi radiosity and the path-traced bake, by closed forms and each other.

mod common;
mod truth_scenes;

use std::{f32::consts::PI, sync::Arc};

use common::assert_close;
use glam::{DVec3, Vec3};
use truth_scenes::{Plates, never};
use vecrad::{
    geometry::RayTree,
    metrics::measure_error,
    reference::{
        BakePoint, JacobiSettings, MatrixSettings, PathSettings, PathTracer, ReferencePoint,
        StochasticJacobi, VertexBake, solve_matrix,
    },
    scene::{Scene, Sides},
};

/// A closed room of walls of one reflectance, with a bright ceiling.
fn room() -> Scene {
    let mut room = Plates::default();
    let wall = room.material(0.5, 0.0);
    let ceiling = room.material(0.3, 2.0);
    room.room(4, [wall, wall, wall, wall, wall, ceiling]);
    room.finish(Sides::One)
}

fn furnace(reflectance: f32) -> Scene {
    let mut room = Plates::default();
    let wall = room.material(reflectance, 1.0 / PI);
    room.room(2, [wall; 6]);
    room.finish(Sides::One)
}

fn points_on(scene: &Arc<Scene>, samples: u32) -> Vec<ReferencePoint> {
    let settings = PathSettings {
        point_count: 1000,
        samples_per_pass: samples,
        seed: 3,
    };
    let mut tracer = PathTracer::new(scene.clone(), Arc::new(RayTree::new(scene)), settings);
    assert!(tracer.pass(&never));
    tracer.result().points
}

fn jacobi(scene: &Arc<Scene>, element_count: u32) -> StochasticJacobi {
    let settings = JacobiSettings {
        element_count,
        seed: 5,
    };
    StochasticJacobi::new(scene.clone(), Arc::new(RayTree::new(scene)), settings)
}

/// Error of the irradiance that Jacobi shows, as radiance.
fn jacobi_error(jacobi: &StochasticJacobi, points: &[ReferencePoint]) -> f64 {
    let measured: Vec<Option<Vec3>> = jacobi
        .irradiance(points)
        .into_iter()
        .zip(points)
        .map(|(irradiance, point)| {
            let lit = ReferencePoint {
                irradiance: irradiance?,
                ..*point
            };
            Some(lit.radiance())
        })
        .collect();
    measure_error(&measured, points).map_or(f64::MAX, |error| error.relative_rms)
}

#[test]
fn jacobi_fills_a_furnace() {
    for reflectance in [0.5, 0.9] {
        let scene = Arc::new(furnace(reflectance));
        let points = points_on(&scene, 16);
        let mut jacobi = jacobi(&scene, 200);
        for _ in 0..4 {
            assert!(jacobi.pass(50_000, &never));
        }
        let lit = jacobi.irradiance(&points);
        let mean = lit.iter().flatten().map(|e| f64::from(e.x)).sum::<f64>() / lit.len() as f64;
        let expected = 1.0 / (1.0 - f64::from(reflectance));
        // Irradiance equals radiosity in a furnace. 200,000 rays a bounce: the end of a path is left to chance, by
        // about the root of the rays of the last bounces; 1 % is several times that.
        assert_close(mean, expected, 0.01, "mean");
        // Each of 216 elements gets some 900 rays a bounce, so 3 % each at worst, less by stratification.
        let worst = lit
            .iter()
            .flatten()
            .map(|e| (f64::from(e.x) / expected - 1.0).abs())
            .fold(0.0, f64::max);
        assert!(worst < 0.1, "{worst}");
    }
}

#[test]
fn jacobi_agrees_with_the_matrix() {
    let scene = Arc::new(room());
    let rays = RayTree::new(&scene);
    let matrix = solve_matrix(&scene, &rays, &MatrixSettings::default(), &never).unwrap();
    let mut jacobi = jacobi(&scene, 1);
    assert_eq!(jacobi.element_count(), scene.triangles.len());
    for _ in 0..4 {
        assert!(jacobi.pass(200_000, &never));
    }
    let arrived = jacobi.element_irradiance();
    for (patch, irradiance) in matrix.patches.iter().zip(arrived) {
        let (expected, found) = (f64::from(patch.irradiance.x), f64::from(irradiance.x));
        // Some 2,000 rays or more reach each of the 192 patches (2 % of noise), and the matrix has its own.
        assert_close(found, expected, 0.08, format_args!("{patch:?}"));
    }
}

#[test]
fn jacobi_comes_nearer_to_path_tracing_with_every_pass() {
    let scene = Arc::new(room());
    let points = points_on(&scene, 256);
    let mut jacobi = jacobi(&scene, 2_000);
    let mut errors = Vec::new();
    for pass in 0..6 {
        assert!(jacobi.pass(4_000 << (2 * pass), &never));
        errors.push(jacobi_error(&jacobi, &points));
    }
    // Each pass brings four times the rays of the one before: noise falls until elements blur.
    assert!(errors[0] > 0.1, "{errors:?}");
    assert!(
        errors.windows(2).all(|pair| pair[1] < pair[0]),
        "{errors:?}"
    );
    assert!(errors[5] < 0.03, "{errors:?}");
}

#[test]
fn jacobi_gives_the_same_bits_on_any_number_of_threads() {
    let scene = Arc::new(room());
    let points = points_on(&scene, 16);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let mut jacobi = jacobi(&scene, 500);
            assert!(jacobi.pass(20_000, &never) && jacobi.pass(20_000, &never));
            (jacobi.irradiance(&points), jacobi.ray_count())
        })
    };
    assert_eq!(on(1), on(8));
}

#[test]
fn a_cancelled_pass_leaves_no_trace() {
    let scene = Arc::new(room());
    let points = points_on(&scene, 16);
    let [mut interrupted, mut whole] = [jacobi(&scene, 500), jacobi(&scene, 500)];
    assert!(!interrupted.pass(5_000, &|| true));
    assert_eq!(interrupted.ray_count(), 0);
    assert!(interrupted.pass(5_000, &never) && whole.pass(5_000, &never));
    assert_eq!(interrupted.irradiance(&points), whole.irradiance(&points));
}

#[test]
fn the_sheet_in_a_room_shadows_jacobi_rays_from_both_sides() {
    let mut plates = Plates::default();
    let black = plates.material(0.0, 0.0);
    let lamp = plates.material(0.0, 1.0);
    plates.rectangle(DVec3::ZERO, DVec3::X, DVec3::Y, 1, black);
    plates.rectangle(DVec3::Z, DVec3::Y, DVec3::X, 1, lamp);
    plates.rectangle(DVec3::Z * 0.5, DVec3::X, DVec3::Y, 1, black);
    let scene = Arc::new(plates.finish(Sides::One));
    let points = points_on(&scene, 64);
    let mut jacobi = jacobi(&scene, 600);
    assert!(jacobi.pass(400_000, &never));
    // The sheet covers the middle of the floor's sky; what is left comes past its edges.
    assert!(jacobi_error(&jacobi, &points) < 0.1);
    let lit = jacobi.irradiance(&points);
    for (found, point) in lit.iter().zip(&points) {
        let is_dark = point.irradiance == Vec3::ZERO && point.triangle.index() >= 2;
        assert!(
            !is_dark || *found == Some(Vec3::ZERO),
            "{point:?}: {found:?}"
        );
    }
}

#[test]
fn a_bake_converges_and_does_not_mind_how_it_is_cut_into_passes() {
    let scene = Arc::new(room());
    let rays = RayTree::new(&scene);
    let truth = points_on(&scene, 512);
    let points: Vec<BakePoint> = truth
        .iter()
        .map(|point| BakePoint {
            position: point.position,
            normal: point.normal,
            triangle: point.triangle,
        })
        .collect();
    let mut bake = VertexBake::new(&scene, &rays, &points, 9);
    let mut errors = Vec::new();
    for pass in 0..5 {
        // 1, 4, 16, 64 and 256 samples in all.
        let until = 1 << (2 * pass);
        assert!(bake.pass(until - bake.samples(), &never));
        let measured: Vec<Option<Vec3>> = bake
            .irradiance()
            .into_iter()
            .zip(&truth)
            .map(|(irradiance, point)| {
                Some(
                    ReferencePoint {
                        irradiance,
                        ..*point
                    }
                    .radiance(),
                )
            })
            .collect();
        errors.push(measure_error(&measured, &truth).unwrap().relative_rms);
    }
    assert!(errors[0] > 0.2, "{errors:?}");
    assert!(
        errors.windows(2).all(|pair| pair[1] < 0.75 * pair[0]),
        "{errors:?}"
    );
    let mut at_once = VertexBake::new(&scene, &rays, &points, 9);
    assert!(at_once.pass(256, &never) && !at_once.pass(1, &|| true));
    assert_eq!(
        (at_once.samples(), at_once.ray_count()),
        (256, bake.ray_count())
    );
    for (a, b) in at_once.irradiance().iter().zip(bake.irradiance()) {
        // Sums of f64 in another order.
        assert!((*a - b).abs().max_element() <= 1e-5 * b.max_element());
    }
}
