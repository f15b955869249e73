//! The dialog for saving error against run time as a table.

use std::path::PathBuf;

use eframe::egui;

use super::dialog::{confirm, dialog, file_field};
use crate::viewer::{action::Action, panel_state::PanelState};

/// Show the dialog where it is open; requested actions go into `actions`.
pub fn table_window(ctx: &egui::Context, panels: &mut PanelState, actions: &mut Vec<Action>) {
    let text = &mut panels.table_text;
    dialog(ctx, "Save errors as CSV", &mut panels.table, |ui| {
        file_field(ui, "File", text);
        ui.weak("A row for each measured step of each run.");
        let path = text.trim();
        let confirmed = confirm(ui, "Save", !path.is_empty(), "Name a file.");
        if confirmed {
            actions.push(Action::SaveTable(PathBuf::from(path)));
        }
        confirmed
    });
}
