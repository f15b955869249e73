//! A thread for work that takes too long for a frame of a large scene: handing mesh, light and boxes to the
//! adapter, choosing and colouring the boxes, looking up the light at the picked point, letting go of what was replaced.
//!
//! The window requests a picture and continues with the one that is ready. Only the newest request is fulfilled.

use std::{
    any::Any,
    io,
    sync::{
        Arc,
        mpsc::{self, Receiver, Sender},
    },
    thread,
};

use super::{
    cluster_lines,
    clusters::ShownClusters,
    pick::{self, ObjectLight, Pick, Probe},
    render::{BoxInstance, Gpu, RenderError, Source, Uploads},
    view::{ClusterOverlay, ViewMode},
};
use crate::{
    metrics::ErrorMap,
    picture::GlossLight,
    scene::{Scene, TriangleId},
    solver::{ClusterBox, Snapshot},
    worker::Wake,
};

/// The picture that the window wants. Arcs are stored, so that no address is reused.
#[derive(Clone)]
pub struct Wanted {
    /// The scene.
    pub scene: Arc<Scene>,
    /// Its mesh, light and clusters.
    pub snapshot: Arc<Snapshot>,
    /// Measured errors at its vertices in per cent, where they are shown.
    pub errors: Option<Arc<Vec<f32>>>,
    /// What gloss reflects at its vertices, where that is known and shown.
    pub gloss: Option<Arc<GlossLight>>,
    /// The view mode.
    pub mode: ViewMode,
    /// Ends of the false colours of that mode.
    pub range: [f32; 2],
    /// Whether edges are drawn.
    pub edges: bool,
    /// Which boxes are drawn.
    pub clusters: ClusterOverlay,
    /// The picked point, and the triangles of the object that it lies on.
    pub picked: Option<(Pick, Option<[TriangleId; 2]>)>,
}

impl PartialEq for Wanted {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.scene, &other.scene)
            && Arc::ptr_eq(&self.snapshot, &other.snapshot)
            && self.errors.as_ref().map(Arc::as_ptr) == other.errors.as_ref().map(Arc::as_ptr)
            && self.gloss.as_ref().map(Arc::as_ptr) == other.gloss.as_ref().map(Arc::as_ptr)
            && self.mode == other.mode
            && self.range == other.range
            && self.edges == other.edges
            && self.clusters == other.clusters
            && self.picked == other.picked
    }
}

/// A picture that is ready to be shown.
pub struct Staged {
    /// The request.
    pub wanted: Wanted,
    /// Its uploads; `None` without an adapter.
    pub uploads: Option<Uploads>,
    /// Errors at the vertices in per cent, where the mode shows them and they are known.
    pub errors: Option<Arc<Vec<f32>>>,
    /// Why there is no mesh among it.
    pub error: Option<RenderError>,
    /// Whether there is light.
    pub is_lit: bool,
    /// The clusters that boxes are drawn of.
    pub clusters: ShownClusters,
    /// Values of the ends of their colours, as [`cluster_lines::ColoredBoxes`] has them.
    pub box_ends: [f32; 2],
    /// Light at the picked point.
    pub probe: Option<Probe>,
    /// Light over its object.
    pub object_light: ObjectLight,
}

/// A command to the thread.
enum Order {
    Show(Box<Wanted>),
    Drop(Box<dyn Any + Send>),
}

/// The window's end of the thread, which ends with it.
pub struct Stage {
    orders: Sender<Order>,
    staged: Receiver<Staged>,
    asked: Option<Wanted>,
}

impl Stage {
    /// Start the thread, with what it uploads to and from where it goes on.
    ///
    /// # Errors
    /// When the system refuses a thread.
    pub fn spawn(adapter: Option<(Gpu, Uploads)>, wake: Wake) -> io::Result<Self> {
        let (orders, inbox) = mpsc::channel();
        let (outbox, staged) = mpsc::channel();
        let mut hand = StageHand {
            adapter,
            clusters: ShownClusters::default(),
            boxes: Boxes::default(),
            estimated: None,
        };
        thread::Builder::new()
            .name("stage".to_owned())
            .spawn(move || {
                while let Some(wanted) = newest(&inbox) {
                    if outbox.send(hand.stage(*wanted)).is_err() {
                        break;
                    }
                    wake();
                }
            })?;
        Ok(Self {
            orders,
            staged,
            asked: None,
        })
    }

    /// Ask for what is to be shown, unless it was asked for already.
    pub fn want(&mut self, wanted: Wanted) {
        if self.asked.as_ref() != Some(&wanted) {
            let replaced = self.asked.replace(wanted.clone());
            self.order(Order::Show(Box::new(wanted)));
            self.drop_later(replaced);
        }
    }

    /// Forget what was asked for: what comes of it is not shown.
    pub fn forget(&mut self) {
        let asked = self.asked.take();
        self.drop_later(asked);
    }

