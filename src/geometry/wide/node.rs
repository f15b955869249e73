//! A node of the tree: the boxes of its children, and where they are.

use glam::Vec4;

use super::{Reach, bounds::Bounds, ray::Ray};

/// Children of a node at most.
pub(super) const WIDTH: usize = 8;

/// A node, or the leaf of this number with the highest bit set.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Child(u32);

impl Child {
    const LEAF: u32 = 1 << 31;

    pub(super) fn new_node(index: usize) -> Self {
        Self(index as u32)
    }

    pub(super) fn new_leaf(index: usize) -> Self {
        Self(index as u32 | Self::LEAF)
    }

    /// The number of the leaf, if it is one.
    #[inline]
    pub(super) fn leaf(self) -> Option<usize> {
        (self.0 & Self::LEAF != 0).then_some((self.0 & !Self::LEAF) as usize)
    }

    /// The number of the node that is no leaf.
    #[inline]
    pub(super) fn node(self) -> usize {
        self.0 as usize
    }
}

/// Up to eight children. Starts on a line of the cache.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub(super) struct Node {
    /// Lower and upper coordinates of the boxes, by axis, by side, four at a time. Nothing meets those of empty slots.
    sides: [[[Vec4; 2]; 2]; 3],
    children: [Child; WIDTH],
}

impl Node {
    /// A node without children.
    pub(super) fn empty() -> Self {
        Self {
            sides: [[[Vec4::INFINITY; 2], [Vec4::NEG_INFINITY; 2]]; 3],
            children: [Child::default(); WIDTH],
        }
    }

    pub(super) fn set_bounds(&mut self, slot: usize, bounds: &Bounds) {
        for (axis, [low, high]) in self.sides.iter_mut().enumerate() {
            low[slot / 4][slot % 4] = bounds.low[axis];
            high[slot / 4][slot % 4] = bounds.high[axis];
        }
    }

    pub(super) fn set_child(&mut self, slot: usize, child: Child) {
        self.children[slot] = child;
    }

    #[inline]
    pub(super) fn child(&self, slot: usize) -> Child {
        self.children[slot % WIDTH]
    }

    /// The distances at which the ray enters the boxes, and a bit for each box that it meets.
    #[inline]
    pub(super) fn children_met(&self, ray: &Ray, reach: &Reach) -> ([Vec4; 2], u32) {
        let four = |half: usize| {
            let near = |axis: usize| {
                let side = ray.near_side[axis] % 2;
                ray.near.distances(axis, self.sides[axis][side][half])
            };
            let far = |axis: usize| {
                let side = (ray.near_side[axis] + 1) % 2;
                ray.far.distances(axis, self.sides[axis][side][half])
            };
            let near = near(0)
                .max(near(1))
                .max(near(2).max(Vec4::splat(reach.from)));
            let far = far(0).min(far(1)).min(far(2).min(Vec4::splat(reach.until)));
            (near, near.cmple(far).bitmask())
        };
        let (first, second) = (four(0), four(1));
        ([first.0, second.0], first.1 | second.1 << 4)
    }
}
