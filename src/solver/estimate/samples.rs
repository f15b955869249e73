//! Rays from the points of an estimate, with what they met.

use glam::Vec3;
use rayon::prelude::*;

use super::groups::{Groups, Residual, order};
use crate::{
    geometry::{Random, RayTree, barycentric, cosine_direction, low_discrepancy_2d},
    hierarchy::{Channels as _, Hierarchy},
    sampling::SurfacePoint,
    scene::{Appearance, MaterialId, Scene},
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
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Stored {
    /// Irradiance, W/m².
    pub irradiance: Vec3,
    /// Reflectance of what rays meet.
    pub reflectance: Vec3,
}

/// A point of a surface that takes part in the solve.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub patch: u32,
    pub receiver: Receiver,
}

/// A point at which the error is estimated.
#[derive(Clone, Copy)]
pub(super) struct Point {
    pub place: Place,
    material: MaterialId,
    /// Reflectance there, with the texture, in the appearance of the scene.
    reflectance: Vec3,
}

impl Point {
    /// `None` for a point of a surface that takes no part.
    pub(super) fn of(scene: &Scene, hierarchy: &Hierarchy, point: &SurfacePoint) -> Option<Self> {
        Some(Self {
            place: Place::of(hierarchy, point)?,
            material: scene.triangles[point.triangle.index()].material,
            reflectance: point.reflectance,
        })
    }

    /// The light stored there; `None` where there is none.
    pub(super) fn stored(&self, light: Scenery<'_>, shown: Appearances<'_>) -> Option<Stored> {
        let stored = light.stored(self.place.patch, self.place.receiver.point)?;
        let [now, before] = [shown.now, shown.of_scene].map(|all| {
            let appearance = all.get(self.material.index());
            appearance.map_or(Vec3::ONE, |appearance| appearance.reflectance)
        });
        let ratio = |now: f32, before: f32| if before > 0.0 { now / before } else { 0.0 };
        let change = Vec3::new(
            ratio(now.x, before.x),
            ratio(now.y, before.y),
            ratio(now.z, before.z),
        );
        Some(Stored {
            reflectance: self.reflectance * change,
            ..stored
        })
    }
}

/// Appearances by material.
#[derive(Clone, Copy)]
pub(super) struct Appearances<'a> {
    pub now: &'a [Appearance],
    pub of_scene: &'a [Appearance],
}

impl Place {
    /// The place of a point; `None` where it takes no part.
    pub(super) fn of(hierarchy: &Hierarchy, point: &SurfacePoint) -> Option<Self> {
        let patch = hierarchy.patch_met(point.triangle, -point.normal)?;
        Some(Self {
            patch: patch as u32,
            receiver: Receiver {
                point: point.position,
                normal: point.normal,
                triangle: point.triangle,
            },
        })
    }
}

/// The light shown, and what rays can meet.
#[derive(Clone, Copy)]
pub(super) struct Scenery<'a> {
    pub hierarchy: &'a Hierarchy,
    pub direct: &'a DirectFields,
    pub rays: &'a RayTree,
    /// Irradiance by vertex, W/m².
    pub irradiance: &'a [Vec3],
    pub cancel: &'a Cancel,
}

impl Scenery<'_> {
    /// The light stored at a point of a patch.
    pub(super) fn stored(&self, patch: u32, point: Vec3) -> Option<Stored> {
        let mesh = &self.hierarchy.mesh;
        let leaf = mesh.leaf_at(patch as usize, point)?;
        let [a, b, c] = barycentric(point, mesh.corners(leaf)).to_array();
        let [u, v, w] = mesh.elements[leaf]
            .vertices
            .map(|vertex| self.irradiance[vertex as usize]);
        let met = 1.0 / self.hierarchy.opacity_of(leaf).max(f32::MIN_POSITIVE);
        let irradiance = match mesh.elements[leaf].is_covered {
            true => Vec3::ZERO,
            false => u * a + v * b + w * c,
        };
        Some(Stored {
            irradiance,
            reflectance: self.hierarchy.reflectance_of(leaf) * met,
        })
    }

    /// The place of a point of a patch in the order of groups.
    pub(super) fn order(&self, patch: u32, point: Vec3) -> u64 {
        let corners = self.hierarchy.mesh.corners(patch as usize);
        order(patch, barycentric(point, corners))
    }

    /// What a ray meets over the mirrors on its way, and its tint.
    fn meet(&self, from: &Receiver, direction: Vec3) -> (Kept, Vec3) {
        let end = self
            .rays
            .followed(from.point, direction, Some(from.triangle));
        let met = end.hit.and_then(|hit| {
            let patch = self.hierarchy.patch_met(hit.triangle, end.direction)?;
            Some(Kept {
                patch: patch as u32,
                point: end.origin + end.direction * hit.distance,
            })
        });
        (met.unwrap_or(Kept::NOTHING), end.tint)
    }
}

