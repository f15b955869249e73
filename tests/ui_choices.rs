//! The window shows what a scene can use, saves what is asked for, and remembers what was chosen.

#![cfg(feature = "viewer")]

mod windows;

use std::{
    collections::HashMap,
    fs,
    sync::{Arc, Mutex, PoisonError},
};

use eframe::egui;
use egui_kittest::{
    Harness,
    kittest::{NodeT as _, Queryable as _},
};
use vecrad::{
    export::ToneMap,
    scene::{SceneOptions, Sides},
    solver::SolveSettings,
    viewer::{
        Options,
        action::Action,
        app::App,
        camera::AxisView,
        faults::Faults,
        figures::figure,
        loader::SceneSource,
        messages::Severity,
        run::RunStatus,
        view::{ViewMode, ViewRequest},
    },
};
use windows::{ONE_TRIANGLE, one_triangle, perform, plates, wait_for, window};

/// The storage that eframe has in a file.
#[derive(Default)]
struct Kept(Mutex<HashMap<String, String>>);

impl eframe::Storage for Kept {
    fn get_string(&self, key: &str) -> Option<String> {
        let kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        kept.get(key).cloned()
    }

    fn set_string(&mut self, key: &str, value: String) {
        let kept = self.0.get_mut().unwrap_or_else(PoisonError::into_inner);
        kept.insert(key.to_owned(), value);
    }

    fn remove_string(&mut self, key: &str) {
        let kept = self.0.get_mut().unwrap_or_else(PoisonError::into_inner);
        kept.remove(key);
    }

    fn flush(&mut self) {}
}

/// A window that finds these entries kept.
fn window_with(kept: Kept, options: Options) -> Harness<'static, App> {
    // It must outlive the window, which lives as long as the test.
    let kept: &'static Kept = Box::leak(Box::new(kept));
    Harness::builder()
        .with_size([1280.0, 900.0])
        .build_eframe(move |cc| {
            cc.storage = Some(kept);
            App::new(cc, options, Arc::new(Faults::default())).expect("threads")
        })
}

/// The storage after a window was closed.
fn kept_by(harness: &mut Harness<'static, App>) -> Kept {
    let mut kept = Kept::default();
    eframe::App::save(harness.state_mut(), &mut kept);
    kept
}

#[test]
fn what_was_chosen_is_there_in_the_next_window() {
    let mut harness = plates();
    perform(&mut harness, Action::Mode(ViewMode::FalseRadiance));
    perform(&mut harness, Action::ToggleToneMap);
    harness.get_by_label("Details").click();
    harness.run_steps(3);
    harness.state_mut().state.panels.fly_speed = 4.0;
    let kept = kept_by(&mut harness);
    drop(harness);

    let mut next = window_with(kept, Options::default());
    next.run_steps(2);
    let state = &next.state().state;
    assert_eq!(state.view.mode, ViewMode::FalseRadiance);
    assert_eq!(state.view.tone_map, ToneMap::None);
    assert_eq!(state.panels.fly_speed, 4.0);
    assert!(state.panels.light && !state.panels.look);
    assert!(next.query_by_label("Statistics").is_none());
    // Panels come back by the menu's entry.
    perform(&mut next, Action::ResetLayout);
    next.get_by_label("Statistics");

    // The command line goes before it.
    let asked = Options {
        view: ViewRequest {
            mode: Some(ViewMode::Normals),
            ..ViewRequest::default()
        },
        ..Options::default()
    };
    let again = window_with(kept_by(&mut next), asked);
    assert_eq!(again.state().state.view.mode, ViewMode::Normals);
    assert_eq!(again.state().state.view.tone_map, ToneMap::None);
}

#[test]
fn what_was_kept_and_cannot_be_read_is_as_if_it_were_not() {
    let broken = ["preferences", "recent"].map(|key| (key.to_owned(), "[= nonsense".to_owned()));
    let kept = Kept(Mutex::new(HashMap::from(broken)));
    let mut harness = window_with(kept, Options::default());
    harness.run_steps(2);
    let state = &harness.state().state;
    assert_eq!(state.view.mode, ViewMode::Radiance);
    assert!(state.panels.light && state.panels.look);
    assert!(state.recent.files.is_empty());
    harness.get_by_label("Open a scene to light it");
}

#[test]
fn the_key_for_normals_leads_there_and_back() {
    let mut harness = plates();
    let mode = |harness: &Harness<'static, App>| harness.state().state.view.mode;
    perform(&mut harness, Action::Mode(ViewMode::LightOnly));
    for expected in [ViewMode::Normals, ViewMode::LightOnly] {
        harness.key_press(egui::Key::N);
        harness.run_steps(2);
        assert_eq!(mode(&harness), expected);
    }
}

