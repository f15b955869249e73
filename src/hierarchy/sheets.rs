//! The two sides of sheets, distinguished over whole surfaces.
//!
//! A sheet separates two spaces, and what one of its sides sees the other does not. A cluster that holds both sides of a
//! tube has faces that look the same way and yet do not see the same: one visibility for all of them lights the inside of
//! the tube with half of what its outside should get. So the light tree is divided by sides first and by places then.
//!
//! Over an edge that two triangles share, a side goes on as it is. Surfaces that share no edges are matched by what their
//! sides see of each other: a floor sees the outside of a column, and so both belong to the same half of the tree.

use std::{collections::BTreeMap, sync::Arc};

use rayon::prelude::*;

use crate::{
    geometry::{Random, RayTree, cosine_direction, triangle_point},
    scene::{DisjointSets, Scene, TriangleId, half_edges},
};

/// Rays that find which sides see each other. With fewer, columns whose share of the area is below one over this number
/// are matched by chance; more delay the first picture: these take about a twentieth of a second.
const SIGHT_RAYS: usize = 1 << 15;

/// Which half of the light tree each side of a triangle belongs to.
#[derive(Clone, Debug)]
pub struct SheetSides {
    /// By triangle, whether its front belongs to the second half and its back to the first.
    is_turned: Vec<bool>,
}

impl SheetSides {
    /// Find the sides of a scene; `None` where no surface has two. Makes the ray tree of the scene where it is needed
    /// and not there yet.
    pub fn of(scene: &Scene, rays: &mut Option<Arc<RayTree>>) -> Option<Self> {
        let corners: Vec<[u32; 3]> = scene.triangles.iter().map(|face| face.corners).collect();
        let twins = twins(&corners);
        let has_sheets = scene.triangles.iter().any(|face| face.two_sided);
        if !has_sheets && twins.is_empty() {
            return None;
        }
        let mut sides = Sides(DisjointSets::new(2 * corners.len()));
        sides.join_over_edges(&corners, &twins);
        let rays = rays.get_or_insert_with(|| Arc::new(RayTree::new(scene)));
        sides.join_by_sight(scene, rays);
        Some(Self {
            is_turned: sides.turned(scene),
        })
    }

    /// Whether a side of a triangle belongs to the second half.
    pub(super) fn is_in_second(&self, triangle: TriangleId, is_back: bool) -> bool {
        self.is_turned[triangle.index()] != is_back
    }
}

/// Sets of sides that belong together: 2 i is the front of triangle i, 2 i + 1 its back. The two sides of a triangle are
/// never in one set, and what holds for some sides holds for those behind them.
struct Sides(DisjointSets);

/// The side behind another one.
fn behind(side: u32) -> u32 {
    side ^ 1
}

impl Sides {
    /// Join two sides, and those behind them. Where that would make the two sides of a surface one, as along a Möbius
    /// strip, they stay apart.
    fn join(&mut self, a: u32, b: u32) {
        if self.0.root(a) != self.0.root(behind(b)) {
            self.0.join(a, b);
            self.0.join(behind(a), behind(b));
        }
    }

    /// A surface by its least side, and whether a side of it is on the other side than that.
    fn surface(&mut self, side: u32) -> (u32, bool) {
        let (own, other) = (self.0.root(side), self.0.root(behind(side)));
        (own.min(other), other < own)
    }

    /// Join what is one surface. The back of a triangle may be another one.
    fn join_over_edges(&mut self, corners: &[[u32; 3]], twins: &[Twins]) {
        let mut is_second = vec![false; corners.len()];
        for twins in twins {
            is_second[twins.second as usize] = true;
            self.join(
                2 * twins.first,
                2 * twins.second + u32::from(twins.is_turned),
            );
        }
        let single: Vec<u32> = (0..corners.len() as u32)
            .filter(|&triangle| !is_second[triangle as usize])
            .collect();
        let edges = half_edges(single.iter().map(|&triangle| corners[triangle as usize]));
        for group in edges.chunk_by(|a, b| a.ends == b.ends) {
            if let [a, b] = group {
                let [first, second] = [a, b].map(|edge| single[edge.triangle as usize]);
                let is_turned = a.is_forward == b.is_forward;
                self.join(2 * first, 2 * second + u32::from(is_turned));
            }
        }
    }

