//! What there is to see in a scene: places on its surfaces, with the light that reaches them.

use glam::Vec3;
use rayon::prelude::*;

use crate::{
    geometry::{Random, RayTree, cosine_direction, low_discrepancy_2d, triangle_point},
    scene::{Frame, Scene, SizeClasses, TriangleId, luminance},
};

/// A place on a side of a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    /// Where, in frame units.
    pub(super) point: Vec3,
    /// Unit normal of the side.
    pub(super) normal: Vec3,
    /// On what.
    pub(super) triangle: TriangleId,
    /// How much it counts: all, where light reaches it on every path.
    pub(super) weight: f32,
    /// Whether light reaches it at all.
    pub(super) is_lit: bool,
}

/// Places chosen by area, and as many by its root: large walls and fine details both count.
const CHOSEN: usize = 192;
/// Paths that look for light from a spot.
const PATHS: u32 = 6;
/// Surfaces on such a path. A room behind a room is lit through its door.
const PATH_LENGTH: usize = 3;
/// How much a spot counts that no light was found at. Less, and the dark side of things never shows; more, and dark
/// outsides of lit rooms do.
const UNLIT: f32 = 0.25;

/// Spots all over a scene.
pub(super) struct Spots {
    pub(super) all: Vec<Spot>,
}

impl Spots {
    /// Choose the spots of a scene and look for their light.
    pub(super) fn new(scene: &Scene, rays: &RayTree) -> Self {
        let lights = Lights::of(scene);
        let mut all: Vec<Spot> = chosen(scene)
            .into_iter()
            .flat_map(|(index, triangle)| sides(scene, triangle, index))
            .collect();
        all.par_iter_mut().enumerate().for_each(|(index, spot)| {
            let paths = (0..PATHS).filter(|&path| {
                let mut random = Random::new(u64::from(path), index as u64);
                lights.reach(scene, rays, spot, &mut random)
            });
            let lit = paths.count() as f32 / PATHS as f32;
            spot.is_lit = lit > 0.0;
            spot.weight = UNLIT + (1.0 - UNLIT) * (3.0 * lit).min(1.0);
        });
        Self { all }
    }
}

/// How far a face lies from the middle of what matters at most, in frame units, where others lie nearer.
const REACH: f32 = Frame::EXTENT as f32;

/// How much the area of each triangle counts: that of lamps, of black surfaces and of far ones not at all, and that of huge
/// ones in part. Where nothing else is left, all counts.
fn counted_areas(scene: &Scene) -> Vec<f64> {
    let of_face = |index: usize| {
        let [a, b, c] = scene.corners(TriangleId(index as u32));
        let squares = [a - b, b - c, c - a].map(Vec3::length_squared);
        let longest = f64::from(squares.into_iter().fold(0.0, f32::max));
        let surface = &scene.surfaces[index];
        let is_near = ((a + b + c) / 3.0).abs().max_element() <= REACH;
        let shows = surface.emission == Vec3::ZERO && is_near;
        let brightness = if shows {
            (10.0 * luminance(surface.reflectance)).min(1.0)
        } else {
            0.0
        };
        let area = f64::from(surface.area_vector.length());
        (longest, area, f64::from(brightness))
    };
    let count = scene.triangles.len();
    let faces: Vec<(f64, f64, f64)> = (0..count).into_par_iter().map(of_face).collect();
    let shown = faces.iter().filter(|(.., brightness)| *brightness > 0.0);
    let classes = SizeClasses::new(shown.map(|&(longest, area, _)| (longest, area)));
    if classes.area == 0.0 {
        return faces.into_iter().map(|(_, area, _)| area).collect();
    }
    let counted = faces.into_par_iter();
    counted
        .map(|(longest, area, brightness)| area * brightness * classes.share(longest))
        .collect()
}

/// Numbered triangles, by area and by the root of the area.
fn chosen(scene: &Scene) -> Vec<(u32, TriangleId)> {
    let counted = counted_areas(scene);
    let by_area = stratified(&counted, |area| area);
    let by_root = stratified(&counted, f64::sqrt);
    (0..).zip(by_area.chain(by_root)).collect()
}

/// As many triangles as are wanted, each with a probability in proportion to its weight.
fn stratified(areas: &[f64], weight: fn(f64) -> f64) -> impl Iterator<Item = TriangleId> + use<> {
    let mut sum = 0.0;
    let sums: Vec<f64> = areas
        .iter()
        .map(|&area| {
            sum += weight(area);
            sum
        })
        .collect();
    let count = if sum > 0.0 { CHOSEN } else { 0 };
    (0..count).map(move |index| {
        let at = (index as f64 + 0.5) / CHOSEN as f64 * sum;
        let found = sums.partition_point(|&sum| sum <= at);
        TriangleId(found.min(sums.len() - 1) as u32)
    })
}

