//! Elements: patches divided into four, again and again, on vertices that neighbours share. Long thin ones are halved
//! across, so that their parts become less so.
//!
//! Points and vertices are kept apart. A point is a place; an edge between two points has one midpoint, whoever
//! divides it, so that no crack can open. A vertex is a point as one smooth surface sees it: faces on both sides of a
//! crease or of a material border have vertices of their own at the same point.
//! Neighbours stay within one level, so that an edge of a leaf carries at most one hanging point.

use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;

use super::{
    Patch,
    edge_leaves::{Edge, EdgeLeaves, EdgeMap},
    longest_edge_squared,
};
use crate::{
    geometry::barycentric_in_plane,
    scene::{DisjointSets, HalfEdge, Scene, half_edges},
};

/// Halvings at most, but for what balance asks: a hundred-thousandth of the largest triangle squared.
const DEEPEST_LEVEL: u8 = 64;

/// Elements whose radius is a smaller share of their coordinates are not divided: single precision would hardly tell
/// neighbours apart.
const LEAST_RADIUS: f32 = 4e-6;

/// Triangles that are longer than so many times their height are halved and not quartered: quarters would be as thin.
const SLIVER: f32 = 3.0;

/// A triangle that receives and sends as one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Element {
    /// Indices into [`Mesh::vertices`], counter-clockwise from the lit side.
    pub vertices: [u32; 3],
    /// First of two or four adjacent children of the same area, or [`Element::LEAF`].
    pub first_child: u32,
    /// The patch it lies on.
    pub patch: u32,
    /// The element above, or `u32::MAX` for a patch.
    pub parent: u32,
    /// Halvings between the patch and this; a division into four counts two.
    pub level: u8,
    /// Bit k: whether corner k lies inside a solid or behind a wall; bit 3: whether the centroid does.
    /// [`Element::UNPROBED`] if that is unknown.
    pub inside_solid: u8,
    /// Whether no light at all reaches these places: each lies in a solid or a closed gap, or sees nothing but backs.
    pub is_covered: bool,
    /// Number of children: 0, 2 or 4.
    pub child_count: u8,
    /// Mean of the corners.
    pub centroid: Vec3,
    /// Largest distance of a corner from the centroid.
    pub radius: f32,
    /// Area times unit normal.
    pub area_vector: Vec3,
}

impl Element {
    /// Stands for missing children.
    pub const LEAF: u32 = u32::MAX;

    /// Value of [`Element::inside_solid`] before it is known.
    pub const UNPROBED: u8 = u8::MAX;

    /// Value of [`Element::inside_solid`] if all of it lies inside a solid.
    const ALL_INSIDE: u8 = 0b1111;

    /// Whether it is a contact: partly inside a solid or behind a wall.
    pub fn is_contact(&self) -> bool {
        !matches!(self.inside_solid, 0 | Self::ALL_INSIDE | Self::UNPROBED)
    }

    /// Whether all of it lies inside a solid.
    pub fn is_inside_solid(&self) -> bool {
        self.inside_solid == Self::ALL_INSIDE
    }

    /// Whether none of it is known to lie inside a solid.
    pub fn is_outside_solids(&self) -> bool {
        matches!(self.inside_solid, 0 | Self::UNPROBED)
    }

    /// Whether a corner is known to lie inside a solid.
    pub fn is_inside_solid_at(&self, side: usize) -> bool {
        self.inside_solid != Self::UNPROBED && self.inside_solid & (1 << side) != 0
    }

    /// Whether it has no children.
    pub fn is_leaf(&self) -> bool {
        self.first_child == Self::LEAF
    }

    /// Vertices at the ends of its edges, in order.
    pub fn edges(&self) -> [[usize; 2]; 3] {
        let [a, b, c] = self.vertices.map(|vertex| vertex as usize);
        [[a, b], [b, c], [c, a]]
    }

