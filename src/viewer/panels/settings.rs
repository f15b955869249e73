//! Settings of the solve: accuracy, presets, thresholds, limits.

use std::time::Duration;

use eframe::egui::{self, DragValue, Slider, emath::Numeric};

use super::{
    method::method_ui,
    row::{self, slider},
};
use crate::{
    metrics::{Expected, Pace, about},
    scene::Sides,
    solver::SolveSettings,
    viewer::{action::Action, figures::number, state::State},
};

/// Show the settings; requested actions go into `actions`.
pub fn settings_ui(ui: &mut egui::Ui, state: &mut State, actions: &mut Vec<Action>) {
    let mut settings = state.settings.clone();
    let prepared = state.run.prepare_secs.unwrap_or_default();
    let pace = Pace::of(prepared, &state.run.reports);
    accuracy_ui(ui, &pace, &mut settings);
    presets_ui(ui, &pace, &mut settings);
    ui.add_space(4.0);
    quality_ui(ui, state, &mut settings);
    method_ui(ui, state, &mut settings);
    if settings != state.settings {
        actions.push(Action::Settings(settings));
    }
    limits_ui(ui, state, actions);
}

/// Errors that can be asked for.
const ACCURACIES: [f32; 4] = [0.1, 0.05, 0.02, 0.01];

/// The error that is asked for. A solve that is asked for one goes on until its estimate is that small.
fn accuracy_ui(ui: &mut egui::Ui, pace: &Pace, settings: &mut SolveSettings) {
    let grid = egui::Grid::new("accuracy").num_columns(1 + ACCURACIES.len());
    grid.spacing([8.0, 2.0]).show(ui, |ui| {
        ui.label("Accuracy")
            .on_hover_text("Refine until the estimated error is this small");
        for error in ACCURACIES {
            let chosen = with_quality_of(&SolveSettings::towards(error), settings);
            let is_active = settings.error == Some(error);
            let label = format!("{} %", (100.0 * error).round());
            let button = egui::Button::selectable(is_active, label).frame_when_inactive(true);
            let explanation = "The upper end of the interval of 'Estimated error' is to be this small";
            if ui.add(button).on_hover_text(explanation).clicked() {
                *settings = chosen;
            }
        }
        ui.end_row();
        // Before the first step nothing is known, but the row stands there, so that nothing below moves.
        ui.weak("takes about").on_hover_text(
            "Time of a run until then, by the error and the time of the steps of this one; finer steps may take longer, or \
             not come that far",
        );
        for error in ACCURACIES {
            ui.weak(time_to(pace, error));
        }
        ui.end_row();
    });
}

/// The time to an error as it stands below its button.
fn time_to(pace: &Pace, error: f32) -> String {
    match pace.to(f64::from(error)) {
        None => "–".to_owned(),
        Some(Expected::Reached) => "reached".to_owned(),
        Some(Expected::After(seconds)) => about(seconds),
    }
}

fn presets_ui(ui: &mut egui::Ui, pace: &Pace, settings: &mut SolveSettings) {
    /// With the error that they lead to in ordinary scenes.
    const PRESETS: [(&str, SolveSettings, f32); 3] = [
        ("Draft", SolveSettings::draft(), 0.05),
        ("Normal", SolveSettings::normal(), 0.02),
        ("Final", SolveSettings::finest(), 0.01),
    ];
    ui.horizontal(|ui| {
        let width = (ui.available_width() - 2.0 * ui.spacing().item_spacing.x) / 3.0;
        for (label, preset, error) in PRESETS {
            let mut explanation = format!("About {} % error", 100.0 * error);
            if let Some(Expected::After(seconds)) = pace.to(f64::from(error)) {
                explanation += &format!(", after about {}", about(seconds));
            }
            let chosen = with_quality_of(&preset, settings);
            let is_active = *settings == preset;
            let (label, explanation) = if *settings == chosen && !is_active {
                let but = "This quality is set, but something of the method, or the seed, differs from the preset";
                (format!("{label} *"), format!("{explanation}. {but}"))
            } else {
                (label.to_owned(), explanation)
            };
            let button = egui::Button::selectable(is_active, label)
                .min_size(egui::vec2(width, 24.0))
                .frame_when_inactive(true);
            if ui.add(button).on_hover_text(explanation).clicked() {
                *settings = chosen;
            }
        }
    });
}

/// Settings with the quality of a preset. How light is computed stays, and so does the seed.
fn with_quality_of(preset: &SolveSettings, settings: &SolveSettings) -> SolveSettings {
    SolveSettings {
        method: settings.method,
        oracle: settings.oracle,
        direct: settings.direct,
        push: settings.push,
        crease_degrees: settings.crease_degrees,
        seed: settings.seed,
        keep: settings.keep,
        epsilon: preset.epsilon,
        samples: preset.samples,
        shadow_samples: preset.shadow_samples,
        min_area: preset.min_area,
        mesh_tolerance: preset.mesh_tolerance,
        max_steps: preset.max_steps,
        tolerance: preset.tolerance,
        error: preset.error,
    }
}

