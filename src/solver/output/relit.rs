//! The result of relighting.

use super::step_report::StepReport;

/// The result of relighting.
#[derive(Clone, Debug)]
pub struct Relit {
    /// The figures of the last step, updated.
    pub report: StepReport,
    /// Whether [`Solver::finish_relighting`](crate::solver::Solver::finish_relighting) would improve the light within
    /// elements.
    pub is_rough: bool,
    /// Whether light reaches omitted patches: it is missing until a new solve is started for these appearances.
    pub needs_restart: bool,
}