    /// Its children among the elements; none of a leaf.
    pub fn children(&self) -> Range<usize> {
        if self.is_leaf() {
            return 0..0;
        }
        let first = self.first_child as usize;
        first..first + usize::from(self.child_count)
    }
}

/// A point as one smooth surface sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex {
    /// Index into [`Mesh::points`].
    pub point: u32,
    /// Where that is.
    pub place: Vec3,
    /// The vertices between which this one was made, or `None` for a corner of the scene.
    pub ends: Option<[u32; 2]>,
}

/// Elements with their points and vertices.
pub struct Mesh {
    /// Places in frame units; the scene's positions come first.
    pub points: Vec<Vec3>,
    /// Points as smooth surfaces see them.
    pub vertices: Vec<Vertex>,
    /// All elements; the patches come first, in order.
    pub elements: Vec<Element>,
    /// Number of the patches for which light is computed; the elements of those that follow are never divided.
    active_count: u32,
    /// Midpoint of the edge between two points, lower index first.
    point_between: EdgeMap<u32>,
    /// Midpoint vertex of the edge between two vertices, lower index first.
    vertex_between: EdgeMap<u32>,
    /// Elements at each edge between points, for balance; none before the first division.
    leaves_at: Option<EdgeLeaves>,
}

/// Whether a triangle with this square of its longest edge, and this area, is halved: its height is twice the area over that
/// edge.
fn is_sliver(longest_squared: f32, area: f32) -> bool {
    longest_squared > SLIVER * 2.0 * area
}

fn edge(a: u32, b: u32) -> Edge {
    (a.min(b), a.max(b))
}

impl Mesh {
    /// One element per patch, of which the first `active_count` may be divided; `None` when cancelled.
    pub(super) fn new(
        scene: &Scene,
        patches: &[Patch],
        active_count: usize,
        crease_degrees: f32,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Option<Self> {
        let corners: Vec<[u32; 3]> = patches
            .iter()
            .map(|patch| {
                let [a, b, c] = scene.triangles[patch.triangle.index()].corners;
                if patch.is_back { [a, c, b] } else { [a, b, c] }
            })
            .collect();
        let (vertices, vertex_of) =
            share_vertices(scene, patches, &corners, crease_degrees, cancelled)?;
        let mut mesh = Self {
            points: scene.positions.clone(),
            vertices,
            elements: Vec::new(),
            active_count: active_count as u32,
            point_between: EdgeMap::default(),
            vertex_between: EdgeMap::default(),
            leaves_at: None,
        };
        let element = |(index, patch): (usize, &Patch)| {
            mesh.element(
                vertex_of[index],
                index as u32,
                u32::MAX,
                0,
                patch.area_vector,
            )
        };
        mesh.elements = patches.par_iter().enumerate().map(element).collect();
        Some(mesh)
    }

    fn element(
        &self,
        vertices: [u32; 3],
        patch: u32,
        parent: u32,
        level: u8,
        area_vector: Vec3,
    ) -> Element {
        let corners = vertices.map(|vertex| self.position(vertex));
        let centroid = crate::geometry::centroid(corners);
        let radius = corners
            .iter()
            .map(|corner| corner.distance(centroid))
            .fold(0.0, f32::max);
        Element {
            vertices,
            first_child: Element::LEAF,
            patch,
            parent,
            level,
            inside_solid: Element::UNPROBED,
            is_covered: false,
            child_count: 0,
            centroid,
            radius,
            area_vector,
        }
    }

    /// Where a vertex is.
    pub fn position(&self, vertex: u32) -> Vec3 {
        self.vertices[vertex as usize].place
    }

    /// The corners of an element.
    pub fn corners(&self, element: usize) -> [Vec3; 3] {
        let [a, b, c] = self.elements[element].vertices;
        [self.position(a), self.position(b), self.position(c)]
    }

    /// The leaf below an element that holds a point of it.
    pub fn leaf_at(&self, mut element: usize, point: Vec3) -> Option<usize> {
        let depth_inside =
            |child: usize| barycentric_in_plane(point, self.corners(child)).min_element();
        loop {
            let at = self.elements.get(element)?;
            if at.is_leaf() {
                return Some(element);
            }
            element = at
                .children()
                .max_by(|&a, &b| depth_inside(a).total_cmp(&depth_inside(b)))?;
        }
    }

    /// The leaves in order.
    pub fn leaves(&self) -> impl Iterator<Item = usize> + '_ {
        self.leaves_among(0..self.elements.len())
    }

