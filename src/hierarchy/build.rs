//! The light tree: split by extent, not by surface area cost.
//!
//! Each cluster is cut near the middle of the longest axis of its centroids, so that clusters are compact in all
//! directions; a cut that leaves one side empty, or a depth that an unlucky scene would drive on, is replaced by one
//! at the median. Both sides of a wall lie at one place but get different light, so for the cut each patch stands a little
//! before its face.

use glam::Vec3;
use rayon::prelude::*;

use super::{Cluster, Patch, sheets::SheetSides};
use crate::{
    geometry::centroid,
    scene::{Scene, TriangleId},
};

/// Patches that a leaf cluster holds at most. With 1, tables cost more than they save; with many, links that need
/// single patches skip a level of the tree.
const LEAF_PATCHES: usize = 4;

/// Depth from which cuts are at the median, so that no tree is deeper than this plus 32. Smaller, and cuts are worse;
/// larger, and degenerate trees are deep.
pub const MEDIAN_DEPTH: u32 = 48;

/// Items that one task divides. Fewer, and subtrees are copied more often; more, and there is nothing to share out.
const TASK_ITEMS: usize = 4096;

/// Where a cluster is cut along its longest axis. A little below the middle, where the centroids of symmetrical scenes
/// lie: rounding, such as that of a scene far from the origin, must not decide on which side they come.
const CUT: f32 = 0.499;

/// An axis counts as longer only by more than this share, for the same reason.
const LONGER: f32 = 1e-3;

/// How far before its face a patch stands for a cut, as a share of the longest extent of the cluster: enough for the two
/// sides of a sheet in the middle to be told apart ([`CUT`]). With 0.1 and more, clusters of loose triangles are less
/// compact and need more links.
const FACED: f32 = 0.01;

/// A patch on its way into the tree.
struct Item {
    triangle: TriangleId,
    is_back: bool,
    centroid: Vec3,
    /// Unit normal of the side.
    normal: Vec3,
}

impl Item {
    fn of(scene: &Scene, triangle: TriangleId, is_back: bool) -> Self {
        let normal = unit(scene.surfaces[triangle.index()].area_vector);
        Self {
            triangle,
            is_back,
            centroid: centroid(scene.corners(triangle)),
            normal: if is_back { -normal } else { normal },
        }
    }
}

/// The direction of an area vector, however small; zero of a face without area.
fn unit(area_vector: Vec3) -> Vec3 {
    area_vector.as_dvec3().normalize_or_zero().as_vec3()
}

/// Clusters over patches: the light tree before there are elements.
#[derive(Clone, Debug)]
pub struct PatchTree {
    /// The binary tree; the root is first, children come after their parents.
    pub clusters: Vec<Cluster>,
    /// Patches in the order of the tree, and after them those that no cluster holds.
    pub patches: Vec<Patch>,
}

