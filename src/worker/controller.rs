//! The worker thread: a loop that waits for commands, for the solve to come back from the pool, or for the time limit.
//!
//! The solve is either in [`Run::stepper`] or in the pool, never both, so that nothing is shared and nothing is locked. A
//! command that arrives while it is in the pool cancels the step and is carried out when the pool returns it; an
//! inspection waits for the return. A solve of an older run is waited for a moment only: then it is abandoned with its
//! threads, and a new run gets new ones.

use std::{
    sync::{
        Arc,
        mpsc::{Receiver, Sender},
    },
    time::{Duration, Instant},
};

use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

use super::{
    Effect, Event, Generation, MakeStepper, StopReason,
    message::{Command, Message, Start},
    outbox::Outbox,
    priority::give_way,
    request::{Outcome, Returned, Task},
    run::{Aim, Run},
};
use crate::{
    scene::Appearance,
    solver::{Cancel, SolveSettings},
};

/// How long a cancelled solve of an older run is waited for. Shorter, and two solves share the cores for no
/// reason; longer, and the next scene begins noticeably late.
const GRACE: Duration = Duration::from_millis(60);

/// Most solves that are abandoned and have not ended. More, and memory and cores are spent on results that are not shown:
/// at this number, the next run waits.
const MAX_ABANDONED: usize = 2;

/// Solver threads; they are reused as long as their number stays the same.
struct Pool {
    threads: usize,
    pool: ThreadPool,
}

/// The solver threads: those of normal priority and those of low priority. Idle ones cost nothing.
#[derive(Default)]
struct Pools {
    sharing: Option<Pool>,
    giving_way: Option<Pool>,
}

impl Pools {
    /// The pool of that many threads; it is rebuilt only when the number changes.
    fn pool_of(
        &mut self,
        threads: usize,
        gives_way: bool,
    ) -> Result<&ThreadPool, ThreadPoolBuildError> {
        let slot = if gives_way {
            &mut self.giving_way
        } else {
            &mut self.sharing
        };
        let fitting = slot.take().filter(|slot| slot.threads == threads);
        let pool = match fitting {
            Some(pool) => pool,
            None => Pool {
                threads,
                pool: ThreadPoolBuilder::new()
                    .num_threads(threads)
                    .thread_name(|index| format!("solver-{index}"))
                    .start_handler(move |_| {
                        if gives_way {
                            give_way();
                        }
                    })
                    .build()?,
            },
        };
        Ok(&slot.insert(pool).pool)
    }

    /// Any of them.
    fn any(&self) -> Option<&ThreadPool> {
        let slot = self.giving_way.as_ref().or(self.sharing.as_ref());
        slot.map(|slot| &slot.pool)
    }
}

/// A solve in the pool.
struct InPool {
    /// The run that it belongs to.
    generation: Generation,
    cancel: Cancel,
    /// Whether it is being prepared.
    prepares: bool,
    /// Whether a change of appearances cancels its task.
    gives_way: bool,
    /// When its run was replaced by another.
    outdated_since: Option<Instant>,
    /// Raised when it is abandoned.
    abandoned: Cancel,
}

