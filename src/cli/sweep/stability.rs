//! The stability suite: stiff and extreme cases, each with what is known of its light.

use std::{
    io::{self, Write},
    time::Instant,
};

use anyhow::{Result, bail};
use serde::Serialize;

use super::session::Session;
use crate::{
    cli::{output::write_whole, report::Machine},
    experiments::stability::{Case, Outcome, Row, stability_cases, stability_markdown},
    export::write_csv,
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

/// Try every case that is asked for, and write the files after each.
pub(super) fn try_cases(session: &mut Session<'_>) -> Result<()> {
    let is_meant = |case: &Case, word: &str| case.name.contains(word) || case.group.name() == word;
    let flags = &session.arguments.runs;
    let cases = flags.chosen(stability_cases(), is_meant, "case of the stability")?;
    let mut outcomes: Vec<Outcome> = Vec::new();
    for (number, case) in cases.iter().enumerate() {
        if session.is_interrupted() {
            break;
        }
        session.say(format!(
            "case {} of {}: {}",
            number + 1,
            cases.len(),
            case.name
        ));
        let outcome = try_case(session, case);
        // A case that an interruption ended has not failed.
        if session.is_interrupted() && !outcome.holds() {
            break;
        }
        outcomes.push(outcome);
        write(session, &outcomes)?;
    }
    if outcomes.is_empty() {
        write(session, &outcomes)?;
    }
    let failed: Vec<&str> = outcomes
        .iter()
        .filter(|outcome| !outcome.holds())
        .map(|outcome| outcome.case.as_str())
        .collect();
    if !failed.is_empty() {
        session.tick();
        bail!(
            "{} of {} cases failed: {}",
            failed.len(),
            outcomes.len(),
            failed.join("; ")
        );
    }
    Ok(())
}

/// Run one case in the session's pool, and stop it when its time is over or Ctrl+C is pressed.
fn try_case(session: &mut Session<'_>, case: &Case) -> Outcome {
    let begin = Instant::now();
    session
        .watch(|cancel| case.run(cancel))
        .unwrap_or_else(|panic| Outcome::failed(case, panic, begin.elapsed().as_secs_f64()))
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
