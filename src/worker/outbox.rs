//! The output of the worker: events and snapshots.

use std::sync::{Arc, PoisonError, mpsc::Sender};

use super::{Event, Generation, Slot, Wake, WatchCell};
use crate::solver::Snapshot;

/// Delivers events and snapshots.
pub(super) struct Outbox {
    events: Sender<(Generation, Event)>,
    slot: Arc<Slot<Snapshot>>,
    watch: WatchCell,
    wake: Wake,
}

impl Outbox {
    /// Events go into a channel, snapshots into a slot and to the observer; `wake` is called for each event.
    pub(super) fn new(
        events: Sender<(Generation, Event)>,
        slot: Arc<Slot<Snapshot>>,
        watch: WatchCell,
        wake: Wake,
    ) -> Self {
        Self {
            events,
            slot,
            watch,
            wake,
        }
    }

    /// Put a snapshot into the slot and pass it to the observer.
    pub(super) fn publish(&self, generation: Generation, snapshot: Snapshot) {
        let snapshot = Arc::new(snapshot);
        let watch = self.watch.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(watch) = watch.as_ref() {
            watch(generation, &snapshot);
        }
        drop(watch);
        self.slot.publish(generation, snapshot);
    }

    /// Send an event, and wake the owner.
    pub(super) fn send(&self, generation: Generation, event: Event) {
        // Nobody listens once the handle is being dropped.
        let _ = self.events.send((generation, event));
        (self.wake)();
    }
}
