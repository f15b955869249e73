//! The first view and what is done from there: back to it, through walls, lamps made and undone, changes kept.

#![cfg(feature = "viewer")]

mod windows;

use std::{fs, sync::Arc};

use eframe::egui::{self, Key, Modifiers};
use egui_kittest::{Harness, kittest::Queryable as _};
use glam::{Vec2, Vec3};
use vecrad::{
    scene::{Lighting, Sky, SkySource, SunSource, Texture},
    solver::SolveSettings,
    viewer::{Options, action::Action, app::App, loader::SceneSource, run::RunStatus, session},
};
use windows::{ONE_TRIANGLE, one_triangle, perform, plates, wait_for, window};

fn press(harness: &mut Harness<'static, App>, modifiers: Modifiers, key: Key) {
    harness.key_press_modifiers(modifiers, key);
    harness.run_steps(3);
}

/// Whether a message holds this.
fn is_told(harness: &Harness<'static, App>, text: &str) -> bool {
    let messages = &harness.state().state.messages.all;
    messages.iter().any(|message| message.text.contains(text))
}

fn opened(source: SceneSource) -> Harness<'static, App> {
    let mut harness = window(Options {
        source: Some(source),
        settings: SolveSettings::draft(),
        ..Options::default()
    });
    wait_for(&mut harness, |app| app.state.loaded.is_some());
    harness
}

#[test]
fn home_returns_to_the_first_view() {
    let mut harness = plates();
    let first = harness.state().state.rig.target;
    harness
        .state_mut()
        .state
        .rig
        .target
        .orbit(Vec2::new(200.0, 40.0));
    press(&mut harness, Modifiers::NONE, Key::Home);
    let back = harness.state().state.rig.target;
    assert!((back.eye() - first.eye()).length() < 1e-2);
    press(&mut harness, Modifiers::SHIFT, Key::Z);
    press(&mut harness, Modifiers::NONE, Key::Home);
    assert_eq!(harness.state().state.rig.target.up, Vec3::Z);
}

#[test]
fn walls_are_seen_through_until_a_key_says_otherwise() {
    let mut harness = opened(SceneSource::Builtin("room-1022".to_owned()));
    assert!(harness.state().state.has_interior());
    assert!(harness.state().state.view.see_through);
    press(&mut harness, Modifiers::NONE, Key::X);
    assert!(!harness.state().state.view.see_through);
    let mut plates = plates();
    press(&mut plates, Modifiers::NONE, Key::X);
    assert!(is_told(&plates, "no walls to see through"));
}

#[test]
fn a_lamp_is_made_undone_and_made_again() {
    let (_folder, mut harness) = one_triangle("scene.obj");
    let mut materials = harness.state().state.materials.clone();
    materials.make_lamp(0);
    perform(&mut harness, Action::Relight(materials));
    let is_lamp = |harness: &Harness<'static, App>| harness.state().state.materials.is_lamp(0);
    assert!(is_lamp(&harness));
    press(&mut harness, Modifiers::COMMAND, Key::Z);
    assert!(!is_lamp(&harness));
    press(&mut harness, Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    assert!(is_lamp(&harness));
}

#[test]
fn sky_and_sun_are_changed_and_undone() {
    let mut harness = plates();
    let sky = SkySource::Uniform(Vec3::new(0.5, 0.75, 1.0));
    let lighting = Lighting {
        sky: Some(sky),
        sun: Some(SunSource::Disc {
            azimuth: 90.0,
            elevation: 30.0,
            irradiance: Vec3::splat(10.0),
            diameter: 0.53,
        }),
        ..Lighting::default()
    };
    perform(&mut harness, Action::Light(lighting));
    let environment = |harness: &Harness<'static, App>| {
        let loaded = harness.state().state.loaded.as_ref().unwrap();
        loaded.scene.environment.clone()
    };
    let shown = environment(&harness);
    assert_eq!(shown.sky, Sky::Uniform(Vec3::new(0.5, 0.75, 1.0)));
    assert!(shown.sun.is_some_and(|sun| sun.direction.x > 0.8));
    assert!(!harness.state().state.is_grey());
    wait_for(&mut harness, |app| {
        matches!(app.state.run.status, RunStatus::Finished(_))
    });
    press(&mut harness, Modifiers::COMMAND, Key::Z);
    assert!(environment(&harness).is_dark());
}

