//! What every node shows as a source: directional moments of clusters, radiosity of elements.
//!
//! Four channels travel together: red, green, blue, and in `w` what a radiosity of 1 everywhere would give. As a source
//! `w` holds projected area, as irradiance the sum of form factors, which must be 1 in a closed scene.

use glam::Vec4;

use super::{Hierarchy, Kind, Moments, NodeId, Quantity as _};

/// Source tables of all nodes.
#[derive(Clone, Debug, Default)]
pub struct Tables {
    /// Σ B S of each cluster, as moments (eq. 7).
    pub clusters: Vec<Moments<Vec4>>,
    /// Largest radiosity in each cluster: no irradiance from it can be larger.
    pub brightest: Vec<Vec4>,
    /// Mean radiosity of each element.
    pub elements: Vec<Vec4>,
}

impl Tables {
    /// Tables of a hierarchy whose leaves have the radiosity that `leaf` gives by element index.
    pub fn new(hierarchy: &Hierarchy, leaf: impl Fn(usize) -> Vec4) -> Self {
        let mut tables = Self::default();
        tables.pull(hierarchy, leaf);
        tables
    }

    /// Take the radiosity of the leaves and carry it up to their parents and clusters.
    pub fn pull(&mut self, hierarchy: &Hierarchy, leaf: impl Fn(usize) -> Vec4) {
        let elements = &hierarchy.mesh.elements;
        self.elements.resize(elements.len(), Vec4::ZERO);
        self.clusters
            .resize(hierarchy.clusters.len(), Moments::default());
        self.brightest.resize(hierarchy.clusters.len(), Vec4::ZERO);
        // Children come after their parents.
        for index in (0..elements.len()).rev() {
            let element = &elements[index];
            self.elements[index] = if element.is_leaf() {
                leaf(index)
            } else {
                let first = element.first_child as usize;
                let children = &self.elements[first..first + 4];
                (children[0] + children[1] + children[2] + children[3]) * 0.25
            };
        }
        for (index, cluster) in hierarchy.clusters.iter().enumerate().rev() {
            let mut moments = Moments::default();
            let mut brightest = Vec4::ZERO;
            if cluster.is_leaf() {
                for patch in cluster.patches() {
                    moments.add(hierarchy.patches[patch].area_vector, self.elements[patch]);
                    brightest = brightest.upper_of(self.elements[patch]);
                }
            } else {
                for child in cluster.first_child as usize..cluster.first_child as usize + 2 {
                    moments.merge(&self.clusters[child]);
                    brightest = brightest.upper_of(self.brightest[child]);
                }
            }
            self.clusters[index] = moments;
            self.brightest[index] = brightest;
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

    /// Largest radiosity within a node. Elements are taken as uniform.
    pub fn brightest(&self, hierarchy: &Hierarchy, node: NodeId) -> Vec4 {
        match hierarchy.kind(node) {
            Kind::Cluster(index) => self.brightest[index],
            Kind::Element(index) => self.elements[index],
        }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.clusters.as_slice())
            + size_of_val(self.brightest.as_slice())
            + size_of_val(self.elements.as_slice())
    }
}
