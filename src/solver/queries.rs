//! What a solve tells of itself, and what may change on the way.

use std::sync::Arc;

use super::{Inspection, Snapshot, SolveSettings, Solver, Subject, shown::Inspector};
use crate::{
    hierarchy::Hierarchy,
    scene::{Appearance, Scene},
    transport::LinkStore,
};

impl Solver {
    /// What the solve knows of a node, or `None` where there is no such node.
    pub fn inspect(&self, subject: &Subject) -> Option<Inspection> {
        let inspector = Inspector {
            surfaces: self.surfaces(),
            linked: &self.linked,
            reading: self.settings.method.reading(),
            coverage: &self.coverage,
            leaves: &self.leaves,
            boxes: &self.snapshot.clusters,
            step: self.step,
        };
        inspector.inspect(subject)
    }

    /// The state as it stands. Cheap: parts are shared.
    pub fn snapshot(&self) -> Snapshot {
        self.snapshot.clone()
    }

    /// Go on under other settings; what is computed stays. Only for changes that do not call for a new start: the
    /// threshold, the tolerances, the smallest area and the number of steps.
    pub fn change_settings(&mut self, settings: SolveSettings) {
        self.settings = settings;
    }

    /// The scene being lit.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// How materials look, by material: as the scene says, or as was last wished.
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
