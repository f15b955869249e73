//! Textures: linear RGB pixels, looked up bilinearly; and their reading from picture files.

use std::io::{BufRead, Cursor, Seek};
use std::ops::{AddAssign, Mul};
use std::path::Path;

use glam::{DVec3, Vec2, Vec3};
use image::{DynamicImage, ImageBuffer, ImageReader, Limits, Luma, Pixel, Primitive, Rgba};

use super::color::linear_from_srgb;
use super::cutout::LEAST_ALPHA;
use super::ranges::{MAX_EMISSION, finite_non_negative};
use super::{Cutout, Wrap};

/// A decoded picture in linear RGB. Row 0 is the top, so `v` = 1 is the top edge.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Texture {
    /// File name as the material gives it.
    pub name: String,
    /// Width in pixels, at least 1.
    pub width: u32,
    /// Height in pixels, at least 1.
    pub height: u32,
    /// `width · height` pixels, row by row from the top.
    pub pixels: Vec<Vec3>,
    /// How it goes on beyond its edges, along u and v.
    pub wrap: [Wrap; 2],
}

impl Texture {
    /// Bilinear value at a texture coordinate. One that is not finite reads as 0.
    pub fn sample(&self, uv: Vec2) -> Vec3 {
        let uv = if uv.is_finite() { uv } else { Vec2::ZERO };
        let [across, down] = self.wrap;
        let x = across.place(uv.x) * self.width as f32 - 0.5;
        let y = down.place(1.0 - uv.y) * self.height as f32 - 0.5;
        let (column, row) = (x.floor(), y.floor());
        let (fx, fy) = (x - column, y - row);
        let pixel = |dx: i64, dy: i64| {
            let i = across.pixel(column as i64 + dx, self.width);
            let j = down.pixel(row as i64 + dy, self.height);
            self.pixels[j as usize * self.width as usize + i as usize]
        };
        let top = pixel(0, 0).lerp(pixel(1, 0), fx);
        let bottom = pixel(0, 1).lerp(pixel(1, 1), fx);
        top.lerp(bottom, fy)
    }
}

/// Textures that were omitted while a scene was read. Of a picture that several materials name, each name counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OmittedTextures {
    /// Of one colour, which the material has instead.
    pub constant_textures: usize,
    /// Shown by no face.
    pub unused_textures: usize,
}

/// Pixels kept of one picture; larger ones are averaged down. Light needs means, and twelve bytes a pixel add up.
const MAX_PIXELS: usize = 1 << 24;

/// Longest side of a picture that is decoded.
const MAX_SIDE: u32 = 16_384;

/// Bytes that decoding one picture may take: 16384² pixels of four bytes.
const MAX_DECODED_BYTES: u64 = 1 << 30;

impl Texture {
    /// Read a picture file: 8 and 16 bits a channel are sRGB, floats are linear.
    ///
    /// # Errors
    /// A clause with the reason why there is no picture.
    pub(super) fn read(path: &Path, name: &str, role: Role) -> Result<Picture, String> {
        let decoded = std::panic::catch_unwind(|| decode(path));
        match decoded {
            Ok(Ok(picture)) if picture.width() > 0 && picture.height() > 0 => {
                if role == Role::CutsOut {
                    return Ok(cutting(picture, name));
                }
                Self::from_picture(picture, name, role)
                    .ok_or_else(|| "all of it is transparent".to_owned())
            }
            Ok(Ok(_)) => Err("it has no pixels".to_owned()),
            Ok(Err(error)) => Err(error.to_string()),
            Err(_) => Err("its decoder failed".to_owned()),
        }
    }

    /// Read a picture file of floats as radiance, whatever its alpha.
    ///
    /// # Errors
    /// Where it cannot be decoded, or has bytes.
    pub(super) fn read_radiance(path: &Path, name: &str) -> Result<RadiancePicture, RadianceError> {
        let decoded = std::panic::catch_unwind(|| decode(path));
        let pixels = match decoded {
            Ok(Ok(DynamicImage::ImageRgb32F(pixels))) => pixels,
            Ok(Ok(picture @ DynamicImage::ImageRgba32F(_))) => picture.into_rgb32f(),
            Ok(Ok(_)) => return Err(RadianceError::NotLinear),
            Ok(Err(error)) => return Err(RadianceError::Unreadable(error.to_string())),
            Err(_) => return Err(RadianceError::Unreadable("its decoder failed".to_owned())),
        };
        if pixels.is_empty() {
            return Err(RadianceError::Unreadable("it has no pixels".to_owned()));
        }
        let is_bad = |channel: &f32| !(0.0..f32::INFINITY).contains(channel);
        let corrected = pixels.pixels().filter(|pixel| pixel.0.iter().any(is_bad));
        let radiance = |channel| finite_non_negative(channel).min(MAX_EMISSION);
        Ok(RadiancePicture {
            corrected: corrected.count(),
            size: [pixels.width(), pixels.height()],
            texture: averaged(&pixels, |pixel| color_of(pixel.0, radiance)).into_texture(name),
        })
    }

