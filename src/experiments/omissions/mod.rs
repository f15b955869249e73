//! What each omission of the plan saves: the same scene solved with all omissions, without one of them, and with none.
//!
//! Times are wall-clock seconds of preparing and stepping, without reading and without pictures. Light is compared where
//! it arrives, at random points of the surfaces, with that of the run that keeps everything; the
//! difference of two such runs with different seeds is the noise.

mod exhibits;
mod table;

pub use exhibits::{Exhibit, exhibits};
pub use table::{Row, omissions_markdown, overhead_markdown};

use std::{f64::consts::PI, sync::Arc, time::Instant};

use glam::{DVec3, Vec3};
use serde::Serialize;

use crate::{
    geometry::RayTree,
    metrics::{MeshLookup, middle},
    reference::{PathSettings, PathTracer, ReferencePoint},
    scene::Scene,
    solver::{Cancel, Keep, Omission, Omitted, SolveSettings, Solver, StepReport},
};

/// Points at which light is compared; a difference over them is good to about a hundredth of itself.
const POINTS: u32 = 4000;

/// How often the plan alone is made, for the median of its time.
const PLANS: u32 = 9;

/// Name of the run with all omissions.
const AS_PLANNED: &str = "nothing";

/// Name of the run that omits nothing.
const ALL: &str = "all";

/// Name of the run that differs from the last by its seed only; it measures the noise and is run once.
const RESEEDED: &str = "all, other seed";

/// A solve to be run.
#[derive(Clone, Debug)]
struct Run {
    kept: &'static str,
    settings: SolveSettings,
    /// The times of its rounds.
    seconds: Vec<f64>,
    /// Its result; the same in all rounds.
    lit: Option<Lit>,
}

/// The result of a solve.
#[derive(Clone, Debug)]
struct Lit {
    last: StepReport,
    /// Irradiance at the points.
    light: Vec<DVec3>,
}

/// A scene with the solves that belong to it.
pub struct Trial {
    scene: Arc<Scene>,
    points: Vec<ReferencePoint>,
    left_out: Vec<&'static str>,
    plan_s: f64,
    runs: Vec<Run>,
}

impl Trial {
    /// Make the plan of a scene and derive the runs from it; `None` when cancelled.
    pub fn new(scene: Arc<Scene>, settings: &SolveSettings, cancel: &Cancel) -> Option<Self> {
        let keeping = |keep: Keep| SolveSettings {
            keep,
            ..settings.clone()
        };
        let seconds_of = |settings: &SolveSettings| {
            let seconds = (0..PLANS).map(|_| {
                let begin = Instant::now();
                Omitted::of(&scene, settings, cancel)?;
                Some(begin.elapsed().as_secs_f64())
            });
            seconds.collect::<Option<Vec<f64>>>().map(median)
        };
        let planned = keeping(Keep::NONE);
        let names: Vec<&str> = Omitted::of(&scene, &planned, cancel)?
            .iter()
            .map(|left| left.name)
            .collect();
        let omitted: Vec<Omission> = Omission::ALL
            .into_iter()
            .filter(|omission| names.contains(&omission.name()))
            .collect();
        // The tree is built in any case.
        let plan_s = (seconds_of(&planned)? - seconds_of(&keeping(Keep::ALL))?).max(0.0);
        let run = |kept, settings| Run {
            kept,
            settings,
            seconds: Vec::new(),
            lit: None,
        };
        let mut runs = vec![run(AS_PLANNED, planned)];
        if omitted.len() > 1 {
            let alone =
                |omission: &Omission| run(omission.name(), keeping(Keep::from(vec![*omission])));
            runs.extend(omitted.iter().map(alone));
        }
        runs.push(run(ALL, keeping(Keep::ALL)));
        if !omitted.is_empty() {
            let reseeded = SolveSettings {
                seed: settings.seed.wrapping_add(1),
                ..keeping(Keep::ALL)
            };
            runs.push(run(RESEEDED, reseeded));
        }
        Some(Self {
            points: points(&scene),
            left_out: omitted.into_iter().map(Omission::name).collect(),
            scene,
            plan_s,
            runs,
        })
    }

