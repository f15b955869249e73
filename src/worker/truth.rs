//! The reference thread: traces random surface points pass by pass, and measures every snapshot that is handed in.
//!
//! [`TruthHandle`] owns the thread; dropping it cancels the pass under way and joins. What was looked up of a snapshot
//! is kept and compared anew after each pass, so that the first error shows after a second and all of them, those of
//! earlier runs too, get better as samples grow. Snapshots themselves are not kept.

use std::{
    collections::{BTreeMap, VecDeque},
    io,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc, Condvar, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    thread::{self, JoinHandle},
};

use glam::Vec3;
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::{Generation, Wake, Watch, controller::describe};
use crate::{
    geometry::RayTree,
    metrics::{ErrorMeasures, MeshLookup, VertexReference, measure_error},
    reference::{PathSettings, PathTracer, ReferencePoint},
    scene::Scene,
    solver::{DisplayMesh, Snapshot},
};

/// Samples of a pass at each point. Fewer pay more for comparing than for tracing, more let the first error wait.
const SAMPLES_PER_PASS: u32 = 16;

/// Samples at each point after which tracing rests. Fewer cannot tell errors of one per cent, more take minutes.
pub const SAMPLE_GOAL: u32 = 512;

/// Snapshots that wait to be measured at most; the oldest then go unmeasured. More hold the memory of large meshes.
const MOST_WAITING: usize = 8;

/// Samples at each point before any at vertices: figures come first.
const FIRST_SAMPLES: u32 = 64;

/// A step that was measured: number of the run, number of the step.
pub type MeasuredStep = (u64, u32);

/// Errors at the vertices of a mesh.
#[derive(Clone, Debug, Default)]
pub struct VertexErrors {
    /// The mesh.
    pub mesh: Arc<DisplayMesh>,
    /// Error of the radiance at each vertex, in per cent of the reference's root mean square.
    pub percent: Arc<Vec<f32>>,
}

/// What is known so far.
#[derive(Clone, Debug, Default)]
pub struct TruthProgress {
    /// Surface points.
    pub points: usize,
    /// Samples at each of them.
    pub samples: u32,
    /// Samples after which tracing rests.
    pub goal: u32,
    /// Errors by run and step.
    pub errors: BTreeMap<MeasuredStep, ErrorMeasures>,
    /// Errors at vertices, where they were asked for.
    pub vertices: Option<VertexErrors>,
    /// Samples at each vertex, and the share of the next pass that is done.
    pub vertex_samples: (u32, f32),
    /// Why there will be no more.
    pub failed: Option<String>,
}

/// What the owner wants.
#[derive(Default)]
struct Wishes {
    waiting: VecDeque<(u64, Arc<Snapshot>)>,
    forgotten: Vec<u64>,
    goal: u32,
    rests: bool,
    /// Whose vertices are to be compared.
    compared: Option<Arc<Snapshot>>,
}

/// The place where owner and thread meet.
struct Desk {
    wishes: Mutex<Wishes>,
    changed: Condvar,
    cancelled: AtomicBool,
    /// Whether the solver is at work: tracing then takes one thread only.
    yields: AtomicBool,
    newest: Mutex<Arc<TruthProgress>>,
}

impl Desk {
    fn wishes(&self) -> MutexGuard<'_, Wishes> {
        // Each wish is put down whole, so a poisoned lock guards nothing broken.
        self.wishes.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn change(&self, change: impl FnOnce(&mut Wishes)) {
        change(&mut self.wishes());
        self.changed.notify_all();
    }

    fn measure(&self, run: u64, snapshot: Arc<Snapshot>) {
        self.change(|wishes| {
            if wishes.waiting.len() >= MOST_WAITING {
                wishes.waiting.pop_front();
            }
            wishes.waiting.push_back((run, snapshot));
        });
    }

    fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}

/// The owner's end of the reference thread. Dropping it cancels what is under way and joins.
pub struct TruthHandle {
    desk: Arc<Desk>,
    thread: Option<JoinHandle<()>>,
}

impl TruthHandle {
    /// Begin to trace a scene; `rays` is its ray tree. `wake` is called whenever there is something new.
    ///
    /// # Errors
    /// When the system refuses a thread.
    pub fn spawn(scene: Arc<Scene>, rays: Arc<RayTree>, seed: u64, wake: Wake) -> io::Result<Self> {
        let desk = Arc::new(Desk {
            wishes: Mutex::new(Wishes {
                goal: SAMPLE_GOAL,
                ..Wishes::default()
            }),
            changed: Condvar::new(),
            cancelled: AtomicBool::new(false),
            yields: AtomicBool::new(false),
            newest: Mutex::default(),
        });
        let shared = desk.clone();
        let thread = thread::Builder::new()
            .name("reference".to_owned())
            .spawn(move || {
                let work = || Tracing::new(scene, rays, seed, shared.clone(), wake.clone()).run();
                if let Err(panic) = catch_unwind(AssertUnwindSafe(work)) {
                    let mut newest = shared.newest.lock().unwrap_or_else(PoisonError::into_inner);
                    Arc::make_mut(&mut newest).failed = Some(describe(panic.as_ref()));
                    drop(newest);
                    wake();
                }
            })?;
        Ok(Self {
            desk,
            thread: Some(thread),
        })
    }

