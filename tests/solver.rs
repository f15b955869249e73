//! The solver against closed forms and against its own promises.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::{f32::consts::PI, sync::Arc};

use common::{assert_close, finish, prepare, step_to_end};
use glam::Vec3;
use vecrad::{
    geometry::{RayTree, area_vector},
    metrics::{ErrorMeasures, MeshLookup, measure_error},
    reference::{PathSettings, PathTraced, PathTracer},
    scene::{Scene, SceneBuilder, SceneOptions, Sides, builtin},
    solver::{
        Cancel, Direct, Method, Note, Oracle, Phase, Push, Snapshot, SolveSettings, Solver,
        StepReport,
    },
};

fn scene(name: &str) -> Arc<Scene> {
    Arc::new(
        builtin::builtin(name, &SceneOptions::with_sides(Sides::One))
            .unwrap()
            .unwrap(),
    )
}

/// All steps of a solve; each state is checked.
fn solve(scene: &Arc<Scene>, settings: SolveSettings) -> Snapshot {
    let mut solver = prepare(scene, settings);
    step_to_end(&mut solver, |solver, _| {
        solver.hierarchy().validate().unwrap();
        solver.links().validate(solver.hierarchy()).unwrap();
        assert_presentable(&solver.snapshot());
    });
    solver.snapshot()
}

fn assert_presentable(snapshot: &Snapshot) {
    let light = &snapshot.light;
    let is_good = |value: &Vec3| value.is_finite() && value.min_element() >= 0.0;
    assert!(light.irradiance.iter().all(is_good) && light.direct.iter().all(is_good));
    assert_eq!(light.irradiance.len(), snapshot.mesh.positions.len());
}

/// Area-weighted mean irradiance (red) over the display triangles of materials that `counts`.
fn mean_irradiance(scene: &Scene, snapshot: &Snapshot, counts: impl Fn(&str) -> bool) -> f64 {
    let (mut sum, mut whole) = (0.0, 0.0);
    let mesh = &snapshot.mesh;
    for (index, vertices) in mesh.indices.iter().enumerate() {
        let triangle = vecrad::scene::TriangleId(mesh.triangle_of[index]);
        if counts(&scene.material(triangle).name) {
            let corners = vertices.map(|vertex| mesh.positions[vertex as usize]);
            let area = f64::from(area_vector(corners).length());
            let light: f32 = vertices
                .iter()
                .map(|&vertex| snapshot.light.irradiance[vertex as usize].x)
                .sum();
            sum += area * f64::from(light) / 3.0;
            whole += area;
        }
    }
    sum / whole
}

/// Form factor from the receiving plate to the emitting one, as the solver lights it.
fn plates_form_factor(builder: SceneBuilder, direct: Direct) -> f64 {
    let scene = finish(builder, Sides::One);
    let settings = SolveSettings {
        direct,
        epsilon: 0.002,
        ..SolveSettings::normal()
    };
    let snapshot = solve(&scene, settings);
    let emitted = scene
        .materials
        .iter()
        .map(|m| m.emission.x)
        .fold(0.0, f32::max);
    let is_receiver = |name: &str| {
        let material = scene
            .materials
            .iter()
            .find(|material| material.name == name);
        material.is_some_and(|material| material.emission == Vec3::ZERO)
    };
    mean_irradiance(&scene, &snapshot, is_receiver) / f64::from(PI * emitted)
}

#[test]
fn plates_have_their_closed_form_factors_sampled_and_linked() {
    // Unit squares face to face at distance 1, and at right angles with a common edge (Howell's catalogue, C-11, C-14).
    const PARALLEL: f64 = 0.199_825;
    const PERPENDICULAR: f64 = 0.200_044;
    for direct in [Direct::Sampled, Direct::Linked] {
        let parallel = plates_form_factor(builtin::plates(1.0), direct);
        assert_close(parallel, PARALLEL, 0.005, format_args!("{direct:?}"));
        let perpendicular = plates_form_factor(builtin::perpendicular_plates(), direct);
        assert_close(
            perpendicular,
            PERPENDICULAR,
            0.005,
            format_args!("{direct:?}"),
        );
    }
}

