//! The progress line on standard error: figures that are known, and what time the error that is asked for may take by them.

use std::{
    io::{self, IsTerminal as _, Write as _},
    time::{Duration, Instant},
};

use super::output::say;
use crate::{
    metrics::{Expected, Pace, about},
    solver::StepReport,
};

/// Time between lines where standard error is not a terminal.
const BETWEEN_LINES: Duration = Duration::from_secs(1);

/// Writes progress, unless it is quiet.
pub(super) struct Progress {
    is_terminal: bool,
    quiet: bool,
    begin: Instant,
    last_line: Option<Instant>,
    step: String,
    /// The error that is asked for, and the pace towards it.
    aim: Option<(f32, Pace)>,
}

impl Progress {
    /// Progress of what begins now.
    pub(super) fn new(quiet: bool) -> Self {
        Self {
            is_terminal: io::stderr().is_terminal(),
            quiet,
            begin: Instant::now(),
            last_line: None,
            step: "preparing".to_owned(),
            aim: None,
        }
    }

    /// The solver is ready, after so many seconds, to refine until the error is that small, if one is asked for.
    pub(super) fn prepared(&mut self, seconds: f64, error: Option<f32>) {
        self.aim = error.map(|error| (error, Pace::new(seconds)));
    }

    /// A step is done.
    pub(super) fn stepped(&mut self, report: &StepReport) {
        let error = report
            .estimated_error
            .map_or_else(String::new, |error| format!(", error {}", error.text()));
        let left = self.left(report).unwrap_or_default();
        self.step = format!(
            "step {}{error}{left}, ε {:.4}, {} links, residual {:.1e}",
            report.step, report.epsilon, report.links, report.residual
        );
        self.show();
    }

    /// About how long it still takes to the error that is asked for.
    fn left(&mut self, report: &StepReport) -> Option<String> {
        let (wanted, pace) = self.aim.as_mut()?;
        pace.note(report);
        let wanted = f64::from(*wanted);
        let Expected::After(seconds) = pace.to(wanted).filter(|_| !report.is_final)? else {
            return None;
        };
        let percent = (1e4 * wanted).round() / 100.0;
        let left = about(seconds - report.elapsed_s);
        Some(format!(", about {left} to {percent} %"))
    }

    /// Something else goes on.
    pub(super) fn say(&mut self, text: String) {
        self.step = text;
        self.show();
    }

    /// Time has passed.
    pub(super) fn show(&mut self) {
        if self.quiet {
            return;
        }
        let line = format!("{}, {:.1} s", self.step, self.begin.elapsed().as_secs_f64());
        if self.is_terminal {
            // Progress that cannot be shown is no reason to stop.
            let _ = write!(io::stderr(), "\r\x1b[K{line}").and_then(|()| io::stderr().flush());
        } else if self
            .last_line
            .is_none_or(|last| last.elapsed() >= BETWEEN_LINES)
        {
            say(line);
            self.last_line = Some(Instant::now());
        }
    }

    /// The last line.
    pub(super) fn finish(&mut self) {
        self.last_line = None;
        self.show();
        if self.is_terminal && !self.quiet {
            say("");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::EstimatedError;

    /// The line after a step.
    fn line(progress: &mut Progress, elapsed_s: f64, trimmed_high: f64) -> String {
        progress.stepped(&StepReport {
            elapsed_s,
            estimated_error: Some(EstimatedError {
                trimmed_high,
                ..EstimatedError::default()
            }),
            ..StepReport::default()
        });
        progress.step.clone()
    }

    #[test]
    fn the_time_that_is_left_is_told_until_the_error_is_reached() {
        let mut progress = Progress::new(true);
        let text = line(&mut progress, 0.5, 0.16);
        assert!(!text.contains("about"), "no error is asked for: {text}");
        progress.prepared(0.0, Some(0.02));
        // An eighth of the error takes 64 times as long.
        for (elapsed_s, error) in [(0.5, 0.16), (2.0, 0.08)] {
            let text = line(&mut progress, elapsed_s, error);
            assert!(text.contains(", about 30 s to 2 %"), "{text}");
        }
        let text = line(&mut progress, 30.0, 0.015);
        assert!(!text.contains("about"), "{text}");
    }
}
