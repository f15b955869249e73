//! The memory budget: how much finer the solve may become before its limit would be exceeded.
//!
//! Room is asked for before links are made and elements divided, so that the limit holds at every moment and what was
//! computed before stays whole.

use super::{Solver, direct::DirectField};
use crate::transport::Link;

/// Bytes for each new link: it is collected in lists that may double, then sorted into the store.
const LINK_BYTES: u64 = 3 * size_of::<Link>() as u64 + 8;

/// Bytes for each new element: itself, its edges in three maps, vertices, tables, the memory of the iteration, and its
/// share of two snapshots. Measured: of 29,375 elements the process held 880 bytes each at its peak, 610 of them to stay.
/// Smaller, and the limit is overrun.
const ELEMENT_BYTES: u64 = 900;

/// Part of the free room that new elements may take; the rest is for their links.
const ELEMENT_PART: u64 = 2;

impl Solver {
    /// Bytes held.
    pub(super) fn memory_bytes(&self) -> u64 {
        let own = self.hierarchy.memory_bytes()
            + self.rays.memory_bytes()
            + self.power.memory_bytes()
            + self.links.memory_bytes()
            + self.closures.memory_bytes()
            + size_of_val(self.linked.as_slice())
            + size_of_val(self.sending.as_slice())
            + size_of_val(self.leaves.as_slice())
            + size_of_val(self.gathered.as_slice())
            + self.direct.as_ref().map_or(0, DirectField::memory_bytes)
            + self.relighting.memory_bytes()
            + self.snapshot.memory_bytes();
        own as u64
    }

    /// Bytes that may still be taken, beside what an iteration needs.
    fn free_bytes(&self) -> u64 {
        let Some(limit) = self.memory_limit else {
            return u64::MAX;
        };
        let iteration = Self::iteration_bytes(self.hierarchy.mesh.elements.len()) as u64;
        limit.saturating_sub(self.memory_bytes() + iteration)
    }

    /// Links that a refinement may have while the present ones are kept.
    pub(super) fn most_links(&self) -> u64 {
        self.free_bytes() / LINK_BYTES
    }

    /// Elements that there may be.
    pub(super) fn most_elements(&self) -> u64 {
        let present = self.hierarchy.mesh.elements.len() as u64;
        present.saturating_add(self.free_bytes() / ELEMENT_PART / ELEMENT_BYTES)
    }

    /// Whether the memory limit is reached.
    pub(super) fn is_out_of_memory(&self) -> bool {
        self.is_full
            || self
                .memory_limit
                .is_some_and(|limit| self.memory_bytes() > limit)
    }
}
