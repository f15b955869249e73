//! Objects far larger or smaller than the rest of a scene must not spoil the light of the rest: a huge ground, a sky of
//! emitting faces, a tiny lamp, long thin faces.

mod boxes;
mod common;

use std::f64::consts::PI;

use boxes::{cuboid, irradiance_at, mean_irradiance, rectangle, solved};
use common::assert_close;
use glam::{DVec3, Vec3};
use vecrad::{
    scene::{Material, MaterialId, SceneBuilder, Sides},
    solver::SolveSettings,
};

fn paint(builder: &mut SceneBuilder, reflectance: f32, emission: f32) -> MaterialId {
    let (reflectance, emission) = (Vec3::splat(reflectance), Vec3::splat(emission));
    builder.push_material(Material::plain("paint", reflectance, emission))
}

/// A square of this half-width in the plane of a height, looking up or down.
fn square(builder: &mut SceneBuilder, middle: DVec3, half: f64, up: bool, paint: MaterialId) {
    let [x, y] = [DVec3::X, DVec3::Y].map(|axis| axis * (2.0 * half));
    let edges = if up { [x, y] } else { [y, x] };
    rectangle(builder, middle - (x + y) * 0.5, edges, paint);
}

/// The form factor from a point to a parallel rectangle of which one corner is above it (Howell, B-3).
fn above_corner(width: f64, depth: f64, height: f64) -> f64 {
    let (x, y) = (width / height, depth / height);
    let part = |x: f64, y: f64| x / (1.0 + x * x).sqrt() * (y / (1.0 + x * x).sqrt()).atan();
    (part(x, y) + part(y, x)) / (2.0 * PI)
}

/// A lamp of a square metre two metres above a ground with a box on it. In reflected light nothing but the box and the
/// ground see each other; below the lamp it adds less than a hundredth.
#[test]
fn a_ground_however_large_is_lit_below_a_lamp_as_a_small_one_is() {
    for (extent, pieces) in [(1e5, 1), (1e7, 1), (1e5, 20)] {
        let mut builder = SceneBuilder::default();
        let ground = paint(&mut builder, 0.5, 0.0);
        let lamp = paint(&mut builder, 0.0, 100.0);
        let side = extent / f64::from(pieces);
        for (x, y) in (0..pieces).flat_map(|x| (0..pieces).map(move |y| (x, y))) {
            let at = |place: i32| side * (f64::from(place) + 0.5) - 0.5 * extent;
            square(
                &mut builder,
                DVec3::new(at(x), at(y), 0.0),
                0.5 * side,
                true,
                ground,
            );
        }
        let (low, high) = (DVec3::new(-0.5, -0.5, 0.0), DVec3::new(0.5, 0.5, 1.0));
        cuboid(&mut builder, low, high, false, ground);
        square(&mut builder, DVec3::new(3.0, 0.0, 2.0), 0.5, false, lamp);
        let snapshot = solved(builder, Sides::Auto, SolveSettings::draft());
        let found = f64::from(irradiance_at(&snapshot, Vec3::new(3.0, 0.0, 0.0), Vec3::Z));
        let expected = 100.0 * PI * 4.0 * above_corner(0.5, 0.5, 2.0);
        assert_close(found, expected, 0.02, format_args!("{extent}"));
    }
}

/// A lamp of a millimetre and of a centimetre a metre above a kilometre and a hundred of ground: as a point of intensity
/// 1 it gives 1 below it, and π to the whole ground.
#[test]
fn a_tiny_lamp_lights_a_huge_ground() {
    for (lamp_side, extent) in [(1e-3, 1e3), (1e-2, 1e5)] {
        let mut builder = SceneBuilder::default();
        let ground = paint(&mut builder, 0.5, 0.0);
        let lamp = paint(&mut builder, 0.0, (1.0 / (lamp_side * lamp_side)) as f32);
        square(&mut builder, DVec3::ZERO, 0.5 * extent, true, ground);
        square(&mut builder, DVec3::Z, 0.5 * lamp_side, false, lamp);
        let snapshot = solved(builder, Sides::Auto, SolveSettings::default());
        let below = irradiance_at(&snapshot, Vec3::ZERO, Vec3::Z);
        assert_close(below, 1.0, 0.01, format_args!("{lamp_side}"));
        let (mean, area, _) = mean_irradiance(&snapshot, |at, normal| at.z < 0.5 && normal.z > 0.9);
        assert_close(mean * area, PI, 0.02, format_args!("{lamp_side}"));
    }
}

