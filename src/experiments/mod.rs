//! Suites of runs: what omissions save, whether hard cases stay stable, whether known light is met, and how cost grows with
//! the size of a scene; and what any scene must obey.

pub mod check;
mod claim;
pub mod exact;
mod light;
mod lit;
pub mod omissions;
pub mod scaling;
pub mod stability;

pub use claim::Claim;
