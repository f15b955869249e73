//! The view that a scene opens with.
//!
//! One rule chooses it: of many cameras, the one whose picture shows most of what there is to see, lit. What there is to
//! see are `Spots` on the surfaces, each of which counts by the light that reaches it. Cameras stand around the scene,
//! and in the free space that its surfaces look into. So a room is seen from inside, since from outside its walls hide
//! the rest; a box without a front from before it; an object from outside.

mod interior;
mod spots;

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};
use rayon::prelude::*;

pub use interior::Interior;

use super::camera::Camera;
use crate::{
    geometry::{Random, RayTree, cosine_direction},
    scene::{Frame, Scene, TriangleId},
};
use spots::{Spot, Spots};

/// The view that a scene opens with.
#[derive(Clone, Copy, Debug)]
pub struct FirstLook {
    /// From where.
    pub camera: Camera,
    /// The room that it shows, where it shows one.
    pub interior: Option<Interior>,
    /// Whether light reaches anything that it shows.
    pub is_lit: bool,
    /// Box about what matters, in frame units: lower and upper corner.
    pub bounds: [Vec3; 2],
}

/// Directions around an eye that are tried.
const YAWS: usize = 12;
/// Heights above the horizon of cameras around the scene, radians. Without the steep ones a house without its roof shows
/// its walls only.
const OUTER_PITCHES: [f32; 4] = [0.08, 0.35, 0.75, 1.2];
/// And of cameras inside it.
const INNER_PITCHES: [f32; 2] = [0.0, 0.15];
/// Places inside that are tried. Fewer miss the room that matters in a house; more take longer.
const PLACES: usize = 24;
/// Cameras that are judged in full, after all were judged by a part of the spots.
const FINALISTS: usize = 24;
/// That part: each such spot. Odd, since fronts and backs take turns.
const STRIDE: usize = 5;
/// Width over height of the pictures that are judged.
const ASPECT: f32 = 1.5;
/// Cameras around the scene show all of it in pictures that are narrower yet: windows differ.
const FIT_ASPECT: f32 = 1.2;
/// Rays across and down such a picture.
const RAYS: [usize; 2] = [15, 10];
/// Nearer surfaces are in the way, in frame units.
const TOO_NEAR: f32 = 1.5;
/// Share of a picture's worth that does not depend on how much of it is filled. Less, and cameras crowd in on what there
/// is; more, and they look through key-holes.
const UNFILLED: f32 = 0.5;
/// Share of the way to the wall behind that a camera inside steps back.
const STEP_BACK: f32 = 0.85;
/// Eyes inside stand at this share of the height of the room.
const EYE_HEIGHT: f32 = 0.45;

/// Choose the view that a scene opens with.
pub fn first_look(scene: &Scene, rays: &RayTree) -> FirstLook {
    let bounds = bounds(scene);
    let judge = Judge {
        scene,
        rays,
        spots: Spots::new(scene, rays),
        up: scene.up.vector(),
        bounds,
    };
    let outer = judge.outer();
    let usual = outer[0].camera;
    let mut candidates = outer;
    let places = judge.free_places();
    candidates.extend(judge.inner(&places, usual.distance));
    let mut ranked = judge.rank(candidates, STRIDE, Judge::seen);
    ranked.truncate(FINALISTS);
    let ranked = judge.rank(ranked, 1, Judge::worth);
    let Some(best) = ranked.first() else {
        return FirstLook {
            camera: usual,
            interior: None,
            is_lit: false,
            bounds,
        };
    };
    FirstLook {
        camera: best.camera,
        interior: judge.interior(best, &places),
        is_lit: judge.shows_light(&best.camera),
        bounds,
    }
}

/// Whether light reaches anything that a camera shows.
pub fn shows_light(scene: &Scene, rays: &RayTree, camera: &Camera) -> bool {
    let judge = Judge {
        scene,
        rays,
        spots: Spots::new(scene, rays),
        up: scene.up.vector(),
        bounds: [Vec3::ZERO; 2],
    };
    judge.shows_light(camera)
}

