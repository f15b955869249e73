//! Irradiance of a uniformly bright polygon at a point, exactly.
//!
//! For radiosity B the irradiance vector (Lambert 1760; Arvo, "The Irradiance Jacobian", 1994, eq. 5) is
//! `(B / 2π) Σ_k θ_k Γ_k`, with θ_k the angle that edge k subtends and Γ_k the unit normal of its fan triangle.
//! It is finite however close the point is, and needs no samples. Four edges, or one edge from four points, are computed at
//! once.

use std::f32::consts::{PI, TAU};

use glam::{BVec4A, Vec3, Vec4};

use super::Vectors4;

/// At a distance of more than this many of its longest edges a triangle counts as a point: nearer, that errs by more than
/// 1e-4; further, the angles of the edges cancel in single precision, until nothing but rounding is left.
const FAR: f32 = 64.0;

/// `acos(x)/√(1 − x²)` for x from 0 to 1, as a polynomial in 1 − x, least power first. Its relative error is at most
/// 7e-8, that of single precision, by Remez's exchange; with a coefficient less it is 4e-7, and one more gains nothing.
const ARC_OVER_SINE: [f32; 9] = [
    1.000_000_1,
    0.333_322_17,
    0.133_621_92,
    0.054_302_435,
    0.039_184_545,
    -0.025_188_117,
    0.060_640_704,
    -0.042_566_516,
    0.017_478_997,
];

/// A triangle as a point sees it.
struct Sight {
    /// Corners relative to the point.
    corners: [Vec3; 3],
    /// Twice the area times the normal of the back, which looks away from the point.
    doubled_area: Vec3,
    /// Centroid relative to the point.
    separation: Vec3,
    /// Squared length of the longest edge.
    size: f32,
}

impl Sight {
    /// `None` where the point does not lie before the triangle's front.
    #[inline]
    fn new(point: Vec3, [a, b, c]: [Vec3; 3]) -> Option<Self> {
        let (u, v) = (b - a, c - a);
        let doubled_area = v.cross(u);
        let corners = [a - point, b - point, c - point];
        (doubled_area.dot(corners[0]) > 0.0).then(|| Self {
            corners,
            doubled_area,
            separation: corners[0] + (u + v) * (1.0 / 3.0),
            size: longest(u, v),
        })
    }

    /// The irradiance vector of a triangle that is far enough to count as a point.
    #[inline]
    fn far_vector(&self) -> Option<Vec3> {
        let squared = self.separation.length_squared();
        (squared > FAR * FAR * self.size).then(|| {
            let projected = 0.5 * self.doubled_area.dot(self.separation).max(0.0);
            self.separation * (projected / (PI * squared * squared))
        })
    }
}

/// Squared length of the longest edge of a triangle with these two.
fn longest(u: Vec3, v: Vec3) -> f32 {
    let third = (v - u).length_squared();
    u.length_squared().max(v.length_squared()).max(third)
}

/// Irradiance vector at `point` of a triangle of radiosity 1 that faces it, per unit radiosity.
/// Its dot product with a unit normal whose horizon the triangle does not cross is the irradiance there.
/// Zero where the point lies behind the triangle's front or in its plane.
pub fn irradiance_vector(point: Vec3, corners: [Vec3; 3]) -> Vec3 {
    let Some(sight) = Sight::new(point, corners) else {
        return Vec3::ZERO;
    };
    sight.far_vector().unwrap_or_else(|| {
        let [a, b, c] = sight.corners;
        let (crosses, weights) = outline_terms(&Vectors4::new([a, b, c, c]));
        crosses.weighted_sum(weights) / TAU
    })
}

/// Irradiance at `point` with unit `normal` of a triangle of radiosity 1, clipped at the horizon; 0…1.
/// It is the form factor from the point to the triangle's front.
pub fn point_irradiance(point: Vec3, normal: Vec3, corners: [Vec3; 3]) -> f32 {
    let Some(sight) = Sight::new(point, corners) else {
        return 0.0;
    };
    let heights = sight.corners.map(|corner| corner.dot(normal));
    let Some(outline) = above_horizon(sight.corners, heights) else {
        return 0.0;
    };
    if let Some(vector) = sight.far_vector() {
        return vector.dot(normal).clamp(0.0, 1.0);
    }
    let (crosses, weights) = outline_terms(&Vectors4::new(outline));
    let projected = crosses.dot(&Vectors4::splat(normal)) * weights;
    (projected.element_sum() / TAU).clamp(0.0, 1.0)
}

