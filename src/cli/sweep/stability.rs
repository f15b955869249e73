//! The stability suite: stiff and extreme cases, each with what is known of its light.

use std::io::{self, Write};

use anyhow::Result;
use serde::Serialize;

use super::{
    session::Session,
    trials::{Trial, try_each},
};
use crate::{
    cli::{output::write_whole, report::Machine},
    experiments::stability::{Case, Outcome, Row, stability_cases, stability_markdown},
    export::write_csv,
    solver::Cancel,
};

/// Everything in `stability.json`.
#[derive(Serialize)]
struct Report<'a> {
    version: &'static str,
    machine: Machine,
    threads: usize,
    is_interrupted: bool,
    holds: usize,
    fails: usize,
    cases: &'a [Outcome],
}

impl Trial for Case {
    type Outcome = Outcome;

    fn name(&self) -> &str {
        &self.name
    }

    fn run(&self, cancel: &Cancel) -> Outcome {
        Self::run(self, cancel)
    }

    fn failed(&self, failure: String, seconds: f64) -> Outcome {
        Outcome::failed(self, failure, seconds)
    }

    fn holds(outcome: &Outcome) -> bool {
        outcome.holds()
    }
}

/// Try every case that is asked for, and write the files after each.
pub(super) fn try_cases(session: &mut Session<'_>) -> Result<()> {
    let is_meant = |case: &Case, word: &str| case.name.contains(word) || case.group.name() == word;
    let flags = &session.arguments.runs;
    let cases = flags.chosen(stability_cases(), is_meant, "case of the stability")?;
    try_each(session, &cases, write)
}

/// Write all files, each whole or not at all.
fn write(session: &Session<'_>, outcomes: &[Outcome]) -> Result<()> {
    let folder = &session.arguments.output;
    let holds = outcomes.iter().filter(|outcome| outcome.holds()).count();
    let report = Report {
        version: env!("CARGO_PKG_VERSION"),
        machine: Machine::present(),
        threads: session.thread_count(),
        is_interrupted: session.is_interrupted(),
        holds,
        fails: outcomes.len() - holds,
        cases: outcomes,
    };
    write_whole(&folder.join("stability.csv"), |out| {
        write_csv(outcomes.iter().flat_map(Row::of), out)
    })?;
    write_whole(&folder.join("stability.json"), |out| {
        serde_json::to_writer_pretty(&mut *out, &report)?;
        out.write_all(b"\n")
    })?;
    write_whole(&folder.join("stability.md"), |out| {
        write_markdown(&report, out)
    })
}

fn write_markdown(report: &Report<'_>, out: &mut dyn Write) -> io::Result<()> {
    let seconds: f64 = report.cases.iter().map(|outcome| outcome.seconds).sum();
    writeln!(
        out,
        "# Stability\n\n\
         vecrad {}, {}, {} threads.\n\
         {} cases hold and {} fail, in {seconds:.0} s.\n\
         Each line shows the figure of its case that comes nearest to failing; `stability.csv` has all of them.\n\
         Besides, all light of all steps is finite, not negative, and no more than the emitters can keep up.\n\n{}",
        report.version,
        report.machine.describe(),
        report.threads,
        report.holds,
        report.fails,
        stability_markdown(report.cases),
    )?;
    let noted = |outcome: &&Outcome| !outcome.finding.notes.is_empty();
    for outcome in report.cases.iter().filter(noted) {
        writeln!(out, "\n{}:", outcome.case)?;
        for note in &outcome.finding.notes {
            writeln!(out, "* {note}")?;
        }
    }
    Ok(())
}
