//! Refinement: from the links of the last step to those of a smaller threshold.
//!
//! Receivers are walked from the root. A pair whose error, weighted by the root of the receiver's share of the area,
//! exceeds the threshold is replaced by pairs with the children of the node that causes the error, which is the larger
//! one. Links that are good enough stay as they are: nothing is traced again.

use std::sync::atomic::{AtomicU64, Ordering};

use super::{
    Judge, Judgement, Link, element_form_factor, element_form_factors, kernel::inner_points,
};
use glam::Vec3;

use crate::{
    geometry::{Random, Vectors4},
    hierarchy::{Hierarchy, Kind, NodeId},
};

/// Receivers with fewer patches than this are refined by one task; less in small scenes.
const TASK_PATCHES: u32 = 256;

/// Rays of one link at least.
const LEAST_RAYS: u32 = 2;

/// Rays of one link at most.
const MOST_RAYS: u32 = 8;

/// Rays that find which part of a cluster's light falls on the cluster itself. These links are few and carry much.
const SELF_RAYS: u32 = 16;

/// Share of its brightest patch's light by which the exchange of a cluster within itself may be wrong. Larger, and links
/// within convex objects are sought in vain; smaller, and bright corners are blurred.
const SELF_SHARE: f32 = 0.2;

/// Largest factor by which rays may raise what tables say of near nodes. Larger, and a few lucky rays make a firefly;
/// smaller, and light is lost where tables see a source edge-on.
const MOST_CORRECTION: f32 = 64.0;

/// Rays of a link between near nodes, at least and at most.
const NEAR_RAYS: std::ops::RangeInclusive<u32> = 4..=16;

/// Share of a partly visible transfer that counts as error: shadows vary over the receiver, and neither node's
/// table knows how.
const PARTIAL_VISIBILITY: f32 = 0.5;

/// Part of a transfer that may get through although no sampled ray did: a few rays prove little. Smaller, and pairs that
/// were once found blocked stay so; larger, and refinement goes on behind walls.
const DOUBT: f32 = 0.1;

/// Of two nodes whose radii differ by less, the source is divided: rounding must not choose among equals.
const TIE: f32 = 0.999;

/// Normals agree when their vector sum is shorter than their total area by less than this.
const SAME_DIRECTION: f32 = 1e-6;

/// Links of some receivers, in the order of the walk.
#[derive(Clone, Debug, Default)]
pub struct Refinement {
    /// Receivers with their number of links.
    pub runs: Vec<(NodeId, u32)>,
    /// The links, run after run.
    pub links: Vec<Link>,
    /// Leaf elements that should be divided.
    pub wanted: Vec<u32>,
    /// Rays shot.
    pub ray_count: u64,
    /// Whether the links fit into the budget. If not, they are incomplete and must be thrown away; the same on any
    /// number of threads.
    pub fits: bool,
}

impl Refinement {
    fn append(&mut self, mut other: Self) {
        self.runs.append(&mut other.runs);
        self.links.append(&mut other.links);
        self.wanted.append(&mut other.wanted);
        self.ray_count += other.ray_count;
    }
}

/// What refinement needs to know.
pub struct Refiner<'a, F> {
    /// Judges pairs.
    pub judge: Judge<'a>,
    /// The links that a receiver has so far.
    pub links_of: F,
    /// Nodes that there were when these links were last judged by this threshold; `None` where that was another one. Links
    /// of which neither end was divided since stay as they are.
    pub judged: Option<usize>,
    /// Largest error of a link, times the root of the receiver's share of the area (luminance irradiance).
    pub threshold: f32,
    /// Elements below this area are not divided.
    pub min_area: f32,
    /// Seed of the rays.
    pub seed: u64,
    /// Tells to stop; the result is then incomplete and must be thrown away.
    pub cancelled: &'a (dyn Fn() -> bool + Sync),
    /// How many links there may be.
    pub budget: LinkBudget,
    /// Whether only elements are linked, no clusters.
    pub is_by_patch: bool,
    /// Whether nothing blocks and elements are divided where light is found to bend, not for their links.
    pub follows_light: bool,
    /// By how much the radiosity of each leaf varies over it (luminance); needed where `follows_light`.
    pub spreads: &'a [f32],
}

/// Counts links as they are made, on all threads.
#[derive(Debug)]
pub struct LinkBudget {
    made: AtomicU64,
    most: u64,
}

impl LinkBudget {
    /// So many links may be made.
    pub fn new(most: u64) -> Self {
        Self {
            made: AtomicU64::new(0),
            most,
        }
    }

    fn is_spent(&self) -> bool {
        self.made.load(Ordering::Relaxed) > self.most
    }
}

/// What becomes of a pair.
pub(super) enum Decision {
    Drop,
    Keep(Link),
    DivideSource,
    DivideReceiver,
}

