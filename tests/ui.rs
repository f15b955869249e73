//! The window by its labels, without a graphics adapter: panels ask, the worker obeys, the state follows.

#![cfg(feature = "viewer")]

mod windows;

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use eframe::egui::{self, Role};
use egui_kittest::{Harness, kittest::Queryable as _};
use glam::Vec3;
use vecrad::{
    solver::{Oracle, SolveSettings, StepReport},
    viewer::{
        Options,
        action::Action,
        app::App,
        loader::SceneSource,
        messages::Severity,
        run::RunStatus,
        view::{ClusterCut, ClusterRequest, LinkEnd, ViewMode, ViewRequest},
    },
    worker::{Effect, StopReason},
};
use windows::{ONE_TRIANGLE, perform, plates, wait_for, window};

/// A window that has lit the box, with the middle of its back wall picked.
fn picked_in_the_box() -> Harness<'static, App> {
    let mut harness = window(Options {
        source: Some(SceneSource::Builtin("cornell".to_owned())),
        settings: SolveSettings::draft(),
        ..Options::default()
    });
    wait_for(&mut harness, |app| {
        matches!(app.state.run.status, RunStatus::Finished(_))
    });
    let at = harness.get_by_label("Scene").rect().center();
    harness.hover_at(at);
    harness.step();
    harness.drag_at(at);
    harness.drop_at(at);
    wait_for(&mut harness, |app| {
        app.state.inspections.element().is_some()
    });
    harness
}

/// Whether what is shown is what the state asks for.
fn is_staged(app: &App) -> bool {
    let (state, staged) = (&app.state, app.state.staged.as_ref());
    staged.is_some_and(|staged| {
        staged.wanted.clusters == state.view.clusters
            && staged.wanted.mode == state.view.mode
            && state
                .run
                .snapshot
                .as_ref()
                .is_some_and(|snapshot| Arc::ptr_eq(snapshot, &staged.wanted.snapshot))
    })
}

#[test]
fn an_empty_window_says_what_to_do() {
    let mut harness = window(Options::default());
    harness.run_steps(2);
    harness.get_by_label("Open a scene to light it");
    harness.get_by_label("Open…");
    assert_eq!(harness.state().state.run.status, RunStatus::Idle);
}

#[test]
fn a_scene_is_read_lit_and_finished() {
    let mut harness = plates();
    let state = &harness.state().state;
    assert_eq!(state.run.reports.len() as u32, state.settings.max_steps);
    let snapshot = state.run.snapshot.as_ref().expect("there is light");
    assert!(
        snapshot
            .light
            .irradiance
            .iter()
            .all(|light| light.is_finite())
    );
    harness.get_by_label("Restart");
    // The heading may lie below the fold of the panel.
    harness.get_by_label("Statistics").click_accesskit();
    harness.run_steps(20);
    harness.get_by_label("Patches");
}

#[test]
fn a_finer_threshold_refines_and_another_method_restarts() {
    let mut harness = plates();
    let generation_of = |harness: &Harness<'static, App>| harness.state().state.run.reports.len();
    let steps = generation_of(&harness);
    let mut finer = harness.state().state.settings.clone();
    finer.epsilon *= 0.5;
    perform(&mut harness, Action::Settings(finer.clone()));
    assert_eq!(last_effect(&harness), Some(Effect::Refines));
    wait_for(&mut harness, |app| {
        matches!(app.state.run.status, RunStatus::Finished(_))
            && app.state.run.reports.len() > steps
    });
    assert!(
        generation_of(&harness) > steps,
        "the steps before are still there"
    );
    let mut other = finer;
    other.seed += 1;
    perform(&mut harness, Action::Settings(other));
    assert_eq!(last_effect(&harness), Some(Effect::Restarts));
    assert_told(&harness, "so the run was restarted");
}

fn last_effect(harness: &Harness<'static, App>) -> Option<Effect> {
    let change = harness.state().state.run.last_change.as_ref();
    change.map(|change| change.effect)
}

/// Whether a sentence stands under the progress, and in the line at the bottom.
fn assert_told(harness: &Harness<'static, App>, text: &str) {
    assert_eq!(
        harness.query_all_by_label_contains(text).count(),
        2,
        "{text}"
    );
}

