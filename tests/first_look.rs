//! The view that a scene opens with: inside rooms, before open boxes, outside of objects; and it shows lit surfaces.

#![cfg(feature = "viewer")]
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod boxes;
mod common;

use std::time::Instant;

use boxes::cuboid;
use glam::{DVec3, Vec2, Vec3};
use vecrad::{
    geometry::RayTree,
    scene::{
        Environment, Material, MaterialId, Scene, SceneBuilder, SceneOptions, Sides, UpAxis,
        builtin,
    },
    viewer::{
        first_look::{FirstLook, first_look},
        view::{ViewMode, ViewSettings},
    },
};

/// Walls of a reflectance, and a lamp.
fn paints(builder: &mut SceneBuilder) -> [MaterialId; 2] {
    let wall = Material::plain("wall", Vec3::splat(0.6), Vec3::ZERO);
    let lamp = Material::plain("lamp", Vec3::ZERO, Vec3::splat(10.0));
    [wall, lamp].map(|paint| builder.push_material(paint))
}

fn finished(builder: SceneBuilder, sides: Sides) -> Scene {
    let scene = builder.finish(&SceneOptions::with_sides(sides)).unwrap();
    scene.lit_by_default()
}

fn look(scene: &Scene) -> FirstLook {
    first_look(scene, &RayTree::new(scene))
}

/// The part of a picture in which the side of a surface is seen that reflects.
fn lit_share(scene: &Scene, look: &FirstLook) -> f32 {
    const SIDE: usize = 40;
    let rays = RayTree::new(scene);
    let place = |index: usize| (index as f32 + 0.5) / SIDE as f32 * 2.0 - 1.0;
    let mut shown = 0;
    for ray in 0..SIDE * SIDE {
        let ndc = Vec2::new(place(ray % SIDE), place(ray / SIDE));
        let (origin, direction) = look.camera.ray(ndc, 1.5);
        if let Some(hit) = rays.closest(origin, direction, None) {
            let index = hit.triangle.index();
            let faces = scene.surfaces[index].area_vector.dot(direction) < 0.0;
            shown += usize::from(faces || scene.triangles[index].two_sided);
        }
    }
    shown as f32 / (SIDE * SIDE) as f32
}

/// A room of 6 × 3 × 5 with a lamp under its ceiling and a box on its floor; sides 0…5 by axis, lower and upper, as far
/// as they are wanted.
fn room(has_side: impl Fn(usize) -> bool, is_inward: bool, has_lamp: bool) -> SceneBuilder {
    let mut builder = SceneBuilder::default();
    let [wall, lamp] = paints(&mut builder);
    let (low, high) = (DVec3::ZERO, DVec3::new(6.0, 3.0, 5.0));
    let first = builder.faces.len();
    cuboid(&mut builder, low, high, is_inward, wall);
    // Two triangles a side: x low, x high, y low, y high, z low, z high.
    let mut index = 0;
    let sides = builder.faces.split_off(first);
    builder.faces.extend(sides.into_iter().filter(|_| {
        index += 1;
        has_side((index - 1) / 2)
    }));
    let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    cuboid(
        &mut builder,
        at(1.0, 0.0, 1.0),
        at(2.5, 1.0, 2.0),
        false,
        wall,
    );
    if has_lamp {
        cuboid(
            &mut builder,
            at(2.5, 2.7, 2.0),
            at(3.5, 2.9, 3.0),
            false,
            lamp,
        );
    }
    builder
}

/// Where the camera stands, in world units.
fn eye(scene: &Scene, look: &FirstLook) -> DVec3 {
    scene.frame.to_world(look.camera.eye())
}

fn is_in_room(eye: DVec3) -> bool {
    eye.cmpgt(DVec3::ZERO).all() && eye.cmplt(DVec3::new(6.0, 3.0, 5.0)).all()
}

#[test]
fn a_closed_room_is_seen_from_inside_whatever_its_sides() {
    for (is_inward, sides) in [
        (true, Sides::Auto),
        (true, Sides::One),
        (true, Sides::Two),
        (false, Sides::Auto),
        (false, Sides::Two),
    ] {
        let scene = finished(room(|_| true, is_inward, true), sides);
        let look = look(&scene);
        let eye = eye(&scene, &look);
        assert!(is_in_room(eye), "{is_inward} {sides:?}: {eye}");
        assert!(look.is_lit && lit_share(&scene, &look) > 0.95);
        assert!(
            look.interior
                .is_some_and(|room| room.holds(look.camera.eye()))
        );
    }
}

