//! Light by direction at the vertices of a mesh, by rays over the light of a solve.
//!
//! From a place beside each vertex rays go over the hemisphere and to points of lamps, and take the light that is stored where
//! they end; what mirrors, panes, cut-outs and the sky send comes with them. Of its own hemisphere a vertex sees no more.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::{
    lamps::{Arriving, Source, Start},
    surface::LitScene,
};
use crate::{
    geometry::{
        Harmonics, RAY_OFFSET, Random, RayTree, area_vector, centroid, hemisphere_direction,
        low_discrepancy_1d, sobol_2d,
    },
    scene::{LobeValue, Scene, Sky, SkySample, TriangleId, luminance},
    solver::{Cancel, DisplayMesh, Snapshot},
};

/// Rays of a vertex over its hemisphere, a power of 2. Fewer are noisy; more take time.
const RAYS: u32 = 256;

/// Points of lamps that are looked at from a vertex, and of the sky where it varies, a power of 2. Fewer are noisy in
/// penumbrae; more take time.
const POINTS: u32 = 64;

/// Density with which rays choose a direction, 1/sr, for each point of a lamp.
const DENSITY: f32 = (RAYS / POINTS) as f32 / TAU;

/// Least number of parts of a sky that varies. Fewer blur it; more take memory.
const SKY_PARTS: usize = 1 << 16;

/// Share of the way to the centroid of a triangle at which rays of its corner start, and the largest one where that is not
/// [`CLEARANCE`] from the edges: exactly on an edge, they start in the plane of the wall that stands on it.
const INSET: [f32; 2] = [0.02, 0.2];

/// See [`INSET`], frame units.
const CLEARANCE: f32 = 2.0 * RAY_OFFSET;

/// Light by direction at the vertices of a snapshot, such that it gives the irradiance that is stored there; `None` when
/// cancelled.
pub fn harmonics_at_vertices(
    scene: &Scene,
    rays: &RayTree,
    snapshot: &Snapshot,
    seed: u64,
    cancel: &Cancel,
) -> Option<Vec<Harmonics>> {
    let lit = LitScene::new(scene, rays, snapshot);
    let incoming = Incoming::new(&lit, seed);
    let places = vertex_places(lit.mesh, |_| true);
    cancel.proceed()?;
    let stored = |vertex: usize| {
        let stored = snapshot.light.irradiance.get(vertex).copied();
        stored.unwrap_or_default()
    };
    let harmonics = |(vertex, place): (usize, &Option<_>)| {
        if cancel.is_cancelled() {
            return Harmonics::default();
        }
        let normal = lit.mesh.normals[vertex].normalize_or(Vec3::Y);
        let (mut sum, mut irradiance) = (Harmonics::default(), Vec3::ZERO);
        if let Some(place) = place {
            incoming.gather(place, vertex, |arriving| {
                sum.add(arriving.direction, arriving.light);
                irradiance += arriving.light * normal.dot(arriving.direction).max(0.0);
            });
        }
        sum.scaled_to(stored(vertex), irradiance, normal)
    };
    let mut found: Vec<Harmonics> = places.par_iter().enumerate().map(harmonics).collect();
    cancel.proceed()?;
    lit.mesh.repeat_light(&mut found);
    Some(found)
}

/// Where rays of a vertex start.
#[derive(Clone, Copy, Debug)]
pub(super) struct VertexPlace {
    start: Start,
    /// Unit normal of the vertex, and of the triangle.
    normal: Vec3,
    flat_normal: Vec3,
}

/// The places of the vertices of wanted display triangles: beside the vertex, in the triangle whose normal is nearest to its
/// own. Vertices that repeat others have none.
pub(super) fn vertex_places(
    mesh: &DisplayMesh,
    is_wanted: impl Fn(usize) -> bool,
) -> Vec<Option<VertexPlace>> {
    let mut places: Vec<Option<VertexPlace>> = vec![None; mesh.positions.len()];
    for triangle in (0..mesh.indices.len()).filter(|&triangle| is_wanted(triangle)) {
        let vertices = mesh.indices[triangle];
        let corners = vertices.map(|vertex| mesh.positions[vertex as usize]);
        let Some(flat_normal) = area_vector(corners).try_normalize() else {
            continue;
        };
        let (centre, inset) = (centroid(corners), inset(corners));
        for (vertex, corner) in vertices.into_iter().zip(corners) {
            let vertex = mesh.own_vertex(vertex);
            let normal = mesh.normals[vertex].normalize_or(flat_normal);
            let fitness = normal.dot(flat_normal);
            let is_best = |best: VertexPlace| fitness > best.normal.dot(best.flat_normal);
            if places[vertex].is_none_or(is_best) {
                places[vertex] = Some(VertexPlace {
                    start: Start {
                        point: corner.lerp(centre, inset),
                        triangle: TriangleId(mesh.triangle_of[triangle]),
                    },
                    normal,
                    flat_normal,
                });
            }
        }
    }
    places
}

/// Share of the way to the centroid at which rays of the corners of a triangle start.
fn inset(corners: [Vec3; 3]) -> f32 {
    let [a, b, c] = corners;
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    // From the centroid to an edge is a third of the height above that.
    let distance = 2.0 / 3.0 * area_vector(corners).length() / longest.max(f32::MIN_POSITIVE);
    let [least, most] = INSET;
    (CLEARANCE / distance.max(f32::MIN_POSITIVE)).clamp(least, most)
}

/// Gathers light by direction.
pub(super) struct Incoming<'a> {
    lit: &'a LitScene<'a>,
    /// Where the sky varies.
    sky: Option<SkyParts>,
    has_lamps: bool,
    seed: u64,
}

