//! The line at the bottom: what is going on, in figures, and whether there is something to read.

use eframe::egui::{self, RichText};

use super::{count, figure, seconds};
use crate::viewer::{
    change::Change,
    state::{Message, RunStatus, Severity, State},
    theme,
};

/// Show the line.
pub fn status_ui(ui: &mut egui::Ui, state: &mut State) {
    ui.horizontal(|ui| {
        if let Some(loading) = &state.loading {
            // No spinner: turning it would take the processor from the reading.
            ui.label(format!("Reading {}", loading.source().label()));
        }
        let color = match &state.run.status {
            RunStatus::Failed(_) => theme::bad(ui.visuals()),
            RunStatus::Finished(_) => theme::good(ui.visuals()),
            RunStatus::Pausing | RunStatus::Paused => theme::warning(ui.visuals()),
            _ => ui.visuals().text_color(),
        };
        // There is a scene, it is only not there yet.
        if state.loading.is_none() || state.run.status != RunStatus::Idle {
            ui.colored_label(color, state.run.status.label());
        }
        if let Some(report) = state.report() {
            let text = format!(
                "Step {}   ε {}   Links {}   Vertices {}   {}",
                report.step,
                figure(f64::from(report.epsilon)),
                count(report.links),
                count(report.vertices),
                seconds(report.elapsed_s),
            );
            ui.label(RichText::new(text).weak());
        }
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            messages_button(ui, state);
        });
    });
}

fn messages_button(ui: &mut egui::Ui, state: &mut State) {
    let unseen = state.messages.unseen();
    // The worst comes first, the newest of them.
    let rank = |message: &&Message| match message.severity {
        Severity::Note => 0,
        Severity::Warning => 1,
        Severity::Error => 2,
    };
    let Some(worst) = unseen.iter().max_by_key(rank) else {
        // The panel of the run may be hidden, or scrolled away.
        match state.run.last_change.as_ref().and_then(Change::label) {
            Some(text) => {
                ui.weak(text);
            }
            None => hint_ui(ui),
        }
        return;
    };
    let color = match worst.severity {
        Severity::Note => theme::good(ui.visuals()),
        Severity::Warning => theme::warning(ui.visuals()),
        Severity::Error => theme::bad(ui.visuals()),
    };
    let mut text = worst.text.clone();
    if text.chars().count() > 90 {
        text = text.chars().take(90).chain(['…']).collect();
    }
    if unseen.len() > 1 {
        text = format!("{text}  (+{})", unseen.len() - 1);
    }
    let button = egui::Button::new(RichText::new(text).color(color)).frame(false);
    if ui.add(button).on_hover_text("Show all messages").clicked() {
        state.panels.show_messages = true;
        state.panels.look = true;
        state.panels.shown = true;
    }
}

/// What to do with mouse and keys, as far as there is room for it.
fn hint_ui(ui: &mut egui::Ui) {
    const HINTS: [&str; 2] = [
        "Drag orbits, wheel zooms, click picks; B boxes, Ctrl+F12 picture, F1 all keys",
        "F1 shows all keys",
    ];
    let font = egui::TextStyle::Body.resolve(ui.style());
    for hint in HINTS {
        let width = |painter: &egui::Painter| {
            let text = painter.layout_no_wrap(hint.to_owned(), font.clone(), egui::Color32::GRAY);
            text.size().x
        };
        if width(ui.painter()) < ui.available_width() {
            ui.weak(hint);
            return;
        }
    }
}
