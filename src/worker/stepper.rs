//! The solver as the worker runs it, so that tests can substitute it.

use std::{sync::Arc, time::Instant};

use crate::{
    geometry::RayTree,
    scene::{Appearance, Scene},
    solver::{
        Cancel, Inspection, LampLight, Phase, Relit, Snapshot, SolveSettings, Solver, StepReport,
        Subject,
    },
};

/// A solve that advances step by step.
pub trait Stepper: Send {
    /// One step, or `None` when cancelled on the way.
    fn step(&mut self, cancel: &Cancel) -> Option<StepReport>;

    /// Make the light of the last step as good as its links allow, where no further step can end in time. The report is that of
    /// the step once more; `None` when cancelled on the way.
    fn finish(&mut self, cancel: &Cancel) -> Option<StepReport>;

    /// The state as it stands.
    fn snapshot(&self) -> Snapshot;

    /// Inspect a node; `None` where there is no such node. Must be short: it delays the next step.
    fn inspect(&self, subject: &Subject) -> Option<Inspection>;

    /// Continue under settings whose change does not restart (see [`super::effect_of_change`]).
    fn change_settings(&mut self, settings: SolveSettings);

    /// Light the scene with these appearances, one for each material, without refining; `None` when cancelled.
    fn relight(&mut self, appearances: &[Appearance], cancel: &Cancel) -> Option<Relit>;

    /// Refine the preview that a relighting made; `None` when cancelled on the way.
    fn finish_relighting(&mut self, cancel: &Cancel) -> Option<StepReport>;

    /// The present light by lamp; `None` when cancelled on the way.
    fn light_by_lamp(&mut self, cancel: &Cancel) -> Option<Vec<LampLight>>;
}

/// The input of a stepper.
pub struct Job {
    /// The scene.
    pub scene: Arc<Scene>,
    /// Its ray tree, where there is one already.
    pub rays: Option<Arc<RayTree>>,
    /// The settings.
    pub settings: SolveSettings,
    /// Bytes that it may hold.
    pub memory_limit: Option<u64>,
    /// Appearances of the materials, where they differ from the scene.
    pub appearances: Option<Arc<[Appearance]>>,
}

impl Job {
    /// Prepare the solver for it, unless cancelled.
    pub fn solver(self, cancel: &Cancel) -> Option<Solver> {
        Solver::with_rays(
            self.scene,
            self.rays,
            self.settings,
            self.memory_limit,
            self.appearances.as_deref(),
            cancel,
        )
    }
}

/// Prepares a solve, or gives up when cancelled; called on a solver thread.
pub type MakeStepper = Arc<dyn Fn(Job, &Cancel) -> Option<Box<dyn Stepper>> + Send + Sync>;

impl Stepper for Solver {
    fn step(&mut self, cancel: &Cancel) -> Option<StepReport> {
        let mut begun: Vec<(Phase, Instant)> = Vec::new();
        let mut report = self.step_in_phases(cancel, &mut |phase, _| {
            begun.push((phase, Instant::now()));
        })?;
        let ends = begun.iter().skip(1).map(|(_, at)| *at);
        let ends = ends.chain([Instant::now()]);
        for (&(phase, begin), end) in begun.iter().zip(ends) {
            *report.phases.of_mut(phase) += end.duration_since(begin).as_secs_f64();
        }
        Some(report)
    }

    fn finish(&mut self, cancel: &Cancel) -> Option<StepReport> {
        Self::finish(self, cancel)
    }

    fn snapshot(&self) -> Snapshot {
        Self::snapshot(self)
    }

    fn inspect(&self, subject: &Subject) -> Option<Inspection> {
        Self::inspect(self, subject)
    }

    fn change_settings(&mut self, settings: SolveSettings) {
        Self::change_settings(self, settings);
    }

    fn relight(&mut self, appearances: &[Appearance], cancel: &Cancel) -> Option<Relit> {
        Self::relight(self, appearances, cancel)
    }

    fn finish_relighting(&mut self, cancel: &Cancel) -> Option<StepReport> {
        Self::finish_relighting(self, cancel)
    }

    fn light_by_lamp(&mut self, cancel: &Cancel) -> Option<Vec<LampLight>> {
        Self::light_by_lamp(self, cancel)
    }
}
