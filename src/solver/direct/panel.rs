//! Panels: emitters that together make one flat lamp.
//!
//! The irradiance of a polygon is a sum over its edges (Lambert's formula), and where two triangles of one radiosity
//! meet in a plane, the terms of their common edge cancel. So the outline determines the irradiance of a lamp of many
//! triangles, as long as most of it lies above the receiver's horizon.

use std::{collections::HashMap, f32::consts::PI, ops::Range};

use glam::Vec3;

use super::emitter::Emitter;
use crate::{
    geometry::outline_irradiance,
    scene::{DisjointSets, HalfEdge, half_edges},
    solver::places::Receiver,
};

/// Least cosine between normals of one plane. Smaller, and curved lamps count as flat; larger, and rounding splits
/// panels.
const SAME_PLANE: f32 = 1.0 - 1e-6;

/// Distance in radii up to which shadow rays are distributed by the irradiance of each triangle instead of by area.
/// Smaller, and shadows near lamps are noisy; larger, and large lamps cost time.
const NEAR: f32 = 2.0;

/// Distance in radii from which a panel counts as a point. Smaller is inexact; larger suffers from rounding.
const FAR: f32 = 128.0;

/// Height over the plane of a panel, as a share of its radius, up to which a point may be in it. Smaller suffers from
/// rounding; larger evaluates single emitters more often.
const LOW: f32 = 1e-3;

/// Largest sine of the angle between edges that are joined to one. Smaller, and outlines have more edges; larger, and
/// curved outlines lose area.
const STRAIGHT: f32 = 1e-5;

/// Most emitters at one edge that are compared with each of its emitters. More, and thousands on one edge take
/// quadratic time; fewer, and panels fall apart there.
const MOST_NEIGHBOURS: usize = 64;

/// A corner of an emitter: the index of its point in the mesh, and its position.
type Corner = (u32, Vec3);

/// Emitters of one material and radiosity that lie in one plane and are connected by edges.
#[derive(Clone, Debug)]
pub(super) struct Panel {
    /// Its emitters.
    pub emitters: Range<usize>,
    /// Total area.
    area: f32,
    /// Edges that no two emitters share, oriented as the corners of the front.
    outline: Vec<[Vec3; 2]>,
    pub(super) normal: Vec3,
    pub(super) centre: Vec3,
    radius: f32,
}

impl Panel {
    /// Irradiance of the whole panel for a radiosity of 1, 0…1; `None` where its emitters must be evaluated one by one.
    pub(crate) fn irradiance(&self, receiver: &Receiver) -> Option<f32> {
        if self.emitters.len() == 1 {
            return None;
        }
        let separation = self.centre - receiver.point;
        let height = -separation.dot(self.normal);
        if height < -LOW * self.radius {
            return Some(0.0);
        }
        let squared = separation.length_squared();
        let is_near = squared < (NEAR * self.radius).powi(2);
        if is_near || height <= LOW * self.radius {
            return None;
        }
        let elevation = separation.dot(receiver.normal);
        if elevation <= -self.radius {
            return Some(0.0);
        }
        if elevation < self.radius {
            let is_above =
                |[start, _]: &[Vec3; 2]| (*start - receiver.point).dot(receiver.normal) >= 0.0;
            match self.outline.iter().filter(|edge| is_above(edge)).count() {
                0 => return Some(0.0),
                // Most shadow rays distributed by area would go below the horizon.
                count if count < self.outline.len() && elevation < 0.0 => return None,
                _ => {}
            }
        }
        if squared > (FAR * self.radius).powi(2) {
            return Some(self.area * height * elevation.max(0.0) / (PI * squared * squared));
        }
        Some(outline_irradiance(
            receiver.point,
            receiver.normal,
            &self.outline,
        ))
    }
}

