//! The menu bar.

use eframe::egui;

use super::{guide::Guide, scene};
use crate::{
    export::ToneMap,
    scene::UpAxis,
    viewer::{
        action::{Action, Scale},
        bindings::{Binding, hint},
        camera::AxisView,
        loader::SceneSource,
        state::State,
        view::ViewMode,
    },
};

/// Height of the list of bookmarks above which it scrolls, in points.
const MOST_HEIGHT: f32 = 240.0;

/// Show the bar; requested actions go into `actions`.
pub fn menu_ui(
    ui: &mut egui::Ui,
    state: &mut State,
    guide: &mut Guide,
    table: &[Binding],
    actions: &mut Vec<Action>,
) {
    egui::MenuBar::new().ui(ui, |ui| {
        ui.menu_button("File", |ui| file_menu(ui, state, table, actions));
        ui.menu_button("Scenes", |ui| scene::builtin_menu(ui, actions));
        ui.menu_button("View", |ui| view_menu(ui, state, table, actions));
        ui.menu_button("Camera", |ui| camera_menu(ui, state, table, actions));
        ui.menu_button("Light", |ui| {
            item(
                ui,
                table,
                actions,
                "Pause or continue",
                Action::PauseContinue,
            );
            item(ui, table, actions, "Stop", Action::Stop);
            item(ui, table, actions, "Restart", Action::Reset);
            ui.separator();
            item(
                ui,
                table,
                actions,
                "Trace reference",
                Action::TraceReference,
            );
        });
        ui.menu_button("Help", |ui| {
            ui.menu_button("Guide", |ui| guide.menu_ui(ui));
            item(ui, table, actions, "Keys and mouse", Action::ToggleHelp);
            ui.separator();
            ui.weak(concat!("vecrad ", env!("CARGO_PKG_VERSION")));
        });
        if let Some(loaded) = &state.loaded {
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                ui.add_space(4.0);
                ui.weak(loaded.source.label());
            });
        }
    });
}

fn file_menu(ui: &mut egui::Ui, state: &mut State, table: &[Binding], actions: &mut Vec<Action>) {
    item(ui, table, actions, "Open…", Action::OpenDialog);
    if ui.button("Open by path…").clicked() {
        state.panels.ask_for_path();
        ui.close();
    }
    ui.add_enabled_ui(!state.recent.files.is_empty(), |ui| {
        ui.menu_button("Open recent", |ui| {
            for path in &state.recent.files {
                let source = SceneSource::File(path.clone());
                let button = ui.button(source.label());
                if button.on_hover_text(path.display().to_string()).clicked() {
                    actions.push(Action::Load(source));
                    ui.close();
                }
            }
            ui.separator();
            item(
                ui,
                table,
                actions,
                "Clear recent files",
                Action::ClearRecent,
            );
        });
    });
    item(ui, table, actions, "Reload", Action::Reload);
    let is_watched = state.watches_files;
    let label = "Reload when files change";
    toggle(ui, table, actions, label, is_watched, Action::ToggleWatch);
    ui.separator();
    item(
        ui,
        table,
        actions,
        "Save camera and settings",
        Action::SaveSidecar,
    );
    item(
        ui,
        table,
        actions,
        "Save material file",
        Action::SaveMaterials,
    );
    ui.add_enabled_ui(state.run.snapshot.is_some(), |ui| {
        item(ui, table, actions, "Export lit mesh…", Action::MeshDialog);
    });
    item(ui, table, actions, "Save picture", Action::Screenshot);
    item(
        ui,
        table,
        actions,
        "Save picture of the window",
        Action::ScreenshotWithWindow,
    );
    item(
        ui,
        table,
        actions,
        "Save picture as…",
        Action::PictureDialog,
    );
    ui.separator();
    item(ui, table, actions, "Quit", Action::Quit);
}

