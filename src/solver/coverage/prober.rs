//! Estimation of the coverage: rays from groups of cells, and from each cell of the groups that are not enclosed.

use glam::Vec3;
use rayon::prelude::*;

use super::{hemisphere::HemisphereCoverage, map::CoverageMap};
use crate::{
    geometry::{Random, RayTree, cosine_direction, low_discrepancy_2d, triangle_point},
    hierarchy::{Element, Hierarchy},
    scene::Scene,
    solver::{Cancel, places::outside_places},
};

/// Share of the rays that is shot for coarse steps. Larger, and the first picture comes later; smaller, and cells that
/// are not enclosed are too bright until the other rays are shot.
const ROUGH_SHARE: f32 = 0.125;

/// Patches that are probed together first. If every ray of a group meets a lit side, so do nearly all others. Smaller,
/// and more rays are needed; larger, and one leak makes many cells be probed one by one.
const GROUP_PATCHES: u32 = 64;

/// Bounding boxes of triangles that a ray crosses in usual scenes. Where it crosses more, fewer rays are shot, from
/// larger groups. Smaller, and the coverage is noisier; larger, and scenes of overlapping triangles take long.
const USUAL_CROSSINGS: f32 = 64.0;

/// Fewest rays per group. Fewer, and leaks are missed; more cost time in all scenes.
const GROUP_RAYS: usize = 24;

/// Cells per ray of a group, if that gives more rays than [`GROUP_RAYS`]. Fewer cost time; more, and leaks are missed.
const CELLS_PER_RAY: usize = 2;

/// Rays of the second pass over all groups, made if one group is not enclosed: in such a scene, groups that
/// `GROUP_RAYS` found enclosed may have small leaks, which matter where walls are white. Fewer miss leaks; more cost
/// time.
const SECOND_RAYS: usize = 100_000;

/// Most rays of the second pass per group. Fewer miss leaks in small scenes; more cost time there.
const MOST_SECOND_RAYS: usize = 1024;

/// Rays of all cells of groups that are not enclosed, where these are enough for each cell. More delay the first picture;
/// fewer leave noise in scenes with openings.
const CELL_RAYS: usize = 100_000;

/// Fewest rays per cell. Fewer leave noise; more delay the first picture of large scenes.
const LEAST_CELL_RAYS: usize = 16;

/// Most cells that are probed one by one; if there are more, neighbours share their rays. Smaller, and small
/// differences between neighbours are lost; larger, and large scenes with openings wait long for their first picture.
const MOST_PROBED_CELLS: usize = 60_000;

/// Approximate number of groups of neighbours that share their rays. Fewer blur the coverage; more delay the first
/// picture.
const MOST_SHARES: usize = 15_000;

/// Neighbouring cells count as enclosed if at least this many rays from them met only lit sides. Fewer, and leaks are
/// missed; more, and few cells of small scenes with openings count as enclosed.
const ENCLOSED_RAYS: f32 = 512.0;

/// Counts of what the rays of a cell met.
#[derive(Clone, Copy, Debug, Default)]
struct Met {
    /// Rays that met a lit side.
    hits: f32,
    /// The same rays, each with its tint: 1 on average, but what coloured panes make of single rays may add to more.
    tinted: f32,
    /// Rays that met anything but the inside of a solid, each with its tint.
    blocked: f32,
    /// Rays that began outside solids.
    rays: f32,
    /// Rays that began inside a solid.
    within: f32,
}

impl Met {
    /// Hits with their tints, no more than rays.
    fn filled(self) -> f32 {
        self.tinted.min(self.rays)
    }

    /// Share of hits, with half a hit and half a miss added, so that no finite number of rays gives 0 or 1.
    fn share(self) -> f32 {
        (self.filled() + 0.5) / (self.rays + 1.0)
    }

    /// Of the rays that met something, the part that met a lit side, with one more that has the result of `around`.
    fn lit(self, around: f32) -> f32 {
        ((self.tinted + around) / (self.blocked + 1.0)).min(1.0)
    }

