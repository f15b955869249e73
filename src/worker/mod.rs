//! The solver thread: commands in, small events out, and a latest-wins slot for the large snapshot.
//!
//! [`WorkerHandle`] owns a named thread that only waits, so that every command is answered at once. It hands the solve
//! back and forth between itself and a pool of solver threads, one step at a time; dropping the handle cancels the step
//! under way and joins. Every run has a [`Generation`]; the handle shows nothing of an older one.
//! Nothing waits long for a solve that has been cancelled: one that the pool has not returned a moment later is abandoned
//! with its threads, and ends there.
//! The window and the headless commands drain the same handle; neither needs to know how a step is made.

mod controller;
mod effect;
mod generation;
mod message;
mod outbox;
mod priority;
mod request;
mod run;
mod slot;
mod stepper;
mod trajectory;
mod truth;

use std::{
    io,
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{self, Receiver, Sender},
    },
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

pub use effect::{Effect, effect_of_change};
pub use generation::Generation;
pub use message::{Event, RunOptions, StopReason};
pub use priority::pool_that_gives_way;
pub use slot::Slot;
pub use stepper::{Job, MakeStepper, Stepper};
pub use trajectory::trajectory;
pub use truth::{MeasuredStep, SAMPLE_GOAL, TruthHandle, TruthProgress, VertexErrors};

use crate::{
    geometry::RayTree,
    scene::{Appearance, Scene},
    solver::{Cancel, Snapshot, SolveSettings, Subject},
};
use controller::Controller;
use message::{Command, Message, Start};
use outbox::Outbox;

/// Called from the worker whenever there is something new to see, such as a request to repaint.
pub type Wake = Arc<dyn Fn() + Send + Sync>;

/// Called with every snapshot, before a newer one can replace it. Must not take long: the solve waits.
pub type Watch = Arc<dyn Fn(Generation, &Arc<Snapshot>) + Send + Sync>;

/// The observer of snapshots, shared by owner and worker.
type WatchCell = Arc<Mutex<Option<Watch>>>;

/// The owner's end of the worker. Dropping it cancels the step under way and joins the thread, which waits for the step
/// a moment only.
pub struct WorkerHandle {
    inbox: Sender<Message>,
    events: Receiver<(Generation, Event)>,
    slot: Arc<Slot<Snapshot>>,
    watch: WatchCell,
    generation: Generation,
    settings: SolveSettings,
    thread: Option<JoinHandle<()>>,
}

impl WorkerHandle {
    /// A worker without a run, which lights scenes with the [`Solver`](crate::solver::Solver).
    ///
    /// # Errors
    /// When the system refuses a thread.
    pub fn spawn(wake: Wake) -> io::Result<Self> {
        Self::with_steppers(
            wake,
            Arc::new(|job: Job, cancel: &Cancel| Some(Box::new(job.solver(cancel)?) as _)),
        )
    }

    /// A worker that steps whatever `make` returns.
    ///
    /// # Errors
    /// When the system refuses a thread.
    pub fn with_steppers(wake: Wake, make: MakeStepper) -> io::Result<Self> {
        let (inbox, messages) = mpsc::channel();
        let (events_in, events) = mpsc::channel();
        let slot = Arc::new(Slot::default());
        let watch = WatchCell::default();
        let outbox = Outbox::new(events_in, slot.clone(), watch.clone(), wake);
        let controller = Controller::new(messages, inbox.clone(), outbox, make);
        let thread = thread::Builder::new()
            .name("worker".to_owned())
            .spawn(move || controller.run())?;
        Ok(Self {
            inbox,
            events,
            slot,
            watch,
            generation: Generation::default(),
            settings: SolveSettings::default(),
            thread: Some(thread),
        })
    }

    /// Light a scene from the beginning, instead of what ran before. Nothing older is shown from here on.
    pub fn start(
        &mut self,
        scene: Arc<Scene>,
        settings: SolveSettings,
        options: RunOptions,
    ) -> Generation {
        self.begin(scene, None, settings, options)
    }

    /// As [`Self::start`], with the scene's ray tree, which takes long to build where the scene is large.
    pub fn start_with_rays(
        &mut self,
        scene: Arc<Scene>,
        rays: Arc<RayTree>,
        settings: SolveSettings,
        options: RunOptions,
    ) -> Generation {
        self.begin(scene, Some(rays), settings, options)
    }

