//! Meshes that the built-in scenes are put together from: box lattices, geodesic spheres, lathes, prisms, frames.
//!
//! Closed shapes face outward unless asked otherwise. Vertices that belong together have exactly equal coordinates, so
//! that they weld, and no corner lies on a neighbour's edge.

use std::collections::HashMap;
use std::f64::consts::TAU;

use earcut::Earcut;
use glam::{DQuat, DVec2, DVec3, Vec2};

use crate::scene::{Face, MaterialId, SceneBuilder, geodesic};

/// Triangles in the making, in world coordinates.
#[derive(Clone, Debug, Default)]
pub(super) struct Mesh {
    pub(super) positions: Vec<DVec3>,
    pub(super) faces: Vec<Face>,
}

impl Mesh {
    pub(super) fn vertex(&mut self, position: DVec3) -> u32 {
        self.positions.push(position);
        self.positions.len() as u32 - 1
    }

    pub(super) fn triangle(&mut self, corners: [u32; 3], material: MaterialId) {
        self.faces.push(Face {
            corners,
            texcoords: None,
            normals: None,
            material,
            line: 0,
        });
    }

    pub(super) fn quad(&mut self, [a, b, c, d]: [u32; 4], material: MaterialId) {
        self.triangle([a, b, c], material);
        self.triangle([a, c, d], material);
    }

    /// Triangles between a row of vertices and one that has one more.
    pub(super) fn strip(&mut self, above: &[u32], below: &[u32], material: MaterialId) {
        for corners in geodesic::strip(above, below) {
            self.triangle(corners, material);
        }
    }

    /// Move every vertex. A mirroring `place` would turn the mesh inside out.
    pub(super) fn moved(mut self, place: impl Fn(DVec3) -> DVec3) -> Self {
        for position in &mut self.positions {
            *position = place(*position);
        }
        self
    }

    /// Lower or raise the mesh so that its lowest vertex lies at `height`.
    pub(super) fn standing_at(self, height: f64) -> Self {
        let lowest = self.positions.iter().fold(f64::MAX, |y, p| y.min(p.y));
        self.moved(|p| p + DVec3::Y * (height - lowest))
    }

    pub(super) fn append(&mut self, other: Self) {
        let base = self.positions.len() as u32;
        self.positions.extend(other.positions);
        self.faces.extend(other.faces.into_iter().map(|face| Face {
            corners: face.corners.map(|corner| corner + base),
            ..face
        }));
    }

    /// Give the faces of one material texture coordinates by the position of their corners.
    pub(super) fn textured(
        mut self,
        material: MaterialId,
        coordinate: impl Fn(DVec3) -> Vec2,
    ) -> Self {
        for face in self.faces.iter_mut().filter(|f| f.material == material) {
            face.texcoords = Some(
                face.corners
                    .map(|corner| coordinate(self.positions[corner as usize])),
            );
        }
        self
    }

    /// Merge vertices of equal coordinates.
    pub(super) fn welded(self) -> Self {
        let mut merged = HashMap::new();
        let mut positions = Vec::new();
        let moved_to: Vec<u32> = self
            .positions
            .iter()
            .map(|&position| {
                // Adding 0 turns −0 into 0, which has other bits.
                *merged
                    .entry((position + 0.0).to_array().map(f64::to_bits))
                    .or_insert_with(|| {
                        positions.push(position);
                        positions.len() as u32 - 1
                    })
            })
            .collect();
        let mut faces = self.faces;
        for face in &mut faces {
            face.corners = face.corners.map(|corner| moved_to[corner as usize]);
        }
        Self { positions, faces }
    }