    /// Join sides of surfaces that see each other, those first that see most.
    fn join_by_sight(&mut self, scene: &Scene, rays: &RayTree) {
        // The number of rays that join the smallest sides of two surfaces, less the number that join the others.
        let mut votes: BTreeMap<[u32; 2], i32> = BTreeMap::new();
        for [from, met] in sights(scene, rays) {
            let ((a, a_turned), (b, b_turned)) = (self.surface(from), self.surface(met));
            if a != b {
                *votes.entry([a.min(b), a.max(b)]).or_default() +=
                    if a_turned == b_turned { 1 } else { -1 };
            }
        }
        let mut votes: Vec<([u32; 2], i32)> = votes.into_iter().collect();
        votes.sort_by_key(|&(_, count)| std::cmp::Reverse(count.abs()));
        for ([a, b], count) in votes {
            match count {
                0 => {}
                1.. => self.join(a, b),
                _ => self.join(a, behind(b)),
            }
        }
    }

    /// Whether the front of each triangle is not in that of the two sets of its surface that has more fronts.
    fn turned(&mut self, scene: &Scene) -> Vec<bool> {
        let mut fronts = vec![0.0f64; 2 * scene.triangles.len()];
        for (triangle, surface) in scene.surfaces.iter().enumerate() {
            let set = self.0.root(2 * triangle as u32);
            fronts[set as usize] += f64::from(surface.area_vector.length());
        }
        let is_turned = |triangle: u32| {
            let [front, back] = [0, 1].map(|side| self.0.root(2 * triangle + side));
            let [by_front, by_back] = [front, back].map(|set| fronts[set as usize]);
            by_front < by_back || by_front == by_back && back < front
        };
        (0..scene.triangles.len() as u32).map(is_turned).collect()
    }
}

/// A triangle, and a later one that has the same corners.
struct Twins {
    first: u32,
    second: u32,
    /// Whether the second looks the other way.
    is_turned: bool,
}

/// All triangles that share their corners with an earlier one.
fn twins(corners: &[[u32; 3]]) -> Vec<Twins> {
    let keyed = |(triangle, &[a, b, c]): (usize, &[u32; 3])| {
        let mut sorted = [a, b, c];
        sorted.sort_unstable();
        let is_even = [[a, b, c], [b, c, a], [c, a, b]].contains(&sorted);
        (sorted, triangle as u32, is_even)
    };
    let mut keyed: Vec<([u32; 3], u32, bool)> = corners.par_iter().enumerate().map(keyed).collect();
    keyed.par_sort_unstable();
    let twins = |run: &[([u32; 3], u32, bool)]| {
        let (_, first, is_even) = run[0];
        let later = run[1..].iter().map(move |next| Twins {
            first,
            second: next.1,
            is_turned: next.2 != is_even,
        });
        later.collect::<Vec<Twins>>()
    };
    keyed.chunk_by(|a, b| a.0 == b.0).flat_map(twins).collect()
}

