//! Colours and spacing of the window and of pictures.

use std::sync::LazyLock;

use eframe::egui::{self, Color32};
use glam::Vec3;

use crate::scene::{linear_from_srgb, srgb_byte};

/// Display-linear lightness behind the scene in saved pictures and in the dark theme.
pub const PICTURE_BACKGROUND: f32 = 0.018;
/// Display-linear lightness of the backs of one-sided faces.
pub(super) const BACK_LIGHTNESS: f32 = 0.035;

/// Colour of what is selected, over the scene.
pub const SELECTED: Color32 = Color32::from_rgb(0xff, 0xb4, 0x3a);

/// Colour of the mark of the sun, over the scene.
pub const SUN: Color32 = Color32::from_rgb(0xff, 0xe0, 0x6a);

/// Colour of lines that mark the selection, display-linear.
pub const SELECTED_LINE: Vec3 = Vec3::new(1.0, 0.45, 0.04);
/// Colours of the arrows along x, y and z, display-linear.
pub const AXIS_LINES: [Vec3; 3] = [
    Vec3::new(0.85, 0.09, 0.08),
    Vec3::new(0.16, 0.6, 0.1),
    Vec3::new(0.1, 0.27, 0.95),
];

/// The false-colour ramp, evenly spaced, as sRGB: dark blue over green to light yellow, even in lightness.
/// The ends stay clear of the black and white that mark values outside the range.
const RAMP: [[u8; 3]; 9] = [
    [0x30, 0x12, 0x5a],
    [0x41, 0x3a, 0x92],
    [0x2f, 0x68, 0xa6],
    [0x1f, 0x90, 0x9a],
    [0x2f, 0xb0, 0x7a],
    [0x7c, 0xc9, 0x4f],
    [0xd0, 0xd0, 0x3a],
    [0xf5, 0xa5, 0x30],
    [0xe0, 0x4a, 0x2c],
];

/// The ramp of quantities with a sign, likewise: blue below 0, red above it.
const SIGNED_RAMP: [[u8; 3]; 9] = [
    [0x1c, 0x4f, 0xd8],
    [0x45, 0x72, 0xdc],
    [0x6b, 0x90, 0xdc],
    [0x8f, 0xa8, 0xcf],
    [0xa8, 0xa8, 0xa8],
    [0xcf, 0xa0, 0x90],
    [0xde, 0x80, 0x6b],
    [0xe0, 0x5a, 0x47],
    [0xd8, 0x24, 0x24],
];

/// A ramp, display-linear.
pub(super) fn ramp_stops(is_signed: bool) -> &'static [Vec3; 9] {
    type Stops = LazyLock<[Vec3; 9]>;
    static STOPS: Stops = LazyLock::new(|| RAMP.map(linear_color));
    static SIGNED_STOPS: Stops = LazyLock::new(|| SIGNED_RAMP.map(linear_color));
    if is_signed { &SIGNED_STOPS } else { &STOPS }
}

fn linear_color(color: [u8; 3]) -> Vec3 {
    Vec3::from_array(color.map(|byte| linear_from_srgb(f32::from(byte) / 255.0)))
}

/// Display-linear colour of the ramp at 0…1.
pub(super) fn ramp(t: f32) -> Vec3 {
    between(ramp_stops(false), t)
}

fn between(stops: &[Vec3; 9], t: f32) -> Vec3 {
    let at = t.clamp(0.0, 1.0) * (stops.len() - 1) as f32;
    let below = (at as usize).min(stops.len() - 2);
    stops[below].lerp(stops[below + 1], at - below as f32)
}

/// The ramp at 0…1 for the window.
pub fn ramp_color(t: f32) -> Color32 {
    display_color(ramp(t))
}

/// The ramp of quantities with a sign, likewise; 0 is at 0.5.
pub fn signed_color(t: f32) -> Color32 {
    display_color(between(ramp_stops(true), t))
}

fn display_color(linear: Vec3) -> Color32 {
    let [r, g, b] = linear.to_array().map(srgb_byte);
    Color32::from_rgb(r, g, b)
}

/// Colour of good news.
pub fn good(visuals: &egui::Visuals) -> Color32 {
    by_theme(visuals, [0x5b, 0xb9, 0x74], [0x1b, 0x74, 0x38])
}

/// Colour of warnings.
pub fn warning(visuals: &egui::Visuals) -> Color32 {
    by_theme(visuals, [0xe0, 0xa0, 0x30], [0x85, 0x58, 0x00])
}

/// Colour of errors.
pub fn bad(visuals: &egui::Visuals) -> Color32 {
    by_theme(visuals, [0xee, 0x6f, 0x69], [0xb3, 0x26, 0x1e])
}

/// Colour of what is selected, as text.
pub fn selected_text(visuals: &egui::Visuals) -> Color32 {
    by_theme(visuals, [0xff, 0xb4, 0x3a], [0x90, 0x55, 0x00])
}

fn by_theme(visuals: &egui::Visuals, dark: [u8; 3], light: [u8; 3]) -> Color32 {
    let [r, g, b] = if visuals.dark_mode { dark } else { light };
    Color32::from_rgb(r, g, b)
}

/// Colour of names beside figures: quieter than the figures, but easy to read.
pub fn secondary_text(visuals: &egui::Visuals) -> Color32 {
    if visuals.dark_mode {
        Color32::from_gray(150)
    } else {
        Color32::from_gray(88)
    }
}

/// Spacing and corners, for both themes.
pub fn apply(ctx: &egui::Context) {
    ctx.all_styles_mut(|style| {
        style.spacing.item_spacing = egui::vec2(8.0, 6.0);
        style.spacing.button_padding = egui::vec2(8.0, 4.0);
        style.spacing.slider_width = 120.0;
        style.spacing.interact_size.y = 22.0;
        style.spacing.indent = 14.0;
        // Scroll bars float; what they float over would be cut off.
        style.spacing.scroll.floating_allocated_width = 6.0;
        style.visuals.striped = false;
        style.visuals.weak_text_color = Some(secondary_text(&style.visuals));
        let text = if style.visuals.dark_mode { 212 } else { 30 };
        style.visuals.widgets.noninteractive.fg_stroke.color = Color32::from_gray(text);
        style.visuals.indent_has_left_vline = false;
    });
}

/// Colour of an axis in the window: x red, y green, z blue.
pub fn axis_color(axis: usize) -> Color32 {
    [
        Color32::from_rgb(0xec, 0x5b, 0x56),
        Color32::from_rgb(0x6c, 0xbf, 0x4c),
        Color32::from_rgb(0x5b, 0x8f, 0xf5),
    ][axis.min(2)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How much brighter one colour is than the other, 1…21 (WCAG 2).
    fn contrast(a: Color32, b: Color32) -> f32 {
        let luminance = |color: Color32| {
            let [r, g, b, _] = color
                .to_array()
                .map(|byte| linear_from_srgb(f32::from(byte) / 255.0));
            0.2126 * r + 0.7152 * g + 0.0722 * b + 0.05
        };
        let (a, b) = (luminance(a), luminance(b));
        a.max(b) / a.min(b)
    }

    #[test]
    fn coloured_text_can_be_read_in_both_themes() {
        for visuals in [egui::Visuals::dark(), egui::Visuals::light()] {
            for color in [good, warning, bad, selected_text, secondary_text] {
                let color = color(&visuals);
                let seen = contrast(color, visuals.panel_fill);
                // What WCAG 2 asks of text of this size.
                assert!(seen >= 4.5, "{color:?} {seen}");
            }
        }
    }
}
