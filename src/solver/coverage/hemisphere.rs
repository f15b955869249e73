//! HemisphereCoverage: which part of a surface's view is filled by lit surfaces.
//!
//! It is 1 in a closed room, less in an open scene or where backs are seen. The sum of form factors of each leaf must
//! equal it, so it tells by how much the kernel and the visibility of its links err together, and scales it away.
//!
//! What the sum lacks is mostly near by: coarse links see a whole cluster from its centre, and tables see edge-on what
//! lies beside it. Scaled like the rest, it would count as bright as what is far, and folds and undersides would glow. So
//! it is taken for as bright as the neighbourhood of the leaf, if that is darker. (Trimmed error after the second step of
//! `normal`: `room-42879` 5.8 → 4.7 %, `room-8621` 5.6 → 4.7 %; as bright as the neighbourhood whatever it sees: 5.0 %
//! both, and lit hilltops up to twice too bright.)

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use crate::{
    hierarchy::{Channels as _, Hierarchy, Moments, Tables},
    solver::plan::Plan,
    transport::luminance,
};

/// Form factors that add to less than this share of the coverage are not trusted to stand for what is missing.
/// Nearer to 1, and coarse links stay as wrong as they are; further, and the noise of a few rays is blown up.
const LEAST_ROW: f32 = 0.3;

/// Where more form factors are counted than there can be, by this share of the coverage, half of the surplus is taken
/// for light. Less of it may be that of dark and buried faces alone. Smaller, and light is lost about buried faces;
/// larger, and coarse links stay too bright.
const SURPLUS: f32 = 0.1;

/// Patches of a neighbourhood at most. With 4 errors are alike, with 64 a little larger; fewer tell only of the leaf's own
/// colour, more of what lies far off.
const NEIGHBOURS: u32 = 16;

/// Sums of form factors that are too large by so little that they must be multiplied by more than this are treated as
/// those that are too small: both are noise. Smaller, and what counts too much is taken for dark; larger, and light is
/// lost on average (halls of sheets 3.5 % too dark at `draft` with 1, 2.4 % with 0.8).
const SLIGHT: f32 = 0.8;

/// How much of a cell's view is filled by lit surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HemisphereCoverage {
    /// The part, 0…1.
    share: f32,
    /// Standard error of it: 0 in closed surroundings.
    deviation: f32,
}

impl HemisphereCoverage {
    /// Surrounded by lit surfaces.
    pub(super) const ENCLOSED: Self = Self {
        share: 1.0,
        deviation: 0.0,
    };

    /// Anything between nothing and all: form factors are left as they are.
    pub(super) const UNKNOWN: Self = Self {
        share: 0.0,
        deviation: f32::INFINITY,
    };

    /// Within a solid, where nothing is seen.
    pub(super) const INSIDE_SOLID: Self = Self {
        share: 0.0,
        deviation: 0.0,
    };

    /// This part, known up to a standard error.
    pub(super) fn estimated(share: f32, deviation: f32) -> Self {
        Self { share, deviation }
    }

    /// Whether it is known without doubt, and so for every part of the cell.
    fn is_certain(&self) -> bool {
        self.deviation == 0.0
    }

    /// What irradiance must be multiplied by, given the sum of its form factors. Where the coverage is only estimated,
    /// a sum that differs by no more than the estimate's error is left alone.
    fn factor(&self, row: f32) -> f32 {
        let gap = self.share - row;
        let doubt = 2.0 * self.deviation;
        let trust = if self.is_certain() {
            1.0
        } else {
            let surplus = if gap < 0.0 { SURPLUS * self.share } else { 0.0 };
            gap * gap / (gap * gap + doubt * doubt + surplus * surplus)
        };
        let target = row + trust * gap;
        let row = row.max(LEAST_ROW * self.share);
        if row > 0.0 { target / row } else { 1.0 }
    }

    /// Light of a leaf, with the sum of its form factors, as it is if they add to the coverage. Over the whole cell,
    /// `sums` are the area and the sum times area; `nearby` is the mean radiosity of the neighbourhood.
    pub(crate) fn scaled(&self, light: Vec4, sums: (f32, f32), nearby: Vec3) -> Vec4 {
        multiplied(
            light,
            self.factor_for(light.form_factor_sum(), sums),
            nearby,
        )
    }

    /// The factor for one leaf, from the sum of its form factors. An estimate stands for the cell as a whole only: its
    /// parts may rightly differ.
    fn factor_for(&self, row: f32, (area, weighted): (f32, f32)) -> f32 {
        if self.is_certain() || area <= 0.0 {
            self.factor(row)
        } else {
            self.factor(weighted / area)
        }
    }
}

/// Light with its form factors, in the fourth channel and left as they are, times a factor; what it lacks comes from `nearby` if that is
/// darker.
fn multiplied(light: Vec4, factor: f32, nearby: Vec3) -> Vec4 {
    let (color, row) = (light.color(), light.form_factor_sum());
    if factor <= SLIGHT || row <= 0.0 {
        return (color * factor).extend(row);
    }
    let seen = color / row;
    let is_darker = luminance(nearby.extend(0.0)) < luminance(seen.extend(0.0));
    let missing = if is_darker { nearby } else { seen };
    let whole = color + missing * ((factor - 1.0) * row);
    whole.max(Vec3::ZERO).extend(row)
}

