//! Light by rays from the surface of a pixel.

use std::f32::consts::PI;

use glam::Vec3;

use super::{
    sampler::{Numbers, Sampler, Use},
    surface::{LitScene, Surface},
};
use crate::{
    geometry::cosine_direction,
    scene::luminance,
    solver::{LIGHT_KINDS, LightSampler},
};

/// Kinds of light: direct light of each kind, and indirect light.
pub(super) const KINDS: usize = LIGHT_KINDS + 1;

/// Index of indirect light.
pub(super) const INDIRECT: usize = LIGHT_KINDS;

/// The light at a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Record {
    pub(super) position: Vec3,
    pub(super) normal: Vec3,
    /// Records of other groups do not count: there is one of all pixels, and one of each chart of a lightmap.
    pub(super) group: u32,
    /// Distance to the next pixel on a surface square to the view.
    pub(super) spacing: f32,
    /// Unoccluded direct irradiance, W/m².
    pub(super) unoccluded: Vec3,
    /// Luminance of the irradiance stored there.
    pub(super) stored: f32,
    /// By kind: how fast it changes, as the inverse of a distance. Of direct light the sharpness of its shadows, 0 where
    /// nothing is blocked; of indirect light the inverse of the harmonic mean of the lengths of its rays.
    pub(super) changes: [f32; KINDS],
    /// Mean of unit vectors towards what the rays of indirect light met, along the surface, each over the length of its ray:
    /// light changes in this direction, along a corner it does not.
    pub(super) towards: Vec3,
    /// By kind, W/m²: what is missing of direct light, and what is more than stored of indirect light.
    pub(super) light: [Estimate; KINDS],
}

/// The mean of several estimates.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Estimate {
    pub(super) mean: Vec3,
    pub(super) count: f32,
    /// Sum of the squared differences of the luminances from their mean.
    spread: f32,
}

impl Estimate {
    /// That of so many estimates with a mean of this variance.
    fn of_mean(mean: Vec3, variance: f32, count: u32) -> Self {
        let count = count as f32;
        Self {
            mean,
            count,
            spread: variance * count * (count - 1.0),
        }
    }

    /// Add an estimate.
    fn add(&mut self, value: Vec3) {
        self.count += 1.0;
        let before = value - self.mean;
        self.mean += before / self.count;
        self.spread += luminance(before) * luminance(value - self.mean);
    }

    /// Variance of an estimate. Of one it is not known, and 0.
    pub(super) fn variance(&self) -> f32 {
        self.spread.max(0.0) / (self.count - 1.0).max(1.0)
    }

    /// Add other estimates.
    pub(super) fn merge(&mut self, other: &Self) {
        let count = self.count + other.count;
        if count > 0.0 {
            let apart = luminance(other.mean - self.mean);
            self.spread += other.spread + apart * apart * self.count * other.count / count;
            self.mean = self.mean.lerp(other.mean, other.count / count);
            self.count = count;
        }
    }
}

/// Shoots the rays of records, for the pixels of one thread.
pub(super) struct Recorder<'a> {
    lit: &'a LitScene<'a>,
    direct: Option<Box<dyn LightSampler + 'a>>,
}

impl<'a> Recorder<'a> {
    pub(super) fn new(lit: &'a LitScene<'a>) -> Self {
        Self {
            lit,
            direct: lit.lights.map(|lights| lights.sampler()),
        }
    }

    /// So many rays to each kind of light and over the hemisphere; `numbers` are those of the first.
    pub(super) fn record(
        &mut self,
        surface: &Surface,
        spacing: f32,
        sampler: &Sampler,
        numbers: Numbers,
        counts: [u32; 2],
    ) -> Record {
        let [all, direct] = self.lit.stored(surface);
        let mut record = Record {
            position: surface.position,
            normal: surface.normal,
            group: 0,
            spacing,
            unoccluded: Vec3::ZERO,
            stored: luminance(all),
            changes: [0.0; KINDS],
            towards: Vec3::ZERO,
            light: [Estimate::default(); KINDS],
        };
        let [to_lights, over_hemisphere] = counts;
        if let Some(lights) = self.direct.as_mut().filter(|_| to_lights > 0) {
            let (rays, shuffle) = sampler.shadow(numbers, to_lights);
            let light = lights.light(&surface.lit_point(direct), rays, shuffle);
            record.unoccluded = light.unoccluded;
            for (kind, shadow) in light.shadows.into_iter().enumerate() {
                record.light[kind] = Estimate::of_mean(shadow.missing, shadow.variance, to_lights);
                record.changes[kind] = shadow.sharpness;
            }
        }
        let stored = (all - direct).max(Vec3::ZERO);
        self.indirect(
            surface,
            stored,
            sampler,
            numbers,
            over_hemisphere,
            &mut record,
        );
        record
    }

