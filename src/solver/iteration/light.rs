//! Light over links, with the links and tables from which it is computed.

use std::sync::Arc;

use glam::{Vec3, Vec4};

use crate::{
    geometry::{Image, RayTree},
    hierarchy::{Channels as _, Hierarchy, Reading, Tables, luminance},
    solver::{direct::Surfaces, sums},
    transport::{Kernel, LinkStore},
};

/// Growth of the mesh from which finer links are tried again that did not pay before. Smaller, and they are refined in
/// vain; larger, and links of a mesh that has grown stay coarse.
const GROWTH_TO_RETRY: usize = 2;

/// Light over links, with the links and tables from which it is computed.
#[derive(Default)]
pub(crate) struct LinkedLight {
    /// The pairs of nodes that exchange light.
    pub(crate) links: LinkStore,
    /// The threshold that they meet; 0 before the first.
    pub(crate) threshold: f32,
    /// Number of elements when finer links did not pay; 0 before.
    limited_at: usize,
    /// The same over mirrors.
    pub(crate) images: Vec<ImageLinks>,
    /// Linked irradiance of every element, scaled to the coverage, W/m²; the fourth channel is the unscaled sum of form
    /// factors.
    pub(crate) irradiance: Vec<Vec4>,
    /// Factor of the sent radiosity by element (see `balance`); 1 without links.
    pub(super) sending: Vec<f32>,
    /// Source tables: reflected light, and emission that is not sampled.
    pub(crate) power: Tables,
}

/// Links from the image of the scene in mirrors.
pub(crate) struct ImageLinks {
    pub(crate) image: Arc<Image>,
    pub(crate) links: LinkStore,
}

impl LinkedLight {
    /// Begin with links from all images in mirrors.
    pub(crate) fn show_images(&mut self, rays: &RayTree) {
        let unlinked = rays.images().iter().map(|image| ImageLinks {
            image: image.clone(),
            links: LinkStore::default(),
        });
        self.images = unlinked.collect();
    }

    /// Note that finer links do not pay for a mesh of so many elements.
    pub(crate) fn limit(&mut self, elements: usize) {
        self.limited_at = elements;
    }

    /// Whether they are known not to pay for a mesh of so many elements, which has hardly grown since.
    pub(crate) fn is_limited(&self, elements: usize) -> bool {
        elements < GROWTH_TO_RETRY * self.limited_at
    }

    /// Number of links, those over mirrors included.
    pub(crate) fn link_count(&self) -> usize {
        let images = self.images.iter().map(|image| image.links.len());
        self.links.len() + images.sum::<usize>()
    }

    /// Give new elements the irradiance and the factor of the element that was divided; those of the first mesh are
    /// dark.
    pub(crate) fn extend(&mut self, hierarchy: &Hierarchy) {
        for index in self.irradiance.len()..hierarchy.mesh.elements.len() {
            let parent = hierarchy.mesh.elements[index].parent as usize;
            let inherited = self.irradiance.get(parent).copied();
            self.irradiance.push(inherited.unwrap_or(Vec4::ZERO));
            self.sending
                .push(self.sending.get(parent).copied().unwrap_or(1.0));
        }
    }

    /// Irradiance of a leaf, direct light included, W/m².
    pub(crate) fn total(&self, surfaces: Surfaces<'_>, leaf: usize) -> Vec4 {
        self.irradiance[leaf] + surfaces.direct(leaf)
    }

    /// Radiosity of a leaf without sampled emission, W/m²; its active share is the opacity; all 0 inside a solid.
    pub(crate) fn radiosity(&self, surfaces: Surfaces<'_>, leaf: usize) -> Vec4 {
        surfaces.radiosity(leaf, self.total(surfaces, leaf))
    }

    /// Update the source tables to the irradiance of the leaves.
    pub(crate) fn pull(&mut self, surfaces: Surfaces<'_>) {
        let (irradiance, sending) = (&self.irradiance, &self.sending);
        self.power.pull(surfaces.hierarchy, |leaf| {
            surfaces.radiosity(leaf, irradiance[leaf] + surfaces.direct(leaf)) * sending[leaf]
        });
    }

    /// The kernel that reads the source tables.
    pub(crate) fn kernel<'a>(
        &'a self,
        hierarchy: &'a Hierarchy,
        reading: Option<Reading>,
    ) -> Kernel<'a> {
        Kernel {
            hierarchy,
            tables: &self.power,
            reading,
            image: None,
        }
    }

    /// Tables of the squared luminance of the sent radiosity: gathered over links, they give the variance of the
    /// radiosity that rays meet.
    pub(crate) fn squares(&self, hierarchy: &Hierarchy) -> Tables {
        let mut squares = Tables::default();
        squares.pull(hierarchy, |leaf| {
            let sent = self.power.elements[leaf];
            Vec3::splat(luminance(sent).powi(2)).extend(sent.active_share())
        });
        squares
    }

    /// Mean irradiance (luminance), to which thresholds relate. Before any link it is estimated from the direct light
    /// and the source tables.
    pub(crate) fn mean_irradiance(&self, surfaces: Surfaces<'_>) -> f32 {
        let hierarchy = surfaces.hierarchy;
        let mean = sums::scale(hierarchy, |leaf| self.total(surfaces, leaf));
        let is_dark = |light: &Vec4| light.color() == Vec3::ZERO;
        if !self.irradiance.iter().all(is_dark) {
            return mean;
        }
        let power = sums::area_sum(hierarchy, |leaf| self.power.elements[leaf]);
        let power = power / hierarchy.importance.area.max(f64::MIN_POSITIVE);
        let brightest = self.power.brightest(hierarchy, Hierarchy::ROOT);
        // Far emitters send most of their light past the scene.
        mean + luminance(power.as_vec3().extend(0.0)).min(luminance(brightest))
    }

    /// How often light bounces on average where none escapes, at least once: 1/(1 − ρ), ρ weighted by what arrives.
    pub(crate) fn bounces(&self, surfaces: Surfaces<'_>) -> f64 {
        let hierarchy = surfaces.hierarchy;
        let arrived = sums::area_total(hierarchy, |leaf| self.total(surfaces, leaf));
        let returned = sums::area_total(hierarchy, |leaf| {
            hierarchy.reflectance_of(leaf).extend(0.0) * self.total(surfaces, leaf)
        });
        let absorbed = (arrived - returned).max(f64::MIN_POSITIVE);
        (arrived / absorbed).max(1.0)
    }

    /// Memory in bytes.
    pub(crate) fn memory_bytes(&self) -> usize {
        let images = self.images.iter().map(|image| image.links.memory_bytes());
        self.power.memory_bytes()
            + self.links.memory_bytes()
            + images.sum::<usize>()
            + size_of_val(self.irradiance.as_slice())
            + size_of_val(self.sending.as_slice())
    }
}
