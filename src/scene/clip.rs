//! Convex polygons in a plane: what triangles leave of them.
//!
//! All polygons turn left.

use glam::DVec2;

/// More triangles than this are sorted to both sides of a line before they are cut out. Fewer cut polygons along lines for
/// nothing, more compare every piece with every triangle.
const MANY: usize = 32;

/// How often polygons are cut along such lines at most: where triangles lie over each other it helps no more.
const DEEPEST: u32 = 16;

/// Polygons that a set of triangles leaves of one, and those that it covers; together they are the whole but for slivers.
#[derive(Debug, Default)]
pub(super) struct Parts {
    /// Parts that no triangle covers.
    pub(super) open: Vec<Vec<DVec2>>,
    /// Parts that one covers.
    pub(super) covered: Vec<Vec<DVec2>>,
}

/// The corners of a triangle in the order that turns left.
pub(super) fn turned_left([a, b, c]: [DVec2; 3]) -> [DVec2; 3] {
    if (b - a).perp_dot(c - a) < 0.0 {
        [a, c, b]
    } else {
        [a, b, c]
    }
}

/// Whether an edge of one of two convex polygons leaves them apart, or overlapping by no more than `width`.
pub(super) fn are_apart(a: &[DVec2], b: &[DVec2], width: f64) -> bool {
    let is_apart = |a: &[DVec2], b: &[DVec2]| {
        edges(a).any(|edge| {
            let depth = b.iter().map(|&corner| edge.left_of(corner));
            depth.fold(f64::MIN, f64::max) <= width
        })
    };
    is_apart(a, b) || is_apart(b, a)
}

/// Cut triangles out of a polygon. Pieces less wide than `least` are omitted.
pub(super) fn cut_out(polygon: Vec<DVec2>, triangles: &[[DVec2; 3]], least: f64) -> Parts {
    let mut parts = Parts::default();
    cut_into(&mut parts, polygon, triangles, least, 0);
    parts
}

fn cut_into(
    parts: &mut Parts,
    polygon: Vec<DVec2>,
    triangles: &[[DVec2; 3]],
    least: f64,
    depth: u32,
) {
    let near: Vec<[DVec2; 3]> = triangles
        .iter()
        .filter(|triangle| !are_apart(&polygon, *triangle, least))
        .copied()
        .collect();
    if near.len() > MANY && depth < DEEPEST {
        let (min, max) = bounds(&polygon);
        let (middle, extent) = ((min + max) / 2.0, max - min);
        let direction = if extent.x > extent.y {
            DVec2::Y
        } else {
            DVec2::NEG_X
        };
        let [left, right] = Line::new(middle, direction).split(&polygon);
        for half in [left, right] {
            if is_wide(&half, least) {
                cut_into(parts, half, &near, least, depth + 1);
            }
        }
        return;
    }
    let mut open = vec![polygon];
    for triangle in &near {
        let before = std::mem::take(&mut open);
        for piece in before {
            if are_apart(&piece, triangle, least) {
                open.push(piece);
                continue;
            }
            let mut inner = piece;
            for edge in edges(triangle) {
                let [inside, outside] = edge.split(&inner);
                if is_wide(&outside, least) {
                    open.push(outside);
                    inner = inside;
                }
            }
            if is_wide(&inner, least) {
                parts.covered.push(inner);
            }
        }
    }
    parts.open.append(&mut open);
}

/// Whether a polygon is wider than `least`, by its area and its longest diagonal.
fn is_wide(polygon: &[DVec2], least: f64) -> bool {
    let Some(&first) = polygon.first() else {
        return false;
    };
    let double_area: f64 = polygon
        .windows(2)
        .map(|pair| (pair[0] - first).perp_dot(pair[1] - first))
        .sum();
    let (min, max) = bounds(polygon);
    double_area > least * (max - min).length()
}

fn bounds(polygon: &[DVec2]) -> (DVec2, DVec2) {
    let start = (DVec2::MAX, DVec2::MIN);
    polygon.iter().fold(start, |(min, max), &corner| {
        (min.min(corner), max.max(corner))
    })
}