    /// Linear pixels of a picture, averaged down on the way where it is large: a picture of a few hundred kilobytes
    /// may hold pixels for gigabytes. Nothing where no pixel shows what it reflects.
    pub(super) fn from_picture(picture: DynamicImage, name: &str, role: Role) -> Option<Picture> {
        let table: Vec<f32> = (0..=255_u8)
            .map(|x| linear_from_srgb(f32::from(x) / 255.0))
            .collect();
        let byte = |x: u8| table[usize::from(x)];
        let word = |x: u16| linear_from_srgb(f32::from(x) / 65_535.0);
        let texture = match picture {
            DynamicImage::ImageLuma8(pixels) => {
                averaged(&pixels, |pixel| Vec3::splat(byte(pixel.0[0]))).into_texture(name)
            }
            DynamicImage::ImageLumaA8(_) | DynamicImage::ImageRgba8(_) => {
                let share = |alpha: u8| f32::from(alpha) / 255.0;
                return covered(&picture.into_rgba8(), name, role, byte, share);
            }
            DynamicImage::ImageLumaA16(_) | DynamicImage::ImageRgba16(_) => {
                let share = |alpha: u16| f32::from(alpha) / 65_535.0;
                return covered(&picture.into_rgba16(), name, role, word, share);
            }
            DynamicImage::ImageRgba32F(pixels) => {
                // NaN counts as opaque.
                let share = |alpha: f32| if alpha < 1.0 { alpha.max(0.0) } else { 1.0 };
                return covered(&pixels, name, role, finite_non_negative, share);
            }
            DynamicImage::ImageLuma16(_) | DynamicImage::ImageRgb16(_) => {
                averaged(&picture.into_rgb16(), |pixel| color_of(pixel.0, word)).into_texture(name)
            }
            DynamicImage::ImageRgb32F(pixels) => {
                averaged(&pixels, |pixel| color_of(pixel.0, finite_non_negative)).into_texture(name)
            }
            // Takes no copy where it is of this kind already.
            _ => averaged(&picture.into_rgb8(), |pixel| color_of(pixel.0, byte)).into_texture(name),
        };
        Some(Picture {
            texture: Some(texture),
            is_transparent: false,
            cutout: None,
        })
    }

    /// Mean of all pixels.
    pub(super) fn mean(&self) -> Vec3 {
        let sum: DVec3 = self.pixels.iter().map(|pixel| pixel.as_dvec3()).sum();
        (sum / self.pixels.len().max(1) as f64).as_vec3()
    }

    /// The picture with sides halved until it has at most so many pixels, but at least one.
    pub fn reduced_to(mut self, max_pixels: usize) -> Self {
        while self.pixels.len() > max_pixels.max(1) {
            self = self.halved();
        }
        self
    }

    /// The picture with both sides halved (rounded up), each pixel the mean of four.
    pub(super) fn halved(&self) -> Self {
        let half = half([self.width, self.height], |column, row| {
            self.pixels[row as usize * self.width as usize + column as usize]
        });
        Self {
            name: self.name.clone(),
            wrap: self.wrap,
            ..half
        }
    }

    /// Whether the size and the pixels agree, so that looking up cannot fail.
    pub(super) fn is_consistent(&self) -> bool {
        let count = self.width as usize * self.height as usize;
        count > 0 && count == self.pixels.len()
    }
}

/// A nameless picture of half the width and height (rounded up), each pixel the mean of four of those that `pixel` gives
/// by column and row.
fn half([full_width, full_height]: [u32; 2], pixel: impl Fn(u32, u32) -> Vec3) -> Texture {
    let (width, height) = (full_width.div_ceil(2), full_height.div_ceil(2));
    let pixel = |column: u32, row: u32| pixel(column.min(full_width - 1), row.min(full_height - 1));
    let mut pixels = Vec::with_capacity(width as usize * height as usize);
    for row in 0..height {
        for column in 0..width {
            let (x, y) = (2 * column, 2 * row);
            let sum = pixel(x, y) + pixel(x + 1, y) + pixel(x, y + 1) + pixel(x + 1, y + 1);
            pixels.push(sum * 0.25);
        }
    }
    Texture {
        name: String::new(),
        width,
        height,
        pixels,
        ..Texture::default()
    }
}

