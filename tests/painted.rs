//! Light of painted surfaces, where it leaves from: lamps in `map_Ke`, dark and bright parts of `map_Kd`. Against closed
//! forms, sampled and linked, in the clear and with something in the way.

mod common;

use std::{f64::consts::PI, sync::Arc};

use common::{finish, solve_validated};
use glam::{DVec3, Vec2, Vec3};
use vecrad::{
    geometry::RayTree,
    reference::{PathSettings, PathTracer, analytic::point_to_polygon},
    scene::{
        Appearance, Face, Material, MaterialId, Scene, SceneBuilder, Sides, Texture, TextureId,
    },
    solver::{Cancel, Direct, Snapshot, SolveSettings, Solver},
};

/// Grey pixels by column and row, row 0 at the top.
fn texture(width: u32, height: u32, value: impl Fn(u32, u32) -> f32) -> Texture {
    let pixels = (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
    Texture {
        name: String::new(),
        width,
        height,
        pixels: pixels
            .map(|(column, row)| Vec3::splat(value(column, row)))
            .collect(),
        ..Texture::default()
    }
}

/// A parallelogram with texture coordinates from 0 to 1 along its edges `u` and `v`; its front looks along `u` × `v`.
fn quad(builder: &mut SceneBuilder, material: MaterialId, [corner, u, v]: [DVec3; 3]) {
    let corners = [corner, corner + u, corner + u + v, corner + v];
    let places = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    let points = corners.map(|corner| builder.push_position(corner));
    for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
        builder.faces.push(Face {
            corners: [points[a], points[b], points[c]],
            texcoords: Some([places[a], places[b], places[c]]),
            normals: None,
            material,
            line: 0,
        });
    }
}

fn solver(scene: &Arc<Scene>, direct: Direct) -> Solver {
    let settings = SolveSettings {
        direct,
        ..SolveSettings::draft()
    };
    solve_validated(scene, settings).0
}

/// Mean error of the irradiance at vertices that look along a normal, and that are told, and the error that one in twenty
/// exceeds; relative to the mean of what is right.
fn errors(
    scene: &Scene,
    shown: &Snapshot,
    normal: Vec3,
    right: impl Fn(DVec3) -> Option<Vec3>,
) -> [f64; 2] {
    let mesh = &shown.mesh;
    let (mut errors, mut sum) = (Vec::new(), 0.0);
    for (index, &position) in mesh.positions.iter().enumerate() {
        let Some(right) = right(scene.frame.to_world(position)) else {
            continue;
        };
        if mesh.normals[index].dot(normal) < 0.99 {
            continue;
        }
        let error = (shown.light.irradiance[index] - right).abs().max_element();
        errors.push(f64::from(error));
        sum += f64::from(right.max_element());
    }
    assert!(errors.len() > 15, "{} vertices", errors.len());
    errors.sort_unstable_by(f64::total_cmp);
    let high = errors[errors.len() * 19 / 20];
    [
        errors.iter().sum::<f64>() / sum,
        high * errors.len() as f64 / sum,
    ]
}

/// Something black in a corner, so that the scene is not clear.
fn speck(builder: &mut SceneBuilder, at: DVec3) {
    let black = builder.push_material(Material::plain("speck", Vec3::ZERO, Vec3::ZERO));
    quad(builder, black, [at, DVec3::X * 0.02, DVec3::Y * 0.02]);
}

/// Where the ceiling of the painted room shines, as shares of it, and how brightly.
const LAMPS: [([f64; 4], f64); 2] = [
    ([0.25, 0.375, 0.5, 0.75], 1.0),
    ([0.8125, 0.125, 0.9375, 0.25], 0.5),
];

const CEILING: Vec3 = Vec3::new(10.0, 8.0, 3.0);
const ROOM: DVec3 = DVec3::new(6.0, 4.0, 2.5);

