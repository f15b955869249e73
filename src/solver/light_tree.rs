//! A tree over emitters, so that thousands of lamps cost a point hardly more than a hundred.
//!
//! A point takes the coarsest nodes of which the error does not count (a cut, as in Walter et al., "Lightcuts", 2005):
//! near emitters give their exact irradiance, far ones that of their multipole together. A shadow ray to a node goes
//! to one of its emitters, chosen on the way down by how much light the two sides of each node give at most.

use glam::{DVec3, Vec3, Vec4};

use super::{emitter::Emitter, multipole::Multipole, panel::Panel, places::Receiver};
use crate::{geometry::point_irradiance, transport::luminance};

/// Error of a node of a cut, as a share of all light at the point. Cuts have some hundred nodes, whose errors differ in sign but
/// for round lamps: of thousands of lamps all light is then right to 0.3 % (root mean square), of flat ones to 0.07 %. With three
/// times as much it is right to 0.6 %, and cuts have a fifth fewer nodes.
const CUT_TOLERANCE: f32 = 1e-4;

/// Emitters that are looked at one by one, at most: the cut through a tree of so few has hardly fewer nodes.
const FEW_EMITTERS: usize = 64;

/// Emitters of a leaf at most. With 1, nodes take twice the memory; with many, cuts are finer than they need be.
const LEAF_EMITTERS: usize = 4;

/// What a spread of normals counts beside one of places. Where a node is split by normals first, lamps far from each other
/// stay together; where it is split by places alone, both sides of a sheet do.
const NORMAL_WEIGHT: f64 = 0.9;

/// Depth from which nodes are split at the median, so that no tree is deeper than this plus 32.
const MEDIAN_DEPTH: u32 = 48;

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
    light: Multipole,
}

/// Emitters, and the tree over them.
#[derive(Clone, Debug, Default)]
pub(super) struct LightTree {
    /// In the order of the tree; those of a panel follow each other.
    pub(super) emitters: Vec<Emitter>,
    panels: Vec<Panel>,
    /// Depth first: a parent, all below its first child, all below its second child.
    nodes: Vec<Node>,
    /// Area of all emitters before each.
    area_before: Vec<f64>,
}

/// What arrives without occlusion from a node of a cut.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arriving {
    /// Luminance of it and of all before it in the cut.
    pub(super) until: f32,
    pub(super) target: Target,
}

/// Where the light of a part of a cut comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Target {
    Emitter(u32),
    Node(u32),
}

/// An emitter on its way into the tree, or a panel.
#[derive(Clone, Copy)]
struct Item {
    place: Vec3,
    normal: Vec3,
    index: usize,
}

