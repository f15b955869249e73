//! Points of surfaces: at which errors are measured, and from which emitters shine. No light is computed here, so that
//! the solver's estimate of its error and the reference measure at points of the same kind without sharing transport code.

mod emitters;
mod point;
mod points;

pub use emitters::{EmitterPoint, Emitters};
pub use point::SurfacePoint;
pub use points::{SampledSurfaces, sample_points};
