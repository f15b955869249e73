//! The frame in which a scene is computed: what is lit lies about the origin and is about [`Frame::EXTENT`] large.
//!
//! Radiosity does not depend on scale, but single precision and the ray tree do: far from 1, rays miss silently, and where
//! a sky or a ground is much larger than what stands in it, that must lie where numbers are fine.

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

    /// Area times unit normal in frame units of a triangle in world coordinates.
    pub(super) fn area_vector(&self, [a, b, c]: [DVec3; 3]) -> Vec3 {
        ((b - a).cross(c - a) * (0.5 * self.scale * self.scale)).as_vec3()
    }

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

    /// The same frame with `detail` as its largest extent and a centre of its own, where that is smaller than a scene of
    /// this extent by far.
    pub fn focused(self, extent: f64, detail: f64, centre: impl FnOnce() -> DVec3) -> Self {
        let scale = Self::EXTENT / detail;
        if !(scale.is_finite() && detail < extent) {
            return self;
        }
        Self {
            centre: centre(),
            scale: scale.min(Self::MOST_EXTENT / extent),
        }
    }

    /// Largest extent of all surroundings in frame units. Larger, and products of distances overflow single precision.
    const MOST_EXTENT: f64 = 1e8;

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