/// Box about the faces near the origin, where what matters lies: see [`Frame`]. Lamps are left out where there is anything
/// else: a dome that stands for the sky is as far away as it likes. In most scenes that is all.
fn bounds(scene: &Scene) -> [Vec3; 2] {
    let reach = Frame::EXTENT as f32;
    let around = |shows: &(dyn Fn(TriangleId, Vec3) -> bool + Sync)| {
        let empty = || [Vec3::MAX, Vec3::MIN];
        (0..scene.triangles.len())
            .into_par_iter()
            .fold(empty, |[min, max], index| {
                let id = TriangleId(index as u32);
                let [a, b, c] = scene.corners(id);
                let [low, high] = [a.min(b).min(c), a.max(b).max(c)];
                match shows(id, low.abs().max(high.abs())) {
                    true => [min.min(low), max.max(high)],
                    false => [min, max],
                }
            })
            .reduce(empty, |a, b| [a[0].min(b[0]), a[1].max(b[1])])
    };
    let is_near = |farthest: Vec3| farthest.max_element() <= reach;
    let emits = |id: TriangleId| scene.surfaces[id.index()].emission != Vec3::ZERO;
    let is_some = |[min, max]: &[Vec3; 2]| (*max - *min).max_element() > 0.0;
    let half = Vec3::splat(0.5 * reach);
    let found = [
        around(&|id, farthest| is_near(farthest) && !emits(id)),
        around(&|_, farthest| is_near(farthest)),
    ];
    let all = || around(&|_, _| true).map(|corner| corner.clamp(-half, half));
    found.into_iter().find(is_some).unwrap_or_else(all)
}

/// A camera to be judged.
#[derive(Clone, Copy)]
struct Candidate {
    camera: Camera,
    /// The free place that it was found from; `None` around the scene.
    place: Option<Vec3>,
    /// Factor on its worth: the usual view from the front goes before others that show as much.
    habit: f32,
}

/// What judges cameras.
struct Judge<'a> {
    scene: &'a Scene,
    rays: &'a RayTree,
    spots: Spots,
    up: Vec3,
    bounds: [Vec3; 2],
}

