//! How long a solve takes to an error, from its steps so far.
//!
//! The error falls as a power of the time, e = c t^−k. The exponent k is found by linear regression of ln e on ln t, as it
//! would be from a priori knowledge: after few steps it is ½, that of noise and of elements whose error falls with their
//! area, and the steps prevail the more time they span.

use crate::solver::StepReport;

/// The exponent before anything is measured.
const EXPECTED_EXPONENT: f64 = 0.5;

/// The weight of that, as the sum of the squares of ln t over the steps that counts as much: the square of how much errors
/// of steps scatter, a quarter, over how much exponents do, a sixth. Smaller, and the first two steps promise any time;
/// larger, and a scene that converges fast or slowly is not believed.
const EXPECTATION_WEIGHT: f64 = 2.25;

/// Shortest time of a step, seconds: the logarithm of none is no number.
const SHORTEST: f64 = 1e-3;

/// Time to an error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Expected {
    /// A step has reached it.
    Reached,
    /// Seconds from the start of the run.
    After(f64),
}

/// The error by time, of the steps of a run.
#[derive(Clone, Debug, Default)]
pub struct Pace {
    /// Seconds before the first step.
    prepared: f64,
    /// Seconds from then on, and the upper end of the error's interval, by step.
    steps: Vec<[f64; 2]>,
}

impl Pace {
    /// Of a run that was prepared for so many seconds.
    pub fn new(prepared: f64) -> Self {
        Self {
            prepared,
            steps: Vec::new(),
        }
    }

    /// Of all steps of a run.
    pub fn of<'a>(prepared: f64, reports: impl IntoIterator<Item = &'a StepReport>) -> Self {
        let mut pace = Self::new(prepared);
        reports.into_iter().for_each(|report| pace.note(report));
        pace
    }

    /// Take note of a step; one without an estimated error tells nothing.
    pub fn note(&mut self, report: &StepReport) {
        let Some(estimated) = report.estimated_error else {
            return;
        };
        let seconds = (report.elapsed_s - self.prepared).max(SHORTEST);
        // Light that is finished early, or changed, belongs to the step before.
        self.steps.retain(|step| step[0] < seconds);
        if estimated.trimmed_high > 0.0 {
            self.steps.push([seconds, estimated.trimmed_high]);
        }
    }

    /// When an error is to be expected; `None` before the first step, and where errors do not fall.
    pub fn to(&self, error: f64) -> Option<Expected> {
        let [last, _] = *self.steps.last()?;
        if self.steps.iter().any(|step| step[1] <= error) {
            return Some(Expected::Reached);
        }
        let logarithms = || self.steps.iter().map(|step| step.map(f64::ln));
        let count = self.steps.len() as f64;
        let mean = |of: usize| logarithms().map(|step| step[of]).sum::<f64>() / count;
        let [time, size] = [mean(0), mean(1)];
        let squares: f64 = logarithms().map(|step| (step[0] - time).powi(2)).sum();
        let products: f64 = logarithms()
            .map(|step| (step[0] - time) * (size - step[1]))
            .sum();
        let exponent =
            (products + EXPECTATION_WEIGHT * EXPECTED_EXPONENT) / (squares + EXPECTATION_WEIGHT);
        if exponent <= 0.0 {
            return None;
        }
        let seconds = (time + (size - error.ln()) / exponent).exp();
        // A further step at least, which takes no less than the one before.
        let before = self.steps.iter().rev().nth(1).map_or(0.0, |step| step[0]);
        let next = last + (last - before);
        Some(Expected::After(self.prepared + seconds.max(next)))
    }
}

/// About how long some seconds are, for people: "12 s", "5 min".
pub fn about(seconds: f64) -> String {
    const UNITS: [(f64, &str); 3] = [(60.0, "s"), (3600.0, "min"), (86400.0, "h")];
    let mut size = 1.0;
    for (end, unit) in UNITS {
        let count = rounded(seconds / size);
        if count * size < end {
            return format!("{count} {unit}");
        }
        size = end;
    }
    format!("{} d", rounded(seconds / size))
}

/// One digit below ten, whole numbers below twenty, and multiples of five from there on: more would be a promise.
fn rounded(value: f64) -> f64 {
    match value {
        _ if value < 1.0 => ((10.0 * value).round() / 10.0).max(0.1),
        _ if value < 20.0 => value.round(),
        _ => 5.0 * (value / 5.0).round(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::EstimatedError;

    /// A run of errors at times.
    fn pace(prepared: f64, steps: impl IntoIterator<Item = (f64, f64)>) -> Pace {
        let report = |(elapsed_s, trimmed_high)| StepReport {
            elapsed_s,
            estimated_error: Some(EstimatedError {
                trimmed_high,
                ..EstimatedError::default()
            }),
            ..StepReport::default()
        };
        let reports: Vec<StepReport> = steps.into_iter().map(report).collect();
        Pace::of(prepared, &reports)
    }

    fn seconds(pace: &Pace, error: f64) -> f64 {
        match pace.to(error) {
            Some(Expected::After(seconds)) => seconds,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn powers_of_the_expected_exponent_go_on() {
        let steps = |count: i32| (0..count).map(|step| (3.0 + 4f64.powi(step), 0.5f64.powi(step)));
        for count in 1..6 {
            let found = seconds(&pace(3.0, steps(count)), 0.5f64.powi(8));
            assert!((found - 3.0 - 4f64.powi(8)).abs() < 1.0, "{count}: {found}");
        }
    }

    #[test]
    fn other_exponents_prevail_with_the_time_that_is_seen() {
        // Halved with each doubling of the time.
        let run = |count: i32| {
            pace(
                0.0,
                (0..count).map(|step| (2f64.powi(step), 0.5f64.powi(step))),
            )
        };
        let beyond = |count: i32| {
            let wanted = 0.5f64.powi(count + 2);
            seconds(&run(count), wanted) / 2f64.powi(count + 2)
        };
        let found = [2, 4, 8, 16].map(beyond);
        assert!(found.is_sorted_by(|a, b| a > b), "{found:?}");
        assert!(
            found[0] > 3.0 && found[3] < 1.2 && found[3] >= 1.0,
            "{found:?}"
        );
    }

    #[test]
    fn nothing_is_promised_before_a_step_and_nothing_after_it_is_reached() {
        assert_eq!(pace(1.0, []).to(0.1), None);
        let run = pace(1.0, [(2.0, 0.08), (3.0, 0.04)]);
        assert_eq!(run.to(0.05), Some(Expected::Reached));
        assert!(seconds(&run, 0.039) >= 4.0);
    }

    #[test]
    fn errors_that_do_not_fall_promise_no_end() {
        let rising = (0..8).map(|step| (4f64.powi(step), 2f64.powi(step)));
        assert_eq!(pace(0.0, rising).to(0.01), None);
    }

    #[test]
    fn times_have_few_digits() {
        for (seconds, text) in [
            (0.0, "0.1 s"),
            (0.34, "0.3 s"),
            (4.2, "4 s"),
            (12.4, "12 s"),
            (43.0, "45 s"),
            (58.0, "1 min"),
            (130.0, "2 min"),
            (1500.0, "25 min"),
            (3590.0, "1 h"),
            (80_000.0, "20 h"),
            (1e6, "12 d"),
        ] {
            assert_eq!(about(seconds), text, "{seconds}");
        }
    }
}
