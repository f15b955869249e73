//! Boxes, wide enough for what rounding hides.

use glam::Vec3;

/// By which part of the largest coordinate boxes are wider than what is in them, on either side. The corner of a triangle
/// as a ray sees it is off by six roundings at most, each half an epsilon of the coordinates of both: one of its difference
/// to the origin, three of the sheared part, two of what is left. Smaller, and a triangle may be met outside its box, so
/// that rays leak; larger, and flat boxes are met in vain.
pub(super) const ROUNDING: f32 = 4.0 * f32::EPSILON;

/// A box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub(super) low: Vec3,
    pub(super) high: Vec3,
}

impl Bounds {
    /// The box about a triangle, widened by its share of what rounding hides: the ray adds that of its origin.
    #[inline]
    pub(super) fn of([a, b, c]: [Vec3; 3]) -> Self {
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let widening = ROUNDING * low.abs().max(high.abs()).max_element() + f32::MIN_POSITIVE;
        Self {
            low: low - widening,
            high: high + widening,
        }
    }
}
