//! Where objects stand on others: in a furnace, where everything emits and reflects alike, all that can be seen is equally
//! bright, however much of a surface lies under an object.

mod boxes;
mod common;

use std::{f32::consts::PI, f64::consts::TAU};

use boxes::{cuboid, mean_irradiance, rectangle, solved};
use common::assert_close;
use glam::{DVec3, Vec3};
use vecrad::{
    scene::{Material, MaterialId, SceneBuilder, Sides},
    solver::{Direct, Snapshot, SolveSettings},
};

const EMITTED: f32 = 0.25;
const REFLECTANCE: f32 = 0.5;

/// A furnace with a box in it, whose floor runs from -1 to 1 both ways at height 0; places as in the file.
fn furnished(low: DVec3, high: DVec3) -> Snapshot {
    let mut builder = SceneBuilder::default();
    let paint = builder.push_material(Material::plain(
        "glowing",
        Vec3::splat(REFLECTANCE),
        Vec3::splat(EMITTED),
    ));
    let room = [DVec3::new(-1.0, 0.0, -1.0), DVec3::new(1.0, 2.0, 1.0)];
    cuboid(&mut builder, room[0], room[1], true, paint);
    cuboid(&mut builder, low, high, false, paint);
    solved(builder, Sides::One, SolveSettings::default())
}

/// How far what shows on the floor within 0.1 of the box is off: on average, and at worst.
fn errors_beside(low: DVec3, high: DVec3) -> (f32, f32) {
    let outside = |corners: [Vec3; 3]| {
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        let outside = (low.as_vec3() - middle).max(middle - high.as_vec3());
        let is_floor = corners.iter().all(|corner| corner.y.abs() < 1e-3);
        is_floor.then_some(outside.x.max(outside.z))
    };
    errors_within(&furnished(low, high), outside)
}

/// How far what shows is off at triangles of which the distance is less than 0.1: on average, and at worst.
fn errors_within(snapshot: &Snapshot, distance: impl Fn([Vec3; 3]) -> Option<f32>) -> (f32, f32) {
    let (mesh, light) = (&snapshot.mesh, &snapshot.light);
    let expected = PI * EMITTED / (1.0 - REFLECTANCE);
    let (mut beside, mut worst, mut sum) = (0, 0.0f32, 0.0);
    for vertices in &mesh.indices {
        let corners = vertices.map(|vertex| mesh.positions[vertex as usize]);
        if !distance(corners).is_some_and(|distance| (0.0..0.1).contains(&distance)) {
            continue;
        }
        let shown = vertices.map(|vertex| light.irradiance[vertex as usize].x);
        let shown = shown.iter().sum::<f32>() / 3.0;
        let error = (shown / expected - 1.0).abs();
        (beside, worst, sum) = (beside + 1, worst.max(error), sum + error);
    }
    assert!(beside > 50, "{beside} triangles there");
    (sum / beside as f32, worst)
}

/// Light is lost only where triangles reach under the box; a smudge would be far darker.
#[test]
fn no_smudge_shows_beside_an_object() {
    let (mean, worst) = errors_beside(DVec3::new(-0.37, -0.05, -0.37), DVec3::new(0.37, 0.8, 0.37));
    assert!(mean < 0.06 && worst < 0.3, "mean {mean}, worst {worst}");
}

/// Within the box, floor and wall see each other, and neither a back.
#[test]
fn no_smudge_shows_beside_an_object_in_a_corner() {
    let (mean, worst) = errors_beside(DVec3::new(-1.05, -0.05, -0.37), DVec3::new(-0.3, 0.8, 0.37));
    assert!(mean < 0.06 && worst < 0.3, "mean {mean}, worst {worst}");
}

/// A shelf let into a wall by less than is seen where large elements are looked at.
#[test]
fn no_smudge_shows_on_what_reaches_into_a_wall() {
    let (low, high) = (DVec3::new(-1.0004, 0.5, -0.6), DVec3::new(-0.4, 0.6, 0.6));
    let before_wall = |corners: [Vec3; 3]| {
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        let is_top = corners.iter().all(|corner| (corner.y - 0.6).abs() < 1e-3);
        is_top.then_some(middle.x + 1.0)
    };
    let (mean, worst) = errors_within(&furnished(low, high), before_wall);
    assert!(mean < 0.02 && worst < 0.1, "mean {mean}, worst {worst}");
}

