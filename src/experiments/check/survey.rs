//! What surfaces see: whether light can leave, or end on the black backs of one-sided faces.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::{
    geometry::{Hit, Random, RayTree, barycentric, cosine_direction, low_discrepancy_2d},
    reference::ReferencePoint,
    sampling::SurfacePoint,
    scene::{Scene, TriangleId},
    solver::Cancel,
};

/// Rays from each point that tell whether a scene is closed, or light ends on backs.
const RAYS: u32 = 64;

/// Paths from a point that tell whether it sees a back, over other surfaces, too. Where a hundredth of its light is missing
/// for one, three in four points are known by it, and where a fiftieth is, nine in ten.
const PATHS: u32 = 128;

/// Reflections of a path: what is left then at the usual limit of reflectance, 0.98, is 2 %.
const MOST_BOUNCES: u32 = 200;

/// Part of all rays up to which none is said to leave: rounding lets some pass between faces that touch. The mean light of
/// a closed scene that reflects half is known to twice that.
const NEGLIGIBLE: f64 = 1e-4;

/// Rays from the middle of each side that tell whether it is apart.
const SIDE_RAYS: u32 = 6;

/// What all surfaces see.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Survey {
    /// By side (twice the triangle, plus 1 for the back): whether most that it sees is outside or black backs, as of what
    /// lies within a solid or reaches out through a wall.
    is_apart: Vec<bool>,
    /// Part of the rays from all other lit sides that leave the scene, 0…1.
    pub(super) leaving: f64,
    /// Part of them that end on black backs, 0…1.
    pub(super) blocked: f64,
    /// Whether there are such sides.
    encloses: bool,
    /// Whether any ray met a black back.
    has_backs: bool,
}

/// Where a ray ends.
enum End {
    /// Outside.
    Outside,
    /// On a side that is lit.
    Lit(ReferencePoint),
    /// On the back of a one-sided face.
    Back,
}

impl Survey {
    /// Look around from points of all surfaces. `None` when cancelled.
    pub(super) fn new(
        scene: &Scene,
        rays: &RayTree,
        points: &[ReferencePoint],
        seed: u64,
        cancel: &Cancel,
    ) -> Option<Self> {
        let is_apart: Vec<bool> = (0..scene.triangles.len() as u32)
            .into_par_iter()
            .flat_map_iter(|index| {
                let of = |is_back| is_apart(scene, rays, TriangleId(index), is_back);
                [false, true].map(|is_back| !cancel.is_cancelled() && of(is_back))
            })
            .collect();
        let ends: Vec<[u32; 3]> = points
            .par_iter()
            .enumerate()
            .map(|(index, point)| {
                let mut counts = [0; 3];
                if cancel.is_cancelled() {
                    return counts;
                }
                let shift = Random::new(seed, index as u64).uniform_2d();
                for ray in 0..RAYS {
                    let direction = cosine_direction(point.normal, low_discrepancy_2d(ray, shift));
                    counts[match end(scene, rays, point, direction) {
                        End::Lit(_) => 0,
                        End::Outside => 1,
                        End::Back => 2,
                    }] += 1;
                }
                counts
            })
            .collect();
        if cancel.is_cancelled() {
            return None;
        }
        let part_of = |end: usize| {
            let enclosed = points
                .iter()
                .zip(&ends)
                .filter(|(point, _)| !is_apart[side(point)]);
            let (some, all) = enclosed.fold((0, 0), |(some, all), (_, counts)| {
                (some + u64::from(counts[end]), all + u64::from(RAYS))
            });
            some as f64 / all.max(1) as f64
        };
        Some(Self {
            encloses: points.iter().any(|point| !is_apart[side(point)]),
            leaving: part_of(1),
            blocked: part_of(2),
            has_backs: ends.iter().any(|counts| counts[2] > 0),
            is_apart,
        })
    }

    /// Whether a side is no part of what the others enclose.
    pub(super) fn is_apart(&self, triangle: TriangleId, is_back: bool) -> bool {
        self.is_apart[2 * triangle.index() + usize::from(is_back)]
    }

