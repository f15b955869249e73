//! The pictures of a glTF file, decoded once for each use that materials have for them.

use std::collections::HashMap;

use glam::Vec3;
use image::{DynamicImage, Primitive};

use super::buffers::Buffers;
use super::document::{Document, Image, TextureInfo};
use super::placement::Placement;
use super::printable;
use crate::scene::texture::{Role, decode_bytes};
use crate::scene::{CutoutId, SceneBuilder, Texture, TextureId, Wrap};

/// Pixels of all textures together, as for OBJ files: 768 MiB. The next picture gets a quarter of what is left.
const PIXEL_BUDGET: usize = 1 << 26;

/// Pixels of all cut-outs together, a bit each: 128 MiB.
const CUTOUT_BUDGET: usize = 1 << 30;

/// Uses of one picture at most. Each decodes it again, which a file with many materials may ask for without end; a scene
/// needs two or three.
const MAX_USES: usize = 8;

/// The meaning of the alpha of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Alpha {
    /// None.
    Ignored,
    /// What is less is not there; the bits of a number.
    CutBelow(u32),
    /// It is how much is seen.
    Seen,
}

/// What a picture is read for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Use {
    Reflects(Alpha),
    Emits,
    /// Only its means.
    Numbers,
}

/// A picture as it was read.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shown {
    /// Nothing where only means are asked for, or nothing is seen of it.
    pub(super) texture: Option<TextureId>,
    /// What is there of it; nothing where all is.
    pub(super) cutout: Option<CutoutId>,
    /// Mean colour, linear.
    pub(super) color: Vec3,
    /// Mean alpha.
    pub(super) alpha: f32,
    /// Means of red, green and blue as they are stored, 0…1; only where they are asked for.
    pub(super) numbers: Vec3,
}

/// Where a picture lies.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
enum Place {
    /// Buffer and offset.
    Buffer(usize, u64),
    Uri(String),
    /// In the text; the index of the image.
    Inline(usize),
}

/// A picture as one use of it reads it, or why that fails.
type ReadPicture = ((Use, [Wrap; 2]), Result<Shown, String>);

/// The pictures.
#[derive(Debug)]
pub(super) struct Pictures<'a> {
    document: &'a Document,
    read: HashMap<Place, Vec<ReadPicture>>,
    pixel_budget: usize,
    cutout_budget: usize,
}

impl<'a> Pictures<'a> {
    pub(super) fn new(document: &'a Document) -> Self {
        Self {
            document,
            read: HashMap::new(),
            pixel_budget: PIXEL_BUDGET,
            cutout_budget: CUTOUT_BUDGET,
        }
    }

    /// The picture of a texture, and its name.
    ///
    /// # Errors
    /// A clause with the reason.
    pub(super) fn read(
        &mut self,
        info: &TextureInfo,
        purpose: Use,
        buffers: &Buffers,
        builder: &mut SceneBuilder,
    ) -> (String, Result<Shown, String>) {
        let wrap = Placement::of(self.document, info).wrap;
        let texture = self.document.textures.get(info.index);
        let Some(index) = texture.and_then(|texture| texture.source) else {
            let reason = "has no picture in PNG or JPEG; export it so";
            return (info.index.to_string(), Err(reason.to_owned()));
        };
        let Some(image) = self.document.images.get(index) else {
            let reason = "names a picture that does not exist";
            return (info.index.to_string(), Err(reason.to_owned()));
        };
        let name = name_of(image, index);
        let place = self.place_of(image, index);
        let known = self.read.get(&place);
        if let Some((_, shown)) =
            known.and_then(|known| known.iter().find(|(of, _)| *of == (purpose, wrap)))
        {
            return (name, shown.clone());
        }
        let shown = if known.is_some_and(|known| known.len() >= MAX_USES) {
            Err("has too many uses".to_owned())
        } else {
            self.decode(image, &name, (purpose, wrap), buffers, builder)
        };
        let uses = self.read.entry(place).or_default();
        uses.push(((purpose, wrap), shown.clone()));
        (name, shown)
    }