fn edges(polygon: &[DVec2]) -> impl Iterator<Item = Line> {
    let next = polygon.iter().cycle().skip(1);
    polygon
        .iter()
        .zip(next)
        .filter(|(from, to)| from.distance_squared(**to) > SHORTEST * SHORTEST)
        .map(|(&from, &to)| Line::new(from, to - from))
}

/// Shorter edges, frame units, are what rounding leaves between crossings in one place, and have no direction.
const SHORTEST: f64 = 1e-9;

/// A line with a direction.
#[derive(Clone, Copy)]
struct Line {
    origin: DVec2,
    /// Unit.
    direction: DVec2,
}

impl Line {
    fn new(origin: DVec2, direction: DVec2) -> Self {
        Self {
            origin,
            direction: direction.normalize_or_zero(),
        }
    }

    /// How far a point lies to the left.
    fn left_of(&self, point: DVec2) -> f64 {
        self.direction.perp_dot(point - self.origin)
    }

    /// The parts of a convex polygon to the left and to the right; corners on the line belong to both.
    fn split(&self, polygon: &[DVec2]) -> [Vec<DVec2>; 2] {
        let [mut left, mut right] = [Vec::new(), Vec::new()];
        let next = polygon.iter().cycle().skip(1);
        for (&from, &to) in polygon.iter().zip(next) {
            let (before, after) = (self.left_of(from), self.left_of(to));
            if before >= 0.0 {
                left.push(from);
            }
            if before <= 0.0 {
                right.push(from);
            }
            if before * after < 0.0 {
                let crossing = from + (to - from) * (before / (before - after));
                left.push(crossing);
                right.push(crossing);
            }
        }
        [left, right]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(polygons: &[Vec<DVec2>]) -> f64 {
        let of = |polygon: &Vec<DVec2>| -> f64 {
            let pairs = polygon.windows(2);
            pairs
                .map(|pair| (pair[0] - polygon[0]).perp_dot(pair[1] - polygon[0]) / 2.0)
                .sum()
        };
        polygons.iter().map(of).sum()
    }

    fn square(min: DVec2, side: f64) -> Vec<DVec2> {
        [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
            .map(|corner| min + DVec2::from(corner) * side)
            .to_vec()
    }

    /// Squares in a grid of `count` a side over a square of `side`, two triangles each.
    fn tiles(count: usize, side: f64) -> Vec<[DVec2; 3]> {
        let step = side / count as f64;
        (0..count * count)
            .flat_map(|tile| {
                let at = DVec2::new((tile % count) as f64, (tile / count) as f64) * step;
                let [a, b, c, d] = [0, 1, 2, 3].map(|corner| square(at, step)[corner]);
                [[a, b, c], [a, c, d]]
            })
            .collect()
    }

    #[test]
    fn areas_of_the_parts_add_up_to_the_whole() {
        let whole = square(DVec2::ZERO, 4.0);
        for (count, side) in [(1, 2.0), (3, 2.0), (20, 3.0), (1, 9.0)] {
            let parts = cut_out(whole.clone(), &tiles(count, side), 1e-4);
            let covered = side.min(4.0) * side.min(4.0);
            assert!((area(&parts.covered) - covered).abs() < 1e-9, "{count}");
            assert!((area(&parts.open) - 16.0 + covered).abs() < 1e-9, "{count}");
        }
    }

    #[test]
    fn triangles_over_each_other_are_cut_out_once() {
        let twice = [tiles(2, 2.0), tiles(3, 2.0)].concat();
        let parts = cut_out(square(DVec2::ZERO, 4.0), &twice, 1e-4);
        assert!((area(&parts.covered) - 4.0).abs() < 1e-9);
        assert!((area(&parts.open) - 12.0).abs() < 1e-9);
    }

    #[test]
    fn what_many_tiles_cover_leaves_no_slivers() {
        let parts = cut_out(square(DVec2::ZERO, 4.0), &tiles(40, 4.0 - 1e-6), 1e-4);
        assert!(parts.open.is_empty());
        let none = cut_out(square(DVec2::ZERO, 4.0), &[], 1e-4);
        assert_eq!(none.open, [square(DVec2::ZERO, 4.0)]);
    }
}
