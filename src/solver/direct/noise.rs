//! Noise of shadow rays, and when more of them are shot.

use super::{samples::DirectLight, tally::Tally};
use crate::{hierarchy::luminance, solver::limits::Limits};

/// Tolerated noise of a point, times the square root of its share of the area, as a share of the tolerance. Larger
/// leaves blotches, which are taken for shadow borders and divided; smaller costs rays, as one over its square.
const NOISE_SHARE: f32 = 0.25;

/// Most shadow rays of a point, in multiples of the usual number. Fewer leave noise; more cost time.
const MOST_SAMPLES: u32 = 16;

impl Limits {
    /// Most shadow rays of a point.
    pub(super) fn most_samples(&self) -> u32 {
        MOST_SAMPLES * self.shadow_samples
    }

    /// Whether the noise of a point is not tolerated and more rays may be shot, by the tally of its neighbours;
    /// `weight` is the square root of its share of the area.
    pub(super) fn is_noisy(
        &self,
        light: &DirectLight,
        neighbours: Tally,
        weight: f32,
        mean: f32,
    ) -> bool {
        let error = light.error_among(neighbours);
        light.tried < self.most_samples()
            && (error * weight > NOISE_SHARE * self.tolerance * mean
                || self.is_grainy(light, error, weight, mean))
    }

    /// Whether the noise of a point with this standard error is visible.
    pub(super) fn is_grainy(
        &self,
        light: &DirectLight,
        error: f32,
        weight: f32,
        mean: f32,
    ) -> bool {
        let beside = mean.max(luminance(light.irradiance()));
        self.is_noise_visible(error, beside, weight)
    }

    /// Whether a point whose neighbours differ from it has too few rays, though all of them have the same outcome.
    pub(super) fn is_doubtful(&self, light: &DirectLight, weight: f32, mean: f32) -> bool {
        let beside = mean.max(luminance(light.irradiance()));
        light.tried < self.most_samples() && self.is_noise_visible(light.doubt(), beside, weight)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::{SolveSettings, limits::CONTRAST_TOLERANCE};

    fn limits(tolerance: f32) -> Limits {
        let settings = SolveSettings::default();
        Limits {
            tolerance,
            finest_tolerance: tolerance,
            contrast: CONTRAST_TOLERANCE * tolerance,
            min_area: 0.0,
            shadow_samples: settings.shadow_samples,
            seed: settings.seed,
            most_elements: u64::MAX,
        }
    }

    #[test]
    fn an_error_is_visible_the_sooner_the_larger_the_element_and_the_darker_its_surroundings() {
        let limits = limits(1e-3);
        let least_visible = |beside: f32, weight: f32| {
            let errors = (0..4000).map(|step| step as f32 * 1e-3);
            let mut seen = errors.filter(|&error| limits.is_visible(error, beside, weight));
            seen.next().unwrap_or(f32::INFINITY)
        };
        for (small, large) in [(1e-3, 1e-2), (1e-2, 1e-1)] {
            assert!(least_visible(1.0, large) < least_visible(1.0, small));
            assert!(least_visible(1.0, small) < least_visible(4.0, small));
            assert!(least_visible(0.1, large) > 0.0);
        }
    }

    #[test]
    fn noise_is_visible_before_an_interpolation_error_of_the_same_size() {
        let limits = limits(1e-3);
        assert!(!limits.is_visible(0.03, 1.0, 0.01));
        assert!(limits.is_noise_visible(0.03, 1.0, 0.01));
    }

    #[test]
    fn points_without_light_have_no_visible_noise() {
        let limits = limits(1e-3);
        assert!(!limits.is_grainy(&DirectLight::default(), 0.0, 1.0, 1.0));
        assert!(!limits.is_doubtful(&DirectLight::default(), 1.0, 1.0));
    }
}
