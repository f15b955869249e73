//! Files of the lit scene and of reports: one format a file, the colours they share, and how a file is put in its place.

mod color;
mod plot;
mod ply;
mod whole;

pub use color::{ColorOptions, ToneMap, linear_from_srgb, neutral, srgb_from_linear};
pub use plot::{Curve, CurvePlot};
pub use ply::{PlyOptions, UpAxis, write_ply};
pub use whole::{ASIDE, folder_of, try_writing, write_whole};
