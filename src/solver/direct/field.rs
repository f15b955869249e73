//! Direct light as a field on the mesh: sampled at vertices, and at the centroids of elements where it varies.

use std::sync::Arc;

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::{lights::Lights, samples::DirectLight, smooth};
use crate::{
    hierarchy::{Element, Hierarchy, luminance},
    solver::{
        coverage::SkyShare,
        places::{OffsetPlaces, carry_over, project},
        sums,
    },
};

/// Direct light on a mesh.
pub(crate) struct DirectField {
    /// Shared with snapshots.
    pub(crate) lights: Arc<Lights>,
    /// By vertex, if it was sampled; shorter than the vertices of the mesh if some are new.
    pub(super) vertices: Vec<Option<DirectLight>>,
    /// At the centroid by element, where it was needed.
    pub(super) centres: Vec<Option<DirectLight>>,
    /// Luminance of the unoccluded irradiance at the centroid by element, where it was needed.
    pub(super) unoccluded_at_centres: Vec<Option<f32>>,
    /// Number of elements whose corners are all sampled; later ones are new.
    pub(super) sampled_elements: usize,
    /// Shadow rays of these corners at shadow borders.
    pub(crate) samples: u32,
    /// Offset places of vertices behind walls.
    pub(crate) offsets: OffsetPlaces,
}

impl DirectField {
    /// The field before any sample.
    pub(crate) fn new(lights: Lights) -> Self {
        Self {
            lights: Arc::new(lights),
            vertices: Vec::new(),
            centres: Vec::new(),
            unoccluded_at_centres: Vec::new(),
            sampled_elements: 0,
            samples: 0,
            offsets: OffsetPlaces::default(),
        }
    }

    /// Replace the light by that of recoloured emitters, with samples at vertices and centroids.
    pub(super) fn recolor(
        &mut self,
        lights: Lights,
        vertices: Vec<Option<DirectLight>>,
        centres: Vec<Option<DirectLight>>,
    ) {
        (self.lights, self.vertices, self.centres) = (Arc::new(lights), vertices, centres);
        self.unoccluded_at_centres.clear();
    }

    /// Direct irradiance of a leaf: the mean of its corners, or the quadrature rule of degree 2 with its centroid. For
    /// a contact element, the mean of its corners outside solids.
    pub(super) fn element(&self, hierarchy: &Hierarchy, element: usize) -> Vec4 {
        let leaf = &hierarchy.mesh.elements[element];
        if leaf.is_contact() {
            let outside = (0..3).filter(|&side| !leaf.is_inside_solid_at(side));
            let known = outside.clone().map(|side| self.corner(leaf.vertices[side]));
            return known.sum::<Vec4>() / (outside.count().max(1) as f32);
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

    /// Direct irradiance at each vertex for display, smoothed. A vertex that only prevents cracks takes the mean of the
    /// ends of its edge.
    pub(crate) fn shown(&self, hierarchy: &Hierarchy) -> Vec<Vec4> {
        let smoothed = self.smoothed(hierarchy);
        let mut shown: Vec<Vec4> = Vec::with_capacity(hierarchy.mesh.vertices.len());
        for (index, vertex) in hierarchy.mesh.vertices.iter().enumerate() {
            let sampled = self.vertices.get(index).copied().flatten();
            shown.push(match (sampled, vertex.ends) {
                (Some(_), _) => smoothed[index],
                // Ends were made before the vertices between them.
                (None, Some([a, b])) => (shown[a as usize] + shown[b as usize]) * 0.5,
                (None, None) => Vec4::ZERO,
            });
        }
        shown
    }

    /// The part of hemispheres that an even sky fills, by vertex as shown, and by element; `None` for other light.
    pub(super) fn shares(&self, hierarchy: &Hierarchy) -> Option<[Vec<SkyShare>; 2]> {
        let radiosity = self.lights.even_radiosity()?;
        let share = |light: Vec4, deviation: f32| SkyShare {
            share: luminance(light) / radiosity,
            deviation,
        };
        let mesh = &hierarchy.mesh;
        let mut doubts: Vec<f32> = Vec::with_capacity(mesh.vertices.len());
        for (index, vertex) in mesh.vertices.iter().enumerate() {
            let sampled = self.vertices.get(index).copied().flatten();
            doubts.push(match (sampled, vertex.ends) {
                (Some(light), _) => light.fraction_doubt(),
                // Ends were made before the vertices between them.
                (None, Some([a, b])) => (doubts[a as usize] + doubts[b as usize]) * 0.5,
                (None, None) => 1.0,
            });
        }
        let shown = self.shown(hierarchy);
        let vertices = shown.iter().zip(&doubts);
        let vertices = vertices
            .map(|(&light, &doubt)| share(light, doubt))
            .collect();
        let of_element = |index: usize| {
            let corners = mesh.elements[index]
                .vertices
                .map(|vertex| doubts[vertex as usize]);
            let doubt = Vec3::from_array(corners).length() / 3.0;
            share(self.element(hierarchy, index), doubt)
        };
        let elements = (0..mesh.elements.len()).into_par_iter().map(|index| {
            if mesh.elements[index].is_leaf() {
                of_element(index)
            } else {
                SkyShare::default()
            }
        });
        Some([vertices, elements.collect()])
    }

    /// Irradiance at the sampled vertices, smoothed as far as noise explains differences of neighbours.
    fn smoothed(&self, hierarchy: &Hierarchy) -> Vec<Vec4> {
        let fractions = smooth::fractions(hierarchy, &self.vertices);
        let known = self.vertices.iter().zip(fractions);
        let mut shown: Vec<Vec4> = known
            .map(|(light, fraction)| {
                let unoccluded = light.map_or(Vec4::ZERO, |light| light.unoccluded());
                self.lights.bounded(unoccluded * fraction)
            })
            .collect();
        let is_known = |element: &Element, side| !element.is_inside_solid_at(side);
        carry_over(&hierarchy.mesh, is_known, &mut shown);
        let is_outside = |leaf: &usize| hierarchy.mesh.elements[*leaf].is_outside_solids();
        let centres = hierarchy
            .mesh
            .leaves()
            .filter(is_outside)
            .filter_map(|leaf| {
                let centre = self.centres.get(leaf).copied().flatten()?;
                Some((leaf, self.lights.bounded(centre.irradiance())))
            });
        project(hierarchy, &mut shown, centres);
        shown
    }

    /// Direct irradiance at a vertex; 0 if it was not sampled.
    pub(crate) fn corner(&self, vertex: u32) -> Vec4 {
        self.vertices
            .get(vertex as usize)
            .copied()
            .flatten()
            .map_or(Vec4::ZERO, |light| self.lights.bounded(light.irradiance()))
    }

    /// Unoccluded irradiance at a vertex; 0 if it was not sampled.
    pub(super) fn unoccluded(&self, vertex: u32) -> Vec4 {
        let light = self.vertices[vertex as usize].unwrap_or_default();
        light.unoccluded()
    }

    /// Luminance to which errors of direct light are relative.
    pub(super) fn mean(&self, hierarchy: &Hierarchy) -> f32 {
        sums::scale(hierarchy, |leaf| self.element(hierarchy, leaf))
    }

    /// Memory in bytes.
    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(self.vertices.as_slice())
            + size_of_val(self.centres.as_slice())
            + size_of_val(self.unoccluded_at_centres.as_slice())
            + self.offsets.memory_bytes()
    }
}