    /// Where an image lies; two of one place are one picture.
    fn place_of(&self, image: &Image, index: usize) -> Place {
        let view = image.buffer_view;
        let view = view.and_then(|view| self.document.buffer_views.get(view));
        match (&image.uri, view) {
            (Some(uri), _) if !uri.starts_with("data:") => Place::Uri(uri.clone()),
            (None, Some(view)) => Place::Buffer(view.buffer, view.byte_offset),
            _ => Place::Inline(index),
        }
    }

    fn decode(
        &mut self,
        image: &Image,
        name: &str,
        (purpose, wrap): (Use, [Wrap; 2]),
        buffers: &Buffers,
        builder: &mut SceneBuilder,
    ) -> Result<Shown, String> {
        let picture = match (&image.uri, image.buffer_view) {
            (Some(uri), _) => decode_bytes(&buffers.file(uri)?),
            (None, Some(view)) => {
                let bytes = buffers.view(view);
                decode_bytes(bytes.map_err(|reason| format!("cannot be read ({reason})"))?)
            }
            (None, None) => return Err("has no data".to_owned()),
        };
        let picture = picture.map_err(|reason| format!("cannot be used: {reason}"))?;
        let numbers = match purpose {
            Use::Numbers => {
                return Ok(Shown {
                    texture: None,
                    cutout: None,
                    color: Vec3::ONE,
                    alpha: 1.0,
                    numbers: means(&picture),
                });
            }
            Use::Reflects(_) | Use::Emits => Vec3::ONE,
        };
        let (role, alpha) = match purpose {
            Use::Reflects(alpha) => (Role::Reflects, alpha),
            Use::Emits | Use::Numbers => (Role::Emits, Alpha::Ignored),
        };
        let (picture, alpha) = with_alpha(picture, alpha);
        let Some(picture) = Texture::from_picture(picture, name, role) else {
            // Nothing of it is seen.
            return Ok(Shown {
                texture: None,
                cutout: None,
                color: Vec3::ONE,
                alpha: 0.0,
                numbers,
            });
        };
        let picture = picture.wrapped(wrap);
        let mut color = Vec3::ONE;
        let texture = picture.texture.map(|texture| {
            let texture = texture.reduced_to(self.pixel_budget / 4);
            self.pixel_budget = self.pixel_budget.saturating_sub(texture.pixels.len());
            color = texture.mean();
            builder.textures.push(texture);
            TextureId(builder.textures.len() as u32 - 1)
        });
        let cutout = match picture.cutout {
            None => None,
            Some(cutout) => {
                let pixels = cutout.width as usize * cutout.height as usize;
                let left = self.cutout_budget.checked_sub(pixels);
                self.cutout_budget = left.ok_or("has more pixels than can be cut out")?;
                builder.cutouts.push(cutout);
                Some(CutoutId(builder.cutouts.len() as u32 - 1))
            }
        };
        Ok(Shown {
            texture,
            cutout,
            color,
            alpha,
            numbers,
        })
    }
}

/// The name of a picture in messages and lists.
fn name_of(image: &Image, index: usize) -> String {
    match &image.uri {
        Some(uri) if !uri.starts_with("data:") => printable(uri),
        _ if image.name.is_empty() => format!("picture {index}"),
        _ => printable(&image.name),
    }
}

/// Make pixels whole or nothing, by whether their alpha, 0…1, is at least this.
fn cut_below<T: Primitive>(pixels: &mut [T], least: f32)
where
    f32: From<T>,
{
    let whole = f32::from(T::DEFAULT_MAX_VALUE);
    for alpha in pixels.iter_mut().skip(3).step_by(4) {
        *alpha = match f32::from(*alpha) / whole >= least {
            true => T::DEFAULT_MAX_VALUE,
            false => T::DEFAULT_MIN_VALUE,
        };
    }
}

