//! Rows of a panel: a setting with its label, unit, explanation and reset; a figure with its name.

use std::f32::consts::TAU;

use eframe::egui::{self, RichText};

use crate::viewer::{figures, theme};

/// Width of the labels of settings, in points. Narrower cuts them off, wider leaves no room for the values.
const LABEL_WIDTH: f32 = 118.0;
/// Width of the button that resets a setting.
const RESET_WIDTH: f32 = 24.0;
/// Width of a slider's value with the gap before it, for figures of seven characters.
const VALUE_WIDTH: f32 = 72.0;

/// A setting: label, widget, and a reset that appears when the value is not the default.
/// `widget` gets the label to be named by. Returns whether the value changed.
pub fn setting<T: PartialEq + Clone>(
    ui: &mut egui::Ui,
    label: &str,
    explanation: &str,
    value: &mut T,
    default: &T,
    widget: impl FnOnce(&mut egui::Ui, &mut T) -> egui::Response,
) -> bool {
    let before = value.clone();
    ui.horizontal(|ui| {
        let name = ui
            .allocate_ui_with_layout(
                egui::vec2(LABEL_WIDTH, ui.spacing().interact_size.y),
                egui::Layout::left_to_right(egui::Align::Center),
                |ui| {
                    ui.set_min_width(LABEL_WIDTH);
                    ui.label(label).on_hover_text(explanation)
                },
            )
            .inner;
        let room = ui.available_width() - RESET_WIDTH - ui.spacing().item_spacing.x;
        ui.allocate_ui_with_layout(
            egui::vec2(room, ui.spacing().interact_size.y),
            egui::Layout::left_to_right(egui::Align::Center),
            |ui| {
                ui.set_min_width(room);
                // The value of a slider stands behind it.
                ui.spacing_mut().slider_width = (room - VALUE_WIDTH).max(40.0);
                widget(ui, value)
                    .labelled_by(name.id)
                    .on_hover_text(explanation);
            },
        );
        if *value != *default && reset_button(ui, label).clicked() {
            *value = default.clone();
        }
    });
    *value != before
}

/// Something that cannot be set, beside the settings.
pub fn fixed(ui: &mut egui::Ui, label: &str, explanation: &str, text: &str) {
    ui.horizontal(|ui| {
        ui.allocate_ui_with_layout(
            egui::vec2(LABEL_WIDTH, ui.spacing().interact_size.y),
            egui::Layout::left_to_right(egui::Align::Center),
            |ui| {
                ui.set_min_width(LABEL_WIDTH);
                ui.label(label).on_hover_text(explanation);
            },
        );
        ui.weak(text).on_hover_text(explanation);
    });
}

/// A small arrow that turns back.
pub(super) fn reset_button(ui: &mut egui::Ui, label: &str) -> egui::Response {
    let size = egui::Vec2::splat(ui.spacing().interact_size.y - 4.0);
    let (rect, response) = ui.allocate_exact_size(size, egui::Sense::click());
    let name = format!("Reset {}", label.to_lowercase());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &name));
    let stroke = egui::Stroke::new(1.5, ui.style().interact(&response).fg_stroke.color);
    // Drawn, since not every font has such an arrow.
    let radius = 0.28 * size.x;
    let on_circle = |turn: f32| rect.center() + radius * egui::Vec2::angled(turn * TAU);
    let arc = (0..=18).map(|step| on_circle(0.62 - 0.8 * step as f32 / 18.0));
    ui.painter().line(arc.collect(), stroke);
    let tip = on_circle(0.62);
    for arm in [egui::vec2(0.0, -4.0), egui::vec2(4.0, 0.5)] {
        ui.painter().line_segment([tip, tip + arm], stroke);
    }
    response.on_hover_text(name)
}

/// A choice among a few.
pub fn choice<T: PartialEq + Copy>(
    ui: &mut egui::Ui,
    name: &str,
    value: &mut T,
    options: &[(T, &str, &str)],
) -> egui::Response {
    let shown = options
        .iter()
        .find(|(option, ..)| option == value)
        .map_or("", |(_, label, _)| label);
    egui::ComboBox::from_id_salt(name)
        .selected_text(shown)
        .width(ui.available_width())
        .show_ui(ui, |ui| {
            for (option, label, explanation) in options {
                ui.selectable_value(value, *option, *label)
                    .on_hover_text(*explanation);
            }
        })
        .response
}

/// A figure with its name, in a grid of two columns.
pub fn figure(ui: &mut egui::Ui, name: &str, value: impl Into<String>, explanation: &str) {
    let name = RichText::new(name).color(theme::secondary_text(ui.visuals()));
    let label = ui.label(name);
    ui.label(value.into());
    if !explanation.is_empty() {
        label.on_hover_text(explanation);
    }
    ui.end_row();
}

/// The size of a box in the file's units, as a [`figure`].
pub fn size(ui: &mut egui::Ui, size: glam::DVec3) {
    let [x, y, z] = size.to_array().map(figures::figure);
    figure(
        ui,
        "Size",
        format!("{x} × {y} × {z}"),
        "In the file's units",
    );
}

/// A grid for [`figure`].
pub fn figures(ui: &mut egui::Ui, id: &str, add: impl FnOnce(&mut egui::Ui)) {
    egui::Grid::new(id)
        .num_columns(2)
        .spacing([14.0, 3.0])
        .min_col_width(96.0)
        .show(ui, add);
}

/// A section that folds.
pub fn section(ui: &mut egui::Ui, title: &str, open: bool, add: impl FnOnce(&mut egui::Ui)) {
    egui::CollapsingHeader::new(RichText::new(title).strong())
        .id_salt(title)
        .default_open(open)
        .show_unindented(ui, add);
    ui.add_space(2.0);
}

/// A logarithmic slider whose typed value may leave its range, but not go to 0 or below.
pub fn slider(value: &mut f32, range: std::ops::RangeInclusive<f32>) -> egui::Slider<'_> {
    egui::Slider::new(value, range)
        .logarithmic(true)
        .clamping(egui::SliderClamping::Never)
        .custom_formatter(|value, _| figures::figure(value))
        .custom_parser(|text| {
            let value = figures::number(text)? as f32;
            (f32::MIN_POSITIVE..=f32::MAX)
                .contains(&value)
                .then_some(f64::from(value))
        })
}
