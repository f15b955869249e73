//! Faces cut along the lines where other surfaces cross them or stand on them.
//!
//! Light is different on both sides of a wall that stands on a floor or goes through it, so no element may lie on both
//! (discontinuities of the value itself: Heckbert 1992; Lischinski, Tampieri & Greenberg 1992). Large faces are cut by
//! large faces; where small ones cross, elements are small enough.

use std::{
    collections::{BTreeMap, HashMap},
    panic::{AssertUnwindSafe, catch_unwind},
};

use glam::{DVec2, DVec3, Vec2, Vec3};
use rayon::prelude::*;
use spade::{
    ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation as _,
    handles::FixedVertexHandle,
};

use super::{Appearance, Scene, SizeClasses, Surface, Triangle, TriangleId};

/// Faces are cut whose longest edge, squared, is more than this part of the scene's area. Smaller cuts what elements resolve
/// anyway (a quarter of it at draft: `soup` 4.1 → 4.4 %, an office 9.5 → 9.9 %, more time), larger leaves furniture whole,
/// and what lies in stacks (ten times as much: an error of 17 % instead of 10 % in an office at draft, 1.54 % instead of 1.39 %
/// in `gallery` at normal).
const LEAST_CUT: f64 = 4e-5;

/// Faces cut others whose longest edge, squared, is more than this part of the scene's area. Smaller makes slivers about
/// small things, larger leaves the feet of furniture on whole floors.
const LEAST_CUTTER: f64 = 1e-5;

/// Lines by which a face is cut at most, the longest: what is crossed by more is clutter.
const MOST_LINES: usize = 128;

/// Corners of the parts of a face at most: lines that cross each other make more.
const MOST_CORNERS: usize = 512;

/// Lines in a scene at most, the longest, unless it has more faces than that: cuts multiply no clutter in which everything
/// crosses everything. Fewer leave rooms of many sheets uncut, more let what crosses outweigh the scene.
const MOST_LINES_IN_ALL: usize = 1 << 11;

/// Widest gap between two surfaces that counts as closed, as a part of the square root of the scene's area: 2 cm in a room of
/// 100 m². Faces are cut along what ends so near before them, too, and no light is looked for deep within such gaps. Larger
/// takes light from gaps that have some; smaller leaves elements both behind furniture that stands close to a wall and beside
/// it, and light is lost behind it (three pieces 1 cm before the walls of a room: 1.2 % of it).
pub const CLOSED_GAP: f64 = 2e-3;

/// Least length of an edge by which a face before which it ends is cut, in widths of the gap. Smaller cuts by small things,
/// into slivers (`gallery` at `normal`: 2.16 % of error without, 1.91 % with 64, where noise is 0.3 %); larger leaves gaps behind
/// furniture.
const LEAST_ASPECT: f64 = 32.0;

/// Cosine of the angle up to which two triangles are one flat face. Smaller takes the edges of bent sheets for seams; larger
/// cuts along the diagonals of faces that are flat but for rounding.
const FLAT_COSINE: f64 = 0.999;

/// Points nearer than this are one place, frame units: half of the distance that rays keep from their ends.
const SAME_PLACE: f64 = 5e-5;

/// The same relative to the distance from the origin: the resolution of single precision.
const SAME_PLACE_RELATIVE: f64 = 5e-7;

/// Cut the faces of a scene. Parts keep what their face has; their textures are averaged anew.
pub(super) fn cut_crossings(scene: &mut Scene) {
    let lines = lines(scene);
    if lines.is_empty() {
        return;
    }
    let mut points = Points::new(scene);
    let on_edges = points.on_edges(scene, &lines);
    let is_cut = |index: usize| {
        lines.contains_key(&index)
            || edges_of(scene.triangles[index].corners)
                .iter()
                .any(|edge| on_edges.contains_key(edge))
    };
    let mut parts: Vec<Parts> = Vec::with_capacity(scene.triangles.len());
    for index in 0..scene.triangles.len() {
        parts.push(match is_cut(index) {
            // Of what the library gives up on with a panic, the face stays whole.
            true => catch_unwind(AssertUnwindSafe(|| {
                points.parts(scene, index, lines.get(&index), &on_edges)
            }))
            .unwrap_or_default(),
            false => Parts::default(),
        });
    }
    scene.positions = points.positions;
    replace(scene, &parts);
}

