//! Scenes to open: the text of an empty window, the list of built-in scenes, the field for a path.

use std::path::PathBuf;

use eframe::egui::{self, RichText, text::CCursorRange};

use crate::{
    scene::builtin::builtins,
    viewer::{
        action::Action, figures::counts_in, loader::SceneSource, messages::Severity, state::State,
        theme, view::ViewMode,
    },
};

/// The text in the viewport while there is no scene.
pub fn empty_ui(ui: &mut egui::Ui, rect: egui::Rect, state: &mut State, actions: &mut Vec<Action>) {
    let width = 460.0_f32.min(rect.width() - 24.0);
    let area = egui::Rect::from_center_size(rect.center(), egui::vec2(width, 330.0));
    ui.scope_builder(egui::UiBuilder::new().max_rect(area), |ui| {
        ui.vertical_centered(|ui| {
            ui.label(RichText::new("Open a scene to light it").heading());
            ui.add_space(6.0);
            let last = state.messages.all.last();
            if let Some(error) = last.filter(|message| message.severity == Severity::Error) {
                ui.colored_label(theme::bad(ui.visuals()), &error.text);
                ui.add_space(6.0);
            }
            ui.label("Drop an OBJ or glTF file here, choose one, or type its path.");
            ui.add_space(8.0);
            if ui
                .add(egui::Button::new("Open…").min_size(egui::vec2(120.0, 28.0)))
                .clicked()
            {
                actions.push(Action::OpenDialog);
            }
            ui.add_space(8.0);
            if !state.panels.path {
                path_ui(ui, state, actions);
            }
            ui.add_space(14.0);
            ui.weak("Or begin with a built-in scene");
            ui.add_space(2.0);
            for builtin in builtins().iter().take(4) {
                if ui
                    .link(format!("{}: {}", builtin.name, counts_in(builtin.summary)))
                    .clicked()
                {
                    actions.push(Action::Load(SceneSource::Builtin(builtin.name.to_owned())));
                }
            }
            ui.add_space(14.0);
            ui.weak("Left drag orbits, middle drag pans, the wheel zooms. F1 shows all keys.");
        });
    });
}

/// The text in the viewport while there is nothing to show yet.
pub fn waiting_ui(ui: &egui::Ui, rect: egui::Rect, state: &State) {
    let text = match (&state.loading, &state.loaded) {
        (Some(loading), None) => loading.progress().sentence(&loading.source().label()),
        (_, Some(loaded)) if state.run.snapshot.is_none() && state.run.status.is_busy() => {
            format!("Building the clusters of {}…", loaded.source.label())
        }
        (_, Some(loaded)) if state.staged.is_none() && state.run.snapshot.is_some() => {
            format!(
                "Uploading {} to the graphics adapter…",
                loaded.source.label()
            )
        }
        (_, Some(_)) if lacks_measured_errors(state) => {
            "Tracing the reference at the vertices…".to_owned()
        }
        (_, Some(_)) if lacks_estimate(state) => {
            "The error is estimated at the end of each step".to_owned()
        }
        _ => return,
    };
    ui.painter().text(
        rect.center(),
        egui::Align2::CENTER_CENTER,
        text,
        egui::FontId::proportional(15.0),
        theme::secondary_text(ui.visuals()),
    );
}

/// Whether an estimate is to be shown and there is none yet.
fn lacks_estimate(state: &State) -> bool {
    let snapshot = state.run.snapshot.as_ref();
    state.view.mode == ViewMode::EstimatedError
        && snapshot.is_some_and(|snapshot| snapshot.errors.is_empty())
}

/// Whether measured errors are to be shown that are not known yet.
fn lacks_measured_errors(state: &State) -> bool {
    let snapshot = state.run.snapshot.as_ref();
    state.view.mode == ViewMode::Error
        && snapshot.is_some_and(|snapshot| state.truth.vertex_errors(snapshot).is_none())
}

/// A field for a path, for when there is no file dialog.
fn path_ui(ui: &mut egui::Ui, state: &mut State, actions: &mut Vec<Action>) {
    ui.horizontal(|ui| {
        let label = ui.label("Path");
        let field = egui::TextEdit::singleline(&mut state.panels.path_text)
            .hint_text("/home/me/scene.obj")
            .desired_width(ui.available_width() - 70.0);
        let mut shown = field.show(ui);
        let response = shown.response.response.labelled_by(label.id);
        if std::mem::take(&mut state.panels.path_is_asked) {
            response.request_focus();
            // The typed text replaces the old one.
            let all = CCursorRange::select_all_str(&state.panels.path_text);
            shown.state.cursor.set_char_range(Some(all));
            shown.state.store(ui.ctx(), response.id);
        }
        let entered =
            response.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
        let text = state.panels.path_text.trim();
        let can_read = !text.is_empty() && state.loading.is_none();
        let pressed = ui.add_enabled(can_read, egui::Button::new("Read"));
        if (entered || pressed.clicked()) && can_read {
            actions.push(Action::Load(SceneSource::File(PathBuf::from(text))));
            state.panels.path_error = None;
        }
    });
}

/// The window with the field for a path. It stays until a scene is read, or it is closed.
pub fn path_window(ctx: &egui::Context, state: &mut State, actions: &mut Vec<Action>) {
    let mut open = state.panels.path;
    egui::Window::new("Open by path")
        .open(&mut open)
        .collapsible(false)
        .resizable(false)
        .default_width(420.0)
        .anchor(egui::Align2::CENTER_CENTER, [0.0, -60.0])
        .show(ctx, |ui| {
            path_ui(ui, state, actions);
            if let Some(error) = &state.panels.path_error {
                ui.colored_label(theme::bad(ui.visuals()), error);
            }
        });
    state.panels.path &= open;
}

/// The menu of built-in scenes.
pub fn builtin_menu(ui: &mut egui::Ui, actions: &mut Vec<Action>) {
    for builtin in builtins() {
        if ui
            .button(builtin.name)
            .on_hover_text(counts_in(builtin.summary))
            .clicked()
        {
            actions.push(Action::Load(SceneSource::Builtin(builtin.name.to_owned())));
            ui.close();
        }
    }
}