/// A floor under a ceiling of two triangles with two lamps that are painted on it, and a plain lamp beside it.
fn painted_room(has_speck: bool) -> Arc<Scene> {
    let mut builder = SceneBuilder::default();
    let (width, height) = (96, 64);
    builder.textures.push(texture(width, height, |column, row| {
        let x = (f64::from(column) + 0.5) / f64::from(width);
        let y = 1.0 - (f64::from(row) + 0.5) / f64::from(height);
        let lamp = |([left, low, right, high], _): &&([f64; 4], f64)| {
            (*left..*right).contains(&x) && (*low..*high).contains(&y)
        };
        LAMPS.iter().find(lamp).map_or(0.0, |lamp| lamp.1 as f32)
    }));
    let floor = builder.push_material(Material::plain("floor", Vec3::splat(0.5), Vec3::ZERO));
    let ceiling = builder.push_material(Material {
        emission_texture: Some(TextureId(0)),
        ..Material::plain("ceiling", Vec3::ZERO, CEILING)
    });
    let lamp = builder.push_material(Material::plain("lamp", Vec3::ZERO, Vec3::splat(4.0)));
    let [x, y] = [DVec3::X * ROOM.x, DVec3::Y * ROOM.y];
    quad(&mut builder, floor, [DVec3::ZERO, x, y]);
    // Looks down, and its texture runs along x and y: by its corners, not by `quad`.
    let corners = [DVec3::ZERO, x, x + y, y].map(|corner| corner + DVec3::Z * ROOM.z);
    let points = corners.map(|corner| builder.push_position(corner));
    let places = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    for [a, b, c] in [[0, 2, 1], [0, 3, 2]] {
        builder.faces.push(Face {
            corners: [points[a], points[b], points[c]],
            texcoords: Some([places[a], places[b], places[c]]),
            normals: None,
            material: ceiling,
            line: 0,
        });
    }
    let [corner, u, v] = PLAIN_LAMP;
    quad(&mut builder, lamp, [corner, u, v]);
    if has_speck {
        speck(&mut builder, DVec3::new(0.05, 0.05, 0.5));
    }
    finish(builder, Sides::One)
}

/// Beside the ceiling; looks down.
const PLAIN_LAMP: [DVec3; 3] = [
    DVec3::new(6.1, 1.0, 2.5),
    DVec3::new(0.0, 1.0, 0.0),
    DVec3::new(1.0, 0.0, 0.0),
];

/// Irradiance of the floor of the painted room for these radiances of the ceiling and of the plain lamp.
fn on_floor(point: DVec3, ceiling: Vec3, plain: Vec3) -> Vec3 {
    let factor = |corners: [DVec3; 4]| point_to_polygon(point, DVec3::Z, &corners).abs() * PI;
    let painted: f64 = LAMPS
        .iter()
        .map(|([left, low, right, high], share)| {
            let corner = |x: f64, y: f64| DVec3::new(x, y, 1.0) * ROOM;
            let corners = [
                corner(*left, *low),
                corner(*right, *low),
                corner(*right, *high),
                corner(*left, *high),
            ];
            share * factor(corners)
        })
        .sum();
    let [corner, u, v] = PLAIN_LAMP;
    let beside = factor([corner, corner + u, corner + u + v, corner + v]);
    ceiling * painted as f32 + plain * beside as f32
}

/// Points of the floor, away from the speck.
fn is_told(point: DVec3) -> bool {
    point.z.abs() < 1e-3 && (point.x > 0.6 || point.y > 0.6)
}

#[test]
fn light_comes_from_where_lamps_are_painted() {
    // Measured: at most 0.0097 and 0.031.
    let most = [0.0145, 0.045];
    for (has_speck, direct) in [
        (false, Direct::Sampled),
        (false, Direct::Linked),
        (true, Direct::Sampled),
        (true, Direct::Linked),
    ] {
        let scene = painted_room(has_speck);
        let shown = solver(&scene, direct).snapshot();
        let right =
            |point: DVec3| is_told(point).then(|| on_floor(point, CEILING, Vec3::splat(4.0)));
        let found = errors(&scene, &shown, Vec3::Z, right);
        assert!(
            found[0] < most[0] && found[1] < most[1],
            "{direct:?}, speck {has_speck}: mean and high errors {found:?}"
        );
    }
}

