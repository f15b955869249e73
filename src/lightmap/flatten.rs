//! Charts laid flat: projected along their mean normal, turned so that they fill their rectangle well.

use std::collections::HashSet;

use glam::{Vec2, Vec3};

use super::sides::Side;
use crate::scene::Scene;

/// Sides of a chart whose longest edges are tried as an edge of its rectangle.
const TRIED_EDGES: usize = 24;

/// By how much sides may lie over each other, relative to the extent of their chart: rounding makes it 1e-6, and a hundredth
/// of a texel is not seen.
const SLACK: f32 = 1e-5;

/// Cells of the grid by which sides over each other are found, along an axis at most.
const MOST_CELLS: usize = 256;

/// Pairs of sides of a chart that are compared at most, beside some for each: sides that are left come to charts of their own.
const MOST_PAIRS: usize = 1 << 22;
const PAIRS_OF_SIDE: usize = 256;

/// How the sides of a chart lie, frame units.
#[derive(Clone, Debug, Default)]
pub(super) struct Flat {
    /// Corners of each side, from the corner of the rectangle.
    pub(super) corners: Vec<[Vec2; 3]>,
    /// Width and height of the rectangle; it is as wide as high at least.
    pub(super) extent: Vec2,
}

/// Lay sides flat. Returns how those that stay lie, in their order, and those that would lie over others before them.
pub(super) fn flatten(scene: &Scene, sides: &[Side], chart: &[u32]) -> (Flat, Vec<u32>) {
    let of = |side: &u32| sides[*side as usize];
    let areas = chart
        .iter()
        .map(|side| of(side).normal(scene) * of(side).area(scene));
    let normal = areas
        .sum::<Vec3>()
        .normalize_or(of(&chart[0]).normal(scene));
    let tangent = normal.any_orthonormal_vector();
    let bitangent = normal.cross(tangent);
    let origin = of(&chart[0]).corners(scene)[0];
    let corners: Vec<[Vec2; 3]> = chart
        .iter()
        .map(|side| {
            of(side).corners(scene).map(|corner| {
                let from = corner - origin;
                Vec2::new(from.dot(tangent), from.dot(bitangent))
            })
        })
        .collect();
    let is_rejected = over_others(&corners);
    let kept = corners.iter().zip(&is_rejected);
    let kept: Vec<[Vec2; 3]> = kept
        .filter(|(_, is_rejected)| !**is_rejected)
        .map(|(corners, _)| *corners)
        .collect();
    let rejected = chart.iter().zip(&is_rejected);
    let rejected = rejected.filter(|(_, is_rejected)| **is_rejected);
    (turned(kept), rejected.map(|(side, _)| *side).collect())
}

/// Corners turned so that their rectangle is small, and wider than high.
fn turned(mut corners: Vec<[Vec2; 3]>) -> Flat {
    let mut edges: Vec<Vec2> = corners
        .iter()
        .flat_map(|&[a, b, c]| [b - a, c - b, a - c])
        .collect();
    let count = TRIED_EDGES.min(edges.len());
    edges.sort_by(|a, b| b.length_squared().total_cmp(&a.length_squared()));
    let area = |axis: Vec2| {
        let [low, high] = bounds(&corners, axis);
        (high - low).element_product()
    };
    let axes = edges[..count].iter().map(|edge| edge.normalize_or(Vec2::X));
    let best = axes.min_by(|a, b| area(*a).total_cmp(&area(*b)));
    let mut axis = best.unwrap_or(Vec2::X);
    let [low, high] = bounds(&corners, axis);
    if (high - low).x < (high - low).y {
        axis = axis.perp();
    }
    let [low, high] = bounds(&corners, axis);
    for corner in corners.iter_mut().flatten() {
        *corner = along(*corner, axis) - low;
    }
    Flat {
        corners,
        extent: high - low,
    }
}

/// A place by its parts along an axis and square to it.
fn along(place: Vec2, axis: Vec2) -> Vec2 {
    Vec2::new(place.dot(axis), axis.perp_dot(place))
}

/// The least and the largest of places along an axis and square to it.
fn bounds(corners: &[[Vec2; 3]], axis: Vec2) -> [Vec2; 2] {
    let places = corners.iter().flatten().map(|&place| along(place, axis));
    places.fold([Vec2::INFINITY, Vec2::NEG_INFINITY], |[low, high], at| {
        [low.min(at), high.max(at)]
    })
}

/// Which triangles of a plane lie over others before them that do not themselves.
pub(super) fn over_others(triangles: &[[Vec2; 3]]) -> Vec<bool> {
    let [low, high] = bounds(triangles, Vec2::X);
    let extent = (high - low).max_element();
    let mut is_over = vec![false; triangles.len()];
    if extent.is_nan() || extent <= 0.0 {
        return is_over;
    }
    let mut pairs = MOST_PAIRS + PAIRS_OF_SIDE * triangles.len();
    let (grid, cells) = Grid::of(triangles, low, high - low);
    let mut met = HashSet::new();
    for (index, triangle) in triangles.iter().enumerate() {
        met.clear();
        let mut overlaps = |other: usize| {
            pairs = pairs.saturating_sub(1);
            let is_new = !is_over[other] && met.insert(other);
            pairs == 0 || is_new && is_overlap(triangle, &triangles[other], SLACK * extent)
        };
        // In each cell they come in their order.
        let before = |cell: usize| {
            let all = cells[cell].iter().map(|&other| other as usize);
            all.take_while(move |other| *other < index)
        };
        let mut covered = grid.covered(triangle);
        is_over[index] = covered.any(|cell| before(cell).any(&mut overlaps));
    }
    is_over
}

