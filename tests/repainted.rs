//! Dark surfaces that are omitted, and materials that are repainted so that light reaches them.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::{sync::Arc, time::Duration};

use common::{finish, step_to_end};
use glam::{DVec3, Vec3};
use vecrad::{
    scene::{Appearance, Material, MaterialId, Scene, SceneBuilder, Sides},
    solver::{Cancel, Snapshot, SolveSettings, Solver},
    worker::{Event, RunOptions, WorkerHandle},
};

const LAMP: usize = 0;
const WALL: usize = 1;
const TARGET: usize = 2;

/// A small lamp that shines at a large black wall, and behind the lamp a white target that sees the wall only.
fn scene() -> Arc<Scene> {
    let mut builder = SceneBuilder::default();
    let white = Vec3::splat(0.7);
    builder.push_material(Material::plain("lamp", Vec3::ZERO, Vec3::splat(9.0)));
    builder.push_material(Material::plain("wall", Vec3::ZERO, Vec3::ZERO));
    builder.push_material(Material::plain("target", white, Vec3::ZERO));
    let (y, z) = (DVec3::Y, DVec3::Z);
    let mut square = |material: usize, x: f64, half: f64, u: DVec3, v: DVec3| {
        let corner = DVec3::X * x - (u + v) * half;
        let (u, v) = (u * 2.0 * half, v * 2.0 * half);
        let [a, b, c, d] = [corner, corner + u, corner + u + v, corner + v]
            .map(|corner| builder.push_position(corner));
        let material = MaterialId(material as u32);
        builder.push_triangle([a, b, c], material);
        builder.push_triangle([a, c, d], material);
    };
    square(LAMP, 0.0, 0.25, y, z);
    square(WALL, 2.0, 2.0, z, y);
    square(TARGET, -1.0, 1.0, y, z);
    finish(builder, Sides::One)
}

fn finished(mut solver: Solver) -> Solver {
    step_to_end(&mut solver, |_, _| {});
    solver
}

fn solver(scene: &Arc<Scene>, requested: Option<&[Appearance]>) -> Solver {
    let settings = SolveSettings::draft();
    let cancel = Cancel::default();
    Solver::with_rays(scene.clone(), None, settings, None, requested, &cancel).unwrap()
}

/// The appearances of the scene but for one material.
fn with(scene: &Scene, material: usize, change: impl Fn(&mut Appearance)) -> Vec<Appearance> {
    let mut appearances = scene.appearances();
    change(&mut appearances[material]);
    appearances
}

/// Mean irradiance (red) at the display vertices of a material.
fn irradiance(scene: &Scene, snapshot: &Snapshot, material: usize) -> f32 {
    let mesh = &snapshot.mesh;
    let of = |triangle: &u32| scene.triangles[*triangle as usize].material.index() == material;
    let corners = mesh.indices.iter().zip(&mesh.triangle_of);
    let own: Vec<f32> = corners
        .filter(|(_, triangle)| of(triangle))
        .flat_map(|(corners, _)| corners.map(|at| snapshot.light.irradiance[at as usize].x))
        .collect();
    own.iter().sum::<f32>() / own.len() as f32
}

#[test]
fn light_that_reaches_what_was_omitted_asks_for_a_new_solve() {
    let scene = scene();
    let mut lean = finished(solver(&scene, None));
    let unlit = lean.snapshot().omitted[0].clone();
    assert_eq!((unlit.name, unlit.count), ("unlit", 2), "the target");
    let white = with(&scene, WALL, |wall| wall.reflectance = Vec3::splat(0.8));
    let relit = lean.relight(&white, &Cancel::default()).unwrap();
    assert!(relit.needs_restart);
    assert_eq!(
        irradiance(&scene, &lean.snapshot(), TARGET),
        0.0,
        "it is missing"
    );
    // A solve that begins anew shows it, as that of a scene that was read so.
    let anew = finished(solver(&scene, Some(&white)));
    let read = finished(solver(&Arc::new(scene.relit(&white)), None));
    let [anew, read] = [anew, read].map(|solver| irradiance(&scene, &solver.snapshot(), TARGET));
    assert!(
        read > 0.05 && (anew / read - 1.0).abs() < 0.02,
        "{anew} {read}"
    );
}

#[test]
fn what_begins_to_shine_where_it_was_omitted_asks_for_a_new_solve() {
    let scene = scene();
    let mut lean = finished(solver(&scene, None));
    let shining = with(&scene, TARGET, |target| target.emission = Vec3::ONE);
    let relit = lean.relight(&shining, &Cancel::default()).unwrap();
    assert!(relit.needs_restart);
    let before = irradiance(&scene, &lean.snapshot(), WALL);
    let anew = finished(solver(&scene, Some(&shining)));
    let after = irradiance(&scene, &anew.snapshot(), WALL);
    assert!(after > 1.2 * before, "{after} {before}");
}

#[test]
fn changes_that_light_nothing_else_need_no_new_solve() {
    let scene = scene();
    let mut lean = finished(solver(&scene, None));
    for requested in [
        // Nothing shines at the lamp, and it looks at the wall only.
        with(&scene, LAMP, |lamp| lamp.reflectance = Vec3::splat(0.5)),
        with(&scene, LAMP, |lamp| lamp.emission = Vec3::ZERO),
        with(&scene, LAMP, |lamp| lamp.emission *= 3.0),
        with(&scene, TARGET, |target| {
            target.reflectance = Vec3::splat(0.1);
        }),
        scene.appearances(),
    ] {
        let relit = lean.relight(&requested, &Cancel::default()).unwrap();
        assert!(!relit.needs_restart);
    }
    // Made for a white wall, a solve holds for both.
    let white = with(&scene, WALL, |wall| wall.reflectance = Vec3::splat(0.8));
    let mut wide = finished(solver(&scene, Some(&white)));
    for (requested, is_dark) in [(&scene.appearances(), true), (&white, false)] {
        let relit = wide.relight(requested, &Cancel::default()).unwrap();
        assert!(!relit.needs_restart);
        let light = irradiance(&scene, &wide.snapshot(), TARGET);
        assert_eq!(light == 0.0, is_dark, "{light}");
    }
}

#[test]
fn the_worker_says_so_and_a_run_that_begins_again_is_right() {
    let scene = scene();
    let mut worker = WorkerHandle::spawn(Arc::new(|| {})).unwrap();
    let drain = |worker: &WorkerHandle| {
        let mut restarts = Vec::new();
        loop {
            match worker.next_event(Duration::from_secs(60)).unwrap() {
                Event::Relit {
                    needs_restart,
                    seconds: Some(_),
                    ..
                } => restarts.push(needs_restart),
                Event::Finished(_) | Event::Paused => return restarts,
                _ => {}
            }
        }
    };
    worker.start(scene.clone(), SolveSettings::draft(), RunOptions::default());
    assert!(drain(&worker).is_empty());
    let white = with(&scene, WALL, |wall| wall.reflectance = Vec3::splat(0.8));
    worker.relight(white.into());
    assert_eq!(drain(&worker), [true]);
    worker.reset();
    assert!(drain(&worker).is_empty());
    let light = irradiance(&scene, &worker.latest().unwrap(), TARGET);
    assert!(light > 0.05, "{light}");
}
