//! Shapes and rays: area vectors, the exact irradiance of a polygon, sampling, occlusion.
//! Everything here is in frame units and knows nothing of light.

mod harmonics;
mod lanes;
mod mirrors;
mod panes;
mod polygon;
mod rays;
mod reflections;
mod sampling;
mod wide;

pub use harmonics::Harmonics;
pub use lanes::Vectors4;
pub use mirrors::{Image, Mirrors};
pub use polygon::{irradiance_vector, outline_irradiance, point_irradiance, point_irradiances};
pub use rays::{Hit, Passage, RAY_OFFSET, RayTree};
pub use reflections::Followed;
pub use sampling::{
    Random, Shuffle, SphericalTriangle, cosine_direction, hemisphere_direction, low_discrepancy_1d,
    low_discrepancy_2d, shuffled, sobol_2d, triangle_point,
};

use glam::Vec3;

/// Area times unit normal of a triangle, by its winding.
pub fn area_vector([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a) * 0.5
}

/// Mean of the corners.
pub fn centroid([a, b, c]: [Vec3; 3]) -> Vec3 {
    (a + b + c) / 3.0
}

/// Barycentric coordinates of the point of a triangle that lies nearest to `point` within its plane, moved inside
/// where rounding put it outside; sums to 1. A triangle without area gives the centroid.
pub fn barycentric(point: Vec3, corners: [Vec3; 3]) -> Vec3 {
    let raw = barycentric_in_plane(point, corners).max(Vec3::ZERO);
    let sum = raw.element_sum();
    if sum > 0.0 && sum.is_finite() {
        raw / sum
    } else {
        Vec3::splat(1.0 / 3.0)
    }
}

/// Barycentric coordinates of the projection of `point` onto the plane of a triangle; negative outside.
/// A triangle without area gives the centroid.
pub fn barycentric_in_plane(point: Vec3, [a, b, c]: [Vec3; 3]) -> Vec3 {
    let normal = (b - a).cross(c - a);
    let scale = normal.length_squared();
    if scale == 0.0 {
        return Vec3::splat(1.0 / 3.0);
    }
    let from_a = point - a;
    let second = from_a.cross(c - a).dot(normal) / scale;
    let third = (b - a).cross(from_a).dot(normal) / scale;
    Vec3::new(1.0 - second - third, second, third)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [Vec3; 3] = [
        Vec3::new(1.0, 0.0, 2.0),
        Vec3::new(3.0, 0.0, 2.0),
        Vec3::new(1.0, 4.0, 2.0),
    ];

    #[test]
    fn area_vector_points_to_the_front() {
        assert_eq!(area_vector(CORNERS), Vec3::new(0.0, 0.0, 4.0));
        let [a, b, c] = CORNERS;
        assert_eq!(area_vector([a, c, b]), Vec3::new(0.0, 0.0, -4.0));
        assert_eq!(area_vector([a, a, b]), Vec3::ZERO);
    }

    #[test]
    fn barycentric_inverts_interpolation() {
        let place = Vec3::new(0.2, 0.3, 0.5);
        let point = CORNERS[0] * place.x + CORNERS[1] * place.y + CORNERS[2] * place.z;
        assert!((barycentric(point + Vec3::Z, CORNERS) - place).length() < 1e-6);
        assert!(barycentric_in_plane(Vec3::ZERO, CORNERS).min_element() < 0.0);
        assert_eq!(
            barycentric(CORNERS[1] + Vec3::X, CORNERS).min_element(),
            0.0
        );
        let flat = [Vec3::ZERO, Vec3::X, Vec3::X * 2.0];
        assert_eq!(barycentric(Vec3::X, flat), Vec3::splat(1.0 / 3.0));
    }
}