impl<'a, F: Fn(NodeId) -> &'a [Link] + Sync> Refiner<'a, F> {
    /// Refine everything, from the root's exchange with itself where there are no links yet.
    pub fn refine(&self, is_first: bool) -> Refinement {
        let start = if is_first {
            vec![Hierarchy::ROOT]
        } else {
            Vec::new()
        };
        let mut refinement = self.visit(Hierarchy::ROOT, &start);
        if self.follows_light {
            // Sources are wanted by each of their receivers.
            refinement.wanted.sort_unstable();
            refinement.wanted.dedup();
        }
        Refinement {
            fits: !self.budget.is_spent(),
            ..refinement
        }
    }

    /// Whether the rest is not worth doing.
    fn is_stopped(&self) -> bool {
        (self.cancelled)() || self.budget.is_spent()
    }

    /// Whether nothing that decides about a link has changed since it was judged.
    fn is_settled(&self, source: NodeId, receiver: NodeId) -> bool {
        let hierarchy = self.hierarchy();
        // What a division makes comes after all that was there before.
        self.judged.is_some_and(|count| {
            [source, receiver]
                .iter()
                .all(|&node| hierarchy.children(node).end as usize <= count)
        })
    }

    pub(super) fn hierarchy(&self) -> &'a Hierarchy {
        self.judge.kernel.hierarchy
    }

    /// Refine a receiver and all below it; `sources` are handed down from above.
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

    /// As `visit`, within one task. Depth is bounded by that of the trees.
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

    /// Decide on the links of one receiver; sources for its children go to `down`.
    fn refine_links(
        &self,
        receiver: NodeId,
        sources: &[NodeId],
        out: &mut Refinement,
        down: &mut Vec<NodeId>,
    ) {
        let before = out.links.len();
        let mut is_wanted = false;
        let mut pending: Vec<NodeId> = Vec::new();
        for link in (self.links_of)(receiver) {
            if self.is_settled(link.source, receiver) {
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
        pending.extend(sources.iter().rev());
        while let Some(source) = pending.pop() {
            let made = (out.links.len() - before) as u64;
            if (self.cancelled)() || made > self.budget.most {
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
        let count = (out.links.len() - before) as u32;
        self.budget
            .made
            .fetch_add(u64::from(count), Ordering::Relaxed);
        if count > 0 {
            out.runs.push((receiver, count));
        }
        if let (true, Kind::Element(index)) = (is_wanted, self.hierarchy().kind(receiver)) {
            out.wanted.push(index as u32);
        }
    }

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
            Decision::DivideReceiver if source == receiver => {
                down.extend(self.hierarchy().children(receiver).map(NodeId));
            }
            Decision::DivideReceiver => {
                if self.hierarchy().children(receiver).is_empty() {
                    // The element will be divided after this pass, if there is room; until then its link stays.
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

    /// What becomes of a pair; `known` is its link if it has one.
    fn decide(
        &self,
        source: NodeId,
        receiver: NodeId,
        known: Option<&Link>,
        out: &mut Refinement,
    ) -> Decision {
        let weight = self.weight(receiver);
        if let Some(decision) = self.decide_by_plan(source, receiver, known, weight, out) {
            return decision;
        }
        if source == receiver {
            return self.decide_self(source, weight, known, out);
        }
        let mut random = self.random(source, receiver);
        let (irradiance, error, bound) = match self.judge.judge(source, receiver, &mut random) {
            Judgement::Nothing => return Decision::Drop,
            Judgement::Transfer {
                irradiance,
                error,
                bound,
            } => (irradiance, error, bound),
        };
        let fits = |error: f32| error * weight <= self.threshold;
        let divide = self.division(source, receiver);
        if let (false, Some(decision)) = (fits(error), divide) {
            return decision;
        }
        let link = match known {
            Some(link) => *link,
            None => {
                let ray_count = self.ray_count(irradiance * weight, MOST_RAYS);
                self.link(source, receiver, error, ray_count, out)
            }
        };
        if self.judge.is_too_near_for_tables(source, receiver) {
            // What few rays have seen must not decide: of pairs that see little, only those found blind would stay.
            return Decision::Keep(Link {
                error: bound,
                ..link
            });
        }
        let partial = 2.0 * (link.visibility * (1.0 - link.visibility)).max(0.0).sqrt();
        let error = error * link.visibility.max(DOUBT) + PARTIAL_VISIBILITY * irradiance * partial;
        if let (false, Some(decision)) = (fits(error), self.division(source, receiver)) {
            return decision;
        }
        // What gets through is known from a few rays: the bound of the transfer, and twice the deviation of a share that so
        // many rays found.
        let share =
            (link.visibility.min(1.0) * LEAST_RAYS as f32 + 1.0) / (LEAST_RAYS as f32 + 2.0);
        let deviation = (share * (1.0 - share) / LEAST_RAYS as f32).sqrt();
        Decision::Keep(Link {
            error: bound + 2.0 * deviation * irradiance,
            ..link
        })
    }

    fn decide_self(
        &self,
        cluster: NodeId,
        weight: f32,
        known: Option<&Link>,
        out: &mut Refinement,
    ) -> Decision {
        let judged = self.judge.judged_brightest(cluster);
        if judged <= 0.0 || self.faces_one_way(cluster) {
            return Decision::Drop;
        }
        // What few rays have seen must not decide: of clusters that see little of themselves, only those found blind would
        // stay.
        if judged * SELF_SHARE * weight > self.threshold {
            return Decision::DivideReceiver;
        }
        let fraction = match known {
            Some(link) => link.visibility,
            None => {
                out.ray_count += u64::from(SELF_RAYS);
                self.judge.sampler.seen_fraction(
                    cluster,
                    cluster,
                    SELF_RAYS,
                    &mut self.random(cluster, cluster),
                )
            }
        };
        Decision::Keep(Link {
            source: cluster,
            visibility: fraction,
            error: self.judge.brightest(cluster),
            form_factor: fraction,
        })
    }

    /// Whether all faces of a cluster look the same way: then none sees another.
    fn faces_one_way(&self, cluster: NodeId) -> bool {
        let Kind::Cluster(index) = self.hierarchy().kind(cluster) else {
            return true;
        };
        let moments = &self.judge.kernel.tables.clusters[index];
        let vector = Vec3::from_array(moments.linear.map(|along| along.w));
        vector.length() >= (1.0 - SAME_DIRECTION) * moments.total().w
    }

    /// Rays for a transfer, the more the more it matters.
    fn ray_count(&self, weighted: f32, most: u32) -> u32 {
        let importance = weighted / self.threshold.max(f32::MIN_POSITIVE);
        (importance.min(64.0).ceil() as u32).clamp(LEAST_RAYS, most)
    }

    /// Which node to divide: the larger that can be.
    fn division(&self, source: NodeId, receiver: NodeId) -> Option<Decision> {
        let hierarchy = self.hierarchy();
        let can_divide_source = !hierarchy.children(source).is_empty();
        let can_divide_receiver = match hierarchy.kind(receiver) {
            Kind::Cluster(_) => true,
            Kind::Element(index) => {
                let area = hierarchy.mesh.elements[index].area_vector.length();
                !hierarchy.mesh.elements[index].is_leaf() || area * 0.25 >= self.min_area
            }
        };
        let prefers_source = hierarchy.radius(source) >= TIE * hierarchy.radius(receiver);
        match (can_divide_source, can_divide_receiver) {
            (true, true) => Some(if prefers_source {
                Decision::DivideSource
            } else {
                Decision::DivideReceiver
            }),
            (true, false) => Some(Decision::DivideSource),
            (false, true) => Some(Decision::DivideReceiver),
            (false, false) => None,
        }
    }

    /// Root of the receiver's share of the area: error is summed in squares over area.
    fn weight(&self, receiver: NodeId) -> f32 {
        self.hierarchy().node_share_of_area(receiver).sqrt()
    }

    pub(super) fn random(&self, source: NodeId, receiver: NodeId) -> Random {
        Random::new(
            self.seed,
            (u64::from(receiver.0) << 32) | u64::from(source.0),
        )
    }

    fn link(
        &self,
        source: NodeId,
        receiver: NodeId,
        error: f32,
        ray_count: u32,
        out: &mut Refinement,
    ) -> Link {
        let mut random = self.random(source, receiver);
        let hierarchy = self.hierarchy();
        let sampler = self.judge.sampler;
        let (visibility, of_area) = if self.judge.is_too_near_for_tables(source, receiver) {
            let ray_count = (2 * ray_count).clamp(*NEAR_RAYS.start(), *NEAR_RAYS.end());
            out.ray_count += u64::from(ray_count);
            let seen = sampler.seen_fraction(source, receiver, ray_count, &mut random);
            let expected = self.judge.kernel.mean_form_factor(source, receiver);
            let correction = if expected > 0.0 {
                (seen / expected).min(MOST_CORRECTION)
            } else {
                0.0
            };
            (correction, correction)
        } else {
            out.ray_count += u64::from(ray_count);
            sampler.visibility(source, receiver, ray_count, &mut random)
        };
        let form_factor = match (hierarchy.kind(source), hierarchy.kind(receiver)) {
            (Kind::Element(from), Kind::Element(to)) => {
                visibility * area_form_factor(hierarchy, from, to)
            }
            _ => of_area,
        };
        Link {
            source,
            visibility,
            error,
            form_factor,
        }
    }
}

/// Form factor from one element to another, unoccluded, averaged over the receiver where they are near.
fn area_form_factor(hierarchy: &Hierarchy, source: usize, receiver: usize) -> f32 {
    let (from, to) = (
        &hierarchy.mesh.elements[source],
        &hierarchy.mesh.elements[receiver],
    );
    let normal = hierarchy.patch_of(receiver).normal;
    let distance = from.centroid.distance(to.centroid);
    if distance > 2.0 * (from.radius + to.radius) {
        return element_form_factor(hierarchy, source, to.centroid, normal);
    }
    let points = inner_points(hierarchy.mesh.corners(receiver));
    let normals = Vectors4::splat(normal);
    element_form_factors(hierarchy, source, &points, &normals).element_sum() * 0.25
}