/// One set of rays from places, by their index.
pub(super) struct Samples {
    seed: u64,
    kept: Vec<Vec<Kept>>,
    /// Tints of these rays; empty where there is none.
    tints: Vec<Vec<Vec3>>,
    direct: PointLight,
}

impl Samples {
    pub(super) fn new(count: usize, seed: u64) -> Self {
        Self {
            seed,
            kept: vec![Vec::new(); count],
            tints: vec![Vec::new(); count],
            direct: PointLight::default(),
        }
    }

    pub(super) fn forget_direct_light(&mut self) {
        self.direct = PointLight::default();
    }

    /// Shoot until each place has had `count` rays. Returns the rays shot; `None` when cancelled.
    pub(super) fn shoot(
        &mut self,
        scene: Scenery<'_>,
        places: &[Option<Place>],
        indices: &[usize],
        count: u32,
    ) -> Option<u64> {
        let (seed, is_tinted) = (self.seed, scene.rays.has_tints());
        // Over the hemisphere.
        let kept = &self.kept;
        let of_place = |(&index, place): (&usize, &Option<Place>)| -> Vec<(Kept, Vec3)> {
            let Some(place) = place.filter(|_| !scene.cancel.is_cancelled()) else {
                return Vec::new();
            };
            let shift = Random::new(seed, index as u64).uniform_2d();
            let of_ray = |ray| {
                let square = low_discrepancy_2d(ray, shift);
                let direction = cosine_direction(place.receiver.normal, square);
                scene.meet(&place.receiver, direction)
            };
            let before = kept[index].len() as u32;
            (before..count).map(of_ray).collect()
        };
        let all = indices.par_iter().zip(places).with_min_len(4);
        let added: Vec<_> = all.map(of_place).collect();
        scene.cancel.proceed()?;
        let shot: u64 = added.iter().map(|added| added.len() as u64).sum();
        for (&index, added) in indices.iter().zip(added) {
            self.kept[index].extend(added.iter().map(|(kept, _)| kept));
            if is_tinted {
                self.tints[index].extend(added.iter().map(|(_, tint)| tint));
            }
        }
        // To emitters and outside.
        let placed = indices.iter().zip(places);
        let placed = placed.filter_map(|(&index, place)| Some((index, place.as_ref()?.receiver)));
        let shadow = shadow_rays(count);
        let lit = scene.direct.sample_points(
            scene.rays,
            placed,
            shadow,
            seed,
            &mut self.direct,
            scene.cancel,
        );
        Some(shot + lit?)
    }

    /// What the first ray of a place met that met anything.
    pub(super) fn first_met(&self, hierarchy: &Hierarchy, index: usize) -> Option<Place> {
        let mut kept = self.kept[index].iter();
        let kept = kept.find(|kept| kept.patch != Kept::NOTHING.patch)?;
        let patch = &hierarchy.patches[kept.patch as usize];
        Some(Place {
            patch: kept.patch,
            receiver: Receiver {
                point: kept.point,
                normal: patch.normal,
                triangle: patch.triangle,
            },
        })
    }

    /// The residuals at some places; 0 where there is none.
    pub(super) fn residuals(
        &self,
        scene: Scenery<'_>,
        places: &[Option<Place>],
        indices: &[usize],
        groups: &Groups,
    ) -> Vec<Residual> {
        let residual = |(&index, place): (&usize, &Option<Place>)| {
            let stored = place.and_then(|place| scene.stored(place.patch, place.receiver.point));
            let mut row = vec![Vec3::ZERO; groups.count()];
            let (kept, tints) = (&self.kept[index], &self.tints[index]);
            let weight = kept.len() as f32;
            let Some(stored) = stored else {
                return Residual {
                    residual: Vec3::ZERO,
                    row,
                    weight,
                };
            };
            let by_ray = 1.0 / kept.len().max(1) as f32;
            let mut gathered = scene.direct.at_point(&self.direct, index).color();
            for (ray, kept) in kept.iter().enumerate() {
                if kept.patch == Kept::NOTHING.patch {
                    continue;
                }
                let Some(met) = scene.stored(kept.patch, kept.point) else {
                    continue;
                };
                let tint = tints.get(ray).copied().unwrap_or(Vec3::ONE);
                let factor = met.reflectance * tint * by_ray;
                gathered += factor * met.irradiance;
                let group = groups.of(scene.order(kept.patch, kept.point));
                if let Some(factors) = row.get_mut(group) {
                    *factors += factor;
                }
            }
            Residual {
                residual: stored.irradiance - gathered,
                row,
                weight,
            }
        };
        indices.par_iter().zip(places).map(residual).collect()
    }

    /// Memory in bytes.
    pub(super) fn memory_bytes(&self) -> usize {
        let kept = self.kept.iter().map(|kept| size_of_val(kept.as_slice()));
        let tints = self.tints.iter().map(|tints| size_of_val(tints.as_slice()));
        let lists = size_of_val(self.kept.as_slice()) + size_of_val(self.tints.as_slice());
        lists + kept.chain(tints).sum::<usize>() + self.direct.memory_bytes()
    }
}
