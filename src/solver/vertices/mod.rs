//! Light at vertices: from links, and in the last step from rays.

mod final_gather;
mod gather_estimate;
mod reconstruct;

pub(crate) use final_gather::{FinalGather, converged_change};
pub(crate) use reconstruct::{LeafLight, link_irradiance, own_irradiance, vertex_means};
pub(crate) use reconstruct::{divide_by_interpolation_error, gather_leaves};
