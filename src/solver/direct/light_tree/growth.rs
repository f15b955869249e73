//! Construction of the tree over emitters: top-down splits by position or by normal, whole panels first.

use glam::{DVec3, Vec3};

use super::{LEAF_EMITTERS, NONE, Node};
use crate::{
    hierarchy::MEDIAN_DEPTH,
    solver::direct::{emitter::Emitter, multipole::Extent, panel::Panel},
};

/// Weight of the variance of normals relative to that of positions. Larger, and lamps far from each other stay
/// together; smaller, and both sides of a sheet do.
const NORMAL_WEIGHT: f64 = 0.9;

/// An emitter or a panel that is put into the tree.
#[derive(Clone, Copy)]
struct Item {
    place: Vec3,
    normal: Vec3,
    index: usize,
}

/// A tree under construction.
pub(super) struct Growth<'a> {
    emitters: &'a [Emitter],
    panels: &'a [Panel],
    /// Emitters and panels so far, in the order of the tree.
    pub(super) order: Vec<usize>,
    pub(super) panel_order: Vec<usize>,
    pub(super) nodes: Vec<Node>,
}

impl<'a> Growth<'a> {
    /// The tree over emitters; those of each panel must be consecutive.
    pub(super) fn over(emitters: &'a [Emitter], panels: &'a [Panel]) -> Self {
        let mut growth = Self {
            emitters,
            panels,
            order: Vec::with_capacity(emitters.len()),
            panel_order: Vec::with_capacity(panels.len()),
            nodes: Vec::new(),
        };
        let mut items: Vec<Item> = (0..panels.len())
            .map(|index| Item {
                place: panels[index].centre,
                normal: panels[index].normal,
                index,
            })
            .collect();
        if !items.is_empty() {
            growth.panels_below(&mut items, 0);
        }
        growth
    }

    /// Add a subtree over some panels.
    fn panels_below(&mut self, items: &mut [Item], depth: u32) {
        if let [panel] = items {
            self.panel_order.push(panel.index);
            let emitters = self.panels[panel.index].emitters.clone();
            let mut items: Vec<Item> = emitters
                .map(|index| Item {
                    place: self.emitters[index].corners.iter().sum::<Vec3>() / 3.0,
                    normal: self.emitters[index].normal,
                    index,
                })
                .collect();
            let panel = match items.len() {
                1 => NONE,
                _ => self.panel_order.len() as u32 - 1,
            };
            self.emitters_below(&mut items, panel, depth);
            return;
        }
        let is_single = |item: &Item| self.panels[item.index].emitters.len() == 1;
        let is_leaf = items.len() <= LEAF_EMITTERS && items.iter().all(is_single);
        let index = self.begin();
        if is_leaf {
            for item in items {
                self.panel_order.push(item.index);
                self.order.push(self.panels[item.index].emitters.start);
            }
        } else {
            let cut = split(items, depth);
            let (first, second) = items.split_at_mut(cut);
            self.panels_below(first, depth + 1);
            self.panels_below(second, depth + 1);
        }
        self.end(index, NONE, false);
    }

    /// Add a subtree over emitters of one panel; `panel` is its number if they are all of them.
    fn emitters_below(&mut self, items: &mut [Item], panel: u32, depth: u32) {
        let index = self.begin();
        if items.len() <= LEAF_EMITTERS {
            self.order.extend(items.iter().map(|item| item.index));
        } else {
            let cut = split(items, depth);
            let (first, second) = items.split_at_mut(cut);
            self.emitters_below(first, NONE, depth + 1);
            self.emitters_below(second, NONE, depth + 1);
        }
        self.end(index, panel, true);
    }

    /// Add a node before its children. Returns its index.
    fn begin(&mut self) -> usize {
        self.nodes.push(Node {
            start: self.order.len() as u32,
            end: 0,
            next: 0,
            panel: NONE,
            is_even: false,
            extent: Extent::default(),
        });
        self.nodes.len() - 1
    }

    /// Complete a node after its children.
    fn end(&mut self, node: usize, panel: u32, is_even: bool) {
        let (end, next) = (self.order.len() as u32, self.nodes.len() as u32);
        let node = &mut self.nodes[node];
        (node.end, node.next) = (end, next);
        (node.panel, node.is_even) = (panel, is_even);
    }
}

/// Partition at least two items, and return the size of the first part. They are split at the mean along the axis of
/// the largest variance, of positions or of normals.
fn split(items: &mut [Item], depth: u32) -> usize {
    let count = items.len() as f64;
    let statistics = |of: fn(&Item) -> Vec3| {
        let mean = items.iter().map(|item| of(item).as_dvec3()).sum::<DVec3>() / count;
        let squares = items
            .iter()
            .map(|item| (of(item).as_dvec3() - mean).powf(2.0));
        (mean, squares.sum::<DVec3>() / count)
    };
    let (place, places) = statistics(|item| item.place);
    let (normal, normals) = statistics(|item| item.normal);
    let places = places / places.element_sum().max(f64::MIN_POSITIVE);
    let normals = normals * NORMAL_WEIGHT;
    let is_by_normal = normals.max_element() > places.max_element();
    let (of, mean, variances): (fn(&Item) -> Vec3, DVec3, DVec3) = if is_by_normal {
        (|item| item.normal, normal, normals)
    } else {
        (|item| item.place, place, places)
    };
    let axis = variances.max_position();
    let at = |item: &Item| f64::from(of(item)[axis]);
    let (before, behind): (Vec<Item>, Vec<Item>) =
        items.iter().partition(|item| at(item) < mean[axis]);
    if depth >= MEDIAN_DEPTH || before.is_empty() || behind.is_empty() {
        items.sort_by(|a, b| at(a).total_cmp(&at(b)));
        return items.len() / 2;
    }
    let all = before.iter().chain(&behind);
    items
        .iter_mut()
        .zip(all)
        .for_each(|(item, new)| *item = *new);
    before.len()
}
