//! A visit of the solve to the pool: to be prepared, to step, or to answer.

use std::{
    any::Any,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::Arc,
    time::{Duration, Instant},
};

use super::{Generation, Job, MakeStepper, Stepper};
use crate::{
    scene::Appearance,
    solver::{Cancel, Inspection, Relit, Snapshot, StepReport, Subject},
};

/// A solve on its way to the pool.
pub(super) struct Visit {
    /// The run that it belongs to.
    pub generation: Generation,
    /// What is to be done there.
    pub errand: Errand,
}

/// What there is to do in the pool.
pub(super) enum Errand {
    /// Make a solve, unless cancelled.
    Prepare(MakeStepper, Job, Cancel),
    /// Make one step, unless cancelled.
    Step(Box<dyn Stepper>, Cancel),
    /// Light materials that look otherwise, unless cancelled.
    Relight(Box<dyn Stepper>, Arc<[Appearance]>, Cancel),
    /// Work out what relighting left out, unless cancelled.
    FinishRelighting(Box<dyn Stepper>, Cancel),
    /// Look into nodes.
    Inspect(Box<dyn Stepper>, Vec<Subject>),
}

/// The solve on its way back.
pub(super) struct Returned {
    /// The run that it belongs to.
    pub generation: Generation,
    /// What the visit brought, nothing where there is no solve yet, or the text of a panic.
    pub trip: Result<Option<Trip>, String>,
}

/// What a visit brought.
pub(super) struct Trip {
    /// The solve.
    pub stepper: Box<dyn Stepper>,
    /// What came of it.
    pub outcome: Outcome,
    /// Time that it took.
    pub spent: Duration,
}

/// What came of an errand.
pub(super) enum Outcome {
    /// The solve is ready.
    Prepared(Snapshot),
    /// A step is done, or was cancelled.
    Stepped(Option<StepReport>, Snapshot),
    /// Materials look otherwise, or it was cancelled.
    Relit(Option<Relit>, Snapshot),
    /// What relighting left out is there, or it was cancelled.
    RelitFinely(Option<StepReport>, Snapshot),
    /// Nodes were looked into.
    Inspected(Vec<Inspection>),
}

impl Visit {
    /// Do what there is to do.
    pub(super) fn pay(self) -> Returned {
        let Self { generation, errand } = self;
        let trip = catch_unwind(AssertUnwindSafe(move || errand.run()));
        Returned {
            generation,
            trip: trip.map_err(|panic| describe(&*panic)),
        }
    }
}

impl Errand {
    fn run(self) -> Option<Trip> {
        let begin = Instant::now();
        Some(match self {
            Self::Prepare(make, job, cancel) => {
                let stepper = make(job, &cancel)?;
                let spent = begin.elapsed();
                Trip {
                    outcome: Outcome::Prepared(stepper.snapshot()),
                    stepper,
                    spent,
                }
            }
            Self::Step(mut stepper, cancel) => {
                let report = stepper.step(&cancel);
                let spent = begin.elapsed();
                Trip {
                    outcome: Outcome::Stepped(report, stepper.snapshot()),
                    stepper,
                    spent,
                }
            }
            Self::Relight(mut stepper, appearances, cancel) => {
                let relit = stepper.relight(&appearances, &cancel);
                let spent = begin.elapsed();
                Trip {
                    outcome: Outcome::Relit(relit, stepper.snapshot()),
                    stepper,
                    spent,
                }
            }
            Self::FinishRelighting(mut stepper, cancel) => {
                let report = stepper.finish_relighting(&cancel);
                let spent = begin.elapsed();
                Trip {
                    outcome: Outcome::RelitFinely(report, stepper.snapshot()),
                    stepper,
                    spent,
                }
            }
            Self::Inspect(stepper, subjects) => {
                let found = subjects
                    .iter()
                    .filter_map(|subject| stepper.inspect(subject));
                Trip {
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
