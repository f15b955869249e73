//! Bounds of the unoccluded irradiance that a face gets at a point from nodes.
//!
//! Seen from a point, a patch is exact in closed form. A cluster lies in a cone about the direction to its centre and
//! between two distances, and its table bounds what it sends there; where that is loose, its children take its place,
//! the widest of all sources first. Holzschuch and Sillion (1998) bound single patches by derivatives; here the bounds
//! hold for clusters, too.

use std::{cmp::Ordering, collections::BinaryHeap, f32::consts::PI};

use glam::Vec3;

use super::{Kernel, luminance, oracle::IN_PLANE};
use crate::{
    geometry::point_irradiance,
    hierarchy::{Kind, NodeId},
};

/// Most nodes that are replaced by their children for one face. Fewer, and bounds beside finely divided objects are
/// loose; more cost time there.
const MOST_REPLACED: u32 = 2048;

/// Lower and upper bound of an irradiance (luminance), W/m².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Interval {
    /// Lower bound.
    pub low: f32,
    /// Upper bound.
    pub high: f32,
}

impl Interval {
    /// Largest distance of a value to a value between the bounds.
    pub fn farthest(self, value: f32) -> f32 {
        (self.high - value).max(value - self.low).max(0.0)
    }

    fn width(self) -> f32 {
        self.high - self.low
    }
}

/// A node that may be replaced by its children.
struct Open {
    /// Width of its interval, times the weight of its source.
    width: f32,
    /// The source that it is a part of.
    source: usize,
    node: NodeId,
    interval: Interval,
}

