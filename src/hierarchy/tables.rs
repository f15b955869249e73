//! Every node as a source: directional moments of clusters, radiosity of elements.
//!
//! Quantities have four channels (see [`Channels`](super::Channels)).

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::{Hierarchy, Kind, Moments, NodeId, Quantity as _, Subtrees, luminance};

/// Source tables of all nodes.
#[derive(Clone, Debug, Default)]
pub struct Tables {
    /// Σ B S of each cluster, as moments (eq. 7).
    pub clusters: Vec<Moments<Vec4>>,
    /// Largest radiosity in each cluster: no irradiance from it can be larger.
    pub brightest: Vec<Vec4>,
    /// Where the power of each cluster comes from on average: its patches' centroids weighed by power, by area where
    /// it has none. Seen from there, a bright corner is as near as it is.
    pub centres: Vec<Vec3>,
    /// Mean radiosity of each element.
    pub elements: Vec<Vec4>,
    /// Largest radiosity in each element.
    pub brightest_in_elements: Vec<Vec4>,
}

impl Tables {
    /// Tables of a hierarchy whose leaves have the radiosity that `leaf` gives by element index.
    pub fn new(hierarchy: &Hierarchy, leaf: impl Fn(usize) -> Vec4 + Sync) -> Self {
        let mut tables = Self::default();
        tables.pull(hierarchy, leaf);
        tables
    }

    /// Take the radiosity of the leaves and carry it up to their parents and clusters. Sums are in the order of the
    /// tree, on any number of threads.
    pub fn pull(&mut self, hierarchy: &Hierarchy, leaf: impl Fn(usize) -> Vec4 + Sync) {
        let weighed = self.pull_elements(hierarchy, leaf);
        let count = hierarchy.clusters.len();
        self.clusters.resize(count, Moments::default());
        self.brightest.resize(count, Vec4::ZERO);
        self.centres.resize(count, Vec3::ZERO);
        let mut sums = vec![Vec4::ZERO; count];
        let cover = &hierarchy.subtrees;
        let level = Level {
            hierarchy,
            elements: &self.elements,
            brightest: &self.brightest_in_elements,
            weighed: &weighed,
        };
        let mut whole = Slices {
            start: 0,
            clusters: &mut self.clusters,
            brightest: &mut self.brightest,
            centres: &mut self.centres,
            sums: &mut sums,
        };
        let parts = whole.parts(cover);
        parts
            .into_par_iter()
            .zip(&cover.runs)
            .for_each(|(mut part, run)| {
                // Children come after their parents.
                run.clone().rev().for_each(|index| part.pull(level, index));
            });
        for &index in cover.top.iter().rev() {
            whole.pull(level, index);
        }
    }

    /// Carry radiosity up to the patches. Returns the power of each element times its centroid, in luminance.
    fn pull_elements(
        &mut self,
        hierarchy: &Hierarchy,
        leaf: impl Fn(usize) -> Vec4 + Sync,
    ) -> Vec<Vec4> {
        let elements = &hierarchy.mesh.elements;
        self.elements.resize(elements.len(), Vec4::ZERO);
        self.elements
            .par_iter_mut()
            .zip(elements)
            .enumerate()
            .filter(|(_, (_, element))| element.is_leaf())
            .for_each(|(index, (radiosity, _))| *radiosity = leaf(index));
        // What light passes through has that radiosity only where it is met.
        self.brightest_in_elements.clone_from(&self.elements);
        let leaves = self.brightest_in_elements.par_iter_mut().enumerate();
        leaves
            .filter(|(index, _)| elements[*index].is_leaf())
            .for_each(|(index, brightest)| {
                *brightest /= hierarchy.opacity_of(index).max(f32::MIN_POSITIVE);
            });
        let mut weighed: Vec<Vec4> = elements
            .par_iter()
            .zip(&self.elements)
            .map(|(element, &radiosity)| {
                let power = luminance(radiosity) * element.area_vector.length();
                element.centroid.extend(1.0) * power
            })
            .collect();
        // Children come after their parents.
        for (index, element) in elements.iter().enumerate().rev() {
            if element.is_leaf() {
                continue;
            }
            let children = element.children();
            let sum: Vec4 = self.elements[children.clone()].iter().sum();
            self.elements[index] = sum / f32::from(element.child_count);
            self.brightest_in_elements[index] = self.brightest_in_elements[children.clone()]
                .iter()
                .fold(Vec4::ZERO, |most, value| most.upper_of(*value));
            weighed[index] = weighed[children].iter().sum();
        }
        weighed
    }

