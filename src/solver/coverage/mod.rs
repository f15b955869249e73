//! Hemisphere coverage: the part of a surface's hemisphere that lit surfaces fill, and the rays that estimate it.

mod hemisphere;
mod prober;

pub(crate) use hemisphere::{CoverageMap, HemisphereCoverage};
pub(crate) use prober::probe;