    /// What indirect light is more than stored, and how fast it changes.
    fn indirect(
        &mut self,
        surface: &Surface,
        stored: Vec3,
        sampler: &Sampler,
        numbers: Numbers,
        count: u32,
        record: &mut Record,
    ) {
        let (mut light, mut nearness, mut towards) = (Estimate::default(), 0.0, Vec3::ZERO);
        for numbers in (0..count).map(|ray| numbers.after(ray)) {
            let square = sampler.point(numbers, Use::Hemisphere);
            let direction = cosine_direction(surface.normal, square);
            if direction.dot(surface.flat_normal) <= 0.0 {
                // Below the surface: as if it met what the others meet.
                continue;
            }
            let (met, tint, distance) = self.meet(surface, direction);
            let near = 1.0 / distance.max(f32::MIN_POSITIVE);
            nearness += near;
            let along = direction - surface.normal * surface.normal.dot(direction);
            towards += along.normalize_or_zero() * near;
            let arriving = met.map_or(Vec3::ZERO, |met| {
                let irradiance = match distance < self.lit.element_size(&met) {
                    true => self.irradiance(&met, sampler, numbers),
                    false => self.lit.stored(&met)[0],
                };
                tint * self.lit.sent(&met, irradiance)
            });
            light.add(arriving * PI - stored);
        }
        let rays = count.max(1) as f32;
        record.light[INDIRECT] = light;
        (record.changes[INDIRECT], record.towards) = (nearness / rays, towards / rays);
    }

    /// The surface that a ray from another one meets over mirrors, the tint of its light, and the length of its way.
    fn meet(&self, from: &Surface, direction: Vec3) -> (Option<Surface>, Vec3, f32) {
        let rays = self.lit.rays;
        let end = rays.followed(from.start, direction, Some(from.triangle));
        match end.hit {
            None => (None, Vec3::ONE, f32::INFINITY),
            Some(hit) => {
                let met = self.lit.surface(end.origin, end.direction, hit);
                (met, end.tint, end.length + hit.distance)
            }
        }
    }

    /// Irradiance at a surface by a ray to each kind of light and one over the hemisphere.
    fn irradiance(&mut self, surface: &Surface, sampler: &Sampler, numbers: Numbers) -> Vec3 {
        let [all, stored] = self.lit.stored(surface);
        let direct = match &mut self.direct {
            None => stored,
            Some(lights) => {
                let (rays, shuffle) = sampler.shadow(numbers, 1);
                let light = lights.light(&surface.lit_point(stored), rays, shuffle);
                light.unoccluded
                    - light
                        .shadows
                        .map(|shadow| shadow.missing)
                        .iter()
                        .sum::<Vec3>()
            }
        };
        let direction = cosine_direction(surface.normal, sampler.point(numbers, Use::Further));
        let indirect = match self.meet(surface, direction) {
            _ if direction.dot(surface.flat_normal) <= 0.0 => (all - stored).max(Vec3::ZERO),
            (None, ..) => Vec3::ZERO,
            (Some(met), tint, _) => tint * self.lit.sent(&met, self.lit.stored(&met)[0]) * PI,
        };
        direct + indirect
    }
}

impl Record {
    /// What the irradiance is more than the indirect light stored there, from the light of each kind.
    pub(super) fn excess_of(&self, light: [Vec3; KINDS]) -> Vec3 {
        let missing: Vec3 = light[..INDIRECT].iter().sum();
        (self.unoccluded - missing).max(Vec3::ZERO) + light[INDIRECT]
    }
}
