//! Tables of what omissions save.

use serde::Serialize;

use super::{Comparison, Cost};
use crate::metrics::{digits, grouped};

/// One run. Field names are the header of the table of figures; ratios are to the run that obeys the plan, and missing
/// where that has none of what is counted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row<'a> {
    scene: &'a str,
    triangles: usize,
    kept: &'a str,
    wall_s: f64,
    rounds: usize,
    rays: u64,
    links: u64,
    elements: u64,
    memory_bytes: u64,
    time_ratio: f64,
    rays_ratio: Option<f64>,
    links_ratio: Option<f64>,
    elements_ratio: Option<f64>,
    memory_ratio: Option<f64>,
    difference_rms: f64,
    difference_of_seeds_rms: Option<f64>,
    power_ratio: f64,
    plan_s: f64,
}

impl<'a> Row<'a> {
    /// All runs of a scene.
    pub fn of(comparison: &'a Comparison) -> Vec<Self> {
        let base = comparison.planned();
        let row = |run: &'a Cost| {
            let ratio = |of: fn(&Cost) -> u64| ratio(of(run), of(base));
            Self {
                scene: &comparison.scene,
                triangles: comparison.triangles,
                kept: run.kept,
                wall_s: run.wall_s,
                rounds: run.rounds,
                rays: run.rays,
                links: run.links,
                elements: run.elements,
                memory_bytes: run.memory_bytes,
                time_ratio: run.wall_s / base.wall_s,
                rays_ratio: ratio(|run| run.rays),
                links_ratio: ratio(|run| run.links),
                elements_ratio: ratio(|run| run.elements),
                memory_ratio: ratio(|run| run.memory_bytes),
                difference_rms: run.difference,
                difference_of_seeds_rms: comparison.noise,
                power_ratio: run.power,
                plan_s: comparison.plan_s,
            }
        };
        comparison.runs.iter().map(row).collect()
    }
}

/// How many times the second fits into the first; 1 where neither is anything.
fn ratio(count: u64, base: u64) -> Option<f64> {
    match (count, base) {
        (0, 0) => Some(1.0),
        (_, 0) => None,
        _ => Some(count as f64 / base as f64),
    }
}

/// A Markdown table with a line for each run.
pub fn omissions_markdown(comparisons: &[Comparison]) -> String {
    let mut text = String::from(
        "| scene | kept | wall time | rays | links | elements | memory | × time | × rays | × links | × elements | × memory | difference | of seeds | power |\n\
         |---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
    );
    for row in comparisons.iter().flat_map(Row::of) {
        text += &format!(
            "\n| {} | {} | {} | {} | {} | {} | {} KiB | {} | {} | {} | {} | {} | {} | {} | {:.4} |",
            row.scene,
            row.kept,
            duration(row.wall_s),
            grouped(row.rays),
            grouped(row.links),
            grouped(row.elements),
            grouped(row.memory_bytes >> 10),
            times(Some(row.time_ratio)),
            times(row.rays_ratio),
            times(row.links_ratio),
            times(row.elements_ratio),
            times(row.memory_ratio),
            per_cent(row.difference_rms),
            row.difference_of_seeds_rms.map_or("–".to_owned(), per_cent),
            row.power_ratio,
        );
    }
    text + "\n"
}

/// A Markdown table of the cost of making the plan.
pub fn overhead_markdown(comparisons: &[Comparison]) -> String {
    let mut text = String::from(
        "| scene | triangles | omitted | making the plan | share of the run |\n|---|---:|---|---:|---:|",
    );
    for comparison in comparisons {
        let omitted = match comparison.left_out.join(", ") {
            none if none.is_empty() => "nothing".to_owned(),
            names => names,
        };
        text += &format!(
            "\n| {} | {} | {omitted} | {} | {} |",
            comparison.scene,
            grouped(comparison.triangles as u64),
            duration(comparison.plan_s),
            per_cent(comparison.overhead()),
        );
    }
    text + "\n"
}

/// Seconds, or milliseconds where there are few.
fn duration(seconds: f64) -> String {
    if seconds < 0.1 {
        format!("{} ms", digits(1e3 * seconds))
    } else {
        format!("{} s", digits(seconds))
    }
}

fn times(ratio: Option<f64>) -> String {
    ratio.map_or("–".to_owned(), digits)
}

fn per_cent(share: f64) -> String {
    format!("{} %", digits(100.0 * share))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cost(kept: &'static str, wall_s: f64, rays: u64) -> Cost {
        Cost {
            kept,
            wall_s,
            rounds: 1,
            rays,
            links: 20,
            elements: 10,
            memory_bytes: 4096,
            difference: 0.003,
            power: 1.0,
        }
    }

    #[test]
    fn ratios_are_to_the_run_that_obeys_the_plan() {
        let comparison = Comparison {
            scene: "x".to_owned(),
            triangles: 3,
            left_out: vec!["rays"],
            plan_s: 0.01,
            noise: Some(0.004),
            runs: vec![cost("nothing", 0.5, 0), cost("all", 2.0, 7)],
        };
        let rows = Row::of(&comparison);
        assert_eq!((rows[0].time_ratio, rows[1].time_ratio), (1.0, 4.0));
        assert_eq!((rows[0].rays_ratio, rows[1].rays_ratio), (Some(1.0), None));
        assert_eq!(rows[1].links_ratio, Some(1.0));
        let tables = [
            omissions_markdown(std::slice::from_ref(&comparison)),
            overhead_markdown(std::slice::from_ref(&comparison)),
        ];
        for (table, columns) in tables.iter().zip([15, 5]) {
            let bars = |line: &str| line.matches('|').count();
            assert!(
                table.lines().all(|line| bars(line) == columns + 1),
                "{table}"
            );
        }
        assert!(
            tables[1].contains("| rays | 10 ms | 2.0 % |"),
            "{}",
            tables[1]
        );
    }
}
