//! Shapes of lamps about the origin.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

/// A sphere of 80 triangles: an icosahedron, each face of which is cut into four. Its front looks outward. The light that it
/// sends to different directions differs by little more than a percent.
pub(super) fn icosphere(radius: f64) -> Vec<[DVec3; 3]> {
    let middle = |a: DVec3, b: DVec3| (a + b).normalize_or_zero();
    icosahedron()
        .into_iter()
        .flat_map(|[a, b, c]| {
            let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        })
        .map(|triangle| triangle.map(|corner| corner * radius))
        .collect()
}

/// The icosahedron with corners at distance 1.
fn icosahedron() -> Vec<[DVec3; 3]> {
    let pole = DVec3::Y;
    // Two rings of five between the poles, at a height of 1/√5.
    let height = 1.0 / 5.0_f64.sqrt();
    let corner = |number: usize, height: f64, turn: f64| {
        let (sine, cosine) = ((number as f64 + turn) * TAU / 5.0).sin_cos();
        let across = (1.0 - height * height).sqrt();
        DVec3::new(across * sine, height, across * cosine)
    };
    let upper = |number: usize| corner(number, height, 0.0);
    let lower = |number: usize| corner(number, -height, 0.5);
    (0..5)
        .flat_map(|at| {
            [
                [pole, upper(at), upper(at + 1)],
                [upper(at), lower(at), upper(at + 1)],
                [lower(at), lower(at + 1), upper(at + 1)],
                [-pole, lower(at + 1), lower(at)],
            ]
        })
        .collect()
}

/// Corners of a regular polygon with the area of a disc of this radius, counter-clockwise about a unit vector.
pub(super) fn ring(axis: DVec3, count: usize, radius: f64) -> Vec<DVec3> {
    let (across, up) = axis.any_orthonormal_pair();
    let turn = TAU / count as f64;
    let reach = radius * (2.0 * PI / (count as f64 * turn.sin())).sqrt();
    let corner = |number: usize| {
        let (sine, cosine) = (number as f64 * turn).sin_cos();
        (across * cosine + up * sine) * reach
    };
    (0..count).map(corner).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area_vector([a, b, c]: &[DVec3; 3]) -> DVec3 {
        (*b - *a).cross(*c - *a) * 0.5
    }

    #[test]
    fn the_sphere_is_closed_looks_outward_and_is_round() {
        let sphere = icosphere(2.0);
        assert_eq!(sphere.len(), 80);
        let sum: DVec3 = sphere.iter().map(area_vector).sum();
        assert!(sum.length() < 1e-12);
        assert!(
            sphere
                .iter()
                .all(|triangle| area_vector(triangle).dot(triangle[0]) > 0.0)
        );
        let surface: f64 = sphere
            .iter()
            .map(|triangle| area_vector(triangle).length())
            .sum();
        for number in 0..1000 {
            let (sine, cosine) = (f64::from(number) * 2.4).sin_cos();
            let height = f64::from(number) / 500.0 - 0.999;
            let direction =
                DVec3::new(sine, 0.0, cosine) * (1.0 - height * height).sqrt() + DVec3::Y * height;
            let seen: f64 = sphere
                .iter()
                .map(|triangle| area_vector(triangle).dot(direction).max(0.0))
                .sum();
            let ratio = seen / (0.25 * surface);
            assert!((ratio - 1.0).abs() < 0.012, "{ratio} towards {direction}");
        }
    }

    #[test]
    fn a_ring_has_the_area_of_its_disc_and_turns_about_its_axis() {
        let axis = DVec3::new(1.0, 2.0, -2.0) / 3.0;
        let ring = ring(axis, 16, 3.0);
        let area: DVec3 = (0..16)
            .map(|corner| ring[corner].cross(ring[(corner + 1) % 16]) * 0.5)
            .sum();
        assert!((area - axis * PI * 9.0).length() < 1e-12);
    }
}