/// Red, green and blue of a pixel, each turned into a linear value.
fn color_of<T: Copy, const N: usize>(channels: [T; N], linear: impl Fn(T) -> f32) -> Vec3 {
    let [red, green, blue] = [0, 1, 2].map(|channel| linear(channels[channel]));
    Vec3::new(red, green, blue)
}

/// The role of a picture, which decides the meaning of its transparent pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Role {
    /// It reflects: hidden pixels have the mean colour of the others, so that none is too bright or dark by what nobody
    /// was to see.
    Reflects,
    /// It emits: hidden pixels are black.
    Emits,
    /// It has no colour, but is cut out where its alpha, or its brightness where that is 1, is small.
    CutsOut,
}

impl Role {
    /// The other one of those with a colour.
    pub(super) fn other(self) -> Option<Self> {
        match self {
            Self::Reflects => Some(Self::Emits),
            Self::Emits => Some(Self::Reflects),
            Self::CutsOut => None,
        }
    }
}

/// A picture as it is read.
pub(super) struct Picture {
    /// Its colours; nothing where it only cuts out.
    pub(super) texture: Option<Texture>,
    /// Whether any pixel is transparent, in full or in part.
    pub(super) is_transparent: bool,
    /// What is there of it; nothing where all is.
    pub(super) cutout: Option<Cutout>,
}

impl Picture {
    /// The picture that goes on in these ways beyond its edges, along u and v.
    pub(super) fn wrapped(mut self, wrap: [Wrap; 2]) -> Self {
        if let Some(texture) = &mut self.texture {
            texture.wrap = wrap;
        }
        if let Some(cutout) = &mut self.cutout {
            cutout.wrap = wrap;
        }
        self
    }
}

/// A picture of radiance as it is read.
pub(super) struct RadiancePicture {
    /// Its pixels, finite and within the range of emission.
    pub(super) texture: Texture,
    /// Pixels that were negative or not finite in a channel.
    pub(super) corrected: usize,
    /// Width and height in the file, pixels.
    pub(super) size: [u32; 2],
}

/// Why there is no picture of radiance.
pub(super) enum RadianceError {
    /// It cannot be decoded; a clause with the reason.
    Unreadable(String),
    /// It has bytes, not floats.
    NotLinear,
}

/// Values of pixels or of blocks of them, row by row.
struct Grid<T> {
    width: u32,
    height: u32,
    values: Vec<T>,
}

impl Grid<Vec3> {
    fn into_texture(self, name: &str) -> Texture {
        Texture {
            name: name.to_owned(),
            width: self.width,
            height: self.height,
            pixels: self.values,
            ..Texture::default()
        }
    }
}

/// A picture with alpha: how much of each pixel is seen. Nothing where it reflects and no pixel is seen at all.
fn covered<T: Primitive>(
    picture: &ImageBuffer<Rgba<T>, Vec<T>>,
    name: &str,
    role: Role,
    linear: impl Fn(T) -> f32,
    share: impl Fn(T) -> f32,
) -> Option<Picture>
where
    Rgba<T>: Pixel<Subpixel = T>,
{
    let share_of = |pixel: &Rgba<T>| share(pixel.0[3]);
    let is_transparent = picture.pixels().any(|pixel| share_of(pixel) < 1.0);
    let weight = |pixel: &Rgba<T>| match role {
        Role::Reflects => share_of(pixel),
        _ if share_of(pixel) > 0.0 => 1.0,
        _ => 0.0,
    };
    let mut grid = averaged(picture, |pixel| color_of(pixel.0, &linear) * weight(pixel));
    if is_transparent && role == Role::Reflects {
        let seen = averaged(picture, weight);
        let sum_of_colors: DVec3 = grid.values.iter().map(|color| color.as_dvec3()).sum();
        let sum_of_shares: f64 = seen.values.iter().copied().map(f64::from).sum();
        if sum_of_shares <= 0.0 {
            return None;
        }
        let mean = (sum_of_colors / sum_of_shares).as_vec3();
        for (color, seen) in grid.values.iter_mut().zip(seen.values) {
            *color = if seen > 0.0 { *color / seen } else { mean };
        }
    }
    let cutout = (is_transparent && role == Role::Reflects).then(|| {
        let (width, height) = picture.dimensions();
        Cutout::new(name, [width, height], |column, row| {
            share_of(picture.get_pixel(column, row)) >= LEAST_ALPHA
        })
    });
    Some(Picture {
        texture: Some(grid.into_texture(name)),
        is_transparent,
        cutout: cutout.filter(|cutout| !cutout.is_whole()),
    })
}

