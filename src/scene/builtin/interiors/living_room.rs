//! A living room: a sofa and an armchair around a table, a dining table, shelves of books, curtains before a window.

use glam::{DVec2, DVec3, Vec2};

use super::super::courtyard::day;
use super::super::palette::{glass, glowing, in_colours, plain, textured};
use super::super::pictures;
use super::super::shapes::{
    Mesh, Numbers, Side, bar, geodesic_sphere, lathe, painted_cuboid, picture_frame, windowed_shell,
};
use super::SUNK;
use super::furniture::{block, bookcase, chair, round_table, sofa};
use super::parts::{Books, ShadedLamp, curtain, curve, moulding, placed, plant, ring, tube};
use crate::scene::{Environment, MaterialId, SceneBuilder};

/// Width, height and depth.
const ROOM: [f64; 3] = [6.4, 2.7, 5.2];
const WINDOW_X: [f64; 2] = [1.5, 4.1];
const WINDOW_Y: [f64; 2] = [0.75, 2.3];
const WALL: f64 = 0.3;

/// Low sun through the window.
pub(in super::super) fn late_afternoon() -> Environment {
    day([0.9, 1.05, 1.3], [205.0, 24.0], [9.0, 7.0, 4.6])
}

/// The materials.
struct Paints {
    plaster: MaterialId,
    paper: MaterialId,
    boards: MaterialId,
    facade: MaterialId,
    white: MaterialId,
    wood: MaterialId,
    dark_wood: MaterialId,
    sofa: MaterialId,
    armchair: MaterialId,
    cushions: [MaterialId; 2],
    curtain: MaterialId,
    rug: MaterialId,
    fringe: MaterialId,
    shade: MaterialId,
    brass: MaterialId,
    bulb: MaterialId,
    glass: MaterialId,
    clay: MaterialId,
    earth: MaterialId,
    leaf: MaterialId,
    glaze: MaterialId,
    covers: Vec<MaterialId>,
    canvases: [MaterialId; 2],
}

pub(in super::super) fn living_room() -> SceneBuilder {
    let mut builder = SceneBuilder::default();
    let paints = paints(&mut builder);
    shell(&mut builder, &paints);
    window(&mut builder, &paints);
    seats(&mut builder, &paints);
    dining(&mut builder, &paints);
    along_the_walls(&mut builder, &paints);
    builder
}

fn paints(builder: &mut SceneBuilder) -> Paints {
    let covers = [
        [0.42, 0.1, 0.08],
        [0.1, 0.18, 0.34],
        [0.12, 0.28, 0.16],
        [0.62, 0.55, 0.42],
        [0.34, 0.24, 0.16],
        [0.7, 0.68, 0.62],
        [0.5, 0.36, 0.1],
        [0.12, 0.12, 0.13],
    ];
    let glass = glass(builder, 0.12, 0.6);
    Paints {
        plaster: plain(builder, "plaster", [0.78, 0.76, 0.72]),
        paper: textured(builder, "wallpaper", pictures::wallpaper("wallpaper.png")),
        boards: textured(builder, "floorboards", pictures::planks("floorboards.png")),
        facade: plain(builder, "facade", [0.6, 0.56, 0.5]),
        white: plain(builder, "white paint", [0.8, 0.8, 0.78]),
        wood: plain(builder, "oak", [0.46, 0.3, 0.17]),
        dark_wood: plain(builder, "walnut", [0.22, 0.13, 0.1]),
        sofa: plain(builder, "sofa cloth", [0.34, 0.38, 0.42]),
        armchair: plain(builder, "leather", [0.42, 0.2, 0.11]),
        cushions: [
            plain(builder, "mustard cloth", [0.66, 0.44, 0.12]),
            plain(builder, "teal cloth", [0.12, 0.36, 0.38]),
        ],
        curtain: plain(builder, "curtain", [0.68, 0.62, 0.52]),
        rug: textured(builder, "rug", pictures::rug("rug.png")),
        fringe: plain(builder, "fringe", [0.7, 0.62, 0.45]),
        shade: plain(builder, "lamp shade", [0.76, 0.7, 0.58]),
        brass: plain(builder, "brass", [0.58, 0.44, 0.2]),
        bulb: glowing(builder, "bulb", [260.0, 190.0, 110.0]),
        glass,
        clay: plain(builder, "clay", [0.55, 0.28, 0.18]),
        earth: plain(builder, "earth", [0.12, 0.1, 0.1]),
        leaf: plain(builder, "leaf", [0.13, 0.34, 0.1]),
        glaze: plain(builder, "glaze", [0.2, 0.42, 0.55]),
        covers: in_colours(builder, "cover", &covers),
        canvases: [
            textured(builder, "landscape", pictures::landscape("landscape.png")),
            textured(builder, "rings", pictures::rings("rings.png")),
        ],
    }
}

