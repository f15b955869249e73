//! The way out of the worker.

use std::sync::{Arc, mpsc::Sender};

use super::{Event, Generation, Slot, Wake};
use crate::solver::Snapshot;

/// Where events and snapshots leave.
pub(super) struct Outbox {
    events: Sender<(Generation, Event)>,
    slot: Arc<Slot<Snapshot>>,
    wake: Wake,
}

impl Outbox {
    /// Events into a channel, snapshots into a slot, and a call to `wake` for each event.
    pub(super) fn new(
        events: Sender<(Generation, Event)>,
        slot: Arc<Slot<Snapshot>>,
        wake: Wake,
    ) -> Self {
        Self { events, slot, wake }
    }

    /// Put a snapshot into the slot.
    pub(super) fn publish(&self, generation: Generation, snapshot: Snapshot) {
        self.slot.publish(generation, Arc::new(snapshot));
    }

    /// Send an event, and wake the owner.
    pub(super) fn send(&self, generation: Generation, event: Event) {
        // Nobody listens once the handle is being dropped.
        let _ = self.events.send((generation, event));
        (self.wake)();
    }
}
