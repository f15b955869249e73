//! Flags shared by the commands, and what they set. A flag that is not given leaves the preset as it is.

use std::{fmt::Display, str::FromStr, time::Duration};

use clap::{Args, ValueEnum};

use super::{
    light_flags::LightFlags,
    values::{at_least_zero, name_of, number, per_cent},
};
use crate::{
    export::{ColorOptions, MeshOptions, ToneMap},
    scene::{Lighting, SceneOptions, Sides, UpAxis},
    solver::{Direct, Keep, Method, Omission, Oracle, SolveSettings},
    worker::RunOptions,
};

/// A place to start from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Preset {
    /// Seconds to a first impression
    Draft,
    /// The default
    #[default]
    Normal,
    /// For the final result
    Final,
}

/// Flags of [`SceneOptions`] and of [`Lighting`].
#[derive(Clone, Debug, Args)]
pub struct SceneFlags {
    /// Which sides of faces reflect and emit
    #[arg(long, value_enum, default_value = "auto", help_heading = "Scene")]
    pub sides: Sides,
    /// Maximum reflectance, 0 to 1
    #[arg(
        long,
        value_name = "R",
        value_parser = fraction,
        help = format!(
            "Maximum reflectance, 0 to 1 [default: {}]",
            SceneOptions::default().max_reflectance
        ),
        help_heading = "Scene"
    )]
    pub max_reflectance: Option<f32>,
    /// Encoding of Kd and Ke in the MTL file
    #[arg(long, value_enum, default_value = "linear", help_heading = "Scene")]
    pub mtl_color: MtlColorFlag,
    /// Treat panes and cut-outs as solid
    ///
    /// Otherwise map_d, or the alpha of map_Kd, cuts out where it is below 0.5, and d below 1 (or Tr above 0) lets the
    /// part 1 - d pass straight on, times Tf. d 0 (or Tr 1) counts only for materials without a picture, and where at
    /// most half of the materials have it: many programs write it into opaque ones. By
    /// itself illum 6 and 7 alone make glass; see --matt.
    #[arg(long, help_heading = "Scene")]
    pub opaque: bool,
    /// Treat mirrors, gloss and glass as matt
    ///
    /// Otherwise Ks reflects beside Kd: illum 3, 5 or 8, or Ns of 1000 and more, is a mirror, else gloss whose width Ns or Pr
    /// tells; Pm makes metal. illum 6 and 7 are solid glass of index Ni, 4 and 9 panes, where d or Ni say so.
    #[arg(long, help_heading = "Scene")]
    pub matt: bool,
    /// Up axis of the scene
    #[arg(
        long,
        value_enum,
        default_value = "auto",
        allow_hyphen_values = true,
        help_heading = "Scene"
    )]
    pub up: UpFlag,
    /// Light
    #[command(flatten)]
    pub light: LightFlags,
}

impl SceneFlags {
    /// The light that the flags ask for.
    ///
    /// # Errors
    /// As [`LightFlags::lighting`].
    pub fn lighting(&self) -> anyhow::Result<Lighting> {
        self.light.lighting()
    }

    /// The options that the flags ask for.
    pub fn options(&self) -> SceneOptions {
        let default = SceneOptions::default();
        SceneOptions {
            sides: self.sides,
            max_reflectance: self.max_reflectance.unwrap_or(default.max_reflectance),
            mtl_color_is_srgb: self.mtl_color == MtlColorFlag::Srgb,
            is_opaque: self.opaque,
            is_matt: self.matt,
            up: self.up.axis(),
        }
    }
}

