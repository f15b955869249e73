//! `vecrad completions` and `vecrad man`: what packages install beside the program, made from the flags themselves.

use std::{
    io::{self, Write as _},
    path::PathBuf,
};

use anyhow::{Context as _, Result};
use clap::{Args, CommandFactory as _};
use clap_complete::Shell;

use super::{Arguments, Outcome};

/// The name by which shells call the program.
const PROGRAM: &str = "vecrad";

/// Flags of `vecrad completions`.
#[derive(Debug, Args)]
pub struct CompletionsArguments {
    /// The shell
    #[arg(value_enum)]
    pub shell: Shell,
}

/// Flags of `vecrad man`.
#[derive(Debug, Args)]
pub struct ManArguments {
    /// Write the pages of the program and of all its commands into this folder
    #[arg(long, value_name = "DIR")]
    pub write: Option<PathBuf>,
}

/// Print the completions.
pub(super) fn completions(arguments: &CompletionsArguments) -> Result<Outcome> {
    // The generator panics where standard output is closed; a buffer cannot fail.
    let mut script = Vec::new();
    clap_complete::generate(
        arguments.shell,
        &mut Arguments::command(),
        PROGRAM,
        &mut script,
    );
    io::stdout().write_all(&script)?;
    Ok(Outcome::Done)
}

/// Print the page, or write all of them.
pub(super) fn man(arguments: &ManArguments) -> Result<Outcome> {
    let command = Arguments::command();
    match &arguments.write {
        None => clap_mangen::Man::new(command).render(&mut io::stdout())?,
        Some(folder) => {
            let written = std::fs::create_dir_all(folder)
                .and_then(|()| clap_mangen::generate_to(command, folder));
            written.with_context(|| format!("cannot write to {}", folder.display()))?;
        }
    }
    Ok(Outcome::Done)
}
