//! Hemisphere coverage: the part of a surface's hemisphere that lit surfaces fill, and the rays that estimate it.

mod complement;
mod hemisphere;
mod map;
mod prober;

pub(crate) use complement::SkyShares;
pub(crate) use hemisphere::{Control, HemisphereCoverage, SkyShare};
pub(crate) use map::CoverageMap;
pub(crate) use prober::probe;
