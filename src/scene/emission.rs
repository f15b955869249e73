//! How bright the solver's numbers are: any emission that single precision holds is brought into a range in which sums
//! and squares over a scene neither overflow nor vanish, and light is multiplied back on its way out.

use super::{
    SceneBuilder, TextureId,
    ranges::{MAX_EMISSION, MIN_BRIGHTEST_EMISSION},
};

impl SceneBuilder {
    /// Divide all emission by one power of two, so that the brightest comes into range, and return that: 1 where it is
    /// in range. For materials and textures without negative or infinite values.
    pub(super) fn scale_emission(&mut self) -> f32 {
        let factors = self.scale_textures();
        let mut is_used = vec![false; self.materials.len()];
        for face in &self.faces {
            is_used[face.material.index()] = true;
        }
        let emissions: Vec<_> = self
            .materials
            .iter()
            .map(|material| {
                let factor = material
                    .emission_texture
                    .map_or(1.0, |texture| factors[texture.index()].0);
                material.emission.as_dvec3() * factor
            })
            .collect();
        let mut brightest = 0.0f64;
        for ((material, emission), _) in self
            .materials
            .iter()
            .zip(&emissions)
            .zip(&is_used)
            .filter(|(_, is_used)| **is_used)
        {
            let of_texture = |texture: TextureId| f64::from(factors[texture.index()].1);
            // Faces without texture coordinates show the colour as it is.
            let most = material.emission_texture.map_or(1.0, of_texture).max(1.0);
            brightest = brightest.max(emission.max_element() * most);
        }
        let [least, most] = [MIN_BRIGHTEST_EMISSION, MAX_EMISSION].map(f64::from);
        let exponent = if brightest > most {
            (brightest / most).log2().ceil()
        } else if brightest > 0.0 && brightest < least {
            (brightest / least).log2().floor()
        } else {
            0.0
        };
        // Textures times their factors may be far outside single precision; so may be the result.
        let unit = exponent.clamp(-126.0, 127.0).exp2();
        for (material, emission) in self.materials.iter_mut().zip(emissions) {
            let largest = emission.max_element() / unit;
            let excess = (largest / most).max(1.0);
            material.emission = (emission / unit / excess).as_vec3();
        }
        unit as f32
    }

