//! Gloss of the vertex view, computed in the background while no light is.

use std::{
    sync::{
        Arc,
        mpsc::{self, Receiver},
    },
    thread,
};

use super::state::State;
use crate::{
    picture::{GlossLight, gloss_at_vertices},
    solver::{Cancel, Snapshot},
    worker::{self, Wake},
};

/// Gloss of the newest light for which there is any.
#[derive(Default)]
pub(super) struct Glossing {
    /// Arcs are stored, so that no address is reused.
    ready: Option<(Arc<Snapshot>, Arc<GlossLight>)>,
    work: Option<Work>,
}

/// Gloss that is being computed.
struct Work {
    snapshot: Arc<Snapshot>,
    cancel: Cancel,
    result: Receiver<GlossLight>,
}

impl Drop for Work {
    fn drop(&mut self) {
        self.cancel.cancel();
    }
}

impl Glossing {
    /// Gloss at the vertices of a snapshot, be it of earlier light.
    pub(super) fn of(&self, snapshot: &Snapshot) -> Option<Arc<GlossLight>> {
        let (known, gloss) = self.ready.as_ref()?;
        Arc::ptr_eq(&known.mesh, &snapshot.mesh).then(|| gloss.clone())
    }

    /// Take what was computed, and compute what the state shows.
    pub(super) fn renew(&mut self, state: &State, wake: &Wake) {
        let result = self
            .work
            .as_ref()
            .and_then(|work| Some((work.snapshot.clone(), work.result.try_recv().ok()?)));
        if let Some((snapshot, gloss)) = result {
            self.ready = Some((snapshot, Arc::new(gloss)));
            self.work = None;
        }
        let Some(wanted) = wanted(state) else {
            self.work = None;
            return;
        };
        let ready = self.ready.as_ref().map(|(snapshot, _)| snapshot);
        let asked = self.work.as_ref().map(|work| &work.snapshot);
        let is_wanted = |known: &Arc<Snapshot>| Arc::ptr_eq(known, wanted);
        if !ready.into_iter().chain(asked).any(is_wanted) {
            self.work = Work::begin(wanted, state, wake.clone());
        }
    }
}

/// The light that gloss is to be shown of: one that is not about to be replaced.
fn wanted(state: &State) -> Option<&Arc<Snapshot>> {
    let (loaded, snapshot) = (state.loaded.as_ref()?, state.run.snapshot.as_ref()?);
    let is_at_rest = !state.run.status.is_busy() && state.loading.is_none();
    let is_wanted = state.view.shows_gloss() && loaded.scene.has_specular() && is_at_rest;
    (is_wanted && snapshot.is_lit()).then_some(snapshot)
}

impl Work {
    /// Compute on a thread of its own.
    fn begin(snapshot: &Arc<Snapshot>, state: &State, wake: Wake) -> Option<Self> {
        let (scene, rays) = (state.lit_scene()?, state.loaded.as_ref()?.rays.clone());
        let (sender, result) = mpsc::channel();
        let cancel = Cancel::default();
        let (stop, lit) = (cancel.clone(), snapshot.clone());
        let work = move || {
            let gloss = || gloss_at_vertices(&scene, &rays, &lit, &stop);
            let gloss = match worker::pool_that_gives_way("gloss", 0) {
                Some(pool) => pool.install(gloss),
                None => gloss(),
            };
            if let Some(gloss) = gloss {
                // Nobody listens where other light is shown by now.
                let _ = sender.send(gloss);
                wake();
            }
        };
        // Without a thread there is no gloss.
        let _ = thread::Builder::new().name("gloss".to_owned()).spawn(work);
        Some(Self {
            snapshot: snapshot.clone(),
            cancel,
            result,
        })
    }
}