/// Whether two triangles lie over each other by more than a slack: no edge of either has them on both of its sides.
fn is_overlap(one: &[Vec2; 3], other: &[Vec2; 3], slack: f32) -> bool {
    let parts = |[a, b, c]: &[Vec2; 3], others: &[Vec2; 3]| {
        let is_clockwise = (b - a).perp_dot(c - a) < 0.0;
        [(a, b), (b, c), (c, a)].into_iter().any(|(from, to)| {
            let edge = (to - from).normalize_or_zero();
            let inward = if is_clockwise {
                -edge.perp()
            } else {
                edge.perp()
            };
            others
                .iter()
                .all(|place| (place - from).dot(inward) <= slack)
        })
    };
    !parts(one, other) && !parts(other, one)
}

/// A grid over the plane of a chart.
struct Grid {
    low: Vec2,
    cell: Vec2,
    count: usize,
}

impl Grid {
    /// A grid, with the triangles that touch each of its cells: coarse where they touch many.
    fn of(triangles: &[[Vec2; 3]], low: Vec2, extent: Vec2) -> (Self, Vec<Vec<u32>>) {
        let mut count = (triangles.len() as f32).sqrt() as usize;
        count = count.clamp(1, MOST_CELLS);
        loop {
            let cell = (extent / count as f32).max(Vec2::splat(f32::MIN_POSITIVE));
            let grid = Self { low, cell, count };
            let entries = triangles.iter().map(|triangle| {
                let [from, to] = grid.range(triangle);
                (to[0] - from[0] + 1) * (to[1] - from[1] + 1)
            });
            if count > 1 && entries.sum::<usize>() > 32 * triangles.len() {
                count /= 2;
                continue;
            }
            let mut cells = vec![Vec::new(); count * count];
            for (index, triangle) in triangles.iter().enumerate() {
                for cell in grid.covered(triangle) {
                    cells[cell].push(index as u32);
                }
            }
            return (grid, cells);
        }
    }

    /// The first and the last cell of a triangle's box.
    fn range(&self, triangle: &[Vec2; 3]) -> [[usize; 2]; 2] {
        let [a, b, c] = *triangle;
        let last = (self.count - 1) as f32;
        [a.min(b).min(c), a.max(b).max(c)].map(|place| {
            let cell = ((place - self.low) / self.cell).floor();
            cell.clamp(Vec2::ZERO, Vec2::splat(last))
                .to_array()
                .map(|at| at as usize)
        })
    }

    fn covered(&self, triangle: &[Vec2; 3]) -> impl Iterator<Item = usize> + use<> {
        let ([from, to], count) = (self.range(triangle), self.count);
        (from[1]..=to[1]).flat_map(move |row| (from[0]..=to[0]).map(move |at| row * count + at))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Random;

    fn triangle(x: f32, y: f32, size: f32) -> [Vec2; 3] {
        let at = Vec2::new(x, y);
        [at, at + Vec2::X * size, at + Vec2::Y * size]
    }

    #[test]
    fn triangles_that_touch_do_not_lie_over_each_other() {
        let mut triangles = Vec::new();
        for cell in 0..400 {
            let at = Vec2::new((cell % 20) as f32, (cell / 20) as f32);
            let [a, b, c, d] = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y].map(|corner| at + corner);
            triangles.extend([[a, b, c], [a, c, d]]);
        }
        assert_eq!(over_others(&triangles), vec![false; 800]);
        triangles.push(triangle(3.2, 4.2, 0.1));
        assert!(over_others(&triangles)[800]);
    }

    #[test]
    fn those_that_stay_never_lie_over_each_other_and_each_other_one_does() {
        let mut random = Random::new(7, 0);
        let triangles: Vec<[Vec2; 3]> = (0..300)
            .map(|_| {
                let at = random.uniform_2d() * 10.0;
                triangle(at.x, at.y, 0.2 + random.uniform())
            })
            .collect();
        let is_over = over_others(&triangles);
        let slack = SLACK * 11.0;
        for (index, triangle) in triangles.iter().enumerate() {
            let others = triangles[..index].iter().zip(&is_over);
            let meets = others
                .filter(|(_, is_over)| !**is_over)
                .any(|(other, _)| is_overlap(triangle, other, slack));
            assert_eq!(is_over[index], meets, "{index}");
        }
        assert!(is_over.iter().any(|over| *over) && is_over.iter().any(|over| !*over));
    }

    #[test]
    fn a_slanted_rectangle_fills_its_own() {
        let (long, short) = (Vec2::new(4.0, 3.0), Vec2::new(-0.6, 0.8));
        let flat = turned(vec![
            [Vec2::ZERO, long, long + short],
            [Vec2::ZERO, long + short, short],
        ]);
        assert!((flat.extent - Vec2::new(5.0, 1.0)).abs().max_element() < 1e-5);
        let places = flat.corners.iter().flatten();
        let inside =
            |at: &Vec2| at.cmpge(Vec2::splat(-1e-5)).all() && at.cmple(flat.extent + 1e-5).all();
        assert!(places.into_iter().all(inside));
    }
}
