//! `vecrad report`: run methods and baselines on scenes, measure their error against run time, write what came out.
//!
//! A suite says which scenes and what to run; a [`session::Session`] loads, traces references and runs, and
//! knows when to stop. Measures are described in the room `metrics`, plots are drawn in `export`.

mod baselines;
mod error_time;
mod exact;
mod omissions;
mod run_flags;
mod runs;
mod scaling;
mod session;
mod stability;
mod suite;
mod trials;

use std::{fs, path::PathBuf, time::Duration};

use anyhow::{Context as _, Result, bail};
use clap::{Args, builder::PossibleValuesParser};

use super::{
    Outcome, Reference, SceneFlags, SettingFlags, UsageError, flags::seconds, solve::Interruption,
};
use run_flags::ReportRunFlags;
use session::{Session, Source};

/// Flags of `vecrad report`.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct ReportArguments {
    /// OBJ or glTF file to measure on
    #[arg(required_unless_present_any = ["scene", "suite"], conflicts_with_all = ["scene", "suite"])]
    pub path: Option<PathBuf>,
    /// Built-in scene to measure on
    #[arg(long, value_name = "NAME", conflicts_with = "suite")]
    pub scene: Option<String>,
    /// Scenes and runs that belong together
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(suite::names()))]
    pub suite: Option<String>,
    /// Folder for report.md, report.csv, report.json and plots; made where it is missing
    #[arg(long, value_name = "DIR", help_heading = "Output")]
    pub output: PathBuf,
    /// Reference to measure the error against: path tracing with paths or paths=SAMPLES
    #[arg(long, value_name = "HOW", default_value = "paths=4096", value_parser = reference_samples, help_heading = "Output")]
    pub reference: u32,
    /// No progress line
    #[arg(long, short, help_heading = "Output")]
    pub quiet: bool,
    /// Runs
    #[command(flatten)]
    pub runs: ReportRunFlags,
    /// Scene
    #[command(flatten)]
    pub scene_flags: SceneFlags,
    /// Settings
    #[command(flatten)]
    pub setting_flags: SettingFlags,
    /// Limits
    #[command(flatten)]
    pub limits: LimitFlags,
}

/// Limits of every single run.
#[derive(Clone, Debug, Args)]
pub struct LimitFlags {
    /// Stop each run after this time [default: 60]
    #[arg(long, value_name = "SEC", value_parser = seconds, help_heading = "Limits")]
    pub time_limit: Option<Duration>,
    /// Stop a run when its solver uses this much memory [default: none]
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u64).range(1..=1 << 40), help_heading = "Limits")]
    pub memory_limit: Option<u64>,
    /// Threads of solver and baselines [default: automatic, one for each core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024), help_heading = "Limits")]
    pub threads: Option<u16>,
}

/// Measure, and write after every scene.
pub(super) fn report(arguments: &ReportArguments) -> Result<Outcome> {
    make_folder(arguments)?;
    let mut session = Session::new(arguments, Interruption::listen()?.flag)?;
    if let Some(name) = &arguments.suite {
        suite::run(name, &mut session)?;
    } else {
        let source = match (&arguments.path, &arguments.scene) {
            (Some(path), _) => Source::File(path.clone()),
            (None, name) => Source::Builtin(name.clone().unwrap_or_default()),
        };
        error_time::compare(&mut session, &[source])?;
    }
    Ok(session.finish())
}

fn make_folder(arguments: &ReportArguments) -> Result<()> {
    let folder = &arguments.output;
    if folder.exists() && !folder.is_dir() {
        bail!(UsageError(format!(
            "the output must be a folder: {}",
            folder.display()
        )));
    }
    fs::create_dir_all(folder)
        .with_context(|| format!("cannot make the folder {}", folder.display()))?;
    super::output::check(&folder.join("report.md"))
}

/// Samples of `--reference`: only path tracing is exact on every scene.
fn reference_samples(text: &str) -> Result<u32, String> {
    match text.parse()? {
        Reference::Paths(samples) => Ok(samples),
        Reference::Matrix => Err("a report needs path tracing: paths or paths=SAMPLES".to_owned()),
    }
}
