//! Textures that a scene does not need: those that no face shows, and those that show one colour.
//!
//! Where all pixels that the faces of a material can show are alike, the picture becomes a part of the material's plain
//! colour: nothing is averaged, looked up or cut along its seams. Each material is judged by itself, by the box of its
//! texture coordinates; a picture goes once no material shows it.

use glam::Vec2;
use glam::Vec3;

use super::ranges::finite_non_negative;
use super::{Cutout, CutoutId, Face, SceneBuilder, Texture, TextureId, Wrap};

/// Pixels that differ by no more than this share of the first are of one colour: means of equal pixels are rounded.
const ALIKE: f32 = 1e-6;

/// Texture coordinates of the faces of a material.
#[derive(Clone, Copy, Debug, Default)]
struct View {
    /// Box of the texture coordinates, where a face has any.
    bounds: Option<[Vec2; 2]>,
    /// Whether a face has none: it has the colour of the material without the textures.
    has_bare_faces: bool,
}

impl View {
    fn add(&mut self, face: &Face) {
        let Some(uv) = face.texcoords else {
            self.has_bare_faces = true;
            return;
        };
        for at in uv {
            // Coordinates that are not finite are read as 0.
            let at = if at.is_finite() { at } else { Vec2::ZERO };
            let [min, max] = self.bounds.unwrap_or([at, at]);
            self.bounds = Some([min.min(at), max.max(at)]);
        }
    }
}

/// The treatment of a texture of a material.
enum Fate {
    Kept,
    Unused,
    Constant(Vec3),
}

impl SceneBuilder {
    /// Drop textures that no face shows, and replace those that are constant where faces show them by plain colours.
    /// For textures and materials within their ranges.
    pub(super) fn omit_textures(&mut self) {
        if self.textures.is_empty() && self.cutouts.is_empty() {
            return;
        }
        let mut views = vec![View::default(); self.materials.len()];
        for face in &self.faces {
            views[face.material.index()].add(face);
        }
        let before = self.omitted_textures;
        for (material, view) in self.materials.iter_mut().zip(&views) {
            let colors = [&mut material.reflectance, &mut material.emission];
            let slots = [
                &mut material.reflectance_texture,
                &mut material.emission_texture,
            ];
            for (slot, color) in slots.into_iter().zip(colors) {
                let Some(id) = *slot else { continue };
                match fate(&self.textures[id.index()], view) {
                    Fate::Kept => continue,
                    Fate::Unused => self.omitted_textures.unused_textures += 1,
                    Fate::Constant(of_texture) => {
                        *color = (*color * of_texture).map(finite_non_negative);
                        self.omitted_textures.constant_textures += 1;
                    }
                }
                *slot = None;
            }
            let is_whole = |id: &CutoutId| is_whole(&self.cutouts[id.index()], view);
            if material.cutout.is_some_and(|id| is_whole(&id)) {
                material.cutout = None;
                self.omitted_textures.constant_textures += 1;
            }
        }
        if self.omitted_textures != before {
            self.forget_unshown_textures();
        }
    }

    /// Drop textures and cut-outs without a material, and of texture coordinates without a texture.
    fn forget_unshown_textures(&mut self) {
        let mut renamed: Vec<Option<TextureId>> = vec![None; self.textures.len()];
        let mut kept: Vec<Texture> = Vec::new();
        for material in &mut self.materials {
            let slots = [
                &mut material.reflectance_texture,
                &mut material.emission_texture,
            ];
            for id in slots.into_iter().flatten() {
                let texture = &mut self.textures[id.index()];
                *id = *renamed[id.index()].get_or_insert_with(|| {
                    kept.push(std::mem::take(texture));
                    TextureId(kept.len() as u32 - 1)
                });
            }
        }
        self.textures = kept;
        let mut renamed: Vec<Option<CutoutId>> = vec![None; self.cutouts.len()];
        let mut kept: Vec<Cutout> = Vec::new();
        for id in self.materials.iter_mut().filter_map(|m| m.cutout.as_mut()) {
            let cutout = &mut self.cutouts[id.index()];
            *id = *renamed[id.index()].get_or_insert_with(|| {
                kept.push(std::mem::take(cutout));
                CutoutId(kept.len() as u32 - 1)
            });
        }
        self.cutouts = kept;
        for face in &mut self.faces {
            if !self.materials[face.material.index()].has_pictures() {
                face.texcoords = None;
            }
        }
    }
}

