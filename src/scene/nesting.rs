//! Which closed shells hold which others: winding numbers of points on each shell, counted along one direction.
//!
//! All rays run in the same direction, so that a triangle concerns the points within its projection along it. Points are
//! few where triangles are many and the other way round, so triangles look up points that are sorted across the rays.

use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;

use super::Triangle;
use super::coplanar::reach;
use super::shells::Shells;

/// Points of a shell that are asked where they lie, where there are few shells; odd, so that a majority is never a tie.
/// Fewer mistake an object that pokes out of a wall for one behind it, more take longer.
const POINTS: usize = 7;

/// Points of all shells together, where each has more than one. More take memory in scenes of many leaves.
const MOST_POINTS: usize = 1 << 18;

/// How far points are moved off their shells, relative to their [`reach`], so that a lamp in the plane of a ceiling lies below it and a box
/// on a floor above it. Less is lost in the rounding of positions, more leaves thin walls.
const SHIFT: f64 = 1e-6;

/// By shell, the innermost closed shell that holds most of it, where there is one.
pub(super) fn parents(
    shells: &Shells,
    triangles: &[Triangle],
    positions: &[Vec3],
) -> Vec<Option<u32>> {
    let count = shells.closed.len();
    let holds_space: Vec<bool> = (0..count)
        .map(|shell| shells.volume[shell] != 0.0)
        .collect();
    if count < 2 || !holds_space.contains(&true) {
        return vec![None; count];
    }
    let members = Members::of(shells);
    let points = Points::on(shells, &members, triangles, positions);
    let holders: Vec<Vec<(u32, u32)>> = (0..count as u32)
        .into_par_iter()
        .filter(|&holder| holds_space[holder as usize])
        .map(|holder| {
            let faces = members.of_shell(holder);
            let inside = points.held_by(holder, faces, triangles, positions);
            inside.into_iter().map(|inner| (inner, holder)).collect()
        })
        .collect();
    // Of coincident shells back to back, the one that looks inward lies within the other.
    let size = |shell: u32| {
        let volume = shells.volume[shell as usize];
        (volume.abs() as f32, volume > 0.0, shell)
    };
    let is_smaller = |a: u32, b: u32| {
        let (a, b) = (size(a), size(b));
        a.0.total_cmp(&b.0)
            .then((a.1, a.2).cmp(&(b.1, b.2)))
            .is_lt()
    };
    let mut parents: Vec<Option<u32>> = vec![None; count];
    for (inner, holder) in holders.into_iter().flatten() {
        if holds_space[inner as usize] && !is_smaller(inner, holder) {
            continue;
        }
        let parent = &mut parents[inner as usize];
        if parent.is_none_or(|known| is_smaller(holder, known)) {
            *parent = Some(holder);
        }
    }
    parents
}

/// The triangles of each shell.
struct Members {
    triangles: Vec<u32>,
    starts: Vec<u32>,
}

impl Members {
    fn of(shells: &Shells) -> Self {
        let mut starts = vec![0u32; shells.closed.len() + 1];
        for &shell in &shells.of_triangle {
            starts[shell as usize + 1] += 1;
        }
        for shell in 1..starts.len() {
            starts[shell] += starts[shell - 1];
        }
        let mut next = starts.clone();
        let mut triangles = vec![0; shells.of_triangle.len()];
        for (triangle, &shell) in shells.of_triangle.iter().enumerate() {
            triangles[next[shell as usize] as usize] = triangle as u32;
            next[shell as usize] += 1;
        }
        Self { triangles, starts }
    }

    fn of_shell(&self, shell: u32) -> &[u32] {
        let [start, end] = [shell, shell + 1].map(|at| self.starts[at as usize] as usize);
        &self.triangles[start..end]
    }
}

/// A point of a shell.
#[derive(Clone, Copy)]
struct Point {
    /// Where it lies: two coordinates across the rays, one along them.
    at: DVec3,
    shell: u32,
}

/// Points of all shells, sorted into the cells of a grid.
struct Points {
    points: Vec<Point>,
    /// Where those of each cell begin.
    starts: Vec<u32>,
    grid: Grid,
    across: DMat3,
    per_shell: usize,
}

