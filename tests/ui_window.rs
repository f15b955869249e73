//! The window in its first minute: the keyboard works wherever the focus is, messages are told, the view has room, and
//! its exposure is there with the first light.

#![cfg(feature = "viewer")]

mod windows;

use std::{fs, path::Path, sync::Arc};

use eframe::egui::{self, Key, Modifiers};
use egui_kittest::{
    Harness,
    kittest::{NodeT as _, Queryable as _},
};
use vecrad::{
    solver::SolveSettings,
    viewer::{
        Options,
        action::{Action, Scale},
        app::App,
        faults::Faults,
        headless,
        loader::SceneSource,
        messages::Severity,
        run::RunStatus,
        view::ViewMode,
    },
};
use windows::{one_triangle, perform, plates, plates_of_size, wait_for, window};

fn press(harness: &mut Harness<'static, App>, key: Key) {
    harness.key_press(key);
    harness.run_steps(3);
}

/// Whether the line at the bottom tells a sentence that holds this.
fn is_told(harness: &Harness<'static, App>, text: &str) -> bool {
    let bottom = harness.ctx.content_rect().bottom();
    let mut told = harness.query_all_by_label_contains(text);
    told.any(|node| node.rect().bottom() > bottom - 40.0)
}

#[test]
fn tab_moves_the_focus_and_keys_go_on_working() {
    let mut harness = plates();
    for round in 0..40 {
        press(&mut harness, Key::Tab);
        assert!(harness.state().state.panels.shown, "Tab {round}");
        harness.get_by_label("Progress");
        if harness.ctx.text_edit_focused() {
            continue;
        }
        let before = harness.state().state.view.edges;
        press(&mut harness, Key::M);
        assert_ne!(
            harness.state().state.view.edges,
            before,
            "M after Tab {round}"
        );
    }
    let focused = harness.ctx.memory(|memory| memory.focused());
    assert!(focused.is_some(), "the focus is still somewhere");
    for is_shown in [false, true] {
        harness.key_press_modifiers(Modifiers::COMMAND, Key::B);
        harness.run_steps(3);
        assert_eq!(harness.state().state.panels.shown, is_shown);
        press(&mut harness, Key::Tab);
        let before = harness.state().state.view.edges;
        press(&mut harness, Key::M);
        assert_ne!(harness.state().state.view.edges, before);
    }
}

#[test]
fn the_focus_stays_in_view_and_presses_what_it_is_on() {
    let mut harness = plates();
    let window = harness.ctx.content_rect();
    let is_focused = |harness: &Harness<'static, App>, label: &str| {
        let mut alike = harness.query_all_by_label(label);
        alike.any(|node| node.is_focused())
    };
    let mut rounds = 0;
    // Far below the fold of the panel.
    while !is_focused(&harness, "Statistics") {
        harness.key_press(Key::Tab);
        harness.run_steps(2);
        rounds += 1;
        assert!(rounds < 300, "the section is never reached");
    }
    harness.run_steps(30);
    let at = harness.get_by_label("Statistics").rect();
    assert!(window.contains_rect(at), "{at:?}");
    assert!(harness.query_by_label("Patches").is_none());
    press(&mut harness, Key::Space);
    harness.run_steps(20);
    harness.get_by_label("Patches");
    // Space was the control's; Escape leaves it and does nothing else.
    assert!(matches!(
        harness.state().state.run.status,
        RunStatus::Finished(_)
    ));
    perform(&mut harness, Action::SelectCluster(0));
    press(&mut harness, Key::Escape);
    assert_eq!(harness.ctx.memory(|memory| memory.focused()), None);
    assert_eq!(harness.state().state.cluster, Some(0));
    press(&mut harness, Key::Escape);
    assert_eq!(harness.state().state.cluster, None);
}

#[test]
fn a_standing_warning_hides_neither_what_was_saved_nor_errors() {
    let mut harness = plates();
    let messages = &mut harness.state_mut().state.messages;
    messages.push(Severity::Warning, "two faces were skipped");
    messages.push(Severity::Warning, "a texture is missing");
    messages.push_lasting(Severity::Note, "saved hall_1.png");
    harness.run_steps(2);
    assert!(is_told(&harness, "Saved hall_1.png"));
    assert!(is_told(&harness, "2 warnings"));
    let messages = &mut harness.state_mut().state.messages;
    messages.push_lasting(Severity::Error, "cannot save hall_2.png: no room");
    harness.run_steps(2);
    assert!(is_told(&harness, "Cannot save hall_2.png"));
    // A click shows them all, and then they were seen.
    harness.get_by_label_contains("2 warnings").click();
    harness.run_steps(60);
    assert!(harness.state().state.messages.unseen().is_empty());
    assert!(!is_told(&harness, "Cannot save"));
}

