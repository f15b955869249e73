//! The dialog for a picture of any size.

use std::path::PathBuf;

use eframe::egui::{self, DragValue};

use super::dialog::{confirm, dialog, file_field};
use crate::viewer::{action::Action, state::State};

/// Show the dialog where it is open; requested actions go into `actions`.
pub fn picture_window(ctx: &egui::Context, state: &mut State, actions: &mut Vec<Action>) {
    let mut open = state.panels.picture;
    dialog(ctx, "Save picture", &mut open, |ui| {
        picture_ui(ui, state, actions)
    });
    state.panels.picture = open;
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
        for multiple in [1, 2, 4] {
            let text = format!("Viewport size × {multiple}");
            if ui.small_button(text).clicked() {
                panels.picture_size = window.map(|side| side * multiple);
            }
        }
        if ui.small_button("3840 × 2160").clicked() {
            panels.picture_size = [3840, 2160];
        }
    });
    ui.checkbox(&mut panels.picture_is_transparent, "Transparent background")
        .on_hover_text(
            "Omit the background: straight alpha in a PNG, colours multiplied by alpha in an EXR",
        );
    let label = "File: .png as seen, .exr with linear radiance";
    file_field(ui, label, &mut panels.picture_text);
    let path = panels.picture_text.trim();
    let confirmed = confirm(ui, "Save", !path.is_empty(), "Name a file.");
    if confirmed {
        actions.push(Action::SavePicture {
            path: PathBuf::from(path),
            size: panels.picture_size,
            is_transparent: panels.picture_is_transparent,
        });
    }
    confirmed
}
