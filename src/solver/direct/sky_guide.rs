//! Where the sky is seen from places that see little of it.
//!
//! From a point in a room a window may fill a thousandth of the hemisphere, and shadow rays that follow the unoccluded
//! light miss it. The guide divides space into cells, and keeps by cell places in the openings through which its points
//! see the sky. A share of the rays of a point goes to the leaves of the sky's tree behind these places, the others
//! everywhere, and each is weighted by the probability of both, so that the light has no bias however wrong the guide is
//! (path guiding with parallax: Ruppert, Herholz and Lensch, "Robust fitting of parallax-aware mixtures for path
//! guiding", 2020; mixture sampling: Hesterberg, "Weighted average importance sampling", 1995).

use std::ops::Range;

use glam::Vec3;

use super::{
    light_tree::{Arriving, Target},
    openings::Opening,
    sky::SkyTree,
};
use crate::transport::luminance;

/// Largest visible fraction of the light of guided cells. Larger guides rays that need no guide, and makes their weights
/// uneven; smaller leaves noise.
pub(super) const SELDOM: f32 = 0.06;

/// Largest second moment of the weights of guided rays relative to that of unguided ones. Larger guides rays where light
/// comes through many small gaps, and makes it noisier; smaller leaves rooms without a guide.
const MOST_SQUARE: f32 = 0.6;

/// Share of rays that go everywhere. Smaller, and light that the guide does not know comes in few bright samples; larger
/// shoots fewer rays into openings.
const EVERYWHERE: f32 = 0.5;

/// Fewest hits of a cell. Fewer, and a cell does not know all of its openings; more, and cells reach into several rooms.
const LEAST_HITS: usize = 64;

/// Share of a leaf's visible part that each of its three neighbours gets, and how often: an opening is known by a few
/// places. Smaller, and light at its rim comes in few bright samples; larger aims beside it.
const SPREAD: f32 = 0.5;
const SPREADS: usize = 2;

/// A point from which rays were shot, and what they saw.
#[derive(Clone, Debug)]
pub(super) struct Explored {
    pub point: Vec3,
    /// By hit.
    pub openings: Vec<Opening>,
    /// The visible fraction of the point's light: the sum of the weights of visible rays over the number of rays.
    pub fraction: f32,
    /// The same of the squares of the weights.
    pub square: f32,
}

/// A cell of space.
#[derive(Clone, Debug, Default)]
struct Cell {
    /// Axis, place on it, and the cells below and above.
    halves: Option<(usize, f32, [u32; 2])>,
    /// Its openings; none if it is not guided.
    openings: Range<usize>,
}

/// The guide.
#[derive(Clone, Debug, Default)]
pub(super) struct SkyGuide {
    cells: Vec<Cell>,
    /// Of all cells.
    openings: Vec<Opening>,
}

/// A leaf of the sky's tree that is seen from a point.
#[derive(Clone, Copy, Debug)]
struct Lobe {
    leaf: u32,
    /// Its visible part, up to a factor that is the same for all leaves.
    visible: f32,
    /// Luminance of its irradiance.
    irradiance: f32,
}

/// The leaves of the sky's tree that are seen from a point, in the order of their indices once complete.
#[derive(Debug, Default)]
pub(super) struct Lobes {
    lobes: Vec<Lobe>,
    /// By leaf, one more than its place among `lobes`; 0 for others.
    places: Vec<u32>,
    /// Scratch space: visible parts before they spread.
    visible: Vec<f32>,
}

impl Lobes {
    /// Discard all, for a tree of so many nodes.
    fn clear(&mut self, node_count: usize) {
        for lobe in self.lobes.drain(..) {
            self.places[lobe.leaf as usize] = 0;
        }
        self.places.resize(node_count, 0);
    }

