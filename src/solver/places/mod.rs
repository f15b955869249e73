//! Where light is evaluated, and what counts how much there.

mod contact;
mod offsets;
mod receivers;

pub(crate) use contact::{is_behind_wall, open_places};
pub(crate) use offsets::{Moved, OffsetPlaces};
pub(crate) use receivers::{
    INSET, Receiver, carry_over, centre_of, inset, project, share_root, vertex_share_roots,
};