#[test]
fn a_scene_shows_only_what_it_can_use() {
    // Two grey sheets under white light, without a texture or a reference.
    let mut harness = plates();
    let lacks = |harness: &Harness<'static, App>, label: &str| {
        assert!(
            harness.query_all_by_label_contains(label).next().is_none(),
            "{label}"
        );
    };
    for label in [
        "Textures",
        "Backs",
        "Relative RMS",
        "Trimmed RMS against run time",
        "Save CSV…",
    ] {
        lacks(&harness, label);
    }
    // Advanced settings are folded.
    for label in ["Link error", "Crease angle", "Ray offset", "Memory limit"] {
        lacks(&harness, label);
    }
    for label in ["Emission scale", "Rays per vertex", "Transported"] {
        assert!(
            harness.query_all_by_label(label).next().is_some(),
            "{label}"
        );
    }
    // The table of views offers the estimated error beside the figure of that name, and no errors without a reference.
    let told = harness.query_all_by_label("Estimated error").count();
    harness.get_by_label("View mode").click();
    harness.run_steps(3);
    assert_eq!(
        harness.query_all_by_label("Estimated error").count(),
        told + 1
    );
    // Only the panel of that name.
    assert_eq!(harness.query_all_by_label("Measured error").count(), 1);
}

#[test]
fn advanced_settings_unfold_and_tell_the_ray_offset() {
    let mut harness = plates();
    harness.get_by_label("Method").click_accesskit();
    harness.run_steps(20);
    harness.get_by_label("Ray offset");
    // The plates are 1 unit across: a millionth of that.
    harness.get_by_label("1.00e-6 (automatic)");
}

#[test]
fn what_a_scene_has_brings_its_controls() {
    let mut harness = window(Options {
        source: Some(SceneSource::Builtin("gallery".to_owned())),
        settings: SolveSettings::draft(),
        ..Options::default()
    });
    wait_for(&mut harness, |app| app.state.loaded.is_some());
    harness.get_by_label("Textures");
    harness.get_by_label("Backs");
    let is_grey = harness
        .state()
        .state
        .loaded
        .as_ref()
        .map(|loaded| loaded.is_grey);
    assert_eq!(is_grey, Some(false));
    perform(&mut harness, Action::Stop);
}

#[test]
fn light_of_a_grey_scene_is_one_figure() {
    // From above, so that the middle of the picture lies on a plate.
    let figures = |is_grey: bool| {
        let mut harness = plates();
        let mut loaded = harness.state_mut().state.loaded.take().expect("a scene");
        assert!(loaded.is_grey);
        Arc::get_mut(&mut loaded)
            .expect("nobody else has it")
            .is_grey = is_grey;
        harness.state_mut().state.loaded = Some(loaded);
        perform(&mut harness, Action::LookFrom(AxisView::Top));
        harness.run_steps(60);
        let at = harness.get_by_label("Scene").rect().center();
        harness.hover_at(at);
        harness.step();
        harness.drag_at(at);
        harness.drop_at(at);
        wait_for(&mut harness, |app| {
            app.state
                .selection
                .as_ref()
                .is_some_and(|selection| selection.probe.is_some())
        });
        let irradiance = harness
            .state()
            .state
            .selection
            .as_ref()
            .and_then(|s| s.probe);
        let [red, green, blue] = irradiance
            .expect("waited for")
            .irradiance
            .to_array()
            .map(|x| figure(f64::from(x)));
        harness
            .query_all_by_label(&format!("{red}  {green}  {blue}"))
            .count()
    };
    assert!(figures(false) > 0);
    assert_eq!(figures(true), 0);
}

#[test]
fn a_scene_without_emitters_has_nothing_to_scale() {
    let (_folder, harness) = one_triangle("dark.obj");
    for label in ["Emission scale", "Rays per vertex"] {
        assert!(
            // A figure of the progress has the same name.
            harness
                .query_all_by_role_and_label(egui::Role::Slider, label)
                .next()
                .is_none(),
            "{label}"
        );
    }
}