    /// Cut the longest edge in half, with the faces on both sides of it: two more faces in a closed, welded mesh.
    /// Texture coordinates are not carried over.
    pub(super) fn split_longest_edge(&mut self) {
        let length = |a: u32, b: u32| {
            self.positions[a as usize].distance_squared(self.positions[b as usize])
        };
        let mut longest = (0, 0, 0.0);
        for face in &self.faces {
            for k in 0..3 {
                let (a, b) = (face.corners[k], face.corners[(k + 1) % 3]);
                if length(a, b) > longest.2 {
                    longest = (a, b, length(a, b));
                }
            }
        }
        let (a, b, _) = longest;
        let middle = self.vertex((self.positions[a as usize] + self.positions[b as usize]) * 0.5);
        for index in 0..self.faces.len() {
            let face = self.faces[index];
            for k in 0..3 {
                let corners = [0, 1, 2].map(|i| face.corners[(k + i) % 3]);
                if corners[..2] == [a, b] || corners[..2] == [b, a] {
                    let [from, to, apex] = corners;
                    self.faces[index].corners = [from, middle, apex];
                    self.triangle([middle, to, apex], face.material);
                }
            }
        }
    }

    /// Put the mesh into a scene as an object of its own.
    pub(super) fn add_to(self, builder: &mut SceneBuilder, name: &str) {
        builder.objects.push((name.into(), builder.faces.len()));
        let base = builder.positions.len() as u32;
        builder.positions.extend(self.positions);
        builder
            .faces
            .extend(self.faces.into_iter().map(|face| Face {
                corners: face.corners.map(|corner| corner + base),
                ..face
            }));
    }
}

/// A side of an axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    /// Lowest x.
    Left,
    /// Highest x.
    Right,
    /// Lowest y.
    Bottom,
    /// Highest y.
    Top,
    /// Lowest z.
    Near,
    /// Highest z.
    Far,
}

/// Whether a shell is seen from outside or is the wall of a room.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Facing {
    Outward,
    Inward,
}

/// A box whose sides are cut along the same lines in x, y and z, so that they share all edges.
/// `material` gets the side and the centre of each cell; cells without a material are left open.
pub(super) fn lattice_box(
    lines: [&[f64]; 3],
    facing: Facing,
    material: impl Fn(Side, DVec3) -> Option<MaterialId>,
) -> Mesh {
    const SIDES: [Side; 6] = [
        Side::Left,
        Side::Right,
        Side::Bottom,
        Side::Top,
        Side::Near,
        Side::Far,
    ];
    let mut mesh = Mesh::default();
    for (number, side) in SIDES.into_iter().enumerate() {
        let axis = number / 2;
        let is_high = number % 2 == 1;
        let (u_axis, v_axis) = ((axis + 1) % 3, (axis + 2) % 3);
        let level = lines[axis][if is_high { lines[axis].len() - 1 } else { 0 }];
        let point = |u: f64, v: f64| {
            let mut coordinates = [level; 3];
            coordinates[u_axis] = u;
            coordinates[v_axis] = v;
            DVec3::from_array(coordinates)
        };
        for u in lines[u_axis].windows(2) {
            for v in lines[v_axis].windows(2) {
                let centre = point((u[0] + u[1]) * 0.5, (v[0] + v[1]) * 0.5);
                let Some(material) = material(side, centre) else {
                    continue;
                };
                let mut corners =
                    [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| mesh.vertex(point(u[i], v[j])));
                if is_high != (facing == Facing::Outward) {
                    corners.reverse();
                }
                mesh.quad(corners, material);
            }
        }
    }
    mesh.welded()
}

/// A closed box of twelve triangles.
pub(super) fn cuboid(min: DVec3, max: DVec3, material: MaterialId) -> Mesh {
    painted_cuboid(min, max, |_| material)
}

/// A closed box with a material for each side.
pub(super) fn painted_cuboid(
    min: DVec3,
    max: DVec3,
    material: impl Fn(Side) -> MaterialId,
) -> Mesh {
    let lines = [[min.x, max.x], [min.y, max.y], [min.z, max.z]];
    lattice_box(
        [&lines[0], &lines[1], &lines[2]],
        Facing::Outward,
        |side, _| Some(material(side)),
    )
}