#[test]
fn a_furnace_has_radiosity_emission_over_one_minus_reflectance() {
    for (reflectance, direct) in [
        (0.5f32, Direct::Sampled),
        (0.9, Direct::Sampled),
        (0.5, Direct::Linked),
        (0.9, Direct::Linked),
    ] {
        let scene = finish(builtin::furnace(reflectance, 1.0, 4), Sides::One);
        let settings = SolveSettings {
            direct,
            tolerance: 1e-4,
            ..SolveSettings::normal()
        };
        let snapshot = solve(&scene, settings);
        // B = E_m / (1 − ρ) and B = E_m + ρ E, with the exitance E_m = π.
        let expected = f64::from(PI) / (1.0 - f64::from(reflectance));
        let found = mean_irradiance(&scene, &snapshot, |_| true);
        assert_close(
            found,
            expected,
            0.005,
            format_args!("ρ {reflectance} {direct:?}"),
        );
    }
}

/// All reports of a solve of a furnace of radiance 1, and its mean irradiance relative to the closed form.
fn solve_furnace(
    builder: SceneBuilder,
    reflectance: f32,
    settings: &SolveSettings,
) -> (Vec<StepReport>, f64) {
    let options = SceneOptions {
        max_reflectance: 0.9999,
        ..SceneOptions::with_sides(Sides::One)
    };
    let scene = Arc::new(builder.finish(&options).unwrap());
    let mut solver = prepare(&scene, settings.clone());
    let mut reports: Vec<StepReport> = Vec::new();
    step_to_end(&mut solver, |solver, report| {
        reports.push(report.clone());
        assert_presentable(&solver.snapshot());
    });
    let expected = f64::from(PI) / (1.0 - f64::from(reflectance));
    let found = mean_irradiance(&scene, &solver.snapshot(), |_| true);
    (reports, found / expected)
}

#[test]
fn white_furnaces_converge_in_few_sweeps() {
    // Single precision resolves 6e-8, which 1 / (1 − ρ) amplifies, and the tolerance is 1e-4.
    for (reflectance, tolerance) in [
        (0.5, 1e-3),
        (0.9, 1e-3),
        (0.98, 1e-3),
        (0.999, 2e-3),
        (0.9999, 1e-2),
    ] {
        let settings = SolveSettings {
            direct: Direct::Linked,
            tolerance: 1e-4,
            max_steps: 2,
            ..SolveSettings::normal()
        };
        let (reports, ratio) = solve_furnace(
            builtin::furnace(reflectance, 1.0, 4),
            reflectance,
            &settings,
        );
        assert_close(
            ratio,
            1.0,
            tolerance,
            format_args!("ρ {reflectance} {reports:?}"),
        );
        for report in reports {
            assert!(report.sweeps <= 40 && report.residual <= 1e-4, "{report:?}");
            assert_close(report.energy_balance, 1.0, 1e-3, format_args!("{report:?}"));
            assert!(report.contraction < 1.0, "{report:?}");
        }
    }
}

#[test]
fn growth_at_coarse_links_is_named_and_held() {
    for (method, grows) in [(Method::SixFace, true), (Method::Bounded, false)] {
        let settings = SolveSettings {
            method,
            push: Push::AtOnce,
            direct: Direct::Linked,
            epsilon: 0.05,
            max_steps: 1,
            ..SolveSettings::normal()
        };
        let (reports, ratio) =
            solve_furnace(builtin::sphere_furnace(0.98, 1.0, 14), 0.98, &settings);
        let report = &reports[0];
        let is_named = report
            .notes
            .iter()
            .any(|note| matches!(note, Note::CoarseLinks { .. }));
        assert_eq!(is_named, grows, "{method:?}: {report:?}");
        assert_close(ratio, 1.0, 1e-2, format_args!("{method:?}"));
    }
}

#[test]
fn scaling_a_scene_leaves_irradiance_unchanged() {
    let settings = SolveSettings::draft();
    let original = solve(&scene("cornell"), settings.clone());
    let mut builder = builtin::find_builtin("cornell").unwrap().builder();
    for position in &mut builder.positions {
        // A power of two, so that rounding is the same.
        *position *= 1024.0;
    }
    let scaled = solve(&finish(builder, Sides::One), settings);
    assert_eq!(
        original.light.irradiance.len(),
        scaled.light.irradiance.len()
    );
    for (a, b) in original
        .light
        .irradiance
        .iter()
        .zip(&scaled.light.irradiance)
    {
        assert!(a.abs_diff_eq(*b, 1e-4 * a.max_element()), "{a} {b}");
    }
}