#[test]
fn light_that_is_finer_than_asked_for_says_so_where_the_run_is_shown() {
    let mut harness = plates();
    let before = harness.get_by_label("Normal").rect();
    let mut coarser = harness.state().state.settings.clone();
    coarser.epsilon *= 4.0;
    let epsilon = coarser.epsilon;
    perform(&mut harness, Action::Settings(coarser));
    assert_eq!(last_effect(&harness), Some(Effect::Continues));
    assert_told(&harness, "Restart to have it coarser");
    let sentence = harness.query_all_by_label_contains("Restart to have it coarser");
    let progress = harness.get_by_label("Progress").rect().bottom();
    let highest = sentence
        .map(|said| said.rect().top())
        .fold(f32::MAX, f32::min);
    assert!(progress < highest && highest < before.top());
    assert_eq!(
        harness.get_by_label("Normal").rect(),
        before,
        "nothing moves"
    );
    // The offered actions can be done.
    perform(&mut harness, Action::Reset);
    wait_for(&mut harness, |app| {
        // The light before was a quarter of that.
        let is_coarse = |report: &StepReport| report.is_final && report.epsilon > 0.5 * epsilon;
        matches!(app.state.run.status, RunStatus::Finished(_))
            && app.state.report().is_some_and(is_coarse)
    });
    assert_eq!(last_effect(&harness), None);
}

#[test]
fn figures_keep_their_rows_while_a_run_begins_again() {
    let mut harness = plates();
    let places = |harness: &Harness<'static, App>| {
        ["Energy balance", "Memory", "Normal"].map(|label| harness.get_by_label(label).rect())
    };
    let before = places(&harness);
    // As it is until the first step is there.
    harness.state_mut().state.run.reports.clear();
    harness.run_steps(2);
    assert_eq!(places(&harness), before);
    assert!(harness.query_all_by_label("–").count() >= 9);
}

#[test]
fn presets_are_chosen_by_their_button() {
    let mut harness = plates();
    harness.get_by_label("Normal").click();
    harness.run_steps(3);
    assert_eq!(harness.state().state.settings, SolveSettings::normal());
    // Another method stays under another quality, and the preset does not pass for the whole of it.
    let mut other = SolveSettings::draft();
    other.oracle = Oracle::Samples;
    other.samples = 9;
    perform(&mut harness, Action::Settings(other));
    assert!(harness.query_by_label_contains(" *").is_none());
    harness.get_by_label("Normal").click();
    harness.run_steps(3);
    let by_samples = SolveSettings {
        oracle: Oracle::Samples,
        ..SolveSettings::normal()
    };
    assert_eq!(harness.state().state.settings, by_samples);
    harness.get_by_label("Normal *");
    harness.get_by_label("Draft");
    perform(&mut harness, Action::Settings(SolveSettings::normal()));
    harness.get_by_label("Normal");
}

#[test]
fn pause_and_continue_never_begin_again() {
    let mut harness = window(Options {
        source: Some(SceneSource::Builtin("room-1022".to_owned())),
        settings: SolveSettings::finest(),
        ..Options::default()
    });
    wait_for(&mut harness, |app| !app.state.run.reports.is_empty());
    perform(&mut harness, Action::PauseContinue);
    wait_for(&mut harness, |app| {
        app.state.run.status == RunStatus::Paused
    });
    let steps = harness.state().state.run.reports.len();
    harness.get_by_label("Continue").click();
    wait_for(&mut harness, |app| {
        app.state.run.status == RunStatus::Running
    });
    assert!(harness.state().state.run.reports.len() >= steps);
    perform(&mut harness, Action::Stop);
    wait_for(&mut harness, |app| {
        app.state.run.status == RunStatus::Finished(StopReason::Requested)
    });
}

#[test]
fn view_keys_change_the_view() {
    let mut harness = plates();
    harness.key_press(egui::Key::M);
    harness.run_steps(2);
    assert!(harness.state().state.view.edges);
    harness.key_press(egui::Key::B);
    harness.run_steps(2);
    assert!(harness.state().state.view.clusters.shown);
    harness.key_press(egui::Key::Equals);
    harness.run_steps(2);
    let view = &harness.state().state.view;
    assert!(
        !view.auto_exposure,
        "a hand on the exposure ends the automatic"
    );
    perform(&mut harness, Action::Mode(ViewMode::FalseIrradiance));
    harness.get_by_label("Fixed range");
    harness.key_press(egui::Key::F1);
    harness.run_steps(2);
    harness.get_by_label("Keys and mouse");
    harness.get_by_label("Pause or continue");
}

