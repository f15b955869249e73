//! The ray tree: what passes along a segment, and what does a ray meet first.
//!
//! An obvhs CWBVH over the scene's triangles. It serves rays only: clusters of light come from a tree of their own.

use std::time::Duration;

use glam::Vec3;
use obvhs::{
    BvhBuildParams,
    aabb::Aabb,
    cwbvh::{CwBvh, builder::build_cwbvh_from_tris},
    ray::{Ray, RayHit},
    rt_triangle::RtTriangle,
    triangle::Triangle as RayTriangle,
};

use super::panes::{self, Panes};
use crate::scene::{Frame, Scene, TriangleId};

/// Rays start and end this far from their ends, in frame units: a millionth of the scene's extent.
/// Much smaller, and a ray meets the surface that it leaves; much larger, and thin gaps leak or close.
/// At the rim of the frame (50 units) single precision resolves 4e-6.
pub const RAY_OFFSET: f32 = 1e-4;

/// Triangles with longer edges are stored in pieces, unless they are far from the origin: an intersection is known to about
/// a millionth of the triangle's size. Smaller costs memory, larger lets a huge ground be met beside where it is.
const LONGEST_EDGE: f32 = 4.0 * Frame::EXTENT as f32;

/// Longest edge of a piece in multiples of its distance from the origin, about which all detail lies.
const LONGEST_BY_DISTANCE: f32 = 1.0;

/// How the tree is built. The search for the best partner of a box must begin with the leaves: where the first levels take
/// neighbours along a curve through space instead, as the usual settings have it, large walls share nodes with fine
/// bodies, and rays through rooms take three to six times as long. Much more reinsertion, wider searches and splitting
/// triangles beforehand take several times as long to build, and rays gain a tenth at most.
const BUILD: BvhBuildParams = BvhBuildParams {
    search_depth_threshold: 0,
    ..BvhBuildParams::medium_build()
};

/// The first hit of a ray.
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
    /// Which triangle of the scene each of them is, or is a piece of.
    ids: Vec<u32>,
    crossings: f32,
    /// Nothing where all triangles are opaque.
    panes: Option<Box<Panes>>,
}

impl RayTree {
    /// A tree without triangles: nothing blocks anything, and nothing is met.
    pub fn clear() -> Self {
        Self {
            tree: CwBvh::default(),
            triangles: Vec::new(),
            ids: Vec::new(),
            crossings: 0.0,
            panes: None,
        }
    }

