//! The row above the scene: what is shown and how bright.

use eframe::egui::{self, DragValue, Slider};

use crate::{
    export::ToneMap,
    viewer::{
        action::Action,
        figures::figure,
        panel_state::{PanelState, Side},
        state::State,
        view::{ViewMode, ViewSettings},
    },
};

/// Width of the exposure's value, for two digits before the point and a sign.
const EXPOSURE_WIDTH: f32 = 76.0;

/// Show the row; what is quick to change is changed in place, the rest goes into `actions`.
pub fn toolbar_ui(ui: &mut egui::Ui, state: &mut State, actions: &mut Vec<Action>) {
    ui.horizontal_wrapped(|ui| {
        mode_ui(ui, state, actions);
        if state.view.mode.is_light() {
            exposure_ui(ui, &mut state.view, actions);
        }
        if state.view.mode.false_color_unit().is_some() {
            range_ui(ui, &mut state.view, state.false_color_range);
        }
        ui.separator();
        // Where orientation is shown, backs are shown anyway.
        let has_backs = state.has_backs() && state.view.mode != ViewMode::FaceOrientation;
        let has_gloss = state.has_gloss();
        let view = &mut state.view;
        ui.toggle_value(&mut view.edges, "Mesh")
            .on_hover_text("Edges of the elements over the light (M)");
        ui.toggle_value(&mut view.clusters.shown, "Clusters")
            .on_hover_text("Boxes of the cluster tree; [ and ] change the level (B)");
        let loaded = state.loaded.as_ref();
        if has_backs {
            ui.toggle_value(&mut view.backs, "Backs").on_hover_text(
                "Draw the backs of one-sided faces instead of looking through them (K)",
            );
        }
        if loaded.is_some_and(|loaded| !loaded.scene.textures.is_empty()) {
            ui.toggle_value(&mut view.texture_detail, "Textures")
                .on_hover_text("Textures in detail, lit by the computed light");
        }
        if view.mode == ViewMode::Radiance && has_gloss {
            ui.toggle_value(&mut view.gloss, "Gloss").on_hover_text(
                "Add what mirrors, gloss and glass send to the eye to the light at vertices; the traced picture always has it (G)",
            );
        }
        if view.mode == ViewMode::Radiance {
            ui.toggle_value(&mut view.traced, "Traced").on_hover_text(
                "Sharpen the view to a picture by rays from the eye while nothing moves and nothing is computed (V)",
            );
        }
        ui.separator();
        sides_ui(ui, &mut state.panels);
    });
}

/// Which panels stand beside the scene.
fn sides_ui(ui: &mut egui::Ui, panels: &mut PanelState) {
    let window_width = ui.ctx().content_rect().width();
    let shown = panels.shown_sides(window_width);
    for (side, label, explanation) in [
        (
            Side::Light,
            "Settings",
            "The panel of the run and its settings; Ctrl+B hides all but the scene",
        ),
        (
            Side::Look,
            "Details",
            "The panel of what is picked, of clusters, links and figures; Ctrl+B hides all but the scene",
        ),
    ] {
        let mut is_shown = shown.contains(&side);
        let toggle = ui.toggle_value(&mut is_shown, label);
        if toggle.on_hover_text(explanation).changed() {
            match is_shown {
                true => panels.open_side(side),
                false => panels.close_side(side, window_width),
            }
        }
    }
}

fn mode_ui(ui: &mut egui::Ui, state: &State, actions: &mut Vec<Action>) {
    let mode = state.view.mode;
    let mut chosen = mode;
    let response = egui::ComboBox::from_id_salt("view mode")
        .selected_text(mode.label())
        .width(176.0)
        .height(320.0)
        .show_ui(ui, |ui| {
            for mode in ViewMode::offered(state.truth.exists()) {
                ui.selectable_value(&mut chosen, mode, mode.label())
                    .on_hover_text(mode.explanation());
            }
        })
        .response;
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::ComboBox, true, "View mode"));
    response.on_hover_text(mode.explanation());
    if chosen != mode {
        actions.push(Action::Mode(chosen));
    }
}

fn exposure_ui(ui: &mut egui::Ui, view: &mut ViewSettings, actions: &mut Vec<Action>) {
    let label = ui.label("Exposure");
    let mut exposure = view.exposure;
    let slider = Slider::new(&mut exposure, -8.0..=8.0)
        .suffix(" EV")
        .custom_formatter(|value, _| exposure_text(value))
        .step_by(0.1)
        .clamping(egui::SliderClamping::Never);
    let response = ui
        .scope(|ui| {
            // As wide as the longest value, so that what follows stays in its place.
            ui.spacing_mut().interact_size.x = EXPOSURE_WIDTH;
            ui.add(slider)
        })
        .inner
        .labelled_by(label.id)
        .on_hover_text("Brightness of the picture, without computing anything (- and =)");
    if response.changed() {
        actions.push(Action::ExposureBy(exposure - view.exposure));
    }
    if ui
        .selectable_label(view.auto_exposure, "Auto")
        .on_hover_text("Let the exposure follow the light (0)")
        .clicked()
    {
        actions.push(Action::AutoExposure);
    }
    let mut is_neutral = view.tone_map == ToneMap::Neutral;
    ui.toggle_value(&mut is_neutral, "Tone map")
        .on_hover_text("Compress highlights and keep their colour; off cuts them at white (T)");
    view.tone_map = if is_neutral {
        ToneMap::Neutral
    } else {
        ToneMap::None
    };
}

/// An exposure with one decimal; what is rounded to 0 has no sign.
fn exposure_text(value: f64) -> String {
    format!("{:.1}", (10.0 * value).round() / 10.0 + 0.0)
}

fn range_ui(ui: &mut egui::Ui, view: &mut ViewSettings, in_use: [f32; 2]) {
    let is_signed = view.mode.is_signed();
    if !is_signed {
        ui.toggle_value(&mut view.logarithmic, "Log")
            .on_hover_text("Space the colours logarithmically");
    }
    let mut is_fixed = view.fixed_range.is_some();
    ui.toggle_value(&mut is_fixed, "Fixed range")
        .on_hover_text("Keep the range while the light changes; otherwise it follows the light");
    view.fixed_range = match (is_fixed, view.fixed_range) {
        (true, None) => Some(in_use.map(|end| end.max(0.0))),
        (true, chosen) => chosen,
        (false, _) => None,
    };
    if let Some([low, high]) = &mut view.fixed_range {
        let speed = f64::from(*high) * 0.005;
        let drag = |value| {
            DragValue::new(value)
                .range(0.0..=f32::MAX)
                .speed(speed)
                .custom_formatter(|value, _| figure(value))
        };
        if !is_signed {
            let label = ui.label("from");
            ui.add(drag(low)).labelled_by(label.id);
        }
        let label = ui.label(if is_signed { "up to ±" } else { "to" });
        ui.add(drag(high)).labelled_by(label.id);
    }
}

#[cfg(test)]
mod tests {
    use super::exposure_text;

    #[test]
    fn no_exposure_is_no_less_than_nothing() {
        let cases = [
            (-0.04, "0.0"),
            (0.04, "0.0"),
            (-0.06, "-0.1"),
            (12.3, "12.3"),
        ];
        for (value, text) in cases {
            assert_eq!(exposure_text(value), text);
        }
    }
}
