//! Stochastic Jacobi radiosity: power is shot over the whole scene by rays, from elements chosen by what they have yet
//! to send (Neumann 1995; Bekaert, "Hierarchical and Stochastic Algorithms for Radiosity", 1999, §6.3).
//!
//! Light from outside is gathered by rays from every element.
//! A pass is a complete solution: rays of equal power carry the emitted light, then what each bounce reflected, until
//! chance leaves nothing to send. Every pass is unbiased, so passes are averaged, each by its number of rays. An
//! element's rays follow one four-dimensional low-discrepancy sequence over all passes.
//! Radiosity is constant over elements while it is shot; the irradiance that is shown is averaged to their vertices.

use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::{
    ReferencePoint,
    jacobi_mesh::ElementMesh,
    outside::{Outside, Place},
};
use crate::{
    geometry::{Random, RayTree, barycentric, cosine_direction, triangle_point},
    scene::Scene,
};

/// Rays traced before their hits are added up. Fewer leave threads idle; more only take memory.
const BATCH: usize = 1 << 16;

/// Bounces after which what is left is dropped: at the reflectance clamp of 0.98 a share of 2e-9.
const MOST_BOUNCES: u32 = 1000;

/// How a solution by stochastic Jacobi radiosity is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JacobiSettings {
    /// Elements aimed at. Triangles larger than this share of the scene's area are cut into equal elements; smaller
    /// ones stay as they are. Fewer blur shadows, more need more rays for the same noise.
    pub element_count: u32,
    /// Same seed, same bits.
    pub seed: u64,
}

impl Default for JacobiSettings {
    fn default() -> Self {
        Self {
            element_count: 20_000,
            seed: 0,
        }
    }
}

/// A solution in progress.
pub struct StochasticJacobi {
    scene: Arc<Scene>,
    rays: Arc<RayTree>,
    mesh: ElementMesh,
    outside: Outside,
    /// Samples of the light from outside at each element so far.
    gathered: u32,
    /// Rays that each element has sent so far.
    sent: Vec<u32>,
    /// Power that arrived at each element, summed over passes, each times its weight; W in frame units.
    arrived: Vec<DVec3>,
    /// Sum of the weights.
    weight: f64,
    ray_count: u64,
    passes: u64,
    seed: u64,
}

/// A ray to be: the element that sends it, its number there, and the power that it carries.
#[derive(Clone, Copy)]
struct Shot {
    element: u32,
    number: u32,
    power: Vec3,
}

impl StochasticJacobi {
    /// Cut the scene into elements. `rays` is its ray tree.
    pub fn new(scene: Arc<Scene>, rays: Arc<RayTree>, settings: JacobiSettings) -> Self {
        let sides = |two_sided: bool| if two_sided { 2.0 } else { 1.0 };
        let area: f64 = scene
            .surfaces
            .iter()
            .zip(&scene.triangles)
            .map(|(surface, triangle)| {
                f64::from(surface.area_vector.length()) * sides(triangle.two_sided)
            })
            .sum();
        let max_area = area / f64::from(settings.element_count.max(1));
        let mesh = ElementMesh::new(&scene, (max_area as f32).max(f32::MIN_POSITIVE));
        Self {
            sent: vec![0; mesh.len()],
            arrived: vec![DVec3::ZERO; mesh.len()],
            weight: 0.0,
            ray_count: 0,
            passes: 0,
            seed: settings.seed,
            outside: Outside::new(&scene),
            gathered: 0,
            scene,
            rays,
            mesh,
        }
    }

