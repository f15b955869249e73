//! The reference as the window keeps it: the thread that traces it, and the runs that are compared by it.
//!
//! A reference belongs to one scene as it was read; another scene, or the same with other sides, drops it and the runs
//! with it. A run that begins again under other settings stays for comparison.

use std::{collections::BTreeMap, io, sync::Arc};

use super::{figures::figure, run::Run, view::ViewMode};
use crate::{
    geometry::RayTree,
    metrics::{ErrorMeasures, ReferenceFacts, SceneComparison, Trajectory},
    scene::Scene,
    solver::{Method, Oracle, Snapshot, SolveSettings, StepReport},
    worker::{self, Event, TruthHandle, TruthProgress, VertexErrors, Wake, Watch},
};

/// Runs kept for comparison, the present one included. More lines than colours are a tangle.
const MOST_RUNS: usize = 8;

/// One run under the reference.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunRecord {
    /// Number by which its errors are known: that of the worker's run.
    pub number: u64,
    /// Its place among the runs of the scene, from 1.
    pub ordinal: u32,
    /// Ordinal and settings, for people.
    pub name: String,
    /// Its settings, those of its last step where they were changed on the way.
    pub settings: SolveSettings,
    /// Its steps.
    pub steps: BTreeMap<u32, StepReport>,
}

/// One row of the table: a step, what the solver says of it, and what was measured.
pub type MeasuredRow<'a> = (u32, &'a StepReport, &'a ErrorMeasures);

/// The reference of the present scene, where there is one.
#[derive(Default)]
pub struct Truth {
    handle: Option<TruthHandle>,
    /// Progress so far.
    pub progress: Arc<TruthProgress>,
    /// Runs in order; the last is the present one.
    pub runs: Vec<RunRecord>,
    /// Runs since the scene was read.
    run_count: u32,
}

impl Truth {
    /// Whether there is a reference, or one in the making.
    pub fn exists(&self) -> bool {
        self.handle.is_some()
    }

    /// Whether samples are being added.
    pub fn is_tracing(&self) -> bool {
        let traces = |handle: &TruthHandle| !handle.rests() && self.progress.failed.is_none();
        self.handle.as_ref().is_some_and(traces) && !self.is_done()
    }

    /// Whether all samples are there.
    pub fn is_done(&self) -> bool {
        self.progress.goal > 0 && self.progress.samples >= self.progress.goal
    }

    /// Rest, go on, or trace more, whichever comes next.
    pub fn toggle(&mut self) {
        let is_done = self.is_done();
        if let Some(handle) = &self.handle {
            if is_done {
                handle.trace_more();
                handle.rest(false);
            } else {
                handle.rest(!handle.rests());
            }
        }
    }

    /// Begin to trace; `shown` is measured at once. Returns what the worker is to hand its snapshots to.
    ///
    /// # Errors
    /// When the system refuses a thread.
    pub fn start(
        &mut self,
        (scene, rays): (Arc<Scene>, Arc<RayTree>),
        seed: u64,
        shown: Option<&Arc<Snapshot>>,
        wake: Wake,
    ) -> io::Result<Watch> {
        self.handle = None;
        self.progress = Arc::default();
        let handle = TruthHandle::spawn(scene, rays, seed, wake)?;
        let lit = shown.filter(|snapshot| snapshot.step > 0);
        if let (Some(snapshot), Some(run)) = (lit, self.runs.last()) {
            handle.measure(run.number, snapshot.clone());
        }
        let watch = handle.watch();
        self.handle = Some(handle);
        Ok(watch)
    }

    /// Take note of an event of the run of this number, which lights under these settings.
    pub fn note(&mut self, event: &Event, run: u64, settings: &SolveSettings) {
        match event {
            Event::Started => self.begin_run(run, settings),
            Event::Stepped(report) | Event::Relit { report, .. } => {
                if let Some(run) = self.runs.last_mut() {
                    run.steps.insert(report.step, report.clone());
                    // A run may go on under finer settings.
                    run.name = name(run.ordinal, settings);
                    run.settings = settings.clone();
                }
            }
            _ => {}
        }
    }

    /// A new run; the one before is kept if anything of it was measured.
    fn begin_run(&mut self, number: u64, settings: &SolveSettings) {
        let is_measured = |run: &RunRecord| self.steps_of(run).next().is_some();
        if self.runs.last().is_some_and(|run| !is_measured(run)) {
            self.forget_run(self.runs.len() - 1);
        }
        if self.runs.len() >= MOST_RUNS {
            self.forget_run(0);
        }
        self.run_count += 1;
        self.runs.push(RunRecord {
            number,
            ordinal: self.run_count,
            name: name(self.run_count, settings),
            settings: settings.clone(),
            steps: BTreeMap::new(),
        });
    }

    fn forget_run(&mut self, index: usize) {
        let run = self.runs.remove(index);
        if let Some(handle) = &self.handle {
            handle.forget(run.number);
        }
    }

    /// Forget all runs but the present one.
    pub fn forget_earlier(&mut self) {
        while self.runs.len() > 1 {
            self.forget_run(0);
        }
    }

    /// Drop the reference and all that was measured by it; the present run goes on without.
    pub fn forget_reference(&mut self) {
        self.handle = None;
        self.progress = Arc::default();
        self.runs.drain(..self.runs.len().saturating_sub(1));
        if let Some(run) = self.runs.last_mut() {
            run.steps.clear();
        }
    }