#[test]
fn messages_of_a_scene_go_with_it() {
    let folder = tempfile::tempdir().expect("a folder can be made");
    let scene = folder.path().join("hall.obj");
    // The second face has a corner too few.
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2\n";
    fs::write(&scene, text).expect("it can be written");
    let mut harness = window(Options {
        source: Some(SceneSource::File(scene)),
        settings: SolveSettings::draft(),
        ..Options::default()
    });
    wait_for(&mut harness, |app| app.state.loaded.is_some());
    let texts = |harness: &Harness<'static, App>| -> Vec<String> {
        let all = harness.state().state.messages.all.iter();
        all.map(|message| message.text.clone()).collect()
    };
    assert!(
        texts(&harness)
            .iter()
            .any(|text| text.starts_with("hall.obj:5:")),
        "the name of the file keeps its case: {:?}",
        texts(&harness)
    );
    let missing = SceneSource::File("/no/such/scene.obj".into());
    perform(&mut harness, Action::Load(missing));
    wait_for(&mut harness, |app| app.state.loading.is_none());
    perform(
        &mut harness,
        Action::Load(SceneSource::Builtin("plates".to_owned())),
    );
    wait_for(&mut harness, |app| {
        let loaded = app.state.loaded.as_ref();
        loaded.is_some_and(|loaded| loaded.source.path().is_none())
    });
    assert_eq!(texts(&harness), Vec::<String>::new());
}

#[test]
fn the_view_keeps_half_of_the_window() {
    let sizes = [
        [720.0, 480.0],
        [800.0, 600.0],
        [1024.0, 768.0],
        [1080.0, 700.0],
        [1280.0, 800.0],
        [2560.0, 1440.0],
    ];
    for size in sizes {
        let mut harness = plates_of_size(size);
        let view_share = |harness: &Harness<'static, App>| {
            let scene = harness.get_by_label("Scene").rect();
            scene.width() / harness.ctx.content_rect().width()
        };
        let open = |harness: &mut Harness<'static, App>, label: &str| {
            // A section of a panel has the same name as the button.
            let mut alike = harness.query_all_by_label(label);
            let button = alike.find(|node| node.rect().top() < 90.0);
            button.expect("it is in the toolbar").click();
            drop(alike);
            harness.run_steps(4);
        };
        assert!(
            view_share(&harness) >= 0.5,
            "{size:?}: {}",
            view_share(&harness)
        );
        // Whichever panel is asked for is there; the other one gives way where it must.
        open(&mut harness, "Settings");
        open(&mut harness, "Settings");
        harness.get_by_label("Progress");
        if harness.query_by_label("Probe").is_none() {
            open(&mut harness, "Details");
        }
        harness.get_by_label("Probe");
        assert!(
            view_share(&harness) >= 0.5,
            "{size:?}: {}",
            view_share(&harness)
        );
        for _ in 0..6 {
            perform(&mut harness, Action::Scale(Scale::Larger));
        }
        harness.run_steps(4);
        assert!(
            view_share(&harness) >= 0.5,
            "large text in {size:?}: {}",
            view_share(&harness)
        );
    }
}

#[test]
fn limits_that_do_not_limit_say_so() {
    let mut harness = plates();
    harness.get_by_label("Limits and scene").click_accesskit();
    harness.run_steps(20);
    for (label, value) in [
        ("Time limit", "none"),
        ("Memory limit", "none"),
        ("Threads", "automatic"),
    ] {
        let field = harness.get_by_role_and_label(egui::Role::SpinButton, label);
        assert_eq!(field.value().as_deref(), Some(value), "{label}");
    }
}

#[test]
fn a_colour_is_picked_without_a_missing_glyph() {
    let mut harness = plates();
    let lamp = {
        let state = &harness.state().state;
        let lamp = state.materials.lights().next().expect("a plate emits");
        state.materials.now[lamp].name.clone()
    };
    // A character without a glyph ends the test.
    harness.get_by_label(&format!("Colour of {lamp}")).click();
    harness.run_steps(4);
    let bar = harness.get_by_role_and_label(egui::Role::Slider, "Saturation");
    let at = bar.rect().right_center() - egui::vec2(2.0, 0.0);
    harness.hover_at(at);
    harness.step();
    harness.drag_at(at);
    harness.drop_at(at);
    wait_for(&mut harness, |app| app.state.run.relit_secs.is_some());
    let state = &harness.state().state;
    let index = state.materials.lights().next().expect("a plate emits");
    let light = state.materials.now[index].light.expect("it is a light");
    assert!(
        light.color.min_element() < 0.1 && light.color.max_element() > 0.9,
        "{}",
        light.color
    );
    harness.get_by_label_contains("Relit in");
}

#[test]
fn pictures_are_saved_beside_the_scene() {
    let (folder, mut harness) = one_triangle("Hall.obj");
    perform(&mut harness, Action::PictureDialog);
    let path = &harness.state().state.panels.picture_text;
    assert_eq!(Path::new(path), folder.path().join("Hall_1.png"));
    for label in ["Viewport size × 1", "Viewport size × 2"] {
        harness.get_by_label(label);
    }
}

