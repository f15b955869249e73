//! Short ways to put materials into a scene.

use glam::Vec3;

use crate::scene::{Material, MaterialId, SceneBuilder, Texture, TextureId};

/// A material that reflects.
pub(super) fn plain(builder: &mut SceneBuilder, name: &str, reflectance: [f32; 3]) -> MaterialId {
    builder.push_material(Material::plain(
        name,
        Vec3::from_array(reflectance),
        Vec3::ZERO,
    ))
}

/// Keep a texture for materials to name.
pub(super) fn push_texture(builder: &mut SceneBuilder, texture: Texture) -> TextureId {
    builder.textures.push(texture);
    TextureId(builder.textures.len() as u32 - 1)
}

/// A nearly white material under a texture.
pub(super) fn textured(builder: &mut SceneBuilder, name: &str, texture: Texture) -> MaterialId {
    let texture = push_texture(builder, texture);
    builder.push_material(Material {
        reflectance_texture: Some(texture),
        ..Material::plain(name, Vec3::splat(0.9), Vec3::ZERO)
    })
}

/// A material that glows and reflects half of what arrives. `emission` is radiance.
pub(super) fn glowing(builder: &mut SceneBuilder, name: &str, emission: [f32; 3]) -> MaterialId {
    builder.push_material(Material::plain(
        name,
        Vec3::splat(0.5),
        Vec3::from_array(emission),
    ))
}

/// Glass that lets light through but for the part `opacity`, of which it reflects the part `reflectance`.
pub(super) fn glass(builder: &mut SceneBuilder, opacity: f32, reflectance: f32) -> MaterialId {
    builder.push_material(Material {
        opacity,
        ..Material::plain("glass", Vec3::splat(reflectance), Vec3::ZERO)
    })
}

/// Materials of one kind in several colours, numbered.
pub(super) fn in_colours(
    builder: &mut SceneBuilder,
    name: &str,
    reflectances: &[[f32; 3]],
) -> Vec<MaterialId> {
    let numbered = reflectances.iter().enumerate();
    numbered
        .map(|(number, &reflectance)| plain(builder, &format!("{name} {number}"), reflectance))
        .collect()
}
