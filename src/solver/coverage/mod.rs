//! CoverageMap: which part of a view lit surfaces fill, and the rays that find it.

mod hemisphere;
mod prober;

pub(crate) use hemisphere::{CoverageMap, HemisphereCoverage};
pub(crate) use prober::probe;
