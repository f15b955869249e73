//! Errors of built-in scenes against path tracing, held close to what was measured.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod boxes;
mod common;

use std::sync::Arc;

use boxes::{cuboid, rectangle};
use common::{finish, prepare, solve, step_to_end};
use glam::{DVec3, Vec3};
use vecrad::{
    geometry::{Random, RayTree},
    metrics::{ErrorMeasures, MeshLookup, measure_error},
    reference::{PathSettings, PathTracer},
    scene::{Material, Scene, SceneBuilder, SceneOptions, Sides, builtin},
    solver::{Note, Snapshot, SolveSettings},
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
    errors_of(&scene, &solve(&scene, settings).0.snapshot())
}

fn errors_of(scene: &Arc<Scene>, snapshot: &Snapshot) -> ErrorMeasures {
    let settings_of_truth = PathSettings {
        point_count: POINTS,
        samples_per_pass: SAMPLES,
        seed: 5,
    };
    let rays = Arc::new(RayTree::new(scene));
    let mut tracer = PathTracer::new(scene.clone(), rays, settings_of_truth);
    assert!(tracer.pass(&|| false));
    let points = tracer.result().points;
    let values = MeshLookup::new(scene, &snapshot.mesh).radiance(&snapshot.light, &points);
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

/// A room with a lamp below its ceiling, and thin bars in all directions.
fn bars(count: u32) -> Arc<Scene> {
    let mut builder = SceneBuilder::default();
    let mut paint = |reflectance, emitted| {
        let [reflectance, emitted] = [reflectance, emitted].map(Vec3::splat);
        builder.push_material(Material::plain("", reflectance, emitted))
    };
    let (wall, bars, lamp) = (paint(0.5, 0.0), paint(0.3, 0.0), paint(0.0, 10.0));
    cuboid(
        &mut builder,
        DVec3::ZERO,
        DVec3::new(4.0, 3.0, 4.0),
        true,
        wall,
    );
    let corner = DVec3::new(1.5, 2.9, 1.5);
    rectangle(&mut builder, corner, [DVec3::X, DVec3::Z], lamp);
    let mut random = Random::new(7, 0);
    for bar in 0..count as usize {
        let mut size = DVec3::splat(0.03);
        size[bar % 3] = 2.0;
        let place = DVec3::from_array([(); 3].map(|()| f64::from(random.uniform())));
        let low = DVec3::splat(0.2) + place * (DVec3::new(3.6, 2.6, 3.6) - size);
        cuboid(&mut builder, low, low + size, false, bars);
    }
    finish(builder, Sides::One)
}

/// Half of the threshold of `normal` asks for several times as many links.
#[test]
fn links_in_clutter_stay_few_and_rays_do_as_well_as_finer_ones() {
    let scene = bars(80);
    let settings = SolveSettings {
        epsilon: 0.5 * SolveSettings::normal().epsilon,
        ..SolveSettings::normal()
    };
    let mut solver = prepare(&scene, settings);
    let report = step_to_end(&mut solver, |_, _| ());
    let is_limit = |note: &Note| matches!(note, Note::LinksLimited { .. });
    assert!(report.notes.iter().any(is_limit), "{:?}", report.notes);
    let links = report.links as f64 / report.nodes as f64;
    assert!(links < 16.0, "{links} links of a node");
    let found = errors_of(&scene, &solver.snapshot());
    assert!(found.relative_rms_trimmed < 0.02, "{found:?}");
    let energy = found.energy_ratio.unwrap();
    assert!((energy - 1.0).abs() < 0.01, "{found:?}");
}
