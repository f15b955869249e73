//! Furniture. Each piece stands at the origin, faces +z and is as wide along x.

use std::f64::consts::TAU;

use glam::{DQuat, DVec2, DVec3};

use super::super::shapes::{Mesh, Numbers, Side, cuboid, geodesic_sphere, lathe, painted_cuboid};
use super::SUNK;
use super::parts::{Books, bars, curve, cushion, placed, tube};
use crate::scene::MaterialId;

/// A box by its corners.
pub(super) fn block(min: [f64; 3], max: [f64; 3], material: MaterialId) -> Mesh {
    cuboid(DVec3::from_array(min), DVec3::from_array(max), material)
}

/// A turned shape by (radius, height).
fn turned<const N: usize>(profile: [(f64, f64); N], segments: u32, material: MaterialId) -> Mesh {
    lathe(&profile.map(DVec2::from), segments, material, |_, _| 1.0)
}

/// A mesh tilted about the x axis by an angle in degrees, then moved.
fn tilted(mesh: Mesh, degrees: f64, at: [f64; 3]) -> Mesh {
    let turn = DQuat::from_rotation_x(degrees.to_radians());
    let at = DVec3::from_array(at);
    mesh.moved(|p| turn * p + at)
}

/// A sofa of so many seats (1 is an armchair), with pillows where there are two or more.
pub(super) fn sofa(
    seats: u32,
    cloth: MaterialId,
    wood: MaterialId,
    pillows: [MaterialId; 2],
) -> Mesh {
    const SEAT: f64 = 0.6;
    let width = SEAT * f64::from(seats);
    let half = 0.5 * width;
    let mut mesh = placed(
        cushion([half + 0.2, 0.12, 0.42], 0.03, 0.05, 0.0, cloth),
        [0.0, 0.22, 0.0],
        0.0,
    );
    mesh.append(placed(
        cushion([half + 0.2, 0.34, 0.1], 0.06, 0.05, 0.01, cloth),
        [0.0, 0.48, -0.39],
        0.0,
    ));
    for side in [-1.0, 1.0] {
        let at = [side * (half + 0.13), 0.37, 0.02];
        mesh.append(placed(
            cushion([0.12, 0.28, 0.43], 0.06, 0.035, 0.01, cloth),
            at,
            0.0,
        ));
        for z in [-0.35, 0.35] {
            let foot = turned([(0.018, -SUNK), (0.03, 0.12)], 16, wood);
            mesh.append(placed(foot, [side * (half + 0.1), 0.0, z], 0.0));
        }
    }
    for seat in 0..seats {
        let x = SEAT * (f64::from(seat) + 0.5) - half;
        let flat = cushion([0.295, 0.085, 0.34], 0.035, 0.024, 0.03, cloth);
        mesh.append(placed(flat, [x, 0.42, 0.08], 0.0));
        let upright = cushion([0.29, 0.22, 0.085], 0.04, 0.024, 0.03, cloth);
        mesh.append(tilted(upright, -14.0, [x, 0.72, -0.2]));
    }
    if seats > 1 {
        for (number, (side, cover)) in [(-1.0, pillows[0]), (1.0, pillows[1])]
            .into_iter()
            .enumerate()
        {
            let pillow = cushion([0.2, 0.2, 0.03], 0.025, 0.018, 0.05, cover);
            let turn = DQuat::from_rotation_z(0.3 * side);
            let at = [side * (half - 0.24), 0.71, -0.02 + 0.03 * number as f64];
            mesh.append(tilted(pillow.moved(|p| turn * p), -24.0, at));
        }
    }
    mesh
}