    /// One more solution, with `emitted_rays` rays for the light of the emitters and as many for the same power later.
    /// Light from outside is gathered by about as many samples, spread evenly over the elements, and its reflection is sent
    /// with the light of the emitters.
    /// `false` when `cancel` came true on the way; the pass then leaves no trace.
    pub fn pass(&mut self, emitted_rays: u32, cancel: &(dyn Fn() -> bool + Sync)) -> bool {
        let emitted_rays = emitted_rays.max(1);
        let mut unsent = self.emitted_power();
        let samples = emitted_rays.div_ceil(self.mesh.len().max(1) as u32);
        let Some(mut arrived) = self.gather_outside(samples, cancel) else {
            return false;
        };
        for (element, (unsent, power)) in unsent.iter_mut().zip(&arrived).enumerate() {
            *unsent += *power * self.reflectance(element);
        }
        let quantum =
            unsent.iter().map(|power| importance(*power)).sum::<f64>() / f64::from(emitted_rays);
        let mut random = Random::new(self.seed, self.passes ^ (1 << 63));
        let mut sent = self.sent.clone();
        let mut ray_count = self.outside_rays(samples);
        for _ in 0..MOST_BOUNCES {
            let shots = choose(&unsent, quantum, random.uniform(), &mut sent);
            if shots.is_empty() {
                break;
            }
            ray_count += shots.len() as u64;
            let Some(bounce) = self.shoot(&shots, cancel) else {
                return false;
            };
            for (element, (power, sum)) in bounce.iter().zip(&mut arrived).enumerate() {
                *sum += *power;
                unsent[element] = *power * self.reflectance(element);
            }
        }
        self.passes += 1;
        self.gathered = self.gathered.wrapping_add(samples);
        self.sent = sent;
        self.ray_count += ray_count;
        self.weight += f64::from(emitted_rays);
        for (sum, power) in self.arrived.iter_mut().zip(arrived) {
            *sum += power * f64::from(emitted_rays);
        }
        true
    }

    /// Irradiance of each point so far, W/m², interpolated between the vertices of its element; black before the first
    /// pass, `None` where a point lies on no lit side.
    pub fn irradiance(&self, points: &[ReferencePoint]) -> Vec<Option<Vec3>> {
        let vertices = self.vertex_irradiance();
        let at = |point: &ReferencePoint| {
            let (element, within) =
                self.mesh
                    .find(point.triangle, point.is_back, point.barycentric)?;
            let [a, b, c] = self
                .mesh
                .vertices(element)
                .map(|vertex| vertices[vertex as usize]);
            Some(a * within.x + b * within.y + c * within.z)
        };
        points.iter().map(at).collect()
    }

    /// Irradiance of each element so far, W/m²: fronts in the order of the triangles, each followed by its back where
    /// that is lit.
    pub fn element_irradiance(&self) -> Vec<Vec3> {
        let scale = self.scale();
        let irradiance = |(element, power): (usize, &DVec3)| {
            (*power * (scale / self.met_area(element).max(f64::MIN_POSITIVE))).as_vec3()
        };
        self.arrived.iter().enumerate().map(irradiance).collect()
    }

    /// Mean irradiance of the elements at each vertex, weighted by area.
    fn vertex_irradiance(&self) -> Vec<Vec3> {
        let mut sums = vec![(DVec3::ZERO, 0.0); self.mesh.vertex_count()];
        for (element, power) in self.arrived.iter().enumerate() {
            let area = self.met_area(element);
            for vertex in self.mesh.vertices(element) {
                let sum = &mut sums[vertex as usize];
                *sum = (sum.0 + *power, sum.1 + area);
            }
        }
        let scale = self.scale();
        sums.iter()
            .map(|(power, area)| (*power * (scale / area.max(f64::MIN_POSITIVE))).as_vec3())
            .collect()
    }

    /// The factors from weighted sums to means.
    fn scale(&self) -> f64 {
        if self.weight > 0.0 {
            1.0 / self.weight
        } else {
            0.0
        }
    }

    fn element_area(&self, element: usize) -> f64 {
        f64::from(self.mesh.area(&self.scene, element))
    }

    /// The part of the area of an element that rays meet.
    fn met_area(&self, element: usize) -> f64 {
        self.element_area(element) * self.opacity(element)
    }

    fn opacity(&self, element: usize) -> f64 {
        let (triangle, _) = self.mesh.side_of_element(element);
        f64::from(self.scene.surfaces[triangle.index()].opacity)
    }

    /// Number of elements.
    pub fn element_count(&self) -> usize {
        self.mesh.len()
    }

    /// Rays shot so far.
    pub fn ray_count(&self) -> u64 {
        self.ray_count
    }

