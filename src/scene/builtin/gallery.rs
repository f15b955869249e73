//! A gallery: a hall nine metres wide with windows behind a colonnade on one side, pictures under warm spots on the
//! other, a staircase at its end, and a figure, a bench and a table between them. Lengths in metres.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DMat2, DQuat, DVec2, DVec3, Vec2, Vec3};

use super::palette::{glowing, plain, textured};
use super::pictures;
use super::shapes::{
    Facing, Mesh, Side, bar, cuboid, geodesic_sphere, lathe, lattice_box, lines_through,
    painted_cuboid, picture_frame, prism,
};
use crate::scene::{MaterialId, SceneBuilder};

/// Width, height and length of the hall.
const HALL: DVec3 = DVec3::new(9.0, 5.0, 15.0);
/// How deep things sink into what carries them.
const SUNK: f64 = 0.005;
const WINDOWS_Z: [[f64; 2]; 3] = [[2.2, 4.6], [6.3, 8.7], [10.4, 12.8]];
const WINDOW_Y: [f64; 2] = [1.0, 4.0];
/// Depth of the window recess.
const REVEAL: f64 = 0.35;
const COLUMNS_Z: [f64; 4] = [1.3, 5.45, 9.55, 13.65];
const COLUMN_X: f64 = 2.3;
const ARCHITRAVE_Y: f64 = 4.35;

/// The materials.
struct Paints {
    plaster: MaterialId,
    accent: MaterialId,
    stone: MaterialId,
    marble: MaterialId,
    wood: MaterialId,
    bronze: MaterialId,
    glaze: MaterialId,
    gilt: MaterialId,
    daylight: MaterialId,
    spot: MaterialId,
    globe: MaterialId,
    floor: MaterialId,
    rug: MaterialId,
    canvases: [MaterialId; 4],
}

pub(super) fn gallery() -> SceneBuilder {
    let mut builder = SceneBuilder::default();
    let paints = paints(&mut builder);
    hall(&paints).add_to(&mut builder, "hall");
    window_bars(&mut builder, &paints);
    colonnade(&mut builder, &paints);
    pictures_and_spots(&mut builder, &paints);
    staircase(&mut builder, &paints);
    figure(&mut builder, &paints);
    furniture(&mut builder, &paints);
    builder
}

fn paints(builder: &mut SceneBuilder) -> Paints {
    let slabs = pictures::stone_tiles(
        "slabs.png",
        Vec3::new(0.8, 0.76, 0.7),
        Vec3::new(0.47, 0.43, 0.4),
    );
    Paints {
        plaster: plain(builder, "plaster", [0.78, 0.75, 0.69]),
        accent: plain(builder, "accent wall", [0.5, 0.17, 0.13]),
        stone: plain(builder, "stone", [0.66, 0.62, 0.55]),
        marble: plain(builder, "marble", [0.8, 0.79, 0.77]),
        wood: plain(builder, "wood", [0.36, 0.2, 0.1]),
        bronze: plain(builder, "bronze", [0.16, 0.13, 0.1]),
        glaze: plain(builder, "glaze", [0.1, 0.28, 0.42]),
        gilt: plain(builder, "gilt", [0.62, 0.43, 0.14]),
        daylight: glowing(builder, "daylight", [5.6, 6.6, 7.8]),
        spot: glowing(builder, "spot", [340.0, 225.0, 120.0]),
        globe: glowing(builder, "globe", [14.0, 9.2, 4.6]),
        floor: textured(builder, "slabs", slabs),
        rug: textured(builder, "rug", pictures::rug("rug.png")),
        canvases: [
            textured(builder, "landscape", pictures::landscape("landscape.png")),
            textured(
                builder,
                "rectangles",
                pictures::rectangles("rectangles.png"),
            ),
            textured(builder, "rings", pictures::rings("rings.png")),
            textured(builder, "dusk", pictures::landscape("dusk.png")),
        ],
    }
}