impl<'a> Incoming<'a> {
    pub(super) fn new(lit: &'a LitScene<'a>, seed: u64) -> Self {
        let environment = &lit.scene.environment;
        Self {
            lit,
            sky: SkyParts::of(&environment.sky),
            has_lamps: !lit.emitters.is_empty() || environment.sun.is_some(),
            seed,
        }
    }

    /// The light that arrives at a vertex: the sum over all that are added, each radiance times solid angle.
    pub(super) fn gather(&self, place: &VertexPlace, vertex: usize, mut add: impl FnMut(Arriving)) {
        let mut random = Random::new(self.seed, vertex as u64);
        let is_above = |direction: Vec3| {
            direction.dot(place.normal) > 0.0 && direction.dot(place.flat_normal) > 0.0
        };
        let scramble = [random.next_u32(), random.next_u32()];
        let directions = (0..RAYS)
            .map(|ray| hemisphere_direction(place.normal, sobol_2d(ray, scramble)))
            .filter(|&direction| is_above(direction));
        let met: Vec<(Vec3, [(Vec3, Source); 2])> = directions
            .filter_map(|direction| Some((direction, self.met(place.start, direction)?)))
            .collect();
        // Below the surface, or behind one-sided faces: as if they met what the others meet.
        let each = TAU / met.len().max(1) as f32;
        for (direction, parts) in met {
            for (radiance, source) in parts {
                add(Arriving {
                    direction,
                    light: radiance * each,
                    source,
                });
            }
        }
        let each = 1.0 / POINTS as f32;
        if self.has_lamps {
            let toward = |direction: Vec3| LobeValue {
                value: f32::from(u8::from(is_above(direction))),
                density: DENSITY,
            };
            for point in 0..POINTS {
                // The same sequences for all points.
                let mut random = random.clone();
                self.lit.arriving_from_lamps(
                    place.start,
                    toward,
                    || choice(point, &mut random),
                    |arriving| {
                        add(Arriving {
                            light: arriving.light * each,
                            ..arriving
                        });
                    },
                );
            }
        }
        if let Some(sky) = &self.sky {
            let scramble = random.next_u32();
            let own = Some(place.start.triangle);
            for point in 0..POINTS {
                let (direction, light) = sky.choose(low_discrepancy_1d(point, scramble));
                if is_above(direction) {
                    let rays = self.lit.rays;
                    let passing = rays.transmittance_outward(place.start.point, direction, own);
                    add(Arriving {
                        direction,
                        light: light * passing * each,
                        source: Source::Other,
                    });
                }
            }
        }
    }

    /// Radiance that a ray meets, that of emitters apart; `None` behind one-sided faces.
    fn met(&self, start: Start, direction: Vec3) -> Option<[(Vec3, Source); 2]> {
        let lit = self.lit;
        let end = lit
            .rays
            .followed(start.point, direction, Some(start.triangle));
        let Some(hit) = end.hit else {
            let radiance = lit.scene.environment.sky.radiance(end.direction);
            // What is seen straight of a sky that varies is chosen by its light as well.
            let share = match &self.sky {
                Some(sky) if end.reflections == 0 => sky.share_of_ray(radiance),
                _ => 1.0,
            };
            return Some([
                (end.tint * radiance * share, Source::Other),
                (Vec3::ZERO, Source::Other),
            ]);
        };
        let surface = lit.surface(end.origin, end.direction, hit)?;
        let (share, source) = match end.reflections {
            0 | 1 => {
                let length = end.length + hit.distance;
                let share = lit.share_of_ray(&surface, end.direction, DENSITY, length);
                let source = match end.reflections {
                    0 => Source::Emitter(surface.triangle),
                    _ => Source::Other,
                };
                (share, source)
            }
            _ => (1.0, Source::Other),
        };
        Some([
            (end.tint * lit.reflected(&surface), Source::Other),
            (end.tint * surface.emission * share, source),
        ])
    }
}

/// A number in 0…1 and a point of the unit square, of a sequence that the random numbers choose.
fn choice(index: u32, random: &mut Random) -> (f64, Vec2) {
    let number = f64::from(low_discrepancy_1d(index, random.next_u32()));
    let square = sobol_2d(index, [random.next_u32(), random.next_u32()]);
    (number, square)
}

/// The parts of a sky that varies, chosen by their light.
struct SkyParts {
    parts: Vec<SkySample>,
    /// Running sums of their light.
    until: Vec<f64>,
}

impl SkyParts {
    fn of(sky: &Sky) -> Option<Self> {
        let Sky::Picture(picture) = sky else {
            return None;
        };
        let parts = picture.samples(SKY_PARTS);
        let mut sum = 0.0;
        let until = parts.iter().map(|part| {
            sum += f64::from(luminance(part.radiance) * part.solid_angle);
            sum
        });
        let until: Vec<f64> = until.collect();
        (sum > 0.0).then_some(Self { parts, until })
    }

    /// A direction, and its radiance over the density with which it is chosen, or met by rays.
    fn choose(&self, number: f32) -> (Vec3, Vec3) {
        let wanted = f64::from(number) * self.all();
        let index = self.until.partition_point(|&until| until <= wanted);
        let part = &self.parts[index.min(self.parts.len() - 1)];
        let density = self.density(part.radiance) + DENSITY;
        (part.direction, part.radiance / density)
    }

    /// The part that counts of what a ray meets of this radiance; the rest counts where it is chosen.
    fn share_of_ray(&self, radiance: Vec3) -> f32 {
        DENSITY / (self.density(radiance) + DENSITY)
    }

    /// Density with which directions of this radiance are chosen, 1/sr.
    fn density(&self, radiance: Vec3) -> f32 {
        (f64::from(luminance(radiance)) / self.all()) as f32
    }

    fn all(&self) -> f64 {
        self.until[self.until.len() - 1]
    }
}