#[test]
fn every_method_oracle_and_push_stays_presentable() {
    let scene = scene("cornell");
    let draft = SolveSettings::draft();
    for method in [
        Method::Bounded,
        Method::SixFace,
        Method::Single,
        Method::Exact,
        Method::Isotropic,
    ] {
        let push = if method == Method::SixFace {
            Push::AtOnce
        } else {
            Push::Combined
        };
        for oracle in [Oracle::Interval, Oracle::Samples] {
            solve(
                &scene,
                SolveSettings {
                    method,
                    oracle,
                    push,
                    ..draft.clone()
                },
            );
        }
    }
}

fn truth(scene: &Arc<Scene>) -> PathTraced {
    let rays = Arc::new(RayTree::new(scene));
    let settings = PathSettings {
        point_count: 600,
        samples_per_pass: 128,
        ..PathSettings::default()
    };
    let mut tracer = PathTracer::new(scene.clone(), rays, settings);
    assert!(tracer.pass(&|| false));
    tracer.result()
}

fn errors(scene: &Scene, snapshot: &Snapshot, truth: &PathTraced) -> ErrorMeasures {
    let values = MeshLookup::new(scene, &snapshot.mesh).radiance(&snapshot.light, &truth.points);
    measure_error(&values, &truth.points).unwrap()
}

#[test]
fn error_falls_as_the_threshold_falls() {
    let scene = scene("room-1022");
    let truth = truth(&scene);
    // Sums over all patches cost too much for the smallest threshold.
    let least = [
        (Method::Bounded, 0.01),
        (Method::SixFace, 0.01),
        (Method::Exact, 0.03),
    ];
    for (method, least) in least {
        let found = [16.0 * least, 4.0 * least, least].map(|epsilon| {
            let settings = SolveSettings {
                method,
                epsilon,
                max_steps: 3,
                ..SolveSettings::normal()
            };
            let mut solver =
                Solver::new(scene.clone(), settings, None, &Cancel::default()).unwrap();
            let [_, by_links, last] = [(); 3].map(|()| {
                solver.step(&Cancel::default()).unwrap();
                errors(&scene, &solver.snapshot(), &truth)
            });
            [by_links, last]
        });
        let by_links = found
            .each_ref()
            .map(|[by_links, _]| by_links.relative_rms_trimmed);
        assert!(
            by_links.is_sorted_by(|a, b| a > b),
            "{method:?}: {by_links:?}"
        );
        // In the last step the final gather makes up for links, so that the threshold matters less.
        for pair in found.windows(2) {
            let [[_, coarse], [_, fine]] = [&pair[0], &pair[1]];
            assert!(
                fine.relative_rms_trimmed < coarse.relative_rms_trimmed + fine.noise_floor
                    && fine.relative_rms_trimmed < by_links[2],
                "{method:?}: {coarse:?} became {fine:?}"
            );
        }
    }
}

#[test]
fn a_scene_without_emitters_is_black() {
    let mut builder = builtin::plates(1.0);
    for material in &mut builder.materials {
        material.emission = Vec3::ZERO;
    }
    let snapshot = solve(&finish(builder, Sides::One), SolveSettings::draft());
    assert!(
        snapshot
            .light
            .irradiance
            .iter()
            .all(|light| *light == Vec3::ZERO)
    );
}

#[test]
fn a_memory_limit_holds_and_keeps_what_fits() {
    let settings = SolveSettings {
        epsilon: 0.0,
        min_area: 0.0,
        max_steps: 6,
        ..SolveSettings::normal()
    };
    let scene = scene("room-1022");
    for mebibytes in [2, 6, 16] {
        let limit = mebibytes << 20;
        let solve = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            pool.build().unwrap().install(|| {
                let never = Cancel::default();
                let mut solver =
                    Solver::new(scene.clone(), settings.clone(), Some(limit), &never).unwrap();
                loop {
                    let report = solver.step(&never).unwrap();
                    assert!(report.memory_bytes <= limit, "{mebibytes} MiB: {report:?}");
                    assert_presentable(&solver.snapshot());
                    solver.links().validate(solver.hierarchy()).unwrap();
                    if report.is_final {
                        return (report, solver.snapshot().light);
                    }
                }
            })
        };
        let (report, light) = solve(1);
        assert!(report.is_full && report.links > 0, "{report:?}");
        assert!(report.notes.contains(&Note::MemoryLimit));
        assert!(
            light
                .irradiance
                .iter()
                .any(|light| light.min_element() > 0.0)
        );
        let (other_report, other_light) = solve(3);
        assert_eq!(report, other_report);
        assert!(light == other_light, "{mebibytes} MiB");
    }
}

