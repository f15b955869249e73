//! Direct light as a field on the mesh: known at vertices, and at the centroids of elements where it varies.
//! Elements are divided where linear interpolation between their corners would miss it.

use std::sync::OnceLock;

use glam::Vec4;
use rayon::prelude::*;

use super::{
    Cancel,
    direct::{DirectLight, Lights},
    offset_places::OffsetPlaces,
    places::{Receiver, carry_over, centre_of, share_root},
    reconstruct::{LeafLight, project},
    smooth,
};
use crate::{
    geometry::RayTree,
    hierarchy::{Element, Hierarchy, longest_edge_squared},
    transport::luminance,
};

/// No element is longer than the longest edge of a right isosceles triangle of this share of the scene's area: smaller
/// shadows than such an element could be missed by all its corners. Larger misses more, smaller costs vertices on empty
/// walls.
const LARGEST_SHARE: f32 = 1.0 / 1000.0;

/// Larger elements are left whole where no other surface stands above their plane within this many radii and light does
/// not bend: nothing can cast a shadow there. Smaller misses shadows that fall far, larger divides empty ground.
const EMPTY_RADII: f32 = 16.0;

/// Share of the variation between the corners that counts as error even where the centroid agrees with their mean.
pub(super) const SPREAD_SHARE: f32 = 0.15;

/// Where all corners of an element lie in shadow, its centroid is sampled if it could get more light than this many
/// times the tolerance. Smaller costs rays in the shade, larger loses light on narrow faces.
const HIDDEN_TOLERANCE: f32 = 4.0;

/// Part of the smallest area of elements down to which they are divided where light bends that nothing blocks. Smaller
/// divides without end where a lamp touches a surface; larger misses the light about a lamp far smaller than the scene.
const SMOOTH_SHARE: f32 = 1e-6;

/// Where it is asked whether the light of many emitters bends, its error is relative to this many times the tolerance of the last
/// step: it is then a tenth of that. Smaller looks at emitters that do not matter, larger divides by the error.
const BEND_SCALE: f32 = 30.0;

/// Rounds of division in one step at most.
const MOST_ROUNDS: u32 = 8;

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

/// Direct light on a mesh.
pub(super) struct DirectField {
    pub(super) lights: Lights,
    /// By vertex, where it was sampled; shorter than the vertices where some are new.
    pub(super) vertices: Vec<Option<DirectLight>>,
    /// By element, where it was needed.
    pub(super) centres: Vec<Option<DirectLight>>,
    /// Luminance of the unoccluded irradiance at centroids by element, where it was needed.
    unoccluded_at_centres: Vec<OnceLock<f32>>,
    /// Elements whose corners are all sampled: those that come after are new.
    pub(super) covered: usize,
    /// Shadow rays that these corners have where it takes all.
    pub(super) samples: u32,
    /// Vertices behind walls.
    pub(super) offsets: OffsetPlaces,
    /// Irradiance to show by vertex; shorter than the vertices where some are new.
    shown: Vec<Vec4>,
    /// Whether the number of elements kept the last adaptation from being finer.
    pub(super) is_full: bool,
}