/// Walls, floor, ceiling and window recesses as one closed shell.
fn hall(paints: &Paints) -> Mesh {
    let mut z_breaks = vec![0.0];
    z_breaks.extend(WINDOWS_Z.iter().flatten());
    z_breaks.push(HALL.z);
    let xs = lines_through(&[0.0, HALL.x], 1.0);
    let ys = lines_through(&[0.0, WINDOW_Y[0], WINDOW_Y[1], HALL.y], 1.0);
    let zs = lines_through(&z_breaks, 1.2);
    let between = |x: f64, [low, high]: [f64; 2]| x > low && x < high;
    let mut mesh = lattice_box([&xs, &ys, &zs], Facing::Inward, |side, centre| match side {
        Side::Left
            if between(centre.y, WINDOW_Y) && WINDOWS_Z.iter().any(|&z| between(centre.z, z)) =>
        {
            None
        }
        Side::Bottom => Some(paints.floor),
        Side::Right => Some(paints.accent),
        _ => Some(paints.plaster),
    });
    for window in WINDOWS_Z {
        let within = |lines: &[f64], [low, high]: [f64; 2]| -> Vec<f64> {
            let inside = |line: &f64| (low..=high).contains(line);
            lines.iter().copied().filter(inside).collect()
        };
        let (ys, zs) = (within(&ys, WINDOW_Y), within(&zs, window));
        let recess = [&[-REVEAL, 0.0][..], &ys, &zs];
        mesh.append(lattice_box(recess, Facing::Inward, |side, _| match side {
            Side::Right => None,
            Side::Left => Some(paints.daylight),
            _ => Some(paints.stone),
        }));
    }
    mesh.welded()
        .textured(paints.floor, |p| Vec2::new(p.x as f32, p.z as f32) / 3.0)
}

/// A cross of bars in every window.
fn window_bars(builder: &mut SceneBuilder, paints: &Paints) {
    let (back, front) = (-0.22, -0.16);
    for [near, far] in WINDOWS_Z {
        for third in [1.0, 2.0] {
            let z = near + (far - near) * third / 3.0;
            let low = DVec3::new(back, WINDOW_Y[0] - SUNK, z - 0.03);
            let high = DVec3::new(front, WINDOW_Y[1] + SUNK, z + 0.03);
            cuboid(low, high, paints.wood).add_to(builder, "mullion");
        }
        let low = DVec3::new(back + 0.01, 2.97, near - SUNK);
        let high = DVec3::new(front - 0.01, 3.03, far + SUNK);
        cuboid(low, high, paints.wood).add_to(builder, "transom");
    }
}

/// Fluted columns on plinths, the architrave on them and beams across the hall.
fn colonnade(builder: &mut SceneBuilder, paints: &Paints) {
    for z in COLUMNS_Z {
        let at = DVec3::new(COLUMN_X, 0.0, z);
        let block = |half: f64, low: f64, high: f64| {
            let half = DVec3::new(half, 0.0, half);
            cuboid(
                at - half + DVec3::Y * low,
                at + half + DVec3::Y * high,
                paints.stone,
            )
        };
        block(0.36, -SUNK, 0.14).add_to(builder, "plinth");
        column(paints.stone)
            .moved(|p| p + at)
            .add_to(builder, "column");
        block(0.34, 4.2, ARCHITRAVE_Y + SUNK).add_to(builder, "abacus");
        let low = DVec3::new(COLUMN_X + 0.29, 4.62, z - 0.16);
        let high = DVec3::new(HALL.x + SUNK, HALL.y + SUNK, z + 0.16);
        cuboid(low, high, paints.wood).add_to(builder, "beam");
    }
    let low = DVec3::new(COLUMN_X - 0.3, ARCHITRAVE_Y, -SUNK);
    let high = DVec3::new(COLUMN_X + 0.3, HALL.y + SUNK, HALL.z + SUNK);
    cuboid(low, high, paints.plaster).add_to(builder, "architrave");
}

