//! Which triangles lie over each other in one plane.
//!
//! Triangles are sorted into cells of planes, by normal and distance from the origin; one near the border of a cell goes
//! into both. The triangles of a cell are then compared where their boxes overlap within the plane.

use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

use super::clip::{are_apart, turned_left};
use super::{DisjointSets, Triangle, half_edges};

/// Triangles whose corners are at most this far from each other's planes lie in one plane, relative to their [`reach`]: a
/// few roundings of positions in single precision, and the sixth decimal of a scene of 50 m. Less misses backs that were
/// written with other corners, more takes a picture for the wall that it hangs on.
pub(super) const COPLANAR: f64 = 4e-7;

/// Triangles that overlap by no more than this width only touch, likewise. Less takes roundings along common edges for
/// overlap, more misses narrow faces.
pub(super) const TOUCHING: f64 = 2e-6;

/// Scale of the distances about a point: how far from the origin it lies, at least half of what the frame fits.
pub(super) fn reach(at: DVec3) -> f64 {
    at.abs().max_element().max(0.5 * super::Frame::EXTENT)
}

/// Triangles of which one is less wide than [`TOUCHING`] overlap where they do by this share of its width.
pub(super) const TOUCHING_SHARE: f64 = 0.1;

/// Cells of planes per unit of each coordinate of the normal. Fewer make cells with many triangles of curved surfaces, more
/// put triangles into several cells.
const NORMAL_CELLS: f64 = 64.0;

/// Cells of planes per unit of their distance from the origin, likewise.
const DISTANCE_CELLS: f64 = 8.0;

/// Triangles that each triangle of a plane overlaps at most, on average. Triangles in more layers are a heap in which
/// nothing is anyone's back: it is left as it is. Fewer gives up on doubled meshes, more takes long on heaps.
const MOST_LAYERS: usize = 64;

/// Cells with so many triangles or fewer compare all pairs.
const FEW: usize = 16;

/// Pairs of triangles that overlap, by triangle.
pub(super) struct Overlaps {
    /// Both ways, ascending.
    pairs: Vec<[u32; 2]>,
}

impl Overlaps {
    /// Compare triangles in the frame.
    pub(super) fn of(triangles: &[[u32; 3]], positions: &[Vec3]) -> Self {
        let planes: Vec<Plane> = triangles
            .par_iter()
            .map(|&corners| Plane::of(corners, positions))
            .collect();
        let mut keys: Vec<u64> = planes
            .par_iter()
            .enumerate()
            .with_min_len(1024)
            .flat_map_iter(|(triangle, plane)| {
                let cells = plane.cells();
                cells.map(move |cell| (cell << 32) | triangle as u64)
            })
            .collect();
        keys.par_sort_unstable();
        let cell = |key: &u64| key >> 32;
        let mut pairs: Vec<[u32; 2]> = keys
            .par_chunk_by(|a, b| cell(a) == cell(b))
            .filter(|keys| keys.len() > 1)
            .flat_map_iter(|keys| {
                let members: Vec<u32> = keys.iter().map(|&key| key as u32).collect();
                overlapping(&members, triangles, positions, &planes)
            })
            .flat_map_iter(|[a, b]| [[a, b], [b, a]])
            .collect();
        pairs.par_sort_unstable();
        pairs.dedup();
        Self { pairs }
    }

    /// The triangles that overlap others, ascending, each with those.
    pub(super) fn by_triangle(
        &self,
    ) -> impl Iterator<Item = (u32, impl Iterator<Item = u32> + Clone)> {
        self.pairs
            .chunk_by(|a, b| a[0] == b[0])
            .map(|pairs| (pairs[0][0], pairs.iter().map(|pair| pair[1])))
    }
}

/// The plane of a triangle, the same whichever way the triangle is wound.
#[derive(Clone, Copy)]
struct Plane {
    normal: Vec3,
    distance: f32,
    /// How far off the normal may be for rounding, per coordinate.
    slack: f32,
    /// How far off the distance may be.
    distance_slack: f32,
    /// The width of the triangle.
    width: f32,
}

/// Normals are turned towards this direction: none of usual scenes lies across it.
const TOWARDS: DVec3 = DVec3::new(0.531_7, 0.611_3, 0.586_1);