    /// Add to the visible part of a leaf.
    fn add(&mut self, leaf: u32, visible: f32) {
        match self.places[leaf as usize].checked_sub(1) {
            Some(place) => self.lobes[place as usize].visible += visible,
            None => {
                self.lobes.push(Lobe {
                    leaf,
                    visible,
                    irradiance: 0.0,
                });
                self.places[leaf as usize] = self.lobes.len() as u32;
            }
        }
    }

    /// Add a share of the visible part of each leaf to its neighbours.
    fn spread(&mut self, tree: &SkyTree) {
        self.visible.clear();
        let visible = self.lobes.iter().map(|lobe| lobe.visible);
        self.visible.extend(visible);
        for index in 0..self.visible.len() {
            for neighbour in tree.neighbours(self.lobes[index].leaf) {
                self.add(neighbour, SPREAD * self.visible[index]);
            }
        }
    }

    /// Find the irradiance of each leaf, discard those without any, and sort the others.
    fn complete(&mut self, irradiance: impl Fn(u32) -> f32) {
        for lobe in &mut self.lobes {
            lobe.irradiance = irradiance(lobe.leaf);
            self.places[lobe.leaf as usize] = 0;
        }
        self.lobes.retain(|lobe| lobe.irradiance > 0.0);
        self.lobes.sort_unstable_by_key(|lobe| lobe.leaf);
        for (place, lobe) in self.lobes.iter().enumerate() {
            self.places[lobe.leaf as usize] = place as u32 + 1;
        }
    }

    /// Luminance of the irradiance of one of them, by its place.
    pub(super) fn irradiance(&self, place: usize) -> f32 {
        self.lobes[place].irradiance
    }

    /// Visible part of a leaf; 0 for those that are not among them.
    fn visible(&self, leaf: u32) -> f32 {
        let place = self.places[leaf as usize].checked_sub(1);
        place.map_or(0.0, |place| self.lobes[place as usize].visible)
    }
}

/// How the rays of a point are mixed: the weight of a ray by its leaf.
pub(super) struct Mixture {
    /// Probability of a leaf by the guide over that by its light, for a visible part of 1.
    per_visible: f32,
    /// Expected square of the weight of a visible ray.
    pub square: f32,
}

impl SkyGuide {
    /// The guide that some points have found; `None` if they see too little of the sky, or enough without a guide.
    pub(super) fn new(mut points: Vec<Explored>) -> Option<Self> {
        let mut guide = Self::default();
        guide.grow(&mut points);
        (!guide.openings.is_empty()).then_some(guide)
    }

    /// Add a cell with some points. Returns its index.
    fn grow(&mut self, points: &mut [Explored]) -> u32 {
        let index = self.cells.len();
        self.cells.push(Cell::default());
        let hits = hits(points);
        if hits == 0 {
            return index as u32;
        }
        if hits >= 2 * LEAST_HITS
            && let Some((axis, place)) = halve(points)
        {
            let middle = points.partition_point(|point| point.point[axis] < place);
            let (below, above) = points.split_at_mut(middle);
            let halves = [below, above].map(|half| self.grow(half));
            self.cells[index].halves = Some((axis, place, halves));
            return index as u32;
        }
        let fraction: f32 = points.iter().map(|point| point.fraction).sum();
        if fraction < SELDOM * points.len() as f32 {
            let start = self.openings.len();
            self.openings
                .extend(points.iter().flat_map(|point| &point.openings));
            self.cells[index].openings = start..self.openings.len();
        }
        index as u32
    }

    /// Guide only cells in which this made the light of points less noisy; `None` if there are none.
    pub(super) fn proven(mut self, points: &[Explored]) -> Option<Self> {
        let mut sums = vec![(0.0, 0.0); self.cells.len()];
        for point in points {
            let (fraction, square) = &mut sums[self.cell_at(point.point)];
            *fraction += point.fraction;
            *square += point.square;
        }
        for (cell, (fraction, square)) in self.cells.iter_mut().zip(sums) {
            if square >= MOST_SQUARE * fraction {
                cell.openings = 0..0;
            }
        }
        let guides = self.cells.iter().any(|cell| !cell.openings.is_empty());
        guides.then_some(self)
    }