#[test]
fn a_click_picks_and_shows_the_light() {
    let mut harness = plates();
    let scene = harness.get_by_label("Scene").rect();
    let at = scene.center();
    harness.hover_at(at);
    harness.step();
    harness.drag_at(at);
    harness.drop_at(at);
    harness.run_steps(3);
    // The middle of the opening view may be a gap between the plates: then nothing is picked.
    if harness.state().state.selection.is_some() {
        harness.get_by_label("Position");
    }
    harness.key_press(egui::Key::Escape);
    harness.run_steps(2);
    assert!(harness.state().state.selection.is_none());
}

#[test]
fn a_picked_element_tells_its_row_sum_and_a_path_to_choose_from() {
    let mut harness = picked_in_the_box();
    harness.get_by_label("Row sum");
    harness.get_by_label("Path from the root");
    harness.get_by_label_contains("Level 0 ·").click();
    wait_for(&mut harness, |app| {
        app.state.cluster == Some(0) && app.state.inspections.of(LinkEnd::Cluster).is_some()
    });
    let state = &harness.state().state;
    let inspection = state.inspections.element().expect("it was answered");
    let probe = state.selection.as_ref().and_then(|picked| picked.probe);
    let shown = probe.expect("the wall is lit").irradiance;
    let said = inspection.linked + inspection.direct;
    assert!(
        (said - shown).abs().max_element() < 0.3 * shown.max_element(),
        "the element has {said}, its vertices {shown}"
    );
    assert_eq!(inspection.step, state.settings.max_steps);
}

#[test]
fn links_are_shown_by_a_key_and_their_light_is_told() {
    let mut harness = picked_in_the_box();
    harness.key_press(egui::Key::L);
    harness.run_steps(2);
    assert!(harness.state().state.view.links.shown);
    harness.get_by_label_contains("of their light");
    harness.state_mut().state.view.links.most = 1;
    harness.run_steps(2);
    harness.get_by_label_contains("1 of ");
    harness.state_mut().state.view.links.of = LinkEnd::Cluster;
    harness.run_steps(2);
    harness.get_by_label_contains("to select a cluster");
    perform(&mut harness, Action::SelectCluster(2));
    wait_for(&mut harness, |app| {
        app.state.inspections.of(LinkEnd::Cluster).is_some()
    });
    harness.key_press(egui::Key::L);
    harness.run_steps(2);
    assert!(!harness.state().state.view.links.shown);
}

#[test]
fn a_new_start_forgets_what_the_solver_said() {
    let mut harness = picked_in_the_box();
    let mut other = harness.state().state.settings.clone();
    other.seed += 1;
    perform(&mut harness, Action::Settings(other));
    // The point is still picked: the new run is asked, and answers.
    wait_for(&mut harness, |app| {
        matches!(app.state.run.status, RunStatus::Finished(_))
            && app
                .state
                .inspections
                .element()
                .is_some_and(|told| told.step == app.state.settings.max_steps)
    });
}

#[test]
fn clusters_are_cut_by_size_and_by_use() {
    let mut harness = picked_in_the_box();
    let shown = |harness: &Harness<'static, App>| harness.state().state.shown_clusters.shown.len();
    harness.state_mut().state.view.clusters.cut = ClusterCut::Size;
    harness.state_mut().state.view.clusters.size = 0.5;
    harness.run_steps(2);
    wait_for(&mut harness, is_staged);
    let before = shown(&harness);
    harness.key_press(egui::Key::CloseBracket);
    harness.run_steps(2);
    let overlay = harness.state().state.view.clusters;
    assert_eq!((overlay.shown, overlay.size), (true, 0.25));
    wait_for(&mut harness, is_staged);
    assert!(shown(&harness) > before, "smaller boxes are more");
    harness.state_mut().state.view.clusters.cut = ClusterCut::Used;
    harness.run_steps(2);
    wait_for(&mut harness, is_staged);
    assert!(shown(&harness) > 0);
    harness.get_by_label_contains("boxes of");
}

#[test]
fn a_file_that_is_not_there_is_a_message() {
    let mut harness = plates();
    let source = SceneSource::File("/no/such/scene.obj".into());
    perform(&mut harness, Action::Load(source));
    wait_for(&mut harness, |app| app.state.loading.is_none());
    let state = &harness.state().state;
    let last = state.messages.all.last().expect("a message");
    assert_eq!(last.severity, Severity::Error);
    assert!(state.loaded.is_some(), "the scene before stays");
}

