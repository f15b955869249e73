//! The sky as an emitter: a tree over directions, by which its unoccluded irradiance is exact and its rays are
//! distributed by radiance times projected solid angle.
//!
//! The sphere of directions is an octahedron whose triangles are halved, in the order of the Sierpiński curve, so that
//! successive leaves share an edge: rays that are stratified along the curve are stratified over the sphere. A leaf has
//! one radiance. Where a node lies above the horizon of a surface as a whole, its irradiance is the product of its
//! vector irradiance with the normal; only leaves across the horizon are cut off there.

mod growth;

use std::f32::consts::PI;

use glam::{Vec2, Vec3, Vec4};

use super::light_tree::{Arriving, Target};
use crate::{
    geometry::{irradiance_vector, triangle_point},
    hierarchy::{Moments, Reading},
    scene::Sky,
    transport::luminance,
};

/// Fewest samples of a picture by which its radiance is distributed over leaves. Fewer make even skies uneven; more
/// take time before the first picture.
const LEAST_SAMPLES: usize = 1 << 18;

/// Smallest cosine at which what a ray sees is told to others. Smaller, and a ray along the horizon counts too much;
/// larger, and places see less than they should by it.
const LEAST_COSINE: f32 = 0.1;

/// Step across an edge to the leaf behind it, as a share of the height on the edge.
const STEP_ACROSS: f32 = 0.1;

/// A node: a spherical triangle.
#[derive(Clone, Debug)]
struct Node {
    /// Directions of the corners: the first and the last are where the curve enters and leaves.
    path: [Vec3; 3],
    /// Vector irradiance, W/m², by axis.
    vector: [Vec4; 3],
    /// Index of the first of two children; 0 for a leaf.
    first_child: u32,
    /// Radiosity of a surface of the radiance of a leaf, W/m².
    radiosity: Vec4,
    /// Solid angle over π: irradiance of a leaf of radiosity 1 at normal incidence.
    facing_share: f32,
    /// Normal of the plane between its children, towards the first.
    halving: Vec3,
}

/// The sky as an emitter.
#[derive(Clone, Debug)]
pub(crate) struct SkyTree {
    /// The octants, then pairs of children.
    nodes: Vec<Node>,
    /// By node, the leaves across the edges of a leaf.
    neighbours: Vec<[u32; 3]>,
    /// If its light is to be that of a link: its moments as those of a cluster around the scene whose surfaces face
    /// inwards, and how they are read.
    table: Option<(Moments<Vec4>, Reading)>,
    /// The angular width of most of its light, radians.
    width: f32,
}

/// A ray to the sky or to the sun.
#[derive(Clone, Copy, Debug)]
pub(super) struct OutsideRay {
    /// Unit direction.
    pub direction: Vec3,
    /// Its irradiance over its probability density, up to a factor that is the same for all rays from a point.
    pub weight: f32,
    /// Colour of luminance 1.
    pub color: Vec4,
    /// The leaf of the sky's tree; 0 for the sun.
    pub leaf: u32,
}

impl Node {
    fn leaf(path: [Vec3; 3], radiosity: Vec4) -> Self {
        let vector = irradiance_vector(Vec3::ZERO, facing(path));
        Self {
            path,
            vector: vector.to_array().map(|component| radiosity * component),
            first_child: 0,
            radiosity,
            facing_share: solid_angle(path) / PI,
            halving: Vec3::ZERO,
        }
    }

    /// Where it lies relative to a horizon: wholly above, wholly below, or across.
    fn side_of(&self, normal: Vec3) -> Option<bool> {
        let heights = self.path.map(|corner| corner.dot(normal));
        if heights.iter().all(|&height| height >= 0.0) {
            Some(true)
        } else if heights.iter().all(|&height| height <= 0.0) {
            Some(false)
        } else {
            None
        }
    }

