//! The suites of exact cases: light that is known in closed form.

use std::io::{self, Write};

use anyhow::Result;
use serde::Serialize;

use super::{
    session::Session,
    trials::{Trial, try_each},
};
use crate::{
    cli::{output::write_whole, report::Machine},
    experiments::{
        Claim,
        exact::{Case, Group, Outcome, Row, exact_cases, exact_markdown},
    },
    export::write_csv,
    solver::{Cancel, SolveSettings},
};

/// Everything in `exact.json`.
#[derive(Serialize)]
struct Report<'a> {
    version: &'static str,
    machine: Machine,
    threads: usize,
    settings: &'a SolveSettings,
    is_interrupted: bool,
    /// Figures that are met.
    holds: usize,
    fails: usize,
    cases: &'a [Outcome],
}

/// A case with the settings that it is solved with.
struct SetCase<'a> {
    case: Case,
    settings: &'a SolveSettings,
}

impl Trial for SetCase<'_> {
    type Outcome = Outcome;

    fn name(&self) -> &str {
        &self.case.name
    }

    fn run(&self, cancel: &Cancel) -> Outcome {
        self.case.run(self.settings, cancel)
    }

    fn failed(&self, failure: String, seconds: f64) -> Outcome {
        self.case.failed(failure, seconds)
    }

    fn holds(outcome: &Outcome) -> bool {
        outcome.holds()
    }
}

/// Try every case that is asked for, and write `exact.md`, `exact.csv` and `exact.json` after each.
pub(super) fn try_all(session: &mut Session<'_>) -> Result<()> {
    try_cases(session, "exact", exact_cases())
}

/// Try the cases of CIE 171:2006 that are asked for, and write `cie171.md`, `cie171.csv` and `cie171.json` after each.
pub(super) fn try_cie171(session: &mut Session<'_>) -> Result<()> {
    let mut cases = exact_cases();
    cases.retain(|case| case.group == Group::Cie171);
    try_cases(session, "cie171", cases)
}

fn try_cases(session: &mut Session<'_>, stem: &str, cases: Vec<Case>) -> Result<()> {
    let is_meant = |case: &Case, word: &str| case.name.contains(word) || case.group.name() == word;
    let flags = &session.arguments.runs;
    let chosen = flags.chosen(cases, is_meant, &format!("case of the {stem}"))?;
    let settings = session.arguments.setting_flags.settings();
    let cases: Vec<SetCase<'_>> = chosen
        .into_iter()
        .map(|case| SetCase {
            case,
            settings: &settings,
        })
        .collect();
    try_each(session, &cases, |session, outcomes| {
        write(session, stem, &settings, outcomes)
    })
}

/// Write all files, each whole or not at all.
fn write(
    session: &Session<'_>,
    stem: &str,
    settings: &SolveSettings,
    outcomes: &[Outcome],
) -> Result<()> {
    let path = |ending: &str| session.arguments.output.join(format!("{stem}.{ending}"));
    let claims: Vec<&Claim> = outcomes
        .iter()
        .flat_map(|outcome| &outcome.claims)
        .collect();
    let holds = claims.iter().filter(|claim| claim.holds()).count();
    let report = Report {
        version: env!("CARGO_PKG_VERSION"),
        machine: Machine::present(),
        threads: session.thread_count(),
        settings,
        is_interrupted: session.is_interrupted(),
        holds,
        fails: claims.len() - holds,
        cases: outcomes,
    };
    write_whole(&path("csv"), |out| {
        write_csv(outcomes.iter().flat_map(Row::of), out)
    })?;
    write_whole(&path("json"), |out| {
        serde_json::to_writer_pretty(&mut *out, &report)?;
        out.write_all(b"\n")
    })?;
    write_whole(&path("md"), |out| write_markdown(&report, out))
}

fn write_markdown(report: &Report<'_>, out: &mut dyn Write) -> io::Result<()> {
    let seconds: f64 = report.cases.iter().map(|outcome| outcome.seconds).sum();
    writeln!(
        out,
        "# Exact cases\n\n\
         vecrad {}, {}, {} threads.\n\
         {} figures hold and {} fail, in {seconds:.0} s.\n\
         Irradiance E in W/m² and radiance L in W·sr⁻¹·m⁻², each to be within {} % of what is expected, or of the largest \
         figure of its case where that is 0.\n\n{}",
        report.version,
        report.machine.describe(),
        report.threads,
        report.holds,
        report.fails,
        100.0 * report.settings.epsilon,
        exact_markdown(report.cases),
    )
}