#[test]
fn reload_keeps_camera_and_settings() {
    let mut harness = plates();
    harness.state_mut().state.rig.target.yaw = 1.25;
    perform(&mut harness, Action::ExposureBy(0.5));
    let exposure = harness.state().state.view.exposure;
    perform(&mut harness, Action::Reload);
    wait_for(&mut harness, |app| {
        app.state.loading.is_none() && matches!(app.state.run.status, RunStatus::Finished(_))
    });
    let state = &harness.state().state;
    assert_eq!(state.rig.target.yaw, 1.25);
    assert_eq!(state.view.exposure, exposure);
}

#[test]
fn the_reference_measures_each_run_and_the_view_of_errors_is_offered() {
    let mut harness = plates();
    assert!(!ViewMode::offered(false).any(|mode| mode == ViewMode::Error));
    // The button may lie below the fold of the panel.
    harness.get_by_label("Trace reference").click_accesskit();
    harness.run_steps(2);
    wait_for(&mut harness, |app| app.state.truth.newest_error().is_some());
    harness.get_by_label("Relative RMS");
    harness.get_by_label("Trimmed RMS against run time");
    harness.get_by_label("Pause tracing");
    // Another run of the same scene: the first stays for comparison until it is cleared.
    let mut other = harness.state().state.settings.clone();
    other.seed += 1;
    perform(&mut harness, Action::Settings(other));
    wait_for(&mut harness, |app| {
        app.state.truth.runs.len() == 2
            && matches!(app.state.run.status, RunStatus::Finished(_))
            && app
                .state
                .truth
                .newest_error()
                .is_some_and(|(step, ..)| step == app.state.settings.max_steps)
    });
    let truth = &harness.state().state.truth;
    assert!(truth.steps_of(&truth.runs[0]).next().is_some());
    assert_eq!(
        truth
            .steps_of(&truth.runs[1])
            .map(|(step, ..)| step)
            .collect::<Vec<_>>(),
        (1..=harness.state().state.settings.max_steps).collect::<Vec<_>>(),
        "no step goes unmeasured"
    );
    // The button may lie below the fold of the panel.
    harness
        .get_by_label("Forget earlier runs")
        .click_accesskit();
    harness.run_steps(3);
    assert_eq!(harness.state().state.truth.runs.len(), 1);
    // Vertices are compared once they are looked at.
    perform(&mut harness, Action::Mode(ViewMode::Error));
    wait_for(&mut harness, |app| {
        let snapshot = app.state.run.snapshot.as_ref().expect("there is light");
        app.state.truth.vertex_errors(snapshot).is_some()
    });
    harness.get_by_label_contains("At each vertex");
}

#[test]
fn the_view_of_the_estimated_error_needs_no_reference() {
    assert!(ViewMode::offered(false).any(|mode| mode == ViewMode::EstimatedError));
    let mut harness = picked_in_the_box();
    // The picked place has a figure of its own.
    let count = |harness: &Harness<'static, App>| {
        let named = harness.get_all_by_label("Estimated error");
        named.count()
    };
    let with_picked = count(&harness);
    perform(&mut harness, Action::ClearSelection);
    assert_eq!(count(&harness), with_picked - 1);
    perform(&mut harness, Action::Mode(ViewMode::EstimatedError));
    wait_for(&mut harness, |app| {
        let staged = app.state.staged.as_ref();
        staged.is_some_and(|staged| staged.errors.is_some())
    });
    let state = &harness.state().state;
    let [low, high] = state.false_color_range;
    assert!(low == -high && high >= 1.0, "{low} {high}");
    let staged = state.staged.as_ref().expect("it is shown");
    let errors = staged.errors.as_ref().expect("they are known");
    assert_eq!(errors.len(), staged.wanted.snapshot.mesh.positions.len());
    assert!(errors.iter().all(|error| error.abs() <= high));
    // A scale with a sign has no logarithm.
    assert!(harness.query_by_label("Log").is_none());
    harness.get_by_label("Fixed range");
}

