//! Irradiance of a uniformly bright polygon at a point, exactly.
//!
//! For radiosity B the irradiance vector (Lambert 1760; Arvo, "The Irradiance Jacobian", 1994, eq. 5) is
//! `(B / 2π) Σ_k θ_k Γ_k`, with θ_k the angle that edge k subtends and Γ_k the unit normal of its fan triangle.
//! It is finite however close the point is, and needs no samples.

use std::f32::consts::{PI, TAU};

use glam::Vec3;

/// Longest polygon that clipping a triangle by a plane can leave.
const CLIPPED_CORNERS: usize = 4;

/// Beyond this many of its longest edges a triangle counts as a point: nearer, that errs by more than 1e-4; further, the
/// angles of the edges cancel in single precision, until nothing but rounding is left.
const FAR: f32 = 64.0;

/// Irradiance vector at `point` of a triangle of radiosity 1 that faces it, per unit radiosity.
/// Its dot product with a unit normal whose horizon the triangle does not cross is the irradiance there.
/// Zero where the point lies behind the triangle's front or in its plane.
pub fn irradiance_vector(point: Vec3, corners: [Vec3; 3]) -> Vec3 {
    if !sees_front(point, corners) {
        Vec3::ZERO
    } else {
        far_vector(point, corners)
            .unwrap_or_else(|| edge_sum(&corners.map(|corner| corner - point)))
    }
}

/// The irradiance vector of a triangle that is far enough to count as a point.
fn far_vector(point: Vec3, [a, b, c]: [Vec3; 3]) -> Option<Vec3> {
    let (u, v) = (b - a, c - a);
    let size = u
        .length_squared()
        .max(v.length_squared())
        .max((v - u).length_squared());
    let separation = (a - point) + (u + v) * (1.0 / 3.0);
    let squared = separation.length_squared();
    (squared > FAR * FAR * size).then(|| {
        let projected = (-0.5 * u.cross(v).dot(separation)).max(0.0);
        separation * (projected / (PI * squared * squared))
    })
}

/// Irradiance at `point` with unit `normal` of a triangle of radiosity 1, clipped at the horizon; 0…1.
/// It is the form factor from the point to the triangle's front.
pub fn point_irradiance(point: Vec3, normal: Vec3, corners: [Vec3; 3]) -> f32 {
    if !sees_front(point, corners) {
        return 0.0;
    }
    if let Some(vector) = far_vector(point, corners) {
        return vector.dot(normal).clamp(0.0, 1.0);
    }
    let local = corners.map(|corner| corner - point);
    let heights = local.map(|corner| corner.dot(normal));
    if heights.iter().all(|&height| height >= 0.0) {
        return edge_sum(&local).dot(normal).clamp(0.0, 1.0);
    }
    let mut clipped = [Vec3::ZERO; CLIPPED_CORNERS];
    let mut count = 0;
    for i in 0..3 {
        let j = (i + 1) % 3;
        if heights[i] >= 0.0 {
            clipped[count] = local[i];
            count += 1;
        }
        if (heights[i] >= 0.0) != (heights[j] >= 0.0) {
            clipped[count] = local[i].lerp(local[j], heights[i] / (heights[i] - heights[j]));
            count += 1;
        }
    }
    if count < 3 {
        0.0
    } else {
        edge_sum(&clipped[..count]).dot(normal).clamp(0.0, 1.0)
    }
}

/// Irradiance at `point` with unit `normal` of a flat surface of radiosity 1, given by the edges of its outline in any
/// order, each wound as seen from its front; 0…1. It may have holes and several parts. The point must lie before its
/// front, and all of it above the horizon.
pub fn outline_irradiance(point: Vec3, normal: Vec3, edges: &[[Vec3; 2]]) -> f32 {
    let terms = edges
        .iter()
        .map(|&[from, to]| edge_term(from - point, to - point));
    (terms.sum::<Vec3>() / TAU).dot(normal).clamp(0.0, 1.0)
}

/// Whether the point lies before the triangle's front.
fn sees_front(point: Vec3, [a, b, c]: [Vec3; 3]) -> bool {
    (b - a).cross(c - a).dot(point - a) > 0.0
}

/// `Σ_k θ_k Γ_k / 2π` over the edges of a polygon given relative to the point, wound as seen from its front.
fn edge_sum(corners: &[Vec3]) -> Vec3 {
    let mut sum = Vec3::ZERO;
    let mut previous = corners[corners.len() - 1];
    for &corner in corners {
        sum += edge_term(previous, corner);
        previous = corner;
    }
    sum / TAU
}

