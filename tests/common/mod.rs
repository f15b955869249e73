//! Helpers of tests of light: finished scenes, whole solves, and one measure of closeness.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(dead_code, reason = "each test uses some of it")]

use std::{fmt::Display, sync::Arc};

use vecrad::{
    scene::{Scene, SceneBuilder, SceneOptions, Sides},
    solver::{Cancel, SolveSettings, Solver, StepReport},
};

/// The scene of a builder whose faces are usable.
pub(crate) fn finish(builder: SceneBuilder, sides: Sides) -> Arc<Scene> {
    Arc::new(builder.finish(&SceneOptions::with_sides(sides)).unwrap())
}

/// A solver before its first step.
pub(crate) fn prepare(scene: &Arc<Scene>, settings: SolveSettings) -> Solver {
    Solver::new(scene.clone(), settings, None, &Cancel::default()).unwrap()
}

/// A solver after its last step, and the report of that step.
pub(crate) fn solve(scene: &Arc<Scene>, settings: SolveSettings) -> (Solver, StepReport) {
    let mut solver = prepare(scene, settings);
    let report = step_to_end(&mut solver, |_, _| {});
    (solver, report)
}

/// As [`solve`], with the hierarchy and the links validated after each step.
pub(crate) fn solve_validated(scene: &Arc<Scene>, settings: SolveSettings) -> (Solver, StepReport) {
    let mut solver = prepare(scene, settings);
    let report = step_to_end(&mut solver, |solver, _| {
        solver.hierarchy().validate().unwrap();
        solver.links().validate(solver.hierarchy()).unwrap();
    });
    (solver, report)
}

/// Step until the settings ask for no more, call `after` with each state, and return the last report.
pub(crate) fn step_to_end(
    solver: &mut Solver,
    mut after: impl FnMut(&Solver, &StepReport),
) -> StepReport {
    loop {
        let report = solver.step(&Cancel::default()).unwrap();
        after(solver, &report);
        if report.is_final {
            return report;
        }
    }
}

/// Fails unless `found` differs from `expected` by less than the share `relative` of it.
pub(crate) fn assert_close(
    found: impl Into<f64>,
    expected: impl Into<f64>,
    relative: f64,
    what: impl Display,
) {
    let (found, expected) = (found.into(), expected.into());
    assert!(
        (found - expected).abs() < relative * expected.abs(),
        "{what}: {found} instead of {expected}"
    );
}
