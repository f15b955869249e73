//! The form factor of a pair of triangles: exact towards one, quadrature over the other, visibility by rays.

use glam::{Vec2, Vec3};

use crate::{
    geometry::{Random, RayTree, centroid, low_discrepancy_2d, point_irradiance, triangle_point},
    scene::TriangleId,
};

/// Width of a quadrature cell relative to the gap of the pair. Larger, and pairs side by side lose digits;
/// smaller, and the time goes to pairs that are smooth anyway. At 0.15 the midpoint rule errs by about 0.5 % at worst.
const CELL_PER_GAP: f32 = 0.15;

/// Times that a receiver is halved at most; touching triangles get `4^5` points.
const MAX_LEVEL: u32 = 5;

/// One side of a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Side {
    /// The triangle.
    pub(super) triangle: TriangleId,
    /// Corners, counter-clockwise seen from this side.
    pub(super) corners: [Vec3; 3],
    /// Unit normal of this side.
    pub(super) normal: Vec3,
    /// Area in square frame units.
    pub(super) area: f32,
}

impl Side {
    /// Radius of a sphere about the centroid that holds the triangle.
    fn radius(&self) -> f32 {
        let centre = centroid(self.corners);
        self.corners
            .iter()
            .map(|corner| corner.distance(centre))
            .fold(0.0, f32::max)
    }

    /// Whether any corner of the other side lies before this one.
    fn faces(&self, other: &Self) -> bool {
        other
            .corners
            .iter()
            .any(|&corner| (corner - self.corners[0]).dot(self.normal) > 0.0)
    }

    fn point(&self, barycentric: Vec3) -> Vec3 {
        let [a, b, c] = self.corners;
        a * barycentric.x + b * barycentric.y + c * barycentric.z
    }
}

/// Form factor times area, `∫∫ cos cos V / (π r²)`, the same in both directions.
/// `rays` is the number of rays for its visibility; none are shot where the pair does not see each other.
pub(super) fn exchange_area(
    a: &Side,
    b: &Side,
    tree: &RayTree,
    rays: u32,
    random: &mut Random,
) -> f32 {
    if !a.faces(b) || !b.faces(a) {
        return 0.0;
    }
    let (receiver, source) = if a.area <= b.area { (a, b) } else { (b, a) };
    let free = receiver.area * unoccluded(receiver, source);
    if free > 0.0 {
        free * visibility(receiver, source, tree, rays, random)
    } else {
        0.0
    }
}

/// Mean over the receiver of the exact point-to-triangle factor.
fn unoccluded(receiver: &Side, source: &Side) -> f32 {
    let radius = receiver.radius();
    let distance = centroid(receiver.corners).distance(centroid(source.corners));
    let gap = (distance - radius - source.radius()).max(1e-6 * radius);
    let halvings = (radius / (CELL_PER_GAP * gap)).log2().ceil();
    let level = (halvings.max(0.0) as u32).min(MAX_LEVEL);
    let sum: f64 = cell_centres(1 << level)
        .map(|place| {
            let point = receiver.point(place);
            f64::from(point_irradiance(point, receiver.normal, source.corners))
        })
        .sum();
    (sum / f64::from(1 << (2 * level))) as f32
}

/// Centres, in barycentric coordinates, of the `n²` congruent triangles that a triangle divides into.
fn cell_centres(n: u32) -> impl Iterator<Item = Vec3> {
    (0..n).flat_map(move |row| {
        let upright = (0..n - row).map(move |column| (row, column, 1.0 / 3.0));
        let inverted = (0..n - row - 1).map(move |column| (row, column, 2.0 / 3.0));
        upright.chain(inverted).map(move |(row, column, offset)| {
            let u = (column as f32 + offset) / n as f32;
            let v = (row as f32 + offset) / n as f32;
            Vec3::new(u, v, 1.0 - u - v)
        })
    })
}

/// Share of the transfer that is not blocked: rays between random points, weighted by what they carry.
fn visibility(
    receiver: &Side,
    source: &Side,
    tree: &RayTree,
    rays: u32,
    random: &mut Random,
) -> f32 {
    let shift = random.uniform_2d();
    let ends = [Some(receiver.triangle), Some(source.triangle)];
    let (mut all, mut seen) = (0.0, 0.0);
    for ray in 0..rays {
        let from = receiver.point(triangle_point(low_discrepancy_2d(ray, shift)));
        let to = source.point(triangle_point(stratified(ray, rays, random)));
        let separation = to - from;
        let cosines =
            receiver.normal.dot(separation).max(0.0) * source.normal.dot(-separation).max(0.0);
        let weight = cosines / separation.length_squared().powi(2).max(f32::MIN_POSITIVE);
        if weight > 0.0 && weight.is_finite() {
            all += weight;
            seen += weight * tree.transmittance(from, to, ends).element_sum() / 3.0;
        }
    }
    if all > 0.0 { seen / all } else { 1.0 }
}

/// A point of the unit square in the strip that belongs to `index` of `count`.
fn stratified(index: u32, count: u32, random: &mut Random) -> Vec2 {
    let jittered = random.uniform_2d();
    Vec2::new((index as f32 + jittered.x) / count as f32, jittered.y)
        .min(Vec2::splat(1.0 - f32::EPSILON))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_cover_the_triangle_evenly() {
        for n in [1, 2, 8] {
            let cells: Vec<Vec3> = cell_centres(n).collect();
            assert_eq!(cells.len() as u32, n * n);
            let mean = cells.iter().sum::<Vec3>() / cells.len() as f32;
            assert!(
                (mean - Vec3::splat(1.0 / 3.0)).length() < 1e-6,
                "{n}: {mean}"
            );
            assert!(cells.iter().all(|cell| cell.min_element() > 0.0));
        }
    }
}