#[test]
fn errors_are_saved_as_a_table_with_the_columns_of_the_report() {
    let folder = tempfile::tempdir().expect("a folder can be made");
    let path = folder.path().join("errors.csv");
    let mut harness = plates();
    perform(&mut harness, Action::TraceReference);
    let steps = harness.state().state.settings.max_steps;
    // One more run, so that there is something to compare.
    let mut other = harness.state().state.settings.clone();
    wait_for(&mut harness, |app| app.state.truth.newest_error().is_some());
    other.seed += 1;
    perform(&mut harness, Action::Settings(other));
    wait_for(&mut harness, |app| {
        app.state.truth.runs.len() == 2
            && app
                .state
                .truth
                .newest_error()
                .is_some_and(|(step, ..)| step == steps)
    });
    // The button may lie below the fold of the panel.
    harness.get_by_label("Save CSV…").click_accesskit();
    harness.run_steps(3);
    assert!(harness.state().state.panels.table);
    harness.state_mut().state.panels.table_text = path.display().to_string();
    harness.run_steps(2);
    harness.get_by_label("Save").click();
    harness.run_steps(2);
    assert!(!harness.state().state.panels.table);
    wait_for(&mut harness, |app| {
        let said = app.state.messages.all.last();
        said.is_some_and(|said| said.severity == Severity::Note && said.text.contains("errors.csv"))
    });
    let mut table = csv::Reader::from_path(&path).expect("it was saved");
    let headers: Vec<String> = table
        .headers()
        .expect("a header")
        .iter()
        .map(str::to_owned)
        .collect();
    for name in [
        "scene",
        "run",
        "step",
        "time_s",
        "error_trimmed",
        "error_rms",
        "rays",
        "links",
    ] {
        assert!(headers.iter().any(|header| header == name), "{name}");
    }
    let column = |name: &str| {
        headers
            .iter()
            .position(|header| header == name)
            .expect("found")
    };
    let (run, step, time, error) = (
        column("run"),
        column("step"),
        column("time_s"),
        column("error_rms"),
    );
    let rows: Vec<csv::StringRecord> = table.records().map(|row| row.expect("a row")).collect();
    let truth = &harness.state().state.truth;
    let measured: usize = truth
        .runs
        .iter()
        .map(|run| truth.steps_of(run).count())
        .sum();
    assert_eq!(rows.len(), measured);
    let last = rows.last().expect("rows");
    let (newest_step, report, _) = truth.newest_error().expect("measured");
    assert_eq!(last[run], truth.runs[1].name);
    assert_eq!(last[step].parse::<u32>(), Ok(newest_step));
    assert_eq!(last[time].parse::<f64>(), Ok(report.solve_s));
    // The reference grew meanwhile, and the error with it: 0 where noise explains it.
    let error: f64 = last[error].parse().expect("a number");
    assert!((0.0..1.0).contains(&error), "{error}");
}

#[test]
fn escape_closes_a_dialog_before_it_clears_the_selection() {
    let mut harness = plates();
    perform(&mut harness, Action::SelectCluster(0));
    perform(&mut harness, Action::PictureDialog);
    harness.get_by_label("Transparent background");
    harness.key_press(egui::Key::Escape);
    harness.run_steps(3);
    assert!(!harness.state().state.panels.picture);
    assert_eq!(harness.state().state.cluster, Some(0));
    harness.key_press(egui::Key::Escape);
    harness.run_steps(3);
    assert_eq!(harness.state().state.cluster, None);
}

#[test]
fn escape_closes_a_menu_and_nothing_else() {
    let mut harness = plates();
    perform(&mut harness, Action::SelectCluster(0));
    harness.get_by_label("View").click();
    harness.run_steps(3);
    harness.get_by_label("Reset layout");
    harness.key_press(egui::Key::Escape);
    harness.run_steps(3);
    assert!(harness.query_by_label("Reset layout").is_none());
    assert_eq!(harness.state().state.cluster, Some(0));
}

#[test]
fn enter_confirms_a_dialog_and_leaves_the_camera() {
    let folder = tempfile::tempdir().expect("a folder can be made");
    let path = folder.path().join("lit.ply");
    let mut harness = plates();
    harness.state_mut().state.rig.target.yaw = 1.25;
    harness.state_mut().state.rig.target.pivot.x = 3.0;
    perform(&mut harness, Action::MeshDialog);
    harness.state_mut().state.panels.mesh_text = path.display().to_string();
    harness.run_steps(2);
    harness.key_press(egui::Key::Enter);
    harness.run_steps(2);
    assert!(!harness.state().state.panels.mesh);
    wait_for(&mut harness, |_| path.exists());
    assert_eq!(harness.state().state.rig.target.pivot.x, 3.0);
}

#[test]
fn a_typed_path_is_asked_for_again_until_it_can_be_read() {
    let folder = tempfile::tempdir().expect("a folder can be made");
    let scene = folder.path().join("lamp.obj");
    fs::write(&scene, ONE_TRIANGLE).expect("it can be written");
    let mut harness = plates();
    harness.state_mut().state.panels.path_text = "/an/older/path.obj".to_owned();
    harness.get_by_label("File").click();
    harness.run_steps(3);
    harness.get_by_label("Open by path…").click();
    harness.run_steps(4);
    // Typed at once, without a click, over what was there.
    let enter = |harness: &mut Harness<'static, App>, text: &str| {
        harness.event(egui::Event::Text(text.to_owned()));
        harness.run_steps(2);
        assert_eq!(harness.state().state.panels.path_text, text);
        harness.key_press(egui::Key::Enter);
        harness.run_steps(2);
        wait_for(harness, |app| app.state.loading.is_none());
    };
    enter(&mut harness, "/no/such/lamp.obj");
    let panels = &harness.state().state.panels;
    assert!(panels.path && panels.path_error.is_some());
    let told = harness.query_all_by_label_contains("no such file");
    assert!(
        told.count() >= 2,
        "in the dialog and in the line at the bottom"
    );
    enter(&mut harness, &scene.display().to_string());
    let state = &harness.state().state;
    assert!(!state.panels.path);
    assert_eq!(
        state
            .loaded
            .as_ref()
            .and_then(|loaded| loaded.source.path()),
        Some(scene.as_path())
    );
    let mut unseen = state.messages.unseen().iter();
    assert!(unseen.all(|message| message.severity != Severity::Error));
}

