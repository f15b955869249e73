//! Which texels a chart touches, and where on its surface they lie.

use std::ops::RangeInclusive;

use glam::{Vec2, Vec3};

use super::{layout::Layout, sides::Side};
use crate::{geometry::RAY_OFFSET, picture::TexelPlace, scene::Scene};

/// Distance from a chart, in texels, within which a texel counts where the chart is looked up. A texel further away has no
/// part in a bilinear lookup, or next to none near corners.
const TOUCHED: f32 = 0.999;

/// How far within the edges of a triangle light is evaluated, in texels: exactly on one, a wall that stands there would be
/// seen edge-on. Larger, and both sides of a seam have light of other places.
const INSET: f32 = 0.05;

/// Largest part of the way to the middle of a triangle for that distance.
const MOST_INSET: f32 = 0.2;

/// No side.
const NONE: u32 = u32::MAX;

/// The nearest side of every texel that a chart touches.
pub(super) struct Texels<'a> {
    scene: &'a Scene,
    sides: &'a [Side],
    layout: &'a Layout,
    /// Row by row.
    nearest: Vec<u32>,
}

impl<'a> Texels<'a> {
    /// Find them.
    pub(super) fn new(scene: &'a Scene, sides: &'a [Side], layout: &'a Layout) -> Self {
        let side = layout.side as usize;
        let mut nearest = vec![NONE; side * side];
        let mut distances = vec![f32::INFINITY; side * side];
        for (number, corners) in layout.corners.iter().enumerate() {
            for row in rows(corners, layout.side) {
                for column in columns(corners, row, layout.side) {
                    let texel = row as usize * side + column as usize;
                    let centre = Vec2::new(column as f32, row as f32) + 0.5;
                    let distance = centre.distance(nearest_in(centre, corners));
                    if distance < distances[texel] && distance < TOUCHED {
                        (distances[texel], nearest[texel]) = (distance, number as u32);
                    }
                }
            }
        }
        Self {
            scene,
            sides,
            layout,
            nearest,
        }
    }

    /// The side that a texel shows, if a chart touches it.
    pub(super) fn side(&self, texel: usize) -> Option<u32> {
        Some(self.nearest[texel]).filter(|side| *side != NONE)
    }

    /// What lies nearest to a place of the picture on a side, as parts of the corners of its triangle.
    pub(super) fn barycentric(&self, side: u32, at: Vec2) -> Vec3 {
        let parts = parts_in(at, &self.layout.corners[side as usize]);
        let order = self.sides[side as usize].order();
        let mut of_triangle = Vec3::ZERO;
        for (corner, part) in order.into_iter().zip(parts.to_array()) {
            of_triangle[corner] = part;
        }
        of_triangle
    }

    /// The place where a texel is lit: the nearest one to its middle, a little within its triangle.
    pub(super) fn place(&self, [column, row]: [u32; 2]) -> Option<TexelPlace> {
        let side = self.side((row * self.layout.side + column) as usize)?;
        let Side { triangle, is_back } = self.sides[side as usize];
        let middle = Vec2::new(column as f32, row as f32) + 0.5;
        let parts = self.barycentric(side, middle);
        let corners @ [a, b, c] = self.scene.corners(triangle);
        let position = a * parts.x + b * parts.y + c * parts.z;
        let centroid = (a + b + c) / 3.0;
        let inset = (INSET / self.layout.density).max(2.0 * RAY_OFFSET);
        let part = (inset / centroid_depth(corners)).min(MOST_INSET);
        let is_near_edge = parts.min_element() * 3.0 < part;
        Some(TexelPlace {
            triangle,
            is_back,
            position: match is_near_edge {
                true => position.lerp(centroid, part),
                false => position,
            },
            chart: self.layout.chart_of[side as usize],
        })
    }
}

/// How far the centroid of a triangle lies from its longest edge, the nearest one.
fn centroid_depth([a, b, c]: [Vec3; 3]) -> f32 {
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let depth = (b - a).cross(c - a).length() / (3.0 * longest);
    depth.max(f32::MIN_POSITIVE)
}

/// The rows that a triangle touches.
fn rows([a, b, c]: &[Vec2; 3], side: u32) -> RangeInclusive<u32> {
    within(a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y), side)
}

