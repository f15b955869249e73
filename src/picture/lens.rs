//! The rays of a camera.

use glam::{Vec2, Vec3};

/// Where a picture is seen from. Lengths in frame units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// The eye, or, where all rays are parallel, the middle of the plane that they start from.
    pub origin: Vec3,
    /// Direction to the middle of the picture, of any length.
    pub forward: Vec3,
    /// What the right edge differs by: in direction, or, where all rays are parallel, in position.
    pub right: Vec3,
    /// What the upper edge differs by, likewise.
    pub up: Vec3,
    /// Whether all rays are parallel.
    pub is_parallel: bool,
}

impl Lens {
    /// Origin and unit direction of the ray through a place of the picture; -1…1, y up.
    pub(super) fn ray(&self, place: Vec2) -> (Vec3, Vec3) {
        let offset = self.right * place.x + self.up * place.y;
        let (origin, direction) = match self.is_parallel {
            true => (self.origin + offset, self.forward),
            false => (self.origin, self.forward + offset),
        };
        (origin, direction.normalize_or(Vec3::NEG_Z))
    }

    /// Distance between neighbouring pixels of a picture of this height, on a surface square to a ray of this length.
    pub(super) fn spacing(&self, length: f32, height: u32) -> f32 {
        let step = 2.0 * self.up.length() / height.max(1) as f32;
        match self.is_parallel {
            true => step,
            false => step * length / self.forward.length(),
        }
    }
}
