//! A subway carriage along z: benches under the windows, poles, rails and straps of long thin triangles, and two light
//! strips of many small ones.

use std::f64::consts::PI;

use glam::{DVec2, DVec3, Vec2, Vec3};

use super::super::palette::{glass, glowing, plain, textured};
use super::super::pictures;
use super::super::shapes::{
    Facing, Mesh, Side, bar, lathe, lattice_box, lines_through, painted_cuboid, picture_frame,
    triangulated,
};
use super::SUNK;
use super::furniture::block;
use super::parts::{bars, curve, cushion, placed, ring, tube};
use crate::scene::{MaterialId, SceneBuilder};

const LENGTH: f64 = 18.0;
/// Half the width inside.
const HALF: f64 = 1.35;
const WALL: f64 = 0.12;
/// Where the roof begins to bend, and how far it rises.
const EAVES: f64 = 1.95;
const RISE: f64 = 0.4;
const WINDOW_Y: [f64; 2] = [0.78, 1.6];
/// Windows and doors repeat at this distance.
const BAY: f64 = 3.0;
const BAYS: u32 = 6;
const WINDOW_HALF: f64 = 0.85;
const ROOF_SEGMENTS: u32 = 20;
/// Segments of the outline before the roof: three of the floor, three of a wall.
const FLOOR_SEGMENTS: usize = 3;
const WALL_SEGMENTS: usize = 3;
/// The overhead rails: distance from the middle, and height.
const RAIL_X: f64 = 0.62;
const RAIL_Y: f64 = 1.9;

/// The materials.
struct Paints {
    floor: MaterialId,
    panel: MaterialId,
    ceiling: MaterialId,
    outside: MaterialId,
    frame: MaterialId,
    door: MaterialId,
    steel: MaterialId,
    seats: [MaterialId; 2],
    strap: MaterialId,
    lamp: MaterialId,
    glass: MaterialId,
    posters: [MaterialId; 3],
}

pub(in super::super) fn carriage() -> SceneBuilder {
    let mut builder = SceneBuilder::default();
    let paints = paints(&mut builder);
    body(&mut builder, &paints);
    windows(&mut builder, &paints);
    for bay in 0..BAYS {
        let z = BAY * (f64::from(bay) + 0.5);
        for side in [-1.0, 1.0] {
            bench(&mut builder, &paints, side, z);
            posters(&mut builder, &paints, side, z, bay as usize);
        }
    }
    doors(&mut builder, &paints);
    poles(&mut builder, &paints);
    rails_and_straps(&mut builder, &paints);
    light_strips(&mut builder, &paints);
    builder
}

fn paints(builder: &mut SceneBuilder) -> Paints {
    let glass = glass(builder, 0.15, 0.5);
    let floor = pictures::stone_tiles(
        "floor.png",
        Vec3::new(0.44, 0.45, 0.48),
        Vec3::new(0.4, 0.41, 0.45),
    );
    Paints {
        floor: textured(builder, "floor", floor),
        panel: plain(builder, "wall panel", [0.74, 0.74, 0.7]),
        ceiling: plain(builder, "ceiling", [0.8, 0.8, 0.8]),
        outside: plain(builder, "outside", [0.5, 0.12, 0.1]),
        frame: plain(builder, "window frame", [0.25, 0.25, 0.27]),
        door: plain(builder, "door", [0.64, 0.5, 0.16]),
        steel: plain(builder, "steel", [0.58, 0.58, 0.58]),
        seats: [
            plain(builder, "blue seat", [0.12, 0.22, 0.46]),
            plain(builder, "green seat", [0.16, 0.4, 0.3]),
        ],
        strap: plain(builder, "strap", [0.7, 0.66, 0.56]),
        lamp: glowing(builder, "lamp", [14.0, 14.6, 15.0]),
        glass,
        posters: [
            textured(builder, "landscape", pictures::landscape("landscape.png")),
            textured(
                builder,
                "rectangles",
                pictures::rectangles("rectangles.png"),
            ),
            textured(builder, "rings", pictures::rings("rings.png")),
        ],
    }
}

