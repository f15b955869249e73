//! The coverage of all cells, leaves and vertices of a mesh, and the scaling of their light to it.

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::{
    complement::{Complement, SkyShares},
    hemisphere::{HemisphereCoverage, multiplied},
};
use crate::{
    hierarchy::{Channels as _, Hierarchy, Moments, Tables},
    solver::plan::Plan,
};

/// Most patches of a neighbourhood. With 4 the errors are equal, with 64 a little larger. Smaller, and the
/// neighbourhood has the colour of the leaf itself; larger, and it includes far surfaces.
const NEIGHBOURS: u32 = 16;

/// Coverage by cell of a mesh. The cells are the leaves of the first mesh.
#[derive(Clone, Debug, Default)]
pub(crate) struct CoverageMap {
    /// By element of the first mesh.
    of: Vec<HemisphereCoverage>,
    /// By patch, the cluster that is its neighbourhood.
    near: Vec<u32>,
    /// Whether only a share of the rays was shot.
    is_rough: bool,
    /// The coverage of the present elements and vertices where an even sky gives it.
    complement: Option<Complement>,
}

impl CoverageMap {
    /// The cell that contains an element.
    pub(crate) fn cell(&self, hierarchy: &Hierarchy, mut element: usize) -> usize {
        while element >= self.of.len() {
            element = hierarchy.mesh.elements[element].parent as usize;
        }
        element
    }

    /// From the coverage of all elements of the first mesh.
    pub(crate) fn new(hierarchy: &Hierarchy, of: Vec<HemisphereCoverage>, is_rough: bool) -> Self {
        let mut near = vec![0; hierarchy.patches.len()];
        for cluster in hierarchy.groups(NEIGHBOURS) {
            near[hierarchy.clusters[cluster].patches()].fill(cluster as u32);
        }
        Self {
            of,
            near,
            is_rough,
            complement: None,
        }
    }

    /// The same coverage of all patches.
    fn even(hierarchy: &Hierarchy, coverage: HemisphereCoverage) -> Self {
        Self::new(hierarchy, vec![coverage; hierarchy.patches.len()], false)
    }

    /// The coverage that is known without rays: 1 in enclosed scenes, and unknown where all form factors are exact.
    /// `None` elsewhere: it must be probed, since with white walls even a leak that one ray in a thousand finds
    /// matters.
    pub(crate) fn without_rays(plan: &Plan, hierarchy: &Hierarchy) -> Option<Self> {
        if !plan.is_clear {
            return None;
        }
        let coverage = match (plan.is_enclosed, plan.is_by_patch) {
            (true, _) => HemisphereCoverage::ENCLOSED,
            (false, true) => HemisphereCoverage::UNKNOWN,
            (false, false) => return None,
        };
        Some(Self::even(hierarchy, coverage))
    }

    /// Number of elements of the first mesh; 0 before the coverage is known.
    pub(super) fn count(&self) -> usize {
        self.of.len()
    }

    /// Whether it is precise enough for a coarse step or another one.
    pub(crate) fn serve(&self, is_coarse: bool) -> bool {
        !self.of.is_empty() && (is_coarse || !self.is_rough)
    }

    /// Those of some cells that lie inside solids get no light.
    pub(crate) fn exclude_inside_solids(&mut self, hierarchy: &Hierarchy, cells: &[usize]) {
        for &cell in cells {
            if hierarchy.mesh.elements[cell].is_inside_solid() {
                self.of[cell] = HemisphereCoverage::INSIDE_SOLID;
            }
        }
    }

    /// Mean radiosity of the neighbourhood of a patch.
    pub(crate) fn nearby(&self, tables: &Tables, patch: usize) -> Vec3 {
        // A scene without active patches has no cluster.
        let cluster = tables.clusters.get(self.near[patch] as usize);
        let total = cluster.map_or(Vec4::ZERO, Moments::total);
        total.color() / total.area().max(f32::MIN_POSITIVE)
    }

