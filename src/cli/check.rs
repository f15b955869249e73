//! `vecrad check`: test the light of a scene where it is known without a reference, and say how right it is.

use std::{
    io::{self, Write as _},
    path::PathBuf,
    sync::{Arc, atomic::Ordering},
    time::Instant,
};

use anyhow::{Context as _, Result, anyhow, bail};
use clap::Args;
use rayon::ThreadPoolBuilder;
use serde::Serialize;

use super::{
    LimitFlags, Outcome, SceneFlags, SettingFlags,
    load::load_with_faces,
    output::{self, Destination},
    progress::Progress,
    report::{LightFacts, Machine, SceneFacts},
    solve::Interruption,
    watched::watched,
};
use crate::{
    experiments::check::{Check, Outcome as Found, Subject, check_markdown, summary},
    solver::SolveSettings,
};

/// Flags of `vecrad check`.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct CheckArguments {
    /// OBJ or glTF file to test
    #[arg(required_unless_present = "scene", conflicts_with = "scene")]
    pub path: Option<PathBuf>,
    /// Built-in scene to test
    #[arg(long, value_name = "NAME")]
    pub scene: Option<String>,
    /// Write the tests with all figures (JSON; - for standard output in place of the table)
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub report: Option<PathBuf>,
    /// No progress line
    #[arg(long, short, help_heading = "Output")]
    pub quiet: bool,
    /// Scene
    #[command(flatten)]
    pub scene_flags: SceneFlags,
    /// Settings
    #[command(flatten)]
    pub setting_flags: SettingFlags,
    /// Limits
    #[command(flatten)]
    pub limits: LimitFlags,
}

/// The JSON report.
#[derive(Serialize)]
struct Report<'a> {
    version: &'static str,
    scene: SceneFacts,
    lights: LightFacts,
    settings: SolveSettings,
    /// How far light may be off, relative.
    limit: f64,
    tests: &'a [Found],
    /// What is said of the file in the end.
    summary: String,
    /// Whether tests are missing, or solves were cut short by a limit.
    stopped_early: bool,
    seconds: f64,
    threads: usize,
    machine: Machine,
}

/// Test, say what came of it, write the report.
pub(super) fn check(arguments: &CheckArguments) -> Result<Outcome> {
    let interruption = Interruption::listen()?;
    let destinations = check_outputs(arguments)?;
    let begin = Instant::now();
    let options = arguments.scene_flags.options();
    interruption.ends_at_once(true);
    let lighting = arguments.scene_flags.lighting()?;
    let (path, name) = (arguments.path.as_deref(), arguments.scene.as_deref());
    let (scene, faces) = load_with_faces(path, name, &options, &lighting)?;
    interruption.ends_at_once(false);
    output::check_inputs_kept(&destinations, &scene.files)?;
    for warning in &scene.warnings {
        output::say(format_args!("warning: {warning}"));
    }
    let scene = Arc::new(scene);
    let limits = arguments.limits.options();
    let pool = ThreadPoolBuilder::new()
        .num_threads(limits.threads)
        .build()
        .context("cannot start the threads")?;
    let mut progress = Progress::new(arguments.quiet);
    let is_over = || {
        let is_late = limits
            .time_limit
            .is_some_and(|limit| begin.elapsed() >= limit);
        is_late || interruption.flag.load(Ordering::Relaxed)
    };
    let subject = Subject {
        scene: scene.clone(),
        faces,
        options,
        lighting,
        settings: arguments.setting_flags.settings(),
        memory_limit: limits.memory_limit,
    };
    progress.say("looking around".to_owned());
    let check = watched(
        &pool,
        |cancel| Check::new(subject, cancel),
        || {
            progress.show();
            is_over()
        },
    )
    .map_err(|panic| anyhow!(panic))?;
    let Some(check) = check else {
        progress.finish();
        bail!("stopped before the first test");
    };
    let laws = check.laws();
    let mut found: Vec<Found> = Vec::new();
    for (number, law) in laws.iter().enumerate() {
        progress.say(format!(
            "test {} of {}: {}",
            number + 1,
            laws.len(),
            law.name()
        ));
        let start = Instant::now();
        let outcome = watched(
            &pool,
            |cancel| check.run(law, cancel),
            || {
                progress.show();
                is_over()
            },
        )
        .unwrap_or_else(|panic| Found::failed(law, panic, start.elapsed().as_secs_f64()));
        found.push(outcome);
        if is_over() {
            break;
        }
    }
    progress.finish();
    let is_cut_short = found.iter().any(|outcome| outcome.is_cut_short);
    let is_whole = found.len() == laws.len() && !found.iter().any(Found::is_stopped);
    let sum = match summary(&found) {
        Ok(_) if !is_whole => Ok("stopped before the last test".to_owned()),
        sum => sum,
    };
    let report = Report {
        version: env!("CARGO_PKG_VERSION"),
        scene: SceneFacts::of(&scene),
        lights: LightFacts::of(&scene),
        settings: arguments.setting_flags.settings(),
        limit: check.limit(),
        tests: &found,
        summary: sum.clone().unwrap_or_else(|failure| failure),
        stopped_early: is_cut_short || !is_whole,
        seconds: begin.elapsed().as_secs_f64(),
        threads: pool.current_num_threads(),
        machine: Machine::present(),
    };
    write(arguments, &report)?;
    let sentence = sum.map_err(|failure| anyhow!(failure))?;
    say_last(arguments, &sentence)?;
    if is_cut_short {
        output::say("note: the memory limit cut solves short");
    }
    Ok(match is_cut_short || !is_whole {
        true => Outcome::StoppedEarly,
        false => Outcome::Done,
    })
}

/// Refuse what cannot be written before the work begins; else the file that will be.
fn check_outputs(arguments: &CheckArguments) -> Result<Vec<Destination>> {
    let report = arguments.report.as_deref();
    report.map_or(Ok(()), output::check)?;
    let destinations: Vec<Destination> = report
        .and_then(|path| Destination::new("--report", path))
        .into_iter()
        .collect();
    output::check_inputs_kept(&destinations, arguments.path.as_slice())?;
    Ok(destinations)
}

/// Print the table, and write the report where one is asked for.
fn write(arguments: &CheckArguments, report: &Report<'_>) -> Result<()> {
    if !prints_report(arguments) {
        let mut out = io::stdout().lock();
        write!(out, "{}", check_markdown(report.tests)).and_then(|()| out.flush())?;
    }
    let Some(path) = &arguments.report else {
        return Ok(());
    };
    output::write_whole(path, |out| {
        serde_json::to_writer_pretty(&mut *out, report)?;
        out.write_all(b"\n")
    })
}

fn say_last(arguments: &CheckArguments, sentence: &str) -> Result<()> {
    if !prints_report(arguments) {
        writeln!(io::stdout().lock(), "\n{sentence}")?;
    }
    Ok(())
}

/// Whether standard output is for the report.
fn prints_report(arguments: &CheckArguments) -> bool {
    arguments.report.as_deref().is_some_and(output::is_stdout)
}