    /// The newest picture that is ready, if it is of the present run.
    pub fn poll(&mut self) -> Option<Staged> {
        let newest = self.staged.try_iter().last()?;
        let is_of_run = |asked: &Wanted| Arc::ptr_eq(&asked.scene, &newest.wanted.scene);
        self.asked.as_ref().is_some_and(is_of_run).then_some(newest)
    }

    /// Drop something large on the thread, where no frame waits for it.
    pub fn drop_later(&self, large: impl Send + 'static) {
        self.order(Order::Drop(Box::new(large)));
    }

    fn order(&self, order: Order) {
        // After a panic of the thread, which has been printed, the last picture stays.
        let _ = self.orders.send(order);
    }
}

/// The newest request; older ones are discarded, and large values are dropped. `None` when the window is gone.
fn newest(inbox: &Receiver<Order>) -> Option<Box<Wanted>> {
    let mut newest = None;
    loop {
        let order = match &newest {
            None => inbox.recv().ok()?,
            Some(_) => match inbox.try_recv() {
                Ok(order) => order,
                Err(_) => return newest,
            },
        };
        match order {
            Order::Show(wanted) => newest = Some(wanted),
            Order::Drop(large) => drop(large),
        }
    }
}

/// Box instances, and what they were made from.
#[derive(Default)]
struct Boxes {
    of: Option<(Arc<Vec<ClusterBox>>, ClusterOverlay)>,
    instances: Arc<Vec<BoxInstance>>,
    ends: [f32; 2],
}

/// The thread's state.
struct StageHand {
    adapter: Option<(Gpu, Uploads)>,
    clusters: ShownClusters,
    boxes: Boxes,
    estimated: Option<Estimated>,
}

/// Estimated errors at vertices, where there are any, and of what.
struct Estimated {
    of: Arc<Snapshot>,
    errors: Option<Arc<Vec<f32>>>,
}

impl StageHand {
    fn stage(&mut self, wanted: Wanted) -> Staged {
        let tree = &wanted.snapshot.clusters;
        self.clusters.update(tree, &wanted.clusters);
        let overlay = wanted.clusters;
        let is_current = |(current, drawn): &(Arc<Vec<ClusterBox>>, ClusterOverlay)| {
            Arc::ptr_eq(current, tree) && *drawn == overlay
        };
        if !self.boxes.of.as_ref().is_some_and(is_current) {
            let boxes = cluster_lines::boxes(tree, &self.clusters.shown, &overlay);
            self.boxes = Boxes {
                of: Some((tree.clone(), overlay)),
                instances: Arc::new(boxes.instances),
                ends: boxes.ends,
            };
        }
        let errors = self.errors(&wanted);
        let error = self.upload(&wanted, errors.as_ref());
        let picked = wanted.picked.as_ref();
        Staged {
            uploads: self.adapter.as_ref().map(|(_, uploads)| uploads.clone()),
            errors,
            error,
            is_lit: wanted.snapshot.is_lit(),
            clusters: self.clusters.clone(),
            box_ends: self.boxes.ends,
            probe: picked.and_then(|(pick, _)| pick::probe(&wanted.snapshot, pick)),
            object_light: picked
                .and_then(|(_, object)| *object)
                .map(|[start, end]| pick::object_light(&wanted.snapshot, start, end))
                .unwrap_or_default(),
            wanted,
        }
    }

    /// The errors at the vertices that the mode shows.
    fn errors(&mut self, wanted: &Wanted) -> Option<Arc<Vec<f32>>> {
        if wanted.mode != ViewMode::EstimatedError {
            return wanted.errors.clone();
        }
        let is_current = |known: &Estimated| Arc::ptr_eq(&known.of, &wanted.snapshot);
        if !self.estimated.as_ref().is_some_and(is_current) {
            self.estimated = Some(Estimated {
                of: wanted.snapshot.clone(),
                errors: estimated_errors(&wanted.snapshot),
            });
        }
        self.estimated
            .as_ref()
            .and_then(|known| known.errors.clone())
    }

    fn upload(&mut self, wanted: &Wanted, errors: Option<&Arc<Vec<f32>>>) -> Option<RenderError> {
        let (gpu, uploads) = self.adapter.as_mut()?;
        let source = Source {
            scene: &wanted.scene,
            mesh: &wanted.snapshot.mesh,
            light: &wanted.snapshot.light,
            errors,
            gloss: wanted.gloss.as_ref(),
            mode: wanted.mode,
            edges: wanted.edges,
            boxes: &self.boxes.instances,
        };
        let error = uploads.renew(gpu, &source).err();
        // Copied from here, and not with the next frame.
        gpu.queue.submit([]);
        error
    }
}

/// Estimated errors at the vertices of a snapshot in per cent, where there is an estimate.
pub(super) fn estimated_errors(snapshot: &Snapshot) -> Option<Arc<Vec<f32>>> {
    let map = ErrorMap::new(&snapshot.errors);
    (!map.is_empty()).then(|| Arc::new(map.percent_at_vertices(&snapshot.mesh)))
}
