//! A tree over emitters, by which thousands of lamps cost hardly more at a point than a hundred.
//!
//! The light at a point is that of the coarsest nodes whose errors are tolerated (a cut, as in Walter et al.,
//! "Lightcuts", 2005): near emitters give their exact irradiance, far ones that of their common multipole. A shadow ray
//! to a node goes to one of its emitters, chosen from the node down by the largest irradiance that the two children of
//! each node can give.

mod growth;
#[cfg(test)]
mod tests;

use glam::Vec4;

use growth::Growth;

use super::{
    emitter::Emitter,
    multipole::{Expansion, Extent, Multipole},
    panel::Panel,
};
use crate::{geometry::point_irradiance, solver::places::Receiver, transport::luminance};

/// Tolerated error of a node of a cut, as a share of all light at the point. Cuts have some hundred nodes, whose errors
/// differ in sign except for round lamps: the light of thousands of lamps is then right to 0.3 % (root mean square),
/// that of flat ones to 0.07 %. Larger is less exact (with three times as much to 0.6 %, and cuts have a fifth fewer
/// nodes); smaller makes cuts larger.
const CUT_TOLERANCE: f32 = 1e-4;

/// Most emitters that are evaluated without a cut: it would have hardly fewer nodes. Smaller, and few lamps are
/// inexact; larger, and they cost time.
const FEW_EMITTERS: usize = 64;

/// Most emitters of a leaf. Fewer, and nodes take more memory, twice as much with 1; more, and cuts are finer than
/// needed.
const LEAF_EMITTERS: usize = 4;

/// Stands for a missing panel.
const NONE: u32 = u32::MAX;

/// A node.
#[derive(Clone, Debug)]
struct Node {
    /// Its emitters.
    start: u32,
    end: u32,
    /// Index of the node after all descendants of this one: the next index for a leaf.
    next: u32,
    /// The panel that consists of its emitters, or [`NONE`].
    panel: u32,
    /// Whether all its emitters belong to one panel, and so have one radiosity.
    is_even: bool,
    extent: Extent,
}

/// Emitters, and the tree over them.
#[derive(Clone, Debug, Default)]
pub(crate) struct LightTree {
    /// In the order of the tree; those of a panel are consecutive.
    pub(crate) emitters: Vec<Emitter>,
    panels: Vec<Panel>,
    /// Depth first: a parent, the subtree of its first child, that of its second child.
    nodes: Vec<Node>,
    /// By node, apart from the nodes: a walk reads few of them.
    expansions: Vec<Expansion>,
    /// Summed area of all emitters before each; one entry more than there are emitters.
    area_before: Vec<f64>,
}

/// The unoccluded light of a part of a cut.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arriving {
    /// Luminance of the irradiance of this part and of all before it in the cut.
    pub(crate) until: f32,
    pub(crate) target: Target,
}

impl Arriving {
    /// The part of a cut at a sum of luminances: its index, its own luminance, and the place in it, 0…1. The cut must have
    /// a part.
    pub(crate) fn choose(cut: &[Self], at: f32) -> (usize, f32, f32) {
        let chosen = cut.partition_point(|part| part.until <= at);
        let chosen = chosen.min(cut.len() - 1);
        let before = chosen.checked_sub(1).map_or(0.0, |last| cut[last].until);
        let share = cut[chosen].until - before;
        (chosen, share, (at - before) / share)
    }
}

/// The emitter or the node of a part of a cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Target {
    Emitter(u32),
    Node(u32),
}

impl LightTree {
    /// The tree over emitters; those of each panel must be consecutive.
    pub(crate) fn new(emitters: &[Emitter], panels: &[Panel]) -> Self {
        let Growth {
            order,
            panel_order,
            nodes,
            ..
        } = Growth::over(emitters, panels);
        let mut area = 0.0;
        let area_before = order.iter().map(|&index| {
            let before = area;
            area += f64::from(emitters[index].area);
            before
        });
        let mut tree = Self {
            area_before: area_before.collect(),
            emitters: order.iter().map(|&index| emitters[index]).collect(),
            panels: Vec::with_capacity(panels.len()),
            expansions: Vec::new(),
            nodes,
        };
        tree.area_before.push(area);
        let mut start = 0;
        for panel in panel_order {
            let mut panel = panels[panel].clone();
            let end = start + panel.emitters.len();
            panel.emitters = start..end;
            tree.panels.push(panel);
            start = end;
        }
        tree.carry_up();
        tree
    }

