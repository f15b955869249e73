//! Further entry points of `Solver`: queries, and a change of settings.

use std::sync::Arc;

use super::{Inspection, Snapshot, SolveSettings, Solver, Subject, shown::Inspector};
use crate::{
    hierarchy::Hierarchy,
    scene::{Appearance, Scene},
    transport::LinkStore,
};

impl Solver {
    /// Links, path and sums of form factors of a node; `None` if there is no such node.
    pub fn inspect(&self, subject: &Subject) -> Option<Inspection> {
        let inspector = Inspector {
            surfaces: self.surfaces(),
            linked: &self.linked,
            reading: self.settings.method.reading(),
            is_clear: self.plan.is_clear,
            coverage: &self.coverage,
            leaves: &self.leaves,
            boxes: &self.snapshot.clusters,
            step: self.step,
        };
        inspector.inspect(subject)
    }

    /// The snapshot of the last whole step. Cheap: its parts are shared.
    pub fn snapshot(&self) -> Snapshot {
        self.snapshot.clone()
    }

    /// Continue with other settings; results stay. Only for changes that do not need a new solve: the threshold, the
    /// tolerances, the smallest area and the number of steps.
    pub fn change_settings(&mut self, settings: SolveSettings) {
        self.settings = settings;
    }

    /// The scene that is solved.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// Appearance by material: that of the scene, or the one last relit with.
    pub fn appearances(&self) -> &[Appearance] {
        &self.relighting.appearances
    }

    /// The settings in force.
    pub fn settings(&self) -> &SolveSettings {
        &self.settings
    }

    /// The hierarchy, for tests and inspection.
    pub fn hierarchy(&self) -> &Hierarchy {
        &self.hierarchy
    }

    /// The links, for tests and inspection.
    pub fn links(&self) -> &LinkStore {
        &self.linked.links
    }
}
