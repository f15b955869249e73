//! Plane mirrors: a room with one equals the room built twice, and mirrors that show each other equal path tracing.

mod common;

use std::sync::Arc;

use common::{assert_close, finish, prepare, solve, step_to_end};
use glam::{DVec3, Vec3};
use vecrad::{
    geometry::RayTree,
    metrics::{MeshLookup, measure_error},
    reference::{PathSettings, PathTracer, ReferencePoint},
    scene::{Material, MaterialId, Scene, SceneBuilder, Sides, Specular, luminance},
    solver::{Cancel, SolveSettings, Solver},
};

/// Extents of the room, from the plane x = 0.
const ROOM: [f64; 3] = [3.0, 2.5, 4.0];

/// A side of the room.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Wall {
    /// x = 0.
    Left,
    /// x = 3.
    Right,
    /// z = 4.
    Far,
}

/// The materials of the room.
struct Paints {
    wall: MaterialId,
    red: MaterialId,
    lamp: MaterialId,
    block: MaterialId,
    mirror: MaterialId,
}

impl Paints {
    fn new(builder: &mut SceneBuilder, reflectance: f32) -> Self {
        let mut plain = |name: &str, [r, g, b]: [f32; 3], emission: [f32; 3]| {
            let emission = Vec3::from_array(emission);
            builder.push_material(Material::plain(name, Vec3::new(r, g, b), emission))
        };
        let dark = [0.0; 3];
        let [wall, red, lamp, block] = [
            plain("wall", [0.6, 0.55, 0.5], dark),
            plain("red", [0.6, 0.1, 0.1], dark),
            plain("lamp", dark, [3.0, 2.7, 2.2]),
            plain("block", [0.3, 0.5, 0.3], dark),
        ];
        let mirror = builder.push_material(Material {
            specular: Some(Specular::Mirror {
                reflectance: Vec3::splat(reflectance),
            }),
            ..Material::plain("mirror", Vec3::ZERO, Vec3::ZERO)
        });
        Self {
            wall,
            red,
            lamp,
            block,
            mirror,
        }
    }
}

/// A rectangle across an axis that faces along it, or against it.
fn rectangle(
    builder: &mut SceneBuilder,
    (axis, at): (usize, f64),
    [low, high]: [[f64; 2]; 2],
    is_along: bool,
    material: MaterialId,
) {
    let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
    let mut corners = [
        [low[0], low[1]],
        [high[0], low[1]],
        [high[0], high[1]],
        [low[0], high[1]],
    ];
    if !is_along {
        corners.reverse();
    }
    let corners = corners.map(|[across, up]| {
        let mut point = DVec3::ZERO;
        (point[axis], point[u], point[v]) = (at, across, up);
        builder.push_position(point)
    });
    let [a, b, c, d] = corners;
    builder.push_triangle([a, b, c], material);
    builder.push_triangle([a, c, d], material);
}

/// The half of the room with positive x, or its mirror image, without the wall at x = 0.
fn half(builder: &mut SceneBuilder, paints: &Paints, mirrors: &[Wall], is_image: bool) {
    let paint = |wall: Wall, otherwise: MaterialId| match mirrors.contains(&wall) {
        true => paints.mirror,
        false => otherwise,
    };
    let [width, height, depth] = ROOM;
    let x = |x: f64| if is_image { -x } else { x };
    let between = |a: f64, b: f64| [x(a).min(x(b)), x(a).max(x(b))];
    let [left, right] = between(0.0, width);
    let red = paint(Wall::Right, paints.red);
    rectangle(
        builder,
        (0, x(width)),
        [[0.0, 0.0], [height, depth]],
        is_image,
        red,
    );
    // Across y, the coordinates are z and x.
    let floor = [[0.0, left], [depth, right]];
    rectangle(builder, (1, 0.0), floor, true, paints.wall);
    for (z, is_along, wall) in [
        (0.0, true, paints.wall),
        (depth, false, paint(Wall::Far, paints.wall)),
    ] {
        rectangle(
            builder,
            (2, z),
            [[left, 0.0], [right, height]],
            is_along,
            wall,
        );
    }
    // The ceiling about its lamp.
    let [near, far] = [1.2, 2.8];
    let [lamp_left, lamp_right] = between(0.6, 2.4);
    for (zs, xs, material) in [
        ([0.0, near], [left, right], paints.wall),
        ([far, depth], [left, right], paints.wall),
        ([near, far], [left, lamp_left], paints.wall),
        ([near, far], [lamp_right, right], paints.wall),
        ([near, far], [lamp_left, lamp_right], paints.lamp),
    ] {
        let part = [[zs[0], xs[0]], [zs[1], xs[1]]];
        rectangle(builder, (1, height), part, false, material);
    }
    // A block that floats.
    let [low, high] = [[0.3, 2.4], [1.2, 3.0]];
    let [block_left, block_right] = between(0.6, 1.3);
    for (at, is_along) in [(block_left, false), (block_right, true)] {
        rectangle(builder, (0, at), [low, high], is_along, paints.block);
    }
    for (at, is_along) in [(low[0], false), (high[0], true)] {
        let part = [[low[1], block_left], [high[1], block_right]];
        rectangle(builder, (1, at), part, is_along, paints.block);
    }
    for (at, is_along) in [(low[1], false), (high[1], true)] {
        let part = [[block_left, low[0]], [block_right, high[0]]];
        rectangle(builder, (2, at), part, is_along, paints.block);
    }
}