/// Where a point lies on a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
enum On {
    Corner(usize),
    /// Edge k begins at corner k.
    Edge(usize),
    Inside,
}

impl On {
    /// Bit k: whether the point lies on edge k.
    fn edges(self) -> u8 {
        match self {
            Self::Corner(corner) => 1 << corner | 1 << ((corner + 2) % 3),
            Self::Edge(edge) => 1 << edge,
            Self::Inside => 0,
        }
    }
}

/// A line on a triangle by its ends.
type Line = [(DVec3, On); 2];

/// The two ends of an edge, the lesser first.
type EdgeKey = [u32; 2];

fn edges_of([a, b, c]: [u32; 3]) -> [EdgeKey; 3] {
    [[a, b], [b, c], [c, a]].map(|[from, to]| [from.min(to), from.max(to)])
}

/// Distance within which a place is the same as this one.
fn tolerance(at: DVec3) -> f64 {
    SAME_PLACE.max(SAME_PLACE_RELATIVE * at.abs().max_element())
}

/// The lines by which triangles are to be cut.
fn lines(scene: &Scene) -> BTreeMap<usize, Vec<Line>> {
    let corners = |index: usize| scene.corners(TriangleId(index as u32)).map(Vec3::as_dvec3);
    let longest = |index: usize| {
        let [a, b, c] = corners(index);
        [a - b, b - c, c - a]
            .map(DVec3::length_squared)
            .into_iter()
            .fold(0.0, f64::max)
    };
    let count = scene.triangles.len();
    let squares: Vec<f64> = (0..count).into_par_iter().map(longest).collect();
    let areas: Vec<f64> = scene
        .surfaces
        .iter()
        .map(|surface| f64::from(surface.area_vector.length()))
        .collect();
    let whole = SizeClasses::new(squares.iter().copied().zip(areas.iter().copied())).area;
    // By the lower end along an axis, so that those which may touch a box are found by search.
    let mut cutters: Vec<(Vec3, Vec3, usize)> = (0..count)
        .filter(|&index| squares[index] > LEAST_CUTTER * whole)
        .map(|index| {
            let [a, b, c] = scene.corners(TriangleId(index as u32));
            (a.min(b).min(c), a.max(b).max(c), index)
        })
        .collect();
    cutters.sort_by(|a, b| a.0.x.total_cmp(&b.0.x).then(a.2.cmp(&b.2)));
    let near = CLOSED_GAP * whole.sqrt();
    let outlines = Outlines::new(scene, cutters.iter().map(|&(.., index)| index));
    let lines_on = |&(min, max, index): &(Vec3, Vec3, usize)| {
        let height = 2.0 * areas[index] / squares[index].sqrt();
        if squares[index] <= LEAST_CUT * whole || height * NEEDLE < squares[index].sqrt() {
            return None;
        }
        let slack = tolerance(min.abs().max(max.abs()).as_dvec3()).max(near) as f32;
        let (min, max) = (min - slack, max + slack);
        let last = cutters.partition_point(|other| other.0.x <= max.x);
        let own = corners(index);
        let mut found = Vec::new();
        for &(from, to, other) in &cutters[..last] {
            let is_near = to.cmpge(min).all() && from.cmple(max).all();
            if other == index || !is_near || shared_corners(scene, index, other) > 1 {
                continue;
            }
            let line = crossing(own, corners(other));
            let before = line.is_none().then(|| {
                let sides = scene.triangles[index].two_sided;
                let is_outline = |edge| outlines.has(scene, other, edge);
                ends_before(own, corners(other), is_outline, near, sides)
            });
            let before = before.into_iter().flatten();
            // Along an edge there is nothing to cut.
            let is_wanted = |[(_, a), (_, b)]: &Line| a.edges() & b.edges() == 0;
            found.extend(line.into_iter().chain(before).filter(is_wanted));
        }
        found.sort_by(|a, b| squared_length(b).total_cmp(&squared_length(a)));
        found.truncate(MOST_LINES);
        (!found.is_empty()).then_some((index, found))
    };
    let mut found: Vec<(usize, Vec<Line>)> = cutters.par_iter().filter_map(lines_on).collect();
    keep_longest(&mut found, MOST_LINES_IN_ALL.max(count));
    found.into_iter().collect()
}

fn squared_length([(from, _), (to, _)]: &Line) -> f64 {
    from.distance_squared(*to)
}

