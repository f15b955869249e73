//! One path: an unbiased estimate of the irradiance at a surface point.
//!
//! `E(x) = D(x) + ρ(y) E(y)` with y met by a cosine-weighted ray from x. The light D that comes straight from
//! emitters is sampled twice, by points of emitters and by that same ray, and both are weighted by the balance
//! heuristic (Veach & Guibas 1995), so that neither a near nor a small emitter leaves spikes. Light from outside likewise:
//! see [`Outside`].

use std::f32::consts::{FRAC_1_PI, PI};

use glam::{Vec2, Vec3};

use super::outside::{Outside, OutsideSquares, Place};
use crate::{
    geometry::{Hit, Random, RayTree, barycentric, cosine_direction},
    sampling::Emitters,
    scene::{Scene, TriangleId},
};

/// Bounces before Russian roulette begins. Earlier, noise grows; later, dark scenes waste rays.
const SURE_BOUNCES: u32 = 3;

/// Bounces after which a path is cut. At the reflectance clamp of 0.98 it omits a share of 1e-36; it only ends
/// the paths of a closed scene whose clamp was raised to 1.
const MAX_BOUNCES: u32 = 4096;

/// The random numbers of one bounce.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounce {
    /// For the direction of the ray.
    pub(super) direction: Vec2,
    /// For the choice of the emitter, in 0…1.
    pub(super) choice: f64,
    /// For the point of the emitter.
    pub(super) emitter: Vec2,
    /// For sky and sun.
    pub(super) outside: OutsideSquares,
}

impl Bounce {
    /// Independent random numbers.
    fn random(random: &mut Random, outside: &Outside) -> Self {
        Self {
            direction: random.uniform_2d(),
            choice: f64::from(random.next_u32()) / 4_294_967_296.0,
            emitter: random.uniform_2d(),
            outside: outside.squares(|| random.uniform_2d()),
        }
    }
}

/// The inputs of an estimate.
pub(super) struct Estimator<'a> {
    /// The scene.
    pub(super) scene: &'a Scene,
    /// Its rays.
    pub(super) rays: &'a RayTree,
    /// Its emitters.
    pub(super) emitters: &'a Emitters,
    /// Its sky and sun.
    pub(super) outside: &'a Outside,
}

/// A hit on a side that reflects.
struct Arrival {
    point: Place,
    reflectance: Vec3,
    /// Emitted radiance, weighted by the balance heuristic.
    emission: Vec3,
}

impl Estimator<'_> {
    /// Whether there is no light.
    pub(super) fn is_dark(&self) -> bool {
        self.emitters.is_empty() && self.outside.is_dark()
    }

    /// Irradiance at `start` by one path, and the rays that it took. `first` steers the first bounce.
    pub(super) fn irradiance(
        &self,
        start: Place,
        first: Bounce,
        random: &mut Random,
    ) -> (Vec3, u32) {
        let (mut sum, mut throughput, mut ray_count) = (Vec3::ZERO, Vec3::ONE, 0);
        let (mut at, mut bounce) = (start, first);
        for depth in 0..MAX_BOUNCES {
            ray_count += 1 + u32::from(!self.emitters.is_empty()) + self.outside.ray_count();
            sum += throughput * self.emitter_share(at, bounce);
            sum += throughput * self.outside.share(self.rays, at, bounce.outside);
            let direction = cosine_direction(at.normal, bounce.direction);
            let start = Some(at.triangle);
            let hit = self.rays.closest(at.position, direction, start);
            throughput *= self.rays.tint(at.position, direction, start, hit);
            let Some(hit) = hit else {
                sum += throughput * self.outside.by_ray(at.normal, direction);
                break;
            };
            let Some(arrival) = self.arrive(at, direction, hit) else {
                break;
            };
            sum += throughput * arrival.emission * PI;
            throughput *= arrival.reflectance;
            if depth + 1 >= SURE_BOUNCES {
                let survival = throughput.max_element().min(1.0);
                if random.uniform() >= survival {
                    break;
                }
                throughput /= survival;
            } else if throughput == Vec3::ZERO {
                break;
            }
            at = arrival.point;
            bounce = Bounce::random(random, self.outside);
        }
        (sum, ray_count)
    }

    /// The weighted share of direct light by a point of an emitter.
    fn emitter_share(&self, at: Place, bounce: Bounce) -> Vec3 {
        let sample = self
            .emitters
            .sample(self.scene, bounce.choice, bounce.emitter);
        let Some(sample) = sample else {
            return Vec3::ZERO;
        };
        let separation = sample.position - at.position;
        let direction = separation.normalize_or_zero();
        let cosine = at.normal.dot(direction);
        let source_cosine = self.lit_cosine(sample.triangle, direction);
        if cosine <= 0.0 || source_cosine <= 0.0 || sample.triangle == at.triangle {
            return Vec3::ZERO;
        }
        let density = self.emitters.density(sample.triangle) * separation.length_squared();
        let ends = [Some(at.triangle), Some(sample.triangle)];
        let mut passing = self.rays.transmittance(at.position, sample.position, ends);
        passing *= self.scene.opacity_at(sample.triangle, sample.barycentric);
        if passing == Vec3::ZERO {
            return Vec3::ZERO;
        }
        // Both densities times the cosine at the source, so that nothing is divided by a vanishing cosine.
        let weight = cosine * source_cosine / (density + source_cosine * cosine * FRAC_1_PI);
        self.scene.emission_at(sample.triangle, sample.barycentric) * weight * passing
    }

    /// The surface at a hit, if that side reflects or emits.
    fn arrive(&self, from: Place, direction: Vec3, hit: Hit) -> Option<Arrival> {
        let source_cosine = self.lit_cosine(hit.triangle, direction);
        if source_cosine <= 0.0 {
            return None;
        }
        let corners = self.scene.corners(hit.triangle);
        // The point is put back on the triangle: along the ray it is off by the rounding of the distance.
        let place = barycentric(from.position + direction * hit.distance, corners);
        let position = corners[0] * place.x + corners[1] * place.y + corners[2] * place.z;
        let front = self.normal(hit.triangle);
        let mut emission = self.scene.emission_at(hit.triangle, place);
        if emission != Vec3::ZERO {
            let by_ray = from.normal.dot(direction).max(0.0) * FRAC_1_PI * source_cosine;
            let by_point = self.emitters.density(hit.triangle) * hit.distance * hit.distance;
            emission *= if by_ray > 0.0 {
                by_ray / (by_ray + by_point)
            } else {
                0.0
            };
        }
        Some(Arrival {
            point: Place {
                position,
                normal: if front.dot(direction) < 0.0 {
                    front
                } else {
                    -front
                },
                triangle: hit.triangle,
            },
            reflectance: self.scene.reflectance_at(hit.triangle, place),
            emission,
        })
    }

    /// Cosine between a ray's reverse and the normal of the side that it meets; at most 0 on a black back.
    fn lit_cosine(&self, triangle: TriangleId, direction: Vec3) -> f32 {
        let cosine = -self.normal(triangle).dot(direction);
        if self.scene.triangles[triangle.index()].two_sided {
            cosine.abs()
        } else {
            cosine
        }
    }

    /// Unit normal of the front.
    fn normal(&self, triangle: TriangleId) -> Vec3 {
        self.scene.surfaces[triangle.index()]
            .area_vector
            .normalize_or_zero()
    }
}
