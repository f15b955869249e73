//! A ray, and what the tests of boxes and triangles need of it, computed once.

use glam::{Vec3, Vec4};

use super::bounds::{Bounds, ROUNDING};

/// A ray from an origin; its direction need not be a unit vector.
pub(in super::super) struct Ray {
    /// Where it starts.
    pub origin: Vec3,
    /// Distances are in its lengths.
    pub direction: Vec3,
    pub(super) near: Planes,
    pub(super) far: Planes,
    /// By axis, which side of a box is met first: 0 the lower, 1 the upper one.
    pub(super) near_side: [usize; 3],
    /// The axis along which the direction is longest comes last.
    pub(super) axes: [usize; 3],
    /// Coordinates of the origin along these.
    pub(super) turned_origin: [Vec4; 3],
    /// Direction along the first two over that along the last.
    pub(super) shear: [Vec4; 2],
}

/// Distances along the ray of planes across the axes: (plane − origin) · inverse.
pub(super) struct Planes {
    origin: [Vec4; 3],
    inverse: [Vec4; 3],
}

/// Components of a direction below this count as this, so that nothing is divided by zero.
const LEAST: f32 = 1e-30;

impl Ray {
    #[inline]
    pub(in super::super) fn new(origin: Vec3, direction: Vec3) -> Self {
        let size = direction.abs();
        let inverse = Vec3::select(
            size.cmpgt(Vec3::splat(LEAST)),
            1.0 / direction,
            Vec3::splat(1.0 / LEAST).copysign(direction),
        );
        let widening = Vec3::splat(ROUNDING * origin.abs().max_element()).copysign(direction);
        let axes = if size.x >= size.y && size.x >= size.z {
            [1, 2, 0]
        } else if size.y >= size.z {
            [2, 0, 1]
        } else {
            [0, 1, 2]
        };
        let along = |vector: Vec3| {
            let all = vector.to_array();
            [all[axes[0]], all[axes[1]], all[axes[2]]]
        };
        let [x, y, z] = along(direction);
        let [origin_x, origin_y, origin_z] = along(origin);
        Self {
            origin,
            direction,
            // The quotients above and the products to come are each rounded once, and the differences in them.
            near: Planes::new(origin + widening, inverse * (1.0 - ROUNDING)),
            far: Planes::new(origin - widening, inverse * (1.0 + ROUNDING)),
            near_side: [
                usize::from(inverse.x < 0.0),
                usize::from(inverse.y < 0.0),
                usize::from(inverse.z < 0.0),
            ],
            axes,
            turned_origin: [
                Vec4::splat(origin_x),
                Vec4::splat(origin_y),
                Vec4::splat(origin_z),
            ],
            shear: [Vec4::splat(x / z), Vec4::splat(y / z)],
        }
    }

    /// Whether the ray is made of numbers that are not beyond all bounds.
    #[inline]
    pub(super) fn is_finite(&self) -> bool {
        (self.origin + self.direction).element_sum().is_finite()
    }

    /// The distances between which the ray is in a box; the first is the larger one if it passes by.
    #[inline]
    pub(super) fn within(&self, bounds: &Bounds) -> [f32; 2] {
        let sides = [bounds.low, bounds.high];
        let near = |axis: usize| {
            let plane = sides[self.near_side[axis] % 2][axis];
            (plane - self.near.origin[axis].x) * self.near.inverse[axis].x
        };
        let far = |axis: usize| {
            let plane = sides[(self.near_side[axis] + 1) % 2][axis];
            (plane - self.far.origin[axis].x) * self.far.inverse[axis].x
        };
        [
            near(0).max(near(1)).max(near(2)),
            far(0).min(far(1)).min(far(2)),
        ]
    }
}

impl Planes {
    #[inline]
    fn new(origin: Vec3, inverse: Vec3) -> Self {
        let splat = |vector: Vec3| {
            [
                Vec4::splat(vector.x),
                Vec4::splat(vector.y),
                Vec4::splat(vector.z),
            ]
        };
        Self {
            origin: splat(origin),
            inverse: splat(inverse),
        }
    }

    /// Distances of four planes across an axis.
    #[inline]
    pub(super) fn distances(&self, axis: usize, planes: Vec4) -> Vec4 {
        (planes - self.origin[axis]) * self.inverse[axis]
    }
}
