//! Messages of the worker: commands, events, options of a run.

use std::{sync::Arc, time::Duration};

use serde::Serialize;

use super::{Effect, Generation, request::Returned};
use crate::{
    geometry::RayTree,
    scene::{Appearance, Scene},
    solver::{Inspection, LampLight, SolveSettings, StepReport, Subject},
};

/// How to run, apart from what to compute: nothing here changes a finished result.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunOptions {
    /// Solver threads; 0 takes one for each core.
    pub threads: usize,
    /// Time from the start or the last continue after which the run stops.
    pub time_limit: Option<Duration>,
    /// Bytes that the solver may use.
    pub memory_limit: Option<u64>,
    /// Whether steps wait for other threads of the program where cores are few. The preparation does not: until it is
    /// done there is nothing to look at.
    pub gives_way: bool,
}

/// Why a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum StopReason {
    /// The threshold asked for, or the error, is reached and light has converged.
    Converged,
    /// The steps asked for are used up before the threshold is reached.
    StepLimit,
    /// Further steps do not lead to the error asked for; a note of the last step tells why.
    ErrorNotReached,
    /// The time limit has passed.
    TimeLimit,
    /// The memory limit is reached.
    MemoryLimit,
    /// The owner stopped it.
    Requested,
}

impl StopReason {
    /// Whether there is more to do under the same settings.
    pub fn can_continue(self) -> bool {
        matches!(self, Self::TimeLimit | Self::MemoryLimit | Self::Requested)
    }
}

/// An event that the worker announces.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// A run begins; its solver is being prepared.
    Started,
    /// The solver is ready; the unlit mesh is in the slot.
    Prepared {
        /// Seconds that preparing took.
        seconds: f64,
    },
    /// A step is done; its light is in the slot.
    Stepped(StepReport),
    /// A step was interrupted on its way and its work is lost; the times count it.
    Interrupted {
        /// Running time so far, in seconds, as in [`StepReport::elapsed_s`].
        elapsed_s: f64,
        /// Time spent on preparing and stepping, in seconds, as in [`StepReport::solve_s`].
        solve_s: f64,
    },
    /// The light of other appearances is in the slot. The figures are those of the last step, except those that the
    /// change affects.
    Relit {
        /// Figures of the light.
        report: StepReport,
        /// Seconds that it took; nothing where a preview was refined.
        seconds: Option<f64>,
        /// Whether light is missing that only a restart will show (see
        /// [`Relit::needs_restart`](crate::solver::Relit::needs_restart)).
        needs_restart: bool,
    },
    /// An answer to [`super::WorkerHandle::inspect`].
    Inspected(Arc<Inspection>),
    /// An answer to [`super::WorkerHandle::light_by_lamp`]; `None` when it was cancelled.
    ByLamp(Option<Arc<[LampLight]>>),
    /// The run rests until it is continued.
    Paused,
    /// The run goes on from where it stood.
    Continued,
    /// The run ended; the result is in the slot.
    Finished(StopReason),
    /// The solver panicked with this message; the run is over, the worker is not.
    Failed(String),
}

/// A run to begin.
pub(super) struct Start {
    /// The new run.
    pub generation: Generation,
    /// The scene.
    pub scene: Arc<Scene>,
    /// Its ray tree, where there is one already.
    pub rays: Option<Arc<RayTree>>,
    /// The settings.
    pub settings: SolveSettings,
    /// How to run.
    pub options: RunOptions,
    /// Appearances of the materials, where they differ from the scene.
    pub appearances: Option<Arc<[Appearance]>>,
}

/// A command of the owner.
pub(super) enum Command {
    /// Light a scene from the beginning.
    Start(Start),
    /// Light the same scene from the beginning.
    Restart {
        /// The new run.
        generation: Generation,
        /// The settings.
        settings: SolveSettings,
    },
    /// Interrupt and rest.
    Pause,
    /// Go on.
    Continue,
    /// Interrupt and end.
    Stop,
    /// Other settings that the run can take over.
    Settings {
        /// The settings from the next step on.
        settings: SolveSettings,
        /// The effect of the change.
        effect: Effect,
    },
    /// Other limits.
    Options(RunOptions),
    /// Use other appearances of the materials of a run from now on.
    Relight {
        /// The run.
        generation: Generation,
        /// One for each material.
        appearances: Arc<[Appearance]>,
    },
    /// Inspect nodes of a run.
    Inspect {
        /// The run that the nodes are of.
        generation: Generation,
        /// The nodes, now and after each step, instead of those of the last such command.
        subjects: Vec<Subject>,
    },
    /// Find the light of each lamp of a run.
    LightByLamp(Generation),
    /// End the thread.
    Shutdown,
}

/// A message that the worker thread waits for.
pub(super) enum Message {
    /// A command.
    Command(Command),
    /// The pool returns the solve.
    Returned(Box<Returned>),
}
