//! Which clusters of the tree are shown, counted, and clicked.

use std::sync::Arc;

use glam::Vec3;

use super::view::{ClusterCut, ClusterOverlay};
use crate::solver::ClusterBox;

/// The shown clusters of a tree, stored because large trees take a while to go through.
#[derive(Clone, Default)]
pub struct ShownClusters {
    of: Option<(Arc<Vec<ClusterBox>>, ClusterOverlay)>,
    /// Deepest level of the tree; nothing before the first tree.
    pub deepest: Option<u32>,
    /// The clusters whose boxes are shown when they are.
    pub shown: Arc<Vec<usize>>,
}

impl ShownClusters {
    /// Choose again if the tree or what is to be shown of it is another.
    pub fn update(&mut self, clusters: &Arc<Vec<ClusterBox>>, overlay: &ClusterOverlay) {
        let is_current = |(current, counted): &(Arc<Vec<ClusterBox>>, ClusterOverlay)| {
            Arc::ptr_eq(current, clusters) && counted.has_same_boxes(overlay)
        };
        if !self.of.as_ref().is_some_and(is_current) {
            let is_same_tree = |(current, _): &(Arc<_>, _)| Arc::ptr_eq(current, clusters);
            if !self.of.as_ref().is_some_and(is_same_tree) {
                self.deepest = Some(deepest_level(clusters));
            }
            self.shown = Arc::new(shown(clusters, overlay));
            self.of = Some((clusters.clone(), *overlay));
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

/// Indices of the clusters that an overlay shows when it is on.
pub fn shown(clusters: &[ClusterBox], overlay: &ClusterOverlay) -> Vec<usize> {
    match overlay.cut {
        ClusterCut::Level => at_level(clusters, overlay.level),
        ClusterCut::Size => of_size(clusters, overlay.size),
        ClusterCut::Used => (0..clusters.len())
            .filter(|&index| is_used(&clusters[index]))
            .collect(),
    }
}

/// Those of a level, and leaves above it. Together they hold every patch once.
fn at_level(clusters: &[ClusterBox], level: u32) -> Vec<usize> {
    let is_inner = inner_clusters(clusters);
    (0..clusters.len())
        .filter(|&index| {
            let at = clusters[index].level;
            at == level || (at < level && !is_inner[index])
        })
        .collect()
}

/// The largest whose extent is at most a part of that of the scene, and leaves that are larger. Together they hold every
/// patch once.
fn of_size(clusters: &[ClusterBox], part: f32) -> Vec<usize> {
    let is_inner = inner_clusters(clusters);
    let limit = part * clusters.first().map_or(0.0, extent);
    let fits = |cluster: &ClusterBox| extent(cluster) <= limit;
    (0..clusters.len())
        .filter(|&index| {
            let cluster = &clusters[index];
            let parent = clusters.get(cluster.parent as usize);
            (fits(cluster) || !is_inner[index]) && !parent.is_some_and(fits)
        })
        .collect()
}

/// Longest side of a box.
fn extent(cluster: &ClusterBox) -> f32 {
    (cluster.max - cluster.min).max_element()
}

/// Whether a link begins or ends at a cluster.
fn is_used(cluster: &ClusterBox) -> bool {
    cluster.link_count > 0 || cluster.source_count > 0
}

/// By cluster, whether there are clusters below it.
fn inner_clusters(clusters: &[ClusterBox]) -> Vec<bool> {
    let mut is_inner = vec![false; clusters.len()];
    for cluster in clusters {
        if let Some(parent) = is_inner.get_mut(cluster.parent as usize) {
            *parent = true;
        }
    }
    is_inner
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

/// The smallest cluster of those shown whose box holds a point.
pub fn containing(clusters: &[ClusterBox], shown: &[usize], point: Vec3) -> Option<usize> {
    // Coordinates of a picked point are rounded; boxes of walls are flat.
    let slack = Vec3::splat(2e-2);
    let volume = |index: &usize| {
        let size = clusters[*index].max - clusters[*index].min + slack;
        size.x * size.y * size.z
    };
    shown
        .iter()
        .copied()
        // The shown clusters may still be of the tree before.
        .filter(|&index| index < clusters.len())
        .filter(|&index| {
            let cluster = &clusters[index];
            point.cmpge(cluster.min - slack).all() && point.cmple(cluster.max + slack).all()
        })
        .min_by(|a, b| volume(a).total_cmp(&volume(b)))
}

#[cfg(test)]
pub(super) mod tests {
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
            source_count: 0,
            error: 0.0,
            face_power: [1.0, 0.0, 2.0, 0.0, 0.0, 0.0],
        }
    }

    /// A root with a leaf and an inner child that has two leaves.
    pub(in crate::viewer) fn tree() -> Vec<ClusterBox> {
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

    fn overlay(cut: ClusterCut, level: u32, size: f32) -> ClusterOverlay {
        ClusterOverlay {
            cut,
            level,
            size,
            ..ClusterOverlay::default()
        }
    }

    #[test]
    fn a_level_shows_its_boxes_and_the_leaves_above() {
        assert_eq!(at_level(&tree(), 2), [1, 3, 4]);
        assert_eq!(at_level(&tree(), 0), [0]);
    }

    #[test]
    fn every_size_and_level_shows_each_leaf_once() {
        let tree = tree();
        let leaves = [1, 3, 4];
        let cuts = (0..4)
            .map(|level| overlay(ClusterCut::Level, level, 1.0))
            .chain([0.0, 0.3, 0.5, 0.9, 1.0].map(|size| overlay(ClusterCut::Size, 0, size)));
        for overlay in cuts {
            let shown = shown(&tree, &overlay);
            for leaf in leaves {
                let above = path_to(&tree, leaf);
                let count = above.iter().filter(|index| shown.contains(index)).count();
                assert_eq!(count, 1, "leaf {leaf} in {overlay:?}");
            }
        }
    }

    #[test]
    fn a_size_shows_the_largest_that_fit() {
        let mut tree = tree();
        tree[3].max = Vec3::new(6.0, 4.0, 4.0);
        assert_eq!(of_size(&tree, 1.0), [0]);
        // The inner child is as long as the scene; one of its leaves is half as long, the others are too long but leaves.
        assert_eq!(of_size(&tree, 0.5), [1, 3, 4]);
    }

    #[test]
    fn used_clusters_are_ends_of_links() {
        let mut tree = tree();
        tree[2].link_count = 3;
        tree[4].source_count = 1;
        assert_eq!(shown(&tree, &overlay(ClusterCut::Used, 0, 1.0)), [2, 4]);
    }

    #[test]
    fn path_runs_from_the_root() {
        assert_eq!(path_to(&tree(), 4), [0, 2, 4]);
        assert_eq!(path_to(&tree(), 0), [0]);
    }

    #[test]
    fn a_point_is_found_in_its_leaf() {
        let point = Vec3::new(6.0, 6.0, 1.0);
        let leaves = at_level(&tree(), 2);
        assert_eq!(containing(&tree(), &leaves, point), Some(4));
        assert_eq!(containing(&tree(), &leaves, Vec3::splat(50.0)), None);
        assert_eq!(containing(&tree()[..2], &leaves, point), None);
    }
}