fn quality_ui(ui: &mut egui::Ui, state: &State, settings: &mut SolveSettings) {
    let default = SolveSettings::normal();
    row::setting(
        ui,
        "Link threshold ε",
        "Largest error of one link, relative to the mean light. Lower is better and slower: links grow about as 1/ε. \
         Values outside the slider may be typed.",
        &mut settings.epsilon,
        &default.epsilon,
        |ui, value| ui.add(slider(value, 0.001..=0.3)),
    );
    row::setting(
        ui,
        "Mesh tolerance",
        "Elements are divided where light errs by more than this between their corners, relative to the mean light. \
         Lower draws sharper shadows and costs vertices and shadow rays.",
        &mut settings.mesh_tolerance,
        &default.mesh_tolerance,
        |ui, value| ui.add(slider(value, 0.0005..=0.2)),
    );
    row::setting(
        ui,
        "Smallest element",
        "Elements are not divided below this fraction of the scene's area. Lower allows finer shadows and more memory.",
        &mut settings.min_area,
        &default.min_area,
        |ui, value| ui.add(slider(value, 1e-8..=1e-3)),
    );
    if state.has_emitters() {
        row::setting(
            ui,
            "Rays per vertex",
            "Shadow rays from a vertex towards the lights; up to 16 times as many are shot where noise would show. More makes penumbrae smoother; the time for direct light grows with it.",
            &mut settings.shadow_samples,
            &default.shadow_samples,
            |ui, value| {
                ui.add(
                    Slider::new(value, 1..=256)
                        .logarithmic(true)
                        .clamping(egui::SliderClamping::Edits),
                )
            },
        );
    }
    row::setting(
        ui,
        "Maximum steps",
        "The threshold falls to ε over this many steps. More steps show the first picture earlier.",
        &mut settings.max_steps,
        &default.max_steps,
        |ui, value| ui.add(DragValue::new(value).range(1..=64).speed(0.1)),
    );
}

fn limits_ui(ui: &mut egui::Ui, state: &mut State, actions: &mut Vec<Action>) {
    row::section(ui, "Limits and scene", false, |ui| {
        let mut options = state.options.clone();
        let mut time = options.time_limit.map_or(0.0, |limit| limit.as_secs_f64());
        row::setting(
            ui,
            "Time limit",
            "The run stops after this many seconds; Continue grants them anew. 0 is no limit.",
            &mut time,
            &0.0,
            |ui, value| ui.add(limit(value, 0.0..=1e6, "s", "none").speed(1.0)),
        );
        options.time_limit = (time > 0.0).then(|| Duration::from_secs_f64(time));
        let mut memory = options.memory_limit.map_or(0, |limit| limit >> 20);
        row::setting(
            ui,
            "Memory limit",
            "The run stops when the solver holds this many MiB. 0 is no limit.",
            &mut memory,
            &0,
            |ui, value| ui.add(limit(value, 0..=1 << 20, "MiB", "none").speed(16.0)),
        );
        options.memory_limit = (memory > 0).then_some(memory << 20);
        row::setting(
            ui,
            "Threads",
            "How many threads compute; 0 takes one for each core. The result is the same.",
            &mut options.threads,
            &0,
            |ui, value| ui.add(limit(value, 0..=256, "", "automatic").speed(0.1)),
        );
        if options != state.options {
            actions.push(Action::Options(options));
        }
        let mut sides = state.scene_options.sides;
        row::setting(
            ui,
            "Sides",
            "Which sides of faces reflect and emit. Changing it reads the scene again.",
            &mut sides,
            &Sides::Auto,
            |ui, value| {
                row::choice(
                    ui,
                    "sides",
                    value,
                    &[
                        (
                            Sides::Auto,
                            "Automatic",
                            "Closed shells one-sided, sheets two-sided",
                        ),
                        (Sides::One, "One-sided", "Counter-clockwise is the front"),
                        (Sides::Two, "Two-sided", "Both sides reflect and emit"),
                    ],
                )
            },
        );
        if sides != state.scene_options.sides {
            actions.push(Action::Sides(sides));
        }
        let loaded = state.loaded.as_ref();
        if loaded.is_none_or(|loaded| !loaded.scene.is_in_metres) {
            row::setting(
                ui,
                "Unit is the metre",
                "OBJ files do not say what a unit of length is. Powers are in watts where it is the metre, else relative.",
                &mut state.view.is_in_metres,
                &false,
                |ui, value| ui.checkbox(value, ""),
            );
        }
    });
}

/// A number that may be dragged and typed, with its unit behind it; 0 stands for what `zero` says, which may be typed, too.
fn limit<'v, N: Numeric>(
    value: &'v mut N,
    range: std::ops::RangeInclusive<N>,
    unit: &'static str,
    zero: &'static str,
) -> DragValue<'v> {
    DragValue::new(value)
        .range(range)
        .custom_formatter(move |value, _| limit_text(value, unit, zero))
        .custom_parser(move |text| parsed_limit(text, unit, zero))
}

fn limit_text(value: f64, unit: &str, zero: &str) -> String {
    if value <= 0.0 {
        return zero.to_owned();
    }
    // Tenths are as fine as limits go.
    let rounded = (10.0 * value).round() / 10.0;
    format!("{rounded} {unit}").trim_end().to_owned()
}

fn parsed_limit(text: &str, unit: &str, zero: &str) -> Option<f64> {
    let text = text.trim();
    if text.eq_ignore_ascii_case(zero) {
        return Some(0.0);
    }
    number(text.trim_end_matches(unit))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_that_does_not_limit_says_so() {
        for (value, unit, zero, text) in [
            (0.0, "s", "none", "none"),
            (90.0, "s", "none", "90 s"),
            (0.5, "s", "none", "0.5 s"),
            (512.0, "MiB", "none", "512 MiB"),
            (0.0, "", "automatic", "automatic"),
            (4.0, "", "automatic", "4"),
        ] {
            assert_eq!(limit_text(value, unit, zero), text);
            assert_eq!(parsed_limit(text, unit, zero), Some(value), "{text}");
        }
        assert_eq!(parsed_limit("None", "s", "none"), Some(0.0));
        assert_eq!(parsed_limit("soon", "s", "none"), None);
    }
}