/// Flags of [`SolveSettings`].
#[derive(Clone, Debug, Args)]
pub struct SettingFlags {
    /// Settings to start from; single flags override it [default: normal]
    #[arg(long, value_enum, help_heading = "Settings")]
    pub preset: Option<Preset>,
    /// Refine until the estimated error (trimmed RMS, upper end of its 95 % interval) is at most this, in per cent of the root
    /// mean square of the light: 2 or 2% [default: none, the preset ends the run]
    #[arg(long, value_name = "PERCENT", value_parser = per_cent, conflicts_with_all = ["preset", "max_steps"], help_heading = "Settings")]
    pub error: Option<f32>,
    /// How clusters store power and area
    #[arg(
        long,
        value_enum,
        help = with_default_name(
            "How clusters store power and area",
            |settings| settings.method
        ),
        help_heading = "Settings"
    )]
    pub method: Option<Method>,
    /// How the error of a link is estimated
    #[arg(
        long,
        value_enum,
        help = with_default_name(
            "How the error of a link is estimated",
            |settings| settings.oracle
        ),
        help_heading = "Settings"
    )]
    pub oracle: Option<Oracle>,
    /// How direct light is computed
    #[arg(
        long,
        value_enum,
        help = with_default_name(
            "How direct light is computed",
            |settings| settings.direct
        ),
        help_heading = "Settings"
    )]
    pub direct: Option<Direct>,
    /// Link threshold ε at the last step
    #[arg(
        long,
        value_name = "E",
        value_parser = at_least_zero,
        help = with_defaults(
            "Link threshold ε at the last step; lower is more accurate and slower",
            |settings| settings.epsilon
        ),
        help_heading = "Settings"
    )]
    pub epsilon: Option<f32>,
    /// Sample pairs of a link in the samples oracle, 1 to 4096
    #[arg(
        long,
        value_name = "P",
        value_parser = clap::value_parser!(u32).range(1..=4096),
        help = with_defaults(
            "Sample pairs for each link with --oracle samples, 1 to 4096",
            |settings| settings.samples
        ),
        help_heading = "Settings"
    )]
    pub samples: Option<u32>,
    /// Minimum area of an element as a fraction of the scene's area
    #[arg(
        long,
        value_name = "A",
        value_parser = at_least_zero,
        help = with_defaults(
            "Minimum area of an element as a fraction of the scene's area",
            |settings| settings.min_area
        ),
        help_heading = "Settings"
    )]
    pub min_area: Option<f32>,
    /// Maximum steps
    #[arg(
        long,
        value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..),
        help = with_defaults(
            "Maximum steps; the threshold is halved from step to step down to ε",
            |settings| settings.max_steps
        ),
        help_heading = "Settings"
    )]
    pub max_steps: Option<u32>,
    /// Seed of all random numbers
    #[arg(
        long,
        value_name = "N",
        help = with_defaults("Seed of all random numbers", |settings| settings.seed),
        help_heading = "Settings"
    )]
    pub seed: Option<u64>,
    /// Do not omit this where the scene does not need it; may be given several times
    #[arg(long, value_enum, value_name = "NAME", help_heading = "Settings")]
    pub keep: Vec<Omission>,
    /// Omit nothing that the scene does not need
    #[arg(long, conflicts_with = "keep", help_heading = "Settings")]
    pub keep_all: bool,
}

impl SettingFlags {
    /// The preset with every given flag put in.
    pub fn settings(&self) -> SolveSettings {
        let preset = match (self.error, self.preset.unwrap_or_default()) {
            (Some(error), _) => SolveSettings::towards(error),
            (None, Preset::Draft) => SolveSettings::draft(),
            (None, Preset::Normal) => SolveSettings::normal(),
            (None, Preset::Final) => SolveSettings::finest(),
        };
        SolveSettings {
            method: self.method.unwrap_or(preset.method),
            oracle: self.oracle.unwrap_or(preset.oracle),
            direct: self.direct.unwrap_or(preset.direct),
            epsilon: self.epsilon.unwrap_or(preset.epsilon),
            samples: self.samples.unwrap_or(preset.samples),
            min_area: self.min_area.unwrap_or(preset.min_area),
            max_steps: self.max_steps.unwrap_or(preset.max_steps),
            seed: self.seed.unwrap_or(preset.seed),
            keep: self.kept(),
            // Those without a flag.
            push: preset.push,
            shadow_samples: preset.shadow_samples,
            mesh_tolerance: preset.mesh_tolerance,
            crease_degrees: preset.crease_degrees,
            tolerance: preset.tolerance,
            error: preset.error,
        }
    }

    fn kept(&self) -> Keep {
        if self.keep_all {
            return Keep::ALL;
        }
        Keep::from(self.keep.clone())
    }

    /// Whether any of them is given.
    pub fn are_given(&self) -> bool {
        let Self {
            preset,
            error,
            method,
            oracle,
            direct,
            epsilon,
            samples,
            min_area,
            max_steps,
            seed,
            keep,
            keep_all,
        } = self;
        preset.is_some()
            || error.is_some()
            || method.is_some()
            || oracle.is_some()
            || direct.is_some()
            || epsilon.is_some()
            || samples.is_some()
            || min_area.is_some()
            || max_steps.is_some()
            || seed.is_some()
            || !keep.is_empty()
            || *keep_all
    }
}

/// Flags of [`RunOptions`].
#[derive(Clone, Debug, Args)]
pub struct LimitFlags {
    /// Stop after this time [default: none]
    #[arg(long, value_name = "SEC", value_parser = seconds, help_heading = "Limits")]
    pub time_limit: Option<Duration>,
    /// Stop when the solver uses this much memory [default: none]
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u64).range(1..=1 << 40), help_heading = "Limits")]
    pub memory_limit: Option<u64>,
    /// Solver threads [default: automatic, one for each core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024), help_heading = "Limits")]
    pub threads: Option<u16>,
}

impl LimitFlags {
    /// The options that the flags ask for.
    pub fn options(&self) -> RunOptions {
        RunOptions {
            threads: self.threads.map_or(0, usize::from),
            time_limit: self.time_limit,
            memory_limit: self.memory_limit.map(|mebibytes| mebibytes << 20),
            gives_way: false,
        }
    }
}

/// Limits of a run, and the colours of exports.
#[derive(Clone, Debug, Args)]
pub struct RunFlags {
    /// Limits
    #[command(flatten)]
    pub limits: LimitFlags,
    /// Exposure in stops [default: 0 in exported files, automatic in pictures and the window]
    #[arg(long, value_name = "EV", value_parser = exposure, allow_hyphen_values = true, help_heading = "Output")]
    pub exposure: Option<f32>,
    /// Factor on the emission of all emitters, in exported files and pictures [default: 1]
    #[arg(long, value_name = "FACTOR", value_parser = at_least_zero, help_heading = "Output")]
    pub emission_scale: Option<f32>,
    /// Tone curve of the byte colours [default: neutral]
    #[arg(long, value_enum, help_heading = "Output")]
    pub tonemap: Option<ToneMap>,
}