/// Walls with a window, and mouldings along floor and ceiling.
fn shell(builder: &mut SceneBuilder, paints: &Paints) {
    let [width, height, depth] = ROOM;
    windowed_shell(
        [0.0, WINDOW_X[0], WINDOW_X[1], width],
        [0.0, WINDOW_Y[0], WINDOW_Y[1], height],
        &[0.0, depth],
        WALL,
        |side| match side {
            Side::Bottom => paints.boards,
            Side::Left => paints.paper,
            _ => paints.plaster,
        },
        [paints.facade, paints.white],
    )
    .textured(paints.boards, |p| Vec2::new(p.x as f32, p.z as f32) / 1.6)
    .textured(paints.paper, |p| Vec2::new(p.z as f32, p.y as f32) / 0.9)
    .add_to(builder, "room");
    let ground = [width, depth];
    moulding(ground, 0.0, 0.015, 0.09, paints.white).add_to(builder, "skirting");
    moulding(ground, height, 0.07, -0.06, paints.plaster).add_to(builder, "cornice");
}

/// Casements with panes, a sill, and curtains on a rod.
fn window(builder: &mut SceneBuilder, paints: &Paints) {
    let depth = ROOM[2] + 0.15;
    let middle = 0.5 * (WINDOW_X[0] + WINDOW_X[1]);
    let mut panes = Mesh::default();
    for [left, right] in [[WINDOW_X[0], middle], [middle, WINDOW_X[1]]] {
        let half = DVec2::new(right - left, WINDOW_Y[1] - WINDOW_Y[0]) * 0.5 + DVec2::splat(SUNK);
        let centre = DVec3::new(
            0.5 * (left + right),
            0.5 * (WINDOW_Y[0] + WINDOW_Y[1]),
            depth,
        );
        picture_frame(half, 0.06, 0.05, paints.white)
            .moved(|p| DVec3::new(-p.x, p.y, -p.z) + centre)
            .add_to(builder, "casement");
        let (low, high) = (centre - half.extend(0.0), centre + half.extend(0.0));
        let inset = 0.04;
        let corners = [
            (low.x + inset, low.y + inset),
            (high.x - inset, low.y + inset),
            (high.x - inset, high.y - inset),
            (low.x + inset, high.y - inset),
        ];
        let corners = corners.map(|(x, y)| panes.vertex(DVec3::new(x, y, depth - 0.02)));
        panes.quad(corners, paints.glass);
    }
    panes.add_to(builder, "panes");
    block(
        [WINDOW_X[0] - 0.08, WINDOW_Y[0] - 0.04, ROOM[2] - 0.14],
        [WINDOW_X[1] + 0.08, WINDOW_Y[0] - 0.005, ROOM[2] + SUNK],
        paints.white,
    )
    .add_to(builder, "sill");
    let (left, right) = (WINDOW_X[0] - 0.75, WINDOW_X[1] + 0.75);
    let [from, to] = [left - 0.05, right + 0.05].map(|x| DVec3::new(x, 2.46, ROOM[2] - 0.24));
    bar(from, to, 0.014, 24, paints.brass).add_to(builder, "curtain rod");
    let mut rings = Mesh::default();
    for (start, width) in [(left, 0.85), (right - 0.85, 0.85)] {
        let hang = DVec3::new(start, 2.42, from.z);
        curtain(width, 2.39, 9, [126, 28], paints.curtain)
            .moved(|p| p + hang)
            .add_to(builder, "curtain");
        for number in 0..10 {
            let x = start + width * f64::from(number) / 9.0;
            let centre = DVec3::new(x, 2.445, from.z);
            rings.append(ring(centre, 0.03, 24, 0.003, 8, paints.brass));
        }
    }
    rings.add_to(builder, "curtain rings");
}

