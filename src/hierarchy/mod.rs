//! The light hierarchy: clusters over patches, patches divided into elements, and what each shows of itself.
//!
//! Two trees in flat arrays. Clusters form a binary tree split by extent, each over a contiguous range of patches; a
//! patch is one lit side of a triangle, and the root of a tree of elements that are divided into four.
//! A [`NodeId`] names any of them. The tree for rays is another one (see `geometry`): a tree that is good for rays
//! strews flat clusters over whole walls.

mod build;
mod channels;
mod colors;
mod directional;
mod edge_leaves;
mod facing;
mod importance;
mod mesh;
mod sheets;
mod subtrees;
mod tables;
mod validate;

pub use build::{MEDIAN_DEPTH, PatchTree};
pub use channels::{Channels, luminance};
pub use directional::{Moments, Quantity, Reading};
pub use importance::{Importance, longest_edge_squared};
pub use mesh::{Element, Mesh, Vertex};
pub use sheets::SheetSides;
pub use subtrees::Subtrees;
pub use tables::Tables;

use glam::Vec3;

use crate::scene::{Material, Scene, TriangleId};
use colors::ElementColors;

/// Tasks that work over the patches is shared into, where there are as many. Fewer, and threads wait for the last one; more,
/// and what each works out for itself of the clusters above adds up.
const LEAST_TASKS: u32 = 64;

/// A point that is less high over an element than this share of the coordinates lies in its plane: rounding tilts flat
/// meshes. Larger, and a house on a huge ground lies in it.
const IN_PLANE: f32 = 2e-7;

/// See [`Hierarchy::is_empty_above`]. Smaller leaves the walls of long halls whole, larger divides a huge ground where it
/// meets a huge sky.
const LARGE: f32 = 4.0;

/// Index of a patch, in tree order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PatchId(pub u32);

/// Index of an element; the first ones are the patches themselves, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ElementId(pub u32);

/// A cluster or an element: clusters come first, so that ids of clusters never change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NodeId(pub u32);

impl PatchId {
    /// The position among the patches.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

impl ElementId {
    /// The position among the elements.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

impl NodeId {
    /// The position in a table over all nodes.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// One lit side of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// The triangle.
    pub triangle: TriangleId,
    /// Whether this is the back of a two-sided triangle.
    pub is_back: bool,
    /// Area times unit normal, towards the lit side.
    pub area_vector: Vec3,
    /// Unit normal.
    pub normal: Vec3,
    /// Area, above 0 unless it underflows.
    pub area: f32,
    /// Mean reflectance; for an element see [`Hierarchy::reflectance_of`].
    pub reflectance: Vec3,
    /// Mean emitted radiance; for an element see [`Hierarchy::emission_of`].
    pub emission: Vec3,
    /// Mean part of the rays to it that meet it; for an element see [`Hierarchy::opacity_of`].
    pub opacity: f32,
}

/// A node of the binary tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cluster {
    /// Lower corner of the bounding box.
    pub min: Vec3,
    /// Upper corner of the bounding box.
    pub max: Vec3,
    /// First of two adjacent child clusters, or [`Cluster::LEAF`].
    pub first_child: u32,
    /// First patch.
    pub start: u32,
    /// One past the last patch.
    pub end: u32,
    /// The cluster above, or `u32::MAX` for the root.
    pub parent: u32,
    /// Sum of the patch areas.
    pub area: f32,
    /// Area-weighted mean of the patch centroids: the point that stands for the cluster. The centre of the box would
    /// err by a share of (size / distance), this errs by its square.
    pub centroid: Vec3,
    /// Radius of a sphere about the centroid that holds the box.
    pub radius: f32,
}

impl Cluster {
    /// Stands for a missing child: the children are then the patches themselves.
    pub const LEAF: u32 = u32::MAX;

    /// Whether the children are patches.
    pub fn is_leaf(&self) -> bool {
        self.first_child == Self::LEAF
    }

    /// Range of patches.
    pub fn patches(&self) -> std::ops::Range<usize> {
        self.start as usize..self.end as usize
    }
}

/// Either kind of node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Index into [`Hierarchy::clusters`].
    Cluster(usize),
    /// Index into the elements of [`Hierarchy::mesh`].
    Element(usize),
}

/// The children of a node: a run of ids, empty for a leaf.
pub type Children = std::ops::Range<u32>;

