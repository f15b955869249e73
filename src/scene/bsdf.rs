//! How surfaces send light in preferred directions, beside what they reflect diffusely: mirrors, gloss and glass.
//!
//! Directions point away from the surface. Gloss is a microfacet lobe with the distribution GGX and the separable masking of
//! Smith (Walter et al., "Microfacet Models for Refraction through Rough Surfaces", 2007); its facets reflect alike from all
//! sides, as `Ks` says.

use std::{
    f32::consts::{FRAC_1_PI, TAU},
    sync::OnceLock,
};

use glam::{Vec2, Vec3};

/// What a material sends in preferred directions. Linear RGB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Specular {
    /// All of it in one direction.
    Mirror {
        /// Part that is reflected, 0…1.
        reflectance: Vec3,
    },
    /// About one direction.
    Gloss {
        /// Part that the facets reflect, 0…1.
        reflectance: Vec3,
        /// How much the facets are tilted, α of GGX: above 0, at most 1.
        roughness: f32,
    },
    /// Through the surface, and reflected by it, as Fresnel's equations say, as far as the material is not opaque.
    Glass {
        /// Index of refraction, at least 1.
        index: f32,
        /// Whether it is a pane that light leaves in the direction in which it came, and not the surface of a solid.
        is_thin: bool,
    },
}

/// Roughness below which gloss is a mirror. A larger one sharpens gloss that can be told from a mirror; a smaller one makes
/// lobes that no lamp is sampled by.
pub(super) const LEAST_ROUGHNESS: f32 = 0.01;

impl Specular {
    /// A mirror where it is smooth, else gloss; nothing where nothing is reflected. A roughness that is not finite is 1.
    pub(super) fn of_roughness(reflectance: Vec3, roughness: f32) -> Option<Self> {
        let roughness = if roughness.is_finite() {
            roughness.min(1.0)
        } else {
            1.0
        };
        let specular = match roughness < LEAST_ROUGHNESS {
            true => Self::Mirror { reflectance },
            false => Self::Gloss {
                reflectance,
                roughness,
            },
        };
        let shines = reflectance.max_element() > 0.0;
        shines.then_some(specular)
    }

    /// The part that is reflected of light from all directions, by channel, 0…1.
    pub fn mean_reflectance(&self) -> Vec3 {
        match *self {
            Self::Mirror { reflectance } => reflectance,
            Self::Gloss {
                reflectance,
                roughness,
            } => reflectance * mean_albedo(roughness),
            Self::Glass { index, is_thin } => Vec3::splat(mean_fresnel(index, is_thin)),
        }
    }

    /// The part that passes of light from all directions, before it is coloured, 0…1.
    pub fn mean_transmittance(&self) -> f32 {
        match *self {
            Self::Mirror { .. } | Self::Gloss { .. } => 1.0,
            Self::Glass { index, is_thin } => 1.0 - mean_fresnel(index, is_thin),
        }
    }

    /// Its colour: the part that is reflected where nothing else takes from it.
    pub fn color(&self) -> Vec3 {
        match *self {
            Self::Mirror { reflectance } | Self::Gloss { reflectance, .. } => reflectance,
            Self::Glass { .. } => Vec3::ONE,
        }
    }

    /// The integrals of what is reflected of light from a direction at this cosine, its colour apart.
    pub fn moments(&self, cosine: f32) -> LobeMoments {
        match *self {
            Self::Mirror { .. } => LobeMoments::of_mirror(1.0, cosine),
            Self::Gloss { roughness, .. } => Gloss::new(roughness).moments(cosine),
            Self::Glass { index, is_thin } => {
                LobeMoments::of_mirror(fresnel_at(cosine, index, is_thin), cosine)
            }
        }
    }

    /// The roughness of its lobe, α of GGX; 0 for mirrors and glass.
    pub fn roughness(&self) -> f32 {
        match *self {
            Self::Gloss { roughness, .. } => roughness,
            Self::Mirror { .. } | Self::Glass { .. } => 0.0,
        }
    }

