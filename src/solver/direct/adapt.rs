//! Division of elements where linear interpolation of direct light between their corners errs.

use glam::Vec4;
use rayon::prelude::*;

use super::{
    border::SPREAD_SHARE,
    field::DirectField,
    fields::DirectFields,
    samples::DirectLight,
    scale::{Scale, Surroundings},
};
use crate::{
    geometry::RayTree,
    hierarchy::{Hierarchy, longest_edge_squared},
    solver::{
        Cancel,
        limits::Limits,
        places::{Receiver, centre_of, share_root},
    },
    transport::luminance,
};

/// Largest share of the scene's area of an element, or of a right isosceles triangle with its longest edge: all corners
/// of an element may miss a smaller shadow. Larger misses more shadows; smaller costs vertices on empty walls.
const LARGEST_SHARE: f32 = 1.0 / 1000.0;

/// Radii within which no other surface may stand above the plane of a larger element if it is not divided: nothing can
/// cast a shadow there. Smaller misses long shadows; larger divides empty ground.
const EMPTY_RADII: f32 = 16.0;

/// Smallest area of elements that are divided by the interpolation error of unoccluded light, as a share of the
/// smallest area of others. Smaller divides too far where a lamp touches a surface; larger misses the light about a
/// lamp far smaller than the scene.
const SMOOTH_SHARE: f32 = 1e-6;

/// Light, in multiples of the tolerance of the last step, to which the error of many emitters at a centroid is relative
/// if the corners are darker: the error is then a tenth of the tolerance. Smaller evaluates emitters that do not
/// matter; larger divides elements because of that error.
const INTERPOLATION_SCALE: f32 = 30.0;

/// Most rounds of division in one step. Fewer, and small shadows stay coarse; more, and one step takes long.
const MOST_ROUNDS: u32 = 8;

/// Divide elements that are too large to be sampled at their corners only. Returns whether memory allowed it. Where
/// nothing casts a shadow, in all of the scene if `is_clear`, elements are not divided over which the unoccluded light
/// has no interpolation error.
pub(crate) fn divide_coarse(
    hierarchy: &mut Hierarchy,
    direct: &DirectFields,
    is_clear: bool,
    limits: Limits,
) -> bool {
    loop {
        let large: Vec<usize> = hierarchy
            .mesh
            .active_leaves()
            .filter(|&leaf| is_large(hierarchy, leaf, limits))
            .collect();
        // If emission is linked, links divide elements for it, except in clear scenes.
        let is_known = direct.are_all(hierarchy);
        let has_error = |leaf: usize| match is_known {
            true => direct.has_interpolation_error(hierarchy, leaf, limits),
            false => is_clear,
        };
        let wanted: Vec<u32> = large
            .into_par_iter()
            .filter(|&leaf| {
                let may_be_shaded = !is_clear
                    && !is_narrow(hierarchy, leaf, limits)
                    && !hierarchy.is_empty_above(leaf, EMPTY_RADII);
                may_be_shaded || has_error(leaf)
            })
            .map(|leaf| leaf as u32)
            .collect();
        if !hierarchy.mesh.fits(&wanted, limits.most_elements) {
            return false;
        }
        if wanted.is_empty() || !hierarchy.mesh.divide(&wanted) {
            return true;
        }
    }
}

/// Whether an element is too large, or too long, to be sampled at its corners only.
fn is_large(hierarchy: &Hierarchy, leaf: usize, limits: Limits) -> bool {
    let squared = longest_edge_squared(hierarchy.mesh.corners(leaf)) as f32;
    // The area of a right isosceles triangle with that edge.
    let area = squared * 0.25;
    hierarchy.share_of_area(leaf, area) > LARGEST_SHARE
        && hierarchy.mesh.size_of_parts(leaf) > limits.min_area
}

/// Whether an element is so narrow that it is smaller than what elements are divided into: shadows that its corners miss do
/// not matter, however long it is.
fn is_narrow(hierarchy: &Hierarchy, leaf: usize, limits: Limits) -> bool {
    hierarchy.mesh.elements[leaf].area_vector.length() <= 4.0 * limits.min_area
}

impl DirectField {
    /// Sample all vertices, then divide elements and sample again until the interpolation error is tolerated, relative
    /// to the mean luminance with that of `others` and the surroundings. Returns the rays shot, and whether memory allowed all divisions; `None` when cancelled.
    pub(crate) fn adapt(
        &mut self,
        rays: &RayTree,
        hierarchy: &mut Hierarchy,
        limits: Limits,
        others: f32,
        surroundings: &Surroundings,
        cancel: &Cancel,
    ) -> Option<(u64, bool)> {
        let mut ray_count = 0;
        // First element that was not examined in this step.
        let mut fresh = 0;
        for round in 0..=MOST_ROUNDS {
            let (shot, scale) =
                self.sample(rays, hierarchy, limits, others, surroundings, cancel)?;
            ray_count += shot;
            if round == MOST_ROUNDS {
                break;
            }
            let elements = fresh..hierarchy.mesh.elements.len();
            fresh = elements.end;
            let leaves: Vec<usize> = hierarchy.mesh.leaves_among(elements).collect();
            ray_count += self.probe_centres(rays, hierarchy, &leaves, limits, scale, cancel)?;
            let wanted = self.leaves_to_divide(hierarchy, &leaves, limits, scale);
            let fits = hierarchy.mesh.fits(&wanted, limits.most_elements);
            if !fits || !hierarchy.mesh.divide(&wanted) {
                return Some((ray_count, fits));
            }
        }
        Some((ray_count, true))
    }

