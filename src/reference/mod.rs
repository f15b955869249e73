//! The truth by other means: closed forms, the full radiosity matrix, path tracing; and two solvers to race against,
//! path-traced vertex baking and stochastic Jacobi radiosity.
//!
//! This room sees only scene, geometry and sampling, and shares no code with the transport, so that an error in the method's
//! kernel cannot hide in what it is measured against. Radiosity B = π·L throughout, radiance `L = Le + ρ·E/π`.

pub mod analytic;
mod bake;
mod estimator;
mod form_factor;
mod jacobi;
mod jacobi_mesh;
mod matrix;
mod outside;
mod path_trace;
mod point;
mod scatter;

pub use bake::{BakePoint, VertexBake, bake};
pub use jacobi::{JacobiSettings, StochasticJacobi};
pub use matrix::{MatrixError, MatrixPatch, MatrixSettings, MatrixSolution, solve_matrix};
pub use path_trace::{PathSettings, PathTraced, PathTracer};
pub use point::ReferencePoint;
