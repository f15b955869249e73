//! A slot for one large value; a newer value replaces one that was not fetched.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::Generation;

/// The newest value of the newest run. The lock is held for the exchange of a pointer only.
#[derive(Debug)]
pub struct Slot<T> {
    newest: Mutex<Option<(Generation, Arc<T>)>>,
}

impl<T> Default for Slot<T> {
    fn default() -> Self {
        Self {
            newest: Mutex::new(None),
        }
    }
}

impl<T> Slot<T> {
    /// Put a value in, unless it belongs to an older run than the one that is there.
    pub fn publish(&self, generation: Generation, value: Arc<T>) {
        let mut newest = self.lock();
        if newest
            .as_ref()
            .is_none_or(|(present, _)| *present <= generation)
        {
            let replaced = newest.replace((generation, value));
            // The old value may be large: free it after the lock.
            drop(newest);
            drop(replaced);
        }
    }

    /// The newest value, if it belongs to `generation`.
    pub fn latest(&self, generation: Generation) -> Option<Arc<T>> {
        self.lock()
            .as_ref()
            .filter(|(present, _)| *present == generation)
            .map(|(_, value)| value.clone())
    }

    fn lock(&self) -> MutexGuard<'_, Option<(Generation, Arc<T>)>> {
        // A pointer is exchanged whole or not at all, so a poisoned lock guards nothing broken.
        self.newest.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_latest_value_is_kept() {
        let slot = Slot::default();
        let first = Generation::default();
        let values = [Arc::new(1), Arc::new(2)];
        for value in &values {
            slot.publish(first, value.clone());
        }
        assert_eq!(slot.latest(first).as_deref(), Some(&2));
        assert_eq!(Arc::strong_count(&values[0]), 1, "the old value is freed");
    }

    #[test]
    fn an_older_run_neither_replaces_nor_shows() {
        let slot = Slot::default();
        let (old, new) = (Generation::default(), Generation::default().next());
        slot.publish(new, Arc::new("new"));
        slot.publish(old, Arc::new("old"));
        assert_eq!(slot.latest(new).as_deref(), Some(&"new"));
        assert_eq!(slot.latest(old), None);
    }
}
