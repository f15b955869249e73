//! The measured error: the reference being traced, each step beside its bound, and error against run time.

use eframe::egui::{self, Color32, RichText};
use egui_plot::{Legend, Line, Plot, PlotPoints};

use super::{plot, row};
use crate::{
    metrics::{ErrorMeasures, smallest_error},
    solver::StepReport,
    viewer::{
        action::Action,
        figures::{bound, count, figure, seconds},
        state::State,
        theme,
        truth::{RunRecord, Truth},
        view::ViewMode,
    },
};

/// Smallest error on the logarithmic axis, in per cent, where not even noise of the reference hides it.
const FLOOR_PERCENT: f64 = 0.01;

/// Show the reference and what was measured by it; requested actions go into `actions`.
pub fn error_ui(ui: &mut egui::Ui, state: &State, actions: &mut Vec<Action>) {
    let truth = &state.truth;
    reference_ui(ui, state, actions);
    if let Some(message) = &truth.progress.failed {
        ui.colored_label(
            theme::bad(ui.visuals()),
            format!("The reference failed: {message}"),
        );
    }
    if !truth.exists() {
        ui.weak("Path tracing at random surface points, to measure the light by.");
        return;
    }
    figures_ui(ui, truth);
    if truth.newest_error().is_some() {
        steps_ui(ui, truth);
    }
    plot_ui(ui, truth, actions);
}

/// The button, and how far tracing is.
fn reference_ui(ui: &mut egui::Ui, state: &State, actions: &mut Vec<Action>) {
    let truth = &state.truth;
    let progress = &truth.progress;
    let text = match (truth.exists(), truth.is_tracing(), truth.is_done()) {
        (false, ..) => "Trace reference",
        (true, true, _) => "Pause tracing",
        (true, false, false) => "Continue tracing",
        (true, false, true) => "Trace more",
    };
    ui.horizontal(|ui| {
        let button = egui::Button::new(text).min_size(egui::vec2(120.0, 24.0));
        let explanation = "Path-trace the truth in the background (R). While light is computed it takes one thread, \
                           which slows the run; restart when it is done for times without it.";
        if ui
            .add_enabled(state.loaded.is_some(), button)
            .on_hover_text(explanation)
            .clicked()
        {
            actions.push(Action::TraceReference);
        }
        if truth.exists() {
            let share = progress.samples as f32 / progress.goal.max(1) as f32;
            let text = format!(
                "{} of {} samples",
                count(u64::from(progress.samples)),
                count(u64::from(progress.goal))
            );
            ui.add(egui::ProgressBar::new(share).text(text).corner_radius(3.0));
        }
    });
    if state.view.mode == ViewMode::Error && truth.exists() {
        let (samples, share) = progress.vertex_samples;
        let percent = (100.0 * share).round();
        ui.weak(format!(
            "At each vertex: {samples} samples, {percent} % of the next 8"
        ));
    }
}

fn figures_ui(ui: &mut egui::Ui, truth: &Truth) {
    let Some((step, report, error)) = truth.newest_error() else {
        ui.weak("The first error shows when both the light and the reference are there.");
        return;
    };
    ui.weak(format!(
        "Errors are means over {}.",
        truth.progress.surfaces
    ));
    row::figures(ui, "error", |ui| {
        row::figure(
            ui,
            "Relative RMS",
            measured(error.relative_rms, error),
            &format!(
                "Root mean square difference of radiance after step {step}, relative to the reference's, at {} random \
                 surface points, without the reference's noise",
                count(error.points as u64)
            ),
        );
        row::figure(
            ui,
            "Trimmed",
            measured(error.relative_rms_trimmed, error),
            "The same without the worst 1 % of the points",
        );
        row::figure(
            ui,
            "Energy ratio",
            error
                .energy_ratio
                .map_or_else(|| "–".to_owned(), |ratio| format!("{ratio:.4}")),
            "Mean radiance over the reference's; 1 is right",
        );
        row::figure(
            ui,
            "Reference noise",
            percent(error.noise_floor),
            "Standard error of the reference; errors far below it cannot be told from none",
        );
        row::figure(
            ui,
            "Error bound",
            bound(f64::from(report.error_bound)),
            "What the solver guarantees by itself, of the irradiance; the same as under 'Progress'",
        );
    });
}

