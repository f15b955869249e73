//! Light of leaves from links.
//!
//! Each leaf gathers once more over its own links and those of its ancestors, at its own position instead of the
//! centroids of clusters: over links of clusters at its centroid, over links of elements at each of its corners.
//! Leaves with the same ancestors are evaluated together.

use std::ops::Range;

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use crate::{
    geometry::Vectors4,
    hierarchy::{Channels as _, Hierarchy, Kind, NodeId},
    solver::{
        Cancel,
        coverage::{CoverageMap, HemisphereCoverage},
        direct::Surfaces,
        places::OffsetPlaces,
    },
    transport::{Kernel, LinkStore, Sights, TintedLink, TintedLinks, self_irradiance},
};

/// Most patches of a group whose leaves one task visits; fewer in small scenes.
const TASK_PATCHES: u32 = 256;

/// Distance, in radii of a group of leaves, from which the projected power of a cluster is evaluated once for the
/// group. Smaller, and seams between groups are visible; larger, and it is evaluated for each leaf.
const SIGHT_DISTANCE: f32 = 8.0;

/// Leaves whose light from above is computed together.
const LANES: usize = 4;

/// Linked light of a leaf.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LeafLight {
    /// The leaf.
    pub element: u32,
    /// Linked irradiance at its corners, W/m²; the sum of form factors in the fourth channel.
    pub corners: [Vec4; 3],
    /// The same at its centroid.
    pub centre: Vec4,
}

/// Linked light of all leaves, in the order of the tree, at the places of their direct light, scaled to the coverage where
/// there is one; `None` when cancelled.
pub(crate) fn gather_leaves(
    kernel: Kernel<'_>,
    surfaces: Surfaces<'_>,
    links: &LinkStore,
    coverage: Option<&CoverageMap>,
    cancel: &Cancel,
) -> Option<Vec<LeafLight>> {
    let hierarchy = kernel.hierarchy;
    let offsets = surfaces.direct.offsets();
    let found: Vec<Vec<LeafLight>> = hierarchy
        .groups(hierarchy.task_patches(TASK_PATCHES))
        .into_par_iter()
        .map(|group| {
            let mut walk = Walk {
                kernel,
                links,
                coverage,
                offsets,
                path: Vec::new(),
                spare: Vec::new(),
                found: Vec::new(),
            };
            if !cancel.is_cancelled() {
                walk.enter(group);
            }
            walk.found
        })
        .collect();
    cancel.proceed()?;
    Some(found.into_iter().flatten().collect())
}

/// Add the light of the same leaves over mirrors, times what arrives of it, by channel.
pub(crate) fn add_mirrored(leaves: &mut [LeafLight], mirrored: &[LeafLight], arriving: Vec3) {
    let arriving = arriving.extend(0.0);
    leaves
        .par_iter_mut()
        .zip(mirrored)
        .for_each(|(leaf, light)| {
            leaf.centre += light.centre * arriving;
            for (sum, light) in leaf.corners.iter_mut().zip(light.corners) {
                *sum += light * arriving;
            }
        });
}

/// Scale the light of the leaves of one cell so that their form factors add to its coverage; `nearby` is the mean
/// radiosity of the neighbourhood.
fn scale_to_coverage(
    hierarchy: &Hierarchy,
    coverage: &CoverageMap,
    nearby: Vec3,
    leaves: &mut [LeafLight],
) {
    let sums = leaves.iter().fold((0.0, 0.0), |(areas, rows), leaf| {
        let area = hierarchy.mesh.elements[leaf.element as usize]
            .area_vector
            .length();
        (areas + area, rows + area * leaf.centre.form_factor_sum())
    });
    for leaf in leaves {
        let corners = coverage.at_corners(hierarchy, leaf.element as usize);
        for (value, coverage) in leaf.corners.iter_mut().zip(corners) {
            *value = coverage.scaled(*value, sums, nearby);
        }
        leaf.centre = HemisphereCoverage::mean(corners).scaled(leaf.centre, sums, nearby);
    }
}

/// Links of a node, and those of its ancestors that are not evaluated yet; some are evaluated for all leaves of the
/// node together.
#[derive(Default)]
struct Chain<'a> {
    /// Isotropic irradiance, the same for all leaves.
    even: Vec4,
    /// Sources far enough for one sight for all leaves, with their transmissions.
    sights: Sights,
    /// The other links.
    rest: Vec<TintedLink<'a>>,
    /// Links of the node if it is an element: they are evaluated at the corners of the leaves.
    own: TintedLinks<'a>,
}

