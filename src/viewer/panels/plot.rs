//! Estimated error, with its interval, and residual against run time.

use eframe::egui;
use egui_plot::{AxisHints, GridInput, GridMark, Line, Plot, PlotPoints};

use super::legend::round_step;
use crate::{
    solver::StepReport,
    viewer::{figures::count, state::State, theme},
};

/// Smallest value on the logarithmic axis.
const FLOOR: f64 = 1e-9;

/// Marks on an axis of time at most. More, and their labels touch each other in a narrow panel.
const MOST_TIMES: f64 = 5.0;

/// Marks on an axis of decades at most, for the same reason.
const MOST_DECADES: f64 = 7.0;

/// Show the plot, once there are two points.
pub fn plot_ui(ui: &mut egui::Ui, state: &State) {
    let reports = &state.run.reports;
    if reports.len() < 2 {
        ui.weak("The plot begins with the second step.");
        return;
    }
    /// A line: its name, colour, width, and value in a step, where there is one.
    type Curve = (
        &'static str,
        egui::Color32,
        f32,
        fn(&StepReport) -> Option<f64>,
    );
    let estimated = theme::SELECTED;
    let interval = estimated.gamma_multiply(0.5);
    let curves: [Curve; 4] = [
        ("Estimated error", estimated, 2.0, |report| {
            report.estimated_error.map(|error| error.trimmed_rms)
        }),
        ("its interval", interval, 1.0, |report| {
            report.estimated_error.map(|error| error.trimmed_high)
        }),
        ("", interval, 1.0, |report| {
            report.estimated_error.map(|error| error.trimmed_low)
        }),
        ("Residual", theme::axis_color(2), 2.0, |report| {
            Some(f64::from(report.residual))
        }),
    ];
    let height = |value: f64| value.max(FLOOR).log10();
    let heights = reports
        .iter()
        .flat_map(|report| curves.map(|(.., of)| of(report)))
        .flatten()
        .filter(|value| *value > 0.0)
        .map(height);
    // Whole decades, so that there are marks however little the lines move.
    let (low, high) = heights.fold((f64::MAX, f64::MIN), |(low, high), at| {
        (low.min(at.floor()), high.max(at.ceil()))
    });
    if low > high {
        ui.weak("There is no light, and so no error to plot.");
        return;
    }
    // Above the plot: within it they would hide the lines.
    ui.horizontal_wrapped(|ui| {
        for (name, color, ..) in curves.iter().filter(|(name, ..)| !name.is_empty()) {
            ui.colored_label(*color, "—");
            ui.label(*name);
        }
        ui.weak("relative");
    });
    Plot::new("residual")
        .include_y(low)
        .include_y(high)
        .height(160.0)
        .allow_scroll(false)
        .allow_zoom(false)
        .allow_drag(false)
        .show_axes([true, true])
        .custom_x_axes(vec![time_axis()])
        .custom_y_axes(vec![decade_axis(power_of_ten)])
        .x_grid_spacer(time_spacer())
        .y_grid_spacer(decade_spacer())
        .show(ui, |plot| {
            for (name, color, width, of) in curves {
                // An interval that reaches 0 has no lower end on this axis.
                let points: PlotPoints<'_> = reports
                    .iter()
                    .filter_map(|report| Some((report, of(report).filter(|value| *value > 0.0)?)))
                    .map(|(report, value)| [report.elapsed_s, height(value)])
                    .collect();
                plot.line(Line::new(name, points).width(width).color(color));
            }
        });
}

/// An axis of run time whose marks all have labels.
pub(super) fn time_axis() -> AxisHints<'static> {
    AxisHints::new_x()
        .formatter(|mark, _| run_time(mark.value))
        .label_spacing(egui::Rangef::new(20.0, 30.0))
}

/// Marks at round numbers of seconds, few enough for labels.
pub(super) fn time_spacer() -> impl Fn(GridInput) -> Vec<GridMark> {
    egui_plot::uniform_grid_spacer(|input| {
        let step = time_step(input.bounds.1 - input.bounds.0);
        [step, step, step]
    })
}

/// An axis of logarithms; `label` writes a whole one.
pub(super) fn decade_axis(label: fn(i32) -> String) -> AxisHints<'static> {
    AxisHints::new_y()
        .formatter(move |mark, _| label(mark.value.round() as i32))
        .label_spacing(egui::Rangef::new(10.0, 14.0))
}

/// Marks at whole decades, or at some of them where there are many.
pub(super) fn decade_spacer() -> impl Fn(GridInput) -> Vec<GridMark> {
    egui_plot::uniform_grid_spacer(|input| {
        let step = ((input.bounds.1 - input.bounds.0) / MOST_DECADES)
            .ceil()
            .max(1.0);
        [step, step, step]
    })
}

/// A round number of seconds that leaves at most [`MOST_TIMES`] steps in a range.
fn time_step(range: f64) -> f64 {
    round_step((range / MOST_TIMES).max(1e-3))
}

/// A whole power of ten as people write it.
fn power_of_ten(exponent: i32) -> String {
    match exponent {
        0..=6 => count(10_u64.pow(exponent.unsigned_abs())),
        -3..0 => format!("{}", 10_f64.powi(exponent)),
        _ => format!("1e{exponent}"),
    }
}

/// A mark on an axis of run time. Marks are round numbers but for their rounding.
fn run_time(seconds: f64) -> String {
    format!("{} s", (1000.0 * seconds).round() / 1000.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_of_time_are_round_and_few() {
        for (range, step) in [
            (0.9, 0.2),
            (5.0, 1.0),
            (12.6, 5.0),
            (61.0, 20.0),
            (0.0, 1e-3),
        ] {
            let found = time_step(range);
            assert!((found / step - 1.0).abs() < 1e-9, "{range}: {found}");
        }
    }

    #[test]
    fn powers_of_ten_are_short() {
        let texts = [2, 0, -1, -3, -4].map(power_of_ten);
        assert_eq!(texts, ["100", "1", "0.1", "0.001", "1e-4"]);
    }
}
