//! Light over links, and what it is computed from.

use glam::{Vec3, Vec4};

use crate::{
    hierarchy::{Channels as _, Hierarchy, Reading, Tables, luminance},
    solver::{direct::Surfaces, sums},
    transport::{Kernel, LinkStore},
};

/// Light over links, and what it is computed from.
#[derive(Default)]
pub(crate) struct LinkedLight {
    /// Over which pairs of nodes light travels.
    pub(crate) links: LinkStore,
    /// Irradiance of every element over links, scaled so that form factors add to the coverage; the fourth channel is their raw sum.
    pub(crate) irradiance: Vec<Vec4>,
    /// By element, what its radiosity is multiplied by before links carry it (see `balance`); 1 without links.
    pub(super) sending: Vec<f32>,
    /// What links carry: reflected light, and emission where it is linked.
    pub(crate) power: Tables,
}

impl LinkedLight {
    /// New elements inherit the irradiance, and the factor of what they send, of the one that was divided; the first have
    /// no light.
    pub(crate) fn extend(&mut self, hierarchy: &Hierarchy) {
        for index in self.irradiance.len()..hierarchy.mesh.elements.len() {
            let parent = hierarchy.mesh.elements[index].parent as usize;
            let inherited = self.irradiance.get(parent).copied();
            self.irradiance.push(inherited.unwrap_or(Vec4::ZERO));
            self.sending
                .push(self.sending.get(parent).copied().unwrap_or(1.0));
        }
    }

    /// Irradiance of a leaf, direct light included.
    pub(crate) fn total(&self, surfaces: Surfaces<'_>, leaf: usize) -> Vec4 {
        self.irradiance[leaf] + surfaces.direct(leaf)
    }

    /// Radiosity of a leaf but for emission that is sampled, with an active share of 1: nothing where it lies within a solid.
    pub(crate) fn radiosity(&self, surfaces: Surfaces<'_>, leaf: usize) -> Vec4 {
        surfaces.radiosity(leaf, self.total(surfaces, leaf))
    }

    /// Bring the source tables up to date with the irradiance of the leaves.
    pub(crate) fn pull(&mut self, surfaces: Surfaces<'_>) {
        let (irradiance, sending) = (&self.irradiance, &self.sending);
        self.power.pull(surfaces.hierarchy, |leaf| {
            surfaces.radiosity(leaf, irradiance[leaf] + surfaces.direct(leaf)) * sending[leaf]
        });
    }

    /// What reads the source tables.
    pub(crate) fn kernel<'a>(
        &'a self,
        hierarchy: &'a Hierarchy,
        reading: Option<Reading>,
    ) -> Kernel<'a> {
        Kernel {
            hierarchy,
            tables: &self.power,
            reading,
        }
    }

    /// Tables of the square of the luminance that is sent: gathered over links, they tell how much rays to the same sources differ.
    pub(crate) fn squares(&self, hierarchy: &Hierarchy) -> Tables {
        let mut squares = Tables::default();
        squares.pull(hierarchy, |leaf| {
            let sent = self.power.elements[leaf];
            Vec3::splat(luminance(sent).powi(2)).extend(sent.w)
        });
        squares
    }

    /// Mean irradiance (luminance), to which thresholds relate. Before any link it is guessed from the direct light.
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
        // Far surroundings send most of their light past the scene.
        mean + luminance(power.as_vec3().extend(0.0)).min(luminance(brightest))
    }

    /// Bytes held.
    pub(crate) fn memory_bytes(&self) -> usize {
        self.power.memory_bytes()
            + self.links.memory_bytes()
            + size_of_val(self.irradiance.as_slice())
            + size_of_val(self.sending.as_slice())
    }
}