    /// Bytes in use, with the ray tree.
    pub fn memory_bytes(&self) -> usize {
        self.rays.memory_bytes()
            + self.mesh.memory_bytes()
            + size_of_val(self.sent.as_slice())
            + size_of_val(self.arrived.as_slice())
    }

    /// Power that each element emits.
    fn emitted_power(&self) -> Vec<DVec3> {
        (0..self.mesh.len())
            .map(|element| {
                let (triangle, _) = self.mesh.side_of_element(element);
                let emission = self.scene.surfaces[triangle.index()].emission.as_dvec3();
                emission * (std::f64::consts::PI * self.element_area(element))
            })
            .collect()
    }

    /// Power that arrives at each element straight from outside, by so many samples each; nothing when cancelled.
    fn gather_outside(
        &self,
        samples: u32,
        cancel: &(dyn Fn() -> bool + Sync),
    ) -> Option<Vec<DVec3>> {
        if self.outside.is_dark() {
            return Some(vec![DVec3::ZERO; self.mesh.len()]);
        }
        let at_element = |element: usize| {
            if cancel() {
                return None;
            }
            let mut sum = DVec3::ZERO;
            for number in self.gathered..self.gathered.wrapping_add(samples) {
                let shot = Shot {
                    element: element as u32,
                    number,
                    power: Vec3::ZERO,
                };
                let (on, toward) = quasi_random(!self.seed, shot);
                let mut random = Random::new(!self.seed, u64::from(shot.element) | 1 << 62);
                let shift = self.outside.squares(|| random.uniform_2d());
                let at = Place {
                    position: self.mesh.point(&self.scene, element, triangle_point(on)),
                    normal: self.mesh.normal(element),
                    triangle: self.mesh.side_of_element(element).0,
                };
                let squares = shift.moved(number);
                let found = self.outside.irradiance(&self.rays, at, toward, squares);
                sum += found.as_dvec3();
            }
            Some(sum * (self.met_area(element) / f64::from(samples)))
        };
        (0..self.mesh.len())
            .into_par_iter()
            .map(at_element)
            .collect()
    }

    /// Rays that [`Self::gather_outside`] shoots.
    fn outside_rays(&self, samples: u32) -> u64 {
        if self.outside.is_dark() {
            return 0;
        }
        let per_sample = u64::from(1 + self.outside.ray_count());
        self.mesh.len() as u64 * u64::from(samples) * per_sample
    }

    /// Reflectance of what rays meet of an element.
    fn reflectance(&self, element: usize) -> DVec3 {
        let (triangle, _) = self.mesh.side_of_element(element);
        let mean = self.scene.surfaces[triangle.index()].reflectance.as_dvec3();
        mean / self.opacity(element).max(f64::MIN_POSITIVE)
    }

    /// Trace rays and add up what arrives at each element; in the order of the rays, so that threads do not matter.
    fn shoot(&self, shots: &[Shot], cancel: &(dyn Fn() -> bool + Sync)) -> Option<Vec<DVec3>> {
        let mut arrived = vec![DVec3::ZERO; self.mesh.len()];
        for batch in shots.chunks(BATCH) {
            if cancel() {
                return None;
            }
            let hits: Vec<Option<(usize, Vec3)>> =
                batch.par_iter().map(|shot| self.trace(*shot)).collect();
            for (shot, hit) in batch.iter().zip(hits) {
                if let Some((element, tint)) = hit {
                    arrived[element] += (shot.power * tint).as_dvec3();
                }
            }
        }
        Some(arrived)
    }

    /// The element that a ray reaches, if any, and its tint.
    fn trace(&self, shot: Shot) -> Option<(usize, Vec3)> {
        let element = shot.element as usize;
        let (on, toward) = quasi_random(self.seed, shot);
        let origin = self.mesh.point(&self.scene, element, triangle_point(on));
        let direction = cosine_direction(self.mesh.normal(element), toward);
        let (from, _) = self.mesh.side_of_element(element);
        let hit = self.rays.closest(origin, direction, Some(from))?;
        let front = self.scene.surfaces[hit.triangle.index()].area_vector;
        let is_back = front.dot(direction) > 0.0;
        if is_back && !self.scene.triangles[hit.triangle.index()].two_sided {
            return None;
        }
        let place = barycentric(
            origin + direction * hit.distance,
            self.scene.corners(hit.triangle),
        );
        let (found, _) = self.mesh.find(hit.triangle, is_back, place)?;
        let tint = self.rays.tint(origin, direction, Some(from), Some(hit));
        Some((found, tint))
    }
}