    /// Compute the multipoles of the nodes, children before parents.
    fn carry_up(&mut self) {
        let mut lights: Vec<Option<Multipole>> = vec![None; self.nodes.len()];
        for index in (0..self.nodes.len()).rev() {
            let node = &self.nodes[index];
            let parts: Vec<Multipole> = if self.is_leaf(index) {
                let emitters = &self.emitters[node.start as usize..node.end as usize];
                emitters.iter().map(Multipole::of).collect()
            } else {
                let children = self.children(index).into_iter();
                children.filter_map(|child| lights[child]).collect()
            };
            lights[index] = parts.into_iter().reduce(|sum, part| sum.merged(&part));
        }
        for (node, light) in self.nodes.iter_mut().zip(lights.into_iter().flatten()) {
            node.extent = light.extent;
            self.expansions.push(light.expansion);
        }
    }

    fn is_leaf(&self, node: usize) -> bool {
        self.nodes[node].next as usize == node + 1
    }

    fn children(&self, node: usize) -> [usize; 2] {
        [node + 1, self.nodes[node + 1].next as usize]
    }

    /// Unoccluded irradiance at a receiver, W/m²; `cut` is set to its parts, in the order of the tree. Errors are
    /// relative to the luminance `scale`, or for `None` to that of all light at the receiver.
    pub(crate) fn unoccluded(
        &self,
        receiver: &Receiver,
        scale: Option<f32>,
        cut: &mut Vec<Arriving>,
    ) -> Vec4 {
        // It is 0 where no light arrives; nodes behind the receiver or facing away are skipped even then.
        let tolerance = (self.emitters.len() > FEW_EMITTERS)
            .then(|| CUT_TOLERANCE * scale.unwrap_or_else(|| self.rough_irradiance(receiver)));
        cut.clear();
        let (mut sum, mut until) = (Vec4::ZERO, 0.0);
        let mut add = |target: Target, irradiance: Vec4| {
            sum += irradiance;
            until += luminance(irradiance);
            cut.push(Arriving { until, target });
        };
        // From the root down, without nodes that give no light: a node whose error is tolerated, a panel, or single
        // emitters.
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            let index = at;
            at = node.next as usize;
            if let Some(tolerance) = tolerance {
                let Some(sight) = node.extent.sight(receiver) else {
                    continue;
                };
                if node.extent.error(&self.expansions[index], &sight) <= tolerance {
                    let irradiance = self.expansions[index].irradiance(&sight, receiver.normal);
                    add(Target::Node(index as u32), irradiance);
                    continue;
                }
            }
            if let Some(panel) = self.panels.get(node.panel as usize)
                && let Some(part) = panel.irradiance(receiver)
            {
                let radiosity = self.emitters[node.start as usize].radiosity;
                add(Target::Node(index as u32), radiosity * part);
                continue;
            }
            if !self.is_leaf(index) {
                at = index + 1;
                continue;
            }
            for emitter in node.start..node.end {
                if let Some(irradiance) = self.exact(emitter as usize, receiver) {
                    add(Target::Emitter(emitter), irradiance);
                }
            }
        }
        sum
    }

    /// Unoccluded irradiance of one emitter; `None` if the receiver lies on it.
    fn exact(&self, emitter: usize, receiver: &Receiver) -> Option<Vec4> {
        let emitter = &self.emitters[emitter];
        (emitter.triangle != receiver.triangle).then(|| {
            let part = point_irradiance(receiver.point, receiver.normal, emitter.corners);
            emitter.radiosity * part
        })
    }

    /// Luminance of the unoccluded irradiance, to some tens of percent, to which errors are relative.
    fn rough_irradiance(&self, receiver: &Receiver) -> f32 {
        let (mut sum, mut at) = (0.0, 0);
        while let Some(node) = self.nodes.get(at) {
            let index = at;
            at = node.next as usize;
            let Some(sight) = node.extent.sight(receiver) else {
                continue;
            };
            if node.extent.is_far(&sight) {
                sum += luminance(self.expansions[index].irradiance(&sight, receiver.normal));
            } else if self.is_leaf(index) {
                let emitters = node.start as usize..node.end as usize;
                let exact = emitters.filter_map(|emitter| self.exact(emitter, receiver));
                sum += luminance(exact.sum());
            } else {
                at = index + 1;
            }
        }
        sum
    }

    /// An emitter of a target for a uniform number `place` in 0…1, and its power per probability of being chosen,
    /// relative to the power of the target.
    pub(crate) fn pick(&self, target: Target, receiver: &Receiver, place: f32) -> (usize, f32) {
        let mut index = match target {
            Target::Emitter(emitter) => return (emitter as usize, 1.0),
            Target::Node(node) => node as usize,
        };
        let whole = self.nodes[index].extent.power;
        let (mut place, mut chance) = (place, 1.0);
        loop {
            let node = &self.nodes[index];
            if node.is_even {
                let emitter = self.at_area(node, place);
                return (emitter, node.extent.power / (whole * chance));
            }
            if self.is_leaf(index) {
                break;
            }
            let [first, second] = self.children(index);
            let [a, b] = [first, second].map(|child| {
                let extent = &self.nodes[child].extent;
                let sight = extent.sight(receiver);
                sight.map_or(0.0, |sight| extent.most_irradiance(&sight))
            });
            let share = share_of(a, b, || {
                self.nodes[first].extent.power / node.extent.power.max(f32::MIN_POSITIVE)
            });
            let is_first = place < share;
            (index, chance, place) = if is_first {
                (first, chance * share, place / share)
            } else {
                let rest = 1.0 - share;
                (second, chance * rest, (place - share) / rest)
            };
        }
        self.pick_in_leaf(index, receiver, place, whole * chance)
    }

    /// As [`Self::pick`], in a leaf; `chance` is its probability of being reached times the power of the target.
    fn pick_in_leaf(
        &self,
        leaf: usize,
        receiver: &Receiver,
        place: f32,
        chance: f32,
    ) -> (usize, f32) {
        let node = &self.nodes[leaf];
        let emitters = node.start as usize..node.end as usize;
        let mut until = [0.0; LEAF_EMITTERS];
        let mut sum = 0.0;
        for (until, emitter) in until.iter_mut().zip(emitters.clone()) {
            sum += self.exact(emitter, receiver).map_or(0.0, luminance);
            *until = sum;
        }
        let chosen = until[..emitters.len()].partition_point(|&until| until <= place * sum);
        let chosen = chosen.min(emitters.len() - 1);
        let own = until[chosen] - chosen.checked_sub(1).map_or(0.0, |before| until[before]);
        let emitter = &self.emitters[emitters.start + chosen];
        let power = luminance(emitter.radiosity) * emitter.area;
        let per_chance = if own > 0.0 {
            power * sum / (own * chance)
        } else {
            0.0
        };
        (emitters.start + chosen, per_chance)
    }

    /// The emitter of a node at a share `place` of its area, 0…1.
    fn at_area(&self, node: &Node, place: f32) -> usize {
        let before = &self.area_before[node.start as usize..node.end as usize];
        let first = before[0];
        let area = self.area_before[node.end as usize] - first;
        let wanted = first + f64::from(place) * area;
        let passed = before.partition_point(|&area| area <= wanted);
        node.start as usize + passed.max(1) - 1
    }
}

/// The share of the first of two parts; that of `otherwise` if both are 0.
fn share_of(first: f32, second: f32, otherwise: impl Fn() -> f32) -> f32 {
    match first / (first + second) {
        share if share.is_finite() => share,
        _ => otherwise(),
    }
}