impl Ord for Open {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_width = self.width.total_cmp(&other.width);
        by_width.then(other.node.cmp(&self.node))
    }
}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Open {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Open {}

impl Kernel<'_> {
    /// Bounds of the unoccluded irradiance of a face with this unit normal at a point from each of some sources, for the
    /// radiosities of the tables.
    /// The sum of their widths, each times the weight of its source, is below the tolerance (W/m²), unless too many
    /// nodes are needed.
    pub fn bounds(
        &self,
        point: Vec3,
        normal: Vec3,
        sources: &[(NodeId, f32)],
        tolerance: f32,
    ) -> Vec<Interval> {
        let mut closed = vec![Interval::default(); sources.len()];
        let mut open = BinaryHeap::new();
        let mut total = 0.0f64;
        let mut add = |source: usize, node: NodeId, open: &mut BinaryHeap<Open>| {
            let interval = self.bounds_of(point, normal, node);
            let width = interval.width() * sources[source].1;
            if width > 0.0 && !self.hierarchy.children(node).is_empty() {
                open.push(Open {
                    width,
                    source,
                    node,
                    interval,
                });
                return f64::from(width);
            }
            closed[source].low += interval.low;
            closed[source].high += interval.high;
            0.0
        };
        for (source, &(node, _)) in sources.iter().enumerate() {
            total += add(source, node, &mut open);
        }
        for _ in 0..MOST_REPLACED {
            if total <= f64::from(tolerance) {
                break;
            }
            let Some(widest) = open.pop() else {
                break;
            };
            total -= f64::from(widest.width);
            for child in self.hierarchy.children(widest.node) {
                total += add(widest.source, NodeId(child), &mut open);
            }
        }
        for left in open {
            closed[left.source].low += left.interval.low;
            closed[left.source].high += left.interval.high;
        }
        closed
    }

    /// Bounds from one node as a whole.
    fn bounds_of(&self, point: Vec3, normal: Vec3, node: NodeId) -> Interval {
        match self.hierarchy.kind(node) {
            Kind::Element(index) => {
                let irradiance = self.exact(point, normal, index);
                Interval {
                    low: irradiance,
                    high: irradiance,
                }
            }
            Kind::Cluster(index) => self.bounds_of_cluster(point, normal, index),
        }
    }

    /// Irradiance from an element in closed form; 0 where face or element lies in the plane of the other.
    fn exact(&self, point: Vec3, normal: Vec3, index: usize) -> f32 {
        let element = &self.hierarchy.mesh.elements[index];
        let separation = element.centroid - point;
        let least = IN_PLANE * (element.radius + separation.length());
        let corners = self.hierarchy.mesh.corners(index);
        let above = |corner: &Vec3| (*corner - point).dot(normal) > least;
        let facing = self.hierarchy.patch_of(index).normal;
        if -separation.dot(facing) <= least || !corners.iter().any(above) {
            return 0.0;
        }
        let radiosity = luminance(self.tables.elements[index]);
        radiosity * point_irradiance(point, normal, corners)
    }

    /// With D and R the distance and radius of the sphere about a cluster, all light comes along directions within
    /// α = asin(R/D) of that from its centre, from distances between those to the box. A projected power changes by at
    /// most its total times the length of the difference of two directions.
    fn bounds_of_cluster(&self, point: Vec3, normal: Vec3, index: usize) -> Interval {
        let cluster = &self.hierarchy.clusters[index];
        let towards = |corner: Vec3| corner - point;
        let (least, most) = (towards(cluster.min), towards(cluster.max));
        // Heights of the corners of the box above the face, and distances to it.
        let middle = (least + most) * 0.5;
        let half = (most - least) * 0.5;
        let (height, reach) = (middle.dot(normal), half.dot(normal.abs()));
        let radius = cluster.radius;
        if height + reach <= IN_PLANE * (radius + middle.length()) {
            return Interval::default();
        }
        let nearest = Vec3::ZERO.clamp(least, most).length();
        let farthest = least.abs().max(most.abs()).length();
        let centre = towards(cluster.centroid);
        let distance = centre.length();
        let brightest = luminance(self.tables.brightest[index]);
        if distance <= radius || nearest <= 0.0 {
            // No patch gives more than its radiosity.
            return Interval {
                low: 0.0,
                high: brightest * (cluster.end - cluster.start) as f32,
            };
        }
        let (near, far) = (
            nearest.max(distance - radius),
            farthest.min(distance + radius),
        );
        let sine = radius / distance;
        let cosine = (1.0 - sine * sine).max(0.0).sqrt();
        // Length of the difference of two unit vectors at that angle.
        let turn = (2.0 - 2.0 * cosine).max(0.0).sqrt();
        let unit = centre / distance;
        // Cosine at the face: by the cone, and by the heights of the box.
        let at_centre = unit.dot(normal).clamp(-1.0, 1.0);
        let beside = (1.0 - at_centre * at_centre).max(0.0).sqrt();
        let largest = if at_centre >= cosine {
            1.0
        } else {
            at_centre * cosine + beside * sine
        };
        let smallest = if at_centre <= -cosine {
            -1.0
        } else {
            at_centre * cosine - beside * sine
        };
        let largest = largest.min((height + reach) / near).clamp(0.0, 1.0);
        let smallest = smallest.max((height - reach) / far).clamp(0.0, 1.0);
        let moments = &self.tables.clusters[index];
        let total = luminance(moments.total());
        let (weakest, strongest) = moments.bounds(-unit);
        let weakest = (luminance(weakest) - turn * total).max(0.0);
        let strongest = (luminance(strongest) + turn * total).min(total);
        Interval {
            low: weakest * smallest / (PI * far * far),
            high: strongest * largest / (PI * near * near),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        geometry::{Random, triangle_point},
        hierarchy::{Hierarchy, Reading, Tables},
        scene::{SceneOptions, Sides, builtin},
    };

    /// A room with furniture, and radiosities by chance.
    fn room() -> (Hierarchy, Tables) {
        let options = SceneOptions::with_sides(Sides::One);
        let scene = builtin::builtin("room-1022", &options)
            .expect("the scene is valid")
            .expect("the scene is known");
        let hierarchy = Hierarchy::new(&scene, 30.0);
        let mut random = Random::new(3, 0);
        let radiosities: Vec<f32> = hierarchy.patches.iter().map(|_| random.uniform()).collect();
        let leaf = |leaf: usize| Vec3::splat(radiosities[leaf].powi(4)).extend(1.0);
        let tables = Tables::new(&hierarchy, leaf);
        (hierarchy, tables)
    }

    /// A point of a surface by chance, and its normal.
    fn place(hierarchy: &Hierarchy, random: &mut Random) -> (Vec3, Vec3) {
        let patch = random.below(hierarchy.patches.len() as u32) as usize;
        let place = triangle_point(random.uniform_2d());
        let [a, b, c] = hierarchy.mesh.corners(patch);
        let point = a * place.x + b * place.y + c * place.z;
        (point, hierarchy.patches[patch].normal)
    }

    fn kernel<'a>((hierarchy, tables): &'a (Hierarchy, Tables)) -> Kernel<'a> {
        Kernel {
            hierarchy,
            tables,
            reading: Some(Reading::Bounded),
            image: None,
        }
    }

    fn sum(kernel: Kernel<'_>, (point, normal): (Vec3, Vec3), node: NodeId) -> f64 {
        let range = match kernel.hierarchy.kind(node) {
            Kind::Cluster(index) => kernel.hierarchy.clusters[index].patches(),
            Kind::Element(index) => index..index + 1,
        };
        range
            .map(|patch| f64::from(kernel.exact(point, normal, patch)))
            .sum()
    }

    #[test]
    fn bounds_hold_the_sum_over_the_patches_at_any_tolerance() {
        let room = room();
        let kernel = kernel(&room);
        let hierarchy = kernel.hierarchy;
        let mut random = Random::new(5, 0);
        let mut told = 0;
        for _ in 0..6000 {
            let (point, normal) = place(hierarchy, &mut random);
            let node = NodeId(random.below(hierarchy.node_count() as u32));
            let truth = sum(kernel, (point, normal), node);
            let slack = 1e-4 * truth + 1e-6;
            for tolerance in [f32::INFINITY, 0.1 * truth as f32, 0.0] {
                let found = kernel.bounds(point, normal, &[(node, 1.0)], tolerance)[0];
                let (low, high) = (f64::from(found.low), f64::from(found.high));
                assert!(
                    low <= truth + slack && truth <= high + slack,
                    "{node:?}: {truth} outside {found:?}"
                );
                if tolerance == 0.0 {
                    assert!(high - low <= slack, "{node:?}: {found:?} is not exact");
                }
            }
            told += usize::from(truth > 0.0);
        }
        assert!(told > 500, "only {told} pairs exchange light");
    }

    #[test]
    fn the_widest_source_is_narrowed_first() {
        let room = room();
        let kernel = kernel(&room);
        let hierarchy = kernel.hierarchy;
        let mut random = Random::new(7, 0);
        let children: Vec<(NodeId, f32)> = hierarchy
            .children(Hierarchy::ROOT)
            .map(|child| (NodeId(child), 1.0))
            .collect();
        for _ in 0..50 {
            let (point, normal) = place(hierarchy, &mut random);
            let truth = sum(kernel, (point, normal), Hierarchy::ROOT) as f32;
            let tolerance = 0.05 * truth;
            let found = kernel.bounds(point, normal, &children, tolerance);
            let widths: f32 = found.iter().map(|interval| interval.width()).sum();
            assert!(widths <= tolerance * 1.001, "{widths} above {tolerance}");
        }
    }
}
