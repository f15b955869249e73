//! The family of coloured rooms: a dense organic figure on a pedestal, a second body on the floor, one small light in
//! the ceiling. The sizes 1,022, 8,621 and 42,879 are those of Sun, Gong and Pan; 1,000,000 is the same room, finer.

use glam::{DMat2, DVec2, DVec3};

use super::palette::{glowing, plain};
use super::shapes::{Facing, Mesh, Side, geodesic_sphere, lattice_box, lines_through};
use super::{Viewpoint, view};
use crate::scene::{MaterialId, SceneBuilder};

pub(super) const VIEWPOINT: Viewpoint = view([3.75, 1.75, 0.3], [1.75, 1.05, 2.7]);

/// How a room spends its triangles. The rest goes to the walls.
struct Plan {
    triangle_count: usize,
    /// Rows of the figure: `20 · rows²` triangles.
    figure: u32,
    /// Rows of the body on the floor.
    gourd: u32,
    /// Rows of the cloth: `rows²` triangles. It alone is no closed shell, so an odd room needs it odd.
    cloth: u32,
}

pub(super) fn room_1022() -> SceneBuilder {
    room(&Plan {
        triangle_count: 1_022,
        figure: 5,
        gourd: 3,
        cloth: 4,
    })
}

pub(super) fn room_8621() -> SceneBuilder {
    room(&Plan {
        triangle_count: 8_621,
        figure: 17,
        gourd: 8,
        cloth: 9,
    })
}

pub(super) fn room_42879() -> SceneBuilder {
    room(&Plan {
        triangle_count: 42_879,
        figure: 40,
        gourd: 20,
        cloth: 17,
    })
}

pub(super) fn room_1m() -> SceneBuilder {
    room(&Plan {
        triangle_count: 1_000_000,
        figure: 200,
        gourd: 90,
        cloth: 70,
    })
}

/// The fewest triangles of a room: below, walls have no room for light and pedestal.
const FEWEST: usize = 1_000;

/// The room in this many triangles (at least 1,000), its bodies as dense against the walls as in the sizes above.
pub fn room_of(triangle_count: usize) -> SceneBuilder {
    let triangle_count = triangle_count.max(FEWEST);
    let edge = (triangle_count as f64).sqrt();
    let cloth = (0.075 * edge).round() as u32;
    let mut builder = room(&Plan {
        triangle_count,
        figure: (0.2 * edge - 1.2).round() as u32,
        gourd: (0.092 * edge).round() as u32,
        cloth: cloth + (cloth + triangle_count as u32) % 2,
    });
    builder.source.name = format!("room-{triangle_count}");
    builder
}

/// Where the lines of the walls must run: walls, pedestal and light in x and z; floor, pedestal top and ceiling in y.
const X_BREAKS: [f64; 5] = [0.0, 1.1, 1.8, 2.4, 4.0];
const Y_BREAKS: [f64; 3] = [0.0, 0.7, 2.8];
const Z_BREAKS: [f64; 5] = [0.0, 1.3, 1.9, 2.6, 4.5];
const LIGHT_X: [f64; 2] = [1.8, 2.4];
const LIGHT_Z: [f64; 2] = [1.3, 1.9];
const PEDESTAL_X: [f64; 2] = [1.1, 1.8];
const PEDESTAL_Z: [f64; 2] = [1.9, 2.6];
const PEDESTAL_HEIGHT: f64 = 0.7;
/// How deep bodies sink into what carries them, in metres.
const SUNK: f64 = 0.006;

fn room(plan: &Plan) -> SceneBuilder {
    let mut builder = SceneBuilder::default();
    let mut paint = |name: &str, reflectance| plain(&mut builder, name, reflectance);
    let paints = Paints {
        floor: paint("floor", [0.5, 0.44, 0.38]),
        ceiling: paint("ceiling", [0.8, 0.8, 0.8]),
        left: paint("left wall", [0.64, 0.16, 0.12]),
        right: paint("right wall", [0.14, 0.3, 0.6]),
        near: paint("near wall", [0.3, 0.5, 0.28]),
        far: paint("far wall", [0.75, 0.66, 0.42]),
        pedestal: paint("pedestal", [0.55, 0.55, 0.57]),
        light: glowing(&mut builder, "light", [90.0, 84.0, 74.0]),
    };
    let mut paint = |name: &str, reflectance| plain(&mut builder, name, reflectance);
    let bodies = [
        (
            "figure",
            figure(plan.figure, paint("figure", [0.74, 0.7, 0.64])),
        ),
        (
            "gourd",
            gourd(plan.gourd, paint("gourd", [0.7, 0.42, 0.12])),
        ),
        ("cloth", cloth(plan.cloth, paint("cloth", [0.2, 0.5, 0.45]))),
    ];
    let spent: usize = bodies.iter().map(|(_, mesh)| mesh.faces.len()).sum();
    shell(plan.triangle_count - spent, &paints).add_to(&mut builder, "room");
    for (name, mesh) in bodies {
        mesh.add_to(&mut builder, name);
    }
    builder
}

/// Materials of the shell.
struct Paints {
    floor: MaterialId,
    ceiling: MaterialId,
    left: MaterialId,
    right: MaterialId,
    near: MaterialId,
    far: MaterialId,
    pedestal: MaterialId,
    light: MaterialId,
}

