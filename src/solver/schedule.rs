//! The thresholds of the steps.

/// Factor by which the threshold falls from step to step. Larger, and steps come late; smaller, and judging old links
/// again costs more than the new ones.
pub(super) const THRESHOLD_FACTOR: f32 = 2.0;

/// Threshold scale from which a step is coarse: its links err by more than a few rays do. Smaller, and the first
/// pictures are rougher than their links; larger, and they come later.
const COARSE_THRESHOLD_SCALE: f32 = 4.0;

/// The threshold of a step (counted from 1) over that of the last of `step_count` steps; below 1 for steps beyond these.
pub(super) fn threshold_scale(step: u32, step_count: u32) -> f32 {
    THRESHOLD_FACTOR.powi(step_count as i32 - step as i32)
}

/// Whether a step of this threshold scale is coarse.
pub(super) fn is_coarse(threshold_scale: f32) -> bool {
    threshold_scale >= COARSE_THRESHOLD_SCALE
}
