//! What the light of any scene must obey, whatever it is: tests of a user's own file whose right answers are known without a
//! reference.
//!
//! * Constant radiance: where every surface emits what it absorbs, under a sky of the same radiance, the irradiance is π
//!   times that radiance everywhere.
//! * One reflectance ρ in a closed scene: the mean irradiance is Φ / (A (1 − ρ)), whatever its shape.
//! * Copies of another size, far away, mirrored and with another axis up are lit the same.
//! * The light of all lamps is the sum of the light of each.
//!
//! Light is compared at random points of the surfaces, by what is reflected of it: the root mean square of the deviations
//! without the worst 1 % of the points, as errors are measured elsewhere. What is not seen does not count.

mod laws;
mod measures;
mod survey;
mod table;

pub use measures::{Deviations, WorstMaterial};
pub use table::{check_markdown, summary};

use std::{
    sync::{Arc, OnceLock},
    time::Instant,
};

use glam::{DVec3, Vec3};
use serde::Serialize;

use super::{claim::Claim, lit::Lit};
use crate::{
    geometry::RayTree,
    reference::ReferencePoint,
    sampling::sample_points,
    scene::{Lighting, Placement, Scene, SceneBuilder, SceneOptions},
    solver::{Cancel, SolveSettings},
};
use laws::{Trial, Trouble};
use survey::Survey;

/// Points at which light is compared.
const POINTS: u32 = 4000;

/// The one reflectance of all surfaces where the mean light is known.
const ONE_REFLECTANCE: f32 = 0.5;

/// Error over the square root of ε, up to which light counts as right: the errors of the built-in scenes fall like that
/// from preset to preset, the largest of them at this factor. Smaller, and files of fine detail fail that are lit as well
/// as they can be; larger, and faults pass.
const REACHED: f32 = 0.3;

/// A scene to be checked, and how it is solved.
pub struct Subject {
    /// The scene as it is lit.
    pub scene: Arc<Scene>,
    /// Its faces before they were cleaned and scaled.
    pub faces: SceneBuilder,
    /// How it was read.
    pub options: SceneOptions,
    /// What light was asked for.
    pub lighting: Lighting,
    /// How it is solved.
    pub settings: SolveSettings,
    /// Bytes that each solve may use.
    pub memory_limit: Option<u64>,
}

/// Something that the light of a scene must obey.
#[derive(Clone, Debug, PartialEq)]
pub enum Law {
    /// Constant radiance.
    EvenLight,
    /// The mean light of a closed scene of one reflectance.
    MeanLight,
    /// A copy is lit as the scene is.
    Copy {
        /// What is done, in a word or two.
        name: &'static str,
        /// Where it lies.
        placement: Placement,
    },
    /// Lamps add up.
    Superposition,
}

impl Law {
    /// Its name in tables; unique.
    pub fn name(&self) -> String {
        match self {
            Self::EvenLight => "constant radiance".to_owned(),
            Self::MeanLight => "mean light".to_owned(),
            Self::Copy { name, .. } => format!("copy: {name}"),
            Self::Superposition => "lamps one by one".to_owned(),
        }
    }

    /// What is expected, in a sentence.
    pub fn basis(&self) -> &'static str {
        match self {
            Self::EvenLight => {
                "every surface emits what it absorbs, under a sky of the same radiance: E = π L everywhere"
            }
            Self::MeanLight => {
                "closed, and every surface reflects half of its light: mean E = Φ / (A (1 − ρ))"
            }
            Self::Copy { .. } => "the same irradiance at the same points",
            Self::Superposition => "the irradiance of all lamps is the sum of those of each",
        }
    }
}

/// How a test ended.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "verdict", content = "why", rename_all = "snake_case")]
pub enum Verdict {
    /// The light is as it must be.
    Holds,
    /// It is not.
    Fails(String),
    /// The test says nothing about this scene.
    NotApplicable(String),
    /// It was told to stop.
    Stopped,
}

/// The outcome of a test.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// The name of the law.
    pub law: String,
    /// What is expected, in a sentence.
    pub basis: &'static str,
    /// How it ended.
    #[serde(flatten)]
    pub verdict: Verdict,
    /// The figure that decides.
    pub claim: Option<Claim>,
    /// All figures, where light was compared at points.
    pub deviations: Option<Deviations>,
    /// What else is to be said.
    pub remarks: Vec<String>,
    /// Whether the memory limit cut some solve short.
    pub is_cut_short: bool,
    /// Time that it took.
    pub seconds: f64,
}

/// Lights scenes; `None` when cancelled.
type Light = dyn Fn(&Arc<Scene>, &Cancel) -> Option<Lit> + Send + Sync;