/// Cells over a box.
struct Grid {
    min: DVec3,
    /// Cells per unit of length along each axis.
    density: DVec3,
    /// Cells along each axis.
    side: usize,
}

impl Grid {
    fn cell(&self, at: DVec3) -> [usize; 3] {
        let place = (at - self.min) * self.density;
        place
            .to_array()
            .map(|x| (x.max(0.0) as usize).min(self.side - 1))
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.side + y) * self.side + x
    }
}

impl Points {
    fn on(shells: &Shells, members: &Members, triangles: &[Triangle], positions: &[Vec3]) -> Self {
        let count = shells.closed.len();
        // An odd number.
        let per_shell = ((MOST_POINTS / count).clamp(1, POINTS) - 1) | 1;
        let across = across();
        let points: Vec<Point> = (0..count as u32)
            .into_par_iter()
            .with_min_len(1024)
            .flat_map_iter(|shell| {
                let faces = members.of_shell(shell);
                let volume = shells.volume[shell as usize];
                let shift = if volume > 0.0 { -SHIFT } else { SHIFT };
                let places = places_on(faces, per_shell, triangles, positions, shift);
                places.map(move |at| Point {
                    at: across * at,
                    shell,
                })
            })
            .collect();
        let (min, max) = points
            .iter()
            .fold((DVec3::MAX, DVec3::MIN), |(min, max), point| {
                (min.min(point.at), max.max(point.at))
            });
        let side = ((points.len() as f64).cbrt().ceil() as usize).clamp(1, 64);
        let grid = Grid {
            min,
            density: side as f64 / (max - min).max(DVec3::splat(f64::MIN_POSITIVE)),
            side,
        };
        let mut starts = vec![0u32; side * side * side + 1];
        let cells: Vec<usize> = points
            .iter()
            .map(|point| grid.index(grid.cell(point.at)))
            .collect();
        for &cell in &cells {
            starts[cell + 1] += 1;
        }
        for cell in 1..starts.len() {
            starts[cell] += starts[cell - 1];
        }
        let mut next = starts.clone();
        let mut sorted = points.clone();
        for (point, cell) in points.into_iter().zip(cells) {
            sorted[next[cell] as usize] = point;
            next[cell] += 1;
        }
        Self {
            points: sorted,
            starts,
            grid,
            across,
            per_shell,
        }
    }

    /// The points of other shells in a box, ascending in the first coordinate.
    fn in_box(&self, min: DVec3, max: DVec3, shell: u32) -> Vec<Point> {
        let ([x0, y0, z0], [x1, y1, z1]) = (self.grid.cell(min), self.grid.cell(max));
        let mut found: Vec<Point> = Vec::new();
        for z in z0..=z1 {
            for y in y0..=y1 {
                let row = self.grid.index([x0, y, z])..self.grid.index([x1, y, z]) + 1;
                let points = self.starts[row.start] as usize..self.starts[row.end] as usize;
                found.extend(self.points[points].iter().filter(|point| {
                    point.shell != shell && point.at.cmpge(min).all() && point.at.cmple(max).all()
                }));
            }
        }
        found.sort_unstable_by(|a, b| a.at.x.total_cmp(&b.at.x));
        found
    }

    /// The shells that lie within a closed one for the greater part.
    fn held_by(
        &self,
        holder: u32,
        faces: &[u32],
        triangles: &[Triangle],
        positions: &[Vec3],
    ) -> Vec<u32> {
        let corners = |face: u32| {
            let corners = triangles[face as usize].corners;
            (
                corners,
                corners.map(|at| self.across * positions[at as usize].as_dvec3()),
            )
        };
        let (mut min, mut max) = (DVec3::MAX, DVec3::MIN);
        for &face in faces {
            for corner in corners(face).1 {
                (min, max) = (min.min(corner), max.max(corner));
            }
        }
        let points = self.in_box(min, max, holder);
        if points.is_empty() {
            return Vec::new();
        }
        let crossings: Vec<(u32, i32)> = faces
            .par_iter()
            .with_min_len(4096)
            .flat_map_iter(|&face| {
                let (names, corners) = corners(face);
                crossed(&points, names, corners)
            })
            .collect();
        let mut winding = vec![0; points.len()];
        for (point, sign) in crossings {
            winding[point as usize] += sign;
        }
        let mut inside: Vec<u32> = points
            .iter()
            .zip(winding)
            .filter(|(_, winding)| *winding != 0)
            .map(|(point, _)| point.shell)
            .collect();
        inside.sort_unstable();
        inside
            .chunk_by(|a, b| a == b)
            .filter(|points| 2 * points.len() > self.per_shell)
            .map(|points| points[0])
            .collect()
    }
}