    /// Give the present elements and vertices the complement of what an even sky fills, if there is one.
    pub(crate) fn complete(&mut self, hierarchy: &Hierarchy, sky: Option<&SkyShares>) {
        let probed = |element| self.of[self.cell(hierarchy, element)];
        self.complement = sky.map(|sky| Complement::new(hierarchy, sky, probed));
    }

    /// The coverage of a leaf: its own where the sky gives it, else that of its cell.
    pub(crate) fn of(&self, hierarchy: &Hierarchy, leaf: usize) -> HemisphereCoverage {
        let Some(complement) = &self.complement else {
            return self.of[self.cell(hierarchy, leaf)];
        };
        // Newer elements have that of the element that was divided.
        let mut element = leaf;
        while element >= complement.elements.len() {
            element = hierarchy.mesh.elements[element].parent as usize;
        }
        complement.elements[element]
    }

    /// The coverage at a vertex; `None` where the sky does not give it.
    pub(crate) fn at_vertex(&self, vertex: u32) -> Option<HemisphereCoverage> {
        let complement = self.complement.as_ref()?;
        complement.vertices.get(vertex as usize).copied()
    }

    /// The coverage at the corners of a leaf.
    pub(crate) fn at_corners(&self, hierarchy: &Hierarchy, leaf: usize) -> [HemisphereCoverage; 3] {
        let own = self.of(hierarchy, leaf);
        let corners = hierarchy.mesh.elements[leaf].vertices;
        match own.is_beside_sky() {
            true => corners.map(|vertex| self.at_vertex(vertex).unwrap_or(own)),
            false => [own; 3],
        }
    }

    /// Memory in bytes.
    pub(crate) fn memory_bytes(&self) -> usize {
        let complement = self.complement.as_ref();
        size_of_val(self.of.as_slice())
            + size_of_val(self.near.as_slice())
            + complement.map_or(0, Complement::memory_bytes)
    }
}

impl CoverageMap {
    /// Scale the irradiance of all leaves so that their form factors add to the coverage; if `bounds_rows`, those of
    /// each leaf to at most 1.
    pub(crate) fn scale(
        &self,
        hierarchy: &Hierarchy,
        power: &Tables,
        irradiance: &mut [Vec4],
        bounds_rows: bool,
    ) {
        let elements = &hierarchy.mesh.elements;
        let factors = self.factors(hierarchy, irradiance);
        irradiance
            .par_iter_mut()
            .zip(elements.par_iter().zip(factors))
            .with_min_len(1024)
            .for_each(|(value, (element, factor))| {
                let Some(factor) = factor else { return };
                let most = if bounds_rows && value.form_factor_sum() > 0.0 {
                    1.0 / value.form_factor_sum()
                } else {
                    f32::INFINITY
                };
                let nearby = self.nearby(power, element.patch as usize);
                *value = multiplied(*value, factor.min(most), nearby);
            });
    }

    /// Factor of the irradiance by leaf, given the sums of form factors; `None` for other elements.
    pub(crate) fn factors(&self, hierarchy: &Hierarchy, irradiance: &[Vec4]) -> Vec<Option<f32>> {
        let elements = &hierarchy.mesh.elements;
        let cell_count = self.of.len();
        let cell = |index| self.cell(hierarchy, index);
        // Area and sum of form factors times area, by cell.
        let part = |index: usize| {
            let (area, row_sum) = (
                elements[index].area_vector.length(),
                irradiance[index].form_factor_sum(),
            );
            if elements[index].is_leaf() {
                (area, area * row_sum)
            } else {
                (0.0, 0.0)
            }
        };
        let mut sums: Vec<(f32, f32)> = (0..cell_count).into_par_iter().map(part).collect();
        for index in cell_count..elements.len() {
            let (area, weighted) = part(index);
            let sum = &mut sums[cell(index)];
            *sum = (sum.0 + area, sum.1 + weighted);
        }
        (0..elements.len())
            .into_par_iter()
            .with_min_len(1024)
            .map(|index| {
                let sums = sums[cell(index)];
                let coverage = self.of(hierarchy, index);
                let is_leaf = elements[index].is_leaf();
                is_leaf.then(|| coverage.factor_for(irradiance[index], sums))
            })
            .collect()
    }
}
