//! Rays from the points of an estimate, with what they met.

use glam::Vec3;
use rayon::prelude::*;

use super::groups::{Gather, Groups};
use crate::{
    geometry::{Random, RayTree, barycentric, cosine_direction, low_discrepancy_2d},
    hierarchy::{Channels as _, Hierarchy},
    solver::{
        Cancel,
        direct::{DirectFields, PointLight},
        places::Receiver,
    },
};

/// Shadow rays to each kind of light for so many rays over the hemisphere.
pub(super) fn shadow_rays(count: u32) -> u32 {
    count / 2
}

/// A point that a ray met.
#[derive(Clone, Copy)]
pub(super) struct Kept {
    /// The patch; `u32::MAX` where no light comes from.
    patch: u32,
    point: Vec3,
}

impl Kept {
    const NOTHING: Self = Self {
        patch: u32::MAX,
        point: Vec3::ZERO,
    };
}

/// Light stored at a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stored {
    /// Irradiance, W/m².
    pub irradiance: Vec3,
    /// Reflectance of what rays meet.
    pub reflectance: Vec3,
}

/// The light shown.
#[derive(Clone, Copy)]
pub(super) struct Light<'a> {
    pub hierarchy: &'a Hierarchy,
    /// Irradiance by vertex, W/m².
    pub irradiance: &'a [Vec3],
}

impl Light<'_> {
    /// The light stored at a point of a patch.
    pub(super) fn at(&self, patch: u32, point: Vec3) -> Option<Stored> {
        let mesh = &self.hierarchy.mesh;
        let leaf = mesh.leaf_at(patch as usize, point)?;
        let [a, b, c] = barycentric(point, mesh.corners(leaf)).to_array();
        let [u, v, w] = mesh.elements[leaf]
            .vertices
            .map(|vertex| self.irradiance[vertex as usize]);
        let met = 1.0 / self.hierarchy.opacity_of(leaf).max(f32::MIN_POSITIVE);
        Some(Stored {
            irradiance: u * a + v * b + w * c,
            reflectance: self.hierarchy.reflectance_of(leaf) * met,
        })
    }
}

/// Where rays start and what they can meet.
#[derive(Clone, Copy)]
pub(super) struct Meet<'a> {
    pub hierarchy: &'a Hierarchy,
    pub rays: &'a RayTree,
    pub points: &'a [Receiver],
    pub cancel: &'a Cancel,
}

impl Meet<'_> {
    /// What a ray meets, and its tint.
    fn meet(&self, from: &Receiver, direction: Vec3) -> (Kept, Vec3) {
        let start = Some(from.triangle);
        let hit = self.rays.closest(from.point, direction, start);
        let tint = self.rays.tint(from.point, direction, start, hit);
        let met = hit.and_then(|hit| {
            let patch = self.hierarchy.side_met(hit.triangle, direction)?;
            let is_active = self.hierarchy.active_patches().contains(&patch);
            is_active.then(|| Kept {
                patch: patch as u32,
                point: from.point + direction * hit.distance,
            })
        });
        (met.unwrap_or(Kept::NOTHING), tint)
    }
}

/// One set of rays from all points.
pub(super) struct Samples {
    seed: u64,
    /// By point.
    kept: Vec<Vec<Kept>>,
    /// Tints of these rays; empty where no pane is coloured.
    tints: Vec<Vec<Vec3>>,
    direct: PointLight,
}

impl Samples {
    pub(super) fn new(points: usize, seed: u64) -> Self {
        Self {
            seed,
            kept: vec![Vec::new(); points],
            tints: vec![Vec::new(); points],
            direct: PointLight::default(),
        }
    }

    pub(super) fn forget_direct_light(&mut self) {
        self.direct = PointLight::default();
    }

    /// Shoot until each of some points has had `count` rays. Returns the rays shot; `None` when cancelled.
    pub(super) fn shoot(
        &mut self,
        meet: Meet<'_>,
        chosen: &[usize],
        direct: &DirectFields,
        count: u32,
    ) -> Option<u64> {
        let (seed, is_tinted) = (self.seed, meet.rays.has_coloured_panes());
        let kept = &self.kept;
        let added: Vec<Vec<(Kept, Vec3)>> = chosen
            .par_iter()
            .with_min_len(4)
            .map(|&index| {
                if meet.cancel.is_cancelled() {
                    return Vec::new();
                }
                let point = &meet.points[index];
                let shift = Random::new(seed, index as u64).uniform_2d();
                let of = |ray| {
                    let square = low_discrepancy_2d(ray, shift);
                    meet.meet(point, cosine_direction(point.normal, square))
                };
                (kept[index].len() as u32..count).map(of).collect()
            })
            .collect();
        meet.cancel.proceed()?;
        let shot = added.iter().map(|added| added.len() as u64).sum::<u64>();
        for (&index, added) in chosen.iter().zip(added) {
            self.kept[index].extend(added.iter().map(|(kept, _)| kept));
            if is_tinted {
                self.tints[index].extend(added.iter().map(|(_, tint)| tint));
            }
        }
        let mut wanted = vec![0; meet.points.len()];
        for &index in chosen {
            wanted[index] = shadow_rays(count);
        }
        let known = &mut self.direct;
        let shadow =
            direct.sample_points(meet.rays, meet.points, &wanted, seed, known, meet.cancel);
        Some(shot + shadow?)
    }

    /// The light shown that the rays of some points met.
    pub(super) fn gathers(
        &self,
        light: Light<'_>,
        chosen: &[usize],
        groups: &Groups,
    ) -> Vec<Gather> {
        let gather = |&point: &usize| {
            let (kept, tints) = (&self.kept[point], &self.tints[point]);
            let by_ray = 1.0 / kept.len().max(1) as f32;
            let mut gather = Gather {
                irradiance: Vec3::ZERO,
                row: vec![Vec3::ZERO; groups.count()],
            };
            for (ray, kept) in kept.iter().enumerate() {
                if kept.patch == Kept::NOTHING.patch {
                    continue;
                }
                let Some(met) = light.at(kept.patch, kept.point) else {
                    continue;
                };
                let factor =
                    met.reflectance * tints.get(ray).copied().unwrap_or(Vec3::ONE) * by_ray;
                gather.irradiance += factor * met.irradiance;
                if let Some(factors) = gather.row.get_mut(groups.of_patch(kept.patch)) {
                    *factors += factor;
                }
            }
            gather
        };
        chosen.par_iter().map(gather).collect()
    }

    /// Direct irradiance of a point, W/m².
    pub(super) fn direct(&self, fields: &DirectFields, point: usize) -> Vec3 {
        fields.at_point(&self.direct, point).color()
    }

    /// Memory in bytes.
    pub(super) fn memory_bytes(&self) -> usize {
        let kept = self.kept.iter().map(|kept| size_of_val(kept.as_slice()));
        let tints = self.tints.iter().map(|tints| size_of_val(tints.as_slice()));
        kept.chain(tints).sum()
    }
}
