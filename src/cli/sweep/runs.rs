//! Solver runs: the worker that the window drives, too, with the error of every step measured off the clock.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

use anyhow::{Context as _, Result, bail};

use super::{
    run_flags::Configuration,
    session::{Session, Truth},
};
use crate::{
    cli::observed::observed_solvers,
    metrics::{ErrorMeasures, Trajectory},
    scene::Scene,
    solver::{DisplayMesh, StepReport},
    worker::{self, Event, StopReason, WorkerHandle},
};

/// How often an interruption is looked for.
const POLL: Duration = Duration::from_millis(50);

/// The result of a configuration.
pub(super) struct SolverRun {
    /// Error over time.
    pub(super) trajectory: Trajectory,
    /// The meshes of the first and of the last step; none if no step came to its end.
    pub(super) meshes: Option<[Arc<DisplayMesh>; 2]>,
}

/// Measurements taken during a run.
#[derive(Default)]
struct Record {
    errors: BTreeMap<u32, ErrorMeasures>,
    meshes: Option<[Arc<DisplayMesh>; 2]>,
}

/// Run a configuration as often as asked for.
pub(super) fn solve(
    session: &mut Session<'_>,
    scene: &Arc<Scene>,
    truth: &Arc<Truth>,
    configuration: &Configuration,
) -> Result<SolverRun> {
    let (mut runs, mut meshes) = (Vec::new(), None);
    for _ in 0..session.arguments.runs.repeats {
        if session.is_interrupted() {
            break;
        }
        let run = solve_once(session, scene, truth, configuration)?;
        meshes = meshes.or(run.meshes);
        runs.push(run.trajectory);
    }
    let trajectory =
        Trajectory::median(runs).unwrap_or_else(|| trajectory(configuration, true, None));
    Ok(SolverRun { trajectory, meshes })
}

fn trajectory<'a>(
    configuration: &Configuration,
    is_cut_short: bool,
    steps: impl IntoIterator<Item = (&'a StepReport, &'a ErrorMeasures)>,
) -> Trajectory {
    let (label, settings) = (configuration.label.clone(), configuration.settings.clone());
    worker::trajectory(label, settings, is_cut_short, steps)
}

fn solve_once(
    session: &mut Session<'_>,
    scene: &Arc<Scene>,
    truth: &Arc<Truth>,
    configuration: &Configuration,
) -> Result<SolverRun> {
    let record = Arc::new(Mutex::new(Record::default()));
    let mut worker = worker(truth.clone(), record.clone())?;
    let title = format!("{}: {}", scene.name, configuration.label);
    session.say(format!("{title}, preparing"));
    worker.start(
        scene.clone(),
        configuration.settings.clone(),
        session.run_options(),
    );
    let (reports, reason) = drain(session, &worker, &title)?;
    drop(worker);
    let record = std::mem::take(&mut *record.lock().unwrap_or_else(PoisonError::into_inner));
    let is_cut_short = reason != StopReason::Converged && reason != StopReason::StepLimit;
    if is_cut_short {
        session.note_cut();
    }
    let measured = |report: &StepReport| record.errors.get(&report.step);
    let steps = reports
        .iter()
        .filter_map(|report| Some((report, measured(report)?)));
    Ok(SolverRun {
        trajectory: trajectory(configuration, is_cut_short, steps),
        meshes: record.meshes,
    })
}

/// Follow a run to its end.
fn drain(
    session: &mut Session<'_>,
    worker: &WorkerHandle,
    title: &str,
) -> Result<(Vec<StepReport>, StopReason)> {
    let (mut reports, mut is_stopping) = (Vec::new(), false);
    loop {
        if session.is_interrupted() && !is_stopping {
            // At once: nothing of the run is kept.
            worker.stop();
            worker.stop();
            is_stopping = true;
        }
        match worker.next_event(POLL) {
            None => session.tick(),
            Some(Event::Stepped(report)) => {
                session.say(format!("{title}, step {}", report.step));
                reports.push(report);
            }
            Some(Event::Finished(reason)) => return Ok((reports, reason)),
            Some(Event::Failed(message)) => bail!("the solver failed: {message}"),
            Some(
                Event::Started
                | Event::Prepared { .. }
                | Event::Interrupted { .. }
                | Event::Relit { .. }
                | Event::Inspected(_)
                | Event::ByLamp(_)
                | Event::Paused
                | Event::Continued,
            ) => {}
        }
    }
}

/// A worker whose solvers are measured after each step.
fn worker(truth: Arc<Truth>, record: Arc<Mutex<Record>>) -> Result<WorkerHandle> {
    let make = observed_solvers(move |scene, snapshot| {
        if snapshot.step == 0 {
            return;
        }
        let error = truth.measure_mesh(scene, &snapshot.mesh, &snapshot.light);
        let mut record = record.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(error) = error {
            record.errors.insert(snapshot.step, error);
        }
        let first = record.meshes.take().map(|[first, _]| first);
        let last = snapshot.mesh.clone();
        record.meshes = Some([first.unwrap_or_else(|| last.clone()), last]);
    });
    WorkerHandle::with_steppers(Arc::new(|| {}), make).context("cannot start the solver thread")
}
