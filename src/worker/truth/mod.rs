//! The reference thread: traces random surface points pass by pass, and measures every snapshot that is handed in.
//!
//! [`TruthHandle`] owns the thread; dropping it cancels the pass under way and joins. The radiance of a snapshot at the
//! points is stored and compared again after each pass, so that the first error shows after a second and all errors,
//! those of earlier runs too, become more accurate as samples grow. Snapshots themselves are not stored.

mod tracing;

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

use super::{Generation, Wake, Watch, request::describe};
use crate::{
    geometry::RayTree,
    metrics::ErrorMeasures,
    sampling::SampledSurfaces,
    scene::Scene,
    solver::{DisplayMesh, Snapshot},
};
use tracing::Tracing;

/// Samples at each point after which tracing rests. Fewer cannot tell errors of one per cent, more take minutes.
pub const SAMPLE_GOAL: u32 = 512;

/// Snapshots that wait to be measured at most; the oldest then go unmeasured. More hold the memory of large meshes.
const MOST_WAITING: usize = 8;

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

/// Progress so far.
#[derive(Clone, Debug, Default)]
pub struct TruthProgress {
    /// Surface points.
    pub points: usize,
    /// The surfaces that the points stand for.
    pub surfaces: SampledSurfaces,
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
    /// Why tracing failed, where it did.
    pub failed: Option<String>,
}

/// Requests of the owner.
#[derive(Default)]
struct Requests {
    waiting: VecDeque<(u64, Arc<Snapshot>)>,
    forgotten: Vec<u64>,
    goal: u32,
    rests: bool,
    /// Whose vertices are to be compared.
    compared: Option<Arc<Snapshot>>,
}

/// State shared by owner and thread.
struct Desk {
    requests: Mutex<Requests>,
    changed: Condvar,
    cancelled: AtomicBool,
    /// Whether the solver is at work: tracing then takes one thread only.
    yields: AtomicBool,
    newest: Mutex<Arc<TruthProgress>>,
}

impl Desk {
    fn requests(&self) -> MutexGuard<'_, Requests> {
        // Each request is stored whole, so a poisoned lock guards nothing broken.
        self.requests.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn change(&self, change: impl FnOnce(&mut Requests)) {
        change(&mut self.requests());
        self.changed.notify_all();
    }

    fn measure(&self, run: u64, snapshot: Arc<Snapshot>) {
        self.change(|requests| {
            if requests.waiting.len() >= MOST_WAITING {
                requests.waiting.pop_front();
            }
            requests.waiting.push_back((run, snapshot));
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
            requests: Mutex::new(Requests {
                goal: SAMPLE_GOAL,
                ..Requests::default()
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
        self.desk.change(|requests| requests.compared = snapshot);
    }

    /// Forget the errors of a run.
    pub fn forget(&self, run: u64) {
        self.desk.change(|requests| {
            requests.waiting.retain(|(waiting, _)| *waiting != run);
            requests.forgotten.push(run);
        });
    }

    /// Rest, or go on from where it stands. A resting reference still measures.
    pub fn rest(&self, rests: bool) {
        self.desk.change(|requests| requests.rests = rests);
    }

    /// Whether it was told to rest.
    pub fn rests(&self) -> bool {
        self.desk.requests().rests
    }

    /// Trace as many samples again.
    pub fn trace_more(&self) {
        self.desk.change(|requests| requests.goal *= 2);
    }

    /// Leave all processors but one to the solver, or take them.
    pub fn yield_to_solver(&self, yields: bool) {
        self.desk.yields.store(yields, Ordering::Relaxed);
    }

    /// The progress so far. The same `Arc` as before where there is nothing newer.
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
