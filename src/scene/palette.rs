//! Colours of vertices, as far as a scene can hold them: each face has the mean of its corners, as a pixel of a picture
//! that holds the colours of all faces of its material.

use std::collections::HashMap;

use glam::{Vec2, Vec3};

use super::{MaterialId, SceneBuilder, Texture, TextureId};

/// Pixels in a row at most. Their middles must be told apart in single precision.
const MOST_COLUMNS: usize = 4096;

/// The colours of faces by material.
#[derive(Debug, Default)]
pub(super) struct Palettes {
    sheets: HashMap<MaterialId, Sheet>,
    /// Faces, and the material and number of the colour of each.
    faces: Vec<(usize, MaterialId, usize)>,
}

/// The colours of one material, in 16 bits a channel.
#[derive(Debug, Default)]
struct Sheet {
    colors: Vec<[u16; 3]>,
    numbers: HashMap<[u16; 3], usize>,
}

impl Palettes {
    /// Give a face the mean of the colours of its corners, linear.
    pub(super) fn paint(&mut self, face: usize, material: MaterialId, corners: [Vec3; 3]) {
        let mean = (corners[0] + corners[1] + corners[2]) / 3.0;
        let color = mean
            .to_array()
            .map(|channel| (channel.clamp(0.0, 1.0) * 65_535.0).round() as u16);
        let sheet = self.sheets.entry(material).or_default();
        let next = sheet.colors.len();
        let number = *sheet.numbers.entry(color).or_insert(next);
        if number == next {
            sheet.colors.push(color);
        }
        self.faces.push((face, material, number));
    }

    /// Make a picture of each sheet, and let the faces show it.
    pub(super) fn finish(self, builder: &mut SceneBuilder) {
        let mut sheets: Vec<(MaterialId, Sheet)> = self.sheets.into_iter().collect();
        sheets.sort_unstable_by_key(|(material, _)| *material);
        let mut sizes = HashMap::new();
        for (material, sheet) in sheets {
            let width = sheet.colors.len().clamp(1, MOST_COLUMNS);
            let height = sheet.colors.len().div_ceil(width);
            let linear = |color: &[u16; 3]| {
                Vec3::from_array(color.map(|channel| f32::from(channel) / 65_535.0))
            };
            let mut pixels: Vec<Vec3> = sheet.colors.iter().map(linear).collect();
            pixels.resize(width * height, Vec3::ZERO);
            let stated = &mut builder.materials[material.index()];
            stated.reflectance_texture = Some(TextureId(builder.textures.len() as u32));
            builder.textures.push(Texture {
                name: format!("vertex colours of {}", stated.name),
                width: width as u32,
                height: height as u32,
                pixels,
                ..Texture::default()
            });
            sizes.insert(material, [width, height]);
        }
        for (face, material, number) in self.faces {
            let [width, height] = sizes[&material];
            let middle = |at: usize, count: usize| (at as f32 + 0.5) / count as f32;
            let at = Vec2::new(
                middle(number % width, width),
                1.0 - middle(number / width, height),
            );
            builder.faces[face].texcoords = Some([at; 3]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, SceneOptions};
    use glam::DVec3;

    #[test]
    fn every_face_has_its_own_color() {
        let mut builder = SceneBuilder::default();
        let material = builder.push_material(Material::plain("m", Vec3::splat(0.5), Vec3::ZERO));
        let mut palettes = Palettes::default();
        // More colours than a row holds, and each twice.
        let colors: Vec<Vec3> = (0..5000)
            .map(|n| Vec3::new(n as f32 / 4999.0, 0.5, (n % 7) as f32 / 7.0))
            .collect();
        for (face, &color) in colors.iter().chain(&colors).enumerate() {
            let corners = [DVec3::ZERO, DVec3::X, DVec3::Y]
                .map(|corner| builder.push_position(corner + 2.0 * DVec3::X * face as f64));
            builder.push_triangle(corners, material);
            palettes.paint(face, material, [color; 3]);
        }
        palettes.finish(&mut builder);
        assert_eq!(builder.textures[0].pixels.len(), 2 * MOST_COLUMNS);
        let scene = builder.finish(&SceneOptions::default()).unwrap();
        for (triangle, color) in scene.triangle_ids().zip(colors.iter().chain(&colors)) {
            let found = scene.surfaces[triangle.index()].reflectance;
            assert!(
                (found - color.min(Vec3::ONE) * 0.5).abs().max_element() < 2e-4,
                "{found} for {color}"
            );
        }
    }
}
