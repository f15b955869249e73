//! Textures that reflect, such that pixel and material together reflect no more than a surface may.
//!
//! Exporters write `Kd 1` beside a picture, so only the product counts: what the colour of a material has above the limit
//! goes into its copy of the picture, whose pixels end at 1.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use super::{SceneBuilder, Texture, TextureId, Warning, WarningKind};

/// Mean reflectance that a clamped texture may lose before it is worth a word: a step of the 8 bits that it is stored in.
/// Smaller, and every photograph with a white spot is named; larger, and white paper is darkened in silence.
const UNTOLD_LOSS: f32 = 1.0 / 255.0;

/// A texture as a material needs it: as it is, or its pixels times a factor (bit by bit) and at most 1.
type Variant = Option<[u32; 3]>;

impl SceneBuilder {
    /// Make materials with a texture reflect at most `max` in any pixel. Returns the names of those that lose by it.
    ///
    /// For textures that are consistent and whose pixels are finite.
    pub(super) fn limit_reflecting_textures(&mut self, max: f32) -> Vec<String> {
        // A texture may be shown by several materials, and emit.
        let mut variants: Vec<Vec<Variant>> = vec![Vec::new(); self.textures.len()];
        for id in self.materials.iter().filter_map(|m| m.emission_texture) {
            variants[id.index()] = vec![None];
        }
        let mut wanted = Vec::new();
        let mut losing = Vec::new();
        for material in &mut self.materials {
            let Some(id) = material.reflectance_texture else {
                wanted.push(None);
                continue;
            };
            let texture = &self.textures[id.index()];
            let is_above = |x: f32| x > max && x.is_finite() && max > 0.0;
            let factor = material
                .reflectance
                .map(|x| if is_above(x) { x / max } else { 1.0 });
            material.reflectance = material
                .reflectance
                .map(|x| if is_above(x) { max } else { x });
            let is_unchanged = factor == Vec3::ONE && most(texture) <= 1.0;
            let variant = (!is_unchanged).then(|| factor.to_array().map(f32::to_bits));
            if factor != Vec3::ONE && max * mean_loss(texture, factor) > UNTOLD_LOSS {
                losing.push(material.name.clone());
            }
            let variants = &mut variants[id.index()];
            if !variants.contains(&variant) {
                variants.push(variant);
                if factor == Vec3::ONE && !is_unchanged {
                    self.warnings.push(clamped_texture(texture));
                }
            }
            wanted.push(Some((id, variant)));
        }
        self.make_variants(&variants, &wanted);
        losing
    }

    /// Give each material the variant of its texture that it needs.
    fn make_variants(
        &mut self,
        variants: &[Vec<Variant>],
        wanted: &[Option<(TextureId, Variant)>],
    ) {
        let mut copies: HashMap<(TextureId, Variant), TextureId> = HashMap::new();
        for (material, wanted) in self.materials.iter_mut().zip(wanted) {
            let Some((id, variant)) = *wanted else {
                continue;
            };
            // The first takes the place of the original, which is not needed otherwise.
            if variants[id.index()][0] == variant {
                continue;
            }
            let textures = &mut self.textures;
            let copy = *copies.entry((id, variant)).or_insert_with(|| {
                let mut copy = textures[id.index()].clone();
                apply(variant, &mut copy);
                textures.push(copy);
                TextureId(textures.len() as u32 - 1)
            });
            material.reflectance_texture = Some(copy);
        }
        for (texture, variants) in self.textures.iter_mut().zip(variants) {
            if let Some(&first) = variants.first() {
                apply(first, texture);
            }
        }
    }
}

fn apply(variant: Variant, texture: &mut Texture) {
    if let Some(factor) = variant {
        let factor = Vec3::from_array(factor.map(f32::from_bits));
        for pixel in &mut texture.pixels {
            *pixel = (*pixel * factor).min(Vec3::ONE);
        }
    }
}

/// The brightest channel of a pixel.
fn most(texture: &Texture) -> f32 {
    let pixels = texture.pixels.iter();
    pixels.fold(0.0, |most, pixel| pixel.max_element().max(most))
}

/// Mean loss of the pixels when they are multiplied by the factor and clamped to 1; of the channel that loses most.
fn mean_loss(texture: &Texture, factor: Vec3) -> f32 {
    let excess = |pixel: &Vec3| (*pixel * factor - 1.0).max(Vec3::ZERO).as_dvec3();
    let sum: DVec3 = texture.pixels.iter().map(excess).sum();
    (sum / texture.pixels.len() as f64).max_element() as f32
}

