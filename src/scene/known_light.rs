//! The same triangles painted so that their light is known in closed form.

use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;

use super::{
    Environment, Material, Scene, Sky, Surface, Texture, TextureId, TriangleId,
    means::TextureAverages, ranges::limited_emission,
};

/// Least part of the emission of an evenly lit surface that its texture multiplies. Only surfaces that reflect everything
/// have less; smaller, and the quotient of their texture overflows.
const LEAST_EMISSION: f32 = 1e-6;

impl Scene {
    /// The scene in which radiance is 1 everywhere and in all directions, in units of [`Self::radiance_unit`]: all surfaces
    /// keep what they reflect and let pass, emit what they absorb, and a sky of radiance 1 is around them (Kirchhoff's law:
    /// an enclosure of one temperature). What sees the black back of a one-sided face gets less.
    ///
    /// A material of opacity 0 that colours what passes has nothing to emit with, and is colourless here.
    pub fn evenly_lit(&self) -> Self {
        let mut textures = self.textures.clone();
        let paint = |material: &Material| {
            let mut even = material.clone();
            if even.opacity <= 0.0 {
                even.filter = Vec3::ONE;
                even.emission = Vec3::ZERO;
                even.emission_texture = None;
                return even;
            }
            // By part of the surface that reflects and emits.
            let absorbing = (Vec3::ONE - even.transmission()) / even.opacity;
            let plain = (absorbing - even.reflectance).max(Vec3::splat(LEAST_EMISSION));
            even.emission = plain;
            even.emission_texture = even.reflectance_texture.map(|texture| {
                let reflecting = &self.textures[texture.index()];
                let emitting =
                    |&pixel: &Vec3| (absorbing - even.reflectance * pixel).max(Vec3::ZERO) / plain;
                textures.push(Texture {
                    pixels: reflecting.pixels.iter().map(emitting).collect(),
                    ..reflecting.clone()
                });
                TextureId(textures.len() as u32 - 1)
            });
            even
        };
        let materials = self.materials.iter().map(paint).collect();
        self.painted(materials, textures, Sky::Uniform(Vec3::ONE))
    }

    /// The scene with one reflectance everywhere, and this emission everywhere, or its own, in units of
    /// [`Self::radiance_unit`]; without sky and sun. What passes is colourless.
    pub fn with_one_reflectance(&self, reflectance: f32, emission: Option<Vec3>) -> Self {
        let paint = |material: &Material| {
            let mut plain = Material {
                reflectance: Vec3::splat(reflectance),
                reflectance_texture: None,
                filter: Vec3::ONE,
                ..material.clone()
            };
            if let Some(emission) = emission {
                (plain.emission, plain.emission_texture) = (emission, None);
            }
            plain
        };
        let materials = self.materials.iter().map(paint).collect();
        self.painted(materials, self.textures.clone(), Sky::Dark)
    }

    /// The same triangles with other materials, as many, under another sky.
    fn painted(&self, materials: Vec<Material>, textures: Vec<Texture>, sky: Sky) -> Self {
        let mut painted = Self {
            materials,
            textures,
            environment: Arc::new(Environment {
                sky,
                ..Environment::default()
            }),
            ..self.clone()
        };
        painted.averages = Arc::new(TextureAverages::new(painted.pictures(), &painted.materials));
        let appearances = painted.appearances();
        painted.surfaces = self
            .surfaces
            .par_iter()
            .enumerate()
            .with_min_len(4096)
            .map(|(index, surface)| {
                let triangle = TriangleId(index as u32);
                let of = self.triangles[index].material.index();
                let means = painted.texture_means(triangle);
                let shown = means.times(&appearances[of], self.max_reflectance);
                Surface {
                    area_vector: surface.area_vector,
                    reflectance: shown.reflectance,
                    emission: limited_emission(shown.emission),
                    opacity: means.opacity,
                }
            })
            .collect();
        painted
    }
}
