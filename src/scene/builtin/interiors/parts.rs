//! Shapes of furnished rooms: boxes with rounded edges, tubes along paths, sheets and what is made of them.

use std::f64::consts::{PI, TAU};

use glam::{DQuat, DVec2, DVec3};

use super::super::shapes::{
    Facing, Mesh, Numbers, bar, geodesic_sphere, lathe, lattice_box, lines_through, picture_frame,
    prism,
};
use super::SUNK;
use crate::scene::MaterialId;

/// A mesh turned about the vertical by an angle in degrees, then moved.
pub(super) fn placed(mesh: Mesh, at: [f64; 3], degrees: f64) -> Mesh {
    let turn = DQuat::from_rotation_y(degrees.to_radians());
    let at = DVec3::from_array(at);
    mesh.moved(|p| turn * p + at)
}

/// A box with rounded edges around the origin, cut into cells of about this length, its sides swollen by `bulge` in their
/// middles. `radius` is less than each of `half`, half the lengths of its sides.
pub(super) fn cushion(
    half: [f64; 3],
    radius: f64,
    cell: f64,
    bulge: f64,
    material: MaterialId,
) -> Mesh {
    let half = DVec3::from_array(half);
    let lines = half.to_array().map(|half| {
        let ends = [-half, -half + radius / 2.0, -half + radius];
        let breaks: Vec<f64> = ends
            .into_iter()
            .chain(ends.into_iter().rev().map(|at| -at))
            .collect();
        lines_through(&breaks, cell)
    });
    let core = half - DVec3::splat(radius);
    lattice_box(
        [&lines[0], &lines[1], &lines[2]],
        Facing::Outward,
        |_, _| Some(material),
    )
    .moved(|p| {
        let inner = p.clamp(-core, core);
        let rounded = inner + (p - inner).normalize_or_zero() * radius;
        let along = rounded / half;
        let [x, y, z] = (DVec3::ONE - along * along).to_array();
        rounded + along * DVec3::new(y * z, z * x, x * y) * bulge
    })
}

/// A round tube along a path, with flat ends; along a closed path, which lies in a plane, a ring.
pub(super) fn tube(
    path: &[DVec3],
    is_closed: bool,
    radius: f64,
    segments: u32,
    material: MaterialId,
) -> Mesh {
    let count = path.len();
    let direction = |at: usize| {
        let (before, after) = match is_closed {
            true => ((at + count - 1) % count, (at + 1) % count),
            false => (at.saturating_sub(1), (at + 1).min(count - 1)),
        };
        (path[after] - path[before]).normalize_or(DVec3::Y)
    };
    let mut mesh = Mesh::default();
    let mut along = direction(0);
    let mut across = along.any_orthonormal_vector();
    let mut rings: Vec<Vec<u32>> = Vec::with_capacity(count);
    for (at, &middle) in path.iter().enumerate() {
        // Turned no more than the path, so that the sides do not twist.
        across = DQuat::from_rotation_arc(along, direction(at)) * across;
        along = direction(at);
        let beside = along.cross(across);
        let ring = (0..segments).map(|segment| {
            let (sine, cosine) = (TAU * f64::from(segment) / f64::from(segments)).sin_cos();
            mesh.vertex(middle + (across * cosine + beside * sine) * radius)
        });
        rings.push(ring.collect());
    }
    let next = |segment: usize| (segment + 1) % segments as usize;
    let mut join = |from: &[u32], to: &[u32]| {
        for (segment, &corner) in from.iter().enumerate() {
            let after = next(segment);
            mesh.quad([corner, from[after], to[after], to[segment]], material);
        }
    };
    for pair in rings.windows(2) {
        join(&pair[0], &pair[1]);
    }
    let (first, last) = (&rings[0], &rings[count - 1]);
    if is_closed {
        join(last, first);
        return mesh;
    }
    let ends = [path[0], path[count - 1]].map(|end| mesh.vertex(end));
    for segment in 0..segments as usize {
        let after = next(segment);
        mesh.triangle([ends[0], first[after], first[segment]], material);
        mesh.triangle([ends[1], last[segment], last[after]], material);
    }
    mesh
}

/// So many points of a curve, from its parameter 0 to 1.
pub(super) fn curve(count: u32, at: impl Fn(f64) -> DVec3) -> Vec<DVec3> {
    let last = f64::from(count - 1);
    (0..count).map(|step| at(f64::from(step) / last)).collect()
}

