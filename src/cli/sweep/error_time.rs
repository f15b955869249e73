//! Error against run time, scene by scene, and the files of the results.

use std::{
    io::{self, Write},
    sync::Arc,
};

use anyhow::Result;
use serde::Serialize;

use super::{
    baselines::{self, JACOBI_ELEMENTS},
    run_flags::Baseline,
    runs,
    session::{Session, Source, Truth},
};
use crate::{
    cli::{
        output::{self, Destination, check_inputs_kept, write_whole},
        report::{LightFacts, Machine},
    },
    export::{Curve, CurvePlot, write_csv},
    metrics::{Runner, SceneComparison, Trajectory, grouped},
    scene::{Scene, SceneOptions},
    solver::SolveSettings,
};

/// Everything in `report.json`.
#[derive(Serialize)]
struct Report<'a> {
    version: &'static str,
    machine: Machine,
    threads: usize,
    /// Settings of the first solver run; those of the others stand beside them.
    settings: SolveSettings,
    sides: String,
    repeats: u32,
    time_limit_s: f64,
    /// Whether Ctrl+C came before the end.
    is_interrupted: bool,
    scenes: &'a [LitComparison],
}

/// The runs on a scene, and what lights it.
#[derive(Serialize)]
struct LitComparison {
    #[serde(flatten)]
    runs: SceneComparison,
    lights: LightFacts,
}

/// Run every configuration and baseline on each scene and write the files after each.
pub(super) fn compare(session: &mut Session<'_>, sources: &[Source]) -> Result<()> {
    let mut scenes = Vec::new();
    for source in sources {
        if session.is_interrupted() {
            break;
        }
        let scene = session.load(source)?;
        check_inputs_kept(&destinations(session, &scene), &scene.files)?;
        if let Some(truth) = session.trace(&scene) {
            scenes.push(LitComparison {
                runs: compare_on(session, &scene, &truth)?,
                lights: LightFacts::of(&scene),
            });
        }
        write(session, &scenes)?;
    }
    Ok(())
}

fn compare_on(
    session: &mut Session<'_>,
    scene: &Arc<Scene>,
    truth: &Arc<Truth>,
) -> Result<SceneComparison> {
    let flags = session.arguments.runs.clone();
    let mut meshes = None;
    let mut comparison = SceneComparison {
        scene: scene.name.clone(),
        triangles: scene.face_count,
        reference: truth.facts.clone(),
        runs: Vec::new(),
    };
    for configuration in flags.configurations(&session.arguments.setting_flags) {
        if session.is_interrupted() {
            return Ok(comparison);
        }
        let run = runs::solve(session, scene, truth, &configuration)?;
        meshes = meshes.or(run.meshes);
        comparison.runs.push(run.trajectory);
    }
    if flags.baselines.contains(&Baseline::Bake) {
        for mesh in distinct(meshes) {
            let run = baselines::bake(session, scene, truth, &mesh);
            comparison.runs.push(run);
        }
    }
    if flags.baselines.contains(&Baseline::Jacobi) {
        for element_count in JACOBI_ELEMENTS {
            let run = baselines::jacobi(session, scene, truth, element_count);
            comparison.runs.push(run);
        }
    }
    comparison
        .runs
        .retain(|run| !run.points.is_empty() || run.runner == Runner::Solver);
    Ok(comparison)
}

/// The files that are written for a scene.
fn destinations(session: &Session<'_>, scene: &Scene) -> Vec<Destination> {
    let stem = file_stem(&scene.name);
    let names = ["report.md", "report.csv", "report.json"].map(str::to_owned);
    let plots = ["svg", "png"].map(|ending| format!("{stem}.{ending}"));
    names
        .into_iter()
        .chain(plots)
        .filter_map(|name| Destination::new(&name, &session.arguments.output.join(&name)))
        .collect()
}

/// Both meshes, or the one where nothing was divided between them.
fn distinct<T>(pair: Option<[Arc<T>; 2]>) -> Vec<Arc<T>> {
    match pair {
        None => Vec::new(),
        Some([first, last]) if Arc::ptr_eq(&first, &last) => vec![first],
        Some(pair) => pair.to_vec(),
    }
}

/// Write all files, each whole or not at all.
fn write(session: &Session<'_>, scenes: &[LitComparison]) -> Result<()> {
    let folder = &session.arguments.output;
    for scene in scenes.iter().map(|scene| &scene.runs) {
        let plot = plot(scene);
        let name = file_stem(&scene.scene);
        write_whole(&folder.join(format!("{name}.svg")), |out| {
            plot.write_svg(out)
        })?;
        write_whole(&folder.join(format!("{name}.png")), |out| {
            plot.write_png(out)
        })?;
    }
    write_whole(&folder.join("report.csv"), |out| {
        write_csv(scenes.iter().flat_map(|scene| scene.runs.rows()), out)
    })?;
    let report = report(session, scenes);
    write_whole(&folder.join("report.json"), |out| {
        serde_json::to_writer_pretty(&mut *out, &report)?;
        out.write_all(b"\n")
    })?;
    write_whole(&folder.join("report.md"), |out| {
        write_markdown(&report, out)
    })
}