impl Plane {
    fn of(mut corners: [u32; 3], positions: &[Vec3]) -> Self {
        corners.sort_unstable();
        let [a, b, c] = corners.map(|corner| positions[corner as usize].as_dvec3());
        let vector = (b - a).cross(c - a);
        let normal = vector.normalize_or_zero();
        let normal = normal * TOWARDS.dot(normal).signum();
        let longest = (b - a)
            .length_squared()
            .max((c - b).length_squared())
            .max((a - c).length_squared())
            .sqrt();
        let width = vector.length() / longest;
        let distance = normal.dot(a);
        let coplanar = COPLANAR * reach(a);
        let slack = coplanar / width;
        // From the triangle to the foot of the origin in its plane.
        let offset = (a - normal * distance).length();
        Self {
            normal: normal.as_vec3(),
            distance: distance as f32,
            slack: slack as f32,
            distance_slack: (slack * offset + coplanar) as f32,
            width: width as f32,
        }
    }

    /// Numbers of the cells that the plane may lie in; of two neighbours along each coordinate at most. Cells far from each
    /// other may share a number.
    fn cells(&self) -> impl Iterator<Item = u64> + use<> {
        let [x, y, z] = self
            .normal
            .to_array()
            .map(|x| around(x, NORMAL_CELLS, self.slack));
        let distance = around(self.distance, DISTANCE_CELLS, self.distance_slack);
        let coordinates = [x, y, z, distance];
        // Bits of the coordinates that have two cells; all choices among those are counted through.
        let open = (0..4).filter(|&at| coordinates[at][0] != coordinates[at][1]);
        let open: usize = open.map(|at| 1 << at).sum();
        let choices = std::iter::successors(Some(open), move |&choice| {
            (choice > 0).then(|| (choice - 1) & open)
        });
        choices.map(move |choice| {
            let mixed = (0..4).fold(0u32, |mixed, at| {
                let chosen = coordinates[at][(choice >> at) & 1];
                (mixed ^ chosen).wrapping_mul(0x9e37_79b1).rotate_left(15)
            });
            u64::from(mixed)
        })
    }

    /// Whether two planes look alike but for rounding.
    fn agrees(&self, other: &Self) -> bool {
        let slack = self.slack + other.slack;
        self.normal.cross(other.normal).length_squared() <= slack * slack
    }
}

/// The cells, of so many per unit, that a coordinate falls into if it may be off by `slack`: two at most.
fn around(coordinate: f32, cells: f64, slack: f32) -> [u32; 2] {
    // Coordinates that are common, such as 0 and 1, lie within cells.
    let place = f64::from(coordinate) * cells + 0.37;
    let slack = (f64::from(slack) * cells).min(0.5);
    [place - slack, place + slack].map(|place| place.floor() as i32 as u32)
}

/// Area of the flat region that each triangle belongs to, among those that are meant; 0 for others. Triangles of a region
/// share edges.
pub(super) fn flat_areas(
    triangles: &[Triangle],
    positions: &[Vec3],
    is_meant: impl Fn(u32) -> bool,
) -> Vec<f64> {
    let meant: Vec<u32> = (0..triangles.len() as u32)
        .filter(|&triangle| is_meant(triangle))
        .collect();
    let corners = |at: usize| triangles[meant[at] as usize].corners;
    let planes: Vec<Plane> = (0..meant.len())
        .map(|at| Plane::of(corners(at), positions))
        .collect();
    let mut forest = DisjointSets::new(meant.len());
    let edges = half_edges((0..meant.len()).map(corners));
    for group in edges.chunk_by(|a, b| a.ends == b.ends) {
        for pair in group.windows(2) {
            let [a, b] = [pair[0].triangle, pair[1].triangle];
            if planes[a as usize].agrees(&planes[b as usize]) {
                forest.join(a, b);
            }
        }
    }
    let mut of_region = vec![0.0; meant.len()];
    for at in 0..meant.len() {
        let [a, b, c] = corners(at).map(|corner| positions[corner as usize].as_dvec3());
        of_region[forest.root(at as u32) as usize] += 0.5 * (b - a).cross(c - a).length();
    }
    let mut areas = vec![0.0; triangles.len()];
    for (at, &triangle) in meant.iter().enumerate() {
        areas[triangle as usize] = of_region[forest.root(at as u32) as usize];
    }
    areas
}

