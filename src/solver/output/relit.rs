//! What relighting returns.

use super::step_report::StepReport;

/// What came of relighting.
#[derive(Clone, Debug)]
pub struct Relit {
    /// The figures of the last step, but for what has changed.
    pub report: StepReport,
    /// Whether [`Solver::finish_relighting`](crate::solver::Solver::finish_relighting) would tell more of the light within elements.
    pub is_rough: bool,
    /// Whether light reaches what was left out of the solve: it is missing, and only a solve that begins anew for these
    /// appearances will show it.
    pub needs_restart: bool,
}