    /// The omission that each run does without, in the order of the runs.
    pub fn kept(&self) -> impl ExactSizeIterator<Item = &'static str> + use<> {
        let kept: Vec<&'static str> = self.runs.iter().map(|run| run.kept).collect();
        kept.into_iter()
    }

    /// Whether another round needs this run, too.
    pub fn is_due(&self, index: usize) -> bool {
        let run = &self.runs[index];
        run.lit.is_none() || run.kept != RESEEDED
    }

    /// Run one of them once; `None` when cancelled.
    pub fn run(&mut self, index: usize, cancel: &Cancel) -> Option<()> {
        let run = &mut self.runs[index];
        let begin = Instant::now();
        let mut solver = Solver::new(self.scene.clone(), run.settings.clone(), None, cancel)?;
        let last = loop {
            let report = solver.step(cancel)?;
            if report.is_final {
                break report;
            }
        };
        run.seconds.push(begin.elapsed().as_secs_f64());
        if run.lit.is_none() {
            let light = irradiance(&self.scene, &solver, &self.points);
            run.lit = Some(Lit { last, light });
        }
        Some(())
    }

    /// Seconds of all runs so far.
    pub fn seconds(&self) -> f64 {
        self.runs.iter().flat_map(|run| &run.seconds).sum()
    }

    /// Cost of the runs and differences of their light; `None` before each was run.
    pub fn comparison(&self) -> Option<Comparison> {
        let lit_of = |kept: &str| self.runs.iter().find(|run| run.kept == kept)?.lit.as_ref();
        let whole = lit_of(ALL)?;
        let compared = self.runs.iter().filter(|run| run.kept != RESEEDED);
        let cost = |run: &Run| {
            let lit = run.lit.as_ref()?;
            Some(Cost {
                kept: run.kept,
                wall_s: median(run.seconds.clone()),
                rounds: run.seconds.len(),
                rays: lit.last.shadow_rays,
                links: lit.last.links,
                elements: lit.last.elements,
                memory_bytes: lit.last.memory_bytes,
                difference: difference(&lit.light, &whole.light),
                power: power(&lit.light) / power(&whole.light),
            })
        };
        Some(Comparison {
            scene: self.scene.name.clone(),
            triangles: self.scene.face_count,
            left_out: self.left_out.clone(),
            plan_s: self.plan_s,
            noise: lit_of(RESEEDED).map(|other| difference(&other.light, &whole.light)),
            runs: compared.map(cost).collect::<Option<_>>()?,
        })
    }
}

/// Cost of a run, and how far its light differs from that of the run without omissions.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cost {
    /// The parts that were not omitted: `nothing`, the name of an omission, or `all`.
    pub kept: &'static str,
    /// Wall-clock seconds of preparing and stepping, median of the rounds.
    pub wall_s: f64,
    /// How often it was run.
    pub rounds: usize,
    /// Rays shot.
    pub rays: u64,
    /// Links at the end.
    pub links: u64,
    /// Elements at the end.
    pub elements: u64,
    /// Bytes that the solver uses at the end.
    pub memory_bytes: u64,
    /// Root mean square of the difference in irradiance, relative to that of the irradiance.
    pub difference: f64,
    /// Power that arrives, relative to that of the run that keeps everything.
    pub power: f64,
}

/// All runs of a scene side by side.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Name of the scene.
    pub scene: String,
    /// Its triangles.
    pub triangles: usize,
    /// Names of what is omitted.
    pub left_out: Vec<&'static str>,
    /// Seconds that making the plan takes, in addition to building the tree; median.
    pub plan_s: f64,
    /// As [`Cost::difference`], of two runs that keep everything and have other seeds. Unknown where nothing is omitted.
    pub noise: Option<f64>,
    /// The runs: first the one that obeys the plan, last the one that keeps everything.
    pub runs: Vec<Cost>,
}

impl Comparison {
    /// The run that obeys the plan.
    fn planned(&self) -> &Cost {
        &self.runs[0]
    }

    /// Time of making the plan, as a share of the run that obeys it.
    pub fn overhead(&self) -> f64 {
        self.plan_s / self.planned().wall_s
    }
}

/// Random points as in a reference, with reflectance 1 and no emission, so that their radiance is the irradiance over π.
fn points(scene: &Arc<Scene>) -> Vec<ReferencePoint> {
    let settings = PathSettings {
        point_count: POINTS,
        samples_per_pass: 1,
        seed: 5,
    };
    let tracer = PathTracer::new(scene.clone(), Arc::new(RayTree::new(scene)), settings);
    let mut points = tracer.result().points;
    for point in &mut points {
        (point.reflectance, point.emission) = (Vec3::ONE, Vec3::ZERO);
    }
    points
}

/// Irradiance at such points.
fn irradiance(scene: &Scene, solver: &Solver, points: &[ReferencePoint]) -> Vec<DVec3> {
    let snapshot = solver.snapshot();
    let lookup = MeshLookup::new(scene, &snapshot.mesh);
    let radiance = lookup.radiance(&snapshot.light, points).into_iter();
    radiance
        .map(|radiance| radiance.unwrap_or_default().as_dvec3() * PI)
        .collect()
}

/// Root of the mean square of the difference, relative to that of the second.
fn difference(light: &[DVec3], from: &[DVec3]) -> f64 {
    let square = |light: DVec3| light.length_squared();
    let between: f64 = light.iter().zip(from).map(|(a, b)| square(*a - *b)).sum();
    let size: f64 = from.iter().copied().map(square).sum();
    (between / size).sqrt()
}

fn power(light: &[DVec3]) -> f64 {
    light.iter().map(|light| light.element_sum()).sum()
}

/// The middle one, or the lower of the two; not a number where there is none.
fn median(values: Vec<f64>) -> f64 {
    middle(values).unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unlike_and_all_scenes_can_be_built() {
        let mut names: Vec<&str> = exhibits().iter().map(|exhibit| exhibit.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), exhibits().len());
        for exhibit in exhibits() {
            let scene = exhibit.scene().unwrap();
            assert!(scene.has_emitter() && scene.name == exhibit.name);
        }
    }

    #[test]
    fn differences_are_relative_and_medians_in_the_middle() {
        let light = [DVec3::ONE, DVec3::ZERO];
        assert_eq!(difference(&light, &light), 0.0);
        assert!((difference(&[DVec3::ONE * 1.1, DVec3::ZERO], &light) - 0.1).abs() < 1e-12);
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(vec![3.0, 1.0]), 1.0);
        assert!(median(Vec::new()).is_nan());
    }
}
