//! Light at vertices: from links, and from rays in the last step.

mod final_gather;
mod gathered;
mod reconstruct;

pub(crate) use final_gather::{FinalGather, settled_change};
pub(crate) use reconstruct::{LeafLight, VertexMeans, link_irradiance, own_irradiance};
pub(crate) use reconstruct::{divide_bent, gather_leaves};
