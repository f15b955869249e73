//! One sweep: light is gathered over all links, then pushed down to the leaves.
//!
//! Clusters sum the vector irradiances of their links as moments, elements as irradiance. Pushing adds the moments of a
//! cluster to those of its children, and projects them to the normal of each face (eq. 15), for all links together.
//! The paper's other way, pushing each vector to each face at once, is [`Push::AtOnce`].

use glam::Vec4;
use rayon::prelude::*;

use super::light::LinkedLight;
use crate::{
    hierarchy::{Hierarchy, Kind, Moments, NodeId, Reading, Tables},
    solver::{Cancel, Push, SolveSettings},
    transport::{Kernel, LinkStore, self_irradiance},
};

/// Fewest nodes for which one task gathers.
const TASK_NODES: usize = 256;

/// Fewest linked clusters for which one task gathers.
const TASK_CLUSTERS: usize = 32;

/// The clusters that receive over links of their own, the same for all sweeps. Most clusters have none and are skipped.
pub(super) struct LinkedClusters {
    /// The clusters, parents before children.
    clusters: Vec<u32>,
    /// For each, the index in `clusters` of its nearest ancestor there, or [`Self::NONE`].
    above: Vec<u32>,
    /// By patch, the index in `clusters` of the smallest one that contains it, or [`Self::NONE`].
    of_patch: Vec<u32>,
}

impl LinkedClusters {
    const NONE: u32 = u32::MAX;

    /// The linked clusters of some links.
    pub(crate) fn new(hierarchy: &Hierarchy, links: &LinkStore) -> Self {
        let mut linked_clusters = Self {
            clusters: Vec::new(),
            above: Vec::new(),
            of_patch: vec![Self::NONE; hierarchy.patches.len()],
        };
        let mut nearest = vec![Self::NONE; hierarchy.clusters.len()];
        for (index, cluster) in hierarchy.clusters.iter().enumerate() {
            let above = nearest.get(cluster.parent as usize).copied();
            nearest[index] = above.unwrap_or(Self::NONE);
            if !links.of(NodeId(index as u32)).is_empty() {
                linked_clusters.above.push(nearest[index]);
                nearest[index] = linked_clusters.clusters.len() as u32;
                linked_clusters.clusters.push(index as u32);
            }
            if cluster.is_leaf() {
                linked_clusters.of_patch[cluster.patches()].fill(nearest[index]);
            }
        }
        linked_clusters
    }
}

impl LinkedLight {
    /// Irradiance over the links of every element, leaves and their ancestors (eqs 14 and 15), if sources send what
    /// these tables tell, with the sum of form factors in the fourth channel. `None` when cancelled.
    pub(super) fn gather(
        &self,
        hierarchy: &Hierarchy,
        tables: &Tables,
        linked_clusters: &LinkedClusters,
        settings: &SolveSettings,
        cancel: &Cancel,
    ) -> Option<Vec<Vec4>> {
        let kernel = Kernel {
            hierarchy,
            tables,
            reading: settings.method.reading(),
            image: None,
        };
        gather(kernel, &self.links, linked_clusters, settings.push, cancel)
    }

    /// The linked clusters of the links over mirrors.
    pub(super) fn clusters_of_images(&self, hierarchy: &Hierarchy) -> Vec<LinkedClusters> {
        let images = self.images.iter();
        images
            .map(|image| LinkedClusters::new(hierarchy, &image.links))
            .collect()
    }

    /// Add the irradiance over mirrors to that of every element; not to the sums of form factors. `None` when cancelled.
    pub(super) fn add_images(
        &self,
        hierarchy: &Hierarchy,
        linked_clusters: &[LinkedClusters],
        settings: &SolveSettings,
        cancel: &Cancel,
        irradiance: &mut [Vec4],
    ) -> Option<()> {
        for (image, linked_clusters) in self.images.iter().zip(linked_clusters) {
            let kernel = Kernel {
                hierarchy,
                tables: &self.power,
                reading: settings.method.reading(),
                image: Some(&image.image),
            };
            let seen = gather(kernel, &image.links, linked_clusters, settings.push, cancel)?;
            let arriving = image.image.reflectance().extend(0.0);
            for (sum, light) in irradiance.iter_mut().zip(seen) {
                *sum += light * arriving;
            }
        }
        Some(())
    }
}

fn gather(
    kernel: Kernel<'_>,
    links: &LinkStore,
    linked_clusters: &LinkedClusters,
    push: Push,
    cancel: &Cancel,
) -> Option<Vec<Vec4>> {
    let hierarchy = kernel.hierarchy;
    let mut irradiance = own_irradiance(kernel, links, cancel);
    cancel.proceed()?;
    let from_clusters = match push {
        Push::Combined => push_moments(kernel, links, linked_clusters, cancel)?,
        Push::AtOnce => push_at_once(kernel, links, cancel),
    };
    cancel.proceed()?;
    let patch_count = from_clusters.len();
    irradiance[..patch_count]
        .par_iter_mut()
        .zip(from_clusters)
        .for_each(|(sum, above)| *sum += above);
    // Parents come before their children.
    for index in patch_count..irradiance.len() {
        let parent = hierarchy.mesh.elements[index].parent as usize;
        let above = irradiance[parent];
        irradiance[index] += above;
    }
    Some(irradiance)
}