    /// The same with another colour; that of glass does not change.
    pub(super) fn with_color(self, color: Vec3) -> Self {
        match self {
            Self::Mirror { .. } => Self::Mirror { reflectance: color },
            Self::Gloss { roughness, .. } => Self::Gloss {
                reflectance: color,
                roughness,
            },
            Self::Glass { .. } => self,
        }
    }
}

/// The direction in which a mirror reflects a ray. `direction` is that of the ray, towards the surface.
pub fn reflected(direction: Vec3, normal: Vec3) -> Vec3 {
    direction.reflect(normal).normalize_or(-direction)
}

/// The direction in which a ray goes on behind a surface, and the part of it that is reflected instead (Fresnel's equations
/// for light that is not polarised); `None` for the direction where all is. `direction` is that of the ray, towards the
/// surface, `normal` that of the side that it comes from, `index` the index of refraction behind the surface over that before
/// it.
pub fn refracted(direction: Vec3, normal: Vec3, index: f32) -> (Option<Vec3>, f32) {
    let cosine = (-direction.dot(normal)).clamp(0.0, 1.0);
    let behind = 1.0 - (1.0 - cosine * cosine) / (index * index);
    if behind <= 0.0 {
        return (None, 1.0);
    }
    let behind = behind.sqrt();
    let onward = direction / index + normal * (cosine / index - behind);
    (onward.try_normalize(), fresnel(cosine, behind, index))
}

/// The part that a thin pane reflects, with all reflections within it. `cosine` is that of the angle to its normal.
pub fn reflected_by_pane(cosine: f32, index: f32) -> f32 {
    let cosine = cosine.clamp(0.0, 1.0);
    let behind = (1.0 - (1.0 - cosine * cosine) / (index * index)).max(0.0);
    let once = fresnel(cosine, behind.sqrt(), index);
    2.0 * once / (1.0 + once)
}

/// Fresnel's reflectance from the cosines before and behind a surface.
fn fresnel(before: f32, behind: f32, index: f32) -> f32 {
    let ratio = |a: f32, b: f32| if a + b > 0.0 { (a - b) / (a + b) } else { 1.0 };
    let (across, along) = (ratio(before, index * behind), ratio(index * before, behind));
    0.5 * (across * across + along * along)
}

/// The part that glass reflects of light from all directions.
fn mean_fresnel(index: f32, is_thin: bool) -> f32 {
    cosine_mean(|cosine| fresnel_at(cosine, index, is_thin))
}

/// The part that glass reflects of light from a direction at this cosine.
fn fresnel_at(cosine: f32, index: f32, is_thin: bool) -> f32 {
    if is_thin {
        return reflected_by_pane(cosine, index);
    }
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    refracted(Vec3::new(sine, 0.0, -cosine), Vec3::Z, index).1
}

/// Mean over the directions of a hemisphere, weighted by their cosines.
fn cosine_mean(value: impl Fn(f32) -> f32) -> f32 {
    /// Midpoints in the square of the cosine.
    const STEPS: u32 = 64;
    let midpoints = (0..STEPS).map(|step| ((step as f32 + 0.5) / STEPS as f32).sqrt());
    midpoints.map(value).sum::<f32>() / STEPS as f32
}

/// The lobe of gloss whose facets reflect everything.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gloss {
    roughness: f32,
}

/// What a lobe does in one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LobeValue {
    /// Value of the BSDF times the cosine at the surface, 1/sr.
    pub value: f32,
    /// Probability per steradian with which [`Gloss::sample`] chooses the direction.
    pub density: f32,
}

impl Gloss {
    /// Of a roughness, α of GGX.
    pub fn new(roughness: f32) -> Self {
        Self {
            roughness: roughness.clamp(LEAST_ROUGHNESS, 1.0),
        }
    }