/// A ring of round wire about a line along x, of so many pieces.
pub(super) fn ring(
    centre: DVec3,
    radius: f64,
    pieces: u32,
    thickness: f64,
    sides: u32,
    material: MaterialId,
) -> Mesh {
    let around = curve(pieces + 1, |t| {
        let (sine, cosine) = (TAU * t).sin_cos();
        DVec3::new(
            centre.x,
            centre.y + radius * cosine,
            centre.z + radius * sine,
        )
    });
    tube(&around[..pieces as usize], true, thickness, sides, material)
}

/// An open sheet of columns and rows of cells, placed by coordinates in 0…1.
pub(super) fn sheet(
    [columns, rows]: [u32; 2],
    material: MaterialId,
    place: impl Fn(DVec2) -> DVec3,
) -> Mesh {
    let mut mesh = Mesh::default();
    let size = DVec2::new(f64::from(columns), f64::from(rows));
    for row in 0..=rows {
        for column in 0..=columns {
            mesh.vertex(place(DVec2::new(f64::from(column), f64::from(row)) / size));
        }
    }
    let number = |column: u32, row: u32| row * (columns + 1) + column;
    for row in 0..rows {
        for column in 0..columns {
            let (right, above) = (column + 1, row + 1);
            mesh.quad(
                [
                    number(column, row),
                    number(right, row),
                    number(right, above),
                    number(column, above),
                ],
                material,
            );
        }
    }
    mesh
}

/// A curtain in folds: its upper edge runs from the origin along x.
pub(super) fn curtain(
    width: f64,
    height: f64,
    folds: u32,
    cells: [u32; 2],
    material: MaterialId,
) -> Mesh {
    sheet(cells, material, |at| {
        let phase = TAU * f64::from(folds) * at.x;
        // Folds open downwards.
        let depth = 0.02 + 0.025 * (1.0 - at.y);
        DVec3::new(
            width * at.x + 0.3 * depth * (2.0 * phase).sin(),
            height * (at.y - 1.0),
            depth * phase.sin() * (1.0 + 0.2 * (5.0 * at.x + 2.0 * at.y).sin()),
        )
    })
}

/// A bulb on a stem under a shade: a cone of cloth, open above and below. Its foot stands at the origin.
pub(super) struct ShadedLamp {
    pub(super) height: f64,
    pub(super) foot: f64,
    pub(super) shade: [f64; 3],
    pub(super) bulb: f64,
}

impl ShadedLamp {
    /// Its mesh: stem, shade and bulb of these materials. `shade` is the lower and the upper radius and the height.
    pub(super) fn mesh(&self, [stem, cloth, glow]: [MaterialId; 3]) -> Mesh {
        let [low, high, tall] = self.shade;
        let base = self.height - tall;
        let bulb = base + 0.45 * tall;
        let profile = [
            (self.foot, -SUNK),
            (self.foot, 0.015),
            (0.25 * self.foot, 0.035),
            (0.011, 0.06),
            (0.011, bulb - 1.8 * self.bulb),
            (0.018, bulb - 1.6 * self.bulb),
            (0.018, bulb - 0.9 * self.bulb),
        ];
        let mut mesh = lathe(&profile.map(DVec2::from), 32, stem, |_, _| 1.0);
        mesh.append(geodesic_sphere(3, glow).moved(|p| p * self.bulb + DVec3::Y * bulb));
        mesh.append(round_sheet([64, 8], cloth, |turn, up| {
            let radius = low + (high - low) * up;
            DVec3::new(radius * turn.x, base + tall * up, radius * turn.y)
        }));
        mesh
    }
}

/// A sheet that closes round the vertical; `place` gets the direction across it and how far up it is, 0…1.
pub(super) fn round_sheet(
    cells: [u32; 2],
    material: MaterialId,
    place: impl Fn(DVec2, f64) -> DVec3,
) -> Mesh {
    sheet(cells, material, |at| {
        // The last column is the first one again, to the bit.
        let turn = DVec2::from_angle(-TAU * at.x.fract());
        place(turn, at.y)
    })
    .welded()
}

