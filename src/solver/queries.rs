//! Further entry points of `Solver`: queries, and a change of settings.

use std::sync::Arc;

use super::{
    Inspection, Snapshot, SolveSettings, Solver, Subject,
    shown::{Bounding, Inspector},
    sums,
};
use crate::{
    geometry::Image,
    hierarchy::{Hierarchy, luminance},
    scene::{Appearance, Scene},
    transport::LinkStore,
};

impl Solver {
    /// Links, path and sums of form factors of a node; `None` if there is no such node.
    pub fn inspect(&self, subject: &Subject) -> Option<Inspection> {
        let inspector = Inspector {
            surfaces: self.surfaces(),
            linked: &self.linked,
            bounding: self.bounding(),
            coverage: &self.coverage,
            leaves: &self.leaves,
            boxes: &self.snapshot.clusters,
            step: self.step,
        };
        inspector.inspect(subject)
    }

    /// What bounds of the light over links follow from.
    pub(super) fn bounding(&self) -> Bounding<'_> {
        let reading = self.settings.method.reading();
        Bounding {
            kernel: self.linked.kernel(&self.hierarchy, reading),
            links: &self.linked.links,
            is_clear: self.plan.is_clear,
        }
    }

    /// Bound of the error of the light over links, root mean square relative to the mean irradiance.
    pub(super) fn error_bound(&self) -> f32 {
        let (surfaces, linked) = (self.surfaces(), &self.linked);
        let mean = sums::mean(&self.hierarchy, |leaf| linked.total(surfaces, leaf));
        self.bounding()
            .relative_error(&self.leaves, luminance(mean))
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

    /// The links from images in mirrors, for tests.
    pub fn image_links(&self) -> impl Iterator<Item = (&Image, &LinkStore)> {
        let images = self.linked.images.iter();
        images.map(|image| (&*image.image, &image.links))
    }
}
