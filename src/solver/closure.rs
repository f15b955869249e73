//! Closure: which part of a patch's view is filled by lit surfaces.
//!
//! It is 1 in a closed room, less in an open scene or where backs are seen. The sum of form factors of each leaf must
//! equal it, so it tells by how much the kernel and the visibility of its links err together, and scales it away.

use glam::Vec3;
use rayon::prelude::*;

use crate::{
    geometry::{Random, RayTree, cosine_direction, low_discrepancy_2d, triangle_point},
    hierarchy::{Cluster, Hierarchy},
    scene::Scene,
};

/// Patches that are probed together first. If every ray of a group meets a lit side, so will nearly all others.
const GROUP_PATCHES: u32 = 64;

/// Rays per group.
const GROUP_RAYS: u32 = 24;

/// Rays per patch where the group's rays did not all meet a lit side.
const PATCH_RAYS: u32 = 12;

/// Closure of every patch, 0…1, and the rays shot.
pub(super) fn closures(
    scene: &Scene,
    hierarchy: &Hierarchy,
    rays: &RayTree,
    seed: u64,
) -> (Vec<f32>, u64) {
    let groups = groups(hierarchy);
    let found: Vec<(Vec<f32>, u64)> = groups
        .par_iter()
        .map(|cluster| {
            let range = cluster.patches();
            let count = range.len();
            let mut hits = 0;
            for ray in 0..GROUP_RAYS {
                let patch = range.start + (ray as usize * count) / GROUP_RAYS as usize;
                hits += probe(scene, hierarchy, rays, patch, 1, ray, seed);
            }
            if hits == GROUP_RAYS {
                return (vec![1.0; count], u64::from(GROUP_RAYS));
            }
            let shares = range
                .map(|patch| {
                    probe(scene, hierarchy, rays, patch, PATCH_RAYS, 0, seed) as f32
                        / PATCH_RAYS as f32
                })
                .collect();
            (
                shares,
                u64::from(GROUP_RAYS) + count as u64 * u64::from(PATCH_RAYS),
            )
        })
        .collect();
    let ray_count = found.iter().map(|(_, rays)| rays).sum();
    (
        found.into_iter().flat_map(|(shares, _)| shares).collect(),
        ray_count,
    )
}

/// The largest clusters with few enough patches, in the order of the patches.
fn groups(hierarchy: &Hierarchy) -> Vec<&Cluster> {
    let is_small =
        |cluster: &Cluster| cluster.is_leaf() || cluster.end - cluster.start <= GROUP_PATCHES;
    let parent = |cluster: &Cluster| hierarchy.clusters.get(cluster.parent as usize);
    let mut groups: Vec<&Cluster> = hierarchy
        .clusters
        .iter()
        .filter(|cluster| {
            is_small(cluster) && parent(cluster).is_none_or(|parent| !is_small(parent))
        })
        .collect();
    groups.sort_unstable_by_key(|cluster| cluster.start);
    groups
}

/// How many of some cosine-weighted rays from a patch meet a lit side; `first` numbers them within the patch.
fn probe(
    scene: &Scene,
    hierarchy: &Hierarchy,
    rays: &RayTree,
    patch: usize,
    count: u32,
    first: u32,
    seed: u64,
) -> u32 {
    let mut random = Random::new(seed, patch as u64);
    let shifts = [random.uniform_2d(), random.uniform_2d()];
    let [a, b, c] = hierarchy.mesh.corners(patch);
    let patch = &hierarchy.patches[patch];
    let is_met = |index: u32| {
        let at = triangle_point(low_discrepancy_2d(first + index, shifts[0]));
        let origin: Vec3 = a * at.x + b * at.y + c * at.z;
        let direction =
            cosine_direction(patch.normal, low_discrepancy_2d(first + index, shifts[1]));
        rays.closest(origin, direction, Some(patch.triangle))
            .is_some_and(|hit| {
                let triangle = hit.triangle.index();
                scene.triangles[triangle].two_sided
                    || scene.surfaces[triangle].area_vector.dot(direction) < 0.0
            })
    };
    (0..count).filter(|&index| is_met(index)).count() as u32
}