/// CoverageMap of the cells of a mesh: of its leaves as they were before light was known.
#[derive(Clone, Debug, Default)]
pub(crate) struct CoverageMap {
    /// By element, as many as there were then.
    of: Vec<HemisphereCoverage>,
    /// By patch, the cluster that is its neighbourhood.
    near: Vec<u32>,
    /// Whether only a share of the rays was shot for them.
    is_rough: bool,
}

impl CoverageMap {
    /// The cell that an element lies in, or is.
    pub(crate) fn cell(&self, hierarchy: &Hierarchy, mut element: usize) -> usize {
        while element >= self.of.len() {
            element = hierarchy.mesh.elements[element].parent as usize;
        }
        element
    }

    /// Of all elements that there were when they were looked at.
    pub(crate) fn new(hierarchy: &Hierarchy, of: Vec<HemisphereCoverage>, is_rough: bool) -> Self {
        let mut near = vec![0; hierarchy.patches.len()];
        for cluster in hierarchy.groups(NEIGHBOURS) {
            near[hierarchy.clusters[cluster].patches()].fill(cluster as u32);
        }
        Self { of, near, is_rough }
    }

    /// The same coverage of all patches.
    fn even(hierarchy: &Hierarchy, coverage: HemisphereCoverage) -> Self {
        Self::new(hierarchy, vec![coverage; hierarchy.patches.len()], false)
    }

    /// Those that need no rays: 1 on closed surfaces, and none where all form factors are exact. Elsewhere they must be
    /// probed: where walls are white, a leak that is seen by one ray in a thousand decides.
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

    /// Elements that there were when they were looked at, the cells among them; 0 where none was yet.
    pub(super) fn count(&self) -> usize {
        self.of.len()
    }

    /// Whether they are good enough for coarse links, or for others.
    pub(crate) fn serve(&self, is_coarse: bool) -> bool {
        !self.of.is_empty() && (is_coarse || !self.is_rough)
    }

    /// Mean radiosity of the neighbourhood of a patch.
    pub(crate) fn nearby(&self, tables: &Tables, patch: usize) -> Vec3 {
        // Where nothing is lit there is no cluster.
        let cluster = tables.clusters.get(self.near[patch] as usize);
        let total = cluster.map_or(Vec4::ZERO, Moments::total);
        total.color() / total.area().max(f32::MIN_POSITIVE)
    }

    /// The coverage of a cell.
    pub(crate) fn of(&self, cell: usize) -> HemisphereCoverage {
        self.of[cell]
    }

    /// Bytes held.
    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(self.of.as_slice()) + size_of_val(self.near.as_slice())
    }
}

impl CoverageMap {
    /// Scale the colours of all leaves so that their form factors add to the coverage, and no leaf's to more than 1 where
    /// `bounds_rows`.
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

    /// What irradiance of each leaf must be multiplied by, given the sums of their form factors; `None` for other elements.
    pub(crate) fn factors(&self, hierarchy: &Hierarchy, irradiance: &[Vec4]) -> Vec<Option<f32>> {
        let elements = &hierarchy.mesh.elements;
        let cell_count = self.of.len();
        let cell = |index| self.cell(hierarchy, index);
        // Area and sum of form factors times area, by cell.
        let part = |index: usize| {
            let (area, row) = (
                elements[index].area_vector.length(),
                irradiance[index].form_factor_sum(),
            );
            if elements[index].is_leaf() {
                (area, area * row)
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
                let cell = cell(index);
                let coverage = self.of(cell);
                let is_leaf = elements[index].is_leaf();
                is_leaf
                    .then(|| coverage.factor_for(irradiance[index].form_factor_sum(), sums[cell]))
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Random;

    fn color(random: &mut Random) -> Vec3 {
        Vec3::from_array([(); 3].map(|()| random.uniform()))
    }

    #[test]
    fn in_even_light_the_scale_is_all_that_counts() {
        let mut random = Random::new(3, 0);
        for _ in 0..200 {
            let (radiosity, row, share) =
                (color(&mut random), 1.5 * random.uniform(), random.uniform());
            let coverage = HemisphereCoverage::estimated(share, 0.0);
            let light = (radiosity * row).extend(row);
            let scaled = coverage.scaled(light, (1.0, row), radiosity);
            let expected = radiosity * row * coverage.factor(row);
            assert!((scaled.color() - expected).abs().max_element() < 1e-5);
            assert_eq!(scaled.form_factor_sum(), row);
        }
    }

    #[test]
    fn what_is_lacking_is_never_brighter_than_the_neighbourhood_or_than_what_is_seen() {
        let mut random = Random::new(4, 0);
        for _ in 0..200 {
            let (seen, nearby) = (color(&mut random), color(&mut random));
            let row = 0.3 + 0.7 * random.uniform();
            let light = (seen * row).extend(row);
            let whole = HemisphereCoverage::ENCLOSED.scaled(light, (1.0, row), nearby);
            let luminance = |color: Vec3| luminance(color.extend(0.0));
            let lacking = luminance(whole.color() - seen * row) / (1.0 - row).max(1e-6);
            let least = luminance(seen).min(luminance(nearby));
            assert!(
                (lacking - least).abs() < 1e-3 || row > 0.999,
                "{lacking} {least}"
            );
            assert!(whole.min_element() >= 0.0);
        }
    }

    #[test]
    fn rows_that_are_far_too_large_are_scaled_as_they_are() {
        let light = Vec4::new(2.0, 1.0, 0.5, 2.0);
        let scaled = HemisphereCoverage::ENCLOSED.scaled(light, (1.0, 2.0), Vec3::splat(9.0));
        assert_eq!(scaled, Vec4::new(1.0, 0.5, 0.25, 2.0));
    }
}