/// Irradiance at each of four points with its unit normal of one triangle of radiosity 1: see [`point_irradiance`].
pub fn point_irradiances(points: &Vectors4, normals: &Vectors4, [a, b, c]: [Vec3; 3]) -> Vec4 {
    let (u, v) = (b - a, c - a);
    let corners = [a, b, c].map(|corner| Vectors4::splat(corner) - *points);
    let heights = corners.map(|corner| corner.dot(normals));
    let [first, second, third] = heights;
    let doubled_area = Vectors4::splat(v.cross(u));
    let is_before = doubled_area.dot(&corners[0]).cmpgt(Vec4::ZERO);
    let is_seen = is_before & first.max(second).max(third).cmpgt(Vec4::ZERO);
    if !is_seen.any() {
        return Vec4::ZERO;
    }
    let lowest = first.min(second).min(third);
    let mut sum = if lowest.cmplt(Vec4::ZERO).any() {
        clipped_sum(&corners, heights, normals)
    } else {
        let [a, b, c] = &corners;
        edge_term(a, b, &Vectors4::splat(u), normals)
            + edge_term(b, c, &Vectors4::splat(v - u), normals)
            + edge_term(c, a, &Vectors4::splat(-v), normals)
    } / TAU;
    let separation = Vectors4::splat((a + b + c) / 3.0) - *points;
    let squared = separation.dot(&separation);
    let is_far = squared.cmpgt(Vec4::splat(FAR * FAR * longest(u, v)));
    if is_far.any() {
        let projected = doubled_area.dot(&separation) * separation.dot(normals) * 0.5;
        sum = Vec4::select(is_far, projected / (squared * squared * PI), sum);
    }
    Vec4::select(is_seen, sum, Vec4::ZERO).clamp(Vec4::ZERO, Vec4::ONE)
}

/// Irradiance at `point` with unit `normal` of a flat surface of radiosity 1, given by the edges of its outline in any
/// order, each wound as seen from its front, and clipped at the horizon; 0…1. It may have holes and several parts. The
/// point must lie before its front.
pub fn outline_irradiance(point: Vec3, normal: Vec3, edges: &[[Vec3; 2]]) -> f32 {
    let normals = Vectors4::splat(normal);
    let mut sum = Vec4::ZERO;
    let mut horizon = Horizon::new(normal);
    for four in edges.chunks(4) {
        let ends = |end: usize| {
            let corner = |lane: usize| four.get(lane).map_or(Vec3::ZERO, |ends| ends[end] - point);
            Vectors4::new([corner(0), corner(1), corner(2), corner(3)])
        };
        let (from, to) = (ends(0), ends(1));
        let edges = ClippedEdges::new(&from, &to, from.dot(&normals), to.dot(&normals));
        sum += edges.terms(&normals);
        if (edges.leave | edges.enter).any() {
            let crossings = edges.crossings.to_array();
            let (leave, enter) = (edges.leave.bitmask(), edges.enter.bitmask());
            for (lane, &crossing) in crossings.iter().enumerate() {
                let has = |mask: u32| f32::from((mask >> lane & 1) as u8);
                horizon.cross(crossing, has(leave) - has(enter));
            }
        }
    }
    ((sum.element_sum() + horizon.sum) / TAU).clamp(0.0, 1.0)
}

/// What outlines that are cut off at the horizon have there: between the places where they go down and those where they
/// come up again. These lie on one line, so the angle of each from the first is all that counts, and not which of them
/// belong together.
struct Horizon {
    normal: Vec3,
    first: Option<Vec3>,
    /// `Σ θ Γ · n` of the closing edges.
    sum: f32,
}

impl Horizon {
    fn new(normal: Vec3) -> Self {
        Self {
            normal,
            first: None,
            sum: 0.0,
        }
    }

    /// An edge goes through the horizon here: with 1 down, with −1 up, with 0 not.
    fn cross(&mut self, place: Vec3, down: f32) {
        if down != 0.0 {
            let first = *self.first.get_or_insert(place);
            let sine = first.cross(place).dot(self.normal);
            self.sum += down * sine.atan2(first.dot(place));
        }
    }
}

/// The part of a triangle above the horizon, by the heights of its corners; a corner twice where it has but three.
/// `None` where nothing is.
#[inline]
fn above_horizon([a, b, c]: [Vec3; 3], [of_a, of_b, of_c]: [f32; 3]) -> Option<[Vec3; 4]> {
    Some(match [of_a >= 0.0, of_b >= 0.0, of_c >= 0.0] {
        [true, true, true] => [a, b, c, c],
        [false, false, false] => return None,
        [true, false, false] => tip([a, b, c], [of_a, of_b, of_c]),
        [false, true, false] => tip([b, c, a], [of_b, of_c, of_a]),
        [false, false, true] => tip([c, a, b], [of_c, of_a, of_b]),
        [false, true, true] => stump([a, b, c], [of_a, of_b, of_c]),
        [true, false, true] => stump([b, c, a], [of_b, of_c, of_a]),
        [true, true, false] => stump([c, a, b], [of_c, of_a, of_b]),
    })
}

/// The part above the horizon, where only the first corner lies above it.
fn tip([a, b, c]: [Vec3; 3], [of_a, of_b, of_c]: [f32; 3]) -> [Vec3; 4] {
    let last = a.lerp(c, of_a / (of_a - of_c));
    [a, a.lerp(b, of_a / (of_a - of_b)), last, last]
}

