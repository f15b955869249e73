//! Closed forms: view factors of plates and discs, the sphere and the furnace, in double precision.
//!
//! The view factors are those of Howell, "A Catalog of Radiation Heat Transfer Configuration Factors"; the polygon
//! is Lambert's formula. All lengths share one unit and are above 0.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

/// View factor between two equal, directly opposed rectangles of sides `a` and `b` at distance `c` (Howell C-11).
pub fn parallel_rectangles(a: f64, b: f64, c: f64) -> f64 {
    let (x, y) = (a / c, b / c);
    let (x1, y1) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    let logarithm = (x1 * y1 / (1.0 + x * x + y * y).sqrt()).ln();
    2.0 / (PI * x * y)
        * (logarithm + x * y1 * (x / y1).atan() + y * x1 * (y / x1).atan()
            - x * x.atan()
            - y * y.atan())
}

/// View factor from a rectangle `edge` × `width` to a perpendicular one `edge` × `height` that shares the edge
/// (Howell C-14).
pub fn perpendicular_rectangles(edge: f64, width: f64, height: f64) -> f64 {
    let (h, w) = (height / edge, width / edge);
    let (h2, w2) = (h * h, w * w);
    let sum = h2 + w2;
    let logarithm = ((1.0 + w2) * (1.0 + h2) / (1.0 + sum)).ln()
        + w2 * (w2 * (1.0 + sum) / ((1.0 + w2) * sum)).ln()
        + h2 * (h2 * (1.0 + sum) / ((1.0 + h2) * sum)).ln();
    let angles =
        w * (1.0 / w).atan() + h * (1.0 / h).atan() - sum.sqrt() * (1.0 / sum.sqrt()).atan();
    (angles + 0.25 * logarithm) / (PI * w)
}

/// View factor from a point to a parallel rectangle `a` × `b` at distance `c`, one of whose corners lies straight
/// above the point (Howell B-3).
pub fn point_to_parallel_rectangle(a: f64, b: f64, c: f64) -> f64 {
    let (x, y) = (a / c, b / c);
    let (x1, y1) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    (x / x1 * (y / x1).atan() + y / y1 * (x / y1).atan()) / TAU
}

/// View factor from a point to a perpendicular rectangle at distance `c`, of height `a` above the point's plane and
/// width `b`, one of whose lower corners is the foot of the perpendicular from the point (Howell B-4).
pub fn point_to_perpendicular_rectangle(a: f64, b: f64, c: f64) -> f64 {
    let slant = (a * a + c * c).sqrt();
    ((b / c).atan() - c / slant * (b / slant).atan()) / TAU
}

/// View factor from a disc of radius `a` to a parallel one of radius `b` about the same axis at distance `c`
/// (Howell C-41).
pub fn coaxial_discs(a: f64, b: f64, c: f64) -> f64 {
    let sum = a * a + b * b + c * c;
    let root = (sum * sum - 4.0 * a * a * b * b).sqrt();
    (sum - root) / (2.0 * a * a)
}

/// View factor from a point to a parallel disc of radius `radius` at distance `c`, whose axis passes the point at
/// distance `offset`, at least 0 (Howell B-12).
pub fn point_to_parallel_disc(offset: f64, radius: f64, c: f64) -> f64 {
    let (offset2, radius2, c2) = (offset * offset, radius * radius, c * c);
    let sum = offset2 + radius2 + c2;
    let root = (sum * sum - 4.0 * offset2 * radius2).sqrt();
    0.5 * (1.0 - (offset2 + c2 - radius2) / root)
}

/// View factor from a point with unit `normal` to a polygon that lies wholly above its horizon (Lambert 1760).
/// Positive where the corners run counter-clockwise as seen from the point; the point may not lie on an edge.
pub fn point_to_polygon(point: DVec3, normal: DVec3, corners: &[DVec3]) -> f64 {
    let mut sum = 0.0;
    for (i, &corner) in corners.iter().enumerate() {
        let from = (corner - point).normalize_or_zero();
        let to = (corners[(i + 1) % corners.len()] - point).normalize_or_zero();
        let angle = from.cross(to).length().atan2(from.dot(to));
        sum += angle * to.cross(from).normalize_or_zero().dot(normal);
    }
    sum / TAU
}