/// Pairs of lit sides of which the first sees the second, by rays from points spread evenly over the area.
fn sights(scene: &Scene, rays: &RayTree) -> Vec<[u32; 2]> {
    let mut sum = 0.0;
    let sums = scene.surfaces.iter().map(|surface| {
        sum += f64::from(surface.area_vector.length());
        sum
    });
    let sums: Vec<f64> = sums.collect();
    let sight = |index: usize| {
        let mut random = Random::new(0, index as u64);
        let target = (index as f64 + 0.5) / SIGHT_RAYS as f64 * sum;
        let triangle = sums.partition_point(|&sum| sum <= target);
        let triangle = triangle.min(sums.len() - 1);
        let is_back = scene.triangles[triangle].two_sided && random.uniform() < 0.5;
        let id = TriangleId(triangle as u32);
        let [a, b, c] = scene.corners(id);
        let at = triangle_point(random.uniform_2d());
        let front = scene.surfaces[triangle].area_vector.normalize_or_zero();
        let normal = if is_back { -front } else { front };
        let direction = cosine_direction(normal, random.uniform_2d());
        let hit = rays.closest(a * at.x + b * at.y + c * at.z, direction, Some(id))?;
        let met = hit.triangle.index();
        let meets_back = scene.surfaces[met].area_vector.dot(direction) > 0.0;
        let is_lit = !meets_back || scene.triangles[met].two_sided;
        is_lit.then(|| [(triangle, is_back), (met, meets_back)].map(side))
    };
    (0..SIGHT_RAYS).into_par_iter().filter_map(sight).collect()
}

/// A side of a triangle by number.
fn side((triangle, is_back): (usize, bool)) -> u32 {
    2 * triangle as u32 + u32::from(is_back)
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};

    use super::*;
    use crate::{
        hierarchy::Hierarchy,
        scene::{Material, SceneBuilder, SceneOptions, Sides as Sidedness},
    };

    #[test]
    fn surfaces_with_one_side_alone_are_left_as_they_are() {
        const QUADS: u32 = 24;
        let mut builder = SceneBuilder::default();
        let grey = Material::plain("grey", Vec3::splat(0.5), Vec3::ONE);
        let material = builder.push_material(grey);
        // The edges of a Möbius strip meet after a turn with their ends exchanged.
        let on_strip = |number: u32, across: f64| {
            let turn = std::f64::consts::TAU * f64::from(number) / f64::from(QUADS);
            let (sin, cos) = turn.sin_cos();
            let (half_sin, half_cos) = (0.5 * turn).sin_cos();
            let out = 3.0 + across * half_cos;
            DVec3::new(out * cos, across * half_sin, out * sin)
        };
        let mut corner = |number, across| builder.push_position(on_strip(number, across));
        let ends: Vec<[u32; 3]> = (0..=QUADS)
            .map(|number| [-0.5, 0.0, 0.5].map(|across| corner(number, across)))
            .collect();
        for pair in ends.windows(2) {
            for half in 0..2 {
                let [a, b] = [pair[0][half], pair[1][half]];
                let [c, d] = [pair[1][half + 1], pair[0][half + 1]];
                builder.push_triangle([a, b, c], material);
                builder.push_triangle([a, c, d], material);
            }
        }
        let options = SceneOptions::with_sides(Sidedness::Two);
        let scene = builder.finish(&options).unwrap();
        let sides = SheetSides::of(&scene, &mut None).unwrap();
        for index in 0..scene.triangles.len() as u32 {
            let [front, back] =
                [false, true].map(|is_back| sides.is_in_second(TriangleId(index), is_back));
            assert_ne!(front, back);
        }
        Hierarchy::new(&scene, 40.0).validate().unwrap();
    }

    #[test]
    fn a_back_that_is_another_triangle_counts_as_a_back() {
        let corners = [[0, 1, 2], [2, 1, 0], [1, 3, 2], [1, 2, 3]];
        let found = twins(&corners);
        let found: Vec<(u32, u32, bool)> = found
            .iter()
            .map(|twins| (twins.first, twins.second, twins.is_turned))
            .collect();
        assert_eq!(found, [(0, 1, true), (2, 3, true)]);
        let mut sides = Sides(DisjointSets::new(8));
        sides.join_over_edges(&corners, &twins(&corners));
        let [fronts, backs] = [[0, 3, 4, 7], [1, 2, 5, 6]];
        for (set, root) in [(fronts, 0), (backs, 1)] {
            assert_eq!(set.map(|side| sides.0.root(side)), [root; 4]);
        }
    }
}