/// A chair with turned legs and spindles in its back.
pub(super) fn chair(wood: MaterialId, cloth: MaterialId) -> Mesh {
    let mut mesh = placed(
        cushion([0.21, 0.018, 0.2], 0.012, 0.04, 0.004, wood),
        [0.0, 0.435, 0.0],
        0.0,
    );
    mesh.append(placed(
        cushion([0.19, 0.02, 0.18], 0.015, 0.02, 0.02, cloth),
        [0.0, 0.466, 0.005],
        0.0,
    ));
    let leg = [
        (0.012, -SUNK),
        (0.016, 0.05),
        (0.013, 0.07),
        (0.02, 0.1),
        (0.022, 0.18),
        (0.018, 0.2),
        (0.022, 0.22),
        (0.02, 0.34),
        (0.015, 0.36),
        (0.02, 0.38),
        (0.02, 0.42),
    ];
    for x in [-0.17, 0.17] {
        for z in [-0.16, 0.16] {
            mesh.append(placed(turned(leg, 24, wood), [x, 0.0, z], 0.0));
        }
        let post = curve(12, |t| {
            DVec3::new(x * (1.0 + 0.1 * t), 0.43 + 0.5 * t, -0.17 - 0.1 * t * t)
        });
        mesh.append(tube(&post, false, 0.015, 20, wood));
    }
    for number in -2..=2 {
        let x = 0.058 * f64::from(number);
        let spindle = curve(9, |t| {
            DVec3::new(x * (1.0 + 0.1 * t), 0.44 + 0.45 * t, -0.17 - 0.1 * t * t)
        });
        mesh.append(tube(&spindle, false, 0.007, 16, wood));
    }
    let rail = cushion([0.2, 0.035, 0.012], 0.009, 0.03, 0.0, wood);
    mesh.append(tilted(rail, -18.0, [0.0, 0.915, -0.262]));
    let (left, right) = (-0.17, 0.17);
    mesh.append(bars(
        &[
            [[left, 0.13, -0.16], [left, 0.14, 0.16]],
            [[right, 0.13, -0.16], [right, 0.14, 0.16]],
            [[left, 0.17, 0.0], [right, 0.17, 0.0]],
        ],
        0.009,
        16,
        wood,
    ));
    mesh
}

/// A table with a round top of this radius on four splayed round legs.
pub(super) fn round_table(radius: f64, height: f64, wood: MaterialId) -> Mesh {
    let top = [
        (radius - 0.03, height - 0.035),
        (radius - 0.005, height - 0.025),
        (radius, height - 0.012),
        (radius - 0.006, height),
    ];
    let mut mesh = turned(top, 64, wood);
    for quarter in 0..4 {
        let (sine, cosine) = (TAU * (f64::from(quarter) + 0.5) / 4.0).sin_cos();
        let at = |share: f64, y: f64| [share * radius * cosine, y, share * radius * sine];
        mesh.append(bars(
            &[[at(0.72, -SUNK), at(0.5, height - 0.03)]],
            0.022,
            32,
            wood,
        ));
    }
    mesh
}

/// Shelves full of books: width, height and depth of the case, boards on so many levels, and what stands on them.
pub(super) fn bookcase(
    [width, height, depth]: [f64; 3],
    levels: u32,
    wood: MaterialId,
    books: &Books,
    covers: &[MaterialId],
    seed: u64,
) -> Mesh {
    const BOARD: f64 = 0.022;
    let half = 0.5 * width;
    let mut mesh = Mesh::default();
    for side in [-1.0, 1.0] {
        let (inner, outer) = (side * (half - BOARD), side * half);
        let (low, high) = (f64::min(inner, outer), f64::max(inner, outer));
        mesh.append(block([low, -SUNK, 0.0], [high, height, depth], wood));
    }
    let inside = half - BOARD;
    mesh.append(block(
        [-inside - SUNK, 0.03, 0.004],
        [inside + SUNK, height - 0.03, 0.012],
        wood,
    ));
    let mut numbers = Numbers(seed);
    let step = (height - 0.08 - BOARD) / f64::from(levels);
    for level in 0..=levels {
        let low = 0.06 + step * f64::from(level);
        mesh.append(block(
            [-inside - SUNK, low, 0.009],
            [inside + SUNK, low + BOARD, depth - 0.01],
            wood,
        ));
        if level < levels {
            let row = books.row(2.0 * inside, &mut numbers, covers);
            let at = [-inside, low + BOARD, 0.02];
            mesh.append(placed(row, at, 0.0));
        }
    }
    mesh
}

