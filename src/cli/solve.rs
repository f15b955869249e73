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
    lightmap::{Baked, LightmapFlags},
    load::load,
    output::{self, Destination},
    progress::Progress,
    report::{
        LightFacts, Machine, ReferenceFacts, SceneFacts, SolveReport, StepFacts, Totals,
        WarningFacts, core_count,
    },
    truth::{self, Errors, Truth},
};
use crate::{
    export::{LitMesh, MeshFormat, MeshOptions},
    geometry::RayTree,
    metrics::ErrorMeasures,
    picture::harmonics_at_vertices,
    reference::MatrixError,
    scene::Scene,
    solver::{Cancel, LampLight, Snapshot, StepReport},
    worker::{Event, StopReason, WorkerHandle},
};

/// How often an interruption is looked for: an answer within a tenth of a second feels immediate, and to stop takes most
/// of it.
const POLL: Duration = Duration::from_millis(20);

/// Flags of `vecrad solve`.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct SolveArguments {
    /// OBJ or glTF file to light
    #[arg(required_unless_present = "scene", conflicts_with = "scene")]
    pub path: Option<PathBuf>,
    /// Built-in scene to light
    #[arg(long, value_name = "NAME")]
    pub scene: Option<String>,
    /// Write the lit mesh (.ply, .glb or .obj)
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub export: Option<PathBuf>,
    /// Export all objects of the scene as one
    #[arg(long, requires = "export", help_heading = "Output")]
    pub merge: bool,
    /// Export the light of each lamp by itself, too: of each material that emits, the sky and the sun (.ply or .glb)
    #[arg(long, requires = "export", help_heading = "Output")]
    pub export_lamps: bool,
    /// Export the light that arrives at each vertex by direction, too, as first-order spherical harmonics (.ply or .glb)
    #[arg(long, help_heading = "Output")]
    pub export_sh: bool,
    /// Write the report (JSON; - for standard output)
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub report: Option<PathBuf>,
    /// Measure the error of every step against a reference
    #[arg(
        long,
        value_name = "HOW",
        help = format!(
            "Measure the error of every step against path tracing (paths or paths=SAMPLES, by default {}) or the full \
             radiosity matrix (matrix, for small scenes)",
            Reference::DEFAULT_SAMPLES
        ),
        help_heading = "Output"
    )]
    pub reference: Option<Reference>,
    /// Lightmap
    #[command(flatten)]
    pub lightmap: LightmapFlags,
    /// Pictures
    #[cfg(feature = "viewer")]
    #[command(flatten)]
    pub picture: super::picture::PictureFlags,
    /// Say what is omitted because this scene does not need it, and why
    #[arg(long, help_heading = "Output")]
    pub explain: bool,
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

/// The reference of errors, and errors by step.
struct Measured {
    reference: Option<ReferenceFacts>,
    errors: Errors,
}

/// The result of a run.
struct Run {
    steps: Vec<StepReport>,
    prepare_s: f64,
    /// Running time and time spent at the end, in seconds; a step that was interrupted counts.
    times: (f64, f64),
    stop_reason: StopReason,
    snapshot: Arc<Snapshot>,
    /// The light of each lamp, where that is asked for.
    lamps: Arc<[LampLight]>,
}

