//! How much of a scene's area counts when errors are measured against the whole.
//!
//! A ground plane of a hundred kilometres about a house holds nearly all of the area, and measured against that nothing
//! about the house would matter. So faces are sorted into classes by their longest edge, and of each class no more area
//! counts than [`MOST_RATIO`] times what all finer ones hold together. In usual scenes all of it counts.

use std::collections::BTreeMap;

/// Area of a class that counts at most, relative to that of all finer faces. Smaller, and a room with one small thing in
/// it is computed as finely as the thing; larger, and what stands on a huge ground is lost on it.
const MOST_RATIO: f64 = 1e3;

/// Finer faces that there must be before they limit the area of others: as many as a plate has. Fewer are a stray one.
const LEAST_FACES: usize = 2;

/// And their number as a share of all faces. Smaller, and a few stray slivers shrink the measure.
const LEAST_SHARE: f64 = 1e-3;

/// The classes of the faces of a scene.
#[derive(Clone, Debug, Default)]
pub struct SizeClasses {
    /// By class: the share of its area that counts, 0…1.
    shares: BTreeMap<i32, f64>,
    /// Sum of what counts, in the squared unit of the faces.
    pub area: f64,
}

impl SizeClasses {
    /// Sort faces, each given by its squared longest edge and its area, both finite and at least 0.
    pub fn new(faces: impl Iterator<Item = (f64, f64)>) -> Self {
        let mut classes: BTreeMap<i32, (f64, usize)> = BTreeMap::new();
        let mut count = 0;
        for (squared, area) in faces {
            let class = classes.entry(class(squared)).or_default();
            *class = (class.0 + area, class.1 + 1);
            count += 1;
        }
        let (mut sum, mut finer) = (0.0, 0);
        let mut shares = BTreeMap::new();
        for (class, (area, faces)) in classes {
            let limits = finer >= LEAST_FACES && finer as f64 >= LEAST_SHARE * f64::from(count);
            let counted = if limits && sum > 0.0 {
                area.min(MOST_RATIO * sum)
            } else {
                area
            };
            shares.insert(class, if area > 0.0 { counted / area } else { 1.0 });
            sum += counted;
            finer += faces;
        }
        Self { shares, area: sum }
    }

    /// The share of the area of faces with this squared longest edge that counts, 0…1.
    pub fn share(&self, squared: f64) -> f64 {
        self.shares.get(&class(squared)).copied().unwrap_or(1.0)
    }

    /// Whether the area of some faces does not count in full.
    pub fn is_limited(&self) -> bool {
        self.shares.values().any(|&share| share < 1.0)
    }

    /// Whether faces with this squared longest edge are finer than all whose area does not count in full.
    pub fn is_fine(&self, squared: f64) -> bool {
        let limited = self.shares.iter().find(|&(_, &share)| share < 1.0);
        limited.is_none_or(|(&first, _)| class(squared) < first)
    }
}

/// Each class has twice the edges of the one before.
fn class(squared: f64) -> i32 {
    (squared.max(f64::MIN_POSITIVE).log2() * 0.5).floor() as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Right triangles with these squared longest edges.
    fn classes(faces: &[(f64, usize)]) -> SizeClasses {
        let each = |&(squared, count): &(f64, usize)| {
            std::iter::repeat_n((squared, squared * 0.25), count)
        };
        SizeClasses::new(faces.iter().flat_map(each))
    }

    #[test]
    fn in_usual_scenes_all_area_counts() {
        let rooms: [&[(f64, usize)]; 5] = [
            &[(32.0, 12), (1.0, 24)],
            &[(32.0, 12), (1e-4, 40_000)],
            &[(32.0, 12), (1e-8, 1)],
            &[(32.0, 12_000), (1e-8, 8)],
            &[(1.0, 1)],
        ];
        for faces in rooms {
            let classes = classes(faces);
            assert!(!classes.is_limited(), "{faces:?}");
            let whole: f64 = faces.iter().map(|&(s, n)| s * 0.25 * n as f64).sum();
            assert!((classes.area - whole).abs() < 1e-9 * whole);
        }
    }

    #[test]
    fn a_huge_ground_does_not_drown_a_box() {
        for (edge, pieces) in [(1e10, 2), (1e14, 2), (1e6, 20_000), (1e10, 600)] {
            let classes = classes(&[(2.0, 400), (edge, pieces)]);
            let fine = 400.0 * 0.5;
            assert!(classes.area <= 1.000_1 * MOST_RATIO * fine + fine, "{edge}");
            assert!(classes.is_fine(2.0) && classes.share(2.0) >= 1.0);
            assert!(classes.area >= fine);
        }
        let one = classes(&[(2.0, 12), (1e14, 2)]);
        assert!(one.is_limited() && !one.is_fine(1e14) && one.share(1e14) < 1e-7);
    }
}
