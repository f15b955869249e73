//! Integrals of the light on a display mesh.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use crate::{
    geometry::area_vector,
    scene::{Scene, Surface, Triangle, TriangleId},
    solver::{DisplayMesh, Snapshot},
};

/// Power of all emitters by channel, frame units.
pub(super) fn emitted_power(scene: &Scene) -> DVec3 {
    let of = |(surface, triangle): (&Surface, &Triangle)| {
        let sides = if triangle.two_sided { 2.0 } else { 1.0 };
        surface.emission.as_dvec3() * (PI * sides * f64::from(surface.area_vector.length()))
    };
    scene.surfaces.iter().zip(&scene.triangles).map(of).sum()
}

/// Integral of the irradiance over all display triangles, by channel, frame units, each triangle of the scene weighed.
pub(super) fn arriving_power(snapshot: &Snapshot, weight: impl Fn(TriangleId) -> DVec3) -> DVec3 {
    power_by_side(snapshot, |triangle, _| weight(triangle))
}

/// The same with each side weighed, the back where it is asked for as such.
pub(super) fn power_by_side(
    snapshot: &Snapshot,
    weight: impl Fn(TriangleId, bool) -> DVec3,
) -> DVec3 {
    integral(&snapshot.mesh, &snapshot.light.irradiance, weight)
}

/// Area-weighted mean of a quantity known at vertices over the display triangles that count; NaN where none does.
pub(super) fn mean_where(
    mesh: &DisplayMesh,
    values: &[Vec3],
    counts: impl Fn(TriangleId) -> bool,
) -> DVec3 {
    let weight = |triangle, _| DVec3::splat(if counts(triangle) { 1.0 } else { 0.0 });
    let ones = vec![Vec3::ONE; values.len()];
    integral(mesh, values, weight) / integral(mesh, &ones, weight)
}

fn integral(
    mesh: &DisplayMesh,
    values: &[Vec3],
    weight: impl Fn(TriangleId, bool) -> DVec3,
) -> DVec3 {
    let mut sum = DVec3::ZERO;
    let sides = mesh.triangle_of.iter().zip(&mesh.is_back);
    for (vertices, (&triangle, &is_back)) in mesh.indices.iter().zip(sides) {
        let corners = vertices.map(|vertex| mesh.positions[vertex as usize]);
        let area = f64::from(area_vector(corners).length());
        let light: DVec3 = vertices
            .iter()
            .map(|&vertex| values[vertex as usize].as_dvec3())
            .sum();
        sum += weight(TriangleId(triangle), is_back) * light * (area / 3.0);
    }
    sum
}