    /// Standard error of the share for this many rays.
    fn deviation(self, rays: f32) -> f32 {
        (self.share() * (1.0 - self.share()) / (rays + 1.0)).sqrt()
    }

    /// The coverage of each of `sharing` cells, from their rays and those of their neighbourhood `around`.
    fn coverage(self, around: Self, sharing: usize) -> HemisphereCoverage {
        if self.rays == 0.0 {
            return HemisphereCoverage::INSIDE_SOLID;
        }
        // Cells that share their rays may differ: their coverage counts as that of a few rays.
        let rays = if sharing > 1 {
            LEAST_CELL_RAYS as f32
        } else {
            self.rays
        };
        // One more ray has the mean result of the neighbourhood.
        let share = (self.filled() + around.share()) / (self.rays + 1.0);
        let lit = self.lit(around.lit(1.0));
        HemisphereCoverage::estimated(share, self.deviation(rays), lit)
    }

    /// The counts of both.
    fn and(self, other: Self) -> Self {
        Self {
            hits: self.hits + other.hits,
            tinted: self.tinted + other.tinted,
            blocked: self.blocked + other.blocked,
            rays: self.rays + other.rays,
            within: self.within + other.within,
        }
    }
}

/// Append the coverage of cells in the order of the tree, of which each `sharing` cells share one count. Neighbours are
/// enclosed if all their rays met lit sides and are at least [`ENCLOSED_RAYS`]; others are halved down to single
/// counts.
fn pooled(cells: &[Met], around: Met, sharing: usize, coverage: &mut Vec<HemisphereCoverage>) {
    let met = cells.iter().copied().fold(Met::default(), Met::and);
    if met.hits >= met.rays && met.rays >= ENCLOSED_RAYS {
        coverage.resize(coverage.len() + cells.len(), HemisphereCoverage::ENCLOSED);
    } else if let [cell] = cells {
        coverage.push(cell.coverage(around, sharing));
    } else {
        let (first, second) = cells.split_at(cells.len() / 2);
        pooled(first, met, sharing, coverage);
        pooled(second, met, sharing, coverage);
    }
}

/// The result of probing.
pub(crate) struct Probed {
    pub coverage: CoverageMap,
    /// Cells some of whose rays began inside a solid.
    pub within: Vec<usize>,
    pub ray_count: u64,
}

/// Estimate the coverage of all cells for a coarse step or another one; `None` when cancelled. The cells are those of
/// the `known` coverage, or the present leaves of the mesh if none is known.
pub(crate) fn probe(
    scene: &Scene,
    hierarchy: &Hierarchy,
    rays: &RayTree,
    known: &CoverageMap,
    is_coarse: bool,
    seed: u64,
    cancel: &Cancel,
) -> Option<Probed> {
    // In a clear scene only this needs a ray tree.
    let own_tree = rays.is_clear().then(|| RayTree::new(scene));
    let rays = own_tree.as_ref().unwrap_or(rays);
    let cost = (rays.crossings() / USUAL_CROSSINGS).max(1.0);
    let prober = Prober {
        scene,
        hierarchy,
        rays,
        seed,
        cancel,
        share: if is_coarse { ROUGH_SHARE } else { 1.0 } / cost,
    };
    // The cells, in groups of neighbours.
    let count = match known.count() {
        0 => hierarchy.mesh.elements.len(),
        count => count,
    };
    let groups: Vec<Vec<usize>> = hierarchy
        .groups((GROUP_PATCHES as f32 * cost) as u32)
        .into_par_iter()
        .map(|group| cells(hierarchy, group, count))
        .filter(|cells| !cells.is_empty())
        .collect();
    // Rays from groups, and from each cell of those that are not enclosed.
    let (unenclosed, tested) = prober.unenclosed_groups(&groups);
    let (found, probed) = prober.probe_groups(&unenclosed);
    cancel.proceed()?;
    // All others are enclosed, or inside solids.
    let elements = &hierarchy.mesh.elements[..count];
    let unprobed = |element: &Element| match element.is_inside_solid() {
        true => HemisphereCoverage::INSIDE_SOLID,
        false => HemisphereCoverage::ENCLOSED,
    };
    let mut of: Vec<HemisphereCoverage> = elements.iter().map(unprobed).collect();
    let mut within = Vec::new();
    let cells = unenclosed.into_iter().flatten();
    for (&cell, (coverage, is_within)) in cells.zip(found.into_iter().flatten()) {
        of[cell] = coverage;
        if is_within {
            within.push(cell);
        }
    }
    Some(Probed {
        coverage: CoverageMap::new(hierarchy, of, is_coarse),
        within,
        ray_count: (tested + probed) as u64,
    })
}