/// Find the panels, and sort emitters so that those of a panel are consecutive. Both are in the order of the first
/// emitter of each panel.
pub(super) fn panels(emitters: &[Emitter]) -> (Vec<Emitter>, Vec<Panel>) {
    let (mut sets, mut is_inner) = (
        DisjointSets::new(emitters.len()),
        vec![[false; 3]; emitters.len()],
    );
    // Join emitters that continue each other across an edge.
    let edges = half_edges(emitters.iter().map(|emitter| emitter.vertices));
    let emitter_of = |edge: &HalfEdge| &emitters[edge.triangle as usize];
    for same in edges.chunk_by(|a, b| a.ends == b.ends) {
        for (at, one) in same.iter().enumerate() {
            let is_free = |edge: &HalfEdge| !is_inner[edge.triangle as usize][edge.side as usize];
            let mut others = same[at + 1..].iter().take(MOST_NEIGHBOURS);
            let other = others.find(|other| {
                one.is_forward != other.is_forward
                    && is_free(other)
                    && emitter_of(one).continues(emitter_of(other))
            });
            if let Some(other) = other.filter(|_| is_free(one)) {
                for edge in [one, other] {
                    is_inner[edge.triangle as usize][edge.side as usize] = true;
                }
                sets.join(one.triangle, other.triangle);
            }
        }
    }
    // Sort them by panel.
    let mut order: Vec<(u32, usize)> = (0..emitters.len())
        .map(|emitter| (sets.root(emitter as u32), emitter))
        .collect();
    order.sort_unstable();
    // The panels, with the edges that no two emitters share.
    let mut panels = Vec::new();
    let mut start = 0;
    for members in order.chunk_by(|a, b| a.0 == b.0) {
        let end = start + members.len();
        let inner = members.iter().map(|&(_, emitter)| is_inner[emitter]);
        let members: Vec<&Emitter> = members
            .iter()
            .map(|&(_, emitter)| &emitters[emitter])
            .collect();
        panels.push(panel(start..end, &members, inner));
        start = end;
    }
    let sorted = order.iter().map(|&(_, emitter)| emitters[emitter]);
    (sorted.collect(), panels)
}

fn panel(
    range: Range<usize>,
    members: &[&Emitter],
    inner: impl Iterator<Item = [bool; 3]>,
) -> Panel {
    let mut area = 0.0;
    let mut middle = Vec3::ZERO;
    for emitter in members {
        area += emitter.area;
        middle += emitter.corners.iter().sum::<Vec3>() * (emitter.area / 3.0);
    }
    let centre = match middle / area {
        middle if middle.is_finite() => middle,
        _ => members[0].corners[0],
    };
    let edges = members.iter().zip(inner).flat_map(|(emitter, inner)| {
        let corner = |at: usize| (emitter.vertices[at], emitter.corners[at]);
        let sides = [0, 1, 2].map(|side| [corner(side), corner((side + 1) % 3)]);
        let sides = sides.into_iter().zip(inner);
        sides
            .filter(|(_, is_inner)| !is_inner)
            .map(|(side, _)| side)
    });
    let outline: Vec<[Vec3; 2]> = straightened(edges.collect())
        .into_iter()
        .map(|ends| ends.map(|(_, point)| point))
        .collect();
    let corners = outline.iter().map(|[start, _]| start.distance(centre));
    Panel {
        emitters: range,
        area,
        radius: corners.fold(0.0, f32::max),
        outline,
        normal: members[0].normal,
        centre,
    }
}

/// The same outline with collinear edges joined.
fn straightened(mut edges: Vec<[Corner; 2]>) -> Vec<[Corner; 2]> {
    let mut starting: HashMap<u32, Vec<usize>> = HashMap::new();
    for (index, [start, _]) in edges.iter().enumerate() {
        starting.entry(start.0).or_default().push(index);
    }
    let mut is_part = vec![false; edges.len()];
    for index in 0..edges.len() {
        // Where outlines touch in a corner, the continuation is ambiguous.
        while let Some(&[next]) = starting.get(&edges[index][1].0).map(Vec::as_slice) {
            let ([start, end], [_, last]) = (edges[index], edges[next]);
            let (along, on) = (end.1 - start.1, last.1 - end.1);
            let sine = along.cross(on).length();
            let is_straight =
                along.dot(on) > 0.0 && sine <= STRAIGHT * along.length() * on.length();
            if !is_straight || next == index || is_part[index] || is_part[next] {
                break;
            }
            is_part[next] = true;
            edges[index][1] = last;
        }
    }
    let mut parts = is_part.into_iter();
    edges.retain(|_| !parts.next().unwrap_or_default());
    edges
}

