//! Form factors in single precision against the same sums in double precision, with the functions of the standard library:
//! random, grazing, near and far, tiny and huge triangles, from one point and from four at once.

use std::f64::consts::TAU;

use glam::{DVec3, Vec3};
use vecrad::geometry::{
    Random, Vectors4, irradiance_vector, outline_irradiance, point_irradiance, point_irradiances,
};

/// Error of a form factor that is let be.
const TOLERANCE: f64 = 1e-6;

/// A cross product of an edge and a corner at distance r is off by 3 ε r of the edge's length at most; relative to its own
/// length that is 3 ε r / d, if the edge passes at distance d. The three angles of a triangle add to 2π at most.
const ROUNDING: f64 = 3.0 * (f32::EPSILON as f64) / 2.0;

/// A receiver's unit normal and a triangle, front towards the origin.
struct Case {
    normal: Vec3,
    corners: [Vec3; 3],
}

/// Sums over edges as polygon.rs has them, written out anew in double precision.
fn vector(outline: &[DVec3]) -> DVec3 {
    let mut sum = DVec3::ZERO;
    for (index, &from) in outline.iter().enumerate() {
        let to = outline[(index + 1) % outline.len()];
        let cross = to.cross(from);
        let sine = cross.length();
        if sine > 0.0 {
            sum += cross * (sine.atan2(to.dot(from)) / sine);
        }
    }
    sum / TAU
}

fn exact(point: Vec3, case: &Case) -> f64 {
    let normal = case.normal.as_dvec3();
    let corners = case
        .corners
        .map(|corner| corner.as_dvec3() - point.as_dvec3());
    let [a, b, c] = corners;
    if (b - a).cross(c - a).dot(a) >= 0.0 {
        return 0.0;
    }
    let mut outline = Vec::new();
    for (from, to) in [(a, b), (b, c), (c, a)] {
        let (start, end) = (from.dot(normal), to.dot(normal));
        if start >= 0.0 {
            outline.push(from);
        }
        if (start >= 0.0) != (end >= 0.0) {
            outline.push(from.lerp(to, start / (start - end)));
        }
    }
    vector(&outline).dot(normal)
}

/// How far single precision may be off at a point: the tolerance, more only where an edge passes close by.
fn allowed(point: Vec3, case: &Case) -> f64 {
    let corners = case
        .corners
        .map(|corner| corner.as_dvec3() - point.as_dvec3());
    // Corners are rounded where they are moved to the point.
    let reach = |corner: DVec3| corner.length() + point.as_dvec3().length();
    let [a, b, c] = corners;
    let relative = [(a, b), (b, c), (c, a)].map(|(from, to)| {
        let distance = from.cross(to).length() / (to - from).length();
        reach(from).max(reach(to)) / distance
    });
    TOLERANCE.max(ROUNDING * relative.into_iter().fold(0.0, f64::max))
}

fn in_ball(random: &mut Random) -> Vec3 {
    loop {
        let point = Vec3::from_array([(); 3].map(|()| 2.0 * random.uniform() - 1.0));
        if (1e-4..=1.0).contains(&point.length_squared()) {
            return point;
        }
    }
}

/// A triangle about a point at this distance, squashed along a random axis.
fn case(random: &mut Random, distance: f32, thickness: f32) -> Case {
    let axis = in_ball(random).normalize_or(Vec3::X);
    let middle = in_ball(random).normalize_or(Vec3::Y) * distance;
    let mut corner = || {
        let offset = in_ball(random);
        middle + offset - axis * (offset.dot(axis) * (1.0 - thickness))
    };
    let [a, b, c] = [corner(), corner(), corner()];
    let looks_away = (b - a).cross(c - a).dot(a) > 0.0;
    Case {
        normal: in_ball(random).normalize_or(Vec3::Z),
        corners: if looks_away { [a, c, b] } else { [a, b, c] },
    }
}

