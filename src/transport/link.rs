//! Links: over which pairs of nodes light travels.

use std::ops::Deref;

use glam::{Vec3, Vec4};

use crate::hierarchy::{Hierarchy, NodeId};

/// Fewest visibility rays of a link. Fewer, and the two halves that correct the bias are missing; more cost time on all
/// weak links.
pub(super) const LEAST_RAYS: u32 = 2;

/// Transport from a source to one receiver. The receiver is implied by where the link is stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// The sending node. Equal to the receiver for the light that a cluster exchanges within itself.
    pub source: NodeId,
    /// Bound of the error of the irradiance that a face receives over this link (luminance): guaranteed except for
    /// visibility, which adds twice its standard error.
    pub error: f32,
    /// See [`Self::light_factor`].
    light_factor: f32,
    /// The form factor between elements, else the factor of the area: a sweep needs only one of both, so that a link
    /// takes 16 bytes. Read by [`Self::form_factor`] and [`Self::area_factor`].
    form_or_area_factor: f32,
}

impl Link {
    /// A link between two elements. `form_factor` (0…1) includes the visibility; `visibility` is the unoccluded
    /// fraction of both light and area.
    pub fn between_elements(source: NodeId, visibility: f32, form_factor: f32, error: f32) -> Self {
        Self {
            source,
            error,
            light_factor: visibility,
            form_or_area_factor: form_factor,
        }
    }

    /// A link with a cluster at one end at least. Bright surfaces often stand free, so the unoccluded fraction of the
    /// light may exceed that of the area.
    pub fn over_tables(source: NodeId, light_factor: f32, area_factor: f32, error: f32) -> Self {
        Self {
            source,
            error,
            light_factor,
            form_or_area_factor: area_factor,
        }
    }

    /// Factor of the unoccluded irradiance: the visible part of the light, 0…1.5, since an unbiased estimate from few
    /// rays may exceed 1; larger where near nodes exchange more than the tables give.
    pub fn light_factor(&self) -> f32 {
        self.light_factor
    }

    /// The same factor for the area of the source, and so for form factors. Only where one end at least is a cluster.
    pub fn area_factor(&self) -> f32 {
        self.form_or_area_factor
    }

    /// The form factor, visibility included, 0…1. Only between elements.
    pub fn form_factor(&self) -> f32 {
        self.form_or_area_factor
    }

    /// Variance of the visibility as an estimate of the fewest rays of a link, with a prior of one ray seen and one not.
    pub fn visibility_variance(&self) -> f32 {
        let rays = LEAST_RAYS as f32;
        let share = (self.light_factor.min(1.0) * rays + 1.0) / (rays + 2.0);
        share * (1.0 - share) / rays
    }

    /// Factor by channel of an unoccluded irradiance, where one end at least is a cluster.
    pub fn transmission(&self) -> Vec4 {
        Vec3::splat(self.light_factor).extend(self.area_factor())
    }

    /// The same link with another bound of its error.
    pub fn with_error(self, error: f32) -> Self {
        Self { error, ..self }
    }
}

/// A link, and what coloured panes on its way make of its light.
#[derive(Clone, Copy, Debug)]
pub struct TintedLink<'a> {
    link: &'a Link,
    /// Factor by colour, 1 on average; `None` where no pane is coloured.
    tint: Option<&'a Vec3>,
}

impl Deref for TintedLink<'_> {
    type Target = Link;

    fn deref(&self) -> &Link {
        self.link
    }
}

impl TintedLink<'_> {
    /// As [`Link::light_factor`], by channel.
    pub fn tinted_light_factor(&self) -> Vec4 {
        self.tinted(Vec4::splat(self.light_factor()))
    }

    /// As [`Link::form_factor`], by channel.
    pub fn tinted_form_factor(&self) -> Vec4 {
        self.tinted(Vec4::splat(self.form_factor()))
    }

    /// As [`Link::transmission`], by channel.
    pub fn tinted_transmission(&self) -> Vec4 {
        self.tinted(self.transmission())
    }

    fn tinted(&self, factor: Vec4) -> Vec4 {
        self.tint.map_or(factor, |tint| factor * tint.extend(1.0))
    }
}

