//! An open-plan office: desks in groups of four between partitions, binders along the wall, a meeting room behind glass,
//! and a ceiling of panels, every sixth or so a lamp.

use glam::{DVec3, Vec2, Vec3};

use super::super::palette::{glass, glowing, in_colours, plain, textured};
use super::super::pictures;
use super::super::shapes::{Facing, Mesh, Numbers, Side, lattice_box, lines_through};
use super::SUNK;
use super::furniture::{DeskPaints, block, bookcase, desk, round_table, swivel_chair};
use super::parts::{Books, bars, cushion, moulding, placed, plant};
use crate::scene::{MaterialId, SceneBuilder};

/// Side of a ceiling panel.
const PANEL: f64 = 0.6;
const PANELS: [u32; 2] = [25, 17];
const HEIGHT: f64 = 2.9;
/// Width and depth.
const GROUND: [f64; 2] = [PANEL * PANELS[0] as f64, PANEL * PANELS[1] as f64];
/// The corner of the meeting room.
const GLASS: [f64; 2] = [12.0, 6.6];

/// The materials.
struct Paints {
    wall: MaterialId,
    accent: MaterialId,
    ceiling: MaterialId,
    carpet: MaterialId,
    lamp: MaterialId,
    grid: MaterialId,
    partition: MaterialId,
    cloths: [MaterialId; 2],
    wood: MaterialId,
    glass: MaterialId,
    potted: [MaterialId; 3],
    binders: Vec<MaterialId>,
    desk: DeskPaints,
}

pub(in super::super) fn office() -> SceneBuilder {
    let mut builder = SceneBuilder::default();
    let paints = paints(&mut builder);
    shell(&mut builder, &paints);
    desks(&mut builder, &paints);
    meeting_room(&mut builder, &paints);
    along_the_walls(&mut builder, &paints);
    builder
}

fn paints(builder: &mut SceneBuilder) -> Paints {
    let carpet = pictures::stone_tiles(
        "carpet.png",
        Vec3::new(0.46, 0.48, 0.52),
        Vec3::new(0.4, 0.42, 0.47),
    );
    let glass = glass(builder, 0.12, 0.6);
    let binders = [
        [0.14, 0.15, 0.17],
        [0.12, 0.22, 0.44],
        [0.56, 0.14, 0.12],
        [0.7, 0.7, 0.68],
        [0.16, 0.36, 0.22],
    ];
    Paints {
        wall: plain(builder, "wall", [0.76, 0.76, 0.74]),
        accent: plain(builder, "accent wall", [0.2, 0.42, 0.5]),
        ceiling: plain(builder, "ceiling panel", [0.8, 0.8, 0.78]),
        carpet: textured(builder, "carpet", carpet),
        lamp: glowing(builder, "lamp", [8.2, 8.0, 7.4]),
        grid: plain(builder, "grid", [0.7, 0.7, 0.7]),
        partition: plain(builder, "partition", [0.36, 0.42, 0.46]),
        cloths: [
            plain(builder, "grey cloth", [0.2, 0.2, 0.22]),
            plain(builder, "orange cloth", [0.6, 0.28, 0.1]),
        ],
        wood: plain(builder, "beech", [0.6, 0.44, 0.28]),
        glass,
        potted: [
            plain(builder, "pot", [0.7, 0.7, 0.68]),
            plain(builder, "earth", [0.12, 0.1, 0.1]),
            plain(builder, "leaf", [0.12, 0.34, 0.1]),
        ],
        binders: in_colours(builder, "binder", &binders),
        desk: DeskPaints {
            board: plain(builder, "desk board", [0.7, 0.66, 0.58]),
            metal: plain(builder, "metal", [0.5, 0.51, 0.52]),
            plastic: plain(builder, "plastic", [0.12, 0.12, 0.13]),
            screen: glowing(builder, "screen", [0.55, 0.75, 1.0]),
            keys: plain(builder, "keys", [0.2, 0.2, 0.21]),
            paper: plain(builder, "paper", [0.8, 0.8, 0.78]),
            mug: plain(builder, "mug", [0.62, 0.3, 0.2]),
        },
    }
}

