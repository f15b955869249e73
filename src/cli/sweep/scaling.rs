//! How time and memory grow with the number of triangles: one room in sizes that grow about fourfold.

use std::io::{self, Write};

use anyhow::Result;
use serde::Serialize;

use super::{
    runs,
    session::{Session, Source},
};
use crate::{
    cli::{output::write_whole, report::Machine},
    experiments::scaling::{COST_KINDS, SizeCost, exponent_of, scaling_markdown},
    export::{Curve, CurvePlot, write_csv},
    metrics::{ReferenceFacts, Trajectory},
    solver::SolveSettings,
};

/// Triangles of the rooms; the first is the smallest of Sun, Gong and Pan.
const SIZES: [u32; 6] = [1_022, 4_096, 16_384, 65_536, 262_144, 1_000_000];

/// All results of one size.
#[derive(Serialize)]
struct Size {
    cost: SizeCost,
    reference: ReferenceFacts,
    run: Trajectory,
}

/// Everything in `scaling.json`.
#[derive(Serialize)]
struct Report<'a> {
    version: &'static str,
    machine: Machine,
    threads: usize,
    settings: SolveSettings,
    repeats: u32,
    is_interrupted: bool,
    exponents: Vec<(&'static str, Option<f64>)>,
    sizes: &'a [Size],
}

/// Run the first configuration on every size and write the files after each.
pub(super) fn scale(session: &mut Session<'_>) -> Result<()> {
    let arguments = session.arguments;
    let configurations = arguments.runs.configurations(&arguments.setting_flags);
    let Some(configuration) = configurations.into_iter().next() else {
        return Ok(());
    };
    let given = arguments.runs.sizes.as_slice();
    let wanted = if given.is_empty() { &SIZES } else { given };
    let mut sizes = Vec::new();
    for &triangles in wanted {
        if session.is_interrupted() {
            break;
        }
        let scene = session.load(&Source::Room(triangles))?;
        if let Some(truth) = session.trace(&scene) {
            let run = runs::solve(session, &scene, &truth, &configuration)?.trajectory;
            sizes.push(Size {
                cost: SizeCost::of(scene.face_count, &run, truth.facts.noise_floor),
                reference: truth.facts.clone(),
                run,
            });
        }
        write(session, &configuration.settings, &sizes)?;
    }
    Ok(())
}

/// Write all files, each whole or not at all.
fn write(session: &Session<'_>, settings: &SolveSettings, sizes: &[Size]) -> Result<()> {
    let folder = &session.arguments.output;
    let costs: Vec<SizeCost> = sizes.iter().map(|size| size.cost.clone()).collect();
    let plot = plot(&costs);
    let report = Report {
        version: env!("CARGO_PKG_VERSION"),
        machine: Machine::present(),
        threads: session.thread_count(),
        settings: settings.clone(),
        repeats: session.arguments.runs.repeats,
        is_interrupted: session.is_interrupted(),
        exponents: COST_KINDS
            .iter()
            .map(|kind| (kind.label, exponent_of(&costs, kind)))
            .collect(),
        sizes,
    };
    write_whole(&folder.join("scaling.svg"), |out| plot.write_svg(out))?;
    write_whole(&folder.join("scaling.png"), |out| plot.write_png(out))?;
    write_whole(&folder.join("scaling.csv"), |out| write_csv(&costs, out))?;
    write_whole(&folder.join("scaling.json"), |out| {
        serde_json::to_writer_pretty(&mut *out, &report)?;
        out.write_all(b"\n")
    })?;
    write_whole(&folder.join("scaling.md"), |out| {
        write_markdown(&report, &costs, out)
    })
}

fn write_markdown(report: &Report<'_>, costs: &[SizeCost], out: &mut dyn Write) -> io::Result<()> {
    let settings = toml::to_string(&report.settings).map_err(io::Error::other)?;
    writeln!(
        out,
        "# Growth with the size of the scene\n\n\
         vecrad {}, {}, {} threads, median of {} run{}.\n\
         Settings: {}.\n\
         Times are seconds of computing, preparation included; errors are those of `report.md`.\n\
         \"†\" marks runs that a limit cut short.\n\
         The exponent is that of the power law of the number of triangles that fits the column best.\n\n\
         ![time against triangles](scaling.svg)\n\n{}",
        report.version,
        report.machine.describe(),
        report.threads,
        report.repeats,
        if report.repeats == 1 { "" } else { "s" },
        settings.trim_end().replace('\n', ", "),
        scaling_markdown(costs),
    )
}

fn plot(costs: &[SizeCost]) -> CurvePlot {
    let curve = |kind: &crate::experiments::scaling::CostKind| {
        let power =
            exponent_of(costs, kind).map_or(String::new(), |power| format!(", n^{power:.2}"));
        let points = costs.iter().filter_map(|cost| {
            let seconds = (kind.seconds)(cost)?;
            Some([cost.triangles as f64, seconds])
        });
        Curve {
            label: format!("{}{power}", kind.label),
            points: points.collect(),
            is_dashed: false,
            has_marks: true,
        }
    };
    CurvePlot {
        title: "one room in many sizes: time against triangles".to_owned(),
        x_label: "triangles".to_owned(),
        y_label: "run time (s)".to_owned(),
        curves: COST_KINDS.iter().map(curve).collect(),
    }
}
