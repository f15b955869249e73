//! The JSON report of `solve`.

use std::fmt;

use glam::Vec3;
use serde::Serialize;

use super::lightmap::BakedFacts;
use crate::{
    export::ColorOptions,
    metrics::ErrorMeasures,
    sampling::SampledSurfaces,
    scene::{Frame, Scene, Sky, Warning},
    solver::{Omitted, SolveSettings, StepReport},
    worker::StopReason,
};

/// Everything that is known of a solve when it ends.
#[derive(Debug, Serialize)]
pub(super) struct SolveReport {
    pub(super) version: &'static str,
    pub(super) scene: SceneFacts,
    pub(super) lights: LightFacts,
    pub(super) settings: SolveSettings,
    pub(super) color: ColorOptions,
    /// Omissions, since this scene does not need the omitted parts, with their reasons.
    pub(super) left_out: Vec<Omitted>,
    pub(super) warnings: Vec<WarningFacts>,
    /// The reference of the errors of the steps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) reference: Option<ReferenceFacts>,
    pub(super) steps: Vec<StepFacts>,
    /// Of `--export-lightmap`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) lightmap: Option<BakedFacts>,
    pub(super) stop_reason: StopReason,
    pub(super) totals: Totals,
    pub(super) threads: usize,
    pub(super) machine: Machine,
}

/// The scene in figures; lengths in world units.
#[derive(Debug, Serialize)]
pub(super) struct SceneFacts {
    name: String,
    triangles: usize,
    /// Sides of triangles that reflect and emit.
    patches: usize,
    materials: usize,
    textures: usize,
    emitters: usize,
    up: &'static str,
    bounds: Bounds,
}

#[derive(Debug, Serialize)]
struct Bounds {
    min: [f64; 3],
    max: [f64; 3],
}

impl SceneFacts {
    /// Count a scene.
    pub(super) fn of(scene: &Scene) -> Self {
        let two_sided = scene.triangles.iter().filter(|t| t.two_sided).count();
        let emits = |surface: &&crate::scene::Surface| surface.emission.max_element() > 0.0;
        Self {
            name: scene.name.clone(),
            triangles: scene.face_count,
            patches: scene.triangles.len() + two_sided,
            materials: scene.materials.len(),
            textures: scene.textures.len(),
            emitters: scene.surfaces.iter().filter(emits).count(),
            up: scene.up.name(),
            bounds: bounds(scene, &scene.frame),
        }
    }
}

fn bounds(scene: &Scene, frame: &Frame) -> Bounds {
    let (mut min, mut max) = (glam::DVec3::MAX, glam::DVec3::MIN);
    for &position in &scene.positions {
        let position = frame.to_world(position);
        min = min.min(position);
        max = max.max(position);
    }
    Bounds {
        min: min.to_array(),
        max: max.to_array(),
    }
}

/// What gives light.
#[derive(Debug, Serialize)]
pub(super) struct LightFacts {
    /// Of "surfaces", "default sky" or "sky", and "sun", those that give light.
    sources: Vec<&'static str>,
    /// Triangles that emit.
    emitting_triangles: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    sky: Option<SkyFacts>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sun: Option<SunFacts>,
}

/// Radiance in W·sr⁻¹·m⁻², linear RGB.
#[derive(Debug, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum SkyFacts {
    Uniform { radiance: [f32; 3] },
    Picture { name: String, scale: [f32; 3] },
}

/// Angles in degrees, azimuth clockwise from north; irradiance of a surface that faces it in W/m², linear RGB.
#[derive(Debug, Serialize)]
struct SunFacts {
    azimuth: f32,
    elevation: f32,
    diameter: f32,
    irradiance: [f32; 3],
}

impl LightFacts {
    /// The light of a scene.
    pub(super) fn of(scene: &Scene) -> Self {
        let unit = scene.radiance_unit;
        let environment = &scene.environment;
        let surfaces = scene.surfaces.iter();
        let emitting = surfaces.filter(|surface| surface.emission.max_element() > 0.0);
        let emitting_triangles = emitting.count();
        let sky = match &environment.sky {
            sky if sky.is_dark() => None,
            Sky::Dark => None,
            Sky::Uniform(radiance) => Some(SkyFacts::Uniform {
                radiance: (*radiance * unit).to_array(),
            }),
            Sky::Picture(sky) => Some(SkyFacts::Picture {
                name: sky.picture.name.clone(),
                scale: (sky.scale * unit).to_array(),
            }),
        };
        let sun = environment.sun.filter(|sun| sun.irradiance != Vec3::ZERO);
        let sun = sun.map(|sun| {
            let [azimuth, elevation] = sun.place(scene.up);
            SunFacts {
                azimuth,
                elevation,
                diameter: sun.diameter.to_degrees(),
                irradiance: (sun.irradiance * unit).to_array(),
            }
        });
        let of_sky = if environment.is_default {
            "default sky"
        } else {
            "sky"
        };
        let sources = [
            (emitting_triangles > 0, "surfaces"),
            (sky.is_some(), of_sky),
            (sun.is_some(), "sun"),
        ];
        Self {
            sources: sources
                .into_iter()
                .filter_map(|(shines, name)| shines.then_some(name))
                .collect(),
            emitting_triangles,
            sky,
            sun,
        }
    }
}