/// Walls, floor and ceiling; the bars between the panels of the ceiling.
fn shell(builder: &mut SceneBuilder, paints: &Paints) {
    let lines = |count: u32| -> Vec<f64> { (0..=count).map(|at| PANEL * f64::from(at)).collect() };
    let (xs, zs) = (lines(PANELS[0]), lines(PANELS[1]));
    let ys = lines_through(&[0.0, HEIGHT], 0.7);
    lattice_box([&xs, &ys, &zs], Facing::Inward, |side, centre| {
        let [column, row] = [centre.x, centre.z].map(|at| (at / PANEL) as u32);
        Some(match side {
            Side::Top if column % 3 == 2 && row % 2 == 1 => paints.lamp,
            Side::Top => paints.ceiling,
            Side::Bottom => paints.carpet,
            Side::Right => paints.accent,
            _ => paints.wall,
        })
    })
    .textured(paints.carpet, |p| Vec2::new(p.x as f32, p.z as f32) / 2.4)
    .add_to(builder, "room");
    let mut grid = Mesh::default();
    // The bars of one direction hang lower, so that no two lie in one plane where they cross.
    for &x in &xs[1..xs.len() - 1] {
        let min = [x - 0.012, HEIGHT - 0.008, -SUNK];
        grid.append(block(
            min,
            [x + 0.012, HEIGHT + SUNK, GROUND[1] + SUNK],
            paints.grid,
        ));
    }
    for &z in &zs[1..zs.len() - 1] {
        let min = [-SUNK, HEIGHT - 0.006, z - 0.012];
        grid.append(block(
            min,
            [GROUND[0] + SUNK, HEIGHT + 2.0 * SUNK, z + 0.012],
            paints.grid,
        ));
    }
    grid.add_to(builder, "ceiling grid");
    moulding(GROUND, 0.0, 0.012, 0.07, paints.grid).add_to(builder, "skirting");
}

/// Groups of four desks with chairs.
fn desks(builder: &mut SceneBuilder, paints: &Paints) {
    let mut numbers = Numbers(24);
    for [x, z] in [2.2, 5.9, 9.6]
        .into_iter()
        .flat_map(|x| [[x, 2.4], [x, 6.2]])
    {
        for (number, cloth) in paints.cloths.into_iter().enumerate() {
            for (side, facing) in [(1.0, 0.0), (-1.0, 180.0)] {
                let x = x + if number == 0 { -0.82 } else { 0.82 };
                placed(
                    desk(&paints.desk, &mut numbers),
                    [x, 0.0, z + 0.42 * side],
                    facing,
                )
                .add_to(builder, "desk");
                let chair = swivel_chair(cloth, paints.desk.plastic, paints.desk.metal);
                let out = numbers.between(0.95, 1.2) * side;
                let at = [x + numbers.between(-0.3, 0.1), 0.0, z + out];
                placed(chair, at, facing + 180.0 + numbers.between(-35.0, 35.0))
                    .add_to(builder, "chair");
            }
        }
        partitions(paints)
            .moved(|p| p + DVec3::new(x, 0.0, z))
            .add_to(builder, "partition");
    }
}

/// Partitions between four desks: one along x, one across, on round posts.
fn partitions(paints: &Paints) -> Mesh {
    let mut mesh = placed(
        cushion([1.66, 0.38, 0.014], 0.01, 0.4, 0.0, paints.partition),
        [0.0, 0.84, 0.0],
        0.0,
    );
    mesh.append(placed(
        cushion([0.82, 0.33, 0.013], 0.01, 0.4, 0.0, paints.partition),
        [0.0, 0.82, 0.0],
        90.0,
    ));
    let posts = [[-1.64, 0.0], [1.64, 0.0], [0.0, -0.8], [0.0, 0.8]];
    let posts = posts.map(|[x, z]| [[x, -SUNK, z], [x, 1.24, z]]);
    mesh.append(bars(&posts, 0.018, 24, paints.desk.metal));
    mesh
}

