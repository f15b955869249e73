//! The furnace: a closed cube of one material, in which radiance is `emission / (1 − reflectance)` everywhere.

use glam::Vec3;

use super::shapes::{Facing, geodesic_sphere, lattice_box, lines_through};
use crate::scene::{Material, SceneBuilder};

/// A unit cube that faces inward, each edge cut into `subdivisions` (at least 1): `12 · subdivisions²` triangles.
/// `emission` is radiance.
pub fn furnace(reflectance: f32, emission: f32, subdivisions: u32) -> SceneBuilder {
    let mut builder = SceneBuilder::default();
    "furnace".clone_into(&mut builder.source.name);
    let wall = builder.push_material(Material::plain(
        "wall",
        Vec3::splat(reflectance),
        Vec3::splat(emission),
    ));
    let lines = lines_through(&[0.0, 1.0], 1.0 / f64::from(subdivisions.max(1)));
    lattice_box([&lines, &lines, &lines], Facing::Inward, |_, _| Some(wall))
        .add_to(&mut builder, "furnace");
    builder
}

/// The furnace as a unit sphere that faces inward, `20 · frequency²` triangles: no normal lies along an axis, and every
/// point sees every other.
pub fn sphere_furnace(reflectance: f32, emission: f32, frequency: u32) -> SceneBuilder {
    let mut builder = SceneBuilder::default();
    "sphere-furnace".clone_into(&mut builder.source.name);
    let wall = builder.push_material(Material::plain(
        "wall",
        Vec3::splat(reflectance),
        Vec3::splat(emission),
    ));
    // A point reflection turns the sphere inside out.
    geodesic_sphere(frequency, wall)
        .moved(|point| -point)
        .add_to(&mut builder, "furnace");
    builder
}
