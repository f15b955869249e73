//! The runs on a scene: which methods, oracles, thresholds and sample counts, and which baselines.
//!
//! The first of each list is the base; the others are tried one at a time, so that the number of runs is the sum of the
//! lengths of the lists. `--full` asks for their product.

use anyhow::{Result, bail};
use clap::{Args, ValueEnum};

use crate::{
    cli::{
        Preset, SettingFlags, UsageError,
        values::{at_least_zero, name_of},
    },
    solver::{Method, Oracle, SolveSettings},
};

/// Flags that say what is run.
#[derive(Clone, Debug, Args)]
pub struct ReportRunFlags {
    /// Methods to run [default: all, the one of the settings first]
    #[arg(long, value_enum, value_delimiter = ',', help_heading = "Runs")]
    pub methods: Vec<Method>,
    /// Oracles to run [default: both, the one of the settings first]
    #[arg(long, value_enum, value_delimiter = ',', help_heading = "Runs")]
    pub oracles: Vec<Oracle>,
    /// Thresholds to run, each with the mesh and the samples of the nearest preset [default: that of the settings, and
    /// those of the other presets]
    #[arg(long, value_name = "E", value_delimiter = ',', value_parser = above_zero, help_heading = "Runs")]
    pub epsilons: Vec<f32>,
    /// Sample counts of the samples oracle to run [default: that of the settings, and 16]
    #[arg(long, value_name = "P", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=4096), help_heading = "Runs")]
    pub sample_counts: Vec<u32>,
    /// Run every combination, not one change at a time
    #[arg(long, help_heading = "Runs")]
    pub full: bool,
    /// Baselines to run beside the solver
    #[arg(
        long,
        value_enum,
        value_delimiter = ',',
        default_value = "bake,jacobi",
        help_heading = "Runs"
    )]
    pub baselines: Vec<Baseline>,
    /// Maximum paths per vertex of the bake
    #[arg(long, value_name = "N", default_value = "4096", value_parser = clap::value_parser!(u32).range(1..=1 << 24), help_heading = "Runs")]
    pub max_spp: u32,
    /// Triangles of the rooms in the scaling suite [default: 1022 to 1000000, about fourfold each]
    #[arg(long, value_name = "N", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1_000..=16_000_000), help_heading = "Runs")]
    pub sizes: Vec<u32>,
    /// Cases of the stability, exact and cie171 suites to try, or scenes of the plan suite: groups, or parts of names [default: all]
    #[arg(
        long,
        value_name = "NAME",
        value_delimiter = ',',
        help_heading = "Runs"
    )]
    pub cases: Vec<String>,
    /// Repetitions of each run, of whose times the median is taken; best odd; at least 3 for quick scenes of the plan suite
    #[arg(long, value_name = "N", default_value = "1", value_parser = clap::value_parser!(u32).range(1..=99), help_heading = "Runs")]
    pub repeats: u32,
}

/// `--baselines`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Baseline {
    /// Path tracing at the vertices of the solver's first and last mesh
    Bake,
    /// Stochastic Jacobi radiosity on few and on many elements
    Jacobi,
    /// Nothing
    None,
}

/// A solver run.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Configuration {
    /// Its label.
    pub(super) label: String,
    /// Its settings.
    pub(super) settings: SolveSettings,
}

/// Sample pairs beside those of the settings: enough that max − min seldom misses much.
const MANY_SAMPLES: u32 = 16;

impl ReportRunFlags {
    /// Those of a suite's cases that one of `--cases` means; all where none is given.
    ///
    /// # Errors
    /// A usage error that calls them `what`, where a word means none.
    pub(super) fn chosen<T>(
        &self,
        mut cases: Vec<T>,
        is_meant: impl Fn(&T, &str) -> bool,
        what: &str,
    ) -> Result<Vec<T>> {
        let words = &self.cases;
        if let Some(word) = words
            .iter()
            .find(|word| !cases.iter().any(|case| is_meant(case, word)))
        {
            bail!(UsageError(format!("no {what} suite is named '{word}'")));
        }
        cases.retain(|case| words.is_empty() || words.iter().any(|word| is_meant(case, word)));
        Ok(cases)
    }

