//! From a name on the command line to a scene.

use std::path::Path;

use glam::{DVec3, Vec3};

use crate::scene::{BuildError, Material, Scene, SceneBuilder, SceneOptions};

/// Why there is no scene.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The format is not read.
    #[error("cannot read this kind of file: {0}")]
    Format(String),
    /// There is no such built-in scene.
    #[error("no built-in scene is named '{0}'")]
    Unknown(String),
    /// Nothing in it can be lit.
    #[error(transparent)]
    Build(#[from] BuildError),
}

/// Read a file, or make the built-in scene of this name.
///
/// # Errors
/// When there is no scene to light.
pub fn load(
    path: Option<&Path>,
    name: Option<&str>,
    options: &SceneOptions,
) -> Result<Scene, LoadError> {
    match (path, name) {
        (_, Some("quads")) => Ok(quads().finish(options)?),
        (_, Some(name)) => Err(LoadError::Unknown(name.to_owned())),
        (path, None) => Err(LoadError::Format(
            path.unwrap_or(Path::new("")).display().to_string(),
        )),
    }
}

/// A light over a floor: the smallest scene with something to see.
fn quads() -> SceneBuilder {
    let mut builder = SceneBuilder::default();
    builder.source.name = "quads".to_owned();
    let grey = Material::plain("floor", Vec3::splat(0.5), Vec3::ZERO);
    let light = Material::plain("light", Vec3::ZERO, Vec3::splat(5.0));
    for (material, half, height, winding) in [
        (grey, 1.0, 0.0, [[0, 1, 2], [0, 2, 3]]),
        (light, 0.25, 1.0, [[0, 2, 1], [0, 3, 2]]),
    ] {
        let material = builder.push_material(material);
        let corners = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)]
            .map(|(x, z)| builder.push_position(DVec3::new(x * half, height, z * half)));
        for triangle in winding {
            builder.push_triangle(triangle.map(|corner| corners[corner]), material);
        }
    }
    builder
}