fn report<'a>(session: &Session<'_>, scenes: &'a [LitComparison]) -> Report<'a> {
    let arguments = session.arguments;
    let configurations = arguments.runs.configurations(&arguments.setting_flags);
    let SceneOptions { sides, .. } = arguments.scene_flags.options();
    Report {
        version: env!("CARGO_PKG_VERSION"),
        machine: Machine::present(),
        threads: session.thread_count(),
        settings: configurations
            .into_iter()
            .next()
            .map(|first| first.settings)
            .unwrap_or_default(),
        sides: format!("{sides:?}").to_lowercase(),
        repeats: arguments.runs.repeats,
        time_limit_s: session.time_limit().as_secs_f64(),
        is_interrupted: session.is_interrupted(),
        scenes,
    }
}

fn write_markdown(report: &Report<'_>, out: &mut dyn Write) -> io::Result<()> {
    let settings = toml::to_string(&report.settings).map_err(io::Error::other)?;
    let settings = settings.trim_end().replace('\n', ", ");
    let interrupted = if report.is_interrupted {
        "Interrupted: what had not been run by then is missing.\n"
    } else {
        ""
    };
    writeln!(
        out,
        "# Error against run time\n\n\
         vecrad {}, {}, {} threads, sides {}, median of {} run{}, at most {} s each.\n\
         Settings of the first run: {settings}.\n\
         Errors are relative RMS of radiance at random points against path tracing, without the worst 1 % of the points \
         and without the noise of the reference.\n\
         \"†\" marks runs that the time limit, or another one, cut short; stochastic Jacobi radiosity has no end but the limit.\n\
         Times are seconds of computing, preparation included, reading the scene and measuring excluded; \"≤\" where \
         the first measurement was already better, \"–\" where a run never came so far.\n\
         Errors far below the noise of the reference cannot be told from none: they read \"below noise\", times to them \"?\".\n\
         Links, rays and memory are those at the best error. The ratio divides the time of the faster bake, whose mesh \
         is given to it, by the time of the run.\n{interrupted}",
        report.version,
        report.machine.describe(),
        report.threads,
        report.sides,
        report.repeats,
        if report.repeats == 1 { "" } else { "s" },
        report.time_limit_s,
    )?;
    for LitComparison {
        runs: scene,
        lights,
    } in report.scenes
    {
        writeln!(
            out,
            "## {}, {} triangles\n\n![error against run time]({}.svg)\n\n\
             Light: {lights}.\n\
             Reference: {} points of {} samples, {:.1} s, noise {:.2} %. Errors are means over {}.\n\n{}",
            scene.scene,
            grouped(scene.triangles as u64),
            file_stem(&scene.scene),
            grouped(scene.reference.points as u64),
            grouped(u64::from(scene.reference.samples)),
            scene.reference.seconds,
            100.0 * scene.reference.noise_floor,
            scene.reference.surfaces,
            scene.markdown(),
        )?;
    }
    Ok(())
}

/// Error over time of every run, baselines dashed, and the noise of the reference.
fn plot(scene: &SceneComparison) -> CurvePlot {
    let mut curves: Vec<Curve> = scene.runs.iter().map(curve).collect();
    let times = || {
        scene
            .runs
            .iter()
            .flat_map(|run| &run.points)
            .map(|point| point.time_s)
    };
    let noise = 100.0 * scene.reference.noise_floor;
    let ends = [
        times().min_by(f64::total_cmp),
        times().max_by(f64::total_cmp),
    ];
    curves.push(Curve {
        label: "noise of the reference".to_owned(),
        points: ends
            .into_iter()
            .flatten()
            .map(|time| [time, noise])
            .collect(),
        is_dashed: true,
        has_marks: false,
    });
    CurvePlot {
        title: format!(
            "{}, {} triangles: error against run time",
            scene.scene,
            grouped(scene.triangles as u64)
        ),
        x_label: "run time (s)".to_owned(),
        y_label: "relative RMS error without the worst 1 % of the points (%)".to_owned(),
        curves,
    }
}

fn curve(run: &Trajectory) -> Curve {
    let points = run.points.iter();
    let cut = if run.is_cut_short { " (cut short)" } else { "" };
    Curve {
        label: format!("{}{cut}", run.label),
        points: points
            .map(|point| [point.time_s, 100.0 * point.error.relative_rms_trimmed])
            .collect(),
        is_dashed: run.runner != Runner::Solver,
        has_marks: true,
    }
}

/// A scene's name as a file's that is none of the report.
fn file_stem(scene: &str) -> String {
    // The table has a name of its own, and a scene may have none.
    match output::file_stem(scene) {
        stem if matches!(stem.as_str(), "" | "report") => format!("scene-{stem}"),
        stem => stem,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_names_are_plain_and_never_those_of_the_report() {
        assert_eq!(file_stem("room-1022"), "room-1022");
        assert_eq!(file_stem("../a b"), "___a_b");
        assert_eq!(file_stem("report"), "scene-report");
        assert_eq!(file_stem(""), "scene-");
    }
}