    /// The solver runs, the base first, none twice.
    pub(super) fn configurations(&self, setting_flags: &SettingFlags) -> Vec<Configuration> {
        let base = setting_flags.settings();
        let lists = Lists::new(self, &base);
        let mut settings = if self.full {
            lists.product(setting_flags)
        } else {
            lists.one_at_a_time(setting_flags)
        };
        let mut seen: Vec<SolveSettings> = Vec::new();
        settings.retain(|settings| {
            let is_new = !seen.contains(settings);
            if is_new {
                seen.push(settings.clone());
            }
            is_new
        });
        let first = lists.epsilons[0];
        let named = |settings: SolveSettings| Configuration {
            label: label(&settings, first),
            settings,
        };
        settings.into_iter().map(named).collect()
    }
}

/// The lists with their defaults put in; none is empty.
struct Lists {
    methods: Vec<Method>,
    oracles: Vec<Oracle>,
    epsilons: Vec<f32>,
    sample_counts: Vec<u32>,
}

impl Lists {
    fn new(flags: &ReportRunFlags, base: &SolveSettings) -> Self {
        let presets = [
            SolveSettings::draft(),
            SolveSettings::normal(),
            SolveSettings::finest(),
        ];
        let all_methods = Method::value_variants().iter();
        let all_oracles = Oracle::value_variants().iter();
        Self {
            methods: given_or(
                flags.methods.iter().copied(),
                base.method,
                all_methods.copied(),
            ),
            oracles: given_or(
                flags.oracles.iter().copied(),
                base.oracle,
                all_oracles.copied(),
            ),
            epsilons: given_or(
                flags.epsilons.iter().copied(),
                base.epsilon,
                presets.iter().map(|preset| preset.epsilon),
            ),
            sample_counts: given_or(
                flags.sample_counts.iter().copied(),
                base.samples,
                [MANY_SAMPLES].into_iter(),
            ),
        }
    }

    /// The base, then every other entry of each list in its place.
    fn one_at_a_time(&self, flags: &SettingFlags) -> Vec<SolveSettings> {
        let base = at(flags, self.methods[0], self.oracles[0], self.epsilons[0]);
        let base = SolveSettings {
            samples: self.sample_counts[0],
            ..base
        };
        let mut runs = vec![base.clone()];
        runs.extend(self.methods.iter().map(|&method| SolveSettings {
            method,
            ..base.clone()
        }));
        for &oracle in &self.oracles {
            runs.extend(
                self.samples_of(oracle)
                    .iter()
                    .map(|&samples| SolveSettings {
                        oracle,
                        samples,
                        ..base.clone()
                    }),
            );
        }
        runs.extend(self.epsilons.iter().map(|&epsilon| SolveSettings {
            samples: base.samples,
            ..at(flags, self.methods[0], self.oracles[0], epsilon)
        }));
        runs
    }

    /// Every combination.
    fn product(&self, flags: &SettingFlags) -> Vec<SolveSettings> {
        let mut runs = Vec::new();
        for &epsilon in &self.epsilons {
            for &method in &self.methods {
                for &oracle in &self.oracles {
                    runs.extend(
                        self.samples_of(oracle)
                            .iter()
                            .map(|&samples| SolveSettings {
                                samples,
                                ..at(flags, method, oracle, epsilon)
                            }),
                    );
                }
            }
        }
        runs
    }

    /// The sample counts that make a difference.
    fn samples_of(&self, oracle: Oracle) -> &[u32] {
        match oracle {
            Oracle::Samples => &self.sample_counts,
            Oracle::Interval => &self.sample_counts[..1],
        }
    }
}

/// The given values, or else the base and all others.
fn given_or<T: PartialEq>(
    given: impl Iterator<Item = T>,
    base: T,
    all: impl Iterator<Item = T>,
) -> Vec<T> {
    let given: Vec<T> = given.collect();
    if !given.is_empty() {
        return given;
    }
    let mut values = vec![base];
    for value in all {
        if !values.contains(&value) {
            values.push(value);
        }
    }
    values
}

