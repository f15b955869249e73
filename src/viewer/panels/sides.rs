//! The panels on the two sides: which sections, in which order.

use eframe::egui;

use super::{
    clusters, emission, error, links, materials, messages, plot, probe, progress, row, settings,
    statistics,
};
use crate::viewer::{action::Action, focus, panel_state::Side, state::State};

/// Show the open panels that there is room for; requested actions go into `actions`.
pub fn side_panels(ui: &mut egui::Ui, state: &mut State, actions: &mut Vec<Action>) {
    let window_width = ui.ctx().content_rect().width();
    let shown = state.panels.shown_sides(window_width);
    let mut room = Side::room(window_width);
    for (index, &side) in shown.iter().enumerate() {
        // The one that comes after keeps its least width.
        let kept: f32 = shown[index + 1..]
            .iter()
            .map(|side| side.width_range().min)
            .sum();
        room -= side_panel(ui, side, room - kept, |ui| match side {
            Side::Light => light_sections(ui, state, actions),
            Side::Look => look_sections(ui, state, actions),
        });
    }
}

/// One panel that is at most `most` points wide; returns its width.
fn side_panel(ui: &mut egui::Ui, side: Side, most: f32, add: impl FnOnce(&mut egui::Ui)) -> f32 {
    let needed = side.width_range();
    let range = egui::Rangef::new(needed.min.min(most), needed.max.min(most));
    let panel = match side {
        Side::Light => egui::Panel::left("light").default_size(320.0),
        Side::Look => egui::Panel::right("look").default_size(300.0),
    };
    let shown = panel.resizable(true).size_range(range).show(ui, |ui| {
        // Where not even the least width is to be had, as under large text, what is cut off is scrolled to.
        let is_cut = range.min < needed.min;
        let inner = ui.available_width();
        egui::ScrollArea::new([is_cut, true])
            .auto_shrink(false)
            .show(ui, |ui| {
                if is_cut {
                    ui.set_max_width(inner.max(inner - most + needed.min));
                }
                ui.add_space(4.0);
                add(ui);
                focus::keep_in_view(ui);
            });
    });
    shown.response.rect.width()
}

/// The run and its settings.
fn light_sections(ui: &mut egui::Ui, state: &mut State, actions: &mut Vec<Action>) {
    row::section(ui, "Progress", true, |ui| {
        progress::progress_ui(ui, state, actions);
    });
    row::section(ui, "Settings", true, |ui| {
        settings::settings_ui(ui, state, actions);
        if state.has_emitters() {
            emission::emission_ui(ui, state, actions);
        }
    });
    if state.loaded.is_some() {
        row::section(ui, "Lights and materials", true, |ui| {
            materials::materials_ui(ui, state, actions);
        });
    }
}

/// Inspection of the method.
fn look_sections(ui: &mut egui::Ui, state: &mut State, actions: &mut Vec<Action>) {
    row::section(ui, "Probe", true, |ui| {
        probe::probe_ui(ui, state, actions);
    });
    row::section(ui, "Clusters", true, |ui| {
        clusters::clusters_ui(ui, state, actions);
    });
    row::section(ui, "Links", true, |ui| {
        links::links_ui(ui, state);
    });
    row::section(ui, "Convergence", true, |ui| {
        plot::plot_ui(ui, state);
    });
    row::section(ui, "Measured error", true, |ui| {
        error::error_ui(ui, state, actions);
    });
    row::section(ui, "Statistics", false, |ui| {
        statistics::statistics_ui(ui, state);
    });
    messages_section(ui, state);
}

/// The messages; where they are asked for, they open and come into view.
fn messages_section(ui: &mut egui::Ui, state: &mut State) {
    let is_asked = std::mem::take(&mut state.panels.show_messages);
    let section = egui::CollapsingHeader::new(egui::RichText::new("Messages").strong())
        .id_salt("Messages")
        .open(is_asked.then_some(true))
        .show_unindented(ui, |ui| messages::messages_ui(ui, state));
    if is_asked {
        section.header_response.scroll_to_me(Some(egui::Align::TOP));
    }
}