/// A room with one window in its far wall, closed: walls that face inward, a facade around them that faces outward, and the
/// reveal that joins both. The window takes the middle of `xs` and of `ys`; `paint` is for the walls by their sides, the
/// other materials are those of facade and reveal.
pub(super) fn windowed_shell(
    xs: [f64; 4],
    ys: [f64; 4],
    zs: &[f64],
    thickness: f64,
    paint: impl Fn(Side) -> MaterialId,
    [facade, reveal]: [MaterialId; 2],
) -> Mesh {
    let is_window = |side: Side, centre: DVec3| {
        let within = |lines: [f64; 4], at: f64| (lines[1]..lines[2]).contains(&at);
        side == Side::Far && within(xs, centre.x) && within(ys, centre.y)
    };
    let (near, far) = (zs[0], zs[zs.len() - 1]);
    let outer =
        |[low, first, last, high]: [f64; 4]| [low - thickness, first, last, high + thickness];
    let mut shell = lattice_box([&xs, &ys, zs], Facing::Inward, |side, centre| {
        (!is_window(side, centre)).then(|| paint(side))
    });
    shell.append(lattice_box(
        [&outer(xs), &outer(ys), &[near - thickness, far + thickness]],
        Facing::Outward,
        |side, centre| (!is_window(side, centre)).then_some(facade),
    ));
    shell.append(lattice_box(
        [&xs[1..3], &ys[1..3], &[far, far + thickness]],
        Facing::Inward,
        |side, _| (side != Side::Near && side != Side::Far).then_some(reveal),
    ));
    shell.welded()
}

/// Lines through all `breaks`, ascending, with equal cells of about `cell` between them.
pub(super) fn lines_through(breaks: &[f64], cell: f64) -> Vec<f64> {
    let mut lines = vec![breaks[0]];
    for pair in breaks.windows(2) {
        let count = ((pair[1] - pair[0]) / cell).round().max(1.0) as usize;
        for i in 1..count {
            lines.push(pair[0] + (pair[1] - pair[0]) * i as f64 / count as f64);
        }
        lines.push(pair[1]);
    }
    lines
}

/// A unit sphere, see [`geodesic::sphere`].
pub(super) fn geodesic_sphere(frequency: u32, material: MaterialId) -> Mesh {
    let (positions, faces) = geodesic::sphere(frequency);
    let mut mesh = Mesh {
        positions,
        ..Mesh::default()
    };
    for corners in faces {
        mesh.triangle(corners, material);
    }
    mesh
}

/// A solid of revolution about the y axis. `profile` runs upwards in (radius, height), all radii above 0, and is
/// closed by flat ends; `swell` scales the radius of a ring, numbered as in the profile, at a segment.
pub(super) fn lathe(
    profile: &[DVec2],
    segments: u32,
    material: MaterialId,
    swell: impl Fn(usize, u32) -> f64,
) -> Mesh {
    let mut mesh = Mesh::default();
    let rings: Vec<Vec<u32>> = profile
        .iter()
        .enumerate()
        .map(|(number, point)| {
            (0..segments)
                .map(|segment| {
                    let (sine, cosine) = (TAU * f64::from(segment) / f64::from(segments)).sin_cos();
                    let radius = point.x * swell(number, segment);
                    mesh.vertex(DVec3::new(radius * cosine, point.y, -radius * sine))
                })
                .collect()
        })
        .collect();
    for pair in rings.windows(2) {
        for (j, &below) in pair[0].iter().enumerate() {
            let next = (j + 1) % segments as usize;
            mesh.quad([below, pair[0][next], pair[1][next], pair[1][j]], material);
        }
    }
    let bottom = mesh.vertex(DVec3::Y * profile[0].y);
    let top = mesh.vertex(DVec3::Y * profile[profile.len() - 1].y);
    for j in 0..segments as usize {
        let next = (j + 1) % segments as usize;
        mesh.triangle([bottom, rings[0][next], rings[0][j]], material);
        let last = &rings[rings.len() - 1];
        mesh.triangle([top, last[j], last[next]], material);
    }
    mesh
}

