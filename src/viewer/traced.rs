//! Traced pictures as the window shows them: exposed, tone-mapped, over the background.

use glam::{Vec2, Vec3};
use image::{Rgb, Rgb32FImage, Rgba, Rgba32FImage, RgbaImage};
use rayon::prelude::*;

use super::{
    camera::Camera,
    exposure,
    headless::{HeadlessPicture, Subject},
    render::{Cutout, Metered},
    theme,
    view::ViewSettings,
};
use crate::{
    export::ToneMap,
    geometry::RayTree,
    picture::{self, Developed, Exposure, Lens},
    scene::{luminance, srgb_byte},
    solver::Cancel,
};

/// A traced picture.
pub struct Traced {
    size: [u32; 2],
    pixels: Vec<Developed>,
    /// Factor from the radiance of the scene to that of files, and, beside it, to that of the display.
    to_file: f32,
    to_display: f32,
    tone_map: ToneMap,
    is_unlit: bool,
}

/// The rays of a camera for a picture of this width over its height.
fn lens(camera: &Camera, aspect: f32) -> Lens {
    let half = 0.5 * camera.height_at_pivot();
    let (origin, forward) = camera.ray(Vec2::ZERO, aspect);
    let [_, right, up] = camera.rays(aspect);
    match camera.orthographic {
        false => Lens {
            origin,
            forward,
            right,
            up,
            is_parallel: false,
        },
        true => Lens {
            origin,
            forward,
            right: camera.right() * (half * aspect),
            up: camera.upward() * half,
            is_parallel: true,
        },
    }
}

/// Trace a picture of the light at a size in pixels; `None` when cancelled. Automatic exposure is taken from the pixels.
pub fn trace(
    subject: Subject<'_>,
    rays: &RayTree,
    camera: &Camera,
    view: &ViewSettings,
    exposure: &Exposure,
    cancel: &Cancel,
) -> Option<Traced> {
    let size = exposure.size;
    let is_unlit = subject.is_unlit(view);
    let looked_into = subject
        .interior
        .filter(|room| room.is_looked_into(camera, view));
    let hides =
        looked_into.map(|room| move |point: Vec3, normal: Vec3| room.hides(camera, point, normal));
    let traced = picture::Subject {
        scene: subject.scene,
        rays,
        snapshot: subject.snapshot,
        hidden: hides.as_ref().map(|hides| hides as picture::HiddenFrom<'_>),
        shows_backs: view.backs,
        is_unlit,
    };
    let lens = lens(camera, size[0] as f32 / size[1] as f32);
    let pixels = picture::trace(&traced, &lens, exposure, cancel)?;
    let mut view = view.clone();
    if view.auto_exposure {
        view.exposure = exposure::of(&metered(&pixels)).unwrap_or(view.exposure);
    }
    let mut traced = Traced {
        size,
        pixels,
        to_file: view.light_factor() * subject.scene.radiance_unit,
        to_display: 1.0,
        tone_map: ToneMap::None,
        is_unlit,
    };
    traced.expose(&view);
    Some(traced)
}

/// Luminances of the pixels that show light.
fn metered(pixels: &[Developed]) -> Metered {
    let mut metered = Metered::default();
    for pixel in pixels {
        let [surfaces, sources] = [
            luminance(pixel.surfaces) * pixel.surface_part(),
            luminance(pixel.sources) * pixel.source_part,
        ];
        if sources > surfaces {
            metered.emitted.push(sources + surfaces);
        } else if surfaces > 0.0 {
            metered.reflected.push(sources + surfaces);
        }
    }
    metered
}

impl Traced {
    /// Expose and tone-map it as a view asks for. What shows no light stays as it is.
    pub fn expose(&mut self, view: &ViewSettings) {
        (self.to_display, self.tone_map) = match self.is_unlit {
            true => (1.0, ToneMap::None),
            false => (view.light_factor() * view.exposure_factor(), view.tone_map),
        };
    }

    /// Estimated noise of its pixels that show surfaces alone, root mean square relative to their mean luminance; `None` where
    /// they are black, or have one sample each. At the rims of lamps samples differ by right.
    pub fn noise(&self) -> Option<f32> {
        let (mut squares, mut light, mut count) = (0.0, 0.0, 0.0);
        let surfaces = self.pixels.iter().filter(|pixel| pixel.source_part <= 0.0);
        for pixel in surfaces {
            squares += f64::from(pixel.noise).powi(2);
            light += f64::from(luminance(pixel.radiance()));
            count += 1.0;
        }
        let noise = (squares * count).sqrt() / light;
        (noise > 0.0 && noise.is_finite()).then_some(noise as f32)
    }

    /// Its display colours over a background, display-linear.
    pub fn display(&self, background: f32) -> RgbaImage {
        let [width, height] = self.size;
        let mut display = RgbaImage::new(width, height);
        let bytes: &mut [u8] = &mut display;
        let pixels = bytes.par_chunks_exact_mut(4).zip(&self.pixels);
        pixels.for_each(|(display, pixel)| {
            let behind = background * pixel.background_part;
            let [r, g, b] = self.shown(pixel, behind).to_array().map(srgb_byte);
            display.copy_from_slice(&[r, g, b, u8::MAX]);
        });
        display
    }

    /// The picture over the window's background.
    pub fn picture(&self) -> HeadlessPicture {
        let [width, height] = self.size;
        let mut radiance = Rgb32FImage::new(width, height);
        for (pixel, radiance) in self.pixels.iter().zip(radiance.pixels_mut()) {
            *radiance = Rgb((pixel.radiance() * self.to_file).to_array());
        }
        HeadlessPicture {
            display: self.display(theme::PICTURE_BACKGROUND),
            radiance: Some(radiance),
        }
    }

    /// The picture without a background.
    pub fn cutout(&self) -> Cutout {
        let [width, height] = self.size;
        let mut display = RgbaImage::new(width, height);
        let mut radiance = Rgba32FImage::new(width, height);
        let pixels = display.pixels_mut().zip(radiance.pixels_mut());
        for (pixel, (display, radiance)) in self.pixels.iter().zip(pixels) {
            let covered = 1.0 - pixel.background_part;
            let color = self.shown(pixel, 0.0) / covered.max(f32::MIN_POSITIVE);
            let [r, g, b] = color.to_array().map(srgb_byte);
            *display = Rgba([r, g, b, (covered * 255.0).round() as u8]);
            let color = pixel.radiance() * self.to_file;
            *radiance = Rgba(color.extend(covered).to_array());
        }
        Cutout { display, radiance }
    }

    /// Display-linear colour of a pixel over that of its background.
    fn shown(&self, pixel: &Developed, behind: f32) -> Vec3 {
        let mapped = |radiance: Vec3| {
            let shown = self.tone_map.apply(radiance * self.to_display);
            shown.clamp(Vec3::ZERO, Vec3::ONE)
        };
        let backs = theme::BACK_LIGHTNESS * pixel.back_part;
        mapped(pixel.surfaces) * pixel.surface_part()
            + mapped(pixel.sources) * pixel.source_part
            + (behind + backs)
    }
}