/// A column with a moulded base, twenty flutes, entasis and a capital, from plinth to abacus.
fn column(material: MaterialId) -> Mesh {
    let mut profile = vec![
        (0.33, 0.135),
        (0.35, 0.18),
        (0.33, 0.23),
        (0.29, 0.25),
        (0.31, 0.3),
    ];
    let shaft_start = profile.len();
    for step in 0..=10 {
        let height = f64::from(step) / 10.0;
        // Entasis: the shaft tapers by a sixth, slowly at first.
        profile.push((0.27 * (1.0 - 0.17 * height.powf(1.7)), 0.33 + 3.56 * height));
    }
    let shaft_end = profile.len();
    profile.extend([(0.25, 3.93), (0.25, 3.98), (0.31, 4.1), (0.33, 4.205)]);
    let profile: Vec<DVec2> = profile.into_iter().map(DVec2::from).collect();
    lathe(&profile, 40, material, |ring, segment| {
        let is_fluted = ring > shaft_start && ring + 1 < shaft_end;
        if is_fluted && segment % 2 == 1 {
            0.92
        } else {
            1.0
        }
    })
}

/// Framed canvases on the right wall, each with a spot on a rail under the ceiling.
fn pictures_and_spots(builder: &mut SceneBuilder, paints: &Paints) {
    let rail_x = HALL.x - 1.7;
    let sizes = [(1.7, 1.25), (1.3, 1.3), (1.7, 1.25), (1.5, 1.15)];
    for (index, (width, height)) in sizes.into_iter().enumerate() {
        let centre = DVec3::new(HALL.x, 1.85, 3.35 + 2.55 * index as f64);
        hang_picture(
            builder,
            paints,
            centre,
            DVec2::new(width, height) * 0.5,
            paints.canvases[index],
        );
        let head = DVec3::new(rail_x, 4.1, centre.z);
        spot_head(paints, centre - head)
            .moved(|p| p + head)
            .add_to(builder, "spot");
        let top = DVec3::new(rail_x, 4.47, centre.z);
        bar(head + DVec3::Y * 0.05, top, 0.012, 8, paints.bronze).add_to(builder, "rod");
    }
    let low = DVec3::new(rail_x - 0.03, 4.46, 0.8);
    let high = DVec3::new(rail_x + 0.03, 4.5, 12.4);
    cuboid(low, high, paints.bronze).add_to(builder, "rail");
    for z in [COLUMNS_Z[0], COLUMNS_Z[1], COLUMNS_Z[2]] {
        let foot = DVec3::new(rail_x, 4.49, z);
        bar(foot, foot + DVec3::Y * 0.14, 0.015, 8, paints.bronze).add_to(builder, "hanger");
    }
}

/// A canvas and its frame on the right wall; `half` is half the size of the canvas along z and y.
fn hang_picture(
    builder: &mut SceneBuilder,
    paints: &Paints,
    centre: DVec3,
    half: DVec2,
    canvas: MaterialId,
) {
    let low = DVec3::new(HALL.x - 0.025, centre.y - half.y, centre.z - half.x);
    let high = DVec3::new(HALL.x + SUNK, centre.y + half.y, centre.z + half.x);
    painted_cuboid(low, high, |side| {
        if side == Side::Left {
            canvas
        } else {
            paints.wood
        }
    })
    .textured(canvas, |p| {
        let across = (p.z - low.z) / (high.z - low.z);
        let up = (p.y - low.y) / (high.y - low.y);
        Vec2::new(across as f32, up as f32)
    })
    .add_to(builder, "canvas");
    let turn = DQuat::from_rotation_y(-FRAC_PI_2);
    let back = centre + DVec3::X * SUNK;
    picture_frame(half + DVec2::splat(0.09), 0.1, 0.07, paints.gilt)
        .moved(|p| back + turn * p)
        .add_to(builder, "frame");
}

/// A small box at the origin that shines from one side in a direction.
fn spot_head(paints: &Paints, direction: DVec3) -> Mesh {
    let turn = DQuat::from_rotation_arc(DVec3::Z, direction.normalize_or(DVec3::Z));
    let half = DVec3::new(0.07, 0.07, 0.11);
    painted_cuboid(-half, half, |side| {
        if side == Side::Far {
            paints.spot
        } else {
            paints.bronze
        }
    })
    .moved(|p| turn * p)
}

