//! From a name on the command line to a scene.

use std::path::Path;

use crate::scene::{
    self, BuildError, Lighting, ReadError, Scene, SceneBuilder, SceneOptions, SkyError, builtin,
};

/// Why there is no scene.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// There is no such built-in scene.
    #[error("no built-in scene is named '{0}'; {hint}", hint = hint(.0))]
    Unknown(String),
    /// A built-in scene is named where a file is expected.
    #[error("there is no such file; for the built-in scene of this name write --scene {0}")]
    NotFile(String),
    /// Neither a file nor a built-in scene is named.
    #[error("no scene is named")]
    Nothing,
    /// The picture of the sky cannot be read.
    #[error(transparent)]
    Sky(#[from] SkyError),
    /// No material has the name of a lamp; a sentence.
    #[error("{0}")]
    Lamp(String),
    /// Nothing in it can be lit.
    #[error(transparent)]
    Build(#[from] BuildError),
}

/// Read a file, or make the built-in scene of this name, and light it.
///
/// # Errors
/// When there is no scene to light, or no material for a lamp.
pub fn load(
    path: Option<&Path>,
    name: Option<&str>,
    options: &SceneOptions,
    lighting: &Lighting,
) -> Result<Scene, LoadError> {
    let scene = if let Some(name) = name {
        let made = builtin::builtin(name, options);
        made.ok_or_else(|| LoadError::Unknown(name.to_owned()))??
    } else {
        let path = path.ok_or(LoadError::Nothing)?;
        check_is_file(path)?;
        scene::read_scene(path, options)?
    };
    light(scene, lighting)
}

/// As [`load`], with the faces as they are before they are cleaned and scaled.
///
/// # Errors
/// As [`load`].
pub(super) fn load_with_faces(
    path: Option<&Path>,
    name: Option<&str>,
    options: &SceneOptions,
    lighting: &Lighting,
) -> Result<(Scene, SceneBuilder), LoadError> {
    let (scene, faces) = if let Some(name) = name {
        let found = builtin::find_builtin(name);
        let found = found.ok_or_else(|| LoadError::Unknown(name.to_owned()))?;
        (found.scene(options)?, found.builder())
    } else {
        let path = path.ok_or(LoadError::Nothing)?;
        check_is_file(path)?;
        scene::read_scene_and_faces(path, options)?
    };
    Ok((light(scene, lighting)?, faces))
}

/// Light a scene as it is asked for.
///
/// # Errors
/// [`LoadError::Lamp`]
pub(super) fn light(scene: Scene, lighting: &Lighting) -> Result<Scene, LoadError> {
    match lighting.misnamed(&scene) {
        Some(sentence) => Err(LoadError::Lamp(sentence)),
        None => Ok(lighting.apply(scene)),
    }
}

/// Refuse the name of a built-in scene that stands for a file and is none.
///
/// # Errors
/// [`LoadError::NotFile`]
pub(super) fn check_is_file(path: &Path) -> Result<(), LoadError> {
    match path.to_str().and_then(builtin::find_builtin) {
        Some(found) if !path.exists() => Err(LoadError::NotFile(found.name.to_owned())),
        _ => Ok(()),
    }
}

/// What to do about an unknown name.
fn hint(name: &str) -> String {
    match scene::closest(name, builtin::builtin_names()) {
        Some(known) => format!("did you mean '{known}'?"),
        None => "'vecrad scenes' lists them".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_misspelt_scene_gets_a_suggestion_and_another_word_does_not() {
        for (name, meant) in [
            ("cornel", "cornell"),
            ("Cornell", "cornell"),
            ("galery", "gallery"),
            ("galllery", "gallery"),
            ("room1022", "room-1022"),
            ("tiledroom", "tiled-room"),
            ("furnance", "furnace"),
            ("sopu", "soup"),
        ] {
            let sentence = LoadError::Unknown(name.to_owned()).to_string();
            let end = format!("named '{name}'; did you mean '{meant}'?");
            assert!(sentence.ends_with(&end), "{sentence}");
        }
        for name in ["", "kitchen", "xyzzy"] {
            let sentence = LoadError::Unknown(name.to_owned()).to_string();
            assert!(
                sentence.ends_with("'vecrad scenes' lists them"),
                "{sentence}"
            );
        }
    }

    #[test]
    fn a_built_in_scene_in_the_place_of_a_file_is_recognised() {
        let (options, lighting) = (SceneOptions::default(), Lighting::default());
        let error = load(Some(Path::new("cornell")), None, &options, &lighting).unwrap_err();
        assert!(error.to_string().ends_with("--scene cornell"), "{error}");
        let error = load(Some(Path::new("missing.obj")), None, &options, &lighting).unwrap_err();
        assert!(matches!(error, LoadError::Read(ReadError::NotFound { .. })));
    }
}
