//! Which patches face each other: tests of planes against the boxes of the light tree, before any light is computed.
//!
//! Two patches exchange light only where each has a part before the plane of the other. Patches that no chain of such
//! pairs joins to an emitter stays dark, whatever stands between. And where everything that light is computed for lies
//! on one side of the plane of each triangle, nothing stands between anything: the triangle can at most touch a line of
//! sight.

use glam::Vec3;
use rayon::prelude::*;

use super::{Patch, PatchTree};
use crate::{
    geometry::centroid,
    scene::{ActiveMaterials, Scene},
};

/// What is nearer to a plane than this lies in it, in frame units. Positions are rounded to 4e-6 there and normals
/// tilted by 6e-8, over 100 units: below 2e-5 flat walls would rise over themselves. Rays start at twice this distance,
/// so they cannot tell either. What it omits is the light between surfaces that rise over each other by less than a
/// two-millionth of the scene.
const IN_PLANE: f32 = 5e-5;

/// Nodes of the tree that are looked at for one patch. Fewer, and patches that nothing lights are kept; more, and
/// scenes of many sheets wait.
const MAX_NODES: u32 = 128;

/// Rounds of the flood. Light that needs more chained pairs is taken to reach everything: usual scenes need three.
const MOST_ROUNDS: u32 = 32;

/// A plane, and the side before it.
#[derive(Clone, Copy)]
struct Plane {
    point: Vec3,
    normal: Vec3,
}

impl Plane {
    fn of(scene: &Scene, patch: &Patch) -> Self {
        Self {
            point: centroid(scene.corners(patch.triangle)),
            normal: patch.normal,
        }
    }

    fn behind(self) -> Self {
        Self {
            normal: -self.normal,
            ..self
        }
    }

    /// Whether any part of a patch rises before the plane.
    fn sees(self, scene: &Scene, patch: &Patch) -> bool {
        let height = |corner: Vec3| (corner - self.point).dot(self.normal);
        let corners = scene.corners(patch.triangle);
        corners.into_iter().any(|corner| height(corner) > IN_PLANE)
    }

    /// Whether a box may.
    fn sees_box(self, min: Vec3, max: Vec3) -> bool {
        let (middle, half) = ((min + max) * 0.5, (max - min) * 0.5);
        (middle - self.point).dot(self.normal) + half.dot(self.normal.abs()) > IN_PLANE
    }
}

/// Some patches, and the clusters that hold any of them.
struct Marked {
    patches: Vec<bool>,
    clusters: Vec<bool>,
    /// The smallest cluster that holds all of them, and how many hold it.
    smallest: (usize, u32),
}

impl PatchTree {
    /// Which patches light may be exchanged with: those that no chain of patches that face each other joins to an
    /// emitter are false, and so are emitters that nothing faces. Conservative: true where it takes long to tell.
    /// Materials that are active count as if they emitted or reflected.
    pub fn lit(&self, scene: &Scene, active: &ActiveMaterials) -> Vec<bool> {
        let material = |patch: &Patch| scene.triangles[patch.triangle.index()].material;
        let emits = |patch: &Patch| patch.emission != Vec3::ZERO || active.emits(material(patch));
        let reflects = |patch: &Patch| {
            patch.reflectance != Vec3::ZERO
                || active.reflects(material(patch))
                || scene.materials[material(patch).index()].specular.is_some()
        };
        let all = self.marked(|_| true);
        let mut lit: Vec<bool> = self
            .patches
            .par_iter()
            .map_init(Vec::new, |pending, patch| {
                emits(patch) && self.faces_any(scene, patch, &all, pending)
            })
            .collect();
        let mut senders = self.marked(|index| lit[index]);
        let mut dark: Vec<usize> = (0..lit.len()).filter(|&index| !lit[index]).collect();
        for _ in 0..MOST_ROUNDS {
            let reached: Vec<usize> = dark
                .par_iter()
                .map_init(Vec::new, |pending, &index| {
                    self.faces_any(scene, &self.patches[index], &senders, pending)
                        .then_some(index)
                })
                .flatten()
                .collect();
            for &index in &reached {
                lit[index] = true;
            }
            dark.retain(|&index| !lit[index]);
            if dark.is_empty() || reached.is_empty() {
                return lit;
            }
            let mut sends = vec![false; lit.len()];
            for index in reached {
                sends[index] = reflects(&self.patches[index]);
            }
            senders = self.marked(|index| sends[index]);
        }
        vec![true; lit.len()]
    }

    fn marked(&self, is_marked: impl Fn(usize) -> bool) -> Marked {
        let patches: Vec<bool> = (0..self.patches.len()).map(is_marked).collect();
        let mut clusters = vec![false; self.clusters.len()];
        for (index, cluster) in self.clusters.iter().enumerate().rev() {
            clusters[index] = if cluster.is_leaf() {
                patches[cluster.patches()].contains(&true)
            } else {
                let first = cluster.first_child as usize;
                clusters[first] || clusters[first + 1]
            };
        }
        let smallest = self.smallest_marked(&clusters);
        Marked {
            patches,
            clusters,
            smallest,
        }
    }