/// The columns that it touches in a row: those about the part of it that is near the row.
fn columns(corners: &[Vec2; 3], row: u32, side: u32) -> RangeInclusive<u32> {
    let middle = row as f32 + 0.5;
    let [top, bottom] = [middle - 1.0, middle + 1.0];
    let [a, b, c] = *corners;
    let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
    for (from, to) in [(a, b), (b, c), (c, a)] {
        let [from_y, to_y] = [from.y, to.y].map(|y| y.clamp(top, bottom));
        let is_apart = from.y.max(to.y) < top || from.y.min(to.y) > bottom;
        if is_apart {
            continue;
        }
        let at = |y: f32| {
            let part = (y - from.y) / (to.y - from.y);
            if part.is_finite() {
                from.x + (to.x - from.x) * part.clamp(0.0, 1.0)
            } else {
                from.x
            }
        };
        let ends = match from.y == to.y {
            true => [from.x, to.x],
            false => [at(from_y), at(to_y)],
        };
        (low, high) = (
            low.min(ends[0]).min(ends[1]),
            high.max(ends[0]).max(ends[1]),
        );
    }
    within(low, high, side)
}

/// The texels whose middles lie less than one from a range; none where it is empty.
fn within(low: f32, high: f32, side: u32) -> RangeInclusive<u32> {
    let last = side as f32 - 1.0;
    let (first, end) = ((low - 1.5).ceil(), (high + 0.5).floor());
    if !(first <= end && end >= 0.0 && first <= last) {
        return RangeInclusive::new(1, 0);
    }
    first.max(0.0) as u32..=end.min(last) as u32
}

/// The point of a triangle that is nearest to a place of its plane.
fn nearest_in(place: Vec2, corners @ [a, b, c]: &[Vec2; 3]) -> Vec2 {
    let parts = parts_in(place, corners);
    a * parts.x + b * parts.y + c * parts.z
}

/// The same as parts of the corners. Of a triangle without area, a point of its line; where all corners are one, the middle.
fn parts_in(place: Vec2, &[a, b, c]: &[Vec2; 3]) -> Vec3 {
    let whole = (b - a).perp_dot(c - a);
    let parts =
        [(b, c), (c, a), (a, b)].map(|(from, to)| (to - from).perp_dot(place - from) / whole);
    // In a needle, rounding decides, and the parts add to anything.
    let is_inside = parts.iter().all(|part| *part >= 0.0);
    if is_inside && (parts.iter().sum::<f32>() - 1.0).abs() < 1e-3 {
        return Vec3::from_array(parts);
    }
    if a == b && b == c {
        return Vec3::splat(1.0 / 3.0);
    }
    let on_edges = [(a, b, [0, 1]), (b, c, [1, 2]), (c, a, [2, 0])].map(|(from, to, corners)| {
        let edge = to - from;
        let part = (place - from).dot(edge) / edge.length_squared();
        let part = if part > 0.0 { part.min(1.0) } else { 0.0 };
        let mut parts = Vec3::ZERO;
        parts[corners[0]] = 1.0 - part;
        parts[corners[1]] = part;
        ((from + edge * part).distance_squared(place), parts)
    });
    let nearest = on_edges.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
    nearest.map_or(Vec3::X, |(_, parts)| parts)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Random;

    #[test]
    fn the_columns_of_a_row_are_those_that_are_near() {
        let mut random = Random::new(3, 0);
        for _ in 0..200 {
            let corners: [Vec2; 3] = std::array::from_fn(|_| random.uniform_2d() * 20.0);
            for row in 0..20 {
                let found = columns(&corners, row, 20);
                for column in 0..20 {
                    let centre = Vec2::new(column as f32, row as f32) + 0.5;
                    let distance = centre.distance(nearest_in(centre, &corners));
                    let is_found = found.contains(&column) && rows(&corners, 20).contains(&row);
                    assert!(is_found || distance >= 1.0, "{corners:?} {centre}");
                }
            }
        }
    }

    #[test]
    fn a_place_outside_goes_to_the_nearest_edge_and_one_without_area_to_its_line() {
        let corners = [Vec2::ZERO, Vec2::X * 4.0, Vec2::Y * 4.0];
        assert_eq!(
            nearest_in(Vec2::new(1.0, 1.0), &corners),
            Vec2::new(1.0, 1.0)
        );
        assert_eq!(
            nearest_in(Vec2::new(2.0, -3.0), &corners),
            Vec2::new(2.0, 0.0)
        );
        assert_eq!(
            nearest_in(Vec2::new(4.0, 4.0), &corners),
            Vec2::new(2.0, 2.0)
        );
        let line = [Vec2::ZERO, Vec2::X, Vec2::X * 3.0];
        assert_eq!(nearest_in(Vec2::new(2.0, 1.0), &line), Vec2::X * 2.0);
        let middle = parts_in(Vec2::new(7.0, 1.0), &[Vec2::ONE; 3]);
        assert_eq!(middle, Vec3::splat(1.0 / 3.0));
    }
}
