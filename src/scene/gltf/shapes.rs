//! Shapes of lamps about the origin.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use crate::scene::geodesic;

/// A sphere of 80 triangles, whose front looks outward. The light that it sends to different directions differs by little more
/// than a percent.
pub(super) fn small_sphere(radius: f64) -> Vec<[DVec3; 3]> {
    let (positions, faces) = geodesic::sphere(2);
    let places = |face: [u32; 3]| face.map(|corner| positions[corner as usize] * radius);
    faces.into_iter().map(places).collect()
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
        let sphere = small_sphere(2.0);
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
