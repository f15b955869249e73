//! The elements with their direct light.

use std::f32::consts::PI;

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::field::DirectField;
use crate::{
    hierarchy::{Channels as _, Hierarchy},
    solver::sums::ordered_sum,
};

/// The elements with their direct light: the constant part of the exchange of light over links.
#[derive(Clone, Copy)]
pub(crate) struct Surfaces<'a> {
    /// The elements, with their reflectance and emission.
    pub(crate) hierarchy: &'a Hierarchy,
    /// `None` if no emitter is sampled.
    pub(crate) direct: Option<&'a DirectField>,
}

impl<'a> Surfaces<'a> {
    /// The elements of a hierarchy with a field of direct light, if there is one.
    pub(crate) fn new(hierarchy: &'a Hierarchy, direct: &'a Option<DirectField>) -> Self {
        Self {
            hierarchy,
            direct: direct.as_ref(),
        }
    }

    /// Direct irradiance of a leaf, W/m²; 0 without a field.
    pub(crate) fn direct(&self, element: usize) -> Vec4 {
        self.direct
            .map_or(Vec4::ZERO, |field| field.element(self.hierarchy, element))
    }

    /// The same by element; 0 for elements that are not leaves.
    pub(crate) fn direct_of_leaves(&self) -> Vec<Vec4> {
        let elements = self.hierarchy.mesh.elements.par_iter().enumerate();
        elements
            .map(|(index, element)| {
                if element.is_leaf() {
                    self.direct(index)
                } else {
                    Vec4::ZERO
                }
            })
            .collect()
    }

    /// Whether the emission of an element is sampled, and so not sent over links.
    pub(crate) fn is_sampled(&self, element: usize) -> bool {
        let patch = self.hierarchy.mesh.elements[element].patch as usize;
        self.direct
            .is_some_and(|field| field.lights.is_sampled(patch))
    }

    /// Radiosity of a leaf under this irradiance, without sampled emission, W/m²; its active share is the opacity;
    /// all 0 inside a solid.
    pub(crate) fn radiosity(&self, element: usize, irradiance: Vec4) -> Vec4 {
        if self.hierarchy.mesh.elements[element].is_inside_solid() {
            return Vec4::ZERO;
        }
        let reflected = self.hierarchy.reflectance_of(element) * irradiance.color();
        let emitted = if self.is_sampled(element) {
            Vec3::ZERO
        } else {
            self.hierarchy.emission_of(element) * PI
        };
        (reflected + emitted).extend(self.hierarchy.opacity_of(element))
    }

    /// Power of the sampled emitters, summed over the colours.
    pub(crate) fn sampled_power(&self) -> f64 {
        let Some(field) = self.direct else {
            return 0.0;
        };
        let of_patch = |index: usize| {
            let patch = &self.hierarchy.patches[index];
            f64::from((patch.emission * PI).element_sum()) * f64::from(patch.area)
        };
        field.lights.sampled_patches().map(of_patch).sum()
    }

    /// Upper bound of the total power, summed over the colours: the emitted power, if all surfaces reflected as the
    /// brightest one does.
    pub(crate) fn most_power(&self) -> f64 {
        let patches = &self.hierarchy.patches;
        let brightest = self.hierarchy.largest_reflectance();
        let emitted = ordered_sum(patches.len(), |index| {
            patches[index].emission.as_dvec3() * f64::from(patches[index].area)
        });
        let absorbed = 1.0 - f64::from(brightest);
        if absorbed > 0.0 {
            f64::from(PI) * emitted.element_sum() / absorbed
        } else {
            f64::INFINITY
        }
    }
}