#[test]
fn changed_materials_are_kept_beside_the_scene() {
    let (folder, mut harness) = one_triangle("scene.obj");
    let mut materials = harness.state().state.materials.clone();
    materials.make_lamp(0);
    materials.now[0].reflectance = Vec3::new(0.125, 0.25, 0.5);
    perform(&mut harness, Action::Relight(materials.clone()));
    perform(&mut harness, Action::SaveSidecar);
    perform(&mut harness, Action::SaveMaterials);
    let text = fs::read_to_string(folder.path().join("scene.vecrad.mtl")).unwrap();
    assert!(text.contains("Kd 0.125 0.25 0.5\nKe 1 1 1\n"), "{text}");
    let source = SceneSource::File(folder.path().join("scene.obj"));
    assert!(session::sidecar_path(&source).unwrap().is_file());
    let again = opened(source);
    let scene = again.state().state.loaded.as_ref().unwrap().scene.clone();
    assert_eq!(
        again.state().state.materials.appearances(&scene),
        materials.appearances(&scene)
    );
}

/// What lights the scene beside its own light.
fn lighting(harness: &Harness<'static, App>) -> Lighting {
    harness.state().state.lighting.clone()
}

#[test]
fn rows_switch_sky_and_sun_and_know_what_they_were() {
    let (_folder, mut harness) = one_triangle("scene.obj");
    let click = |harness: &mut Harness<'static, App>, label: &str| {
        harness
            .get_by_role_and_label(egui::accesskit::Role::CheckBox, label)
            .click_accesskit();
        harness.run_steps(3);
    };
    click(&mut harness, "Sun");
    let sun = harness.state().state.sun();
    assert!(matches!(sun, Some(SunSource::Disc { .. })));
    click(&mut harness, "Sun");
    assert_eq!(harness.state().state.sun(), None);
    click(&mut harness, "Sun");
    assert_eq!(harness.state().state.sun(), sun);
    // The default sky, too, can be switched off.
    click(&mut harness, "Sky");
    let environment = |harness: &Harness<'static, App>| {
        let loaded = harness.state().state.loaded.as_ref().unwrap();
        loaded.scene.environment.clone()
    };
    assert_eq!(environment(&harness).sky, Sky::Dark);
    click(&mut harness, "Sky");
    assert!(environment(&harness).is_default);
    press(&mut harness, Modifiers::COMMAND, Key::Z);
    assert_eq!(lighting(&harness), Lighting::default());
}

#[test]
fn a_picture_of_the_sky_is_turned_and_dimmed_in_its_rows() {
    let mut harness = plates();
    let sky = |scale, rotation| SkySource::Picture {
        picture: Arc::new(Texture {
            name: "sky".to_owned(),
            width: 2,
            height: 1,
            pixels: vec![Vec3::ONE, Vec3::X],
            ..Texture::default()
        }),
        file: None,
        scale,
        rotation,
    };
    let asked = Lighting {
        sky: Some(sky(Vec3::ONE, 0.0)),
        ..Lighting::default()
    };
    perform(&mut harness, Action::Light(asked));
    for (label, value) in [("Sky strength", 0.5), ("Sky rotation", 90.0)] {
        let slider = harness.get_by_role_and_label(egui::accesskit::Role::Slider, label);
        slider.set_value_accesskit(value);
        harness.run_steps(3);
    }
    assert_eq!(lighting(&harness).sky, Some(sky(Vec3::splat(0.5), 90.0)));
}

#[test]
fn the_sun_is_dragged_in_the_view_and_undone() {
    let mut harness = plates();
    press(&mut harness, Modifiers::NONE, Key::U);
    assert!(is_told(&harness, "There is no sun to drag"));
    let sun = SunSource::Disc {
        azimuth: 100.0,
        elevation: 30.0,
        irradiance: Vec3::ONE,
        diameter: 0.53,
    };
    let asked = Lighting {
        sun: Some(sun),
        ..Lighting::default()
    };
    perform(&mut harness, Action::Light(asked));
    press(&mut harness, Modifiers::NONE, Key::U);
    let camera = harness.state().state.rig.target;
    let middle = harness.get_by_label("Scene").rect().center();
    harness.drag_at(middle);
    harness.run_steps(2);
    harness.hover_at(middle + egui::vec2(40.0, -20.0));
    harness.run_steps(2);
    harness.drop_at(middle + egui::vec2(40.0, -20.0));
    harness.run_steps(2);
    assert_eq!(harness.state().state.rig.target, camera);
    let moved = match harness.state().state.sun() {
        Some(SunSource::Disc {
            azimuth, elevation, ..
        }) => [azimuth, elevation],
        other => panic!("{other:?}"),
    };
    assert!(
        (moved[0] - 110.0).abs() < 1e-3 && (moved[1] - 35.0).abs() < 1e-3,
        "{moved:?}"
    );
    press(&mut harness, Modifiers::NONE, Key::U);
    assert!(!harness.state().state.panels.drags_sun);
}