/// Eight steps up to a landing along the far wall, with a railing.
fn staircase(builder: &mut SceneBuilder, paints: &Paints) {
    const STEPS: u32 = 8;
    const RISE: f64 = 0.17;
    const TREAD: f64 = 0.31;
    let front = 12.6;
    let foot = 3.3;
    let step_x = |step: f64| foot + TREAD * step;
    let mut profile = vec![DVec2::new(HALL.x + SUNK, -SUNK)];
    let landing = RISE * f64::from(STEPS);
    profile.push(DVec2::new(HALL.x + SUNK, landing));
    for step in (0..STEPS).rev() {
        let x = step_x(f64::from(step));
        profile.push(DVec2::new(x, RISE * f64::from(step + 1)));
        let below = if step == 0 {
            -SUNK
        } else {
            RISE * f64::from(step)
        };
        profile.push(DVec2::new(x, below));
    }
    prism(&profile, front, HALL.z + SUNK, paints.stone).add_to(builder, "staircase");

    let rail_height = 0.95;
    let post = |x: f64, y: f64| {
        let foot = DVec3::new(x, y - SUNK, front + 0.08);
        bar(foot, foot + DVec3::Y * rail_height, 0.018, 8, paints.bronze)
    };
    for step in 0..STEPS {
        let x = step_x(f64::from(step) + 0.5);
        post(x, RISE * f64::from(step + 1)).add_to(builder, "baluster");
    }
    for number in 1..=10 {
        let x = step_x(f64::from(STEPS) - 0.5) + 0.31 * f64::from(number);
        post(x, landing).add_to(builder, "baluster");
    }
    let at = |x: f64, y: f64| DVec3::new(x, y + rail_height, front + 0.08);
    let (low, turn) = (
        at(step_x(0.2), RISE * 0.7),
        at(step_x(f64::from(STEPS) - 0.5), landing),
    );
    bar(low, turn, 0.035, 12, paints.wood).add_to(builder, "handrail");
    bar(turn, at(HALL.x + SUNK, landing), 0.035, 12, paints.wood).add_to(builder, "handrail");
}

/// A marble figure on a pedestal.
fn figure(builder: &mut SceneBuilder, paints: &Paints) {
    let at = DVec3::new(4.7, 0.0, 8.6);
    let block = |half: f64, low: f64, high: f64, material| {
        let half = DVec3::new(half, 0.0, half);
        cuboid(
            at - half + DVec3::Y * low,
            at + half + DVec3::Y * high,
            material,
        )
    };
    block(0.5, -SUNK, 0.12, paints.stone).add_to(builder, "pedestal foot");
    block(0.4, 0.12 - SUNK, 0.85, paints.stone).add_to(builder, "pedestal");
    block(0.46, 0.85 - SUNK, 0.93, paints.stone).add_to(builder, "pedestal top");
    geodesic_sphere(20, paints.marble)
        .moved(|p| {
            let waves = 0.2 * (2.4 * p.y + 0.8 * p.x + 2.0).sin()
                + 0.16 * (3.7 * p.y + 2.2 * p.z).sin() * (1.9 * p.x + 0.5).cos();
            let swollen = p * (1.0 + waves);
            let turned = DMat2::from_angle(2.0 * swollen.y) * DVec2::new(swollen.x, swollen.z);
            DVec3::new(
                0.42 * turned.x + 0.12 * (2.2 * swollen.y).sin(),
                0.82 * swollen.y,
                0.26 * turned.y,
            )
        })
        .standing_at(0.93 - SUNK)
        .moved(|p| at + p)
        .add_to(builder, "figure");
}