    /// See [`Marked::smallest`].
    fn smallest_marked(&self, clusters: &[bool]) -> (usize, u32) {
        let (mut index, mut above) = (0, 0);
        while !self.clusters[index].is_leaf() {
            let first = self.clusters[index].first_child as usize;
            index = match [clusters[first], clusters[first + 1]] {
                [true, false] => first,
                [false, true] => first + 1,
                _ => break,
            };
            above += 1;
        }
        (index, above)
    }

    /// Whether a patch faces one of the marked patches, or it would take long to tell. `pending` is scratch space.
    fn faces_any(
        &self,
        scene: &Scene,
        patch: &Patch,
        marked: &Marked,
        pending: &mut Vec<usize>,
    ) -> bool {
        let plane = Plane::of(scene, patch);
        let (smallest, mut node_count) = marked.smallest;
        pending.clear();
        pending.push(smallest);
        while let Some(index) = pending.pop() {
            let cluster = &self.clusters[index];
            if !marked.clusters[index] || !plane.sees_box(cluster.min, cluster.max) {
                continue;
            }
            node_count += 1;
            if node_count > MAX_NODES {
                return true;
            }
            if !cluster.is_leaf() {
                pending.extend([0, 1].map(|child| cluster.first_child as usize + child));
                continue;
            }
            let faces = |other: usize| {
                let other = &self.patches[other];
                plane.sees(scene, other) && Plane::of(scene, other).sees(scene, patch)
            };
            if cluster
                .patches()
                .any(|other| marked.patches[other] && faces(other))
            {
                return true;
            }
        }
        false
    }

    /// Whether no triangle of the scene can stand between two patches of the tree: none has parts of them on both
    /// sides.
    pub fn is_clear(&self, scene: &Scene) -> bool {
        let blocks = |triangle: u32| {
            let corners = scene.corners(crate::scene::TriangleId(triangle));
            let area_vector = scene.surfaces[triangle as usize].area_vector;
            let plane = Plane {
                point: centroid(corners),
                normal: area_vector.as_dvec3().normalize_or_zero().as_vec3(),
            };
            self.rises(scene, plane) && self.rises(scene, plane.behind())
        };
        let count = scene.triangles.len() as u32;
        !(0..count).into_par_iter().any(blocks)
    }

    /// Whether nothing rises before the plane of any active patch, so that each sees half of the sky. Patches must be
    /// active on one side of each triangle at least.
    pub fn is_open(&self, scene: &Scene) -> bool {
        let patches = &self.patches[self.active_patches()];
        let is_covered = |patch: &Patch| self.rises(scene, Plane::of(scene, patch));
        !patches.par_iter().any(is_covered)
    }

    /// Whether any active patch has a part before a plane.
    fn rises(&self, scene: &Scene, plane: Plane) -> bool {
        let mut pending = vec![0usize];
        while let Some(index) = pending.pop() {
            let cluster = &self.clusters[index];
            if !plane.sees_box(cluster.min, cluster.max) {
                continue;
            }
            if !cluster.is_leaf() {
                pending.extend([0, 1].map(|child| cluster.first_child as usize + child));
            } else if self.patches[cluster.patches()]
                .iter()
                .any(|patch| plane.sees(scene, patch))
            {
                return true;
            }
        }
        false
    }