/// The part above the horizon, where only the first corner lies below it.
fn stump([a, b, c]: [Vec3; 3], [of_a, of_b, of_c]: [f32; 3]) -> [Vec3; 4] {
    [
        a.lerp(b, of_a / (of_a - of_b)),
        b,
        c,
        a.lerp(c, of_a / (of_a - of_c)),
    ]
}

/// For four edges around an outline that is given relative to a point, wound as seen from its front: vectors that point
/// towards the inside of the fan triangles, and what to multiply them with to have θ Γ.
#[inline]
fn outline_terms(corners: &Vectors4) -> (Vectors4, Vec4) {
    let next = corners.rotated();
    let crosses = (next - *corners).cross(corners);
    (crosses, angle_over_cross(&crosses, corners.dot(&next)))
}

/// `θ Γ · n` of four edges, between corners that are given relative to the point of each, with normals n.
#[inline]
fn edge_term(from: &Vectors4, to: &Vectors4, edge: &Vectors4, normals: &Vectors4) -> Vec4 {
    // The front faces the point, so its corners run clockwise around the outgoing vector: from × to would point away,
    // to × from points towards the polygon. The edge in place of `to` keeps the digits of short edges far away.
    let cross = edge.cross(from);
    angle_over_cross(&cross, from.dot(to)) * cross.dot(normals)
}

/// The angle between two vectors over the length of their cross product; 0 where that is 0.
#[inline]
fn angle_over_cross(cross: &Vectors4, dot: Vec4) -> Vec4 {
    let squared_sine = cross.dot(cross);
    // One over the product of the lengths of the two.
    let scale = Vec4::ONE / (squared_sine + dot * dot).sqrt();
    let cosine = dot.abs() * scale;
    let mut angle = arc_over_sine(Vec4::ONE - cosine) * scale;
    let is_obtuse = dot.cmplt(Vec4::ZERO);
    if is_obtuse.any() {
        let supplement = Vec4::splat(PI) / squared_sine.sqrt() - angle;
        angle = Vec4::select(is_obtuse, supplement, angle);
    }
    Vec4::select(squared_sine.cmpgt(Vec4::ZERO), angle, Vec4::ZERO)
}

/// See [`ARC_OVER_SINE`]; in pairs, so that few products wait for each other.
#[inline]
fn arc_over_sine(rest: Vec4) -> Vec4 {
    let [c0, c1, c2, c3, c4, c5, c6, c7, c8] = ARC_OVER_SINE.map(Vec4::splat);
    let square = rest * rest;
    let fourth = square * square;
    let low = (c0 + c1 * rest) + (c2 + c3 * rest) * square;
    let high = (c4 + c5 * rest) + (c6 + c7 * rest) * square;
    low + high * fourth + c8 * (fourth * fourth)
}

/// Four edges, cut off where they go below a horizon.
struct ClippedEdges {
    from: Vectors4,
    to: Vectors4,
    /// Which have a part above.
    are_seen: BVec4A,
    /// Which go down through the horizon, and which come up.
    leave: BVec4A,
    enter: BVec4A,
    /// Where these go through it.
    crossings: Vectors4,
}

impl ClippedEdges {
    /// Edges between corners of these heights, given relative to the point of each.
    #[inline]
    fn new(from: &Vectors4, to: &Vectors4, of_from: Vec4, of_to: Vec4) -> Self {
        let [starts_above, ends_above] = [of_from, of_to].map(|height| height.cmpge(Vec4::ZERO));
        let crossings = from.lerp(to, of_from / (of_from - of_to));
        let (leave, enter) = (starts_above & !ends_above, !starts_above & ends_above);
        Self {
            from: Vectors4::select(enter, &crossings, from),
            to: Vectors4::select(leave, &crossings, to),
            are_seen: starts_above | ends_above,
            leave,
            enter,
            crossings,
        }
    }

    /// `θ Γ · n` of what lies above.
    #[inline]
    fn terms(&self, normals: &Vectors4) -> Vec4 {
        let term = edge_term(&self.from, &self.to, &(self.to - self.from), normals);
        Vec4::select(self.are_seen, term, Vec4::ZERO)
    }
}

/// `Σ_k θ_k Γ_k · n` of a triangle as four points see it, clipped at the horizon of each.
fn clipped_sum(corners: &[Vectors4; 3], heights: [Vec4; 3], normals: &Vectors4) -> Vec4 {
    let mut sum = Vec4::ZERO;
    // Where the outline goes below the horizon, and where it comes up again.
    let (mut exit, mut entry) = (Vectors4::splat(Vec3::ZERO), Vectors4::splat(Vec3::ZERO));
    for k in 0..3 {
        let next = (k + 1) % 3;
        let edges = ClippedEdges::new(&corners[k], &corners[next], heights[k], heights[next]);
        exit = Vectors4::select(edges.leave, &edges.crossings, &exit);
        entry = Vectors4::select(edges.enter, &edges.crossings, &entry);
        sum += edges.terms(normals);
    }
    sum + edge_term(&exit, &entry, &(entry - exit), normals)
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
