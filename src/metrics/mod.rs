//! Measures of error against the truth.

mod error;
mod lookup;

pub use error::{ErrorMeasures, measure_error};
pub use lookup::MeshLookup;
