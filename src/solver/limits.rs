//! Tolerances of a step: when elements are divided, which errors are visible, how many shadow rays are shot.

use super::{schedule::is_coarse, settings::SolveSettings};
use crate::hierarchy::Hierarchy;

/// Tolerated contrast of an error, times the fourth root of the element's share of the area, in multiples of the
/// tolerance of the mesh. Smaller costs elements and rays in all penumbrae; larger draws their borders as saw teeth.
pub(super) const CONTRAST_TOLERANCE: f32 = 4.0;

/// Tolerated contrast of the noise of a point, as a share of that of an error. Larger leaves blotches in penumbrae;
/// smaller costs rays, as one over its square.
const NOISE_SHARE: f32 = 0.5;

/// Power of the threshold with which the tolerance of the mesh falls in steps beyond the settings: a solve towards an
/// error then has the mesh tolerance of the finest preset at its threshold. Smaller, and the mesh cannot follow the links;
/// larger, and the mesh grows for an error that links make (1 % on `cornell`, `room-1022` and `room-8621`: 1.9, 1.4 and
/// 4.7 times the processor time with 1).
const MESH_EXPONENT: f32 = 2.0 / 3.0;

/// The same of the smallest area of elements, which falls as the tolerance to the power of 1.5. Smaller, and the mesh
/// cannot follow the links; larger, and elements become tiny.
const AREA_EXPONENT: f32 = 1.0;

/// Tolerances and limits of a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Interpolation error, times the square root of the element's share of the area, relative to the mean.
    pub tolerance: f32,
    /// The same in the last step.
    pub finest_tolerance: f32,
    /// Contrast of an error, times the fourth root of the element's share of the area; infinite where contrast is
    /// ignored.
    pub contrast: f32,
    /// Children of elements are not smaller than this, square frame units.
    pub min_area: f32,
    /// Shadow rays per point.
    pub shadow_samples: u32,
    /// Seed of the rays.
    pub seed: u64,
    /// Most elements that the mesh may have.
    pub most_elements: u64,
}

impl Limits {
    /// The limits of a step with this threshold scale and element limit.
    pub(super) fn new(
        settings: &SolveSettings,
        hierarchy: &Hierarchy,
        threshold_scale: f32,
        most_elements: u64,
    ) -> Self {
        let beyond = threshold_scale.min(1.0);
        let finest_tolerance = settings.mesh_tolerance * beyond.powf(MESH_EXPONENT);
        let tolerance = finest_tolerance * threshold_scale.max(1.0);
        Self {
            tolerance,
            finest_tolerance,
            // Coarse steps are displayed only briefly.
            contrast: match is_coarse(threshold_scale) {
                true => f32::INFINITY,
                false => CONTRAST_TOLERANCE * tolerance,
            },
            min_area: min_area(settings, hierarchy) * beyond.powf(AREA_EXPONENT),
            shadow_samples: shadow_samples(settings, is_coarse(threshold_scale)),
            seed: settings.seed,
            most_elements,
        }
    }

    /// Whether an error (luminance, without its noise) is visible beside light of luminance `beside`, on an element or
    /// about a point; `weight` is the square root of its share of the area.
    pub(super) fn is_visible(&self, error: f32, beside: f32, weight: f32) -> bool {
        error * weight.sqrt() > self.contrast * beside
    }

    /// As [`Self::is_visible`], for the standard error of a point.
    pub(super) fn is_noise_visible(&self, error: f32, beside: f32, weight: f32) -> bool {
        self.is_visible(error / NOISE_SHARE, beside, weight)
    }
}

/// Smallest area of an element that a division may make, square frame units.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{SceneOptions, builtin};

    #[test]
    fn a_solve_towards_an_error_has_the_mesh_tolerance_of_the_finest_preset_at_its_threshold() {
        let scene = builtin::plates(1.0)
            .finish(&SceneOptions::default())
            .unwrap();
        let hierarchy = Hierarchy::new(&scene, 30.0);
        let limits = |settings: &SolveSettings, scale| Limits::new(settings, &hierarchy, scale, 0);
        let (settings, finest) = (SolveSettings::towards(0.01), SolveSettings::finest());
        let (own, wanted) = (limits(&settings, 1.0), limits(&finest, 1.0));
        assert_eq!(own.tolerance, settings.mesh_tolerance);
        let beyond = limits(&settings, finest.epsilon / settings.epsilon);
        let ratio = beyond.tolerance / wanted.tolerance;
        assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
        assert_eq!(beyond.tolerance, beyond.finest_tolerance);
        assert!(beyond.min_area < own.min_area);
        // Steps before the last have coarser meshes, with elements no smaller than those of the last.
        let coarse = limits(&settings, 4.0);
        assert_eq!(coarse.tolerance, 4.0 * own.tolerance);
        assert_eq!(coarse.finest_tolerance, own.tolerance);
        assert_eq!(coarse.min_area, own.min_area);
    }
}