#[test]
fn below_the_accuracies_stands_when_to_expect_them() {
    let harness = picked_in_the_box();
    harness.get_by_label("takes about");
    let reports = harness.state().state.run.reports.iter();
    let errors = reports.filter_map(|report| Some(report.estimated_error?.trimmed_high));
    let error = errors.fold(f64::INFINITY, f64::min);
    let reached = [0.1, 0.05, 0.02, 0.01]
        .iter()
        .filter(|&&wanted| error <= wanted)
        .count();
    assert!(
        reached > 0,
        "a draft of the box is as good as 10 %: {error}"
    );
    assert_eq!(harness.get_all_by_label("reached").count(), reached);
}

#[test]
fn a_reference_of_another_scene_is_dropped() {
    let mut harness = plates();
    perform(&mut harness, Action::TraceReference);
    wait_for(&mut harness, |app| app.state.truth.newest_error().is_some());
    perform(&mut harness, Action::Reload);
    wait_for(&mut harness, |app| {
        app.state.loading.is_none() && matches!(app.state.run.status, RunStatus::Finished(_))
    });
    assert!(!harness.state().state.truth.exists());
    assert!(harness.state().state.truth.newest_error().is_none());
    harness.get_by_label("Trace reference");
}

#[test]
fn emission_is_scaled_at_once_and_reset() {
    let mut harness = plates();
    let range = |harness: &Harness<'static, App>| harness.state().state.false_color_range[1];
    perform(&mut harness, Action::Mode(ViewMode::FalseIrradiance));
    let before = range(&harness);
    let exposure = harness.state().state.view.exposure;
    perform(&mut harness, Action::EmissionScale(3.0));
    assert!((range(&harness) / before - 3.0).abs() < 1e-4);
    assert_eq!(harness.state().state.view.exposure, exposure);
    harness.get_by_label("Reset emission scale").click();
    harness.run_steps(3);
    assert_eq!(harness.state().state.view.emission_scale, 1.0);
}

#[test]
fn lights_and_materials_are_changed_by_their_controls_and_reset() {
    let mut harness = plates();
    let radiance = |harness: &Harness<'static, App>| -> Vec3 {
        let snapshot = harness.state().state.run.snapshot.clone();
        let snapshot = snapshot.expect("the plates are lit");
        let mesh = snapshot.mesh.emission.iter().sum::<Vec3>();
        mesh + snapshot.light.irradiance.iter().sum::<Vec3>()
    };
    let before = radiance(&harness);
    let lamp = {
        let state = &harness.state().state;
        let lamp = state.materials.lights().next().expect("a plate emits");
        state.materials.now[lamp].name.clone()
    };
    harness.get_by_role_and_label(Role::CheckBox, &lamp).click();
    wait_for(&mut harness, |app| app.state.run.relit_secs.is_some());
    assert_eq!(radiance(&harness), Vec3::ZERO, "switched off");
    assert!(harness.state().state.materials.are_changed());
    assert_eq!(harness.state().state.run.status, RunStatus::Paused);
    harness.get_by_label("Reset lights and materials").click();
    wait_for(&mut harness, |app| {
        let mesh = app.state.run.snapshot.as_ref().map(|shown| &shown.mesh);
        mesh.is_some_and(|mesh| mesh.emission.iter().any(|light| *light != Vec3::ZERO))
    });
    assert!(!harness.state().state.materials.are_changed());
    assert!((radiance(&harness) / before - 1.0).abs().max_element() < 1e-5);
}

#[test]
fn what_is_measured_by_a_reference_goes_with_the_light_it_was_traced_for() {
    let mut harness = plates();
    perform(&mut harness, Action::TraceReference);
    wait_for(&mut harness, |app| app.state.truth.newest_error().is_some());
    perform(&mut harness, Action::Mode(ViewMode::Error));
    let mut materials = harness.state().state.materials.clone();
    materials.now[0].reflectance = Vec3::splat(0.25);
    perform(&mut harness, Action::Relight(materials));
    let state = &harness.state().state;
    assert!(!state.truth.exists() && state.truth.newest_error().is_none());
    assert_ne!(state.view.mode, ViewMode::Error);
    let scene = state.lit_scene().expect("there is a scene");
    assert_eq!(scene.materials[0].reflectance, Vec3::splat(0.25));
    perform(&mut harness, Action::TraceReference);
    wait_for(&mut harness, |app| app.state.truth.newest_error().is_some());
}

