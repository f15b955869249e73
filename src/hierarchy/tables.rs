//! What every node shows as a source: directional moments of clusters, radiosity of elements.
//!
//! Four channels travel together: red, green, blue, and in `w` what a radiosity of 1 everywhere would give. As a source
//! `w` holds projected area, as irradiance the sum of form factors, which must be 1 in a closed scene.

use glam::{Vec3, Vec4};

use super::{Hierarchy, Kind, Moments, NodeId, Quantity as _};

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
        self.centres.resize(hierarchy.clusters.len(), Vec3::ZERO);
        self.brightest_in_elements
            .resize(elements.len(), Vec4::ZERO);
        // Power of each element times its centroid, in luminance.
        let mut weighed = vec![Vec4::ZERO; elements.len()];
        // Children come after their parents.
        for index in (0..elements.len()).rev() {
            let element = &elements[index];
            if element.is_leaf() {
                let radiosity = leaf(index);
                self.elements[index] = radiosity;
                self.brightest_in_elements[index] = radiosity;
                let power = luminance(radiosity) * element.area_vector.length();
                weighed[index] = element.centroid.extend(1.0) * power;
            } else {
                let first = element.first_child as usize;
                let children = first..first + 4;
                self.elements[index] = self.elements[children.clone()].iter().sum::<Vec4>() * 0.25;
                self.brightest_in_elements[index] = self.brightest_in_elements[children.clone()]
                    .iter()
                    .fold(Vec4::ZERO, |most, value| most.upper_of(*value));
                weighed[index] = weighed[children].iter().sum();
            }
        }
        let mut weighed_clusters = vec![Vec4::ZERO; hierarchy.clusters.len()];
        for (index, cluster) in hierarchy.clusters.iter().enumerate().rev() {
            let mut moments = Moments::default();
            let mut brightest = Vec4::ZERO;
            let mut sum = Vec4::ZERO;
            if cluster.is_leaf() {
                for patch in cluster.patches() {
                    moments.add(hierarchy.patches[patch].area_vector, self.elements[patch]);
                    brightest = brightest.upper_of(self.brightest_in_elements[patch]);
                    sum += weighed[patch];
                }
            } else {
                let first = cluster.first_child as usize;
                for child in [first, first + 1] {
                    moments.merge(&self.clusters[child]);
                    brightest = brightest.upper_of(self.brightest[child]);
                    sum += weighed_clusters[child];
                }
            }
            self.clusters[index] = moments;
            self.brightest[index] = brightest;
            weighed_clusters[index] = sum;
            let centre = sum.truncate() / sum.w;
            self.centres[index] = if sum.w > 0.0 && centre.is_finite() {
                centre
            } else {
                cluster.centroid
            };
        }
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

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.clusters.as_slice())
            + size_of_val(self.brightest.as_slice())
            + size_of_val(self.centres.as_slice())
            + size_of_val(self.elements.as_slice())
            + size_of_val(self.brightest_in_elements.as_slice())
    }
}

/// Luminance of linear RGB (Rec. 709), by which errors of colours are weighed; `w` does not count.
pub fn luminance(color: Vec4) -> f32 {
    color.dot(Vec4::new(0.2126, 0.7152, 0.0722, 0.0))
}