/// The room with some walls as mirrors of this reflectance.
fn room(mirrors: &[Wall], reflectance: f32) -> Arc<Scene> {
    let mut builder = SceneBuilder::default();
    let paints = Paints::new(&mut builder, reflectance);
    half(&mut builder, &paints, mirrors, false);
    let left = match mirrors.contains(&Wall::Left) {
        true => paints.mirror,
        false => paints.wall,
    };
    let [_, height, depth] = ROOM;
    rectangle(
        &mut builder,
        (0, 0.0),
        [[0.0, 0.0], [height, depth]],
        true,
        left,
    );
    finish(builder, Sides::One)
}

/// The room and its image in the plane x = 0.
fn doubled() -> Arc<Scene> {
    let mut builder = SceneBuilder::default();
    let paints = Paints::new(&mut builder, 1.0);
    half(&mut builder, &paints, &[], false);
    half(&mut builder, &paints, &[], true);
    finish(builder, Sides::One)
}

/// The irradiance shown at points of a scene.
fn shown(solver: &Solver, points: &[ReferencePoint]) -> Vec<Vec3> {
    let snapshot = solver.snapshot();
    let lookup = MeshLookup::new(solver.scene(), &snapshot.mesh);
    let found = lookup.irradiance(&snapshot.light, points);
    found
        .into_iter()
        .map(|light| light.unwrap_or_default())
        .collect()
}

/// The points of a path-traced scene.
fn traced(scene: &Arc<Scene>, passes: u32) -> Vec<ReferencePoint> {
    let settings = PathSettings {
        point_count: 1000,
        samples_per_pass: 64,
        seed: 3,
    };
    let mut tracer = PathTracer::new(scene.clone(), Arc::new(RayTree::new(scene)), settings);
    for _ in 0..passes {
        assert!(tracer.pass(&|| false));
    }
    tracer.result().points
}

#[test]
fn a_room_with_a_mirror_is_the_room_built_twice() {
    let (mirrored, twice) = (room(&[Wall::Left], 1.0), doubled());
    let solved = |scene: &Arc<Scene>| solve(scene, SolveSettings::normal()).0;
    let (mirrored, twice) = (solved(&mirrored), solved(&twice));
    // Points of the first, and the same in the second: which has other triangles in another frame.
    let points = traced(mirrored.scene(), 1);
    let mirror = |point: &ReferencePoint| {
        let material = mirrored.scene().material(point.triangle);
        material.specular.is_some()
    };
    let points: Vec<ReferencePoint> = points.into_iter().filter(|point| !mirror(point)).collect();
    let rays = RayTree::new(twice.scene());
    let moved: Vec<ReferencePoint> = points
        .iter()
        .map(|point| {
            let (from, to) = (&mirrored.scene().frame, &twice.scene().frame);
            let position = to.from_world(from.to_world(point.position));
            let above = position + point.normal * 0.01;
            let hit = rays.closest(above, -point.normal, None).unwrap();
            let corners = twice.scene().corners(hit.triangle);
            ReferencePoint {
                triangle: hit.triangle,
                barycentric: vecrad::geometry::barycentric(position, corners),
                position,
                ..*point
            }
        })
        .collect();
    let (one, two) = (shown(&mirrored, &points), shown(&twice, &moved));
    let light = |all: &[Vec3], power: i32| -> f64 {
        let values = all
            .iter()
            .map(|light| f64::from(luminance(*light)).powi(power));
        values.sum::<f64>() / all.len() as f64
    };
    assert_close(light(&one, 1), light(&two, 1), 0.003, "mean");
    assert_close(
        light(&one, 2).sqrt(),
        light(&two, 2).sqrt(),
        0.003,
        "root mean square",
    );
    let squares = one.iter().zip(&two);
    let squares = squares.map(|(a, b)| f64::from(luminance(*a - *b)).powi(2));
    let apart = (squares.sum::<f64>() / one.len() as f64 / light(&two, 2)).sqrt();
    assert!(apart < 0.015, "points differ by {apart}");
}