#[test]
fn the_lit_mesh_is_exported_in_either_format() {
    let folder = tempfile::tempdir().expect("a folder can be made");
    let mut harness = plates();
    for (label, ending, magic, last) in [
        ("GLB", "glb", &b"glTF"[..], &b"_SH3"[..]),
        ("PLY", "ply", &b"ply\n"[..], &b"sh3_b"[..]),
    ] {
        harness.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::E);
        harness.run_steps(3);
        let path = folder.path().join("lit.fbx");
        harness.state_mut().state.panels.mesh_text = path.display().to_string();
        harness.run_steps(2);
        // The choice is there again with the next file.
        if !harness.state().state.panels.mesh_has_harmonics {
            harness.get_by_label("Light by direction").click();
        }
        harness.get_by_label("Export").click();
        harness.run_steps(2);
        assert!(harness.state().state.panels.mesh, "that is no format");
        harness.get_by_label(label).click();
        harness.run_steps(2);
        harness.get_by_label("Export").click();
        harness.run_steps(2);
        assert!(!harness.state().state.panels.mesh);
        let path = path.with_extension(ending);
        wait_for(&mut harness, |_| path.exists());
        wait_for(&mut harness, |app| {
            let said = app.state.messages.all.last();
            said.is_some_and(|said| said.text.ends_with(&format!("lit.{ending}")))
        });
        let bytes = fs::read(&path).expect("it can be read");
        assert!(bytes.starts_with(magic));
        assert!(bytes.windows(last.len()).any(|window| window == last));
    }
}

#[test]
fn flying_slowly_opens_and_closes_nothing() {
    let mut harness = plates();
    let pos = harness.get_by_label("Scene").rect().center();
    harness.hover_at(pos);
    let right = |pressed| egui::Event::PointerButton {
        pos,
        button: egui::PointerButton::Secondary,
        pressed,
        modifiers: egui::Modifiers::NONE,
    };
    harness.event(right(true));
    harness.run_steps(2);
    harness.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::E);
    harness.run_steps(2);
    assert!(!harness.state().state.panels.mesh);
    harness.event(right(false));
    harness.run_steps(2);
    harness.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::E);
    harness.run_steps(2);
    assert!(harness.state().state.panels.mesh);
}

#[test]
fn the_layout_is_reset() {
    let mut harness = plates();
    harness.state_mut().state.panels.light = false;
    harness.ctx.set_zoom_factor(1.5);
    harness.run_steps(3);
    perform(&mut harness, Action::ResetLayout);
    assert!(harness.state().state.panels.light);
    assert_eq!(harness.ctx.zoom_factor(), 1.0);
    harness.get_by_label("Statistics");
}

#[test]
fn an_idle_window_asks_for_no_frames() {
    let mut harness = plates();
    // Ends only when nothing asks for another frame; a restless window exceeds the steps and panics.
    harness.run();
}

/// A file as the system hands it over.
#[derive(Debug)]
struct Dropped(PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        fs::read(&self.0).map_err(|error| error.to_string())
    }
}

/// Drop files, and wait until they are read or refused.
fn drop_files(harness: &mut Harness<'static, App>, paths: &[&Path]) {
    let input = harness.input_mut();
    for path in paths {
        let file: egui::DroppedFileHandle = Arc::new(Dropped((*path).to_owned()));
        input.dropped_files.push(file);
    }
    harness.step();
    harness.input_mut().dropped_files.clear();
    wait_for(harness, |app| app.state.loading.is_none());
}

fn last_message(harness: &Harness<'static, App>) -> (Severity, String) {
    let message = harness.state().state.messages.all.last();
    message.map_or((Severity::Note, String::new()), |message| {
        (message.severity, message.text.clone())
    })
}

fn shown_file(harness: &Harness<'static, App>) -> Option<PathBuf> {
    let loaded = harness.state().state.loaded.as_ref()?;
    Some(loaded.source.path()?.to_owned())
}

#[test]
fn a_dropped_scene_is_opened() {
    let folder = tempfile::tempdir().expect("a folder can be made");
    let (scene, picture) = (folder.path().join("a.OBJ"), folder.path().join("a.png"));
    fs::write(&scene, ONE_TRIANGLE).expect("it can be written");
    fs::write(&picture, [137, 80, 78, 71, 13, 10, 26, 10, 0, 0]).expect("it can be written");
    let mut harness = window(Options::default());
    harness.run_steps(2);

    // Something else is refused, and the window stays empty.
    drop_files(&mut harness, &[&picture]);
    let (severity, text) = last_message(&harness);
    assert_eq!(severity, Severity::Error);
    assert!(text.contains("neither glTF nor OBJ text"), "{text}");
    assert_eq!(shown_file(&harness), None);
    let shown = harness.query_all_by_label_contains("neither glTF nor OBJ text");
    assert!(shown.count() > 0, "the empty window says so itself");

    drop_files(&mut harness, &[&scene]);
    assert_eq!(shown_file(&harness).as_deref(), Some(scene.as_path()));
    assert_eq!(harness.state().state.recent.files, [scene]);
}