    /// Whether there are no triangles: then no ray need be shot.
    pub fn is_clear(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Build the tree over all triangles of a scene.
    pub fn new(scene: &Scene) -> Self {
        let mut triangles: Vec<RayTriangle> = Vec::with_capacity(scene.triangles.len());
        let mut ids = Vec::with_capacity(scene.triangles.len());
        for id in scene.triangle_ids() {
            for piece in pieces(scene.corners(id)) {
                let [a, b, c] = piece.map(Into::into);
                triangles.push(RayTriangle {
                    v0: a,
                    v1: b,
                    v2: c,
                });
                ids.push(id.0);
            }
        }
        let tree = build_cwbvh_from_tris(&triangles, BUILD, &mut Duration::default());
        let order = || tree.primitive_indices.iter().map(|&index| index as usize);
        Self {
            triangles: order()
                .map(|index| RtTriangle::from(&triangles[index]))
                .collect(),
            ids: order().map(|index| ids[index]).collect(),
            crossings: crossings(&triangles),
            panes: Panes::of(scene),
            tree,
        }
    }

    /// How many boxes about triangles a line through the scene crosses on average: what a ray costs. Tens where triangles
    /// lie beside each other; as many as there are where all lie across each other.
    pub fn crossings(&self) -> f32 {
        self.crossings
    }

    /// Whether light passes through a triangle.
    pub fn is_see_through(&self, triangle: TriangleId) -> bool {
        self.panes
            .as_ref()
            .is_some_and(|panes| panes.has(triangle.0))
    }

    /// Whether light passes through some triangle.
    pub fn has_panes(&self) -> bool {
        self.panes.is_some()
    }

    /// Whether some triangle colours what passes through it.
    pub fn has_coloured_panes(&self) -> bool {
        self.panes.as_ref().is_some_and(|panes| panes.is_coloured())
    }

    /// What passes along a segment, by channel, 0…1: the product over all triangles on it but the two of its ends.
    /// Naming the ends lets a segment start on its own surface however small that is.
    pub fn transmittance(&self, from: Vec3, to: Vec3, ends: [Option<TriangleId>; 2]) -> Vec3 {
        let separation = to - from;
        let length = separation.length();
        if self.is_clear() || length <= 2.0 * RAY_OFFSET {
            return Vec3::ONE;
        }
        let until = length - RAY_OFFSET;
        let ray = ray_until(from, separation / length, until);
        self.passing(ray, ends)
    }

    /// What passes along a ray of unit direction out of the scene, by channel, 0…1: the product over all triangles that it
    /// meets but the one that it starts on.
    pub fn transmittance_outward(
        &self,
        origin: Vec3,
        direction: Vec3,
        from: Option<TriangleId>,
    ) -> Vec3 {
        if self.is_clear() {
            return Vec3::ONE;
        }
        let ray = ray_until(origin, direction, f32::MAX);
        self.passing(ray, [from, None])
    }

    /// What passes through all triangles on a ray but two.
    fn passing(&self, ray: Ray, ends: [Option<TriangleId>; 2]) -> Vec3 {
        let [first, second] = ends.map(|end| end.map_or(u32::MAX, |id| id.0));
        let mut passing = Vec3::ONE;
        let is_open = self.tree.ray_traverse_miss(ray, |ray, primitive| {
            let distance = self.triangles[primitive].intersect(ray);
            // Most triangles are missed, and which one it was is then of no interest.
            if distance == f32::INFINITY {
                return distance;
            }
            let id = self.ids[primitive];
            if id == first || id == second {
                return f32::INFINITY;
            }
            let Some(panes) = &self.panes else {
                return distance;
            };
            passing *= panes.passing(id, point_at(ray, distance));
            if passing == Vec3::ZERO {
                distance
            } else {
                f32::INFINITY
            }
        });
        if is_open { passing } else { Vec3::ZERO }
    }

    /// Whether nothing passes along a segment; see [`Self::transmittance`].
    pub fn occluded(&self, from: Vec3, to: Vec3, ends: [Option<TriangleId>; 2]) -> bool {
        self.transmittance(from, to, ends) == Vec3::ZERO
    }

    /// The nearest triangle along a ray of unit direction, except the one that it starts on. Of two in one place, back
    /// to back, it is the one whose front is met. What is cut out is not met, and panes only by chance, as often as they
    /// do not let light pass in the mean of its channels; see [`Self::tint`].
    pub fn closest(&self, origin: Vec3, direction: Vec3, from: Option<TriangleId>) -> Option<Hit> {
        self.closest_of(origin, direction, from, |panes, id, point| {
            panes.meets(id, point, [origin, direction])
        })
    }

    /// As [`Self::closest`], but panes are always met: what is looked at.
    pub fn closest_shown(
        &self,
        origin: Vec3,
        direction: Vec3,
        from: Option<TriangleId>,
    ) -> Option<Hit> {
        self.closest_of(origin, direction, from, Panes::is_there)
    }

    /// The nearest triangle of those that are opaque and those for which `meets` is true.
    fn closest_of(
        &self,
        origin: Vec3,
        direction: Vec3,
        from: Option<TriangleId>,
        meets: impl Fn(&Panes, u32, Vec3) -> bool,
    ) -> Option<Hit> {
        if self.is_clear() {
            return None;
        }
        let ray = ray_until(origin, direction, f32::MAX);
        let start = from.map_or(u32::MAX, |id| id.0);
        let mut hit = RayHit::none();
        let met = self.tree.ray_traverse(ray, &mut hit, |ray, primitive| {
            let triangle = &self.triangles[primitive];
            let distance = triangle.intersect(ray);
            let id = self.ids[primitive];
            if distance == f32::INFINITY || id == start {
                return f32::INFINITY;
            }
            if let Some(panes) = &self.panes
                && !meets(panes, id, point_at(ray, distance))
            {
                return f32::INFINITY;
            }
            let is_back = triangle.compute_normal().dot(ray.direction) > 0.0;
            if is_back {
                distance + RAY_OFFSET
            } else {
                distance
            }
        });
        met.then(|| Hit {
            triangle: TriangleId(self.ids[hit.primitive_id as usize]),
            distance: self.triangles[hit.primitive_id as usize].intersect(&ray),
        })
    }

    /// By what the light that comes along a ray to [`Self::closest`] is to be multiplied, by channel, for the colours of the
    /// panes that it passes before the `hit`, or on its way out of the scene: on average over panes of one material, what
    /// passes over the chance of passing. 1 where no pane is coloured.
    pub fn tint(
        &self,
        origin: Vec3,
        direction: Vec3,
        from: Option<TriangleId>,
        hit: Option<Hit>,
    ) -> Vec3 {
        let Some(panes) = self.panes.as_ref().filter(|panes| panes.is_coloured()) else {
            return Vec3::ONE;
        };
        let end = hit.map_or(f32::MAX, |hit| hit.distance);
        let ray = ray_until(origin, direction, end);
        let met = hit.map_or(u32::MAX, |hit| hit.triangle.0);
        let start = from.map_or(u32::MAX, |id| id.0);
        let mut tint = Vec3::ONE;
        // Nothing counts as met, so that the ray goes through everything.
        self.tree
            .ray_traverse(ray, &mut RayHit::none(), |ray, primitive| {
                let id = self.ids[primitive];
                let distance = self.triangles[primitive].intersect(ray);
                if distance < f32::INFINITY && id != start && id != met {
                    let passing = panes.passing(id, point_at(ray, distance));
                    let chance = panes::mean(passing);
                    if chance > 0.0 {
                        tint *= passing / chance;
                    }
                }
                f32::INFINITY
            });
        tint
    }

    /// How many solids a ray of unit direction leaves on its way, less how many it enters: of those that hold its origin
    /// each counts once. `bounds` tells which triangles bound solids.
    pub fn solids_left(
        &self,
        origin: Vec3,
        direction: Vec3,
        from: Option<TriangleId>,
        bounds: impl Fn(TriangleId) -> bool,
    ) -> i32 {
        let ray = ray_until(origin, direction, f32::MAX);
        let mut left = 0;
        // Nothing counts as met, so that the ray goes through everything.
        self.tree
            .ray_traverse(ray, &mut RayHit::none(), |ray, primitive| {
                let id = TriangleId(self.ids[primitive]);
                let triangle = &self.triangles[primitive];
                if bounds(id) && from != Some(id) && triangle.intersect(ray) < f32::INFINITY {
                    let is_back = triangle.compute_normal().dot(ray.direction) > 0.0;
                    left += if is_back { 1 } else { -1 };
                }
                f32::INFINITY
            });
        left
    }

    /// Bytes that the tree holds.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.tree.nodes.as_slice())
            + size_of_val(self.triangles.as_slice())
            + size_of_val(self.tree.primitive_indices.as_slice())
            + size_of_val(self.ids.as_slice())
            + self.panes.as_ref().map_or(0, |panes| panes.memory_bytes())
    }
}