#[test]
fn a_room_without_a_lamp_is_seen_from_inside() {
    for sides in [Sides::One, Sides::Auto] {
        let scene = finished(room(|_| true, true, false), sides);
        let look = look(&scene);
        let eye = eye(&scene, &look);
        assert!(is_in_room(eye), "{sides:?}: {eye}");
        assert!(!look.is_lit, "no sky reaches it");
    }
}

#[test]
fn a_box_without_a_front_is_seen_from_before_it() {
    for open in [0, 1, 4, 5] {
        let scene = finished(room(|side| side != open, true, true), Sides::Auto);
        let look = look(&scene);
        let eye = eye(&scene, &look);
        let axis = open / 2;
        let before = [0.0, [6.0, 3.0, 5.0][axis]][open % 2];
        let is_before = if open % 2 == 0 {
            eye[axis] < before
        } else {
            eye[axis] > before
        };
        assert!(is_before, "side {open}: {eye}");
        assert!(look.interior.is_some());
    }
}

#[test]
fn an_object_is_seen_from_outside_and_above() {
    let mut builder = SceneBuilder::default();
    let [wall, _] = paints(&mut builder);
    cuboid(&mut builder, DVec3::ZERO, DVec3::ONE, false, wall);
    for sides in [Sides::Auto, Sides::Two] {
        let scene = finished(builder.clone(), sides);
        let look = look(&scene);
        let eye = eye(&scene, &look);
        assert!(eye.max_element() > 1.0, "{sides:?}: {eye}");
        assert!(look.camera.pitch > 0.0);
        assert!(look.interior.is_none());
    }
}

#[test]
fn solids_that_overlap_on_a_ground_are_no_room() {
    let mut builder = SceneBuilder::default();
    let [wall, _] = paints(&mut builder);
    // A body and a cabin that stands in it, over a ground.
    let [low, high] = [DVec3::new(-1.0, 0.2, -1.0), DVec3::new(1.0, 1.2, 1.0)];
    cuboid(&mut builder, low, high, false, wall);
    let raise = DVec3::new(0.0, 0.6, 0.0);
    cuboid(
        &mut builder,
        low * 0.6 + raise,
        high * 0.6 + raise,
        false,
        wall,
    );
    let ground = [[-6.0, -6.0], [-6.0, 6.0], [6.0, 6.0], [6.0, -6.0]];
    let corners = ground.map(|[x, z]| builder.push_position(DVec3::new(x, 0.0, z)));
    for half in [[0, 1, 2], [0, 2, 3]] {
        builder.push_triangle(half.map(|corner| corners[corner]), wall);
    }
    for sides in [Sides::Auto, Sides::One, Sides::Two] {
        let scene = finished(builder.clone(), sides);
        assert_eq!(look(&scene).interior, None, "{sides:?}");
    }
}

#[test]
fn far_things_do_not_move_the_camera_away() {
    let mut builder = SceneBuilder::default();
    let [wall, _] = paints(&mut builder);
    for index in 0..200 {
        let at = DVec3::new(f64::from(index % 20), 0.0, f64::from(index / 20)) * 2.0;
        cuboid(&mut builder, at, at + DVec3::ONE, false, wall);
    }
    let near = finished(builder.clone(), Sides::Auto);
    let distance = |scene: &Scene| look(scene).camera.distance / scene.frame.scale as f32;
    let expected = distance(&near);
    // A ground of a hundred kilometres, and a stray corner.
    let far = 1e5;
    let ground = [[-far, -far], [far, -far], [far, far], [-far, far]];
    let [a, b, c, d] = ground.map(|[x, z]| builder.push_position(DVec3::new(x, 0.0, z)));
    builder.push_triangle([a, c, b], wall);
    builder.push_triangle([a, d, c], wall);
    let grounded = distance(&finished(builder, Sides::Auto));
    assert!(grounded < 3.0 * expected, "{grounded} for {expected}");
}

#[test]
fn a_room_in_a_dome_that_glows_is_seen_from_inside() {
    // Without the wall at high x, as with a large window.
    let mut builder = room(|side| side != 1, true, false);
    let glow = builder.push_material(Material::plain("sky", Vec3::ZERO, Vec3::ONE));
    let far = DVec3::splat(60.0);
    cuboid(&mut builder, -far, far, true, glow);
    let scene = finished(builder, Sides::Auto);
    let look = look(&scene);
    let eye = eye(&scene, &look);
    assert!(eye.abs().max_element() < 20.0, "{eye}");
    assert!(lit_share(&scene, &look) > 0.5);
}

