//! Furnished rooms as people model them: round legs and poles of long thin triangles, cushions of many small ones, books,
//! folds, leaves and straps, lit by many lamps. Lengths in metres.

mod carriage;
mod furniture;
mod living_room;
mod office;
mod parts;

pub(super) use carriage::carriage;
pub(super) use living_room::{late_afternoon, living_room};
pub(super) use office::office;

/// How deep things sink into what carries them.
const SUNK: f64 = 0.003;
