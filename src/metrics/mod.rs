//! Measures of error against the truth, and of how it falls with time.

mod comparison;
mod error;
mod lookup;
pub mod omissions;
mod scaling;
pub mod stability;
mod trajectory;
mod vertex;

pub use comparison::{
    ReferenceFacts, Row, SceneComparison, TARGETS, digits, grouped, smallest_error,
};
pub use error::{ErrorMeasures, measure_error};
pub use lookup::MeshLookup;
pub use scaling::{COST_KINDS, CostKind, SizeCost, exponent_of, fitted_exponent, scaling_markdown};
pub use trajectory::{Crossing, Measurement, Runner, Trajectory};
pub use vertex::VertexReference;
