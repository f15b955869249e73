//! `vecrad scenes`: list the built-in scenes, or write them as OBJ and MTL.

use std::{
    io::{self, Write as _},
    path::PathBuf,
};

use anyhow::{Context as _, Result};
use clap::Args;

use super::Outcome;
use crate::scene::{builtin::builtins, write_builtin};

/// Flags of `vecrad scenes`.
#[derive(Debug, Args)]
pub struct ScenesArguments {
    /// Write all of them into this folder
    #[arg(long, value_name = "DIR")]
    pub write: Option<PathBuf>,
}

/// List or write.
pub(super) fn scenes(arguments: &ScenesArguments) -> Result<Outcome> {
    let mut out = io::stdout().lock();
    for builtin in builtins() {
        match &arguments.write {
            None => writeln!(out, "{:<22}{}", builtin.name, builtin.summary)?,
            Some(folder) => {
                let path = write_builtin(builtin.name, folder)
                    .with_context(|| format!("cannot write to {}", folder.display()))?;
                writeln!(out, "{}", path.display())?;
            }
        }
    }
    Ok(Outcome::Done)
}