impl Emitter {
    /// Whether two emitters that share an edge are parts of one panel.
    fn continues(&self, other: &Self) -> bool {
        self.material == other.material
            && self.radiosity == other.radiosity
            && self.normal.dot(other.normal) >= SAME_PLANE
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec4;

    use super::*;
    use crate::{
        geometry::{Random, point_irradiance},
        scene::{MaterialId, TriangleId},
    };

    /// A lamp of `n` by `n` squares from 0 to 1 in the plane z = 1, facing down, without the squares for which
    /// `is_hole` holds.
    fn lamp(n: usize, is_hole: impl Fn(usize, usize) -> bool) -> Vec<Emitter> {
        let vertex = |x: usize, y: usize| (x * (n + 1) + y) as u32;
        let point = |vertex: u32| {
            let (x, y) = (vertex as usize / (n + 1), vertex as usize % (n + 1));
            Vec3::new(x as f32, y as f32, n as f32) / n as f32
        };
        let mut emitters: Vec<Emitter> = Vec::new();
        for (x, y) in (0..n).flat_map(|x| (0..n).map(move |y| (x, y))) {
            if is_hole(x, y) {
                continue;
            }
            let [a, b, c, d] =
                [(x, y), (x, y + 1), (x + 1, y + 1), (x + 1, y)].map(|(x, y)| vertex(x, y));
            for vertices in [[a, b, c], [a, c, d]] {
                emitters.push(Emitter {
                    vertices,
                    corners: vertices.map(point),
                    normal: Vec3::NEG_Z,
                    area: 0.5 / (n * n) as f32,
                    triangle: TriangleId(emitters.len() as u32),
                    material: MaterialId(0),
                    texture: Vec3::ONE,
                    radiosity: Vec4::ONE,
                });
            }
        }
        emitters
    }

    #[test]
    fn a_panel_is_reduced_to_its_outline() {
        for n in [1, 2, 5, 16] {
            let (emitters, panels) = panels(&lamp(n, |_, _| false));
            assert_eq!((panels.len(), panels[0].outline.len()), (1, 4), "{n}");
            assert_eq!(panels[0].emitters, 0..emitters.len());
            assert!((panels[0].area - 1.0).abs() < 1e-5);
            assert!((panels[0].radius - 0.5f32.sqrt()).abs() < 1e-5);
        }
        // A window in the middle has an outline of its own.
        let (_, holed) = panels(&lamp(5, |x, y| x == 2 && y == 2));
        assert_eq!((holed.len(), holed[0].outline.len()), (1, 8));
        // Two halves that do not touch.
        let (emitters, halves) = panels(&lamp(5, |x, _| x == 2));
        assert_eq!((halves.len(), emitters.len()), (2, 40));
        for (index, panel) in halves.iter().enumerate() {
            assert_eq!(
                (panel.emitters.clone(), panel.outline.len()),
                (20 * index..20 * index + 20, 4)
            );
        }
    }

    #[test]
    fn emitters_that_differ_or_meet_at_an_angle_are_no_panel() {
        let mut colors = lamp(1, |_, _| false);
        colors[1].radiosity = Vec4::splat(2.0);
        let mut tilted = lamp(1, |_, _| false);
        tilted[1].normal = Vec3::new(0.0, 0.1, -1.0).normalize_or_zero();
        let mut materials = lamp(1, |_, _| false);
        materials[1].material = MaterialId(1);
        // The two sides of one triangle.
        let mut sides = lamp(1, |_, _| false);
        let turned = |[a, b, c]: [u32; 3]| [a, c, b];
        let [a, b, c] = sides[0].corners;
        sides[1] = Emitter {
            vertices: turned(sides[0].vertices),
            corners: [a, c, b],
            normal: Vec3::Z,
            ..sides[0]
        };
        for emitters in [colors, tilted, materials, sides] {
            assert_eq!(panels(&emitters).1.len(), 2);
        }
    }

    #[test]
    fn a_panel_gives_as_much_light_as_its_emitters_where_it_is_used() {
        let (emitters, panels) = panels(&lamp(6, |x, y| x == 1 && y > 3));
        let mut random = Random::new(3, 0);
        let mut wholes = 0;
        for _ in 0..4000 {
            let mut uniform = |low: f32, high: f32| low + (high - low) * random.uniform();
            let reach = if uniform(0.0, 1.0) < 0.1 { 300.0 } else { 4.0 };
            let point = Vec3::from_array([0.0; 3].map(|_| uniform(-reach, reach)));
            let normal = Vec3::from_array([0.0; 3].map(|_| uniform(-1.0, 1.0)));
            let receiver = Receiver {
                point,
                normal: normal.try_normalize().unwrap_or(Vec3::Z),
                triangle: TriangleId(1000),
            };
            let Some(whole) = panels[0].irradiance(&receiver) else {
                continue;
            };
            wholes += u32::from(whole > 0.0);
            let parts: f32 = emitters
                .iter()
                .map(|emitter| point_irradiance(point, receiver.normal, emitter.corners))
                .sum();
            assert!(
                (whole - parts).abs() < 2e-3 * parts + 2e-7,
                "{whole} {parts} {receiver:?}"
            );
        }
        assert!(wholes > 500, "{wholes}");
    }
}