/// Keep no more than so many lines of all triangles together; those of each are sorted, the longest first.
fn keep_longest(found: &mut Vec<(usize, Vec<Line>)>, most: usize) {
    let mut lengths: Vec<f64> = found
        .iter()
        .flat_map(|(_, lines)| lines.iter().map(squared_length))
        .collect();
    if lengths.len() <= most {
        return;
    }
    let (_, &mut least, _) = lengths.select_nth_unstable_by(most, |a, b| b.total_cmp(a));
    for (_, lines) in &mut *found {
        lines.truncate(lines.partition_point(|line| squared_length(line) > least));
    }
    found.retain(|(_, lines)| !lines.is_empty());
}

fn shared_corners(scene: &Scene, a: usize, b: usize) -> usize {
    let [a, b] = [a, b].map(|index| scene.triangles[index].corners);
    a.iter().filter(|corner| b.contains(corner)).count()
}

/// A point of a triangle in the plane of another one.
struct InPlane {
    place: DVec3,
    on: On,
}

/// The line on the first of two triangles along which they cross or touch; `None` where they do not or lie in one plane.
fn crossing(first: [DVec3; 3], second: [DVec3; 3]) -> Option<Line> {
    let [normal, other] = [first, second].map(|[a, b, c]| (b - a).cross(c - a).normalize_or_zero());
    let along = normal.cross(other);
    let own = in_plane(first, second[0], other)?;
    let others = in_plane(second, first[0], normal)?;
    let along = along.try_normalize()?;
    let sorted = |[a, b]: [InPlane; 2]| {
        if a.place.dot(along) <= b.place.dot(along) {
            [a, b]
        } else {
            [b, a]
        }
    };
    let ([from, to], [other_from, other_to]) = (sorted(own), sorted(others));
    let at = |point: &InPlane| point.place.dot(along);
    let slack = tolerance(from.place);
    // Own ends are preferred: it is known where on the triangle they lie.
    let start = if at(&from) >= at(&other_from) - slack {
        (from.place, from.on)
    } else {
        (other_from.place, place_on(first, other_from.place))
    };
    let end = if at(&to) <= at(&other_to) + slack {
        (to.place, to.on)
    } else {
        (other_to.place, place_on(first, other_to.place))
    };
    (end.0.dot(along) - start.0.dot(along) > 2.0 * slack).then_some([start, end])
}

/// The edges of triangles that are no seams within a flat face.
struct Outlines {
    /// By edge: the normals of its triangles.
    normals: HashMap<EdgeKey, Vec<Vec3>>,
}

impl Outlines {
    /// Of some triangles.
    fn new(scene: &Scene, triangles: impl Iterator<Item = usize>) -> Self {
        let mut normals: HashMap<EdgeKey, Vec<Vec3>> = HashMap::new();
        for index in triangles {
            let normal = scene.surfaces[index].area_vector.normalize_or_zero();
            for key in edges_of(scene.triangles[index].corners) {
                normals.entry(key).or_default().push(normal);
            }
        }
        Self { normals }
    }

    /// Whether an edge of a triangle, by its number, is part of an outline.
    fn has(&self, scene: &Scene, index: usize, edge: usize) -> bool {
        let own = scene.surfaces[index].area_vector.normalize_or_zero();
        let key = edges_of(scene.triangles[index].corners)[edge];
        let is_along = |normal: &&Vec3| f64::from(normal.dot(own).abs()) > FLAT_COSINE;
        let all = self.normals.get(&key).into_iter().flatten();
        all.filter(is_along).count() < 2
    }
}

/// Lines on the first of two triangles under edges of the second that end before it, nearer than a distance; `is_outline` tells
/// which edges count.
fn ends_before(
    first: [DVec3; 3],
    second: [DVec3; 3],
    is_outline: impl Fn(usize) -> bool,
    near: f64,
    is_two_sided: bool,
) -> impl Iterator<Item = Line> {
    let [a, b, c] = first;
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let heights = second.map(|corner| (corner - a).dot(normal));
    let gaps = if is_two_sided {
        heights.map(f64::abs)
    } else {
        heights
    };
    let is_before =
        move |corner: usize| gaps[corner] > tolerance(second[corner]) && gaps[corner] <= near;
    (0..3).filter_map(move |edge| {
        let ends = [edge, (edge + 1) % 3];
        let [from, to] = ends.map(|corner| second[corner] - normal * heights[corner]);
        let gap = ends
            .map(|corner| gaps[corner])
            .into_iter()
            .fold(0.0, f64::max);
        let is_long = gap * LEAST_ASPECT <= second[ends[0]].distance(second[ends[1]]);
        // A triangle that stands on the line.
        (ends.into_iter().all(is_before) && is_long && is_outline(edge))
            .then(|| crossing(first, [from, to, from + normal * from.distance(to)]))?
    })
}