    /// Why the scene is not closed; `None` where it is.
    pub(super) fn opening(&self) -> Option<String> {
        let part = |share: f64| format!("{:.2} % of the rays within", 100.0 * share);
        if !self.encloses {
            return Some("open".to_owned());
        }
        if self.leaving > NEGLIGIBLE {
            return Some(format!("open: {} leave", part(self.leaving)));
        }
        (self.blocked > NEGLIGIBLE).then(|| {
            let share = part(self.blocked);
            format!("{share} end on black backs of one-sided faces")
        })
    }

    /// For each point, whether some of its light is missing since it sees black backs, also over reflections. `None` when
    /// cancelled.
    pub(super) fn sees_backs(
        &self,
        scene: &Scene,
        rays: &RayTree,
        points: &[ReferencePoint],
        seed: u64,
        cancel: &Cancel,
    ) -> Option<Vec<bool>> {
        let sees = |(index, point): (usize, &ReferencePoint)| {
            if !self.has_backs || cancel.is_cancelled() {
                return false;
            }
            let mut random = Random::new(!seed, index as u64);
            (0..PATHS).any(|_| path_ends_on_back(scene, rays, *point, &mut random))
        };
        let seen = points.par_iter().enumerate().map(sees).collect();
        (!cancel.is_cancelled()).then_some(seen)
    }
}

/// Index of the side of a point.
fn side(point: &ReferencePoint) -> usize {
    2 * point.triangle.index() + usize::from(point.is_back)
}

/// Whether most that is seen from the middle of a side is outside or black backs. Backs that are black themselves are no part of anything.
fn is_apart(scene: &Scene, rays: &RayTree, triangle: TriangleId, is_back: bool) -> bool {
    if is_back && !scene.triangles[triangle.index()].two_sided {
        return true;
    }
    let [a, b, c] = scene.corners(triangle);
    let front = scene.surfaces[triangle.index()]
        .area_vector
        .normalize_or_zero();
    let normal = if is_back { -front } else { front };
    let middle = (a + b + c) / 3.0;
    let is_lit = |ray: &u32| {
        let direction = cosine_direction(normal, low_discrepancy_2d(*ray, Vec2::splat(0.3)));
        let hit = rays.closest(middle, direction, Some(triangle));
        hit.is_some_and(|hit| arrival(scene, middle, direction, hit).is_some())
    };
    2 * (0..SIDE_RAYS).filter(is_lit).count() < SIDE_RAYS as usize
}

/// Follow a diffuse path until light would be absorbed, and tell whether it ends on a back before.
fn path_ends_on_back(
    scene: &Scene,
    rays: &RayTree,
    mut point: ReferencePoint,
    random: &mut Random,
) -> bool {
    for _ in 0..MOST_BOUNCES {
        let direction = cosine_direction(point.normal, random.uniform_2d());
        match end(scene, rays, &point, direction) {
            End::Back => return true,
            End::Outside => return false,
            End::Lit(met) => point = met,
        }
        if random.uniform() >= point.reflectance.max_element() {
            return false;
        }
    }
    false
}

fn end(scene: &Scene, rays: &RayTree, from: &ReferencePoint, direction: Vec3) -> End {
    match rays.closest(from.position, direction, Some(from.triangle)) {
        None => End::Outside,
        Some(hit) => arrival(scene, from.position, direction, hit).map_or(End::Back, End::Lit),
    }
}

/// The point of a lit side that a ray of unit direction meets; `None` on a black back.
pub(super) fn arrival(
    scene: &Scene,
    origin: Vec3,
    direction: Vec3,
    hit: Hit,
) -> Option<ReferencePoint> {
    let Hit { triangle, distance } = hit;
    let is_back = scene.surfaces[triangle.index()].area_vector.dot(direction) > 0.0;
    if is_back && !scene.triangles[triangle.index()].two_sided {
        return None;
    }
    // Put back on the triangle: along the ray it is off by the rounding of the distance.
    let barycentric = barycentric(origin + direction * distance, scene.corners(triangle));
    let point = SurfacePoint::at(scene, triangle, is_back, barycentric);
    Some(ReferencePoint::from(point))
}
