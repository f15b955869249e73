//! A tree over emitters, so that thousands of lamps cost a point hardly more than a hundred.
//!
//! A point takes the coarsest nodes of which the error does not count (a cut, as in Walter et al., "Lightcuts", 2005):
//! near emitters give their exact irradiance, far ones that of their multipole together. A shadow ray to a node goes
//! to one of its emitters, chosen on the way down by how much light the two sides of each node give at most.

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

/// Error of a node of a cut, as a share of all light at the point. Cuts have some hundred nodes, whose errors differ in sign but
/// for round lamps: of thousands of lamps all light is then right to 0.3 % (root mean square), of flat ones to 0.07 %. With three
/// times as much it is right to 0.6 %, and cuts have a fifth fewer nodes.
const CUT_TOLERANCE: f32 = 1e-4;

/// Emitters that are looked at one by one, at most: the cut through a tree of so few has hardly fewer nodes.
const FEW_EMITTERS: usize = 64;

/// Emitters of a leaf at most. With 1, nodes take twice the memory; with many, cuts are finer than they need be.
const LEAF_EMITTERS: usize = 4;

/// Stands for a missing panel.
const NONE: u32 = u32::MAX;

/// A node.
#[derive(Clone, Debug)]
struct Node {
    /// Its emitters.
    start: u32,
    end: u32,
    /// The node that comes after all below this one. One of which that is the next is a leaf.
    next: u32,
    /// The panel that its emitters make up, or [`NONE`].
    panel: u32,
    /// Whether all its emitters belong to one panel, and so give their light evenly by area.
    is_even: bool,
    extent: Extent,
}

/// Emitters, and the tree over them.
#[derive(Clone, Debug, Default)]
pub(crate) struct LightTree {
    /// In the order of the tree; those of a panel follow each other.
    pub(crate) emitters: Vec<Emitter>,
    panels: Vec<Panel>,
    /// Depth first: a parent, all below its first child, all below its second child.
    nodes: Vec<Node>,
    /// By node. Most nodes of a walk are told by their extent alone.
    expansions: Vec<Expansion>,
    /// Area of all emitters before each.
    area_before: Vec<f64>,
}

/// What arrives without occlusion from a node of a cut.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arriving {
    /// Luminance of it and of all before it in the cut.
    pub(crate) until: f32,
    pub(crate) target: Target,
}

/// Where the light of a part of a cut comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Target {
    Emitter(u32),
    Node(u32),
}

impl LightTree {
    /// The tree over emitters of which those of each panel follow each other.
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

    /// Multipoles of the nodes, children before parents.
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

    /// Irradiance at a receiver without occlusion; `cut` becomes where it comes from, in the order of the tree. Errors are
    /// relative to a luminance: that of all light at the receiver, where `None`.
    pub(crate) fn unoccluded(
        &self,
        receiver: &Receiver,
        scale: Option<f32>,
        cut: &mut Vec<Arriving>,
    ) -> Vec4 {
        // Where nothing arrives it is 0, and what is behind the receiver or faces away is passed over all the same.
        let tolerance = (self.emitters.len() > FEW_EMITTERS)
            .then(|| CUT_TOLERANCE * scale.unwrap_or_else(|| self.rough_irradiance(receiver)));
        cut.clear();
        let (mut sum, mut until) = (Vec4::ZERO, 0.0);
        let mut add = |target: Target, irradiance: Vec4| {
            sum += irradiance;
            until += luminance(irradiance);
            cut.push(Arriving { until, target });
        };
        // From the root down, past nodes that give nothing: as one where the error does not count, as a panel, or each emitter.
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

    /// Irradiance of one emitter; `None` where the receiver lies on it.
    fn exact(&self, emitter: usize, receiver: &Receiver) -> Option<Vec4> {
        let emitter = &self.emitters[emitter];
        (emitter.triangle != receiver.triangle).then(|| {
            let part = point_irradiance(receiver.point, receiver.normal, emitter.corners);
            emitter.radiosity * part
        })
    }

    /// Luminance of the irradiance without occlusion, to some tens of percent: what errors are relative to.
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

    /// An emitter of a target for a place from 0 to 1, and what it gives by area there for each unit of the chance to be
    /// chosen, up to a factor that is the same for all of the target.
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

    /// As [`Self::pick`], in a leaf that is reached with some chance, here times the power of the target.
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

    /// The emitter that holds a place of the area of a node, given from 0 to 1.
    fn at_area(&self, node: &Node, place: f32) -> usize {
        let before = &self.area_before[node.start as usize..node.end as usize];
        let first = before[0];
        let area = self.area_before[node.end as usize] - first;
        let wanted = first + f64::from(place) * area;
        let passed = before.partition_point(|&area| area <= wanted);
        node.start as usize + passed.max(1) - 1
    }
}

/// The share of the first of two parts; as `otherwise` has it where both are 0.
fn share_of(first: f32, second: f32, otherwise: impl Fn() -> f32) -> f32 {
    match first / (first + second) {
        share if share.is_finite() => share,
        _ => otherwise(),
    }
}
