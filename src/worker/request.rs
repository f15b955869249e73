//! Requests to the pool of solver threads: to prepare a solve, to step it, or to inspect it.

use std::{
    any::Any,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::Arc,
    time::{Duration, Instant},
};

use super::{Generation, Job, MakeStepper, Stepper};
use crate::{
    scene::Appearance,
    solver::{Cancel, Inspection, LampLight, Relit, Snapshot, StepReport, Subject},
};

/// A task for the pool, with the solve that it is about.
pub(super) struct Request {
    /// The run that it belongs to.
    pub generation: Generation,
    /// The task.
    pub task: Task,
}

/// A task with a solve.
pub(super) enum Task {
    /// Make a solve, unless cancelled.
    Prepare(MakeStepper, Job, Cancel),
    /// Make one step, unless cancelled.
    Step(Box<dyn Stepper>, Cancel),
    /// Find the light of the last step as well as its links allow, unless cancelled.
    Finish(Box<dyn Stepper>, Cancel),
    /// Light the scene with other appearances of its materials, unless cancelled.
    Relight(Box<dyn Stepper>, Arc<[Appearance]>, Cancel),
    /// Compute the light that a relighting omitted, unless cancelled.
    FinishRelighting(Box<dyn Stepper>, Cancel),
    /// Find the light of each lamp, unless cancelled.
    LightByLamp(Box<dyn Stepper>, Cancel),
    /// Inspect nodes.
    Inspect(Box<dyn Stepper>, Vec<Subject>),
}

/// The solve as the pool returns it.
pub(super) struct Returned {
    /// The run that it belongs to.
    pub generation: Generation,
    /// The completed task, nothing where there is no solve yet, or the text of a panic.
    pub result: Result<Option<Completed>, String>,
}

/// A completed task.
pub(super) struct Completed {
    /// The solve.
    pub stepper: Box<dyn Stepper>,
    /// Its result.
    pub outcome: Outcome,
    /// Time that it took.
    pub spent: Duration,
}

/// The result of a task.
pub(super) enum Outcome {
    /// The solve is ready.
    Prepared(Snapshot),
    /// A step is done, or was cancelled.
    Stepped(Option<StepReport>, Snapshot),
    /// The light of the last step is as good as its links allow, or the task was cancelled.
    Finished(Option<StepReport>, Snapshot),
    /// The light of other appearances is there, or the task was cancelled.
    Relit(Option<Relit>, Snapshot),
    /// The light that a relighting omitted is there, or the task was cancelled.
    RelitFinely(Option<StepReport>, Snapshot),
    /// The light of each lamp is there, or the task was cancelled.
    ByLamp(Option<Vec<LampLight>>),
    /// Nodes were inspected.
    Inspected(Vec<Inspection>),
}

impl Request {
    /// Run the task; a panic becomes its text.
    pub(super) fn carry_out(self) -> Returned {
        let Self { generation, task } = self;
        let result = catch_unwind(AssertUnwindSafe(move || task.run()));
        Returned {
            generation,
            result: result.map_err(|panic| describe(&*panic)),
        }
    }
}

impl Task {
    fn run(self) -> Option<Completed> {
        let begin = Instant::now();
        Some(match self {
            Self::Prepare(make, job, cancel) => {
                let stepper = make(job, &cancel)?;
                let spent = begin.elapsed();
                Completed {
                    outcome: Outcome::Prepared(stepper.snapshot()),
                    stepper,
                    spent,
                }
            }
            Self::Step(mut stepper, cancel) => {
                let report = stepper.step(&cancel);
                let spent = begin.elapsed();
                Completed {
                    outcome: Outcome::Stepped(report, stepper.snapshot()),
                    stepper,
                    spent,
                }
            }
            Self::Finish(mut stepper, cancel) => {
                let report = stepper.finish(&cancel);
                let spent = begin.elapsed();
                Completed {
                    outcome: Outcome::Finished(report, stepper.snapshot()),
                    stepper,
                    spent,
                }
            }
            Self::Relight(mut stepper, appearances, cancel) => {
                let relit = stepper.relight(&appearances, &cancel);
                let spent = begin.elapsed();
                Completed {
                    outcome: Outcome::Relit(relit, stepper.snapshot()),
                    stepper,
                    spent,
                }
            }
            Self::FinishRelighting(mut stepper, cancel) => {
                let report = stepper.finish_relighting(&cancel);
                let spent = begin.elapsed();
                Completed {
                    outcome: Outcome::RelitFinely(report, stepper.snapshot()),
                    stepper,
                    spent,
                }
            }
            Self::LightByLamp(mut stepper, cancel) => Completed {
                outcome: Outcome::ByLamp(stepper.light_by_lamp(&cancel)),
                stepper,
                spent: begin.elapsed(),
            },
            Self::Inspect(stepper, subjects) => {
                let found = subjects
                    .iter()
                    .filter_map(|subject| stepper.inspect(subject));
                Completed {
                    outcome: Outcome::Inspected(found.collect()),
                    stepper,
                    spent: begin.elapsed(),
                }
            }
        })
    }
}

/// The text of a panic.
pub(super) fn describe(panic: &(dyn Any + Send)) -> String {
    panic
        .downcast_ref::<String>()
        .map(String::as_str)
        .or_else(|| panic.downcast_ref::<&str>().copied())
        .unwrap_or("unknown reason")
        .to_owned()
}