/// Divide elements that are too large to be trusted with their corners. Returns whether all could be. Where nothing casts
/// a shadow, in all of the scene if `is_clear`, `lights` tell over which elements their light does not bend: these stay
/// whole.
pub(super) fn divide_coarse(
    hierarchy: &mut Hierarchy,
    lights: Option<&Lights>,
    is_clear: bool,
    limits: Limits,
) -> bool {
    loop {
        let large: Vec<usize> = hierarchy
            .mesh
            .active_leaves()
            .filter(|&leaf| is_large(hierarchy, leaf, limits))
            .collect();
        // Elsewhere than in the clear, links divide elements for the light that they carry.
        let bends = |leaf: usize| match lights {
            Some(lights) if is_clear || lights.are_all(hierarchy) => {
                lights.bend_over(hierarchy, leaf, limits)
            }
            _ => is_clear,
        };
        let wanted: Vec<u32> = large
            .into_par_iter()
            .filter(|&leaf| {
                (!is_clear && !hierarchy.is_empty_above(leaf, EMPTY_RADII)) || bends(leaf)
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

/// Whether an element is too large, or too long, to be trusted with its corners.
fn is_large(hierarchy: &Hierarchy, leaf: usize, limits: Limits) -> bool {
    let squared = longest_edge_squared(hierarchy.mesh.corners(leaf)) as f32;
    // The area of a right isosceles triangle with that edge.
    let area = squared * 0.25;
    let own = hierarchy.mesh.elements[leaf].area_vector.length();
    hierarchy.share_of_area(leaf, area) > LARGEST_SHARE && own > 4.0 * limits.min_area
}

/// Leaves between whose corners the light that they found over links bends, as [`DirectField::adapt`] has it.
pub(super) fn bent_under(
    hierarchy: &Hierarchy,
    found: &[LeafLight],
    limits: Limits,
    mean: f32,
) -> Vec<u32> {
    let is_bent = |light: &LeafLight| {
        let element = &hierarchy.mesh.elements[light.element as usize];
        let corners = light.corners.map(luminance);
        let [least, most] = [f32::min, f32::max].map(|of| corners.into_iter().fold(corners[0], of));
        let bend = (luminance(light.centre) - corners.iter().sum::<f32>() / 3.0).abs();
        let weight = share_root(hierarchy, light.element as usize) / mean.max(f32::MIN_POSITIVE);
        element.area_vector.length() * 0.25 >= limits.min_area
            && (bend + SPREAD_SHARE * (most - least)) * weight > limits.tolerance
    };
    let bent = found.iter().filter(|light| is_bent(light));
    bent.map(|light| light.element).collect()
}

impl DirectField {
    /// Nothing is known yet.
    pub(super) fn new(lights: Lights) -> Self {
        Self {
            lights,
            vertices: Vec::new(),
            centres: Vec::new(),
            unoccluded_at_centres: Vec::new(),
            covered: 0,
            samples: 0,
            offsets: OffsetPlaces::default(),
            shown: Vec::new(),
            is_full: false,
        }
    }

    /// The same light in other colours: of these emitters, with what shadow rays found at vertices and centroids.
    pub(super) fn recolor(
        &mut self,
        lights: Lights,
        vertices: Vec<Option<DirectLight>>,
        centres: Vec<Option<DirectLight>>,
    ) {
        (self.lights, self.vertices, self.centres) = (lights, vertices, centres);
        self.unoccluded_at_centres.clear();
    }

    /// Direct irradiance of a leaf: its corners' mean, or the rule of degree 2 with its centroid. Of one that lies within a
    /// solid in part, that of its open part.
    pub(super) fn element(&self, hierarchy: &Hierarchy, element: usize) -> Vec4 {
        let leaf = &hierarchy.mesh.elements[element];
        if leaf.is_contact() {
            let open = (0..3).filter(|&side| !leaf.is_inside_solid_at(side));
            let known = open.clone().map(|side| self.corner(leaf.vertices[side]));
            return known.sum::<Vec4>() / (open.count().max(1) as f32);
        }
        let [a, b, c] = leaf.vertices.map(|vertex| self.corner(vertex));
        let corners = a + b + c;
        match self.centres.get(element).copied().flatten() {
            Some(centre) => {
                self.lights.bounded(centre.irradiance()) * 0.75 + corners * (0.25 / 3.0)
            }
            None => corners / 3.0,
        }
    }

    /// Bring what is shown at vertices up to date with the samples.
    pub(super) fn smooth(&mut self, hierarchy: &Hierarchy) {
        let fractions = smooth::fractions(hierarchy, &self.vertices);
        let known = self.vertices.iter().zip(fractions);
        self.shown = known
            .map(|(light, fraction)| {
                let unoccluded = light.map_or(Vec4::ZERO, |light| light.unoccluded());
                self.lights.bounded(unoccluded * fraction)
            })
            .collect();
        let tells = |element: &Element, side| !element.is_inside_solid_at(side);
        carry_over(&hierarchy.mesh, tells, &mut self.shown);
        let open = |leaf: &usize| hierarchy.mesh.elements[*leaf].is_outside_solids();
        let centres = hierarchy.mesh.leaves().filter(open).filter_map(|leaf| {
            let centre = self.centres.get(leaf).copied().flatten()?;
            Some((leaf, self.lights.bounded(centre.irradiance())))
        });
        project(hierarchy, &mut self.shown, centres);
    }

    /// Direct irradiance to show at a vertex and its standard error (luminance). A vertex that only closes an edge takes the
    /// mean of its ends.
    pub(super) fn vertex(&self, hierarchy: &Hierarchy, vertex: u32) -> (Vec4, f32) {
        if let Some(light) = self.vertices.get(vertex as usize).copied().flatten() {
            let shown = self.shown.get(vertex as usize).copied();
            let shown = shown.unwrap_or_else(|| self.lights.bounded(light.irradiance()));
            return (shown, light.error());
        }
        match hierarchy.mesh.vertices[vertex as usize].ends {
            // Ends were made before the vertices between them, so this descends.
            Some(ends) => {
                let [(a, a_error), (b, b_error)] = ends.map(|end| self.vertex(hierarchy, end));
                ((a + b) * 0.5, (a_error + b_error) * 0.5)
            }
            None => (Vec4::ZERO, 0.0),
        }
    }

    /// Direct irradiance at a corner of a leaf.
    pub(super) fn corner(&self, vertex: u32) -> Vec4 {
        self.vertices
            .get(vertex as usize)
            .copied()
            .flatten()
            .map_or(Vec4::ZERO, |light| self.lights.bounded(light.irradiance()))
    }

    /// Irradiance at a vertex without occlusion; 0 where it was not sampled.
    pub(super) fn unoccluded(&self, vertex: u32) -> Vec4 {
        let light = self.vertices[vertex as usize].unwrap_or_default();
        light.unoccluded()
    }

    /// Sample all vertices, and divide and sample until interpolation is good enough. Returns the rays shot.
    pub(super) fn adapt(
        &mut self,
        rays: &RayTree,
        hierarchy: &mut Hierarchy,
        limits: Limits,
        cancel: &Cancel,
    ) -> Option<u64> {
        let mut ray_count = 0;
        self.is_full = false;
        // Elements from here on were not looked at yet in this step.
        let mut fresh = 0;
        for round in 0..=MOST_ROUNDS {
            let (shot, mean) = self.sample(rays, hierarchy, limits, cancel)?;
            ray_count += shot;
            if round == MOST_ROUNDS {
                break;
            }
            let elements = fresh..hierarchy.mesh.elements.len();
            fresh = elements.end;
            let leaves: Vec<usize> = hierarchy.mesh.leaves_among(elements).collect();
            ray_count += self.probe_centres(rays, hierarchy, &leaves, limits, mean, cancel)?;
            let wanted = self.bent(hierarchy, &leaves, limits, mean);
            self.is_full = !hierarchy.mesh.fits(&wanted, limits.most_elements);
            if self.is_full || !hierarchy.mesh.divide(&wanted) {
                break;
            }
        }
        Some(ray_count)
    }

    /// Sample all vertices, until their noise is small enough. Returns the rays shot and the mean luminance.
    pub(super) fn sample(
        &mut self,
        rays: &RayTree,
        hierarchy: &Hierarchy,
        limits: Limits,
        cancel: &Cancel,
    ) -> Option<(u64, f32)> {
        let covering = self.cover(rays, hierarchy, limits.shadow_samples, limits.seed, cancel)?;
        let moving = self.move_before_walls(rays, hierarchy, limits, cancel)?;
        let mean = self.mean(hierarchy);
        let settling = self.settle(rays, hierarchy, limits, mean, cancel)?;
        Some((covering + moving + settling, mean))
    }

    fn mean(&self, hierarchy: &Hierarchy) -> f32 {
        super::gather::scale(hierarchy, |leaf| self.element(hierarchy, leaf))
    }

    /// How much the luminance of the corners varies, times the weight of the element, relative to the mean.
    fn spread(&self, hierarchy: &Hierarchy, element: usize, mean: f32) -> f32 {
        let corners = hierarchy.mesh.elements[element].vertices;
        let values = corners.map(|vertex| luminance(self.corner(vertex)));
        let range = values.iter().copied().fold(0.0, f32::max)
            - values.iter().copied().fold(f32::MAX, f32::min);
        range * share_root(hierarchy, element) / mean.max(f32::MIN_POSITIVE)
    }

    /// The light that an element would get if nothing stood before it, as `spread` counts, where none of it reaches the
    /// corners: rings and bands lie with all their corners under the edges of their neighbours.
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

    /// How far light that nothing blocks is from linear between the corners of an element, as `spread` counts; 0 where it
    /// cannot be above the tolerance, or where none reaches the corners.
    fn bend_unoccluded(
        &self,
        hierarchy: &Hierarchy,
        element: usize,
        limits: Limits,
        mean: f32,
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
        let at_centre = *self.unoccluded_at_centres[element].get_or_init(|| {
            let centre = centre_of(hierarchy, element);
            // What is off by far less than the tolerance tells as much.
            let brightest_corner = corners.into_iter().fold(0.0, f32::max);
            let scale = brightest_corner.max(BEND_SCALE * limits.finest_tolerance / weight);
            luminance(
                self.lights
                    .unoccluded(&centre, Some(scale), &mut Vec::new()),
            )
        });
        (at_centre - corners.iter().sum::<f32>() / 3.0).abs() * weight
    }

    /// Sample the centroids of those of some leaves whose corners differ, or may all be dark by chance. Returns the rays
    /// shot.
    fn probe_centres(
        &mut self,
        rays: &RayTree,
        hierarchy: &Hierarchy,
        leaves: &[usize],
        limits: Limits,
        mean: f32,
        cancel: &Cancel,
    ) -> Option<u64> {
        let element_count = hierarchy.mesh.elements.len();
        self.centres.resize(element_count, None);
        self.unoccluded_at_centres
            .resize(element_count, OnceLock::new());
        let unknown: Vec<usize> = leaves
            .par_iter()
            .copied()
            .filter(|&leaf| {
                hierarchy.mesh.is_held(leaf)
                    && hierarchy.mesh.elements[leaf].is_outside_solids()
                    && self.centres[leaf].is_none()
                    && (self.spread(hierarchy, leaf, mean) > limits.tolerance
                        || self.bend_unoccluded(hierarchy, leaf, limits, mean) > limits.tolerance
                        || self.may_show(hierarchy, leaf, limits, mean)
                        || self.hidden(hierarchy, leaf, mean) > HIDDEN_TOLERANCE * limits.tolerance)
            })
            .collect();
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
        let noisy = |index: usize, light: &DirectLight| {
            let corners = self.tally_of_corners(hierarchy, unknown[index]);
            limits.is_noisy(light, corners, share_root(hierarchy, unknown[index]), mean)
        };
        self.double(rays, &receivers, noisy, limits.seed, &mut lights, cancel)?;
        let mut ray_count = 0;
        for (leaf, light) in unknown.into_iter().zip(lights) {
            ray_count += u64::from(light.shot);
            self.centres[leaf] = Some(light);
        }
        Some(ray_count)
    }

    /// Those of some leaves whose corners do not tell what lies between.
    fn bent(&self, hierarchy: &Hierarchy, leaves: &[usize], limits: Limits, mean: f32) -> Vec<u32> {
        let mesh = &hierarchy.mesh;
        leaves
            .iter()
            .copied()
            .filter(|&leaf| {
                let element = &mesh.elements[leaf];
                let area = element.area_vector.length();
                let Some(centre) = self.centres.get(leaf).copied().flatten() else {
                    return false;
                };
                // What reaches into a solid was divided as far as it shall be.
                if !element.is_outside_solids() || area * 0.25 < SMOOTH_SHARE * limits.min_area {
                    return false;
                }
                // Shadows have borders however small elements are; light that nothing blocks does not.
                if area * 0.25 < limits.min_area {
                    return self.bend_unoccluded(hierarchy, leaf, limits, mean) > limits.tolerance;
                }
                let [a, b, c] = element.vertices.map(|vertex| self.corner(vertex));
                let bend = luminance((centre.irradiance() - (a + b + c) / 3.0).abs());
                let weight = share_root(hierarchy, leaf) / mean.max(f32::MIN_POSITIVE);
                bend * weight + SPREAD_SHARE * self.spread(hierarchy, leaf, mean) > limits.tolerance
                    || self.shows(hierarchy, leaf, &centre, limits, mean)
            })
            .map(|leaf| leaf as u32)
            .collect()
    }

    /// Bytes held.
    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(self.vertices.as_slice())
            + size_of_val(self.centres.as_slice())
            + size_of_val(self.unoccluded_at_centres.as_slice())
            + size_of_val(self.shown.as_slice())
            + self.offsets.memory_bytes()
    }
}