impl<'a> Chain<'a> {
    /// Empty, with its memory for reuse.
    fn emptied(mut self) -> Self {
        self.sights.clear();
        self.rest.clear();
        Self {
            sights: self.sights,
            rest: self.rest,
            ..Self::default()
        }
    }

    /// Add a link, as a sight if its source is a cluster further than `far` from a centre.
    fn add(&mut self, kernel: Kernel<'_>, link: TintedLink<'a>, centre: Vec3, far: f32) {
        match kernel.hierarchy.kind(link.source) {
            Kind::Cluster(index) if centre.distance_squared(kernel.centre(index)) > far * far => {
                let sight = kernel.sight(index, centre);
                self.sights.push(&sight, link.tinted_transmission());
            }
            _ => self.rest.push(link),
        }
    }

    /// Irradiance over the evaluated links.
    fn known(&self, point: Vec3, normal: Vec3) -> Vec4 {
        self.sights.add_to(self.even, point, normal)
    }
}

/// A walk over the leaves below a cluster, in the order of the tree.
struct Walk<'a> {
    kernel: Kernel<'a>,
    links: &'a LinkStore,
    coverage: Option<&'a CoverageMap>,
    offsets: &'a OffsetPlaces,
    /// Chains of the ancestors of the current node.
    path: Vec<Chain<'a>>,
    /// Unused chains, for their memory.
    spare: Vec<Chain<'a>>,
    found: Vec<LeafLight>,
}

impl<'a> Walk<'a> {
    /// Visit all leaves of a cluster.
    fn enter(&mut self, group: usize) {
        let hierarchy = self.kernel.hierarchy;
        let mut above: Vec<usize> = Vec::new();
        let mut at = hierarchy.clusters[group].parent;
        while at != u32::MAX {
            above.push(at as usize);
            at = hierarchy.clusters[at as usize].parent;
        }
        for &cluster in above.iter().rev() {
            self.push_cluster(cluster);
        }
        let mut pending = vec![(group, self.path.len())];
        while let Some((cluster, depth)) = pending.pop() {
            self.leave(depth);
            self.push_cluster(cluster);
            if hierarchy.clusters[cluster].is_leaf() {
                let patches = hierarchy.clusters[cluster].patches();
                for start in patches.clone().step_by(LANES) {
                    let four = start..patches.end.min(start + LANES);
                    let above = self.light_from_above(four.clone());
                    for (patch, above) in four.zip(above) {
                        self.visit_patch(patch, above);
                    }
                }
            } else {
                let children = hierarchy.children(NodeId(cluster as u32));
                pending.extend(children.rev().map(|child| (child as usize, depth + 1)));
            }
        }
    }

    /// Shorten the path to a length.
    fn leave(&mut self, depth: usize) {
        while self.path.len() > depth {
            self.spare.extend(self.path.pop().map(Chain::emptied));
        }
    }

    /// Add a node to the path, with the links of its ancestors that are not evaluated yet.
    fn push(&mut self, centre: Vec3, radius: f32, mut chain: Chain<'a>) {
        let far = SIGHT_DISTANCE * radius;
        if let Some(above) = self.path.last() {
            for &link in &above.rest {
                chain.add(self.kernel, link, centre, far);
            }
        }
        self.path.push(chain);
    }

    /// Add a cluster to the path.
    fn push_cluster(&mut self, index: usize) {
        let cluster = &self.kernel.hierarchy.clusters[index];
        let far = SIGHT_DISTANCE * cluster.radius;
        let mut chain = self.spare.pop().unwrap_or_default();
        self.links.tinted(NodeId(index as u32)).for_each(|link| {
            if self.kernel.is_own(link.source, NodeId(index as u32)) {
                chain.even += own_irradiance(self.kernel, index, link);
            } else {
                chain.add(self.kernel, link, cluster.centroid, far);
            }
        });
        self.push(cluster.centroid, cluster.radius, chain);
    }

    /// Visit the leaves of a patch; `above` is its light from above if it is a leaf itself.
    fn visit_patch(&mut self, patch: usize, above: Vec4) {
        let hierarchy = self.kernel.hierarchy;
        let normal = hierarchy.patches[patch].normal;
        let base = hierarchy.clusters.len() as u32;
        let (first, top) = (self.found.len(), self.path.len());
        // Elements with the length of the path to them and their light from above: depth first, without recursion.
        let mut pending = vec![(patch, top, above)];
        while let Some((index, depth, above)) = pending.pop() {
            let element = &hierarchy.mesh.elements[index];
            self.leave(depth);
            let own = self.links.tinted(NodeId(base + index as u32));
            if element.is_leaf() {
                let light = self.leaf_light(index, normal, above, own);
                self.found.push(light);
                continue;
            }
            let mut chain = self.spare.pop().unwrap_or_default();
            chain.own = own;
            self.push(element.centroid, element.radius, chain);
            let children = element.children();
            let above = self.light_from_above(children.clone());
            let children = children.zip(above);
            pending.extend(
                children
                    .rev()
                    .map(|(child, above)| (child, depth + 1, above)),
            );
        }
        self.leave(top);
        let Some(coverage) = self.coverage else {
            return;
        };
        // Leaves come depth first, so those of a cell are consecutive.
        let cell = |leaf: &LeafLight| coverage.cell(hierarchy, leaf.element as usize);
        let nearby = coverage.nearby(self.kernel.tables, patch);
        for leaves in self.found[first..].chunk_by_mut(|a, b| cell(a) == cell(b)) {
            scale_to_coverage(hierarchy, coverage, nearby, leaves);
        }
    }