#[test]
fn among_several_dropped_files_the_scene_is_found() {
    let folder = tempfile::tempdir().expect("a folder can be made");
    let at = |name: &str| folder.path().join(name);
    for name in ["a.mtl", "b.obj", "c.obj"] {
        fs::write(at(name), ONE_TRIANGLE).expect("it can be written");
    }
    let mut harness = window(Options::default());
    drop_files(&mut harness, &[&at("a.mtl"), &at("b.obj"), &at("c.obj")]);
    assert_eq!(shown_file(&harness), Some(at("b.obj")));
    let messages = &harness.state().state.messages.all;
    let is_note = |text: &str| text.starts_with("3 files were dropped") && text.contains("b.obj");
    assert!(messages.iter().any(|message| is_note(&message.text)));
}

#[test]
fn a_dropped_folder_is_opened_where_it_holds_one_scene() {
    let folder = tempfile::tempdir().expect("a folder can be made");
    let mut harness = window(Options::default());
    for (count, sentence) in [(0, "no OBJ or glTF file"), (1, ""), (2, "several scenes")] {
        if count > 0 {
            let path = folder.path().join(format!("{count}.obj"));
            fs::write(path, ONE_TRIANGLE).expect("it can be written");
        }
        drop_files(&mut harness, &[folder.path()]);
        let (severity, text) = last_message(&harness);
        if sentence.is_empty() {
            assert_eq!(shown_file(&harness), Some(folder.path().join("1.obj")));
        } else {
            assert_eq!(severity, Severity::Error);
            assert!(text.contains(sentence), "{text}");
        }
    }
}

#[test]
fn files_held_over_the_window_are_told_what_will_happen() {
    let mut harness = window(Options::default());
    harness.run_steps(2);
    assert!(harness.query_by_label_contains("Drop to open").is_none());
    harness.input_mut().hovered_files.push(egui::HoveredFile {
        path: Some("/somewhere/hall.obj".into()),
        ..Default::default()
    });
    harness.run_steps(2);
    harness.get_by_label("Drop to open hall.obj");
    harness.input_mut().hovered_files.clear();
    harness.run_steps(2);
    assert!(harness.query_by_label_contains("Drop to open").is_none());
}

#[test]
fn the_command_line_goes_before_the_sidecar() {
    let folder = tempfile::tempdir().expect("a folder can be made");
    let scene = folder.path().join("a.obj");
    fs::write(&scene, ONE_TRIANGLE).expect("it can be written");
    let sidecar = "[view]\nmode = \"normals\"\nedges = true\nexposure = 3.0\nauto_exposure = false\n[settings]\nseed = 77\n";
    fs::write(folder.path().join("a.obj.vecrad.toml"), sidecar).expect("it can be written");
    let open = |view: ViewRequest, settings_are_asked_for| {
        let mut harness = window(Options {
            source: Some(SceneSource::File(scene.clone())),
            view,
            settings_are_asked_for,
            ..Options::default()
        });
        wait_for(&mut harness, |app| app.state.loaded.is_some());
        let state = &harness.state().state;
        (state.view.clone(), state.settings.seed)
    };
    let (view, seed) = open(ViewRequest::default(), false);
    assert_eq!(
        (view.mode, view.edges, view.exposure),
        (ViewMode::Normals, true, 3.0)
    );
    assert_eq!(seed, 77);
    let asked = ViewRequest {
        mode: Some(ViewMode::LightOnly),
        exposure: Some(-1.0),
        clusters: Some(ClusterRequest::Size(0.25)),
        ..ViewRequest::default()
    };
    let (view, seed) = open(asked, true);
    assert_eq!(
        (view.mode, view.edges, view.exposure),
        (ViewMode::LightOnly, true, -1.0)
    );
    assert_eq!(
        (view.clusters.shown, view.clusters.cut),
        (true, ClusterCut::Size)
    );
    assert_eq!(seed, SolveSettings::default().seed);
}
