//! Lightmaps as the bytes of pictures.

use std::io::Cursor;

use glam::{Vec3, Vec4};
use image::{DynamicImage, ImageFormat, ImageResult, Rgb32FImage, RgbImage, RgbaImage};

use crate::scene::srgb_byte;

/// An OpenEXR file of linear values.
pub(super) fn linear(values: impl Iterator<Item = Vec3>, side: u32) -> ImageResult<Vec<u8>> {
    let channels = values.flat_map(|value| value.to_array()).collect();
    let picture = Rgb32FImage::from_raw(side, side, channels).unwrap_or_default();
    encoded(&picture.into(), ImageFormat::OpenExr)
}

/// A PNG file of sRGB bytes, cut off at 1.
pub(super) fn display(values: impl Iterator<Item = Vec3>, side: u32) -> ImageResult<Vec<u8>> {
    let bytes = values
        .flat_map(|value| value.to_array().map(srgb_byte))
        .collect();
    let picture = RgbImage::from_raw(side, side, bytes).unwrap_or_default();
    encoded(&picture.into(), ImageFormat::Png)
}

/// The same with straight alpha.
pub(super) fn transparent(values: impl Iterator<Item = Vec4>, side: u32) -> ImageResult<Vec<u8>> {
    let bytes = values.flat_map(|value| {
        let [red, green, blue] = value.truncate().to_array().map(srgb_byte);
        [
            red,
            green,
            blue,
            (value.w.clamp(0.0, 1.0) * 255.0).round() as u8,
        ]
    });
    let picture = RgbaImage::from_raw(side, side, bytes.collect()).unwrap_or_default();
    encoded(&picture.into(), ImageFormat::Png)
}

fn encoded(picture: &DynamicImage, format: ImageFormat) -> ImageResult<Vec<u8>> {
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, format)?;
    Ok(bytes.into_inner())
}
