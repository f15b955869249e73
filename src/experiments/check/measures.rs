//! How far light at points is from what it should be.

use std::collections::BTreeMap;

use glam::{DVec3, Vec3};
use serde::Serialize;

use crate::{
    reference::ReferencePoint,
    scene::{MaterialId, Scene},
};

/// Points that tell about the mean of a material. Fewer, and one leak under an edge names the material.
const FEW_POINTS: usize = 20;

/// Deviations of the light at points, as it is reflected: of the irradiance times the reflectance, relative to the root mean
/// square of what is expected. Where nothing reflects, of the irradiance.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Deviations {
    /// Points that are compared.
    pub points: usize,
    /// Points at which no light is known.
    pub unmatched: usize,
    /// Mean irradiance that is expected, over points and channels, weighted by their reflectance, W/m².
    pub expected: f64,
    /// The mean of what was found, W/m².
    pub found: f64,
    /// Deviation of the mean, relative.
    pub mean: f64,
    /// Root mean square of the deviations, relative.
    pub rms: f64,
    /// The same without the worst 1 % of the points.
    pub trimmed_rms: f64,
    /// By how much the worst 1 % of the points are off at least, relative.
    pub worst_percent: f64,
    /// The material whose mean is furthest off, of those with 20 points or more.
    pub worst_material: Option<WorstMaterial>,
}

/// A material and the mean deviation of its points.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WorstMaterial {
    /// Its name.
    pub name: String,
    /// Deviation of the mean irradiance of its points, weighted likewise, relative.
    pub mean: f64,
    /// Its points.
    pub points: usize,
}

impl Deviations {
    /// Compare what was found at points of a scene with what is expected there; no light, or light that is no number, is no
    /// match where some is expected. `None` where nothing can be compared, or all that is expected is darkness.
    pub(super) fn of(
        scene: &Scene,
        points: &[ReferencePoint],
        expected: &[Option<Vec3>],
        found: &[Option<Vec3>],
    ) -> Option<Self> {
        let is_black = points.iter().all(|point| point.reflectance == Vec3::ZERO);
        let samples: Vec<Sample> = points
            .iter()
            .zip(expected.iter().zip(found))
            .filter_map(|(point, (expected, found))| {
                Some(Sample {
                    material: scene.triangles[point.triangle.index()].material,
                    weight: if is_black {
                        DVec3::ONE
                    } else {
                        point.reflectance.as_dvec3()
                    },
                    expected: (*expected)?.as_dvec3(),
                    found: (*found)?.as_dvec3(),
                })
            })
            .collect();
        let sum = |of: &dyn Fn(&Sample) -> f64| samples.iter().map(of).sum::<f64>();
        let count = samples.len() as f64;
        let scale = (sum(&|s| (s.weight * s.expected).length_squared()) / count).sqrt();
        let weights = sum(&|s| s.weight.element_sum());
        if samples.is_empty() || scale == 0.0 {
            return None;
        }
        let mut errors: Vec<f64> = samples.iter().map(|s| s.error().length() / scale).collect();
        errors.sort_by(f64::total_cmp);
        let trimmed = &errors[..errors.len() - errors.len() / 100];
        let rms = |errors: &[f64]| {
            let squares = errors.iter().map(|error| error.powi(2));
            (squares.sum::<f64>() / errors.len() as f64).sqrt()
        };
        let mean = |light: &dyn Fn(&Sample) -> DVec3| {
            sum(&|s| (s.weight * light(s)).element_sum()) / weights
        };
        let [expected, found] = [mean(&|s| s.expected), mean(&|s| s.found)];
        let is_finite = samples.iter().all(|s| s.found.is_finite());
        let worst_percent = trimmed.last().copied().unwrap_or(0.0);
        Some(Self {
            points: samples.len(),
            unmatched: points.len() - samples.len(),
            expected,
            found,
            mean: found / expected - 1.0,
            rms: rms(&errors),
            trimmed_rms: if is_finite { rms(trimmed) } else { f64::NAN },
            worst_percent,
            worst_material: worst_material(scene, &samples),
        })
    }

    /// Where and how it is off, in a clause.
    pub(super) fn remark(&self) -> String {
        let worst = self.worst_material.as_ref();
        let worst = worst.map_or_else(String::new, |worst| {
            format!("; most in {}: {}", worst.name, signed(worst.mean))
        });
        format!(
            "mean {}, worst 1 % of {} points off by {:.1} % and more{worst}",
            signed(self.mean),
            self.points,
            100.0 * self.worst_percent
        )
    }
}

/// How far a mean is off.
fn signed(share: f64) -> String {
    let percent = 100.0 * share.abs();
    match share {
        _ if percent < 0.005 => "right".to_owned(),
        _ if share < 0.0 => format!("{percent:.2} % too dark"),
        _ => format!("{percent:.2} % too bright"),
    }
}

/// Light at a point.
struct Sample {
    material: MaterialId,
    /// Reflectance.
    weight: DVec3,
    /// Irradiance, W/m².
    expected: DVec3,
    found: DVec3,
}

impl Sample {
    /// Deviation of what is reflected.
    fn error(&self) -> DVec3 {
        self.weight * (self.found - self.expected)
    }
}

fn worst_material(scene: &Scene, samples: &[Sample]) -> Option<WorstMaterial> {
    let mut sums: BTreeMap<MaterialId, ([f64; 2], usize)> = BTreeMap::new();
    for sample in samples {
        let ([expected, error], count) = sums.entry(sample.material).or_default();
        *expected += (sample.weight * sample.expected).element_sum();
        *error += sample.error().element_sum();
        *count += 1;
    }
    sums.into_iter()
        .filter(|(_, ([expected, _], count))| *count >= FEW_POINTS && *expected > 0.0)
        .map(|(material, ([expected, error], points))| WorstMaterial {
            name: material_name(scene, material),
            mean: error / expected,
            points,
        })
        .max_by(|a, b| a.mean.abs().total_cmp(&b.mean.abs()))
}

/// The name of a material in quotes, or what it is where it has none.
pub(super) fn material_name(scene: &Scene, material: MaterialId) -> String {
    match scene.materials[material.index()].name.as_str() {
        "" => "the material without a name".to_owned(),
        name => format!("'{name}'"),
    }
}
