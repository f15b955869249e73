//! Cluster boxes as lines: which boxes of the tree, in which colours; the face powers of one as arrows.

use std::sync::Arc;

use glam::Vec3;

use super::{
    render::{BoxInstance, SegmentInstance},
    theme,
    view::{ClusterColor, ClusterOverlay},
};
use crate::solver::ClusterBox;

/// Boxes drawn at most. More are a grey fog and slow on a software adapter.
const MAX_BOXES: usize = 200_000;

/// Counts of a tree at a level, kept because large trees take milliseconds to count.
#[derive(Default)]
pub struct ClusterCounts {
    of: Option<(Arc<Vec<ClusterBox>>, u32)>,
    /// Deepest level.
    pub deepest: u32,
    /// Boxes that the level shows.
    pub shown: usize,
}

impl ClusterCounts {
    /// Count again if the tree or the level is another.
    pub fn update(&mut self, clusters: &Arc<Vec<ClusterBox>>, level: u32) {
        let is_current = |(held, counted): &(Arc<Vec<ClusterBox>>, u32)| {
            Arc::ptr_eq(held, clusters) && *counted == level
        };
        if !self.of.as_ref().is_some_and(is_current) {
            self.deepest = deepest_level(clusters);
            self.shown = at_level(clusters, level).count();
            self.of = Some((clusters.clone(), level));
        }
    }
}

/// Deepest level of a tree; 0 without one.
pub fn deepest_level(clusters: &[ClusterBox]) -> u32 {
    clusters
        .iter()
        .map(|cluster| cluster.level)
        .max()
        .unwrap_or(0)
}

/// Indices of the boxes that a level shows: its own, and leaves above it. Together they hold every patch once.
pub fn at_level(clusters: &[ClusterBox], level: u32) -> impl Iterator<Item = usize> {
    let mut has_child = vec![false; clusters.len()];
    for cluster in clusters {
        if let Some(parent) = has_child.get_mut(cluster.parent as usize) {
            *parent = true;
        }
    }
    let shown = move |cluster: &ClusterBox, is_inner: bool| {
        cluster.level == level || (cluster.level < level && !is_inner)
    };
    clusters
        .iter()
        .zip(has_child)
        .enumerate()
        .filter(move |(_, (cluster, is_inner))| shown(cluster, *is_inner))
        .map(|(index, _)| index)
}

/// The boxes of an overlay; empty where it is off.
pub fn boxes(clusters: &[ClusterBox], overlay: &ClusterOverlay) -> Vec<BoxInstance> {
    if !overlay.shown {
        return Vec::new();
    }
    let shown: Vec<&ClusterBox> = at_level(clusters, overlay.level)
        .take(MAX_BOXES)
        .map(|index| &clusters[index])
        .collect();
    let [low, high] = color_range(&shown, overlay.color);
    shown
        .iter()
        .map(|cluster| {
            let t = (quantity(cluster, overlay.color) - low) / (high - low).max(f32::MIN_POSITIVE);
            instance(cluster, theme::ramp(0.15 + 0.85 * t.clamp(0.0, 1.0)))
        })
        .collect()
}

/// One box in a colour.
pub fn instance(cluster: &ClusterBox, color: Vec3) -> BoxInstance {
    // Flat clusters, such as a wall, keep a visible edge.
    let thick = Vec3::splat(0.02);
    let [a, b, c] = (cluster.min - thick).to_array();
    let [d, e, f] = (cluster.max + thick).to_array();
    let [red, green, blue] = color.to_array();
    [a, b, c, d, e, f, red, green, blue]
}

/// The twelve edges of a box as ribbons.
pub fn outline(cluster: &ClusterBox, color: Vec3) -> Vec<SegmentInstance> {
    let corner = |bits: u32| {
        Vec3::new(
            if bits & 1 == 0 {
                cluster.min.x
            } else {
                cluster.max.x
            },
            if bits & 2 == 0 {
                cluster.min.y
            } else {
                cluster.max.y
            },
            if bits & 4 == 0 {
                cluster.min.z
            } else {
                cluster.max.z
            },
        )
    };
    let mut edges = Vec::with_capacity(12);
    for axis in [1, 2, 4] {
        for bits in (0..8).filter(|bits| bits & axis == 0) {
            edges.push(segment(corner(bits), corner(bits | axis), color, false));
        }
    }
    edges
}

/// The six face powers as arrows from the faces outwards; the strongest is half as long as the box is large.
pub fn face_power_arrows(cluster: &ClusterBox) -> Vec<SegmentInstance> {
    let strongest = cluster.face_power.into_iter().fold(0.0, f32::max);
    if strongest <= 0.0 {
        return Vec::new();
    }
    let extent = (cluster.max - cluster.min).max_element().max(0.5);
    let centre = 0.5 * (cluster.min + cluster.max);
    let half = 0.5 * (cluster.max - cluster.min);
    let mut arrows = Vec::new();
    for (face, power) in cluster.face_power.into_iter().enumerate() {
        let axis = face / 2;
        let sign = if face % 2 == 0 { 1.0 } else { -1.0 };
        let direction = sign * [Vec3::X, Vec3::Y, Vec3::Z][axis];
        if power > 0.0 {
            let start = centre + direction * half;
            let end = start + direction * (0.5 * extent * power / strongest);
            arrows.push(segment(start, end, theme::AXIS_LINES[axis], true));
        }
    }
    arrows
}

