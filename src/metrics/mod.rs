//! Measures of error against the truth, and of how it falls with time.

mod comparison;
mod error;
mod error_map;
mod lookup;
mod pace;
mod trajectory;
mod vertex;

pub use comparison::{ReferenceFacts, Row, SceneComparison, TARGETS, digits, grouped};
pub use error::{ErrorMeasures, error_text, measure_error, smallest_error};
pub use error_map::{ErrorMap, PooledError};
pub use lookup::{MeshLookup, MeshPlace, SidePoint};
pub use pace::{Expected, Pace, about};
pub use trajectory::{CUT_SHORT_MARK, Crossing, Measurement, Runner, Trajectory, middle};
pub use vertex::VertexReference;