/// A bench on a rug before the pictures; a table with a lamp, a vase and books by the windows.
fn furniture(builder: &mut SceneBuilder, paints: &Paints) {
    let (low, high) = (DVec3::new(5.7, -SUNK, 4.5), DVec3::new(7.7, 0.012, 7.5));
    painted_cuboid(low, high, |side| {
        if side == Side::Top {
            paints.rug
        } else {
            paints.wood
        }
    })
    .textured(paints.rug, |p| {
        Vec2::new((p.x - low.x) as f32 / 2.0, (p.z - low.z) as f32 / 3.0)
    })
    .add_to(builder, "rug");
    bench(paints.wood)
        .moved(|p| p + DVec3::new(6.7, 0.012 - SUNK, 6.0))
        .add_to(builder, "bench");

    let table = DVec3::new(3.9, 0.0, 4.3);
    let top = 0.76;
    table_meshes(paints.wood)
        .into_iter()
        .for_each(|(name, mesh)| {
            mesh.moved(|p| p + table).add_to(builder, name);
        });
    let stem = [
        (0.13, 0.0),
        (0.13, 0.02),
        (0.03, 0.05),
        (0.022, 0.12),
        (0.022, 0.36),
    ];
    let lamp = table + DVec3::new(-0.3, top - SUNK, 0.15);
    lathe(&stem.map(DVec2::from), 20, paints.gilt, |_, _| 1.0)
        .moved(|p| p + lamp)
        .add_to(builder, "lamp stem");
    geodesic_sphere(4, paints.globe)
        .moved(|p| p * 0.15 + lamp + DVec3::Y * 0.5)
        .add_to(builder, "globe");
    let vase = table + DVec3::new(0.12, top - SUNK, -0.05);
    vase_mesh(paints.glaze)
        .moved(|p| p + vase)
        .add_to(builder, "vase");
    for (level, (turn, material)) in [
        (0.2, paints.accent),
        (0.35, paints.glaze),
        (-0.1, paints.gilt),
    ]
    .into_iter()
    .enumerate()
    {
        let turn = DQuat::from_rotation_y(turn);
        let low = top - SUNK + 0.04 * level as f64;
        let high = DVec3::new(0.12, low + 0.04 + SUNK * 0.5, 0.085);
        cuboid(DVec3::new(-0.12, low, -0.085), high, material)
            .moved(|p| turn * p + table + DVec3::new(0.47, 0.0, 0.12))
            .add_to(builder, "book");
    }
}

/// A bench along z, its seat and both ends in one piece.
fn bench(material: MaterialId) -> Mesh {
    let profile = [
        (-0.9, 0.0),
        (-0.8, 0.0),
        (-0.76, 0.37),
        (0.76, 0.37),
        (0.8, 0.0),
        (0.9, 0.0),
        (0.9, 0.45),
        (-0.9, 0.45),
    ];
    let turn = DQuat::from_rotation_y(FRAC_PI_2);
    prism(&profile.map(DVec2::from), -0.23, 0.23, material).moved(|p| turn * p)
}

/// A table top with four turned legs.
fn table_meshes(material: MaterialId) -> Vec<(&'static str, Mesh)> {
    let top = cuboid(
        DVec3::new(-0.75, 0.71, -0.42),
        DVec3::new(0.75, 0.76, 0.42),
        material,
    );
    let leg = [
        (0.025, -SUNK),
        (0.03, 0.2),
        (0.02, 0.24),
        (0.04, 0.5),
        (0.045, 0.715),
    ];
    let mut meshes = vec![("table top", top)];
    for (x, z) in [(-0.66, -0.34), (0.66, -0.34), (0.66, 0.34), (-0.66, 0.34)] {
        let mesh = lathe(&leg.map(DVec2::from), 16, material, |_, _| 1.0)
            .moved(|p| p + DVec3::new(x, 0.0, z));
        meshes.push(("table leg", mesh));
    }
    meshes
}

/// A vase with a swelling body and a lip.
fn vase_mesh(material: MaterialId) -> Mesh {
    let profile: Vec<DVec2> = (0..=16)
        .map(|ring| {
            let height = f64::from(ring) / 16.0;
            let radius = 0.075 + 0.055 * (TAU * (0.82 * height - 0.1)).sin();
            DVec2::new(radius, 0.42 * height)
        })
        .collect();
    lathe(&profile, 32, material, |_, _| 1.0)
}
