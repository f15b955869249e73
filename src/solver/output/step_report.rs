//! The figures of a step.

use serde::Serialize;

/// Figures of one step. Quantities in world units.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct StepReport {
    /// Number of the step, from 1.
    pub step: u32,
    /// Seconds since the scene was read; filled in by the caller that owns a clock.
    pub elapsed_s: f64,
    /// Seconds spent in solver steps; filled in by the caller that owns a clock.
    pub solve_s: f64,
    /// Link threshold of this step.
    pub epsilon: f32,
    /// Links in use.
    pub links: u64,
    /// Clusters, patches and elements.
    pub nodes: u64,
    /// Leaves that receive light.
    pub elements: u64,
    /// Vertices of the display mesh.
    pub vertices: u64,
    /// Rays shot so far.
    pub shadow_rays: u64,
    /// Bytes held by the solver.
    pub memory_bytes: u64,
    /// Sweeps of the iteration in this step.
    pub sweeps: u32,
    /// What gathering once more changes, relative to the total power: the residual of the equation that is solved.
    pub residual: f32,
    /// Largest ratio by which a sweep changed the distance of two lights; below 1 while the iteration contracts, 0 where
    /// too few sweeps were needed to tell.
    pub contraction: f32,
    /// Power arriving over links and samples, relative to the power that left for it; 1 in a closed scene.
    pub energy_balance: f64,
    /// Smallest sum of form factors over the elements; 1 in a closed scene.
    pub row_sum_min: f32,
    /// Area-weighted mean of the sums of form factors.
    pub row_sum_mean: f32,
    /// Largest sum of form factors.
    pub row_sum_max: f32,
    /// Sum of the link error estimates, root mean square over the area, relative to the mean irradiance.
    pub estimated_error: f32,
    /// Whether a further step can change anything.
    pub is_final: bool,
    /// Whether the memory limit kept the step from being finer: further ones would fare alike.
    pub is_full: bool,
    /// What the solver had to do to stay stable, one sentence each.
    pub notes: Vec<String>,
}