impl fmt::Display for LightFacts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let color = |color: [f32; 3]| {
            let [red, green, blue] = color.map(|channel| format!("{channel:.3}"));
            match red == green && green == blue {
                true => red,
                false => format!("{red}, {green}, {blue}"),
            }
        };
        let mut parts = Vec::new();
        if self.emitting_triangles > 0 {
            let s = if self.emitting_triangles == 1 {
                ""
            } else {
                "s"
            };
            parts.push(format!("{} emitting triangle{s}", self.emitting_triangles));
        }
        let name = if self.sources.contains(&"default sky") {
            "default sky"
        } else {
            "sky"
        };
        match &self.sky {
            None => {}
            Some(SkyFacts::Uniform { radiance }) => {
                parts.push(format!("{name} of radiance {} W/(sr·m²)", color(*radiance)));
            }
            Some(SkyFacts::Picture { name, scale }) => {
                parts.push(format!("sky {name} times {}", color(*scale)));
            }
        }
        if let Some(sun) = &self.sun {
            parts.push(format!(
                "sun at azimuth {:.1}° and elevation {:.1}°, {} W/m²",
                sun.azimuth,
                sun.elevation,
                color(sun.irradiance)
            ));
        }
        match parts.is_empty() {
            true => f.write_str("none"),
            false => f.write_str(&parts.join("; ")),
        }
    }
}

/// A warning of the loader.
#[derive(Debug, Serialize)]
pub(super) struct WarningFacts {
    kind: String,
    message: String,
    count: usize,
    file: Option<String>,
    line: Option<usize>,
}

impl WarningFacts {
    /// A warning, field by field.
    pub(super) fn of(warning: &Warning) -> Self {
        Self {
            kind: format!("{:?}", warning.kind),
            message: warning.message.clone(),
            count: warning.count,
            file: warning.place.as_ref().map(|(file, _)| file.clone()),
            line: warning.place.as_ref().map(|(_, line)| *line),
        }
    }
}

/// The reference of errors.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ReferenceFacts {
    pub(super) method: &'static str,
    /// Paths at each point.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) samples: Option<u32>,
    pub(super) points: usize,
    pub(super) surfaces: SampledSurfaces,
    /// The surfaces that the errors are means over, in words.
    pub(super) error_of: String,
}

/// A step and its error.
#[derive(Debug, Serialize)]
pub(super) struct StepFacts {
    #[serde(flatten)]
    pub(super) report: StepReport,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) error: Option<ErrorMeasures>,
}

/// Times in seconds, a step that was interrupted included; the figures of whole steps are in `steps`.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub(super) struct Totals {
    pub(super) steps: usize,
    pub(super) read_s: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) reference_s: Option<f64>,
    pub(super) prepare_s: f64,
    /// Preparing and stepping.
    pub(super) solve_s: f64,
    /// The part of `solve_s` that went into a step that a limit interrupted, and left no light.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) interrupted_s: Option<f64>,
    pub(super) elapsed_s: f64,
}

/// The machine that the times belong to.
#[derive(Debug, Serialize)]
pub(super) struct Machine {
    os: &'static str,
    architecture: &'static str,
    /// Logical cores that the program may use.
    cores: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    processor: Option<String>,
    debug_build: bool,
}

impl Machine {
    /// The machine that this runs on.
    pub(super) fn present() -> Self {
        Self {
            os: std::env::consts::OS,
            architecture: std::env::consts::ARCH,
            cores: core_count(),
            processor: processor(),
            debug_build: cfg!(debug_assertions),
        }
    }
}

impl Machine {
    /// Processor, cores and system in a phrase.
    pub(super) fn describe(&self) -> String {
        let processor = self.processor.as_deref().unwrap_or(self.architecture);
        let build = if self.debug_build {
            ", debug build"
        } else {
            ""
        };
        format!("{processor} ({} cores, {}{build})", self.cores, self.os)
    }
}

/// Logical cores that the program may use.
pub(super) fn core_count() -> usize {
    std::thread::available_parallelism().map_or(1, Into::into)
}

/// The processor's name, where the system has it in a file.
fn processor() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}