/// The links of one receiver with their tints.
#[derive(Clone, Copy, Debug, Default)]
pub struct TintedLinks<'a> {
    links: &'a [Link],
    /// Empty where no pane is coloured.
    tints: &'a [Vec3],
}

impl<'a> TintedLinks<'a> {
    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.links.is_empty()
    }

    /// Call `visit` for each link in order. Two loops, since that without tints is the common one and takes most of the
    /// time of a sweep.
    pub fn for_each(self, mut visit: impl FnMut(TintedLink<'a>)) {
        if self.tints.is_empty() {
            for link in self.links {
                visit(TintedLink { link, tint: None });
            }
        } else {
            for (link, tint) in self.links.iter().zip(self.tints) {
                let tint = Some(tint);
                visit(TintedLink { link, tint });
            }
        }
    }
}

/// All links, grouped by receiver.
#[derive(Clone, Debug, Default)]
pub struct LinkStore {
    /// Start of each receiver's run; one more than there are nodes.
    offsets: Vec<u32>,
    links: Vec<Link>,
    /// By link, what coloured panes make of its light; empty where no pane is coloured.
    tints: Vec<Vec3>,
}

impl LinkStore {
    /// From runs of links: `runs` names each receiver at most once, in any order, with its number of links; `links` has
    /// them in that order.
    pub fn from_runs(node_count: usize, runs: &[(NodeId, u32)], links: &[Link]) -> Self {
        let mut offsets = vec![0u32; node_count + 1];
        for &(node, count) in runs {
            offsets[node.index() + 1] = count;
        }
        for index in 0..node_count {
            offsets[index + 1] += offsets[index];
        }
        let empty = Link::over_tables(NodeId(0), 0.0, 0.0, 0.0);
        let mut sorted = vec![empty; links.len()];
        let mut start = 0;
        for &(node, count) in runs {
            let to = offsets[node.index()] as usize;
            let count = count as usize;
            sorted[to..to + count].copy_from_slice(&links[start..start + count]);
            start += count;
        }
        Self {
            offsets,
            links: sorted,
            tints: Vec::new(),
        }
    }

    /// The links over which a node receives; none for nodes that are newer than the store.
    pub fn of(&self, node: NodeId) -> &[Link] {
        match self.offsets.get(node.index()..node.index() + 2) {
            Some(&[start, end]) => &self.links[start as usize..end as usize],
            _ => &[],
        }
    }

    /// As [`Self::of`], with their tints.
    pub fn tinted(&self, node: NodeId) -> TintedLinks<'_> {
        let links = self.of(node);
        let tints = match self.offsets.get(node.index()) {
            Some(&start) if !links.is_empty() && !self.tints.is_empty() => {
                &self.tints[start as usize..][..links.len()]
            }
            _ => &[],
        };
        TintedLinks { links, tints }
    }

    /// Set the tint of each link, in their order: factors of its light by colour, 1 on average over the colours.
    pub fn tint(&mut self, tints: Vec<Vec3>) {
        assert_eq!(tints.len(), self.links.len(), "a tint for each link");
        self.tints = tints;
    }

    /// All links, grouped by receiver.
    pub fn all(&self) -> &[Link] {
        &self.links
    }

    /// Set the factor of the light to that of the area: then the sums of form factors bound the irradiance of any
    /// surface. Between elements both are equal already.
    pub fn level(&mut self, hierarchy: &Hierarchy) {
        let first_element = hierarchy.clusters.len();
        for (receiver, range) in self.offsets.windows(2).enumerate() {
            for link in &mut self.links[range[0] as usize..range[1] as usize] {
                if receiver.min(link.source.index()) < first_element {
                    link.light_factor = link.area_factor();
                }
            }
        }
    }

    /// Number of links.
    pub fn len(&self) -> usize {
        self.links.len()
    }

    /// Whether there is no link.
    pub fn is_empty(&self) -> bool {
        self.links.is_empty()
    }

    /// Memory in bytes.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.links.as_slice())
            + size_of_val(self.offsets.as_slice())
            + size_of_val(self.tints.as_slice())
    }
}
