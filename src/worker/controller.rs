//! The worker thread: a loop that waits for commands, for the solve to come back from the pool, or for the time limit.
//!
//! The solve is either at home (in [`Run::stepper`]) or away in the pool, never both, so that nothing is shared and
//! nothing is locked. A command that comes while it is away cancels the step and is carried out on its return.

use std::{
    any::Any,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc, PoisonError,
        mpsc::{Receiver, Sender},
    },
    time::{Duration, Instant},
};

use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

use super::{
    Effect, Event, Generation, Job, MakeStepper, RunOptions, Slot, Stepper, StopReason, Wake,
    WatchCell,
    message::{Command, Message},
};
use crate::{
    scene::Scene,
    solver::{Cancel, Snapshot, SolveSettings, StepReport},
};

/// Where events and snapshots leave.
pub(super) struct Outbox {
    events: Sender<(Generation, Event)>,
    slot: Arc<Slot<Snapshot>>,
    watch: WatchCell,
    wake: Wake,
}

impl Outbox {
    /// Events into a channel, snapshots into a slot and to who watches, and a call to `wake` for each event.
    pub(super) fn new(
        events: Sender<(Generation, Event)>,
        slot: Arc<Slot<Snapshot>>,
        watch: WatchCell,
        wake: Wake,
    ) -> Self {
        Self {
            events,
            slot,
            watch,
            wake,
        }
    }

    fn publish(&self, generation: Generation, snapshot: Arc<Snapshot>) {
        let watch = self.watch.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(watch) = watch.as_ref() {
            watch(generation, &snapshot);
        }
        drop(watch);
        self.slot.publish(generation, snapshot);
    }

    fn send(&self, generation: Generation, event: Event) {
        // Nobody listens once the handle is being dropped.
        let _ = self.events.send((generation, event));
        (self.wake)();
    }
}

/// The solve on its way back from the pool.
pub(super) struct Returned {
    generation: Generation,
    outcome: Result<Trip, String>,
}

/// What a visit to the pool brought.
struct Trip {
    stepper: Box<dyn Stepper>,
    snapshot: Snapshot,
    errand: Errand,
    spent: Duration,
}

/// What the visit was for.
enum Errand {
    Prepared,
    Stepped(Option<StepReport>),
}

/// What a run is meant to be doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Aim {
    Run,
    Rest,
    End(StopReason),
    Failed,
}

/// One run: a scene under settings.
struct Run {
    generation: Generation,
    scene: Arc<Scene>,
    settings: SolveSettings,
    settings_changed: bool,
    options: RunOptions,
    stepper: Option<Box<dyn Stepper>>,
    aim: Aim,
    /// Start, or last continue.
    since: Instant,
    /// Running time before that.
    before: Duration,
    /// Time spent preparing and stepping.
    solving: Duration,
}

impl Run {
    fn deadline(&self) -> Option<Instant> {
        let limit = self.options.time_limit?;
        (self.aim == Aim::Run).then_some(())?;
        self.since.checked_add(limit)
    }

    /// Why the run ends after a step with this report, if it does.
    fn end_after(&self, report: &StepReport) -> Option<StopReason> {
        if report.is_final {
            let reached = report.epsilon <= self.settings.epsilon;
            return Some(if reached {
                StopReason::Converged
            } else {
                StopReason::StepLimit
            });
        }
        let limit = self.options.memory_limit?;
        (report.memory_bytes >= limit).then_some(StopReason::MemoryLimit)
    }
}

/// The solver threads, kept while their number stays.
struct Pool {
    threads: usize,
    pool: ThreadPool,
}

/// The state of the worker thread.
pub(super) struct Controller {
    messages: Receiver<Message>,
    inbox: Sender<Message>,
    outbox: Outbox,
    make: MakeStepper,
    pool: Option<Pool>,
    run: Option<Run>,
    /// Set while a solve is away in the pool, even one of an older run.
    away: Option<Cancel>,
}

impl Controller {
    /// A worker without a run. `inbox` is the sending end of `messages`.
    pub(super) fn new(
        messages: Receiver<Message>,
        inbox: Sender<Message>,
        outbox: Outbox,
        make: MakeStepper,
    ) -> Self {
        Self {
            messages,
            inbox,
            outbox,
            make,
            pool: None,
            run: None,
            away: None,
        }
    }