    /// Where the power of a node comes from on average.
    pub fn centre(&self, hierarchy: &Hierarchy, node: NodeId) -> Vec3 {
        match hierarchy.kind(node) {
            Kind::Cluster(index) => self.centres[index],
            Kind::Element(index) => hierarchy.mesh.elements[index].centroid,
        }
    }

    /// Radiosity times area of a node.
    pub fn power(&self, hierarchy: &Hierarchy, node: NodeId) -> Vec4 {
        match hierarchy.kind(node) {
            Kind::Cluster(index) => self.clusters[index].total(),
            Kind::Element(index) => {
                self.elements[index] * hierarchy.mesh.elements[index].area_vector.length()
            }
        }
    }

    /// Largest radiosity within a node.
    pub fn brightest(&self, hierarchy: &Hierarchy, node: NodeId) -> Vec4 {
        match hierarchy.kind(node) {
            Kind::Cluster(index) => self.brightest[index],
            Kind::Element(index) => self.brightest_in_elements[index],
        }
    }

    /// Bytes in use.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.clusters.as_slice())
            + size_of_val(self.brightest.as_slice())
            + size_of_val(self.centres.as_slice())
            + size_of_val(self.elements.as_slice())
            + size_of_val(self.brightest_in_elements.as_slice())
    }
}

/// The source that clusters are pulled from.
#[derive(Clone, Copy)]
struct Level<'a> {
    hierarchy: &'a Hierarchy,
    elements: &'a [Vec4],
    brightest: &'a [Vec4],
    weighed: &'a [Vec4],
}

/// The tables of a run of clusters.
struct Slices<'a> {
    /// The first cluster of the run.
    start: usize,
    clusters: &'a mut [Moments<Vec4>],
    brightest: &'a mut [Vec4],
    centres: &'a mut [Vec3],
    /// Power times centroid, in luminance.
    sums: &'a mut [Vec4],
}

impl Slices<'_> {
    /// The tables of each run of a cover.
    fn parts(&mut self, cover: &Subtrees) -> Vec<Slices<'_>> {
        let clusters = cover.parts(self.clusters).into_iter();
        let brightest = cover.parts(self.brightest);
        let centres = cover.parts(self.centres);
        let sums = cover.parts(self.sums);
        clusters
            .zip(brightest)
            .zip(centres)
            .zip(sums)
            .zip(&cover.runs)
            .map(|((((clusters, brightest), centres), sums), run)| Slices {
                start: run.start,
                clusters,
                brightest,
                centres,
                sums,
            })
            .collect()
    }

    /// Sum up one cluster, whose children are done and in this run.
    fn pull(&mut self, level: Level<'_>, index: usize) {
        let hierarchy = level.hierarchy;
        let cluster = &hierarchy.clusters[index];
        let mut moments = Moments::default();
        let mut brightest = Vec4::ZERO;
        let mut sum = Vec4::ZERO;
        if cluster.is_leaf() {
            for patch in cluster.patches() {
                moments.add(hierarchy.patches[patch].area_vector, level.elements[patch]);
                brightest = brightest.upper_of(level.brightest[patch]);
                sum += level.weighed[patch];
            }
        } else {
            let first = cluster.first_child as usize - self.start;
            for child in [first, first + 1] {
                moments.merge(&self.clusters[child]);
                brightest = brightest.upper_of(self.brightest[child]);
                sum += self.sums[child];
            }
        }
        let at = index - self.start;
        self.clusters[at] = moments;
        self.brightest[at] = brightest;
        self.sums[at] = sum;
        let centre = sum.truncate() / sum.w;
        self.centres[at] = if sum.w > 0.0 && centre.is_finite() {
            centre
        } else {
            cluster.centroid
        };
    }
}