/// A black box before walls that glow, lit over links alone: at its foot, half of the view is black. What glows behind
/// the box must not leak there.
#[test]
fn links_let_no_light_into_the_corner_at_the_foot_of_an_object() {
    let mut builder = SceneBuilder::default();
    let glowing = Material::plain("glowing", Vec3::ZERO, Vec3::ONE);
    let glowing = builder.push_material(glowing);
    let black = builder.push_material(Material::plain("black", Vec3::ZERO, Vec3::ZERO));
    // A floor that glows would show nothing of the light that it receives.
    let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * 2.0);
    let corner = DVec3::new(-1.0, 0.0, -1.0);
    rectangle(&mut builder, corner, [z, x], black);
    rectangle(&mut builder, corner + y, [x, z], glowing);
    rectangle(&mut builder, corner, [y, z], glowing);
    rectangle(&mut builder, corner + x, [z, y], glowing);
    rectangle(&mut builder, corner, [x, y], glowing);
    rectangle(&mut builder, corner + z, [y, x], glowing);
    let (low, high) = (DVec3::new(-0.5, -0.05, -0.2), DVec3::new(0.5, 0.8, 0.2));
    cuboid(&mut builder, low, high, false, black);
    let settings = SolveSettings {
        direct: Direct::Linked,
        ..SolveSettings::default()
    };
    let snapshot = solved(builder, Sides::One, settings);
    let (mesh, light) = (&snapshot.mesh, &snapshot.light);
    let (mut count, mut sum) = (0, 0.0);
    // Where the floor goes on below the box, it has vertices of its own at the foot.
    let middle = |&[a, b, c]: &[u32; 3]| {
        let [a, b, c] = [a, b, c].map(|vertex| mesh.positions[vertex as usize]);
        (a + b + c) / 3.0
    };
    let mut is_before = vec![false; mesh.positions.len()];
    for vertices in &mesh.indices {
        for &vertex in vertices {
            is_before[vertex as usize] |= middle(vertices).z > high.z as f32;
        }
    }
    for (vertex, position) in mesh.positions.iter().enumerate() {
        let before = high.z as f32..high.z as f32 + 0.1;
        let is_foot = is_before[vertex] && position.y.abs() < 1e-3 && position.x.abs() < 0.4;
        if !is_foot || !before.contains(&position.z) || mesh.normals[vertex].y < 0.9 {
            continue;
        }
        let black = share_of_face(*position, low.as_vec3(), high.as_vec3());
        sum += (light.irradiance[vertex].x / (PI * (1.0 - black)) - 1.0).abs();
        count += 1;
    }
    assert!(count > 10, "{count} vertices before the box");
    let mean = sum / count as f32;
    // Links alone are off by 0.16; of what rays find, a part is taken for noise.
    assert!(mean < 0.1, "off by {mean} in the mean of {count}");
}

/// The form factor from a point of the floor to the face of a box before it: that of an upright rectangle.
fn share_of_face(point: Vec3, low: Vec3, high: Vec3) -> f32 {
    let (distance, height) = ((point.z - high.z).max(1e-3), high.y);
    let half = |width: f32| {
        let slant = (distance * distance + height * height).sqrt();
        ((width / distance).atan() - distance / slant * (width / slant).atan()) / (2.0 * PI)
    };
    half(high.x - point.x) + half(point.x - low.x)
}

/// A closed ring about an axis, of many small triangles.
fn ring(builder: &mut SceneBuilder, centre: DVec3, axis: usize, paint: MaterialId) {
    const AROUND: u32 = 32;
    const ACROSS: u32 = 16;
    let turn = |step: u32, of: u32| TAU * f64::from(step % of) / f64::from(of);
    let corner = |around: u32, across: u32| {
        let (sine, cosine) = turn(around, AROUND).sin_cos();
        let (height, inward) = turn(across, ACROSS).sin_cos();
        let distance = 0.6 + 0.2 * inward;
        let mut place = [0.0; 3];
        place[axis] = 0.2 * height;
        place[(axis + 1) % 3] = distance * cosine;
        place[(axis + 2) % 3] = distance * sine;
        centre + DVec3::from_array(place)
    };
    let corners: Vec<u32> = (0..AROUND * ACROSS)
        .map(|index| builder.push_position(corner(index / ACROSS, index % ACROSS)))
        .collect();
    let at =
        |around: u32, across: u32| corners[(around % AROUND * ACROSS + across % ACROSS) as usize];
    for (around, across) in (0..AROUND).flat_map(|a| (0..ACROSS).map(move |b| (a, b))) {
        let [a, b, c, d] =
            [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(x, y)| at(around + x, across + y));
        builder.push_triangle([a, b, c], paint);
        builder.push_triangle([a, c, d], paint);
    }
}