    /// Mean height above the horizon of a leaf across it, with 0 for its part below: that of a flat triangle, over which
    /// heights are linear. Leaves are small and cosines at the horizon, too, so that the sky's irradiance is right to
    /// 1e-4.
    fn mean_height_above(&self, normal: Vec3) -> f32 {
        let heights = self.path.map(|corner| corner.dot(normal));
        // The corner alone on its side of the horizon cuts off a triangle.
        let is_above = heights.map(|height| height > 0.0);
        let majority = is_above.into_iter().filter(|&above| above).count() >= 2;
        let alone = (0..3).find(|&side| is_above[side] != majority).unwrap_or(0);
        let [apex, b, c] = [0, 1, 2].map(|step| heights[(alone + step) % 3]);
        let cut_off = apex.powi(3) / (3.0 * (apex - b) * (apex - c));
        match majority {
            true => (heights.iter().sum::<f32>() / 3.0 - cut_off).max(0.0),
            false => cut_off.max(0.0),
        }
    }

    /// Irradiance of a node that lies above the horizon.
    fn whole(&self, normal: Vec3) -> Vec4 {
        let [x, y, z] = self.vector;
        (x * normal.x + y * normal.y + z * normal.z).max(Vec4::ZERO)
    }
}

impl SkyTree {
    /// The tree over a sky; `None` if it is dark. With a reading its unoccluded irradiance is that of the directional
    /// table of a cluster around the scene.
    pub(super) fn new(sky: &Sky, reading: Option<Reading>) -> Option<Self> {
        if sky.is_dark() {
            return None;
        }
        let mut tree = match sky {
            Sky::Dark => return None,
            Sky::Uniform(radiance) => {
                let radiosity = (*radiance * PI).extend(0.0);
                Self::grown(&mut [], |_, _| radiosity)
            }
            Sky::Picture(picture) => {
                let mut samples = picture.samples(LEAST_SAMPLES);
                Self::grown(&mut samples, |path, samples| {
                    let power = samples
                        .iter()
                        .map(|sample| sample.radiance * sample.solid_angle);
                    (power.sum::<Vec3>() * (PI / solid_angle(path))).extend(0.0)
                })
            }
        };
        tree.carry_up();
        tree.find_neighbours();
        tree.width = tree.find_width();
        tree.table = reading.map(|reading| (tree.moments(), reading));
        Some(tree)
    }

    /// The angular width of most of its light, radians: that of as many leaves as would give its light if all were alike.
    fn find_width(&self) -> f32 {
        let leaves = self.nodes.iter().filter(|node| node.first_child == 0);
        let (mut sum, mut squares, mut angles) = (0.0, 0.0, 0.0);
        for leaf in leaves {
            let (angle, light) = (solid_angle(leaf.path), luminance(leaf.radiosity));
            angles += angle;
            sum += angle * light;
            squares += angle * light * light;
        }
        let part = if squares > 0.0 {
            sum * sum / (squares * angles)
        } else {
            1.0
        };
        (4.0 * part).sqrt().min(1.0)
    }

    /// See [`Self::find_width`].
    pub(super) fn width(&self) -> f32 {
        self.width
    }

    /// Compute the vector irradiances of parents, children before parents.
    fn carry_up(&mut self) {
        for index in (0..self.nodes.len()).rev() {
            if let Some([first, second]) = self.children(index) {
                let pairs = self.nodes[first]
                    .vector
                    .into_iter()
                    .zip(self.nodes[second].vector);
                let sums: Vec<Vec4> = pairs.map(|(a, b)| a + b).collect();
                self.nodes[index].vector.copy_from_slice(&sums);
            }
        }
    }

    /// Find the leaves across the edges of each leaf.
    fn find_neighbours(&mut self) {
        let across = |node: &Node| {
            let [a, b, c] = node.path;
            let beyond = |a: Vec3, b: Vec3, c: Vec3| {
                let middle = (a + b) * 0.5;
                self.leaf_towards(middle + (middle - c) * STEP_ACROSS)
            };
            [beyond(a, b, c), beyond(b, c, a), beyond(c, a, b)]
        };
        self.neighbours = self.nodes.iter().map(across).collect();
    }

