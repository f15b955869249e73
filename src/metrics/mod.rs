//! Measures of error against the truth, and of how it falls with time.

mod comparison;
mod error;
mod lookup;
mod trajectory;

pub use comparison::{ReferenceFacts, Row, SceneComparison, TARGETS, digits, grouped};
pub use error::{ErrorMeasures, measure_error};
pub use lookup::MeshLookup;
pub use trajectory::{Crossing, Measurement, Runner, Trajectory};