fn fate(texture: &Texture, view: &View) -> Fate {
    let Some([min, max]) = view.bounds else {
        return Fate::Unused;
    };
    if view.has_bare_faces {
        return Fate::Kept;
    }
    match constant(texture, min, max) {
        Some(color) => Fate::Constant(color),
        None => Fate::Kept,
    }
}

/// Whether faces show nothing of what is cut out: lookups that interpolate reach further than those of a cut-out.
fn is_whole(cutout: &Cutout, view: &View) -> bool {
    let Some([min, max]) = view.bounds else {
        return true;
    };
    let [across, down] = cutout.wrap;
    let columns = pixels_between(min.x, max.x, cutout.width, across);
    let rows = pixels_between(1.0 - max.y, 1.0 - min.y, cutout.height, down);
    let has_row = |row: u32| {
        (0..)
            .map_while(&columns)
            .all(|column| cutout.has(column, row))
    };
    (0..).map_while(&rows).all(has_row)
}

/// The colour of all pixels that lookups within a box of texture coordinates read, where it is one.
fn constant(texture: &Texture, min: Vec2, max: Vec2) -> Option<Vec3> {
    let [across, down] = texture.wrap;
    let columns = pixels_between(min.x, max.x, texture.width, across);
    let rows = pixels_between(1.0 - max.y, 1.0 - min.y, texture.height, down);
    let pixel = |column: u32, row: u32| {
        texture.pixels[row as usize * texture.width as usize + column as usize]
    };
    let first = pixel(columns(0)?, rows(0)?);
    let is_alike = |other: Vec3| (other - first).abs().cmple(first * ALIKE).all();
    for row in (0..).map_while(&rows) {
        if !(0..)
            .map_while(&columns)
            .all(|column| is_alike(pixel(column, row)))
        {
            return None;
        }
    }
    Some(first)
}

