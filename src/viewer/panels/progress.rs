//! The run: where it stands, its figures, and the buttons to steer it.

use eframe::egui::{self, Button};

use super::{bytes, count, figure, row, seconds};
use crate::viewer::{
    action::Action,
    state::{RunStatus, State},
    theme,
};

/// Show the run; wishes go into `actions`.
pub fn progress_ui(ui: &mut egui::Ui, state: &State, actions: &mut Vec<Action>) {
    let status = &state.run.status;
    let steps = state.settings.max_steps.max(1);
    let step = state.report().map_or(0, |report| report.step);
    let share = match status {
        RunStatus::Finished(_) => 1.0,
        _ => step as f32 / steps as f32,
    };
    let text = match status {
        RunStatus::Running => format!("Computing step {} of {steps}", (step + 1).min(steps)),
        RunStatus::Paused => format!("Paused after step {step} of {steps}"),
        _ => status.label(),
    };
    ui.add(egui::ProgressBar::new(share).text(text).corner_radius(3.0));
    buttons_ui(ui, status, actions);
    if let RunStatus::Failed(message) = status {
        ui.colored_label(theme::BAD, format!("The solver failed: {message}"));
    }
    figures_ui(ui, state);
}

fn buttons_ui(ui: &mut egui::Ui, status: &RunStatus, actions: &mut Vec<Action>) {
    ui.horizontal(|ui| {
        let width = (ui.available_width() - 2.0 * ui.spacing().item_spacing.x) / 3.0;
        let mut button = |text: &str, is_on: bool, explanation: &str, action: Action| {
            let button = Button::new(text).min_size(egui::vec2(width, 24.0));
            if ui
                .add_enabled(is_on, button)
                .on_hover_text(explanation)
                .clicked()
            {
                actions.push(action);
            }
        };
        if status.is_busy() {
            button(
                "Pause",
                true,
                "Rest; Continue goes on from there (Space)",
                Action::PauseContinue,
            );
        } else {
            let explanation = "Go on from where it stands (Space)";
            button(
                "Continue",
                status.can_continue(),
                explanation,
                Action::PauseContinue,
            );
        }
        let can_stop = status.is_busy() || matches!(status, RunStatus::Pausing | RunStatus::Paused);
        button(
            "Stop",
            can_stop,
            "End the run and keep its light (Esc)",
            Action::Stop,
        );
        button(
            "Reset",
            *status != RunStatus::Idle,
            "Begin the light again (Ctrl+R)",
            Action::Reset,
        );
    });
}

fn figures_ui(ui: &mut egui::Ui, state: &State) {
    let Some(report) = state.report() else { return };
    row::figures(ui, "progress", |ui| {
        row::figure(
            ui,
            "Time",
            seconds(report.elapsed_s),
            "Since the run began, without pauses",
        );
        row::figure(
            ui,
            "Threshold ε",
            figure(f64::from(report.epsilon)),
            "Of the last step",
        );
        row::figure(
            ui,
            "Residual",
            figure(f64::from(report.residual)),
            "Change of the last sweep, relative to the total power",
        );
        row::figure(
            ui,
            "Energy balance",
            format!("{:.2} %", 100.0 * report.energy_balance),
            "Light that arrived, of the light that left; 100 % in a closed scene",
        );
        row::figure(
            ui,
            "Error bound",
            format!("{} %", figure(f64::from(100.0 * report.estimated_error))),
            "Sum of the intervals of all links, relative to the mean irradiance; far above the real error",
        );
        row::figure(
            ui,
            "Links",
            count(report.links),
            "Pairs of nodes that exchange light",
        );
        row::figure(ui, "Shadow rays", count(report.shadow_rays), "Shot so far");
        row::figure(
            ui,
            "Memory",
            bytes(report.memory_bytes),
            "Held by the solver",
        );
    });
    for note in &report.notes {
        ui.colored_label(theme::WARNING, note);
    }
}