    /// The leaves among some elements, in order.
    pub fn leaves_among(&self, elements: Range<usize>) -> impl Iterator<Item = usize> + '_ {
        elements.filter(|&index| self.elements[index].is_leaf())
    }

    /// What limits of the size of elements compare, square frame units: the area of the parts into which an element would be
    /// divided. Slivers are halved along their length, and so count by that: as right isosceles triangles with the longest
    /// edge of their parts. By their area, light along a bar of a room could not change from end to end.
    pub fn size_of_parts(&self, element: usize) -> f32 {
        let area = self.elements[element].area_vector.length();
        let squared = longest_edge_squared(self.corners(element)) as f32;
        match is_sliver(squared, area) {
            true => squared / 16.0,
            false => area / 4.0,
        }
    }

    /// Area of the leaves about each vertex.
    pub fn areas_about_vertices(&self) -> Vec<f32> {
        self.sums_about_vertices(|leaf| self.elements[leaf].area_vector.length())
    }

    /// Sums over the leaves about each vertex.
    pub fn sums_about_vertices(&self, of: impl Fn(usize) -> f32) -> Vec<f32> {
        let mut sums = vec![0.0; self.vertices.len()];
        for leaf in self.leaves() {
            let value = of(leaf);
            for vertex in self.elements[leaf].vertices {
                sums[vertex as usize] += value;
            }
        }
        sums
    }

    /// The leaves for which light is computed, in order.
    pub fn active_leaves(&self) -> impl Iterator<Item = usize> + '_ {
        self.leaves().filter(|&leaf| self.is_active(leaf))
    }

    /// Whether light is computed for an element.
    pub fn is_active(&self, element: usize) -> bool {
        self.elements[element].patch < self.active_count
    }

    /// Whether so many elements are enough for dividing these, and about as many neighbours as balance asks.
    pub fn fits(&self, wanted: &[u32], most_elements: u64) -> bool {
        wanted.is_empty() || (self.elements.len() + 8 * wanted.len()) as u64 <= most_elements
    }

    /// Divide the given leaves, and their neighbours as far as balance asks. Elements that are no leaves are passed
    /// over, as are those at the deepest level that are not divided for balance. Returns whether anything was divided.
    pub fn divide(&mut self, wanted: &[u32]) -> bool {
        if self.leaves_at.is_none() {
            self.leaves_at = Some(EdgeLeaves::new(self.patch_edges()));
        }
        let before = self.elements.len();
        let is_deepest = |&index: &u32| {
            let element = &self.elements[index as usize];
            element.level >= DEEPEST_LEVEL
                || element.radius < LEAST_RADIUS * element.centroid.abs().max_element()
        };
        let mut pending: Vec<u32> = wanted
            .iter()
            .copied()
            .filter(|index| !is_deepest(index))
            .collect();
        while let Some(index) = pending.pop() {
            let element = self.elements[index as usize];
            if !element.is_leaf() || !self.is_active(index as usize) {
                continue;
            }
            self.divide_one(index);
            // Where others are much finer already, the children are still too coarse.
            let children = self.elements[index as usize].children();
            let hanging = children.filter(|&child| self.hangs_twice(child));
            pending.extend(hanging.map(|child| child as u32));
            // An edge of the new children may lie on a neighbour's half edge: then the neighbour is two levels
            // above and must be divided, too.
            for half in self.edges_above(index) {
                pending.extend(self.leaves_over(half));
            }
        }
        self.elements.len() > before
    }

    /// The three edges of an element, as pairs of points.
    fn point_edges(&self, vertices: [u32; 3]) -> [Edge; 3] {
        let [a, b, c] = vertices.map(|vertex| self.vertices[vertex as usize].point);
        [edge(a, b), edge(b, c), edge(c, a)]
    }

    /// The edges of the patches that light is computed for.
    fn patch_edges(&self) -> impl Iterator<Item = (u32, [Edge; 3])> + Clone + '_ {
        (0..self.active_count).map(|patch| {
            let vertices = self.elements[patch as usize].vertices;
            (patch, self.point_edges(vertices))
        })
    }

    fn divide_one(&mut self, index: u32) {
        let parent = self.elements[index as usize];
        let children = self.parts(parent.vertices, parent.area_vector.length());
        let (share, deeper) = (1.0 / children.len() as f32, children.len() as u8 / 2);
        self.elements[index as usize].first_child = self.elements.len() as u32;
        self.elements[index as usize].child_count = children.len() as u8;
        for vertices in children {
            let child = self.element(
                vertices,
                parent.patch,
                index,
                parent.level + deeper,
                parent.area_vector * share,
            );
            let child_index = self.elements.len() as u32;
            self.elements.push(child);
            let edges = self.point_edges(vertices);
            if let Some(leaves_at) = &mut self.leaves_at {
                leaves_at.push(child_index, edges);
            }
        }
    }

    /// The parts of equal area that a triangle is divided into.
    fn parts(&mut self, vertices: [u32; 3], area: f32) -> Vec<[u32; 3]> {
        let corners = vertices.map(|vertex| self.position(vertex));
        let squares = [0, 1, 2].map(|side| corners[side].distance_squared(corners[(side + 1) % 3]));
        let longest = (1..3).fold(0, |best, side| {
            if squares[side] > squares[best] {
                side
            } else {
                best
            }
        });
        if is_sliver(squares[longest], area) {
            let [a, b, c] = [0, 1, 2].map(|turn| vertices[(longest + turn) % 3]);
            let ab = self.middle(a, b);
            return vec![[a, ab, c], [ab, b, c]];
        }
        let [a, b, c] = vertices;
        let (ab, bc, ca) = (self.middle(a, b), self.middle(b, c), self.middle(c, a));
        vec![[a, ab, ca], [ab, b, bc], [ca, bc, c], [bc, ca, ab]]
    }

    /// Edges that those of the divided element are halves of, where a leaf may still lie undivided.
    fn edges_above(&self, index: u32) -> Vec<Edge> {
        let mut edges = Vec::new();
        let mut above = self.elements[index as usize].parent;
        while let Some(element) = self.elements.get(above as usize) {
            edges.extend(self.point_edges(element.vertices));
            // Halves keep edges of what they are halves of.
            if element.child_count == 4 {
                break;
            }
            above = element.parent;
        }
        edges
    }

    /// Leaves that have a whole edge where others already have quarters of it.
    fn leaves_over(&self, key: Edge) -> impl Iterator<Item = u32> + '_ {
        let elements = self.leaves_at.as_ref().filter(|_| self.is_quartered(key));
        let elements = elements.into_iter().flat_map(move |all| all.at(key));
        elements.filter(|&element| self.elements[element as usize].is_leaf())
    }

    /// Whether an edge is divided, and a half of it, too.
    fn is_quartered(&self, key: Edge) -> bool {
        self.point_between.get(&key).is_some_and(|&middle| {
            [edge(key.0, middle), edge(middle, key.1)]
                .iter()
                .any(|half| self.point_between.contains_key(half))
        })
    }

    /// The vertex in the middle between two vertices, made if it is not there.
    fn middle(&mut self, a: u32, b: u32) -> u32 {
        let key = edge(a, b);
        if let Some(&vertex) = self.vertex_between.get(&key) {
            return vertex;
        }
        let points = edge(
            self.vertices[a as usize].point,
            self.vertices[b as usize].point,
        );
        let place = (self.points[points.0 as usize] + self.points[points.1 as usize]) * 0.5;
        let point = *self.point_between.entry(points).or_insert_with(|| {
            self.points.push(place);
            self.points.len() as u32 - 1
        });
        let vertex = self.vertices.len() as u32;
        self.vertices.push(Vertex {
            point,
            place,
            ends: Some([a, b]),
        });
        self.vertex_between.insert(key, vertex);
        vertex
    }

    /// Whether an edge of a leaf carries more than one hanging point.
    pub(super) fn hangs_twice(&self, leaf: usize) -> bool {
        self.point_edges(self.elements[leaf].vertices)
            .into_iter()
            .any(|key| self.is_quartered(key))
    }

    /// The leaves as triangles without T-junctions between active ones, each with its element: where a neighbour divided
    /// an edge, its midpoint is used on this side, too. Vertices that are missing on this side of a crease are added.
    pub fn crack_free_triangles(&mut self) -> Vec<(u32, [u32; 3])> {
        let mut triangles = Vec::with_capacity(self.elements.len());
        for index in 0..self.elements.len() {
            if !self.elements[index].is_leaf() {
                continue;
            }
            let corners = self.elements[index].vertices;
            if !self.is_active(index) {
                // No light, and so none that could differ beside a vertex in the middle of an edge.
                triangles.push((index as u32, corners));
                continue;
            }
            let keys = self.point_edges(corners);
            let middles: [Option<u32>; 3] = std::array::from_fn(|side| {
                let hangs = self.point_between.contains_key(&keys[side]);
                hangs.then(|| self.middle(corners[side], corners[(side + 1) % 3]))
            });
            close(corners, middles, |vertices| {
                triangles.push((index as u32, vertices));
            });
        }
        triangles
    }

    /// Bytes in use.
    pub(super) fn memory_bytes(&self) -> usize {
        /// A hash table keeps about an eighth of its slots free and a byte of control per slot.
        const SLOT: usize = 16;
        size_of_val(self.points.as_slice())
            + size_of_val(self.vertices.as_slice())
            + size_of_val(self.elements.as_slice())
            + SLOT * (self.point_between.capacity() + self.vertex_between.capacity())
            + self.leaves_at.as_ref().map_or(0, EdgeLeaves::memory_bytes)
    }
}

