//! How a material reflects and emits, apart from its name and its textures.

use glam::Vec3;

use super::{
    Material,
    ranges::{limited_emission, limited_reflectance},
};

/// How a material reflects and emits, without its name and its textures. Linear RGB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Appearance {
    /// Diffuse reflectance (`Kd`); multiplies the texture.
    pub reflectance: Vec3,
    /// Emitted radiance (`Ke`) in units of [`super::Scene::radiance_unit`]; multiplies the texture.
    pub emission: Vec3,
}

impl Appearance {
    /// That of a material.
    pub fn of(material: &Material) -> Self {
        Self {
            reflectance: material.reflectance,
            emission: material.emission,
        }
    }

    /// Reflectance and emission brought into their ranges.
    pub(super) fn within(self, max_reflectance: f32) -> Self {
        Self {
            reflectance: limited_reflectance(self.reflectance, max_reflectance),
            emission: limited_emission(self.emission),
        }
    }
}