/// A ray of unit direction that ends at a distance.
fn ray_until(origin: Vec3, direction: Vec3, until: f32) -> Ray {
    // Adding 0 turns -0 into 0: the tree takes it for a direction below 0, and misses what lies across it.
    Ray::new(origin.into(), (direction + 0.0).into(), RAY_OFFSET, until)
}

fn point_at(ray: &Ray, distance: f32) -> Vec3 {
    (ray.origin + ray.direction * distance).into()
}

/// A triangle, or, where it is huge, its pieces: halves across the longest edge, again and again.
fn pieces(corners: [Vec3; 3]) -> Vec<[Vec3; 3]> {
    let (mut pieces, mut pending) = (Vec::new(), vec![corners]);
    while let Some([a, b, c]) = pending.pop() {
        let edges = [(a - b).length(), (b - c).length(), (c - a).length()];
        let longest = edges.into_iter().fold(0.0, f32::max);
        let distance = ((a + b + c) / 3.0).length() - longest;
        if longest <= LONGEST_EDGE.max(LONGEST_BY_DISTANCE * distance) {
            pieces.push([a, b, c]);
            continue;
        }
        // Turned so that the longest edge comes first.
        let [a, b, c] = match edges.iter().position(|&edge| edge >= longest) {
            Some(1) => [b, c, a],
            Some(2) => [c, a, b],
            _ => [a, b, c],
        };
        let middle = (a + b) * 0.5;
        pending.extend([[a, middle, c], [middle, b, c]]);
    }
    pieces
}

/// See [`RayTree::crossings`]: areas of boxes relative to that of the box about all.
fn crossings(triangles: &[RayTriangle]) -> f32 {
    let (mut whole, mut sum) = (Aabb::empty(), 0.0);
    for triangle in triangles {
        let bounds = triangle.aabb();
        whole.extend(bounds.min);
        whole.extend(bounds.max);
        sum += f64::from(bounds.half_area());
    }
    let whole = f64::from(whole.half_area());
    if whole > 0.0 {
        (sum / whole) as f32
    } else {
        0.0
    }
}
