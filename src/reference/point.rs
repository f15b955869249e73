//! A surface point at which a reference knows the light.

use glam::Vec3;

use crate::{sampling::SurfacePoint, scene::TriangleId};

/// A point of the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferencePoint {
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
    /// Irradiance, W/m²; 0 before the first pass.
    pub irradiance: Vec3,
    /// Standard error of the luminance of the irradiance, W/m².
    pub irradiance_error: f32,
    /// Standard error of the luminance of the radiance, W·sr⁻¹·m⁻².
    pub standard_error: f32,
}

impl From<SurfacePoint> for ReferencePoint {
    /// A point whose light is not yet known.
    fn from(point: SurfacePoint) -> Self {
        Self {
            triangle: point.triangle,
            is_back: point.is_back,
            barycentric: point.barycentric,
            position: point.position,
            normal: point.normal,
            reflectance: point.reflectance,
            emission: point.emission,
            irradiance: Vec3::ZERO,
            irradiance_error: 0.0,
            standard_error: 0.0,
        }
    }
}

impl ReferencePoint {
    /// Radiance that leaves the point, emitted and reflected, W·sr⁻¹·m⁻².
    pub fn radiance(&self) -> Vec3 {
        self.emission + self.reflectance * self.irradiance * std::f32::consts::FRAC_1_PI
    }
}