impl LightTree {
    /// The tree over emitters of which those of each panel follow each other.
    pub(super) fn new(emitters: &[Emitter], panels: &[Panel]) -> Self {
        let mut growth = Growth {
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
        let Growth {
            order,
            panel_order,
            nodes,
            ..
        } = growth;
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
        for index in (0..self.nodes.len()).rev() {
            let node = &self.nodes[index];
            self.nodes[index].light = if self.is_leaf(index) {
                let emitters = &self.emitters[node.start as usize..node.end as usize];
                let mut lights = emitters.iter().map(Multipole::of);
                let first = lights.next().expect("a leaf has an emitter");
                lights.fold(first, |sum, light| sum.merged(&light))
            } else {
                let [first, second] = self.children(index);
                self.nodes[first].light.merged(&self.nodes[second].light)
            };
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
    pub(super) fn unoccluded(
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
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            let index = at;
            at = node.next as usize;
            if let Some(tolerance) = tolerance {
                let Some(sight) = node.light.sight(receiver) else {
                    continue;
                };
                if node.light.error(&sight) <= tolerance {
                    let irradiance = node.light.irradiance(&sight, receiver.normal);
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
            let Some(sight) = node.light.sight(receiver) else {
                continue;
            };
            if node.light.is_far(&sight) {
                sum += luminance(node.light.irradiance(&sight, receiver.normal));
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
    pub(super) fn pick(&self, target: Target, receiver: &Receiver, place: f32) -> (usize, f32) {
        let mut index = match target {
            Target::Emitter(emitter) => return (emitter as usize, 1.0),
            Target::Node(node) => node as usize,
        };
        let whole = self.nodes[index].light.power;
        let (mut place, mut chance) = (place, 1.0);
        loop {
            let node = &self.nodes[index];
            if node.is_even {
                let emitter = self.at_area(node, place);
                return (emitter, node.light.power / (whole * chance));
            }
            if self.is_leaf(index) {
                break;
            }
            let [first, second] = self.children(index);
            let [a, b] = [first, second].map(|child| {
                let light = &self.nodes[child].light;
                let sight = light.sight(receiver);
                sight.map_or(0.0, |sight| light.most_irradiance(&sight))
            });
            let share = share_of(a, b, || {
                self.nodes[first].light.power / node.light.power.max(f32::MIN_POSITIVE)
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

/// A tree on its way.
struct Growth<'a> {
    emitters: &'a [Emitter],
    panels: &'a [Panel],
    /// Emitters and panels in the order of the tree, as far as it has come.
    order: Vec<usize>,
    panel_order: Vec<usize>,
    nodes: Vec<Node>,
}

impl Growth<'_> {
    /// Grow the tree over some panels.
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

    /// Grow the tree over emitters of one panel; `panel` is its number where they are all of it.
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

    fn begin(&mut self) -> usize {
        let light = Multipole::of(&self.emitters[0]);
        self.nodes.push(Node {
            start: self.order.len() as u32,
            end: 0,
            next: 0,
            panel: NONE,
            is_even: false,
            light,
        });
        self.nodes.len() - 1
    }

    fn end(&mut self, node: usize, panel: u32, is_even: bool) {
        let (end, next) = (self.order.len() as u32, self.nodes.len() as u32);
        let node = &mut self.nodes[node];
        (node.end, node.next) = (end, next);
        (node.panel, node.is_even) = (panel, is_even);
    }
}

/// Sort at least two items into those before and behind a cut, and return how many come before. They are cut at the
/// mean of the axis along which they differ most, of places or of normals.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        geometry::Random,
        scene::{MaterialId, TriangleId},
        solver::panel::panels,
    };

    /// Lamps that share no corners, each of up to two triangles.
    #[derive(Default)]
    struct Lamps(Vec<Emitter>);

    impl Lamps {
        fn triangle(&mut self, corners: [Vec3; 3], radiosity: Vec4) {
            let number = 4 * self.0.len() as u32;
            self.face([0, 1, 2].map(|corner| number + corner), corners, radiosity);
        }

        fn face(&mut self, vertices: [u32; 3], corners: [Vec3; 3], radiosity: Vec4) {
            let [a, b, c] = corners;
            let area_vector = (b - a).cross(c - a) * 0.5;
            let number = self.0.len() as u32;
            self.0.push(Emitter {
                vertices,
                corners,
                normal: area_vector.normalize_or_zero(),
                area: area_vector.length(),
                triangle: TriangleId(number),
                material: MaterialId(0),
                radiosity,
                texture: Vec3::ONE,
            });
        }

        /// A square of some edge length about a centre, that looks along a direction.
        fn square(&mut self, centre: Vec3, normal: Vec3, edge: f32, radiosity: Vec4) {
            let (u, v) = normal.any_orthonormal_pair();
            let (u, v) = (u * (edge * 0.5), v * (edge * 0.5));
            let corner = |a: f32, b: f32| centre + u * a + v * b;
            let [a, b, c, d] =
                [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| corner(x, y));
            let first = 4 * self.0.len() as u32;
            for corners in [[0, 1, 2], [0, 2, 3]] {
                let places = corners.map(|corner| [a, b, c, d][corner]);
                self.face(
                    corners.map(|corner| first + corner as u32),
                    places,
                    radiosity,
                );
            }
        }

        fn tree(&self) -> LightTree {
            let (emitters, panels) = panels(&self.0);
            LightTree::new(&emitters, &panels)
        }
    }

    /// A ceiling of `n` by `n` lamps of a centimetre over 10 by 10 metres, red and blue ones in turn.
    fn ceiling(n: usize) -> Lamps {
        let mut lamps = Lamps::default();
        for (x, y) in (0..n).flat_map(|x| (0..n).map(move |y| (x, y))) {
            let at = |x: usize| (x as f32 + 0.5) * 10.0 / n as f32;
            let radiosity = match (x + y) % 2 {
                0 => Vec4::new(5.0, 1.0, 0.5, 0.0),
                _ => Vec4::new(0.2, 1.0, 8.0, 0.0),
            };
            lamps.square(Vec3::new(at(x), at(y), 3.0), Vec3::NEG_Z, 0.01, radiosity);
        }
        lamps
    }

    /// Round lamps of `20 · 16` faces each about random places.
    fn bulbs(count: usize) -> Lamps {
        let (mut lamps, mut random) = (Lamps::default(), Random::new(1, 0));
        for _ in 0..count {
            let mut uniform = || random.uniform();
            let centre = Vec3::new(10.0 * uniform(), 10.0 * uniform(), 2.0 + uniform());
            // Rings of quads, and two caps.
            let on = |ring: usize, step: usize| {
                let (height, turn) = (
                    (ring as f32 * 0.1 * std::f32::consts::PI).sin_cos(),
                    (step as f32 * std::f32::consts::PI / 8.0).sin_cos(),
                );
                centre + Vec3::new(height.0 * turn.1, height.0 * turn.0, height.1) * 0.05
            };
            for (ring, step) in (0..10).flat_map(|ring| (0..16).map(move |step| (ring, step))) {
                let [a, b, c, d] = [
                    on(ring, step),
                    on(ring + 1, step),
                    on(ring + 1, step + 1),
                    on(ring, step + 1),
                ];
                if ring < 9 {
                    lamps.triangle([a, b, c], Vec4::splat(3.0));
                }
                if ring > 0 {
                    lamps.triangle([a, c, d], Vec4::splat(3.0));
                }
            }
        }
        lamps
    }

    /// Sheets that shine on both sides.
    fn sheets() -> Lamps {
        let mut lamps = Lamps::default();
        for (x, y) in (0..20).flat_map(|x| (0..20).map(move |y| (x, y))) {
            let centre = Vec3::new(x as f32 * 0.5, y as f32 * 0.5, 2.5);
            lamps.square(centre, Vec3::Z, 0.1, Vec4::new(1.0, 2.0, 3.0, 0.0));
            lamps.square(centre, Vec3::NEG_Z, 0.1, Vec4::new(3.0, 2.0, 1.0, 0.0));
        }
        lamps
    }

    /// Loose small faces of all colours and directions.
    fn swarm(count: usize) -> Lamps {
        let (mut lamps, mut random) = (Lamps::default(), Random::new(2, 0));
        for _ in 0..count {
            let mut vector = || Vec3::from_array([(); 3].map(|()| random.uniform()));
            let centre = vector() * Vec3::new(10.0, 10.0, 3.0);
            let normal = (vector() - 0.5).normalize_or(Vec3::X);
            lamps.square(centre, normal, 0.02, vector().powf(4.0).extend(0.0));
        }
        lamps
    }

    /// Places on the walls, the floor and the ceiling of a room about the lamps, and within it.
    fn receivers(count: usize) -> Vec<Receiver> {
        let mut random = Random::new(3, 0);
        let mut receivers = Vec::new();
        for number in 0..count {
            let mut vector = || Vec3::from_array([(); 3].map(|()| random.uniform()));
            let (mut point, mut normal) = (vector(), vector() - 0.5);
            if number % 4 > 0 {
                let axis = number % 3;
                let side = if vector().x < 0.5 { 0.0 } else { 1.0 };
                point[axis] = side;
                normal = Vec3::ZERO;
                normal[axis] = 1.0 - 2.0 * side;
            }
            receivers.push(Receiver {
                point: point * Vec3::new(10.0, 10.0, 3.1),
                normal: normal.normalize_or(Vec3::Z),
                triangle: TriangleId(u32::MAX),
            });
        }
        receivers
    }

    #[test]
    fn a_cut_gives_the_light_of_all_emitters_by_colour() {
        for (name, lamps) in [
            ("ceiling", ceiling(50)),
            ("bulbs", bulbs(20)),
            ("sheets", sheets()),
            ("swarm", swarm(3000)),
        ] {
            let tree = lamps.tree();
            let (mut cut, mut sizes, mut worst, mut squares) = (Vec::new(), 0, 0.0_f32, 0.0);
            let receivers = receivers(400);
            for receiver in &receivers {
                let found = tree.unoccluded(receiver, None, &mut cut);
                sizes += cut.len();
                let parts = tree.emitters.iter().map(|emitter| {
                    let part = point_irradiance(receiver.point, receiver.normal, emitter.corners);
                    (emitter.radiosity * part).as_dvec4()
                });
                let exact = parts.sum::<glam::DVec4>().as_vec4();
                let scale = exact.max_element().max(f32::MIN_POSITIVE);
                let error = (found - exact).abs().max_element() / scale;
                worst = worst.max(error);
                squares += error * error;
            }
            let (count, size) = (receivers.len(), sizes / receivers.len());
            let typical = (squares / count as f32).sqrt();
            println!(
                "{name}: {} emitters, cut {size}, {typical} {worst}",
                lamps.0.len()
            );
            assert!(typical < 4e-3 && worst < 6e-3, "{name}: {typical} {worst}");
        }
    }

    #[test]
    fn cuts_hardly_grow_with_the_number_of_lamps() {
        let size = |n: usize| {
            let (tree, mut cut) = (ceiling(n).tree(), Vec::new());
            // Beside the lamps, there are as many near ones as there are lamps.
            let receivers: Vec<Receiver> = receivers(200)
                .into_iter()
                .filter(|receiver| receiver.point.z < 2.0)
                .collect();
            let sizes = receivers.iter().map(|receiver| {
                tree.unoccluded(receiver, None, &mut cut);
                cut.len()
            });
            sizes.sum::<usize>() / receivers.len()
        };
        let (hundreds, thousands) = (size(20), size(80));
        println!("{hundreds} {thousands}");
        assert!(thousands < 4 * hundreds, "{hundreds} {thousands}");
    }

    #[test]
    fn emitters_are_picked_by_the_light_that_they_give() {
        for lamps in [ceiling(30), bulbs(4), swarm(1000)] {
            let tree = lamps.tree();
            for receiver in receivers(20) {
                let mut cut = Vec::new();
                tree.unoccluded(&receiver, None, &mut cut);
                for part in cut.iter().step_by(7) {
                    let Target::Node(node) = part.target else {
                        continue;
                    };
                    let node_of = &tree.nodes[node as usize];
                    let light =
                        |emitter: usize| tree.exact(emitter, &receiver).map_or(0.0, luminance);
                    let all: f32 = (node_of.start..node_of.end)
                        .map(|at| light(at as usize))
                        .sum();
                    if all <= 0.0 {
                        continue;
                    }
                    const COUNT: u32 = 2000;
                    let places = (0..COUNT).map(|place| (place as f32 + 0.5) / COUNT as f32);
                    let mean = places
                        .map(|place| {
                            let (emitter, by_area) = tree.pick(part.target, &receiver, place);
                            assert!((node_of.start..node_of.end).contains(&(emitter as u32)));
                            let of = &tree.emitters[emitter];
                            let power = luminance(of.radiosity) * of.area;
                            by_area * light(emitter) / power
                        })
                        .sum::<f32>()
                        / COUNT as f32;
                    let found = mean * node_of.light.power;
                    // What one side of a node may be taken to give nothing of does not count.
                    let slack = 0.02 * all + 1e-3 * cut[cut.len() - 1].until;
                    assert!((found - all).abs() <= slack, "{found} {all}");
                }
            }
        }
    }

    #[test]
    fn every_emitter_is_in_one_leaf_and_panels_are_whole() {
        for lamps in [Lamps::default(), ceiling(1), ceiling(7), bulbs(2), sheets()] {
            let tree = lamps.tree();
            assert_eq!(tree.emitters.len(), lamps.0.len());
            let mut next = 0;
            for (index, node) in tree.nodes.iter().enumerate() {
                assert!(node.start < node.end);
                if tree.is_leaf(index) {
                    assert_eq!(node.start, next);
                    next = node.end;
                } else {
                    let [first, second] = tree.children(index).map(|child| &tree.nodes[child]);
                    assert_eq!((first.start, first.end), (node.start, second.start));
                    assert_eq!(second.end, node.end);
                }
            }
            assert_eq!(next as usize, lamps.0.len());
            let mut next = 0;
            for panel in &tree.panels {
                assert_eq!(panel.emitters.start, next);
                next = panel.emitters.end;
            }
        }
    }

    #[test]
    fn thousands_of_emitters_in_one_place_make_no_deep_tree() {
        let mut lamps = Lamps::default();
        for _ in 0..5000 {
            lamps.square(Vec3::Z, Vec3::NEG_Z, 0.1, Vec4::ONE);
        }
        let tree = lamps.tree();
        let mut cut = Vec::new();
        let receiver = Receiver {
            point: Vec3::ZERO,
            normal: Vec3::Z,
            triangle: TriangleId(u32::MAX),
        };
        let found = luminance(tree.unoccluded(&receiver, None, &mut cut));
        let one = point_irradiance(Vec3::ZERO, Vec3::Z, lamps.0[0].corners)
            + point_irradiance(Vec3::ZERO, Vec3::Z, lamps.0[1].corners);
        assert!((found / (5000.0 * one) - 1.0).abs() < 1e-3);
    }
}
