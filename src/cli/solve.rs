//! `vecrad solve`: light a scene headless and write what is asked for.

use std::{
    path::PathBuf,
    sync::{
        Arc, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use anyhow::{Context as _, Result, bail};
use clap::Args;

use super::{
    Outcome, Reference, RunFlags, SceneFlags, SettingFlags, UsageError,
    load::load,
    output,
    progress::Progress,
    report::{Machine, SceneFacts, SolveReport, StepFacts, Totals, WarningFacts, core_count},
    truth::{self, Errors, Truth},
};
use crate::{
    export::write_ply,
    reference::MatrixError,
    scene::Scene,
    solver::{Snapshot, StepReport},
    worker::{Event, StopReason, WorkerHandle},
};

/// How often an interruption is looked for; an answer within a tenth of a second feels immediate.
const POLL: Duration = Duration::from_millis(50);

/// Flags of `vecrad solve`.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct SolveArguments {
    /// OBJ file to light
    #[arg(required_unless_present = "scene", conflicts_with = "scene")]
    pub path: Option<PathBuf>,
    /// Built-in scene to light
    #[arg(long, value_name = "NAME")]
    pub scene: Option<String>,
    /// Write the lit mesh (.ply)
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub export: Option<PathBuf>,
    /// Write the report (JSON; - for standard output)
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub report: Option<PathBuf>,
    /// Measure the error of every step: paths or paths=SAMPLES
    #[arg(long, value_name = "HOW", help_heading = "Output")]
    pub reference: Option<Reference>,
    /// Pictures
    #[cfg(feature = "viewer")]
    #[command(flatten)]
    pub picture: super::picture::PictureFlags,
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
    pub run_flags: RunFlags,
}

/// What a drained run brought.
struct Run {
    steps: Vec<StepReport>,
    prepare_s: f64,
    stop_reason: StopReason,
    snapshot: Arc<Snapshot>,
}

/// Light the scene, write the files, say how it ended.
pub(super) fn solve(arguments: &SolveArguments) -> Result<Outcome> {
    check_outputs(arguments)?;
    let interrupted = interruption()?;
    let begin = Instant::now();
    let options = arguments.scene_flags.options();
    let scene = Arc::new(load(
        arguments.path.as_deref(),
        arguments.scene.as_deref(),
        &options,
    )?);
    let read_s = begin.elapsed().as_secs_f64();
    for warning in &scene.warnings {
        eprintln!("warning: {warning}");
    }
    let errors = Errors::default();
    let traced = Instant::now();
    let mut worker = worker(arguments, &scene, &interrupted, &errors)?;
    let reference_s = arguments.reference.map(|_| traced.elapsed().as_secs_f64());
    worker.start(
        scene.clone(),
        arguments.setting_flags.settings(),
        arguments.run_flags.options(),
    );
    let run = drain(&worker, &interrupted, arguments.quiet)?;
    drop(worker);
    let totals = Totals {
        read_s,
        reference_s,
        ..Totals::default()
    };
    write_outputs(arguments, &scene, &run, &errors, totals)?;
    #[cfg(feature = "viewer")]
    arguments.picture.write(
        &scene,
        arguments.scene.as_deref(),
        &run.snapshot,
        errors_of(arguments, &scene, &run, &errors, &interrupted).as_ref(),
        &arguments.run_flags,
        arguments.scene_flags.up,
    )?;
    Ok(match run.stop_reason {
        StopReason::Converged => Outcome::Done,
        _ => Outcome::StoppedEarly,
    })
}

/// Errors at the vertices, where a picture is to show them.
#[cfg(feature = "viewer")]
fn errors_of(
    arguments: &SolveArguments,
    scene: &Scene,
    run: &Run,
    errors: &Errors,
    interrupted: &AtomicBool,
) -> Option<Arc<Vec<f32>>> {
    let Some(Reference::Paths(samples)) = arguments.reference else {
        return None;
    };
    if !arguments.picture.shows_errors() {
        return None;
    }
    let measured = errors.lock().unwrap_or_else(PoisonError::into_inner);
    let reference_rms = measured.last_key_value()?.1.reference_rms;
    let paths = (samples, arguments.setting_flags.settings().seed);
    let cancel = || interrupted.load(Ordering::Relaxed);
    truth::vertex_errors(scene, &run.snapshot, paths, reference_rms, &cancel).map(Arc::new)
}

/// Refuse what cannot be written before the work begins.
fn check_outputs(arguments: &SolveArguments) -> Result<()> {
    if let Some(path) = &arguments.export {
        let is_ply = path
            .extension()
            .is_some_and(|extension| extension.eq_ignore_ascii_case("ply"));
        if !is_ply {
            let message = format!("the exported file must end in .ply: {}", path.display());
            bail!(UsageError(message));
        }
        output::check(path)?;
    }
    #[cfg(feature = "viewer")]
    {
        arguments.picture.check()?;
        let has_paths = matches!(arguments.reference, Some(Reference::Paths(_)));
        if arguments.picture.shows_errors() && !has_paths {
            let message = "--view error compares with a reference: add --reference paths";
            bail!(UsageError(message.to_owned()));
        }
    }
    arguments.report.as_deref().map_or(Ok(()), output::check)
}

/// A flag that Ctrl+C sets; a second Ctrl+C is the same.
pub(super) fn interruption() -> Result<Arc<AtomicBool>> {
    let interrupted = Arc::new(AtomicBool::new(false));
    let flag = interrupted.clone();
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed))
        .context("cannot listen for Ctrl+C")?;
    Ok(interrupted)
}