#[test]
fn built_in_scenes_open_with_lit_surfaces() {
    for found in builtin::builtins() {
        // It takes long.
        if found.name == "room-1m" {
            continue;
        }
        let scene = found.scene(&SceneOptions::default()).unwrap();
        let look = look(&scene);
        assert!(look.camera.is_valid(), "{}", found.name);
        let eye = look.camera.eye();
        let [min, max] = look.bounds;
        let is_inside = eye.cmpgt(min).all() && eye.cmplt(max).all();
        // The glazed room is a house that stands on its ground: both are seen from outside.
        let outside = [
            "cornell",
            "courtyard",
            "glazed-room",
            "plates",
            "perpendicular-plates",
        ];
        let is_room = !outside.contains(&found.name);
        assert_eq!(is_inside, is_room, "{}: {eye}", found.name);
        let least = if is_room { 0.8 } else { 0.05 };
        let shown = lit_share(&scene, &look);
        assert!(shown > least, "{}: {shown}", found.name);
    }
}

#[test]
fn a_room_is_entered_where_its_wall_is() {
    let scene = finished(room(|_| true, true, true), Sides::Two);
    let room = look(&scene).interior.unwrap();
    let scale = scene.frame.scale as f32;
    let middle = scene.frame.from_world(DVec3::new(3.0, 1.5, 2.5));
    let eye = middle + Vec3::new(10.0, 0.0, 0.0) * scale;
    let entered = room.entered(eye, Vec3::NEG_X).unwrap() / scale;
    // The wall stands 7 away, and lies before what is entered, so that it is not drawn.
    assert!(entered > 7.0 && entered < 7.1, "{entered}");
    assert_eq!(room.entered(middle, Vec3::NEG_X), Some(0.0));
    assert_eq!(room.entered(eye, Vec3::X), None);
}

#[test]
fn walls_that_face_the_room_are_no_obstacles_before_it() {
    let scene = finished(room(|_| true, true, true), Sides::One);
    let room = look(&scene).interior.unwrap();
    let at = |x: f64, y: f64, z: f64| scene.frame.from_world(DVec3::new(x, y, z));
    // The side walls and the floor, also a little before the box, but not their outsides.
    assert!(room.is_wall(at(3.0, 1.5, 0.0), Vec3::Z));
    assert!(!room.is_wall(at(3.0, 1.5, 0.0), Vec3::NEG_Z));
    assert!(room.is_wall(at(-0.5, 0.0, 2.5), Vec3::Y));
    assert!(room.is_wall(at(-0.5, 1.5, 0.0), Vec3::Z));
    // A post before it, and the outside of the wall in front.
    assert!(!room.is_wall(at(-0.5, 1.5, 2.0), Vec3::Z));
    assert!(!room.is_wall(at(-0.5, 1.5, 2.0), Vec3::NEG_X));
}

#[test]
fn a_room_is_looked_into_from_outside_only() {
    let scene = finished(room(|_| true, true, true), Sides::Two);
    let look = look(&scene);
    let room = look.interior.unwrap();
    let view = ViewSettings::default();
    assert!(!room.is_looked_into(&look.camera, &view));
    let mut outside = look.camera;
    outside.frame_box(look.bounds[0], look.bounds[1], 1.0);
    assert!(room.is_looked_into(&outside, &view));
    for shows_walls in [
        ViewSettings {
            see_through: false,
            ..ViewSettings::default()
        },
        ViewSettings {
            mode: ViewMode::FaceOrientation,
            ..ViewSettings::default()
        },
    ] {
        assert!(!room.is_looked_into(&outside, &shows_walls));
    }
}

#[test]
fn the_same_scene_opens_alike_and_upright() {
    let mut turned = room(|_| true, true, true);
    for position in &mut turned.positions {
        *position = DVec3::new(position.x, -position.z, position.y);
    }
    let options = SceneOptions {
        up: Some(UpAxis::Z),
        ..SceneOptions::default()
    };
    let scene = turned.finish(&options).unwrap();
    let scene = scene.in_environment(Environment::default_sky());
    let (first, second) = (look(&scene), look(&scene));
    assert_eq!(first.camera, second.camera);
    assert_eq!(first.camera.up, Vec3::Z);
}

#[test]
#[ignore = "measures time"]
fn a_million_triangles_take_a_tenth_of_a_second() {
    let found = builtin::find_builtin("room-1m").unwrap();
    let scene = found.scene(&SceneOptions::default()).unwrap();
    let rays = RayTree::new(&scene);
    let begin = Instant::now();
    first_look(&scene, &rays);
    println!("{} s", begin.elapsed().as_secs_f64());
}
