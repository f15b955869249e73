//! Means of textures over triangles and their parts, with what is cut out of them and what passes through.

use std::collections::HashMap;

use glam::{Vec2, Vec3};

use super::{
    Appearance, Cutout, CutoutId, Material, Scene, Texture, TextureId, TriangleId,
    texture::{MAX_SAMPLES, TextureAverage},
};

/// By what the textures of a material, its cut-outs and its opacity multiply its colours in the mean over some area; 1
/// where it is opaque and has no texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureMeans {
    /// Mean of `map_Kd`, 0 where it is cut out, times the opacity; linear RGB, at most 1.
    pub reflectance: Vec3,
    /// Mean of `map_Ke`, likewise.
    pub emission: Vec3,
    /// Mean part of the rays that meet the surface, 0…1.
    pub opacity: f32,
}

impl TextureMeans {
    /// Without textures.
    pub const ONE: Self = Self {
        reflectance: Vec3::ONE,
        emission: Vec3::ONE,
        opacity: 1.0,
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

/// The textures and cut-outs that materials use, ready for means over triangles.
#[derive(Debug, Default)]
pub(super) struct TextureAverages {
    /// By texture; `None` where no material shows all of it.
    list: Vec<Option<TextureAverage>>,
    /// Of what is left of textures, and of plain white, where materials are cut out.
    cut_out: HashMap<(Option<TextureId>, CutoutId), TextureAverage>,
}

/// The pictures of a scene.
#[derive(Clone, Copy)]
pub(super) struct Pictures<'a> {
    /// See [`Scene::textures`].
    pub(super) textures: &'a [Texture],
    /// See [`Scene::cutouts`].
    pub(super) cutouts: &'a [Cutout],
}

impl TextureAverages {
    /// Halve the textures that the materials use.
    pub(super) fn new(pictures: Pictures<'_>, materials: &[Material]) -> Self {
        let mut averages = Self {
            list: pictures.textures.iter().map(|_| None).collect(),
            cut_out: HashMap::new(),
        };
        for material in materials {
            let used = [material.reflectance_texture, material.emission_texture];
            if let Some(cutout) = material.cutout {
                for texture in used.into_iter().chain([None]) {
                    averages
                        .cut_out
                        .entry((texture, cutout))
                        .or_insert_with(|| pictures.cut_out(texture, cutout).halved());
                }
                continue;
            }
            for texture in used.into_iter().flatten().map(TextureId::index) {
                averages.list[texture]
                    .get_or_insert_with(|| TextureAverage::new(&pictures.textures[texture]));
            }
        }
        averages
    }

    /// Means of the textures of a material over a triangle of texture coordinates, if it has any.
    pub(super) fn over(
        &self,
        pictures: Pictures<'_>,
        material: &Material,
        uv: Option<[Vec2; 3]>,
        most_samples: f32,
    ) -> TextureMeans {
        let mut means = match (material.cutout, uv) {
            (Some(cutout), Some(uv)) => {
                self.over_cut_out(pictures, material, cutout, uv, most_samples)
            }
            _ => TextureMeans {
                reflectance: self.mean(pictures, material.reflectance_texture, uv, most_samples),
                emission: self.mean(pictures, material.emission_texture, uv, most_samples),
                opacity: 1.0,
            },
        };
        if material.opacity < 1.0 {
            means.reflectance *= material.opacity;
            means.emission *= material.opacity;
            means.opacity *= material.met_share();
        }
        means
    }

    /// Mean of a texture over a triangle of texture coordinates; 1 without either.
    fn mean(
        &self,
        pictures: Pictures<'_>,
        texture: Option<TextureId>,
        uv: Option<[Vec2; 3]>,
        most_samples: f32,
    ) -> Vec3 {
        let index = texture.map(TextureId::index);
        let average = index.and_then(|index| Some((index, self.list[index].as_ref()?)));
        match (average, uv) {
            (Some((index, average)), Some(uv)) => {
                let texture = &pictures.textures[index];
                let size = [texture.width, texture.height];
                average.over(size, |at| texture.sample(at), uv, most_samples)
            }
            _ => Vec3::ONE,
        }
    }

    /// Means of what a cut-out leaves of the textures of a material.
    fn over_cut_out(
        &self,
        pictures: Pictures<'_>,
        material: &Material,
        cutout: CutoutId,
        uv: [Vec2; 3],
        most_samples: f32,
    ) -> TextureMeans {
        let mean = |texture: Option<TextureId>| match self.cut_out.get(&(texture, cutout)) {
            Some(average) => {
                let left = pictures.cut_out(texture, cutout);
                average.over(left.size(), |at| left.at(at), uv, most_samples)
            }
            None => Vec3::ONE,
        };
        TextureMeans {
            reflectance: mean(material.reflectance_texture),
            emission: mean(material.emission_texture),
            opacity: mean(None).x,
        }
    }
}

impl<'a> Pictures<'a> {
    /// What a cut-out leaves of a texture, or of plain white.
    fn cut_out(self, texture: Option<TextureId>, cutout: CutoutId) -> CutOut<'a> {
        CutOut {
            texture: texture.map(|texture| &self.textures[texture.index()]),
            cutout: &self.cutouts[cutout.index()],
        }
    }
}

/// What a cut-out leaves of a texture, or of plain white.
struct CutOut<'a> {
    texture: Option<&'a Texture>,
    cutout: &'a Cutout,
}

impl CutOut<'_> {
    /// Width and height of pixels that are no larger than those of either.
    fn size(&self) -> [u32; 2] {
        let [width, height] = self
            .texture
            .map_or([1, 1], |texture| [texture.width, texture.height]);
        [width.max(self.cutout.width), height.max(self.cutout.height)]
    }

    /// Its colour at a texture coordinate; 0 where it is cut out.
    fn at(&self, uv: Vec2) -> Vec3 {
        match (self.cutout.has_at(uv), self.texture) {
            (false, _) => Vec3::ZERO,
            (true, None) => Vec3::ONE,
            (true, Some(texture)) => texture.sample(uv),
        }
    }

    /// Its halved copies.
    fn halved(&self) -> TextureAverage {
        let size = self.size();
        let [width, height] = size.map(|side| side as f32);
        TextureAverage::of(size, self.cutout.wrap, |column, row| {
            self.at(Vec2::new(
                (column as f32 + 0.5) / width,
                1.0 - (row as f32 + 0.5) / height,
            ))
        })
    }
}

impl Scene {
    /// Whether a texture may vary over a triangle: its corners show different places of one.
    pub fn is_textured(&self, triangle: TriangleId) -> bool {
        let material = self.material(triangle);
        let uv = self.texcoords.get(triangle.index());
        material.has_pictures() && uv.is_some_and(|[a, b, c]| a != b || b != c)
    }

    /// Means of the textures over a whole triangle.
    pub fn texture_means(&self, triangle: TriangleId) -> TextureMeans {
        let uv = self.texcoords.get(triangle.index()).copied();
        let material = self.material(triangle);
        self.averages
            .over(self.pictures(), material, uv, MAX_SAMPLES)
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
                .over(self.pictures(), material, Some(quarter), MAX_SAMPLES / 4.0)
        })
    }

    pub(super) fn pictures(&self) -> Pictures<'_> {
        Pictures {
            textures: &self.textures,
            cutouts: &self.cutouts,
        }
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
            ..Texture::default()
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
                    opacity: 1.0,
                }
            );
        }
    }
}
