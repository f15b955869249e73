//! All runs on one scene side by side: rows for a table of figures, and a Markdown table to read.

use serde::Serialize;

use super::{Measurement, Runner, Trajectory, error_text, smallest_error};
use crate::sampling::SampledSurfaces;

/// Errors for which the table has the time.
pub const TARGETS: [f64; 4] = [0.1, 0.05, 0.02, 0.01];

/// Errors at which runs are compared with the bake.
const RATIO_TARGETS: [f64; 2] = [0.1, 0.05];

/// The reference of errors.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReferenceFacts {
    /// The surfaces that the errors are means over.
    pub surfaces: SampledSurfaces,
    /// Surface points.
    pub points: usize,
    /// Paths at each point.
    pub samples: u32,
    /// Its noise, root mean square over the points, relative; subtracted from every error.
    pub noise_floor: f64,
    /// Seconds that it took.
    pub seconds: f64,
}

/// All runs on one scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SceneComparison {
    /// Name of the scene.
    pub scene: String,
    /// Its triangles.
    pub triangles: usize,
    /// The reference of errors.
    pub reference: ReferenceFacts,
    /// The runs, in the order of the plan.
    pub runs: Vec<Trajectory>,
}

/// One line of the table of figures. Field names are its header.
#[derive(Debug, Serialize)]
pub struct Row<'a> {
    scene: &'a str,
    triangles: usize,
    run: &'a str,
    runner: Runner,
    step: u32,
    time_s: f64,
    error_trimmed: f64,
    error_rms: f64,
    energy_ratio: Option<f64>,
    epsilon: Option<f32>,
    samples: Option<u32>,
    rays: u64,
    links: u64,
    elements: u64,
    memory_bytes: u64,
    reference_noise: f64,
    repeats: u32,
    is_cut_short: bool,
}

impl SceneComparison {
    /// A row for every measurement.
    pub fn rows(&self) -> impl Iterator<Item = Row<'_>> {
        self.runs.iter().flat_map(move |run| {
            let points = run.points.iter();
            points.map(move |point| row(self, run, point))
        })
    }

    /// Seconds in which the fastest bake reaches a target.
    pub fn bake_time_to(&self, target: f64) -> Option<f64> {
        self.runs
            .iter()
            .filter(|run| run.runner == Runner::Bake)
            .filter_map(|run| run.time_to(target))
            .map(|crossing| crossing.time_s)
            .min_by(f64::total_cmp)
    }

    /// The smallest error that is distinguishable from 0.
    pub fn smallest_error(&self) -> f64 {
        smallest_error(self.reference.noise_floor)
    }

    /// A Markdown table with a line for each run.
    pub fn markdown(&self) -> String {
        let mut text = String::from("| run |");
        for target in TARGETS {
            text += &format!(" {:.0} % |", 100.0 * target);
        }
        text += " best | after | rays | links | memory |";
        for target in RATIO_TARGETS {
            text += &format!(" bake ÷ run at {:.0} % |", 100.0 * target);
        }
        text += "\n|---|";
        text += &"---:|".repeat(TARGETS.len() + 5 + RATIO_TARGETS.len());
        for run in &self.runs {
            text += &self.markdown_line(run);
        }
        text + "\n"
    }

    fn markdown_line(&self, run: &Trajectory) -> String {
        let mut line = format!("\n| {} |", run.marked_label().replace('|', "/"));
        for target in TARGETS {
            line += &format!(" {} |", self.time_cell(run, target));
        }
        let Some(best) = run.best() else {
            return line + &" – |".repeat(5 + RATIO_TARGETS.len());
        };
        line += &format!(
            " {} | {} | {} | {} | {} MiB |",
            error_text(best.error.relative_rms_trimmed, self.reference.noise_floor),
            seconds(best.time_s),
            grouped(best.rays),
            if run.runner == Runner::Solver {
                grouped(best.links)
            } else {
                "–".to_owned()
            },
            digits(best.memory_bytes as f64 / f64::from(1 << 20)),
        );
        for target in RATIO_TARGETS {
            line += &format!(" {} |", self.ratio_cell(run, target));
        }
        line
    }

    fn time_cell(&self, run: &Trajectory, target: f64) -> String {
        let Some(crossing) = run.time_to(target) else {
            return "–".to_owned();
        };
        if target < self.smallest_error() {
            return "?".to_owned();
        }
        let sign = if crossing.is_bound { "≤ " } else { "" };
        format!("{sign}{}", seconds(crossing.time_s))
    }

    /// How many times as long as this run the bake takes; a bound where the bake or this run is known by a bound only.
    fn ratio_cell(&self, run: &Trajectory, target: f64) -> String {
        let Some(crossing) = run.time_to(target) else {
            return "–".to_owned();
        };
        let own = crossing.time_s.max(f64::MIN_POSITIVE);
        if let Some(bake) = self.bake_time_to(target) {
            let sign = if crossing.is_bound { "≥ " } else { "" };
            return format!("{sign}{}", digits(bake / own));
        }
        let longest = self
            .runs
            .iter()
            .filter(|run| run.runner == Runner::Bake)
            .filter_map(|run| run.points.last())
            .map(|last| last.time_s)
            .max_by(f64::total_cmp);
        longest.map_or("–".to_owned(), |time| format!("> {}", digits(time / own)))
    }
}