    fn cell_at(&self, point: Vec3) -> usize {
        let mut cell = 0;
        while let Some((axis, place, halves)) = self.cells[cell].halves {
            cell = halves[usize::from(point[axis] >= place)] as usize;
        }
        cell
    }

    /// The openings seen from a point; none if it is not guided.
    fn openings_at(&self, point: Vec3) -> &[Opening] {
        &self.openings[self.cells[self.cell_at(point)].openings.clone()]
    }

    /// Whether rays from a point are guided.
    pub(super) fn guides(&self, point: Vec3) -> bool {
        !self.openings_at(point).is_empty()
    }

    /// Add to the cut of a point the leaves that are seen from it, which `lobes` describe. `None` if the point is not
    /// guided.
    pub(super) fn mix(
        &self,
        tree: &SkyTree,
        point: Vec3,
        normal: Vec3,
        cut: &mut Vec<Arriving>,
        lobes: &mut Lobes,
    ) -> Option<Mixture> {
        lobes.clear(tree.node_count());
        let light = cut.last()?.until;
        for opening in self.openings_at(point) {
            lobes.add(tree.leaf_towards(opening.place - point), opening.visible);
        }
        for _ in 0..SPREADS {
            lobes.spread(tree);
        }
        lobes.complete(|leaf| luminance(tree.leaf_irradiance(leaf as usize, normal)));
        let lobes = &lobes.lobes;
        let sum: f32 = lobes
            .iter()
            .map(|lobe| lobe.visible * lobe.irradiance)
            .sum();
        if !(sum > 0.0 && sum.is_finite()) {
            return None;
        }
        let guided = (1.0 - EVERYWHERE) / EVERYWHERE * light;
        let mut until = 0.0;
        let mut mixture = Mixture {
            per_visible: (1.0 - EVERYWHERE) * light / sum,
            square: 0.0,
        };
        for lobe in lobes {
            let share = lobe.visible * lobe.irradiance / sum;
            until += share;
            mixture.square += share * mixture.weight_of(lobe.visible).powi(2);
            cut.push(Arriving {
                until: light + guided * until,
                target: Target::Node(lobe.leaf),
            });
        }
        Some(mixture)
    }
}

impl Mixture {
    /// Weight of a ray into a leaf, relative to one that follows the unoccluded light.
    pub(super) fn weight(&self, lobes: &Lobes, leaf: u32) -> f32 {
        self.weight_of(lobes.visible(leaf))
    }

    fn weight_of(&self, visible: f32) -> f32 {
        1.0 / (EVERYWHERE + self.per_visible * visible)
    }
}

/// Number of hits of some points.
fn hits(points: &[Explored]) -> usize {
    points.iter().map(|point| point.openings.len()).sum()
}

/// Sort points along the longest axis of their box. Returns it and the place that halves them; `None` if all points are
/// one.
fn halve(points: &mut [Explored]) -> Option<(usize, f32)> {
    let bounds = |of: fn(Vec3, Vec3) -> Vec3| {
        let places = points.iter().map(|point| point.point);
        places.reduce(of).unwrap_or(Vec3::ZERO)
    };
    let axis = (bounds(Vec3::max) - bounds(Vec3::min)).max_position();
    points.sort_by(|a, b| a.point[axis].total_cmp(&b.point[axis]));
    let least = points.first()?.point[axis];
    let middle = points[points.len() / 2].point[axis];
    let mut places = points.iter().map(|point| point.point[axis]);
    let place = places.find(|&at| at >= middle && at > least)?;
    Some((axis, place))
}

#[cfg(test)]
mod tests {
    use std::f32::consts::PI;

    use super::*;
    use crate::{geometry::Random, scene::Sky};

