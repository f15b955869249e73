//! The memory budget: how much finer the solve may become before its limit would be exceeded.
//!
//! Room is asked for before links are made and elements divided, so that the limit holds at every moment and what was
//! computed before stays whole.

use super::{
    direct::{DirectField, Surfaces},
    iteration::{LinkedLight, iteration_bytes},
};
use crate::transport::Link;

/// Bytes for each new link: it is collected in lists that may double, then sorted into the store.
const LINK_BYTES: u64 = 3 * size_of::<Link>() as u64 + 8;

/// Bytes for each new element: itself, its edges in three maps, vertices, tables, the memory of the iteration, and its
/// share of two snapshots. Measured: of 29,375 elements the process held 880 bytes each at its peak, 610 of them to stay.
/// Smaller, and the limit is overrun.
const ELEMENT_BYTES: u64 = 900;

/// Part of the free room that new elements may take; the rest is for their links.
const ELEMENT_PART: u64 = 2;

/// The memory limit, and what is held whatever becomes of the mesh and its light.
#[derive(Clone, Copy)]
pub(super) struct Budget {
    /// Bytes that may be held; `None` for any number.
    pub limit: Option<u64>,
    /// Bytes held beside the mesh and its light.
    pub others: u64,
}

impl Budget {
    /// Bytes held in all.
    pub(super) fn used_bytes(&self, surfaces: Surfaces<'_>, linked: &LinkedLight) -> u64 {
        let own = surfaces.hierarchy.memory_bytes()
            + surfaces.direct.map_or(0, DirectField::memory_bytes)
            + linked.memory_bytes();
        self.others + own as u64
    }

    /// Bytes that may still be taken, beside what an iteration needs.
    fn free_bytes(&self, surfaces: Surfaces<'_>, linked: &LinkedLight) -> u64 {
        let Some(limit) = self.limit else {
            return u64::MAX;
        };
        let iteration = iteration_bytes(surfaces.hierarchy.mesh.elements.len()) as u64;
        limit.saturating_sub(self.used_bytes(surfaces, linked) + iteration)
    }

    /// Links that a refinement may have while the present ones are kept.
    pub(super) fn most_links(&self, surfaces: Surfaces<'_>, linked: &LinkedLight) -> u64 {
        self.free_bytes(surfaces, linked) / LINK_BYTES
    }

    /// Elements that there may be.
    pub(super) fn most_elements(&self, surfaces: Surfaces<'_>, linked: &LinkedLight) -> u64 {
        let present = surfaces.hierarchy.mesh.elements.len() as u64;
        let free = self.free_bytes(surfaces, linked);
        present.saturating_add(free / ELEMENT_PART / ELEMENT_BYTES)
    }

    /// Whether the limit is exceeded.
    pub(super) fn is_exceeded(&self, surfaces: Surfaces<'_>, linked: &LinkedLight) -> bool {
        self.limit
            .is_some_and(|limit| self.used_bytes(surfaces, linked) > limit)
    }
}