#[test]
fn backs_are_offered_where_there_are_any() {
    let mut harness = plates();
    assert!(harness.query_by_label("Backs").is_none());
    press(&mut harness, Key::K);
    assert!(!harness.state().state.view.backs);
    assert!(is_told(&harness, "no backs to show"));
    let mut harness = window(Options {
        source: Some(SceneSource::Builtin("room-1022".to_owned())),
        settings: SolveSettings::draft(),
        ..Options::default()
    });
    harness.run_steps(2);
    // The scene may have been read by then.
    let is_offered = harness.query_by_label("Backs").is_some();
    assert!(!is_offered || harness.state().state.loaded.is_some());
    wait_for(&mut harness, |app| app.state.loaded.is_some());
    harness.get_by_label("Backs");
    press(&mut harness, Key::K);
    assert!(harness.state().state.view.backs);
    // There they are shown anyway.
    perform(&mut harness, Action::Mode(ViewMode::FaceOrientation));
    assert!(harness.query_by_label("Backs").is_none());
    perform(&mut harness, Action::Stop);
}

/// A closed box that faces outward, with a light inside: a case for a warning.
const INVERTED_ROOM: [(&str, &str); 2] = [
    (
        "room.obj",
        "mtllib room.mtl\nusemtl wall\n\
         v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 0 0 4\nv 4 0 4\nv 4 4 4\nv 0 4 4\n\
         f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 2 3 7 6\nf 4 1 5 8\n\
         usemtl lamp\nv 1 3 1\nv 3 3 1\nv 3 3 3\nv 1 3 3\nf 9 10 11 12\n",
    ),
    (
        "room.mtl",
        "newmtl wall\nKd 0.5 0.5 0.5\nnewmtl lamp\nKd 0 0 0\nKe 5 5 5\n",
    ),
];

#[test]
fn no_flag_of_the_command_line_is_named_in_the_window() {
    let folder = tempfile::tempdir().expect("a folder can be made");
    for (name, text) in INVERTED_ROOM {
        fs::write(folder.path().join(name), text).expect("it can be written");
    }
    let mut harness = window(Options {
        source: Some(SceneSource::File(folder.path().join("room.obj"))),
        settings: SolveSettings::draft(),
        ..Options::default()
    });
    wait_for(&mut harness, |app| {
        matches!(app.state.run.status, RunStatus::Finished(_))
    });
    for section in ["Statistics", "Messages", "Method", "Limits and scene"] {
        harness.get_by_label(section).click_accesskit();
        harness.run_steps(20);
    }
    harness.get_by_label_contains("Omitted (").click_accesskit();
    harness.run_steps(20);
    let flags = harness.query_all_by_label_contains("--");
    let named: Vec<String> = flags
        .filter_map(|node| node.accesskit_node().label())
        .collect();
    assert_eq!(named, Vec::<String>::new());
}

#[test]
fn one_bound_is_told_in_every_panel() {
    let mut harness = plates();
    perform(&mut harness, Action::TraceReference);
    wait_for(&mut harness, |app| app.state.truth.newest_error().is_some());
    let bounds = harness.query_all_by_label("Error bound");
    assert!(
        bounds.count() >= 2,
        "under 'Progress' and under 'Measured error'"
    );
    assert!(harness.query_by_label("Bound").is_none());
}

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
fn wait_until_steady(harness: &mut Harness<'static, App>) {
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
    let Some(mut harness) = drawing_window("plates") else {
        return;
    };
    wait_for(&mut harness, |app| app.state.exposure.target.is_some());
    wait_until_steady(&mut harness);
    let steady = exposure(&harness);
    // Looking around a little changes nothing.
    harness
        .state_mut()
        .state
        .rig
        .target
        .orbit(glam::Vec2::new(10.0, 6.0));
    harness.run_steps(60);
    assert_eq!(exposure(&harness), steady);
    // Close to the lamp there is little else to see; the way to its exposure is a glide.
    let state = &mut harness.state_mut().state;
    state.rig.target.distance *= 0.2;
    state.rig.target.pivot.y += 50.0;
    let (mut before, mut steps) = (steady, 0);
    for _ in 0..200 {
        harness.step();
        let now = exposure(&harness);
        assert!((now - before).abs() < 0.8, "a jump from {before} to {now}");
        steps += u32::from(now != before);
        before = now;
    }
    assert!(steps > 3, "{steps} frames of a glide");
    assert_ne!(exposure(&harness), steady);
}

#[test]
fn a_hand_on_the_exposure_and_changed_lamps_keep_it() {
    let Some(mut harness) = drawing_window("plates") else {
        return;
    };
    wait_until_steady(&mut harness);
    let steady = exposure(&harness);
    let mut materials = harness.state().state.materials.clone();
    let lamp = materials.lights().next().expect("a plate emits");
    if let Some(light) = &mut materials.now[lamp].light {
        light.intensity = 0.1;
    }
    perform(&mut harness, Action::Relight(materials));
    wait_for(&mut harness, |app| app.state.run.relit_secs.is_some());
    harness.run_steps(60);
    assert_eq!(exposure(&harness), steady, "what is dimmed is darker");
    perform(&mut harness, Action::ExposureBy(1.0));
    harness.run_steps(30);
    assert_eq!(exposure(&harness), steady + 1.0);
    perform(&mut harness, Action::AutoExposure);
    harness.run_steps(120);
    assert_eq!(exposure(&harness), steady);
}