/// Clusters, patches and elements of a scene.
pub struct Hierarchy {
    /// The binary tree; the root is first, children come after their parents.
    pub clusters: Vec<Cluster>,
    /// The lit sides, in tree order; those that no cluster holds come last.
    pub patches: Vec<Patch>,
    /// Elements and the vertices that they share.
    pub mesh: Mesh,
    /// How much errors on each patch count.
    pub importance: Importance,
    /// By cluster: sum of the patch areas, each times its weight.
    weighted_areas: Vec<f32>,
    /// Parts of the binary tree for several threads.
    pub subtrees: Subtrees,
    /// The patches on the front and on the back of each triangle; `u32::MAX` for a back that is not lit.
    sides: Vec<[u32; 2]>,
    /// Where elements differ from their patch.
    colors: ElementColors,
    /// By patch, what mirrors, gloss and glass reflect of what rays meet and is counted as diffuse; empty where nothing is.
    diffused: Vec<Vec3>,
    /// By patch, what mirrors reflect whose images are followed; empty where there is none.
    mirrored: Vec<Vec3>,
    /// Reflectances are at most this.
    max_reflectance: f32,
}

impl Hierarchy {
    /// Build the tree of a scene. `crease_degrees` is the angle between faces above which vertices are not shared.
    pub fn new(scene: &Scene, crease_degrees: f32) -> Self {
        Self::build(scene, crease_degrees, &|| false).expect("nothing stops it")
    }