/// A swivel chair: a star of five legs on castors, a column, an upholstered seat and back, arms of bent tube.
pub(super) fn swivel_chair(cloth: MaterialId, plastic: MaterialId, metal: MaterialId) -> Mesh {
    let mut mesh = Mesh::default();
    for number in 0..5 {
        let degrees = 72.0 * f64::from(number);
        let leg = curve(4, |t| DVec3::new(0.0, 0.13 - 0.05 * t * t, 0.02 + 0.28 * t));
        mesh.append(placed(
            tube(&leg, false, 0.018, 12, plastic),
            [0.0; 3],
            degrees,
        ));
        let castor = turned(
            [
                (0.012, -0.02),
                (0.029, -0.014),
                (0.029, 0.014),
                (0.024, 0.02),
            ],
            24,
            plastic,
        );
        let axle = DQuat::from_rotation_z(0.5 * std::f64::consts::PI);
        let castor = castor.moved(|p| axle * p + DVec3::new(0.0, 0.026, 0.3));
        mesh.append(placed(castor, [0.0; 3], degrees));
        let pin = bars(&[[[0.0, 0.04, 0.3], [0.0, 0.1, 0.28]]], 0.007, 10, metal);
        mesh.append(placed(pin, [0.0; 3], degrees));
    }
    mesh.append(turned(
        [
            (0.035, 0.1),
            (0.035, 0.16),
            (0.026, 0.17),
            (0.026, 0.3),
            (0.016, 0.31),
            (0.016, 0.43),
        ],
        16,
        metal,
    ));
    mesh.append(placed(
        cushion([0.24, 0.035, 0.23], 0.03, 0.12, 0.012, cloth),
        [0.0, 0.46, 0.0],
        0.0,
    ));
    let back = cushion([0.22, 0.28, 0.03], 0.025, 0.12, 0.012, cloth);
    mesh.append(tilted(back, -8.0, [0.0, 0.8, -0.25]));
    let spine = curve(6, |t| {
        DVec3::new(
            0.0,
            0.43 + 0.4 * t * t,
            -0.12 - 0.2 * (1.0 - (1.0 - t).powi(2)),
        )
    });
    mesh.append(tube(&spine, false, 0.02, 12, plastic));
    for x in [-0.26_f64, 0.26] {
        let arm = curve(7, |t| {
            let swing = (TAU * 0.5 * t).sin();
            DVec3::new(
                x + 0.02 * x.signum() * swing,
                0.45 + 0.2 * swing.sqrt(),
                0.16 - 0.3 * t,
            )
        });
        mesh.append(tube(&arm, false, 0.014, 12, plastic));
        let pad = block([-0.03, -0.012, -0.11], [0.03, 0.012, 0.11], plastic);
        mesh.append(placed(pad, [x * 1.07, 0.667, 0.01], 0.0));
    }
    mesh
}

/// What a place to work is made of.
pub(super) struct DeskPaints {
    pub(super) board: MaterialId,
    pub(super) metal: MaterialId,
    pub(super) plastic: MaterialId,
    pub(super) screen: MaterialId,
    pub(super) keys: MaterialId,
    pub(super) paper: MaterialId,
    pub(super) mug: MaterialId,
}

