//! Which fraction of a transfer gets through.
//!
//! A fraction of area-uniform rays is biased, since most of them stand for little light. Here each ray stands for the
//! light that it carries: of a few candidate point pairs one is kept with probability proportional to its unoccluded
//! transfer, and the outcome of its ray counts with their mean weight (resampled importance sampling, Talbot 2005).

use glam::Vec3;

use super::luminance;
use crate::{
    geometry::{Random, RayTree, barycentric_in_plane, cosine_direction, triangle_point},
    hierarchy::{Hierarchy, Kind, NodeId, Tables},
    scene::TriangleId,
};

/// Candidate pairs of points for each ray. One candidate is the area-uniform way with its noise; more than some four
/// cost as much as the ray that they improve.
const CANDIDATES: u32 = 3;

/// Radiosity of what is dark, beside which all light counts. Without it, dark pairs would be weighed alike, those that
/// face each other and those that do not; sums of form factors count all sources.
const DARK_RADIOSITY: f32 = 1e-20;

/// A point on a patch of a node.
#[derive(Clone, Copy, Debug)]
struct Sample {
    point: Vec3,
    normal: Vec3,
    triangle: TriangleId,
    radiosity: f32,
}

/// Samples pairs of points on pairs of nodes.
#[derive(Clone, Copy)]
pub struct PairSampler<'a> {
    /// Where the nodes are.
    pub hierarchy: &'a Hierarchy,
    /// What they send.
    pub tables: &'a Tables,
    /// Running sums of the patch areas, in tree order, one more than there are patches.
    pub area_sums: &'a [f64],
    /// What blocks.
    pub rays: &'a RayTree,
}

impl PairSampler<'_> {
    /// Running sums of patch areas.
    pub fn area_sums(hierarchy: &Hierarchy) -> Vec<f64> {
        let mut sum = 0.0;
        let mut sums = Vec::with_capacity(hierarchy.patches.len() + 1);
        sums.push(0.0);
        for patch in &hierarchy.patches {
            sum += f64::from(patch.area);
            sums.push(sum);
        }
        sums
    }

    /// A random point of a node and its normal, uniform over its area.
    pub fn point_on(&self, node: NodeId, random: &mut Random) -> (Vec3, Vec3) {
        let sample = self.sample(node, random);
        (sample.point, sample.normal)
    }

    fn sample(&self, node: NodeId, random: &mut Random) -> Sample {
        let element = match self.hierarchy.kind(node) {
            Kind::Element(index) => index,
            Kind::Cluster(index) => {
                let range = self.hierarchy.clusters[index].patches();
                let sums = &self.area_sums[range.start..=range.end];
                let target =
                    sums[0] + f64::from(random.uniform()) * (sums[sums.len() - 1] - sums[0]);
                let above = sums.partition_point(|&sum| sum <= target);
                range.start + above.clamp(1, range.len()) - 1
            }
        };
        let [a, b, c] = self.hierarchy.mesh.corners(element);
        let at = triangle_point(random.uniform_2d());
        let patch = self.hierarchy.patch_of(element);
        Sample {
            point: a * at.x + b * at.y + c * at.z,
            normal: patch.normal,
            triangle: patch.triangle,
            radiosity: luminance(self.tables.elements[element]).max(DARK_RADIOSITY),
        }
    }

    /// Unoccluded fraction of the transfer from a source to a receiver by `ray_count` rays, 0…1.
    /// Where no sampled pair transfers anything, all of them count alike.
    pub fn visibility(
        &self,
        source: NodeId,
        receiver: NodeId,
        ray_count: u32,
        random: &mut Random,
    ) -> f32 {
        let (mut transferred, mut sent) = (0.0, 0.0);
        let (mut clear, mut shot) = (0.0, 0.0);
        for _ in 0..ray_count {
            let (mut kept, mut sum) = (None, 0.0);
            for _ in 0..CANDIDATES {
                let (from, to) = (self.sample(source, random), self.sample(receiver, random));
                let weight = transfer(&from, &to);
                sum += weight;
                if kept.is_none() || random.uniform() * sum < weight {
                    kept = Some((from, to));
                }
            }
            let Some((from, to)) = kept else { continue };
            let visible = !self.rays.occluded(
                to.point,
                from.point,
                [Some(to.triangle), Some(from.triangle)],
            );
            let gets_through = if visible { 1.0 } else { 0.0 };
            transferred += sum * gets_through;
            sent += sum;
            clear += gets_through;
            shot += 1.0;
        }
        if sent > 0.0 {
            transferred / sent
        } else if shot > 0.0 {
            clear / shot
        } else {
            1.0
        }
    }

    /// Mean form factor from a receiver to a source, occlusion included, by cosine-weighted rays from random points of
    /// the receiver; 0…1. For a cluster and itself it is the part of its light that falls on itself: 0 where it is flat
    /// or convex, whatever its box.
    pub fn seen_fraction(
        &self,
        source: NodeId,
        receiver: NodeId,
        ray_count: u32,
        random: &mut Random,
    ) -> f32 {
        let mut met = 0;
        for _ in 0..ray_count {
            let from = self.sample(receiver, random);
            let direction = cosine_direction(from.normal, random.uniform_2d());
            let hit = self
                .rays
                .closest(from.point, direction, Some(from.triangle));
            met += u32::from(hit.is_some_and(|hit| {
                let point = from.point + direction * hit.distance;
                self.hierarchy
                    .patch_met(hit.triangle, direction)
                    .is_some_and(|patch| self.holds(source, patch, point))
            }));
        }
        met as f32 / ray_count.max(1) as f32
    }

    /// Whether a point of a patch belongs to a node.
    fn holds(&self, node: NodeId, patch: usize, point: Vec3) -> bool {
        match self.hierarchy.kind(node) {
            Kind::Cluster(index) => self.hierarchy.clusters[index].patches().contains(&patch),
            Kind::Element(index) => {
                let element = &self.hierarchy.mesh.elements[index];
                element.patch as usize == patch
                    && (element.parent == u32::MAX
                        || barycentric_in_plane(point, self.hierarchy.mesh.corners(index))
                            .min_element()
                            >= 0.0)
            }
        }
    }
}

/// Unoccluded transfer between two points, up to a factor that is the same for all pairs of two nodes.
fn transfer(from: &Sample, to: &Sample) -> f32 {
    let separation = to.point - from.point;
    let squared = separation.length_squared();
    if squared <= f32::MIN_POSITIVE {
        return 0.0;
    }
    let cosines = from.normal.dot(separation).max(0.0) * (-to.normal.dot(separation)).max(0.0);
    let value = from.radiosity * cosines / (squared * squared);
    if value.is_finite() { value } else { 0.0 }
}
