//! The four channels of quantities of light.

use glam::{Vec3, Vec4};

use crate::scene::LUMINANCE;

/// Four channels travel together: red, green and blue, and beside them what a radiosity of 1 everywhere would give. The
/// fourth means something else for each kind of quantity, and has a name for each.
pub trait Channels: Copy {
    /// Red, green and blue.
    fn color(self) -> Vec3;

    /// Of any quantity: what it would be if everything had a radiosity of 1.
    fn unit_response(self) -> f32;

    /// Of radiosity: the part of the surface that sends and receives, 0…1; 0 within solids.
    fn active_share(self) -> f32;

    /// Of power: the area that sends it, projected where the power is, square frame units.
    fn area(self) -> f32;

    /// Of irradiance: the sum of form factors. It must be 1 in a closed scene.
    fn form_factor_sum(self) -> f32;
}

impl Channels for Vec4 {
    #[inline]
    fn color(self) -> Vec3 {
        self.truncate()
    }

    #[inline]
    fn unit_response(self) -> f32 {
        self.w
    }

    #[inline]
    fn active_share(self) -> f32 {
        self.w
    }

    #[inline]
    fn area(self) -> f32 {
        self.w
    }

    #[inline]
    fn form_factor_sum(self) -> f32 {
        self.w
    }
}

/// Luminance of linear RGB (Rec. 709), by which errors of colours are weighed; the fourth channel does not count.
pub fn luminance(color: Vec4) -> f32 {
    color.dot(LUMINANCE.extend(0.0))
}
