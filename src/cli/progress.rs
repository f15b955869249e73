//! The progress line on standard error: figures that are known, no guess of what is left.

use std::{
    io::{self, IsTerminal as _, Write as _},
    time::{Duration, Instant},
};

use super::output::say;
use crate::solver::StepReport;

/// Time between lines where standard error is not a terminal.
const BETWEEN_LINES: Duration = Duration::from_secs(1);

/// Writes progress, unless it is quiet.
pub(super) struct Progress {
    is_terminal: bool,
    quiet: bool,
    begin: Instant,
    last_line: Option<Instant>,
    step: String,
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
        }
    }

    /// A step is done.
    pub(super) fn stepped(&mut self, report: &StepReport) {
        let error = report
            .estimated_error
            .map_or_else(String::new, |error| format!(", error {}", error.text()));
        self.step = format!(
            "step {}{error}, ε {:.4}, {} links, residual {:.1e}",
            report.step, report.epsilon, report.links, report.residual
        );
        self.show();
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