    /// Serve until told to shut down, then wait for the solve to come home.
    pub(super) fn run(mut self) {
        loop {
            self.dispatch();
            match self.wait() {
                Some(Message::Command(Command::Shutdown)) => break,
                Some(Message::Command(command)) => self.obey(command),
                Some(Message::Returned(returned)) => self.welcome(returned),
                None => self.aim_at(Aim::End(StopReason::TimeLimit)),
            }
        }
        self.cancel_step();
        while self.away.is_some() {
            if let Ok(Message::Returned(_)) = self.messages.recv() {
                self.away = None;
            }
        }
    }

    /// The next message, or `None` when the time limit passes first.
    fn wait(&self) -> Option<Message> {
        let Some(deadline) = self.run.as_ref().and_then(Run::deadline) else {
            // This struct holds a sender, so the channel cannot close.
            return self.messages.recv().ok();
        };
        let left = deadline.saturating_duration_since(Instant::now());
        self.messages.recv_timeout(left).ok()
    }

    /// Send the solve to the pool if it is at home and meant to run.
    fn dispatch(&mut self) {
        if self.away.is_some() {
            return;
        }
        let Some(run) = self.run.as_mut().filter(|run| run.aim == Aim::Run) else {
            return;
        };
        let pool = match pool_of(&mut self.pool, run.options.threads) {
            Ok(pool) => pool,
            Err(error) => {
                run.aim = Aim::Failed;
                let message = format!("cannot start the solver threads: {error}");
                self.outbox.send(run.generation, Event::Failed(message));
                return;
            }
        };
        let cancel = Cancel::default();
        self.away = Some(cancel.clone());
        let trip: Box<dyn FnOnce() -> Trip + Send> = match run.stepper.take() {
            Some(mut stepper) => {
                if std::mem::take(&mut run.settings_changed) {
                    stepper.change_settings(run.settings.clone());
                }
                Box::new(move || step(stepper, &cancel))
            }
            None => {
                run.settings_changed = false;
                let make = self.make.clone();
                let job = Job {
                    scene: run.scene.clone(),
                    settings: run.settings.clone(),
                    memory_limit: run.options.memory_limit,
                };
                Box::new(move || prepare(&make, job))
            }
        };
        let (generation, inbox) = (run.generation, self.inbox.clone());
        pool.spawn(move || {
            let outcome = catch_unwind(AssertUnwindSafe(trip)).map_err(|panic| describe(&*panic));
            // Nobody waits once the worker has ended.
            let _ = inbox.send(Message::Returned(Returned {
                generation,
                outcome,
            }));
        });
    }

    /// Take the solve back from the pool and say what it brought.
    fn welcome(&mut self, returned: Returned) {
        self.away = None;
        let Some(run) = self
            .run
            .as_mut()
            .filter(|run| run.generation == returned.generation)
        else {
            return;
        };
        let generation = run.generation;
        let trip = match returned.outcome {
            Ok(trip) => trip,
            Err(message) => {
                run.aim = Aim::Failed;
                self.outbox.send(generation, Event::Failed(message));
                return;
            }
        };
        run.solving += trip.spent;
        run.stepper = Some(trip.stepper);
        self.outbox.publish(generation, Arc::new(trip.snapshot));
        match trip.errand {
            Errand::Prepared => {
                let seconds = trip.spent.as_secs_f64();
                self.outbox.send(generation, Event::Prepared { seconds });
            }
            Errand::Stepped(Some(mut report)) => {
                report.elapsed_s = (run.before + run.since.elapsed()).as_secs_f64();
                report.solve_s = run.solving.as_secs_f64();
                if let Some(reason) = run.end_after(&report) {
                    // Lower settings that came during the step ask for more.
                    let more = run.settings_changed && !reason.can_continue();
                    if !more {
                        run.aim = Aim::End(reason);
                    }
                }
                self.outbox.send(generation, Event::Stepped(report));
            }
            Errand::Stepped(None) => {}
        }
        self.announce_aim();
    }

