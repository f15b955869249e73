//! The reference thread: it measures, gets better, cancels at once, and leaves nothing behind.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod display_scenes;

use std::{
    f32::consts::PI,
    sync::{
        Arc,
        atomic::{AtomicU32, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use glam::Vec3;
use vecrad::{
    geometry::RayTree,
    scene::{Scene, SceneOptions, builtin},
    solver::{Snapshot, VertexLight},
    worker::{TruthHandle, TruthProgress},
};

/// Longer than any machine needs for what is waited for; only a failing test waits so long.
const PATIENCE: Duration = Duration::from_secs(120);

/// Radiance that the walls of the furnace emit, and their reflectance.
const EMISSION: f32 = 1.0;
const REFLECTANCE: f32 = 0.5;

/// A closed cube in which all light is known: radiance is emission / (1 − reflectance) everywhere.
fn furnace() -> Arc<Scene> {
    let scene = builtin::furnace(REFLECTANCE, EMISSION, 2);
    Arc::new(scene.finish(&SceneOptions::default()).unwrap())
}

/// The scene's own triangles under even light.
fn snapshot(scene: &Scene, step: u32, irradiance: f32) -> Arc<Snapshot> {
    let mesh = display_scenes::own_triangles(scene);
    let light = VertexLight {
        irradiance: vec![Vec3::splat(irradiance); mesh.positions.len()],
        ..VertexLight::default()
    };
    Arc::new(Snapshot {
        step,
        mesh: Arc::new(mesh),
        light: Arc::new(light),
        clusters: Arc::default(),
        omitted: Arc::default(),
        lights: None,
        errors: Arc::default(),
    })
}

/// The progress once it satisfies a condition.
fn wait_for(handle: &TruthHandle, holds: impl Fn(&TruthProgress) -> bool) -> Arc<TruthProgress> {
    let begin = Instant::now();
    loop {
        let progress = handle.progress();
        if holds(&progress) {
            return progress;
        }
        assert!(begin.elapsed() < PATIENCE, "{progress:?}");
        thread::sleep(Duration::from_millis(2));
    }
}

fn trace(scene: &Arc<Scene>) -> TruthHandle {
    let rays = Arc::new(RayTree::new(scene));
    TruthHandle::spawn(scene.clone(), rays, 1, Arc::new(|| {})).unwrap()
}

#[test]
fn a_perfect_answer_has_no_error_and_a_wrong_one_has_its_own() {
    let scene = furnace();
    let handle = trace(&scene);
    let truth = PI * EMISSION / (1.0 - REFLECTANCE);
    handle.measure(1, snapshot(&scene, 1, truth));
    handle.measure(1, snapshot(&scene, 2, 0.5 * truth));
    let progress = wait_for(&handle, |progress| {
        progress.samples >= 64 && progress.errors.len() == 2
    });
    let (right, wrong) = (&progress.errors[&(1, 1)], &progress.errors[&(1, 2)]);
    // The mean over 4,000 points is 60 times as sharp as one point; what is left of the square is noise of noise.
    assert!(right.noise_floor < 0.05, "{right:?}");
    assert!(right.relative_rms < 0.5 * right.noise_floor, "{right:?}");
    assert!(
        (right.energy_ratio.unwrap() - 1.0).abs() < 0.005,
        "{right:?}"
    );
    // Radiance 1 + 0.5 · 1 instead of 1 + 0.5 · 2.
    assert!((wrong.relative_rms - 0.25).abs() < 0.01, "{wrong:?}");
    assert!((wrong.energy_ratio.unwrap() - 0.75).abs() < 0.01);
}

#[test]
fn samples_grow_and_so_does_what_was_measured_before() {
    let scene = furnace();
    let handle = trace(&scene);
    handle.measure(3, snapshot(&scene, 1, 1.0));
    let early = wait_for(&handle, |progress| !progress.errors.is_empty());
    let late = wait_for(&handle, |progress| progress.samples >= 8 * early.samples);
    let floor = |progress: &TruthProgress| progress.errors[&(3, 1)].noise_floor;
    assert!(floor(&late) < 0.6 * floor(&early), "8 times the samples");
}

#[test]
fn vertices_are_compared_when_asked_for() {
    let scene = furnace();
    let handle = trace(&scene);
    let truth = PI * EMISSION / (1.0 - REFLECTANCE);
    let wrong = snapshot(&scene, 1, 0.5 * truth);
    handle.compare_vertices(Some(wrong.clone()));
    let progress = wait_for(&handle, |progress| {
        progress.vertices.is_some() && progress.vertex_samples.0 >= 64
    });
    let errors = progress.vertices.as_ref().unwrap();
    assert!(Arc::ptr_eq(&errors.mesh, &wrong.mesh));
    let mean = errors.percent.iter().sum::<f32>() / errors.percent.len() as f32;
    assert!((mean - 25.0).abs() < 3.0, "{mean} % instead of 25 %");
    handle.compare_vertices(None);
    wait_for(&handle, |progress| progress.vertices.is_none());
}

#[test]
fn a_forgotten_run_is_gone_and_others_stay() {
    let scene = furnace();
    let handle = trace(&scene);
    handle.measure(1, snapshot(&scene, 1, 1.0));
    handle.measure(2, snapshot(&scene, 1, 2.0));
    wait_for(&handle, |progress| progress.errors.len() == 2);
    handle.forget(1);
    let progress = wait_for(&handle, |progress| progress.errors.len() == 1);
    assert!(progress.errors.contains_key(&(2, 1)));
}

#[test]
fn a_resting_reference_still_measures() {
    let scene = furnace();
    let handle = trace(&scene);
    wait_for(&handle, |progress| progress.samples > 0);
    handle.rest(true);
    assert!(handle.rests());
    handle.measure(1, snapshot(&scene, 1, 1.0));
    wait_for(&handle, |progress| progress.errors.len() == 1);
}

#[test]
fn dropping_the_handle_ends_the_thread_in_the_midst_of_a_pass() {
    let scene = Arc::new(
        builtin::builtin("room-8621", &SceneOptions::default())
            .unwrap()
            .unwrap(),
    );
    let woken = Arc::new(AtomicU32::new(0));
    let counted = woken.clone();
    let wake = Arc::new(move || {
        counted.fetch_add(1, Ordering::SeqCst);
    });
    let rays = Arc::new(RayTree::new(&scene));
    let weak = Arc::downgrade(&rays);
    let handle = TruthHandle::spawn(scene, rays, 0, wake).unwrap();
    wait_for(&handle, |progress| progress.samples > 0);
    let begin = Instant::now();
    drop(handle);
    println!("ended after {:?}", begin.elapsed());
    assert!(weak.upgrade().is_none(), "the thread let go of the scene");
    let seen = woken.load(Ordering::SeqCst);
    thread::sleep(Duration::from_millis(20));
    assert_eq!(woken.load(Ordering::SeqCst), seen, "nobody is left to wake");
}