/// The outline of the body in (x, y), counter-clockwise, this much larger than the inside.
fn outline(offset: f64) -> Vec<DVec2> {
    let half = HALF + offset;
    let floor = [-half, -0.45, 0.45, half].map(|x| DVec2::new(x, -offset));
    let wall = WINDOW_Y.map(|y| DVec2::new(half, y));
    let roof = (0..=ROOF_SEGMENTS).map(|step| {
        // Its ends are those of the walls, to the bit.
        let (sine, cosine) = match step {
            0 => (0.0, 1.0),
            ROOF_SEGMENTS => (0.0, -1.0),
            _ => (PI * f64::from(step) / f64::from(ROOF_SEGMENTS)).sin_cos(),
        };
        DVec2::new(half * cosine, EAVES + (RISE + offset) * sine)
    });
    let mut outline: Vec<DVec2> = floor.into_iter().chain(wall).chain(roof).collect();
    outline.extend(WINDOW_Y.into_iter().rev().map(|y| DVec2::new(-half, y)));
    outline
}

/// A closed body along z over an outline, cut at these places. `material` gets the number of the segment and the middle
/// of the cell along z; cells without a material are left open.
fn body_along_z(
    outline: &[DVec2],
    zs: &[f64],
    facing: Facing,
    material: impl Fn(usize, f64) -> Option<MaterialId>,
    ends: MaterialId,
) -> Mesh {
    let mut mesh = Mesh::default();
    let count = outline.len() as u32;
    for &z in zs {
        for corner in outline {
            mesh.vertex(corner.extend(z));
        }
    }
    let mut add = |mut corners: [u32; 3], material| {
        if facing == Facing::Inward {
            corners.reverse();
        }
        mesh.triangle(corners, material);
    };
    for (cell, ends) in zs.windows(2).enumerate() {
        let base = cell as u32 * count;
        for segment in 0..count {
            let Some(material) = material(segment as usize, 0.5 * (ends[0] + ends[1])) else {
                continue;
            };
            let next = (segment + 1) % count;
            let [a, b, c, d] =
                [segment, next, next + count, segment + count].map(|corner| base + corner);
            add([a, b, c], material);
            add([a, c, d], material);
        }
    }
    let far = (zs.len() as u32 - 1) * count;
    for [a, b, c] in triangulated(outline, &[]) {
        add([c, b, a], ends);
        add([a + far, b + far, c + far], ends);
    }
    mesh
}

/// The windows along z.
fn window_ends() -> Vec<[f64; 2]> {
    let middle = |bay: u32| BAY * (f64::from(bay) + 0.5);
    (0..BAYS)
        .map(|bay| [middle(bay) - WINDOW_HALF, middle(bay) + WINDOW_HALF])
        .collect()
}

/// Walls, floor and roof, inside and outside, joined by the reveals of the windows.
fn body(builder: &mut SceneBuilder, paints: &Paints) {
    let windows = window_ends();
    let is_window = |segment: usize, z: f64| {
        let right = FLOOR_SEGMENTS + 1;
        let left = FLOOR_SEGMENTS + WALL_SEGMENTS + ROOF_SEGMENTS as usize + 1;
        let is_beside = |ends: &[f64; 2]| z > ends[0] && z < ends[1];
        (segment == right || segment == left) && windows.iter().any(is_beside)
    };
    let lines = |low: f64, high: f64| -> Vec<f64> {
        let mut lines = vec![low];
        lines.extend(windows.iter().flatten());
        lines.push(high);
        lines
    };
    let roof =
        FLOOR_SEGMENTS + WALL_SEGMENTS..FLOOR_SEGMENTS + WALL_SEGMENTS + ROOF_SEGMENTS as usize;
    let mut mesh = body_along_z(
        &outline(0.0),
        &lines(0.0, LENGTH),
        Facing::Inward,
        |segment, z| {
            (!is_window(segment, z)).then(|| match segment {
                segment if segment < FLOOR_SEGMENTS => paints.floor,
                segment if roof.contains(&segment) => paints.ceiling,
                _ => paints.panel,
            })
        },
        paints.panel,
    );
    mesh.append(body_along_z(
        &outline(WALL),
        &lines(-WALL, LENGTH + WALL),
        Facing::Outward,
        |segment, z| (!is_window(segment, z)).then_some(paints.outside),
        paints.outside,
    ));
    for xs in [[-HALF - WALL, -HALF], [HALF, HALF + WALL]] {
        for ends in &windows {
            mesh.append(lattice_box(
                [&xs, &WINDOW_Y, ends],
                Facing::Inward,
                |side, _| (side != Side::Left && side != Side::Right).then_some(paints.frame),
            ));
        }
    }
    mesh.welded()
        .textured(paints.floor, |p| Vec2::new(p.x as f32, p.z as f32))
        .add_to(builder, "body");
}

