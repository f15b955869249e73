//! The texture coordinates of the file, where they lay every lit side out by itself.

use glam::Vec2;

use super::{
    flatten::over_others,
    sides::{Neighbours, Side},
};
use crate::scene::{DisjointSets, Scene};

/// By how much coordinates may lie outside the picture: what rounding in files makes of its edges.
const OUTSIDE: f32 = 1e-4;

/// Area in the picture, relative to the mean of all sides with the same area in the scene, below which a side has no texels of
/// its own. Larger refuses coordinates that give dull surfaces less room; smaller leaves surfaces without light.
const LEAST_AREA: f32 = 1e-3;

/// The coordinates of the file from the upper left of the picture, 0…1, and the island of each side; `None` where there are
/// none, or two sides share a place.
pub(super) fn own_coordinates(
    scene: &Scene,
    sides: &[Side],
    neighbours: &Neighbours,
) -> Option<(Vec<[Vec2; 3]>, Vec<u32>)> {
    let mut places = Vec::with_capacity(sides.len());
    for side in sides {
        let texcoords = scene.texcoords.get(side.triangle.index())?;
        let place = side.order().map(|corner| {
            let Vec2 { x, y } = texcoords[corner];
            Vec2::new(x, 1.0 - y)
        });
        let is_inside = |at: &Vec2| {
            at.cmpge(Vec2::splat(-OUTSIDE)).all() && at.cmple(Vec2::splat(1.0 + OUTSIDE)).all()
        };
        if side.is_back || !place.iter().all(is_inside) {
            return None;
        }
        places.push(place.map(|at| at.clamp(Vec2::ZERO, Vec2::ONE)));
    }
    let covered = |&[a, b, c]: &[Vec2; 3]| 0.5 * (b - a).perp_dot(c - a).abs();
    let area: f32 = sides.iter().map(|side| side.area(scene)).sum();
    let share = places.iter().map(covered).sum::<f32>() / area;
    let is_seen =
        |(side, place): (&Side, &[Vec2; 3])| covered(place) > LEAST_AREA * share * side.area(scene);
    let are_seen = sides.iter().zip(&places).all(is_seen);
    if !are_seen || over_others(&places).into_iter().any(|is_over| is_over) {
        return None;
    }
    let islands = islands(&places, neighbours);
    Some((places, islands))
}

/// Sides that hang together in the scene and in the picture.
fn islands(places: &[[Vec2; 3]], neighbours: &Neighbours) -> Vec<u32> {
    let mut sets = DisjointSets::new(places.len());
    for side in 0..places.len() as u32 {
        for (edge, other) in neighbours.about(side) {
            let [from, to] = ends(&places[side as usize], edge);
            let shares = (0..3).any(|edge| ends(&places[other as usize], edge) == [to, from]);
            if shares {
                sets.join(side, other);
            }
        }
    }
    let mut numbers = vec![u32::MAX; places.len()];
    let mut count = 0;
    (0..places.len() as u32)
        .map(|side| {
            let number = &mut numbers[sets.root(side) as usize];
            if *number == u32::MAX {
                *number = count;
                count += 1;
            }
            *number
        })
        .collect()
}

fn ends(place: &[Vec2; 3], edge: usize) -> [Vec2; 2] {
    [place[edge], place[(edge + 1) % 3]]
}
