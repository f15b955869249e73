//! Light by direction in spherical harmonics of the first two bands.

use std::f32::consts::{FRAC_1_PI, PI};

use glam::Vec3;

/// Light by direction as coefficients of the real spherical harmonics of bands 0 and 1: c = ∫ L(ω) Y(ω) dω, in the order
/// Y₀₀, Y₁₋₁, Y₁₀, Y₁₁; orthonormal, and without the sign (-1)ᵐ.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Harmonics(pub [Vec3; 4]);

impl Harmonics {
    /// Y₀₀: 1 / (2 √π).
    pub const Y0: f32 = 0.282_094_8;

    /// Y₁₋₁, Y₁₀ and Y₁₁ over y, z and x of a unit vector: √(3 / (4 π)).
    pub const Y1: f32 = 0.488_602_5;

    /// The light of a hemisphere about a normal that is equally bright everywhere and gives this irradiance.
    pub fn even(normal: Vec3, irradiance: Vec3) -> Self {
        let radiance = irradiance * FRAC_1_PI;
        let mut even = Self::default();
        even.add_moments(radiance * (2.0 * PI), normal * PI, radiance);
        even
    }

    /// Add light from a direction: radiance times solid angle.
    pub fn add(&mut self, direction: Vec3, light: Vec3) {
        self.add_moments(light, direction, light);
    }

    /// Add ∫ L dω, and ∫ L ω dω as a vector times a colour.
    fn add_moments(&mut self, light: Vec3, vector: Vec3, color: Vec3) {
        let Vec3 { x, y, z } = vector * Self::Y1;
        self.0[0] += light * Self::Y0;
        for (sum, part) in self.0[1..].iter_mut().zip([y, z, x]) {
            *sum += color * part;
        }
    }

    /// ∫ L dω, and ∫ L ω dω by axis.
    pub fn moments(&self) -> (Vec3, [Vec3; 3]) {
        let [even, y, z, x] = self.0;
        (even / Self::Y0, [x, y, z].map(|sum| sum / Self::Y1))
    }

    /// Irradiance of a surface with this unit normal as these bands tell it (Ramamoorthi and Hanrahan, "An Efficient
    /// Representation for Irradiance Environment Maps", 2001). Negative where the light is concentrated behind it.
    pub fn irradiance(&self, normal: Vec3) -> Vec3 {
        let [even, y, z, x] = self.0;
        let turned = x * normal.x + y * normal.y + z * normal.z;
        even * (PI * Self::Y0) + turned * (2.0 * PI / 3.0 * Self::Y1)
    }

    /// The same light, scaled by channel so that it gives an irradiance, where it now gives `found`. At most doubled: what
    /// is missing then, or where nothing was found, comes evenly from the hemisphere.
    pub fn scaled_to(&self, irradiance: Vec3, found: Vec3, normal: Vec3) -> Self {
        let factor = |wanted: f32, found: f32| {
            let ratio = wanted / found;
            if ratio.is_nan() || found <= 0.0 {
                0.0
            } else {
                ratio.clamp(0.0, 2.0)
            }
        };
        let factors = Vec3::new(
            factor(irradiance.x, found.x),
            factor(irradiance.y, found.y),
            factor(irradiance.z, found.z),
        );
        let rest = Self::even(normal, (irradiance - found * factors).max(Vec3::ZERO));
        let mut scaled = *self;
        for (sum, rest) in scaled.0.iter_mut().zip(rest.0) {
            *sum = *sum * factors + rest;
        }
        scaled
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Random, hemisphere_direction};

    const NORMAL: Vec3 = Vec3::new(0.48, -0.6, 0.64);

    #[test]
    fn known_lights_have_known_coefficients() {
        // A small lamp: L Ω Y.
        let (direction, light) = (Vec3::new(0.36, 0.48, -0.8), Vec3::new(2.0, 1.0, 0.5));
        let mut lamp = Harmonics::default();
        lamp.add(direction, light);
        let expected = [0.282_094_8, 0.234_529_2, -0.390_882, 0.175_896_9];
        for (sum, expected) in lamp.0.into_iter().zip(expected) {
            assert!(sum.abs_diff_eq(light * expected, 1e-5), "{sum} {expected}");
        }
        // A hemisphere of radiance 1: 2 π Y₀₀, and π Y of its normal.
        let even = Harmonics::even(NORMAL, Vec3::splat(PI));
        let expected = [
            1.772_454,
            1.534_99 * NORMAL.y,
            1.534_99 * NORMAL.z,
            1.534_99 * NORMAL.x,
        ];
        for (sum, expected) in even.0.into_iter().zip(expected) {
            assert!(sum.abs_diff_eq(Vec3::splat(expected), 1e-5));
        }
        let (all, vector) = even.moments();
        assert!(all.abs_diff_eq(Vec3::splat(2.0 * PI), 1e-5));
        assert!(vector[1].abs_diff_eq(Vec3::splat(PI * NORMAL.y), 1e-5));
    }

    #[test]
    fn the_irradiance_of_an_even_hemisphere_is_that_of_the_part_that_is_faced() {
        let even = Harmonics::even(NORMAL, Vec3::splat(PI));
        for turned in [NORMAL, -NORMAL, NORMAL.any_orthonormal_vector()] {
            // Exact for two bands: the others of a clamped cosine are even, those of a hemisphere odd.
            let expected = 0.5 * PI * (1.0 + turned.dot(NORMAL));
            let found = even.irradiance(turned);
            assert!(found.abs_diff_eq(Vec3::splat(expected), 1e-5), "{found}");
        }
    }

    #[test]
    fn sums_over_directions_are_those_of_the_even_hemisphere() {
        let mut random = Random::new(3, 0);
        let (mut sum, count) = (Harmonics::default(), 40_000);
        for _ in 0..count {
            let direction = hemisphere_direction(NORMAL, random.uniform_2d());
            sum.add(direction, Vec3::splat(2.0 * PI / count as f32));
        }
        let even = Harmonics::even(NORMAL, Vec3::splat(PI));
        for (sum, even) in sum.0.into_iter().zip(even.0) {
            // A few standard errors, each of 2 π Y / √count.
            assert!(sum.abs_diff_eq(even, 0.05), "{sum} {even}");
        }
    }

    #[test]
    fn scaled_light_gives_the_irradiance_whatever_was_found() {
        let mut found = Harmonics::default();
        found.add(NORMAL, Vec3::new(1.0, 0.1, 0.0));
        let wanted = Vec3::new(0.5, 1.0, 3.0);
        let scaled = found.scaled_to(wanted, Vec3::new(1.0, 0.1, 0.0), NORMAL);
        let even = Harmonics::even(NORMAL, Vec3::new(0.0, 0.8, 3.0));
        let expected = |index: usize| found.0[index] * Vec3::new(0.5, 2.0, 0.0) + even.0[index];
        for index in 0..4 {
            assert!(scaled.0[index].abs_diff_eq(expected(index), 1e-6));
        }
        let dark = found.scaled_to(Vec3::ZERO, Vec3::splat(f32::MIN_POSITIVE), NORMAL);
        assert_eq!(dark, Harmonics::default());
    }
}