fn row<'a>(scene: &'a SceneComparison, run: &'a Trajectory, point: &Measurement) -> Row<'a> {
    Row {
        scene: &scene.scene,
        triangles: scene.triangles,
        run: &run.label,
        runner: run.runner,
        step: point.step,
        time_s: point.time_s,
        error_trimmed: point.error.relative_rms_trimmed,
        error_rms: point.error.relative_rms,
        energy_ratio: point.error.energy_ratio,
        epsilon: point.epsilon,
        samples: point.samples,
        rays: point.rays,
        links: point.links,
        elements: point.elements,
        memory_bytes: point.memory_bytes,
        reference_noise: scene.reference.noise_floor,
        repeats: run.repeats,
        is_cut_short: run.is_cut_short,
    }
}

/// Seconds with three significant digits or less.
fn seconds(value: f64) -> String {
    format!("{} s", digits(value))
}

/// About two or three significant digits.
pub fn digits(value: f64) -> String {
    match value.abs() {
        small if small < 1.0 => format!("{value:.2}"),
        middle if middle < 10.0 => format!("{value:.1}"),
        _ => grouped(value.round().max(0.0) as u64),
    }
}

/// A count with a comma at every thousand.
pub fn grouped(count: u64) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::{trajectory::CUT_SHORT_MARK, trajectory::tests::trajectory_along};

    fn run(label: &str, runner: Runner, curve: &[(f64, f64)]) -> Trajectory {
        Trajectory {
            label: label.to_owned(),
            runner,
            ..trajectory_along(curve)
        }
    }

    fn comparison() -> SceneComparison {
        SceneComparison {
            scene: "box".to_owned(),
            triangles: 12,
            reference: ReferenceFacts {
                surfaces: SampledSurfaces::default(),
                points: 10,
                samples: 8,
                noise_floor: 0.01,
                seconds: 1.0,
            },
            runs: vec![
                run("bounded", Runner::Solver, &[(1.0, 0.2), (2.0, 0.04)]),
                run("bake", Runner::Bake, &[(4.0, 0.2), (16.0, 0.1)]),
                run("nothing", Runner::Jacobi, &[]),
            ],
        }
    }

    #[test]
    fn all_lines_of_the_table_have_as_many_cells() {
        let table = comparison().markdown();
        let cells: Vec<usize> = table
            .lines()
            .map(|line| line.matches('|').count())
            .collect();
        assert_eq!(cells, [13; 5], "{table}");
    }

    #[test]
    fn the_ratio_to_a_bake_is_a_bound_where_the_bake_never_arrives() {
        let comparison = comparison();
        // The run falls by 5 in a doubling: 10 % after 2^(ln 2 / ln 5) = 1.348 s, the bake after 16 s.
        assert_eq!(comparison.ratio_cell(&comparison.runs[0], 0.1), "12");
        assert!(
            comparison
                .ratio_cell(&comparison.runs[0], 0.05)
                .starts_with("> ")
        );
        assert_eq!(comparison.ratio_cell(&comparison.runs[2], 0.1), "–");
        assert_eq!(comparison.rows().count(), 4);
    }

    #[test]
    fn errors_within_the_noise_are_not_told() {
        let mut comparison = comparison();
        comparison.runs = vec![run("good", Runner::Solver, &[(1.0, 0.2), (2.0, 0.0)])];
        comparison.reference.noise_floor = 0.05;
        let table = comparison.markdown();
        // 0.3 of 5 %: 2 % is told, 1 % is not.
        assert!(table.contains("| ? | below noise (5.0 %) |"), "{table}");
        comparison.reference.noise_floor = 0.001;
        assert!(comparison.markdown().contains("below noise (0.10 %)"));
    }

    #[test]
    fn runs_that_were_cut_short_are_marked() {
        let mut comparison = comparison();
        assert!(!comparison.markdown().contains(CUT_SHORT_MARK));
        comparison.runs[1].is_cut_short = true;
        let table = comparison.markdown();
        let marked: Vec<&str> = table
            .lines()
            .filter(|line| line.contains(CUT_SHORT_MARK))
            .collect();
        assert_eq!(marked.len(), 1, "{table}");
        assert!(marked[0].starts_with("| bake † |"), "{table}");
        let cut: Vec<bool> = comparison.rows().map(|row| row.is_cut_short).collect();
        assert_eq!(cut, [false, false, true, true]);
    }

    #[test]
    fn numbers_are_grouped_and_cut() {
        assert_eq!(grouped(0), "0");
        assert_eq!(grouped(999), "999");
        assert_eq!(grouped(1_000), "1,000");
        assert_eq!(grouped(12_345_678), "12,345,678");
        assert_eq!(
            (digits(0.123).as_str(), digits(1.26).as_str()),
            ("0.12", "1.3")
        );
        assert_eq!(digits(1234.5), "1,235");
    }
}