    /// Divide textures that are brighter than [`MAX_EMISSION`] by powers of two. By texture: by what, and its brightest channel
    /// then.
    fn scale_textures(&mut self) -> Vec<(f64, f32)> {
        let mut emits = vec![false; self.textures.len()];
        for texture in self
            .materials
            .iter()
            .filter_map(|material| material.emission_texture)
        {
            emits[texture.index()] = true;
        }
        self.textures
            .iter_mut()
            .zip(emits)
            .map(|(texture, emits)| {
                if !emits {
                    return (1.0, 1.0);
                }
                let channels = texture.pixels.iter().map(|pixel| pixel.max_element());
                let brightest = channels.fold(0.0, f32::max);
                if brightest <= MAX_EMISSION {
                    return (1.0, brightest);
                }
                let factor = f64::from(brightest).log2().ceil().exp2();
                for pixel in &mut texture.pixels {
                    *pixel = (pixel.as_dvec3() / factor).as_vec3();
                }
                (factor, (f64::from(brightest) / factor) as f32)
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec2, Vec3};

    use super::*;
    use crate::scene::{
        Appearance, Face, Material, MaterialId, Scene, SceneOptions, Texture, WarningKind,
    };

    /// A triangle for each emission; the first is under a texture of two pixels, where there is one.
    fn scene(emissions: &[Vec3], pixels: Option<[Vec3; 2]>) -> Scene {
        let mut builder = SceneBuilder::default();
        builder.textures.extend(pixels.map(|pixels| Texture {
            name: String::new(),
            width: 2,
            height: 1,
            pixels: pixels.to_vec(),
            ..Texture::default()
        }));
        for (number, &emission) in emissions.iter().enumerate() {
            let mut material = Material::plain("lamp", Vec3::ZERO, emission);
            material.emission_texture = (number == 0 && pixels.is_some()).then_some(TextureId(0));
            let material = builder.push_material(material);
            let corners = [DVec3::ZERO, DVec3::X, DVec3::Y]
                .map(|corner| builder.push_position(corner + DVec3::Z * number as f64));
            builder.faces.push(Face {
                corners,
                texcoords: Some([Vec2::ZERO, Vec2::X, Vec2::ONE]),
                normals: None,
                material,
                line: 0,
            });
        }
        builder
            .finish(&SceneOptions::default())
            .expect("it has faces")
    }

    fn assert_emission(scene: &Scene, triangle: usize, expected: DVec3) {
        let emission = scene.surfaces[triangle].emission;
        assert!(emission.max_element() <= MAX_EMISSION);
        let emission = emission.as_dvec3() * f64::from(scene.radiance_unit);
        let difference = (emission - expected).abs().max_element();
        assert!(
            difference <= 1e-6 * expected.max_element(),
            "{emission} for {expected}"
        );
    }

    #[test]
    fn any_emission_keeps_its_colour() {
        for most in [f32::MAX, 1e30, 1.1e12, 1e12, 7.0, 1e-12, 1e-20, 1e-36] {
            let [bright, dim] =
                [Vec3::new(1.0, 0.5, 0.0), Vec3::new(0.001, 0.0, 0.01)].map(|c| c * most);
            let scene = scene(&[dim, bright], None);
            assert_emission(&scene, 0, dim.as_dvec3());
            assert_emission(&scene, 1, bright.as_dvec3());
            let is_scaled = !(1e-12..=1e12).contains(&most);
            assert_eq!(scene.radiance_unit != 1.0, is_scaled, "{most}");
            assert!(scene.surfaces[1].emission.x >= 0.9 * MIN_BRIGHTEST_EMISSION);
            let clamped = |kind| kind == WarningKind::ValueClamped;
            assert!(!scene.warnings.iter().any(|warning| clamped(warning.kind)));
        }
    }

    #[test]
    fn bright_textures_and_their_factors_come_into_range_together() {
        for (emission, pixel) in [(1e20, 1e20), (1.0, 1e38), (1e-30, 1e30), (1e30, 1e-10)] {
            let pixels = [Vec3::new(pixel, 0.5 * pixel, 0.0); 2];
            let pixels = [pixels[0], pixels[1] * 0.5];
            let scene = scene(&[Vec3::splat(emission), Vec3::splat(1e-3)], Some(pixels));
            let mean = scene.surfaces[0].emission;
            assert!(mean.is_finite() && mean.x <= MAX_EMISSION);
            let mean = mean.as_dvec3() * f64::from(scene.radiance_unit);
            let share = mean.x / f64::from(emission) / f64::from(pixel);
            assert!(share > 0.5 && share < 1.0, "{share}");
            assert!((mean.y / mean.x - 0.5).abs() < 1e-6);
        }
        let brightest = scene(&[Vec3::splat(1e38)], Some([Vec3::splat(1e38); 2]));
        assert!(brightest.radiance_unit.is_finite());
        assert!(brightest.surfaces[0].emission.x <= MAX_EMISSION);
    }

    #[test]
    fn appearances_out_of_range_keep_their_colour() {
        let scene = scene(&[Vec3::ONE], None);
        let request = Appearance {
            reflectance: Vec3::ZERO,
            emission: Vec3::new(f32::MAX, 1e38, 0.0),
        };
        let allowed = scene.allowed(&[request])[0].emission;
        assert!(allowed.x <= MAX_EMISSION && allowed.x > 0.99 * MAX_EMISSION);
        assert!((allowed.y / allowed.x - 1e38 / f32::MAX).abs() < 1e-6);
        assert_eq!(scene.appearances().len(), 1);
        assert_eq!(scene.triangles[0].material, MaterialId(0));
    }
}
