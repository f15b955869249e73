//! The frame in which a scene is computed: centred on the origin, its largest extent [`Frame::EXTENT`].
//!
//! Radiosity does not depend on scale, but single precision and the ray tree do: far from 1, rays miss silently.

use glam::{DVec3, Vec3};

/// Similarity between world coordinates (the file's) and frame coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// World point that becomes the origin.
    pub centre: DVec3,
    /// Frame units per world unit, above 0.
    pub scale: f64,
}

impl Frame {
    /// Largest extent of a scene in frame units.
    /// Much smaller, and ray tests on fine meshes underflow; much larger, and they overflow.
    pub const EXTENT: f64 = 100.0;

    /// The frame that fits a box of world coordinates. A box without extent keeps its scale.
    pub fn fitting(min: DVec3, max: DVec3) -> Self {
        let extent = (max - min).max_element();
        let scale = if extent > 0.0 && extent.is_finite() {
            Self::EXTENT / extent
        } else {
            1.0
        };
        Self {
            centre: min + (max - min) * 0.5,
            scale,
        }
    }

    /// World to frame.
    pub fn from_world(&self, point: DVec3) -> Vec3 {
        ((point - self.centre) * self.scale).as_vec3()
    }

    /// Frame to world.
    pub fn to_world(&self, point: Vec3) -> DVec3 {
        self.centre + point.as_dvec3() / self.scale
    }

    /// An area in frame units, in world units.
    pub fn area_to_world(&self, area: f64) -> f64 {
        area / (self.scale * self.scale)
    }
}
