//! The estimated error of a step beside the measured one, and solves that end by it.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::{collections::BTreeMap, sync::Arc};

use common::{prepare, solve, step_to_end};
use vecrad::{
    geometry::RayTree,
    metrics::{ErrorMap, ErrorMeasures, MeshLookup, measure_error},
    reference::{PathSettings, PathTracer, ReferencePoint},
    scene::{Scene, SceneOptions, Sides, builtin, luminance},
    solver::{Cancel, Note, Obstacle, Snapshot, SolveSettings, Solver},
};

struct Truth {
    scene: Arc<Scene>,
    points: Vec<ReferencePoint>,
}

impl Truth {
    fn of(name: &str) -> Self {
        let options = SceneOptions::with_sides(Sides::One);
        let scene = Arc::new(builtin::builtin(name, &options).unwrap().unwrap());
        let settings = PathSettings {
            point_count: 2000,
            samples_per_pass: 128,
            seed: 5,
        };
        let rays = Arc::new(RayTree::new(&scene));
        let mut tracer = PathTracer::new(scene.clone(), rays, settings);
        assert!(tracer.pass(&|| false));
        let points = tracer.result().points;
        Self { scene, points }
    }

    fn error(&self, snapshot: &Snapshot) -> ErrorMeasures {
        let lookup = MeshLookup::new(&self.scene, &snapshot.mesh);
        measure_error(
            &lookup.radiance(&snapshot.light, &self.points),
            &self.points,
        )
        .unwrap()
    }
}

/// What both intervals may miss: the reference has noise and a sample of points of its own.
const SLACK: f64 = 0.25;

#[test]
fn the_interval_holds_the_measured_error_in_nearly_all_steps() {
    let (mut steps, mut held) = (0, 0);
    for name in ["cornell", "room-1022", "tiled-room"] {
        let truth = Truth::of(name);
        let mut solver = prepare(&truth.scene, SolveSettings::draft());
        step_to_end(&mut solver, |solver, report| {
            let measured = truth.error(&solver.snapshot());
            let estimated = report.estimated_error.unwrap();
            let trimmed = measured.relative_rms_trimmed;
            let is_held = trimmed >= (1.0 - SLACK) * estimated.trimmed_low
                && trimmed <= (1.0 + SLACK) * estimated.trimmed_high;
            (steps, held) = (steps + 1, held + u32::from(is_held));
            let energy = measured.energy_ratio.unwrap();
            let interval = estimated.energy_low - 0.02..estimated.energy_high + 0.02;
            assert!(interval.contains(&energy), "{name}: {energy} {estimated:?}");
        });
    }
    assert!(10 * held >= 9 * steps, "{held} of {steps}");
}

#[test]
fn the_map_is_red_where_light_is_too_bright_and_blue_where_it_is_too_dark() {
    for name in ["cornell", "room-8621"] {
        let truth = Truth::of(name);
        let mut solver = prepare(&truth.scene, SolveSettings::draft());
        solver.step(&Cancel::default()).unwrap();
        let snapshot = solver.snapshot();
        let map = ErrorMap::new(&snapshot.errors);
        let lookup = MeshLookup::new(&truth.scene, &snapshot.mesh);
        let shown = lookup.radiance(&snapshot.light, &truth.points);
        // Measured errors by the error that the map shows, which is the same over a part of the surfaces.
        let mut parts: BTreeMap<u32, Vec<f32>> = BTreeMap::new();
        for (point, shown) in truth.points.iter().zip(shown) {
            let error = luminance(shown.unwrap()) - luminance(point.radiance());
            let mapped = map.at(point.position, point.normal).error;
            parts.entry(mapped.to_bits()).or_default().push(error);
        }
        let (mut told, mut agreed) = (0, 0);
        for (mapped, errors) in parts {
            let mapped = f32::from_bits(mapped);
            if mapped.abs() > 0.005 {
                let is_alike = mapped * errors.iter().sum::<f32>() > 0.0;
                told += errors.len();
                agreed += if is_alike { errors.len() } else { 0 };
            }
        }
        assert!(5 * told > truth.points.len(), "{name}: {told}");
        assert!(10 * agreed >= 8 * told, "{name}: {agreed} of {told}");
    }
}

#[test]
fn a_solve_ends_where_the_error_is_as_small_as_asked_for() {
    let truth = Truth::of("room-1022");
    let mut before = 0;
    for wanted in [0.1_f32, 0.03] {
        let (solver, report) = solve(&truth.scene, SolveSettings::towards(wanted));
        let estimated = report.estimated_error.unwrap();
        assert!(estimated.trimmed_high <= f64::from(wanted), "{estimated:?}");
        assert!(report.notes.is_empty(), "{:?}", report.notes);
        let error = truth.error(&solver.snapshot()).relative_rms_trimmed;
        assert!(error <= 1.1 * f64::from(wanted), "{wanted}: {error}");
        assert!(report.step > before, "a smaller error takes more steps");
        before = report.step;
    }
}

#[test]
fn what_prevents_a_smaller_error_is_named() {
    let scene = Truth::of("cornell").scene;
    let settings = SolveSettings::towards(1e-4);
    let limit = Some(40 << 20);
    let mut solver = Solver::new(scene.clone(), settings, limit, &Cancel::default()).unwrap();
    let report = step_to_end(&mut solver, |_, _| {});
    let of = |note: &Note| match note {
        Note::ErrorNotReached { obstacle, .. } => Some(*obstacle),
        _ => None,
    };
    let obstacles: Vec<Obstacle> = report.notes.iter().filter_map(of).collect();
    assert_eq!(obstacles, [Obstacle::Memory], "{:?}", report.notes);
}

#[test]
fn estimates_are_the_same_on_any_number_of_threads() {
    let scene = Truth::of("room-1022").scene;
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = pool.build().unwrap();
        pool.install(|| solve(&scene, SolveSettings::draft()).1)
    };
    assert_eq!(on(1).estimated_error, on(3).estimated_error);
}
