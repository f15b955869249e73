//! The work of the reference thread: which task is next, and how each is done.

use std::{
    collections::BTreeMap,
    sync::{Arc, PoisonError, atomic::Ordering},
};

use glam::Vec3;
use rayon::ThreadPool;

use super::{Desk, MeasuredStep, TruthProgress, VertexErrors};
use crate::{
    geometry::RayTree,
    metrics::{ErrorMeasures, MeshLookup, VertexReference, measure_error},
    reference::{PathSettings, PathTraced, PathTracer, ReferencePoint},
    scene::Scene,
    solver::Snapshot,
    worker::{Wake, priority::pool_that_gives_way},
};

/// Samples of a pass at each point. Fewer pay more for comparing than for tracing, more let the first error wait.
const SAMPLES_PER_PASS: u32 = 16;

/// Samples at each point before any at vertices: figures come first.
const FIRST_SAMPLES: u32 = 64;

/// The next task.
enum Task {
    Measure(u64, Arc<Snapshot>),
    Forget(Vec<u64>),
    TracePoints,
    TraceVertices,
    CompareVertices(Option<Arc<Snapshot>>),
    End,
}

/// The state of the thread.
pub(super) struct Tracing {
    scene: Arc<Scene>,
    rays: Arc<RayTree>,
    seed: u64,
    desk: Arc<Desk>,
    wake: Wake,
    tracer: PathTracer,
    points: Vec<ReferencePoint>,
    /// Radiance at the points, by run and step.
    measured: BTreeMap<MeasuredStep, Vec<Option<Vec3>>>,
    vertices: Option<VertexReference>,
    compared: Option<Arc<Snapshot>>,
    /// With one thread and with all of them.
    pools: [Option<ThreadPool>; 2],
    progress: TruthProgress,
}

impl Tracing {
    /// Choose the points; nothing is traced yet.
    pub(super) fn new(
        scene: Arc<Scene>,
        rays: Arc<RayTree>,
        seed: u64,
        desk: Arc<Desk>,
        wake: Wake,
    ) -> Self {
        let settings = PathSettings {
            samples_per_pass: SAMPLES_PER_PASS,
            seed,
            ..PathSettings::default()
        };
        let tracer = PathTracer::new(scene.clone(), rays.clone(), settings);
        let PathTraced {
            points, surfaces, ..
        } = tracer.result();
        Self {
            scene,
            rays,
            seed,
            desk,
            wake,
            tracer,
            progress: TruthProgress {
                points: points.len(),
                surfaces,
                ..TruthProgress::default()
            },
            points,
            measured: BTreeMap::new(),
            vertices: None,
            compared: None,
            pools: [None, None],
        }
    }

    /// Serve until cancelled.
    pub(super) fn run(mut self) {
        loop {
            match self.next_task() {
                Task::End => break,
                Task::Forget(runs) => {
                    let keeps = |step: &MeasuredStep| !runs.contains(&step.0);
                    self.measured.retain(|step, _| keeps(step));
                    self.progress.errors.retain(|step, _| keeps(step));
                }
                Task::Measure(run, snapshot) => self.measure(run, &snapshot),
                Task::TracePoints => self.trace_points(),
                Task::CompareVertices(snapshot) => self.compare(snapshot),
                Task::TraceVertices => self.trace_vertices(),
            }
            if !self.desk.is_cancelled() {
                self.publish();
            }
        }
    }

