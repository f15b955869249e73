//! The scale of false colours, over the scene.

use eframe::egui::{self, Align2, Color32, FontId, Rect, Stroke, StrokeKind, pos2, vec2};

use super::figure;
use crate::viewer::{state::State, theme, view::ViewMode};

/// Draw the scale where the mode has one.
pub fn legend_ui(ui: &egui::Ui, rect: Rect, state: &State) {
    let mode = state.view.mode;
    if mode == ViewMode::FaceOrientation {
        let entries = [
            ("Front", theme::axis_color(2)),
            ("Back", theme::axis_color(0)),
        ];
        swatches(ui, rect, &entries);
        return;
    }
    let Some(unit) = mode.false_color_unit() else {
        return;
    };
    const SIZE: egui::Vec2 = vec2(18.0, 180.0);
    let at = rect.right_top() + vec2(-104.0, 44.0);
    let painter = ui.painter().with_clip_rect(rect);
    let plate = Rect::from_min_size(at - vec2(14.0, 34.0), vec2(110.0, SIZE.y + 64.0));
    painter.rect_filled(plate, 4.0, Color32::from_black_alpha(190));
    let text = |at, anchor, text: String| {
        painter.text(
            at,
            anchor,
            text,
            FontId::proportional(12.0),
            Color32::from_gray(225),
        );
    };
    text(at - vec2(2.0, 26.0), Align2::LEFT_TOP, unit.to_owned());
    // The ramp, and the marks of what lies outside it.
    const BANDS: usize = 90;
    let band = SIZE.y / BANDS as f32;
    for index in 0..BANDS {
        let t = 1.0 - (index as f32 + 0.5) / BANDS as f32;
        let top = at + vec2(0.0, index as f32 * band);
        let rect = Rect::from_min_size(top, vec2(SIZE.x, band + 0.5));
        painter.rect_filled(rect, 0.0, theme::ramp_color(t));
    }
    let above = Rect::from_min_size(at - vec2(0.0, 9.0), vec2(SIZE.x, 7.0));
    let below = Rect::from_min_size(at + vec2(0.0, SIZE.y + 2.0), vec2(SIZE.x, 7.0));
    painter.rect_filled(above, 0.0, Color32::WHITE);
    painter.rect(
        below,
        0.0,
        Color32::BLACK,
        Stroke::new(1.0, Color32::from_gray(90)),
        StrokeKind::Inside,
    );
    let scale = match mode {
        ViewMode::Error => 1.0,
        _ => f64::from(state.radiance_unit()),
    };
    let [low, high] = state.false_color_range;
    for step in 0..=4 {
        let t = step as f32 / 4.0;
        let value = if state.view.logarithmic && low > 0.0 {
            low * (high / low).powf(t)
        } else {
            low + (high - low) * t
        };
        let y = at.y + SIZE.y * (1.0 - t);
        text(
            pos2(at.x + SIZE.x + 8.0, y),
            Align2::LEFT_CENTER,
            figure(f64::from(value) * scale),
        );
    }
}

/// A scale in a panel: the ramp between what stands for its ends.
pub fn scale_ui(ui: &mut egui::Ui, low: &str, high: &str) {
    const SIZE: egui::Vec2 = vec2(110.0, 10.0);
    const BANDS: usize = 44;
    ui.horizontal(|ui| {
        ui.weak(low);
        let (rect, _) = ui.allocate_exact_size(SIZE, egui::Sense::hover());
        let band = SIZE.x / BANDS as f32;
        for index in 0..BANDS {
            let left = rect.left_top() + vec2(index as f32 * band, 0.0);
            let color = theme::ramp_color((index as f32 + 0.5) / BANDS as f32);
            let plate = Rect::from_min_size(left, vec2(band + 0.5, SIZE.y));
            ui.painter().rect_filled(plate, 0.0, color);
        }
        ui.weak(high);
    });
}

fn swatches(ui: &egui::Ui, rect: Rect, entries: &[(&str, Color32)]) {
    let painter = ui.painter().with_clip_rect(rect);
    let mut at = rect.right_top() + vec2(-84.0, 14.0);
    for (label, color) in entries {
        let plate = Rect::from_min_size(at, vec2(14.0, 14.0));
        painter.rect_filled(plate, 2.0, *color);
        painter.text(
            at + vec2(22.0, 7.0),
            Align2::LEFT_CENTER,
            label,
            FontId::proportional(13.0),
            Color32::from_gray(225),
        );
        at.y += 20.0;
    }
}