/// The two points of the outline of a triangle that lie in a plane, given by a point and its unit normal.
fn in_plane(corners: [DVec3; 3], origin: DVec3, normal: DVec3) -> Option<[InPlane; 2]> {
    let heights = corners.map(|corner| {
        let height = (corner - origin).dot(normal);
        if height.abs() <= tolerance(corner) {
            0.0
        } else {
            height
        }
    });
    let mut found = Vec::with_capacity(3);
    for corner in 0..3 {
        let next = (corner + 1) % 3;
        if heights[corner] == 0.0 {
            found.push(InPlane {
                place: corners[corner],
                on: On::Corner(corner),
            });
        } else if heights[corner] * heights[next] < 0.0 {
            // From the same end whichever triangle asks: both sides of an edge get the same point.
            let is_first = corners[corner].to_array() < corners[next].to_array();
            let (from, to) = if is_first {
                (corner, next)
            } else {
                (next, corner)
            };
            let share = heights[from] / (heights[from] - heights[to]);
            found.push(InPlane {
                place: corners[from].lerp(corners[to], share),
                on: On::Edge(corner),
            });
        }
    }
    found.try_into().ok()
}

/// Where a point in the plane of a triangle lies on it.
fn place_on(corners: [DVec3; 3], point: DVec3) -> On {
    let slack = 2.0 * tolerance(point);
    if let Some(corner) = (0..3).find(|&corner| corners[corner].distance(point) <= slack) {
        return On::Corner(corner);
    }
    let is_near = |&edge: &usize| {
        let (from, to) = (corners[edge], corners[(edge + 1) % 3]);
        let share = (point - from).dot(to - from) / (to - from).length_squared();
        from.lerp(to, share.clamp(0.0, 1.0)).distance(point) <= slack
    };
    (0..3).find(is_near).map_or(On::Inside, On::Edge)
}

/// The points of a scene, old and new.
struct Points {
    positions: Vec<Vec3>,
    /// By cell of a grid.
    known: HashMap<[i64; 3], Vec<u32>>,
}

/// The parts of a triangle: corners with their barycentric coordinates on it; empty where it stays whole.
#[derive(Clone, Debug, Default)]
struct Parts(Vec<[(u32, DVec3); 3]>);

/// New points on edges, in order from the lesser end.
type OnEdges = BTreeMap<EdgeKey, Vec<(f64, u32)>>;

/// A point on its way into a triangulation.
#[derive(Clone, Copy)]
struct Corner {
    at: DVec2,
    point: u32,
    /// See [`On::edges`].
    edges: u8,
}

/// Grid of the coordinates in the plane of a face that is cut, frame units. Much finer, and rounding shows; coarser, and
/// points that differ fall together.
const GRID: f64 = 1.0 / 65_536.0;

/// A face that is so much longer than it is high is not cut: its parts would be thinner still.
const NEEDLE: f64 = 400.0;

/// Stands for a point where two lines cross, which is not made yet.
const UNMADE: u32 = u32::MAX;

impl HasPosition for Corner {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        Point2::new(self.at.x, self.at.y)
    }
}

impl Points {
    /// Cells of the grid are so many times larger than what counts as one place.
    const CELL: f64 = 4.0 * SAME_PLACE;

    fn new(scene: &Scene) -> Self {
        let mut points = Self {
            positions: scene.positions.clone(),
            known: HashMap::new(),
        };
        for (index, at) in scene.positions.iter().enumerate() {
            let cell = Self::cell(at.as_dvec3());
            points.known.entry(cell).or_default().push(index as u32);
        }
        points
    }

    fn cell(place: DVec3) -> [i64; 3] {
        (place / Self::CELL).floor().to_array().map(|x| x as i64)
    }

