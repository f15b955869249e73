//! Which elements lie at an edge between two points, and tables by such edges.

use std::{
    collections::HashMap,
    hash::{BuildHasherDefault, Hasher},
};

/// Two points or vertices, the lesser first.
pub(super) type Edge = (u32, u32);

/// A table by edges.
pub(super) type EdgeMap<T> = HashMap<Edge, T, BuildHasherDefault<EdgeHasher>>;

/// Hashes pairs of small numbers several times faster than the standard hasher, and alike in every run.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct EdgeHasher(u64);

/// The golden ratio in 64 bits: odd, and its bits follow no pattern.
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

impl Hasher for EdgeHasher {
    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = self.0.rotate_left(8) ^ u64::from(byte);
        }
    }

    fn write_u32(&mut self, number: u32) {
        self.0 = self.0.rotate_left(32) ^ u64::from(number);
    }

    fn finish(&self) -> u64 {
        // Both halves of the product, so that every bit of the numbers reaches the lowest and the highest bits.
        let product = u128::from(self.0 ^ GOLDEN) * u128::from(GOLDEN);
        product as u64 ^ (product >> 64) as u64
    }
}

/// Stands for no further place in a list.
const END: u32 = u32::MAX;

/// The elements at each edge: patches in lists that are sorted once, since there may be millions of which few are
/// divided, and their parts in lists that grow.
#[derive(Default)]
pub(super) struct EdgeLeaves {
    /// Where the edges with each lesser point begin in [`Self::of_patches`], and where the last ones end.
    starts: Vec<u32>,
    /// The greater point of each edge of a patch, and the patch.
    of_patches: Vec<(u32, u32)>,
    /// First and last place of the list of each edge in [`Self::next`].
    lists: EdgeMap<[u32; 2]>,
    /// The element of each place and the next place: three for each element that was added.
    next: Vec<(u32, u32)>,
}

impl EdgeLeaves {
    /// The edges of patches, by the number of the patch.
    pub(super) fn new(patches: impl Iterator<Item = (u32, [Edge; 3])> + Clone) -> Self {
        let edges = patches.flat_map(|(patch, edges)| edges.map(|edge| (edge, patch)));
        let last = edges.clone().map(|((lesser, _), _)| lesser).max();
        let mut starts = vec![0; last.map_or(1, |last| last as usize + 2)];
        edges.clone().for_each(|((lesser, _), _)| {
            starts[lesser as usize + 1] += 1;
        });
        let mut sum = 0;
        for start in &mut starts {
            sum += *start;
            *start = sum;
        }
        let mut of_patches = vec![(0, 0); sum as usize];
        let mut free = starts.clone();
        edges.for_each(|((lesser, greater), patch)| {
            let place = &mut free[lesser as usize];
            of_patches[*place as usize] = (greater, patch);
            *place += 1;
        });
        Self {
            starts,
            of_patches,
            ..Self::default()
        }
    }

    /// Add an element.
    pub(super) fn push(&mut self, element: u32, edges: [Edge; 3]) {
        for edge in edges {
            let place = self.next.len() as u32;
            self.next.push((element, END));
            let [_, last] = self.lists.entry(edge).or_insert([place, END]);
            let before = std::mem::replace(last, place);
            if before != END {
                self.next[before as usize].1 = place;
            }
        }
    }

    /// The elements that were added with an edge, in the order in which they were. They may be divided by now.
    pub(super) fn at(&self, edge: Edge) -> impl Iterator<Item = u32> + '_ {
        let bound = |point: usize| self.starts.get(point).map(|&start| start as usize);
        let (lesser, greater) = (edge.0 as usize, edge.1);
        let range = bound(lesser).zip(bound(lesser + 1));
        let patches = range.map_or(&[][..], |(start, end)| &self.of_patches[start..end]);
        let patches = patches.iter().filter(move |patch| patch.0 == greater);
        let first = self.lists.get(&edge).map_or(END, |&[first, _]| first);
        let places = std::iter::successors(self.next.get(first as usize), |&&(_, next)| {
            self.next.get(next as usize)
        });
        patches
            .map(|&(_, patch)| patch)
            .chain(places.map(|&(element, _)| element))
    }

    /// Bytes in use.
    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(self.starts.as_slice())
            + size_of_val(self.of_patches.as_slice())
            + size_of_val(self.next.as_slice())
            + size_of::<(Edge, [u32; 2])>() * self.lists.capacity()
    }
}

#[cfg(test)]
mod tests {
    use std::hash::BuildHasher as _;

    use super::*;

    #[test]
    fn elements_at_an_edge_come_in_the_order_in_which_they_were_added() {
        let edges = |[a, b, c]: [u32; 3]| {
            [(a, b), (b, c), (c, a)].map(|(from, to)| (from.min(to), from.max(to)))
        };
        let patches = [[0, 1, 2], [2, 1, 3], [1, 3, 0]];
        let numbered = patches.iter().zip(0..);
        let mut leaves = EdgeLeaves::new(numbered.map(|(&corners, patch)| (patch, edges(corners))));
        for (element, corners) in [(3, [0, 1, 4]), (4, [4, 1, 2]), (5, [1, 0, 5])] {
            leaves.push(element, edges(corners));
        }
        let at = |a, b| leaves.at((a, b)).collect::<Vec<_>>();
        assert_eq!(at(0, 1), [0, 2, 3, 5]);
        assert_eq!(at(1, 2), [0, 1, 4]);
        assert_eq!(at(1, 4), [3, 4]);
        assert_eq!(at(0, 5), [5]);
        assert!(at(2, 4) == [4] && at(3, 9).is_empty() && at(8, 9).is_empty());
        assert!(EdgeLeaves::default().at((0, 1)).next().is_none());
    }

    #[test]
    fn edges_of_a_grid_spread_over_all_slots_of_a_table() {
        let hasher = BuildHasherDefault::<EdgeHasher>::default();
        const SLOTS: usize = 1 << 12;
        for bit in [0, 64 - 12] {
            let mut counts = vec![0_u32; SLOTS];
            for point in 0..8 * SLOTS as u32 {
                for step in [1, 100] {
                    let hash = hasher.hash_one((point, point + step));
                    counts[(hash >> bit) as usize % SLOTS] += 1;
                }
            }
            // 16 on average; at random, 41 or more come once in 30,000 tables.
            assert!(counts.iter().all(|&count| count < 41), "{bit}");
        }
    }
}