    fn obey(&mut self, command: Command) {
        match command {
            Command::Start {
                generation,
                scene,
                settings,
                options,
            } => self.start(generation, scene, settings, options),
            Command::Restart {
                generation,
                settings,
            } => {
                if let Some(run) = self.run.take() {
                    self.start(generation, run.scene, settings, run.options);
                }
            }
            Command::Pause => {
                if self.aim() == Some(Aim::Run) {
                    self.aim_at(Aim::Rest);
                }
            }
            Command::Stop => {
                if matches!(self.aim(), Some(Aim::Run | Aim::Rest)) {
                    self.aim_at(Aim::End(StopReason::Requested));
                }
            }
            Command::Continue => match self.aim() {
                Some(Aim::Rest) => self.go_on(),
                Some(Aim::End(reason)) if reason.can_continue() => self.go_on(),
                _ => {}
            },
            Command::Settings { settings, effect } => self.change_settings(settings, effect),
            Command::Options(options) => {
                if let Some(run) = &mut self.run {
                    run.options = options;
                }
            }
            Command::Shutdown => {}
        }
    }

    fn start(
        &mut self,
        generation: Generation,
        scene: Arc<Scene>,
        settings: SolveSettings,
        options: RunOptions,
    ) {
        self.cancel_step();
        self.run = Some(Run {
            generation,
            scene,
            settings,
            settings_changed: false,
            options,
            stepper: None,
            aim: Aim::Run,
            since: Instant::now(),
            before: Duration::ZERO,
            solving: Duration::ZERO,
        });
        self.outbox.send(generation, Event::Started);
    }

    fn change_settings(&mut self, settings: SolveSettings, effect: Effect) {
        let Some(run) = &mut self.run else { return };
        run.settings = settings;
        run.settings_changed = true;
        if let (Effect::Refines, Aim::End(reason)) = (effect, run.aim)
            && !reason.can_continue()
        {
            self.go_on();
        }
    }

    fn aim(&self) -> Option<Aim> {
        self.run.as_ref().map(|run| run.aim)
    }

    /// Rest or end: interrupt the step under way, and announce it once the solve is home.
    fn aim_at(&mut self, aim: Aim) {
        if let Some(run) = &mut self.run {
            if run.aim == Aim::Run {
                run.before += run.since.elapsed();
                run.since = Instant::now();
            }
            run.aim = aim;
        }
        self.cancel_step();
        if self.away.is_none() {
            self.announce_aim();
        }
    }

    fn go_on(&mut self) {
        if let Some(run) = &mut self.run {
            run.aim = Aim::Run;
            run.since = Instant::now();
            self.outbox.send(run.generation, Event::Continued);
        }
    }

    fn announce_aim(&self) {
        let Some(run) = &self.run else { return };
        match run.aim {
            Aim::Run | Aim::Failed => {}
            Aim::Rest => self.outbox.send(run.generation, Event::Paused),
            Aim::End(reason) => self.outbox.send(run.generation, Event::Finished(reason)),
        }
    }

    fn cancel_step(&self) {
        if let Some(cancel) = &self.away {
            cancel.cancel();
        }
    }
}

/// The pool of that many threads, made anew only when the number changes.
fn pool_of(held: &mut Option<Pool>, threads: usize) -> Result<&ThreadPool, ThreadPoolBuildError> {
    let fitting = held.take().filter(|held| held.threads == threads);
    let pool = match fitting {
        Some(pool) => pool,
        None => Pool {
            threads,
            pool: ThreadPoolBuilder::new()
                .num_threads(threads)
                .thread_name(|index| format!("solver-{index}"))
                .build()?,
        },
    };
    Ok(&held.insert(pool).pool)
}

fn prepare(make: &MakeStepper, job: Job) -> Trip {
    let begin = Instant::now();
    let stepper = make(job);
    let spent = begin.elapsed();
    Trip {
        snapshot: stepper.snapshot(),
        stepper,
        errand: Errand::Prepared,
        spent,
    }
}

fn step(mut stepper: Box<dyn Stepper>, cancel: &Cancel) -> Trip {
    let begin = Instant::now();
    let report = stepper.step(cancel);
    let spent = begin.elapsed();
    Trip {
        snapshot: stepper.snapshot(),
        stepper,
        errand: Errand::Stepped(report),
        spent,
    }
}

/// The text of a panic.
pub(super) fn describe(panic: &(dyn Any + Send)) -> String {
    panic
        .downcast_ref::<String>()
        .map(String::as_str)
        .or_else(|| panic.downcast_ref::<&str>().copied())
        .unwrap_or("unknown reason")
        .to_owned()
}
