//! Where the light of a snapshot lies: the ends of automatic false colours.

use super::view::{ViewMode, ViewSettings};
use crate::{metrics::ErrorMap, scene::luminance, solver::Snapshot};

/// Vertices looked at. Fewer miss small bright spots; more take longer than a frame of a large scene may.
const SAMPLES: usize = 20_000;
/// Least end of the scale of estimated errors, in per cent. Smaller, and what noise leaves of an error is as red as one that
/// can be seen; larger, and small errors have no colour.
const LEAST_ERROR_PERCENT: f32 = 1.0;

/// Below this nothing counts as light, in W/(sr·m²).
const DARKNESS: f32 = 1e-12;

/// Ends of the false colours of a mode: the fixed ones, or those of the light. `errors` are those at the vertices.
pub fn false_color_range(
    snapshot: &Snapshot,
    view: &ViewSettings,
    errors: Option<&[f32]>,
) -> [f32; 2] {
    if view.mode.is_signed() {
        let largest = || ErrorMap::new(&snapshot.errors).largest_percent();
        let high = match view.fixed_range {
            Some([_, high]) => high.max(f32::MIN_POSITIVE),
            None => largest().max(LEAST_ERROR_PERCENT),
        };
        return [-high, high];
    }
    if let Some([low, high]) = view.fixed_range {
        return [low, high.max(low.next_up())];
    }
    if view.mode.false_color_unit().is_none() {
        return [0.0, 1.0];
    }
    let mut values: Vec<f32> = sampled(snapshot)
        .map(|vertex| match view.mode {
            ViewMode::Error => errors
                .and_then(|errors| errors.get(vertex))
                .copied()
                .unwrap_or(0.0),
            mode => value(snapshot, mode, vertex),
        })
        .filter(|value| *value > DARKNESS)
        .collect();
    values.sort_by(f32::total_cmp);
    if values.is_empty() {
        return if view.logarithmic {
            [1e-3, 1.0]
        } else {
            [0.0, 1.0]
        };
    }
    let factor = view.light_factor();
    let high = quantile(&values, 0.99) * factor;
    let low = quantile(&values, 0.01) * factor;
    if view.logarithmic {
        [low.min(0.5 * high), high]
    } else {
        [0.0, high]
    }
}

/// The value of false colours at a vertex.
fn value(snapshot: &Snapshot, mode: ViewMode, vertex: usize) -> f32 {
    let light = &snapshot.light;
    match mode {
        ViewMode::FalseRadiance => {
            luminance(snapshot.mesh.emission[vertex]) + reflected(snapshot, vertex)
        }
        ViewMode::Radiance
        | ViewMode::LightOnly
        | ViewMode::DirectOnly
        | ViewMode::Reflectance
        | ViewMode::Normals
        | ViewMode::Elements
        | ViewMode::FaceOrientation
        | ViewMode::FalseIrradiance
        | ViewMode::Error
        | ViewMode::EstimatedError => luminance(light.irradiance[vertex]),
    }
}

/// Luminance of the reflected radiance at a vertex.
fn reflected(snapshot: &Snapshot, vertex: usize) -> f32 {
    let reflectance = snapshot.mesh.reflectance[vertex];
    luminance(reflectance * snapshot.light.irradiance[vertex]) / std::f32::consts::PI
}

/// Evenly spread vertices.
fn sampled(snapshot: &Snapshot) -> impl Iterator<Item = usize> + use<> {
    let count = snapshot
        .mesh
        .positions
        .len()
        .min(snapshot.light.irradiance.len());
    (0..count).step_by((count / SAMPLES).max(1))
}

fn quantile(sorted: &[f32], share: f32) -> f32 {
    let last = sorted.len() - 1;
    sorted[((share * last as f32) as usize).min(last)]
}
