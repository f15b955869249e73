//! How the error of one run falls with time, and when it passes a target.

use serde::Serialize;

use super::ErrorMeasures;
use crate::solver::SolveSettings;

/// Error and cost of a run at one moment.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Measurement {
    /// Number of the step or pass, from 1.
    pub step: u32,
    /// Seconds of computing, preparation included, measuring excluded; the median where a run was repeated.
    pub time_s: f64,
    /// Link threshold of the step, for solver runs.
    pub epsilon: Option<f32>,
    /// Samples per vertex, for bakes.
    pub samples: Option<u32>,
    /// Rays shot so far.
    pub rays: u64,
    /// Links in use; 0 without links.
    pub links: u64,
    /// Elements that receive light, or vertices of a bake.
    pub elements: u64,
    /// Bytes in use.
    pub memory_bytes: u64,
    /// How far off the light is.
    pub error: ErrorMeasures,
}

/// The runner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Runner {
    /// The solver of this program.
    Solver,
    /// Path tracing at vertices.
    Bake,
    /// Stochastic Jacobi radiosity.
    Jacobi,
}

/// A run as it was measured: error over time.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Trajectory {
    /// Its label in plots and tables.
    pub label: String,
    /// The runner.
    pub runner: Runner,
    /// Its settings, for solver runs.
    pub settings: Option<SolveSettings>,
    /// Runs behind the median times.
    pub repeats: u32,
    /// Whether a limit or an interruption came before the end of its settings; of repeated runs, before any one's.
    pub is_cut_short: bool,
    /// In the order of time.
    pub points: Vec<Measurement>,
}

/// The moment at which a run passes a target.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Crossing {
    /// Seconds of computing.
    pub time_s: f64,
    /// Whether the first measurement is already past the target, so that the time is only an upper bound.
    pub is_bound: bool,
}

/// Behind the names of runs in tables that a limit or an interruption cut short.
pub const CUT_SHORT_MARK: char = '†';

/// Errors below this are taken for it where a logarithm is needed; a noise-corrected error may be 0.
const SMALLEST_ERROR: f64 = 1e-9;

impl Trajectory {
    /// Its name, marked where it was cut short.
    pub fn marked_label(&self) -> String {
        match self.is_cut_short {
            true => format!("{} {CUT_SHORT_MARK}", self.label),
            false => self.label.clone(),
        }
    }

    /// When the trimmed error first reaches `target` (relative, above 0), interpolated between measurements in the
    /// logarithms of both; `None` if it never does.
    pub fn time_to(&self, target: f64) -> Option<Crossing> {
        let curve = self
            .points
            .iter()
            .map(|point| (point.time_s, point.error.relative_rms_trimmed));
        time_to_error(curve, target)
    }

    /// The measurement with the smallest trimmed error.
    pub fn best(&self) -> Option<&Measurement> {
        self.points.iter().min_by(|a, b| {
            let [a, b] = [a, b].map(|point| point.error.relative_rms_trimmed);
            a.total_cmp(&b)
        })
    }

    /// One trajectory from repeated runs of the same thing: errors of the first, median times.
    /// Steps that only some runs reached keep the median of those. `None` without runs.
    pub fn median(runs: Vec<Self>) -> Option<Self> {
        let times: Vec<Vec<(u32, f64)>> = runs
            .iter()
            .map(|run| {
                run.points
                    .iter()
                    .map(|point| (point.step, point.time_s))
                    .collect()
            })
            .collect();
        let repeats = runs.len() as u32;
        let is_cut_short = runs.iter().any(|run| run.is_cut_short);
        let mut merged = runs.into_iter().max_by_key(|run| run.points.len())?;
        merged.repeats = repeats;
        merged.is_cut_short = is_cut_short;
        for point in &mut merged.points {
            let of_step = times
                .iter()
                .flatten()
                .filter(|(step, _)| *step == point.step)
                .map(|(_, time)| *time);
            point.time_s = median(of_step.collect());
        }
        Some(merged)
    }
}