#[test]
fn mirrors_that_show_each_other_equal_path_tracing() {
    for (mirrors, reflectance) in [
        ([Wall::Left, Wall::Right], 0.75),
        ([Wall::Left, Wall::Far], 0.75),
    ] {
        let scene = room(&mirrors, reflectance);
        let (solver, _) = solve(&scene, SolveSettings::normal());
        let points = traced(&scene, 2);
        let snapshot = solver.snapshot();
        let lookup = MeshLookup::new(&scene, &snapshot.mesh);
        let found = lookup.radiance(&snapshot.light, &points);
        let error = measure_error(&found, &points).unwrap();
        assert_close(
            error.energy_ratio.unwrap(),
            1.0,
            0.01,
            format_args!("{mirrors:?}"),
        );
        assert!(error.relative_rms_trimmed < 0.05, "{mirrors:?}: {error:?}");
    }
}

#[test]
fn other_lamps_and_walls_show_in_mirrors() {
    let scene = room(&[Wall::Left], 0.9);
    let mut appearances = scene.appearances();
    for (appearance, material) in appearances.iter_mut().zip(&scene.materials) {
        match &*material.name {
            "lamp" => appearance.emission = Vec3::new(0.5, 2.0, 6.0),
            "red" => appearance.reflectance = Vec3::new(0.1, 0.2, 0.7),
            _ => {}
        }
    }
    let (mut solver, _) = solve(&scene, SolveSettings::normal());
    let relit = solver.relight(&appearances, &Cancel::default()).unwrap();
    assert!(!relit.needs_restart);
    let anew = Arc::new(scene.relit(&appearances));
    let (fresh, _) = solve(&anew, SolveSettings::normal());
    let points = traced(&scene, 1);
    let mean = |solver: &Solver| {
        let light = shown(solver, &points);
        light.iter().sum::<Vec3>() / light.len() as f32
    };
    let (relit, fresh) = (mean(&solver), mean(&fresh));
    assert!(
        (relit / fresh - 1.0).abs().max_element() < 0.01,
        "{relit} instead of {fresh}"
    );
}

#[test]
fn links_over_mirrors_link_each_pair_once() {
    let scene = room(&[Wall::Left, Wall::Far], 0.75);
    let mut solver = prepare(&scene, SolveSettings::draft());
    step_to_end(&mut solver, |solver, _| {
        let mut linked = 0;
        for (image, links) in solver.image_links() {
            let found = links.validate_seen(solver.hierarchy(), Some(image));
            assert_eq!(found, Ok(()), "{image:?}");
            linked += links.len();
        }
        assert!(linked > 0);
    });
}

#[test]
fn the_reference_sees_a_mirror_as_an_image() {
    // E = E(source) + ρ E(image), for light straight from the lamp: black walls.
    let lit = |mirrors: &[Wall], reflectance: f32| {
        let mut builder = SceneBuilder::default();
        let paints = Paints::new(&mut builder, reflectance);
        for paint in [paints.wall, paints.red, paints.block] {
            builder.materials[paint.index()].reflectance = Vec3::ZERO;
        }
        half(&mut builder, &paints, mirrors, false);
        let left = if mirrors.is_empty() {
            paints.wall
        } else {
            paints.mirror
        };
        rectangle(
            &mut builder,
            (0, 0.0),
            [[0.0, 0.0], [ROOM[1], ROOM[2]]],
            true,
            left,
        );
        let scene = finish(builder, Sides::One);
        // All surfaces are black, so all count.
        let points = traced(&scene, 4);
        let floor = points.iter().filter(|point| point.normal.y > 0.9);
        let light: Vec<f64> = floor
            .map(|point| f64::from(luminance(point.irradiance)))
            .collect();
        light.iter().sum::<f64>() / light.len() as f64
    };
    let [without, half, whole] = [
        lit(&[], 1.0),
        lit(&[Wall::Left], 0.5),
        lit(&[Wall::Left], 1.0),
    ];
    assert!(whole > 1.05 * without);
    assert_close(half, 0.5 * (without + whole), 0.01, "half a mirror");
}