/// A round bar between two points.
pub(super) fn bar(
    from: DVec3,
    to: DVec3,
    radius: f64,
    segments: u32,
    material: MaterialId,
) -> Mesh {
    let along = to - from;
    let turn = DQuat::from_rotation_arc(DVec3::Y, along.normalize_or(DVec3::Y));
    let profile = [DVec2::new(radius, 0.0), DVec2::new(radius, along.length())];
    lathe(&profile, segments, material, |_, _| 1.0).moved(|p| from + turn * p)
}

/// A prism along z over a polygon that runs counter-clockwise in (x, y).
pub(super) fn prism(polygon: &[DVec2], near: f64, far: f64, material: MaterialId) -> Mesh {
    let mut mesh = Mesh::default();
    let count = polygon.len() as u32;
    for z in [near, far] {
        for corner in polygon {
            mesh.vertex(corner.extend(z));
        }
    }
    for i in 0..count {
        let next = (i + 1) % count;
        mesh.quad([i, next, next + count, i + count], material);
    }
    for [a, b, c] in triangulated(polygon, &[]) {
        mesh.triangle([c, b, a], material);
        mesh.triangle([a + count, b + count, c + count], material);
    }
    mesh
}

/// Counter-clockwise triangles of a polygon with holes (the index of the first corner of each), without new corners and
/// close to Delaunay.
pub(super) fn triangulated(polygon: &[DVec2], holes: &[u32]) -> Vec<[u32; 3]> {
    let points: Vec<[f64; 2]> = polygon.iter().map(|p| p.to_array()).collect();
    let mut indices: Vec<u32> = Vec::new();
    Earcut::new().earcut(points.iter().copied(), holes, &mut indices);
    earcut::refine(&mut indices, &points);
    indices
        .chunks_exact(3)
        .map(|t| {
            let [a, b, c] = [t[0], t[1], t[2]].map(|i| polygon[i as usize]);
            if (b - a).perp_dot(c - a) > 0.0 {
                [t[0], t[1], t[2]]
            } else {
                [t[0], t[2], t[1]]
            }
        })
        .collect()
}

/// A mitred picture frame around the origin, its back in the plane z = 0 and its front towards +z.
/// `half` is half the outer size; `width` and `depth` are those of the moulding.
pub(super) fn picture_frame(half: DVec2, width: f64, depth: f64, material: MaterialId) -> Mesh {
    let moulding = [
        (0.0, 0.0),
        (0.0, 0.7 * depth),
        (0.3 * width, depth),
        (0.7 * width, 0.8 * depth),
        (width, 0.5 * depth),
        (width, 0.0),
    ];
    let mut mesh = Mesh::default();
    for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
        for (inward, height) in moulding {
            mesh.vertex(DVec3::new(
                x * (half.x - inward),
                y * (half.y - inward),
                height,
            ));
        }
    }
    let count = moulding.len() as u32;
    for corner in 0..4 {
        let next = (corner + 1) % 4;
        for k in 0..count {
            let l = (k + 1) % count;
            mesh.quad(
                [
                    corner * count + k,
                    next * count + k,
                    next * count + l,
                    corner * count + l,
                ],
                material,
            );
        }
    }
    mesh
}

/// A deterministic stream of numbers (SplitMix64).
#[derive(Clone, Debug)]
pub(super) struct Numbers(pub(super) u64);

impl Numbers {
    /// The next number in `low..high`.
    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        bits ^= bits >> 31;
        // 53 bits fill the mantissa.
        low + (high - low) * (bits >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A unit vector, uniform on the sphere.
    pub(super) fn direction(&mut self) -> DVec3 {
        let z = self.between(-1.0, 1.0);
        let (sine, cosine) = self.between(0.0, TAU).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        DVec3::new(radius * cosine, radius * sine, z)
    }
}