    pub(super) fn node_count(&self) -> usize {
        self.nodes.len()
    }

    /// The leaves across the edges of a leaf.
    pub(super) fn neighbours(&self, leaf: u32) -> [u32; 3] {
        self.neighbours[leaf as usize]
    }

    fn children(&self, node: usize) -> Option<[usize; 2]> {
        let first = self.nodes[node].first_child as usize;
        (first != 0).then_some([first, first + 1])
    }

    fn leaves(&self) -> impl Iterator<Item = &Node> {
        self.nodes.iter().filter(|node| node.first_child == 0)
    }

    /// Moments of the sky as a cluster of surfaces that face inwards.
    fn moments(&self) -> Moments<Vec4> {
        let mut moments = Moments::default();
        for leaf in self.leaves() {
            moments.add(
                -irradiance_vector(Vec3::ZERO, facing(leaf.path)),
                leaf.radiosity,
            );
        }
        moments
    }

    /// Upper bound of the irradiance by channel, W/m².
    pub(super) fn brightest(&self) -> Vec4 {
        let even = self
            .leaves()
            .map(|leaf| leaf.radiosity)
            .fold(Vec4::ZERO, Vec4::max);
        let all = self
            .leaves()
            .map(|leaf| leaf.radiosity * solid_angle(leaf.path));
        even.min(all.sum::<Vec4>() / PI)
    }

    /// Radiosity of a surface of the radiance of the sky (luminance), W/m², if that is the same in all directions.
    pub(super) fn even_radiosity(&self) -> Option<f32> {
        let mut leaves = self.leaves().map(|leaf| leaf.radiosity);
        let first = leaves.next()?;
        leaves
            .all(|radiosity| radiosity == first)
            .then(|| luminance(first))
    }

    /// Mean of the unoccluded irradiance over all normals, W/m².
    pub(super) fn mean_irradiance(&self) -> Vec4 {
        let all = self
            .leaves()
            .map(|leaf| leaf.radiosity * solid_angle(leaf.path));
        all.sum::<Vec4>() / (4.0 * PI)
    }

    /// Unoccluded irradiance of a surface with this unit normal, W/m²; `cut` is set to its parts along the curve.
    pub(super) fn unoccluded(&self, normal: Vec3, cut: &mut Vec<Arriving>) -> Vec4 {
        cut.clear();
        let mut sums = (Vec4::ZERO, 0.0);
        for octant in 0..OCTANTS {
            self.add_to_cut(octant, normal, cut, &mut sums);
        }
        match &self.table {
            Some((moments, reading)) => moments.project(-normal, *reading).max(Vec4::ZERO),
            None => sums.0,
        }
    }

    /// Add a node to a cut, with the sums so far of irradiance and of its luminance.
    fn add_to_cut(
        &self,
        index: usize,
        normal: Vec3,
        cut: &mut Vec<Arriving>,
        sums: &mut (Vec4, f32),
    ) {
        let node = &self.nodes[index];
        let irradiance = match (node.side_of(normal), self.children(index)) {
            (Some(false), _) => return,
            (Some(true), _) => node.whole(normal),
            (None, Some(children)) => {
                for child in children {
                    self.add_to_cut(child, normal, cut, sums);
                }
                return;
            }
            (None, None) => self.leaf_irradiance(index, normal),
        };
        sums.0 += irradiance;
        sums.1 += luminance(irradiance);
        let target = Target::Node(index as u32);
        cut.push(Arriving {
            until: sums.1,
            target,
        });
    }

