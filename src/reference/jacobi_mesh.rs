//! Equal elements for stochastic Jacobi radiosity: triangles as they are, large ones cut into n² alike.
//!
//! Elements carry what arrives; vertices average it, so that light is shown without facets. Elements of neighbouring
//! triangles share a vertex where their corners coincide and the angle between their faces is small.

use std::collections::HashMap;

use glam::{IVec3, Vec3};

use crate::scene::{Scene, TriangleId};

/// Cuts per edge at most: 4096² elements of one triangle are more than any memory holds.
const MOST_CUTS: u32 = 4096;

/// Corners this near are the same, in frame units: far above the rounding of a midpoint, far below an element.
const WELD: f32 = 1e-5;

/// Faces whose normals differ by more than 30° are lit apart, as in the solver that this is compared with.
const SMOOTH_COSINE: f32 = 0.866;

/// A lit side of a triangle and its elements.
struct Side {
    triangle: TriangleId,
    is_back: bool,
    normal: Vec3,
    /// Elements per edge.
    cuts: u32,
    first_element: u32,
}

/// Elements and vertices over all lit sides.
pub(super) struct ElementMesh {
    sides: Vec<Side>,
    /// Per triangle of the scene: its front in `sides`; the back follows where it is lit.
    side_of: Vec<u32>,
    /// The side of each element.
    owner: Vec<u32>,
    /// Vertices of each element.
    vertices: Vec<[u32; 3]>,
    vertex_count: usize,
}

impl ElementMesh {
    /// Cut every triangle that is larger than `max_area` (square frame units) into equal elements.
    pub(super) fn new(scene: &Scene, max_area: f32) -> Self {
        let mut mesh = Self {
            sides: Vec::new(),
            side_of: Vec::with_capacity(scene.triangles.len()),
            owner: Vec::new(),
            vertices: Vec::new(),
            vertex_count: 0,
        };
        let mut welder = Welder::default();
        for triangle in scene.triangle_ids() {
            mesh.side_of.push(mesh.sides.len() as u32);
            let area_vector = scene.surfaces[triangle.index()].area_vector;
            let cuts = ((area_vector.length() / max_area).sqrt().ceil() as u32).clamp(1, MOST_CUTS);
            let front = area_vector.normalize_or_zero();
            let backs = usize::from(scene.triangles[triangle.index()].two_sided);
            for is_back in [false, true].into_iter().take(1 + backs) {
                let side = Side {
                    triangle,
                    is_back,
                    normal: if is_back { -front } else { front },
                    cuts,
                    first_element: mesh.owner.len() as u32,
                };
                mesh.cut(scene, side, &mut welder);
            }
        }
        mesh.vertex_count = welder.count as usize;
        mesh
    }

    /// Add a side with its elements, row by row; odd places in a row hold those that point the other way.
    fn cut(&mut self, scene: &Scene, side: Side, welder: &mut Welder) {
        let corners = scene.corners(side.triangle);
        let mut vertex = |row: u32, column: u32| {
            welder.vertex(place(corners, side.cuts, row, column), side.normal)
        };
        for row in 0..side.cuts {
            for column in 0..side.cuts - row {
                let [right, up] = [vertex(row, column + 1), vertex(row + 1, column)];
                self.vertices.push([vertex(row, column), right, up]);
                if column + 1 < side.cuts - row {
                    self.vertices.push([right, vertex(row + 1, column + 1), up]);
                }
            }
        }
        self.owner
            .resize(self.vertices.len(), self.sides.len() as u32);
        self.sides.push(side);
    }

    /// Number of elements.
    pub(super) fn len(&self) -> usize {
        self.owner.len()
    }

    /// The triangle under an element, and whether the element lies on its back.
    pub(super) fn side_of_element(&self, element: usize) -> (TriangleId, bool) {
        let side = &self.sides[self.owner[element] as usize];
        (side.triangle, side.is_back)
    }

    /// Unit normal of an element.
    pub(super) fn normal(&self, element: usize) -> Vec3 {
        self.sides[self.owner[element] as usize].normal
    }

    /// Area of an element, square frame units.
    pub(super) fn area(&self, scene: &Scene, element: usize) -> f32 {
        let side = &self.sides[self.owner[element] as usize];
        let whole = scene.surfaces[side.triangle.index()].area_vector.length();
        whole / (side.cuts * side.cuts) as f32
    }

    /// The point of an element with these barycentric coordinates.
    pub(super) fn point(&self, scene: &Scene, element: usize, barycentric: Vec3) -> Vec3 {
        let side = &self.sides[self.owner[element] as usize];
        let (row, column, is_flipped) = cell(element as u32 - side.first_element, side.cuts);
        let corners = scene.corners(side.triangle);
        let at = |row, column| place(corners, side.cuts, row, column);
        let first = if is_flipped {
            at(row + 1, column + 1)
        } else {
            at(row, column)
        };
        first * barycentric.x
            + at(row, column + 1) * barycentric.y
            + at(row + 1, column) * barycentric.z
    }

