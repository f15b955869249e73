//! Agreement of noisy values.

/// Weight of a neighbour whose value differs by `gap`, 0…1: ½ where the gap is `half_deviations` standard errors;
/// `variance` is the square of the standard error.
pub(crate) fn agreement(gap: f32, variance: f32, half_deviations: f32) -> f32 {
    let noise = variance * half_deviations * half_deviations;
    noise / (noise + gap * gap).max(f32::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_values_agree_and_half_deviations_count_half() {
        assert_eq!(agreement(0.0, 0.01, 3.0), 1.0);
        // The standard error is 0.1.
        assert!((agreement(0.3, 0.01, 3.0) - 0.5).abs() < 1e-6);
        assert!(agreement(3.0, 0.01, 3.0) < 0.01);
        assert_eq!(agreement(1.0, 0.0, 3.0), 0.0);
    }
}
