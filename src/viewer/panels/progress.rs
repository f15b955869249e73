//! The run: where it stands, its figures, and the buttons to steer it.

use eframe::egui::{self, Button};

use super::row;
use crate::{
    solver::StepReport,
    viewer::{
        action::Action,
        figures::{bound, bytes, count, figure, seconds},
        run::Change,
        run::RunStatus,
        state::State,
        theme,
        wording::without_flags,
    },
};

/// Show the run; requested actions go into `actions`.
pub fn progress_ui(ui: &mut egui::Ui, state: &State, actions: &mut Vec<Action>) {
    let status = &state.run.status;
    let steps = state.settings.max_steps;
    let step = state.report().map_or(0, |report| report.step);
    let (share, text) = match &state.loading {
        Some(loading) => {
            let progress = loading.progress();
            (progress.share, progress.text())
        }
        None => (
            run_share(status, step, steps),
            run_text(status, step, steps),
        ),
    };
    ui.add(egui::ProgressBar::new(share).text(text).corner_radius(3.0));
    buttons_ui(ui, status, actions);
    if let RunStatus::Failed(message) = status {
        ui.colored_label(
            theme::bad(ui.visuals()),
            format!("The solver failed: {message}"),
        );
    }
    change_ui(ui, state);
    figures_ui(ui, state);
}

/// The part of a run's steps that is done, 0…1.
fn run_share(status: &RunStatus, step: u32, steps: u32) -> f32 {
    match status {
        RunStatus::Finished(_) => 1.0,
        _ => step as f32 / steps.max(step + 1) as f32,
    }
}

/// Where a run stands.
fn run_text(status: &RunStatus, step: u32, steps: u32) -> String {
    match status {
        RunStatus::Running => format!("Computing {}", place(step + 1, steps)),
        RunStatus::Paused => format!("Paused after {}", place(step, steps)),
        _ => status.label(),
    }
}

/// The effect of the last change of settings. Its room is always there, so that no slider moves away from the hand.
fn change_ui(ui: &mut egui::Ui, state: &State) {
    if state.loaded.is_none() {
        return;
    }
    let room = egui::vec2(
        ui.available_width(),
        2.0 * ui.text_style_height(&egui::TextStyle::Body),
    );
    let (rect, _) = ui.allocate_exact_size(room, egui::Sense::hover());
    if let Some(text) = state.run.last_change.as_ref().and_then(Change::label) {
        // Beside the layout: a line that is a little higher moves nothing either.
        ui.new_child(egui::UiBuilder::new().max_rect(rect))
            .label(text);
    }
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
                "Pause; Continue resumes from there (Space)",
                Action::PauseContinue,
            );
        } else {
            let explanation = "Resume from where the run stands (Space)";
            button(
                "Continue",
                status.can_continue(),
                explanation,
                Action::PauseContinue,
            );
        }
        button(
            "Stop",
            status.can_stop(),
            "End the run and finish the light that there is; once more to end at once (Esc)",
            Action::Stop,
        );
        button(
            "Restart",
            *status != RunStatus::Idle,
            "Start the run from the beginning (Ctrl+R)",
            Action::Reset,
        );
    });
}