    /// What is sent from one direction to another. All are unit vectors.
    pub fn value(&self, normal: Vec3, from: Vec3, to: Vec3) -> LobeValue {
        let (cosine_from, cosine_to) = (normal.dot(from), normal.dot(to));
        if cosine_from <= 0.0 || cosine_to <= 0.0 {
            return LobeValue {
                value: 0.0,
                density: 0.0,
            };
        }
        let half = (from + to).normalize_or(normal);
        let density = self.facets(normal, half) * self.unmasked(cosine_from) / (4.0 * cosine_from);
        LobeValue {
            value: density * self.unmasked(cosine_to),
            density,
        }
    }

    /// A direction to which light from another one goes, chosen by the facets that are visible (Dupuy and Benyoub, "Sampling
    /// Visible GGX Normals with Spherical Caps", 2023), and the value over the density there; `None` below the surface.
    pub fn sample(&self, normal: Vec3, from: Vec3, square: Vec2) -> Option<(Vec3, f32)> {
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        let local = Vec3::new(tangent.dot(from), bitangent.dot(from), normal.dot(from));
        let stretch = Vec3::new(self.roughness, self.roughness, 1.0);
        let stretched = (local * stretch).normalize_or(Vec3::Z);
        let height = (1.0 - square.y) * (1.0 + stretched.z) - stretched.z;
        let across = (1.0 - height * height).max(0.0).sqrt();
        let (sine, cosine) = (square.x * TAU).sin_cos();
        let cap = Vec3::new(across * cosine, across * sine, height);
        let half = ((cap + stretched) * stretch).normalize_or(Vec3::Z);
        let to = 2.0 * local.dot(half) * half - local;
        let world = tangent * to.x + bitangent * to.y + normal * to.z;
        (to.z > 0.0).then(|| (world.normalize_or(normal), self.unmasked(to.z)))
    }

    /// Density of the facets about a direction, 1/sr.
    fn facets(&self, normal: Vec3, half: Vec3) -> f32 {
        let cosine = normal.dot(half).max(0.0);
        // The sine from the cross product: small angles keep their digits.
        let sine = normal.cross(half).length();
        let squared = self.roughness * self.roughness;
        let spread = squared * cosine * cosine + sine * sine;
        squared * FRAC_1_PI / (spread * spread).max(f32::MIN_POSITIVE)
    }

    /// The part of the facets that no others hide from a direction.
    fn unmasked(&self, cosine: f32) -> f32 {
        let squared = self.roughness * self.roughness;
        let cosine = cosine.clamp(0.0, 1.0);
        let root = (squared + (1.0 - squared) * cosine * cosine).sqrt();
        2.0 * cosine / (cosine + root).max(f32::MIN_POSITIVE)
    }

    /// The part that is reflected of light from a direction at this cosine, 0…1.
    fn albedo(&self, cosine: f32) -> f32 {
        self.moments(cosine).albedo
    }

    /// The integrals of the lobe about a direction at this cosine.
    fn moments(&self, cosine: f32) -> LobeMoments {
        /// Midpoints along each side of the unit square.
        const STEPS: u32 = 24;
        let from = Vec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
        let squares = (0..STEPS * STEPS).map(|index| {
            let at = [index % STEPS, index / STEPS];
            Vec2::from(at.map(|step| (step as f32 + 0.5) / STEPS as f32))
        });
        let samples = squares.filter_map(|square| self.sample(Vec3::Z, from, square));
        let sum: Vec3 = samples
            .map(|(to, weight)| weight * Vec3::new(1.0, to.z, -to.x))
            .sum();
        let [albedo, along_normal, across] = (sum / (STEPS * STEPS) as f32).to_array();
        LobeMoments {
            albedo,
            along_normal,
            across,
        }
    }
}

/// Integrals of a lobe over all directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LobeMoments {
    /// Of the value, 0…1: the part that is reflected of light from one direction.
    pub albedo: f32,
    /// Of the value times the direction: along the normal, and along the surface, away from where the light comes from.
    pub along_normal: f32,
    /// See above.
    pub across: f32,
}

