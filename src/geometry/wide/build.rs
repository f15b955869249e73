//! Builds the tree: obvhs pairs boxes into a binary tree, and its nodes are gathered into wide ones at the least cost.
//!
//! The expected cost of a ray is the sum over nodes and leaves of the area of their boxes, times what a test costs (the
//! surface area heuristic). The least is found from the leaves up, as Ylitie, Karras & Laine (2017, §3.2) do for
//! compressed trees: for each binary node, the least cost in at most so many slots of a wide one.

use glam::Vec3;
use obvhs::{
    BvhBuildParams,
    aabb::Aabb,
    bvh2::{Bvh2, reinsertion::ReinsertionOptimizer},
    ploc::PlocBuilder,
};

use super::{
    Tree,
    bounds::Bounds,
    four::{FourTriangles, LANES},
    node::{Child, Node, WIDTH},
};

/// How the binary tree is built. The search for the best partner of a box must begin with the leaves: where the first
/// levels take neighbours along a curve through space instead, as the usual settings have it, large walls share nodes with
/// fine bodies, and rays through rooms take three to six times as long. Much more reinsertion and wider searches take
/// several times as long to build, and rays gain a tenth at most.
const BUILD: BvhBuildParams = BvhBuildParams {
    search_depth_threshold: 0,
    ..BvhBuildParams::medium_build()
};

/// What a test of the boxes of a node costs, in tests of a leaf: it is of eight boxes, that of a leaf of four triangles.
/// Smaller, and scenes of crossing triangles take a tenth more memory; rays hardly notice.
const NODE_COST: f32 = 2.0;

/// How the binary tree below a node is divided among slots of a wide node.
#[derive(Clone, Copy, Default)]
struct Plan {
    /// Of so many slots and one, how many the first child gets; 0 where one slot fewer is as good. Of the first entry:
    /// how many of all of a node of its own; 0 where it is a leaf.
    firsts: [u8; WIDTH],
}

/// The least costs of what is below a binary node.
#[derive(Clone, Copy)]
struct Least {
    /// In at most so many slots and one.
    costs: [f32; WIDTH],
    triangles: usize,
}

/// See [`Tree::new`].
pub(super) fn tree(triangles: &[[Vec3; 3]]) -> Tree {
    let mut wide = Tree {
        root: Child::new_node(0),
        nodes: Vec::new(),
        leaves: Vec::new(),
    };
    if triangles.is_empty() {
        wide.nodes.push(Node::empty());
        return wide;
    }
    let binary = binary_tree(triangles);
    let plans = plans(&binary);
    // What becomes of a binary node is noted in the slot that waits for it.
    let mut pending: Vec<(u32, Option<(usize, usize)>)> = vec![(0, None)];
    while let Some((index, waiting)) = pending.pop() {
        let child = if plans[index as usize].firsts[0] == 0 {
            wide.leaves.push(leaf(triangles, &binary, index));
            Child::new_leaf(wide.leaves.len() - 1)
        } else {
            let at = wide.nodes.len();
            let mut node = Node::empty();
            for (slot, below) in slots(&binary, &plans, index).into_iter().enumerate() {
                let bounds = binary.nodes[below as usize].aabb();
                let (low, high) = (bounds.min.into(), bounds.max.into());
                node.set_bounds(slot, &Bounds { low, high });
                pending.push((below, Some((at, slot))));
            }
            wide.nodes.push(node);
            Child::new_node(at)
        };
        match waiting {
            Some((node, slot)) => wide.nodes[node].set_child(slot, child),
            None => wide.root = child,
        }
    }
    wide.nodes.shrink_to_fit();
    wide.leaves.shrink_to_fit();
    wide
}

/// One triangle a leaf.
fn binary_tree(triangles: &[[Vec3; 3]]) -> Bvh2 {
    let boxes: Vec<Aabb> = triangles
        .iter()
        .map(|&corners| {
            let bounds = Bounds::of(corners);
            Aabb::new(bounds.low.into(), bounds.high.into())
        })
        .collect();
    let mut tree = PlocBuilder::with_capacity(boxes.len()).build(
        BUILD.ploc_search_distance,
        &boxes,
        (0..boxes.len() as u32).collect(),
        BUILD.sort_precision,
        BUILD.search_depth_threshold,
    );
    ReinsertionOptimizer::default().run(&mut tree, BUILD.reinsertion_batch_ratio, None);
    tree
}