/// The steps of the present run, the newest last.
fn steps_ui(ui: &mut egui::Ui, truth: &Truth) {
    let Some(run) = truth.runs.last() else { return };
    ui.add_space(4.0);
    egui::Grid::new("measured steps")
        .num_columns(5)
        .spacing([10.0, 2.0])
        .show(ui, |ui| {
            let heading = |ui: &mut egui::Ui, text: &str, explanation: &str| {
                let text = RichText::new(text).color(theme::secondary_text(ui.visuals()));
                ui.label(text).on_hover_text(explanation);
            };
            heading(ui, "Step", "Steps shown while the reference was there");
            heading(ui, "Time", "Since the run began");
            heading(ui, "Error bound", "What the solver guarantees by itself");
            heading(ui, "RMS", "Measured, relative");
            heading(ui, "Trimmed", "Without the worst 1 % of the points");
            ui.end_row();
            for (step, report, error) in truth.steps_of(run) {
                ui.label(step.to_string());
                ui.label(seconds(report.elapsed_s));
                ui.label(bound(f64::from(report.error_bound)));
                ui.label(measured(error.relative_rms, error));
                ui.label(measured(error.relative_rms_trimmed, error));
                ui.end_row();
            }
        });
}

/// Error against run time, one line a run.
fn plot_ui(ui: &mut egui::Ui, truth: &Truth, actions: &mut Vec<Action>) {
    let has_points = |run: &RunRecord| truth.steps_of(run).next().is_some();
    let shown: Vec<&RunRecord> = truth.runs.iter().filter(|run| has_points(run)).collect();
    if shown.is_empty() {
        return;
    }
    ui.add_space(4.0);
    ui.label("Trimmed RMS against run time").on_hover_text(
        "On a logarithmic scale; errors below the noise stand at the smallest that can be told",
    );
    ui.horizontal(|ui| {
        let save = egui::Button::new("Save CSV…").small();
        if ui
            .add(save)
            .on_hover_text("All measured steps of all runs as a table")
            .clicked()
        {
            actions.push(Action::TableDialog);
        }
        let clear = egui::Button::new("Forget earlier runs").small();
        if ui
            .add_enabled(truth.runs.len() > 1, clear)
            .on_hover_text("Clear the plot but for the present run")
            .clicked()
        {
            actions.push(Action::ForgetRuns);
        }
    });
    let present = truth.runs.last().map(|run| run.number);
    Plot::new("error against time")
        .height(180.0)
        .legend(Legend::default().position(egui_plot::Corner::RightTop))
        .allow_scroll(false)
        .allow_zoom(false)
        .allow_drag(false)
        .custom_x_axes(vec![plot::time_axis()])
        .custom_y_axes(vec![plot::decade_axis(|exponent| {
            format!("{} %", 10_f64.powi(exponent))
        })])
        .x_grid_spacer(plot::time_spacer())
        .y_grid_spacer(plot::decade_spacer())
        .include_y(0.0)
        .include_y(2.0)
        .include_x(0.0)
        .show(ui, |plot| {
            for run in shown {
                let is_present = Some(run.number) == present;
                let points: Vec<[f64; 2]> = truth
                    .steps_of(run)
                    .map(|(_, report, error)| point(report, error))
                    .collect();
                let color = run_color(run.ordinal);
                plot.points(
                    egui_plot::Points::new(run.name.clone(), points.clone())
                        .radius(if is_present { 3.5 } else { 2.0 })
                        .color(color),
                );
                plot.line(
                    Line::new(run.name.clone(), PlotPoints::from(points))
                        .width(if is_present { 2.5 } else { 1.2 })
                        .color(color),
                );
            }
        });
}

/// A step in the plot. An error below the noise stands at the smallest one that can be told.
fn point(report: &StepReport, error: &ErrorMeasures) -> [f64; 2] {
    let told = error
        .relative_rms_trimmed
        .max(smallest_error(error.noise_floor));
    [report.elapsed_s, (100.0 * told).max(FLOOR_PERCENT).log10()]
}

/// A measured relative error, where the noise of the reference leaves one to be told.
fn measured(relative: f64, error: &ErrorMeasures) -> String {
    if relative < smallest_error(error.noise_floor) {
        "below noise".to_owned()
    } else {
        percent(relative)
    }
}

/// Colours that tell neighbours apart, in turn.
fn run_color(ordinal: u32) -> Color32 {
    const TURN: f32 = 0.618_034;
    egui::ecolor::Hsva::new((ordinal as f32 * TURN + 0.02).fract(), 0.65, 0.9, 1.0).into()
}

fn percent(share: f64) -> String {
    format!("{} %", figure(100.0 * share))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_below_the_noise_are_not_told_as_none() {
        let error = ErrorMeasures {
            noise_floor: 0.1,
            ..ErrorMeasures::default()
        };
        assert_eq!(measured(0.0, &error), "below noise");
        assert_eq!(measured(0.01, &error), "below noise");
        assert_eq!(measured(0.2, &error), "20.0 %");
        let [_, height] = point(&StepReport::default(), &error);
        assert!(
            (0.0..2.0).contains(&height),
            "within the decades of the noise: {height}"
        );
        // A reference without noise tells everything.
        assert_eq!(measured(0.0, &ErrorMeasures::default()), "0 %");
    }
}
