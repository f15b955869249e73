//! The places at which light is evaluated, and their weights.

mod agreement;
mod carry;
mod contact;
mod offsets;
mod receivers;
mod shares;

pub(crate) use agreement::agreement;
pub(crate) use carry::{carry_over, project};
pub(crate) use contact::{
    divide_contacts, is_behind_wall, outside_places, probe_contacts, probe_within,
};
pub(crate) use offsets::{OffsetPlace, OffsetPlaces};
pub(crate) use receivers::{INSET, Receiver, centre_of, inset};
pub(crate) use shares::{LEAST_PART, emitted_as_irradiance, share_root, vertex_share_roots};
