//! Irradiance of a uniformly bright polygon at a point, exactly.
//!
//! For radiosity B the irradiance vector (Lambert 1760; Arvo, "The Irradiance Jacobian", 1994, eq. 5) is
//! `(B / 2π) Σ_k θ_k Γ_k`, with θ_k the angle that edge k subtends and Γ_k the unit normal of its fan triangle.
//! It is finite however close the point is, and needs no samples.

use std::f32::consts::TAU;

use glam::Vec3;

/// Longest polygon that clipping a triangle by a plane can leave.
const CLIPPED_CORNERS: usize = 4;

/// Irradiance vector at `point` of a triangle of radiosity 1 that faces it, per unit radiosity.
/// Its dot product with a unit normal whose horizon the triangle does not cross is the irradiance there.
/// Zero where the point lies behind the triangle's front or in its plane.
pub fn irradiance_vector(point: Vec3, corners: [Vec3; 3]) -> Vec3 {
    if !sees_front(point, corners) {
        Vec3::ZERO
    } else {
        edge_sum(&corners.map(|corner| corner - point))
    }
}

/// Irradiance at `point` with unit `normal` of a triangle of radiosity 1, clipped at the horizon; 0…1.
/// It is the form factor from the point to the triangle's front.
pub fn point_irradiance(point: Vec3, normal: Vec3, corners: [Vec3; 3]) -> f32 {
    if !sees_front(point, corners) {
        return 0.0;
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

/// Whether the point lies before the triangle's front.
fn sees_front(point: Vec3, [a, b, c]: [Vec3; 3]) -> bool {
    (b - a).cross(c - a).dot(point - a) > 0.0
}

/// `Σ_k θ_k Γ_k / 2π` over the edges of a polygon given relative to the point, wound as seen from its front.
fn edge_sum(corners: &[Vec3]) -> Vec3 {
    let mut sum = Vec3::ZERO;
    let mut previous = corners[corners.len() - 1];
    for &corner in corners {
        // The front faces the point, so its corners run clockwise around the outgoing vector: previous × corner
        // would point away, corner × previous points towards the polygon.
        let cross = corner.cross(previous);
        let sine = cross.length();
        if sine > 0.0 {
            sum += cross * (sine.atan2(corner.dot(previous)) / sine);
        }
        previous = corner;
    }
    sum / TAU
}
