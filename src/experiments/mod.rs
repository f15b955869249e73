//! Suites of runs: what omissions save, whether hard cases stay stable, whether known light is met, and how cost grows with
//! the size of a scene.

mod claim;
pub mod exact;
mod light;
pub mod omissions;
pub mod scaling;
pub mod stability;

pub use claim::Claim;
