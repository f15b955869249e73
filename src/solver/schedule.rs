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

/// Elements of a large mesh. Smaller, and steps and links are spared that gain accuracy in milliseconds; larger, and meshes
/// that take seconds are treated as small ones.
const LARGE: usize = 1 << 15;

/// Whether a mesh of so many elements is worth the sparing of steps and links.
pub(super) fn is_large(elements: usize) -> bool {
    elements >= LARGE
}

/// Factor by which links grow as the threshold falls by [`THRESHOLD_FACTOR`], in furnished rooms. Smaller, and skipped
/// steps are found to have been needed; larger, and fewer are skipped.
const LINK_GROWTH: usize = 4;

/// Links of an element that take as long to find as what a step does for each element beside them. Smaller, and large
/// meshes are sampled and gathered over for steps that hardly change them; larger, and the first step with many links is
/// the last.
const LINKS_OF_ELEMENT: usize = 8;

/// The step after `step` (0 before the first). On large meshes steps are skipped while the links of the next one will cost
/// less than its elements do: a step takes as long as the mesh, however few its links are.
pub(super) fn next_step(step: u32, step_count: u32, links: usize, elements: usize) -> u32 {
    let mut next = step + 1;
    if step == 0 || !is_large(elements) {
        return next;
    }
    let most = LINKS_OF_ELEMENT * elements;
    let mut expected = links.max(1).saturating_mul(LINK_GROWTH);
    while next < step_count && expected.saturating_mul(LINK_GROWTH) <= most {
        expected *= LINK_GROWTH;
        next += 1;
    }
    next
}

/// Whether a step of this threshold scale is coarse.
pub(super) fn is_coarse(threshold_scale: f32) -> bool {
    threshold_scale >= COARSE_THRESHOLD_SCALE
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_skipped_only_where_links_are_few_for_the_mesh() {
        // The first step, and those of small meshes, come one by one.
        assert_eq!(next_step(0, 5, 0, 1_000_000), 1);
        assert_eq!(next_step(1, 5, 5_000, 2_000), 2);
        assert_eq!(next_step(1, 5, 500, 2_000), 2);
        // A large mesh: as many steps as cost less than it.
        assert_eq!(next_step(1, 3, 24_000, 220_000), 3);
        assert_eq!(next_step(1, 5, 24_000, 220_000), 4);
        assert_eq!(next_step(4, 5, 1_500_000, 220_000), 5);
        // Steps beyond the settings, towards an error.
        assert_eq!(next_step(1, 1, 0, 1_000_000), 2);
        assert_eq!(
            next_step(u32::MAX - 2, u32::MAX, usize::MAX, 1),
            u32::MAX - 1
        );
    }
}
