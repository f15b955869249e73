//! Boxes, wide enough for what rounding hides.

use glam::Vec3;

/// Part of a coordinate by which boxes are wider than what is in them, on either side. Corners of a triangle relative to a
/// ray are off by at most three such units of single precision of the coordinates of both: one for the difference to the
/// origin, which counts once more where it is sheared, and four roundings there. Smaller, and a triangle might be met
/// outside its box; larger, and flat boxes are met in vain.
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