/// Walls, light and pedestal as one closed shell of exactly this many triangles, an even number.
fn shell(triangle_count: usize, paints: &Paints) -> Mesh {
    // The finest lattice that does not exceed the count.
    let mut lines = shell_lines(2.0);
    let mut cell = 2.0;
    while shell_triangle_count(&shell_lines(cell)) <= triangle_count {
        lines = shell_lines(cell);
        cell *= 0.99;
    }
    let [xs, ys, zs] = &lines;
    let mut mesh = lattice_box([xs, ys, zs], Facing::Inward, |side, centre| match side {
        Side::Bottom if within(centre, PEDESTAL_X, PEDESTAL_Z) => None,
        Side::Bottom => Some(paints.floor),
        Side::Top if within(centre, LIGHT_X, LIGHT_Z) => Some(paints.light),
        Side::Top => Some(paints.ceiling),
        Side::Left => Some(paints.left),
        Side::Right => Some(paints.right),
        Side::Near => Some(paints.near),
        Side::Far => Some(paints.far),
    });
    mesh.append(lattice_box(
        [
            clipped(xs, PEDESTAL_X),
            clipped(ys, [0.0, PEDESTAL_HEIGHT]),
            clipped(zs, PEDESTAL_Z),
        ],
        Facing::Outward,
        |side, _| (side != Side::Bottom).then_some(paints.pedestal),
    ));
    let mut mesh = mesh.welded();
    while mesh.faces.len() < triangle_count {
        mesh.split_longest_edge();
    }
    mesh
}

fn shell_lines(cell: f64) -> [Vec<f64>; 3] {
    [&X_BREAKS[..], &Y_BREAKS[..], &Z_BREAKS[..]].map(|breaks| lines_through(breaks, cell))
}

/// Two triangles a cell; the top of the pedestal makes up for the floor under it.
fn shell_triangle_count([xs, ys, zs]: &[Vec<f64>; 3]) -> usize {
    let cells = |lines: &[f64]| lines.len() - 1;
    let [x, y, z] = [cells(xs), cells(ys), cells(zs)];
    let around = cells(clipped(xs, PEDESTAL_X)) + cells(clipped(zs, PEDESTAL_Z));
    4 * (x * y + y * z + z * x) + 4 * around * cells(clipped(ys, [0.0, PEDESTAL_HEIGHT]))
}

/// The lines from `low` to `high`, both among them.
fn clipped(lines: &[f64], [low, high]: [f64; 2]) -> &[f64] {
    let start = lines.partition_point(|&line| line < low);
    let end = lines.partition_point(|&line| line <= high);
    &lines[start..end]
}

fn within(point: DVec3, x: [f64; 2], z: [f64; 2]) -> bool {
    point.x > x[0] && point.x < x[1] && point.z > z[0] && point.z < z[1]
}

/// A standing figure: a sphere swollen by smooth waves, drawn out, bent and twisted.
fn figure(rows: u32, material: MaterialId) -> Mesh {
    geodesic_sphere(rows, material)
        .moved(|p| {
            let waves = 0.24 * (2.6 * p.y + 1.1 * p.x + 0.4).sin() * (2.1 * p.x - 0.7).cos()
                + 0.15 * (4.3 * p.y - 1.7 * p.z + 1.9).sin()
                + 0.06 * (6.1 * p.x + 5.2 * p.z).sin() * (1.0 - p.y * p.y);
            let swollen = p * (1.0 + waves);
            let angle = 1.5 * swollen.y;
            let turned = DMat2::from_angle(angle) * DVec2::new(swollen.x, swollen.z);
            DVec3::new(
                0.3 * turned.x + 0.09 * (2.4 * swollen.y).sin(),
                0.66 * swollen.y,
                0.26 * turned.y + 0.05 * (1.9 * swollen.y).cos(),
            )
        })
        .moved(|p| p + DVec3::new(1.45, 0.0, 2.25))
        .standing_at(PEDESTAL_HEIGHT - SUNK)
}

/// A ribbed gourd on the floor.
fn gourd(rows: u32, material: MaterialId) -> Mesh {
    geodesic_sphere(rows, material)
        .moved(|p| {
            // The ribs fade out towards the poles, where they would meet in a spike.
            let ribs = 0.11 * (7.0 * p.z.atan2(p.x)).cos() * (1.0 - p.y * p.y);
            let neck = 0.3 * (2.2 * p.y + 0.3).sin() * (1.0 - p.y);
            let scale = 0.36 * (1.0 + ribs);
            DVec3::new(
                p.x * (scale - 0.3 * neck),
                0.42 * p.y,
                p.z * (scale - 0.3 * neck),
            )
        })
        .moved(|p| p + DVec3::new(2.85, 0.0, 2.9))
        .standing_at(-SUNK)
}

/// A three-cornered cloth before the far wall: an open sheet of `rows²` triangles.
fn cloth(rows: u32, material: MaterialId) -> Mesh {
    let (left, right) = (DVec3::new(2.5, 2.35, 4.1), DVec3::new(3.7, 2.35, 4.3));
    let bottom = DVec3::new(3.1, 1.15, 4.25);
    let mut mesh = Mesh::default();
    let mut row_above: Vec<u32> = Vec::new();
    for row in 0..=rows {
        let this_row: Vec<u32> = (0..=row)
            .map(|column| {
                let along = f64::from(column) / f64::from(rows);
                let up = f64::from(row) / f64::from(rows);
                let flat = bottom * (1.0 - up) + left * (up - along) + right * along;
                let billow = 0.07 * (4.0 * flat.x).sin() * (3.0 * flat.y).cos();
                mesh.vertex(flat + DVec3::Z * billow)
            })
            .collect();
        mesh.strip(&row_above, &this_row, material);
        row_above = this_row;
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SceneOptions;

    #[test]
    fn a_room_has_the_triangles_that_are_asked_for() {
        for wanted in [1, 1_022, 4_096, 8_621, 16_385] {
            let builder = room_of(wanted);
            assert_eq!(builder.faces.len(), wanted.max(FEWEST));
            let scene = builder.finish(&SceneOptions::default()).unwrap();
            assert!(scene.has_emitter() && scene.warnings.is_empty(), "{wanted}");
        }
    }
}
