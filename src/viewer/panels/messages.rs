//! Messages: warnings of the loader, errors, and what was saved where.

use eframe::egui::{self, RichText};

use super::status::severity_color;
use crate::viewer::{messages::Severity, state::State};

/// Show all messages, the newest first. Those that are not scrolled away are then seen.
pub fn messages_ui(ui: &mut egui::Ui, state: &mut State) {
    let messages = &mut state.messages;
    if messages.all.is_empty() {
        ui.weak("Nothing to report.");
        return;
    }
    ui.horizontal(|ui| {
        if ui.small_button("Copy all").clicked() {
            let lines: Vec<&str> = messages
                .all
                .iter()
                .map(|message| message.text.as_str())
                .collect();
            ui.ctx().copy_text(lines.join("\n"));
        }
        if ui.small_button("Clear").clicked() {
            messages.all.clear();
            messages.seen = 0;
        }
    });
    let mut is_newest = true;
    for message in messages.all.iter().rev() {
        let mark = match message.severity {
            Severity::Note => "Note",
            Severity::Warning => "Warning",
            Severity::Error => "Error",
        };
        let color = severity_color(message.severity, ui.visuals());
        let shown = ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing.x = 6.0;
            ui.label(RichText::new(mark).color(color).small());
            // Selectable, so that a part of it can be copied.
            ui.add(egui::Label::new(&message.text).selectable(true).wrap());
        });
        if std::mem::take(&mut is_newest) && ui.is_rect_visible(shown.response.rect) {
            messages.seen = messages.all.len();
        }
    }
}
