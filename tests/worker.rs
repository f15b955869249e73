//! The worker with a stand-in for the solver: cancelling, pausing, generations, panics, limits.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::{
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, AtomicU32, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use glam::{DVec3, Vec3};
use vecrad::{
    hierarchy::NodeId,
    scene::{Appearance, Material, Scene, SceneBuilder, SceneOptions},
    solver::{
        Cancel, Inspection, LampLight, Note, Relit, Snapshot, SolveSettings, StepReport, Subject,
    },
    worker::{Effect, Event, Generation, Job, RunOptions, Stepper, StopReason, WorkerHandle},
};

/// Longer than any machine needs for what is waited for; only a failing test waits so long.
const PATIENCE: Duration = Duration::from_secs(30);

/// Slower than a test may last: such a step ends by being cancelled.
const FOREVER: Duration = Duration::from_secs(600);

/// The node that the fake solver knows of.
const NODE: Subject = Subject::Cluster(NodeId(0));

/// Script of the fake solver, and a record of its calls.
#[derive(Default)]
struct Script {
    /// Time that a step takes unless cancelled.
    step_time: Duration,
    /// Steps until the last.
    steps: u32,
    /// Step that panics, from 1; 0 for none.
    panics_at: u32,
    /// Memory that each step reports.
    memory_bytes: u64,
    /// How many steppers were made.
    made: AtomicU32,
    /// Numbers of the steps that began.
    begun: Mutex<Vec<u32>>,
    /// Steps that saw the cancellation.
    cancelled: AtomicU32,
    /// Nodes that were inspected.
    inspected: AtomicU32,
    /// Steppers that were dropped.
    dropped: AtomicU32,
    /// Time that changing the light takes, whether cancelled or not.
    relight_time: Duration,
    /// Emission that was requested, each time that the light began to change.
    relit: Mutex<Vec<f32>>,
    /// How often a rough light was worked out.
    finished: AtomicU32,
    /// Time that finishing the light of a step takes unless cancelled.
    finish_time: Duration,
    /// The threshold of each step, if it is not that of the settings.
    coarser: Option<f32>,
    /// Notes of each step.
    notes: Vec<Note>,
    /// How often the light of a step was finished.
    finished_steps: AtomicU32,
    /// Emission that steppers were made for.
    made_for: Mutex<Vec<Option<f32>>>,
}

struct FakeSolver {
    script: Arc<Script>,
    settings: SolveSettings,
    step: u32,
}

impl Stepper for FakeSolver {
    fn step(&mut self, cancel: &Cancel) -> Option<StepReport> {
        self.script.begun.lock().unwrap().push(self.step + 1);
        let begin = Instant::now();
        while begin.elapsed() < self.script.step_time {
            if cancel.is_cancelled() {
                self.script.cancelled.fetch_add(1, Ordering::SeqCst);
                return None;
            }
            thread::sleep(Duration::from_millis(1));
        }
        self.step += 1;
        assert!(self.step != self.script.panics_at, "the light went out");
        Some(StepReport {
            step: self.step,
            memory_bytes: self.script.memory_bytes,
            epsilon: self.script.coarser.unwrap_or(self.settings.epsilon),
            notes: self.script.notes.clone(),
            is_final: self.step >= self.script.steps.max(self.settings.max_steps),
            ..StepReport::default()
        })
    }

    fn finish(&mut self, cancel: &Cancel) -> Option<StepReport> {
        self.script.finished_steps.fetch_add(1, Ordering::SeqCst);
        let begin = Instant::now();
        while begin.elapsed() < self.script.finish_time {
            if cancel.is_cancelled() {
                return None;
            }
            thread::sleep(Duration::from_millis(1));
        }
        Some(StepReport {
            step: self.step,
            ..StepReport::default()
        })
    }

    fn snapshot(&self) -> Snapshot {
        Snapshot {
            step: self.step,
            ..Snapshot::default()
        }
    }

    fn inspect(&self, subject: &Subject) -> Option<Inspection> {
        self.script.inspected.fetch_add(1, Ordering::SeqCst);
        // It knows of one node only.
        (*subject == NODE).then(|| Inspection {
            subject: *subject,
            step: self.step,
            links: Vec::new(),
            linked: Vec3::ZERO,
            direct: Vec3::ZERO,
            row_sum: 0.0,
            error_bound: 0.0,
            path: Vec::new(),
        })
    }

    fn change_settings(&mut self, settings: SolveSettings) {
        self.settings = settings;
    }

