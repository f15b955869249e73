//! What refinement goes by and what it makes.

use std::sync::atomic::{AtomicU64, Ordering};

use super::{Judge, Link};
use crate::{
    geometry::Random,
    hierarchy::{Hierarchy, NodeId},
};

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
    pub(super) fn append(&mut self, mut other: Self) {
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

    /// Count links.
    pub(super) fn count(&self, made: u64) {
        self.made.fetch_add(made, Ordering::Relaxed);
    }

    /// Links that may be made in all.
    pub(super) fn most(&self) -> u64 {
        self.most
    }

    /// Whether more were made.
    pub(super) fn is_spent(&self) -> bool {
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

impl<'a, F> Refiner<'a, F> {
    pub(super) fn hierarchy(&self) -> &'a Hierarchy {
        self.judge.kernel.hierarchy
    }

    pub(super) fn random(&self, source: NodeId, receiver: NodeId) -> Random {
        Random::new(
            self.seed,
            (u64::from(receiver.0) << 32) | u64::from(source.0),
        )
    }
}