    /// Say what is wanted, and take what is known. Returns whether that is more than before.
    pub fn exchange(&mut self, run: &Run, mode: ViewMode) -> bool {
        let Some(handle) = &self.handle else {
            return false;
        };
        handle.yield_to_solver(run.status.is_busy());
        let newest = run.snapshot.as_ref().filter(|snapshot| snapshot.step > 0);
        handle.compare_vertices(newest.filter(|_| mode == ViewMode::Error).cloned());
        let progress = handle.progress();
        let is_new = !Arc::ptr_eq(&progress, &self.progress);
        self.progress = progress;
        is_new
    }

    /// The measured steps of a run, in order.
    pub fn steps_of<'a>(&'a self, run: &'a RunRecord) -> impl Iterator<Item = MeasuredRow<'a>> {
        self.progress
            .errors
            .range((run.number, 0)..=(run.number, u32::MAX))
            .filter_map(|((_, step), error)| Some((*step, run.steps.get(step)?, error)))
    }

    /// The newest measured step of the present run.
    pub fn newest_error(&self) -> Option<MeasuredRow<'_>> {
        self.steps_of(self.runs.last()?).last()
    }

    /// Error against run time of all runs, as tables of them are made.
    pub fn comparison(&self, scene: &Scene) -> SceneComparison {
        let newest = self.progress.errors.values().next_back();
        SceneComparison {
            scene: scene.name.clone(),
            triangles: scene.face_count,
            reference: ReferenceFacts {
                surfaces: self.progress.surfaces,
                points: self.progress.points,
                samples: self.progress.samples,
                noise_floor: newest.map_or(0.0, |error| error.noise_floor),
                // Traced beside the runs, it has no time of its own; tables do not ask for it.
                seconds: 0.0,
            },
            runs: self.runs.iter().map(|run| self.trajectory(run)).collect(),
        }
    }

    /// A run with its measured steps, as far as it has come.
    fn trajectory(&self, run: &RunRecord) -> Trajectory {
        let last = run.steps.values().next_back();
        worker::trajectory(
            run.name.clone(),
            run.settings.clone(),
            last.is_none_or(|last| !last.is_final),
            self.steps_of(run).map(|(_, report, error)| (report, error)),
        )
    }

    /// Errors at the vertices of a snapshot's mesh, where they are known.
    pub fn vertex_errors(&self, snapshot: &Snapshot) -> Option<&Arc<Vec<f32>>> {
        let fits = |errors: &&VertexErrors| Arc::ptr_eq(&errors.mesh, &snapshot.mesh);
        let errors = self.progress.vertices.as_ref().filter(fits)?;
        Some(&errors.percent)
    }
}

/// The name of a run, unique among the runs.
fn name(ordinal: u32, settings: &SolveSettings) -> String {
    let method = match settings.method {
        Method::Bounded => "bounded",
        Method::SixFace => "six-face",
        Method::Single => "single",
        Method::Exact => "exact",
        Method::Isotropic => "isotropic",
    };
    let epsilon = figure(f64::from(settings.epsilon));
    let oracle = match settings.oracle {
        Oracle::Interval => String::new(),
        Oracle::Samples => format!(", p {}", settings.samples),
    };
    format!("{ordinal}: {method}, ε {epsilon}{oracle}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stepped(step: u32) -> Event {
        Event::Stepped(StepReport {
            step,
            elapsed_s: f64::from(step),
            error_bound: 0.5,
            ..StepReport::default()
        })
    }

    /// As if the thread had measured these steps.
    fn know(truth: &mut Truth, steps: &[(u64, u32)]) {
        let progress = Arc::make_mut(&mut truth.progress);
        for &step in steps {
            progress.errors.insert(step, ErrorMeasures::default());
        }
    }

    #[test]
    fn a_measured_run_is_kept_and_an_unmeasured_one_is_not() {
        let mut truth = Truth::default();
        let mut settings = SolveSettings::draft();
        truth.note(&Event::Started, 1, &settings);
        truth.note(&stepped(1), 1, &settings);
        truth.note(&Event::Started, 2, &settings);
        assert_eq!(truth.runs.len(), 1, "nothing of the first was measured");
        truth.note(&stepped(1), 2, &settings);
        truth.note(&stepped(2), 2, &settings);
        know(&mut truth, &[(2, 1), (2, 2)]);
        assert_eq!(truth.newest_error().map(|(step, ..)| step), Some(2));
        settings.method = Method::SixFace;
        truth.note(&Event::Started, 3, &settings);
        assert_eq!(truth.runs.len(), 2);
        assert_ne!(truth.runs[0].name, truth.runs[1].name);
        assert_eq!(truth.newest_error(), None, "the new run has no error yet");
        truth.forget_earlier();
        assert_eq!(truth.runs.len(), 1);
        assert!(truth.runs[0].name.contains("six-face"));
    }

    #[test]
    fn old_runs_go_when_there_are_many() {
        let mut truth = Truth::default();
        for run in 1..=20 {
            truth.note(&Event::Started, run, &SolveSettings::draft());
            truth.note(&stepped(1), run, &SolveSettings::draft());
            know(&mut truth, &[(run, 1)]);
        }
        assert_eq!(truth.runs.len(), MOST_RUNS);
        assert_eq!(truth.runs.last().map(|run| run.number), Some(20));
    }
}