#[test]
fn painted_lamps_are_dimmed_and_coloured_with_their_material() {
    for direct in [Direct::Sampled, Direct::Linked] {
        let scene = painted_room(true);
        let mut solver = solver(&scene, direct);
        let mut requested = scene.appearances();
        let painted = Vec3::new(1.0, 4.0, 9.0);
        for (material, appearance) in scene.materials.iter().zip(&mut requested) {
            match material.name.as_str() {
                "ceiling" => appearance.emission = painted,
                "lamp" => appearance.emission = Vec3::ZERO,
                _ => {}
            }
        }
        solver.relight(&requested, &Cancel::default()).unwrap();
        solver.finish_relighting(&Cancel::default()).unwrap();
        let right = |point: DVec3| is_told(point).then(|| on_floor(point, painted, Vec3::ZERO));
        let found = errors(&scene, &solver.snapshot(), Vec3::Z, right);
        assert!(
            // Measured: 0.0089 and 0.029.
            found[0] < 0.013 && found[1] < 0.043,
            "{direct:?}: mean and high errors {found:?}"
        );
        let off: Vec<Appearance> = requested
            .iter()
            .map(|appearance| Appearance {
                emission: Vec3::ZERO,
                ..*appearance
            })
            .collect();
        solver.relight(&off, &Cancel::default()).unwrap();
        let light = &solver.snapshot().light;
        assert!(light.irradiance.iter().all(|light| *light == Vec3::ZERO));
    }
}

#[test]
fn paths_see_lamps_where_they_are_painted() {
    let scene = painted_room(true);
    let rays = Arc::new(RayTree::new(&scene));
    let settings = PathSettings {
        point_count: 1500,
        samples_per_pass: 512,
        seed: 3,
    };
    let mut tracer = PathTracer::new(scene.clone(), rays, settings);
    assert!(tracer.pass(&|| false));
    let (mut squares, mut sum, mut variance, mut right, mut count) = (0.0, 0.0, 0.0, 0.0, 0);
    for point in tracer.result().points {
        let place = scene.frame.to_world(point.position);
        if !is_told(place) || point.normal.z < 0.9 {
            continue;
        }
        let luminance = |color: Vec3| f64::from(color.dot(Vec3::new(0.2126, 0.7152, 0.0722)));
        let exact = luminance(on_floor(place, CEILING, Vec3::splat(4.0)));
        let error = luminance(point.irradiance) - exact;
        let deviation = f64::from(point.irradiance_error).max(1e-3 * exact);
        squares += (error / deviation).powi(2);
        sum += error;
        variance += deviation * deviation;
        right += exact;
        count += 1;
    }
    assert!(count > 400, "{count}");
    let chi = squares / f64::from(count);
    assert!(chi < 1.3, "{chi}: errors above their noise");
    // Four standard errors, and what the blurred rims of the lamps change.
    assert!(
        sum.abs() < 4.0 * variance.sqrt() + 1e-3 * right,
        "{sum} of {right}"
    );
}

const FLOOR: f64 = 4.0;
/// In the plane of the wall above it, so that it lights the floor and not the wall.
const LAMP: [DVec3; 4] = [
    DVec3::new(1.5, 4.0, 3.2),
    DVec3::new(2.5, 4.0, 3.2),
    DVec3::new(2.5, 4.0, 4.0),
    DVec3::new(1.5, 4.0, 4.0),
];
const LAMP_RADIANCE: f64 = 20.0;

/// A black wall at y = 4 beside a floor of two triangles that a picture colours, and a lamp above the wall.
fn painted_floor(picture: Texture, has_speck: bool) -> Arc<Scene> {
    let mut builder = SceneBuilder::default();
    builder.textures.push(picture);
    let floor = builder.push_material(Material {
        reflectance_texture: Some(TextureId(0)),
        ..Material::plain("floor", Vec3::splat(0.9), Vec3::ZERO)
    });
    let black = builder.push_material(Material::plain("wall", Vec3::ZERO, Vec3::ZERO));
    let bright = Vec3::splat(LAMP_RADIANCE as f32);
    let lamp = builder.push_material(Material::plain("lamp", Vec3::ZERO, bright));
    let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * FLOOR);
    quad(&mut builder, floor, [DVec3::ZERO, x, y]);
    // Looks along −y.
    quad(&mut builder, black, [y, x, z * 0.75]);
    let [corner, u, _, v] = LAMP;
    quad(&mut builder, lamp, [corner, u - corner, v - corner]);
    if has_speck {
        speck(&mut builder, DVec3::new(0.05, 0.05, 2.0));
    }
    finish(builder, Sides::One)
}