/// A corner of the room behind glass, with a round table.
fn meeting_room(builder: &mut SceneBuilder, paints: &Paints) {
    let [x, z] = GLASS;
    let (end_x, end_z) = (GROUND[0], GROUND[1]);
    let top = 2.3;
    let along_x = |at: f64| [at, z];
    let along_z = |at: f64| [x, at];
    let posts: Vec<[f64; 2]> = [x, x + 1.0, x + 2.0, end_x - 0.03]
        .map(along_x)
        .into_iter()
        .chain([z + 0.9, z + 1.8, z + 2.7].map(along_z))
        .collect();
    let mut frame = Mesh::default();
    for [x, z] in &posts {
        let half = 0.025;
        let min = [x - half, -SUNK, z - half];
        frame.append(block(min, [x + half, top, z + half], paints.desk.metal));
    }
    let thin = 0.02;
    frame.append(block(
        [x + 0.02, top - 0.06, z - thin],
        [end_x + SUNK, top - 0.01, z + thin],
        paints.desk.metal,
    ));
    frame.append(block(
        [x - thin, top - 0.055, z + 0.02],
        [x + thin, top - 0.005, end_z + SUNK],
        paints.desk.metal,
    ));
    frame.add_to(builder, "glass wall frame");
    let mut panes = Mesh::default();
    // Each ends within its posts; the last place along z is the door.
    for ends in [
        &posts[..2],
        &posts[1..3],
        &posts[2..4],
        &[posts[0], posts[4]],
        &posts[4..6],
        &posts[5..7],
    ] {
        let [[x0, z0], [x1, z1]] = [ends[0], ends[1]];
        let corners = [
            (x0, 0.04, z0),
            (x1, 0.04, z1),
            (x1, top - 0.03, z1),
            (x0, top - 0.03, z0),
        ];
        let corners = corners.map(|(x, y, z)| panes.vertex(DVec3::new(x, y, z)));
        panes.quad(corners, paints.glass);
    }
    panes.add_to(builder, "panes");
    let table = [13.55, 0.0, 8.5];
    placed(round_table(0.7, 0.74, paints.wood), table, 0.0).add_to(builder, "table");
    for number in 0..4 {
        let degrees: f64 = 90.0 * f64::from(number) + 20.0;
        let (sine, cosine) = degrees.to_radians().sin_cos();
        let at = [table[0] + 0.95 * sine, 0.0, table[2] + 0.95 * cosine];
        let chair = swivel_chair(paints.cloths[1], paints.desk.plastic, paints.desk.metal);
        placed(chair, at, degrees + 180.0).add_to(builder, "chair");
    }
    let board = [[end_x - 0.02, 0.95, 7.4], [end_x + SUNK, 2.0, 9.4]];
    block(board[0], board[1], paints.desk.paper).add_to(builder, "whiteboard");
}

/// Binders, plants and a long cabinet.
fn along_the_walls(builder: &mut SceneBuilder, paints: &Paints) {
    let binders = Books {
        thickness: [0.045, 0.08],
        height: [0.31, 0.32],
        depth: [0.27, 0.28],
    };
    for number in 0..3_u32 {
        let x = 2.7 + 2.3 * f64::from(number);
        let case = bookcase(
            [2.2, 1.7, 0.34],
            4,
            paints.wood,
            &binders,
            &paints.binders,
            u64::from(number),
        );
        placed(case, [x, 0.0, GROUND[1] - 0.02], 180.0).add_to(builder, "binders");
    }
    for (seed, [x, z]) in [[0.85, 8.6], [11.0, 9.0], [14.1, 0.9]]
        .into_iter()
        .enumerate()
    {
        placed(
            plant(seed as u64, 28, 1.0, paints.potted),
            [x, 0.0, z],
            50.0 * seed as f64,
        )
        .add_to(builder, "plant");
    }
}
