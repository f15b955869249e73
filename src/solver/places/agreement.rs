//! Agreement of noisy values.

/// Weight of a neighbour whose value differs by `gap`, 0…1: ½ where the gap is `half_deviations` standard errors;
/// `variance` is the square of the standard error.
pub(crate) fn agreement(gap: f32, variance: f32, half_deviations: f32) -> f32 {
    let noise = variance * half_deviations * half_deviations;
    noise / (noise + gap * gap).max(f32::MIN_POSITIVE)
}