/// The plan of each binary node.
fn plans(binary: &Bvh2) -> Vec<Plan> {
    // Parents before children, second children first: backwards, the results of both children lie on a stack.
    let mut order = Vec::with_capacity(binary.nodes.len());
    let mut pending = vec![0];
    while let Some(index) = pending.pop() {
        order.push(index);
        let node = &binary.nodes[index as usize];
        if !node.is_leaf() {
            pending.extend([node.first_index, node.first_index + 1]);
        }
    }
    let mut plans = vec![Plan::default(); binary.nodes.len()];
    let mut done: Vec<Least> = Vec::new();
    for &index in order.iter().rev() {
        let node = &binary.nodes[index as usize];
        let area = node.aabb().half_area();
        let least = if !node.is_leaf()
            && let (Some(second), Some(first)) = (done.pop(), done.pop())
        {
            let (plan, least) = planned(area, &first, &second);
            plans[index as usize] = plan;
            least
        } else {
            Least {
                costs: [area; WIDTH],
                triangles: node.prim_count as usize,
            }
        };
        done.push(least);
    }
    plans
}

/// The plan of a binary node with a box of so large an area, and its costs, from those of its children.
fn planned(area: f32, first: &Least, second: &Least) -> (Plan, Least) {
    let mut plan = Plan::default();
    let mut costs = [f32::MAX; WIDTH];
    let choices = costs.iter_mut().zip(&mut plan.firsts);
    for (slots, (least, firsts)) in choices.enumerate().skip(1) {
        for of_first in 0..slots {
            let cost = first.costs[of_first] + second.costs[slots - 1 - of_first];
            if cost < *least {
                *least = cost;
                *firsts = of_first as u8 + 1;
            }
        }
    }
    let triangles = first.triangles + second.triangles;
    let as_node = area * NODE_COST + costs[WIDTH - 1];
    if triangles <= LANES && area <= as_node {
        costs[0] = area;
    } else {
        costs[0] = as_node;
        plan.firsts[0] = plan.firsts[WIDTH - 1];
    }
    for slots in 1..WIDTH {
        if costs[slots - 1] <= costs[slots] {
            costs[slots] = costs[slots - 1];
            plan.firsts[slots] = 0;
        }
    }
    (plan, Least { costs, triangles })
}

/// The binary nodes that become the children of one.
fn slots(binary: &Bvh2, plans: &[Plan], index: u32) -> Vec<u32> {
    let mut slots = Vec::with_capacity(WIDTH);
    // The first entry of the plan tells how the node itself is divided, the others how it would be within another.
    let mut pending = vec![(index, WIDTH, plans[index as usize].firsts[0])];
    while let Some((index, count, of_first)) = pending.pop() {
        let first = binary.nodes[index as usize].first_index;
        let of_first = of_first as usize;
        for (child, mut count) in [(first + 1, count - of_first), (first, of_first)] {
            let firsts = &plans[child as usize].firsts;
            while count > 1 && firsts[count - 1] == 0 {
                count -= 1;
            }
            if count == 1 {
                slots.push(child);
            } else {
                pending.push((child, count, firsts[count - 1]));
            }
        }
    }
    slots
}

/// The leaf of all triangles below a binary node.
fn leaf(triangles: &[[Vec3; 3]], binary: &Bvh2, index: u32) -> FourTriangles {
    let mut four = FourTriangles::empty();
    let mut pending = vec![index];
    let mut lane = 0;
    while let Some(index) = pending.pop() {
        let node = &binary.nodes[index as usize];
        if !node.is_leaf() {
            pending.extend([node.first_index + 1, node.first_index]);
            continue;
        }
        for place in node.first_index..node.first_index + node.prim_count {
            let number = binary.primitive_indices[place as usize];
            four.set(lane, number, triangles[number as usize]);
            lane += 1;
        }
    }
    four
}
