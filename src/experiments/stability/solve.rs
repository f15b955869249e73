//! A solve whose every step is checked, and what can be read off its light.

use std::{f64::consts::PI, sync::Arc};

use glam::{DVec3, Vec3};

use super::{
    super::light::{arriving_power, emitted_power, mean_where},
    Claim, Finding, Trouble,
};
use crate::{
    geometry::RayTree,
    metrics::{ErrorMeasures, MeshLookup, measure_error},
    reference::{PathSettings, PathTracer, ReferencePoint},
    scene::{Scene, SceneBuilder, SceneOptions, Sides, TriangleId},
    solver::{Cancel, Snapshot, SolveSettings, Solver, StepReport},
};

/// Factor by which irradiance at a vertex may exceed what surfaces all round it could give it at most. Sums of form
/// factors of few rays are scaled by their mean over a patch, so those of single corners may lie above 1.
const PEAK_SLACK: f64 = 2.0;

/// Factor by which all that arrives in the end may exceed what emitters can keep up: the noise of direct light.
const POWER_SLACK: f64 = 1.1;

/// The same for the coarse links of earlier steps.
const EARLY_POWER_SLACK: f64 = 1.5;

/// Points at which two solves are compared.
const COMPARED_POINTS: u32 = 4000;

/// One-sided faces, reflectance up to 1.
pub(super) fn one_sided() -> SceneOptions {
    SceneOptions {
        sides: Sides::One,
        max_reflectance: 1.0,
        ..SceneOptions::default()
    }
}

/// Sides by the shape, reflectance up to 1.
pub(super) fn sides_by_shape() -> SceneOptions {
    SceneOptions {
        sides: Sides::Auto,
        ..one_sided()
    }
}

/// A finished solve.
pub(super) struct Lit {
    pub(super) scene: Arc<Scene>,
    pub(super) reports: Vec<StepReport>,
    pub(super) snapshot: Snapshot,
}

/// Light a scene to the end.
pub(super) fn solve(
    builder: SceneBuilder,
    options: &SceneOptions,
    settings: &SolveSettings,
    cancel: &Cancel,
) -> Result<Lit, Trouble> {
    solve_within(builder, options, settings, None, cancel)
}

/// Light a scene to the end within so many bytes.
pub(super) fn solve_within(
    builder: SceneBuilder,
    options: &SceneOptions,
    settings: &SolveSettings,
    memory_limit: Option<u64>,
    cancel: &Cancel,
) -> Result<Lit, Trouble> {
    let scene = Arc::new(builder.finish(options)?);
    let limits = Limits::of(&scene);
    let mut solver = Solver::new(scene.clone(), settings.clone(), memory_limit, cancel)
        .ok_or(Trouble::Stopped)?;
    let mut reports: Vec<StepReport> = Vec::new();
    while reports.last().is_none_or(|report| !report.is_final) {
        let report = solver.step(cancel).ok_or(Trouble::Stopped)?;
        let broken = limits
            .broken_by(&solver.snapshot(), report.is_final)
            .or_else(|| broken_by(&report))
            .or_else(|| solver.hierarchy().validate().err());
        if let Some(what) = broken {
            return Err(Trouble::Broken {
                scene: scene.name.clone(),
                step: report.step,
                what,
            });
        }
        reports.push(report);
    }
    Ok(Lit {
        snapshot: solver.snapshot(),
        scene,
        reports,
    })
}

/// The faults of the figures of a step.
fn broken_by(report: &StepReport) -> Option<String> {
    let figures = [
        ("epsilon", f64::from(report.epsilon)),
        ("residual", f64::from(report.residual)),
        ("contraction", f64::from(report.contraction)),
        ("energy balance", report.energy_balance),
        ("smallest row sum", f64::from(report.row_sum_min)),
        ("mean row sum", f64::from(report.row_sum_mean)),
        ("largest row sum", f64::from(report.row_sum_max)),
        ("error bound", f64::from(report.error_bound)),
    ];
    figures
        .into_iter()
        .find(|(_, value)| !(value.is_finite() && *value >= 0.0))
        .map(|(name, value)| format!("the {name} is {value}"))
}

