//! Transport between pairs of nodes: the kernel, visibility, the error oracle, refinement, and the links.

mod arrival;
mod bounds;
mod clear;
mod decide;
mod kernel;
mod link;
mod oracle;
mod patch_sums;
mod refine;
mod refiner;
mod sights;
mod tint;
mod validate;
mod visibility;

pub use bounds::Interval;
pub use kernel::{Incident, Kernel, Sight, element_form_factor, element_form_factors};
pub use link::{Link, LinkStore, TintedLink, TintedLinks};
pub(crate) use oracle::self_irradiance;
pub use oracle::{Estimate, Judge, Judgement};
pub use patch_sums::PatchSums;
pub use refiner::{LinkBudget, Refinement, Refiner};
pub use sights::Sights;
pub use visibility::PairSampler;

pub use crate::hierarchy::luminance;
