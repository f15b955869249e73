//! The line at the bottom: what is going on, in figures, and the newest message.

use eframe::egui::{self, Color32, RichText};

use crate::viewer::{
    figures::{count, figure, seconds},
    messages::{Message, Severity},
    panel_state::Side,
    run::Change,
    run::RunStatus,
    state::State,
    theme,
};

/// Width that the newest message needs at least, in points; figures of the run give way to it. Narrower shows the
/// beginning of the sentence only.
const MESSAGE_WIDTH: f32 = 300.0;

/// Show the line.
pub fn status_ui(ui: &mut egui::Ui, state: &mut State) {
    ui.horizontal(|ui| {
        if let Some(loading) = &state.loading {
            ui.label(loading.progress().sentence(&loading.source().label()));
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
                "Step {}{}   ε {}   Links {}   Vertices {}   {}",
                report.step,
                report.estimated_error.map_or_else(String::new, |error| {
                    format!("   Error {}", error.text())
                }),
                figure(f64::from(report.epsilon)),
                count(report.links),
                count(report.vertices),
                seconds(report.elapsed_s),
            );
            if text_width(ui, &text) + MESSAGE_WIDTH < ui.available_width() {
                ui.label(RichText::new(text).weak());
            }
        }
        if let Some(sharpness) = &state.sharpness {
            let text = sharpness.label();
            if text_width(ui, &text) + MESSAGE_WIDTH < ui.available_width() {
                let why = "The traced picture of this view: samples of each pixel, and the noise that they leave";
                ui.weak(text).on_hover_text(why);
            }
        }
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            messages_ui(ui, state);
        });
    });
}

/// The newest message that was not seen yet, and how many warnings and errors wait behind it.
fn messages_ui(ui: &mut egui::Ui, state: &mut State) {
    let Some((newest, older)) = state.messages.unseen().split_last() else {
        // The panel of the run may be hidden, or scrolled away.
        match state.run.last_change.as_ref().and_then(Change::label) {
            Some(text) => {
                ui.weak(text);
            }
            None => hint_ui(ui),
        }
        return;
    };
    let mut is_clicked = false;
    if let Some((text, worst)) = waiting(older) {
        let text = RichText::new(text).color(severity_color(worst, ui.visuals()));
        let button = egui::Button::new(text).frame(false);
        is_clicked |= ui.add(button).on_hover_text("Show all messages").clicked();
        ui.separator();
    }
    let text = RichText::new(&newest.text).color(severity_color(newest.severity, ui.visuals()));
    let button = egui::Button::new(text).frame(false).truncate();
    let response = ui.add(button);
    is_clicked |= response
        .on_hover_text(format!("{}\n\nClick to show all messages", newest.text))
        .clicked();
    if is_clicked {
        state.panels.show_messages = true;
        state.panels.open_side(Side::Look);
        state.panels.shown = true;
    }
}

/// How many warnings and errors there are among messages, and how much the worst matters; `None` without any.
fn waiting(messages: &[Message]) -> Option<(String, Severity)> {
    let count_of = |severity: Severity| {
        let alike = messages
            .iter()
            .filter(|message| message.severity == severity);
        alike.count()
    };
    let named = |severity: Severity, one: &str, many: &str| match count_of(severity) {
        0 => None,
        1 => Some(format!("1 {one}")),
        number => Some(format!("{number} {many}")),
    };
    let errors = named(Severity::Error, "error", "errors");
    let warnings = named(Severity::Warning, "warning", "warnings");
    let worst = match &errors {
        Some(_) => Severity::Error,
        None => Severity::Warning,
    };
    let parts: Vec<String> = errors.into_iter().chain(warnings).collect();
    (!parts.is_empty()).then(|| (format!("+ {}", parts.join(", ")), worst))
}

/// The colour in which a message stands.
pub(super) fn severity_color(severity: Severity, visuals: &egui::Visuals) -> Color32 {
    match severity {
        Severity::Note => theme::good(visuals),
        Severity::Warning => theme::warning(visuals),
        Severity::Error => theme::bad(visuals),
    }
}

/// Hints on mouse and keys, as far as there is room for them.
fn hint_ui(ui: &mut egui::Ui) {
    const HINTS: [&str; 2] = [
        "Drag orbits, wheel zooms, click picks; B boxes, Ctrl+F12 picture, F1 all keys",
        "F1 shows all keys",
    ];
    for hint in HINTS {
        if text_width(ui, hint) < ui.available_width() {
            ui.weak(hint);
            return;
        }
    }
}

/// Width of a line of body text, in points.
fn text_width(ui: &egui::Ui, text: &str) -> f32 {
    let font = egui::TextStyle::Body.resolve(ui.style());
    let laid_out = ui
        .painter()
        .layout_no_wrap(text.to_owned(), font, Color32::GRAY);
    laid_out.size().x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::viewer::messages::Messages;

    #[test]
    fn warnings_and_errors_that_wait_are_counted() {
        let mut messages = Messages::default();
        assert_eq!(waiting(messages.unseen()), None);
        messages.push(Severity::Note, "a");
        assert_eq!(waiting(messages.unseen()), None);
        messages.push(Severity::Warning, "b");
        messages.push(Severity::Warning, "c");
        let told = |messages: &Messages| waiting(messages.unseen());
        assert_eq!(
            told(&messages),
            Some(("+ 2 warnings".to_owned(), Severity::Warning))
        );
        messages.push(Severity::Error, "d");
        assert_eq!(
            told(&messages),
            Some(("+ 1 error, 2 warnings".to_owned(), Severity::Error))
        );
    }
}