#[test]
fn form_factors_are_those_of_double_precision() {
    const CASES: u32 = 4000;
    for (name, distance, thickness, scale) in [
        ("about the point", 0.2, 1.0, 1.0),
        ("touching", 0.7, 1.0, 1.0),
        ("near", 2.0, 1.0, 1.0),
        ("flat, so that many are seen edge-on", 1.5, 1e-3, 1.0),
        ("at a distance", 20.0, 1.0, 1.0),
        ("before they count as points", 60.0, 1.0, 1.0),
        ("about where they do", 100.0, 1.0, 1.0),
        ("far", 1e4, 1.0, 1.0),
        ("tiny", 2.0, 1.0, 1e-6),
        ("huge", 2.0, 1.0, 1e6),
    ] {
        let mut random = Random::new(1, 0);
        let mut lit = 0;
        for index in 0..CASES {
            let mut case = case(&mut random, distance, thickness);
            case.corners = case.corners.map(|corner| corner * scale);
            let points = [(); 3].map(|()| in_ball(&mut random) * (0.2 * scale));
            let points = [Vec3::ZERO, points[0], points[1], points[2]];
            let found = point_irradiances(
                &Vectors4::new(points),
                &Vectors4::splat(case.normal),
                case.corners,
            );
            for (point, found) in points.into_iter().zip(found.to_array()) {
                let (expected, allowed) = (exact(point, &case), allowed(point, &case));
                let one = point_irradiance(point, case.normal, case.corners);
                for found in [found, one] {
                    let error = (f64::from(found) - expected).abs();
                    assert!(
                        error <= allowed,
                        "{name} {index}: {found} {expected}, off by {error:e} of {allowed:e}"
                    );
                }
                lit += u32::from(expected > 0.0);
            }
        }
        assert!(lit > CASES, "{name}: only {lit} receive anything");
    }
}

#[test]
fn vectors_and_outlines_are_those_of_double_precision() {
    for distance in [0.7, 2.0, 20.0, 60.0] {
        let mut random = Random::new(2, 0);
        for index in 0..4000 {
            let case = case(&mut random, distance, 1.0);
            let allowed = allowed(Vec3::ZERO, &case);
            let [a, b, c] = case.corners;
            let expected = vector(&case.corners.map(Vec3::as_dvec3));
            let found = irradiance_vector(Vec3::ZERO, case.corners).as_dvec3();
            let error = (found - expected).length();
            assert!(error <= allowed, "{distance} {index}: off by {error:e}");
            if case
                .corners
                .iter()
                .any(|corner| corner.dot(case.normal) < 0.0)
            {
                continue;
            }
            // With a hole of no width, so that there are more edges than lanes.
            let edges = [[c, a], [a, b], [b, a], [a, b], [b, c]];
            let found = f64::from(outline_irradiance(Vec3::ZERO, case.normal, &edges));
            let error = (found - expected.dot(case.normal.as_dvec3())).abs();
            assert!(
                error <= 2.0 * allowed,
                "{distance} {index}: off by {error:e}"
            );
        }
    }
}

#[test]
fn each_of_four_normals_has_its_own_horizon() {
    let mut random = Random::new(3, 0);
    for index in 0..4000 {
        let case = case(&mut random, 1.5, 1.0);
        let normals = [(); 4].map(|()| in_ball(&mut random).normalize_or(Vec3::Z));
        let points = Vectors4::splat(Vec3::ZERO);
        let found = point_irradiances(&points, &Vectors4::new(normals), case.corners);
        for (normal, found) in normals.into_iter().zip(found.to_array()) {
            let corners = case.corners;
            let expected = exact(Vec3::ZERO, &Case { normal, corners });
            let error = (f64::from(found) - expected).abs();
            let allowed = allowed(Vec3::ZERO, &case);
            assert!(error <= allowed, "{index} {normal}: {found} {expected}");
            // With a hole of no width through the horizon, so that there are more edges than lanes.
            let [a, b, c] = corners;
            let edges = [[c, a], [a, b], [b, a], [a, b], [b, c]];
            let outlined = f64::from(outline_irradiance(Vec3::ZERO, normal, &edges));
            let error = (outlined - expected).abs();
            assert!(
                error <= 2.0 * allowed,
                "{index} {normal}: {outlined} {expected}"
            );
        }
    }
}

#[test]
fn points_on_edges_and_corners_and_flat_triangles_stay_finite() {
    let [a, b, c] = [Vec3::NEG_X, Vec3::Y * 2.0, Vec3::new(1.0, -1.0, 0.0)];
    for corners in [[a, b, c], [a, c, b], [a, b, a.lerp(b, 0.5)], [a; 3]] {
        for shift in [0.0, 1e-7, -1e-7, 1e-20] {
            let points = [a, b, a.lerp(b, 0.3), (a + b + c) / 3.0];
            let points = points.map(|point| point + Vec3::Z * shift);
            for normal in [Vec3::Z, Vec3::NEG_Z, Vec3::X] {
                let four = Vectors4::new(points);
                let found = point_irradiances(&four, &Vectors4::splat(normal), corners);
                for (point, found) in points.into_iter().zip(found.to_array()) {
                    assert!((0.0..=1.0).contains(&found), "{point} {normal}: {found}");
                    let one = point_irradiance(point, normal, corners);
                    assert!((0.0..=1.0).contains(&one), "{point} {normal}: {one}");
                }
            }
        }
    }
}
