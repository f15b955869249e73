//! The worker thread: a loop that waits for commands, for the solve to come back from the pool, or for the time limit.
//!
//! The solve is either at home (in [`Run::stepper`]) or away in the pool, never both, so that nothing is shared and
//! nothing is locked. A command that comes while it is away cancels the step and is carried out on its return; a
//! question waits for the return.

use std::{
    sync::{
        Arc,
        mpsc::{Receiver, Sender},
    },
    time::Instant,
};

use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

use super::{
    Effect, Event, Generation, MakeStepper, RunOptions, StopReason,
    message::{Command, Message},
    outbox::Outbox,
    run::{Aim, Run},
    visit::{Outcome, Returned},
};
use crate::{
    scene::Scene,
    solver::{Cancel, SolveSettings},
};

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
    /// Whether what is away is being prepared.
    prepares: bool,
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
            prepares: false,
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

    /// Send the solve to the pool if it is at home and there is a question, or it is meant to run.
    fn dispatch(&mut self) {
        if self.away.is_some() {
            return;
        }
        let Some(run) = self.run.as_mut().filter(|run| run.wants_visit()) else {
            return;
        };
        let pool = match pool_of(&mut self.pool, run.options.threads) {
            Ok(pool) => pool,
            Err(error) => {
                run.turn_to(Aim::Failed);
                let message = format!("cannot start the solver threads: {error}");
                self.outbox.send(run.generation, Event::Failed(message));
                return;
            }
        };
        let cancel = Cancel::default();
        self.away = Some(cancel.clone());
        self.prepares = run.stepper.is_none();
        let visit = run.visit(&self.make, cancel);
        let inbox = self.inbox.clone();
        pool.spawn(move || {
            // Nobody waits once the worker has ended.
            let _ = inbox.send(Message::Returned(visit.pay()));
        });
    }

    /// Take the solve back from the pool and say what it brought.
    fn welcome(&mut self, returned: Returned) {
        self.away = None;
        self.prepares = false;
        let Some(run) = self
            .run
            .as_mut()
            .filter(|run| run.generation == returned.generation)
        else {
            return;
        };
        let generation = run.generation;
        let trip = match returned.trip {
            Ok(Some(trip)) => trip,
            Ok(None) => {
                // There is nothing to keep: going on prepares anew.
                self.announce_aim();
                return;
            }
            Err(message) => {
                run.turn_to(Aim::Failed);
                self.outbox.send(generation, Event::Failed(message));
                return;
            }
        };
        run.stepper = Some(trip.stepper);
        match trip.outcome {
            Outcome::Prepared(snapshot) => {
                run.solving += trip.spent;
                self.outbox.publish(generation, snapshot);
                let seconds = trip.spent.as_secs_f64();
                self.outbox.send(generation, Event::Prepared { seconds });
            }
            Outcome::Stepped(report, snapshot) => {
                run.solving += trip.spent;
                self.outbox.publish(generation, snapshot);
                if let Some(report) = report {
                    run.ask_again();
                    let report = run.take_note(report);
                    self.outbox.send(generation, Event::Stepped(report));
                }
            }
            Outcome::Inspected(inspections) => {
                for inspection in inspections {
                    let event = Event::Inspected(Arc::new(inspection));
                    self.outbox.send(generation, event);
                }
            }
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
            Command::Inspect {
                generation,
                subjects,
            } => {
                // Nodes of an older run are other nodes in this one.
                if let Some(run) = self.run.as_mut().filter(|run| run.generation == generation) {
                    run.ask(subjects);
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
        self.run = Some(Run::new(generation, scene, settings, options));
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
            run.turn_to(aim);
        }
        // A run that ends keeps what it has: without the first picture that would be nothing.
        let keeps_nothing = self.prepares && matches!(aim, Aim::End(_));
        if !keeps_nothing {
            self.cancel_step();
        }
        if self.away.is_none() {
            self.announce_aim();
        }
    }

    fn go_on(&mut self) {
        if let Some(run) = &mut self.run {
            run.turn_to(Aim::Run);
            run.since = Instant::now();
            self.outbox.send(run.generation, Event::Continued);
        }
    }

    fn announce_aim(&mut self) {
        let Some(run) = self.run.as_mut().filter(|run| !run.announced) else {
            return;
        };
        run.announced = true;
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