/// Upper bounds of light.
struct Limits {
    /// Irradiance by channel: what a point would get if the brightest radiosity that there can be were all round it.
    irradiance: DVec3,
    /// Arriving power by channel, frame units: all emitters, each bounce returning the largest reflectance.
    power: DVec3,
}

impl Limits {
    fn of(scene: &Scene) -> Self {
        let mut reflectance = DVec3::ZERO;
        let mut brightest = DVec3::ZERO;
        for surface in &scene.surfaces {
            reflectance = reflectance.max(surface.reflectance.as_dvec3());
            brightest = brightest.max(surface.emission.as_dvec3());
        }
        let absorbed = DVec3::ONE - reflectance;
        Self {
            irradiance: brightest * PI / absorbed * PEAK_SLACK,
            power: emitted_power(scene) / absorbed,
        }
    }

    /// The faults of the light of a snapshot.
    fn broken_by(&self, snapshot: &Snapshot, is_final: bool) -> Option<String> {
        let light = &snapshot.light;
        if light.irradiance.len() != snapshot.mesh.positions.len() {
            return Some("vertices without light".to_owned());
        }
        let is_light = |value: &Vec3| value.is_finite() && value.min_element() >= 0.0;
        let all = || light.irradiance.iter().chain(&light.direct);
        if let Some(value) = all().find(|value| !is_light(value)) {
            return Some(format!("irradiance {value}"));
        }
        let exceeds = |value: &Vec3| value.as_dvec3().cmpgt(self.irradiance).any();
        if let Some(value) = light.irradiance.iter().find(|value| exceeds(value)) {
            return Some(format!(
                "irradiance {value}, more than {} that any surroundings can give",
                self.irradiance
            ));
        }
        let power = arriving_power(snapshot, |_| DVec3::ONE);
        let slack = if is_final {
            POWER_SLACK
        } else {
            EARLY_POWER_SLACK
        };
        power.cmpgt(self.power * slack).any().then(|| {
            format!(
                "power {power} arrives, more than {} that the emitters can keep up",
                self.power
            )
        })
    }
}

impl Lit {
    /// The findings, with these claims.
    pub(super) fn finding(&self, claims: Vec<Claim>) -> Finding {
        let mut finding = Finding {
            claims,
            ..Finding::default()
        };
        self.count_in(&mut finding);
        finding
    }

    /// Add the steps, sweeps and notes of this solve.
    pub(super) fn count_in(&self, finding: &mut Finding) {
        for report in &self.reports {
            finding.steps += 1;
            finding.sweeps += report.sweeps;
            for note in &report.notes {
                let note = note.to_string();
                if !finding.notes.contains(&note) {
                    finding.notes.push(note);
                }
            }
        }
    }

    /// Area-weighted mean irradiance over the display triangles of a material.
    pub(super) fn mean_irradiance(&self, material: &str) -> DVec3 {
        self.mean_irradiance_where(|triangle| self.scene.material(triangle).name == material)
    }

    /// Area-weighted mean irradiance over the display triangles that count.
    pub(super) fn mean_irradiance_where(&self, counts: impl Fn(TriangleId) -> bool) -> DVec3 {
        let light = &self.snapshot.light.irradiance;
        mean_where(&self.snapshot.mesh, light, counts)
    }

    /// Largest and smallest irradiance (red) at a vertex of a material.
    pub(super) fn extremes(&self, material: &str) -> [f64; 2] {
        let mesh = &self.snapshot.mesh;
        let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
        for (vertices, &triangle) in mesh.indices.iter().zip(&mesh.triangle_of) {
            if self.scene.material(TriangleId(triangle)).name == material {
                for &vertex in vertices {
                    let value = f64::from(self.snapshot.light.irradiance[vertex as usize].x);
                    least = least.min(value);
                    most = most.max(value);
                }
            }
        }
        [least, most]
    }

