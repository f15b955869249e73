//! Runs of the worker as error over time, for tables and plots.

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_keeps_its_figures() {
        let report = StepReport {
            step: 3,
            elapsed_s: 9.0,
            solve_s: 2.5,
            epsilon: 0.02,
            links: 7,
            elements: 5,
            shadow_rays: 11,
            memory_bytes: 13,
            ..StepReport::default()
        };
        let error = ErrorMeasures {
            relative_rms: 0.25,
            ..ErrorMeasures::default()
        };
        let settings = SolveSettings::draft();
        let run = trajectory("a".to_owned(), settings, false, [(&report, &error)]);
        assert_eq!(run.runner, Runner::Solver);
        let [point] = &run.points[..] else {
            panic!("one step, {} points", run.points.len())
        };
        // Time is that of computing: pauses and measuring do not count.
        assert_eq!((point.step, point.time_s), (3, 2.5));
        assert_eq!((point.links, point.elements, point.rays), (7, 5, 11));
        assert_eq!((point.memory_bytes, point.epsilon), (13, Some(0.02)));
        assert_eq!(point.error.relative_rms, 0.25);
    }
}