/// The state of the worker thread.
pub(super) struct Controller {
    messages: Receiver<Message>,
    inbox: Sender<Message>,
    outbox: Outbox,
    make: MakeStepper,
    pools: Pools,
    run: Option<Run>,
    /// The solve in the pool, even one of an older run.
    in_pool: Option<InPool>,
    /// How many solves were abandoned and have not ended.
    abandoned_count: usize,
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
            pools: Pools::default(),
            run: None,
            in_pool: None,
            abandoned_count: 0,
        }
    }

    /// Serve until told to shut down, then wait a moment for the pool to return the solve.
    pub(super) fn run(mut self) {
        loop {
            self.dispatch();
            match self.wait() {
                Some(Message::Command(Command::Shutdown)) => break,
                Some(Message::Command(command)) => self.carry_out(command),
                Some(Message::Returned(returned)) => self.accept(*returned),
                None => self.check_deadlines(),
            }
        }
        self.cancel_step();
        self.run = None;
        let end = Instant::now() + GRACE;
        while let Some(in_pool) = &self.in_pool {
            let left = end.saturating_duration_since(Instant::now());
            match self.messages.recv_timeout(left) {
                Ok(Message::Returned(returned)) if returned.generation == in_pool.generation => {
                    self.in_pool = None;
                }
                Ok(_) => {}
                Err(_) => self.abandon(),
            }
        }
    }

    /// The next message, or `None` when the time limit, or the grace of a solve of an older run, ends first.
    fn wait(&self) -> Option<Message> {
        let limit = self.run.as_ref().and_then(Run::deadline);
        let Some(deadline) = limit.into_iter().chain(self.grace_ends()).min() else {
            // This struct holds a sender, so the channel cannot close.
            return self.messages.recv().ok();
        };
        let left = deadline.saturating_duration_since(Instant::now());
        self.messages.recv_timeout(left).ok()
    }

    /// Act on the deadlines that have passed.
    fn check_deadlines(&mut self) {
        let has_passed =
            |deadline: Option<Instant>| deadline.is_some_and(|at| at <= Instant::now());
        if has_passed(self.grace_ends()) {
            self.abandon();
        }
        if has_passed(self.run.as_ref().and_then(Run::deadline)) {
            self.aim_at(Aim::End(StopReason::TimeLimit));
        }
    }

    /// When a solve of an older run is no longer waited for.
    fn grace_ends(&self) -> Option<Instant> {
        let in_pool = self.in_pool.as_ref()?;
        (self.abandoned_count < MAX_ABANDONED).then_some(())?;
        Some(in_pool.outdated_since? + GRACE)
    }

    /// Stop waiting for the solve in the pool; it has been cancelled, and ends there with its threads.
    fn abandon(&mut self) {
        if let Some(in_pool) = self.in_pool.take() {
            in_pool.abandoned.cancel();
            self.abandoned_count += 1;
            self.pools = Pools::default();
        }
    }

    /// Send the next request to the pool, if that has no solve and there is a task.
    fn dispatch(&mut self) {
        if self.in_pool.is_some() {
            return;
        }
        let Some(run) = self.run.as_mut().filter(|run| run.has_task()) else {
            return;
        };
        let gives_way = run.options.gives_way && run.stepper.is_some();
        let pool = match self.pools.pool_of(run.options.threads, gives_way) {
            Ok(pool) => pool,
            Err(error) => {
                run.turn_to(Aim::Failed);
                let message = format!("cannot start the solver threads: {error}");
                self.outbox.send(run.generation, Event::Failed(message));
                return;
            }
        };
        let (cancel, abandoned) = (Cancel::default(), Cancel::default());
        let request = run.next_request(&self.make, cancel.clone());
        self.in_pool = Some(InPool {
            generation: run.generation,
            cancel,
            prepares: matches!(request.task, Task::Prepare(..)),
            gives_way: matches!(
                request.task,
                Task::Step(..) | Task::Finish(..) | Task::FinishRelighting(..)
            ),
            outdated_since: None,
            abandoned: abandoned.clone(),
        });
        let inbox = self.inbox.clone();
        pool.spawn(move || {
            let mut returned = request.carry_out();
            if abandoned.is_cancelled() {
                returned.result = Ok(None);
            }
            // Nobody waits once the worker has ended.
            let _ = inbox.send(Message::Returned(Box::new(returned)));
        });
    }

    /// Take the solve back from the pool and announce the result.
    fn accept(&mut self, returned: Returned) {
        let is_expected = |in_pool: &InPool| in_pool.generation == returned.generation;
        if !self.in_pool.as_ref().is_some_and(is_expected) {
            self.abandoned_count = self.abandoned_count.saturating_sub(1);
            return;
        }
        self.in_pool = None;
        let Some(run) = self
            .run
            .as_mut()
            .filter(|run| run.generation == returned.generation)
        else {
            self.drop_in_pool(returned);
            return;
        };
        let generation = run.generation;
        let completed = match returned.result {
            Ok(Some(completed)) => completed,
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
        run.stepper = Some(completed.stepper);
        let is_step = matches!(completed.outcome, Outcome::Stepped(..));
        if matches!(completed.outcome, Outcome::Stepped(Some(_), _)) {
            run.last_step = Some(completed.spent);
        }
        match completed.outcome {
            Outcome::Prepared(snapshot) => {
                run.solving += completed.spent;
                self.outbox.publish(generation, snapshot);
                let seconds = completed.spent.as_secs_f64();
                self.outbox.send(generation, Event::Prepared { seconds });
            }
            Outcome::Stepped(report, snapshot) | Outcome::Finished(report, snapshot) => {
                run.solving += completed.spent;
                self.outbox.publish(generation, snapshot);
                let event = match report {
                    Some(report) => {
                        run.is_unfinished = is_step && !report.is_final;
                        run.is_finishing &= run.is_unfinished;
                        run.ask_again();
                        Event::Stepped(run.take_note(report))
                    }
                    None => {
                        run.is_finishing &= is_step;
                        let (elapsed_s, solve_s) = run.times();
                        Event::Interrupted { elapsed_s, solve_s }
                    }
                };
                self.outbox.send(generation, event);
            }
            Outcome::Relit(Some(relit), snapshot) => {
                self.outbox.publish(generation, snapshot);
                run.is_rough = relit.is_rough;
                run.ask_again();
                let report = run.dated(relit.report);
                let seconds = Some(completed.spent.as_secs_f64());
                let needs_restart = relit.needs_restart;
                let event = Event::Relit {
                    report,
                    seconds,
                    needs_restart,
                };
                self.outbox.send(generation, event);
                if matches!(run.aim, Aim::End(reason) if !reason.can_continue()) {
                    // The new light can be refined once the run is continued.
                    run.turn_to(Aim::Rest);
                }
            }
            // It was cancelled for something more urgent: it is still to be done.
            Outcome::Relit(None, _) => run.appearances_changed = true,
            Outcome::RelitFinely(Some(report), snapshot) => {
                self.outbox.publish(generation, snapshot);
                run.ask_again();
                let report = run.dated(report);
                let event = Event::Relit {
                    report,
                    seconds: None,
                    needs_restart: false,
                };
                self.outbox.send(generation, event);
            }
            Outcome::RelitFinely(None, _) => run.is_rough = true,
            Outcome::ByLamp(lamps) => {
                let lamps = lamps.map(Arc::from);
                self.outbox.send(generation, Event::ByLamp(lamps));
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

    fn carry_out(&mut self, command: Command) {
        match command {
            Command::Start(start) => self.start(start),
            Command::Restart {
                generation,
                settings,
            } => {
                if let Some(run) = &self.run {
                    self.start(Start {
                        generation,
                        scene: run.scene.clone(),
                        rays: run.rays.clone(),
                        settings,
                        options: run.options.clone(),
                        appearances: run.appearances.clone(),
                    });
                }
            }
            Command::Pause => {
                if self.aim() == Some(Aim::Run) {
                    self.aim_at(Aim::Rest);
                }
            }
            Command::Stop => {
                let is_finishing = self.run.as_ref().is_some_and(|run| run.is_finishing);
                if matches!(self.aim(), Some(Aim::Run | Aim::Rest)) || is_finishing {
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
            Command::Relight {
                generation,
                appearances,
            } => self.relight(generation, appearances),
            Command::Inspect {
                generation,
                subjects,
            } => {
                // Nodes of an older run are other nodes in this one.
                if let Some(run) = self.run.as_mut().filter(|run| run.generation == generation) {
                    run.ask(subjects);
                }
            }
            Command::LightByLamp(generation) => {
                if let Some(run) = self.run.as_mut().filter(|run| run.generation == generation) {
                    run.is_asked_by_lamp = true;
                }
            }
            Command::Shutdown => {}
        }
    }

    fn start(&mut self, start: Start) {
        let generation = start.generation;
        self.cancel_step();
        if let Some(in_pool) = &mut self.in_pool {
            in_pool.outdated_since.get_or_insert_with(Instant::now);
        }
        if let Some(old) = self.run.replace(Run::new(start)) {
            self.drop_in_pool(old);
        }
        self.outbox.send(generation, Event::Started);
    }

    /// Drop something large on a thread where no command waits for it.
    fn drop_in_pool(&self, large: impl Send + 'static) {
        match self.pools.any() {
            Some(pool) => pool.spawn(move || drop(large)),
            None => drop(large),
        }
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

    /// Light the run with other appearances. A step under way is interrupted, since it lights the old ones. A relighting
    /// under way is not, or nothing would show while a slider is dragged; of later appearances only the last are lit.
    fn relight(&mut self, generation: Generation, appearances: Arc<[Appearance]>) {
        let run = self.run.as_mut();
        if let Some(run) = run.filter(|run| run.generation == generation) {
            run.relight(appearances);
            if let Some(in_pool) = self.in_pool.as_ref().filter(|in_pool| in_pool.gives_way) {
                in_pool.cancel.cancel();
            }
        }
    }

    fn aim(&self) -> Option<Aim> {
        self.run.as_ref().map(|run| run.aim)
    }

    /// Rest or end: interrupt the step under way, and announce it once the pool has returned the solve.
    fn aim_at(&mut self, aim: Aim) {
        if let Some(run) = &mut self.run {
            match aim {
                // Asked a second time it ends at once.
                Aim::End(StopReason::Requested) if run.aim != aim => {
                    run.end_with_finish(StopReason::Requested);
                }
                _ => run.turn_to(aim),
            }
        }
        // A run that reaches a limit keeps what it has: without the first picture that would be nothing.
        let prepares = self
            .in_pool
            .as_ref()
            .is_some_and(|in_pool| in_pool.prepares);
        if !(prepares && aim == Aim::End(StopReason::TimeLimit)) {
            self.cancel_step();
        }
        if self.in_pool.is_none() {
            self.announce_aim();
        }
    }

    fn go_on(&mut self) {
        if let Some(run) = &mut self.run {
            run.turn_to(Aim::Run);
            self.outbox.send(run.generation, Event::Continued);
        }
    }

    fn announce_aim(&mut self) {
        let is_due = |run: &&mut Run| !run.announced && !run.is_finishing;
        let Some(run) = self.run.as_mut().filter(is_due) else {
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
        if let Some(in_pool) = &self.in_pool {
            in_pool.cancel.cancel();
        }
    }
}