/// The weight by which a ray is chosen: the power of all channels.
fn importance(power: DVec3) -> f64 {
    power.element_sum()
}

/// Rays in proportion to the unsent power, each standing for `quantum` of it: systematic sampling, so that an element
/// sends the whole number below or above its share. An element's colour is kept.
fn choose(unsent: &[DVec3], quantum: f64, offset: f32, sent: &mut [u32]) -> Vec<Shot> {
    let mut shots = Vec::new();
    if quantum <= 0.0 {
        return shots;
    }
    let (mut passed, mut next) = (0.0, f64::from(offset) * quantum);
    for (element, power) in unsent.iter().enumerate() {
        let weight = importance(*power);
        passed += weight;
        while next < passed {
            shots.push(Shot {
                element: element as u32,
                number: sent[element],
                power: (*power * (quantum / weight)).as_vec3(),
            });
            sent[element] = sent[element].wrapping_add(1);
            next += quantum;
        }
    }
    shots
}

/// Where a ray starts and where it goes, both in the unit square: a point of an additive sequence in four dimensions,
/// whose steps are the powers of the root of x⁵ = x + 1 (Roberts 2018), shifted for each element.
fn quasi_random(seed: u64, shot: Shot) -> (Vec2, Vec2) {
    const ROOT: f64 = 1.167_303_978_261_418_7;
    let mut random = Random::new(seed, u64::from(shot.element));
    let mut step = 1.0;
    let mut next = || {
        step /= ROOT;
        let place = f64::from(shot.number) * step + f64::from(random.uniform());
        (place.fract() as f32).min(1.0 - f32::EPSILON)
    };
    let on = Vec2::new(next(), next());
    (on, Vec2::new(next(), next()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shots_carry_all_power_of_an_element_and_its_colour() {
        let unsent = [
            DVec3::new(1.0, 2.0, 3.0),
            DVec3::ZERO,
            DVec3::new(0.0, 0.0, 6.0),
        ];
        let mut sent = [5, 0, 0];
        let shots = choose(&unsent, 0.5, 0.25, &mut sent);
        assert_eq!((shots.len(), sent), (24, [17, 0, 12]));
        let sum: Vec3 = shots.iter().map(|shot| shot.power).sum();
        assert!((sum - Vec3::new(1.0, 2.0, 9.0)).length() < 1e-5, "{sum}");
        assert_eq!((shots[0].number, shots[11].number), (5, 16));
        assert!(choose(&unsent, 0.0, 0.5, &mut sent).is_empty());
    }

    #[test]
    fn weak_elements_send_now_and_then_and_right_on_average() {
        let unsent = [DVec3::splat(0.01); 3];
        let mut count = 0;
        for place in 0..1000_u16 {
            let shots = choose(&unsent, 1.0, f32::from(place) / 1000.0, &mut [0; 3]);
            count += shots.len();
        }
        // 0.09 of a ray each time.
        assert_eq!(count, 90);
    }

    #[test]
    fn ray_samples_fill_square_and_hemisphere_evenly() {
        let (mut bins, count) = ([0_u32; 256], 25_600);
        for number in 0..count {
            let shot = Shot {
                element: 3,
                number,
                power: Vec3::ONE,
            };
            let (on, toward) = quasi_random(1, shot);
            let place = [on.x, on.y, toward.x, toward.y].map(|x| (x * 4.0) as usize);
            bins[((place[0] * 4 + place[1]) * 4 + place[2]) * 4 + place[3]] += 1;
        }
        // 100 in each of 4⁴ cells; random points would scatter by 10.
        assert!(bins.iter().all(|n| n.abs_diff(100) < 20), "{bins:?}");
    }
}