/// The cut-out of a picture: by its alpha, or by its encoded brightness where the alpha hides nothing.
fn cutting(picture: DynamicImage, name: &str) -> Picture {
    let has_alpha = picture.color().has_alpha();
    let alpha = has_alpha.then(|| picture.to_rgba16());
    let alpha = alpha.filter(|pixels| pixels.pixels().any(|pixel| pixel.0[3] < u16::MAX));
    let values = match alpha {
        Some(pixels) => ImageBuffer::from_fn(pixels.width(), pixels.height(), |x, y| {
            Luma([pixels.get_pixel(x, y).0[3]])
        }),
        None => picture.into_luma16(),
    };
    let value = |pixel: &Luma<u16>| f32::from(pixel.0[0]) / 65_535.0;
    let (width, height) = values.dimensions();
    let cutout = Cutout::new(name, [width, height], |column, row| {
        value(values.get_pixel(column, row)) >= LEAST_ALPHA
    });
    Picture {
        texture: None,
        is_transparent: values.pixels().any(|pixel| value(pixel) < 1.0),
        cutout: (!cutout.is_whole()).then_some(cutout),
    }
}

/// Means of blocks of pixels, of the smallest power of two that leaves at most [`MAX_PIXELS`].
fn averaged<P: Pixel, T>(
    picture: &ImageBuffer<P, Vec<P::Subpixel>>,
    value: impl Fn(&P) -> T,
) -> Grid<T>
where
    T: Copy + Default + AddAssign + Mul<f32, Output = T>,
{
    let sides = |block: u32| {
        (
            picture.width().div_ceil(block),
            picture.height().div_ceil(block),
        )
    };
    let mut block = 1;
    while let (width, height) = sides(block)
        && width as usize * height as usize > MAX_PIXELS
    {
        block *= 2;
    }
    let (width, height) = sides(block);
    let mut values = vec![T::default(); width as usize * height as usize];
    for (y, row) in (0..).zip(picture.rows()) {
        let start = (y / block) as usize * width as usize;
        let above = y / block * block;
        let block_height = (picture.height() - above).min(block);
        for (x, pixel) in (0..).zip(row) {
            let left = x / block * block;
            let block_width = (picture.width() - left).min(block);
            let share = 1.0 / (block_width * block_height) as f32;
            values[start + (x / block) as usize] += value(pixel) * share;
        }
    }
    Grid {
        width,
        height,
        values,
    }
}

/// Decode a picture in memory.
///
/// # Errors
/// A clause with the reason why there is no picture.
pub(super) fn decode_bytes(bytes: &[u8]) -> Result<DynamicImage, String> {
    let decoded = std::panic::catch_unwind(|| decode_from(ImageReader::new(Cursor::new(bytes))));
    match decoded {
        Ok(Ok(picture)) if picture.width() > 0 && picture.height() > 0 => Ok(picture),
        Ok(Ok(_)) => Err("it has no pixels".to_owned()),
        Ok(Err(error)) => Err(error.to_string()),
        Err(_) => Err("its decoder failed".to_owned()),
    }
}

fn decode(path: &Path) -> image::ImageResult<DynamicImage> {
    decode_from(ImageReader::open(path)?)
}

fn decode_from(reader: ImageReader<impl BufRead + Seek>) -> image::ImageResult<DynamicImage> {
    let mut reader = reader.with_guessed_format()?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_DECODED_BYTES);
    reader.limits(limits);
    reader.decode()
}

/// Samples of a triangle at most, its parts together; at this many the mean of a halved texture is good to about a percent.
pub(super) const MAX_SAMPLES: f32 = 256.0;

/// Samples of a triangle at least, however small it is on the picture.
const MIN_SAMPLES: f32 = 4.0;

/// Halved copies of a texture, for means over triangles.
#[derive(Debug)]
pub(super) struct TextureAverage {
    /// Each half the size of the one before, the first of the texture itself; down to one pixel.
    halved: Vec<Texture>,
}