    /// The element at barycentric coordinates of a triangle's side, and the coordinates within it, in the order of
    /// its vertices. `None` where that side is not lit.
    pub(super) fn find(
        &self,
        triangle: TriangleId,
        is_back: bool,
        barycentric: Vec3,
    ) -> Option<(usize, Vec3)> {
        let front = self.side_of[triangle.index()] as usize;
        let side = self.sides.get(front + usize::from(is_back))?;
        if side.triangle != triangle {
            return None;
        }
        let cuts = side.cuts as f32;
        // The first corner is the origin; columns run to the second, rows to the third.
        let (across, up) = (barycentric.y * cuts, barycentric.z * cuts);
        let row = (up.max(0.0) as u32).min(side.cuts - 1);
        let column = (across.max(0.0) as u32).min(side.cuts - 1 - row);
        let (u, v) = (across - column as f32, up - row as f32);
        let is_flipped = u + v > 1.0 && column + 1 < side.cuts - row;
        let within = if is_flipped {
            // Vertices: right, opposite, up.
            Vec3::new(1.0 - v, u + v - 1.0, 1.0 - u)
        } else {
            Vec3::new(1.0 - u - v, u, v)
        };
        let within = within.max(Vec3::ZERO);
        let index = side.first_element + index_in_side(row, column, side.cuts);
        let element = index as usize + usize::from(is_flipped);
        Some((
            element,
            within / within.element_sum().max(f32::MIN_POSITIVE),
        ))
    }

    /// Vertices of an element.
    pub(super) fn vertices(&self, element: usize) -> [u32; 3] {
        self.vertices[element]
    }

    /// Number of vertices.
    pub(super) fn vertex_count(&self) -> usize {
        self.vertex_count
    }

    /// Bytes in use.
    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(self.sides.as_slice())
            + size_of_val(self.side_of.as_slice())
            + size_of_val(self.owner.as_slice())
            + size_of_val(self.vertices.as_slice())
    }
}

/// A point of the lattice that cuts a triangle.
fn place([a, b, c]: [Vec3; 3], cuts: u32, row: u32, column: u32) -> Vec3 {
    let scale = 1.0 / cuts as f32;
    a + (b - a) * (column as f32 * scale) + (c - a) * (row as f32 * scale)
}

/// Place of the upright element of a row and column among the elements of a side.
fn index_in_side(row: u32, column: u32, cuts: u32) -> u32 {
    row * (2 * cuts - row) + 2 * column
}

/// Row, column, and whether it is flipped, of an element by its place in its side.
fn cell(index: u32, cuts: u32) -> (u32, u32, bool) {
    // Rows below `row` hold cuts² − (cuts − row)² elements; the root may be off by its rounding.
    let above = f64::from(cuts * cuts - index).sqrt();
    let mut row = (f64::from(cuts) - above).max(0.0) as u32;
    while index_in_side(row + 1, 0, cuts) <= index {
        row += 1;
    }
    while index_in_side(row, 0, cuts) > index {
        row -= 1;
    }
    let rest = index - index_in_side(row, 0, cuts);
    (row, rest / 2, rest % 2 == 1)
}

/// Gives corners at one place and of about one normal the same number.
#[derive(Default)]
struct Welder {
    at: HashMap<IVec3, Vec<(Vec3, u32)>>,
    count: u32,
}

impl Welder {
    fn vertex(&mut self, position: Vec3, normal: Vec3) -> u32 {
        let key = (position / WELD).round().as_ivec3();
        let here = self.at.entry(key).or_default();
        let known = here
            .iter()
            .find(|(other, _)| other.dot(normal) >= SMOOTH_COSINE);
        if let Some(&(_, vertex)) = known {
            return vertex;
        }
        let vertex = self.count;
        self.count += 1;
        here.push((normal, vertex));
        vertex
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        geometry::{Random, triangle_point},
        scene::{SceneOptions, builtin::furnace},
    };

    #[test]
    fn an_element_is_found_at_each_of_its_points() {
        let scene = furnace(0.5, 0.5, 1)
            .finish(&SceneOptions::default())
            .unwrap();
        let mesh = ElementMesh::new(&scene, scene.surfaces[0].area_vector.length() / 30.0);
        assert_eq!(mesh.len(), 12 * 36);
        let mut random = Random::new(1, 2);
        for element in 0..mesh.len() {
            // Away from the edges, where rounding may choose the neighbour.
            let within = triangle_point(random.uniform_2d()) * 0.97 + Vec3::splat(0.01);
            let [first, ..] = mesh.vertices(element);
            let point = mesh.point(&scene, element, within);
            let (triangle, is_back) = mesh.side_of_element(element);
            let place = crate::geometry::barycentric(point, scene.corners(triangle));
            let (found, coordinates) = mesh.find(triangle, is_back, place).unwrap();
            assert_eq!(found, element, "{within}");
            let (row, column, is_flipped) = cell(element as u32 % 36, 6);
            assert_eq!(
                index_in_side(row, column, 6) + u32::from(is_flipped),
                element as u32 % 36
            );
            // A flipped element names its vertices in another order than its points do.
            let expected = if is_flipped {
                Vec3::new(within.y, within.x, within.z)
            } else {
                within
            };
            assert!(
                (coordinates - expected).abs().max_element() < 1e-3,
                "{element}: {coordinates} for {expected}, vertex {first}"
            );
        }
        // 6 faces of 7² lattice points of their own: every edge of the cube is a crease.
        assert_eq!(mesh.vertex_count(), 6 * 49);
    }
}
