//! The run that the window shows: where it stands, what it has reported, and what the last change of settings did to it.

use std::sync::Arc;

use crate::{
    solver::{Snapshot, StepReport},
    worker::{Effect, Event, StopReason},
};

/// Where a run stands.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum RunStatus {
    /// Nothing runs.
    #[default]
    Idle,
    /// The hierarchy is being built.
    Preparing,
    /// Light is being computed.
    Running,
    /// It was asked to rest.
    Pausing,
    /// It rests until continued.
    Paused,
    /// It was asked to end.
    Stopping,
    /// It ended.
    Finished(StopReason),
    /// The solver failed with this message.
    Failed(String),
}

impl RunStatus {
    /// Whether the solver is at work.
    pub fn is_busy(&self) -> bool {
        matches!(self, Self::Preparing | Self::Running)
    }

    /// Whether it can be asked to end, or to end at once.
    pub fn can_stop(&self) -> bool {
        self.is_busy() || matches!(self, Self::Pausing | Self::Paused | Self::Stopping)
    }

    /// Whether there is something to go on with.
    pub fn can_continue(&self) -> bool {
        match self {
            Self::Pausing | Self::Paused | Self::Stopping => true,
            Self::Finished(reason) => reason.can_continue(),
            _ => false,
        }
    }

    /// For people.
    pub fn label(&self) -> String {
        match self {
            Self::Idle => "No scene".to_owned(),
            Self::Preparing => "Preparing".to_owned(),
            Self::Running => "Computing light".to_owned(),
            Self::Pausing => "Pausing".to_owned(),
            Self::Paused => "Paused".to_owned(),
            Self::Stopping => "Stopping".to_owned(),
            Self::Finished(reason) => match reason {
                StopReason::Converged => "Done".to_owned(),
                StopReason::StepLimit => "Done: step limit reached".to_owned(),
                StopReason::ErrorNotReached => "Done: accuracy not reached".to_owned(),
                StopReason::TimeLimit => "Stopped by the time limit".to_owned(),
                StopReason::MemoryLimit => "Stopped by the memory limit".to_owned(),
                StopReason::Requested => "Stopped".to_owned(),
            },
            Self::Failed(_) => "Failed".to_owned(),
        }
    }
}

/// The run as it is shown.
#[derive(Default)]
pub struct Run {
    /// Where it stands.
    pub status: RunStatus,
    /// One report a step.
    pub reports: Vec<StepReport>,
    /// The newest snapshot.
    pub snapshot: Option<Arc<Snapshot>>,
    /// Seconds that preparing took.
    pub prepare_secs: Option<f64>,
    /// Seconds that changing the light took last.
    pub relit_secs: Option<f64>,
    /// The last change of settings since the light began.
    pub last_change: Option<Change>,
}

impl Run {
    /// Take note of an event.
    pub fn note(&mut self, event: Event) {
        match event {
            Event::Started => {
                self.status = RunStatus::Preparing;
                self.reports.clear();
                self.prepare_secs = None;
                self.relit_secs = None;
            }
            Event::Prepared { seconds } => {
                self.prepare_secs = Some(seconds);
                if self.status == RunStatus::Preparing {
                    self.status = RunStatus::Running;
                }
            }
            Event::Stepped(report) => self.reports.push(report),
            Event::Relit {
                report, seconds, ..
            } => {
                self.relit_secs = seconds.or(self.relit_secs);
                if let Some(last) = self.reports.last_mut() {
                    *last = report;
                }
            }
            // Inspections are kept apart: they are of what is selected, not of the run.
            Event::Inspected(_) | Event::ByLamp(_) | Event::Interrupted { .. } => {}
            Event::Paused => self.status = RunStatus::Paused,
            Event::Continued => self.status = RunStatus::Running,
            Event::Finished(reason) => self.status = RunStatus::Finished(reason),
            Event::Failed(message) => self.status = RunStatus::Failed(message),
        }
    }
}

/// A change of settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// Its effect.
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

    #[test]
    fn a_run_goes_through_its_states() {
        let mut run = Run::default();
        run.note(Event::Started);
        assert!(run.status.is_busy());
        run.note(Event::Prepared { seconds: 0.5 });
        assert_eq!(run.status, RunStatus::Running);
        run.note(Event::Stepped(StepReport::default()));
        run.note(Event::Paused);
        assert!(run.status.can_continue());
        run.note(Event::Continued);
        run.note(Event::Finished(StopReason::Converged));
        assert!(!run.status.can_continue());
        assert_eq!(run.reports.len(), 1);
        run.note(Event::Started);
        assert!(
            run.reports.is_empty(),
            "a new run begins with an empty plot"
        );
    }

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