    /// Whether the active patches close a surface around what they face: each edge between two points belongs to two of them
    /// that run along it in opposite senses, and they do not face outward. Of a surface that is convex, as one without
    /// occlusion is, nothing rises before any patch then; nor does it where the two sides of a sheet share its rim.
    pub fn is_enclosed(&self, scene: &Scene) -> bool {
        let mut edges: Vec<(u32, u32, bool)> = Vec::with_capacity(self.active_patches().len() * 3);
        for patch in &self.patches[self.active_patches()] {
            let [a, b, c] = scene.triangles[patch.triangle.index()].corners;
            for (from, to) in [(a, b), (b, c), (c, a)] {
                edges.push((from.min(to), from.max(to), (from < to) != patch.is_back));
            }
        }
        edges.par_sort_unstable();
        edges
            .chunk_by(|a, b| (a.0, a.1) == (b.0, b.1))
            .all(|run| matches!(run, [(.., false), (.., true)]))
            && !self.is_open(scene)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::{Material, MaterialId, SceneBuilder, SceneOptions, Sides};

    const LIGHT: u32 = 0;
    const WHITE: u32 = 1;
    const BLACK: u32 = 2;

    /// A parallelogram: material, corner and two edges; the front looks along the edges' product.
    type Square = (u32, [f64; 3], [f64; 3], [f64; 3]);

    fn scene(sides: Sides, faces: &[Square]) -> Scene {
        let mut builder = SceneBuilder::default();
        let half = Vec3::splat(0.5);
        builder.push_material(Material::plain("light", half, Vec3::ONE));
        builder.push_material(Material::plain("white", half, Vec3::ZERO));
        builder.push_material(Material::plain("black", Vec3::ZERO, Vec3::ZERO));
        for &(material, corner, u, v) in faces {
            let [corner, u, v] = [corner, u, v].map(DVec3::from_array);
            let corners = [corner, corner + u, corner + u + v, corner + v];
            let [a, b, c, d] = corners.map(|corner| builder.push_position(corner));
            builder.push_triangle([a, b, c], MaterialId(material));
            builder.push_triangle([a, c, d], MaterialId(material));
        }
        builder.finish(&SceneOptions::with_sides(sides)).unwrap()
    }

    fn tree(scene: &Scene) -> PatchTree {
        PatchTree::build(scene, None, &|| false).unwrap()
    }

    /// For each parallelogram, whether light may reach its front.
    fn fronts(scene: &Scene) -> Vec<bool> {
        let tree = tree(scene);
        let lit = tree.lit(scene, &ActiveMaterials::default());
        let mut fronts = vec![false; scene.triangles.len() / 2];
        for (patch, is_lit) in tree.patches.iter().zip(lit) {
            fronts[patch.triangle.index() / 2] |= is_lit && !patch.is_back;
        }
        fronts
    }

    const X: [f64; 3] = [1.0, 0.0, 0.0];
    const Y: [f64; 3] = [0.0, 1.0, 0.0];
    const Z: [f64; 3] = [0.0, 0.0, 1.0];

    /// A lamp at the left looks right at a wall; a third face sees the wall only.
    fn chain(wall: u32) -> Scene {
        scene(
            Sides::One,
            &[
                (LIGHT, [0.0, 0.0, 0.0], Y, Z),
                (wall, [2.0, 0.0, 0.0], Z, Y),
                (WHITE, [-2.0, 0.0, 0.0], Y, Z),
                (WHITE, [-4.0, 0.0, 0.0], Z, Y),
            ],
        )
    }

    #[test]
    fn light_goes_on_from_white_walls_and_not_from_black_ones() {
        // The third face looks right, at the back of the lamp and at the wall; the fourth looks away from all.
        assert_eq!(fronts(&chain(WHITE)), [true, true, true, false]);
        assert_eq!(fronts(&chain(BLACK)), [true, true, false, false]);
    }

    #[test]
    fn an_emitter_that_nothing_faces_is_not_lit() {
        let faces = [
            (LIGHT, [0.0, 0.0, 0.0], Y, Z),
            (WHITE, [-2.0, 0.0, 0.0], Y, Z),
        ];
        assert_eq!(fronts(&scene(Sides::One, &faces)), [false, false]);
    }

    #[test]
    fn the_outside_of_a_box_is_dark_and_its_inside_clear_and_closed() {
        let one = [1.0, 1.0, 1.0];
        let back = |[x, y, z]: [f64; 3]| [-x, -y, -z];
        let walls = [
            (LIGHT, [0.0; 3], X, Y),
            (WHITE, [0.0; 3], Y, Z),
            (WHITE, [0.0; 3], Z, X),
            (WHITE, one, back(Y), back(X)),
            (WHITE, one, back(Z), back(Y)),
            (WHITE, one, back(X), back(Z)),
        ];
        let room = scene(Sides::Two, &walls);
        let both = tree(&room);
        let lit = both.lit(&room, &ActiveMaterials::default());
        let dark: Vec<bool> = lit.iter().map(|lit| !lit).collect();
        for (patch, &is_dark) in both.patches.iter().zip(&dark) {
            assert_eq!(patch.is_back, is_dark);
        }
        assert!(!both.is_enclosed(&room), "two sides share each edge");
        let inside = both.without(&room, None, &dark, &|| false).unwrap();
        assert_eq!(inside.active_patches(), 0..12);
        assert_eq!(inside.patches.len(), 24);
        assert!(inside.is_clear(&room) && inside.is_enclosed(&room));

        let open = scene(Sides::One, &walls[1..]);
        assert!(tree(&open).is_clear(&open) && !tree(&open).is_enclosed(&open));

        // Seen from outside, and as a sheet, it encloses nothing.
        let outward = walls.map(|(paint, corner, u, v)| (paint, corner, v, u));
        for body in [scene(Sides::One, &outward), scene(Sides::Two, &walls[..1])] {
            let around = tree(&body);
            assert!(around.is_clear(&body) && around.is_open(&body) && !around.is_enclosed(&body));
        }

        // A speck in the middle has parts of the room on both sides.
        let speck = (BLACK, [0.5, 0.5, 0.5], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0]);
        let furnished = scene(Sides::One, &[&walls[..], &[speck]].concat());
        assert!(!tree(&furnished).is_clear(&furnished));
    }
}
