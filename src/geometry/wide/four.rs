//! A leaf of the tree: up to four triangles that are tested at once.

use glam::{Vec3, Vec4};

use super::{bounds::Bounds, ray::Ray};

/// Triangles of a leaf at most.
pub(super) const LANES: usize = 4;

/// Up to four triangles, one a lane.
pub(super) struct FourTriangles {
    /// Coordinates by axis and corner; not a number in empty lanes, which nothing meets.
    corners: [[Vec4; 3]; 3],
    numbers: [u32; LANES],
}

impl FourTriangles {
    pub(super) fn empty() -> Self {
        Self {
            corners: [[Vec4::NAN; 3]; 3],
            numbers: [u32::MAX; LANES],
        }
    }

    pub(super) fn set(&mut self, lane: usize, number: u32, triangle: [Vec3; 3]) {
        for (corner, at) in triangle.into_iter().enumerate() {
            for (axis, corners) in self.corners.iter_mut().enumerate() {
                corners[corner][lane] = at[axis];
            }
        }
        self.numbers[lane] = number;
    }

    #[inline]
    fn corner(&self, lane: usize, corner: usize) -> Vec3 {
        let [x, y, z] = &self.corners;
        Vec3::new(x[corner][lane], y[corner][lane], z[corner][lane])
    }

    /// A bit for each triangle that the line of a ray passes through: seen along the ray, its three edges turn the same
    /// way about it, or it touches one. Not of those that are seen edge-on.
    #[inline]
    pub(super) fn lanes_met(&self, ray: &Ray) -> u32 {
        let [x, y, z] = ray.axes;
        let (xs, ys, zs) = (&self.corners[x], &self.corners[y], &self.corners[z]);
        let [origin_x, origin_y, origin_z] = ray.turned_origin;
        let [shear_x, shear_y] = ray.shear;
        // Corners relative to the ray, sheared so that it runs along the last axis.
        let seen = |corner: usize| {
            let z = zs[corner] - origin_z;
            let x = (xs[corner] - origin_x) - shear_x * z;
            let y = (ys[corner] - origin_y) - shear_y * z;
            (x, y)
        };
        let (a, b, c) = (seen(0), seen(1), seen(2));
        let turn = |from: (Vec4, Vec4), to: (Vec4, Vec4)| from.0 * to.1 - from.1 * to.0;
        let (first, second, third) = (turn(a, b), turn(b, c), turn(c, a));
        let none_right = first.min(second).min(third).cmpge(Vec4::ZERO);
        let none_left = first.max(second).max(third).cmple(Vec4::ZERO);
        none_right.bitmask() ^ none_left.bitmask()
    }

    /// The number of a triangle.
    #[inline]
    pub(super) fn number(&self, lane: usize) -> u32 {
        self.numbers[lane % LANES]
    }

    /// The distance at which the line of a ray passes through a triangle, and whether through its back. Infinite where
    /// it passes its box by.
    #[inline]
    pub(super) fn met(&self, lane: usize, ray: &Ray) -> (f32, bool) {
        let lane = lane % LANES;
        let (a, b, c) = (
            self.corner(lane, 0),
            self.corner(lane, 1),
            self.corner(lane, 2),
        );
        let [near, far] = ray.within(&Bounds::of([a, b, c]));
        let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let (a, b, c) = (a.as_dvec3(), b.as_dvec3(), c.as_dvec3());
        let normal = (b - a).cross(c - a);
        let along = normal.dot(direction);
        // Beside the triangle by less than rounding, an almost edge-on plane may be met far away; one that is exactly
        // edge-on gives no number, and `max` passes over that.
        let distance = (normal.dot(a - origin) / along) as f32;
        let distance = if near <= far {
            distance.max(near).min(far)
        } else {
            f32::INFINITY
        };
        (distance, along > 0.0)
    }
}
