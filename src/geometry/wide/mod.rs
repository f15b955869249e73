//! The tree that rays go down: eight boxes a node, four triangles a leaf, each tested at once.
//!
//! A node is met where the ray's way through its box, widened by what rounding can hide, is not empty; a triangle where
//! the ray passes its three edges on one side. Of two triangles with an edge in common both test it by the same numbers,
//! so nothing slips between them (Woop, Benthin & Wald 2013). Its distance is that of its plane, in double precision, kept
//! within the ray's way through its own box: so every box about it is met before it is, and what is found is what a test
//! of all triangles would find.

mod bounds;
mod build;
mod four;
mod node;
mod ray;
mod stack;
#[cfg(test)]
mod tests;

use glam::Vec3;

use four::FourTriangles;
use node::{Child, Node};
pub(super) use ray::Ray;
use stack::{Entry, Stack};

/// A triangle on the way of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Met {
    /// Its number.
    pub triangle: u32,
    /// Distance in lengths of the ray's direction.
    pub distance: f32,
    /// Whether its back is met.
    pub is_back: bool,
}

/// The part of a ray that counts, and what does not count on it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reach {
    /// Distance from which triangles are met, at least 0.
    pub from: f32,
    /// Distance up to which they are.
    pub until: f32,
    /// Numbers of triangles that are passed over.
    pub except: [u32; 2],
}

/// A tree over numbered triangles.
pub(super) struct Tree {
    root: Child,
    nodes: Vec<Node>,
    leaves: Vec<FourTriangles>,
}

impl Tree {
    /// The tree over triangles; each has its place in the list as its number. At most 2³¹ of them.
    pub(super) fn new(triangles: &[[Vec3; 3]]) -> Self {
        build::tree(triangles)
    }

    /// Whether there are no triangles.
    pub(super) fn is_empty(&self) -> bool {
        self.leaves.is_empty()
    }

    /// Bytes in use.
    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.leaves.as_slice())
    }

    /// Calls `on_met` with the triangles on a ray in no order that means anything, but always the same, until it returns
    /// false; says whether it never did. A ray that is not finite meets nothing.
    #[inline]
    pub(super) fn each(
        &self,
        ray: &Ray,
        reach: Reach,
        mut on_met: impl FnMut(Met) -> bool,
    ) -> bool {
        let until = reach.until;
        self.descend::<false>(ray, reach, |met| on_met(met).then_some(until))
    }

    /// Calls `on_met` with the triangles on a ray, near ones first as far as their boxes tell. It returns the distance
    /// up to which triangles still count, at most the last one.
    #[inline]
    pub(super) fn nearest_first(
        &self,
        ray: &Ray,
        reach: Reach,
        mut on_met: impl FnMut(Met) -> f32,
    ) {
        self.descend::<true>(ray, reach, |met| Some(on_met(met)));
    }

    /// The descent of both; `on_met` returns the distance up to which triangles still count, or `None` to end it.
    #[inline]
    fn descend<const NEAREST_FIRST: bool>(
        &self,
        ray: &Ray,
        mut reach: Reach,
        mut on_met: impl FnMut(Met) -> Option<f32>,
    ) -> bool {
        // What is not a number would be within every box.
        if !ray.is_finite() {
            return true;
        }
        let mut stack = Stack::new();
        let mut current = self.root;
        loop {
            if let Some(leaf) = current.leaf() {
                let four = &self.leaves[leaf];
                let mut lanes = four.lanes_met(ray);
                while let Some(lane) = take_lowest(&mut lanes) {
                    let triangle = four.number(lane);
                    if reach.except.contains(&triangle) {
                        continue;
                    }
                    let (distance, is_back) = four.met(lane, ray);
                    if distance >= reach.from && distance <= reach.until {
                        let met = Met {
                            triangle,
                            distance,
                            is_back,
                        };
                        match on_met(met) {
                            Some(until) => reach.until = until,
                            None => return false,
                        }
                    }
                }
            } else {
                let node = &self.nodes[current.node()];
                let (near, mut children) = node.children_met(ray, &reach);
                if let Some(first) = take_lowest(&mut children) {
                    current = node.child(first);
                    if children == 0 {
                        continue;
                    }
                    if NEAREST_FIRST {
                        let near = [near[0].to_array(), near[1].to_array()];
                        let near = |slot: usize| near[slot / 4 % 2][slot % 4];
                        let mut nearest = Entry::new(near(first), current);
                        let before = stack.len();
                        while let Some(slot) = take_lowest(&mut children) {
                            let mut entry = Entry::new(near(slot), node.child(slot));
                            if entry.near < nearest.near {
                                std::mem::swap(&mut entry, &mut nearest);
                            }
                            stack.push(entry);
                        }
                        stack.sort_from(before);
                        current = nearest.child;
                    } else {
                        while let Some(slot) = take_lowest(&mut children) {
                            stack.push(Entry::new(0.0, current));
                            current = node.child(slot);
                        }
                    }
                    continue;
                }
            }
            loop {
                let Some(entry) = stack.pop() else {
                    return true;
                };
                if entry.near <= reach.until {
                    current = entry.child;
                    break;
                }
            }
        }
    }
}

/// Place of the lowest bit that is set, which is cleared.
#[inline]
fn take_lowest(bits: &mut u32) -> Option<usize> {
    let lowest = bits.trailing_zeros() as usize;
    *bits &= bits.checked_sub(1)?;
    Some(lowest)
}