/// A picture whose alpha says what a cut-out takes from it, and its mean alpha.
fn with_alpha(picture: DynamicImage, alpha: Alpha) -> (DynamicImage, f32) {
    if !picture.color().has_alpha() {
        return (picture, 1.0);
    }
    let is_deep = picture.color().bytes_per_pixel() > 4 || picture.as_luma_alpha16().is_some();
    match (alpha, is_deep) {
        (Alpha::Ignored, false) => (picture.into_rgb8().into(), 1.0),
        (Alpha::Ignored, true) => (picture.into_rgb16().into(), 1.0),
        (Alpha::CutBelow(bits), false) => {
            let mut pixels = picture.into_rgba8();
            cut_below(&mut pixels, f32::from_bits(bits));
            (pixels.into(), 1.0)
        }
        (Alpha::CutBelow(bits), true) => {
            let mut pixels = picture.into_rgba16();
            cut_below(&mut pixels, f32::from_bits(bits));
            (pixels.into(), 1.0)
        }
        (Alpha::Seen, _) => {
            let pixels = picture.into_rgba8();
            let alphas = || pixels.iter().skip(3).step_by(4);
            let count = alphas().len().max(1);
            let sum: u64 = alphas().map(|&alpha| u64::from(alpha)).sum();
            let mean = sum as f64 / count as f64 / 255.0;
            let is_mixed =
                alphas().any(|&alpha| alpha >= 128) && alphas().any(|&alpha| alpha < 128);
            match is_mixed {
                true => (pixels.into(), 1.0),
                // A veil all over, and nothing that is cut out.
                false => (DynamicImage::from(pixels).into_rgb8().into(), mean as f32),
            }
        }
    }
}

/// Means of red, green and blue, 0…1.
fn means(picture: &DynamicImage) -> Vec3 {
    let pixels = picture.to_rgb8();
    let mut sums = [0_u64; 3];
    for pixel in pixels.pixels() {
        for (sum, &channel) in sums.iter_mut().zip(&pixel.0) {
            *sum += u64::from(channel);
        }
    }
    let count = pixels.pixels().len().max(1) as f64;
    Vec3::from_array(sums.map(|sum| (sum as f64 / count / 255.0) as f32))
}

#[cfg(test)]
mod tests {
    use image::{Rgba, RgbaImage};

    use super::*;

    fn alphas(alphas: [u8; 2]) -> DynamicImage {
        RgbaImage::from_fn(2, 1, |x, _| Rgba([200, 100, 0, alphas[x as usize]])).into()
    }

    #[test]
    fn alpha_cuts_veils_or_is_ignored() {
        let least = Alpha::CutBelow(0.25_f32.to_bits());
        for (meaning, given, expected, mean) in [
            (Alpha::Ignored, [0, 255], None, 1.0),
            (least, [63, 64], Some([0, 255]), 1.0),
            (Alpha::Seen, [0, 200], Some([0, 200]), 1.0),
            (Alpha::Seen, [51, 102], None, 0.3),
            (Alpha::Seen, [255, 255], None, 1.0),
        ] {
            let (picture, found) = with_alpha(alphas(given), meaning);
            let left = picture
                .as_rgba8()
                .map(|pixels| [0, 1].map(|x| pixels.get_pixel(x, 0).0[3]));
            assert_eq!(left, expected, "{meaning:?} {given:?}");
            assert!(
                (found - mean).abs() < 1e-3,
                "{meaning:?} {given:?}: {found}"
            );
        }
        let deep = DynamicImage::from(alphas([63, 64]).into_rgba16());
        let (deep, _) = with_alpha(deep, least);
        let deep = deep
            .as_rgba16()
            .map(|pixels| [0, 1].map(|x| pixels.get_pixel(x, 0).0[3]));
        assert_eq!(deep, Some([0, u16::MAX]));
    }
}