    /// A guide with openings in one direction from all points below, and in none above.
    fn guide() -> SkyGuide {
        let explored = |index: u16| {
            let place = Vec3::new(5.0, 20.0, -3.0);
            let is_dark = index >= 100;
            let openings = vec![
                Opening {
                    place,
                    visible: 1.0
                };
                2 * usize::from(!is_dark)
            ];
            Explored {
                point: Vec3::Y * f32::from(index) * 0.01,
                openings,
                fraction: if is_dark { 0.0 } else { 0.01 },
                square: 0.001,
            }
        };
        SkyGuide::new((0..200).map(explored).collect()).unwrap()
    }

    #[test]
    fn a_cell_without_a_hit_is_not_guided_and_a_few_hits_make_no_guide() {
        let guide = guide();
        assert!(guide.guides(Vec3::Y * 0.1));
        assert!(!guide.guides(Vec3::Y * 1.9));
        let point = Explored {
            point: Vec3::ZERO,
            openings: Vec::new(),
            fraction: 0.0,
            square: 0.0,
        };
        assert!(SkyGuide::new(vec![point; 10]).is_none());
        assert!(SkyGuide::new(Vec::new()).is_none());
    }

    #[test]
    fn cells_whose_light_did_not_become_less_noisy_are_not_guided() {
        let point = |fraction, square| Explored {
            point: Vec3::Y * 0.1,
            openings: Vec::new(),
            fraction,
            square,
        };
        assert!(guide().proven(&[point(0.01, 0.001)]).is_some());
        assert!(guide().proven(&[point(0.01, 0.01)]).is_none());
        assert!(guide().proven(&[]).is_none());
    }

    #[test]
    fn guided_rays_have_the_mean_of_unguided_ones_in_every_part_of_the_sky() {
        let guide = guide();
        let tree = SkyTree::new(&Sky::Uniform(Vec3::ONE), None).unwrap();
        let (mut random, mut cut, mut lobes) = (Random::new(5, 0), Vec::new(), Lobes::default());
        let (point, normal) = (Vec3::Y * 0.3, Vec3::Y);
        let light = luminance(tree.unoccluded(normal, &mut cut));
        let own = cut.len();
        let mixture = guide
            .mix(&tree, point, normal, &mut cut, &mut lobes)
            .unwrap();
        let total = cut.last().unwrap().until;
        assert!((total * EVERYWHERE / light - 1.0).abs() < 1e-4);
        let towards = (Vec3::new(5.0, 20.0, -3.0) - point).normalize_or_zero();
        // Sums of weights: within a cone about the opening, and beyond it; and the rays within.
        let (mut within, mut beyond, mut rays, count) = (0.0, 0.0, 0, 40_000);
        for ray in 0..count {
            let at = (ray as f32 + random.uniform()) / count as f32 * total;
            let (chosen, share, place) = Arriving::choose(&cut, at);
            let irradiance = chosen
                .checked_sub(own)
                .map_or(share, |place| lobes.irradiance(place));
            let Target::Node(node) = cut[chosen].target else {
                unreachable!()
            };
            let square = random.uniform_2d();
            let Some(ray) = tree.aim(node as usize, irradiance, normal, place, square) else {
                continue;
            };
            let weight = ray.weight * mixture.weight(&lobes, ray.leaf);
            if ray.direction.dot(towards) > 0.98 {
                (within, rays) = (within + weight, rays + 1);
            } else {
                beyond += weight;
            }
        }
        // Irradiance of a cone over that of the hemisphere, both times π.
        let expected = (1.0 - 0.98_f32.powi(2)) * normal.dot(towards);
        let [within, beyond] = [within, beyond].map(|sum| sum / count as f32);
        assert!(
            (within / expected - 1.0).abs() < 0.05,
            "{within} for {expected}"
        );
        assert!((beyond + within - 1.0).abs() < 0.02, "{beyond}");
        assert!(rays as f32 > 5.0 * expected * count as f32, "{rays}");
        assert!((light / PI - 1.0).abs() < 1e-3);
    }
}
