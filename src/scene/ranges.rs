//! The ranges of reflectance and emission, and how values outside them are brought in.

use glam::Vec3;

/// Default of the largest reflectance. Nearer 1, light dies out slowly and errors grow; smaller, white paint is darkened.
pub(super) const DEFAULT_MAX_REFLECTANCE: f32 = 0.98;

/// Largest emission of a channel in units of the scene. The square of the power of a bright frame, with 1e5 square units
/// of area, must stay below what single precision holds: a much larger limit overflows. A smaller one scales scenes for
/// no reason: the surface of the sun has 2e7 W·sr⁻¹·m⁻².
pub(super) const MAX_EMISSION: f32 = 1e12;

/// Scenes whose brightest emission is smaller than this are scaled up. With a much smaller limit, squares of light that
/// has been reflected underflow; a larger one scales scenes for no reason.
pub(super) const MIN_BRIGHTEST_EMISSION: f32 = 1e-12;

/// A channel without negative and non-finite values, which become 0.
pub(super) fn finite_non_negative(channel: f32) -> f32 {
    if channel.is_finite() {
        channel.max(0.0)
    } else {
        0.0
    }
}

/// Reflectance from 0 to `max` in each channel; non-finite channels become 0.
pub(super) fn limited_reflectance(reflectance: Vec3, max: f32) -> Vec3 {
    reflectance.map(|channel| {
        if channel.is_finite() {
            channel.clamp(0.0, max)
        } else {
            0.0
        }
    })
}

/// Emission in units of the scene, at most [`MAX_EMISSION`] in any channel; emission above it keeps its colour.
pub(super) fn limited_emission(emission: Vec3) -> Vec3 {
    let emission = emission.map(finite_non_negative);
    let brightest = emission.max_element();
    if brightest > MAX_EMISSION {
        // Divided first, so that nothing overflows.
        emission / brightest * MAX_EMISSION
    } else {
        emission
    }
}
