//! The lit sides of triangles, and which of them hang together.

use glam::Vec3;

use crate::scene::{HalfEdge, MaterialId, Scene, TriangleId, half_edges};

/// A side of a triangle that reflects and emits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Side {
    pub(super) triangle: TriangleId,
    pub(super) is_back: bool,
}

/// No neighbour.
const NONE: u32 = u32::MAX;

/// Cosine of the largest angle between neighbours that are shaded smoothly across their edge: 30°, as the solver has it by
/// default. Larger angles blend what light is apart.
const SMOOTH: f32 = 0.866;

impl Side {
    /// All of a scene, fronts before backs of each triangle.
    pub(super) fn all(scene: &Scene) -> Vec<Self> {
        let sides = scene.triangle_ids().flat_map(|triangle| {
            let two_sided = scene.triangles[triangle.index()].two_sided;
            let backs = two_sided.then_some(true);
            [false]
                .into_iter()
                .chain(backs)
                .map(move |is_back| Self { triangle, is_back })
        });
        sides.collect()
    }

    /// Corners counter-clockwise as seen from the lit side: those of the triangle by number.
    pub(super) fn order(self) -> [usize; 3] {
        if self.is_back { [0, 2, 1] } else { [0, 1, 2] }
    }

    /// Its corners as indices of positions.
    pub(super) fn points(self, scene: &Scene) -> [u32; 3] {
        let corners = scene.triangles[self.triangle.index()].corners;
        self.order().map(|corner| corners[corner])
    }

    /// Its corners in frame units.
    pub(super) fn corners(self, scene: &Scene) -> [Vec3; 3] {
        self.points(scene)
            .map(|point| scene.positions[point as usize])
    }

    /// Unit normal towards the lit side.
    pub(super) fn normal(self, scene: &Scene) -> Vec3 {
        let front = scene.surfaces[self.triangle.index()]
            .area_vector
            .normalize_or(Vec3::Y);
        if self.is_back { -front } else { front }
    }

    /// Area in square frame units.
    pub(super) fn area(self, scene: &Scene) -> f32 {
        scene.surfaces[self.triangle.index()].area_vector.length()
    }

    /// Its material.
    pub(super) fn material(self, scene: &Scene) -> MaterialId {
        scene.triangles[self.triangle.index()].material
    }
}

/// By side: the neighbours across its three edges over which light goes on smoothly.
pub(super) struct Neighbours(Vec<[u32; 3]>);

impl Neighbours {
    /// Those of all sides. Where a third triangle meets an edge, as a wall that stands on it, light differs on both sides of
    /// it.
    pub(super) fn of(scene: &Scene, sides: &[Side]) -> Self {
        let edges = half_edges(sides.iter().map(|side| side.points(scene)));
        let mut neighbours = vec![[NONE; 3]; sides.len()];
        let triangle = |half: &HalfEdge| sides[half.triangle as usize].triangle;
        let normal = |half: &HalfEdge| sides[half.triangle as usize].normal(scene);
        for run in edges.chunk_by(|a, b| a.ends == b.ends) {
            let first = triangle(&run[0]);
            let second = run.iter().map(triangle).find(|other| *other != first);
            let is_third =
                |half: &HalfEdge| triangle(half) != first && Some(triangle(half)) != second;
            if run.iter().any(is_third) {
                continue;
            }
            let (down, up) = run.split_at(run.partition_point(|half| !half.is_forward));
            for one in up {
                let others = down.iter().filter(|other| triangle(other) != triangle(one));
                let likeness = |other: &HalfEdge| normal(one).dot(normal(other));
                let best = others.max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
                let Some(other) = best.filter(|other| likeness(other) >= SMOOTH) else {
                    continue;
                };
                neighbours[one.triangle as usize][usize::from(one.side)] = other.triangle;
                neighbours[other.triangle as usize][usize::from(other.side)] = one.triangle;
            }
        }
        Self(neighbours)
    }

    /// Those of a side, with the edge that they share: edge 0 begins at its first corner.
    pub(super) fn about(&self, side: u32) -> impl Iterator<Item = (usize, u32)> + use<> {
        let all = self.0[side as usize].into_iter().enumerate();
        all.filter(|(_, other)| *other != NONE)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::{Material, SceneBuilder, SceneOptions, Sides};

    /// Two halves of a square in a plane; with a third triangle that stands on their common edge where asked for.
    fn square(has_wall: bool) -> Scene {
        let mut builder = SceneBuilder::default();
        let material = builder.push_material(Material::plain("", Vec3::splat(0.5), Vec3::ZERO));
        for place in [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.5, 0.5, 1.0],
        ] {
            builder.push_position(DVec3::from_array(place));
        }
        let wall = has_wall.then_some([0, 2, 4]);
        for corners in [[0, 1, 2], [0, 2, 3]].into_iter().chain(wall) {
            builder.push_triangle(corners, material);
        }
        builder
            .finish(&SceneOptions::with_sides(Sides::Two))
            .unwrap()
    }

    #[test]
    fn fronts_and_backs_have_neighbours_of_their_own_until_a_wall_stands_between() {
        for has_wall in [false, true] {
            let scene = square(has_wall);
            let sides = Side::all(&scene);
            assert_eq!(sides.len(), if has_wall { 6 } else { 4 });
            let neighbours = Neighbours::of(&scene, &sides);
            for side in 0..4_u32 {
                let about: Vec<u32> = neighbours.about(side).map(|(_, other)| other).collect();
                let expected = [2, 3, 0, 1][side as usize];
                let expected: &[u32] = if has_wall { &[] } else { &[expected] };
                assert_eq!(about, expected, "{side}");
            }
        }
    }
}
