//! What a change of settings did to a run, in one sentence.

use super::state::RunStatus;
use crate::worker::Effect;

/// A change of settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// What it does.
    pub effect: Effect,
    /// Where the run stood when it came.
    pub status: RunStatus,
}

impl Change {
    /// For people; short, since there is little room where they look.
    pub fn label(&self) -> Option<&'static str> {
        let rests = self.status.can_continue();
        Some(match self.effect {
            Effect::Nothing => return None,
            Effect::Continues if rests => "The change takes effect when the run continues.",
            Effect::Continues if self.status.is_busy() => {
                "The change takes effect from the next step on; nothing is lost."
            }
            Effect::Continues => {
                "The light is as fine as that already. Restart to have it coarser and sooner."
            }
            Effect::Refines if rests => "Continue refines the light further; nothing is lost.",
            Effect::Refines => "The light is refined further; nothing is lost.",
            Effect::Restarts => "The change needs new light, so the run was restarted.",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::worker::StopReason;

    #[test]
    fn what_a_change_does_depends_on_where_the_run_stood() {
        let label = |effect, status| Change { effect, status }.label().unwrap_or_default();
        let done = RunStatus::Finished(StopReason::Converged);
        assert!(label(Effect::Continues, done.clone()).contains("Restart"));
        assert!(label(Effect::Continues, RunStatus::Running).contains("next step"));
        assert!(label(Effect::Continues, RunStatus::Paused).contains("when the run continues"));
        assert!(label(Effect::Refines, RunStatus::Paused).contains("Continue"));
        assert!(label(Effect::Refines, done.clone()).contains("is refined"));
        assert_eq!(label(Effect::Nothing, done), "");
    }
}