impl TextureAverage {
    /// Halve a texture down to one pixel.
    pub(super) fn new(full: &Texture) -> Self {
        let width = full.width as usize;
        Self::of([full.width, full.height], full.wrap, |column, row| {
            full.pixels[row as usize * width + column as usize]
        })
    }

    /// Halve a picture of this width and height down to one pixel; `pixel` gives its pixels by column and row.
    pub(super) fn of(
        [width, height]: [u32; 2],
        wrap: [Wrap; 2],
        pixel: impl Fn(u32, u32) -> Vec3,
    ) -> Self {
        let mut halved: Vec<Texture> = Vec::new();
        if width > 1 || height > 1 {
            let half = half([width, height], pixel);
            halved.push(Texture { wrap, ..half });
        }
        while let Some(last) = halved.last()
            && last.pixels.len() > 1
        {
            halved.push(last.halved());
        }
        Self { halved }
    }

    /// Mean of the texture over a triangle of texture coordinates. The copy is chosen such that there is about one sample
    /// a pixel, so that a small bright spot in a large picture is not missed; `most_samples` is at least 4. `full` looks up
    /// the picture itself, of this width and height.
    pub(super) fn over(
        &self,
        [width, height]: [u32; 2],
        full: impl Fn(Vec2) -> Vec3,
        uv: [Vec2; 3],
        most_samples: f32,
    ) -> Vec3 {
        let size = Vec2::new(width as f32, height as f32);
        let [a, b, c] = uv.map(|uv| uv * size);
        let area = 0.5 * (b - a).perp_dot(c - a).abs();
        let length = (b - a).length().max((c - b).length()).max((a - c).length());
        // Two samples a pixel, in a needle two a pixel of its length.
        let mut wanted = 2.0 * area.max(length);
        let mut texture = None;
        for halved in &self.halved {
            // Written so that an overflow ends at the smallest copy.
            if wanted <= most_samples {
                break;
            }
            wanted *= if area > length { 0.25 } else { 0.5 };
            texture = Some(halved);
        }
        // Coordinates that are not numbers give the least.
        let count = wanted.max(MIN_SAMPLES).min(most_samples).ceil() as u32;
        let sum: Vec3 = (0..count)
            .map(|index| {
                let [x, y, z] = barycentric_sample(index);
                let at = uv[0] * x + uv[1] * y + uv[2] * z;
                texture.map_or_else(|| full(at), |texture| texture.sample(at))
            })
            .sum();
        sum / count as f32
    }
}

