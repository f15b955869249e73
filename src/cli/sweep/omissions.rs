//! The plan suite: what each omission saves, and what it takes to find it.

use std::{
    io::{self, Write},
    sync::Arc,
};

use anyhow::{Result, anyhow};
use serde::Serialize;

use super::session::Session;
use crate::{
    cli::{output::write_whole, report::Machine},
    experiments::omissions::{
        Comparison, Exhibit, Row, Trial, exhibits, omissions_markdown, overhead_markdown,
    },
    export::write_csv,
    solver::SolveSettings,
};

/// Rounds of a scene at least, for the median of its times.
const ROUNDS: u32 = 3;

/// A scene whose runs took longer than this, in seconds, gets no more rounds than asked for: its times are long enough
/// to be told from noise, and the whole suite shall take some minutes.
const PATIENCE: f64 = 8.0;

/// Everything in `plan.json`.
#[derive(Serialize)]
struct Report<'a> {
    version: &'static str,
    machine: Machine,
    threads: usize,
    settings: SolveSettings,
    is_interrupted: bool,
    scenes: &'a [Comparison],
}

/// Run every scene that is asked for in all its ways, and write the files after each.
pub(super) fn compare(session: &mut Session<'_>) -> Result<()> {
    let settings = session.arguments.setting_flags.settings();
    let is_meant = |exhibit: &Exhibit, word: &str| exhibit.name.contains(word);
    let flags = &session.arguments.runs;
    let chosen = flags.chosen(exhibits().to_vec(), is_meant, "scene of the plan")?;
    let mut comparisons = Vec::new();
    for exhibit in &chosen {
        if session.is_interrupted() {
            break;
        }
        comparisons.extend(compare_on(session, exhibit, &settings)?);
        write(session, &settings, &comparisons)?;
    }
    if comparisons.is_empty() {
        write(session, &settings, &comparisons)?;
    }
    Ok(())
}

/// All runs on one scene, round by round, so that a machine that slows down does so for all; `None` when one of them was
/// stopped.
fn compare_on(
    session: &mut Session<'_>,
    exhibit: &Exhibit,
    settings: &SolveSettings,
) -> Result<Option<Comparison>> {
    session.say(format!("{}: making the plan", exhibit.name));
    let scene = Arc::new(exhibit.scene()?);
    let planned = session
        .watch(|cancel| Trial::new(scene, settings, cancel))
        .map_err(|panic| anyhow!("{}: {panic}", exhibit.name))?;
    let Some(mut trial) = planned else {
        session.note_cut();
        return Ok(None);
    };
    let repeats = session.arguments.runs.repeats;
    for round in 0..repeats.max(ROUNDS) {
        if round >= repeats && trial.seconds() > PATIENCE {
            break;
        }
        for (index, kept) in trial.kept().enumerate() {
            if !trial.is_due(index) {
                continue;
            }
            session.say(format!(
                "{}: {kept} kept, round {}",
                exhibit.name,
                round + 1
            ));
            let run = session
                .watch(|cancel| trial.run(index, cancel))
                .map_err(|panic| anyhow!("{}: {panic}", exhibit.name))?;
            if run.is_none() {
                session.note_cut();
                return Ok(None);
            }
        }
    }
    Ok(trial.comparison())
}

/// Write all files, each whole or not at all.
fn write(
    session: &Session<'_>,
    settings: &SolveSettings,
    comparisons: &[Comparison],
) -> Result<()> {
    let folder = &session.arguments.output;
    let report = Report {
        version: env!("CARGO_PKG_VERSION"),
        machine: Machine::present(),
        threads: session.thread_count(),
        settings: settings.clone(),
        is_interrupted: session.is_interrupted(),
        scenes: comparisons,
    };
    write_whole(&folder.join("plan.csv"), |out| {
        write_csv(comparisons.iter().flat_map(Row::of), out)
    })?;
    write_whole(&folder.join("plan.json"), |out| {
        serde_json::to_writer_pretty(&mut *out, &report)?;
        out.write_all(b"\n")
    })?;
    write_whole(&folder.join("plan.md"), |out| write_markdown(&report, out))
}

fn write_markdown(report: &Report<'_>, out: &mut dyn Write) -> io::Result<()> {
    let settings = toml::to_string(&report.settings).map_err(io::Error::other)?;
    writeln!(
        out,
        "# What omissions save\n\n\
         vecrad {}, {}, {} threads.\n\
         Settings: {}.\n\
         Each scene is solved as planned (`nothing` kept), with one omission kept, and with all kept.\n\
         Keeping `rays` keeps `elements` and `clusters`, too, which rest on them; where one thing is omitted, keeping it is keeping all.\n\
         Times are wall-clock seconds of preparing and stepping, the median of the rounds; ratios are to the run as planned.\n\
         The difference is that of the irradiance at random points of the surfaces from the run that keeps all, relative root mean square; \
         \"of seeds\" is that between two runs that keep all and have different seeds. \
         Where runs differ, either may be nearer to the truth.\n\
         Power is all that arrives, relative to the run that keeps all.\n\n{}\n\
         Making the plan, beside planting the tree that each solve needs:\n\n{}",
        report.version,
        report.machine.describe(),
        report.threads,
        settings.trim_end().replace('\n', ", "),
        omissions_markdown(report.scenes),
        overhead_markdown(report.scenes),
    )
}