/// The figures of the last step. Before the first, rows stand there without values, so that nothing below moves.
fn figures_ui(ui: &mut egui::Ui, state: &State) {
    if state.loaded.is_none() {
        return;
    }
    let report = state.report();
    row::figures(ui, "progress", |ui| {
        let mut row = |name: &str, value: &dyn Fn(&StepReport) -> String, explanation: &str| {
            let value = report.map_or_else(|| "–".to_owned(), value);
            row::figure(ui, name, value, explanation);
        };
        row(
            "Estimated error",
            &|report| match report.estimated_error {
                Some(error) => error.text(),
                None => "–".to_owned(),
            },
            "Relative root mean square error of the light shown, without the worst 1 % of the points, and its 95 % \
             interval: the light is gathered once more by rays at random points, and compared",
        );
        row(
            "Time",
            &|report| seconds(report.elapsed_s),
            "Since the run began, without pauses",
        );
        row(
            "Threshold ε",
            &|report| figure(f64::from(report.epsilon)),
            "Of the last step",
        );
        row(
            "Transported",
            &|report| transported(report).map_or_else(|| "–".to_owned(), share_text),
            "Estimated part of the light that has been transported over the links of the last step. The rest, residual / \
             (1 − contraction), is still on its way between surfaces. Finer links change the light, too: that is in the \
             estimated error",
        );
        row(
            "Residual",
            &|report| figure(f64::from(report.residual)),
            "Change of the light by the last iteration, relative to the total power",
        );
        row(
            "Energy balance",
            &|report| format!("{:.2} %", 100.0 * report.energy_balance),
            "Light that arrived, of the light that left; 100 % in a closed scene",
        );
        row(
            "Error bound",
            &|report| bound(f64::from(report.error_bound)),
            "Worst case over the intervals of all links, relative to the mean irradiance. The real error is far below: \
             see 'Estimated error'",
        );
        row(
            "Links",
            &|report| count(report.links),
            "Pairs of nodes that exchange light",
        );
        row(
            "Shadow rays",
            &|report| count(report.shadow_rays),
            "Shot so far",
        );
        row(
            "Memory",
            &|report| bytes(report.memory_bytes),
            "Held by the solver",
        );
    });
    for note in report.into_iter().flat_map(|report| &report.notes) {
        ui.colored_label(
            theme::warning(ui.visuals()),
            without_flags(&note.to_string()),
        );
    }
}

/// Where a step stands. Light that is refined after its last step has further steps, counted on.
fn place(step: u32, steps: u32) -> String {
    if step > steps {
        format!("step {step}, refining further")
    } else {
        format!("step {step} of {steps}")
    }
}

/// Estimated part of the light that has been distributed over the links of a step. Each further sweep changes the light
/// by at most the contraction times what the one before did, so that all of them together, the last one's residual
/// among them, change residual / (1 − contraction). `None` where the light does not converge.
fn transported(report: &StepReport) -> Option<f64> {
    let rest = f64::from(report.residual) / (1.0 - f64::from(report.contraction));
    (report.contraction < 1.0 && rest.is_finite()).then(|| (1.0 - rest).max(0.0))
}

/// A share as per cent. Rounded down: all of it is only what is all of it.
fn share_text(share: f64) -> String {
    format!("{:.2} %", (share * 1e4).floor() / 100.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(residual: f32, contraction: f32) -> StepReport {
        StepReport {
            residual,
            contraction,
            ..StepReport::default()
        }
    }

    #[test]
    fn what_is_on_its_way_is_a_geometric_series() {
        // In a furnace of reflectance 0.5 each sweep moves half of what the one before moved. After ten sweeps the next
        // moves 0.5¹¹ of all light, and all from there on 0.5¹⁰.
        let light = |sweeps: i32| 1.0 - 0.5_f64.powi(sweeps);
        let residual = light(11) - light(10);
        let share = transported(&report(residual as f32, 0.5)).expect("it converges");
        assert!((share - light(10)).abs() < 1e-9, "{share}");
        assert_eq!(transported(&report(0.0, 0.0)), Some(1.0));
        assert_eq!(transported(&report(0.6, 0.9)), Some(0.0));
        assert_eq!(transported(&report(0.1, 1.0)), None);
    }

    #[test]
    fn steps_are_counted_on_when_light_is_refined_after_the_last() {
        assert_eq!(place(5, 5), "step 5 of 5");
        assert_eq!(place(8, 5), "step 8, refining further");
    }

    #[test]
    fn nearly_all_is_not_all() {
        assert_eq!(share_text(0.999_99), "99.99 %");
        assert_eq!(share_text(1.0), "100.00 %");
        assert_eq!(share_text(0.5), "50.00 %");
    }
}
