//! The memory budget: how many links and elements fit below the memory limit.
//!
//! It is read before links are made and elements divided, so that the limit is never exceeded and results stay whole.

use super::{
    direct::Surfaces,
    iteration::{LinkedLight, iteration_bytes},
};
use crate::transport::Link;

/// Bytes for each new link: links are collected in lists whose capacity may double, then sorted into the store.
/// Smaller, and the limit is exceeded; larger, and memory stays unused.
const LINK_BYTES: u64 = 3 * size_of::<Link>() as u64 + 8;

/// Bytes for each new element: itself, its edges in three maps, vertices, tables, the memory of the iteration, and its
/// share of two snapshots. Measured with 29,375 elements: 880 bytes each at the peak of the process, 610 of them
/// lasting. Smaller, and the limit is exceeded; larger, and memory stays unused.
const ELEMENT_BYTES: u64 = 900;

/// Divisor of the free memory that new elements may take; the rest is for their links. Smaller, and links do not fit;
/// larger, and elements stay coarse.
const ELEMENT_PART: u64 = 2;

/// The memory limit, and the memory that does not depend on the mesh and its light.
#[derive(Clone, Copy)]
pub(super) struct Budget {
    /// Limit in bytes; `None` for no limit.
    pub limit: Option<u64>,
    /// Bytes in use beside the mesh and its light.
    pub others: u64,
}

impl Budget {
    /// Bytes in use in all.
    pub(super) fn used_bytes(&self, surfaces: Surfaces<'_>, linked: &LinkedLight) -> u64 {
        let own = surfaces.hierarchy.memory_bytes()
            + surfaces.direct.memory_bytes()
            + linked.memory_bytes();
        self.others + own as u64
    }

    /// Bytes that are free, beside those that an iteration needs.
    fn free_bytes(&self, surfaces: Surfaces<'_>, linked: &LinkedLight) -> u64 {
        let Some(limit) = self.limit else {
            return u64::MAX;
        };
        let iteration = iteration_bytes(surfaces.hierarchy.mesh.elements.len()) as u64;
        limit.saturating_sub(self.used_bytes(surfaces, linked) + iteration)
    }

    /// Most links that a refinement may make while the present ones are in memory.
    pub(super) fn most_links(&self, surfaces: Surfaces<'_>, linked: &LinkedLight) -> u64 {
        self.free_bytes(surfaces, linked) / LINK_BYTES
    }

    /// Most elements that fit.
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
