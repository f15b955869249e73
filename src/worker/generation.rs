//! Numbers of runs.

/// Which run something belongs to; each start, reset and restart is a new one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Generation(u64);

impl Generation {
    /// Counts from 1 with the first run.
    pub fn number(self) -> u64 {
        self.0
    }

    /// The run after this one.
    pub(super) fn next(self) -> Self {
        Self(self.0 + 1)
    }
}
