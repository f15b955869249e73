//! Output from the state: the display mesh, figures of a step, inspection of a node.

mod display;
mod figures;
mod inspect;
mod leaf_bounds;
mod path;
mod seams;

pub(crate) use display::{View, changed_triangles, color};
pub(crate) use figures::{fill, note_diffused, note_full};
pub(crate) use inspect::Inspector;
pub(crate) use leaf_bounds::Bounding;
