//! The thresholds of the steps.

/// The threshold falls by this factor from step to step. Larger, and steps come late; smaller, and judging old links
/// again costs more than the new ones.
pub(super) const THRESHOLD_FACTOR: f32 = 2.0;

/// Steps whose thresholds are at least this many times the last one's are coarse: their links err by more than a few rays
/// do. Smaller, and the first pictures come later; larger, and they are rougher than their links.
const COARSE_THRESHOLD_SCALE: f32 = 4.0;

/// By what the threshold of a step, counted from 1, is above that of the last of so many.
pub(super) fn threshold_scale(step: u32, step_count: u32) -> f32 {
    THRESHOLD_FACTOR.powi(step_count.saturating_sub(step) as i32)
}

/// Whether a step of this threshold scale is coarse.
pub(super) fn is_coarse(threshold_scale: f32) -> bool {
    threshold_scale >= COARSE_THRESHOLD_SCALE
}
