//! Places in the openings through which rays see the sky.
//!
//! A ray that leaves the scene does not tell where it passed the last surfaces. But rays from different places through one
//! opening cross there, and nowhere else: the place along a ray at which it meets most others is taken for the opening.

use glam::Vec3;
use rayon::prelude::*;

/// Most rays whose openings are found, and most others that vote on each. Fewer, and openings are known by fewer places;
/// more take time.
const MOST_RAYS: usize = 2048;
const MOST_VOTERS: usize = 64;

/// Distances tried along a ray: from the farthest down, in sizes of the box of all starts, each by this ratio nearer. More,
/// and nearer, take time; fewer miss the opening.
const FARTHEST: f32 = 2.0;
const RATIO: f32 = 0.8;
const DISTANCES: usize = 32;

/// Cosine of the angle within which a ray passes a place (11°, about two leaves of the sky's tree). Larger blurs the place;
/// smaller finds no votes.
const NEAR_COSINE: f32 = 0.98;

/// A ray that reached the sky.
#[derive(Clone, Copy, Debug)]
pub(super) struct SkyHit {
    pub from: Vec3,
    pub direction: Vec3,
    /// Estimate of the visible part of the leaf of the sky's tree, up to a factor.
    pub visible: f32,
}

/// A place in an opening.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Opening {
    pub place: Vec3,
    /// As of its ray.
    pub visible: f32,
}

/// The places in openings of some rays, some of them left out if there are many. Returns each with the index of its ray.
pub(super) fn openings(hits: &[SkyHit]) -> Vec<(usize, Opening)> {
    let stride = |most: usize| hits.len().div_ceil(most).max(1);
    let voters: Vec<&SkyHit> = hits.iter().step_by(stride(MOST_VOTERS)).collect();
    let step = stride(MOST_RAYS);
    let starts = |of: fn(Vec3, Vec3) -> Vec3| hits.iter().map(|hit| hit.from).reduce(of);
    let size = match (starts(Vec3::min), starts(Vec3::max)) {
        (Some(least), Some(most)) => (most - least).length(),
        _ => return Vec::new(),
    };
    (0..hits.len())
        .into_par_iter()
        .step_by(step)
        .map(|index| {
            let hit = &hits[index];
            let place = hit.from + hit.direction * distance(hit, &voters, FARTHEST * size);
            let visible = hit.visible;
            (index, Opening { place, visible })
        })
        .collect()
}

/// The distance along a ray at which it meets most of the others.
fn distance(hit: &SkyHit, voters: &[&SkyHit], farthest: f32) -> f32 {
    let votes = |distance: f32| {
        let place = hit.from + hit.direction * distance;
        let vote = |voter: &&SkyHit| {
            let way = place - voter.from;
            let cosine = way.dot(voter.direction) / way.length().max(f32::MIN_POSITIVE);
            (cosine - NEAR_COSINE).max(0.0)
        };
        voters.iter().map(vote).sum::<f32>()
    };
    let coarse = (0..DISTANCES).map(|step| farthest * RATIO.powi(step as i32));
    let near = best(coarse, votes);
    let fine = (-3..=3).map(|step| near * RATIO.powf(step as f32 / 4.0));
    best(fine, votes)
}

/// The distance with the most votes, the first of them if there are several.
fn best(distances: impl Iterator<Item = f32>, votes: impl Fn(f32) -> f32) -> f32 {
    let mut best = (f32::NEG_INFINITY, 0.0);
    for distance in distances {
        let votes = votes(distance);
        if votes > best.0 {
            best = (votes, distance);
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Random;

    #[test]
    fn rays_through_two_windows_find_the_one_that_each_passed() {
        let mut random = Random::new(1, 0);
        let windows = [Vec3::new(30.0, 10.0, -5.0), Vec3::new(-20.0, 5.0, 30.0)];
        let mut jitter =
            |size: f32| Vec3::from_array([(); 3].map(|()| random.uniform() - 0.5)) * size;
        let hits: Vec<SkyHit> = (0..120)
            .map(|index| {
                let from = jitter(40.0) - Vec3::Y * 20.0;
                let through = windows[index / 7 % 2] + jitter(2.0);
                SkyHit {
                    from,
                    direction: (through - from).normalize_or_zero(),
                    visible: 1.0,
                }
            })
            .collect();
        let found = openings(&hits);
        assert_eq!(found.len(), hits.len());
        let is_near = |&&(ray, opening): &&(usize, Opening)| {
            opening.place.distance(windows[ray / 7 % 2]) < 5.0
        };
        let near = found.iter().filter(is_near).count();
        assert!(near > 110, "{near}");
        assert!(openings(&[]).is_empty());
    }
}
