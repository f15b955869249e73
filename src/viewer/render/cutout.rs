//! Pictures without a background: which part of each pixel the surfaces and lines cover, and their colour alone.
//!
//! The alpha of the linear picture says which part of a pixel is light, so it cannot say which part is covered. The same
//! is therefore drawn twice over black: over a background that is not light, and over one that is. What their alphas
//! differ by is the part that nothing covers. Display colours are made of both by the tone mapping, sample by sample.

use std::path::Path;

use image::{DynamicImage, Rgba, Rgba32FImage, RgbaImage};

use super::{Gpu, ReadError, Target};
use crate::viewer::picture_file::{self, EncodeError};

/// The two pictures of what is cut out.
pub struct CutoutTarget {
    /// Over black that is not light; its display picture is that of both.
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
    pub fn read(&self, gpu: &Gpu, exposure_factor: f32) -> Result<Cutout, ReadError> {
        let over_nothing = self.over_nothing.read_pixels(gpu)?;
        let over_light = self.over_light.read_pixels(gpu)?;
        let [width, height] = self.over_nothing.size();
        let mut radiance = Rgba32FImage::new(width, height);
        let both = over_nothing.iter().zip(&over_light);
        for (radiance, (nothing, light)) in radiance.pixels_mut().zip(both) {
            let coverage = (1.0 - (light.w - nothing.w)).clamp(0.0, 1.0);
            let color = nothing.truncate() / exposure_factor;
            *radiance = Rgba(color.extend(coverage).to_array());
        }
        Ok(Cutout {
            display: self.over_nothing.read_display(gpu)?,
            radiance,
        })
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