/// Triangulate a triangle with vertices in the middle of some of its edges (edge k starts at corner k).
fn close([a, b, c]: [u32; 3], middles: [Option<u32>; 3], mut emit: impl FnMut([u32; 3])) {
    match middles {
        [None, None, None] => emit([a, b, c]),
        [Some(ab), Some(bc), Some(ca)] => {
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
                .into_iter()
                .for_each(emit);
        }
        // Turn the triangle until the first edge is the one that differs from the others.
        [Some(ab), None, None] => [[a, ab, c], [ab, b, c]].into_iter().for_each(emit),
        [None, Some(bc), Some(ca)] => [[a, b, ca], [b, bc, ca], [ca, bc, c]]
            .into_iter()
            .for_each(emit),
        [first, second, third] => close([b, c, a], [second, third, first], emit),
    }
}

/// Faces that are looked at across an edge to find the smoothest way on. Fewer, and the right one of a fan of sheets
/// may be missed; all, and thousands of faces on one edge take the square of their number.
const MOST_NEIGHBOURS: usize = 64;

/// Vertices of the patches: corners at one point are one vertex where a chain of smooth edges joins their patches.
fn share_vertices(
    scene: &Scene,
    patches: &[Patch],
    corners: &[[u32; 3]],
    crease_degrees: f32,
    cancelled: &(dyn Fn() -> bool + Sync),
) -> Option<(Vec<Vertex>, Vec<[u32; 3]>)> {
    let mut corner_group = DisjointSets::new(corners.len() * 3);
    let half_edges = half_edges(corners.iter().copied());
    if cancelled() {
        return None;
    }
    let smooth = crease_degrees.to_radians().cos();
    for run in half_edges.chunk_by(|a, b| a.ends == b.ends) {
        let first_down = run.partition_point(|half| !half.is_forward);
        let (down, up) = run.split_at(first_down);
        let down = &down[..down.len().min(MOST_NEIGHBOURS)];
        for one in up {
            let likeness = |other: &&HalfEdge| {
                patches[one.triangle as usize]
                    .normal
                    .dot(patches[other.triangle as usize].normal)
            };
            let best = match run.len() {
                0..=2 => down.first(),
                // A face that stands between two others parts them, however smoothly they join.
                _ => next_around(scene, patches, one, run),
            };
            let Some(other) = best else { continue };
            if likeness(&other) >= smooth
                && same_material(scene, patches, one.triangle, other.triangle)
            {
                let ends = |half: &HalfEdge| {
                    let corner = |side: u32| half.triangle * 3 + side;
                    let side = u32::from(half.side);
                    (corner(side), corner((side + 1) % 3))
                };
                let ((a, b), (c, d)) = (ends(one), ends(other));
                // They run in opposite directions: the start of one is the end of the other.
                corner_group.join(a, d);
                corner_group.join(b, c);
            }
        }
    }
    if cancelled() {
        return None;
    }
    let mut vertices = Vec::new();
    let mut vertex_of_group = vec![u32::MAX; corners.len() * 3];
    let vertex_of = corners
        .iter()
        .enumerate()
        .map(|(patch, points)| {
            std::array::from_fn(|side| {
                let slot =
                    &mut vertex_of_group[corner_group.root((patch * 3 + side) as u32) as usize];
                if *slot == u32::MAX {
                    *slot = vertices.len() as u32;
                    vertices.push(Vertex {
                        point: points[side],
                        place: scene.positions[points[side] as usize],
                        ends: None,
                    });
                }
                *slot
            })
        })
        .collect();
    Some((vertices, vertex_of))
}

