//! Visible interpolation errors of direct light: at the border of a shadow an error counts by its contrast with the
//! surroundings, though the element is small.

use super::{field::DirectField, samples::DirectLight};
use crate::{
    hierarchy::Hierarchy,
    solver::{limits::Limits, places::share_root},
    transport::luminance,
};

/// Share of the range of the corners that counts as error even if the centroid agrees with their mean. Smaller misses
/// borders by chance; larger divides gradients.
pub(crate) const SPREAD_SHARE: f32 = 0.15;

/// Standard errors of a difference that count as noise and are subtracted. Smaller divides grain; larger leaves narrow
/// penumbrae coarse.
const NOISE_DEVIATIONS: f32 = 0.5;

impl DirectField {
    /// Whether the interpolation error of an element may be visible: the range of its corners, without noise, is.
    pub(super) fn may_error_be_visible(
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
        limits.is_visible(spread, mean.max(most), share_root(hierarchy, element))
    }

    /// Whether the interpolation error at the centroid of an element is visible.
    pub(super) fn is_error_visible(
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
        let error = (at_centre - between).abs() + SPREAD_SHARE * (most - least);
        let noise = centre.error().hypot(noise);
        let beside = mean.max(most).max(at_centre);
        let visible = error - NOISE_DEVIATIONS * noise;
        limits.is_visible(visible, beside, share_root(hierarchy, element))
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
    /// Root mean square of their standard errors.
    noise: f32,
}
