//! Radiance of a display mesh at reference points, as the viewport shows it: irradiance interpolated between vertices,
//! times the reflectance of the place, texture included.
//!
//! A point knows its triangle and side, so the display triangles over that side are searched, never space. A side
//! with many of them gets a grid over its barycentric coordinates.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;
use rayon::prelude::*;

use crate::{
    geometry::{barycentric, barycentric_in_plane},
    reference::ReferencePoint,
    scene::{Scene, TriangleId},
    solver::{DisplayMesh, VertexLight},
};

/// Display triangles per grid cell aimed at.
const PER_CELL: usize = 2;

/// Cells per axis at most, so that a side of a million elements takes no more than its share of memory.
const MAX_CELLS: u32 = 512;

/// Cells reach this much further than they should, in barycentric coordinates, against rounding.
const MARGIN: f32 = 1e-4;

/// Finds the display triangle under a point. Valid for one mesh; light may change.
pub struct MeshLookup<'a> {
    mesh: &'a DisplayMesh,
    /// Per side (twice the triangle, plus 1 for the back): cells per axis.
    resolution: Vec<u32>,
    /// Per side and one past the end: its first cell.
    first_cell: Vec<usize>,
    /// Per cell and one past the end: its first entry of `items`.
    first_item: Vec<usize>,
    /// Display triangles, cell by cell.
    items: Vec<u32>,
}

impl<'a> MeshLookup<'a> {
    /// Sort the display triangles of a mesh of this scene by side and cell.
    pub fn new(scene: &Scene, mesh: &'a DisplayMesh) -> Self {
        let mut counts = vec![0; 2 * scene.triangles.len()];
        for triangle in 0..mesh.indices.len() {
            counts[side_of(mesh, triangle)] += 1;
        }
        let resolution: Vec<u32> = counts.iter().map(|&count| cells_per_axis(count)).collect();
        let first_cell = running_sums(resolution.iter().map(|&cells| (cells * cells) as usize));
        let ranges: Vec<CellRange> = (0..mesh.indices.len())
            .into_par_iter()
            .map(|triangle| CellRange::new(scene, mesh, triangle, &resolution))
            .collect();
        let mut item_counts = vec![0; first_cell[resolution.len()]];
        for range in &ranges {
            range
                .cells(&first_cell)
                .for_each(|cell| item_counts[cell] += 1);
        }
        let first_item = running_sums(item_counts.into_iter());
        let mut next = first_item.clone();
        let mut items = vec![0; first_item[first_item.len() - 1]];
        for (triangle, range) in ranges.iter().enumerate() {
            for cell in range.cells(&first_cell) {
                items[next[cell]] = triangle as u32;
                next[cell] += 1;
            }
        }
        Self {
            mesh,
            resolution,
            first_cell,
            first_item,
            items,
        }
    }

    /// Radiance at each point under this light; `None` where the mesh does not cover the point.
    pub fn radiance(&self, light: &VertexLight, points: &[ReferencePoint]) -> Vec<Option<Vec3>> {
        let of = |point: &ReferencePoint| {
            let irradiance = self.irradiance_at(light, point)?;
            Some(point.emission + point.reflectance * irradiance * FRAC_1_PI)
        };
        points.par_iter().map(of).collect()
    }

    /// Irradiance at each point under this light, also where nothing is reflected; `None` where the mesh does not cover
    /// the point.
    pub fn irradiance(&self, light: &VertexLight, points: &[ReferencePoint]) -> Vec<Option<Vec3>> {
        points
            .par_iter()
            .map(|point| self.irradiance_at(light, point))
            .collect()
    }

    fn irradiance_at(&self, light: &VertexLight, point: &ReferencePoint) -> Option<Vec3> {
        let place = self.place(&SidePoint {
            triangle: point.triangle,
            is_back: point.is_back,
            barycentric: point.barycentric,
            position: point.position,
        })?;
        Some(place.interpolate(&light.irradiance))
    }

    /// The place of a point among the vertices; `None` where the mesh does not cover it.
    pub fn place(&self, point: &SidePoint) -> Option<MeshPlace> {
        let triangle = self.find(point)?;
        Some(MeshPlace {
            vertices: self.mesh.indices[triangle],
            weights: barycentric(point.position, corners(self.mesh, triangle)),
        })
    }