/// Shoots the rays that estimate the coverage. When cancelled, its results are incomplete.
struct Prober<'a> {
    scene: &'a Scene,
    hierarchy: &'a Hierarchy,
    rays: &'a RayTree,
    seed: u64,
    cancel: &'a Cancel,
    /// Share of the rays that is shot, by the step and by the cost of a ray.
    share: f32,
}

impl Prober<'_> {
    /// That share of a number of rays.
    fn budget(&self, rays: usize) -> usize {
        (rays as f32 * self.share) as usize
    }

    /// One ray from a cell, by its number.
    fn probe_once(&self, cell: usize, number: usize) -> Met {
        self.probe(cell, 1, number as u32)
    }

    /// The groups of cells that are not enclosed by lit surfaces, and the number of rays.
    fn unenclosed_groups<'g>(&self, groups: &'g [Vec<usize>]) -> (Vec<&'g [usize]>, usize) {
        let all_hit = |group: &[usize], first: usize, count: usize| {
            (0..count).all(|ray| {
                !self.cancel.is_cancelled()
                    && self
                        .probe_once(group[ray * group.len() / count], first + ray)
                        .hits
                        > 0.0
            })
        };
        let first_rays = |group: &[usize]| GROUP_RAYS.max(self.budget(group.len() / CELLS_PER_RAY));
        let mut enclosed: Vec<bool> = groups
            .par_iter()
            .map(|group| all_hit(group, 0, first_rays(group)))
            .collect();
        let mut shot: usize = groups.iter().map(|group| first_rays(group)).sum();
        if enclosed.iter().any(|is_enclosed| !is_enclosed) {
            let count = (self.budget(SECOND_RAYS) / groups.len()).min(MOST_SECOND_RAYS);
            enclosed
                .par_iter_mut()
                .zip(groups)
                .filter(|(is_enclosed, _)| **is_enclosed)
                .for_each(|(is_enclosed, group)| {
                    *is_enclosed = all_hit(group, first_rays(group), count);
                });
            shot += groups.len() * count;
        }
        let unenclosed = groups
            .iter()
            .zip(&enclosed)
            .filter(|(_, is_enclosed)| !**is_enclosed);
        (
            unenclosed.map(|(group, _)| group.as_slice()).collect(),
            shot,
        )
    }

    /// By group, the coverage of each cell and whether some of its rays began inside a solid; and the number of rays.
    /// Where there are many cells, neighbours share their rays.
    fn probe_groups(&self, groups: &[&[usize]]) -> (Vec<Vec<(HemisphereCoverage, bool)>>, usize) {
        // The number of cells that share their rays, and the number of rays of a part of a group.
        let area = |cell: &usize| self.hierarchy.mesh.elements[*cell].area_vector.length();
        let cells = || groups.iter().copied().flatten();
        let (cell_count, whole): (usize, f32) = (cells().count(), cells().map(area).sum());
        let is_shared = cell_count > self.budget(MOST_PROBED_CELLS);
        let sharing = if is_shared {
            cell_count.div_ceil(self.budget(MOST_SHARES).max(1))
        } else {
            1
        };
        let even = sharing as f32 / cell_count.max(1) as f32;
        let count = |part: &[usize]| {
            let share = part.iter().map(area).sum::<f32>() / whole;
            let count = self.budget(CELL_RAYS) as f32 * 0.5 * (even + share);
            (count as usize).max(LEAST_CELL_RAYS)
        };
        // The counts of a part.
        let probe_part = |part: &[usize]| match part {
            [cell] => self.probe(*cell, count(part) as u32, 0),
            _ => {
                let count = count(part);
                let cell = |ray: usize| part[ray * part.len() / count];
                let met = (0..count).map(|ray| self.probe_once(cell(ray), ray));
                met.fold(Met::default(), Met::and)
            }
        };
        // The coverage of each part, and the same for all its cells.
        let found = groups.par_iter().map(|group| {
            if self.cancel.is_cancelled() {
                return Vec::new();
            }
            let met: Vec<Met> = group.chunks(sharing).map(probe_part).collect();
            let mut coverage = Vec::with_capacity(met.len());
            pooled(&met, Met::default(), sharing, &mut coverage);
            let is_within = met
                .iter()
                .flat_map(|met| std::iter::repeat_n(met.within > 0.0, sharing));
            let parts = group.chunks(sharing).zip(coverage);
            parts
                .flat_map(|(part, coverage)| std::iter::repeat_n(coverage, part.len()))
                .zip(is_within)
                .collect()
        });
        let shot = groups.iter().flat_map(|group| group.chunks(sharing));
        let shot = shot.map(count).sum();
        (found.collect(), shot)
    }

    /// Counts of `count` cosine-weighted rays from an element; `first` is the number of the first within the element.
    /// Rays of a contact element start at its places outside solids, to whose coverage its links are scaled. A ray that
    /// meets the inside of a solid began there and is not counted in `rays`.
    fn probe(&self, element: usize, count: u32, first: u32) -> Met {
        let mut random = Random::new(self.seed, (u64::from(first) << 32) | element as u64);
        let shift = random.uniform_2d();
        let [a, b, c] = self.hierarchy.mesh.corners(element);
        let patch = self.hierarchy.patch_of(element);
        let places = outside_places(self.hierarchy, element);
        let mut met = Met::default();
        for index in 0..count {
            // Only directions are stratified: points of the same sequence would correlate with them.
            let at = triangle_point(random.uniform_2d());
            let place = (random.uniform() * places.len() as f32) as usize;
            let origin: Vec3 = match places.get(place) {
                Some(&place) => place,
                None => a * at.x + b * at.y + c * at.z,
            };
            let direction = cosine_direction(patch.normal, low_discrepancy_2d(index, shift));
            let start = Some(patch.triangle);
            let hit = self.rays.closest(origin, direction, start);
            let is_lit =
                hit.is_some_and(|hit| self.hierarchy.patch_met(hit.triangle, direction).is_some());
            let is_within = hit.is_some_and(|hit| {
                self.scene.triangles[hit.triangle.index()].bounds_solid
                    && self.hierarchy.side_met(hit.triangle, direction).is_none()
            });
            if hit.is_some() && !is_within {
                let tint = self.rays.tint(origin, direction, start, hit).element_sum() / 3.0;
                met.blocked += tint;
                met.tinted += if is_lit { tint } else { 0.0 };
                met.hits += f32::from(u8::from(is_lit));
            }
            if is_within {
                met.within += 1.0;
            } else {
                met.rays += 1.0;
            }
        }
        met
    }
}

/// The elements of a cluster that are outside solids and were leaves when the mesh had `count` elements, in the order
/// of its patches.
fn cells(hierarchy: &Hierarchy, cluster: usize, count: usize) -> Vec<usize> {
    let mut cells = Vec::new();
    let mut pending: Vec<usize> = hierarchy.clusters[cluster].patches().rev().collect();
    while let Some(index) = pending.pop() {
        let element = &hierarchy.mesh.elements[index];
        let is_cell = element.is_leaf() || element.children().start >= count;
        if !is_cell {
            pending.extend(element.children().rev());
        } else if !element.is_inside_solid() {
            cells.push(index);
        }
    }
    cells
}

#[cfg(test)]
mod tests;
