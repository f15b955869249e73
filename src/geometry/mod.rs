//! Shapes and rays: area vectors, the exact irradiance of a polygon, sampling, occlusion.
//! Everything here is in frame units and knows nothing of light.

mod polygon;
mod rays;
mod sampling;

pub use polygon::{irradiance_vector, point_irradiance};
pub use rays::{Hit, RayTree};
pub use sampling::{Random, cosine_direction, low_discrepancy_2d, triangle_point};

use glam::Vec3;

/// Area times unit normal of a triangle, by its winding.
pub fn area_vector([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a) * 0.5
}

/// Mean of the corners.
pub fn centroid([a, b, c]: [Vec3; 3]) -> Vec3 {
    (a + b + c) / 3.0
}