    /// The display triangle that holds a point best.
    fn find(&self, point: &SidePoint) -> Option<usize> {
        let side = 2 * point.triangle.index() + usize::from(point.is_back);
        let cells = *self.resolution.get(side)?;
        if cells == 0 {
            return None;
        }
        let [column, row] =
            [point.barycentric.x, point.barycentric.y].map(|place| cell_at(place, cells));
        let cell = self.first_cell[side] + (row * cells + column) as usize;
        if let [only] = self.items[self.first_item[cell]..self.first_item[cell + 1]] {
            return Some(only as usize);
        }
        let depth = |triangle: u32| {
            barycentric_in_plane(point.position, corners(self.mesh, triangle as usize))
                .min_element()
        };
        self.items[self.first_item[cell]..self.first_item[cell + 1]]
            .iter()
            .map(|&triangle| (triangle as usize, depth(triangle)))
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(triangle, _)| triangle)
    }
}

/// A point of one side of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SidePoint {
    /// The triangle.
    pub triangle: TriangleId,
    /// Whether it lies on the back.
    pub is_back: bool,
    /// Its place in the triangle; sums to 1.
    pub barycentric: Vec3,
    /// Position in frame units.
    pub position: Vec3,
}

/// A place among the vertices of a display mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshPlace {
    /// Those about it.
    pub vertices: [u32; 3],
    /// Their shares of it; they sum to 1.
    pub weights: Vec3,
}

impl MeshPlace {
    /// Values of vertices, interpolated there.
    pub fn interpolate(&self, values: &[Vec3]) -> Vec3 {
        let [a, b, c] = self.vertices.map(|vertex| values[vertex as usize]);
        a * self.weights.x + b * self.weights.y + c * self.weights.z
    }
}

/// The cells that a display triangle touches.
struct CellRange {
    side: usize,
    cells: u32,
    /// First and last column.
    columns: [u32; 2],
    /// First and last row.
    rows: [u32; 2],
}

impl CellRange {
    fn new(scene: &Scene, mesh: &DisplayMesh, triangle: usize, resolution: &[u32]) -> Self {
        let side = side_of(mesh, triangle);
        let cells = resolution[side];
        let whole = scene.corners(TriangleId(mesh.triangle_of[triangle]));
        let places = corners(mesh, triangle).map(|corner| barycentric_in_plane(corner, whole));
        let min = places[0].min(places[1]).min(places[2]) - MARGIN;
        let max = places[0].max(places[1]).max(places[2]) + MARGIN;
        Self {
            side,
            cells,
            columns: [cell_at(min.x, cells), cell_at(max.x, cells)],
            rows: [cell_at(min.y, cells), cell_at(max.y, cells)],
        }
    }

    fn cells(&self, first_cell: &[usize]) -> impl Iterator<Item = usize> {
        let (first, cells, columns) = (first_cell[self.side], self.cells, self.columns);
        (self.rows[0]..=self.rows[1]).flat_map(move |row| {
            (columns[0]..=columns[1]).map(move |column| first + (row * cells + column) as usize)
        })
    }
}

/// Index of a side in the tables.
fn side_of(mesh: &DisplayMesh, triangle: usize) -> usize {
    2 * mesh.triangle_of[triangle] as usize + usize::from(mesh.is_back[triangle])
}

/// Cells per axis for a side with so many display triangles. Half of the cells lie outside the triangle.
fn cells_per_axis(count: usize) -> u32 {
    if count == 0 {
        return 0;
    }
    (((2 * count / PER_CELL) as f32).sqrt() as u32).clamp(1, MAX_CELLS)
}

/// The cell of a barycentric coordinate; coordinates outside 0…1 fall into the outermost cells.
fn cell_at(place: f32, cells: u32) -> u32 {
    ((place * cells as f32).max(0.0) as u32).min(cells.saturating_sub(1))
}

/// Sums of all values before each, and the sum of all at the end.
fn running_sums(values: impl Iterator<Item = usize>) -> Vec<usize> {
    let mut sums = vec![0];
    let mut sum = 0;
    for value in values {
        sum += value;
        sums.push(sum);
    }
    sums
}

fn corners(mesh: &DisplayMesh, triangle: usize) -> [Vec3; 3] {
    mesh.indices[triangle].map(|vertex| mesh.positions[vertex as usize])
}
