//! The elements with their direct light.

use std::f32::consts::PI;

use glam::{DVec3, Vec3, Vec4};
use rayon::prelude::*;

use super::fields::DirectFields;
use crate::{
    hierarchy::{Channels as _, Hierarchy},
    solver::sums::ordered_sum,
};

/// The elements with their direct light: the constant part of the exchange of light over links.
#[derive(Clone, Copy)]
pub(crate) struct Surfaces<'a> {
    /// The elements, with their reflectance and emission.
    pub(crate) hierarchy: &'a Hierarchy,
    /// Light that is sampled.
    pub(crate) direct: &'a DirectFields,
    /// Its irradiance of each leaf, if it was computed for many sweeps.
    known: Option<&'a [Vec4]>,
}

impl<'a> Surfaces<'a> {
    /// The elements of a hierarchy with their direct light.
    pub(crate) fn new(hierarchy: &'a Hierarchy, direct: &'a DirectFields) -> Self {
        Self {
            hierarchy,
            direct,
            known: None,
        }
    }

    /// The same, with the direct irradiance by element from [`Self::direct_of_leaves`], which sweeps need again and again.
    pub(crate) fn knowing<'b>(self, direct: &'b [Vec4]) -> Surfaces<'b>
    where
        'a: 'b,
    {
        Surfaces {
            known: Some(direct),
            ..self
        }
    }

    /// Direct irradiance of a leaf, W/m².
    pub(crate) fn direct(&self, element: usize) -> Vec4 {
        match self.known {
            Some(known) => known[element],
            None => self.direct.element(self.hierarchy, element),
        }
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
        self.direct.is_sampled(patch)
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

    /// The power that is not sent over links, and a bound of all power.
    pub(crate) fn powers(&self) -> Powers {
        let patches = &self.hierarchy.patches;
        let emitted = |index: usize| {
            let emission = patches[index].emission.as_dvec3();
            emission * (f64::from(PI) * f64::from(patches[index].area))
        };
        let outside = self.direct.outside_power(self.hierarchy);
        let from_emitters: DVec3 = self.direct.sampled_patches().map(emitted).sum();
        let all = ordered_sum(patches.len(), emitted).element_sum() + outside;
        let absorbed = 1.0 - f64::from(self.hierarchy.largest_reflectance());
        Powers {
            sampled: from_emitters.element_sum() + outside,
            most: if absorbed > 0.0 {
                all / absorbed
            } else {
                f64::INFINITY
            },
        }
    }
}

/// Powers of a scene, summed over the colours, in watts times the square of the frame's unit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Powers {
    /// Power of the sampled emitters, and the power that arrives from outside.
    pub(crate) sampled: f64,
    /// Upper bound of the total power: the emitted power and that from outside, if all surfaces reflected as the brightest
    /// one does.
    pub(crate) most: f64,
}
