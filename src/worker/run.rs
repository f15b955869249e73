//! One run: its state, its aim, and when it ends.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use super::{
    Generation, Job, MakeStepper, RunOptions, Stepper, StopReason,
    message::Start,
    request::{Request, Task},
};
use crate::{
    geometry::RayTree,
    scene::{Appearance, Scene},
    solver::{Cancel, SolveSettings, StepReport, Subject},
};

/// A step takes up to about this many times as long as the one before. Smaller, and the time limit ends a step whose time is
/// then lost; larger, and light is finished that the next step replaces in time.
const STEP_GROWTH: u32 = 3;

/// The state that a run is to reach.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Aim {
    /// Step after step.
    Run,
    /// Wait to be continued.
    Rest,
    /// Nothing more.
    End(StopReason),
    /// None: the solve is lost.
    Failed,
}

/// A scene under settings.
pub(super) struct Run {
    /// Which run.
    pub generation: Generation,
    /// The scene.
    pub scene: Arc<Scene>,
    /// Its ray tree, where there is one already.
    pub rays: Option<Arc<RayTree>>,
    /// The settings.
    pub settings: SolveSettings,
    /// Whether the solve does not have the settings yet.
    pub settings_changed: bool,
    /// How it is computed.
    pub options: RunOptions,
    /// Appearances of the materials, where they differ from the scene. Changed by [`Run::relight`].
    pub appearances: Option<Arc<[Appearance]>>,
    /// Whether the solve does not have the appearances yet.
    pub appearances_changed: bool,
    /// Whether the light that is shown is a preview, whose refinement is due.
    pub is_rough: bool,
    /// The solve, while it is not in the pool.
    pub stepper: Option<Box<dyn Stepper>>,
    /// Nodes that are inspected, now and after each step. Changed by [`Run::ask`].
    subjects: Vec<Subject>,
    /// Whether an answer is due.
    is_asked: bool,
    /// Whether the light of each lamp is asked for.
    pub is_asked_by_lamp: bool,
    /// The state that it is to reach. Changed by [`Run::turn_to`].
    pub aim: Aim,
    /// Whether it was announced that the aim is reached.
    pub announced: bool,
    /// Start, or last continue.
    since: Instant,
    /// Running time before that.
    before: Duration,
    /// Time spent preparing and stepping.
    pub solving: Duration,
    /// Running time and time spent, in seconds, at the end of the last step.
    last_times: (f64, f64),
    /// Whether the light of the last step can still be made better over its links.
    pub is_unfinished: bool,
    /// Whether that is to be done, or is being done, before the aim counts as reached.
    pub is_finishing: bool,
    /// Time that the last step took, until its light is finished or another step begins.
    pub last_step: Option<Duration>,
}

impl Run {
    /// A run that begins.
    pub(super) fn new(start: Start) -> Self {
        Self {
            generation: start.generation,
            scene: start.scene,
            rays: start.rays,
            settings: start.settings,
            settings_changed: false,
            options: start.options,
            appearances: start.appearances,
            appearances_changed: false,
            is_rough: false,
            stepper: None,
            subjects: Vec::new(),
            is_asked: false,
            is_asked_by_lamp: false,
            aim: Aim::Run,
            announced: false,
            since: Instant::now(),
            before: Duration::ZERO,
            solving: Duration::ZERO,
            last_times: (0.0, 0.0),
            is_unfinished: false,
            is_finishing: false,
            last_step: None,
        }
    }

    /// Whether there is a task for the solve, which is not in the pool.
    pub(super) fn has_task(&self) -> bool {
        self.aim == Aim::Run
            || ((self.is_finishing
                || self.is_asked
                || self.is_asked_by_lamp
                || self.appearances_changed
                || self.is_rough)
                && self.stepper.is_some())
    }

    /// Use these appearances from now on; earlier appearances that are still waiting are dropped.
    pub(super) fn relight(&mut self, appearances: Arc<[Appearance]>) {
        self.appearances = Some(appearances);
        self.appearances_changed = true;
    }

    /// Inspect these nodes from now on.
    pub(super) fn ask(&mut self, subjects: Vec<Subject>) {
        self.subjects = subjects;
        self.ask_again();
    }

    /// The solve has changed: earlier inspections are out of date.
    pub(super) fn ask_again(&mut self) {
        self.is_asked = !self.subjects.is_empty();
    }

    /// The next request to the pool. Light that was changed comes first, then inspections: they are short.
    pub(super) fn next_request(&mut self, make: &MakeStepper, cancel: Cancel) -> Request {
        let changed = self
            .appearances
            .clone()
            .filter(|_| std::mem::take(&mut self.appearances_changed));
        let task = match (self.stepper.take(), changed) {
            (Some(stepper), Some(appearances)) => Task::Relight(stepper, appearances, cancel),
            (stepper, _) => self.other_task(stepper, make, cancel),
        };
        Request {
            generation: self.generation,
            task,
        }
    }