/// Of the patches at an edge the first that is met when one of them is turned about it towards its lit side; `None`
/// where that is the back of a one-sided surface.
fn next_around<'a>(
    scene: &Scene,
    patches: &[Patch],
    one: &HalfEdge,
    run: &'a [HalfEdge],
) -> Option<&'a HalfEdge> {
    /// Angles that differ by less are those of faces in one place.
    const SAME_ANGLE: f32 = 1e-3;
    let [from, to] = one.ends.map(|end| scene.positions[end as usize]);
    // Along the edge in the order of the corners, and from it into the patch.
    let inward = |half: &HalfEdge| {
        let along = if half.is_forward {
            to - from
        } else {
            from - to
        };
        patches[half.triangle as usize]
            .normal
            .cross(along)
            .normalize_or_zero()
    };
    let triangle = |half: &HalfEdge| patches[half.triangle as usize].triangle;
    let (normal, own) = (patches[one.triangle as usize].normal, inward(one));
    let angle = |half: &HalfEdge| {
        let other = inward(half);
        let angle = other.dot(normal).atan2(other.dot(own));
        if angle < SAME_ANGLE {
            angle + std::f32::consts::TAU
        } else {
            angle
        }
    };
    let others = run.iter().take(2 * MOST_NEIGHBOURS);
    let others = others.filter(|half| triangle(half) != triangle(one));
    let nearest = others.clone().map(angle).fold(f32::INFINITY, f32::min);
    let mut at_nearest = others.filter(|half| angle(half) <= nearest + SAME_ANGLE);
    at_nearest.find(|half| half.is_forward != one.is_forward)
}

fn same_material(scene: &Scene, patches: &[Patch], a: u32, b: u32) -> bool {
    let material = |patch: u32| scene.triangles[patches[patch as usize].triangle.index()].material;
    material(a) == material(b)
}
