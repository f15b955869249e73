//! The window's exposure on a graphics adapter: there with the first picture, steady while little moves, gliding else.

#![cfg(feature = "viewer")]

mod windows;

use std::sync::Arc;

use egui_kittest::Harness;
use vecrad::{
    solver::SolveSettings,
    viewer::{
        Options, action::Action, app::App, loader::SceneSource, render::headless, start::Faults,
        state::RunStatus,
    },
};
use windows::{perform, wait_for};

/// A window with an adapter, or `None` on a machine that cannot draw; CI must be able to.
fn drawing_window(scene: &'static str) -> Option<Harness<'static, App>> {
    if let Err(reason) = headless::open_gpu() {
        assert!(std::env::var_os("CI").is_none(), "CI must draw: {reason}");
        eprintln!("skipped, no graphics adapter: {reason}");
        return None;
    }
    let options = Options {
        source: Some(SceneSource::Builtin(scene.to_owned())),
        settings: SolveSettings::draft(),
        ..Options::default()
    };
    let builder = Harness::builder().with_size([800.0, 600.0]).wgpu();
    Some(builder.build_eframe(move |cc| {
        App::new(cc, options, Arc::new(Faults::default())).expect("threads can be had")
    }))
}

fn exposure(harness: &Harness<'static, App>) -> f32 {
    harness.state().state.view.exposure
}

/// Frames until the exposure has followed what is shown.
fn settle(harness: &mut Harness<'static, App>) {
    wait_for(harness, |app| {
        let (state, staged) = (&app.state, app.state.staged.as_ref());
        let shown = staged.map(|staged| &staged.wanted.snapshot);
        let is_newest = |newest| shown.is_some_and(|shown| Arc::ptr_eq(shown, newest));
        matches!(state.run.status, RunStatus::Finished(_))
            && state.run.snapshot.as_ref().is_some_and(is_newest)
            && state.exposure.target == Some(state.view.exposure)
    });
    harness.run_steps(60);
}

#[test]
fn the_exposure_is_there_at_once_and_follows_large_moves_only() {
    let Some(mut harness) = drawing_window("cornell") else {
        return;
    };
    wait_for(&mut harness, |app| app.state.exposure.target.is_some());
    settle(&mut harness);
    let settled = exposure(&harness);
    // Looking around a little changes nothing.
    harness
        .state_mut()
        .state
        .rig
        .target
        .orbit(glam::Vec2::new(10.0, 6.0));
    harness.run_steps(60);
    assert_eq!(exposure(&harness), settled);
    // The lamp's own corner of the ceiling is brighter; the way there is a glide.
    let state = &mut harness.state_mut().state;
    state.rig.target.distance *= 0.2;
    state.rig.target.pivot.y += 40.0;
    let (mut before, mut steps) = (settled, 0);
    for _ in 0..200 {
        harness.step();
        let now = exposure(&harness);
        assert!((now - before).abs() < 0.8, "a jump from {before} to {now}");
        steps += u32::from(now != before);
        before = now;
    }
    assert!(steps > 3, "{steps} frames of a glide");
    assert_ne!(exposure(&harness), settled);
}

#[test]
fn a_hand_on_the_exposure_and_changed_lamps_keep_it() {
    let Some(mut harness) = drawing_window("plates") else {
        return;
    };
    settle(&mut harness);
    let settled = exposure(&harness);
    let mut materials = harness.state().state.materials.clone();
    let lamp = materials.lights().next().expect("a plate emits");
    if let Some(light) = &mut materials.now[lamp].light {
        light.intensity = 0.1;
    }
    perform(&mut harness, Action::Relight(materials));
    wait_for(&mut harness, |app| app.state.run.relit_secs.is_some());
    harness.run_steps(60);
    assert_eq!(exposure(&harness), settled, "what is dimmed is darker");
    perform(&mut harness, Action::ExposureBy(1.0));
    harness.run_steps(30);
    assert_eq!(exposure(&harness), settled + 1.0);
    perform(&mut harness, Action::AutoExposure);
    harness.run_steps(120);
    assert_eq!(exposure(&harness), settled);
}
