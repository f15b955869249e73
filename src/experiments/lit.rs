//! A finished solve.

use std::sync::Arc;

use glam::Vec3;

use crate::{
    metrics::MeshLookup,
    reference::ReferencePoint,
    scene::Scene,
    solver::{Cancel, Snapshot, SolveSettings, Solver},
};

/// A finished solve.
#[derive(Clone, Debug)]
pub(super) struct Lit {
    pub(super) scene: Arc<Scene>,
    pub(super) snapshot: Snapshot,
    /// Whether the memory limit prevented finer links or elements.
    pub(super) is_full: bool,
}

impl Lit {
    /// Light a scene to the end within so many bytes. `None` when cancelled.
    pub(super) fn new(
        scene: Arc<Scene>,
        settings: &SolveSettings,
        memory_limit: Option<u64>,
        cancel: &Cancel,
    ) -> Option<Self> {
        let mut solver = Solver::new(scene.clone(), settings.clone(), memory_limit, cancel)?;
        let last = loop {
            let report = solver.step(cancel)?;
            if report.is_final {
                break report;
            }
        };
        Some(Self {
            scene,
            snapshot: solver.snapshot(),
            is_full: last.is_full,
        })
    }

    /// Irradiance at points of the scene, W/m²; `None` where the mesh does not cover a point.
    pub(super) fn irradiance(&self, points: &[ReferencePoint]) -> Vec<Option<Vec3>> {
        let lookup = MeshLookup::new(&self.scene, &self.snapshot.mesh);
        let mut found = lookup.irradiance(&self.snapshot.light, points);
        for irradiance in found.iter_mut().flatten() {
            *irradiance *= self.scene.radiance_unit;
        }
        found
    }
}
