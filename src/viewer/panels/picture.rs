//! The dialog for a picture of any size.

use std::path::PathBuf;

use eframe::egui::{self, DragValue};

use crate::viewer::{action::Action, state::State};

/// Show the dialog where it is open; wishes go into `actions`.
pub fn picture_window(ctx: &egui::Context, state: &mut State, actions: &mut Vec<Action>) {
    let mut open = state.panels.picture;
    let mut done = false;
    egui::Window::new("Save picture")
        .open(&mut open)
        .collapsible(false)
        .resizable(false)
        .default_width(400.0)
        .anchor(egui::Align2::CENTER_CENTER, [0.0, -60.0])
        .show(ctx, |ui| done = picture_ui(ui, state, actions));
    state.panels.picture = open && !done;
}

/// Size and place; whether it was confirmed.
fn picture_ui(ui: &mut egui::Ui, state: &mut State, actions: &mut Vec<Action>) -> bool {
    let window = state.viewport_size;
    let panels = &mut state.panels;
    ui.horizontal(|ui| {
        let label = ui.label("Size");
        for side in &mut panels.picture_size {
            let value = DragValue::new(side).range(1..=32768).suffix(" px");
            ui.add(value).labelled_by(label.id);
        }
    });
    ui.horizontal(|ui| {
        ui.weak("As the window");
        for multiple in [1, 2, 4] {
            if ui.small_button(format!("× {multiple}")).clicked() {
                panels.picture_size = window.map(|side| side * multiple);
            }
        }
        if ui.small_button("3840 × 2160").clicked() {
            panels.picture_size = [3840, 2160];
        }
    });
    ui.checkbox(&mut panels.picture_is_transparent, "Transparent background")
        .on_hover_text(
            "Leave the background out: straight alpha in a PNG, colours multiplied by alpha in an EXR",
        );
    let label = ui.label("File: .png as seen, .exr with linear radiance");
    let field = egui::TextEdit::singleline(&mut panels.picture_text).desired_width(f32::INFINITY);
    ui.add(field).labelled_by(label.id);
    ui.add_space(4.0);
    let path = panels.picture_text.trim();
    let confirmed = ui
        .add_enabled(!path.is_empty(), egui::Button::new("Save"))
        .clicked();
    if confirmed {
        actions.push(Action::SavePicture {
            path: PathBuf::from(path),
            size: panels.picture_size,
            is_transparent: panels.picture_is_transparent,
        });
    }
    confirmed
}
