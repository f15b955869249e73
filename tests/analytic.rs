//! The references against closed forms.

mod common;
mod truth_scenes;

use std::{f32::consts::PI, sync::Arc};

use common::assert_close;
use glam::{DVec3, Vec3};
use truth_scenes::{Plates, never};
use vecrad::{
    geometry::RayTree,
    reference::{
        BakePoint, MatrixError, MatrixSettings, MatrixSolution, PathSettings, PathTracer, analytic,
        bake, solve_matrix,
    },
    scene::{Scene, Sides, TriangleId},
};

/// A black plate below or beside a plate of radiosity 1, `2 n²` triangles each.
fn plates(n: u32, [source, u, v]: [DVec3; 3]) -> Scene {
    let mut plates = Plates::default();
    let black = plates.material(0.0, 0.0);
    let bright = plates.material(0.0, 1.0 / PI);
    plates.rectangle(DVec3::ZERO, DVec3::X, DVec3::Y, n, black);
    plates.rectangle(source, u, v, n, bright);
    plates.finish(Sides::One)
}

/// Opposed unit squares at distance 1.
fn parallel(n: u32) -> Scene {
    plates(n, [DVec3::Z, DVec3::Y, DVec3::X])
}

/// Unit squares that share an edge at a right angle.
fn perpendicular(n: u32) -> Scene {
    plates(n, [DVec3::ZERO, DVec3::Y, DVec3::Z])
}

fn matrix_of(scene: &Scene) -> MatrixSolution {
    solve_matrix(
        scene,
        &RayTree::new(scene),
        &MatrixSettings::default(),
        &never,
    )
    .expect("the matrix is small")
}

/// Mean irradiance over the first plate, whose triangles are equal.
fn first_plate_mean(solution: &MatrixSolution) -> f64 {
    let half = solution.patches.len() / 2;
    let sum: f64 = solution.patches[..half]
        .iter()
        .map(|patch| f64::from(patch.irradiance.y))
        .sum();
    sum / half as f64
}

#[test]
fn matrix_gives_the_factors_of_plates() {
    let parallel_factor = analytic::parallel_rectangles(1.0, 1.0, 1.0);
    let perpendicular_factor = analytic::perpendicular_rectangles(1.0, 1.0, 1.0);
    // The midpoint rule with cells of 0.15 of the gap is good to some tenths of a percent; touching triangles
    // get 1024 cells, so that the edge strip, where the integrand varies most, is 1/32 of the plate.
    for n in [1, 4] {
        let found = first_plate_mean(&matrix_of(&parallel(n)));
        assert_close(found, parallel_factor, 0.003, format_args!("parallel {n}"));
        let found = first_plate_mean(&matrix_of(&perpendicular(n)));
        assert_close(
            found,
            perpendicular_factor,
            0.003,
            format_args!("perpendicular {n}"),
        );
    }
}

#[test]
fn matrix_of_a_furnace_is_uniform() {
    for reflectance in [0.5, 0.9] {
        let mut room = Plates::default();
        let wall = room.material(reflectance, 1.0 / PI);
        room.room(2, [wall; 6]);
        let solution = matrix_of(&room.finish(Sides::One));
        let expected = analytic::furnace_radiosity(1.0, f64::from(reflectance));
        for patch in &solution.patches {
            // A row sum that is off by δ shifts the radiosity by up to δ ρ/(1 − ρ).
            assert_close(patch.row_sum, 1.0, 0.003, format_args!("{patch:?}"));
            let found = f64::from(patch.radiosity.x);
            assert_close(found, expected, 0.02, format_args!("ρ {reflectance}"));
        }
    }
}

#[test]
fn matrix_refuses_what_does_not_fit() {
    let scene = parallel(1);
    let settings = MatrixSettings {
        memory_limit: 63,
        ..MatrixSettings::default()
    };
    let refused = solve_matrix(&scene, &RayTree::new(&scene), &settings, &never);
    assert!(
        matches!(refused, Err(MatrixError::TooLarge { patches: 4, .. })),
        "{refused:?}"
    );
    let stopped = solve_matrix(
        &scene,
        &RayTree::new(&scene),
        &MatrixSettings::default(),
        &|| true,
    );
    assert_eq!(stopped, Err(MatrixError::Cancelled));
}

#[test]
fn path_tracing_of_a_furnace_is_uniform() {
    for (reflectance, samples) in [(0.5, 128), (0.9, 256)] {
        let mut room = Plates::default();
        let wall = room.material(reflectance, 1.0 / PI);
        room.room(3, [wall; 6]);
        let scene = Arc::new(room.finish(Sides::One));
        let rays = Arc::new(RayTree::new(&scene));
        let settings = PathSettings {
            point_count: 300,
            samples_per_pass: samples,
            seed: 1,
        };
        let mut tracer = PathTracer::new(scene, rays, settings);
        assert!(tracer.pass(&never));
        let result = tracer.result();
        let expected = analytic::furnace_radiosity(1.0, f64::from(reflectance));
        let count = result.points.len() as f64;
        let mean = result
            .points
            .iter()
            .map(|p| f64::from(p.irradiance.y))
            .sum::<f64>()
            / count;
        let variance: f64 = result
            .points
            .iter()
            .map(|p| f64::from(p.irradiance_error).powi(2))
            .sum();
        let sigma = variance.sqrt() / count;
        // Four standard errors, and no more noise than would let a leak of half a percent pass.
        assert!(
            (mean - expected).abs() < 4.0 * sigma,
            "{mean} ± {sigma} for {expected}"
        );
        assert!(sigma < 0.005 * expected, "{sigma}");
    }
}

#[test]
fn path_tracing_gives_the_irradiance_between_plates() {
    let scene = parallel(1);
    let rays = RayTree::new(&scene);
    // The centre of the lower plate, in frame units, and the upper one in four quarters around it.
    let centre = Vec3::from((scene.frame.from_world(DVec3::new(0.5, 0.5, 0.0))).to_array());
    let point = BakePoint {
        position: centre,
        normal: Vec3::Z,
        triangle: TriangleId(0),
    };
    let expected = 4.0 * analytic::point_to_parallel_rectangle(0.5, 0.5, 1.0);
    let baked = bake(&scene, &rays, &[point; 64], 256, 3, &never).unwrap();
    let mean = baked.iter().map(|e| f64::from(e.x)).sum::<f64>() / 64.0;
    // 16,384 samples whose scatter is below the mean itself: 3 standard errors are below 2.5 %; stratified, far less.
    assert_close(mean, expected, 0.01, "mean");
}

#[test]
fn a_vertex_in_a_corner_stays_inside_its_room() {
    // Baked in the very corner of a furnace, where rays from the vertex itself would slip behind the walls.
    let mut room = Plates::default();
    let wall = room.material(0.5, 1.0 / PI);
    room.room(2, [wall; 6]);
    let scene = room.finish(Sides::One);
    let rays = RayTree::new(&scene);
    let points: Vec<BakePoint> = scene
        .triangle_ids()
        .map(|triangle| BakePoint {
            position: scene.corners(triangle)[0],
            normal: scene.surfaces[triangle.index()]
                .area_vector
                .normalize_or_zero(),
            triangle,
        })
        .collect();
    let baked = bake(&scene, &rays, &points, 256, 5, &never).unwrap();
    let mean = baked.iter().map(|e| f64::from(e.x)).sum::<f64>() / points.len() as f64;
    assert!((mean - 2.0).abs() < 0.03, "{mean}");
}