fn view_menu(ui: &mut egui::Ui, state: &State, table: &[Binding], actions: &mut Vec<Action>) {
    // A menu of its own: with all modes in it, this one would not fit into a small window.
    ui.menu_button("Surfaces show", |ui| {
        for mode in ViewMode::offered(state.truth.exists()) {
            let action = Action::Mode(mode);
            let keys = hint(table, &action);
            let button =
                egui::Button::selectable(mode == state.view.mode, mode.label()).shortcut_text(keys);
            if ui.add(button).on_hover_text(mode.explanation()).clicked() {
                actions.push(action);
                ui.close();
            }
        }
    });
    ui.separator();
    let view = &state.view;
    let has_backs = state.has_backs() && view.mode != ViewMode::FaceOrientation;
    let has_interior = state.has_interior();
    let has_gloss = state.has_gloss();
    let toggles = [
        (
            "Element mesh over the light",
            view.edges,
            Action::ToggleEdges,
        ),
        ("Cluster boxes", view.clusters.shown, Action::ToggleClusters),
        (
            "Links of what is picked",
            view.links.shown,
            Action::ToggleLinks,
        ),
        ("Backs of faces", view.backs, Action::ToggleBacks),
        ("Gloss in the drawn view", view.gloss, Action::ToggleGloss),
        ("Traced picture at rest", view.traced, Action::ToggleTraced),
        (
            "See through walls from outside",
            view.see_through,
            Action::ToggleSeeThrough,
        ),
        (
            "Automatic exposure",
            view.auto_exposure,
            Action::AutoExposure,
        ),
        (
            "Tone map",
            view.tone_map == ToneMap::Neutral,
            Action::ToggleToneMap,
        ),
    ];
    for (label, is_on, action) in toggles {
        let is_offered = match action {
            Action::ToggleBacks => has_backs,
            Action::ToggleGloss => has_gloss,
            Action::ToggleSeeThrough => has_interior,
            _ => true,
        };
        if is_offered {
            toggle(ui, table, actions, label, is_on, action);
        }
    }
    ui.separator();
    toggle(
        ui,
        table,
        actions,
        "Panels",
        state.panels.shown,
        Action::TogglePanels,
    );
    let is_full = ui.input(|input| input.viewport().fullscreen.unwrap_or(false));
    toggle(
        ui,
        table,
        actions,
        "Full screen",
        is_full,
        Action::ToggleFullScreen,
    );
    let percent = (100.0 * ui.ctx().zoom_factor()).round();
    ui.menu_button(format!("UI scale ({percent} %)"), |ui| {
        for (label, scale) in [
            ("Larger", Scale::Larger),
            ("Smaller", Scale::Smaller),
            ("Default", Scale::Whole),
        ] {
            item(ui, table, actions, label, Action::Scale(scale));
        }
    });
    item(ui, table, actions, "Reset layout", Action::ResetLayout);
    ui.menu_button("Theme", theme_menu);
}

fn theme_menu(ui: &mut egui::Ui) {
    let present = ui.ctx().options(|options| options.theme_preference);
    for (label, preference) in [
        ("System", egui::ThemePreference::System),
        ("Dark", egui::ThemePreference::Dark),
        ("Light", egui::ThemePreference::Light),
    ] {
        if ui.selectable_label(present == preference, label).clicked() {
            ui.ctx().set_theme(preference);
            ui.close();
        }
    }
}

fn camera_menu(ui: &mut egui::Ui, state: &State, table: &[Binding], actions: &mut Vec<Action>) {
    item(
        ui,
        table,
        actions,
        "Back to the first view",
        Action::FirstLook,
    );
    item(ui, table, actions, "Show the whole scene", Action::FrameAll);
    item(
        ui,
        table,
        actions,
        "Show the selection",
        Action::FrameSelected,
    );
    ui.separator();
    for (label, view) in [
        ("From the front", AxisView::Front),
        ("From behind", AxisView::Back),
        ("From the right", AxisView::Right),
        ("From the left", AxisView::Left),
        ("From above", AxisView::Top),
        ("From below", AxisView::Bottom),
        ("Isometric", AxisView::Isometric),
    ] {
        item(ui, table, actions, label, Action::LookFrom(view));
    }
    item(
        ui,
        table,
        actions,
        "Perspective or parallel",
        Action::ToggleProjection,
    );
    ui.separator();
    item(ui, table, actions, "Keep as bookmark", Action::AddBookmark);
    // A file may bring many.
    egui::ScrollArea::vertical()
        .max_height(MOST_HEIGHT)
        .show(ui, |ui| {
            for index in 0..state.bookmarks.len() {
                let label = format!("Bookmark {}", index + 1);
                ui.horizontal(|ui| {
                    item(ui, table, actions, &label, Action::GoTo(index));
                    let remove = ui.small_button("×").on_hover_text("Forget this bookmark");
                    if remove.clicked() {
                        actions.push(Action::RemoveBookmark(index));
                    }
                });
            }
        });
    item(ui, table, actions, "Copy as flags", Action::CopyCamera);
    item(ui, table, actions, "Paste", Action::RequestPaste);
    ui.separator();
    for (label, up) in [("Y is up", UpAxis::Y), ("Z is up", UpAxis::Z)] {
        let button = egui::Button::selectable(state.rig.target.up == up.vector(), label)
            .shortcut_text(hint(table, &Action::Up(up)));
        if ui.add(button).clicked() {
            actions.push(Action::Up(up));
            ui.close();
        }
    }
}

/// An entry with its key, and a check mark where it is on.
fn toggle(
    ui: &mut egui::Ui,
    table: &[Binding],
    actions: &mut Vec<Action>,
    label: &str,
    mut is_on: bool,
    action: Action,
) {
    let keys = egui::RichText::new(hint(table, &action)).weak();
    let entry = egui::Checkbox::new(&mut is_on, (label, egui::Atom::grow(), keys));
    if ui.add(entry).clicked() {
        actions.push(action);
        ui.close();
    }
}

/// An entry with its key.
fn item(
    ui: &mut egui::Ui,
    table: &[Binding],
    actions: &mut Vec<Action>,
    label: &str,
    action: Action,
) {
    let mut button = egui::Button::new(label);
    let keys = hint(table, &action);
    if !keys.is_empty() {
        button = button.shortcut_text(keys);
    }
    if ui.add(button).clicked() {
        actions.push(action);
        ui.close();
    }
}
