//! Check of a link store: every pair of leaves is linked exactly once, or does not need a link.

use glam::Vec3;

use super::{Link, LinkStore, oracle::IN_PLANE};
use crate::{
    geometry::Image,
    hierarchy::{Hierarchy, Kind, NodeId},
};

/// Height over a plane, in multiples of [`IN_PLANE`] times the radius of the scene, up to which a leaf counts as lying in
/// it: refinement omits pairs of ancestors, whose radii add to at most twice that of the scene. Smaller reports pairs that
/// refinement omits; larger misses missing links.
const SLACK: f32 = 4.0;

/// Stands for no node.
const NONE: u32 = u32::MAX;

impl LinkStore {
    /// Check that each pair of a receiving and a sending leaf is linked through exactly one pair of their ancestors (a node
    /// counts as its own ancestor), and that sources exist. Only these pairs may be without a link:
    /// * leaves that do not face each other: all of one lies behind or in the plane of the other,
    /// * leaves of which one lies inside a solid,
    /// * leaves of patches with less than 1e-5 of the scene's area, which tables of clusters ignore.
    ///
    /// A store without links is that of a scene without light, and is valid.
    ///
    /// # Errors
    /// Names the first receiver and source that break the promise.
    pub fn validate(&self, hierarchy: &Hierarchy) -> Result<(), String> {
        self.validate_seen(hierarchy, None)
    }

    /// As [`Self::validate`], for links from an image of the scene in mirrors.
    ///
    /// # Errors
    /// As there.
    pub fn validate_seen(
        &self,
        hierarchy: &Hierarchy,
        image: Option<&Image>,
    ) -> Result<(), String> {
        if self.is_empty() {
            return Ok(());
        }
        let count = hierarchy.node_count();
        let mut parents = vec![NONE; count];
        for node in 0..count as u32 {
            for child in hierarchy.children(NodeId(node)) {
                parents[child as usize] = node;
            }
        }
        let mut check = Check {
            store: self,
            hierarchy,
            image,
            parents,
            linked_by: vec![NONE; count],
            linked_below: vec![0; count],
            slack: SLACK * IN_PLANE * hierarchy.radius(Hierarchy::ROOT),
            least_area: IN_PLANE * hierarchy.node_area(Hierarchy::ROOT),
        };
        check.receivers_below(Hierarchy::ROOT)
    }
}

/// State of a walk over all receivers.
struct Check<'a> {
    store: &'a LinkStore,
    hierarchy: &'a Hierarchy,
    /// Where receivers see the sources.
    image: Option<&'a Image>,
    /// By node, its parent, or [`NONE`].
    parents: Vec<u32>,
    /// By source, the node on the path to the present receiver that receives from it, or [`NONE`].
    linked_by: Vec<u32>,
    /// By node, the number of its proper descendants with an entry in `linked_by`.
    linked_below: Vec<u32>,
    /// Height up to which a point lies in a plane, frame units.
    slack: f32,
    /// Patches up to this area may be omitted, square frame units.
    least_area: f32,
}