/// When a curve of (time, error) first reaches `target`. Between two measurements, error is a power of time.
fn time_to_error(curve: impl Iterator<Item = (f64, f64)>, target: f64) -> Option<Crossing> {
    let mut before: Option<(f64, f64)> = None;
    for (time_s, error) in curve {
        if error <= target {
            let Some((early, worse)) = before else {
                return Some(Crossing {
                    time_s,
                    is_bound: true,
                });
            };
            let log = |error: f64| error.max(SMALLEST_ERROR).ln();
            let fall = log(worse) - log(error);
            let share = if fall > 0.0 {
                (log(worse) - log(target)) / fall
            } else {
                1.0
            };
            let share = share.clamp(0.0, 1.0);
            let [early, late] = [early, time_s].map(|time| time.max(f64::MIN_POSITIVE).ln());
            return Some(Crossing {
                time_s: (early + share * (late - early)).exp(),
                is_bound: false,
            });
        }
        before = Some((time_s, error));
    }
    None
}

/// The middle value, or the lower of two; 0 without values.
fn median(values: Vec<f64>) -> f64 {
    middle(values).unwrap_or(0.0)
}

/// The middle value, or the lower of two.
pub fn middle(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let middle = values.len().saturating_sub(1) / 2;
    values.get(middle).copied()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A solver's run whose trimmed error is the second number at the time of the first.
    pub(in crate::metrics) fn trajectory_along(curve: &[(f64, f64)]) -> Trajectory {
        let points = curve
            .iter()
            .enumerate()
            .map(|(index, &(time_s, error))| Measurement {
                step: index as u32 + 1,
                time_s,
                epsilon: None,
                samples: None,
                rays: 1_234_567,
                links: 0,
                elements: 1,
                memory_bytes: 3 << 20,
                error: ErrorMeasures {
                    relative_rms_trimmed: error,
                    ..ErrorMeasures::default()
                },
            });
        Trajectory {
            label: String::new(),
            runner: Runner::Solver,
            settings: None,
            repeats: 1,
            is_cut_short: false,
            points: points.collect(),
        }
    }

    #[test]
    fn a_power_law_is_crossed_where_its_formula_says() {
        // error = 0.3 / √time, sampled seldom: time = (0.3 / error)².
        let curve: Vec<(f64, f64)> = (0..5)
            .map(|i| f64::from(1 << (2 * i)))
            .map(|time| (time, 0.3 / time.sqrt()))
            .collect();
        let run = trajectory_along(&curve);
        for target in [0.25, 0.1, 0.05, 0.02] {
            let crossing = run.time_to(target).unwrap();
            let expected = (0.3 / target) * (0.3 / target);
            assert!(
                (crossing.time_s - expected).abs() < 1e-9 * expected,
                "{crossing:?}"
            );
            assert!(!crossing.is_bound);
        }
        assert_eq!(run.time_to(0.01), None);
        let bound = run.time_to(0.5).unwrap();
        assert!(bound.is_bound && (bound.time_s - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_first_crossing_counts_and_no_error_at_all_is_finite() {
        let bouncing = trajectory_along(&[(1.0, 0.2), (2.0, 0.05), (4.0, 0.2), (8.0, 0.05)]);
        assert!(bouncing.time_to(0.1).unwrap().time_s < 2.0);
        let perfect = trajectory_along(&[(1.0, 0.2), (2.0, 0.0)]);
        let time = perfect.time_to(0.01).unwrap().time_s;
        assert!((1.0..2.0).contains(&time), "{time}");
        let level = trajectory_along(&[(1.0, 0.2), (2.0, 0.2)]);
        assert!(level.time_to(0.2).unwrap().is_bound);
        assert_eq!(trajectory_along(&[]).time_to(0.1), None);
    }

    #[test]
    fn repeats_give_median_times() {
        let runs = vec![
            trajectory_along(&[(1.0, 0.2), (5.0, 0.1)]),
            trajectory_along(&[(3.0, 0.2), (6.0, 0.1), (9.0, 0.05)]),
            trajectory_along(&[(2.0, 0.2)]),
        ];
        let merged = Trajectory::median(runs).unwrap();
        let times: Vec<f64> = merged.points.iter().map(|point| point.time_s).collect();
        assert_eq!(times, [2.0, 5.0, 9.0]);
        assert_eq!(merged.repeats, 3);
        assert_eq!(Trajectory::median(Vec::new()), None);
    }
}