/// Panes, and frames around them.
fn windows(builder: &mut SceneBuilder, paints: &Paints) {
    let mut panes = Mesh::default();
    let [low, high] = [WINDOW_Y[0] - SUNK, WINDOW_Y[1] + SUNK];
    for [near, far] in window_ends() {
        for side in [-1.0, 1.0] {
            let x = side * (HALF + 0.5 * WALL);
            let corners = [
                (near - SUNK, low),
                (far + SUNK, low),
                (far + SUNK, high),
                (near - SUNK, high),
            ]
            .map(|(z, y)| panes.vertex(DVec3::new(x, y, z)));
            panes.quad(corners, paints.glass);
            let half = DVec2::new(far - near, WINDOW_Y[1] - WINDOW_Y[0]) * 0.5;
            let frame = picture_frame(half + DVec2::splat(0.04), 0.05, 0.018, paints.frame);
            let at = [
                side * (HALF + SUNK),
                0.5 * (WINDOW_Y[0] + WINDOW_Y[1]),
                0.5 * (near + far),
            ];
            placed(frame, at, -90.0 * side).add_to(builder, "window frame");
        }
    }
    panes.add_to(builder, "panes");
}

/// A bench of three seats along a wall, with a pane and a bent pole at each end.
fn bench(builder: &mut SceneBuilder, paints: &Paints, side: f64, z: f64) {
    let mut mesh = Mesh::default();
    for seat in -1_i32..=1 {
        let cover = paints.seats[(seat & 1) as usize];
        let flat = cushion([0.28, 0.035, 0.22], 0.03, 0.2, 0.012, cover);
        let at = z + 0.575 * f64::from(seat);
        mesh.append(flat.moved(|p| p + DVec3::new(0.575 * f64::from(seat), 0.43, 0.27)));
        let back = cushion([0.28, 0.15, 0.025], 0.022, 0.2, 0.012, cover);
        mesh.append(back.moved(|p| p + DVec3::new(0.575 * f64::from(seat), 0.6, 0.032)));
        let brace = curve(5, |t| {
            DVec3::new(
                side * (1.36 - 0.4 * t),
                0.2 + 0.2 * (0.5 * PI * t).sin(),
                at,
            )
        });
        tube(&brace, false, 0.02, 12, paints.steel).add_to(builder, "brace");
    }
    placed(mesh, [side * HALF, 0.0, z], -90.0 * side).add_to(builder, "bench");
    let mut panes = Mesh::default();
    for end in [-1.0, 1.0] {
        let z = z + 0.92 * end;
        let pole = curve(9, |t| {
            let bend = (1.0 - (2.0 * t - 0.9).abs()).max(0.0);
            DVec3::new(side * (0.98 - 0.18 * bend), -SUNK + 2.25 * t, z)
        });
        tube(&pole, false, 0.017, 16, paints.steel).add_to(builder, "bench pole");
        let [inner, outer] = [0.83, 1.34].map(|x| side * x);
        let corners = [(inner, 0.62), (outer, 0.62), (outer, 1.4), (inner, 1.4)]
            .map(|(x, y)| panes.vertex(DVec3::new(x, y, z)));
        panes.quad(corners, paints.glass);
    }
    panes.add_to(builder, "screens");
}

/// Posters above a window.
fn posters(builder: &mut SceneBuilder, paints: &Paints, side: f64, z: f64, bay: usize) {
    for (number, offset) in [-0.45, 0.45].into_iter().enumerate() {
        let poster = paints.posters[(2 * bay + number + usize::from(side > 0.0)) % 3];
        let half = DVec3::new(0.4, 0.12, 0.006);
        let front = painted_cuboid(-half, half, |side| match side {
            Side::Far => poster,
            _ => paints.frame,
        })
        .textured(poster, |p| {
            Vec2::new((0.5 + p.x / 0.8) as f32, (0.5 + p.y / 0.24) as f32)
        });
        placed(
            front,
            [side * (HALF - 0.003), 1.79, z + offset],
            -90.0 * side,
        )
        .add_to(builder, "poster");
    }
}

/// Doors of two leaves between the windows, and one in each end wall.
fn doors(builder: &mut SceneBuilder, paints: &Paints) {
    let leaf = || cushion([0.31, 0.93, 0.02], 0.015, 0.9, 0.0, paints.door);
    let handle = || {
        let grip = curve(8, |t| {
            DVec3::new(0.0, 0.4 * t - 0.2, 0.05 * (PI * t).sin().sqrt())
        });
        tube(&grip, false, 0.01, 12, paints.steel)
    };
    for bay in 1..BAYS {
        for side in [-1.0, 1.0] {
            for half in [-0.315, 0.315] {
                let at = [side * (HALF - 0.008), 0.96, BAY * f64::from(bay) + half];
                placed(leaf(), at, -90.0 * side).add_to(builder, "door");
                let at = [
                    side * (HALF - 0.026),
                    1.1,
                    BAY * f64::from(bay) + 0.8 * half,
                ];
                placed(handle(), at, -90.0 * side).add_to(builder, "door handle");
            }
        }
    }
    for (z, degrees) in [(0.008, 0.0), (LENGTH - 0.008, 180.0)] {
        placed(leaf(), [0.0, 0.96, z], degrees).add_to(builder, "end door");
        let at = [0.24, 1.1, z + if degrees == 0.0 { 0.018 } else { -0.018 }];
        placed(handle(), at, degrees).add_to(builder, "door handle");
    }
}

