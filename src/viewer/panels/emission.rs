//! How bright all emitters are together.

use eframe::egui;

use super::row;
use crate::viewer::{
    action::Action,
    figures::{figure, number},
    state::State,
};

/// Show the scale of all emission; a requested action goes into `actions`.
pub fn emission_ui(ui: &mut egui::Ui, state: &State, actions: &mut Vec<Action>) {
    let mut scale = state.view.emission_scale;
    let has_changed = row::setting(
        ui,
        "Emission scale",
        "Multiplies what all emitters emit. Exact and at once: light grows in proportion, nothing is computed anew. The \
         automatic exposure does not make up for it.",
        &mut scale,
        &1.0,
        |ui, value| {
            ui.add(
                egui::Slider::new(value, 0.01..=100.0)
                    .logarithmic(true)
                    .clamping(egui::SliderClamping::Never)
                    .custom_formatter(|value, _| figure(value))
                    .custom_parser(|text| {
                        let value = number(text)?;
                        (0.0..=f64::from(f32::MAX))
                            .contains(&value)
                            .then_some(value)
                    }),
            )
        },
    );
    if has_changed {
        actions.push(Action::EmissionScale(scale));
    }
}