/// Irradiance of elements over their own links; incomplete when cancelled.
fn own_irradiance(kernel: Kernel<'_>, links: &LinkStore, cancel: &Cancel) -> Vec<Vec4> {
    let hierarchy = kernel.hierarchy;
    let base = hierarchy.clusters.len() as u32;
    (0..hierarchy.mesh.elements.len())
        .into_par_iter()
        .with_min_len(TASK_NODES)
        .map(|index| {
            let mut sum = Vec4::ZERO;
            let links = links.tinted(NodeId(base + index as u32));
            if links.is_empty() || cancel.is_cancelled() {
                return sum;
            }
            let (point, normal) = (
                hierarchy.mesh.elements[index].centroid,
                hierarchy.patch_of(index).normal,
            );
            links.for_each(|link| {
                sum += match hierarchy.kind(link.source) {
                    Kind::Element(source) => {
                        kernel.tables.elements[source] * link.tinted_form_factor()
                    }
                    Kind::Cluster(_) => {
                        kernel.irradiance(link.source, point, normal) * link.tinted_transmission()
                    }
                };
            });
            sum
        })
        .collect()
}

/// Irradiance of patches over the links of clusters, by the moments of all their ancestors. `None` when cancelled.
fn push_moments(
    kernel: Kernel<'_>,
    links: &LinkStore,
    linked_clusters: &LinkedClusters,
    cancel: &Cancel,
) -> Option<Vec<Vec4>> {
    let hierarchy = kernel.hierarchy;
    let reading = kernel.reading.unwrap_or(Reading::Bounded);
    // The moments of each cluster over its own links.
    let mut incident: Vec<Moments<Vec4>> = linked_clusters
        .clusters
        .par_iter()
        .with_min_len(TASK_CLUSTERS)
        .map(|&index| {
            if cancel.is_cancelled() {
                return Moments::default();
            }
            cluster_incident(kernel, links, index as usize)
        })
        .collect();
    cancel.proceed()?;
    // Add the moments of the ancestors: these come first and are complete.
    for (place, &above) in linked_clusters.above.iter().enumerate() {
        if above != LinkedClusters::NONE {
            let above = incident[above as usize];
            incident[place].merge(&above);
        }
    }
    // The irradiance of each patch by its normal.
    let active = hierarchy.active_patches();
    let project = |patch: usize| {
        let nearest = incident.get(linked_clusters.of_patch[patch] as usize);
        match nearest {
            Some(nearest) if active.contains(&patch) => {
                nearest.project(hierarchy.patches[patch].normal, reading)
            }
            _ => Vec4::ZERO,
        }
    };
    let pushed = (0..hierarchy.patches.len())
        .into_par_iter()
        .with_min_len(TASK_NODES)
        .map(project)
        .collect();
    Some(pushed)
}

/// Sum of the vector irradiances of all links of one cluster.
fn cluster_incident(kernel: Kernel<'_>, links: &LinkStore, index: usize) -> Moments<Vec4> {
    let hierarchy = kernel.hierarchy;
    let cluster = &hierarchy.clusters[index];
    let mut sum = Moments::default();
    links.tinted(NodeId(index as u32)).for_each(|link| {
        if kernel.is_own(link.source, NodeId(index as u32)) {
            sum.add_isotropic(
                self_irradiance(hierarchy, index, kernel.tables.clusters[index].total())
                    * link.tinted_transmission(),
            );
        } else {
            kernel
                .vector_irradiance(link.source, cluster.centroid)
                .add_to(&mut sum, link.tinted_transmission());
        }
    });
    sum
}

/// Irradiance of patches over the links of clusters, each vector pushed separately; incomplete when cancelled.
fn push_at_once(kernel: Kernel<'_>, links: &LinkStore, cancel: &Cancel) -> Vec<Vec4> {
    let hierarchy = kernel.hierarchy;
    let leaves: Vec<usize> = (0..hierarchy.clusters.len())
        .filter(|&index| hierarchy.clusters[index].is_leaf())
        .collect();
    let parts: Vec<(usize, Vec<Vec4>)> = leaves
        .par_iter()
        .map(|&leaf| {
            let range = hierarchy.clusters[leaf].patches();
            let mut sums = vec![Vec4::ZERO; range.len()];
            let mut at = leaf;
            while !cancel.is_cancelled() {
                links.tinted(NodeId(at as u32)).for_each(|link| {
                    push_one(
                        kernel,
                        at,
                        link.source,
                        link.tinted_transmission(),
                        &hierarchy.patches[range.clone()],
                        &mut sums,
                    );
                });
                match hierarchy.clusters[at].parent {
                    u32::MAX => break,
                    parent => at = parent as usize,
                }
            }
            (range.start, sums)
        })
        .collect();
    let mut irradiance = vec![Vec4::ZERO; hierarchy.patches.len()];
    for (start, sums) in parts {
        irradiance[start..start + sums.len()].copy_from_slice(&sums);
    }
    irradiance
}

/// Add the irradiance over one link of a cluster to some of its patches (eq. 15).
fn push_one(
    kernel: Kernel<'_>,
    cluster: usize,
    source: NodeId,
    transmission: Vec4,
    patches: &[crate::hierarchy::Patch],
    sums: &mut [Vec4],
) {
    let hierarchy = kernel.hierarchy;
    if kernel.is_own(source, NodeId(cluster as u32)) {
        let irradiance =
            self_irradiance(hierarchy, cluster, kernel.tables.clusters[cluster].total())
                * transmission;
        sums.iter_mut().for_each(|sum| *sum += irradiance);
        return;
    }
    let receiver = &hierarchy.clusters[cluster];
    let incident = kernel.vector_irradiance(source, receiver.centroid);
    for (sum, patch) in sums.iter_mut().zip(patches) {
        *sum += incident.on_face(patch.normal) * transmission;
    }
}
