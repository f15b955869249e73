//! Light at vertices: from links, and in the last step from rays.

mod final_gather;
mod gather_estimate;
mod means;
mod reconstruct;

pub(crate) use final_gather::{FinalGather, converged_change};
pub(crate) use means::{divide_by_interpolation_error, vertex_means};
pub(crate) use reconstruct::{
    LeafLight, add_mirrored, gather_leaves, link_irradiance, own_irradiance,
};