    /// Sample all vertices until their noise is tolerated, relative to the mean luminance with that of `others`.
    /// Returns the rays shot and what errors are relative to; `None` when cancelled.
    pub(super) fn sample<'a>(
        &mut self,
        rays: &RayTree,
        hierarchy: &Hierarchy,
        limits: Limits,
        others: f32,
        surroundings: &'a Surroundings,
        cancel: &Cancel,
    ) -> Option<(u64, Scale<'a>)> {
        let sampled =
            self.sample_vertices(rays, hierarchy, limits.shadow_samples, limits.seed, cancel)?;
        let offset = self.offset_before_walls(rays, hierarchy, limits, cancel)?;
        let scale = Scale {
            mean: self.mean(hierarchy) + others,
            surroundings,
        };
        let denoised = self.reduce_noise(rays, hierarchy, limits, scale, cancel)?;
        Some((sampled + offset + denoised, scale))
    }

    /// Range of the luminance of the corners, times the weight of the element, relative to the mean.
    fn spread(&self, hierarchy: &Hierarchy, element: usize, mean: f32) -> f32 {
        let corners = hierarchy.mesh.elements[element].vertices;
        let values = corners.map(|vertex| luminance(self.corner(vertex)));
        let range = values.iter().copied().fold(0.0, f32::max)
            - values.iter().copied().fold(f32::MAX, f32::min);
        range * share_root(hierarchy, element) / mean.max(f32::MIN_POSITIVE)
    }

    /// The largest unoccluded light of the corners, in the units of `spread`, if none of it reaches them; else 0. Rings
    /// and bands lie with all their corners under the edges of their neighbours.
    fn hidden(&self, hierarchy: &Hierarchy, element: usize, mean: f32) -> f32 {
        let lights = hierarchy.mesh.elements[element]
            .vertices
            .map(|vertex| self.vertices[vertex as usize].unwrap_or_default());
        if lights.iter().any(|light| light.fraction() != Vec4::ZERO) {
            return 0.0;
        }
        let most = lights
            .iter()
            .map(|light| luminance(light.unoccluded()))
            .fold(0.0, f32::max);
        most * share_root(hierarchy, element) / mean.max(f32::MIN_POSITIVE)
    }

    /// Interpolation error of the unoccluded light at the centroid of an element, in the units of `spread`; 0 where it
    /// cannot exceed the tolerance, or where no light reaches the corners. `at_centre` is the luminance of that light
    /// at the centroid, computed if it is `None`.
    fn unoccluded_interpolation_error(
        &self,
        hierarchy: &Hierarchy,
        element: usize,
        limits: Limits,
        mean: f32,
        at_centre: &mut Option<f32>,
    ) -> f32 {
        let lights = hierarchy.mesh.elements[element]
            .vertices
            .map(|vertex| self.vertices[vertex as usize].unwrap_or_default());
        let corners = lights.map(|light| luminance(light.unoccluded()));
        let weight = share_root(hierarchy, element) / mean.max(f32::MIN_POSITIVE);
        let brightest = luminance(self.lights.brightest());
        let is_dark = lights.iter().all(|light| light.fraction() == Vec4::ZERO);
        if is_dark || brightest * weight <= limits.tolerance {
            return 0.0;
        }
        let at_centre = *at_centre.get_or_insert_with(|| {
            let centre = centre_of(hierarchy, element);
            // An error far below the tolerance is precise enough.
            let brightest_corner = corners.into_iter().fold(0.0, f32::max);
            let scale =
                brightest_corner.max(INTERPOLATION_SCALE * limits.finest_tolerance / weight);
            let mut cut = Vec::new();
            luminance(self.lights.unoccluded(&centre, Some(scale), &mut cut))
        });
        (at_centre - corners.iter().sum::<f32>() / 3.0).abs() * weight
    }

    /// Sample the centroids of those of some leaves whose corners differ, or may all be in shadow by chance. Returns
    /// the rays shot; `None` when cancelled.
    fn probe_centres(
        &mut self,
        rays: &RayTree,
        hierarchy: &Hierarchy,
        leaves: &[usize],
        limits: Limits,
        scale: Scale<'_>,
        cancel: &Cancel,
    ) -> Option<u64> {
        let element_count = hierarchy.mesh.elements.len();
        self.centres.resize(element_count, None);
        self.unoccluded_at_centres.resize(element_count, None);
        // The leaves to sample: their interpolation error may exceed a tolerance.
        let candidates = leaves.par_iter().copied().filter(|&leaf| {
            hierarchy.mesh.is_active(leaf)
                && hierarchy.mesh.elements[leaf].is_outside_solids()
                && self.centres[leaf].is_none()
        });
        let probed: Vec<(usize, bool, Option<f32>)> = candidates
            .map(|leaf| {
                let mut at_centre = self.unoccluded_at_centres[leaf];
                let mean = scale.at(hierarchy, leaf);
                // The light at the centroid takes longest.
                let is_wanted = self.spread(hierarchy, leaf, mean) > limits.tolerance
                    || self.may_error_be_visible(hierarchy, leaf, limits, mean)
                    || self.hidden(hierarchy, leaf, mean) > limits.tolerance
                    || self.unoccluded_interpolation_error(
                        hierarchy,
                        leaf,
                        limits,
                        mean,
                        &mut at_centre,
                    ) > limits.tolerance;
                (leaf, is_wanted, at_centre)
            })
            .collect();
        for &(leaf, _, at_centre) in &probed {
            self.unoccluded_at_centres[leaf] = at_centre;
        }
        let wanted = probed.iter().filter(|(_, is_wanted, _)| *is_wanted);
        let unknown: Vec<usize> = wanted.map(|&(leaf, ..)| leaf).collect();
        // Shadow rays from their centroids.
        let receivers: Vec<Receiver> = unknown
            .iter()
            .map(|&leaf| centre_of(hierarchy, leaf))
            .collect();
        let expected = |&leaf: &usize| {
            let corners = hierarchy.mesh.elements[leaf].vertices;
            let corners = corners.map(|vertex| self.unoccluded(vertex));
            DirectLight::expected(corners.into_iter().sum::<Vec4>() / 3.0)
        };
        let mut lights: Vec<DirectLight> = unknown.iter().map(expected).collect();
        let samples = limits.shadow_samples;
        self.lights.shoot(
            rays,
            &receivers,
            |_, _| samples,
            limits.seed,
            &mut lights,
            cancel,
        );
        cancel.proceed()?;
        // More of them where they are too noisy.
        let noisy = |index: usize, light: &DirectLight| {
            let leaf = unknown[index];
            let corners = self.tally_of_corners(hierarchy, leaf);
            let mean = scale.at(hierarchy, leaf);
            limits.is_noisy(light, corners, share_root(hierarchy, leaf), mean)
        };
        self.double(rays, &receivers, noisy, limits.seed, &mut lights, cancel)?;
        let mut ray_count = 0;
        for (leaf, light) in unknown.into_iter().zip(lights) {
            ray_count += u64::from(light.shot);
            self.centres[leaf] = Some(light);
        }
        Some(ray_count)
    }

    /// Those of some leaves whose interpolation error exceeds a tolerance.
    fn leaves_to_divide(
        &mut self,
        hierarchy: &Hierarchy,
        leaves: &[usize],
        limits: Limits,
        scale: Scale<'_>,
    ) -> Vec<u32> {
        let mut wanted = Vec::new();
        for &leaf in leaves {
            let mut at_centre = self.unoccluded_at_centres[leaf];
            let mean = scale.at(hierarchy, leaf);
            if self.needs_division(hierarchy, leaf, limits, mean, &mut at_centre) {
                wanted.push(leaf as u32);
            }
            self.unoccluded_at_centres[leaf] = at_centre;
        }
        wanted
    }

    /// Whether the interpolation error of a leaf exceeds a tolerance; `at_centre` as in
    /// [`Self::unoccluded_interpolation_error`].
    fn needs_division(
        &self,
        hierarchy: &Hierarchy,
        leaf: usize,
        limits: Limits,
        mean: f32,
        at_centre: &mut Option<f32>,
    ) -> bool {
        let element = &hierarchy.mesh.elements[leaf];
        let size = hierarchy.mesh.size_of_parts(leaf);
        let Some(centre) = self.centres.get(leaf).copied().flatten() else {
            return false;
        };
        // Contact elements are divided elsewhere.
        if !element.is_outside_solids() || size < SMOOTH_SHARE * limits.min_area {
            return false;
        }
        // Shadow borders need a smallest area; unoccluded light is smooth.
        if size < limits.min_area {
            return self.unoccluded_interpolation_error(hierarchy, leaf, limits, mean, at_centre)
                > limits.tolerance;
        }
        let [a, b, c] = element.vertices.map(|vertex| self.corner(vertex));
        let error = luminance((centre.irradiance() - (a + b + c) / 3.0).abs());
        let weight = share_root(hierarchy, leaf) / mean.max(f32::MIN_POSITIVE);
        error * weight + SPREAD_SHARE * self.spread(hierarchy, leaf, mean) > limits.tolerance
            || self.is_error_visible(hierarchy, leaf, &centre, limits, mean)
    }
}

#[cfg(test)]
mod tests;
