//! Scales of colours: over the scene that of false colours, in the panels those of boxes and links. Logarithmic ones have
//! their marks at decades.

use eframe::egui::{self, Align2, Color32, FontId, Rect, Stroke, StrokeKind, pos2, vec2};

use crate::viewer::{figures::count, state::State, theme, view::ViewMode};

/// Marks on a scale at most. More touch each other.
const MOST_MARKS: usize = 7;

/// The quantity of colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Values of the first and the last colour.
    pub ends: [f64; 2],
    /// Whether values are spaced by their logarithm.
    pub is_logarithmic: bool,
}

impl Scale {
    /// Where a value stands, 0…1 between the ends.
    fn position(&self, value: f64) -> f64 {
        let [low, high] = self.ends;
        if self.has_decades() {
            (value / low).ln() / (high / low).ln()
        } else {
            (value - low) / (high - low).max(f64::MIN_POSITIVE)
        }
    }

    fn has_decades(&self) -> bool {
        let [low, high] = self.ends;
        self.is_logarithmic && low > 0.0 && high > low
    }

    /// Values for marks, from low to high: round numbers, on logarithmic scales whole powers of ten where there are two.
    pub fn marks(&self) -> Vec<f64> {
        let [low, high] = self.ends;
        if high <= low {
            return vec![low];
        }
        let is_inside = |value: &f64| (-1e-6..=1.0 + 1e-6).contains(&self.position(*value));
        if !self.has_decades() {
            let step = round_step((high - low) / 5.0);
            let first = (low / step - 1e-6).ceil();
            let marks = (0..MOST_MARKS).map(|index| (first + index as f64) * step);
            return marks.filter(is_inside).collect();
        }
        let [first, last] = [low, high].map(|end| end.log10().floor() as i32);
        let multiples = |factors: &[f64]| -> Vec<f64> {
            let powers = (first..=last).map(|exponent| 10_f64.powi(exponent));
            powers
                .flat_map(|power| factors.iter().map(move |factor| factor * power))
                .filter(is_inside)
                .collect()
        };
        let decades = multiples(&[1.0]);
        match decades.len() {
            0 | 1 => multiples(&[1.0, 2.0, 5.0]),
            number => decades
                .into_iter()
                .step_by(number.div_ceil(MOST_MARKS))
                .collect(),
        }
    }
}

/// The smallest of 1, 2, 5, 10, … times a power of ten that is at least this.
pub(super) fn round_step(least: f64) -> f64 {
    let least = least.max(f64::MIN_POSITIVE);
    let power = 10_f64.powf(least.log10().floor());
    let factor = [1.0, 2.0, 5.0]
        .into_iter()
        .find(|factor| factor * power >= least * (1.0 - 1e-9));
    factor.unwrap_or(10.0) * power
}

/// A round number, as short as it can be written; any other with four digits.
fn mark_text(value: f64) -> String {
    let short: f32 = format!("{value:.3e}").parse().unwrap_or(value as f32);
    match short.abs() {
        size if size < f32::MIN_POSITIVE => "0".to_owned(),
        size if (1e3..1e6).contains(&size) => count(value.round() as u64),
        size if (1e-3..1e3).contains(&size) => format!("{short}"),
        _ => format!("{short:e}"),
    }
}

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
    // Room for words above and below.
    let words = if mode.is_signed() { 14.0 } else { 0.0 };
    let at = rect.right_top() + vec2(-108.0, 58.0 + words);
    let painter = ui.painter().with_clip_rect(rect);
    let plate = Rect::from_min_size(
        at - vec2(14.0, 48.0 + words),
        vec2(114.0, SIZE.y + 78.0 + 2.0 * words),
    );
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
    let quantity = mode.false_color_quantity().to_owned();
    text(at - vec2(2.0, 42.0 + words), Align2::LEFT_TOP, quantity);
    text(
        at - vec2(2.0, 27.0 + words),
        Align2::LEFT_TOP,
        unit.to_owned(),
    );
    if mode.is_signed() {
        let above = at - vec2(2.0, 10.0);
        text(above, Align2::LEFT_BOTTOM, "too bright".to_owned());
        let below = at + vec2(-2.0, SIZE.y + 10.0);
        text(below, Align2::LEFT_TOP, "too dark".to_owned());
    }
    // The ramp, and the marks of what lies outside it.
    const BANDS: usize = 90;
    let band = SIZE.y / BANDS as f32;
    for index in 0..BANDS {
        let t = 1.0 - (index as f32 + 0.5) / BANDS as f32;
        let top = at + vec2(0.0, index as f32 * band);
        let rect = Rect::from_min_size(top, vec2(SIZE.x, band + 0.5));
        let color = if mode.is_signed() {
            theme::signed_color(t)
        } else {
            theme::ramp_color(t)
        };
        painter.rect_filled(rect, 0.0, color);
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
    let unit = match mode {
        mode if mode.shows_errors() => 1.0,
        _ => f64::from(state.radiance_unit()),
    };
    let scale = Scale {
        ends: state.false_color_range.map(|end| f64::from(end) * unit),
        is_logarithmic: state.view.logarithmic && !mode.is_signed(),
    };
    let stroke = Stroke::new(1.0, Color32::from_gray(225));
    for value in scale.marks() {
        let y = at.y + SIZE.y * (1.0 - scale.position(value) as f32);
        painter.hline(at.x + SIZE.x..=at.x + SIZE.x + 4.0, y, stroke);
        let place = pos2(at.x + SIZE.x + 8.0, y);
        text(place, Align2::LEFT_CENTER, mark_text(value));
    }
}

