//! Sides of triangles, and what hangs together.

use rayon::prelude::*;

/// One side of a triangle. In order, sides between the same points follow each other, those that run down first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct HalfEdge {
    /// Its ends, the lesser first.
    pub ends: [u32; 2],
    /// Whether the triangle has its ends in this order.
    pub is_forward: bool,
    /// The triangle, by its place in the list.
    pub triangle: u32,
    /// Which of its sides; side 0 begins at its first corner.
    pub side: u8,
}

/// The sides of triangles given by the points of their corners, sorted.
pub fn half_edges(triangles: impl Iterator<Item = [u32; 3]> + Clone) -> Vec<HalfEdge> {
    let edges = triangles.enumerate().flat_map(|(triangle, [a, b, c])| {
        [(0, a, b), (1, b, c), (2, c, a)].map(|(side, from, to)| HalfEdge {
            ends: [from.min(to), from.max(to)],
            is_forward: from < to,
            triangle: triangle as u32,
            side,
        })
    });
    sorted_by(edges, |edge| edge.ends[0])
}

/// Sort items whose order begins with a number: each goes among those of its number, and those are sorted. Takes memory
/// for the largest number.
pub(super) fn sorted_by<T: Copy + Ord + Send + Sync>(
    items: impl Iterator<Item = T> + Clone,
    number: impl Fn(&T) -> u32 + Sync,
) -> Vec<T> {
    let Some(first) = items.clone().next() else {
        return Vec::new();
    };
    let last = items.clone().map(|item| number(&item)).max();
    // Where the items of each number begin.
    let mut starts = vec![0; last.map_or(0, |last| last as usize + 2)];
    items.clone().for_each(|item| {
        starts[number(&item) as usize + 1] += 1;
    });
    let mut sum = 0;
    for start in &mut starts {
        sum += *start;
        *start = sum;
    }
    let mut sorted = vec![first; sum];
    items.for_each(|item| {
        let start = &mut starts[number(&item) as usize];
        sorted[*start] = item;
        *start += 1;
    });
    sorted
        .par_chunk_by_mut(|a, b| number(a) == number(b))
        .for_each(<[T]>::sort_unstable);
    sorted
}

/// Disjoint sets with path halving.
#[derive(Clone, Debug)]
pub struct DisjointSets {
    parents: Vec<u32>,
}

impl DisjointSets {
    /// As many items, each by itself.
    pub fn new(count: usize) -> Self {
        Self {
            parents: (0..count as u32).collect(),
        }
    }

    /// The item that stands for the set of an item: the smallest of it.
    pub fn root(&mut self, mut item: u32) -> u32 {
        while self.parents[item as usize] != item {
            let above = self.parents[self.parents[item as usize] as usize];
            self.parents[item as usize] = above;
            item = above;
        }
        item
    }

    /// Make one set of those of two items.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parents[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_between_the_same_points_follow_each_other() {
        let edges = half_edges([[0, 1, 2], [2, 1, 3]].into_iter());
        assert_eq!(edges.len(), 6);
        let shared: Vec<&HalfEdge> = edges.iter().filter(|edge| edge.ends == [1, 2]).collect();
        let found = shared
            .iter()
            .map(|edge| (edge.is_forward, edge.triangle, edge.side));
        assert_eq!(found.collect::<Vec<_>>(), [(false, 1, 0), (true, 0, 1)]);
        assert!(edges.is_sorted());
    }

    #[test]
    fn items_are_sorted_whatever_their_numbers() {
        for count in [0, 1, 2, 50, 3000] {
            // Some numbers have none, some have many.
            let items = (0..count).map(|i: u32| (i * 7919 % 101 / 3, i * 31 % 17, i));
            let mut expected: Vec<_> = items.clone().collect();
            expected.sort_unstable();
            assert_eq!(sorted_by(items, |item| item.0), expected, "{count}");
        }
    }

    #[test]
    fn the_smallest_item_stands_for_its_set() {
        let mut sets = DisjointSets::new(6);
        for (a, b) in [(5, 3), (4, 5), (1, 2)] {
            sets.join(a, b);
        }
        let roots: Vec<u32> = (0..6).map(|item| sets.root(item)).collect();
        assert_eq!(roots, [0, 1, 1, 3, 3, 3]);
    }
}
