//! The same triangles painted so that their light is known in closed form.

use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;

use super::{
    Environment, Material, Scene, Sky, Specular, Surface, Texture, TextureId, TriangleId,
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
            // By part of the surface that reflects and emits, what is neither passed nor reflected in other ways.
            let most = match even.specular {
                Some(Specular::Mirror { .. }) => Vec3::ONE,
                _ => Vec3::splat(self.max_reflectance) - even.reflectance,
            };
            let specular = even.diffused_specular().min(most.max(Vec3::ZERO));
            let otherwise = even.transmission() + specular * even.met_share();
            let absorbing = (Vec3::ONE - otherwise) / even.opacity;
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
                specular: None,
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

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec2};

    use super::*;
    use crate::scene::{Cutout, CutoutId, Face, MaterialId, SceneBuilder, SceneOptions};

    /// A triangle of each material, under texture coordinates.
    fn scene(materials: Vec<Material>) -> Scene {
        let mut builder = SceneBuilder::default();
        builder.textures.push(Texture {
            name: String::new(),
            width: 4,
            height: 1,
            pixels: [0.1, 0.9, 0.4, 0.6]
                .map(|red| Vec3::new(red, 0.5, 1.0))
                .to_vec(),
            ..Texture::default()
        });
        builder
            .cutouts
            .push(Cutout::new("", [4, 1], |column, _| column < 2));
        for (number, material) in materials.into_iter().enumerate() {
            builder.push_material(material);
            let corners = [DVec3::ZERO, DVec3::X, DVec3::Y]
                .map(|corner| builder.push_position(corner + DVec3::Z * number as f64));
            builder.faces.push(Face {
                corners,
                texcoords: Some([Vec2::ZERO, Vec2::X * 0.8, Vec2::Y]),
                normals: None,
                material: MaterialId(number as u32),
                line: 0,
            });
        }
        builder.finish(&SceneOptions::default()).expect("faces")
    }

    fn materials() -> Vec<Material> {
        let grey = Material::plain("grey", Vec3::new(0.2, 0.5, 0.98), Vec3::splat(7.0));
        let painted = Material {
            reflectance_texture: Some(TextureId(0)),
            emission_texture: Some(TextureId(0)),
            ..grey.clone()
        };
        let glass = Material {
            opacity: 0.25,
            filter: Vec3::new(1.0, 0.5, 0.0),
            ..painted.clone()
        };
        let leaf = Material {
            cutout: Some(CutoutId(0)),
            ..painted.clone()
        };
        let air = Material {
            opacity: 0.0,
            filter: Vec3::X,
            ..grey.clone()
        };
        vec![grey, painted, glass, leaf, air]
    }

    #[test]
    fn an_evenly_lit_surface_emits_what_it_absorbs() {
        let own = scene(materials());
        let even = own.evenly_lit();
        for (index, triangle) in even.triangle_ids().enumerate() {
            let (surface, material) = (even.surfaces[index], &even.materials[index]);
            assert_eq!(surface.reflectance, own.surfaces[index].reflectance);
            // What is there, on average: the cut-out leaves a part of each pixel that the texture shows.
            let there = match material.cutout {
                Some(_) => surface.opacity,
                None => 1.0,
            };
            let sum = surface.emission + surface.reflectance + material.transmission();
            assert!(
                (sum - there).abs().max_element() < 1e-5,
                "{}: {sum}",
                material.name
            );
            // At points, of what rays meet there.
            for at in [Vec3::splat(1.0 / 3.0), Vec3::new(0.7, 0.1, 0.2), Vec3::X] {
                let met = even.emission_at(triangle, at) + even.reflectance_at(triangle, at);
                let seen = met * material.met_share() + material.transmission();
                assert!(
                    (seen - 1.0).abs().max_element() < 1e-5,
                    "{}: {seen}",
                    material.name
                );
            }
        }
        assert!(!even.environment.is_dark() && own.environment.is_dark());
    }

    #[test]
    fn one_reflectance_leaves_lamps_and_what_passes() {
        let own = scene(materials());
        let lit = own.with_one_reflectance(0.5, None);
        let bare = own.with_one_reflectance(0.5, Some(Vec3::ZERO));
        for (index, surface) in lit.surfaces.iter().enumerate() {
            assert_eq!(surface.emission, own.surfaces[index].emission);
            assert_eq!(bare.surfaces[index].emission, Vec3::ZERO);
            let expected = 0.5 * surface.opacity;
            assert!((surface.reflectance - expected).abs().max_element() < 1e-6);
        }
        assert!(!bare.has_light());
    }
}
