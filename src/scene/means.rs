//! Means of textures over triangles and their parts.

use glam::{Vec2, Vec3};

use super::{
    Appearance, Material, Scene, Texture, TextureId, TriangleId,
    texture::{MAX_SAMPLES, TextureAverage},
};

/// By what the textures of a material multiply its colours in the mean over some area; 1 where there is no texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureMeans {
    /// Mean of `map_Kd`, linear RGB, at most 1.
    pub reflectance: Vec3,
    /// Mean of `map_Ke`, linear RGB.
    pub emission: Vec3,
}

impl TextureMeans {
    /// Without textures.
    pub const ONE: Self = Self {
        reflectance: Vec3::ONE,
        emission: Vec3::ONE,
    };

    /// The mean appearance of a material there. Its reflectance is at most `most` per channel.
    pub fn times(&self, appearance: &Appearance, most: f32) -> Appearance {
        let reflectance = appearance.reflectance * self.reflectance;
        Appearance {
            reflectance: reflectance.clamp(Vec3::ZERO, Vec3::splat(most)),
            emission: appearance.emission * self.emission,
        }
    }
}

/// The textures that materials use, ready for means over triangles.
#[derive(Debug, Default)]
pub(super) struct TextureAverages {
    /// By texture; `None` where no material uses it.
    list: Vec<Option<TextureAverage>>,
}

impl TextureAverages {
    /// Halve the textures that the materials use.
    pub(super) fn new(textures: &[Texture], materials: &[Material]) -> Self {
        let mut list: Vec<Option<TextureAverage>> = textures.iter().map(|_| None).collect();
        for material in materials {
            let used = [material.reflectance_texture, material.emission_texture];
            for texture in used.into_iter().flatten().map(TextureId::index) {
                list[texture].get_or_insert_with(|| TextureAverage::new(&textures[texture]));
            }
        }
        Self { list }
    }

    /// Means of the textures of a material over a triangle of texture coordinates, if it has any.
    pub(super) fn over(
        &self,
        textures: &[Texture],
        material: &Material,
        uv: Option<[Vec2; 3]>,
        most_samples: f32,
    ) -> TextureMeans {
        let mean = |texture: Option<TextureId>| -> Vec3 {
            let index = texture.map(TextureId::index);
            let average = index.and_then(|index| Some((index, self.list[index].as_ref()?)));
            match (average, uv) {
                (Some((index, average)), Some(uv)) => {
                    average.over(&textures[index], uv, most_samples)
                }
                _ => Vec3::ONE,
            }
        };
        TextureMeans {
            reflectance: mean(material.reflectance_texture),
            emission: mean(material.emission_texture),
        }
    }
}

impl Scene {
    /// Whether a texture may vary over a triangle: its corners show different places of one.
    pub fn is_textured(&self, triangle: TriangleId) -> bool {
        let material = self.material(triangle);
        let texture = material.reflectance_texture.or(material.emission_texture);
        let uv = self.texcoords.get(triangle.index());
        texture.is_some() && uv.is_some_and(|[a, b, c]| a != b || b != c)
    }

    /// Means of the textures over a whole triangle.
    pub fn texture_means(&self, triangle: TriangleId) -> TextureMeans {
        let uv = self.texcoords.get(triangle.index()).copied();
        let material = self.material(triangle);
        self.averages
            .over(&self.textures, material, uv, MAX_SAMPLES)
    }

    /// Means of the textures over each quarter of a part of a triangle. The corners of the part are barycentric
    /// coordinates of the triangle; those of a quarter lie in the middle of its edges.
    pub fn texture_quarters(&self, triangle: TriangleId, part: [Vec3; 3]) -> [TextureMeans; 4] {
        let Some(uv) = self.texcoords.get(triangle.index()) else {
            return [TextureMeans::ONE; 4];
        };
        let place = |at: Vec3| uv[0] * at.x + uv[1] * at.y + uv[2] * at.z;
        let [a, b, c] = part.map(place);
        let [ab, bc, ca] = [a + b, b + c, c + a].map(|sum| sum * 0.5);
        let material = self.material(triangle);
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]].map(|quarter| {
            self.averages
                .over(&self.textures, material, Some(quarter), MAX_SAMPLES / 4.0)
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::{Face, MaterialId, SceneBuilder, SceneOptions};

    /// A triangle whose left half is white and whose right half is black in both textures.
    fn scene() -> Scene {
        let mut builder = SceneBuilder::default();
        let half = |x: usize| if x < 32 { Vec3::ONE } else { Vec3::ZERO };
        builder.textures.push(Texture {
            name: String::new(),
            width: 64,
            height: 1,
            pixels: (0..64).map(half).collect(),
        });
        builder.push_material(Material {
            reflectance_texture: Some(TextureId(0)),
            emission_texture: Some(TextureId(0)),
            ..Material::plain("m", Vec3::splat(0.5), Vec3::splat(3.0))
        });
        for corner in [DVec3::ZERO, DVec3::X, DVec3::Y] {
            builder.push_position(corner);
        }
        builder.faces.push(Face {
            corners: [0, 1, 2],
            // Away from the seam.
            texcoords: Some([
                Vec2::new(0.02, 0.5),
                Vec2::new(0.98, 0.5),
                Vec2::new(0.02, 0.5),
            ]),
            normals: None,
            material: MaterialId(0),
            line: 0,
        });
        builder.finish(&SceneOptions::default()).expect("one face")
    }

    #[test]
    fn quarters_tell_what_the_mean_does_not() {
        let scene = scene();
        assert!(scene.is_textured(TriangleId(0)));
        let whole = scene.texture_means(TriangleId(0));
        // Of the triangle 3/4 lie left of the middle of its base.
        assert!((whole.emission - 0.75).abs().max_element() < 0.02);
        let quarters = scene.texture_quarters(TriangleId(0), Vec3::AXES);
        for (quarter, expected) in quarters.iter().zip([1.0, 0.0, 1.0, 1.0]) {
            assert!((quarter.reflectance - expected).abs().max_element() < 0.03);
            assert_eq!(quarter.reflectance, quarter.emission);
        }
        let shown = quarters[0].times(&scene.appearances()[0], 0.25);
        assert!(shown.reflectance.abs_diff_eq(Vec3::splat(0.25), 1e-6));
        assert!((shown.emission - 3.0).abs().max_element() < 0.1);
    }

    #[test]
    fn a_part_of_a_part_is_looked_at_closely() {
        let scene = scene();
        // The right half of the base.
        let right = [
            Vec3::new(0.45, 0.55, 0.0),
            Vec3::Y,
            Vec3::new(0.4, 0.6, 0.0),
        ];
        for quarter in scene.texture_quarters(TriangleId(0), right) {
            assert_eq!(
                quarter,
                TextureMeans {
                    reflectance: Vec3::ZERO,
                    emission: Vec3::ZERO,
                }
            );
        }
    }
}
