//! Suites of runs: what omissions save, whether hard cases stay stable, and how cost grows with the size of a scene.

pub mod omissions;
pub mod scaling;
pub mod stability;