/// A scale in a panel: the colours of the ramp from `start` (0…1) on, marks with their values below, and the unit.
pub fn scale_ui(ui: &mut egui::Ui, scale: &Scale, unit: &str, start: f32) {
    const BAR_HEIGHT: f32 = 10.0;
    const BANDS: usize = 60;
    /// Room for half a value beside the bar, and for the unit behind it.
    const MARGINS: [f32; 2] = [14.0, 78.0];
    let size = vec2(ui.available_width(), 28.0);
    let (rect, _) = ui.allocate_exact_size(size, egui::Sense::hover());
    let bar = Rect::from_min_max(
        rect.left_top() + vec2(MARGINS[0], 0.0),
        pos2(rect.right() - MARGINS[1], rect.top() + BAR_HEIGHT),
    );
    let band = bar.width() / BANDS as f32;
    for index in 0..BANDS {
        let left = bar.left_top() + vec2(index as f32 * band, 0.0);
        let t = (index as f32 + 0.5) / BANDS as f32;
        let color = theme::ramp_color(start + (1.0 - start) * t);
        let plate = Rect::from_min_size(left, vec2(band + 0.5, BAR_HEIGHT));
        ui.painter().rect_filled(plate, 0.0, color);
    }
    let color = theme::secondary_text(ui.visuals());
    let font = FontId::proportional(11.0);
    let mut free_from = f32::NEG_INFINITY;
    for value in scale.marks() {
        let x = bar.left() + bar.width() * scale.position(value) as f32;
        let y = bar.bottom();
        ui.painter().vline(x, y..=y + 4.0, Stroke::new(1.0, color));
        let text = ui
            .painter()
            .layout_no_wrap(mark_text(value), font.clone(), color);
        let left = x - 0.5 * text.size().x;
        // Values that would touch the one before are omitted; their mark tells where they are.
        if left > free_from {
            free_from = left + text.size().x + 4.0;
            ui.painter().galley(pos2(left, y + 4.0), text, color);
        }
    }
    ui.painter().text(
        pos2(bar.right() + 10.0, bar.center().y),
        Align2::LEFT_CENTER,
        unit,
        font,
        color,
    );
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

#[cfg(test)]
mod tests {
    use super::*;

    fn marks(low: f64, high: f64, is_logarithmic: bool) -> Vec<String> {
        let scale = Scale {
            ends: [low, high],
            is_logarithmic,
        };
        scale.marks().into_iter().map(mark_text).collect()
    }

    #[test]
    fn logarithmic_scales_have_marks_at_decades() {
        assert_eq!(marks(0.004, 37.0, true), ["0.01", "0.1", "1", "10"]);
        assert_eq!(marks(0.01, 100.0, true), ["0.01", "0.1", "1", "10", "100"]);
        assert_eq!(marks(0.3, 6.0, true), ["0.5", "1", "2", "5"]);
        let many = marks(1e-9, 2e9, true);
        assert!(
            many.len() <= MOST_MARKS && many.contains(&"1e-9".to_owned()),
            "{many:?}"
        );
    }

    #[test]
    fn even_scales_have_round_marks() {
        assert_eq!(marks(0.0, 4.83, false), ["0", "1", "2", "3", "4"]);
        assert_eq!(
            marks(0.0, 1.0, false),
            ["0", "0.2", "0.4", "0.6", "0.8", "1"]
        );
        assert_eq!(
            marks(900.0, 6200.0, false).first().map(String::as_str),
            Some("2\u{2009}000")
        );
        // A logarithmic scale from 0 has no decades.
        assert_eq!(marks(0.0, 1.0, true), marks(0.0, 1.0, false));
    }

    #[test]
    fn scales_without_extent_have_few_marks_and_no_endless_ones() {
        for ends in [[0.0, 0.0], [3.0, 3.0], [1e-30, 1e-30], [1e30, 1e30]] {
            for is_logarithmic in [false, true] {
                let scale = Scale {
                    ends,
                    is_logarithmic,
                };
                let found = scale.marks();
                assert!(found.len() <= 3 * MOST_MARKS && found.iter().all(|mark| mark.is_finite()));
            }
        }
    }
}