/// A scene with all that its tests share.
pub struct Check {
    subject: Subject,
    light: Box<Light>,
    rays: RayTree,
    survey: Survey,
    /// Points of all surfaces.
    everywhere: Vec<ReferencePoint>,
    /// Points of surfaces that reflect and do not emit; of all where there is none.
    points: Vec<ReferencePoint>,
    /// Irradiance at these, and whether the memory limit cut it short.
    own: OnceLock<(Vec<Option<Vec3>>, bool)>,
}

impl Check {
    /// Prepare the tests of a scene. `None` when cancelled.
    pub fn new(subject: Subject, cancel: &Cancel) -> Option<Self> {
        let (settings, limit) = (subject.settings.clone(), subject.memory_limit);
        let light = move |scene: &Arc<Scene>, cancel: &Cancel| {
            Lit::new(scene.clone(), &settings, limit, cancel)
        };
        Self::lit_by(Box::new(light), subject, cancel)
    }

    fn lit_by(light: Box<Light>, subject: Subject, cancel: &Cancel) -> Option<Self> {
        let (scene, seed) = (&subject.scene, subject.settings.seed);
        let rays = RayTree::new(scene);
        let sampled = |painted: &Scene| -> Vec<ReferencePoint> {
            let (points, _) = sample_points(painted, &rays, POINTS, seed);
            let points = points.into_iter().map(|point| ReferencePoint {
                reflectance: scene.reflectance_at(point.triangle, point.barycentric),
                ..ReferencePoint::from(point)
            });
            let is_there =
                |point: &ReferencePoint| scene.opacity_at(point.triangle, point.barycentric) > 0.0;
            points.filter(is_there).collect()
        };
        let bare = scene.with_one_reflectance(ONE_REFLECTANCE, Some(Vec3::ZERO));
        let (everywhere, points) = (sampled(&bare), sampled(scene));
        Some(Self {
            survey: Survey::new(scene, &rays, &everywhere, seed, cancel)?,
            subject,
            light,
            rays,
            everywhere,
            points,
            own: OnceLock::new(),
        })
    }

    /// The tests of any scene.
    pub fn laws(&self) -> Vec<Law> {
        let scene = &self.subject.scene;
        let (min, max) = scene
            .positions
            .iter()
            .fold((Vec3::MAX, Vec3::MIN), |(min, max), &position| {
                (min.min(position), max.max(position))
            });
        let extent = f64::from((max - min).max_element()) / scene.frame.scale;
        let copies = [
            (
                "1000 times as large, 1000 of its sizes away",
                Placement {
                    scale: 1e3,
                    offset: DVec3::new(1e6, -0.7e6, 0.4e6) * extent,
                    ..Placement::IDENTITY
                },
            ),
            (
                "a thousandth as large",
                Placement {
                    scale: 1e-3,
                    ..Placement::IDENTITY
                },
            ),
            (
                "mirrored",
                Placement {
                    is_mirrored: true,
                    ..Placement::IDENTITY
                },
            ),
            (
                "the other axis up",
                Placement {
                    is_turned: true,
                    ..Placement::IDENTITY
                },
            ),
        ];
        let copies = copies.map(|(name, placement)| Law::Copy { name, placement });
        let mut laws = vec![Law::EvenLight, Law::MeanLight];
        laws.extend(copies);
        laws.push(Law::Superposition);
        laws
    }

    /// Test a law on the threads of the caller's pool.
    pub fn run(&self, law: &Law, cancel: &Cancel) -> Outcome {
        let begin = Instant::now();
        let mut trial = Trial::new(self, cancel);
        let verdict = match trial.test(law) {
            Ok(verdict) => verdict,
            Err(Trouble::Stopped) => Verdict::Stopped,
            Err(Trouble::NotApplicable(why)) => Verdict::NotApplicable(why),
        };
        let finding = trial.finding;
        Outcome {
            law: law.name(),
            basis: law.basis(),
            verdict,
            claim: finding.claim,
            deviations: finding.deviations,
            remarks: finding.remarks,
            is_cut_short: finding.is_cut_short,
            seconds: begin.elapsed().as_secs_f64(),
        }
    }

    /// How far light may be off, relative: what was asked for, or what the threshold of links reaches elsewhere.
    pub fn limit(&self) -> f64 {
        let settings = &self.subject.settings;
        f64::from(settings.error.unwrap_or(REACHED * settings.epsilon.sqrt()))
    }
}

impl Outcome {
    /// The outcome of a test that ended by a panic.
    pub fn failed(law: &Law, failure: String, seconds: f64) -> Self {
        Self {
            law: law.name(),
            basis: law.basis(),
            verdict: Verdict::Fails(failure),
            claim: None,
            deviations: None,
            remarks: Vec::new(),
            is_cut_short: false,
            seconds,
        }
    }

    /// Whether it was told to stop.
    pub fn is_stopped(&self) -> bool {
        self.verdict == Verdict::Stopped
    }
}

#[cfg(test)]
mod tests;
