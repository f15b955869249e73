//! Residual and estimated error against run time.

use eframe::egui;
use egui_plot::{Legend, Line, Plot, PlotPoints};

use super::figure;
use crate::viewer::{state::State, theme};

/// Smallest value on the logarithmic axis.
const FLOOR: f64 = 1e-9;

/// Show the plot, once there are two points.
pub fn plot_ui(ui: &mut egui::Ui, state: &State) {
    let reports = &state.run.reports;
    if reports.len() < 2 {
        ui.weak("The plot begins with the second step.");
        return;
    }
    let line = |name: &str, of: fn(&crate::solver::StepReport) -> f32| {
        let points: PlotPoints<'_> = reports
            .iter()
            .map(|report| [report.elapsed_s, f64::from(of(report)).max(FLOOR).log10()])
            .collect();
        Line::new(name, points).width(2.0)
    };
    Plot::new("residual")
        .height(150.0)
        .legend(Legend::default().position(egui_plot::Corner::RightTop))
        .allow_scroll(false)
        .allow_zoom(false)
        .allow_drag(false)
        .show_axes([true, true])
        .x_axis_formatter(|mark, _| run_time(mark.value))
        .y_axis_formatter(|mark, _| {
            let whole = (mark.value - mark.value.round()).abs() < 1e-6;
            if whole {
                figure(10_f64.powf(mark.value))
            } else {
                String::new()
            }
        })
        .y_grid_spacer(egui_plot::uniform_grid_spacer(|_| [1.0, 1.0, 1.0]))
        .show(ui, |plot| {
            plot.line(line("Residual", |report| report.residual).color(theme::axis_color(2)));
            plot.line(line("Error bound", |report| report.estimated_error).color(theme::SELECTED));
        });
}

/// A mark on an axis of run time. Marks are round numbers but for their rounding.
pub(super) fn run_time(seconds: f64) -> String {
    format!("{} s", (1000.0 * seconds).round() / 1000.0)
}
