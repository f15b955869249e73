//! Measures of error against the truth, and of how it falls with time.

mod comparison;
mod error;
mod lookup;
mod trajectory;
mod vertex;

pub use comparison::{ReferenceFacts, Row, SceneComparison, TARGETS, digits, grouped};
pub use error::{ErrorMeasures, error_text, measure_error, smallest_error};
pub use lookup::MeshLookup;
pub use trajectory::{CUT_SHORT_MARK, Crossing, Measurement, Runner, Trajectory, middle};
pub use vertex::VertexReference;
