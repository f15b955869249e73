//! The figures of a step.

use serde::Serialize;

use super::{estimated_error::EstimatedError, note::Note, phases::PhaseTimes};

/// Figures of one step. Quantities in world units.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct StepReport {
    /// Number of the step, from 1.
    pub step: u32,
    /// Seconds since the scene was read; filled in by the caller that owns a clock.
    pub elapsed_s: f64,
    /// Seconds spent in solver steps; filled in by the caller that owns a clock.
    pub solve_s: f64,
    /// Seconds spent in each phase of this step; filled in by the caller that owns a clock.
    pub phases: PhaseTimes,
    /// Link threshold of this step.
    pub epsilon: f32,
    /// Number of links.
    pub links: u64,
    /// Number of nodes: clusters, patches and elements.
    pub nodes: u64,
    /// Number of leaves that receive light.
    pub elements: u64,
    /// Number of vertices of the mesh.
    pub vertices: u64,
    /// Rays shot so far.
    pub shadow_rays: u64,
    /// Memory of the solver in bytes.
    pub memory_bytes: u64,
    /// Sweeps of the iteration in this step.
    pub sweeps: u32,
    /// Change of power by the last sweep, relative to the total power: the residual of the radiosity equation.
    pub residual: f32,
    /// Largest ratio of the distance between the images of two iterates to that between the iterates; below 1 while the
    /// iteration contracts, 0 after too few sweeps to measure it.
    pub contraction: f32,
    /// Arriving power relative to emitted and reflected power; 1 in an enclosed scene.
    pub energy_balance: f64,
    /// Smallest sum of form factors of an element; 1 in an enclosed scene.
    pub row_sum_min: f32,
    /// Area-weighted mean of the sums of form factors.
    pub row_sum_mean: f32,
    /// Largest sum of form factors of an element.
    pub row_sum_max: f32,
    /// Bound of the error of the light over links, root mean square over the area, relative to the mean irradiance: see
    /// [`Inspection::error_bound`](super::Inspection::error_bound). That of the step; other appearances do not renew it.
    pub error_bound: f32,
    /// Part of the reflected power that curved mirrors, gloss and glass reflect, which counts as diffuse; 0…1.
    pub diffused_share: f64,
    /// Estimated error of the light shown; `None` where it was not estimated.
    pub estimated_error: Option<EstimatedError>,
    /// Whether this is the last step.
    pub is_final: bool,
    /// Whether the memory limit prevented finer links or elements; further steps would be limited alike.
    pub is_full: bool,
    /// Measures to stay stable or within the memory limit.
    pub notes: Vec<Note>,
}

impl StepReport {
    /// Whether its links were left coarser than asked for, since rays do as well (see [`Note::LinksLimited`]).
    pub fn has_limited_links(&self) -> bool {
        let is_limit = |note: &Note| matches!(note, Note::LinksLimited { .. });
        self.notes.iter().any(is_limit)
    }
}
