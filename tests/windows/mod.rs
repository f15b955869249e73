//! Windows without a graphics adapter, for tests of what they show and do.

#![allow(dead_code, reason = "each test uses some of it")]

use std::{
    fs,
    sync::Arc,
    time::{Duration, Instant},
};

use egui_kittest::Harness;
use tempfile::TempDir;
use vecrad::{
    solver::SolveSettings,
    viewer::{
        Options, action::Action, app::App, faults::Faults, loader::SceneSource, run::RunStatus,
    },
};

/// An OBJ file of one face.
pub(crate) const ONE_TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// Longest wait for a small scene on a busy machine.
const PATIENCE: Duration = Duration::from_secs(120);

/// A window that opens with these options.
pub(crate) fn window(options: Options) -> Harness<'static, App> {
    window_of_size(options, [1280.0, 1000.0])
}

/// A window of a size in points.
pub(crate) fn window_of_size(options: Options, size: [f32; 2]) -> Harness<'static, App> {
    Harness::builder().with_size(size).build_eframe(move |cc| {
        App::new(cc, options, Arc::new(Faults::default())).expect("threads can be had")
    })
}

/// A window that lights the two plates: a moment's work.
pub(crate) fn plates() -> Harness<'static, App> {
    plates_of_size([1280.0, 1000.0])
}

/// The same in a window of a size in points.
pub(crate) fn plates_of_size(size: [f32; 2]) -> Harness<'static, App> {
    let options = Options {
        source: Some(SceneSource::Builtin("plates".to_owned())),
        settings: SolveSettings::draft(),
        ..Options::default()
    };
    let mut harness = window_of_size(options, size);
    wait_for(&mut harness, |app| {
        matches!(app.state.run.status, RunStatus::Finished(_))
    });
    harness
}

/// A window that shows a file of this name with one face, and the folder of the file.
pub(crate) fn one_triangle(name: &str) -> (TempDir, Harness<'static, App>) {
    let folder = tempfile::tempdir().expect("a folder can be made");
    let scene = folder.path().join(name);
    fs::write(&scene, ONE_TRIANGLE).expect("it can be written");
    let mut harness = window(Options {
        source: Some(SceneSource::File(scene)),
        settings: SolveSettings::draft(),
        ..Options::default()
    });
    wait_for(&mut harness, |app| app.state.loaded.is_some());
    (folder, harness)
}

/// Frames until something holds.
pub(crate) fn wait_for(harness: &mut Harness<'static, App>, holds: impl Fn(&App) -> bool) {
    let begin = Instant::now();
    while !holds(harness.state()) {
        assert!(
            begin.elapsed() < PATIENCE,
            "{:?}",
            harness.state().state.run.status
        );
        std::thread::sleep(Duration::from_millis(10));
        harness.step();
    }
    harness.run_steps(3);
}

/// Do what the user would have asked for.
pub(crate) fn perform(harness: &mut Harness<'static, App>, action: Action) {
    let ctx = harness.ctx.clone();
    harness.state_mut().perform(&ctx, action);
    harness.run_steps(2);
}
