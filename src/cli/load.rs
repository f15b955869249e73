//! From a name on the command line to a scene.

use std::path::Path;

use crate::scene::{self, BuildError, ReadError, Scene, SceneOptions};

/// Why there is no scene.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// There is no such built-in scene.
    #[error("no built-in scene is named '{0}'; 'vecrad scenes' lists them")]
    Unknown(String),
    /// Neither a file nor a built-in scene is named.
    #[error("no scene is named")]
    Nothing,
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
    if let Some(name) = name {
        let made = scene::builtin::builtin(name, options);
        return Ok(made.ok_or_else(|| LoadError::Unknown(name.to_owned()))??);
    }
    Ok(scene::read_obj(path.ok_or(LoadError::Nothing)?, options)?)
}
