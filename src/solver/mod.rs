//! The solve as a value: [`Solver::new`], [`Solver::step`], [`Solver::snapshot`].
//! No threads of its own, no channel, no clock, no global.

mod settings;
mod snapshot;

use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};

pub use settings::{Direct, Method, Oracle, Push, SolveSettings};
pub use snapshot::{ClusterBox, DisplayMesh, Snapshot, StepReport, VertexLight};

use crate::scene::Scene;

/// A request to stop, seen by everything that runs long. Clones share one flag.
#[derive(Clone, Debug, Default)]
pub struct Cancel(Arc<AtomicBool>);

impl Cancel {
    /// Ask to stop.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether stopping was asked for.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// A solve in progress.
pub struct Solver {
    scene: Arc<Scene>,
    settings: SolveSettings,
    step: u32,
    mesh: Arc<DisplayMesh>,
}

impl Solver {
    /// Prepare a solve: hierarchy, ray tree, first mesh. `memory_limit` in bytes bounds what it will hold.
    pub fn new(scene: Arc<Scene>, settings: SolveSettings, memory_limit: Option<u64>) -> Self {
        let _ = memory_limit;
        let mut mesh = DisplayMesh::default();
        for id in scene.triangle_ids() {
            let corners = scene.corners(id);
            let base = mesh.positions.len() as u32;
            let surface = scene.surfaces[id.index()];
            for corner in corners {
                mesh.positions.push(corner);
                mesh.normals.push(surface.area_vector.normalize_or_zero());
                mesh.reflectance.push(surface.reflectance);
                mesh.emission.push(surface.emission);
            }
            mesh.indices.push([base, base + 1, base + 2]);
            mesh.triangle_of.push(id.0);
            mesh.is_back.push(false);
            mesh.element_of.push(id.0);
        }
        Self {
            scene,
            settings,
            step: 0,
            mesh: Arc::new(mesh),
        }
    }

    /// One progressive step: lower the threshold, refine, gather, push and pull.
    /// Returns `None` when cancelled on the way; the light is then that of the last whole sweep.
    pub fn step(&mut self, cancel: &Cancel) -> Option<StepReport> {
        if cancel.is_cancelled() {
            return None;
        }
        self.step += 1;
        Some(StepReport {
            step: self.step,
            is_final: self.step >= self.settings.max_steps,
            ..StepReport::default()
        })
    }

    /// The state as it stands. Cheap where the mesh did not change.
    pub fn snapshot(&self) -> Snapshot {
        let mesh = self.mesh.clone();
        let light = VertexLight {
            irradiance: mesh
                .normals
                .iter()
                .map(|n| glam::Vec3::splat(1.0 + n.y))
                .collect(),
            direct: vec![glam::Vec3::ZERO; mesh.normals.len()],
            uncertainty: vec![0.0; mesh.normals.len()],
        };
        Snapshot {
            step: self.step,
            mesh,
            light: Arc::new(light),
            clusters: Arc::default(),
        }
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

    /// The settings in force.
    pub fn settings(&self) -> &SolveSettings {
        &self.settings
    }
}