/// A desk, 1.6 m wide and 0.8 m deep, its edge for the one who sits there at +z: with a screen, a keyboard, a mouse, a
/// mug, papers and a cabinet.
pub(super) fn desk(paints: &DeskPaints, numbers: &mut Numbers) -> Mesh {
    const TOP: f64 = 0.74;
    let mut mesh = placed(
        cushion([0.79, 0.0125, 0.39], 0.006, 0.5, 0.0, paints.board),
        [0.0, TOP - 0.0125, 0.0],
        0.0,
    );
    let legs = [[-0.72, -0.34], [0.72, -0.34], [-0.72, 0.34], [0.72, 0.34]];
    let legs = legs.map(|[x, z]| [[x, -SUNK, z], [x, TOP - 0.02, z]]);
    mesh.append(bars(&legs, 0.022, 16, paints.metal));
    let cross = [[[-0.72, 0.66, -0.34], [0.72, 0.66, -0.34]]];
    mesh.append(bars(&cross, 0.015, 16, paints.metal));
    mesh.append(block([0.3, 0.04, -0.3], [0.68, 0.6, 0.3], paints.metal));
    for drawer in 0..3 {
        let low = 0.06 + 0.18 * f64::from(drawer);
        let front = block([-0.18, -0.083, -0.01], [0.18, 0.083, 0.01], paints.board);
        mesh.append(placed(front, [0.49, low + 0.083, 0.305], 0.0));
        let handle = curve(8, |t| {
            let out = (TAU * 0.5 * t).sin().sqrt();
            DVec3::new(0.43 + 0.12 * t, low + 0.13, 0.312 + 0.025 * out)
        });
        mesh.append(tube(&handle, false, 0.004, 8, paints.metal));
    }
    mesh.append(screen(paints).moved(|p| p + DVec3::new(-0.1, TOP, -0.2)));
    let keyboard = keyboard(paints);
    let askew = numbers.between(-6.0, 6.0);
    mesh.append(placed(keyboard, [-0.15, TOP, 0.16], askew));
    let mouse = geodesic_sphere(3, paints.plastic).moved(|p| p * DVec3::new(0.032, 0.018, 0.055));
    mesh.append(placed(mouse, [0.2, TOP + 0.012, 0.17], askew));
    let mug = [
        (0.036, -SUNK),
        (0.04, 0.008),
        (0.042, 0.09),
        (0.038, 0.092),
        (0.036, 0.03),
        (0.01, 0.028),
    ];
    let at = [numbers.between(-0.6, -0.5), TOP, numbers.between(-0.1, 0.2)];
    let mut cup = turned(mug, 24, paints.mug);
    let handle = curve(8, |t| {
        let (sine, cosine) = (TAU * 0.5 * t).sin_cos();
        DVec3::new(0.036 + 0.03 * sine, 0.048 + 0.025 * cosine, 0.0)
    });
    cup.append(tube(&handle, false, 0.005, 8, paints.mug));
    mesh.append(placed(cup, at, numbers.between(0.0, 360.0)));
    let mut height = TOP - 0.001;
    for _ in 0..6 {
        let thick = numbers.between(0.002, 0.012);
        let sheets = block(
            [-0.105, 0.0, -0.148],
            [0.105, thick + 0.0005, 0.148],
            paints.paper,
        );
        let place = [0.52, height, -0.08];
        mesh.append(placed(sheets, place, numbers.between(-12.0, 12.0)));
        height += thick;
    }
    mesh
}

/// A flat screen on its foot.
fn screen(paints: &DeskPaints) -> Mesh {
    let mut mesh = turned(
        [
            (0.12, -SUNK),
            (0.12, 0.006),
            (0.035, 0.012),
            (0.018, 0.03),
            (0.018, 0.24),
        ],
        32,
        paints.plastic,
    );
    let housing = cushion([0.31, 0.185, 0.012], 0.008, 0.3, 0.0, paints.plastic);
    mesh.append(placed(housing, [0.0, 0.33, 0.026], 0.0));
    // The picture lies just before its housing.
    let (low, high) = (
        DVec3::new(-0.3, 0.155, 0.039),
        DVec3::new(0.3, 0.505, 0.043),
    );
    mesh.append(painted_cuboid(low, high, |side| match side {
        Side::Far => paints.screen,
        _ => paints.plastic,
    }));
    mesh
}

/// A keyboard of 56 keys.
fn keyboard(paints: &DeskPaints) -> Mesh {
    let mut mesh = block(
        [-0.16, -0.001, -0.052],
        [0.16, 0.012, 0.052],
        paints.plastic,
    );
    for row in 0..4 {
        for column in 0..14 {
            let (x, z) = (
                0.022 * (f64::from(column) - 6.5),
                0.0235 * (f64::from(row) - 1.5),
            );
            let min = [x - 0.0095, 0.01, z - 0.01];
            mesh.append(block(min, [x + 0.0095, 0.0185, z + 0.01], paints.keys));
        }
    }
    mesh
}
