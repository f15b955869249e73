//! Bounds of the error of a leaf's linked light, link by link.

use glam::Vec4;
use rayon::prelude::*;

use super::path::path_to;
use crate::{
    hierarchy::{ElementId, Hierarchy, NodeId, luminance},
    solver::vertices::{LeafLight, link_irradiance, own_irradiance},
    transport::{Face, Interval, Kernel, LinkStore, TintedLink, is_too_near_for_tables},
};

/// Sum of the widths of the bounds of the kernel, relative to the linked irradiance of a leaf. Smaller costs time;
/// larger shows beside the doubt about visibility.
const TOLERANCE: f32 = 0.02;

/// Leaves whose bounds stand for all: equal parts of the area choose one each. Fewer, and chance shows in the figure;
/// more cost time in each step.
const BOUNDED_LEAVES: u32 = 64;

/// What bounds follow from.
#[derive(Clone, Copy)]
pub(crate) struct Bounding<'a> {
    /// Reads the tables of the sources.
    pub kernel: Kernel<'a>,
    /// The links.
    pub links: &'a LinkStore,
    /// Whether nothing is ever hidden.
    pub is_clear: bool,
}

impl<'a> Bounding<'a> {
    /// Bounds at a leaf; `path` leads from the root to it.
    pub(crate) fn leaf(self, path: &[NodeId], leaf: usize) -> LeafBounds<'a> {
        let Self {
            kernel,
            links: store,
            is_clear,
        } = self;
        let hierarchy = kernel.hierarchy;
        let face = Face {
            point: hierarchy.mesh.elements[leaf].centroid,
            normal: hierarchy.patch_of(leaf).normal,
        };
        // What the links give.
        let mut links = Vec::new();
        for &receiver in path {
            store.tinted(receiver).for_each(|link| {
                let irradiance = if link.source == receiver {
                    own_irradiance(kernel, receiver.index(), link)
                } else {
                    link_irradiance(kernel, link, face.point, face.normal)
                };
                links.push((link, receiver, irradiance));
            });
        }
        // What they should give.
        let is_near = |link: TintedLink<'_>, receiver: NodeId| {
            link.source == receiver || is_too_near_for_tables(hierarchy, link.source, receiver)
        };
        let weight = |&(link, receiver, _): &(TintedLink<'_>, NodeId, Vec4)| {
            let near = is_near(link, receiver);
            (link.source, if near { 1.0 } else { link.light_factor() })
        };
        let sources: Vec<(NodeId, f32)> = links.iter().map(weight).collect();
        let total: f32 = links.iter().map(|(_, _, light)| luminance(*light)).sum();
        let bounds = kernel.bounds(face, &sources, TOLERANCE * total);
        let bounded = |((link, receiver, irradiance), unoccluded): (_, Interval)| {
            bounded_link(hierarchy, link, receiver, irradiance, unoccluded, is_clear)
        };
        LeafBounds {
            links: links.into_iter().zip(bounds).map(bounded).collect(),
        }
    }

    /// Root mean square over the area of the error bounds of leaves, relative to a mean irradiance (luminance, W/m²).
    pub(crate) fn relative_error(self, leaves: &[LeafLight], mean: f32) -> f32 {
        let hierarchy = self.kernel.hierarchy;
        let chosen = chosen_leaves(hierarchy, leaves);
        let squares: Vec<f64> = chosen
            .par_iter()
            .map(|&(leaf, parts)| {
                let path = path_to(hierarchy, hierarchy.element_node(ElementId(leaf)));
                let error = self.leaf(&path, leaf as usize).error();
                f64::from(parts) * f64::from(error).powi(2)
            })
            .collect();
        let parts: u32 = chosen.iter().map(|(_, parts)| parts).sum();
        if mean > 0.0 && parts > 0 {
            ((squares.iter().sum::<f64>() / f64::from(parts)).sqrt() / f64::from(mean)) as f32
        } else {
            0.0
        }
    }
}

/// The leaves under the centres of [`BOUNDED_LEAVES`] equal parts of the area, in the order of the tree, with the number
/// of these centres.
fn chosen_leaves(hierarchy: &Hierarchy, leaves: &[LeafLight]) -> Vec<(u32, u32)> {
    let measure = |leaf: &LeafLight| {
        let element = &hierarchy.mesh.elements[leaf.element as usize];
        let weight = hierarchy.importance.measure(element.patch as usize);
        f64::from(element.area_vector.length() * weight)
    };
    let whole: f64 = leaves.iter().map(measure).sum();
    let centres_below = |area: f64| {
        let parts = area / whole * f64::from(BOUNDED_LEAVES) + 0.5;
        parts as u32
    };
    let mut area = 0.0;
    let mut chosen = Vec::new();
    for leaf in leaves {
        let before = centres_below(area);
        area += measure(leaf);
        let parts = centres_below(area).saturating_sub(before);
        if parts > 0 {
            chosen.push((leaf.element, parts));
        }
    }
    chosen
}

/// Links of a leaf and its ancestors, with their bounds at its centroid.
pub(crate) struct LeafBounds<'a> {
    /// The links with their receivers, from the root down.
    pub links: Vec<BoundedLink<'a>>,
}

/// One of them.
pub(crate) struct BoundedLink<'a> {
    /// The link.
    pub link: TintedLink<'a>,
    /// The leaf or an ancestor of it.
    pub receiver: NodeId,
    /// Irradiance of the leaf over it, before it is scaled to the coverage.
    pub irradiance: Vec4,
    /// Bounds of the luminance of what it should be, for the radiosities of the tables and the visibility of the link;
    /// where tables say nothing of a pair, for any visibility.
    kernel: Interval,
    /// Variance of that luminance by the visibility: it comes from few rays, and over a receiver that sees a part of the
    /// source it differs from place to place.
    variance: f32,
}

impl LeafBounds<'_> {
    /// Bound of the error of the sum (luminance, W/m²): that of the kernel, and twice the standard error of all
    /// visibilities, whose rays are independent.
    pub(crate) fn error(&self) -> f32 {
        let mut sum = Interval::default();
        let (mut shown, mut variance) = (0.0, 0.0);
        for link in &self.links {
            sum.low += link.kernel.low;
            sum.high += link.kernel.high;
            shown += luminance(link.irradiance);
            variance += link.variance;
        }
        sum.farthest(shown) + 2.0 * variance.sqrt()
    }
}

impl BoundedLink<'_> {
    /// Bound of the error of this link's irradiance (luminance, W/m²).
    pub(crate) fn error(&self) -> f32 {
        self.kernel.farthest(luminance(self.irradiance)) + 2.0 * self.variance.sqrt()
    }
}

fn bounded_link<'a>(
    hierarchy: &Hierarchy,
    link: TintedLink<'a>,
    receiver: NodeId,
    irradiance: Vec4,
    unoccluded: Interval,
    is_clear: bool,
) -> BoundedLink<'a> {
    let Interval { low, high } = unoccluded;
    let is_by_rays =
        link.source == receiver || is_too_near_for_tables(hierarchy, link.source, receiver);
    let visibility = link.light_factor();
    let (kernel, variance) = if is_by_rays {
        (Interval { low: 0.0, high }, 0.0)
    } else {
        let within = visibility.min(1.0);
        let share = link.visibility_variance() + within * (1.0 - within);
        let kernel = Interval {
            low: visibility * low,
            high: visibility * high,
        };
        (kernel, if is_clear { 0.0 } else { share * high * high })
    };
    BoundedLink {
        link,
        receiver,
        irradiance,
        kernel,
        variance,
    }
}