/// Pairs of those triangles that overlap, the lesser first.
fn overlapping(
    members: &[u32],
    triangles: &[[u32; 3]],
    positions: &[Vec3],
    planes: &[Plane],
) -> Vec<[u32; 2]> {
    let axes = |triangle: u32| in_plane(planes[triangle as usize].normal.as_dvec3());
    let plate = |triangle: u32, axes: [usize; 2]| {
        let corners = triangles[triangle as usize];
        Plate::new(
            triangle,
            corners.map(|corner| positions[corner as usize].as_dvec3()),
            axes,
        )
    };
    let mut pairs = Vec::new();
    let compare = |a: &Plate, b: &Plate, pairs: &mut Vec<[u32; 2]>| {
        if a.overlaps(b, planes) {
            pairs.push([a.triangle.min(b.triangle), a.triangle.max(b.triangle)]);
        }
    };
    if members.len() <= FEW {
        for (index, a) in members.iter().enumerate() {
            for b in &members[index + 1..] {
                if planes[*a as usize].agrees(&planes[*b as usize]) {
                    compare(&plate(*a, axes(*a)), &plate(*b, axes(*a)), &mut pairs);
                }
            }
        }
        return pairs;
    }
    let axes = axes(members[0]);
    let plates: Vec<Plate> = members.iter().map(|&at| plate(at, axes)).collect();
    // In a grid, a pair is compared in the cell with the least corner of what their boxes share.
    let (min, max, sum) = plates.iter().fold(
        (DVec2::MAX, DVec2::MIN, DVec2::ZERO),
        |(min, max, sum), plate| {
            let extent = plate.max - plate.min;
            (min.min(plate.min), max.max(plate.max), sum + extent)
        },
    );
    // No smaller than most triangles, and not so small that large ones cover more cells than there are triangles.
    let count = plates.len() as f64;
    let size = (sum * 1.5 / count).max((max - min) / count.sqrt());
    let cell = |at: DVec2| {
        let [x, y] = ((at - min) / size).to_array().map(|x| x as u32);
        (u64::from(y) << 32) | u64::from(x)
    };
    let mut entries: Vec<(u64, u32)> = Vec::with_capacity(2 * plates.len());
    for (index, plate) in plates.iter().enumerate() {
        let (first, last) = (cell(plate.min), cell(plate.max));
        for y in first >> 32..=last >> 32 {
            let row = (first & 0xffff_ffff)..=(last & 0xffff_ffff);
            entries.extend(row.map(|x| ((y << 32) | x, index as u32)));
        }
    }
    entries.sort_unstable();
    let most = MOST_LAYERS * plates.len();
    for entries in entries.chunk_by(|a, b| a.0 == b.0) {
        for (index, &(place, a)) in entries.iter().enumerate() {
            if pairs.len() > most {
                return Vec::new();
            }
            let a = &plates[a as usize];
            for &(_, b) in &entries[index + 1..] {
                let b = &plates[b as usize];
                if a.meets(b) && cell(a.min.max(b.min)) == place {
                    compare(a, b, &mut pairs);
                }
            }
        }
    }
    pairs
}

/// Two axes of the frame along which a plane is seen best, in the order that keeps left turns about the normal.
pub(super) fn in_plane(normal: DVec3) -> [usize; 2] {
    let size = normal.abs();
    let across = (0..3).fold(
        0,
        |most, axis| if size[axis] > size[most] { axis } else { most },
    );
    let axes = [(across + 1) % 3, (across + 2) % 3];
    if normal[across] < 0.0 {
        [axes[1], axes[0]]
    } else {
        axes
    }
}

/// A point by two axes.
pub(super) fn projected(point: DVec3, [first, second]: [usize; 2]) -> DVec2 {
    DVec2::new(point[first], point[second])
}

/// A triangle seen along the normal of its cell.
struct Plate {
    triangle: u32,
    corners: [DVec3; 3],
    /// Turning left.
    flat: [DVec2; 3],
    min: DVec2,
    max: DVec2,
}

impl Plate {
    fn new(triangle: u32, corners: [DVec3; 3], axes: [usize; 2]) -> Self {
        let flat = turned_left(corners.map(|corner| projected(corner, axes)));
        let [a, b, c] = flat;
        Self {
            triangle,
            corners,
            flat,
            min: a.min(b).min(c),
            max: a.max(b).max(c),
        }
    }

    /// Whether the boxes overlap.
    fn meets(&self, other: &Self) -> bool {
        self.min.cmplt(other.max).all() && other.min.cmplt(self.max).all()
    }

    fn overlaps(&self, other: &Self, planes: &[Plane]) -> bool {
        let [own, others] = [self, other].map(|plate| &planes[plate.triangle as usize]);
        if !own.agrees(others) || !self.meets(other) {
            return false;
        }
        // The plane of the wider triangle is the surer.
        let (plane, on, narrower) = if own.width > others.width {
            (own, self, other)
        } else {
            (others, other, self)
        };
        let normal = plane.normal.as_dvec3();
        let reach = reach(on.corners[0]);
        let is_off = |corner: &DVec3| normal.dot(*corner - on.corners[0]).abs() > COPLANAR * reach;
        if narrower.corners.iter().any(is_off) {
            return false;
        }
        let width = f64::from(own.width.min(others.width));
        !are_apart(
            &self.flat,
            &other.flat,
            (TOUCHING * reach).min(TOUCHING_SHARE * width),
        )
    }
}