    /// The most urgent task; waits while there is none.
    fn next_task(&mut self) -> Task {
        let desk = self.desk.clone();
        let mut requests = desk.requests();
        loop {
            if desk.is_cancelled() {
                return Task::End;
            }
            self.progress.goal = requests.goal;
            if !requests.forgotten.is_empty() {
                return Task::Forget(std::mem::take(&mut requests.forgotten));
            }
            if let Some((run, snapshot)) = requests.waiting.pop_front() {
                return Task::Measure(run, snapshot);
            }
            if !is_same(&requests.compared, &self.compared) {
                return Task::CompareVertices(requests.compared.clone());
            }
            if !requests.rests
                && let Some(task) = self.tracing_task(requests.goal)
            {
                return task;
            }
            requests = desk
                .changed
                .wait(requests)
                .unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// The points and the vertices in turn, whichever has fewer samples.
    fn tracing_task(&self, goal: u32) -> Option<Task> {
        let at_points = self.progress.samples;
        let vertices = self.vertices.as_ref().filter(|_| self.compared.is_some());
        let at_vertices = vertices.map(VertexReference::samples);
        let first = FIRST_SAMPLES.min(goal);
        match at_vertices {
            Some(samples) if at_points >= first && samples < at_points.min(goal) => {
                Some(Task::TraceVertices)
            }
            _ => (at_points < goal).then_some(Task::TracePoints),
        }
    }

    fn trace_points(&mut self) {
        let desk = self.desk.clone();
        let pool = pool(&mut self.pools, desk.yields.load(Ordering::Relaxed));
        let tracer = &mut self.tracer;
        if within(pool, || tracer.pass(&|| desk.is_cancelled())) {
            let traced = self.tracer.result();
            self.points = traced.points;
            self.progress.samples = traced.samples;
            for (step, values) in &self.measured {
                note_error(&mut self.progress.errors, *step, values, &self.points);
            }
            self.note_vertices();
        }
    }

    fn measure(&mut self, run: u64, snapshot: &Snapshot) {
        let desk = self.desk.clone();
        let pool = pool(&mut self.pools, desk.yields.load(Ordering::Relaxed));
        let (scene, points) = (&self.scene, &self.points);
        let values = within(pool, || {
            MeshLookup::new(scene, &snapshot.mesh).radiance(&snapshot.light, points)
        });
        let step = (run, snapshot.step);
        if self.progress.samples > 0 {
            note_error(&mut self.progress.errors, step, &values, &self.points);
        }
        self.measured.insert(step, values);
    }

    /// Compare the vertices of another snapshot, or of none.
    fn compare(&mut self, snapshot: Option<Arc<Snapshot>>) {
        match &snapshot {
            None => self.progress.vertices = None,
            Some(snapshot) => {
                let present = self.vertices.take();
                self.vertices = Some(match present {
                    Some(present) if Arc::ptr_eq(present.mesh(), &snapshot.mesh) => present,
                    Some(present) => present.on_mesh(&snapshot.mesh),
                    // A seed of its own: the same paths as at the points would not be independent of them.
                    None => VertexReference::new(&snapshot.mesh, !self.seed),
                });
            }
        }
        self.compared = snapshot;
        self.note_vertices();
    }

    fn trace_vertices(&mut self) {
        let desk = self.desk.clone();
        let pool = pool(&mut self.pools, desk.yields.load(Ordering::Relaxed));
        let (scene, rays) = (&self.scene, &self.rays);
        let Some(vertices) = &mut self.vertices else {
            return;
        };
        let cancel = || desk.is_cancelled();
        if within(pool, || vertices.advance(scene, rays, &cancel)) == Some(true) {
            self.note_vertices();
        }
    }

    /// Bring the errors at vertices up to date.
    fn note_vertices(&mut self) {
        let (Some(vertices), Some(snapshot)) = (&self.vertices, &self.compared) else {
            return;
        };
        let unit = 0.01 * reference_rms(&self.points);
        let Some(percent) = vertices.errors(&snapshot.light, unit) else {
            return;
        };
        self.progress.vertices = Some(VertexErrors {
            mesh: vertices.mesh().clone(),
            percent: Arc::new(percent),
        });
    }

    fn publish(&mut self) {
        self.progress.vertex_samples = match (&self.vertices, &self.compared) {
            (Some(vertices), Some(_)) => (vertices.samples(), vertices.pass_share()),
            _ => (0, 0.0),
        };
        let newest = Arc::new(self.progress.clone());
        *self
            .desk
            .newest
            .lock()
            .unwrap_or_else(PoisonError::into_inner) = newest;
        (self.wake)();
    }
}

fn note_error(
    errors: &mut BTreeMap<MeasuredStep, ErrorMeasures>,
    step: MeasuredStep,
    values: &[Option<Vec3>],
    points: &[ReferencePoint],
) {
    if let Some(error) = measure_error(values, points) {
        errors.insert(step, error);
    }
}

/// Root mean square of the reference's radiance where nothing emits, W·sr⁻¹·m⁻².
fn reference_rms(points: &[ReferencePoint]) -> f64 {
    let nothing = vec![None; points.len()];
    measure_error(&nothing, points).map_or(0.0, |measures| measures.reference_rms)
}

fn is_same(a: &Option<Arc<Snapshot>>, b: &Option<Arc<Snapshot>>) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => Arc::ptr_eq(a, b),
        (None, None) => true,
        _ => false,
    }
}

/// The pool of one thread, or that of one for each core; none where the system refuses threads.
fn pool(pools: &mut [Option<ThreadPool>; 2], is_narrow: bool) -> Option<&ThreadPool> {
    let pool = &mut pools[usize::from(!is_narrow)];
    if pool.is_none() {
        *pool = pool_that_gives_way("reference", usize::from(is_narrow));
    }
    pool.as_ref()
}

/// Work in a pool, or in rayon's own where there is none.
fn within<R: Send>(pool: Option<&ThreadPool>, work: impl FnOnce() -> R + Send) -> R {
    match pool {
        Some(pool) => pool.install(work),
        None => work(),
    }
}
