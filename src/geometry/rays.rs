//! The ray tree: what passes along a segment, and what does a ray meet first.
//!
//! It serves rays only: clusters of light come from a tree of their own.

use std::sync::Arc;

use glam::Vec3;

use super::{
    mirrors::{Image, Mirrors},
    panes::{self, Panes},
    wide::{Ray, Reach, Tree},
};
use crate::scene::{Scene, TriangleId};

/// Rays start and end this far from their ends, in frame units: a millionth of the scene's extent.
/// Much smaller, and a ray meets the surface that it leaves; much larger, and thin gaps leak or close.
/// At the rim of the frame (50 units) single precision resolves 4e-6.
pub const RAY_OFFSET: f32 = 1e-4;

/// The first hit of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The triangle.
    pub triangle: TriangleId,
    /// Distance along the unit direction, in frame units.
    pub distance: f32,
}

/// What passes along a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passage {
    /// By channel, 0…1.
    pub transmittance: Vec3,
    /// Distance of the last triangle that was found on it: where nothing passes, of one that blocks.
    pub end: f32,
}

impl Passage {
    const FREE: Self = Self {
        transmittance: Vec3::ONE,
        end: f32::INFINITY,
    };
}

/// Answers occlusion and closest-hit questions about a scene.
pub struct RayTree {
    /// Triangles have the numbers that they have in the scene.
    tree: Tree,
    crossings: f32,
    /// Nothing where all triangles are opaque.
    panes: Option<Box<Panes>>,
    /// Nothing where there is no plane mirror.
    mirrors: Option<Box<Mirrors>>,
}

impl RayTree {
    /// A tree without triangles: nothing blocks anything, and nothing is met.
    pub fn clear() -> Self {
        Self {
            tree: Tree::new(&[]),
            crossings: 0.0,
            panes: None,
            mirrors: None,
        }
    }

    /// Whether there are no triangles: then no ray need be shot.
    pub fn is_clear(&self) -> bool {
        self.tree.is_empty()
    }

    /// Build the tree over all triangles of a scene.
    pub fn new(scene: &Scene) -> Self {
        let corners = scene.triangle_ids().map(|id| scene.corners(id));
        let triangles: Vec<[Vec3; 3]> = corners.collect();
        Self {
            tree: Tree::new(&triangles),
            crossings: crossings(&triangles),
            panes: Panes::of(scene),
            mirrors: Mirrors::of(scene),
        }
    }

    /// How many boxes about triangles a line through the scene crosses on average: what a ray costs. Tens where triangles
    /// lie beside each other; as many as there are where all lie across each other.
    pub fn crossings(&self) -> f32 {
        self.crossings
    }

    /// The plane mirrors, if there are any.
    pub fn mirrors(&self) -> Option<&Mirrors> {
        self.mirrors.as_deref()
    }

    /// The images in plane mirrors, the strongest first.
    pub fn images(&self) -> &[Arc<Image>] {
        self.mirrors().map_or(&[], Mirrors::images)
    }

    /// Whether a triangle is of a plane mirror that rays follow.
    pub fn follows(&self, triangle: TriangleId) -> bool {
        self.mirrors().is_some_and(|mirrors| mirrors.has(triangle))
    }

    /// Whether rays to surfaces may lose some of their light, by colour, on the way.
    pub fn has_tints(&self) -> bool {
        self.has_coloured_panes() || self.mirrors.is_some()
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
        self.passage(from, to, ends).transmittance
    }

    /// As [`Self::transmittance`], with what blocks.
    pub fn passage(&self, from: Vec3, to: Vec3, ends: [Option<TriangleId>; 2]) -> Passage {
        let separation = to - from;
        let length = separation.length();
        if self.is_clear() || length <= 2.0 * RAY_OFFSET {
            return Passage::FREE;
        }
        let ray = Ray::new(from, separation / length);
        self.passing(&ray, length - RAY_OFFSET, ends)
    }

    /// What passes along a ray of unit direction out of the scene, by channel, 0…1: the product over all triangles that it
    /// meets but the one that it starts on.
    pub fn transmittance_outward(
        &self,
        origin: Vec3,
        direction: Vec3,
        from: Option<TriangleId>,
    ) -> Vec3 {
        self.passage_outward(origin, direction, from).transmittance
    }