/// Sofa, armchair and a low table on a rug, with what lies on it.
fn seats(builder: &mut SceneBuilder, paints: &Paints) {
    placed(
        sofa(3, paints.sofa, paints.dark_wood, paints.cushions),
        [0.62, 0.0, 2.6],
        90.0,
    )
    .add_to(builder, "sofa");
    let armchair = sofa(1, paints.armchair, paints.dark_wood, paints.cushions);
    placed(armchair, [3.0, 0.0, 4.1], -160.0).add_to(builder, "armchair");
    rug(builder, paints);
    let table = [1.95, RUG_HEIGHT, 2.7];
    placed(round_table(0.42, 0.42, paints.dark_wood), table, 20.0).add_to(builder, "low table");
    let top = RUG_HEIGHT + 0.42;
    let bowl = [
        (0.05, -SUNK),
        (0.06, 0.005),
        (0.11, 0.03),
        (0.15, 0.07),
        (0.145, 0.072),
        (0.1, 0.04),
        (0.02, 0.02),
    ];
    let bowl = lathe(&bowl.map(DVec2::from), 48, paints.glaze, |_, _| 1.0);
    placed(bowl, [2.05, top, 2.62], 0.0).add_to(builder, "bowl");
    let mut numbers = Numbers(3);
    let mut height = top - SUNK;
    for cover in &paints.covers[..3] {
        let volume = block([-0.12, 0.0, -0.085], [0.12, 0.032, 0.085], *cover);
        placed(volume, [1.78, height, 2.83], numbers.between(10.0, 60.0)).add_to(builder, "book");
        height += 0.03;
    }
}

const RUG_HEIGHT: f64 = 0.014;

/// A rug with a fringe at both ends.
fn rug(builder: &mut SceneBuilder, paints: &Paints) {
    let (low, high) = (
        DVec3::new(1.25, -SUNK, 1.3),
        DVec3::new(3.25, RUG_HEIGHT, 4.1),
    );
    painted_cuboid(low, high, |side| match side {
        Side::Top => paints.rug,
        _ => paints.fringe,
    })
    .textured(paints.rug, |p| {
        Vec2::new((p.x - low.x) as f32 / 2.0, (p.z - low.z) as f32 / 2.8)
    })
    .add_to(builder, "rug");
    let mut fringe = Mesh::default();
    let mut numbers = Numbers(11);
    for (z, outward) in [(low.z, -1.0), (high.z, 1.0)] {
        for number in 0..99 {
            let x = low.x + 0.02 * f64::from(number + 1);
            let aside = numbers.between(-0.012, 0.012);
            let strand = curve(5, |t| {
                DVec3::new(
                    x + aside * t * t,
                    0.008 - 0.003 * t,
                    z + outward * (0.08 * t - SUNK),
                )
            });
            fringe.append(tube(&strand, false, 0.0035, 6, paints.fringe));
        }
    }
    fringe.add_to(builder, "fringe");
}

/// A round table with four chairs under a hanging lamp.
fn dining(builder: &mut SceneBuilder, paints: &Paints) {
    let at = [4.7, 0.0, 1.45];
    placed(round_table(0.62, 0.75, paints.wood), at, 0.0).add_to(builder, "table");
    for (number, degrees) in [175.0, 268.0, 2.0, 95.0].into_iter().enumerate() {
        let angle: f64 = 90.0 * number as f64;
        let (sine, cosine) = angle.to_radians().sin_cos();
        let place = [at[0] + 0.72 * sine, 0.0, at[2] + 0.72 * cosine];
        placed(
            chair(paints.wood, paints.cushions[number % 2]),
            place,
            degrees,
        )
        .add_to(builder, "chair");
    }
    let lamp = ShadedLamp {
        height: 0.3,
        foot: 0.05,
        shade: [0.08, 0.26, 0.26],
        bulb: 0.04,
    };
    // It hangs upside down.
    let top = DVec3::new(at[0], 1.95, at[2]);
    lamp.mesh([paints.brass, paints.shade, paints.bulb])
        .moved(|p| DVec3::new(p.x, -p.y, -p.z) + top)
        .add_to(builder, "hanging lamp");
    bar(
        top - DVec3::Y * 0.01,
        DVec3::new(top.x, ROOM[1] + SUNK, top.z),
        0.004,
        16,
        paints.brass,
    )
    .add_to(builder, "cable");
    let vase: Vec<DVec2> = (0..=24)
        .map(|ring| {
            let height = f64::from(ring) / 24.0;
            let radius = 0.05 + 0.035 * (5.2 * height + 0.4).sin();
            DVec2::new(radius, 0.28 * height - SUNK)
        })
        .collect();
    let vase = lathe(&vase, 40, paints.glaze, |_, _| 1.0);
    placed(vase, [at[0] + 0.08, 0.75, at[2] - 0.05], 0.0).add_to(builder, "vase");
    let plate = [
        (0.06, -SUNK),
        (0.07, 0.004),
        (0.115, 0.018),
        (0.11, 0.02),
        (0.065, 0.008),
    ];
    for number in 0..4 {
        let angle = 90.0_f64 * f64::from(number);
        let (sine, cosine) = angle.to_radians().sin_cos();
        let plate = lathe(&plate.map(DVec2::from), 40, paints.white, |_, _| 1.0);
        let place = [at[0] + 0.42 * sine, 0.75, at[2] + 0.42 * cosine];
        placed(plate, place, 0.0).add_to(builder, "plate");
    }
}