/// `θ Γ` of the edge between two corners given relative to the point.
fn edge_term(from: Vec3, to: Vec3) -> Vec3 {
    // The front faces the point, so its corners run clockwise around the outgoing vector: from × to would point away,
    // to × from points towards the polygon.
    let cross = to.cross(from);
    let sine = cross.length();
    if sine > 0.0 {
        cross * (sine.atan2(to.dot(from)) / sine)
    } else {
        Vec3::ZERO
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Random, cosine_direction};

    /// A triangle above the origin whose front looks down.
    const CEILING: [Vec3; 3] = [
        Vec3::new(-1.0, -0.5, 1.0),
        Vec3::new(0.5, 2.0, 1.0),
        Vec3::new(2.0, -1.0, 1.0),
    ];

    /// Whether a ray from the origin passes through a triangle, by the signs of three volumes.
    fn passes(direction: Vec3, [a, b, c]: [Vec3; 3]) -> bool {
        let signs = [(a, b), (b, c), (c, a)].map(|(p, q)| p.cross(q).dot(direction) > 0.0);
        signs.iter().all(|&sign| sign == signs[0])
            && (b - a).cross(c - a).dot(direction) * (b - a).cross(c - a).dot(a) > 0.0
    }

    /// Share of cosine-weighted rays from the origin that meet the triangle.
    fn sampled(normal: Vec3, corners: [Vec3; 3]) -> f32 {
        const COUNT: u32 = 40_000;
        let mut random = Random::new(5, 0);
        let met = (0..COUNT)
            .filter(|_| passes(cosine_direction(normal, random.uniform_2d()), corners))
            .count();
        met as f32 / COUNT as f32
    }

    #[test]
    fn far_and_near_agree_and_far_light_is_not_lost_in_rounding() {
        for distance in [50.0, 63.0, 70.0, 200.0, 1e4, 1e6] {
            let corners = [Vec3::ZERO, Vec3::Y, Vec3::X].map(|corner| corner + Vec3::Z * distance);
            // Half a unit of area, seen head-on.
            let expected = 0.5 / (PI * distance * distance);
            for found in [
                point_irradiance(Vec3::ZERO, Vec3::Z, corners),
                irradiance_vector(Vec3::ZERO, corners).z,
            ] {
                assert!((found / expected - 1.0).abs() < 2e-3, "{distance}: {found}");
            }
        }
    }

    #[test]
    fn agrees_with_sampling_above_and_across_the_horizon() {
        for normal in [
            Vec3::Z,
            Vec3::new(0.6, 0.0, 0.8),
            Vec3::X,
            Vec3::new(-0.8, 0.6, 0.0),
            Vec3::new(0.0, 0.8, -0.6),
        ] {
            let exact = point_irradiance(Vec3::ZERO, normal, CEILING);
            let found = sampled(normal, CEILING);
            // Four standard deviations of a share p of 40,000, at most 4·√(p/40,000).
            let tolerance = 4.0 * (exact.max(1e-3) / 40_000.0).sqrt();
            assert!(
                (exact - found).abs() < tolerance,
                "{normal}: {exact} {found}"
            );
        }
    }

    #[test]
    fn agrees_with_the_closed_form_of_a_rectangle() {
        // Howell B-3 with a = b = c: 2 · (1/√2) atan(1/√2) / 2π for a square whose corner is straight above.
        let expected = (0.5_f32.sqrt() * 0.5_f32.sqrt().atan()) / PI;
        let corners = [
            Vec3::new(0.0, 0.0, 1.0),
            Vec3::new(0.0, 1.0, 1.0),
            Vec3::new(1.0, 1.0, 1.0),
            Vec3::new(1.0, 0.0, 1.0),
        ];
        let [a, b, c, d] = corners;
        let sum = point_irradiance(Vec3::ZERO, Vec3::Z, [a, b, c])
            + point_irradiance(Vec3::ZERO, Vec3::Z, [a, c, d]);
        assert!((sum - expected).abs() < 1e-6, "{sum} {expected}");
        let vector =
            irradiance_vector(Vec3::ZERO, [a, b, c]) + irradiance_vector(Vec3::ZERO, [a, c, d]);
        assert!((vector.z - expected).abs() < 1e-6);
    }

    #[test]
    fn the_back_and_what_lies_below_the_horizon_give_nothing() {
        let [a, b, c] = CEILING;
        assert_eq!(point_irradiance(Vec3::ZERO, Vec3::Z, [a, c, b]), 0.0);
        assert_eq!(point_irradiance(Vec3::ZERO, -Vec3::Z, CEILING), 0.0);
        assert_eq!(irradiance_vector(Vec3::ZERO, [a, c, b]), Vec3::ZERO);
    }

    #[test]
    fn points_on_the_plane_edges_and_corners_stay_finite() {
        let [a, b, c] = CEILING;
        let flat = [a, b, a.lerp(b, 0.5)];
        for point in [a, b, c, a.lerp(b, 0.3), (a + b + c) / 3.0, a * 2.0 - b] {
            for shift in [Vec3::ZERO, Vec3::Z * 1e-7, Vec3::Z * -1e-7, Vec3::Z * 1e-20] {
                for normal in [Vec3::Z, -Vec3::Z, Vec3::X] {
                    for corners in [CEILING, flat] {
                        let value = point_irradiance(point - shift, normal, corners);
                        assert!((0.0..=1.0).contains(&value), "{point} {normal}: {value}");
                        assert!(irradiance_vector(point - shift, corners).is_finite());
                    }
                }
            }
        }
    }

    #[test]
    fn a_touching_point_sees_half_or_all() {
        let below = (CEILING[0] + CEILING[1] + CEILING[2]) / 3.0 - Vec3::Z * 1e-4;
        let facing = point_irradiance(below, Vec3::Z, CEILING);
        assert!((facing - 1.0).abs() < 1e-3, "{facing}");
        let across = point_irradiance(below, Vec3::X, CEILING);
        assert!((across - 0.5).abs() < 1e-3, "{across}");
    }
}
