//! Bounds of the error of a leaf's linked light, link by link.

use glam::Vec4;
use rayon::prelude::*;

use super::path::path_to;
use crate::{
    hierarchy::{ElementId, Hierarchy, NodeId, luminance},
    solver::vertices::{LeafLight, link_irradiance, own_irradiance},
    transport::{Interval, Kernel, LinkStore, TintedLink},
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
        let point = hierarchy.mesh.elements[leaf].centroid;
        let normal = hierarchy.patch_of(leaf).normal;
        // What the links give.
        let mut given = Vec::new();
        for &receiver in path {
            store.tinted(receiver).for_each(|link| {
                let is_own = link.source == receiver;
                let irradiance = if is_own {
                    own_irradiance(kernel, receiver.index(), link)
                } else {
                    link_irradiance(kernel, link, point, normal)
                };
                let is_by_rays = is_own || kernel.is_too_near_for_tables(link.source, receiver);
                given.push(Given {
                    link,
                    receiver,
                    irradiance,
                    is_by_rays,
                });
            });
        }
        // What they should give.
        let source = |given: &Given<'_>| (given.link.source, given.weight());
        let sources: Vec<(NodeId, f32)> = given.iter().map(source).collect();
        let total: f32 = given.iter().map(|given| luminance(given.irradiance)).sum();
        let bounds = kernel.bounds(point, normal, &sources, TOLERANCE * total);
        let links = given.into_iter().zip(bounds);
        LeafBounds {
            links: links
                .map(|(given, unoccluded)| given.bounded(unoccluded, is_clear))
                .collect(),
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

/// What a leaf gets over a link.
struct Given<'a> {
    link: TintedLink<'a>,
    receiver: NodeId,
    irradiance: Vec4,
    /// Whether rays found how much of it arrives, since tables say nothing of the pair.
    is_by_rays: bool,
}

impl<'a> Given<'a> {
    /// Factor of the unoccluded irradiance in its bounds.
    fn weight(&self) -> f32 {
        if self.is_by_rays {
            1.0
        } else {
            self.link.light_factor()
        }
    }

    fn bounded(self, unoccluded: Interval, is_clear: bool) -> BoundedLink<'a> {
        let Interval { low, high } = unoccluded;
        let weight = self.weight();
        let within = self.link.light_factor().min(1.0);
        let share = if self.is_by_rays || is_clear {
            0.0
        } else {
            self.link.visibility_variance() + within * (1.0 - within)
        };
        BoundedLink {
            link: self.link,
            receiver: self.receiver,
            irradiance: self.irradiance,
            kernel: Interval {
                low: if self.is_by_rays { 0.0 } else { weight * low },
                high: weight * high,
            },
            variance: share * high * high,
        }
    }
}
