//! The phases of a step, and the time that each takes.

use serde::Serialize;

/// A phase of a step, in the order in which a step begins them. The last two come twice in a step that may be the last
/// one by its error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Rays for the coverage of hemispheres by lit surfaces.
    Coverage,
    /// Elements are divided, and direct light is sampled at their vertices.
    Direct,
    /// Links are refined, and elements for them.
    Refine,
    /// Light is exchanged over links until it converges.
    Iterate,
    /// Leaves gather once more for their corners.
    Gather,
    /// Rays from the vertices, in the last step.
    FinalGather,
    /// Figures, and the mesh to show.
    Display,
    /// Rays that estimate the error of the light shown.
    Estimate,
}

impl Phase {
    /// All, in order.
    pub const ALL: [Self; 8] = [
        Self::Coverage,
        Self::Direct,
        Self::Refine,
        Self::Iterate,
        Self::Gather,
        Self::FinalGather,
        Self::Display,
        Self::Estimate,
    ];
}

/// What is told as each phase of a step begins: the phase, and the rays shot so far.
pub type PhaseObserver<'a> = &'a mut dyn FnMut(Phase, u64);

/// Seconds that a step spent in each phase, at least 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PhaseTimes {
    /// In [`Phase::Coverage`].
    pub coverage_s: f64,
    /// In [`Phase::Direct`].
    pub direct_s: f64,
    /// In [`Phase::Refine`].
    pub refine_s: f64,
    /// In [`Phase::Iterate`].
    pub iterate_s: f64,
    /// In [`Phase::Gather`].
    pub gather_s: f64,
    /// In [`Phase::FinalGather`].
    pub final_gather_s: f64,
    /// In [`Phase::Display`].
    pub display_s: f64,
    /// In [`Phase::Estimate`].
    pub estimate_s: f64,
}

impl PhaseTimes {
    /// The seconds spent in a phase.
    pub fn of_mut(&mut self, phase: Phase) -> &mut f64 {
        match phase {
            Phase::Coverage => &mut self.coverage_s,
            Phase::Direct => &mut self.direct_s,
            Phase::Refine => &mut self.refine_s,
            Phase::Iterate => &mut self.iterate_s,
            Phase::Gather => &mut self.gather_s,
            Phase::FinalGather => &mut self.final_gather_s,
            Phase::Display => &mut self.display_s,
            Phase::Estimate => &mut self.estimate_s,
        }
    }
}
