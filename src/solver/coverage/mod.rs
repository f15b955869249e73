//! Hemisphere coverage: the part of a surface's hemisphere that lit surfaces fill, and the rays that estimate it.

mod complement;
mod hemisphere;
mod prober;

pub(crate) use complement::{SkyShare, SkyShares};
pub(crate) use hemisphere::{Control, CoverageMap, HemisphereCoverage};
pub(crate) use prober::probe;
