//! Node pairs: what a source sends to a point, who sees whom, which pairs are good enough, and the links that stay.

mod kernel;
mod link;
mod oracle;
mod refine;
mod visibility;

pub use kernel::{Incident, Kernel, element_form_factor};
pub use link::{Link, LinkStore};
pub(crate) use oracle::self_irradiance;
pub use oracle::{Estimate, Judge, Judgement};
pub use refine::{Refinement, Refiner};
pub use visibility::PairSampler;

use glam::Vec4;

/// Luminance of linear RGB (Rec. 709), by which errors of colours are weighed; `w` does not count.
pub fn luminance(color: Vec4) -> f32 {
    color.dot(Vec4::new(0.2126, 0.7152, 0.0722, 0.0))
}
