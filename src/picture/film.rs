//! Sums over the samples of pixels.

use std::ops::AddAssign;

use glam::Vec3;

use crate::scene::luminance;

/// What a sample shows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    /// Radiance, W·sr⁻¹·m⁻².
    pub(super) radiance: Vec3,
    /// Whether most of it comes straight from a lamp or from outside.
    pub(super) is_source: bool,
    /// Part of the ray that ends on something that is no light: the background, or the back of a surface.
    pub(super) unlit: Unlit,
}

/// Parts of rays that end on something that is no light, 0…1.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Unlit {
    pub(super) background: f32,
    pub(super) back: f32,
}

/// Sums over the samples of a pixel.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pixel {
    count: f32,
    /// Of the samples that show surfaces, and of those that show sources.
    radiance: [Vec3; 2],
    counts: [f32; 2],
    unlit: Unlit,
    /// Luminances and their squares.
    sum: f32,
    squares: f32,
}

impl AddAssign<Sample> for Pixel {
    fn add_assign(&mut self, sample: Sample) {
        let class = usize::from(sample.is_source);
        self.count += 1.0;
        self.radiance[class] += sample.radiance;
        self.counts[class] += 1.0 - sample.unlit.background - sample.unlit.back;
        self.unlit.background += sample.unlit.background;
        self.unlit.back += sample.unlit.back;
        let luminance = luminance(sample.radiance);
        self.sum += luminance;
        self.squares += luminance * luminance;
    }
}

impl Pixel {
    /// Mean luminance, and its standard error.
    pub(super) fn noise(&self) -> [f32; 2] {
        let count = self.count.max(1.0);
        let mean = self.sum / count;
        let variance = (self.squares / count - mean * mean).max(0.0);
        [mean, (variance / (count - 1.0).max(1.0)).sqrt()]
    }

    /// What the pixel shows.
    pub(super) fn developed(&self) -> Developed {
        let count = self.count.max(1.0);
        let [surfaces, sources] = self.radiance;
        let mean = |radiance: Vec3, part: f32| {
            if part > 0.0 {
                radiance / part
            } else {
                Vec3::ZERO
            }
        };
        Developed {
            surfaces: mean(surfaces, self.counts[0]),
            sources: mean(sources, self.counts[1]),
            source_part: self.counts[1] / count,
            background_part: self.unlit.background / count,
            back_part: self.unlit.back / count,
            noise: self.noise()[1],
        }
    }
}

/// A pixel of a traced picture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Developed {
    /// Mean radiance of the surfaces in it, W·sr⁻¹·m⁻².
    pub surfaces: Vec3,
    /// Mean radiance of the lamps, the sky and the sun in it.
    pub sources: Vec3,
    /// The part of it that shows these, 0…1.
    pub source_part: f32,
    /// The part of it that shows nothing, where there is no sky.
    pub background_part: f32,
    /// The part of it that shows backs of surfaces.
    pub back_part: f32,
    /// Standard error of its luminance, as far as its samples tell: 0 for one sample.
    pub noise: f32,
}

impl Developed {
    /// The part of it that shows lit surfaces, 0…1.
    pub fn surface_part(&self) -> f32 {
        (1.0 - self.source_part - self.background_part - self.back_part).max(0.0)
    }

    /// Mean radiance; what is no light counts as black.
    pub fn radiance(&self) -> Vec3 {
        self.surfaces * self.surface_part() + self.sources * self.source_part
    }
}