impl LobeMoments {
    /// Those of a mirror that reflects a part, for light from a direction at this cosine.
    fn of_mirror(part: f32, cosine: f32) -> Self {
        Self {
            albedo: part,
            along_normal: part * cosine,
            across: part * (1.0 - cosine * cosine).max(0.0).sqrt(),
        }
    }
}

/// The part that facets of a roughness reflect of light from all directions, 0…1.
fn mean_albedo(roughness: f32) -> f32 {
    /// Roughnesses that are known, evenly from 0 to 1.
    const KNOWN: usize = 33;
    static TABLE: OnceLock<[f32; KNOWN]> = OnceLock::new();
    let table = TABLE.get_or_init(|| {
        std::array::from_fn(|index| {
            let gloss = Gloss::new(index as f32 / (KNOWN - 1) as f32);
            cosine_mean(|cosine| gloss.albedo(cosine))
        })
    });
    let place = roughness.clamp(0.0, 1.0) * (KNOWN - 1) as f32;
    let below = (place as usize).min(KNOWN - 2);
    table[below] + (table[below + 1] - table[below]) * (place - below as f32)
}

/// Roughness of the highlight of an exponent (`Ns`): that of Phong's lobe, about.
pub(super) fn roughness_of_exponent(exponent: f32) -> f32 {
    (2.0 / (exponent.max(0.0) + 2.0)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::PI;

    fn direction(cosine: f32, azimuth: f32) -> Vec3 {
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        Vec3::new(sine * azimuth.cos(), sine * azimuth.sin(), cosine)
    }

    const ROUGHNESSES: [f32; 5] = [0.05, 0.1, 0.3, 0.6, 1.0];
    const COSINES: [f32; 5] = [0.02, 0.2, 0.5, 0.8, 1.0];

    #[test]
    fn gloss_is_reciprocal() {
        for roughness in ROUGHNESSES {
            let gloss = Gloss::new(roughness);
            for (from, to) in COSINES.into_iter().flat_map(|a| COSINES.map(|b| (a, b))) {
                for azimuth in [0.0, 1.0, 2.5, PI] {
                    let (from, to) = (direction(from, 0.0), direction(to, azimuth));
                    // Without the cosines.
                    let there = gloss.value(Vec3::Z, from, to).value / to.z;
                    let back = gloss.value(Vec3::Z, to, from).value / from.z;
                    assert!((there - back).abs() <= 1e-4 * there.max(back) + 1e-6);
                }
            }
        }
    }

    #[test]
    fn albedos_are_at_most_one_and_as_the_values_say() {
        for roughness in ROUGHNESSES {
            let gloss = Gloss::new(roughness);
            for cosine in COSINES {
                let from = direction(cosine, 0.4);
                let albedo = gloss.albedo(cosine);
                assert!((0.0..=1.0 + 1e-5).contains(&albedo), "{albedo}");
                // The integrals of value and density by the midpoint rule.
                let (steps, mut value, mut density) = (800, 0.0, 0.0);
                for row in 0..steps {
                    for column in 0..2 * steps {
                        let height = (row as f32 + 0.5) / steps as f32;
                        let azimuth = (column as f32 + 0.5) / steps as f32 * PI;
                        let to = gloss.value(Vec3::Z, from, direction(height, azimuth));
                        value += f64::from(to.value);
                        density += f64::from(to.density);
                    }
                }
                let cell = std::f64::consts::PI / f64::from(steps * steps);
                let (value, density) = ((value * cell) as f32, (density * cell) as f32);
                assert!(
                    (value - albedo).abs() < 0.015,
                    "{roughness} {cosine}: {value} {albedo}"
                );
                assert!(density <= 1.0 + 0.01 && density >= value - 1e-3);
            }
        }
    }

    #[test]
    fn moments_are_the_integrals_of_the_value() {
        for (roughness, cosine) in [(0.3, 0.9), (0.6, 0.3), (1.0, 0.6)] {
            let (gloss, from) = (Gloss::new(roughness), direction(cosine, 0.0));
            let moments = gloss.moments(cosine);
            let (steps, mut sum) = (400, Vec3::ZERO);
            for row in 0..steps {
                for column in 0..2 * steps {
                    let height = (row as f32 + 0.5) / steps as f32;
                    let to = direction(height, (column as f32 + 0.5) / steps as f32 * PI);
                    let value = gloss.value(Vec3::Z, from, to).value;
                    sum += value * Vec3::new(1.0, to.z, -to.x);
                }
            }
            let sum = sum * (PI / (steps * steps) as f32);
            let found = Vec3::new(moments.albedo, moments.along_normal, moments.across);
            assert!(found.abs_diff_eq(sum, 0.015), "{found} {sum}");
        }
        let mirror = Specular::Mirror {
            reflectance: Vec3::ONE,
        };
        let (of_mirror, smooth) = (mirror.moments(0.6), Gloss::new(0.0).moments(0.6));
        assert!((of_mirror.along_normal - 0.6).abs() < 1e-6);
        assert!((of_mirror.across - smooth.across).abs() < 0.01);
    }

    #[test]
    fn samples_have_the_weight_of_their_values() {
        for (roughness, cosine) in [(0.05, 0.9), (0.3, 0.2), (1.0, 0.5)] {
            let (gloss, from) = (Gloss::new(roughness), direction(cosine, 2.0));
            for square in [
                Vec2::new(0.1, 0.2),
                Vec2::new(0.7, 0.01),
                Vec2::new(0.4, 0.6),
            ] {
                let Some((to, weight)) = gloss.sample(Vec3::Z, from, square) else {
                    continue;
                };
                let LobeValue { value, density } = gloss.value(Vec3::Z, from, to);
                assert!((value / density / weight - 1.0).abs() < 1e-3);
            }
        }
    }

    #[test]
    fn glass_refracts_by_snell_and_reflects_by_fresnel() {
        let ray = |angle: f32| Vec3::new(angle.sin(), 0.0, -angle.cos());
        let (onward, reflected) = refracted(ray(0.6), Vec3::Z, 1.5);
        let onward = onward.expect("into glass");
        assert!((onward.x * 1.5 - 0.6f32.sin()).abs() < 1e-6 && onward.z < 0.0);
        // The way back passes as much.
        let (back, again) = refracted(-onward, Vec3::NEG_Z, 1.0 / 1.5);
        assert!(back.expect("out of glass").abs_diff_eq(-ray(0.6), 1e-5));
        assert!((reflected - again).abs() < 1e-5);
        let straight = refracted(Vec3::NEG_Z, Vec3::Z, 1.5).1;
        assert!((straight - 0.04).abs() < 1e-6);
        assert!((reflected_by_pane(1.0, 1.5) - 0.08 / 1.04).abs() < 1e-6);
        // At Brewster's angle half of it is not reflected at all.
        let (_, brewster) = refracted(ray(1.5f32.atan()), Vec3::Z, 1.5);
        let across = (1.0 - 1.5f32 * 1.5) / (1.0 + 1.5 * 1.5);
        assert!((brewster - 0.5 * across * across).abs() < 1e-5);
        assert_eq!(refracted(ray(0.8), Vec3::Z, 1.0 / 1.5), (None, 1.0));
        // Glass of index 1 is not there; the mean for 1.5 is known: 0.0918.
        assert_eq!(mean_fresnel(1.0, false), 0.0);
        assert!((mean_fresnel(1.5, false) - 0.0918).abs() < 1e-3);
        let glass = Specular::Glass {
            index: 1.5,
            is_thin: true,
        };
        assert!((glass.mean_reflectance().x + glass.mean_transmittance() - 1.0).abs() < 1e-6);
    }
}