    fn relight(&mut self, appearances: &[Appearance], _: &Cancel) -> Option<Relit> {
        self.script
            .relit
            .lock()
            .unwrap()
            .push(emission_of(appearances));
        thread::sleep(self.script.relight_time);
        Some(Relit {
            report: StepReport {
                step: self.step,
                ..StepReport::default()
            },
            is_rough: true,
            needs_restart: false,
        })
    }

    fn finish_relighting(&mut self, _: &Cancel) -> Option<StepReport> {
        self.script.finished.fetch_add(1, Ordering::SeqCst);
        Some(StepReport {
            step: self.step,
            ..StepReport::default()
        })
    }

    fn light_by_lamp(&mut self, cancel: &Cancel) -> Option<Vec<LampLight>> {
        (!cancel.is_cancelled()).then(Vec::new)
    }
}

/// Appearances with this emission.
fn appearances(emission: f32) -> Arc<[Appearance]> {
    Arc::new([Appearance {
        reflectance: Vec3::splat(0.5),
        emission: Vec3::splat(emission),
    }])
}

/// The emission of appearances.
fn emission_of(appearances: &[Appearance]) -> f32 {
    appearances[0].emission.x
}

impl Drop for FakeSolver {
    fn drop(&mut self) {
        self.script.dropped.fetch_add(1, Ordering::SeqCst);
    }
}

fn worker(script: &Arc<Script>) -> WorkerHandle {
    let script = script.clone();
    let make = move |job: Job, _: &Cancel| {
        script.made.fetch_add(1, Ordering::SeqCst);
        let made_for = job.appearances.as_deref().map(emission_of);
        script.made_for.lock().unwrap().push(made_for);
        Some(Box::new(FakeSolver {
            script: script.clone(),
            settings: job.settings,
            step: 0,
        }) as Box<dyn Stepper>)
    };
    WorkerHandle::with_steppers(Arc::new(|| {}), Arc::new(make)).unwrap()
}

/// A worker whose solver is in its first step, which ends only by being cancelled.
fn within_a_step() -> (Arc<Script>, WorkerHandle) {
    let script = Arc::new(Script {
        step_time: FOREVER,
        ..Script::default()
    });
    let mut worker = worker(&script);
    worker.start(triangle(), short(), one_thread());
    wait_for_steps(&script, 1);
    (script, worker)
}

fn triangle() -> Arc<Scene> {
    let mut builder = SceneBuilder::default();
    let corners = [DVec3::ZERO, DVec3::X, DVec3::Y].map(|corner| builder.push_position(corner));
    let material = builder.push_material(Material::plain("", Vec3::splat(0.5), Vec3::ONE));
    builder.push_triangle(corners, material);
    Arc::new(builder.finish(&SceneOptions::default()).unwrap())
}

fn short() -> SolveSettings {
    SolveSettings {
        max_steps: 1,
        ..SolveSettings::default()
    }
}

fn one_thread() -> RunOptions {
    RunOptions {
        threads: 1,
        ..RunOptions::default()
    }
}

fn wait_for(worker: &WorkerHandle, wanted: impl Fn(&Event) -> bool) -> Vec<Event> {
    let mut seen = Vec::new();
    let begin = Instant::now();
    while begin.elapsed() < PATIENCE {
        if let Some(event) = worker.next_event(PATIENCE) {
            seen.push(event);
            if wanted(&seen[seen.len() - 1]) {
                return seen;
            }
        }
    }
    panic!("the event never came; seen: {seen:?}");
}

fn is_finished(event: &Event) -> bool {
    matches!(event, Event::Finished(_))
}

/// Wait until so many steppers are gone.
fn wait_for_drops(script: &Script, count: u32) {
    let begin = Instant::now();
    while script.dropped.load(Ordering::SeqCst) < count {
        assert!(begin.elapsed() < PATIENCE, "a solve is left");
        thread::sleep(Duration::from_millis(1));
    }
}