/// Barycentric coordinates of point `index` of an even covering of a triangle: the R2 sequence (Roberts 2018), folded.
fn barycentric_sample(index: u32) -> [f32; 3] {
    let number = f64::from(index) + 0.5;
    let mut u = (number * 0.754_877_666_246_692_7).fract() as f32;
    let mut v = (number * 0.569_840_290_998_053_2).fract() as f32;
    if u + v > 1.0 {
        (u, v) = (1.0 - u, 1.0 - v);
    }
    [u, v, 1.0 - u - v]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_curve_meets_known_values() {
        assert!((linear_from_srgb(1.0) - 1.0).abs() < 1e-6);
        assert!((linear_from_srgb(188.0 / 255.0) - 0.5029).abs() < 1e-4);
    }

    #[test]
    fn lookups_beyond_the_edge_follow_the_wrap() {
        let texture = |wrap| Texture {
            name: String::new(),
            width: 2,
            height: 1,
            pixels: vec![Vec3::ZERO, Vec3::ONE],
            wrap,
        };
        // The middles of pixels, and the edges between them.
        for (wrap, expected) in [
            (Wrap::Repeat, [1.0, 0.5, 0.0, 0.5, 1.0, 0.5, 0.0, 0.5, 1.0]),
            (Wrap::Mirror, [0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 1.0, 0.5, 0.0]),
            (Wrap::Clamp, [0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 1.0, 1.0, 1.0]),
        ] {
            let texture = texture([wrap, Wrap::Repeat]);
            for (number, expected) in (-1..).zip(expected) {
                let at = Vec2::new(number as f32 * 0.25, 0.3);
                assert_eq!(texture.sample(at).x, expected, "{wrap:?} {at}");
                // Halved copies go on alike.
                let halved = texture.halved();
                assert_eq!((halved.wrap, halved.sample(at).x), (texture.wrap, 0.5));
            }
        }
    }

    #[test]
    fn halving_keeps_the_mean_of_even_sides() {
        let pixels = (0..16).map(|x| Vec3::splat(x as f32)).collect();
        let texture = Texture {
            name: String::new(),
            width: 4,
            height: 4,
            pixels,
            ..Texture::default()
        };
        let small = texture.reduced_to(1);
        assert_eq!((small.width, small.height), (1, 1));
        assert_eq!(small.pixels[0], Vec3::splat(7.5));
    }

    #[test]
    fn large_pictures_are_averaged_in_blocks_that_may_be_cut_at_the_edge() {
        // 4097 × 4097 needs blocks of two; the last row and column have blocks of one.
        let picture = image::GrayImage::from_fn(4097, 4097, |x, y| {
            Luma([if x == 4096 || y == 0 { 255 } else { 0 }])
        });
        let texture = Texture::from_picture(picture.into(), "", Role::Reflects);
        let texture = texture.unwrap().texture.unwrap();
        assert_eq!((texture.width, texture.height), (2049, 2049));
        assert!(texture.is_consistent());
        assert_eq!(texture.pixels[0], Vec3::splat(0.5));
        assert_eq!(texture.pixels[2048], Vec3::ONE);
        assert_eq!(texture.pixels[2049], Vec3::ZERO);
        assert_eq!(texture.pixels[2049 * 2049 - 1], Vec3::ONE);
    }

    /// Red, half transparent blue, hidden white and hidden black.
    const LEAF: [[u8; 4]; 4] = [
        [255, 0, 0, 255],
        [0, 0, 255, 127],
        [255, 255, 255, 0],
        [0, 0, 0, 0],
    ];

    fn leaf() -> image::RgbaImage {
        image::RgbaImage::from_fn(4, 1, |x, _| Rgba(LEAF[x as usize]))
    }

    #[test]
    fn what_is_hidden_has_the_mean_colour_of_what_is_seen() {
        let picture = DynamicImage::from(leaf());
        for picture in [
            picture.clone(),
            DynamicImage::from(picture.to_rgba16()),
            // Floats are linear already, and 0 and 1 are the same in both.
            DynamicImage::from(picture.to_rgba32f()),
        ] {
            let read = Texture::from_picture(picture, "", Role::Reflects).unwrap();
            assert!(read.is_transparent);
            let half = 127.0 / 255.0;
            let mean = Vec3::new(1.0, 0.0, half) / (1.0 + half);
            let expected = [Vec3::X, Vec3::Z, mean, mean];
            for (pixel, expected) in read.texture.unwrap().pixels.iter().zip(expected) {
                assert!(pixel.abs_diff_eq(expected, 1e-5), "{pixel} for {expected}");
            }
        }
    }

    #[test]
    fn what_is_hidden_emits_nothing() {
        let read = Texture::from_picture(leaf().into(), "", Role::Emits).unwrap();
        let expected = [Vec3::X, Vec3::Z, Vec3::ZERO, Vec3::ZERO];
        assert_eq!(read.texture.unwrap().pixels, expected);
    }

    #[test]
    fn alpha_that_hides_nothing_changes_nothing() {
        let grey = image::GrayAlphaImage::from_pixel(2, 2, image::LumaA([188, 255]));
        let read = Texture::from_picture(grey.into(), "", Role::Reflects).unwrap();
        assert!(!read.is_transparent);
        let expected = Vec3::splat(linear_from_srgb(188.0 / 255.0));
        assert_eq!(read.texture.unwrap().pixels, [expected; 4]);
        let nothing = image::RgbaImage::from_pixel(2, 2, Rgba([255, 255, 255, 0]));
        assert!(Texture::from_picture(nothing.into(), "", Role::Reflects).is_none());
    }

    #[test]
    fn lookup_repeats_and_row_zero_is_the_top() {
        let texture = Texture {
            name: String::new(),
            width: 1,
            height: 2,
            pixels: vec![Vec3::ONE, Vec3::ZERO],
            ..Texture::default()
        };
        for shift in [-3.0, 0.0, 5.0] {
            assert_eq!(texture.sample(Vec2::new(0.3, 0.75 + shift)), Vec3::ONE);
            assert_eq!(texture.sample(Vec2::new(0.3, 0.25 + shift)), Vec3::ZERO);
        }
        assert!(texture.sample(Vec2::new(f32::NAN, 3e38)).is_finite());
    }
}