#[test]
fn what_lies_within_fine_solids_takes_no_light_from_the_room_about_them() {
    let (emitted, reflectance) = (0.1, 0.9);
    let mut builder = SceneBuilder::default();
    let material = Material::plain("glowing", Vec3::splat(reflectance), Vec3::splat(emitted));
    let paint = builder.push_material(material);
    let room = [DVec3::new(-1.0, 0.0, -1.0), DVec3::new(1.0, 2.0, 1.0)];
    cuboid(&mut builder, room[0], room[1], true, paint);
    for axis in 0..3 {
        ring(&mut builder, DVec3::Y, axis, paint);
    }
    let snapshot = solved(builder, Sides::One, SolveSettings::draft());
    let is_wall = |at: Vec3, _: Vec3| (at - Vec3::Y).abs().max_element() > 0.999;
    let (mean, _, most) = mean_irradiance(&snapshot, is_wall);
    let expected = f64::from(PI * emitted / (1.0 - reflectance));
    // Of the light that falls on the rings a part would be lost at each of ten bounces.
    assert_close(mean, expected, 0.025, "mean");
    assert!(f64::from(most) < 1.025 * expected, "{most} of {expected}");
}

/// A white room with boxes in it, by their corners, under a lamp.
fn white_room(boxes: &[[DVec3; 2]], settings: SolveSettings) -> Snapshot {
    let mut builder = SceneBuilder::default();
    let wall = Material::plain("wall", Vec3::splat(0.8), Vec3::ZERO);
    let lamp = Material::plain("lamp", Vec3::ZERO, Vec3::splat(20.0));
    let [wall, lamp] = [wall, lamp].map(|material| builder.push_material(material));
    let room = [DVec3::ZERO, DVec3::new(4.0, 3.0, 4.0)];
    cuboid(&mut builder, room[0], room[1], true, wall);
    for &[low, high] in boxes {
        cuboid(&mut builder, low, high, false, wall);
    }
    let corner = DVec3::new(1.5, 2.99, 1.5);
    rectangle(&mut builder, corner, [DVec3::X, DVec3::Z], lamp);
    solved(builder, Sides::One, settings)
}

/// Elements that lie both behind a cabinet and beside it would send light into the gap behind it.
#[test]
fn furniture_just_before_the_walls_takes_no_more_light_than_at_the_walls() {
    let above = |gap: f64| {
        let furniture = [
            [DVec3::new(gap, gap, 0.5), DVec3::new(0.5, 2.2, 1.5)],
            [DVec3::new(1.5, gap, gap), DVec3::new(2.5, 0.9, 0.6)],
            [DVec3::new(gap, 1.5, 2.5), DVec3::new(0.3, 1.53, 3.5)],
        ];
        let snapshot = white_room(&furniture, SolveSettings::normal());
        let (mean, ..) = mean_irradiance(&snapshot, |at, normal| at.y > 2.995 && normal.y < -0.9);
        mean
    };
    let expected = above(0.0);
    for gap in [0.001, 0.01] {
        let ratio = above(gap) / expected;
        assert!((ratio - 1.0).abs() < 0.012, "{ratio} at {gap}");
    }
}

/// What lies on a floor, and in a stack, covers surfaces whose corners lie on outlines in the light.
#[test]
fn what_is_covered_shows_no_light() {
    // Each reaches a little into what it lies on; the upper ones are smaller, so that all of a top is covered but a rim.
    let sheets = [0, 1, 2, 3].map(|place| {
        let at = 0.02 * f64::from(place);
        let low = DVec3::new(1.0 + at, at - 0.002, 1.0 + at);
        [low, DVec3::new(2.2 - at, at + 0.02, 1.8 - at)]
    });
    let snapshot = white_room(&sheets, SolveSettings::draft());
    let light_within = |inset: f64, height: f64| {
        let is_within = |at: Vec3, normal: Vec3| {
            let at = at.as_dvec3();
            let (x, z) = (at.x - 1.0 - inset, at.z - 1.0 - inset);
            let is_inside = x
                .min(1.2 - 2.0 * inset - x)
                .min(z)
                .min(0.8 - 2.0 * inset - z)
                > 0.0;
            is_inside && (at.y - height).abs() < 1e-4 && normal.y > 0.9
        };
        mean_irradiance(&snapshot, is_within).0
    };
    let lit = light_within(0.06, 0.08);
    assert!(lit > 1.0, "{lit}");
    for height in [0.0, 0.02, 0.04, 0.06] {
        let covered = light_within(height, height);
        assert!(covered < 0.01 * lit, "{covered} at {height}, {lit} on top");
    }
}
