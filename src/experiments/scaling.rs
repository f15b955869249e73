//! How cost grows with the size of a scene.

use serde::Serialize;

use crate::metrics::{CUT_SHORT_MARK, Trajectory, digits, error_text, grouped};

/// Cost of one run on a scene of some size. Field names are the header of the table of figures.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SizeCost {
    /// Triangles of the scene.
    pub triangles: usize,
    /// Seconds to the first light on the surfaces: preparation and the first step.
    pub first_light_s: Option<f64>,
    /// Seconds to 10 % trimmed error.
    pub to_10_percent_s: Option<f64>,
    /// Seconds to 5 % trimmed error.
    pub to_5_percent_s: Option<f64>,
    /// Seconds of the whole run, unless it was cut short.
    pub whole_s: Option<f64>,
    /// Smallest trimmed error.
    pub best_error: Option<f64>,
    /// Links at the end, for each triangle.
    pub links_per_triangle: f64,
    /// Rays of the whole run, for each triangle.
    pub rays_per_triangle: f64,
    /// Bytes at the end.
    pub memory_bytes: u64,
    /// Whether a limit or an interruption cut the run short; other figures are then those until it came.
    pub is_cut_short: bool,
    /// Noise of the reference, relative.
    pub reference_noise: f64,
}

impl SizeCost {
    /// Read the figures off a run.
    pub fn of(triangles: usize, run: &Trajectory, reference_noise: f64) -> Self {
        let seconds_to = |target| run.time_to(target).map(|crossing| crossing.time_s);
        let last = run.points.last();
        let per_triangle = |count: Option<u64>| count.unwrap_or(0) as f64 / triangles.max(1) as f64;
        Self {
            triangles,
            first_light_s: run.points.first().map(|first| first.time_s),
            to_10_percent_s: seconds_to(0.1),
            to_5_percent_s: seconds_to(0.05),
            whole_s: last.filter(|_| !run.is_cut_short).map(|last| last.time_s),
            best_error: run.best().map(|best| best.error.relative_rms_trimmed),
            links_per_triangle: per_triangle(last.map(|last| last.links)),
            rays_per_triangle: per_triangle(last.map(|last| last.rays)),
            memory_bytes: last.map_or(0, |last| last.memory_bytes),
            is_cut_short: run.is_cut_short,
            reference_noise,
        }
    }
}

/// A figure of [`SizeCost`] that is fitted and drawn.
pub struct CostKind {
    /// Its label.
    pub label: &'static str,
    /// Its value in seconds, where it is known.
    pub seconds: fn(&SizeCost) -> Option<f64>,
}

/// The times that growth is fitted to.
pub const COST_KINDS: [CostKind; 4] = [
    CostKind {
        label: "first light",
        seconds: |cost| cost.first_light_s,
    },
    CostKind {
        label: "10 %",
        seconds: |cost| cost.to_10_percent_s,
    },
    CostKind {
        label: "5 %",
        seconds: |cost| cost.to_5_percent_s,
    },
    CostKind {
        label: "whole run",
        seconds: |cost| cost.whole_s,
    },
];

/// The exponent b of the power law `y = a x^b` that fits points best in the logarithms of both; `None` where fewer
/// than two different positive x are known.
fn fitted_exponent(points: impl Iterator<Item = (f64, f64)>) -> Option<f64> {
    let logs: Vec<(f64, f64)> = points
        .filter(|(x, y)| *x > 0.0 && *y > 0.0)
        .map(|(x, y)| (x.ln(), y.ln()))
        .collect();
    let count = logs.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| logs.iter().map(of).sum::<f64>() / count;
    let (x_mean, y_mean) = (mean(|log| log.0), mean(|log| log.1));
    let spread: f64 = logs.iter().map(|log| (log.0 - x_mean).powi(2)).sum();
    let shared: f64 = logs
        .iter()
        .map(|log| (log.0 - x_mean) * (log.1 - y_mean))
        .sum();
    (spread > 0.0).then(|| shared / spread)
}

/// Exponent of a kind of cost over all sizes where it is known.
pub fn exponent_of(costs: &[SizeCost], kind: &CostKind) -> Option<f64> {
    fitted_exponent(
        costs
            .iter()
            .filter_map(|cost| Some((cost.triangles as f64, (kind.seconds)(cost)?))),
    )
}

/// A Markdown table with a line for each size and one for the exponents.
pub fn scaling_markdown(costs: &[SizeCost]) -> String {
    let mut text = String::from("| triangles |");
    for kind in &COST_KINDS {
        text += &format!(" {} |", kind.label);
    }
    text += " best error | links per triangle | rays per triangle | memory |\n|---:|";
    text += &"---:|".repeat(COST_KINDS.len() + 4);
    for cost in costs {
        text += &format!("\n| {}", grouped(cost.triangles as u64));
        if cost.is_cut_short {
            text += &format!(" {CUT_SHORT_MARK}");
        }
        text += " |";
        for kind in &COST_KINDS {
            let cell =
                (kind.seconds)(cost).map_or("–".to_owned(), |s| format!("{} s", digits(s)));
            text += &format!(" {cell} |");
        }
        let error = cost.best_error.map_or("–".to_owned(), |error| {
            error_text(error, cost.reference_noise)
        });
        text += &format!(
            " {error} | {} | {} | {} MiB |",
            digits(cost.links_per_triangle),
            digits(cost.rays_per_triangle),
            digits(cost.memory_bytes as f64 / f64::from(1 << 20)),
        );
    }
    text += "\n| exponent |";
    for kind in &COST_KINDS {
        let cell = exponent_of(costs, kind).map_or("–".to_owned(), |power| format!("{power:.2}"));
        text += &format!(" {cell} |");
    }
    text + " | | | |\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cost(triangles: usize, seconds: f64) -> SizeCost {
        SizeCost {
            triangles,
            first_light_s: Some(seconds),
            to_10_percent_s: None,
            to_5_percent_s: (triangles > 10).then_some(2.0 * seconds),
            whole_s: Some(9.0),
            best_error: Some(0.03),
            links_per_triangle: 3.0,
            rays_per_triangle: 40.0,
            memory_bytes: 5 << 20,
            is_cut_short: false,
            reference_noise: 0.001,
        }
    }

    #[test]
    fn a_power_law_gives_its_exponent() {
        let law = [1.0, 10.0, 1e3, 1e6].map(|n: f64| (n, 0.25 * n.powf(1.07)));
        let fitted = fitted_exponent(law.into_iter()).unwrap();
        assert!((fitted - 1.07).abs() < 1e-9, "{fitted}");
        assert_eq!(fitted_exponent([(2.0, 1.0)].into_iter()), None);
        assert_eq!(fitted_exponent([(2.0, 1.0), (2.0, 3.0)].into_iter()), None);
        assert_eq!(fitted_exponent([].into_iter()), None);
    }

    #[test]
    fn the_table_fits_what_is_known() {
        let costs = [cost(10, 1.0), cost(100, 10.0), cost(1000, 100.0)];
        let table = scaling_markdown(&costs);
        assert!(
            table.contains("| exponent | 1.00 | – | 1.00 | 0.00 |"),
            "{table}"
        );
        let counts: Vec<usize> = table
            .lines()
            .map(|line| line.matches('|').count())
            .collect();
        assert_eq!(counts, [10; 6], "{table}");
    }
}
