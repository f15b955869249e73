//! Pictures without a background: which part of each pixel the surfaces and lines cover, and their colour alone.
//!
//! The alpha of the linear picture says which part of a pixel is light, so it cannot say which part is covered. The same
//! is therefore drawn twice over black: over a background that is not light, and over one that is. What their alphas
//! differ by is the part that nothing covers. Samples of a pixel are averaged before tone mapping, as in every picture.

use std::path::Path;

use glam::{Vec3, Vec4};
use image::{DynamicImage, Rgba, Rgba32FImage, RgbaImage};

use super::{Gpu, ReadError, Target};
use crate::{
    export::ToneMap,
    scene::srgb_from_linear,
    viewer::picture_file::{self, EncodeError},
};

/// The two pictures of what is cut out.
pub struct CutoutTarget {
    /// Over black that is not light.
    pub(super) over_nothing: Target,
    /// Over black that counts as light.
    pub(super) over_light: Target,
}

impl CutoutTarget {
    /// Textures of a size in pixels, at least 1 × 1.
    ///
    /// # Errors
    /// [`super::RenderError::PictureTooLarge`] for more than the adapter takes.
    pub fn new(gpu: &Gpu, size: [u32; 2]) -> Result<Self, super::RenderError> {
        Ok(Self {
            over_nothing: Target::new(gpu, size)?,
            over_light: Target::new(gpu, size)?,
        })
    }

    /// Wait for the picture. `exposure_factor` is what its radiance was multiplied by.
    ///
    /// # Errors
    /// When the device is lost or out of memory, or the adapter has no linear pictures.
    pub fn read(
        &self,
        gpu: &Gpu,
        tone_map: ToneMap,
        exposure_factor: f32,
    ) -> Result<Cutout, ReadError> {
        let over_nothing = self.over_nothing.read_pixels(gpu)?;
        let over_light = self.over_light.read_pixels(gpu)?;
        let [width, height] = self.over_nothing.size();
        let mut display = RgbaImage::new(width, height);
        let mut radiance = Rgba32FImage::new(width, height);
        let seen = display.pixels_mut().zip(radiance.pixels_mut());
        for ((display, radiance), (nothing, light)) in
            seen.zip(over_nothing.iter().zip(&over_light))
        {
            let pixel = CutoutPixel::of(*nothing, light.w);
            *display = pixel.display(tone_map);
            *radiance = pixel.radiance(exposure_factor);
        }
        Ok(Cutout { display, radiance })
    }
}

/// A picture without a background.
pub struct Cutout {
    /// Display colours, sRGB-encoded, with straight alpha: colours are not darkened towards the edges.
    pub display: RgbaImage,
    /// Linear radiance, multiplied by the alpha that it stands beside, as EXR has it.
    pub radiance: Rgba32FImage,
}

impl Cutout {
    /// The bytes of a file of this name; `.exr` takes the radiance, anything else the display colours.
    ///
    /// # Errors
    /// See [`EncodeError`].
    pub fn encode(self, path: &Path) -> Result<Vec<u8>, EncodeError> {
        let (display, radiance) = self.into_images();
        picture_file::encode(display, Some(radiance), path)
    }

    /// Both as they are encoded.
    pub fn into_images(self) -> (DynamicImage, DynamicImage) {
        (self.display.into(), self.radiance.into())
    }
}

/// One pixel of it.
struct CutoutPixel {
    /// Exposed colour, multiplied by `coverage`.
    color: Vec3,
    /// The part that is covered, 0…1.
    coverage: f32,
    /// The part that is covered by light, at most `coverage`.
    light: f32,
}

impl CutoutPixel {
    fn of(over_nothing: Vec4, alpha_over_light: f32) -> Self {
        let coverage = (1.0 - (alpha_over_light - over_nothing.w)).clamp(0.0, 1.0);
        Self {
            color: over_nothing.truncate(),
            coverage,
            light: over_nothing.w.clamp(0.0, coverage),
        }
    }

    /// Twin of `fs_main` in tonemap_pass.wgsl, of the covered part alone.
    fn display(&self, tone_map: ToneMap) -> Rgba<u8> {
        if self.coverage <= 0.0 {
            return Rgba([0; 4]);
        }
        let color = self.color / self.coverage;
        let mapped = tone_map.apply(color);
        let shown = color.lerp(mapped, self.light / self.coverage);
        let byte = |x: f32| (x * 255.0).round() as u8;
        let [r, g, b] = shown
            .to_array()
            .map(|x| byte(srgb_from_linear(x.clamp(0.0, 1.0))));
        Rgba([r, g, b, byte(self.coverage)])
    }

    fn radiance(&self, exposure_factor: f32) -> Rgba<f32> {
        Rgba(
            (self.color / exposure_factor)
                .extend(self.coverage)
                .to_array(),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_keep_the_colour_of_the_surface() {
        // Half of the pixel is covered by light of 0.25, exposed twice as bright.
        let pixel = CutoutPixel::of(Vec4::new(0.25, 0.25, 0.25, 0.5), 1.0);
        assert_eq!((pixel.coverage, pixel.light), (0.5, 0.5));
        let Rgba([r, _, _, a]) = pixel.display(ToneMap::None);
        let whole = CutoutPixel::of(Vec4::new(0.5, 0.5, 0.5, 1.0), 1.0);
        let Rgba([whole_r, _, _, whole_a]) = whole.display(ToneMap::None);
        assert_eq!((r, a), (whole_r, 128));
        assert_eq!(whole_a, 255);
        assert_eq!(pixel.radiance(2.0), Rgba([0.125, 0.125, 0.125, 0.5]));
    }

    #[test]
    fn what_is_no_light_covers_but_is_not_tone_mapped() {
        let line = CutoutPixel::of(Vec4::new(0.9, 0.9, 0.9, 0.0), 0.0);
        assert_eq!((line.coverage, line.light), (1.0, 0.0));
        assert_eq!(line.display(ToneMap::Neutral), line.display(ToneMap::None));
        let light = CutoutPixel::of(Vec4::new(0.9, 0.9, 0.9, 1.0), 1.0);
        assert_ne!(
            light.display(ToneMap::Neutral),
            light.display(ToneMap::None)
        );
    }

    #[test]
    fn nothing_is_clear() {
        let nothing = CutoutPixel::of(Vec4::ZERO, 1.0);
        assert_eq!(nothing.display(ToneMap::Neutral), Rgba([0; 4]));
        assert_eq!(nothing.radiance(1.0), Rgba([0.0; 4]));
    }
}
