//! Refinement: from the links of the last step to those of a smaller threshold.
//!
//! Receivers are walked from the root. A pair whose error, weighted by the square root of the receiver's share of the
//! area, exceeds the threshold is replaced by pairs with the children of its larger node. Links whose errors are below
//! it stay as they are, without new rays.

use super::{
    Link,
    refiner::{Decision, Refinement, Refiner},
};
use crate::hierarchy::{Hierarchy, Kind, NodeId};

/// Receivers with at most this many patches are refined by one task; fewer in small scenes. Smaller, and tasks cost
/// more than their work; larger, and processors wait.
const TASK_PATCHES: u32 = 256;

impl<'a, F: Fn(NodeId) -> &'a [Link] + Sync> Refiner<'a, F> {
    /// Refine all links; if `is_first`, begin with the root's exchange with itself.
    pub fn refine(&self, is_first: bool) -> Refinement {
        let start = if is_first {
            vec![Hierarchy::ROOT]
        } else {
            Vec::new()
        };
        let mut refinement = self.visit(Hierarchy::ROOT, &start);
        if self.follows_light {
            // A source may be listed once for each of its receivers.
            refinement.wanted.sort_unstable();
            refinement.wanted.dedup();
        }
        Refinement {
            fits: !self.budget.is_spent(),
            ..refinement
        }
    }

    /// Whether the result will be discarded anyway.
    fn is_stopped(&self) -> bool {
        (self.cancelled)() || self.budget.is_spent()
    }

    /// Whether a link was judged by this threshold and neither of its nodes was divided since.
    fn is_up_to_date(&self, source: NodeId, receiver: NodeId) -> bool {
        let hierarchy = self.hierarchy();
        // Children of a division are numbered after all nodes that existed before.
        self.judged.is_some_and(|count| {
            [source, receiver]
                .iter()
                .all(|&node| hierarchy.children(node).end as usize <= count)
        })
    }

    /// Refine a receiver and all its descendants; `sources` are those handed down by its parent.
    fn visit(&self, receiver: NodeId, sources: &[NodeId]) -> Refinement {
        let mut refinement = Refinement::default();
        if self.is_stopped() {
            return refinement;
        }
        let mut down = Vec::new();
        self.refine_links(receiver, sources, &mut refinement, &mut down);
        let children = self.hierarchy().children(receiver);
        let is_large = match self.hierarchy().kind(receiver) {
            Kind::Cluster(index) => {
                let cluster = &self.hierarchy().clusters[index];
                !cluster.is_leaf()
                    && cluster.end - cluster.start > self.hierarchy().task_patches(TASK_PATCHES)
            }
            Kind::Element(_) => false,
        };
        if is_large {
            let (first, second) = rayon::join(
                || self.visit(NodeId(children.start), &down),
                || self.visit(NodeId(children.start + 1), &down),
            );
            refinement.append(first);
            refinement.append(second);
        } else {
            for child in children {
                self.visit_into(NodeId(child), &down, &mut refinement);
            }
        }
        refinement
    }

    /// As `visit`, within one task. The recursion is as deep as the trees, whose depth is bounded.
    fn visit_into(&self, receiver: NodeId, sources: &[NodeId], refinement: &mut Refinement) {
        if self.is_stopped() {
            return;
        }
        let mut down = Vec::new();
        self.refine_links(receiver, sources, refinement, &mut down);
        for child in self.hierarchy().children(receiver) {
            self.visit_into(NodeId(child), &down, refinement);
        }
    }

    /// Decide on the links of one receiver; sources for its children are added to `down`.
    fn refine_links(
        &self,
        receiver: NodeId,
        sources: &[NodeId],
        out: &mut Refinement,
        down: &mut Vec<NodeId>,
    ) {
        // Judge the existing links.
        let before = out.links.len();
        let mut is_wanted = false;
        let mut pending: Vec<NodeId> = Vec::new();
        for link in (self.links_of)(receiver) {
            if self.is_up_to_date(link.source, receiver) {
                out.links.push(*link);
                continue;
            }
            let decision = self.decide(link.source, receiver, Some(link), out);
            self.apply(
                &decision,
                link.source,
                receiver,
                Some(link),
                out,
                &mut pending,
                down,
                &mut is_wanted,
            );
        }
        // Judge sources handed down, and the children of divided ones.
        pending.extend(sources.iter().rev());
        while let Some(source) = pending.pop() {
            let made = (out.links.len() - before) as u64;
            if (self.cancelled)() || made > self.budget.most() {
                break;
            }
            let decision = self.decide(source, receiver, None, out);
            self.apply(
                &decision,
                source,
                receiver,
                None,
                out,
                &mut pending,
                down,
                &mut is_wanted,
            );
        }
        // Record the run of this receiver.
        let count = (out.links.len() - before) as u32;
        self.budget.count(u64::from(count));
        if count > 0 {
            out.runs.push((receiver, count));
        }
        if let (true, Kind::Element(index)) = (is_wanted, self.hierarchy().kind(receiver)) {
            out.wanted.push(index as u32);
        }
    }

    /// Carry out a decision: add a link, or hand the pair on as pairs of children.
    #[expect(
        clippy::too_many_arguments,
        reason = "the state of one walk; a struct would be filled and read once"
    )]
    fn apply(
        &self,
        decision: &Decision,
        source: NodeId,
        receiver: NodeId,
        known: Option<&Link>,
        out: &mut Refinement,
        pending: &mut Vec<NodeId>,
        down: &mut Vec<NodeId>,
        is_wanted: &mut bool,
    ) {
        match decision {
            Decision::Drop => {}
            Decision::Keep(link) => out.links.push(*link),
            Decision::DivideSource => {
                pending.extend(self.hierarchy().children(source).rev().map(NodeId));
            }
            Decision::DivideReceiver if self.judge.kernel.is_own(source, receiver) => {
                down.extend(self.hierarchy().children(receiver).map(NodeId));
            }
            Decision::DivideReceiver => {
                if self.hierarchy().children(receiver).is_empty() {
                    // The element is divided after this pass, if memory allows; until then the pair has a link.
                    *is_wanted = true;
                    let error = self.judge.brightest(source);
                    let link = known
                        .copied()
                        .unwrap_or_else(|| self.link(source, receiver, error, 1, out));
                    out.links.push(link);
                } else {
                    down.push(source);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec4;

    use super::*;
    use crate::{
        geometry::{Random, RayTree},
        hierarchy::{Reading, Tables},
        scene::{Scene, SceneOptions, Sides, builtin::empty_cornell},
        transport::{
            Estimate, Judge, Judgement, Kernel, LinkBudget, LinkStore, PairSampler, PatchSums,
        },
    };

    fn cornell() -> Scene {
        let options = SceneOptions::with_sides(Sides::One);
        empty_cornell().finish(&options).unwrap()
    }

    /// What `of` says of the refiner of a scene of radiosity 1, for a threshold and a link limit, and of its links.
    fn refined<T>(
        scene: &Scene,
        threshold: f32,
        most: u64,
        of: impl FnOnce(&Judge<'_>, Refinement) -> T,
    ) -> T {
        let hierarchy = Hierarchy::new(scene, 30.0);
        let rays = RayTree::new(scene);
        let tables = Tables::new(&hierarchy, |_| Vec4::ONE);
        let areas = PatchSums::of_area(&hierarchy, &tables);
        let powers = PatchSums::of_power(&hierarchy, &tables);
        let none = LinkStore::default();
        let refiner = Refiner {
            judge: Judge {
                kernel: Kernel {
                    hierarchy: &hierarchy,
                    tables: &tables,
                    reading: Some(Reading::Bounded),
                    image: None,
                },
                estimate: Estimate::Interval,
                ambient: 0.0,
                sampler: PairSampler {
                    hierarchy: &hierarchy,
                    tables: &tables,
                    areas: &areas,
                    powers: &powers,
                    rays: &rays,
                    image: None,
                },
            },
            links_of: |node| none.of(node),
            judged: None,
            threshold,
            min_area: f32::INFINITY,
            seed: 1,
            cancelled: &|| false,
            budget: LinkBudget::new(most),
            is_by_patch: false,
            follows_light: false,
            spreads: &[],
        };
        of(&refiner.judge, refiner.refine(true))
    }

    #[test]
    fn smaller_thresholds_make_more_links_and_link_each_pair_once() {
        let scene = cornell();
        let counts = [10.0, 0.3, 0.03, 0.003].map(|threshold| {
            refined(&scene, threshold, u64::MAX, |judge, found| {
                assert!(found.fits);
                let hierarchy = judge.kernel.hierarchy;
                let store = LinkStore::from_runs(hierarchy.node_count(), &found.runs, &found.links);
                assert_eq!(store.validate(hierarchy), Ok(()), "{threshold}");
                found.links.len()
            })
        });
        assert_eq!(counts[0], 1, "the root exchanges light with itself");
        assert!(counts.is_sorted() && counts[3] > 100, "{counts:?}");
    }

    #[test]
    fn pairs_that_can_be_divided_are_linked_only_if_their_errors_are_below_the_threshold() {
        const THRESHOLD: f32 = 0.05;
        refined(&cornell(), THRESHOLD, u64::MAX, |judge, found| {
            let hierarchy = judge.kernel.hierarchy;
            let mut links = found.links.iter();
            let mut checked = 0;
            for &(receiver, count) in &found.runs {
                for link in links.by_ref().take(count as usize) {
                    let can_divide = [receiver, link.source]
                        .iter()
                        .any(|&node| !hierarchy.children(node).is_empty());
                    if !can_divide || link.source == receiver {
                        continue;
                    }
                    let judgement = judge.judge(link.source, receiver, &mut Random::new(1, 0));
                    let Judgement::Transfer { error, .. } = judgement else {
                        panic!("a link without transfer");
                    };
                    let weight = hierarchy.node_share_of_area(receiver).sqrt();
                    assert!(error * weight <= THRESHOLD, "{error}");
                    checked += 1;
                }
            }
            assert!(checked > 0);
        });
    }

    #[test]
    fn a_budget_stops_refinement() {
        let scene = cornell();
        let most = refined(&scene, 0.03, u64::MAX, |_, found| found.links.len() as u64);
        assert!(refined(&scene, 0.03, most, |_, found| found.fits));
        assert!(!refined(&scene, 0.03, most - 1, |_, found| found.fits));
    }
}