    /// Measure a snapshot of a run. Never waits.
    pub fn measure(&self, run: u64, snapshot: Arc<Snapshot>) {
        self.desk.measure(run, snapshot);
    }

    /// For [`WorkerHandle::watch`](super::WorkerHandle::watch): measures every lit snapshot, however fast they follow.
    pub fn watch(&self) -> Watch {
        let desk = self.desk.clone();
        Arc::new(move |generation: Generation, snapshot: &Arc<Snapshot>| {
            if snapshot.step > 0 {
                desk.measure(generation.number(), snapshot.clone());
            }
        })
    }

    /// Compare the vertices of a snapshot, too, until told otherwise.
    pub fn compare_vertices(&self, snapshot: Option<Arc<Snapshot>>) {
        self.desk.change(|wishes| wishes.compared = snapshot);
    }

    /// Forget the errors of a run.
    pub fn forget(&self, run: u64) {
        self.desk.change(|wishes| {
            wishes.waiting.retain(|(waiting, _)| *waiting != run);
            wishes.forgotten.push(run);
        });
    }

    /// Rest, or go on from where it stands. A resting reference still measures.
    pub fn rest(&self, rests: bool) {
        self.desk.change(|wishes| wishes.rests = rests);
    }

    /// Whether it was told to rest.
    pub fn rests(&self) -> bool {
        self.desk.wishes().rests
    }

    /// Trace as many samples again.
    pub fn trace_more(&self) {
        self.desk.change(|wishes| wishes.goal *= 2);
    }

    /// Leave all processors but one to the solver, or take them.
    pub fn yield_to_solver(&self, yields: bool) {
        self.desk.yields.store(yields, Ordering::Relaxed);
    }

    /// What is known so far. The same `Arc` as before where there is nothing newer.
    pub fn progress(&self) -> Arc<TruthProgress> {
        self.desk
            .newest
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }
}

impl Drop for TruthHandle {
    fn drop(&mut self) {
        self.desk.cancelled.store(true, Ordering::Relaxed);
        // With the lock taken and let go, the thread either sees the flag or waits for this call.
        self.desk.change(|_| {});
        if let Some(thread) = self.thread.take() {
            // A panic was caught and told.
            let _ = thread.join();
        }
    }
}

/// What to do next.
enum Task {
    Measure(u64, Arc<Snapshot>),
    Forget(Vec<u64>),
    TracePoints,
    TraceVertices,
    CompareVertices(Option<Arc<Snapshot>>),
    End,
}

/// The state of the thread.
struct Tracing {
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
    fn new(scene: Arc<Scene>, rays: Arc<RayTree>, seed: u64, desk: Arc<Desk>, wake: Wake) -> Self {
        let settings = PathSettings {
            samples_per_pass: SAMPLES_PER_PASS,
            seed,
            ..PathSettings::default()
        };
        let tracer = PathTracer::new(scene.clone(), rays.clone(), settings);
        let points = tracer.result().points;
        Self {
            scene,
            rays,
            seed,
            desk,
            wake,
            tracer,
            progress: TruthProgress {
                points: points.len(),
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
    fn run(mut self) {
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

    /// What is most urgent; waits while there is nothing.
    fn next_task(&mut self) -> Task {
        let desk = self.desk.clone();
        let mut wishes = desk.wishes();
        loop {
            if desk.is_cancelled() {
                return Task::End;
            }
            self.progress.goal = wishes.goal;
            if !wishes.forgotten.is_empty() {
                return Task::Forget(std::mem::take(&mut wishes.forgotten));
            }
            if let Some((run, snapshot)) = wishes.waiting.pop_front() {
                return Task::Measure(run, snapshot);
            }
            if !is_same(&wishes.compared, &self.compared) {
                return Task::CompareVertices(wishes.compared.clone());
            }
            if !wishes.rests
                && let Some(task) = self.tracing_task(wishes.goal)
            {
                return task;
            }
            wishes = desk
                .changed
                .wait(wishes)
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
                let held = self.vertices.take();
                self.vertices = Some(match held {
                    Some(held) if Arc::ptr_eq(held.mesh(), &snapshot.mesh) => held,
                    Some(held) => held.on_mesh(&snapshot.mesh),
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
    let held = &mut pools[usize::from(!is_narrow)];
    if held.is_none() {
        *held = ThreadPoolBuilder::new()
            .num_threads(usize::from(is_narrow))
            .thread_name(|index| format!("reference {index}"))
            .build()
            .ok();
    }
    held.as_ref()
}

/// Work in a pool, or in rayon's own where there is none.
fn within<R: Send>(pool: Option<&ThreadPool>, work: impl FnOnce() -> R + Send) -> R {
    match pool {
        Some(pool) => pool.install(work),
        None => work(),
    }
}
