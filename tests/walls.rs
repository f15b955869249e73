//! Closed rooms of sheets in bright surroundings: inside it is dark, however the sheets meet.

mod boxes;
mod common;

use boxes::{cuboid, mean_irradiance, rectangle, solved};
use common::assert_close;
use glam::{DQuat, DVec3, Vec3};
use vecrad::{
    scene::{Material, MaterialId, SceneBuilder, Sides},
    solver::SolveSettings,
};

const ROOM: DVec3 = DVec3::new(5.0, 4.0, 3.0);

/// A wall in as many pieces along its edges as wanted.
fn wall(
    builder: &mut SceneBuilder,
    corner: DVec3,
    [first, second]: [DVec3; 2],
    [rows, columns]: [u32; 2],
    paint: MaterialId,
) {
    let (first, second) = (first / f64::from(rows), second / f64::from(columns));
    for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        let at = corner + first * f64::from(row) + second * f64::from(column);
        rectangle(builder, at, [first, second], paint);
    }
}

/// Six sheets that overshoot each other by so much, in pieces, under a lamp; all turned.
fn house(overshoot: f64, pieces: [[u32; 2]; 6], turn: DQuat) -> SceneBuilder {
    let mut builder = SceneBuilder::default();
    let white = Material::plain("white", Vec3::splat(0.8), Vec3::ZERO);
    let white = builder.push_material(white);
    let lamp = Material::plain("lamp", Vec3::ZERO, Vec3::splat(50.0));
    let lamp = builder.push_material(lamp);
    let past = |axis: DVec3| axis * (ROOM.dot(axis) + 2.0 * overshoot);
    let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(past);
    let sheets = [(x, y, DVec3::Z), (x, z, DVec3::Y), (y, z, DVec3::X)];
    for (sheet, (first, second, across)) in sheets.into_iter().enumerate() {
        let before = -overshoot * (DVec3::ONE - across);
        for (side, place) in [DVec3::ZERO, ROOM * across].into_iter().enumerate() {
            let pieces = pieces[2 * sheet + side];
            wall(&mut builder, before + place, [first, second], pieces, white);
        }
    }
    let (low, high) = (DVec3::new(-8.0, -8.0, -1.4), DVec3::new(12.0, 12.0, -1.2));
    cuboid(&mut builder, low, high, false, white);
    let edges = [DVec3::Y, DVec3::X].map(|axis| axis * 10.0);
    rectangle(&mut builder, DVec3::new(-3.0, -3.0, 6.0), edges, lamp);
    for position in &mut builder.positions {
        *position = turn * *position;
    }
    builder
}

/// Mean irradiance inside a house and outside it.
fn light_of(builder: SceneBuilder, turn: DQuat) -> (f64, f64) {
    let snapshot = solved(builder, Sides::Auto, SolveSettings::default());
    let back = turn.inverse().as_quat();
    let is_inside = |at: Vec3, normal: Vec3| {
        let before = back * (at + normal * 0.01);
        before.cmpgt(Vec3::ZERO).all() && before.cmplt(ROOM.as_vec3()).all()
    };
    let (inside, area, _) = mean_irradiance(&snapshot, is_inside);
    let walls = 2.0 * (ROOM.x * ROOM.y + ROOM.y * ROOM.z + ROOM.z * ROOM.x);
    assert_close(area, walls, 1e-3, "area");
    let (outside, ..) = mean_irradiance(&snapshot, |at, normal| !is_inside(at, normal));
    (inside, outside)
}

const WHOLE: [[u32; 2]; 6] = [[1, 1]; 6];

#[test]
fn sheets_that_overshoot_each_other_keep_light_out() {
    for overshoot in [0.5, 0.03] {
        let builder = house(overshoot, WHOLE, DQuat::IDENTITY);
        let (inside, outside) = light_of(builder, DQuat::IDENTITY);
        assert!(
            inside < 1e-3 * outside,
            "{overshoot}: {inside} beside {outside}"
        );
    }
}

#[test]
fn sheets_that_are_cut_differently_where_they_meet_keep_light_out() {
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize_or_zero(), 0.7);
    let pieces = [[1, 2], [3, 1], [2, 5], [4, 1], [3, 2], [1, 7]];
    for turn in [DQuat::IDENTITY, turn] {
        let (inside, outside) = light_of(house(0.0, pieces, turn), turn);
        assert!(inside < 1e-3 * outside, "{inside} beside {outside}");
    }
}
