//! The dialog for saving error against run time as a table.

use std::path::PathBuf;

use eframe::egui;

use crate::viewer::{action::Action, state::State};

/// Show the dialog where it is open; wishes go into `actions`.
pub fn table_window(ctx: &egui::Context, state: &mut State, actions: &mut Vec<Action>) {
    let mut open = state.panels.table;
    let mut done = false;
    egui::Window::new("Save errors as CSV")
        .open(&mut open)
        .collapsible(false)
        .resizable(false)
        .default_width(400.0)
        .anchor(egui::Align2::CENTER_CENTER, [0.0, -60.0])
        .show(ctx, |ui| {
            done = table_ui(ui, &mut state.panels.table_text, actions);
        });
    state.panels.table = open && !done;
}

/// The place; whether it was confirmed.
fn table_ui(ui: &mut egui::Ui, text: &mut String, actions: &mut Vec<Action>) -> bool {
    let label = ui.label("File");
    let field = egui::TextEdit::singleline(text).desired_width(f32::INFINITY);
    ui.add(field).labelled_by(label.id);
    ui.weak("A line for each measured step of each run, with the columns of 'vecrad report'.");
    ui.add_space(4.0);
    let path = text.trim();
    let confirmed = ui
        .add_enabled(!path.is_empty(), egui::Button::new("Save"))
        .clicked();
    if confirmed {
        actions.push(Action::SaveTable(PathBuf::from(path)));
    }
    confirmed
}
