//! A point of a lit side of a triangle.

use glam::Vec3;

use crate::scene::TriangleId;

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