    /// The point at a place, made if there is none: both faces that cross, and their neighbours, find the same one, though
    /// each computes it from its own plane.
    fn at(&mut self, place: DVec3) -> u32 {
        // Of what is far out not all cells are looked at.
        let slack = (2.0 * tolerance(place)).min(Self::CELL);
        let [low, high] = [place - slack, place + slack].map(Self::cell);
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    let near = self.known.get(&[x, y, z]).into_iter().flatten();
                    let distance = |point: u32| {
                        let at = self.positions[point as usize].as_dvec3();
                        at.distance(place)
                    };
                    if let Some(&point) = near.clone().find(|&&point| distance(point) <= slack) {
                        return point;
                    }
                }
            }
        }
        // Adding 0 turns -0 into 0, so that both have the same bits.
        self.positions.push(place.as_vec3() + 0.0);
        let point = self.positions.len() as u32 - 1;
        self.known.entry(Self::cell(place)).or_default().push(point);
        point
    }

    /// The ends of lines that lie on edges, for both faces at each.
    fn on_edges(&mut self, scene: &Scene, lines: &BTreeMap<usize, Vec<Line>>) -> OnEdges {
        let mut on_edges = OnEdges::new();
        for (&index, lines) in lines {
            let corners = scene.triangles[index].corners;
            for &(place, on) in lines.iter().flatten() {
                let On::Edge(edge) = on else { continue };
                let key = edges_of(corners)[edge];
                let [from, to] = key.map(|end| scene.positions[end as usize].as_dvec3());
                let length = from.distance(to);
                let share = (place - from).dot(to - from) / (length * length);
                let slack = 2.0 * tolerance(place) / length;
                let known = on_edges.entry(key).or_default();
                if share > slack
                    && share < 1.0 - slack
                    && known.iter().all(|(other, _)| (other - share).abs() > slack)
                {
                    known.push((share, self.at(place)));
                }
            }
        }
        on_edges.retain(|_, points| !points.is_empty());
        for points in on_edges.values_mut() {
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        on_edges
    }

    /// The parts of a triangle; none where it cannot be cut.
    fn parts(
        &mut self,
        scene: &Scene,
        index: usize,
        lines: Option<&Vec<Line>>,
        on_edges: &OnEdges,
    ) -> Parts {
        let ids = scene.triangles[index].corners;
        let corners = ids.map(|id| scene.positions[id as usize].as_dvec3());
        let plane = Plane::of(corners);
        if !plane.is_wide() {
            return Parts::default();
        }
        let mut triangulation = ConstrainedDelaunayTriangulation::<Corner>::new();
        // By place on the grid: what falls together is one corner.
        let mut handles: HashMap<[i64; 2], Option<FixedVertexHandle>> = HashMap::new();
        let mut insert = |triangulation: &mut ConstrainedDelaunayTriangulation<Corner>, corner| {
            let Corner { at, .. } = corner;
            let handle = handles.entry([at.x as i64, at.y as i64]);
            *handle.or_insert_with(|| triangulation.insert(corner).ok())
        };
        // The outline.
        for (corner, &point) in ids.iter().enumerate() {
            let at = plane.flat(corners[corner]);
            let edges = On::Corner(corner).edges();
            insert(&mut triangulation, Corner { at, point, edges });
        }
        for (edge, key) in edges_of(ids).into_iter().enumerate() {
            for &(_, point) in on_edges.get(&key).into_iter().flatten() {
                let at = plane.flat(self.positions[point as usize].as_dvec3());
                let edges = On::Edge(edge).edges();
                insert(&mut triangulation, Corner { at, point, edges });
            }
        }
        // The lines, in pieces between their crossings.
        let mut ends: Vec<[Corner; 2]> = Vec::new();
        for line in lines.into_iter().flatten() {
            ends.push(line.map(|(place, on)| {
                let corner = match on {
                    On::Corner(corner) => Some(ids[corner]),
                    On::Edge(edge) => {
                        nearest(&self.positions, on_edges.get(&edges_of(ids)[edge]), place)
                    }
                    On::Inside => Some(self.at(place)),
                };
                let point = corner.unwrap_or_else(|| {
                    // Too near to a corner to be a point of its own.
                    let distance = |&corner: &usize| corners[corner].distance_squared(place);
                    let nearest = (0..3).min_by(|a, b| distance(a).total_cmp(&distance(b)));
                    ids[nearest.unwrap_or(0)]
                });
                let at = plane.flat(self.positions[point as usize].as_dvec3());
                let edges = on.edges();
                Corner { at, point, edges }
            }));
        }
        let mut constraints: Vec<[FixedVertexHandle; 2]> = Vec::new();
        for (number, &[from, to]) in ends.iter().enumerate() {
            let others = ends
                .iter()
                .enumerate()
                .filter(|&(other, _)| other != number);
            let crossings =
                others.filter_map(|(_, &[a, b])| crossing_on_grid([from.at, to.at], [a.at, b.at]));
            let mut along: Vec<Corner> = crossings
                .map(|at| Corner {
                    at,
                    point: UNMADE,
                    edges: 0,
                })
                .collect();
            along.sort_by(|a, b| {
                let share = |corner: &Corner| (corner.at - from.at).dot(to.at - from.at);
                share(a).total_cmp(&share(b))
            });
            let pieces = std::iter::once(from).chain(along).chain([to]);
            let mut before = None;
            for corner in pieces {
                if triangulation.num_vertices() > MOST_CORNERS {
                    break;
                }
                let handle = insert(&mut triangulation, corner);
                if let (Some(a), Some(b)) = (before, handle)
                    && a != b
                {
                    constraints.push([a, b]);
                }
                before = handle;
            }
        }
        // After all points: among constraints the library does not always find the place of a point.
        for [a, b] in constraints {
            if triangulation.can_add_constraint(a, b) {
                triangulation.add_constraint(a, b);
            }
        }
        let faces: Vec<[Corner; 3]> = triangulation
            .inner_faces()
            .map(|face| face.vertices().map(|vertex| *vertex.data()))
            .filter(|[a, b, c]| a.edges & b.edges & c.edges == 0)
            .collect();
        let mut made = |corner: Corner| {
            let place = plane.place(corner.at);
            let point = if corner.point == UNMADE {
                self.at(place)
            } else {
                corner.point
            };
            (point, plane.barycentric(corner.at))
        };
        let parts: Vec<[(u32, DVec3); 3]> =
            faces.into_iter().map(|face| face.map(&mut made)).collect();
        // Points of one line are on it but for rounding: what lies between them lies within what crosses.
        let is_sound = |part: &[(u32, DVec3); 3]| {
            let [a, b, c] = part.map(|(point, _)| self.positions[point as usize].as_dvec3());
            let longest = [a - b, b - c, c - a].map(DVec3::length);
            let longest = longest.into_iter().fold(0.0, f64::max);
            (b - a).cross(c - a).length() > 2.0 * tolerance(a) * longest
        };
        Parts(parts.into_iter().filter(is_sound).collect())
    }
}