/// Irradiance of the wall, by a sum over small squares of the floor.
struct Wall {
    cells: usize,
    /// Radiosity of each square.
    floor: Vec<f64>,
}

impl Wall {
    fn new(reflectance: impl Fn(f64, f64) -> f64) -> Self {
        let cells = 128;
        let step = FLOOR / cells as f64;
        let at = |index: usize| (index as f64 + 0.5) * step;
        let radiosity = |index: usize| {
            let point = DVec3::new(at(index % cells), at(index / cells), 0.0);
            let factor = point_to_polygon(point, DVec3::Z, &LAMP).abs();
            reflectance(point.x, point.y) * factor * PI * LAMP_RADIANCE
        };
        Self {
            cells,
            floor: (0..cells * cells).map(radiosity).collect(),
        }
    }

    fn irradiance(&self, point: DVec3) -> f64 {
        let step = FLOOR / self.cells as f64;
        let at = |index: usize| (index as f64 + 0.5) * step;
        let reflected: f64 = self
            .floor
            .iter()
            .enumerate()
            .map(|(index, radiosity)| {
                let from = DVec3::new(at(index % self.cells), at(index / self.cells), 0.0);
                let separation = from - point;
                let squared = separation.length_squared();
                radiosity * (-separation.y) * point.z / (PI * squared * squared)
            })
            .sum();
        reflected * step * step
    }
}

/// The wall's irradiance is that of a floor of this reflectance; returns the mean over its left and its right half.
fn assert_wall(
    picture: &Texture,
    reflectance: impl Fn(f64, f64) -> f64,
    cases: &[(bool, Direct, [f64; 2])],
) -> [f64; 2] {
    let wall = Wall::new(reflectance);
    // Far enough from the floor for the sum.
    let is_told = |point: DVec3| (point.y - FLOOR).abs() < 1e-3 && (0.25..2.9).contains(&point.z);
    let right = |point: DVec3| is_told(point).then(|| Vec3::splat(wall.irradiance(point) as f32));
    for &(has_speck, direct, most) in cases {
        let scene = painted_floor(picture.clone(), has_speck);
        let shown = solver(&scene, direct).snapshot();
        let found = errors(&scene, &shown, Vec3::NEG_Y, right);
        assert!(
            found[0] < most[0] && found[1] < most[1],
            "{direct:?}, speck {has_speck}: mean and high errors {found:?}"
        );
    }
    [0.5, 3.5].map(|x| wall.irradiance(DVec3::new(x, FLOOR, 0.5)))
}

/// Measured: 0.048 and 0.109, 0.0064 and 0.016, 0.016 and 0.033.
const CASES: [(bool, Direct, [f64; 2]); 3] = [
    (false, Direct::Sampled, [0.07, 0.16]),
    (false, Direct::Linked, [0.0096, 0.024]),
    (true, Direct::Sampled, [0.024, 0.049]),
];

#[test]
fn the_bright_half_of_a_floor_lights_the_wall_beside_it() {
    let half = |x: f64| if x < 0.5 { 0.1 } else { 1.0 };
    let picture = texture(256, 1, |column, _| {
        half((f64::from(column) + 0.5) / 256.0) as f32
    });
    let sides = assert_wall(&picture, |x, _| 0.9 * half(x / FLOOR), &CASES);
    assert!(sides[1] > 2.0 * sides[0], "the halves differ: {sides:?}");
}

#[test]
fn a_floor_of_tiles_reflects_their_mean_in_each_half() {
    // Eight by eight tiles; those on the right are darker.
    let tile = |x: f64, y: f64| {
        let is_even = ((8.0 * x) as u32 + (8.0 * y) as u32).is_multiple_of(2);
        let shade = if is_even { 1.0 } else { 0.25 };
        if x < 0.5 { shade } else { 0.3 * shade }
    };
    let picture = texture(128, 128, |column, row| {
        let [x, y] = [column, 127 - row].map(|index| (f64::from(index) + 0.5) / 128.0);
        tile(x, y) as f32
    });
    let sides = assert_wall(&picture, |x, y| 0.9 * tile(x / FLOOR, y / FLOOR), &CASES);
    assert!(sides[0] > 1.5 * sides[1], "the halves differ: {sides:?}");
}
