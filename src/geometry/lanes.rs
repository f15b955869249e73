//! Four vectors at once, an axis to a register: every processor that this runs on computes four numbers at a time.

use glam::{BVec4A, Vec3, Vec4, Vec4Swizzles as _};

/// Four vectors or points, one a lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vectors4 {
    x: Vec4,
    y: Vec4,
    z: Vec4,
}

impl Vectors4 {
    /// From one vector a lane.
    #[inline]
    pub fn new([a, b, c, d]: [Vec3; 4]) -> Self {
        Self {
            x: Vec4::new(a.x, b.x, c.x, d.x),
            y: Vec4::new(a.y, b.y, c.y, d.y),
            z: Vec4::new(a.z, b.z, c.z, d.z),
        }
    }

    /// The same vector in all lanes.
    #[inline]
    pub fn splat(vector: Vec3) -> Self {
        Self {
            x: Vec4::splat(vector.x),
            y: Vec4::splat(vector.y),
            z: Vec4::splat(vector.z),
        }
    }

    /// Put a vector into a lane.
    #[inline]
    pub fn set(&mut self, lane: usize, vector: Vec3) {
        (self.x[lane], self.y[lane], self.z[lane]) = (vector.x, vector.y, vector.z);
    }

    /// The vector of each lane.
    pub fn to_array(&self) -> [Vec3; 4] {
        [0, 1, 2, 3].map(|lane| Vec3::new(self.x[lane], self.y[lane], self.z[lane]))
    }

    /// Dot products.
    #[inline]
    pub fn dot(&self, other: &Self) -> Vec4 {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// Cross products.
    #[inline]
    pub fn cross(&self, other: &Self) -> Self {
        Self {
            x: self.y * other.z - self.z * other.y,
            y: self.z * other.x - self.x * other.z,
            z: self.x * other.y - self.y * other.x,
        }
    }

    /// Where `share` is 0 this, where it is 1 the other.
    #[inline]
    pub(super) fn lerp(&self, other: &Self, share: Vec4) -> Self {
        Self {
            x: self.x + (other.x - self.x) * share,
            y: self.y + (other.y - self.y) * share,
            z: self.z + (other.z - self.z) * share,
        }
    }

    /// One lane after the other from one of two.
    #[inline]
    pub(super) fn select(mask: BVec4A, if_true: &Self, if_false: &Self) -> Self {
        Self {
            x: Vec4::select(mask, if_true.x, if_false.x),
            y: Vec4::select(mask, if_true.y, if_false.y),
            z: Vec4::select(mask, if_true.z, if_false.z),
        }
    }

    /// In each lane what the next has, in the last what the first has.
    #[inline]
    pub(super) fn rotated(&self) -> Self {
        Self {
            x: self.x.yzwx(),
            y: self.y.yzwx(),
            z: self.z.yzwx(),
        }
    }

    /// The sum of the lanes, each times its weight.
    #[inline]
    pub(super) fn weighted_sum(&self, weights: Vec4) -> Vec3 {
        Vec3::new(
            self.x.dot(weights),
            self.y.dot(weights),
            self.z.dot(weights),
        )
    }
}

impl std::ops::Div<Vec4> for Vectors4 {
    type Output = Self;

    /// Each vector by the number of its lane.
    #[inline]
    fn div(self, by: Vec4) -> Self {
        Self {
            x: self.x / by,
            y: self.y / by,
            z: self.z / by,
        }
    }
}

impl std::ops::Sub for Vectors4 {
    type Output = Self;

    #[inline]
    fn sub(self, other: Self) -> Self {
        Self {
            x: self.x - other.x,
            y: self.y - other.y,
            z: self.z - other.z,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Random;

    #[test]
    fn lanes_compute_what_vectors_do() {
        let mut random = Random::new(1, 0);
        let mut four =
            || [(); 4].map(|()| Vec3::from_array([(); 3].map(|()| random.uniform() - 0.5)));
        let (a, b) = (four(), four());
        let (these, those) = (Vectors4::new(a), Vectors4::new(b));
        let share = Vec4::new(0.0, 0.25, 0.5, 1.0);
        let mask = share.cmplt(Vec4::splat(0.3));
        assert_eq!(these.to_array(), a);
        assert_eq!(Vectors4::splat(b[2]).to_array(), [b[2]; 4]);
        assert_eq!(these.rotated().to_array(), [a[1], a[2], a[3], a[0]]);
        let mut changed = these;
        changed.set(2, b[0]);
        assert_eq!(changed.to_array(), [a[0], a[1], b[0], a[3]]);
        let mut sum = Vec3::ZERO;
        for lane in 0..4 {
            let close = |found: Vec3, expected: Vec3| {
                assert!(
                    (found - expected).length() < 1e-6,
                    "{lane}: {found} {expected}"
                );
            };
            assert!((these.dot(&those)[lane] - a[lane].dot(b[lane])).abs() < 1e-6);
            close(these.cross(&those).to_array()[lane], a[lane].cross(b[lane]));
            close((these - those).to_array()[lane], a[lane] - b[lane]);
            close(
                (these / (share + 1.0)).to_array()[lane],
                a[lane] / (share[lane] + 1.0),
            );
            let between = a[lane].lerp(b[lane], share[lane]);
            close(these.lerp(&those, share).to_array()[lane], between);
            let chosen = if lane < 2 { a[lane] } else { b[lane] };
            close(
                Vectors4::select(mask, &these, &those).to_array()[lane],
                chosen,
            );
            sum += a[lane] * share[lane];
        }
        assert!((these.weighted_sum(share) - sum).length() < 1e-6);
    }
}
