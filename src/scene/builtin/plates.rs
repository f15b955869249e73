//! Pairs of unit squares whose form factors are known in closed form. The emitter is black, so that the irradiance of
//! the receiver is π · emission · F, on average, in any number of bounces.

use glam::{DVec3, Vec3};

use super::shapes::Mesh;
use crate::scene::{Material, MaterialId, SceneBuilder};

const EMISSION: f32 = 3.0;
const REFLECTANCE: f32 = 0.5;

/// A receiver in the plane y = 0 facing up and an emitter of radiance 3 at y = `distance` facing down.
/// At distance 1, F = 0.199825.
pub fn plates(distance: f64) -> SceneBuilder {
    let (mut builder, receiver, emitter) = materials("plates");
    floor_square(receiver).add_to(&mut builder, "receiver");
    square(
        [
            DVec3::new(0.0, distance, 0.0),
            DVec3::new(1.0, distance, 0.0),
            DVec3::new(1.0, distance, 1.0),
            DVec3::new(0.0, distance, 1.0),
        ],
        emitter,
    )
    .add_to(&mut builder, "emitter");
    builder
}

/// A receiver in the plane y = 0 facing up and an emitter of radiance 3 on its edge x = 0, facing +x. F = 0.200044.
pub fn perpendicular_plates() -> SceneBuilder {
    let (mut builder, receiver, emitter) = materials("perpendicular-plates");
    floor_square(receiver).add_to(&mut builder, "receiver");
    square(
        [DVec3::ZERO, DVec3::Y, DVec3::Y + DVec3::Z, DVec3::Z],
        emitter,
    )
    .add_to(&mut builder, "emitter");
    builder
}

fn materials(name: &str) -> (SceneBuilder, MaterialId, MaterialId) {
    let mut builder = SceneBuilder::default();
    name.clone_into(&mut builder.source.name);
    let receiver = Material::plain("receiver", Vec3::splat(REFLECTANCE), Vec3::ZERO);
    let emitter = Material::plain("emitter", Vec3::ZERO, Vec3::splat(EMISSION));
    let receiver = builder.push_material(receiver);
    let emitter = builder.push_material(emitter);
    (builder, receiver, emitter)
}

fn floor_square(material: MaterialId) -> Mesh {
    square(
        [DVec3::ZERO, DVec3::Z, DVec3::X + DVec3::Z, DVec3::X],
        material,
    )
}

fn square(corners: [DVec3; 4], material: MaterialId) -> Mesh {
    let mut mesh = Mesh::default();
    let corners = corners.map(|corner| mesh.vertex(corner));
    mesh.quad(corners, material);
    mesh
}