/// The point of the grid where two lines cross; `None` where they do not.
fn crossing_on_grid([from, to]: [DVec2; 2], [a, b]: [DVec2; 2]) -> Option<DVec2> {
    let (own, other) = (to - from, b - a);
    let area = own.perp_dot(other);
    let share = (a - from).perp_dot(other) / area;
    let of_other = (a - from).perp_dot(own) / area;
    let is_inside = |share: f64| (0.0..=1.0).contains(&share);
    (is_inside(share) && is_inside(of_other)).then(|| (from + own * share).round())
}

/// The point on an edge that is nearest to a place.
fn nearest(positions: &[Vec3], on_edge: Option<&Vec<(f64, u32)>>, place: DVec3) -> Option<u32> {
    let distance = |point: u32| positions[point as usize].as_dvec3().distance_squared(place);
    let points = on_edge?.iter().map(|&(_, point)| point);
    let nearest = points.min_by(|&a, &b| distance(a).total_cmp(&distance(b)))?;
    let slack = 4.0 * tolerance(place);
    (distance(nearest) <= slack * slack).then_some(nearest)
}

/// Coordinates in the plane of a triangle.
struct Plane {
    origin: DVec3,
    axes: [DVec3; 2],
    corners: [DVec2; 3],
}

impl Plane {
    fn of([a, b, c]: [DVec3; 3]) -> Self {
        let x = (b - a).normalize_or_zero();
        let y = (b - a).cross(c - a).cross(b - a).normalize_or_zero();
        let mut plane = Self {
            origin: a,
            axes: [x, y],
            corners: [DVec2::ZERO; 3],
        };
        plane.corners = [a, b, c].map(|corner| plane.flat(corner));
        plane
    }

