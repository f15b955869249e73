//! `--reference`: the error of every step against path tracing.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, PoisonError},
};

use crate::{
    geometry::RayTree,
    metrics::{ErrorMeasures, MeshLookup, measure_error},
    reference::{PathSettings, PathTracer, ReferencePoint},
    scene::Scene,
    solver::{Cancel, Snapshot, SolveSettings, Solver, StepReport},
    worker::{Job, MakeStepper, Stepper},
};

/// Errors by step, filled while the solve runs.
pub(super) type Errors = Arc<Mutex<BTreeMap<u32, ErrorMeasures>>>;

/// Path-trace the reference; `None` when cancelled.
pub(super) fn trace(
    scene: &Arc<Scene>,
    samples: u32,
    seed: u64,
    cancel: &(dyn Fn() -> bool + Sync),
) -> Option<Vec<ReferencePoint>> {
    let rays = Arc::new(RayTree::new(scene));
    let settings = PathSettings {
        samples_per_pass: samples,
        seed,
        ..PathSettings::default()
    };
    let mut tracer = PathTracer::new(scene.clone(), rays, settings);
    tracer.pass(cancel).then(|| tracer.result().points)
}

/// Makes solvers that measure the error of each snapshot. The measuring counts as elapsed, not as solved time.
pub(super) fn measured_solvers(points: Vec<ReferencePoint>, errors: Errors) -> MakeStepper {
    let points = Arc::new(points);
    Arc::new(move |job: Job| {
        Box::new(MeasuredSolver {
            solver: Solver::new(job.scene, job.settings, job.memory_limit),
            points: points.clone(),
            errors: errors.clone(),
        }) as Box<dyn Stepper>
    })
}

struct MeasuredSolver {
    solver: Solver,
    points: Arc<Vec<ReferencePoint>>,
    errors: Errors,
}

impl Stepper for MeasuredSolver {
    fn step(&mut self, cancel: &Cancel) -> Option<StepReport> {
        self.solver.step(cancel)
    }

    fn snapshot(&self) -> Snapshot {
        let snapshot = self.solver.snapshot();
        let lookup = MeshLookup::new(self.solver.scene(), &snapshot.mesh);
        let measured = lookup.radiance(&snapshot.light, &self.points);
        if let Some(error) = measure_error(&measured, &self.points) {
            self.errors
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .insert(snapshot.step, error);
        }
        snapshot
    }

    fn change_settings(&mut self, settings: SolveSettings) {
        self.solver.change_settings(settings);
    }
}