/// From coordinates of the frame to two across the rays and one along them. The rays run along no edge and in no plane of
/// usual scenes.
fn across() -> DMat3 {
    let along = DVec3::new(0.531_7, 0.611_3, 0.586_1).normalize_or_zero();
    let first = DVec3::new(0.713_3, -0.217_7, -0.331_1)
        .reject_from(along)
        .normalize_or_zero();
    DMat3::from_cols(first, along.cross(first), along).transpose()
}

/// So many places on the triangles of a shell, spread by area, moved along the fronts' normals.
fn places_on<'a>(
    faces: &'a [u32],
    count: usize,
    triangles: &'a [Triangle],
    positions: &'a [Vec3],
    shift: f64,
) -> impl Iterator<Item = DVec3> + 'a {
    let corners = |face: u32| {
        triangles[face as usize]
            .corners
            .map(|at| positions[at as usize].as_dvec3())
    };
    let double_area = move |face: u32| {
        let [a, b, c] = corners(face);
        (b - a).cross(c - a)
    };
    let whole: f64 = faces.iter().map(|&face| double_area(face).length()).sum();
    let (mut next, mut below) = (0, 0.0);
    (0..count).map(move |number| {
        let wanted = whole * (number as f64 + 0.5) / count as f64;
        let mut area = double_area(faces[next]);
        while below + area.length() < wanted && next + 1 < faces.len() {
            below += area.length();
            next += 1;
            area = double_area(faces[next]);
        }
        // Spread over large triangles, too.
        let [x, y] = [0.618_034, 0.754_878].map(|step| (0.5 + step * number as f64).fract());
        let [a, b, c] = corners(faces[next]);
        let root = f64::sqrt(0.1 + 0.8 * x);
        let at = a * (1.0 - root) + (b * (1.0 - y) + c * y) * root;
        at + area.normalize_or_zero() * (shift * reach(at))
    })
}

/// The points from which a ray crosses a triangle, with 1 where the ray leaves through the back and −1 where it enters
/// through the front. Points are ascending in the first coordinate. Triangles that share an edge agree on which of them
/// is crossed: `names` tells its ends apart.
fn crossed(
    points: &[Point],
    names: [u32; 3],
    [a, b, c]: [DVec3; 3],
) -> impl Iterator<Item = (u32, i32)> {
    let (min, max) = (a.min(b).min(c), a.max(b).max(c));
    let first = points.partition_point(|point| point.at.x < min.x);
    let last = first + points[first..].partition_point(|point| point.at.x <= max.x);
    let side = move |[from, to]: [(u32, DVec3); 2], at: DVec3| {
        let (from, to, sign) = if from.0 < to.0 {
            (from.1, to.1, 1.0)
        } else {
            (to.1, from.1, -1.0)
        };
        let side = (to - from).truncate().perp_dot((at - from).truncate());
        // A point on the edge counts for one of its sides.
        let is_left = (side >= 0.0) == (sign > 0.0);
        (side * sign, is_left)
    };
    let [a, b, c] = [(names[0], a), (names[1], b), (names[2], c)];
    points[first..last]
        .iter()
        .zip(first as u32..)
        .filter(move |(point, _)| point.at.y >= min.y && point.at.y <= max.y && point.at.z <= max.z)
        .filter_map(move |(point, index)| {
            let [(of_c, c_left), (of_a, a_left), (of_b, b_left)] =
                [[a, b], [b, c], [c, a]].map(|edge| side(edge, point.at));
            if a_left != b_left || b_left != c_left {
                return None;
            }
            let sum = of_a + of_b + of_c;
            if sum == 0.0 {
                return None;
            }
            let height = (a.1.z * of_a + b.1.z * of_b + c.1.z * of_c) / sum;
            (height > point.at.z).then_some((index, if a_left { 1 } else { -1 }))
        })
}