/// Light the scene, write the files, say how it ended.
pub(super) fn solve(arguments: &SolveArguments) -> Result<Outcome> {
    let interruption = Interruption::listen()?;
    let mut destinations = check_outputs(arguments)?;
    let begin = Instant::now();
    let options = arguments.scene_flags.options();
    interruption.ends_at_once(true);
    let lighting = arguments.scene_flags.lighting()?;
    let scene = Arc::new(load(
        arguments.path.as_deref(),
        arguments.scene.as_deref(),
        &options,
        &lighting,
    )?);
    interruption.ends_at_once(false);
    let interrupted = interruption.flag.clone();
    let read_s = begin.elapsed().as_secs_f64();
    destinations.extend(arguments.lightmap.mesh(&scene.name));
    output::check_distinct(&destinations)?;
    output::check_inputs_kept(&destinations, &scene.files)?;
    let companions = companions(arguments, &scene)?;
    output::check_inputs_kept(&companions, &scene.files)?;
    output::check_distinct(&[destinations, companions].concat())?;
    for warning in &scene.warnings {
        output::say(format_args!("warning: {warning}"));
    }
    if let Some(sentence) = scene.up_sentence() {
        output::say(format_args!("note: {sentence}"));
    }
    let errors = Errors::default();
    let traced = Instant::now();
    let (mut worker, reference) = worker(arguments, &scene, &interrupted, &errors)?;
    let reference_s = arguments.reference.map(|_| traced.elapsed().as_secs_f64());
    worker.start(
        scene.clone(),
        arguments.setting_flags.settings(),
        arguments.run_flags.options(),
    );
    let mut run = drain(&worker, &interruption, arguments)?;
    if arguments.export_lamps && !run.snapshot.mesh.positions.is_empty() {
        run.lamps = light_by_lamp(&worker)?;
    }
    drop(worker);
    say_notes(&run);
    let totals = Totals {
        read_s,
        reference_s,
        ..Totals::default()
    };
    let measured = Measured { reference, errors };
    let has_light = !run.snapshot.mesh.positions.is_empty();
    let seed = arguments.setting_flags.settings().seed;
    let lightmap = match has_light {
        true => {
            (arguments.lightmap).bake(&scene, &run.snapshot, seed, arguments.quiet, &interrupted)
        }
        false => Ok(None),
    };
    let baked = lightmap.as_ref().ok().and_then(Option::as_ref);
    // A file that cannot be written does not stop the others from being written.
    let report = write_report(arguments, &scene, &run, baked, &measured, totals);
    if !has_light && writes_light(arguments) {
        report?;
        bail!("stopped before there was any light, so no mesh and no picture was written");
    }
    let export = write_export(arguments, &scene, &run);
    let written = baked.map(|baked| {
        let options = arguments.run_flags.export(scene.up, scene.radiance_unit);
        (arguments.lightmap).write(baked, &scene, &run.snapshot, &options)
    });
    #[cfg(feature = "viewer")]
    let picture = arguments.picture.write(
        &scene,
        arguments.scene.as_deref(),
        &run.snapshot,
        errors_of(arguments, &scene, &run, &measured.errors, &interrupted).as_ref(),
        &arguments.run_flags,
        seed,
    );
    export?;
    report?;
    #[cfg(feature = "viewer")]
    picture?;
    written.transpose()?;
    let is_complete = lightmap?.is_some() || !arguments.lightmap.is_wanted();
    Ok(match run.stop_reason {
        StopReason::Converged if is_complete => Outcome::Done,
        _ => Outcome::StoppedEarly,
    })
}