    /// Absorbed power over emitted power: 1 in a closed scene.
    pub(super) fn absorbed_share(&self) -> f64 {
        let absorbed = arriving_power(&self.snapshot, |triangle| {
            DVec3::ONE - self.scene.surfaces[triangle.index()].reflectance.as_dvec3()
        });
        absorbed.element_sum() / emitted_power(&self.scene).element_sum()
    }

    /// All that is emitted is absorbed, but for a share.
    pub(super) fn balance(&self, allowed: f64) -> Claim {
        Claim::near("absorbed / emitted", 1.0, self.absorbed_share(), allowed)
    }

    /// Error against path tracing at random points.
    pub(super) fn against_paths(
        &self,
        points: u32,
        samples: u32,
        cancel: &Cancel,
    ) -> Result<ErrorMeasures, Trouble> {
        let mut tracer = tracer(&self.scene, points, samples);
        if !tracer.pass(&|| cancel.is_cancelled()) {
            return Err(Trouble::Stopped);
        }
        let points = tracer.result().points;
        let lookup = MeshLookup::new(&self.scene, &self.snapshot.mesh);
        let measured = lookup.radiance(&self.snapshot.light, &points);
        Ok(measure_error(&measured, &points).unwrap_or_default())
    }

    /// Irradiance at points of the scene.
    fn irradiance_at(&self, points: &[ReferencePoint]) -> Vec<DVec3> {
        let lookup = MeshLookup::new(&self.scene, &self.snapshot.mesh);
        let radiance = lookup.radiance(&self.snapshot.light, points);
        let of = |(point, radiance): (&ReferencePoint, Option<Vec3>)| {
            let reflected = radiance.unwrap_or_default() - point.emission;
            reflected.as_dvec3() * PI / point.reflectance.max(Vec3::splat(1e-6)).as_dvec3()
        };
        points.iter().zip(radiance).map(of).collect()
    }

    /// Root mean square of the difference in irradiance from another solve of the same faces, which may be followed by
    /// others and emit `factor` times as much, relative to the root mean square of this one. Taken at random points.
    pub(super) fn difference(&self, other: &Self, factor: f64) -> f64 {
        let dark = |point: &ReferencePoint| point.emission == Vec3::ZERO;
        let mut points = tracer(&self.scene, COMPARED_POINTS, 1).result().points;
        points.retain(dark);
        let own = self.irradiance_at(&points);
        // The same points in the other's frame.
        for point in &mut points {
            let [a, b, c] = other.scene.corners(point.triangle);
            let at = point.barycentric;
            point.position = a * at.x + b * at.y + c * at.z;
        }
        let others = other.irradiance_at(&points);
        let unit = |lit: &Self| f64::from(lit.scene.radiance_unit);
        let factor = factor * unit(self) / unit(other);
        let (mut difference, mut size) = (0.0, 0.0);
        for (own, other) in own.iter().zip(&others) {
            difference += (*other / factor - *own).length_squared();
            size += own.length_squared();
        }
        (difference / size).sqrt()
    }
}

/// The energy is that of path tracing, but for a share.
pub(super) fn energy_claim(error: &ErrorMeasures, allowed: f64) -> Claim {
    let ratio = error.energy_ratio.unwrap_or(f64::NAN);
    Claim::near("energy / path tracing", 1.0, ratio, allowed)
}

/// Light is that of path tracing, but for a tenth.
pub(super) fn error_claim(error: &ErrorMeasures) -> Claim {
    Claim::small(
        "error against path tracing",
        error.relative_rms_trimmed,
        0.1,
    )
}

fn tracer(scene: &Arc<Scene>, point_count: u32, samples_per_pass: u32) -> PathTracer {
    let settings = PathSettings {
        point_count,
        samples_per_pass,
        seed: 5,
    };
    PathTracer::new(scene.clone(), Arc::new(RayTree::new(scene)), settings)
}
