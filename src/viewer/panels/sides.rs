//! The panels on the two sides: which sections, in which order.

use eframe::egui;

use super::{
    clusters, emission, error, links, materials, messages, plot, probe, progress, row, settings,
    statistics,
};
use crate::viewer::{action::Action, state::State};

/// Show the light's panel on the left and the look's on the right; wishes go into `actions`.
pub fn side_panels(ui: &mut egui::Ui, state: &mut State, actions: &mut Vec<Action>) {
    if state.panels.light {
        light_panel(ui, state, actions);
    }
    if state.panels.look {
        look_panel(ui, state, actions);
    }
}

/// The run and its settings.
fn light_panel(ui: &mut egui::Ui, state: &mut State, actions: &mut Vec<Action>) {
    egui::Panel::left("light")
        .resizable(true)
        .default_size(320.0)
        .size_range(290.0..=480.0)
        .show(ui, |ui| {
            egui::ScrollArea::vertical()
                .auto_shrink(false)
                .show(ui, |ui| {
                    ui.add_space(4.0);
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
                        row::section(ui, "Lights and materials", state.has_emitters(), |ui| {
                            materials::materials_ui(ui, state, actions);
                        });
                    }
                });
        });
}

/// What is looked into.
fn look_panel(ui: &mut egui::Ui, state: &mut State, actions: &mut Vec<Action>) {
    egui::Panel::right("look")
        .resizable(true)
        .default_size(300.0)
        .size_range(250.0..=520.0)
        .show(ui, |ui| {
            egui::ScrollArea::vertical()
                .auto_shrink(false)
                .show(ui, |ui| {
                    ui.add_space(4.0);
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
                });
        });
}

/// The messages; they open by themselves when asked for.
fn messages_section(ui: &mut egui::Ui, state: &mut State) {
    let open = std::mem::take(&mut state.panels.show_messages).then_some(true);
    egui::CollapsingHeader::new(egui::RichText::new("Messages").strong())
        .id_salt("Messages")
        .open(open)
        .show_unindented(ui, |ui| messages::messages_ui(ui, state));
}
