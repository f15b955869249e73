//! Rays from the eye, through what they pass, to what they show.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::{
    Subject,
    film::{Sample, Unlit},
    surface::{LitScene, Surface},
};
use crate::{
    geometry::Hit,
    scene::{Sky, TriangleId, luminance},
};

/// Surfaces that a ray passes through at most. Fewer, and leaves behind leaves are black; more take time.
const MOST_PASSED: u32 = 64;

/// What passes below which a ray ends. Larger is seen behind many panes; smaller takes time.
const LEAST_PASSING: f32 = 1e-3;

/// What a ray from the eye shows.
#[derive(Clone, Debug, Default)]
pub(super) struct Sight {
    /// The surfaces that it meets, and the part of their radiance that arrives.
    pub(super) surfaces: Vec<(Surface, Vec3)>,
    /// Radiance from outside that arrives.
    outside: Vec3,
    unlit: Unlit,
}

/// What a ray meets, as the eye sees it.
enum Seen {
    /// It is looked through.
    Nothing,
    Back,
    Surface(Surface),
}

impl Sight {
    /// Follow a ray.
    pub(super) fn follow(
        &mut self,
        subject: &Subject<'_>,
        lit: &LitScene<'_>,
        origin: Vec3,
        direction: Vec3,
    ) {
        self.surfaces.clear();
        (self.outside, self.unlit) = (Vec3::ZERO, Unlit::default());
        let (mut passing, mut origin, mut from) = (Vec3::ONE, origin, None);
        for _ in 0..MOST_PASSED {
            let mean = passing.element_sum() / 3.0;
            let Some(hit) = lit.rays.closest_shown(origin, direction, from) else {
                match outside(lit, direction) {
                    Some(radiance) => self.outside = passing * radiance,
                    None => self.unlit.background = mean,
                }
                break;
            };
            match seen(subject, lit, origin, direction, hit) {
                Seen::Nothing => {}
                Seen::Back => {
                    self.unlit.back = mean;
                    break;
                }
                Seen::Surface(surface) => {
                    let passed = passed(lit, hit.triangle);
                    let part = passing * (1.0 - passed.element_sum() / 3.0);
                    self.surfaces.push((surface, part));
                    passing *= passed;
                    if passing.max_element() < LEAST_PASSING {
                        break;
                    }
                }
            }
            (origin, from) = (origin + direction * hit.distance, Some(hit.triangle));
        }
    }

    /// The surface of which most arrives that is reflected.
    pub(super) fn main_surface(&self) -> Option<&Surface> {
        let weight = |(surface, part): &(Surface, Vec3)| luminance(surface.reflectance * part);
        let shown = self.surfaces.iter().filter(|shown| weight(shown) > 0.0);
        let main = shown.max_by(|a, b| weight(a).total_cmp(&weight(b)));
        main.map(|(surface, _)| surface)
    }

    /// What is seen where the surfaces get this irradiance.
    pub(super) fn sample(&self, mut irradiance: impl FnMut(&Surface) -> Vec3) -> Sample {
        let (mut reflected, mut emitted) = (Vec3::ZERO, self.outside);
        for (surface, part) in &self.surfaces {
            if surface.reflectance != Vec3::ZERO {
                let radiance = surface.reflectance * FRAC_1_PI * irradiance(surface);
                reflected += part * radiance.max(Vec3::ZERO);
            }
            emitted += part * surface.emission;
        }
        Sample {
            radiance: reflected + emitted,
            is_source: luminance(emitted) > luminance(reflected),
            unlit: self.unlit,
        }
    }
}

/// Radiance from outside; `None` where the background is seen instead.
fn outside(lit: &LitScene<'_>, direction: Vec3) -> Option<Vec3> {
    let environment = &lit.scene.environment;
    match &environment.sky {
        Sky::Dark => None,
        _ if environment.is_default => None,
        sky => Some(sky.radiance(direction)),
    }
}

/// What the eye sees of what a ray meets.
fn seen(
    subject: &Subject<'_>,
    lit: &LitScene<'_>,
    origin: Vec3,
    direction: Vec3,
    hit: Hit,
) -> Seen {
    let (normal, is_back) = lit.side(hit.triangle, direction);
    let position = origin + direction * hit.distance;
    if subject.hidden.is_some_and(|hides| hides(position, normal)) {
        return Seen::Nothing;
    }
    match lit.surface(origin, direction, hit) {
        Some(surface) => Seen::Surface(surface),
        None if is_back && !subject.shows_backs => Seen::Nothing,
        None => Seen::Back,
    }
}

/// The part of the light that passes through a triangle where it is not cut out.
fn passed(lit: &LitScene<'_>, triangle: TriangleId) -> Vec3 {
    match lit.rays.is_see_through(triangle) {
        true => lit.scene.material(triangle).transmission(),
        false => Vec3::ZERO,
    }
}