    /// As [`Self::new`], or `None` once `cancelled` returns true.
    pub fn build(
        scene: &Scene,
        crease_degrees: f32,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Option<Self> {
        let sheets = SheetSides::of(scene, &mut None);
        let tree = PatchTree::build(scene, sheets.as_ref(), cancelled)?;
        Self::of_tree(scene, tree, crease_degrees, cancelled)
    }

    /// One element for each patch of a tree, or `None` when cancelled. Patches that no cluster holds keep that one: no
    /// light is computed for them.
    pub fn of_tree(
        scene: &Scene,
        tree: PatchTree,
        crease_degrees: f32,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Option<Self> {
        let active = tree.active_patches().end;
        let PatchTree { clusters, patches } = tree;
        let mesh = Mesh::new(scene, &patches, active, crease_degrees, cancelled)?;
        let mut sides = vec![[u32::MAX; 2]; scene.triangles.len()];
        for (index, patch) in patches.iter().enumerate() {
            sides[patch.triangle.index()][usize::from(patch.is_back)] = index as u32;
        }
        let importance = Importance::new(scene, &patches);
        Some(Self {
            subtrees: Subtrees::new(&clusters),
            weighted_areas: weighted_areas(&clusters, &patches, &importance),
            clusters,
            patches,
            mesh,
            importance,
            sides,
            colors: ElementColors::default(),
            diffused: Vec::new(),
            mirrored: Vec::new(),
            max_reflectance: scene.max_reflectance,
        })
    }

    /// Whether some specular reflection counts as diffuse.
    pub fn has_diffused(&self) -> bool {
        !self.diffused.is_empty()
    }

    /// Count as diffuse what mirrors, gloss and glass reflect, but for the triangles whose images in mirrors are followed.
    pub fn diffuse_specular(&mut self, scene: &Scene, is_followed: impl Fn(TriangleId) -> bool) {
        let materials = scene.materials.iter();
        let by_material: Vec<Vec3> = materials.map(Material::diffused_specular).collect();
        if by_material.iter().all(|&diffused| diffused == Vec3::ZERO) {
            return;
        }
        let of = |patch: &Patch, is_wanted: bool| match is_followed(patch.triangle) == is_wanted {
            true => by_material[scene.triangles[patch.triangle.index()].material.index()],
            false => Vec3::ZERO,
        };
        let [diffused, mirrored] = [false, true].map(|followed| {
            let all = self.patches.iter().map(|patch| of(patch, followed));
            all.collect::<Vec<Vec3>>()
        });
        let some = |list: Vec<Vec3>| match list.iter().any(|&part| part != Vec3::ZERO) {
            true => list,
            false => Vec::new(),
        };
        (self.diffused, self.mirrored) = (some(diffused), some(mirrored));
    }

    /// Mean reflectance of an element in the mirrors whose images are followed.
    pub fn mirrored_by(&self, element: usize) -> Vec3 {
        let patch = self.mesh.elements[element].patch as usize;
        let mirrored = self.mirrored.get(patch).copied().unwrap_or_default();
        mirrored * self.opacity_of(element)
    }

    /// The root cluster.
    pub const ROOT: NodeId = NodeId(0);

    /// The patches that clusters hold. For the others no light is computed.
    pub fn active_patches(&self) -> std::ops::Range<usize> {
        self.clusters[0].patches()
    }

    /// The patch that a ray of the given direction meets on a triangle, if a cluster holds it: if light is computed for it.
    pub fn patch_met(&self, triangle: TriangleId, direction: Vec3) -> Option<usize> {
        let patch = self.side_met(triangle, direction)?;
        self.active_patches().contains(&patch).then_some(patch)
    }

    /// The patch that a ray of the given direction meets on a triangle, unless it is the back of a one-sided surface.
    pub fn side_met(&self, triangle: TriangleId, direction: Vec3) -> Option<usize> {
        let [front, back] = self.sides[triangle.index()];
        let meets_front = self.patches[front as usize].normal.dot(direction) < 0.0;
        let patch = if meets_front { front } else { back };
        (patch != u32::MAX).then_some(patch as usize)
    }

    /// The clusters that hold a patch, the root first; none where it is omitted.
    pub fn clusters_over(&self, patch: usize) -> impl Iterator<Item = usize> + '_ {
        let root = self.active_patches().contains(&patch).then_some(0);
        std::iter::successors(root, move |&index: &usize| {
            let cluster = &self.clusters[index];
            let first = cluster.first_child as usize;
            (!cluster.is_leaf()).then(|| {
                let is_second = patch >= self.clusters[first].end as usize;
                first + usize::from(is_second)
            })
        })
    }

    /// Patches that one task should process: no more than `most`, and fewer where there are few, since their elements are
    /// many. The same on any number of threads.
    pub fn task_patches(&self, most: u32) -> u32 {
        (self.active_patches().len() as u32 / LEAST_TASKS).clamp(1, most)
    }

    /// The largest clusters with few enough patches, in the order of the patches.
    pub fn groups(&self, most_patches: u32) -> Vec<usize> {
        let clusters = &self.clusters;
        let is_small =
            |cluster: &Cluster| cluster.is_leaf() || cluster.end - cluster.start <= most_patches;
        let mut groups: Vec<usize> = (0..clusters.len())
            .filter(|&index| {
                let parent = clusters.get(clusters[index].parent as usize);
                is_small(&clusters[index]) && parent.is_none_or(|parent| !is_small(parent))
            })
            .collect();
        groups.sort_unstable_by_key(|&index| clusters[index].start);
        groups
    }

    /// Box around a node.
    pub fn bounds(&self, node: NodeId) -> (Vec3, Vec3) {
        match self.kind(node) {
            Kind::Cluster(index) => (self.clusters[index].min, self.clusters[index].max),
            Kind::Element(index) => {
                let [a, b, c] = self.mesh.corners(index);
                (a.min(b).min(c), a.max(b).max(c))
            }
        }
    }

    /// Number of nodes of both kinds.
    pub fn node_count(&self) -> usize {
        self.clusters.len() + self.mesh.elements.len()
    }

    /// The kind of a node.
    pub fn kind(&self, node: NodeId) -> Kind {
        let clusters = self.clusters.len();
        if node.index() < clusters {
            Kind::Cluster(node.index())
        } else {
            Kind::Element(node.index() - clusters)
        }
    }

    /// The node of an element.
    pub fn element_node(&self, element: ElementId) -> NodeId {
        NodeId(self.clusters.len() as u32 + element.0)
    }

    /// The children of a node, as node ids.
    pub fn children(&self, node: NodeId) -> Children {
        let base = self.clusters.len() as u32;
        match self.kind(node) {
            Kind::Cluster(index) => {
                let cluster = &self.clusters[index];
                if cluster.is_leaf() {
                    base + cluster.start..base + cluster.end
                } else {
                    cluster.first_child..cluster.first_child + 2
                }
            }
            Kind::Element(index) => {
                let children = self.mesh.elements[index].children();
                base + children.start as u32..base + children.end as u32
            }
        }
    }

    /// The point that stands for a node: the centroid of its area.
    pub fn centroid(&self, node: NodeId) -> Vec3 {
        match self.kind(node) {
            Kind::Cluster(index) => self.clusters[index].centroid,
            Kind::Element(index) => self.mesh.elements[index].centroid,
        }
    }

    /// Radius of a sphere about the centroid that holds the node.
    pub fn radius(&self, node: NodeId) -> f32 {
        match self.kind(node) {
            Kind::Cluster(index) => self.clusters[index].radius,
            Kind::Element(index) => self.mesh.elements[index].radius,
        }
    }

    /// Total area of a node.
    pub fn node_area(&self, node: NodeId) -> f32 {
        match self.kind(node) {
            Kind::Cluster(index) => self.clusters[index].area,
            Kind::Element(index) => self.mesh.elements[index].area_vector.length(),
        }
    }

    /// Whether no other surface stands above the plane of an element within so many of its radii of it. Of surfaces that are
    /// larger than `LARGE` times that, their parts that are near do not count: they cast no small shadow.
    pub fn is_empty_above(&self, element: usize, radii: f32) -> bool {
        let at = &self.mesh.elements[element];
        let normal = self.patch_of(element).normal;
        let reach = radii * at.radius;
        let least = IN_PLANE * (at.radius + at.centroid.abs().max_element());
        let height = |point: Vec3| (point - at.centroid).dot(normal);
        let mut pending = vec![0];
        while let Some(index) = pending.pop() {
            let cluster: &Cluster = &self.clusters[index];
            let nearest = at.centroid.clamp(cluster.min, cluster.max);
            let middle = (cluster.min + cluster.max) * 0.5;
            let highest = height(middle) + ((cluster.max - cluster.min) * 0.5).dot(normal.abs());
            if nearest.distance(at.centroid) > reach || highest <= least {
                continue;
            }
            if !cluster.is_leaf() {
                pending.extend([
                    cluster.first_child as usize,
                    cluster.first_child as usize + 1,
                ]);
                continue;
            }
            let stands_above = |patch: usize| {
                if self.mesh.elements[patch].radius > LARGE * reach {
                    return false;
                }
                let corners = self.mesh.corners(patch);
                let is_above = corners.iter().any(|&c| height(c) > least);
                let [a, b, c] = corners;
                let near = at.centroid.clamp(a.min(b).min(c), a.max(b).max(c));
                is_above && near.distance(at.centroid) <= reach
            };
            if cluster.patches().any(stands_above) {
                return false;
            }
        }
        true
    }

    /// The part of the scene's area that an element, or a point on it that stands for so much area, has for errors of what
    /// it receives, 0…1. Nodes much larger than all that counts have 1.
    pub fn share_of_area(&self, element: usize, area: f32) -> f32 {
        let patch = self.mesh.elements[element].patch as usize;
        let weight = match self.emission_of(element) == Vec3::ZERO {
            // Of a painted lamp, too.
            true => 1.0,
            false => self.importance.weight(patch),
        };
        let share = f64::from(area * weight) / self.importance.area.max(f64::MIN_POSITIVE);
        share.min(1.0) as f32
    }

    /// The same for a node.
    pub fn node_share_of_area(&self, node: NodeId) -> f32 {
        match self.kind(node) {
            Kind::Cluster(index) => {
                let area = f64::from(self.weighted_areas[index]);
                (area / self.importance.area.max(f64::MIN_POSITIVE)).min(1.0) as f32
            }
            Kind::Element(index) => {
                self.share_of_area(index, self.mesh.elements[index].area_vector.length())
            }
        }
    }

    /// The patch that an element lies on.
    pub fn patch_of(&self, element: usize) -> &Patch {
        &self.patches[self.mesh.elements[element].patch as usize]
    }

    /// Bytes in use.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.clusters.as_slice())
            + size_of_val(self.patches.as_slice())
            + size_of_val(self.sides.as_slice())
            + size_of_val(self.weighted_areas.as_slice())
            + self.importance.memory_bytes()
            + self.colors.memory_bytes()
            + self.mesh.memory_bytes()
    }
}

/// By cluster: sum of the areas of its patches, each times its weight.
fn weighted_areas(clusters: &[Cluster], patches: &[Patch], importance: &Importance) -> Vec<f32> {
    let mut areas = vec![0.0f64; clusters.len()];
    // Children come after their parents.
    for (index, cluster) in clusters.iter().enumerate().rev() {
        areas[index] = if cluster.is_leaf() {
            let area = |patch: usize| f64::from(patches[patch].area * importance.weight(patch));
            cluster.patches().map(area).sum()
        } else {
            let first = cluster.first_child as usize;
            areas[first] + areas[first + 1]
        };
    }
    areas.into_iter().map(|area| area as f32).collect()
}
