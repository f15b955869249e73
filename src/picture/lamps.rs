//! Light straight from emitters and the sun at a surface, from points chosen on them, and over single plane mirrors.
//!
//! Rays that choose directions by themselves meet emitters as well: both count in part, by the balance heuristic of Veach and
//! Guibas ("Optimally Combining Sampling Techniques for Monte Carlo Rendering", 1995).

use std::iter;

use glam::{Vec2, Vec3};

use super::surface::{LitScene, Surface};
use crate::{
    geometry::Image,
    scene::{LobeValue, TriangleId},
};

/// Where light arrives.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    pub(super) point: Vec3,
    pub(super) triangle: TriangleId,
}

/// Light from a direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arriving {
    /// Unit vector towards where it comes from.
    pub(super) direction: Vec3,
    /// Radiance times solid angle times the value of the direction.
    pub(super) light: Vec3,
    pub(super) source: Source,
}

/// Where light comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Source {
    /// Straight from an emitter.
    Emitter(TriangleId),
    /// Straight from the sun.
    Sun,
    /// From surfaces, the sky, or mirrors.
    Other,
}

impl Surface {
    /// Where its light arrives.
    pub(super) fn as_start(&self) -> Start {
        Start {
            point: self.start,
            triangle: self.triangle,
        }
    }
}

impl LitScene<'_> {
    /// Light of the sun, of a point of an emitter, and of one of its image in each mirror. `toward` says what a direction is
    /// worth, and with which density rays choose it; `choose` gives a number in 0…1 and a point of the unit square.
    pub(super) fn arriving_from_lamps(
        &self,
        at: Start,
        toward: impl Fn(Vec3) -> LobeValue,
        mut choose: impl FnMut() -> (f64, Vec2),
        mut add: impl FnMut(Arriving),
    ) {
        let images = || {
            let images = self.rays.images().iter();
            let images = images.filter(|image| image.is_single());
            iter::once(None).chain(images.map(|image| Some(&**image)))
        };
        for image in images() {
            if let Some(arriving) = self.arriving_from_emitter(at, &toward, image, choose()) {
                add(arriving);
            }
        }
        let Some(sun) = self.scene.environment.sun else {
            return;
        };
        for image in images() {
            let sampled = sun.sample(choose().1);
            if let Some(arriving) = self.arriving_from_sun(at, &toward, image, sampled) {
                add(Arriving {
                    light: sun.irradiance * arriving.light,
                    ..arriving
                });
            }
        }
    }

    fn arriving_from_emitter(
        &self,
        at: Start,
        toward: &impl Fn(Vec3) -> LobeValue,
        image: Option<&Image>,
        (choice, square): (f64, Vec2),
    ) -> Option<Arriving> {
        let point = self.emitters.sample(self.scene, choice, square)?;
        let seen = image.map_or(point.position, |image| image.place(point.position));
        let separation = seen - at.point;
        let direction = separation.normalize_or_zero();
        let toward = toward(direction);
        let sent = image.map_or(direction, |image| image.source_direction(direction));
        let (normal, is_back) = self.side(point.triangle, sent);
        let source_cosine = -normal.dot(sent);
        let is_lit = self.is_lit(point.triangle, is_back);
        let is_own = image.is_none() && point.triangle == at.triangle;
        if toward.value <= 0.0 || source_cosine <= 0.0 || !is_lit || is_own {
            return None;
        }
        let density = self.emitters.density(point.triangle) * separation.length_squared();
        let ends = [Some(at.triangle), Some(point.triangle)];
        let (from, to) = (at.point, point.position);
        let mut passing = match image {
            None => self.rays.transmittance(from, to, ends),
            Some(image) => {
                self.rays.passage_over(image, from, to, ends).transmittance * image.reflectance()
            }
        };
        passing *= self.scene.opacity_at(point.triangle, point.barycentric);
        let weight = toward.value * source_cosine / (density + source_cosine * toward.density);
        Some(Arriving {
            direction,
            light: self.emitted(&point) * weight * passing,
            source: match image {
                None => Source::Emitter(point.triangle),
                Some(_) => Source::Other,
            },
        })
    }

    /// Light of the sun from one direction, for an irradiance of 1 square to it.
    fn arriving_from_sun(
        &self,
        at: Start,
        toward: &impl Fn(Vec3) -> LobeValue,
        image: Option<&Image>,
        (sent, weight): (Vec3, f32),
    ) -> Option<Arriving> {
        let direction = image.map_or(sent, |image| image.direction(sent));
        let value = toward(direction).value;
        if value <= 0.0 {
            return None;
        }
        let own = Some(at.triangle);
        let (passing, source) = match image {
            None => (
                self.rays.transmittance_outward(at.point, sent, own),
                Source::Sun,
            ),
            Some(image) => {
                let passage = self.rays.passage_outward_over(image, at.point, sent, own);
                (passage.transmittance * image.reflectance(), Source::Other)
            }
        };
        Some(Arriving {
            direction,
            light: passing * (value * weight),
            source,
        })
    }

    /// The part of the emission of a surface that counts where a ray meets it that was chosen with this density, 1/sr, after a
    /// way of this length; the rest counts where points of emitters are chosen.
    pub(super) fn share_of_ray(
        &self,
        surface: &Surface,
        direction: Vec3,
        density: f32,
        length: f32,
    ) -> f32 {
        let by_ray = density * -surface.flat_normal.dot(direction);
        let by_point = self.emitters.density(surface.triangle) * length * length;
        if by_ray > 0.0 {
            by_ray / (by_ray + by_point)
        } else {
            0.0
        }
    }
}
