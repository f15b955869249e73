//! The key sheet, made from the table that the window obeys.

use eframe::egui::{self, RichText};

use crate::viewer::{
    bindings::{Binding, FOCUS, Group, MOUSE},
    state::State,
};

/// Show the sheet where it is open.
pub fn help_window(ctx: &egui::Context, state: &mut State, table: &[Binding]) {
    egui::Window::new("Keys and mouse")
        .open(&mut state.panels.help)
        .collapsible(false)
        .resizable(false)
        .anchor(egui::Align2::CENTER_CENTER, [0.0, 0.0])
        .show(ctx, |ui| {
            let height = (ctx.content_rect().height() - 120.0).max(120.0);
            egui::ScrollArea::vertical()
                .max_height(height)
                .min_scrolled_height(height)
                .show(ui, |ui| {
                    egui::Frame::new()
                        .inner_margin(egui::Margin::symmetric(12, 4))
                        .show(ui, |ui| sheet_ui(ui, table));
                });
        });
}

/// Width of a window that has room for two columns, in points. In a narrower one their texts would be cut off.
const TWO_COLUMNS: f32 = 940.0;

fn sheet_ui(ui: &mut egui::Ui, table: &[Binding]) {
    let left = |ui: &mut egui::Ui| {
        rows(ui, "Mouse", fixed_rows(&MOUSE));
        group_ui(ui, table, Group::Solve);
        group_ui(ui, table, Group::File);
        rows(ui, "Controls", fixed_rows(&FOCUS));
    };
    let right = |ui: &mut egui::Ui| {
        group_ui(ui, table, Group::Camera);
        group_ui(ui, table, Group::View);
    };
    if ui.ctx().content_rect().width() < TWO_COLUMNS {
        left(ui);
        right(ui);
        return;
    }
    ui.horizontal_top(|ui| {
        ui.vertical(left);
        ui.add_space(20.0);
        ui.vertical(right);
    });
}

fn fixed_rows<'t>(entries: &'t [(&'t str, &'t str)]) -> impl Iterator<Item = (String, &'t str)> {
    entries
        .iter()
        .map(|(keys, text)| ((*keys).to_owned(), *text))
}

fn group_ui(ui: &mut egui::Ui, table: &[Binding], group: Group) {
    // Keys that do the same stand in one row.
    let mut entries: Vec<(String, &str)> = Vec::new();
    for binding in table.iter().filter(|binding| binding.group == group) {
        match entries.last_mut() {
            Some((keys, text)) if *text == binding.text => {
                keys.push_str(", ");
                keys.push_str(&binding.keys());
            }
            _ => entries.push((binding.keys(), binding.text)),
        }
    }
    rows(ui, group.label(), entries.into_iter());
}

fn rows<'t>(ui: &mut egui::Ui, title: &str, entries: impl Iterator<Item = (String, &'t str)>) {
    ui.label(RichText::new(title).strong());
    egui::Grid::new(("keys", title))
        .num_columns(2)
        .spacing([16.0, 3.0])
        .show(ui, |ui| {
            for (keys, text) in entries {
                ui.label(RichText::new(keys).monospace());
                ui.label(text);
                ui.end_row();
            }
        });
    ui.add_space(8.0);
}
