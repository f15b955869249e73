//! Messages: warnings of the loader, errors, and what was saved where.

use eframe::egui::{self, RichText};

use crate::viewer::{
    state::{Severity, State},
    theme,
};

/// Show all messages, the newest first; they are then seen.
pub fn messages_ui(ui: &mut egui::Ui, state: &mut State) {
    let messages = &mut state.messages;
    messages.seen = messages.all.len();
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
    for message in messages.all.iter().rev() {
        let (mark, color) = match message.severity {
            Severity::Note => ("Note", theme::good(ui.visuals())),
            Severity::Warning => ("Warning", theme::warning(ui.visuals())),
            Severity::Error => ("Error", theme::bad(ui.visuals())),
        };
        ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing.x = 6.0;
            ui.label(RichText::new(mark).color(color).small());
            // Selectable, so that a part of it can be copied.
            ui.add(egui::Label::new(&message.text).selectable(true).wrap());
        });
    }
}