/// Wait until the script has begun `count` steps.
fn wait_for_steps(script: &Script, count: usize) {
    let begin = Instant::now();
    while script.begun.lock().unwrap().len() < count {
        assert!(begin.elapsed() < PATIENCE, "no step began");
        thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn who_watches_sees_every_snapshot_of_every_run() {
    let script = Arc::new(Script {
        steps: 6,
        ..Script::default()
    });
    let mut worker = worker(&script);
    let seen = Arc::new(Mutex::new(Vec::new()));
    let noted = seen.clone();
    let watch = move |run: Generation, snapshot: &Arc<Snapshot>| {
        noted.lock().unwrap().push((run.number(), snapshot.step));
    };
    worker.watch(Some(Arc::new(watch)));
    worker.start(triangle(), short(), one_thread());
    wait_for(&worker, is_finished);
    let whole: Vec<(u64, u32)> = (0..=6).map(|step| (1, step)).collect();
    assert_eq!(*seen.lock().unwrap(), whole);
    worker.watch(None);
    worker.reset();
    wait_for(&worker, is_finished);
    assert_eq!(seen.lock().unwrap().len(), 7, "nobody watched the second");
}

#[test]
fn dropping_the_handle_cancels_within_one_step() {
    let script = Arc::new(Script {
        step_time: FOREVER,
        steps: 9,
        ..Script::default()
    });
    let mut worker = worker(&script);
    worker.start(triangle(), short(), one_thread());
    wait_for_steps(&script, 1);
    drop(worker);
    // On a busy machine the handle may have gone before the step came home.
    wait_for_drops(&script, 1);
    assert_eq!(script.cancelled.load(Ordering::SeqCst), 1);
    assert_eq!(*script.begun.lock().unwrap(), [1]);
}

#[test]
fn a_run_announces_each_step_and_publishes_its_light_first() {
    let script = Arc::new(Script {
        steps: 3,
        ..Script::default()
    });
    let mut worker = worker(&script);
    worker.start(triangle(), short(), one_thread());
    let events = wait_for(&worker, is_finished);
    let steps: Vec<u32> = events
        .iter()
        .filter_map(|event| match event {
            Event::Stepped(report) => Some(report.step),
            _ => None,
        })
        .collect();
    assert_eq!(events[0], Event::Started);
    assert!(matches!(events[1], Event::Prepared { .. }));
    assert_eq!(steps, [1, 2, 3]);
    assert_eq!(events.last(), Some(&Event::Finished(StopReason::Converged)));
    assert_eq!(worker.latest().map(|snapshot| snapshot.step), Some(3));
}

/// Links that stay coarse because rays do as well are no limit that cut the run short.
#[test]
fn a_run_is_converged_where_its_links_are_limited_by_what_they_gain() {
    let epsilon = short().epsilon * 2.0;
    for (notes, expected) in [
        (vec![], StopReason::StepLimit),
        (vec![Note::LinksLimited { epsilon }], StopReason::Converged),
    ] {
        let script = Arc::new(Script {
            steps: 2,
            coarser: Some(epsilon),
            notes,
            ..Script::default()
        });
        let mut worker = worker(&script);
        worker.start(triangle(), short(), one_thread());
        let events = wait_for(&worker, is_finished);
        let reason = events.iter().find_map(|event| match event {
            Event::Finished(reason) => Some(*reason),
            _ => None,
        });
        assert_eq!(reason, Some(expected));
    }
}

#[test]
fn a_run_that_is_refined_after_its_end_continues_its_clock() {
    let script = Arc::new(Script {
        step_time: Duration::from_millis(20),
        steps: 4,
        ..Script::default()
    });
    let mut worker = worker(&script);
    let settings = short();
    worker.start(triangle(), settings.clone(), one_thread());
    let mut events = wait_for(&worker, is_finished);
    let finer = SolveSettings {
        epsilon: 0.5 * settings.epsilon,
        ..settings
    };
    assert_eq!(worker.change_settings(finer), Effect::Refines);
    events.extend(wait_for(&worker, is_finished));
    let times: Vec<(f64, f64)> = events
        .iter()
        .filter_map(|event| match event {
            Event::Stepped(report) => Some((report.elapsed_s, report.solve_s)),
            _ => None,
        })
        .collect();
    assert_eq!(times.len(), 5);
    assert!(times.is_sorted_by(|one, next| one.0 < next.0), "{times:?}");
    // Whatever was computed, the clock ran meanwhile.
    assert!(
        times.iter().all(|(elapsed, solved)| elapsed >= solved),
        "{times:?}"
    );
}

#[test]
fn a_stale_generation_never_shows() {
    let script = Arc::new(Script {
        steps: 3,
        ..Script::default()
    });
    let mut worker = worker(&script);
    worker.start(triangle(), short(), one_thread());
    // The first run ends without anyone reading its events.
    let begin = Instant::now();
    while worker.latest().is_none_or(|snapshot| snapshot.step < 3) {
        assert!(begin.elapsed() < PATIENCE);
        thread::sleep(Duration::from_millis(1));
    }
    worker.start(triangle(), short(), one_thread());
    assert!(
        worker.latest().is_none_or(|snapshot| snapshot.step < 3)
            || script.begun.lock().unwrap().len() > 3,
        "the light of the first run must not show in the second"
    );
    let events = wait_for(&worker, is_finished);
    let started = events.iter().filter(|&event| *event == Event::Started);
    assert_eq!(started.count(), 1, "events of the first run: {events:?}");
}

#[test]
fn a_new_start_cancels_the_run_before() {
    let (script, mut worker) = within_a_step();
    worker.start(triangle(), short(), one_thread());
    wait_for_steps(&script, 2);
    wait_for_drops(&script, 1);
    assert_eq!(script.cancelled.load(Ordering::SeqCst), 1);
}

/// A worker whose first `count` preparations heed nothing until they are released, and how many were begun.
struct Stubborn {
    begun: Arc<AtomicU32>,
    is_released: Arc<AtomicBool>,
    script: Arc<Script>,
    worker: WorkerHandle,
}

fn stubborn(count: u32) -> Stubborn {
    let (begun, is_released) = (Arc::new(AtomicU32::new(0)), Arc::default());
    let script = Arc::new(Script::default());
    let (counter, released, made) = (begun.clone(), Arc::clone(&is_released), script.clone());
    let make = move |job: Job, _: &Cancel| {
        let is_stubborn = counter.fetch_add(1, Ordering::SeqCst) < count;
        while is_stubborn && !AtomicBool::load(&released, Ordering::SeqCst) {
            thread::sleep(Duration::from_millis(1));
        }
        Some(Box::new(FakeSolver {
            script: made.clone(),
            settings: job.settings,
            // Its light is told from that of the others.
            step: if is_stubborn { 100 } else { 0 },
        }) as Box<dyn Stepper>)
    };
    Stubborn {
        begun,
        is_released,
        script,
        worker: WorkerHandle::with_steppers(Arc::new(|| {}), Arc::new(make)).unwrap(),
    }
}

impl Stubborn {
    fn wait_for_begun(&self, count: u32) {
        let begin = Instant::now();
        while self.begun.load(Ordering::SeqCst) < count {
            assert!(begin.elapsed() < PATIENCE, "no preparation began");
            thread::sleep(Duration::from_millis(1));
        }
    }

    fn release(&self) {
        self.is_released.store(true, Ordering::SeqCst);
    }
}

#[test]
fn a_new_run_does_not_wait_for_what_cannot_be_interrupted() {
    let mut stubborn_worker = stubborn(1);
    stubborn_worker
        .worker
        .start(triangle(), short(), one_thread());
    stubborn_worker.wait_for_begun(1);
    stubborn_worker
        .worker
        .start(triangle(), short(), one_thread());
    // The first is still being prepared.
    let events = wait_for(&stubborn_worker.worker, is_finished);
    assert_eq!(events.last(), Some(&Event::Finished(StopReason::Converged)));
    stubborn_worker.release();
    wait_for_drops(&stubborn_worker.script, 1);
    assert!(
        stubborn_worker
            .worker
            .next_event(Duration::from_millis(60))
            .is_none()
    );
    assert_eq!(
        stubborn_worker
            .worker
            .latest()
            .map(|snapshot| snapshot.step),
        Some(1)
    );
}

#[test]
fn only_so_many_are_left_behind() {
    let mut stubborn_worker = stubborn(9);
    for count in 1..=3 {
        stubborn_worker
            .worker
            .start(triangle(), short(), one_thread());
        stubborn_worker.wait_for_begun(count);
    }
    stubborn_worker
        .worker
        .start(triangle(), short(), one_thread());
    thread::sleep(Duration::from_millis(300));
    assert_eq!(
        stubborn_worker.begun.load(Ordering::SeqCst),
        3,
        "the fourth waits"
    );
    stubborn_worker.release();
    let events = wait_for(&stubborn_worker.worker, is_finished);
    assert_eq!(events.last(), Some(&Event::Finished(StopReason::Converged)));
    wait_for_drops(&stubborn_worker.script, 3);
    assert_eq!(stubborn_worker.begun.load(Ordering::SeqCst), 4);
}

#[test]
fn dropping_the_handle_does_not_wait_for_what_cannot_be_interrupted() {
    let Stubborn {
        mut worker,
        begun,
        is_released,
        script,
    } = stubborn(1);
    worker.start(triangle(), short(), one_thread());
    let begin = Instant::now();
    while begun.load(Ordering::SeqCst) == 0 {
        assert!(begin.elapsed() < PATIENCE);
        thread::sleep(Duration::from_millis(1));
    }
    // It would wait for ever: nothing releases the preparation before.
    drop(worker);
    is_released.store(true, Ordering::SeqCst);
    wait_for_drops(&script, 1);
}

/// A worker whose first preparation lasts until it is told to end, and how many were begun.
fn prepared_at_the_second_try() -> (Arc<AtomicU32>, WorkerHandle) {
    let made = Arc::new(AtomicU32::new(0));
    let (counter, script) = (made.clone(), Arc::new(Script::default()));
    let make = move |job: Job, cancel: &Cancel| {
        if counter.fetch_add(1, Ordering::SeqCst) == 0 {
            while !cancel.is_cancelled() {
                thread::yield_now();
            }
            return None;
        }
        Some(Box::new(FakeSolver {
            script: script.clone(),
            settings: job.settings,
            step: 0,
        }) as Box<dyn Stepper>)
    };
    let worker = WorkerHandle::with_steppers(Arc::new(|| {}), Arc::new(make)).unwrap();
    (made, worker)
}

#[test]
fn stopping_ends_the_preparation_and_going_on_prepares_anew() {
    let (made, mut worker) = prepared_at_the_second_try();
    worker.start(triangle(), short(), one_thread());
    while made.load(Ordering::SeqCst) == 0 {
        thread::yield_now();
    }
    worker.stop();
    let events = wait_for(&worker, is_finished);
    assert_eq!(events.last(), Some(&Event::Finished(StopReason::Requested)));
    assert!(worker.latest().is_none());
    worker.resume();
    let events = wait_for(&worker, is_finished);
    assert_eq!(events.last(), Some(&Event::Finished(StopReason::Converged)));
    assert_eq!(made.load(Ordering::SeqCst), 2);
}

#[test]
fn pause_stops_steps_and_continue_goes_on_without_a_restart() {
    let script = Arc::new(Script {
        step_time: Duration::from_millis(20),
        steps: 4,
        ..Script::default()
    });
    let mut worker = worker(&script);
    worker.start(triangle(), short(), one_thread());
    wait_for(&worker, |event| matches!(event, Event::Stepped(_)));
    worker.pause();
    wait_for(&worker, |event| *event == Event::Paused);
    let begun = script.begun.lock().unwrap().len();
    assert!(worker.next_event(Duration::from_millis(60)).is_none());
    assert_eq!(script.begun.lock().unwrap().len(), begun, "it rests");

    worker.resume();
    let events = wait_for(&worker, is_finished);
    assert_eq!(events[0], Event::Continued);
    assert_eq!(script.made.load(Ordering::SeqCst), 1, "never made anew");
    assert_eq!(worker.latest().map(|snapshot| snapshot.step), Some(4));
}

#[test]
fn stop_interrupts_a_step_and_keeps_the_light() {
    let (_, worker) = within_a_step();
    worker.stop();
    let events = wait_for(&worker, is_finished);
    assert_eq!(events.last(), Some(&Event::Finished(StopReason::Requested)));
    assert!(worker.latest().is_some());
}

/// A worker that has done a step, is in the second one if `is_running`, and else rests.
fn after_a_step(script: Script, is_running: bool) -> (Arc<Script>, WorkerHandle) {
    let script = Arc::new(Script {
        step_time: Duration::from_millis(100),
        steps: 1_000,
        ..script
    });
    let mut worker = worker(&script);
    worker.start(triangle(), short(), one_thread());
    wait_for(&worker, |event| matches!(event, Event::Stepped(_)));
    if !is_running {
        worker.pause();
        wait_for(&worker, |event| *event == Event::Paused);
    }
    (script, worker)
}

#[test]
fn stop_finishes_the_light_of_the_last_step() {
    for is_running in [true, false] {
        let (script, worker) = after_a_step(Script::default(), is_running);
        worker.stop();
        let events = wait_for(&worker, is_finished);
        assert_eq!(events.last(), Some(&Event::Finished(StopReason::Requested)));
        let finished = || script.finished_steps.load(Ordering::SeqCst);
        assert_eq!(finished(), 1, "{events:?}");
        let is_step = |event: &&Event| matches!(event, Event::Stepped(_));
        assert!(events.iter().any(|event| is_step(&event)), "{events:?}");
        // There is nothing more to finish, until another step is done.
        worker.stop();
        assert!(worker.next_event(Duration::from_millis(60)).is_none());
        assert_eq!(finished(), 1);
        worker.resume();
        wait_for(&worker, |event| matches!(event, Event::Stepped(_)));
        worker.stop();
        wait_for(&worker, is_finished);
        assert_eq!(finished(), 2);
    }
}

#[test]
fn stop_asked_a_second_time_ends_at_once() {
    for is_running in [true, false] {
        let script = Script {
            finish_time: FOREVER,
            ..Script::default()
        };
        let (script, worker) = after_a_step(script, is_running);
        worker.stop();
        let begin = Instant::now();
        while script.finished_steps.load(Ordering::SeqCst) == 0 {
            assert!(begin.elapsed() < PATIENCE, "nothing is finished");
            thread::sleep(Duration::from_millis(1));
        }
        worker.stop();
        let events = wait_for(&worker, is_finished);
        assert_eq!(events.last(), Some(&Event::Finished(StopReason::Requested)));
    }
}

#[test]
fn the_time_limit_interrupts_a_step_and_continue_grants_it_anew() {
    let script = Arc::new(Script {
        step_time: FOREVER,
        ..Script::default()
    });
    let mut worker = worker(&script);
    let options = RunOptions {
        time_limit: Some(Duration::from_millis(30)),
        ..one_thread()
    };
    worker.start(triangle(), short(), options);
    for limits in 1..=2 {
        let events = wait_for(&worker, is_finished);
        assert_eq!(events.last(), Some(&Event::Finished(StopReason::TimeLimit)));
        let times = events.iter().find_map(|event| match event {
            Event::Interrupted { elapsed_s, solve_s } => Some([*elapsed_s, *solve_s]),
            _ => None,
        });
        let spent = 0.03 * f64::from(limits);
        // The solve begins after the scene has been read, and its own time with it.
        assert!(
            times.is_some_and(|[elapsed, solve]| (spent..60.0).contains(&elapsed)
                && (0.2 * spent..60.0).contains(&solve)),
            "the interrupted step counts: {times:?}"
        );
        worker.resume();
    }
    assert_eq!(script.made.load(Ordering::SeqCst), 1);
}

#[test]
fn light_is_finished_before_a_time_limit_that_no_further_step_meets() {
    let script = Arc::new(Script {
        step_time: Duration::from_millis(20),
        steps: u32::MAX,
        ..Script::default()
    });
    let mut worker = worker(&script);
    let options = RunOptions {
        time_limit: Some(Duration::from_secs(1)),
        ..one_thread()
    };
    worker.start(triangle(), short(), options);
    let events = wait_for(&worker, is_finished);
    assert_eq!(events.last(), Some(&Event::Finished(StopReason::TimeLimit)));
    let steps: Vec<u32> = events
        .iter()
        .filter_map(|event| match event {
            Event::Stepped(report) => Some(report.step),
            _ => None,
        })
        .collect();
    let again = steps.windows(2).filter(|pair| pair[0] == pair[1]).count();
    // Once for each of the last steps, and never for one that another follows in time.
    let finished = script.finished_steps.load(Ordering::SeqCst) as usize;
    assert!(
        (1..=steps.len() / 2).contains(&finished),
        "{finished} of {steps:?}"
    );
    assert_eq!(again, finished, "{steps:?}");
}

#[test]
fn without_a_time_limit_only_steps_are_made() {
    let script = Arc::new(Script {
        steps: 3,
        ..Script::default()
    });
    let mut worker = worker(&script);
    worker.start(triangle(), short(), one_thread());
    wait_for(&worker, is_finished);
    assert_eq!(script.finished_steps.load(Ordering::SeqCst), 0);
}

#[test]
fn the_memory_limit_ends_the_run() {
    let script = Arc::new(Script {
        steps: 9,
        memory_bytes: 1000,
        ..Script::default()
    });
    let mut worker = worker(&script);
    let options = RunOptions {
        memory_limit: Some(1000),
        ..one_thread()
    };
    worker.start(triangle(), short(), options);
    let events = wait_for(&worker, is_finished);
    assert_eq!(
        events.last(),
        Some(&Event::Finished(StopReason::MemoryLimit))
    );
    assert_eq!(script.begun.lock().unwrap().len(), 1);
}

#[test]
fn a_panic_becomes_a_message_and_a_following_start_works() {
    let script = Arc::new(Script {
        steps: 2,
        panics_at: 2,
        ..Script::default()
    });
    let mut worker = worker(&script);
    worker.start(triangle(), short(), one_thread());
    let events = wait_for(&worker, |event| matches!(event, Event::Failed(_)));
    assert_eq!(
        events.last(),
        Some(&Event::Failed("the light went out".to_owned()))
    );
    worker.resume();
    worker.start(triangle(), short(), one_thread());
    let events = wait_for(&worker, |event| matches!(event, Event::Stepped(_)));
    assert_eq!(events[0], Event::Started);
}

#[test]
fn changed_settings_refine_a_finished_run_or_restart_it() {
    let script = Arc::new(Script {
        steps: 1,
        ..Script::default()
    });
    let mut worker = worker(&script);
    worker.start(triangle(), short(), one_thread());
    wait_for(&worker, is_finished);

    let more = SolveSettings {
        max_steps: 3,
        ..short()
    };
    assert_eq!(worker.change_settings(more.clone()), Effect::Refines);
    let events = wait_for(&worker, is_finished);
    assert_eq!(events[0], Event::Continued);
    assert_eq!(worker.latest().map(|snapshot| snapshot.step), Some(3));
    assert_eq!(script.made.load(Ordering::SeqCst), 1);

    let reseeded = SolveSettings { seed: 2, ..more };
    assert_eq!(worker.change_settings(reseeded), Effect::Restarts);
    let events = wait_for(&worker, is_finished);
    assert_eq!(events[0], Event::Started);
    assert_eq!(script.made.load(Ordering::SeqCst), 2);
    assert_eq!(worker.settings().seed, 2);
}

#[test]
fn every_event_wakes_the_owner() {
    let script = Arc::new(Script::default());
    let wakes = Arc::new(AtomicU32::new(0));
    let counter = wakes.clone();
    let make_script = script.clone();
    let mut worker = WorkerHandle::with_steppers(
        Arc::new(move || {
            counter.fetch_add(1, Ordering::SeqCst);
        }),
        Arc::new(move |job: Job, _: &Cancel| {
            Some(Box::new(FakeSolver {
                script: make_script.clone(),
                settings: job.settings,
                step: 0,
            }) as Box<dyn Stepper>)
        }),
    )
    .unwrap();
    worker.start(triangle(), short(), one_thread());
    let events = wait_for(&worker, is_finished);
    drop(worker);
    assert_eq!(wakes.load(Ordering::SeqCst) as usize, events.len());
}

#[test]
fn a_pause_ends_the_preparation_and_going_on_prepares_anew() {
    let (made, mut worker) = prepared_at_the_second_try();
    worker.start(triangle(), short(), one_thread());
    worker.pause();
    wait_for(&worker, |event| matches!(event, Event::Paused));
    worker.resume();
    let events = wait_for(&worker, is_finished);
    assert!(
        events
            .iter()
            .any(|event| matches!(event, Event::Prepared { .. }))
    );
    // The pause may have come before the first preparation began.
    assert!(made.load(Ordering::SeqCst) <= 2);
}

/// Steps that the answers among some events are of.
fn answers(events: &[Event]) -> Vec<u32> {
    events
        .iter()
        .filter_map(|event| match event {
            Event::Inspected(inspection) => Some(inspection.step),
            _ => None,
        })
        .collect()
}

#[test]
fn a_question_is_answered_while_the_run_rests_and_after_its_end() {
    let (script, worker) = within_a_step();
    worker.pause();
    wait_for(&worker, |event| *event == Event::Paused);
    let unknown = Subject::Cluster(NodeId(9));
    worker.inspect(vec![unknown, NODE]);
    let events = wait_for(&worker, |event| matches!(event, Event::Inspected(_)));
    assert_eq!(events.len(), 1, "nothing is announced again: {events:?}");
    assert_eq!(answers(&events), [0]);
    assert_eq!(script.inspected.load(Ordering::SeqCst), 2);
    assert_eq!(script.begun.lock().unwrap().len(), 1, "it still rests");

    worker.stop();
    wait_for(&worker, is_finished);
    worker.inspect(vec![NODE]);
    let events = wait_for(&worker, |event| matches!(event, Event::Inspected(_)));
    assert_eq!(events.len(), 1, "{events:?}");
}

#[test]
fn a_question_is_answered_after_each_step_and_interrupts_none() {
    let script = Arc::new(Script {
        step_time: Duration::from_millis(20),
        steps: 4,
        ..Script::default()
    });
    let mut worker = worker(&script);
    worker.start(triangle(), short(), one_thread());
    wait_for_steps(&script, 1);
    worker.inspect(vec![NODE]);
    let is_last =
        |event: &Event| matches!(event, Event::Inspected(inspection) if inspection.step == 4);
    let events = wait_for(&worker, is_last);
    assert_eq!(answers(&events), [1, 2, 3, 4]);
    assert_eq!(*script.begun.lock().unwrap(), [1, 2, 3, 4]);
    assert_eq!(script.cancelled.load(Ordering::SeqCst), 0);
    let ends = events.iter().filter(|event| is_finished(event)).count();
    assert_eq!(ends, 1, "{events:?}");
    // Nothing more is asked: nothing more is said.
    worker.inspect(Vec::new());
    assert!(worker.next_event(Duration::from_millis(60)).is_none());
}

#[test]
fn pausing_during_a_question_is_still_announced() {
    let script = Arc::new(Script {
        step_time: Duration::from_millis(1),
        steps: 1_000_000,
        ..Script::default()
    });
    let mut worker = worker(&script);
    worker.start(triangle(), short(), one_thread());
    for _ in 0..20 {
        worker.inspect(vec![NODE]);
        worker.pause();
        wait_for(&worker, |event| *event == Event::Paused);
        worker.resume();
        wait_for(&worker, |event| *event == Event::Continued);
    }
    assert_eq!(script.made.load(Ordering::SeqCst), 1);
}

#[test]
fn a_question_about_an_older_run_is_dropped() {
    let script = Arc::new(Script {
        steps: 2,
        ..Script::default()
    });
    let mut worker = worker(&script);
    worker.start(triangle(), short(), one_thread());
    wait_for(&worker, is_finished);
    // One answer is given and not read, one question is never answered.
    worker.inspect(vec![NODE]);
    let begin = Instant::now();
    while script.inspected.load(Ordering::SeqCst) == 0 {
        assert!(begin.elapsed() < PATIENCE);
        thread::sleep(Duration::from_millis(1));
    }
    worker.start(triangle(), short(), one_thread());
    let events = wait_for(&worker, is_finished);
    assert!(answers(&events).is_empty(), "{events:?}");
    assert_eq!(script.inspected.load(Ordering::SeqCst), 1);
}

fn is_relit(event: &Event) -> bool {
    matches!(event, Event::Relit { .. })
}

/// The light is changed and all that it omitted is worked out.
fn is_relit_finely(event: &Event) -> bool {
    matches!(event, Event::Relit { seconds: None, .. })
}

/// Wait until the light begins to change for the so-manieth time.
fn wait_for_requests(script: &Script, count: usize) {
    let begin = Instant::now();
    while script.relit.lock().unwrap().len() < count {
        assert!(begin.elapsed() < PATIENCE, "the light never changed");
        thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn of_many_requests_for_light_only_the_last_is_done() {
    let script = Arc::new(Script {
        relight_time: Duration::from_millis(200),
        ..Script::default()
    });
    let mut worker = worker(&script);
    worker.start(triangle(), short(), one_thread());
    wait_for(&worker, is_finished);
    worker.relight(appearances(1.0));
    wait_for_requests(&script, 1);
    for emission in [2.0, 3.0, 4.0] {
        worker.relight(appearances(emission));
    }
    wait_for(&worker, is_relit_finely);
    assert_eq!(*script.relit.lock().unwrap(), [1.0, 4.0]);
    let finished = script.finished.load(Ordering::SeqCst);
    assert_eq!(finished, 1, "what is changed again is not worked out");
}

#[test]
fn a_finished_run_rests_after_its_light_was_changed_and_can_go_on() {
    let script = Arc::new(Script::default());
    let mut worker = worker(&script);
    worker.start(triangle(), short(), one_thread());
    wait_for(&worker, is_finished);
    worker.relight(appearances(2.0));
    let events = wait_for(&worker, |event| *event == Event::Paused);
    assert!(is_relit(&events[0]), "{events:?}");
    worker.resume();
    wait_for(&worker, is_finished);
    assert_eq!(*script.begun.lock().unwrap(), [1, 2], "one more step");
}

#[test]
fn light_is_changed_at_once_and_the_step_under_way_is_made_again() {
    let (script, worker) = within_a_step();
    worker.relight(appearances(2.0));
    wait_for(&worker, is_relit);
    wait_for_steps(&script, 2);
    assert_eq!(script.cancelled.load(Ordering::SeqCst), 1);
    assert_eq!(*script.begun.lock().unwrap(), [1, 1]);
    assert_eq!(script.made.load(Ordering::SeqCst), 1, "nothing begins anew");
}

#[test]
fn changed_light_holds_for_a_new_start_on_the_same_scene_only() {
    let script = Arc::new(Script::default());
    let mut worker = worker(&script);
    worker.start(triangle(), short(), one_thread());
    wait_for(&worker, is_finished);
    worker.relight(appearances(2.0));
    wait_for(&worker, is_relit);
    worker.reset();
    wait_for(&worker, is_finished);
    worker.start(triangle(), short(), one_thread());
    wait_for(&worker, is_finished);
    assert_eq!(*script.made_for.lock().unwrap(), [None, Some(2.0), None]);
    assert_eq!(*script.relit.lock().unwrap(), [2.0], "it is made with it");
}
