//! The command line: flags to settings, commands, exit codes.
//!
//! Exit codes: 0 done, 2 usage, 3 scene cannot be read, 4 stopped early with the outputs written, 5 no graphics
//! adapter, 1 anything else.

mod check;
mod flags;
mod light_flags;
mod lightmap;
mod load;
mod observed;
mod output;
#[cfg(feature = "viewer")]
mod picture;
mod progress;
mod report;
mod scenes;
mod shell;
mod solve;
mod sweep;
mod truth;
mod values;
mod watched;
#[cfg(feature = "viewer")]
mod window;

use std::{io, path::PathBuf, process::ExitCode};

use clap::{Parser, Subcommand};

pub use flags::{LimitFlags, Preset, Reference, RunFlags, SceneFlags, SettingFlags};
pub use light_flags::{LampFlag, LightFlags, SkyFlag, SunFlag};
pub use load::{LoadError, load};

/// Light an OBJ or glTF scene by extended vector-based radiosity.
#[derive(Debug, Parser)]
#[command(version, args_conflicts_with_subcommands = true)]
pub struct Arguments {
    /// What to do instead of opening the window
    #[command(subcommand)]
    pub command: Option<Command>,
    /// OBJ or glTF file to open in the window
    pub path: Option<PathBuf>,
    /// Flags of the window
    #[cfg(feature = "viewer")]
    #[command(flatten)]
    pub window: window::WindowFlags,
}

/// The headless commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Light a scene without a window and write what is asked for
    Solve(Box<solve::SolveArguments>),
    /// Measure error against run time and write tables and plots
    Report(Box<sweep::ReportArguments>),
    /// Test the light of a scene where it is known without a reference
    Check(Box<check::CheckArguments>),
    /// List the built-in scenes, or write them as OBJ and MTL
    Scenes(scenes::ScenesArguments),
    /// Print the completions of a shell
    Completions(shell::CompletionsArguments),
    /// Print the manual page, or write one for each command
    Man(shell::ManArguments),
}

/// A usage error that clap cannot see.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(crate) struct UsageError(pub(crate) String);

/// How a command that wrote its outputs ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// All was done.
    Done,
    /// A limit or an interruption came first; outputs are written.
    StoppedEarly,
}

/// Parse the command line, run the command, and return the exit code.
pub fn run() -> ExitCode {
    let arguments = Arguments::parse();
    let result = match arguments.command {
        Some(Command::Solve(solve)) => solve::solve(&solve),
        Some(Command::Report(report)) => sweep::report(&report),
        Some(Command::Check(check)) => check::check(&check),
        Some(Command::Scenes(scenes)) => scenes::scenes(&scenes),
        Some(Command::Completions(completions)) => shell::completions(&completions),
        Some(Command::Man(man)) => shell::man(&man),
        #[cfg(feature = "viewer")]
        None => window::open(arguments.path, &arguments.window),
        #[cfg(not(feature = "viewer"))]
        None => Err(UsageError(
            "this build has no window; use 'vecrad solve SCENE.obj --export lit.ply'".to_owned(),
        )
        .into()),
    };
    match result {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::StoppedEarly) => ExitCode::from(4),
        // The reader of a pipe has seen enough.
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            output::say(format_args!("error: {error:#}"));
            exit_code_of(&error)
        }
    }
}

fn exit_code_of(error: &anyhow::Error) -> ExitCode {
    if error.is::<UsageError>() {
        ExitCode::from(2)
    } else if error.is::<LoadError>() {
        ExitCode::from(3)
    } else if needs_graphics(error) {
        ExitCode::from(5)
    } else {
        ExitCode::FAILURE
    }
}

/// Whether a graphics adapter or a display was missing.
#[cfg(feature = "viewer")]
fn needs_graphics(error: &anyhow::Error) -> bool {
    error.is::<crate::viewer::ViewerError>() || error.is::<crate::viewer::headless::HeadlessError>()
}

/// Whether a graphics adapter or a display was missing: this build never asks for one.
#[cfg(not(feature = "viewer"))]
fn needs_graphics(_error: &anyhow::Error) -> bool {
    false
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        cause
            .downcast_ref::<io::Error>()
            .is_some_and(|error| error.kind() == io::ErrorKind::BrokenPipe)
    })
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory as _;

    use super::*;

    #[test]
    fn the_flags_are_consistent() {
        Arguments::command().debug_assert();
    }
}
