//! How far light at points is from what it should be.

use std::collections::BTreeMap;

use glam::{DVec3, Vec3};
use serde::Serialize;

use crate::{
    reference::ReferencePoint,
    scene::{MaterialId, Scene},
};

/// Points of a material that tell about its mean. Fewer, and one leak under an edge names the material.
const FEW_POINTS: usize = 20;

/// Deviations of the irradiance at points, relative to the root mean square of what is expected.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Deviations {
    /// Points that are compared.
    pub points: usize,
    /// Points at which no light is known.
    pub unmatched: usize,
    /// Mean of what is expected, over points and channels, W/m².
    pub expected: f64,
    /// Mean of what was found, W/m².
    pub found: f64,
    /// Mean deviation, relative.
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
    /// Mean deviation, relative to the root mean square of what is expected at all points.
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
        let pairs: Vec<(MaterialId, DVec3, DVec3)> = points
            .iter()
            .zip(expected.iter().zip(found))
            .filter_map(|(point, (expected, found))| {
                let material = scene.triangles[point.triangle.index()].material;
                Some((material, (*expected)?.as_dvec3(), (*found)?.as_dvec3()))
            })
            .collect();
        let count = pairs.len().max(1) as f64;
        let squares = pairs.iter().map(|(_, expected, _)| square(*expected));
        let scale = (squares.sum::<f64>() / count).sqrt();
        if pairs.is_empty() || scale == 0.0 {
            return None;
        }
        let mean_of = |of: &dyn Fn(&(MaterialId, DVec3, DVec3)) -> f64| {
            pairs.iter().map(of).sum::<f64>() / count
        };
        let mut errors: Vec<f64> = pairs
            .iter()
            .map(|(_, expected, found)| square(*found - *expected).sqrt() / scale)
            .collect();
        errors.sort_by(f64::total_cmp);
        let trimmed = &errors[..errors.len() - errors.len() / 100];
        let rms = |errors: &[f64]| {
            let squares = errors.iter().map(|error| error.powi(2));
            (squares.sum::<f64>() / errors.len().max(1) as f64).sqrt()
        };
        Some(Self {
            points: pairs.len(),
            unmatched: points.len() - pairs.len(),
            expected: mean_of(&|(_, expected, _)| mean(*expected)),
            found: mean_of(&|(_, _, found)| mean(*found)),
            mean: mean_of(&|(_, expected, found)| mean(*found - *expected)) / scale,
            rms: rms(&errors),
            trimmed_rms: rms(trimmed),
            worst_percent: trimmed.last().copied().unwrap_or(0.0),
            worst_material: worst_material(scene, &pairs, scale),
        })
    }

    /// Where and how it is off, in a clause.
    pub(super) fn remark(&self) -> String {
        let signed = |share: f64| {
            let way = if share < 0.0 {
                "too dark"
            } else {
                "too bright"
            };
            format!("{:.2} % {way}", 100.0 * share.abs())
        };
        let worst = self
            .worst_material
            .as_ref()
            .map_or_else(String::new, |worst| {
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

fn worst_material(
    scene: &Scene,
    pairs: &[(MaterialId, DVec3, DVec3)],
    scale: f64,
) -> Option<WorstMaterial> {
    let mut sums: BTreeMap<MaterialId, (f64, usize)> = BTreeMap::new();
    for (material, expected, found) in pairs {
        let (sum, count) = sums.entry(*material).or_default();
        *sum += mean(*found - *expected) / scale;
        *count += 1;
    }
    sums.into_iter()
        .filter(|(_, (_, count))| *count >= FEW_POINTS)
        .map(|(material, (sum, points))| WorstMaterial {
            name: material_name(scene, material),
            mean: sum / points as f64,
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

/// Mean over the channels.
fn mean(color: DVec3) -> f64 {
    color.element_sum() / 3.0
}

/// Mean square over the channels.
fn square(color: DVec3) -> f64 {
    color.length_squared() / 3.0
}
