//! Measures of error against the truth.

mod error;
mod lookup;
mod vertex;

pub use error::{ErrorMeasures, measure_error};
pub use lookup::MeshLookup;
pub use vertex::VertexReference;
