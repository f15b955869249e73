//! Textures: linear RGB pixels, repeated, looked up bilinearly; and their reading from picture files.

use std::path::Path;

use glam::{Vec2, Vec3};
use image::{DynamicImage, ImageBuffer, ImageReader, Limits, Pixel};

use super::emission::cured;

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
}

impl Texture {
    /// Bilinear value at a texture coordinate, repeated outside 0…1. A coordinate that is not finite reads as 0.
    pub fn sample(&self, uv: Vec2) -> Vec3 {
        let uv = if uv.is_finite() { uv } else { Vec2::ZERO };
        let x = uv.x.rem_euclid(1.0) * self.width as f32 - 0.5;
        let y = (1.0 - uv.y).rem_euclid(1.0) * self.height as f32 - 0.5;
        let (column, row) = (x.floor(), y.floor());
        let (fx, fy) = (x - column, y - row);
        let pixel = |dx: i64, dy: i64| {
            let i = (column as i64 + dx).rem_euclid(i64::from(self.width)) as usize;
            let j = (row as i64 + dy).rem_euclid(i64::from(self.height)) as usize;
            self.pixels[j * self.width as usize + i]
        };
        let top = pixel(0, 0).lerp(pixel(1, 0), fx);
        let bottom = pixel(0, 1).lerp(pixel(1, 1), fx);
        top.lerp(bottom, fy)
    }
}

/// Pixels kept of one picture; larger ones are averaged down. Light needs means, and twelve bytes a pixel add up.
const MAX_PIXELS: usize = 1 << 24;

/// Longest side of a picture that is decoded.
const MAX_SIDE: u32 = 16_384;

/// Bytes that decoding one picture may take: 16384² pixels of four bytes.
const MAX_DECODED_BYTES: u64 = 1 << 30;

impl Texture {
    /// Read a picture file: 8 and 16 bits a channel are sRGB, floats are linear. Transparency is ignored.
    ///
    /// # Errors
    /// A clause that says why there is no picture.
    pub(super) fn read(path: &Path, name: &str) -> Result<Self, String> {
        let decoded = std::panic::catch_unwind(|| decode(path));
        match decoded {
            Ok(Ok(picture)) if picture.width() > 0 && picture.height() > 0 => {
                Ok(Self::from_picture(picture, name))
            }
            Ok(Ok(_)) => Err("it has no pixels".to_owned()),
            Ok(Err(error)) => Err(error.to_string()),
            Err(_) => Err("its decoder failed".to_owned()),
        }
    }

    /// Linear pixels of a picture, averaged down on the way where it is large: a picture of a few hundred kilobytes
    /// may hold pixels for gigabytes.
    fn from_picture(picture: DynamicImage, name: &str) -> Self {
        let table: Vec<f32> = (0..=255_u8)
            .map(|x| linear_from_srgb(f32::from(x) / 255.0))
            .collect();
        let byte = |x: u8| table[usize::from(x)];
        let word = |x: u16| linear_from_srgb(f32::from(x) / 65_535.0);
        match picture {
            DynamicImage::ImageLuma8(pixels) => {
                averaged(&pixels, name, |pixel| Vec3::splat(byte(pixel.0[0])))
            }
            DynamicImage::ImageRgba8(pixels) => {
                averaged(&pixels, name, |pixel| color_of(pixel.0, byte))
            }
            DynamicImage::ImageRgb16(pixels) => {
                averaged(&pixels, name, |pixel| color_of(pixel.0, word))
            }
            DynamicImage::ImageLuma16(_)
            | DynamicImage::ImageLumaA16(_)
            | DynamicImage::ImageRgba16(_) => {
                averaged(&picture.into_rgb16(), name, |pixel| color_of(pixel.0, word))
            }
            DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
                averaged(&picture.into_rgb32f(), name, |pixel| {
                    color_of(pixel.0, cured)
                })
            }
            // Takes no copy where it is of this kind already.
            _ => averaged(&picture.into_rgb8(), name, |pixel| color_of(pixel.0, byte)),
        }
    }

    /// The picture with sides halved until it has at most so many pixels, but at least one.
    pub(super) fn reduced_to(mut self, max_pixels: usize) -> Self {
        while self.pixels.len() > max_pixels.max(1) {
            self = self.halved();
        }
        self
    }

    /// The picture with both sides halved (rounded up), each pixel the mean of four.
    pub(super) fn halved(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let pixel = |column: u32, row: u32| {
            let (column, row) = (column.min(self.width - 1), row.min(self.height - 1));
            self.pixels[row as usize * self.width as usize + column as usize]
        };
        let mut pixels = Vec::with_capacity(width as usize * height as usize);
        for row in 0..height {
            for column in 0..width {
                let (x, y) = (2 * column, 2 * row);
                let sum = pixel(x, y) + pixel(x + 1, y) + pixel(x, y + 1) + pixel(x + 1, y + 1);
                pixels.push(sum * 0.25);
            }
        }
        Self {
            name: self.name.clone(),
            width,
            height,
            pixels,
        }
    }

    /// Whether the size and the pixels agree, so that looking up cannot fail.
    pub(super) fn is_consistent(&self) -> bool {
        let count = self.width as usize * self.height as usize;
        count > 0 && count == self.pixels.len()
    }
}

/// Red, green and blue of a pixel, each turned into a linear value.
fn color_of<T: Copy, const N: usize>(channels: [T; N], linear: impl Fn(T) -> f32) -> Vec3 {
    let [red, green, blue] = [0, 1, 2].map(|channel| linear(channels[channel]));
    Vec3::new(red, green, blue)
}