    fn other_task(
        &mut self,
        stepper: Option<Box<dyn Stepper>>,
        make: &MakeStepper,
        cancel: Cancel,
    ) -> Task {
        match stepper {
            Some(stepper) if self.is_asked => {
                self.is_asked = false;
                Task::Inspect(stepper, self.subjects.clone())
            }
            Some(stepper) if self.is_finishing || self.is_last_in_time() => {
                self.last_step = None;
                Task::Finish(stepper, cancel)
            }
            Some(stepper) if std::mem::take(&mut self.is_rough) && self.aim != Aim::Run => {
                Task::FinishRelighting(stepper, cancel)
            }
            Some(stepper) if self.aim != Aim::Run && std::mem::take(&mut self.is_asked_by_lamp) => {
                Task::LightByLamp(stepper, cancel)
            }
            Some(mut stepper) => {
                self.last_step = None;
                if std::mem::take(&mut self.settings_changed) {
                    stepper.change_settings(self.settings.clone());
                }
                Task::Step(stepper, cancel)
            }
            None => {
                self.settings_changed = false;
                let job = Job {
                    scene: self.scene.clone(),
                    rays: self.rays.clone(),
                    settings: self.settings.clone(),
                    memory_limit: self.options.memory_limit,
                    appearances: self.appearances.clone(),
                };
                Task::Prepare(make.clone(), job, cancel)
            }
        }
    }

    /// Set the aim, which is to be announced once it is reached. The clock continues.
    pub(super) fn turn_to(&mut self, aim: Aim) {
        self.before = self.running_time();
        self.since = Instant::now();
        self.aim = aim;
        self.announced = false;
        self.is_finishing = false;
    }

    /// Time since the start, without that in which nothing was to be done.
    fn running_time(&self) -> Duration {
        match self.aim {
            Aim::Run => self.before + self.since.elapsed(),
            _ => self.before,
        }
    }

    /// When the time limit passes.
    pub(super) fn deadline(&self) -> Option<Instant> {
        let limit = self.options.time_limit?;
        (self.aim == Aim::Run).then_some(())?;
        self.since.checked_add(limit)
    }

    /// Running time and time spent, in seconds, as the pool returns the solve from a step.
    pub(super) fn times(&self) -> (f64, f64) {
        // A step that was interrupted ran on until now.
        let elapsed = self.before + self.since.elapsed();
        (elapsed.as_secs_f64(), self.solving.as_secs_f64())
    }

    /// Whether the time limit would end the step after the last one, whose light has not been finished.
    fn is_last_in_time(&self) -> bool {
        let needed = self.last_step.map(|step| step * STEP_GROWTH);
        let left = self
            .deadline()
            .map(|deadline| deadline.saturating_duration_since(Instant::now()));
        needed.zip(left).is_some_and(|(needed, left)| needed > left)
    }

    /// Give a report the times of the last step: changing the light is no part of the way there.
    pub(super) fn dated(&self, mut report: StepReport) -> StepReport {
        (report.elapsed_s, report.solve_s) = self.last_times;
        report
    }

    /// End the run, but finish the light of its last step first if that can be made better.
    pub(super) fn end_with_finish(&mut self, reason: StopReason) {
        self.turn_to(Aim::End(reason));
        self.is_finishing = self.is_unfinished;
    }

    /// Complete the report of a step, and end the run if it was the last.
    pub(super) fn take_note(&mut self, report: StepReport) -> StepReport {
        self.last_times = self.times();
        let report = self.dated(report);
        if let Some(reason) = self.end_after(&report) {
            // Lower settings that came during the step ask for more.
            let more = self.settings_changed && !reason.can_continue();
            if !more {
                self.turn_to(Aim::End(reason));
            }
        }
        report
    }

    /// Why the run ends after a step with this report, if it does.
    fn end_after(&self, report: &StepReport) -> Option<StopReason> {
        if report.is_full {
            return Some(StopReason::MemoryLimit);
        }
        if report.is_final {
            let estimated = report.estimated_error.as_ref();
            return Some(match self.settings.error {
                Some(wanted) if estimated.is_some_and(|error| error.is_within(wanted)) => {
                    StopReason::Converged
                }
                Some(_) => StopReason::ErrorNotReached,
                // Where links are limited by what they gain, the rest is left to rays: nothing was cut short.
                None if report.epsilon <= self.settings.epsilon || report.has_limited_links() => {
                    StopReason::Converged
                }
                None => StopReason::StepLimit,
            });
        }
        let limit = self.options.memory_limit?;
        (report.memory_bytes >= limit).then_some(StopReason::MemoryLimit)
    }
}