    /// The leaf in a direction, which need not be a unit vector.
    pub(super) fn leaf_towards(&self, direction: Vec3) -> u32 {
        let holds = |&octant: &usize| {
            let corners = self.nodes[octant].path;
            corners.iter().all(|corner| corner.dot(direction) >= 0.0)
        };
        let mut index = (0..OCTANTS).find(holds).unwrap_or(0);
        while let Some([first, second]) = self.children(index) {
            let is_first = self.nodes[index].halving.dot(direction) >= 0.0;
            index = if is_first { first } else { second };
        }
        index as u32
    }

    /// Irradiance of a leaf, W/m², without its part below the horizon.
    pub(super) fn leaf_irradiance(&self, leaf: usize, normal: Vec3) -> Vec4 {
        let node = &self.nodes[leaf];
        match node.side_of(normal) {
            Some(false) => Vec4::ZERO,
            Some(true) => node.whole(normal),
            None => node.radiosity * (node.facing_share * node.mean_height_above(normal)),
        }
    }

    /// Luminance of the irradiance of a leaf, W/m², as at a height above the horizon of about [`LEAST_COSINE`] or more.
    pub(super) fn least_irradiance(&self, leaf: u32, normal: Vec3) -> f32 {
        let node = &self.nodes[leaf as usize];
        let most = Vec3::from_array(node.vector.map(luminance)).length();
        luminance(self.leaf_irradiance(leaf as usize, normal)).max(LEAST_COSINE * most)
    }

    /// A ray into a node of a cut, for a uniform number `place` in 0…1 and a point of the unit square; `share` is the
    /// luminance of the node's irradiance. `None` below the horizon.
    pub(super) fn aim(
        &self,
        index: usize,
        share: f32,
        normal: Vec3,
        mut place: f32,
        square: Vec2,
    ) -> Option<OutsideRay> {
        // A leaf of the node, with the probability of its irradiance.
        let (mut index, mut chance) = (index, share);
        while let Some([first, second]) = self.children(index) {
            let [a, b] = [first, second].map(|child| luminance(self.nodes[child].whole(normal)));
            let of_first = match a / (a + b) {
                share if share.is_finite() => share,
                _ => 0.5,
            };
            (index, chance, place) = if place < of_first {
                (first, chance * of_first, place / of_first)
            } else {
                let rest = 1.0 - of_first;
                (second, chance * rest, (place - of_first) / rest)
            };
        }
        // A point of its flat triangle.
        let node = &self.nodes[index];
        let [a, b, c] = facing(node.path);
        let at = triangle_point(square);
        let point = a * at.x + b * at.y + c * at.z;
        let inwards = (b - a).cross(c - a) * 0.5;
        let squared = point.length_squared();
        let cosines = -point.dot(inwards) * point.dot(normal);
        let brightness = luminance(node.radiosity);
        let weight = brightness * cosines / (PI * squared * squared * chance);
        (weight.is_finite() && weight > 0.0).then(|| OutsideRay {
            direction: point / squared.sqrt(),
            weight,
            color: node.radiosity / brightness,
            leaf: index as u32,
        })
    }
}

const OCTANTS: usize = 8;

/// The octants of the sphere, in the order of the curve.
fn octants() -> impl Iterator<Item = [Vec3; 3]> {
    const AROUND: [Vec3; 4] = [Vec3::X, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Z];
    [Vec3::Y, Vec3::NEG_Y]
        .into_iter()
        .flat_map(|pole| (0..4).map(move |side| [AROUND[side], pole, AROUND[(side + 1) % 4]]))
}

/// The same triangle, wound so that its front faces the centre of the sphere.
fn facing([a, b, c]: [Vec3; 3]) -> [Vec3; 3] {
    if a.dot(b.cross(c)) > 0.0 {
        [a, c, b]
    } else {
        [a, b, c]
    }
}

/// Solid angle of a spherical triangle of unit vectors, steradians (Van Oosterom and Strackee, 1983).
fn solid_angle([a, b, c]: [Vec3; 3]) -> f32 {
    let volume = a.dot(b.cross(c)).abs();
    2.0 * volume.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
}

#[cfg(test)]
mod tests;
