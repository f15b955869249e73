//! One path: an unbiased estimate of the irradiance at a surface point.
//!
//! `E(x) = D(x) + ρ(y) E(y)` with y met by a cosine-weighted ray from x. The light D that comes straight from
//! emitters is sampled twice, by points of emitters and by that same ray, and both are weighted by the balance
//! heuristic (Veach & Guibas 1995), so that neither a near nor a small emitter leaves spikes. Light from outside likewise:
//! see [`Outside`]. From a mirror, gloss or glass the path goes on in one direction until it comes to a diffuse reflection.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use super::{
    outside::{Outside, OutsideSquares, Place},
    scatter::{Scatter, Turn, turned},
};
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

/// The rays of paths where they differ from those of others, which pass straight on through glass: paths bend in it.
pub(super) fn bending_rays(scene: &Scene) -> Option<RayTree> {
    scene.with_solid_glass().map(|solid| RayTree::new(&solid))
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

/// The ray by which a path arrives.
#[derive(Clone, Copy)]
struct Flight {
    from: Place,
    direction: Vec3,
    /// Density with which its direction was chosen, 1/sr; `None` where no other was possible, so that no point of an emitter
    /// could have stood for it.
    density: Option<f32>,
}

/// A hit on a surface.
struct Arrival {
    point: Place,
    /// Of its diffuse part.
    reflectance: Vec3,
    /// Emitted radiance, weighted by the balance heuristic.
    emission: Vec3,
}

/// Whether a path goes on after so many bounces: by Russian roulette, which the throughput makes up for.
fn goes_on(throughput: &mut Vec3, bounces: u32, random: &mut Random) -> bool {
    if bounces < SURE_BOUNCES {
        return *throughput != Vec3::ZERO;
    }
    let survival = throughput.max_element().min(1.0);
    let goes_on = random.uniform() < survival;
    if goes_on {
        *throughput /= survival;
    }
    goes_on
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
            ray_count += self.ray_count();
            let diffuse = Scatter::Diffuse(at.normal);
            sum += throughput * self.emitter_share(at, diffuse, bounce);
            sum += throughput * self.outside.share(self.rays, at, diffuse, bounce.outside);
            let direction = cosine_direction(at.normal, bounce.direction);
            let flight = Flight {
                from: at,
                direction,
                density: Some(diffuse.toward(direction).density),
            };
            let (light, rays, next) = self.fly(flight, random);
            ray_count += rays;
            sum += throughput * light * PI;
            let Some((point, reflectance)) = next else {
                break;
            };
            throughput *= reflectance;
            if !goes_on(&mut throughput, depth + 1, random) {
                break;
            }
            at = point;
            bounce = Bounce::random(random, self.outside);
        }
        (sum, ray_count)
    }

    /// Rays of one reflection.
    fn ray_count(&self) -> u32 {
        1 + u32::from(!self.emitters.is_empty()) + self.outside.ray_count()
    }

    /// Follow a ray over mirrors, gloss and glass to a diffuse reflection: the radiance that arrives beside what is reflected
    /// there, the further rays that it took, and the place with the part of its irradiance that arrives as radiance times π.
    fn fly(&self, mut flight: Flight, random: &mut Random) -> (Vec3, u32, Option<(Place, Vec3)>) {
        let (mut sum, mut throughput, mut ray_count) = (Vec3::ZERO, Vec3::ONE, 0);
        for turns in 0..MAX_BOUNCES {
            let Flight {
                from, direction, ..
            } = flight;
            let start = Some(from.triangle);
            let hit = self.rays.closest(from.position, direction, start);
            throughput *= self.rays.tint(from.position, direction, start, hit);
            let Some(hit) = hit else {
                sum += throughput * self.outside.by_ray(direction, flight.density);
                break;
            };
            let turn = turned(self.scene, hit.triangle, direction, random);
            let Some(arrival) = self.arrive(flight, hit, turn.is_some()) else {
                break;
            };
            sum += throughput * arrival.emission;
            let Some(turn) = turn else {
                return (
                    sum,
                    ray_count,
                    Some((arrival.point, throughput * arrival.reflectance)),
                );
            };
            let at = arrival.point;
            let (onward, weight, density) = match turn {
                Turn::Diffuse { chance } => {
                    let reflected = throughput * arrival.reflectance / chance;
                    return (sum, ray_count, Some((at, reflected)));
                }
                Turn::Onward { direction, weight } => (direction, weight, None),
                Turn::Gloss { scatter, weight } => {
                    ray_count += self.ray_count() - 1;
                    let bounce = Bounce::random(random, self.outside);
                    let direct = self.emitter_share(at, scatter, bounce)
                        + self.outside.share(self.rays, at, scatter, bounce.outside);
                    sum += throughput * weight * direct;
                    let Some((onward, part)) = scatter.sample(bounce.direction) else {
                        break;
                    };
                    (onward, weight * part, Some(scatter.toward(onward).density))
                }
            };
            ray_count += 1;
            throughput *= weight;
            if !goes_on(&mut throughput, turns, random) {
                break;
            }
            flight = Flight {
                from: at,
                direction: onward,
                density,
            };
        }
        (sum, ray_count, None)
    }

    /// The weighted share of direct light by a point of an emitter.
    fn emitter_share(&self, at: Place, scatter: Scatter, bounce: Bounce) -> Vec3 {
        let sample = self
            .emitters
            .sample(self.scene, bounce.choice, bounce.emitter);
        let Some(sample) = sample else {
            return Vec3::ZERO;
        };
        let separation = sample.position - at.position;
        let direction = separation.normalize_or_zero();
        let toward = scatter.toward(direction);
        let source_cosine = self.lit_cosine(sample.triangle, direction);
        if toward.value <= 0.0 || source_cosine <= 0.0 || sample.triangle == at.triangle {
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
        let weight = toward.value * source_cosine / (density + source_cosine * toward.density);
        self.scene.emission_at(sample.triangle, sample.barycentric) * weight * passing
    }

    /// The surface at a hit, if that side reflects or emits, or the path turns there.
    fn arrive(&self, flight: Flight, hit: Hit, turns: bool) -> Option<Arrival> {
        let direction = flight.direction;
        let source_cosine = self.lit_cosine(hit.triangle, direction);
        if source_cosine <= 0.0 && !turns {
            return None;
        }
        let corners = self.scene.corners(hit.triangle);
        // The point is put back on the triangle: along the ray it is off by the rounding of the distance.
        let place = barycentric(flight.from.position + direction * hit.distance, corners);
        let position = corners[0] * place.x + corners[1] * place.y + corners[2] * place.z;
        let front = self.normal(hit.triangle);
        let mut emission = self.scene.emission_at(hit.triangle, place);
        if emission != Vec3::ZERO {
            emission *= match flight.density.map(|density| density * source_cosine) {
                None if source_cosine > 0.0 => 1.0,
                Some(by_ray) if by_ray > 0.0 => {
                    let by_point =
                        self.emitters.density(hit.triangle) * hit.distance * hit.distance;
                    by_ray / (by_ray + by_point)
                }
                _ => 0.0,
            };
        }
        // Of glass, rays always meet something.
        let material = self.scene.material(hit.triangle);
        let met = if material.is_glass() {
            material.met_share()
        } else {
            1.0
        };
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
            reflectance: self.scene.reflectance_at(hit.triangle, place) * met,
            emission: emission * met,
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