/// The spots at one place of a triangle: on the front, and on the back where that reflects.
fn sides(scene: &Scene, triangle: TriangleId, index: u32) -> impl Iterator<Item = Spot> + use<> {
    let weights = triangle_point(low_discrepancy_2d(index, Default::default()));
    let [a, b, c] = scene.corners(triangle);
    let point = a * weights.x + b * weights.y + c * weights.z;
    let normal = scene.surfaces[triangle.index()]
        .area_vector
        .normalize_or_zero();
    let count = if scene.triangles[triangle.index()].two_sided {
        2
    } else {
        1
    };
    [normal, -normal]
        .into_iter()
        .take(count)
        .map(move |normal| Spot {
            point,
            normal,
            triangle,
            weight: 1.0,
            is_lit: false,
        })
}

/// Whether a ray that meets a triangle meets a side of it that reflects.
pub(super) fn faces(scene: &Scene, triangle: TriangleId, direction: Vec3) -> bool {
    let index = triangle.index();
    scene.triangles[index].two_sided || scene.surfaces[index].area_vector.dot(direction) < 0.0
}

/// What gives light in a scene.
struct Lights {
    /// Triangles that emit, with the sum of their powers up to each of them.
    lamps: Vec<(TriangleId, f64)>,
}

impl Lights {
    fn of(scene: &Scene) -> Self {
        let mut sum = 0.0;
        let lamps = scene.triangle_ids().filter_map(|id| {
            let surface = &scene.surfaces[id.index()];
            let radiance = luminance(surface.emission);
            (radiance > 0.0).then(|| {
                sum += f64::from(radiance * surface.area_vector.length());
                (id, sum)
            })
        });
        Self {
            lamps: lamps.collect(),
        }
    }

    /// Whether light comes to a spot along a random path.
    fn reach(&self, scene: &Scene, rays: &RayTree, spot: &Spot, random: &mut Random) -> bool {
        let mut spot = *spot;
        for _ in 0..PATH_LENGTH {
            if self.shine_on(scene, rays, &spot, random) {
                return true;
            }
            let direction = cosine_direction(spot.normal, random.uniform_2d());
            let Some(hit) = rays.closest(spot.point, direction, Some(spot.triangle)) else {
                return luminance(scene.environment.sky.radiance(direction)) > 0.0;
            };
            if !faces(scene, hit.triangle, direction) {
                return false;
            }
            let surface = &scene.surfaces[hit.triangle.index()];
            if surface.emission != Vec3::ZERO {
                return true;
            }
            let normal = surface.area_vector.normalize_or_zero();
            spot = Spot {
                point: spot.point + direction * hit.distance,
                normal: if normal.dot(direction) > 0.0 {
                    -normal
                } else {
                    normal
                },
                triangle: hit.triangle,
                weight: 1.0,
                is_lit: false,
            };
        }
        false
    }

    /// Whether the sun, or a lamp chosen by its power, shines on a spot.
    fn shine_on(&self, scene: &Scene, rays: &RayTree, spot: &Spot, random: &mut Random) -> bool {
        /// Farther than all that may hide the sun, in frame units.
        const FAR: f32 = 1e6;
        let sun = scene.environment.sun;
        if let Some(sun) = sun.filter(|sun| sun.irradiance != Vec3::ZERO)
            && spot.normal.dot(sun.direction) > 0.0
            && !rays.occluded(
                spot.point,
                spot.point + sun.direction * FAR,
                [Some(spot.triangle), None],
            )
        {
            return true;
        }
        let Some(&(_, whole)) = self.lamps.last() else {
            return false;
        };
        let at = f64::from(random.uniform()) * whole;
        let found = self.lamps.partition_point(|&(_, sum)| sum <= at);
        let (lamp, _) = self.lamps[found.min(self.lamps.len() - 1)];
        let weights = triangle_point(random.uniform_2d());
        let [a, b, c] = scene.corners(lamp);
        let point = a * weights.x + b * weights.y + c * weights.z;
        let to_lamp = point - spot.point;
        to_lamp.dot(spot.normal) > 0.0
            && faces(scene, lamp, to_lamp)
            && !rays.occluded(spot.point, point, [Some(spot.triangle), Some(lamp)])
    }
}