/// A closed room whose ceiling has a material of its own.
const CLOSED_ROOM: &str = "usemtl wall\nv 0 0 0\nv 5 0 0\nv 5 0 4\nv 0 0 4\nv 0 3 0\nv 5 3 0\nv 5 3 4\nv 0 3 4\n\
    f 1 4 3 2\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\nusemtl ceiling\nf 5 6 7 8\n";

#[test]
fn a_dark_room_is_lit_by_one_click() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("room.obj");
    fs::write(&path, CLOSED_ROOM).unwrap();
    let mut harness = opened(SceneSource::File(path));
    assert!(harness.state().state.is_dark());
    harness.get_by_label_contains("No light reaches this");
    harness
        .get_by_label("Make “ceiling” (above) a lamp")
        .click_accesskit();
    harness.run_steps(3);
    assert!(!harness.state().state.is_dark());
    assert!(
        harness
            .query_by_label_contains("No light reaches")
            .is_none()
    );
    press(&mut harness, Modifiers::COMMAND, Key::Z);
    assert!(harness.state().state.is_dark());
}

#[test]
fn sky_and_sun_are_kept_beside_the_scene() {
    let (folder, mut harness) = one_triangle("scene.obj");
    let sun = SunSource::Disc {
        azimuth: 90.0,
        elevation: 30.0,
        irradiance: Vec3::new(10.0, 9.0, 8.0),
        diameter: 2.0,
    };
    let lighting = Lighting {
        sky: Some(SkySource::Uniform(Vec3::new(0.5, 0.75, 1.0))),
        is_sky_off: true,
        sun: Some(sun),
        ..Lighting::default()
    };
    perform(&mut harness, Action::Light(lighting.clone()));
    perform(&mut harness, Action::SaveSidecar);
    let source = SceneSource::File(folder.path().join("scene.obj"));
    let again = opened(source.clone());
    assert_eq!(again.state().state.lighting, lighting);
    let loaded = again.state().state.loaded.as_ref().unwrap();
    assert_eq!(loaded.scene.environment.sky, Sky::Dark);
    assert!(loaded.scene.environment.sun.is_some());
    // The command line goes before it.
    let mut asked = window(Options {
        source: Some(source),
        settings: SolveSettings::draft(),
        lighting: Lighting {
            sun: Some(SunSource::Dark),
            ..Lighting::default()
        },
        ..Options::default()
    });
    wait_for(&mut asked, |app| app.state.loaded.is_some());
    let state = &asked.state().state;
    assert_eq!(state.lighting.sun, Some(SunSource::Dark));
    assert_eq!(state.lighting.sky, lighting.sky);
    // Another scene does not have it.
    perform(
        &mut asked,
        Action::Load(SceneSource::Builtin("plates".to_owned())),
    );
    wait_for(&mut asked, |app| {
        let shown = app.state.loaded.as_ref();
        shown.is_some_and(|loaded| loaded.source.path().is_none())
    });
    assert_eq!(asked.state().state.lighting.sky, None);
}

#[test]
fn a_saved_sky_whose_picture_is_gone_is_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.obj");
    fs::write(&path, ONE_TRIANGLE).unwrap();
    let text = "[light.sky]\non = true\npicture = { file = \"gone.hdr\", scale = [1.0, 1.0, 1.0], rotation = 0.0 }\n";
    fs::write(folder.path().join("scene.obj.vecrad.toml"), text).unwrap();
    let harness = opened(SceneSource::File(path));
    assert!(is_told(
        &harness,
        "The saved sky was not used: there is no such picture"
    ));
    let loaded = harness.state().state.loaded.as_ref().unwrap();
    assert!(loaded.scene.environment.is_default);
}

#[test]
fn a_file_with_z_up_opens_upright_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("part.obj");
    let text = "# FreeCAD v0.21\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    fs::write(&path, text).unwrap();
    let harness = opened(SceneSource::File(path));
    assert_eq!(harness.state().state.rig.target.up, Vec3::Z);
    assert!(is_told(
        &harness,
        "+Z is up, as the program that wrote the file shows"
    ));
    assert!(is_told(&harness, "“Camera: Y is up”"));
}