fn clamped_texture(texture: &Texture) -> Warning {
    Warning {
        kind: WarningKind::ValueClamped,
        message: format!(
            "texture '{}': reflectance above 1 was clamped to 1",
            texture.name
        ),
        count: 1,
        place: None,
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;
    use crate::scene::{Face, Material, MaterialId, Scene, SceneOptions};

    /// A triangle for each material: its `Kd` and the grey pixels of its texture; equal textures are one.
    fn scene(materials: &[(f32, [f32; 2])], is_lamp: bool) -> Scene {
        let mut builder = SceneBuilder::default();
        for &(reflectance, pixels) in materials {
            let texture = Texture {
                name: "t".to_owned(),
                width: 2,
                height: 1,
                pixels: pixels.map(Vec3::splat).to_vec(),
                ..Texture::default()
            };
            let known = builder.textures.iter().position(|known| *known == texture);
            let id = known.unwrap_or_else(|| {
                builder.textures.push(texture);
                builder.textures.len() - 1
            });
            let id = Some(TextureId(id as u32));
            let material = builder.push_material(Material {
                reflectance_texture: id,
                emission_texture: id.filter(|_| is_lamp),
                ..Material::plain(
                    &format!("Kd {reflectance}"),
                    Vec3::splat(reflectance),
                    Vec3::ONE,
                )
            });
            let height = f64::from(material.0);
            let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]
                .map(|[x, y]| builder.push_position(DVec3::new(x, y, height)));
            builder.faces.push(Face {
                corners,
                texcoords: Some([Vec2::ZERO, Vec2::X, Vec2::Y]),
                normals: None,
                material: MaterialId(material.0),
                line: 0,
            });
        }
        builder.finish(&SceneOptions::default()).unwrap()
    }

    /// Reflectance of both pixels of a material.
    fn reflectances(scene: &Scene, material: usize) -> [f32; 2] {
        let material = &scene.materials[material];
        let texture = &scene.textures[material.reflectance_texture.unwrap().index()];
        [0, 1].map(|pixel| (material.reflectance * texture.pixels[pixel]).x)
    }

    fn clamped(scene: &Scene) -> Vec<String> {
        let warnings = scene.warnings.iter();
        let clamped = warnings.filter(|warning| warning.kind == WarningKind::ValueClamped);
        clamped.map(ToString::to_string).collect()
    }

    fn assert_near(found: [f32; 2], expected: [f32; 2]) {
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-6, "{found} for {expected}");
        }
    }

    #[test]
    fn only_the_product_of_colour_and_texture_is_clamped() {
        let brown = [0.3, 0.1];
        let scene = scene(
            &[
                (1.0, brown),
                (1.5, brown),
                (0.5, brown),
                (1.0, [1.0, 0.2]),
                (2.0, [0.6, 0.2]),
            ],
            true,
        );
        for (material, expected) in [
            [0.3, 0.1],
            [0.45, 0.15],
            [0.15, 0.05],
            [0.98, 0.2],
            [0.98, 0.4],
        ]
        .into_iter()
        .enumerate()
        {
            assert_near(reflectances(&scene, material), expected);
            let emitting = scene.materials[material].emission_texture.unwrap();
            assert!(
                scene.textures[emitting.index()].pixels[1].x <= 0.2,
                "as it was"
            );
        }
        let said = "material 'Kd 1': reflectance above 0.98 was clamped to it, since light must lose energy at every bounce (2 times)";
        assert_eq!(clamped(&scene), [said]);
    }

    #[test]
    fn a_texture_of_one_variant_is_not_copied() {
        let pixels = [0.5, 0.25];
        assert_eq!(
            scene(&[(1.0, pixels), (1.0, pixels)], false).textures.len(),
            1
        );
        assert_eq!(
            scene(&[(1.0, pixels), (0.5, pixels)], false).textures.len(),
            2
        );
        assert_eq!(scene(&[(1.0, pixels)], true).textures.len(), 2);
        assert_eq!(scene(&[(0.5, pixels)], true).textures.len(), 1);
    }

    #[test]
    fn bright_textures_end_at_1() {
        let scene = scene(&[(0.5, [40.0, 0.5])], false);
        assert_near(reflectances(&scene, 0), [0.5, 0.25]);
        assert_eq!(
            clamped(&scene),
            ["texture 't': reflectance above 1 was clamped to 1"]
        );
    }
}