impl Check<'_> {
    /// Check all receiving leaves below a node. The recursion is as deep as the trees, whose depth is bounded.
    fn receivers_below(&mut self, receiver: NodeId) -> Result<(), String> {
        let store = self.store;
        for link in store.of(receiver) {
            self.enter(link, receiver)?;
        }
        let children = self.hierarchy.children(receiver);
        if children.is_empty() {
            self.sources_below(Hierarchy::ROOT, receiver)?;
        }
        for child in children {
            self.receivers_below(NodeId(child))?;
        }
        for link in store.of(receiver) {
            self.leave(link);
        }
        Ok(())
    }

    fn enter(&mut self, link: &Link, receiver: NodeId) -> Result<(), String> {
        let source = link.source.index();
        let linked_by = self.linked_by.get_mut(source);
        let linked_by = linked_by.ok_or("a source does not exist")?;
        if *linked_by != NONE {
            return Err(format!(
                "node {} and its ancestor {linked_by} both receive from {source}",
                receiver.0
            ));
        }
        *linked_by = receiver.0;
        self.count_below_ancestors(source, |count| count + 1);
        Ok(())
    }

    fn leave(&mut self, link: &Link) {
        self.linked_by[link.source.index()] = NONE;
        self.count_below_ancestors(link.source.index(), |count| count - 1);
    }

    fn count_below_ancestors(&mut self, node: usize, change: impl Fn(u32) -> u32) {
        let mut above = self.parents[node];
        while above != NONE {
            let count = &mut self.linked_below[above as usize];
            *count = change(*count);
            above = self.parents[above as usize];
        }
    }

    /// Check the pairs of a receiving leaf and all sending leaves below a node.
    fn sources_below(&self, source: NodeId, leaf: NodeId) -> Result<(), String> {
        let has_links_below = self.linked_below[source.index()] > 0;
        if self.linked_by[source.index()] != NONE {
            return match has_links_below {
                true => Err(format!(
                    "leaf {} receives from {} and from a node below it",
                    leaf.0, source.0
                )),
                false => Ok(()),
            };
        }
        if !has_links_below && !self.is_above(source, leaf, |point| self.seen_at(point)) {
            return Ok(());
        }
        let children = self.hierarchy.children(source);
        if children.is_empty() && self.needs_link(source, leaf) {
            return Err(format!("leaf {} misses the light of {}", leaf.0, source.0));
        }
        for child in children {
            self.sources_below(NodeId(child), leaf)?;
        }
        Ok(())
    }

    fn seen_at(&self, point: Vec3) -> Vec3 {
        self.image.map_or(point, |image| image.place(point))
    }

    fn source_of(&self, place: Vec3) -> Vec3 {
        self.image.map_or(place, |image| image.source_of(place))
    }

    /// Whether some of a node, or of its box, lies above the plane of a leaf that sees it where `place` puts it.
    fn is_above(&self, node: NodeId, leaf: NodeId, place: impl Fn(Vec3) -> Vec3) -> bool {
        let Kind::Element(of) = self.hierarchy.kind(leaf) else {
            return true;
        };
        let normal = self.hierarchy.patch_of(of).normal;
        let base = self.hierarchy.mesh.elements[of].centroid.dot(normal);
        let height = match self.hierarchy.kind(node) {
            Kind::Element(index) => {
                let corners = self.hierarchy.mesh.corners(index);
                let heights = corners.map(|corner| place(corner).dot(normal));
                heights.into_iter().fold(f32::MIN, f32::max)
            }
            Kind::Cluster(_) => {
                let (min, max) = self.hierarchy.bounds(node);
                let (half, middle) = ((max - min) * 0.5, (max + min) * 0.5);
                let centre = place(middle).dot(normal);
                let reach =
                    Vec3::AXES.map(|axis| (place(middle + axis * half).dot(normal) - centre).abs());
                centre + reach.into_iter().sum::<f32>()
            }
        };
        height - base > self.slack
    }

    /// Whether two leaves may exchange light that refinement does not omit.
    fn needs_link(&self, source: NodeId, receiver: NodeId) -> bool {
        let counts = |node: NodeId| {
            let Kind::Element(leaf) = self.hierarchy.kind(node) else {
                return false;
            };
            let elements = &self.hierarchy.mesh.elements;
            let mut at = leaf;
            while !elements[at].is_inside_solid() {
                if elements[at].parent == NONE {
                    return self.hierarchy.patch_of(leaf).area > self.least_area;
                }
                at = elements[at].parent as usize;
            }
            false
        };
        counts(source)
            && counts(receiver)
            && self.is_above(source, receiver, |point| self.seen_at(point))
            && self.is_above(receiver, source, |point| self.source_of(point))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{SceneOptions, Sides, builtin::furnace};

    /// The hierarchy of a cube of two triangles a side, lit inside, with a divided patch.
    fn cube() -> Hierarchy {
        let options = SceneOptions::with_sides(Sides::One);
        let scene = furnace(0.5, 1.0, 1).finish(&options).unwrap();
        let mut hierarchy = Hierarchy::new(&scene, 30.0);
        hierarchy.mesh.divide(&[0]);
        hierarchy
    }

    /// A store with these links, as pairs of receiver and source.
    fn store(hierarchy: &Hierarchy, pairs: &[(NodeId, NodeId)]) -> LinkStore {
        let (mut runs, mut links) = (Vec::new(), Vec::new());
        for receiver in (0..hierarchy.node_count() as u32).map(NodeId) {
            let sources = pairs.iter().filter(|pair| pair.0 == receiver);
            let before = links.len();
            links.extend(sources.map(|&(_, source)| Link::over_tables(source, 1.0, 1.0, 0.0)));
            runs.push((receiver, (links.len() - before) as u32));
        }
        LinkStore::from_runs(hierarchy.node_count(), &runs, &links)
    }

    /// Pairs of all leaves on different sides of the cube.
    fn facing_leaves(hierarchy: &Hierarchy) -> Vec<(NodeId, NodeId)> {
        let base = hierarchy.clusters.len();
        let leaves: Vec<usize> = hierarchy.mesh.leaves().collect();
        let node = |leaf: usize| NodeId((base + leaf) as u32);
        let normal = |leaf: usize| hierarchy.patch_of(leaf).normal;
        let pairs = leaves.iter().flat_map(|&receiver| {
            let sources = leaves.iter();
            sources.map(move |&source| (receiver, source))
        });
        pairs
            .filter(|&(receiver, source)| normal(receiver).dot(normal(source)) < 0.5)
            .map(|(receiver, source)| (node(receiver), node(source)))
            .collect()
    }

    #[test]
    fn the_exchange_of_the_root_with_itself_links_all_pairs_once() {
        let hierarchy = cube();
        let whole = store(&hierarchy, &[(Hierarchy::ROOT, Hierarchy::ROOT)]);
        assert_eq!(whole.validate(&hierarchy), Ok(()));
        assert_eq!(LinkStore::default().validate(&hierarchy), Ok(()));
    }

    #[test]
    fn each_missing_link_is_found() {
        let hierarchy = cube();
        let pairs = facing_leaves(&hierarchy);
        assert_eq!(store(&hierarchy, &pairs).validate(&hierarchy), Ok(()));
        for missing in 0..pairs.len() {
            let mut fewer = pairs.clone();
            let (receiver, source) = fewer.remove(missing);
            let error = store(&hierarchy, &fewer).validate(&hierarchy);
            let expected = format!("leaf {} misses the light of {}", receiver.0, source.0);
            assert_eq!(error, Err(expected));
        }
    }

    #[test]
    fn each_doubled_link_is_found() {
        let hierarchy = cube();
        let pairs = facing_leaves(&hierarchy);
        let ancestors = |node: NodeId| -> Vec<NodeId> {
            let nodes = (0..hierarchy.node_count() as u32).map(NodeId);
            let is_above = |above: &NodeId| contains(&hierarchy, *above, node);
            nodes.filter(is_above).collect()
        };
        // Each ancestor of each end, the ends themselves included.
        for &(receiver, source) in pairs.iter().step_by(7) {
            for above in ancestors(receiver) {
                for from in ancestors(source) {
                    let mut more = pairs.clone();
                    more.push((above, from));
                    let error = store(&hierarchy, &more).validate(&hierarchy);
                    assert!(error.is_err(), "{above:?} from {from:?}");
                }
            }
        }
    }

    /// Whether a node is another one, or its ancestor.
    fn contains(hierarchy: &Hierarchy, above: NodeId, node: NodeId) -> bool {
        above == node
            || hierarchy
                .children(above)
                .any(|child| contains(hierarchy, NodeId(child), node))
    }

    #[test]
    fn unknown_sources_are_found() {
        let hierarchy = cube();
        let unknown = NodeId(hierarchy.node_count() as u32);
        let error = store(&hierarchy, &[(Hierarchy::ROOT, unknown)]).validate(&hierarchy);
        assert_eq!(error, Err("a source does not exist".to_owned()));
    }
}