/// A plant in a pot at the origin: stems that bend outward, each with a leaf.
pub(super) fn plant(
    seed: u64,
    leaf_count: u32,
    size: f64,
    [pot, earth, leaf]: [MaterialId; 3],
) -> Mesh {
    let profile = [(0.13, -SUNK), (0.15, 0.05), (0.18, 0.3), (0.19, 0.32)];
    let mut mesh = lathe(&profile.map(DVec2::from), 32, pot, |_, _| 1.0);
    let soil = [(0.16, 0.3), (0.15, 0.335), (0.05, 0.34)];
    mesh.append(lathe(&soil.map(DVec2::from), 24, earth, |_, _| 1.0));
    let mut numbers = Numbers(seed);
    for number in 0..leaf_count {
        // Leaves turn by the golden angle.
        let turn = DQuat::from_rotation_y(2.399_963 * f64::from(number));
        let reach = size * numbers.between(0.12, 0.4);
        let height = size * numbers.between(0.5, 1.1) - 0.4 * reach;
        let length = size * numbers.between(0.2, 0.32);
        let root = DVec3::new(0.01, 0.32, 0.02);
        let path = curve(7, |t| {
            root + DVec3::new(reach * t * t, height * (1.0 - 0.3 * t) * t, 0.0)
        });
        let tip = path[path.len() - 1];
        mesh.append(tube(&path, false, 0.004, 8, leaf).moved(|p| turn * p));
        mesh.append(
            leaf_sheet(length, numbers.between(0.2, 0.7), leaf).moved(|p| turn * (p + tip)),
        );
    }
    mesh
}

/// A leaf from the origin along x, folded along its rib and bent down.
fn leaf_sheet(length: f64, droop: f64, material: MaterialId) -> Mesh {
    sheet([4, 10], material, |at| {
        let width = length * (0.015 + 0.22 * (PI * (0.95 * at.y).powf(0.8)).sin());
        let across = 2.0 * at.x - 1.0;
        DVec3::new(
            length * at.y,
            length * (0.25 * at.y - droop * at.y * at.y) + 0.35 * width * across.abs(),
            -width * across,
        )
    })
}

/// Sizes of books: thickness, height and depth, each from the least to the most.
pub(super) struct Books {
    pub(super) thickness: [f64; 2],
    pub(super) height: [f64; 2],
    pub(super) depth: [f64; 2],
}

impl Books {
    /// A row of books from the origin along x, their spines towards +z, as far as they fit in `width`.
    pub(super) fn row(&self, width: f64, numbers: &mut Numbers, covers: &[MaterialId]) -> Mesh {
        let mut mesh = Mesh::default();
        let mut from = 0.001;
        loop {
            let [thickness, height, depth] = [self.thickness, self.height, self.depth]
                .map(|[least, most]| numbers.between(least, most));
            if from + thickness > width {
                return mesh;
            }
            let cover = covers[numbers.between(0.0, covers.len() as f64) as usize];
            // Every tenth one is missing.
            if numbers.between(0.0, 1.0) > 0.1 {
                mesh.append(book(thickness, height, depth, cover).moved(|p| p + DVec3::X * from));
            }
            from += thickness + numbers.between(0.0005, 0.003);
        }
    }
}

/// A standing book with a round spine.
fn book(thickness: f64, height: f64, depth: f64, cover: MaterialId) -> Mesh {
    const ROUND: u32 = 8;
    let spine = (0..=ROUND).map(|step| {
        let angle = PI * f64::from(step) / f64::from(ROUND);
        let half = 0.5 * thickness;
        DVec2::new(half - half * angle.cos(), -0.35 * half * angle.sin())
    });
    let mut outline: Vec<DVec2> = spine.collect();
    outline.extend([DVec2::new(thickness, depth), DVec2::new(0.0, depth)]);
    prism(&outline, -SUNK, height, cover).moved(|p| DVec3::new(p.x, p.z, depth - p.y))
}

/// A moulding around a rectangle of walls from the origin, at a height; `width` is how far it stands off them. It is as
/// high as `depth`, and lower where that is negative.
pub(super) fn moulding(
    [x, z]: [f64; 2],
    at: f64,
    width: f64,
    depth: f64,
    material: MaterialId,
) -> Mesh {
    let half = DVec2::new(x, z) * 0.5 + DVec2::splat(SUNK);
    let towards = depth.signum();
    picture_frame(half, width + SUNK, depth.abs() + SUNK, material).moved(|p| {
        DVec3::new(
            p.x + 0.5 * x,
            at + towards * (p.z - SUNK),
            0.5 * z - towards * p.y,
        )
    })
}

/// Round bars of one radius between pairs of points.
pub(super) fn bars(
    ends: &[[[f64; 3]; 2]],
    radius: f64,
    segments: u32,
    material: MaterialId,
) -> Mesh {
    let mut mesh = Mesh::default();
    for &[from, to] in ends {
        let [from, to] = [from, to].map(DVec3::from_array);
        mesh.append(bar(from, to, radius, segments, material));
    }
    mesh
}