/// Settings for a threshold: links alone make light no better than its mesh and its direct samples, so these come from
/// the nearest preset, and the tolerance of the mesh follows the threshold. Flags that were given stay.
fn at(flags: &SettingFlags, method: Method, oracle: Oracle, epsilon: f32) -> SolveSettings {
    let base = flags.settings();
    if epsilon.to_bits() == base.epsilon.to_bits() {
        return SolveSettings {
            method,
            oracle,
            ..base
        };
    }
    let distance = |preset: &Preset| {
        let of_preset = SettingFlags {
            preset: Some(*preset),
            epsilon: None,
            ..flags.clone()
        };
        (of_preset.settings().epsilon / epsilon).ln().abs()
    };
    let nearest = [Preset::Draft, Preset::Normal, Preset::Final]
        .into_iter()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
        .unwrap_or(flags.preset.unwrap_or_default());
    let preset = SettingFlags {
        preset: Some(nearest),
        epsilon: None,
        ..flags.clone()
    }
    .settings();
    SolveSettings {
        method,
        oracle,
        epsilon,
        mesh_tolerance: preset.mesh_tolerance * (epsilon / preset.epsilon),
        ..preset
    }
}

/// The label of a run, unique among the runs.
fn label(settings: &SolveSettings, usual_epsilon: f32) -> String {
    let mut label = name_of(&settings.method);
    if settings.oracle == Oracle::Samples {
        label += &format!(", {} samples", settings.samples);
    }
    if settings.epsilon.to_bits() != usual_epsilon.to_bits() {
        label += &format!(", ε = {}", settings.epsilon);
    }
    label
}

fn above_zero(text: &str) -> Result<f32, String> {
    at_least_zero(text).and_then(|value| match value > 0.0 {
        true => Ok(value),
        false => Err("must be above 0".to_owned()),
    })
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        runs: ReportRunFlags,
        #[command(flatten)]
        settings: SettingFlags,
    }

    fn runs(arguments: &[&str]) -> Vec<Configuration> {
        let line = Line::try_parse_from([&["test"], arguments].concat()).unwrap();
        line.runs.configurations(&line.settings)
    }

    fn labels(arguments: &[&str]) -> Vec<String> {
        let labels = runs(arguments).into_iter().map(|run| run.label);
        labels.collect()
    }

    #[test]
    fn the_usual_runs_change_one_thing_at_a_time() {
        assert_eq!(
            labels(&[]),
            [
                "bounded",
                "six-face",
                "single",
                "exact",
                "isotropic",
                "bounded, 4 samples",
                "bounded, 16 samples",
                "bounded, ε = 0.03",
                "bounded, ε = 0.002",
            ]
        );
        let usual = runs(&[]);
        assert_eq!(usual[0].settings, SolveSettings::normal());
        assert_eq!(usual[7].settings, SolveSettings::draft());
        assert_eq!(usual[8].settings, SolveSettings::finest());
    }

    #[test]
    fn lists_restrict_the_runs() {
        let few = [
            "--methods",
            "single",
            "--oracles",
            "samples",
            "--epsilons",
            "0.02",
        ];
        assert_eq!(labels(&few), ["single, 4 samples", "single, 16 samples"]);
        let two = [&few[..], &["--sample-counts", "2,8"]].concat();
        assert_eq!(labels(&two), ["single, 2 samples", "single, 8 samples"]);
        assert!(Line::try_parse_from(["test", "--epsilons", "0"]).is_err());
    }

    #[test]
    fn full_runs_are_the_product() {
        let lists = [
            "--full",
            "--methods",
            "bounded,exact",
            "--epsilons",
            "0.1,0.05",
        ];
        // Two methods, two thresholds, and the interval once or samples twice.
        assert_eq!(runs(&lists).len(), 12);
    }

    #[test]
    fn a_threshold_brings_its_mesh_but_no_flag_that_was_given() {
        let runs = runs(&["--epsilons", "0.005,0.06", "--min-area", "0.5"]);
        let coarse = &runs[runs.len() - 1].settings;
        let draft = SolveSettings::draft();
        assert!((coarse.mesh_tolerance - 2.0 * draft.mesh_tolerance).abs() < 1e-6);
        assert_eq!(coarse.shadow_samples, draft.shadow_samples);
        assert_eq!(coarse.min_area.to_bits(), 0.5_f32.to_bits());
    }
}