/// Irradiance everywhere in a sphere, whatever the pattern on its wall: emitted power per area, and mean reflectance
/// below 1. Every point of a sphere sees all of its parts in proportion to their areas.
pub fn sphere_irradiance(emitted: f64, mean_reflectance: f64) -> f64 {
    emitted / (1.0 - mean_reflectance)
}

/// Radiosity everywhere in a closed scene whose surfaces all have this emitted radiosity and reflectance below 1.
pub fn furnace_radiosity(emitted: f64, reflectance: f64) -> f64 {
    emitted / (1.0 - reflectance)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unit_squares_have_the_tabulated_factors() {
        assert!((parallel_rectangles(1.0, 1.0, 1.0) - 0.199_825).abs() < 1e-6);
        assert!((perpendicular_rectangles(1.0, 1.0, 1.0) - 0.200_044).abs() < 1e-6);
    }

    #[test]
    fn factors_of_a_closed_box_sum_to_one() {
        // From the floor a × b of a box of height c: the ceiling and two pairs of walls.
        let (a, b, c) = (2.0, 3.0, 0.7);
        let sum = parallel_rectangles(a, b, c)
            + 2.0 * perpendicular_rectangles(a, b, c)
            + 2.0 * perpendicular_rectangles(b, a, c);
        assert!((sum - 1.0).abs() < 1e-12, "{sum}");
    }

    #[test]
    fn point_factors_of_an_open_corner_sum_to_half() {
        // A quarter of the hemisphere above the point, closed by two walls and a ceiling piece.
        let (a, b, c) = (1.3, 0.4, 0.8);
        let sum = point_to_parallel_rectangle(a, b, c)
            + point_to_perpendicular_rectangle(c, b, a)
            + point_to_perpendicular_rectangle(c, a, b);
        assert!((sum - 0.25).abs() < 1e-12, "{sum}");
    }

    #[test]
    fn factors_of_discs_agree_with_each_other_and_with_a_polygon() {
        let (a, b, c) = (0.7, 0.5, 1.2);
        // Reciprocity, and the mean of the factors of points over the disc by the midpoint rule.
        let factor = coaxial_discs(a, b, c);
        assert!((a * a * factor - b * b * coaxial_discs(b, a, c)).abs() < 1e-12);
        let rings = 1000;
        let width = a / f64::from(rings);
        let sum: f64 = (0..rings)
            .map(|ring| (f64::from(ring) + 0.5) * width)
            .map(|radius| 2.0 * radius * width * point_to_parallel_disc(radius, b, c))
            .sum();
        assert!((sum / (a * a) - factor).abs() < 1e-6, "{sum} {factor}");
        // A circle of 2,000 edges that runs clockwise from above.
        let corner = |i: i32| {
            let (sin, cos) = (-TAU * f64::from(i) / 2000.0).sin_cos();
            DVec3::new(0.3 + b * cos, b * sin, c)
        };
        let corners: Vec<DVec3> = (0..2000).map(corner).collect();
        let polygon = point_to_polygon(DVec3::ZERO, DVec3::Z, &corners);
        let closed = point_to_parallel_disc(0.3, b, c);
        assert!((polygon - closed).abs() < 1e-5, "{polygon} {closed}");
    }

    #[test]
    fn polygon_agrees_with_the_parallel_rectangle() {
        let corners = [
            DVec3::new(0.0, 0.0, 0.8),
            DVec3::new(0.0, 0.4, 0.8),
            DVec3::new(1.3, 0.4, 0.8),
            DVec3::new(1.3, 0.0, 0.8),
        ];
        let polygon = point_to_polygon(DVec3::ZERO, DVec3::Z, &corners);
        let closed = point_to_parallel_rectangle(1.3, 0.4, 0.8);
        assert!((polygon - closed).abs() < 1e-12, "{polygon} {closed}");
    }
}