#[test]
fn a_cancelled_preparation_gives_nothing() {
    let cancel = Cancel::default();
    cancel.cancel();
    let solver = Solver::new(scene("cornell"), SolveSettings::draft(), None, &cancel);
    assert!(solver.is_none());
}

#[test]
fn a_cancelled_step_leaves_the_last_light() {
    let mut solver = Solver::new(
        scene("cornell"),
        SolveSettings::draft(),
        None,
        &Cancel::default(),
    )
    .unwrap();
    solver.step(&Cancel::default()).unwrap();
    let before = solver.snapshot();
    let cancel = Cancel::default();
    cancel.cancel();
    assert!(solver.step(&cancel).is_none());
    assert_eq!(before.light, solver.snapshot().light);
}

#[test]
fn a_step_that_is_cancelled_in_any_phase_can_be_repeated() {
    for cancelled in Phase::ALL {
        let mut solver = prepare(&scene("cornell"), SolveSettings::draft());
        solver.step(&Cancel::default()).unwrap();
        let cancel = Cancel::default();
        let found = solver.step_in_phases(&cancel, &mut |phase, _| {
            if phase == cancelled {
                cancel.cancel();
            }
        });
        // Only the last step gathers by rays.
        assert_eq!(found.is_some(), cancelled == Phase::FinalGather);
        step_to_end(&mut solver, |solver, _| {
            solver.hierarchy().validate().unwrap();
            solver.links().validate(solver.hierarchy()).unwrap();
            assert_presentable(&solver.snapshot());
        });
    }
}

#[test]
fn the_light_of_a_step_is_finished_wherever_the_next_one_was_cancelled() {
    let never = Cancel::default();
    let after_a_step = || {
        let mut solver = prepare(&scene("cornell"), SolveSettings::draft());
        assert_eq!(solver.finish(&never), None, "there is no step yet");
        solver.step(&never).unwrap();
        solver
    };
    let mean = |solver: &Solver| mean_irradiance(solver.scene(), &solver.snapshot(), |_| true);
    let mut expected = after_a_step();
    let rough = mean(&expected);
    let report = expected.finish(&never).unwrap();
    assert!(report.step == 1 && !report.is_final);
    let expected = mean(&expected);
    assert!(rough != expected, "rays change the light");
    let unfinished = [
        Phase::Direct,
        Phase::Refine,
        Phase::Iterate,
        Phase::Gather,
        Phase::Display,
    ];
    for cancelled in unfinished {
        let mut solver = after_a_step();
        let cancel = Cancel::default();
        let found = solver.step_in_phases(&cancel, &mut |phase, _| {
            if phase == cancelled {
                cancel.cancel();
            }
        });
        assert!(found.is_none());
        let report = solver.finish(&never).unwrap();
        assert!(report.step == 1 && !report.is_final, "{cancelled:?}");
        assert_presentable(&solver.snapshot());
        let ratio = mean(&solver) / expected;
        assert!((ratio - 1.0).abs() < 0.03, "{ratio} after {cancelled:?}");
        let last = step_to_end(&mut solver, |_, _| ());
        assert_eq!(last.step, 3);
    }
}

#[test]
fn a_step_tells_its_phases_in_order_with_the_rays_shot_so_far() {
    let cancel = Cancel::default();
    let mut solver = prepare(&scene("cornell"), SolveSettings::draft());
    let mut rays_before = 0;
    loop {
        let mut phases = Vec::new();
        let report = solver.step_in_phases(&cancel, &mut |phase, rays| {
            assert!(rays >= rays_before, "{phase:?}: {rays}");
            rays_before = rays;
            phases.push(phase);
        });
        let report = report.unwrap();
        assert_eq!(report.shadow_rays, rays_before);
        // Figures and mesh are one phase.
        phases.dedup();
        let mut expected = Phase::ALL.to_vec();
        expected.retain(|&phase| report.is_final || phase != Phase::FinalGather);
        assert_eq!(phases, expected);
        if report.is_final {
            break;
        }
    }
}