/// Upright poles along the middle, each in a socket above and below.
fn poles(builder: &mut SceneBuilder, paints: &Paints) {
    let socket = [(0.05, -SUNK), (0.05, 0.006), (0.03, 0.02), (0.022, 0.06)];
    let top = EAVES + RISE;
    for number in 1..2 * BAYS {
        let z = 0.5 * BAY * f64::from(number);
        let ends = [[0.0, -SUNK, z], [0.0, top + SUNK, z]];
        bars(&[ends], 0.018, 32, paints.steel).add_to(builder, "pole");
        let foot = lathe(&socket.map(DVec2::from), 24, paints.steel, |_, _| 1.0);
        let head = foot.clone().moved(|p| DVec3::new(p.x, top - p.y, -p.z));
        for socket in [foot, head] {
            socket.moved(|p| p + DVec3::Z * z).add_to(builder, "socket");
        }
    }
}

/// The height of the ceiling at a distance from the middle.
fn ceiling_height(x: f64) -> f64 {
    EAVES + RISE * (1.0 - (x / HALF).powi(2)).sqrt()
}

/// Rails overhead on hangers, and the straps on them.
fn rails_and_straps(builder: &mut SceneBuilder, paints: &Paints) {
    for side in [-1.0, 1.0] {
        let x = side * RAIL_X;
        let [from, to] = [-SUNK, LENGTH + SUNK].map(|z| DVec3::new(x, RAIL_Y, z));
        bar(from, to, 0.016, 32, paints.steel).add_to(builder, "rail");
        for hanger in 0..=BAYS {
            let z = (BAY * f64::from(hanger)).clamp(0.1, LENGTH - 0.1);
            let foot = DVec3::new(x, RAIL_Y, z);
            let head = DVec3::new(x, ceiling_height(x) + 0.01, z);
            bar(foot, head, 0.012, 24, paints.steel).add_to(builder, "hanger");
        }
        let mut straps = Mesh::default();
        for number in 0..28 {
            let z = 0.36 + 0.63 * f64::from(number);
            // Each hangs askew a little.
            let swing = 0.12 * (2.3 * f64::from(number)).sin();
            let mut strap = block(
                [-0.0015, -0.2, -0.014],
                [0.0015, -0.01, 0.014],
                paints.strap,
            );
            let centre = DVec3::new(0.0, -0.255, 0.0);
            strap.append(ring(centre, 0.06, 16, 0.007, 6, paints.strap));
            let turn = glam::DQuat::from_rotation_x(swing);
            straps.append(strap.moved(|p| turn * p + DVec3::new(x, RAIL_Y, z)));
        }
        straps.add_to(builder, "straps");
    }
}

/// Two strips of light under the ceiling: a housing above, a bent diffuser below.
fn light_strips(builder: &mut SceneBuilder, paints: &Paints) {
    const BENDS: u32 = 8;
    for x in [-0.34, 0.34] {
        let top = ceiling_height(x) - 0.03;
        // The diffuser runs from left to right, the last segment is the top.
        let outline: Vec<DVec2> = (0..=BENDS)
            .map(|step| {
                let (sine, cosine) = (PI * f64::from(step) / f64::from(BENDS)).sin_cos();
                DVec2::new(x - 0.09 * cosine, top - 0.05 * sine)
            })
            .collect();
        let zs = lines_through(&[0.5, LENGTH - 0.5], 0.14);
        let material = |segment: usize, _| {
            Some(if segment == BENDS as usize {
                paints.steel
            } else {
                paints.lamp
            })
        };
        body_along_z(&outline, &zs, Facing::Outward, material, paints.steel)
            .add_to(builder, "light strip");
        for number in 0..12 {
            let z = 0.75 + 1.5 * f64::from(number);
            block(
                [x - 0.03, top - SUNK, z - 0.02],
                [x + 0.03, top + 0.06, z + 0.02],
                paints.steel,
            )
            .add_to(builder, "bracket");
        }
    }
}