/// A worker that measures errors if a reference is asked for.
fn worker(
    arguments: &SolveArguments,
    scene: &Arc<Scene>,
    interrupted: &Arc<AtomicBool>,
    errors: &Errors,
) -> Result<WorkerHandle> {
    let wake = Arc::new(|| {});
    let seed = arguments.setting_flags.settings().seed;
    let cancel = || interrupted.load(Ordering::Relaxed);
    let truth = match arguments.reference {
        None => None,
        Some(Reference::Paths(samples)) => Truth::traced(scene, samples, seed, &cancel),
        Some(Reference::Matrix) => match Truth::by_matrix(scene, seed, &cancel) {
            Err(MatrixError::Cancelled) => None,
            found => Some(found?),
        },
    };
    match truth {
        None => WorkerHandle::spawn(wake),
        Some(truth) => {
            WorkerHandle::with_steppers(wake, truth::measured_solvers(truth, errors.clone()))
        }
    }
    .context("cannot start the solver thread")
}

/// Follow the run to its end.
fn drain(worker: &WorkerHandle, interrupted: &AtomicBool, quiet: bool) -> Result<Run> {
    let mut progress = Progress::new(quiet);
    let (mut steps, mut prepare_s, mut stopping) = (Vec::new(), 0.0, false);
    let stop_reason = loop {
        if interrupted.load(Ordering::Relaxed) && !stopping {
            worker.stop();
            stopping = true;
        }
        match worker.next_event(POLL) {
            None => progress.show(),
            Some(Event::Prepared { seconds }) => prepare_s = seconds,
            Some(Event::Stepped(report)) => {
                progress.stepped(&report);
                steps.push(report);
            }
            Some(Event::Finished(reason)) => break reason,
            Some(Event::Failed(message)) => bail!("the solver failed: {message}"),
            Some(Event::Started | Event::Paused | Event::Continued | Event::Inspected(_)) => {}
        }
    };
    progress.finish();
    Ok(Run {
        steps,
        prepare_s,
        stop_reason,
        snapshot: worker.latest().unwrap_or_default(),
    })
}

fn write_outputs(
    arguments: &SolveArguments,
    scene: &Scene,
    run: &Run,
    errors: &Errors,
    totals: Totals,
) -> Result<()> {
    let export = arguments.run_flags.export(arguments.scene_flags.up);
    if let Some(path) = &arguments.export {
        output::write_whole(path, |mut out| {
            write_ply(&mut out, &run.snapshot, &scene.frame, &export)
        })?;
    }
    if let Some(path) = &arguments.report {
        let report = report(arguments, scene, run, errors, totals);
        output::write_whole(path, |out| {
            serde_json::to_writer_pretty(&mut *out, &report)?;
            out.write_all(b"\n")
        })?;
    }
    Ok(())
}

fn report(
    arguments: &SolveArguments,
    scene: &Scene,
    run: &Run,
    errors: &Errors,
    totals: Totals,
) -> SolveReport {
    let errors = errors.lock().unwrap_or_else(PoisonError::into_inner);
    let steps: Vec<StepFacts> = run
        .steps
        .iter()
        .map(|report| StepFacts {
            report: report.clone(),
            error: errors.get(&report.step).cloned(),
        })
        .collect();
    let last = run.steps.last();
    SolveReport {
        version: env!("CARGO_PKG_VERSION"),
        scene: SceneFacts::of(scene),
        settings: arguments.setting_flags.settings(),
        color: arguments.run_flags.export(arguments.scene_flags.up).color,
        left_out: Vec::new(),
        warnings: scene.warnings.iter().map(WarningFacts::of).collect(),
        stop_reason: run.stop_reason,
        totals: Totals {
            steps: steps.len(),
            prepare_s: run.prepare_s,
            solve_s: last.map_or(run.prepare_s, |last| last.solve_s),
            elapsed_s: last.map_or(run.prepare_s, |last| last.elapsed_s),
            ..totals
        },
        steps,
        threads: match arguments.run_flags.options().threads {
            0 => core_count(),
            threads => threads,
        },
        machine: Machine::present(),
    }
}
