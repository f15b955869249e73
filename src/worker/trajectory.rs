//! Runs of the worker as error over time: what tables and plots are made of, in the window and without.

use crate::{
    metrics::{ErrorMeasures, Measurement, Runner, Trajectory},
    solver::{SolveSettings, StepReport},
};

/// A run of the solver with the steps that were measured, in order.
pub fn trajectory<'a>(
    label: String,
    settings: SolveSettings,
    is_cut_short: bool,
    steps: impl IntoIterator<Item = (&'a StepReport, &'a ErrorMeasures)>,
) -> Trajectory {
    let measured = steps
        .into_iter()
        .map(|(report, error)| measurement(report, error));
    Trajectory {
        label,
        runner: Runner::Solver,
        settings: Some(settings),
        repeats: 1,
        is_cut_short,
        points: measured.collect(),
    }
}

fn measurement(report: &StepReport, error: &ErrorMeasures) -> Measurement {
    Measurement {
        step: report.step,
        time_s: report.solve_s,
        epsilon: Some(report.epsilon),
        samples: None,
        rays: report.shadow_rays,
        links: report.links,
        elements: report.elements,
        memory_bytes: report.memory_bytes,
        error: error.clone(),
    }
}