impl Judge<'_> {
    /// Cameras around the scene, the usual one first.
    fn outer(&self) -> Vec<Candidate> {
        let [min, max] = self.bounds;
        let usual = Camera {
            up: self.up,
            ..Camera::default()
        };
        let turned = (0..YAWS).map(|step| step as f32 / YAWS as f32 * TAU);
        let turned = OUTER_PITCHES
            .into_iter()
            .flat_map(|pitch| turned.clone().map(move |yaw| (yaw, pitch)));
        std::iter::once((usual.yaw, usual.pitch))
            .chain(turned)
            .map(|(yaw, pitch)| {
                let mut camera = Camera {
                    yaw,
                    pitch,
                    ..usual
                };
                camera.fit_box(min, max, FIT_ASPECT);
                let steep = (pitch - usual.pitch).max(0.0);
                let is_usual = yaw == usual.yaw && pitch == usual.pitch;
                Candidate {
                    camera,
                    place: None,
                    habit: (1.0 + 0.06 * yaw.cos() - 0.35 * steep)
                        * if is_usual { 1.1 } else { 1.0 },
                }
            })
            .collect()
    }

    /// Cameras in the free space that surfaces look into.
    fn inner(&self, places: &[Vec3], farthest: f32) -> Vec<Candidate> {
        let directions = INNER_PITCHES
            .into_iter()
            .flat_map(|pitch| (0..YAWS).map(move |step| (step as f32 / YAWS as f32 * TAU, pitch)));
        let directions: Vec<(f32, f32)> = directions.collect();
        places
            .par_iter()
            .flat_map_iter(|&place| {
                let of = move |&(yaw, pitch)| self.standing_back(place, yaw, pitch, farthest);
                directions.iter().filter_map(of)
            })
            .collect()
    }

    /// Places in that free space.
    fn free_places(&self) -> Vec<Vec3> {
        let mut places: Vec<Vec3> = (0..8 * PLACES)
            .into_par_iter()
            .filter_map(|index| self.free_place(index))
            .collect();
        places.truncate(PLACES);
        places
    }

    /// A place between a spot and what it looks at, at the height of an eye.
    fn free_place(&self, index: usize) -> Option<Vec3> {
        let spots = &self.spots.all;
        // Spots next to each other in the list lie next to each other in the scene.
        let spot = spots.get(index.wrapping_mul(7919) % spots.len().max(1))?;
        let mut random = Random::new(1, index as u64);
        let direction = cosine_direction(spot.normal, random.uniform_2d());
        let (distance, is_lit_side) = self.meets(spot.point, direction, spot)?;
        if !is_lit_side {
            return None;
        }
        let place = spot.point + direction * (distance * (0.3 + 0.4 * random.uniform()));
        let (below, _) = self.meets_from(place, -self.up)?;
        let above = self.meets_from(place, self.up).map(|(above, _)| above);
        let [min, max] = self.bounds;
        let height = above.map_or((max - min).dot(self.up) * 0.5, |above| below + above);
        (height > 2.0 * TOO_NEAR).then(|| place + self.up * (EYE_HEIGHT * height - below))
    }

    /// A camera that looks from a place, as far behind it as there is room, and as is needed to see all.
    fn standing_back(&self, place: Vec3, yaw: f32, pitch: f32, farthest: f32) -> Option<Candidate> {
        let mut camera = Camera {
            up: self.up,
            pivot: place,
            yaw,
            pitch,
            ..Camera::default()
        };
        let backward = camera.backward();
        let (behind, _) = self.meets_from(place, backward)?;
        let eye = place + backward * (STEP_BACK * behind).min(behind - TOO_NEAR).max(0.0);
        let eye = place + (eye - place).clamp_length_max(farthest);
        let (ahead, _) = self.meets_from(eye, -backward)?;
        camera.distance = (0.5 * ahead).max(TOO_NEAR);
        camera.pivot = eye - backward * camera.distance;
        Some(Candidate {
            camera,
            place: Some(place),
            habit: 1.0 - 0.2 * pitch,
        })
    }

    /// How far a ray from a spot goes, and whether it ends on a side that is lit.
    fn meets(&self, origin: Vec3, direction: Vec3, from: &Spot) -> Option<(f32, bool)> {
        let hit = self.rays.closest(origin, direction, Some(from.triangle))?;
        Some((
            hit.distance,
            spots::faces(self.scene, hit.triangle, direction),
        ))
    }

    /// The same from free space.
    fn meets_from(&self, origin: Vec3, direction: Vec3) -> Option<(f32, bool)> {
        let hit = self.rays.closest(origin, direction, None)?;
        Some((
            hit.distance,
            spots::faces(self.scene, hit.triangle, direction),
        ))
    }

    /// The candidates, the one of most worth first, judged by each so many spots. Those of no worth are left out.
    fn rank(
        &self,
        candidates: Vec<Candidate>,
        stride: usize,
        worth: impl Fn(&Self, &Candidate, usize) -> f32 + Sync,
    ) -> Vec<Candidate> {
        let mut ranked: Vec<(f32, Candidate)> = candidates
            .into_par_iter()
            .map(|candidate| (worth(self, &candidate, stride), candidate))
            .filter(|(worth, _)| *worth > 0.0)
            .collect();
        // Stable, so that of equals the first goes before.
        ranked.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        ranked.into_iter().map(|(_, candidate)| candidate).collect()
    }

    /// How much of the lit surfaces a camera sees.
    fn seen(&self, candidate: &Candidate, stride: usize) -> f32 {
        let seen = self.spots.all.iter().step_by(stride);
        let seen: f32 = seen.map(|spot| self.view_of(&candidate.camera, spot)).sum();
        seen * candidate.habit
    }

    /// The worth of a whole picture.
    fn worth(&self, candidate: &Candidate, stride: usize) -> f32 {
        let filled = self.filled(&candidate.camera);
        self.seen(candidate, stride) * (UNFILLED + (1.0 - UNFILLED) * filled)
    }

    /// How much a spot counts in a picture: 0 where it does not show.
    fn view_of(&self, camera: &Camera, spot: &Spot) -> f32 {
        /// Spots nearer to the rim of the picture do not count.
        const RIM: f32 = 0.96;
        let eye = camera.eye();
        let to_eye = eye - spot.point;
        let distance = to_eye.length();
        let slant = to_eye.dot(spot.normal) / distance.max(f32::MIN_POSITIVE);
        if slant <= 0.02 || distance < TOO_NEAR {
            return 0.0;
        }
        let ndc = camera.clip_from_frame(ASPECT) * spot.point.extend(1.0);
        if ndc.w <= 0.0 || ndc.x.abs() > RIM * ndc.w || ndc.y.abs() > RIM * ndc.w {
            return 0.0;
        }
        if self
            .rays
            .occluded(spot.point, eye, [Some(spot.triangle), None])
        {
            return 0.0;
        }
        spot.weight * (2.0 * slant).min(1.0)
    }

    /// Whether a camera sees a spot that is lit.
    fn shows_light(&self, camera: &Camera) -> bool {
        let mut lit = self.spots.all.iter().filter(|spot| spot.is_lit);
        lit.any(|spot| self.view_of(camera, spot) > 0.0)
    }

    /// The part of a picture that shows surfaces from their lit side, of what matters and not too near.
    fn filled(&self, camera: &Camera) -> f32 {
        let [across, down] = RAYS;
        let [min, max] = [self.bounds[0] - TOO_NEAR, self.bounds[1] + TOO_NEAR];
        let place = |index: usize, count: usize| (index as f32 + 0.5) / count as f32 * 2.0 - 1.0;
        let mut shown = 0;
        for ray in 0..across * down {
            let ndc = Vec2::new(place(ray % across, across), place(ray / across, down));
            let (origin, direction) = camera.ray(ndc, ASPECT);
            let shows = |(distance, is_lit): (f32, bool)| {
                let point = origin + direction * distance;
                let is_near = point.cmpge(min).all() && point.cmple(max).all();
                is_lit && is_near && distance > TOO_NEAR
            };
            shown += usize::from(self.meets_from(origin, direction).is_some_and(shows));
        }
        shown as f32 / (across * down) as f32
    }

    /// The room that a camera shows: about the place that it was found from, or, of one around the scene that looks
    /// into it, about a place from which most of what the camera sees is seen, too. Within a solid nothing of that is.
    fn interior(&self, best: &Candidate, places: &[Vec3]) -> Option<Interior> {
        if let Some(place) = best.place {
            // Long rooms show their ends from other places in them.
            let is_in_sight = |&&other: &&Vec3| !self.rays.occluded(place, other, [None; 2]);
            let mut places: Vec<Vec3> = places.iter().filter(is_in_sight).copied().collect();
            places.push(best.camera.eye());
            return Interior::about(self.rays, &places);
        }
        let seen: Vec<(&Spot, f32)> = self
            .spots
            .all
            .iter()
            .map(|spot| (spot, self.view_of(&best.camera, spot)))
            .filter(|(_, seen)| *seen > 0.0)
            .collect();
        let all: f32 = seen.iter().map(|(_, seen)| seen).sum();
        let shared = |&place: &Vec3| -> f32 {
            let looks = |spot: &Spot| {
                spot.normal.dot(place - spot.point) > 0.0
                    && !self
                        .rays
                        .occluded(spot.point, place, [Some(spot.triangle), None])
            };
            let inward = seen.iter().filter(|(spot, _)| looks(spot));
            inward.map(|(_, seen)| seen).sum()
        };
        let [min, max] = self.bounds;
        let middle = 0.5 * (min + max);
        let mut places = std::iter::once(middle).chain(places.iter().copied());
        let place = places.find(|place| shared(place) > 0.5 * all)?;
        Interior::about(self.rays, &[place])
    }
}

/// Direction `index` of `count` spread evenly over the sphere (a Fibonacci lattice).
fn even_direction(index: usize, count: usize) -> Vec3 {
    const GOLDEN: f32 = 2.399_963_2;
    let height = 1.0 - (2.0 * index as f32 + 1.0) / count as f32;
    let (sin, cos) = (GOLDEN * index as f32).rem_euclid(2.0 * PI).sin_cos();
    let radius = (1.0 - height * height).max(0.0).sqrt();
    Vec3::new(radius * cos, height, radius * sin)
}