impl RunFlags {
    /// The options that the flags ask for.
    pub fn options(&self) -> RunOptions {
        self.limits.options()
    }

    /// How exported files of a scene with this [`crate::scene::Scene::radiance_unit`] look.
    pub fn export(&self, up: UpAxis, radiance_unit: f32) -> MeshOptions {
        MeshOptions {
            color: ColorOptions {
                exposure_ev: self.exposure.unwrap_or(0.0),
                tone_map: self.tonemap.unwrap_or_default(),
            },
            up,
            emission_scale: self.emission_scale.unwrap_or(1.0),
            radiance_unit,
            merge: false,
        }
    }
}

/// A flag's explanation with its value in every preset, in which only what differs from the default is named.
fn with_defaults<T: Display + PartialEq>(text: &str, value: fn(&SolveSettings) -> T) -> String {
    let default = value(&SolveSettings::default());
    let others = [
        ("draft", SolveSettings::draft()),
        ("final", SolveSettings::finest()),
    ];
    let differing: String = others
        .iter()
        .map(|(name, settings)| (name, value(settings)))
        .filter(|(_, value)| *value != default)
        .map(|(name, value)| format!(", {name} {value}"))
        .collect();
    format!("{text} [default: {default}{differing}]")
}

/// A flag's explanation with the name of its default.
fn with_default_name<T: ValueEnum>(text: &str, value: fn(&SolveSettings) -> T) -> String {
    let default = value(&SolveSettings::default());
    format!("{text} [default: {}]", name_of(&default))
}

/// `--reference`: what to measure the error against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reference {
    /// Path tracing with this many samples per point.
    Paths(u32),
    /// The full radiosity matrix over the triangles.
    Matrix,
}

impl Reference {
    /// Enough to tell an error of a few per cent in usual rooms.
    pub const DEFAULT_SAMPLES: u32 = 256;
}

impl FromStr for Reference {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let samples = match text.split_once('=') {
            None if text == "matrix" => return Ok(Self::Matrix),
            None if text == "paths" => Self::DEFAULT_SAMPLES,
            Some(("paths", samples)) => samples
                .parse()
                .ok()
                .filter(|&samples| samples > 0)
                .ok_or_else(|| format!("'{samples}' is not a number of samples"))?,
            _ => return Err("expected paths, paths=SAMPLES or matrix".to_owned()),
        };
        Ok(Self::Paths(samples))
    }
}

/// `--up`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum UpFlag {
    /// +Z where the floor or a comment of the exporter shows it, else +Y
    Auto,
    /// +Y
    #[value(name = "+Y")]
    Y,
    /// +Z
    #[value(name = "+Z")]
    Z,
}

impl UpFlag {
    /// The axis that is asked for.
    fn axis(self) -> Option<UpAxis> {
        match self {
            Self::Auto => None,
            Self::Y => Some(UpAxis::Y),
            Self::Z => Some(UpAxis::Z),
        }
    }
}

/// `--mtl-color`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MtlColorFlag {
    /// As they are
    Linear,
    /// Decoded from sRGB
    Srgb,
}

fn fraction(text: &str) -> Result<f32, String> {
    number(text).and_then(|value| match (0.0..=1.0).contains(&value) {
        true => Ok(value),
        false => Err("must be within 0 and 1".to_owned()),
    })
}

fn exposure(text: &str) -> Result<f32, String> {
    number(text).and_then(|value| match value.abs() <= 60.0 {
        true => Ok(value),
        false => Err("must be within -60 and 60".to_owned()),
    })
}

/// A time in seconds.
pub(super) fn seconds(text: &str) -> Result<Duration, String> {
    Duration::try_from_secs_f64(f64::from(at_least_zero(text)?)).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn explanations_tell_the_default_and_where_presets_differ() {
        assert_eq!(
            with_defaults("steps", |settings| settings.max_steps),
            "steps [default: 5, draft 3, final 6]"
        );
        assert_eq!(
            with_defaults("seed", |settings| settings.seed),
            "seed [default: 1]"
        );
        assert_eq!(
            with_default_name("a", |settings| settings.oracle),
            "a [default: interval]"
        );
    }

    #[test]
    fn a_reference_is_read_with_and_without_samples() {
        assert_eq!("paths=32".parse(), Ok(Reference::Paths(32)));
        assert!("paths".parse::<Reference>().is_ok());
        for wrong in ["paths=0", "paths=x", "photons", ""] {
            assert!(wrong.parse::<Reference>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn numbers_outside_their_range_are_refused() {
        assert!(at_least_zero("-1").is_err() && at_least_zero("nan").is_err());
        assert!(fraction("1.5").is_err() && seconds("inf").is_err());
        assert_eq!(seconds("1.5"), Ok(Duration::from_millis(1500)));
    }
}