/// The pixels along an axis of so many that lookups between two coordinates read, by number; bilinear ones read two.
fn pixels_between(from: f32, to: f32, count: u32, wrap: Wrap) -> impl Fn(u32) -> Option<u32> {
    let pixel = |at: f32| (f64::from(at) * f64::from(count) - 0.5).floor() as i64;
    let (mut first, mut last) = (pixel(from), pixel(to).saturating_add(1));
    // After how many pixels it begins again.
    let period = i64::from(count) * if wrap == Wrap::Mirror { 2 } else { 1 };
    if wrap == Wrap::Clamp {
        (first, last) = (first.clamp(0, period - 1), last.clamp(0, period - 1));
    }
    let wanted = last.saturating_sub(first).saturating_add(1).min(period);
    move |number| {
        let number = i64::from(number);
        (number < wanted).then(|| wrap.pixel(first.saturating_add(number), count))
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::{Material, MaterialId, OmittedTextures, Scene, SceneOptions};

    /// Four by four pixels, blue but for a red one at the top left.
    fn spotted() -> Texture {
        let mut pixels = vec![Vec3::new(0.0, 0.0, 0.5); 16];
        pixels[0] = Vec3::new(0.5, 0.0, 0.0);
        Texture {
            name: "spotted".to_owned(),
            width: 4,
            height: 4,
            pixels,
            ..Texture::default()
        }
    }

    fn plain() -> Texture {
        let mut texture = spotted();
        texture.pixels.fill(Vec3::splat(0.25));
        texture
    }

    /// A triangle for each material: a texture and the texture coordinates.
    fn scene(textures: &[Texture; 2], faces: &[(u32, Option<[Vec2; 3]>)]) -> Scene {
        let mut builder = SceneBuilder {
            textures: textures.to_vec(),
            ..SceneBuilder::default()
        };
        for (number, &(texture, texcoords)) in faces.iter().enumerate() {
            let material = builder.push_material(Material {
                reflectance_texture: Some(TextureId(texture)),
                ..Material::plain("", Vec3::splat(0.8), Vec3::ONE)
            });
            let height = DVec3::Z * number as f64;
            let corners = [DVec3::ZERO, DVec3::X, DVec3::Y]
                .map(|corner| builder.push_position(corner + height));
            builder.push_triangle(corners, material);
            builder.faces[number].texcoords = texcoords;
        }
        builder.finish(&SceneOptions::default()).unwrap()
    }

    fn about(u: f32, v: f32) -> Option<[Vec2; 3]> {
        Some([[0.0, 0.0], [0.1, 0.0], [0.0, 0.1]].map(|at| Vec2::from(at) + Vec2::new(u, v)))
    }

    #[test]
    fn a_texture_of_one_colour_becomes_that_of_the_material_whatever_it_shows() {
        let whole = Some([Vec2::ZERO, Vec2::new(7.0, 0.0), Vec2::new(0.0, 9.0)]);
        let scene = scene(&[plain(), spotted()], &[(0, whole), (1, whole)]);
        assert_eq!(scene.materials[0].reflectance, Vec3::splat(0.2));
        assert_eq!(scene.surfaces[0].reflectance, Vec3::splat(0.2));
        assert_eq!(scene.materials[0].reflectance_texture, None);
        assert_eq!(scene.materials[1].reflectance_texture, Some(TextureId(0)));
        assert_eq!(scene.textures, [spotted()]);
        assert_eq!(scene.omitted_textures.constant_textures, 1);
    }

    #[test]
    fn only_what_is_shown_of_a_texture_must_be_constant() {
        let blue = Vec3::new(0.0, 0.0, 0.4);
        // The red pixel is at u 0…0.25, v 0.75…1; lookups reach half a pixel further, and over the edges.
        for (at, is_constant) in [
            (about(0.4, 0.4), true),
            (about(-3.6, 5.4), true),
            (about(0.1, 0.8), false),
            (about(0.3, 0.8), false),
            (about(0.9, 0.8), false),
            (about(0.9, 0.4), true),
            (about(0.1, 0.0), false),
        ] {
            let scene = scene(&[spotted(), plain()], &[(0, at)]);
            assert_eq!(scene.textures.is_empty(), is_constant, "{at:?}");
            assert_eq!(scene.texcoords.is_empty(), is_constant, "{at:?}");
            if is_constant {
                assert_eq!(scene.surfaces[0].reflectance, blue);
            }
        }
    }

    #[test]
    fn faces_without_coordinates_keep_the_colour_of_their_material() {
        let mut builder = SceneBuilder {
            textures: vec![plain()],
            ..SceneBuilder::default()
        };
        let material = builder.push_material(Material {
            reflectance_texture: Some(TextureId(0)),
            ..Material::plain("", Vec3::splat(0.8), Vec3::ONE)
        });
        for corner in [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z] {
            builder.push_position(corner);
        }
        builder.push_triangle([0, 1, 2], material);
        builder.push_triangle([0, 1, 3], MaterialId(0));
        let bare = builder.clone().finish(&SceneOptions::default()).unwrap();
        assert_eq!(bare.omitted_textures.unused_textures, 1);
        assert!(bare.textures.is_empty());
        builder.faces[0].texcoords = about(0.0, 0.0);
        let mixed = builder.finish(&SceneOptions::default()).unwrap();
        assert_eq!(
            (mixed.textures.len(), mixed.omitted_textures),
            (1, OmittedTextures::default())
        );
        for scene in [bare, mixed] {
            assert_eq!(scene.surfaces[1].reflectance, Vec3::splat(0.8));
        }
    }
}