/// The path from the root to a cluster, root first.
pub fn path_to(clusters: &[ClusterBox], index: usize) -> Vec<usize> {
    let mut path = Vec::new();
    let mut at = index;
    // A parent comes before its child, so the walk ends.
    while let Some(cluster) = clusters.get(at) {
        path.push(at);
        let parent = cluster.parent as usize;
        if parent >= at {
            break;
        }
        at = parent;
    }
    path.reverse();
    path
}

/// The smallest cluster of a level, or leaf above it, whose box holds a point.
pub fn containing(clusters: &[ClusterBox], point: Vec3, level: u32) -> Option<usize> {
    // Coordinates of a picked point are rounded; boxes of walls are flat.
    let slack = Vec3::splat(2e-2);
    let volume = |index: &usize| {
        let size = clusters[*index].max - clusters[*index].min + slack;
        size.x * size.y * size.z
    };
    at_level(clusters, level)
        .filter(|&index| {
            let cluster = &clusters[index];
            point.cmpge(cluster.min - slack).all() && point.cmple(cluster.max + slack).all()
        })
        .min_by(|a, b| volume(a).total_cmp(&volume(b)))
}

fn segment(start: Vec3, end: Vec3, color: Vec3, is_arrow: bool) -> SegmentInstance {
    let [a, b, c] = start.to_array();
    let [d, e, f] = end.to_array();
    let [red, green, blue] = color.to_array();
    [
        a,
        b,
        c,
        d,
        e,
        f,
        red,
        green,
        blue,
        if is_arrow { 1.0 } else { 0.0 },
    ]
}

/// What a colour stands for; powers, areas and counts by their logarithm, since they span many magnitudes.
fn quantity(cluster: &ClusterBox, color: ClusterColor) -> f32 {
    let log = |x: f32| x.max(1e-20).log10();
    match color {
        ClusterColor::Power => log(cluster.power),
        ClusterColor::Area => log(cluster.area),
        ClusterColor::Spread => cluster.direction_spread,
        ClusterColor::Links => (cluster.link_count as f32 + 1.0).log10(),
        ClusterColor::Error => log(cluster.error),
    }
}

/// Ends of the colours of some boxes; at most six magnitudes for logarithms.
fn color_range(shown: &[&ClusterBox], color: ClusterColor) -> [f32; 2] {
    if color == ClusterColor::Spread {
        return [0.0, 1.0];
    }
    let (mut low, mut high) = (f32::MAX, f32::MIN);
    for cluster in shown {
        let value = quantity(cluster, color);
        low = low.min(value);
        high = high.max(value);
    }
    [low.max(high - 6.0), high]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cluster(level: u32, parent: u32, min: Vec3, max: Vec3) -> ClusterBox {
        ClusterBox {
            min,
            max,
            level,
            parent,
            patch_count: 1,
            area: 1.0,
            power: 1.0,
            direction_spread: 0.0,
            link_count: 0,
            error: 0.0,
            face_power: [1.0, 0.0, 2.0, 0.0, 0.0, 0.0],
        }
    }

    /// A root with a leaf and an inner child that has two leaves.
    fn tree() -> Vec<ClusterBox> {
        let (low, high) = (Vec3::ZERO, Vec3::splat(8.0));
        let right = Vec3::new(4.0, 0.0, 0.0);
        vec![
            cluster(0, u32::MAX, low, high),
            cluster(1, 0, low, Vec3::new(4.0, 8.0, 8.0)),
            cluster(1, 0, right, high),
            cluster(2, 2, right, Vec3::new(8.0, 4.0, 8.0)),
            cluster(2, 2, Vec3::new(4.0, 4.0, 0.0), high),
        ]
    }

    #[test]
    fn a_level_shows_its_boxes_and_the_leaves_above() {
        let shown: Vec<usize> = at_level(&tree(), 2).collect();
        assert_eq!(shown, [1, 3, 4]);
        let shown: Vec<usize> = at_level(&tree(), 0).collect();
        assert_eq!(shown, [0]);
    }

    #[test]
    fn path_runs_from_the_root() {
        assert_eq!(path_to(&tree(), 4), [0, 2, 4]);
        assert_eq!(path_to(&tree(), 0), [0]);
    }

    #[test]
    fn a_point_is_found_in_its_leaf() {
        let point = Vec3::new(6.0, 6.0, 1.0);
        assert_eq!(containing(&tree(), point, 2), Some(4));
        assert_eq!(containing(&tree(), Vec3::splat(50.0), 2), None);
    }

    #[test]
    fn boxes_are_finite_and_only_there_when_shown() {
        let mut overlay = ClusterOverlay::default();
        assert!(boxes(&tree(), &overlay).is_empty());
        overlay.shown = true;
        for color in ClusterColor::ALL {
            overlay.color = color;
            for instance in boxes(&tree(), &overlay) {
                assert!(
                    instance.iter().all(|x| x.is_finite()),
                    "{color:?} {instance:?}"
                );
            }
        }
    }

    #[test]
    fn arrows_point_where_the_power_goes() {
        let arrows = face_power_arrows(&tree()[0]);
        assert_eq!(arrows.len(), 2);
        assert!(arrows[1][4] > arrows[0][3] - 8.0, "the stronger is longer");
    }
}