    /// Irradiance at the centroids of those of up to four elements with the same path that are leaves, over the links of
    /// its nodes, but not over those of elements: they are evaluated at corners.
    fn light_from_above(&self, elements: Range<usize>) -> [Vec4; LANES] {
        let (kernel, hierarchy) = (self.kernel, self.kernel.hierarchy);
        let mut sums = [Vec4::ZERO; LANES];
        let mesh = &hierarchy.mesh;
        let leaves = [0, 1, 2, 3].map(|lane| {
            let index = elements.start + lane;
            (index < elements.end && mesh.elements[index].is_leaf()).then_some(index)
        });
        let Some(first) = leaves.into_iter().flatten().next() else {
            return sums;
        };
        // Other lanes repeat the first leaf.
        let all = leaves.map(|leaf| leaf.unwrap_or(first));
        let points = all.map(|index| mesh.elements[index].centroid);
        let normals = all.map(|index| hierarchy.patch_of(index).normal);
        for lane in (0..LANES).filter(|&lane| leaves[lane].is_some()) {
            for chain in &self.path {
                sums[lane] += chain.known(points[lane], normals[lane]);
            }
        }
        let (points, normals) = (Vectors4::new(points), Vectors4::new(normals));
        for &link in self.path.last().map_or(&[][..], |chain| &chain.rest) {
            let transmission = transmission(kernel, link);
            let lights = kernel.irradiances(link.source, &points, &normals);
            for (sum, light) in sums.iter_mut().zip(lights) {
                *sum += light * transmission;
            }
        }
        sums
    }

    /// Linked light of a leaf, before scaling, with its light from above; `own` are its links.
    fn leaf_light(
        &self,
        index: usize,
        normal: Vec3,
        above: Vec4,
        own: TintedLinks<'_>,
    ) -> LeafLight {
        let (kernel, hierarchy) = (self.kernel, self.kernel.hierarchy);
        let centroid = hierarchy.mesh.elements[index].centroid;
        let mut light = LeafLight {
            element: index as u32,
            corners: [above; 3],
            centre: above,
        };
        let corners = hierarchy.mesh.corners(index);
        let [a, b, c] = self
            .offsets
            .places(&hierarchy.mesh.elements[index], corners);
        let points = Vectors4::new([centroid, a, b, c]);
        let normals = Vectors4::splat(normal);
        let mut add = |link: TintedLink<'_>| {
            let transmission = transmission(kernel, link);
            let [centre, corners @ ..] = kernel.irradiances(link.source, &points, &normals);
            light.centre += centre * transmission;
            for (sum, corner) in light.corners.iter_mut().zip(corners) {
                *sum += corner * transmission;
            }
        };
        for chain in &self.path {
            chain.own.for_each(&mut add);
        }
        own.for_each(add);
        light
    }
}

/// Irradiance of all faces of a cluster over its link with itself.
pub(crate) fn own_irradiance(kernel: Kernel<'_>, cluster: usize, link: TintedLink<'_>) -> Vec4 {
    let total = kernel.tables.clusters[cluster].total();
    self_irradiance(kernel.hierarchy, cluster, total) * link.tinted_transmission()
}

/// Irradiance of a face over a link of its own or of an ancestor, from another node.
pub(crate) fn link_irradiance(
    kernel: Kernel<'_>,
    link: TintedLink<'_>,
    point: Vec3,
    normal: Vec3,
) -> Vec4 {
    kernel.irradiance(link.source, point, normal) * transmission(kernel, link)
}

/// Factor by channel of the irradiance over a link when its form factor is evaluated again.
fn transmission(kernel: Kernel<'_>, link: TintedLink<'_>) -> Vec4 {
    match kernel.hierarchy.kind(link.source) {
        Kind::Cluster(_) => link.tinted_transmission(),
        Kind::Element(_) => link.tinted_light_factor(),
    }
}
