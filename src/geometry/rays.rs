//! The ray tree: is a segment blocked, and what does a ray meet first.
//!
//! An obvhs CWBVH over the scene's triangles. It serves rays only: clusters of light come from a tree of their own.

use std::time::Duration;

use glam::Vec3;
use obvhs::{
    BvhBuildParams,
    cwbvh::{CwBvh, builder::build_cwbvh_from_tris},
    ray::{Ray, RayHit},
    rt_triangle::RtTriangle,
    triangle::Triangle as RayTriangle,
};
use rayon::prelude::*;

use crate::scene::{Scene, TriangleId};

/// Rays start and end this far from their ends, in frame units.
/// Much smaller, and a ray meets the surface that it leaves; much larger, and thin gaps leak or close.
/// At the rim of the frame (50 units) single precision resolves 4e-6.
const RAY_OFFSET: f32 = 1e-4;

/// What a ray meets first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The triangle.
    pub triangle: TriangleId,
    /// Distance along the unit direction, in frame units.
    pub distance: f32,
}

/// Answers occlusion and closest-hit questions about a scene.
pub struct RayTree {
    tree: CwBvh,
    /// In the order of the tree's primitives.
    triangles: Vec<RtTriangle>,
    /// The scene's triangle of each primitive.
    ids: Vec<u32>,
    /// The first triangle with the same corners in the same sense, by triangle; empty where all differ.
    /// A builder that sees thousands of equal boxes makes a chain of them, too deep to be walked.
    firsts: Vec<u32>,
}

impl RayTree {
    /// Build the tree over all triangles of a scene.
    pub fn new(scene: &Scene) -> Self {
        let firsts = first_of_equals(scene);
        let different: Vec<TriangleId> = scene
            .triangle_ids()
            .filter(|id| firsts.is_empty() || firsts[id.index()] == id.0)
            .collect();
        let triangles: Vec<RayTriangle> = different
            .iter()
            .map(|&id| {
                let [a, b, c] = scene.corners(id).map(Into::into);
                RayTriangle {
                    v0: a,
                    v1: b,
                    v2: c,
                }
            })
            .collect();
        let tree = build_cwbvh_from_tris(
            &triangles,
            BvhBuildParams::medium_build(),
            &mut Duration::default(),
        );
        let in_tree_order = tree.primitive_indices.iter().map(|&index| index as usize);
        Self {
            triangles: in_tree_order
                .clone()
                .map(|index| RtTriangle::from(&triangles[index]))
                .collect(),
            ids: in_tree_order.map(|index| different[index].0).collect(),
            tree,
            firsts,
        }
    }

    /// The triangle that stands for this one in the tree.
    fn first_of(&self, id: TriangleId) -> u32 {
        self.firsts.get(id.index()).copied().unwrap_or(id.0)
    }

    /// Whether anything but the two triangles of its ends lies on the segment.
    /// Naming the ends lets a segment start on its own surface however small that is.
    pub fn occluded(&self, from: Vec3, to: Vec3, ends: [Option<TriangleId>; 2]) -> bool {
        let separation = to - from;
        let length = separation.length();
        if length <= 2.0 * RAY_OFFSET {
            return false;
        }
        let ray = Ray::new(
            from.into(),
            (separation / length).into(),
            RAY_OFFSET,
            length - RAY_OFFSET,
        );
        let [first, second] = ends.map(|end| end.map_or(u32::MAX, |id| self.first_of(id)));
        !self.tree.ray_traverse_miss(ray, |ray, primitive| {
            let id = self.ids[primitive];
            if id == first || id == second {
                f32::INFINITY
            } else {
                self.triangles[primitive].intersect(ray)
            }
        })
    }

    /// The nearest triangle along a ray of unit direction, leaving out the one that it starts on.
    pub fn closest(&self, origin: Vec3, direction: Vec3, from: Option<TriangleId>) -> Option<Hit> {
        let ray = Ray::new(origin.into(), direction.into(), RAY_OFFSET, f32::MAX);
        let start = from.map_or(u32::MAX, |id| self.first_of(id));
        let mut hit = RayHit::none();
        let met = self.tree.ray_traverse(ray, &mut hit, |ray, primitive| {
            if self.ids[primitive] == start {
                f32::INFINITY
            } else {
                self.triangles[primitive].intersect(ray)
            }
        });
        met.then(|| Hit {
            triangle: TriangleId(self.ids[hit.primitive_id as usize]),
            distance: hit.t,
        })
    }

    /// Bytes that the tree holds.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.tree.nodes.as_slice())
            + size_of_val(self.triangles.as_slice())
            + 2 * size_of_val(self.ids.as_slice())
            + size_of_val(self.firsts.as_slice())
    }
}

/// For each triangle the first that has the same corners in the same sense; nothing where all differ.
fn first_of_equals(scene: &Scene) -> Vec<u32> {
    let ids: Vec<TriangleId> = scene.triangle_ids().collect();
    let mut keyed: Vec<([[u32; 3]; 3], u32)> = ids
        .par_iter()
        .map(|&id| (corner_bits(scene, id), id.0))
        .collect();
    keyed.par_sort_unstable();
    if keyed.windows(2).all(|pair| pair[0].0 != pair[1].0) {
        return Vec::new();
    }
    let mut firsts: Vec<u32> = vec![0; ids.len()];
    for equals in keyed.chunk_by(|a, b| a.0 == b.0) {
        for &(_, id) in equals {
            firsts[id as usize] = equals[0].1;
        }
    }
    firsts
}

/// The bits of the corners, turned so that the least comes first.
fn corner_bits(scene: &Scene, id: TriangleId) -> [[u32; 3]; 3] {
    let [a, b, c] = scene
        .corners(id)
        .map(|corner| corner.to_array().map(f32::to_bits));
    [[a, b, c], [b, c, a], [c, a, b]]
        .into_iter()
        .min()
        .unwrap_or_default()
}
