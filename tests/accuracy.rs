//! Errors of built-in scenes against path tracing, held close to what was measured.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::sync::Arc;

use common::solve;
use vecrad::{
    geometry::RayTree,
    metrics::{ErrorMeasures, MeshLookup, measure_error},
    reference::{PathSettings, PathTracer},
    scene::{SceneOptions, Sides, builtin},
    solver::SolveSettings,
};

/// Points of the reference, and samples of each: noise of 3 % of each value, which is taken out.
const POINTS: u32 = 2000;
const SAMPLES: u32 = 256;

/// Measured errors may grow by this factor.
const SLACK: f64 = 1.5;

/// Share by which energy may be off beyond what was measured.
const ENERGY_SLACK: f64 = 2e-3;

/// What was measured: at `normal` the trimmed error by 4,000 points of 512 samples, whose noise is less.
struct Measured {
    trimmed: f64,
    energy: f64,
}

fn errors(name: &str, settings: SolveSettings) -> ErrorMeasures {
    let options = SceneOptions::with_sides(Sides::One);
    let scene = Arc::new(builtin::builtin(name, &options).unwrap().unwrap());
    let settings_of_truth = PathSettings {
        point_count: POINTS,
        samples_per_pass: SAMPLES,
        seed: 5,
    };
    let rays = Arc::new(RayTree::new(&scene));
    let mut tracer = PathTracer::new(scene.clone(), rays, settings_of_truth);
    assert!(tracer.pass(&|| false));
    let points = tracer.result().points;
    let snapshot = solve(&scene, settings).0.snapshot();
    let values = MeshLookup::new(&scene, &snapshot.mesh).radiance(&snapshot.light, &points);
    measure_error(&values, &points).unwrap()
}

fn assert_as_measured(name: &str, settings: SolveSettings, measured: &Measured) {
    let found = errors(name, settings);
    let energy = found.energy_ratio.unwrap();
    println!(
        "{name}: trimmed {:.4}, energy {:.4}, noise {:.4}",
        found.relative_rms_trimmed, energy, found.noise_floor
    );
    assert!(
        found.relative_rms_trimmed < SLACK * measured.trimmed,
        "{name}: {found:?}"
    );
    let off = (energy - 1.0).abs();
    assert!(
        off < (measured.energy - 1.0).abs() + ENERGY_SLACK,
        "{name}: {found:?}"
    );
}

#[test]
fn rooms_are_lit_as_well_as_measured_at_normal() {
    for (name, trimmed, energy) in [
        ("cornell", 0.0065, 1.0006),
        ("room-1022", 0.0124, 1.0035),
        ("room-8621", 0.0122, 1.0036),
        ("room-42879", 0.0135, 1.0061),
        ("tiled-room", 0.0067, 1.0016),
    ] {
        let measured = Measured { trimmed, energy };
        assert_as_measured(name, SolveSettings::normal(), &measured);
    }
}

#[test]
fn fine_scenes_are_lit_as_well_as_measured_at_draft() {
    for (name, trimmed, energy) in [("gallery", 0.0528, 1.0190), ("soup", 0.0623, 1.0459)] {
        let measured = Measured { trimmed, energy };
        assert_as_measured(name, SolveSettings::draft(), &measured);
    }
}