/// Means of blocks of pixels, of the smallest power of two that leaves at most [`MAX_PIXELS`].
fn averaged<P: Pixel>(
    picture: &ImageBuffer<P, Vec<P::Subpixel>>,
    name: &str,
    linear: impl Fn(&P) -> Vec3,
) -> Texture {
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
    let mut pixels = vec![Vec3::ZERO; width as usize * height as usize];
    for (y, row) in (0..).zip(picture.rows()) {
        let start = (y / block) as usize * width as usize;
        let above = y / block * block;
        let block_height = (picture.height() - above).min(block);
        for (x, pixel) in (0..).zip(row) {
            let left = x / block * block;
            let block_width = (picture.width() - left).min(block);
            let share = 1.0 / (block_width * block_height) as f32;
            pixels[start + (x / block) as usize] += linear(pixel) * share;
        }
    }
    Texture {
        name: name.to_owned(),
        width,
        height,
        pixels,
    }
}

fn decode(path: &Path) -> image::ImageResult<DynamicImage> {
    let mut reader = ImageReader::open(path)?.with_guessed_format()?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_DECODED_BYTES);
    reader.limits(limits);
    reader.decode()
}

/// The sRGB curve backwards, continued beyond 1.
pub(super) fn linear_from_srgb(encoded: f32) -> f32 {
    if encoded <= 0.040_45 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

/// Samples of a triangle at most; at this many the mean of a halved texture is good to about a percent.
const MAX_SAMPLES: f32 = 256.0;

/// Samples of a triangle at least, however small it is on the picture.
const MIN_SAMPLES: f32 = 4.0;

/// A texture with its halved copies, for means over triangles.
#[derive(Debug)]
pub(super) struct TextureAverage<'a> {
    full: &'a Texture,
    /// Each half the size of the one before, down to one pixel.
    halved: Vec<Texture>,
}

impl<'a> TextureAverage<'a> {
    /// Halve a texture down to one pixel.
    pub(super) fn new(full: &'a Texture) -> Self {
        let mut halved: Vec<Texture> = Vec::new();
        while let last = halved.last().unwrap_or(full)
            && last.pixels.len() > 1
        {
            halved.push(last.halved());
        }
        Self { full, halved }
    }

    /// Mean over a triangle of texture coordinates. The copy is chosen such that there is about one sample a pixel, so
    /// that a small bright spot in a large picture is not missed.
    pub(super) fn over(&self, uv: [Vec2; 3]) -> Vec3 {
        let size = Vec2::new(self.full.width as f32, self.full.height as f32);
        let [a, b, c] = uv.map(|uv| uv * size);
        let area = 0.5 * (b - a).perp_dot(c - a).abs();
        let length = (b - a).length().max((c - b).length()).max((a - c).length());
        // Two samples a pixel, in a needle two a pixel of its length.
        let mut wanted = 2.0 * area.max(length);
        let mut texture = self.full;
        for halved in &self.halved {
            // Written so that an overflow ends at the smallest copy.
            if wanted <= MAX_SAMPLES {
                break;
            }
            wanted *= if area > length { 0.25 } else { 0.5 };
            texture = halved;
        }
        let count = wanted.clamp(MIN_SAMPLES, MAX_SAMPLES).ceil() as u32;
        let sum: Vec3 = (0..count)
            .map(|index| {
                let [x, y, z] = barycentric_sample(index);
                texture.sample(uv[0] * x + uv[1] * y + uv[2] * z)
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
    fn halving_keeps_the_mean_of_even_sides() {
        let pixels = (0..16).map(|x| Vec3::splat(x as f32)).collect();
        let texture = Texture {
            name: String::new(),
            width: 4,
            height: 4,
            pixels,
        };
        let small = texture.reduced_to(1);
        assert_eq!((small.width, small.height), (1, 1));
        assert_eq!(small.pixels[0], Vec3::splat(7.5));
    }

    #[test]
    fn large_pictures_are_averaged_in_blocks_that_may_be_cut_at_the_edge() {
        // 4097 × 4097 needs blocks of two; the last row and column have blocks of one.
        let picture = image::GrayImage::from_fn(4097, 4097, |x, y| {
            image::Luma([if x == 4096 || y == 0 { 255 } else { 0 }])
        });
        let texture = Texture::from_picture(picture.into(), "");
        assert_eq!((texture.width, texture.height), (2049, 2049));
        assert!(texture.is_consistent());
        assert_eq!(texture.pixels[0], Vec3::splat(0.5));
        assert_eq!(texture.pixels[2048], Vec3::ONE);
        assert_eq!(texture.pixels[2049], Vec3::ZERO);
        assert_eq!(texture.pixels[2049 * 2049 - 1], Vec3::ONE);
    }

    #[test]
    fn lookup_repeats_and_row_zero_is_the_top() {
        let texture = Texture {
            name: String::new(),
            width: 1,
            height: 2,
            pixels: vec![Vec3::ONE, Vec3::ZERO],
        };
        for shift in [-3.0, 0.0, 5.0] {
            assert_eq!(texture.sample(Vec2::new(0.3, 0.75 + shift)), Vec3::ONE);
            assert_eq!(texture.sample(Vec2::new(0.3, 0.25 + shift)), Vec3::ZERO);
        }
        assert!(texture.sample(Vec2::new(f32::NAN, 3e38)).is_finite());
    }
}