/// Shelves, lamps, plants, a sideboard and pictures.
fn along_the_walls(builder: &mut SceneBuilder, paints: &Paints) {
    let books = Books {
        thickness: [0.014, 0.045],
        height: [0.19, 0.29],
        depth: [0.13, 0.2],
    };
    let case = bookcase(
        [2.2, 2.05, 0.3],
        6,
        paints.dark_wood,
        &books,
        &paints.covers,
        7,
    );
    placed(case, [ROOM[0] - 0.03, 0.0, 3.6], -90.0).add_to(builder, "bookcase");
    let lamp = |height, foot, shade, bulb| ShadedLamp {
        height,
        foot,
        shade,
        bulb,
    };
    let paints_of_lamp = [paints.brass, paints.shade, paints.bulb];
    let floor_lamp = lamp(1.65, 0.15, [0.24, 0.15, 0.3], 0.045).mesh(paints_of_lamp);
    placed(floor_lamp, [0.5, 0.0, 4.35], 0.0).add_to(builder, "floor lamp");
    let potted = [paints.clay, paints.earth, paints.leaf];
    placed(plant(5, 44, 1.1, potted), [5.1, 0.0, 4.2], 40.0).add_to(builder, "palm");
    placed(plant(9, 40, 0.75, potted), [1.2, 0.0, 0.8], 10.0).add_to(builder, "plant");

    let front = 0.47;
    block([0.03, 0.1, 0.15], [front, 0.78, 1.15], paints.wood).add_to(builder, "sideboard");
    for z in [0.17, 0.655] {
        block(
            [front - SUNK, 0.13, z],
            [front + 0.015, 0.75, z + 0.475],
            paints.dark_wood,
        )
        .add_to(builder, "sideboard door");
    }
    for (x, z) in [(0.08, 0.2), (0.4, 0.2), (0.4, 1.1), (0.08, 1.1)] {
        let [foot, top] = [-SUNK, 0.1 + SUNK].map(|y| DVec3::new(x, y, z));
        bar(foot, top, 0.018, 20, paints.brass).add_to(builder, "sideboard leg");
    }
    let table_lamp = lamp(0.5, 0.09, [0.17, 0.1, 0.2], 0.035).mesh(paints_of_lamp);
    placed(table_lamp, [0.25, 0.78, 0.4], 0.0).add_to(builder, "table lamp");
    geodesic_sphere(10, paints.glaze)
        .moved(|p| p * DVec3::new(0.09, 0.12, 0.09) + DVec3::new(0.24, 0.897, 0.88))
        .add_to(builder, "jar");
    for (z, half, canvas) in [
        (2.0, DVec2::new(0.45, 0.33), paints.canvases[0]),
        (3.2, DVec2::new(0.36, 0.36), paints.canvases[1]),
    ] {
        picture(builder, paints, z, half, canvas);
    }
}

/// A framed picture on the wall behind the sofa; `half` is half its size along z and y.
fn picture(builder: &mut SceneBuilder, paints: &Paints, z: f64, half: DVec2, canvas: MaterialId) {
    let (low, high) = (
        DVec3::new(-SUNK, 1.65 - half.y, z - half.x),
        DVec3::new(0.018, 1.65 + half.y, z + half.x),
    );
    painted_cuboid(low, high, |side| match side {
        Side::Right => canvas,
        _ => paints.dark_wood,
    })
    .textured(canvas, |p| {
        let across = 1.0 - (p.z - low.z) / (2.0 * half.x);
        Vec2::new(across as f32, ((p.y - low.y) / (2.0 * half.y)) as f32)
    })
    .add_to(builder, "picture");
    let frame = picture_frame(half + DVec2::splat(0.04), 0.05, 0.035, paints.dark_wood);
    placed(frame, [-2.0 * SUNK, 1.65, z], 90.0).add_to(builder, "frame");
}