    /// Whether the triangle is more than a line on the grid.
    fn is_wide(&self) -> bool {
        let [a, b, c] = self.corners;
        let longest = [a - b, b - c, c - a].map(DVec2::length);
        let longest = longest.into_iter().fold(0.0, f64::max);
        (b - a).perp_dot(c - a) > 8.0 * longest
    }

    /// On a grid, so that rounding, such as that of a scene far from the origin, does not decide between the two ways to
    /// divide a rectangle. Coordinates that are common do not lie between two of its points.
    fn flat(&self, place: DVec3) -> DVec2 {
        let offset = place - self.origin;
        let at = DVec2::from_array(self.axes.map(|axis| offset.dot(axis)));
        (at / GRID + 0.37).floor()
    }

    fn place(&self, at: DVec2) -> DVec3 {
        let at = (at + 0.13) * GRID;
        self.origin + self.axes[0] * at.x + self.axes[1] * at.y
    }

    fn barycentric(&self, at: DVec2) -> DVec3 {
        let [a, b, c] = self.corners;
        let whole = (b - a).perp_dot(c - a);
        let second = (at - a).perp_dot(c - a) / whole;
        let third = (b - a).perp_dot(at - a) / whole;
        DVec3::new(1.0 - second - third, second, third)
    }
}

/// Put parts in the place of their faces.
fn replace(scene: &mut Scene, parts: &[Parts]) {
    let mut first = Vec::with_capacity(parts.len() + 1);
    let mut count = 0u32;
    for part in parts {
        first.push(count);
        count += part.0.len().max(1) as u32;
    }
    first.push(count);
    let old = std::mem::take(&mut scene.triangles);
    let surfaces = std::mem::take(&mut scene.surfaces);
    let mut cut = Vec::new();
    for ((triangle, surface), parts) in old.iter().zip(&surfaces).zip(parts) {
        if parts.0.is_empty() {
            scene.triangles.push(*triangle);
            scene.surfaces.push(*surface);
            continue;
        }
        let share = |[(_, a), (_, b), (_, c)]: &[(u32, DVec3); 3]| {
            0.0f64.max((b.y - a.y) * (c.z - a.z) - (b.z - a.z) * (c.y - a.y))
        };
        let whole: f64 = parts.0.iter().map(share).sum();
        for part in &parts.0 {
            let corners = part.map(|(point, _)| point);
            cut.push(TriangleId(scene.triangles.len() as u32));
            scene.triangles.push(Triangle {
                corners,
                ..*triangle
            });
            let area_vector = surface.area_vector * (share(part) / whole) as f32;
            scene.surfaces.push(Surface {
                area_vector,
                ..*surface
            });
        }
    }
    scene.texcoords = spread(&scene.texcoords, parts, |[a, b, c]: [Vec2; 3], at| {
        (a.as_dvec2() * at.x + b.as_dvec2() * at.y + c.as_dvec2() * at.z).as_vec2()
    });
    scene.normals = spread(&scene.normals, parts, |[a, b, c]: [Vec3; 3], at| {
        (a.as_dvec3() * at.x + b.as_dvec3() * at.y + c.as_dvec3() * at.z).as_vec3()
    });
    cut.retain(|&part| scene.is_textured(part));
    for part in cut {
        let appearance = Appearance::of(scene.material(part));
        let means = scene.texture_means(part);
        let shown = means.times(&appearance, scene.max_reflectance);
        let surface = &mut scene.surfaces[part.index()];
        (surface.reflectance, surface.emission) = (shown.reflectance, shown.emission);
        surface.opacity = means.opacity;
    }
    for object in &mut scene.objects {
        object.start = TriangleId(first[object.start.index()]);
        object.end = TriangleId(first[object.end.index()]);
    }
}

/// Values at corners for the parts of all faces; nothing where there are none.
fn spread<T: Copy>(
    values: &[[T; 3]],
    parts: &[Parts],
    between: impl Fn([T; 3], DVec3) -> T,
) -> Vec<[T; 3]> {
    let mut all = Vec::new();
    for (&value, parts) in values.iter().zip(parts) {
        match parts.0.is_empty() {
            true => all.push(value),
            false => all.extend(
                parts
                    .0
                    .iter()
                    .map(|part| part.map(|(_, at)| between(value, at))),
            ),
        }
    }
    all
}