impl PatchTree {
    /// The tree over all lit sides of a scene; the two sides of `sheets` are apart in it. `None` when cancelled.
    pub fn build(
        scene: &Scene,
        sheets: Option<&SheetSides>,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Option<Self> {
        grow(scene, sheets, lit_sides(scene), &[], cancelled)
    }

    /// The tree over the patches that are not omitted, of which there is at least one; the others follow in their order.
    /// `None` when cancelled.
    pub fn without(
        &self,
        scene: &Scene,
        sheets: Option<&SheetSides>,
        omitted: &[bool],
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Option<Self> {
        let of = |is_out: bool| {
            let flagged = self.patches.iter().zip(omitted);
            let chosen = flagged.filter(move |(_, flag)| **flag == is_out);
            chosen.map(|(patch, _)| Item::of(scene, patch.triangle, patch.is_back))
        };
        // In the order of triangles, as `lit_sides` has them, so that the tree is the one that their scene would have.
        let mut items: Vec<Item> = of(false).collect();
        items.sort_unstable_by_key(|item| (item.triangle, item.is_back));
        grow(
            scene,
            sheets,
            items,
            &of(true).collect::<Vec<Item>>(),
            cancelled,
        )
    }

    /// The patches that clusters hold; light is computed for these.
    pub fn active_patches(&self) -> std::ops::Range<usize> {
        self.clusters[0].patches()
    }
}

/// Divide the items, by the sides of sheets first, until clusters are small, and put `others` after them.
fn grow(
    scene: &Scene,
    sheets: Option<&SheetSides>,
    mut items: Vec<Item>,
    others: &[Item],
    cancelled: &(dyn Fn() -> bool + Sync),
) -> Option<PatchTree> {
    let first_half = sheets.map_or(0, |sides| part_sides(sides, &mut items));
    let mut clusters = if (1..items.len()).contains(&first_half) {
        let (first, second) = items.split_at_mut(first_half);
        let subtrees = [
            subtree(first, 0, 1, cancelled)?,
            subtree(second, first_half, 1, cancelled)?,
        ];
        let mut clusters = vec![cluster(0, items.len(), u32::MAX)];
        clusters[0].first_child = 1;
        graft(&mut clusters, &subtrees);
        clusters
    } else {
        subtree(&mut items, 0, 0, cancelled)?
    };
    let patches: Vec<Patch> = items
        .par_iter()
        .chain(others)
        .map(|item| patch(scene, item))
        .collect();
    fit_boxes(scene, &patches, &mut clusters);
    Some(PatchTree { clusters, patches })
}

/// Put the items of one half of the sides of sheets before those of the other, in their order, and return how many these
/// are.
fn part_sides(sides: &SheetSides, items: &mut [Item]) -> usize {
    let is_second = |item: &Item| sides.is_in_second(item.triangle, item.is_back);
    items.sort_by_key(is_second);
    items.partition_point(|item| !is_second(item))
}

/// The clusters over some items, of which the first is item `start` of all: their root, and depth first, in pairs, all
/// below it. `None` when cancelled.
fn subtree(
    items: &mut [Item],
    start: usize,
    depth: u32,
    cancelled: &(dyn Fn() -> bool + Sync),
) -> Option<Vec<Cluster>> {
    let mut clusters = vec![cluster(start, start + items.len(), u32::MAX)];
    if items.len() > TASK_ITEMS {
        let count = split(items, depth >= MEDIAN_DEPTH);
        let (before, after) = items.split_at_mut(count);
        let (first, second) = rayon::join(
            || subtree(before, start, depth + 1, cancelled),
            || subtree(after, start + count, depth + 1, cancelled),
        );
        clusters[0].first_child = 1;
        graft(&mut clusters, &[first?, second?]);
        return Some(clusters);
    }
    let mut pending = vec![(0usize, depth)];
    while let Some((index, depth)) = pending.pop() {
        let Cluster {
            start: from, end, ..
        } = clusters[index];
        let range = from as usize - start..end as usize - start;
        if range.len() <= LEAF_PATCHES {
            continue;
        }
        if cancelled() {
            return None;
        }
        let middle = from as usize + split(&mut items[range], depth >= MEDIAN_DEPTH);
        let first = clusters.len();
        clusters[index].first_child = first as u32;
        clusters.push(cluster(from as usize, middle, index as u32));
        clusters.push(cluster(middle, end as usize, index as u32));
        pending.push((first + 1, depth + 1));
        pending.push((first, depth + 1));
    }
    Some(clusters)
}

/// Put two subtrees below a root: the pair of their roots, then what is below the first, then what is below the second.
fn graft(clusters: &mut Vec<Cluster>, subtrees: &[Vec<Cluster>; 2]) {
    for tree in subtrees {
        clusters.push(Cluster {
            parent: 0,
            ..tree[0]
        });
    }
    for (tree, root) in subtrees.iter().zip(1..) {
        // Where what was at 1 comes to lie.
        let shift = clusters.len() as u32 - 1;
        let moved = |index: u32| match index {
            0 => root,
            _ => index + shift,
        };
        if !tree[0].is_leaf() {
            clusters[root as usize].first_child = moved(tree[0].first_child);
        }
        clusters.extend(tree[1..].iter().map(|cluster| Cluster {
            parent: moved(cluster.parent),
            first_child: if cluster.is_leaf() {
                Cluster::LEAF
            } else {
                moved(cluster.first_child)
            },
            ..*cluster
        }));
    }
}

/// Fronts of all triangles and backs of the two-sided ones.
fn lit_sides(scene: &Scene) -> Vec<Item> {
    let sides = |triangle: TriangleId| {
        let is_lit_behind = scene.triangles[triangle.index()].two_sided;
        let backs = is_lit_behind.then(|| Item::of(scene, triangle, true));
        std::iter::once(Item::of(scene, triangle, false)).chain(backs)
    };
    (0..scene.triangles.len() as u32)
        .into_par_iter()
        .with_min_len(TASK_ITEMS)
        .flat_map_iter(|index| sides(TriangleId(index)))
        .collect()
}

fn cluster(start: usize, end: usize, parent: u32) -> Cluster {
    Cluster {
        min: Vec3::ZERO,
        max: Vec3::ZERO,
        first_child: Cluster::LEAF,
        start: start as u32,
        end: end as u32,
        parent,
        area: 0.0,
        centroid: Vec3::ZERO,
        radius: 0.0,
    }
}

fn patch(scene: &Scene, item: &Item) -> Patch {
    let surface = scene.surfaces[item.triangle.index()];
    let area_vector = if item.is_back {
        -surface.area_vector
    } else {
        surface.area_vector
    };
    Patch {
        triangle: item.triangle,
        is_back: item.is_back,
        area_vector,
        normal: unit(area_vector),
        area: area_vector.length(),
        reflectance: surface.reflectance,
        emission: surface.emission,
        opacity: surface.opacity,
    }
}

/// Reorder the items about a cut and return how many come before it; both sides hold at least one.
fn split(items: &mut [Item], at_median: bool) -> usize {
    let box_of = |key: &dyn Fn(&Item) -> Vec3| {
        let (mut min, mut max) = (Vec3::MAX, Vec3::MIN);
        for item in items.iter() {
            let at = key(item);
            min = min.min(at);
            max = max.max(at);
        }
        (min, max - min)
    };
    let (_, extent) = box_of(&|item| item.centroid);
    let shift = FACED * extent.max_element();
    let key = |item: &Item| item.centroid + item.normal * shift;
    let (min, extent) = box_of(&key);
    let axis = longest_axis(extent);
    if !at_median && extent[axis] > 0.0 {
        let cut = min[axis] + CUT * extent[axis];
        let mut count = 0;
        for i in 0..items.len() {
            if key(&items[i])[axis] < cut {
                items.swap(i, count);
                count += 1;
            }
        }
        if count > 0 && count < items.len() {
            return count;
        }
    }
    let middle = items.len() / 2;
    items.select_nth_unstable_by(middle, |a, b| {
        let id = |item: &Item| (item.triangle, item.is_back);
        key(a)[axis]
            .total_cmp(&key(b)[axis])
            .then_with(|| id(a).cmp(&id(b)))
    });
    middle
}

/// The first axis than which no other is longer.
fn longest_axis(extent: Vec3) -> usize {
    let least = extent.max_element() * (1.0 - LONGER);
    (0..3).find(|&axis| extent[axis] >= least).unwrap_or(0)
}

/// Boxes, areas and centroids, from the leaves up.
fn fit_boxes(scene: &Scene, patches: &[Patch], clusters: &mut [Cluster]) {
    for index in (0..clusters.len()).rev() {
        let mut cluster = clusters[index];
        let (mut min, mut max, mut area) = (Vec3::MAX, Vec3::MIN, 0.0f64);
        let (mut weighted, mut plain, mut count) = (glam::DVec3::ZERO, glam::DVec3::ZERO, 0.0);
        if cluster.is_leaf() {
            for patch in &patches[cluster.patches()] {
                let corners = scene.corners(patch.triangle);
                for corner in corners {
                    min = min.min(corner);
                    max = max.max(corner);
                }
                let middle = centroid(corners).as_dvec3();
                area += f64::from(patch.area);
                weighted += middle * f64::from(patch.area);
                plain += middle;
                count += 1.0;
            }
        } else {
            for child in &clusters[cluster.first_child as usize..cluster.first_child as usize + 2] {
                min = min.min(child.min);
                max = max.max(child.max);
                let middle = child.centroid.as_dvec3();
                area += f64::from(child.area);
                weighted += middle * f64::from(child.area);
                plain += middle;
                count += 1.0;
            }
        }
        (cluster.min, cluster.max, cluster.area) = (min, max, area as f32);
        // Areas may underflow: then all count alike.
        let middle = if area > 0.0 {
            weighted / area
        } else {
            plain / count
        };
        cluster.centroid = middle.as_vec3().clamp(min, max);
        cluster.radius = (cluster.centroid - min)
            .max(max - cluster.centroid)
            .length();
        clusters[index] = cluster;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{SceneOptions, Sides, builtin::stability};

    #[test]
    fn the_two_sides_of_a_wall_come_into_the_clusters_of_their_rooms() {
        let options = SceneOptions::with_sides(Sides::One);
        let scene = stability::rooms_with_pin_hole(0.5)
            .finish(&options)
            .unwrap();
        let tree = PatchTree::build(&scene, None, &|| false).unwrap();
        let rooms_of = |cluster: &Cluster| {
            let patches = tree.patches[cluster.patches()].iter();
            let mut rooms: Vec<&str> = patches
                .map(|patch| scene.material(patch.triangle).name.as_str())
                .collect();
            rooms.dedup();
            rooms
        };
        assert_eq!(rooms_of(&tree.clusters[0]).len(), 2);
        for cluster in &tree.clusters[1..] {
            assert_eq!(rooms_of(cluster).len(), 1);
        }
    }
}
