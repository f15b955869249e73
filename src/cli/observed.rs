//! A solver that is looked at whenever it shows itself. The worker's clock of solved time stands still meanwhile.

use std::sync::Arc;

use crate::{
    scene::{Appearance, Scene},
    solver::{
        Cancel, Inspection, LampLight, Relit, Snapshot, SolveSettings, Solver, StepReport, Subject,
    },
    worker::{Job, MakeStepper, Stepper},
};

/// Receives the snapshots of a scene, the unlit one before the first step included.
type Observe = dyn Fn(&Scene, &Snapshot) + Send + Sync;

/// Makes solvers whose snapshots are all handed to `observe` first.
pub(super) fn observed_solvers(
    observe: impl Fn(&Scene, &Snapshot) + Send + Sync + 'static,
) -> MakeStepper {
    let observe: Arc<Observe> = Arc::new(observe);
    Arc::new(move |job: Job, cancel: &Cancel| {
        Some(Box::new(ObservedSolver {
            solver: job.solver(cancel)?,
            observe: observe.clone(),
        }) as Box<dyn Stepper>)
    })
}

struct ObservedSolver {
    solver: Solver,
    observe: Arc<Observe>,
}

impl Stepper for ObservedSolver {
    fn step(&mut self, cancel: &Cancel) -> Option<StepReport> {
        // As a stepper: with the seconds of each phase.
        Stepper::step(&mut self.solver, cancel)
    }

    fn finish(&mut self, cancel: &Cancel) -> Option<StepReport> {
        self.solver.finish(cancel)
    }

    fn snapshot(&self) -> Snapshot {
        let snapshot = self.solver.snapshot();
        (self.observe)(self.solver.scene(), &snapshot);
        snapshot
    }

    fn inspect(&self, subject: &Subject) -> Option<Inspection> {
        self.solver.inspect(subject)
    }

    fn change_settings(&mut self, settings: SolveSettings) {
        self.solver.change_settings(settings);
    }

    fn relight(&mut self, appearances: &[Appearance], cancel: &Cancel) -> Option<Relit> {
        self.solver.relight(appearances, cancel)
    }

    fn finish_relighting(&mut self, cancel: &Cancel) -> Option<StepReport> {
        self.solver.finish_relighting(cancel)
    }

    fn light_by_lamp(&mut self, cancel: &Cancel) -> Option<Vec<LampLight>> {
        self.solver.light_by_lamp(cancel)
    }
}
