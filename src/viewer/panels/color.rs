//! A button that shows a colour, and behind it bars for hue, saturation and value, with the linear channels as figures.

use eframe::egui::{
    self, Color32, DragValue, Popup, PopupCloseBehavior, Rect, Sense, Stroke, WidgetInfo,
    color_picker::show_color_at,
    ecolor::{Hsva, HsvaGamma},
    pos2, vec2,
};
use glam::Vec3;

/// A button with a linear colour, each channel within 0…1, that opens the picker. The colour changes only where the user
/// changes it.
pub fn color_button(ui: &mut egui::Ui, name: &str, color: &mut Vec3) -> egui::Response {
    let size = ui.spacing().interact_size;
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    let is_enabled = ui.is_enabled();
    response.widget_info(|| WidgetInfo::labeled(egui::Role::ColorWell, is_enabled, name));
    let visuals = ui.style().interact(&response);
    show_color_at(ui.painter(), shown(*color), rect.shrink(1.0));
    let stroke = Stroke::new(1.0, visuals.fg_stroke.color);
    ui.painter().rect_stroke(
        rect,
        visuals.corner_radius,
        stroke,
        egui::StrokeKind::Inside,
    );
    Popup::menu(&response)
        .close_behavior(PopupCloseBehavior::CloseOnClickOutside)
        .show(|ui| picker_ui(ui, response.id, color));
    response.on_hover_text(name)
}

fn picker_ui(ui: &mut egui::Ui, id: egui::Id, color: &mut Vec3) {
    // Grey has no hue, and black has no saturation: those chosen last are used.
    let last = ui.data(|data| data.get_temp::<HsvaGamma>(id));
    let fits = |last: &HsvaGamma| linear(*last).abs_diff_eq(*color, 1e-4);
    let mut hsv = last
        .filter(fits)
        .unwrap_or_else(|| HsvaGamma::from(Hsva::from_rgb(color.to_array())));
    let before = hsv;
    bar_ui(ui, "Hue", &mut hsv.h, |h| HsvaGamma {
        h,
        s: 1.0,
        v: 1.0,
        a: 1.0,
    });
    bar_ui(ui, "Saturation", &mut hsv.s, |s| HsvaGamma { s, ..before });
    bar_ui(ui, "Value", &mut hsv.v, |v| HsvaGamma { v, ..before });
    if hsv != before {
        *color = linear(hsv);
    }
    ui.horizontal(|ui| {
        let channels = [
            ("Red", &mut color.x),
            ("Green", &mut color.y),
            ("Blue", &mut color.z),
        ];
        for (name, channel) in channels {
            let label = ui.label(name);
            let value = DragValue::new(channel).range(0.0..=1.0).speed(0.003);
            ui.add(value.fixed_decimals(3)).labelled_by(label.id);
        }
    });
    ui.data_mut(|data| data.insert_temp(id, hsv));
}

/// A bar of colours with a mark at the value, 0…1.
fn bar_ui(ui: &mut egui::Ui, name: &str, value: &mut f32, color_at: impl Fn(f32) -> HsvaGamma) {
    const SIZE: egui::Vec2 = vec2(230.0, 18.0);
    const BANDS: usize = 46;
    ui.label(name);
    let (rect, response) = ui.allocate_exact_size(SIZE, Sense::click_and_drag());
    if let Some(pointer) = response.interact_pointer_pos() {
        *value = ((pointer.x - rect.left()) / rect.width()).clamp(0.0, 1.0);
    }
    let told = f64::from(*value);
    response.widget_info(|| WidgetInfo::slider(true, told, name));
    let width = rect.width() / BANDS as f32;
    for band in 0..BANDS {
        let left = rect.left() + band as f32 * width;
        let plate = Rect::from_min_max(
            pos2(left, rect.top()),
            pos2(left + width + 0.5, rect.bottom()),
        );
        let color = color_at((band as f32 + 0.5) / BANDS as f32);
        ui.painter()
            .rect_filled(plate.intersect(rect), 0.0, Color32::from(color));
    }
    let x = rect.left() + rect.width() * *value;
    for (width, color) in [(4.0, Color32::BLACK), (2.0, Color32::WHITE)] {
        ui.painter()
            .vline(x, rect.y_range(), Stroke::new(width, color));
    }
}

/// A linear colour as the window shows it.
fn shown(color: Vec3) -> Color32 {
    let [r, g, b] = color.clamp(Vec3::ZERO, Vec3::ONE).to_array();
    Color32::from(egui::Rgba::from_rgb(r, g, b))
}

fn linear(hsv: HsvaGamma) -> Vec3 {
    let color = Vec3::from_array(Hsva::from(hsv).to_rgb());
    color.clamp(Vec3::ZERO, Vec3::ONE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_colour_survives_its_bars() {
        for color in [
            Vec3::new(0.2, 0.5, 0.9),
            Vec3::splat(0.4),
            Vec3::ZERO,
            Vec3::X,
        ] {
            let back = linear(HsvaGamma::from(Hsva::from_rgb(color.to_array())));
            assert!(back.abs_diff_eq(color, 1e-4), "{color} became {back}");
        }
    }
}