    /// As [`Self::transmittance_outward`], with what blocks.
    pub fn passage_outward(
        &self,
        origin: Vec3,
        direction: Vec3,
        from: Option<TriangleId>,
    ) -> Passage {
        if self.is_clear() {
            return Passage::FREE;
        }
        self.passing(&Ray::new(origin, direction), f32::MAX, [from, None])
    }

    /// What passes through all triangles on a ray but two, up to a distance.
    fn passing(&self, ray: &Ray, until: f32, ends: [Option<TriangleId>; 2]) -> Passage {
        let mut passage = Passage::FREE;
        self.tree.each(ray, reach(until, ends), |met| {
            passage.transmittance *= match &self.panes {
                None => Vec3::ZERO,
                Some(panes) => panes.passing(met.triangle, point_at(ray, met.distance)),
            };
            passage.end = met.distance;
            passage.transmittance != Vec3::ZERO
        });
        passage
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
        let ray = Ray::new(origin, direction);
        // Distances of backs count as a little larger, so that of two triangles back to back the front is nearer. Of two
        // that are as near it is the one that comes first in the scene.
        let mut nearest = f32::MAX;
        let mut hit: Option<Hit> = None;
        self.tree
            .nearest_first(&ray, reach(f32::MAX, [from, None]), |met| {
                let counted = met.distance + if met.is_back { RAY_OFFSET } else { 0.0 };
                let triangle = TriangleId(met.triangle);
                let is_nearer = counted < nearest
                    || counted == nearest && hit.is_none_or(|hit| triangle.0 < hit.triangle.0);
                let is_there =
                    |panes: &Panes| meets(panes, met.triangle, point_at(&ray, met.distance));
                if is_nearer && self.panes.as_deref().is_none_or(is_there) {
                    nearest = counted;
                    hit = Some(Hit {
                        triangle,
                        distance: met.distance,
                    });
                }
                nearest
            });
        hit
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
        let ray = Ray::new(origin, direction);
        let mut tint = Vec3::ONE;
        let between = reach(end, [from, hit.map(|hit| hit.triangle)]);
        self.tree.each(&ray, between, |met| {
            let passing = panes.passing(met.triangle, point_at(&ray, met.distance));
            let chance = panes::mean(passing);
            if chance > 0.0 {
                tint *= passing / chance;
            }
            true
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
        let ray = Ray::new(origin, direction);
        let mut left = 0;
        self.tree.each(&ray, reach(f32::MAX, [from, None]), |met| {
            if bounds(TriangleId(met.triangle)) {
                left += if met.is_back { 1 } else { -1 };
            }
            true
        });
        left
    }

    /// Bytes that the tree holds.
    pub fn memory_bytes(&self) -> usize {
        let panes = self.panes.as_ref().map_or(0, |panes| panes.memory_bytes());
        let mirrors = self.mirrors().map_or(0, Mirrors::memory_bytes);
        self.tree.memory_bytes() + panes + mirrors
    }
}

/// A ray's part from its offset up to a distance, without the triangles of its ends.
fn reach(until: f32, ends: [Option<TriangleId>; 2]) -> Reach {
    Reach {
        from: RAY_OFFSET,
        until,
        except: ends.map(|end| end.map_or(u32::MAX, |id| id.0)),
    }
}

fn point_at(ray: &Ray, distance: f32) -> Vec3 {
    ray.origin + ray.direction * distance
}

/// See [`RayTree::crossings`]: areas of boxes relative to that of the box about all.
fn crossings(triangles: &[[Vec3; 3]]) -> f32 {
    let half_area = |low: Vec3, high: Vec3| {
        let size = (high - low).as_dvec3();
        size.x * size.y + size.y * size.z + size.z * size.x
    };
    let (mut lowest, mut highest, mut sum) = (Vec3::INFINITY, Vec3::NEG_INFINITY, 0.0);
    for &[a, b, c] in triangles {
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        lowest = lowest.min(low);
        highest = highest.max(high);
        sum += half_area(low, high);
    }
    let whole = half_area(lowest, highest);
    if whole > 0.0 {
        (sum / whole) as f32
    } else {
        0.0
    }
}