/// Say what limits the result: notes of the last step that are more than measures on its way.
fn say_notes(run: &Run) {
    let notes = run.steps.last().map_or(&[][..], |step| &step.notes);
    for note in notes.iter().filter(|note| note.limits_result()) {
        output::say(format_args!("note: {note}"));
    }
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

/// Refuse what cannot be written before the work begins; else the files that will be.
fn check_outputs(arguments: &SolveArguments) -> Result<Vec<Destination>> {
    if let Some(path) = &arguments.export {
        let format = MeshFormat::of(path).map_err(|error| UsageError(error.to_string()))?;
        for (flag, is_asked) in [
            ("--export-lamps", arguments.export_lamps),
            ("--export-sh", arguments.export_sh),
        ] {
            if is_asked && !format.holds_attributes() {
                let reason = "needs a file that ends in .ply or .glb: OBJ has room for one colour";
                bail!(UsageError(format!("{flag} {reason}")));
            }
        }
        output::check(path)?;
    } else if arguments.export_sh {
        let message = "--export-sh adds to the exported mesh: add --export FILE.glb or FILE.ply";
        bail!(UsageError(message.to_owned()));
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
    arguments.report.as_deref().map_or(Ok(()), output::check)?;
    arguments.lightmap.check()?;
    let named = [
        ("--export", &arguments.export),
        ("--report", &arguments.report),
        #[cfg(feature = "viewer")]
        ("--screenshot", &arguments.picture.screenshot),
    ];
    let destinations: Vec<Destination> = named
        .into_iter()
        .filter_map(|(label, path)| Destination::new(label, path.as_deref()?))
        .chain(arguments.lightmap.pictures())
        .collect();
    output::check_distinct(&destinations)?;
    // The rest of the scene's files is known once it is read.
    output::check_inputs_kept(&destinations, arguments.path.as_slice())?;
    #[cfg(feature = "viewer")]
    arguments.picture.check_size()?;
    Ok(destinations)
}

/// The light of each lamp of a run that has ended.
fn light_by_lamp(worker: &WorkerHandle) -> Result<Arc<[LampLight]>> {
    worker.light_by_lamp();
    loop {
        match worker.next_event(POLL) {
            Some(Event::ByLamp(Some(lamps))) => return Ok(lamps),
            Some(Event::ByLamp(None)) => bail!("the light of the lamps was interrupted"),
            Some(Event::Failed(message)) => bail!("the solver failed: {message}"),
            _ => {}
        }
    }
}

/// The files that are written beside those that are asked for.
fn companions(arguments: &SolveArguments, scene: &Scene) -> Result<Vec<Destination>> {
    let Some(path) = &arguments.export else {
        return Ok(Vec::new());
    };
    let library = MeshFormat::of(path)?.companions(path, scene)?;
    let paths = library.map_or(Vec::new(), |library| library.paths());
    let destinations = paths.iter();
    Ok(destinations
        .filter_map(|path| Destination::new("a file beside --export", path))
        .collect())
}

/// Whether files with light are asked for.
fn writes_light(arguments: &SolveArguments) -> bool {
    #[cfg(feature = "viewer")]
    let draws = arguments.picture.screenshot.is_some();
    #[cfg(not(feature = "viewer"))]
    let draws = false;
    arguments.export.is_some() || arguments.lightmap.is_wanted() || draws
}

/// Reacts to Ctrl+C and to a request of the system to end the program.
pub(super) struct Interruption {
    /// Set once it came.
    pub(super) flag: Arc<AtomicBool>,
    /// Set once it came again.
    again: Arc<AtomicBool>,
    at_once: Arc<AtomicBool>,
}

impl Interruption {
    pub(super) fn listen() -> Result<Self> {
        let new = Self {
            flag: Arc::new(AtomicBool::new(false)),
            again: Arc::new(AtomicBool::new(false)),
            at_once: Arc::new(AtomicBool::new(false)),
        };
        let (flag, again) = (new.flag.clone(), new.again.clone());
        let at_once = new.at_once.clone();
        ctrlc::set_handler(move || {
            again.store(flag.swap(true, Ordering::Relaxed), Ordering::Relaxed);
            if at_once.load(Ordering::Relaxed) {
                output::say("error: interrupted while the scene was read; nothing was written");
                std::process::exit(1);
            }
        })
        .context("cannot listen for Ctrl+C")?;
        Ok(new)
    }

    /// Whether an interruption ends the program, as is right while there is nothing to be written and no file open.
    pub(super) fn ends_at_once(&self, whether: bool) {
        self.at_once.store(whether, Ordering::Relaxed);
    }
}

/// A worker that measures errors if a reference is asked for, and what is known of that.
fn worker(
    arguments: &SolveArguments,
    scene: &Arc<Scene>,
    interrupted: &Arc<AtomicBool>,
    errors: &Errors,
) -> Result<(WorkerHandle, Option<ReferenceFacts>)> {
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
    let facts = truth.as_ref().map(|truth| truth.facts.clone());
    let worker = match truth {
        None => WorkerHandle::spawn(wake),
        Some(truth) => {
            WorkerHandle::with_steppers(wake, truth::measured_solvers(truth, errors.clone()))
        }
    };
    Ok((worker.context("cannot start the solver thread")?, facts))
}

/// Follow the run to its end.
fn drain(
    worker: &WorkerHandle,
    interruption: &Interruption,
    arguments: &SolveArguments,
) -> Result<Run> {
    let mut progress = Progress::new(arguments.quiet);
    let (mut steps, mut prepare_s, mut times) = (Vec::new(), 0.0, (0.0, 0.0));
    let mut interruptions = [&interruption.flag, &interruption.again]
        .into_iter()
        .peekable();
    let stop_reason = loop {
        if interruptions
            .next_if(|came| came.load(Ordering::Relaxed))
            .is_some()
        {
            // The preparation is not waited for: nothing would come of it.
            if worker.latest().is_none() {
                break StopReason::Requested;
            }
            worker.stop();
            if !steps.is_empty() {
                progress.say("finishing the light (Ctrl+C again to stop at once)".to_owned());
            }
        }
        match worker.next_event(POLL) {
            None => progress.show(),
            Some(Event::Prepared { seconds }) => {
                prepare_s = seconds;
                progress.prepared(seconds, arguments.setting_flags.settings().error);
                times = (seconds, seconds);
                if arguments.explain {
                    explain(&worker.latest().unwrap_or_default());
                }
            }
            Some(Event::Stepped(report)) => {
                progress.stepped(&report);
                times = (report.elapsed_s, report.solve_s);
                steps.push(report);
            }
            Some(Event::Interrupted { elapsed_s, solve_s }) => times = (elapsed_s, solve_s),
            Some(Event::Finished(reason)) => break reason,
            Some(Event::Failed(message)) => bail!("the solver failed: {message}"),
            Some(
                Event::Started
                | Event::Paused
                | Event::Continued
                | Event::Relit { .. }
                | Event::Inspected(_)
                | Event::ByLamp(_),
            ) => {}
        }
    };
    progress.finish();
    Ok(Run {
        steps,
        prepare_s,
        times,
        stop_reason,
        snapshot: worker.latest().unwrap_or_default(),
        lamps: Arc::default(),
    })
}

/// Say what is omitted, one line each.
fn explain(snapshot: &Snapshot) {
    if snapshot.omitted.is_empty() {
        output::say("omitted: nothing, this scene needs all of it");
    }
    for omission in snapshot.omitted.iter() {
        output::say(format_args!("omitted: {omission}"));
    }
}

fn write_export(arguments: &SolveArguments, scene: &Scene, run: &Run) -> Result<()> {
    let Some(path) = &arguments.export else {
        return Ok(());
    };
    let export = MeshOptions {
        merge: arguments.merge,
        ..arguments.run_flags.export(scene.up, scene.radiance_unit)
    };
    let format = MeshFormat::of(path)?;
    let harmonics = || {
        let (rays, seed) = (RayTree::new(scene), arguments.setting_flags.settings().seed);
        harmonics_at_vertices(scene, &rays, &run.snapshot, seed, &Cancel::default())
    };
    let harmonics = arguments.export_sh.then(harmonics).flatten();
    let lit = LitMesh {
        snapshot: &run.snapshot,
        scene,
        harmonics: harmonics.as_deref(),
        lamps: &run.lamps,
    };
    if let Some(companions) = format.companions(path, scene)? {
        let written = companions.write(scene);
        written.with_context(|| format!("cannot write the materials beside {}", path.display()))?;
    }
    output::write_whole(path, |out| format.write(out, path, lit, &export))
}

fn write_report(
    arguments: &SolveArguments,
    scene: &Scene,
    run: &Run,
    lightmap: Option<&Baked>,
    measured: &Measured,
    totals: Totals,
) -> Result<()> {
    let Some(path) = &arguments.report else {
        return Ok(());
    };
    let mut report = report(arguments, scene, run, measured, totals);
    report.lightmap = lightmap.map(Baked::facts);
    output::write_whole(path, |out| {
        serde_json::to_writer_pretty(&mut *out, &report)?;
        out.write_all(b"\n")
    })
}

fn report(
    arguments: &SolveArguments,
    scene: &Scene,
    run: &Run,
    measured: &Measured,
    totals: Totals,
) -> SolveReport {
    let errors = measured
        .errors
        .lock()
        .unwrap_or_else(PoisonError::into_inner);
    let steps: Vec<StepFacts> = run
        .steps
        .iter()
        .map(|report| StepFacts {
            report: report.clone(),
            error: errors.get(&report.step).map(|error| ErrorMeasures {
                reference_rms: error.reference_rms * f64::from(scene.radiance_unit),
                ..error.clone()
            }),
        })
        .collect();
    let (elapsed_s, solve_s) = run.times;
    let done_s = run.steps.last().map_or(run.prepare_s, |last| last.solve_s);
    SolveReport {
        version: env!("CARGO_PKG_VERSION"),
        scene: SceneFacts::of(scene),
        lights: LightFacts::of(scene),
        settings: arguments.setting_flags.settings(),
        color: arguments
            .run_flags
            .export(scene.up, scene.radiance_unit)
            .color,
        left_out: run.snapshot.omitted.to_vec(),
        warnings: scene.warnings.iter().map(WarningFacts::of).collect(),
        reference: measured.reference.clone(),
        lightmap: None,
        stop_reason: run.stop_reason,
        totals: Totals {
            steps: steps.len(),
            prepare_s: run.prepare_s,
            solve_s,
            interrupted_s: (solve_s > done_s).then_some(solve_s - done_s),
            elapsed_s,
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
