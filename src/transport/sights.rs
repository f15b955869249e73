//! Many clusters as seen from a point: the irradiance of a face, four clusters at a time.

use std::f32::consts::PI;

use glam::{Vec3, Vec4};

use super::Sight;
use crate::{geometry::Vectors4, hierarchy::Quantity as _};

/// Sights with the transmission of each.
#[derive(Clone, Debug, Default)]
pub struct Sights {
    /// Centres, four to a group, and squared radii of the sources.
    places: Vec<(Vectors4, Vec4)>,
    /// The light of each, in the same order; the last group may have fewer than four.
    lights: Vec<Light>,
}

/// The light of a sight.
#[derive(Clone, Copy, Debug)]
struct Light {
    power: Vec4,
    brightest: Vec4,
    transmission: Vec4,
}

impl Sights {
    /// Remove all.
    pub fn clear(&mut self) {
        self.places.clear();
        self.lights.clear();
    }

    /// Add one.
    pub fn push(&mut self, sight: &Sight, transmission: Vec4) {
        let lane = self.lights.len() % 4;
        if lane == 0 {
            self.places
                .push((Vectors4::splat(sight.centre), Vec4::ZERO));
        }
        if let Some((centres, extents)) = self.places.last_mut() {
            centres.set(lane, sight.centre);
            extents[lane] = sight.extent;
        }
        self.lights.push(Light {
            power: sight.power,
            brightest: sight.brightest,
            transmission,
        });
    }

    /// The sum plus the irradiance of a face with this unit normal at a point, in the order of the sights: for each
    /// [`Sight::incident`] on that face ([`on_face`](super::Incident::on_face)), times the transmission.
    pub fn add_to(&self, sum: Vec4, point: Vec3, normal: Vec3) -> Vec4 {
        let (point, normal) = (Vectors4::splat(point), Vectors4::splat(normal));
        let groups = self.places.iter().zip(self.lights.chunks(4));
        groups.fold(sum, |sum, ((centres, extents), lights)| {
            let separation = *centres - point;
            let squared = separation.dot(&separation);
            let cosine = (separation / squared.sqrt()).dot(&normal);
            let spread = (*extents / squared.max(Vec4::splat(f32::MIN_POSITIVE))).min(Vec4::ONE);
            let seen =
                cosine.max(Vec4::ZERO) * (Vec4::ONE - spread) + 0.5 * (Vec4::ONE + cosine) * spread;
            // A source at the point itself sends nothing.
            let is_apart = squared.cmpgt(Vec4::ZERO) & cosine.is_finite_mask();
            let seen = Vec4::select(is_apart, seen, Vec4::ZERO).to_array();
            let falloff = Vec4::select(is_apart, Vec4::ONE / (PI * squared), Vec4::ZERO).to_array();
            lights.iter().enumerate().fold(sum, |sum, (lane, light)| {
                let strength = (light.power * falloff[lane]).saturated(light.brightest);
                sum + strength * seen[lane] * light.transmission
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Random;

    #[test]
    fn sights_together_send_the_sum_of_each() {
        let mut random = Random::new(7, 0);
        let mut vector = || Vec3::from_array([(); 3].map(|()| random.uniform() - 0.5));
        let (point, normal) = (vector(), vector().normalize_or_zero());
        let mut sights = Sights::default();
        let mut sum = Vec4::splat(0.25);
        // Full groups and partial ones; some sources at the point, some with an extent.
        for index in 0..11 {
            let sight = Sight {
                centre: if index % 5 == 3 { point } else { vector() },
                power: vector().abs().extend(1.0),
                brightest: vector().abs().extend(2.0),
                extent: if index % 2 == 0 { 0.0 } else { 0.3 },
            };
            let transmission = vector().abs().extend(0.5);
            sum += sight.incident(point).on_face(normal) * transmission;
            sights.push(&sight, transmission);
            let found = sights.add_to(Vec4::splat(0.25), point, normal);
            assert!(
                (found - sum).abs().max_element() < 1e-6 * sum.max_element(),
                "{index}"
            );
        }
        sights.clear();
        assert_eq!(sights.add_to(Vec4::ONE, point, normal), Vec4::ONE);
    }
}
