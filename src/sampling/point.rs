//! A point of a lit side of a triangle.

use glam::Vec3;

use crate::scene::{Scene, TriangleId};

/// A point of a lit side of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The triangle it lies on.
    pub triangle: TriangleId,
    /// Whether it lies on the back of a two-sided triangle.
    pub is_back: bool,
    /// Its place in the triangle; sums to 1.
    pub barycentric: Vec3,
    /// Position in frame units.
    pub position: Vec3,
    /// Unit normal towards the lit side.
    pub normal: Vec3,
    /// Reflectance there.
    pub reflectance: Vec3,
    /// Emitted radiance there, W·sr⁻¹·m⁻².
    pub emission: Vec3,
}

impl SurfacePoint {
    /// The point of a side of a triangle at a place in it.
    pub fn at(scene: &Scene, triangle: TriangleId, is_back: bool, barycentric: Vec3) -> Self {
        let [a, b, c] = scene.corners(triangle);
        let front = scene.surfaces[triangle.index()]
            .area_vector
            .normalize_or_zero();
        Self {
            triangle,
            is_back,
            barycentric,
            position: a * barycentric.x + b * barycentric.y + c * barycentric.z,
            normal: if is_back { -front } else { front },
            reflectance: scene.reflectance_at(triangle, barycentric),
            emission: scene.emission_at(triangle, barycentric),
        }
    }
}
