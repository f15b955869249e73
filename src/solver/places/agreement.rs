//! How far values agree within their noise.

/// How much a neighbour counts whose value is off by a gap, 0…1: by half where that is so many standard errors, of which the
/// square is `variance`.
pub(crate) fn agreement(gap: f32, variance: f32, half_deviations: f32) -> f32 {
    let noise = variance * half_deviations * half_deviations;
    noise / (noise + gap * gap).max(f32::MIN_POSITIVE)
}
