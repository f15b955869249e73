//! The sun as an emitter: a disc in the sky.

use std::f32::consts::{FRAC_2_PI, FRAC_PI_2, FRAC_PI_4};

use glam::{Vec2, Vec3, Vec4};

use super::{
    light_tree::{Arriving, Target},
    sky::OutsideRay,
};
use crate::{
    hierarchy::{Moments, Reading},
    scene::Sun,
    transport::luminance,
};

/// The sun as an emitter.
#[derive(Clone, Debug)]
pub(crate) struct SunDisc {
    /// Unit vector towards its centre, and two across.
    direction: Vec3,
    across: [Vec3; 2],
    /// Sine of half its angular diameter.
    sine: f32,
    /// Irradiance of a surface that faces it, W/m².
    irradiance: Vec4,
    /// As in [`super::sky::SkyTree`].
    table: Option<(Moments<Vec4>, Reading)>,
}

impl SunDisc {
    /// The disc of a sun; `None` if it is dark. The reading as in [`super::sky::SkyTree::new`].
    pub(super) fn new(sun: &Sun, reading: Option<Reading>) -> Option<Self> {
        let irradiance = sun.irradiance.extend(0.0);
        let (one, other) = sun.direction.any_orthonormal_pair();
        (luminance(irradiance) > 0.0).then(|| Self {
            direction: sun.direction,
            across: [one, other],
            sine: (0.5 * sun.diameter).sin(),
            irradiance,
            table: reading.map(|reading| (Moments::of(-sun.direction, irradiance), reading)),
        })
    }

    /// Its angular diameter, radians.
    pub(super) fn width(&self) -> f32 {
        2.0 * self.sine
    }

    /// Irradiance of a surface that faces it, W/m².
    pub(super) fn brightest(&self) -> Vec4 {
        self.irradiance
    }

    /// Mean of the unoccluded irradiance over all normals, W/m².
    pub(super) fn mean_irradiance(&self) -> Vec4 {
        self.irradiance * 0.25
    }

    /// Unoccluded irradiance of a surface with this unit normal, W/m²; `cut` is set to its one part.
    pub(super) fn unoccluded(&self, normal: Vec3, cut: &mut Vec<Arriving>) -> Vec4 {
        cut.clear();
        let exact = self.irradiance * self.mean_cosine(normal);
        if exact != Vec4::ZERO {
            cut.push(Arriving {
                until: luminance(exact),
                target: Target::Node(0),
            });
        }
        match &self.table {
            Some((moments, reading)) => moments.project(-normal, *reading).max(Vec4::ZERO),
            None => exact,
        }
    }

    /// Mean of the cosine over the disc, 0 below the horizon. Across the horizon the height varies over the disc as a
    /// coordinate does over a circle.
    fn mean_cosine(&self, normal: Vec3) -> f32 {
        let height = self.direction.dot(normal);
        let place = height / self.sine;
        if place >= 1.0 {
            return height;
        }
        if place <= -1.0 {
            return 0.0;
        }
        let chord = (1.0 - place * place).max(0.0).sqrt();
        let mean = place * 0.5 * (1.0 + FRAC_2_PI * (place * chord + place.asin()))
            + FRAC_2_PI / 3.0 * chord.powi(3);
        mean * self.sine
    }

    /// A ray to the disc for a point of the unit square; `None` below the horizon.
    pub(super) fn aim(&self, normal: Vec3, square: Vec2) -> Option<OutsideRay> {
        let [x, y] = disc_point(square).to_array().map(|x| x * self.sine);
        let along = (1.0 - x * x - y * y).max(0.0).sqrt();
        let direction = self.direction * along + self.across[0] * x + self.across[1] * y;
        let weight = direction.dot(normal);
        (weight > 0.0).then(|| OutsideRay {
            direction,
            weight,
            color: self.irradiance / luminance(self.irradiance),
            leaf: 0,
        })
    }
}

/// A uniform point of the unit disc from a point of the unit square (Shirley and Chiu, 1997).
fn disc_point(square: Vec2) -> Vec2 {
    let at = square * 2.0 - 1.0;
    if at == Vec2::ZERO {
        return at;
    }
    let (radius, angle) = if at.x.abs() > at.y.abs() {
        (at.x, FRAC_PI_4 * at.y / at.x)
    } else {
        (at.y, FRAC_PI_2 - FRAC_PI_4 * at.x / at.y)
    };
    Vec2::from_angle(angle) * radius
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Random;

    #[test]
    fn irradiance_is_the_mean_over_the_disc_at_any_height() {
        let mut random = Random::new(1, 0);
        for diameter in [0.53f32.to_radians(), 0.2] {
            let sun = Sun {
                direction: Vec3::Y,
                irradiance: Vec3::splat(2.0),
                diameter,
            };
            let disc = SunDisc::new(&sun, None).unwrap();
            for height in [-1.2f32, -0.9, -0.3, 0.0, 0.4, 0.8, 1.1, 8.0] {
                let angle = (height * 0.5 * diameter).min(1.5);
                let normal = Vec3::new(angle.cos(), angle.sin(), 0.0);
                let count = 20_000;
                let weights = (0..count).map(|_| {
                    disc.aim(normal, random.uniform_2d())
                        .map_or(0.0, |ray| ray.weight)
                });
                let mean = 2.0 * weights.sum::<f32>() / count as f32;
                let found = disc.unoccluded(normal, &mut Vec::new()).x;
                let scale = 2.0 * disc.sine;
                assert!(
                    (found - mean).abs() < 0.02 * scale.max(mean),
                    "{found} {mean}"
                );
            }
        }
    }

    #[test]
    fn the_table_of_the_sun_is_that_of_one_face() {
        let sun = Sun {
            direction: Vec3::new(0.6, 0.8, 0.0),
            irradiance: Vec3::ONE,
            diameter: 0.01,
        };
        let read = |reading, normal| {
            let disc = SunDisc::new(&sun, Some(reading)).unwrap();
            disc.unoccluded(normal, &mut Vec::new()).x
        };
        assert!((read(Reading::SixFace, Vec3::Y) - 0.8).abs() < 1e-5);
        assert!((read(Reading::Bounded, sun.direction) - 1.0).abs() < 1e-5);
        assert!(read(Reading::Bounded, -sun.direction) < 1e-5);
    }
}
