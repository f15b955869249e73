//! What is tolerated in a step: when elements are divided, which errors are seen, how many shadow rays are shot.

use super::{schedule::is_coarse, settings::SolveSettings};
use crate::hierarchy::Hierarchy;

/// Tolerated contrast, in multiples of the tolerance of the mesh, of an error on an element whose share of the area has
/// a fourth root of 1. Smaller costs elements and rays in all penumbrae; larger draws their borders as saw teeth.
pub(super) const CONTRAST_TOLERANCE: f32 = 4.0;

/// Contrast that noise of a point may have, as a share of what a border may have. Larger leaves blotches in penumbrae;
/// smaller costs rays, as one over its square.
const NOISE_SHARE: f32 = 0.5;

/// When to divide.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Error of interpolation, times the root of the element's share of the area, relative to the mean.
    pub tolerance: f32,
    /// The same in the last step.
    pub finest_tolerance: f32,
    /// Contrast of an error, times the fourth root of the element's share of the area; infinite where it does not count.
    pub contrast: f32,
    /// Children are not smaller, frame units.
    pub min_area: f32,
    /// Shadow rays per point.
    pub shadow_samples: u32,
    /// Seed of the rays.
    pub seed: u64,
    /// Elements that there may be.
    pub most_elements: u64,
}

impl Limits {
    /// Those of a step of some threshold scale; `most_elements` there may be.
    pub(super) fn new(
        settings: &SolveSettings,
        hierarchy: &Hierarchy,
        threshold_scale: f32,
        most_elements: u64,
    ) -> Self {
        let tolerance = settings.mesh_tolerance * threshold_scale;
        Self {
            tolerance,
            finest_tolerance: settings.mesh_tolerance,
            // Coarse steps are seen for a moment.
            contrast: match is_coarse(threshold_scale) {
                true => f32::INFINITY,
                false => CONTRAST_TOLERANCE * tolerance,
            },
            min_area: min_area(settings, hierarchy),
            shadow_samples: shadow_samples(settings, is_coarse(threshold_scale)),
            seed: settings.seed,
            most_elements,
        }
    }

    /// Whether an error of luminance (of which the part above noise counts) is seen on an element, or about a point, of
    /// which `weight` is the root of the share of the area, beside light of luminance `beside`.
    pub(super) fn is_visible(&self, error: f32, beside: f32, weight: f32) -> bool {
        error * weight.sqrt() > self.contrast * beside
    }

    /// As [`Self::is_visible`] for noise of a point, by its standard error.
    pub(super) fn is_noise_visible(&self, error: f32, beside: f32, weight: f32) -> bool {
        self.is_visible(error / NOISE_SHARE, beside, weight)
    }
}

/// Smallest element area that may be divided off, frame units.
pub(super) fn min_area(settings: &SolveSettings, hierarchy: &Hierarchy) -> f32 {
    (f64::from(settings.min_area) * hierarchy.importance.area) as f32
}

/// Shadow rays per vertex.
pub(super) fn shadow_samples(settings: &SolveSettings, is_coarse: bool) -> u32 {
    match is_coarse {
        true => settings.shadow_samples.div_ceil(2),
        false => settings.shadow_samples,
    }
}
