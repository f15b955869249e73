//! What the eye sees of direct light that bends within an element: at the border of a shadow an error counts for its
//! contrast with what surrounds it, though the element is small.

use super::{
    adapt::{DirectField, Limits, SPREAD_SHARE},
    direct::DirectLight,
    places::share_root,
};
use crate::{hierarchy::Hierarchy, transport::luminance};

/// Tolerated contrast, in multiples of the tolerance of the mesh, of an error on an element whose share of the area has
/// a fourth root of 1. Smaller costs elements and rays in all penumbrae; larger draws their borders as saw teeth.
pub(super) const CONTRAST_TOLERANCE: f32 = 4.0;

/// Standard errors of a difference that are taken for noise and not for a border. Smaller divides grain; larger lets
/// narrow penumbrae be.
const NOISE_DEVIATIONS: f32 = 0.5;

/// Contrast that noise of a point may have, as a share of what a border may have. Larger leaves blotches in penumbrae;
/// smaller costs rays, as one over its square.
const NOISE_SHARE: f32 = 0.5;

impl Limits {
    /// Whether an error of luminance (of which the part above noise counts) is seen on an element, or about a point, of
    /// which `weight` is the root of the share of the area, beside light of luminance `beside`.
    pub(super) fn is_seen(&self, error: f32, beside: f32, weight: f32) -> bool {
        error * weight.sqrt() > self.contrast * beside
    }

    /// As [`Self::is_seen`] for noise of a point, by its standard error.
    pub(super) fn is_noise_seen(&self, error: f32, beside: f32, weight: f32) -> bool {
        self.is_seen(error / NOISE_SHARE, beside, weight)
    }

    /// Whether the noise of the rays of a point can be seen, by its standard error.
    pub(super) fn is_grainy(
        &self,
        light: &DirectLight,
        error: f32,
        weight: f32,
        mean: f32,
    ) -> bool {
        let beside = mean.max(luminance(light.irradiance()));
        self.is_noise_seen(error, beside, weight)
    }

    /// Whether the rays of a point are too few where those of its neighbours had another outcome: though all of them
    /// agree, others might not.
    pub(super) fn is_doubtful(&self, light: &DirectLight, weight: f32, mean: f32) -> bool {
        let beside = mean.max(luminance(light.irradiance()));
        light.tried < self.most_samples() && self.is_noise_seen(light.doubt(), beside, weight)
    }
}

impl DirectField {
    /// Whether what lies between the corners of an element may show: how far they differ, beyond noise, is seen.
    pub(super) fn may_show(
        &self,
        hierarchy: &Hierarchy,
        element: usize,
        limits: Limits,
        mean: f32,
    ) -> bool {
        let Corners {
            most, least, noise, ..
        } = self.corners(hierarchy, element);
        let spread = most - least - NOISE_DEVIATIONS * noise;
        limits.is_seen(spread, mean.max(most), share_root(hierarchy, element))
    }

    /// Whether the bend between the corners of an element and its centroid shows.
    pub(super) fn shows(
        &self,
        hierarchy: &Hierarchy,
        element: usize,
        centre: &DirectLight,
        limits: Limits,
        mean: f32,
    ) -> bool {
        let Corners {
            most,
            least,
            mean: between,
            noise,
        } = self.corners(hierarchy, element);
        let at_centre = luminance(centre.irradiance());
        let bend = (at_centre - between).abs() + SPREAD_SHARE * (most - least);
        let noise = centre.error().hypot(noise);
        let beside = mean.max(most).max(at_centre);
        let error = bend - NOISE_DEVIATIONS * noise;
        limits.is_seen(error, beside, share_root(hierarchy, element))
    }

    /// Luminances of direct light at the corners of an element.
    fn corners(&self, hierarchy: &Hierarchy, element: usize) -> Corners {
        let lights = hierarchy.mesh.elements[element]
            .vertices
            .map(|vertex| self.vertices[vertex as usize].unwrap_or_default());
        let values = lights.map(|light| luminance(self.lights.bounded(light.irradiance())));
        let [least, most] = [f32::min, f32::max].map(|of| values.into_iter().fold(values[0], of));
        let noise = lights
            .map(|light| light.error())
            .into_iter()
            .fold(0.0, f32::hypot);
        Corners {
            most,
            least,
            mean: values.iter().sum::<f32>() / 3.0,
            noise: noise / (lights.len() as f32).sqrt(),
        }
    }
}

/// Luminances of direct light at the corners of an element.
struct Corners {
    most: f32,
    least: f32,
    mean: f32,
    /// Standard error of one of them, in the root mean square.
    noise: f32,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::SolveSettings;

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
    fn an_error_is_seen_the_sooner_the_larger_the_element_and_the_darker_its_surroundings() {
        let limits = limits(1e-3);
        let least_seen = |beside: f32, weight: f32| {
            let errors = (0..4000).map(|step| step as f32 * 1e-3);
            let mut seen = errors.filter(|&error| limits.is_seen(error, beside, weight));
            seen.next().unwrap_or(f32::INFINITY)
        };
        for (small, large) in [(1e-3, 1e-2), (1e-2, 1e-1)] {
            assert!(least_seen(1.0, large) < least_seen(1.0, small));
            assert!(least_seen(1.0, small) < least_seen(4.0, small));
            assert!(least_seen(0.1, large) > 0.0);
        }
    }

    #[test]
    fn noise_is_seen_before_a_bend_of_the_same_size_is() {
        let limits = limits(1e-3);
        assert!(!limits.is_seen(0.03, 1.0, 0.01));
        assert!(limits.is_noise_seen(0.03, 1.0, 0.01));
    }

    #[test]
    fn what_gets_no_light_has_no_noise_to_be_seen() {
        let limits = limits(1e-3);
        assert!(!limits.is_grainy(&DirectLight::default(), 0.0, 1.0, 1.0));
        assert!(!limits.is_doubtful(&DirectLight::default(), 1.0, 1.0));
    }
}