    fn begin(
        &mut self,
        scene: Arc<Scene>,
        rays: Option<Arc<RayTree>>,
        settings: SolveSettings,
        options: RunOptions,
    ) -> Generation {
        self.generation = self.generation.next();
        self.settings = settings.clone();
        self.send(Command::Start(Start {
            generation: self.generation,
            scene,
            rays,
            settings,
            options,
            appearances: None,
        }));
        self.generation
    }

    /// Light the present run with other appearances, one for each material (see [`Scene::allowed`]), as fast as possible:
    /// nothing is refined until the run continues, and a finished run is paused. Appearances that arrive during a
    /// relighting wait for its end, and only the last of them are lit. [`Event::Relit`] announces the light. Later runs on
    /// the same scene use the appearances, too.
    pub fn relight(&self, appearances: Arc<[Appearance]>) {
        self.send(Command::Relight {
            generation: self.generation,
            appearances,
        });
    }

    /// Interrupt the step under way and wait. [`Event::Paused`] says when it rests.
    pub fn pause(&self) {
        self.send(Command::Pause);
    }

    /// Continue after a pause, a stop, or a limit of time or memory; the time limit starts over. A finished solve is not
    /// affected: it needs other settings.
    pub fn resume(&self) {
        self.send(Command::Continue);
    }

    /// End the run and keep its light. Where a step is done, its light is finished first, which takes about as long as that
    /// step; asked a second time, it ends at once. [`Event::Finished`] announces the end.
    pub fn stop(&self) {
        self.send(Command::Stop);
    }

    /// Light the same scene from the beginning, with the settings in force.
    pub fn reset(&mut self) -> Generation {
        self.generation = self.generation.next();
        self.send(Command::Restart {
            generation: self.generation,
            settings: self.settings.clone(),
        });
        self.generation
    }

    /// Apply other settings and return their effect on the run.
    pub fn change_settings(&mut self, settings: SolveSettings) -> Effect {
        let effect = effect_of_change(&self.settings, &settings);
        self.settings = settings.clone();
        match effect {
            Effect::Nothing => {}
            Effect::Continues | Effect::Refines => {
                self.send(Command::Settings { settings, effect });
            }
            Effect::Restarts => {
                self.reset();
            }
        }
        effect
    }

    /// Apply other limits or another number of threads, from the next step on.
    pub fn change_options(&self, options: RunOptions) {
        self.send(Command::Options(options));
    }

    /// Inspect some nodes of the present run, instead of those of the last call.
    /// [`Event::Inspected`] answers for each node that there is: at once while the run rests or has ended, otherwise
    /// before the next step begins, since interrupting a step would lose what it did; and again after each step.
    pub fn inspect(&self, subjects: Vec<Subject>) {
        self.send(Command::Inspect {
            generation: self.generation,
            subjects,
        });
    }

    /// Find the light of each lamp, see [`Solver::light_by_lamp`](crate::solver::Solver::light_by_lamp); answered by
    /// [`Event::ByLamp`]. A step comes first where the run goes on.
    pub fn light_by_lamp(&self) {
        self.send(Command::LightByLamp(self.generation));
    }

    /// Hand every snapshot from here on to `watch`, too; the slot keeps only the newest.
    pub fn watch(&self, watch: Option<Watch>) {
        *self.watch.lock().unwrap_or_else(PoisonError::into_inner) = watch;
    }

    /// The settings in force.
    pub fn settings(&self) -> &SolveSettings {
        &self.settings
    }

    /// The present run.
    pub fn generation(&self) -> Generation {
        self.generation
    }

    /// All events of the present run that have not been read. Never waits.
    pub fn events(&self) -> impl Iterator<Item = Event> + '_ {
        self.events
            .try_iter()
            .filter(|(generation, _)| *generation == self.generation)
            .map(|(_, event)| event)
    }

    /// The next event of the present run, or nothing after `timeout`.
    pub fn next_event(&self, timeout: Duration) -> Option<Event> {
        let deadline = Instant::now() + timeout;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            let (generation, event) = self.events.recv_timeout(left).ok()?;
            if generation == self.generation {
                return Some(event);
            }
        }
    }

    /// The newest snapshot of the present run. The same `Arc` as before where there is nothing newer.
    pub fn latest(&self) -> Option<Arc<Snapshot>> {
        self.slot.latest(self.generation)
    }

    fn send(&self, command: Command) {
        // The worker ends only when this handle is dropped, so there is someone to hear.
        let _ = self.inbox.send(Message::Command(command));
    }
}

impl Drop for WorkerHandle {
    fn drop(&mut self) {
        self.send(Command::Shutdown);
        if let Some(thread) = self.thread.take() {
            // A panic of the thread has been printed; a second one here would hide it.
            let _ = thread.join();
        }
    }
}
