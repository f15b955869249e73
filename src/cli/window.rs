//! `vecrad [SCENE.obj]`: open the window.

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::Args;

use super::{
    LoadError, Outcome, RunFlags, SceneFlags, SettingFlags, load::check_is_file, picture::ViewFlags,
};
use crate::{
    scene::{ReadError, builtin},
    viewer::{self, loader::SceneSource},
};

/// Shown where no scene is named.
const FIRST_SCENE: &str = "cornell";

/// Flags of the window.
#[derive(Clone, Debug, Args)]
pub struct WindowFlags {
    /// Built-in scene to open
    #[arg(long, value_name = "NAME", conflicts_with = "path")]
    pub scene: Option<String>,
    /// Read the scene again whenever its files change
    #[arg(long)]
    pub watch: bool,
    /// What it shows
    #[command(flatten)]
    pub view: ViewFlags,
    /// Scene
    #[command(flatten)]
    pub scene_flags: SceneFlags,
    /// Settings
    #[command(flatten)]
    pub setting_flags: SettingFlags,
    /// Limits
    #[command(flatten)]
    pub run_flags: RunFlags,
}

/// Open the window and stay until it is closed.
pub(super) fn open(path: Option<PathBuf>, flags: &WindowFlags) -> Result<Outcome> {
    let source = match (path, &flags.scene) {
        (Some(path), _) => SceneSource::File(path),
        (None, name) => {
            let name = name.as_deref().unwrap_or(FIRST_SCENE);
            if builtin::find_builtin(name).is_none() {
                bail!(LoadError::Unknown(name.to_owned()));
            }
            SceneSource::Builtin(name.to_owned())
        }
    };
    // A name that is mistyped is better said here than in an empty window.
    if let Some(path) = source.path()
        && !path.is_file()
    {
        check_is_file(path)?;
        bail!(LoadError::Read(ReadError::NotFound {
            path: path.to_owned(),
        }));
    }
    viewer::run(viewer::Options {
        source: Some(source),
        scene_options: flags.scene_flags.options(),
        watches_files: flags.watch,
        lighting: flags.scene_flags.lighting()?,
        settings: flags.setting_flags.settings(),
        settings_are_asked_for: flags.setting_flags.are_given(),
        run: flags.run_flags.options(),
        view: flags.view.request(&flags.run_flags),
        camera: flags.view.camera(),
    })?;
    Ok(Outcome::Done)
}