/// A black box over a floor under a sky of five faces: below its middle, it hides its form factor of the sky.
#[test]
fn even_light_from_all_around_casts_shadows_and_gives_no_more_than_it_can() {
    for (half, reflectance) in [(20.0, 0.0), (25.0, 0.0)] {
        let mut builder = SceneBuilder::default();
        let floor = paint(&mut builder, 0.0, 0.0);
        let body = paint(&mut builder, reflectance, 0.0);
        let sky = paint(&mut builder, 0.0, 1.0);
        let low = DVec3::new(-half, -half, -1e-3 * half);
        cuboid(&mut builder, low, DVec3::new(half, half, half), true, sky);
        square(&mut builder, DVec3::ZERO, 2.0, true, floor);
        let (low, high) = (DVec3::new(-0.5, -0.5, 0.5), DVec3::new(0.5, 0.5, 1.0));
        cuboid(&mut builder, low, high, false, body);
        let snapshot = solved(builder, Sides::One, SolveSettings::default());
        let is_floor = |at: Vec3, normal: Vec3| at.z.abs() < 1e-3 && normal.z > 0.9;
        let near = |at: Vec3, normal: Vec3| is_floor(at, normal) && at.x.hypot(at.y) < 0.3;
        let (below, ..) = mean_irradiance(&snapshot, near);
        let hidden = 4.0 * above_corner(0.5, 0.5, 0.5);
        let expected = PI * (1.0 - hidden);
        // Towards the edge of the circle the box hides less.
        let least = if reflectance > 0.0 { 1.0 } else { 0.97 };
        assert!(
            (least * expected..1.3 * expected).contains(&below),
            "{half}: {below}, not {expected}"
        );
        let (_, _, most) = mean_irradiance(&snapshot, is_floor);
        assert!(f64::from(most) <= PI * (1.0 + 1e-6), "{half}: {most}");
    }
}

/// A floor of planks in a black room, symmetrical below a lamp: both ends of each plank are lit alike.
#[test]
fn light_along_a_plank_is_not_drawn_straight_from_end_to_end() {
    for (count, length) in [(100, 4.0), (60, 7.0)] {
        let mut builder = SceneBuilder::default();
        let black = paint(&mut builder, 0.0, 0.0);
        let lamp = paint(&mut builder, 0.0, 10.0);
        let width = 4.0 / f64::from(count);
        for plank in 0..count {
            let corner = DVec3::new(0.0, width * f64::from(plank), 0.0);
            let edges = [DVec3::X * length, DVec3::Y * width];
            rectangle(&mut builder, corner, edges, black);
        }
        let low = DVec3::new(0.0, 0.0, -1e-2);
        cuboid(&mut builder, low, DVec3::new(length, 4.0, 3.0), true, black);
        let middle = DVec3::new(0.5 * length, 2.0, 2.9);
        square(&mut builder, middle, 0.5, false, lamp);
        let snapshot = solved(builder, Sides::One, SolveSettings::default());
        let is_floor = |at: Vec3, normal: Vec3| at.z.abs() < 1e-3 && normal.z > 0.9;
        let (mean, ..) = mean_irradiance(&snapshot, is_floor);
        let expected = floor_mean(length, 4.0, 2.9);
        assert_close(mean, expected, 0.01, format_args!("{count}"));
    }
}

/// A bar along a ceiling with lamps in it, far smaller than all that is divided in a room of this size.
#[test]
fn light_along_a_narrow_bar_is_that_of_its_pieces() {
    const LENGTH: f64 = 12.0;
    let light = |pieces: u32| {
        let mut builder = SceneBuilder::default();
        let black = paint(&mut builder, 0.0, 0.0);
        let lamp = paint(&mut builder, 0.0, 10.0);
        let high = DVec3::new(LENGTH, 8.0, 3.0);
        cuboid(&mut builder, DVec3::new(0.0, 0.0, -0.1), high, true, black);
        for place in 0..6 {
            let middle = DVec3::new(1.3 + 1.8 * f64::from(place), 4.32, 2.999);
            square(&mut builder, middle, 0.3, false, lamp);
        }
        let length = LENGTH / f64::from(pieces);
        for piece in 0..pieces {
            let corner = DVec3::new(length * f64::from(piece + 1), 4.0, 2.99);
            let edges = [DVec3::X * -length, DVec3::Z * 0.008];
            rectangle(&mut builder, corner, edges, black);
        }
        let snapshot = solved(builder, Sides::One, SolveSettings::draft());
        let is_bar = |at: Vec3, normal: Vec3| normal.y > 0.9 && at.y > 3.9 && at.z > 2.98;
        mean_irradiance(&snapshot, is_bar).0
    };
    assert_close(light(1), light(80), 0.05, "one bar");
}

/// Mean irradiance of a floor below the middle of a lamp of 1 by 1 and radiance 10, by a fine grid.
fn floor_mean(length: f64, width: f64, height: f64) -> f64 {
    const CELLS: u32 = 60;
    let place =
        |cell: u32, extent: f64| ((f64::from(cell) + 0.5) / f64::from(CELLS) - 0.5) * extent;
    let signed = |x: f64, y: f64| above_corner(x.abs(), y.abs(), height) * x.signum() * y.signum();
    let factor = |x: f64, y: f64| {
        let (left, right, low, high) = (-0.5 - x, 0.5 - x, -0.5 - y, 0.5 - y);
        signed(right, high) - signed(left, high) - signed(right, low) + signed(left, low)
    };
    let cells = (0..CELLS).flat_map(|x| (0..CELLS).map(move |y| (x, y)));
    let sum: f64 = cells
        .map(|(x, y)| factor(place(x, length), place(y, width)))
        .sum();
    10.0 * PI * sum / f64::from(CELLS * CELLS)
}
