//! Input and output of refinement.

use std::sync::atomic::{AtomicU64, Ordering};

use super::{Judge, Link};
use crate::{
    geometry::Random,
    hierarchy::{Hierarchy, NodeId},
};

/// Links of a subtree of receivers, in the order of the walk.
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
    /// Whether the links fit into the budget, the same on any number of threads. If not, they are incomplete and must
    /// be discarded.
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

/// Input of refinement.
pub struct Refiner<'a, F> {
    /// Judges pairs.
    pub judge: Judge<'a>,
    /// The present links of a receiver.
    pub links_of: F,
    /// Number of nodes when these links were last judged by this threshold; `None` if they were judged by another one.
    /// Links neither of whose nodes was divided since stay as they are.
    pub judged: Option<usize>,
    /// Largest error of a link, times the square root of the receiver's share of the area (luminance of the
    /// irradiance).
    pub threshold: f32,
    /// Children of elements are not smaller than this, square frame units.
    pub min_area: f32,
    /// Seed of the rays.
    pub seed: u64,
    /// Whether to stop; the result is then incomplete and must be discarded.
    pub cancelled: &'a (dyn Fn() -> bool + Sync),
    /// Limit of the number of links.
    pub budget: LinkBudget,
    /// Whether only elements are linked, no clusters.
    pub is_by_patch: bool,
    /// Whether nothing occludes and elements are divided by interpolation errors instead of errors of links.
    pub follows_light: bool,
    /// By element, the variation of the radiosity of a leaf (luminance); needed where `follows_light`.
    pub spreads: &'a [f32],
}

/// Counts links as they are made, on all threads.
#[derive(Debug)]
pub struct LinkBudget {
    made: AtomicU64,
    most: u64,
}

impl LinkBudget {
    /// A budget of `most` links.
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

    /// Most links that may be made in all.
    pub(super) fn most(&self) -> u64 {
        self.most
    }

    /// Whether more links were made than the budget allows.
    pub(super) fn is_spent(&self) -> bool {
        self.made.load(Ordering::Relaxed) > self.most
    }
}

/// The decision on a pair.
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
        let image = self.judge.kernel.image;
        Random::new(
            self.seed
                .wrapping_add(image.map_or(0, |image| u64::from(image.index()) + 1)),
            (u64::from(receiver.0) << 32) | u64::from(source.0),
        )
    }
}
