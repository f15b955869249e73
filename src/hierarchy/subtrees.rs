//! Subtrees: parts of the cluster tree that can be worked on at the same time.
//!
//! The tree is built depth first, so that all clusters below one are a run of the list. A few runs and the clusters above
//! them cover the tree: results do not depend on which thread takes which run.

use std::ops::Range;

use super::Cluster;

/// Patches of a subtree at most. Fewer, and the clusters above, which one thread walks, grow many; more, and there is
/// nothing to share out.
const SUBTREE_PATCHES: u32 = 4096;

/// A cover of the cluster tree.
#[derive(Clone, Debug, Default)]
pub struct Subtrees {
    /// Runs of clusters, each below one cluster that is not part of it; in order.
    pub runs: Vec<Range<usize>>,
    /// The clusters that are in no run; in order, the root first.
    pub top: Vec<usize>,
}

impl Subtrees {
    /// The cover of a tree.
    pub(super) fn new(clusters: &[Cluster]) -> Self {
        let mut cover = Self::default();
        let mut index = 0;
        while index < clusters.len() {
            cover.top.push(index);
            index += 1;
            // Children follow in pairs; below the second of a pair of small ones, both runs follow.
            if !is_second(clusters, index - 1) {
                continue;
            }
            for sibling in [index - 2, index - 1] {
                if clusters[sibling].is_leaf() || !is_small(&clusters[sibling]) {
                    continue;
                }
                let run = clusters[sibling].first_child as usize..end_below(clusters, sibling);
                if run.start != index {
                    continue;
                }
                index = run.end;
                cover.runs.push(run);
            }
        }
        cover
    }

    /// The parts of a table over all clusters that belong to the runs.
    pub fn parts<'a, T>(&self, table: &'a mut [T]) -> Vec<&'a mut [T]> {
        let mut parts = Vec::with_capacity(self.runs.len());
        let (mut rest, mut offset) = (table, 0);
        for run in &self.runs {
            let (_, from_start) = rest.split_at_mut(run.start - offset);
            let (part, after) = from_start.split_at_mut(run.len());
            parts.push(part);
            (rest, offset) = (after, run.end);
        }
        parts
    }
}

fn is_small(cluster: &Cluster) -> bool {
    cluster.end - cluster.start <= SUBTREE_PATCHES
}

fn is_second(clusters: &[Cluster], index: usize) -> bool {
    clusters
        .get(clusters[index].parent as usize)
        .is_some_and(|parent| parent.first_child as usize + 1 == index)
}

/// One past the last cluster below one.
fn end_below(clusters: &[Cluster], mut at: usize) -> usize {
    let mut end = at + 1;
    while !clusters[at].is_leaf() {
        let first = clusters[at].first_child as usize;
        end = first + 2;
        // The nodes below the second child come last.
        at = if clusters[first + 1].is_leaf() {
            first
        } else {
            first + 1
        };
    }
    end
}