#[test]
fn the_view_menu_tells_what_is_on_and_how_large_text_is() {
    let mut harness = plates();
    let open = |harness: &mut Harness<'static, App>| {
        harness.get_by_label("View").click();
        harness.run_steps(3);
    };
    for is_on in [false, true] {
        open(&mut harness);
        let mut entries = harness.query_all_by_label_contains("Cluster boxes");
        let entry = entries.next().expect("an entry of the menu");
        let toggled = Some(egui::accesskit::Toggled::from(is_on));
        assert_eq!(entry.accesskit_node().toggled(), toggled);
        entry.click();
        drop(entries);
        harness.run_steps(3);
        assert_eq!(harness.state().state.view.clusters.shown, !is_on);
    }
    harness.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::Minus);
    harness.run_steps(3);
    assert_eq!(harness.ctx.zoom_factor(), 0.9);
    open(&mut harness);
    harness.get_by_label_contains("UI scale (90 %)");
    harness.key_press(egui::Key::Escape);
    harness.run_steps(2);
    harness.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::Num0);
    harness.run_steps(3);
    assert_eq!(harness.ctx.zoom_factor(), 1.0);
}

/// A lamp that shines at a black wall, and behind the lamp a target that sees the wall only.
const LAMP_WALL_AND_TARGET: [(&str, &str); 2] = [
    (
        "scene.obj",
        "mtllib scene.mtl\n\
         v 0 -0.25 -0.25\nv 0 0.25 -0.25\nv 0 0.25 0.25\nv 0 -0.25 0.25\n\
         v 2 -2 -2\nv 2 -2 2\nv 2 2 2\nv 2 2 -2\n\
         v -1 -1 -1\nv -1 1 -1\nv -1 1 1\nv -1 -1 1\n\
         usemtl lamp\nf 1 2 3 4\nusemtl wall\nf 5 6 7 8\nusemtl target\nf 9 10 11 12\n",
    ),
    (
        "scene.mtl",
        "newmtl lamp\nKd 0 0 0\nKe 9 9 9\nnewmtl wall\nKd 0 0 0\nnewmtl target\nKd 0.7 0.7 0.7\n",
    ),
];

/// Whether any light falls on the target.
fn target_is_lit(app: &App) -> bool {
    let state = &app.state;
    let (Some(loaded), Some(snapshot)) = (&state.loaded, &state.run.snapshot) else {
        return false;
    };
    let materials = &loaded.scene.materials;
    let target = materials.iter().position(|m| m.name == "target");
    let target = target.expect("the file names it");
    let mesh = &snapshot.mesh;
    let mut own = mesh.indices.iter().zip(&mesh.triangle_of);
    own.any(|(corners, &triangle)| {
        let material = loaded.scene.triangles[triangle as usize].material;
        let is_lit = |&at: &u32| snapshot.light.irradiance[at as usize].x > 0.0;
        material.index() == target && corners.iter().any(is_lit)
    })
}

#[test]
fn a_wall_that_is_painted_lights_what_was_omitted() {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in LAMP_WALL_AND_TARGET {
        fs::write(folder.path().join(name), text).unwrap();
    }
    let mut harness = window(Options {
        source: Some(SceneSource::File(folder.path().join("scene.obj"))),
        scene_options: SceneOptions::with_sides(Sides::One),
        settings: SolveSettings::draft(),
        ..Options::default()
    });
    let is_finished = |app: &App| matches!(app.state.run.status, RunStatus::Finished(_));
    wait_for(&mut harness, is_finished);
    assert!(!target_is_lit(harness.state()));
    let step_count = harness.state().state.run.reports.len();
    let mut materials = harness.state().state.materials.clone();
    let wall = materials.now.iter().position(|m| m.name == "wall").unwrap();
    materials.now[wall].reflectance = glam::Vec3::splat(0.8);
    perform(&mut harness, Action::Relight(materials));
    wait_for(&mut harness, |app| is_finished(app) && target_is_lit(app));
    assert_eq!(
        harness.state().state.run.reports.len(),
        step_count,
        "the run began again by itself, and came to its end"
    );
}
