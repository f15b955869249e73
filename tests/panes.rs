//! Light through panes and cut-outs: what passes, what is met, and that all ways to compute it agree.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod boxes;
mod common;

use std::{collections::BTreeMap, f32::consts::PI, sync::Arc};

use boxes::cuboid;
use common::{assert_close, finish, solve};
use glam::{DVec3, Vec2, Vec3};
use vecrad::{
    geometry::RayTree,
    metrics::{MeshLookup, measure_error},
    reference::{JacobiSettings, PathSettings, PathTracer, StochasticJacobi, analytic},
    scene::{
        Cutout, CutoutId, Face, Material, MaterialId, Scene, SceneBuilder, SceneOptions, Sides,
        TriangleId,
    },
    solver::{Direct, SolveSettings},
};

/// A rectangle with a texture that repeats `repeats` times along each side.
fn rectangle(
    builder: &mut SceneBuilder,
    origin: DVec3,
    [u, v]: [DVec3; 2],
    material: MaterialId,
    repeats: f32,
) {
    let corners = [origin, origin + u, origin + u + v, origin + v]
        .map(|corner| builder.push_position(corner));
    let at = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y].map(|at| at * repeats);
    for triangle in [[0, 1, 2], [0, 2, 3]] {
        builder.faces.push(Face {
            corners: triangle.map(|corner: usize| corners[corner]),
            texcoords: Some(triangle.map(|corner: usize| at[corner])),
            normals: None,
            material,
            line: 0,
        });
    }
}

/// A black unit square under a lamp of the same size at height 1, with a large sheet of each of these materials between
/// them.
fn under_sheets(builder: SceneBuilder, sheets: &[Material]) -> Arc<Scene> {
    let mut builder = builder;
    let floor = builder.push_material(Material::plain("floor", Vec3::ZERO, Vec3::ZERO));
    let lamp = builder.push_material(Material::plain("lamp", Vec3::ZERO, Vec3::splat(1.0 / PI)));
    rectangle(&mut builder, DVec3::ZERO, [DVec3::X, DVec3::Y], floor, 1.0);
    rectangle(&mut builder, DVec3::Z, [DVec3::Y, DVec3::X], lamp, 1.0);
    for (number, sheet) in sheets.iter().enumerate() {
        let material = builder.push_material(sheet.clone());
        let origin = DVec3::new(-1.0, -1.0, 0.4 + 0.2 * number as f64);
        let sides = [DVec3::X * 3.0, DVec3::Y * 3.0];
        rectangle(&mut builder, origin, sides, material, 40.0);
    }
    finish(builder, Sides::One)
}

/// A quarter of it is there.
fn leaf(builder: &mut SceneBuilder) -> Material {
    builder
        .cutouts
        .push(Cutout::new("leaf", [8, 8], |column, row| {
            column % 2 == 0 && row % 2 == 0
        }));
    Material {
        cutout: Some(CutoutId(builder.cutouts.len() as u32 - 1)),
        ..Material::plain("leaf", Vec3::ZERO, Vec3::ZERO)
    }
}

fn glass(opacity: f32, filter: Vec3) -> Material {
    Material {
        opacity,
        filter,
        ..Material::plain("glass", Vec3::ZERO, Vec3::ZERO)
    }
}

/// Mean irradiance over the first two triangles.
fn floor_mean(scene: &Arc<Scene>, direct: Direct) -> Vec3 {
    let settings = SolveSettings {
        direct,
        ..SolveSettings::normal()
    };
    let (solver, _) = solve(scene, settings);
    let snapshot = solver.snapshot();
    let (mut sum, mut area) = (Vec3::ZERO, 0.0);
    for (vertices, triangle) in snapshot.mesh.indices.iter().zip(&snapshot.mesh.triangle_of) {
        if *triangle < 2 {
            let [a, b, c] = vertices.map(|vertex| snapshot.mesh.positions[vertex as usize]);
            let part = (b - a).cross(c - a).length();
            let mean = vertices.map(|vertex| snapshot.light.irradiance[vertex as usize]);
            sum += mean.into_iter().sum::<Vec3>() / 3.0 * part;
            area += part;
        }
    }
    sum / area
}

/// The same by the two references.
fn floor_means_of_references(scene: &Arc<Scene>) -> [Vec3; 2] {
    let rays = Arc::new(RayTree::new(scene));
    let settings = JacobiSettings {
        element_count: 100,
        seed: 1,
    };
    let mut jacobi = StochasticJacobi::new(scene.clone(), rays.clone(), settings);
    assert!(jacobi.pass(400_000, &|| false));
    let settings = PathSettings {
        point_count: 20_000,
        samples_per_pass: 32,
        seed: 1,
    };
    let mut tracer = PathTracer::new(scene.clone(), rays, settings);
    assert!(tracer.pass(&|| false));
    let mut points = tracer.result().points;
    points.retain(|point| point.triangle < TriangleId(2));
    let mean = |irradiance: Vec<Vec3>| {
        let count = irradiance.len() as f32;
        irradiance.into_iter().sum::<Vec3>() / count
    };
    let traced = points.iter().map(|point| point.irradiance).collect();
    let shot = jacobi.irradiance(&points).into_iter().flatten().collect();
    [mean(traced), mean(shot)]
}

#[test]
fn a_leaf_of_opacity_a_quarter_lets_three_quarters_pass() {
    let mut builder = SceneBuilder::default();
    let leaf = leaf(&mut builder);
    let scene = under_sheets(builder, &[leaf]);
    assert!((scene.surfaces[4].opacity - 0.25).abs() < 0.01);
    let expected = 0.75 * analytic::parallel_rectangles(1.0, 1.0, 1.0);
    for direct in [Direct::Sampled, Direct::Linked] {
        let found = floor_mean(&scene, direct);
        assert_close(found.y, expected, 0.02, format_args!("{direct:?}"));
    }
    for found in floor_means_of_references(&scene) {
        assert_close(found.y, expected, 0.02, "reference");
    }
}

#[test]
fn coloured_panes_multiply() {
    let filters = [Vec3::new(1.0, 0.5, 0.25), Vec3::new(0.5, 1.0, 0.5)];
    let sheets = filters.map(|filter| glass(0.2, filter));
    let scene = under_sheets(SceneBuilder::default(), &sheets);
    let unoccluded = analytic::parallel_rectangles(1.0, 1.0, 1.0) as f32;
    let expected = unoccluded * 0.64 * filters[0] * filters[1];
    let found = floor_mean(&scene, Direct::Sampled);
    let of_references = floor_means_of_references(&scene);
    for (found, tolerance) in [
        (found, 0.01),
        (of_references[0], 0.02),
        (of_references[1], 0.03),
    ] {
        for (found, expected) in found.to_array().into_iter().zip(expected.to_array()) {
            assert_close(found, expected, tolerance, "by channel");
        }
    }
    let linked = floor_mean(&scene, Direct::Linked);
    for (found, expected) in linked.to_array().into_iter().zip(expected.to_array()) {
        assert_close(found, expected, 0.05, "linked");
    }
    // A material that is opaque, and the same scene with nothing between.
    let options = SceneOptions {
        is_opaque: true,
        sides: Sides::One,
        ..SceneOptions::default()
    };
    let mut builder = SceneBuilder::default();
    builder.push_material(glass(0.2, Vec3::ONE));
    rectangle(
        &mut builder,
        DVec3::ZERO,
        [DVec3::X, DVec3::Y],
        MaterialId(0),
        1.0,
    );
    let solid = builder.finish(&options).unwrap();
    assert!(RayTree::new(&solid).transmittance(Vec3::Z, Vec3::NEG_Z, [None; 2]) == Vec3::ZERO);
    assert!(!RayTree::new(&solid).has_panes() && RayTree::new(&scene).has_coloured_panes());
}

/// A closed room with leaves and a pane in it, all of which emit as much as makes their radiance 1 under an irradiance
/// of π.
fn even_room() -> Arc<Scene> {
    let mut builder = SceneBuilder::default();
    let even = |name: &str, reflectance: f32| {
        Material::plain(
            name,
            Vec3::splat(reflectance),
            Vec3::splat(1.0 - reflectance),
        )
    };
    let wall = builder.push_material(even("wall", 0.5));
    let mut leaf = leaf(&mut builder);
    (leaf.reflectance, leaf.emission) = (Vec3::splat(0.3), Vec3::splat(0.7));
    let leaf = builder.push_material(leaf);
    let pane = builder.push_material(Material {
        opacity: 0.4,
        ..even("pane", 0.6)
    });
    let sides = [DVec3::X, DVec3::Y, DVec3::Z];
    for axis in 0..3 {
        let [u, v] = [sides[(axis + 1) % 3] * 4.0, sides[(axis + 2) % 3] * 4.0];
        rectangle(&mut builder, DVec3::ZERO, [u, v], wall, 1.0);
        rectangle(&mut builder, sides[axis] * 4.0, [v, u], wall, 1.0);
    }
    for (number, tilt) in [0.0, 0.4, -0.3].into_iter().enumerate() {
        let origin = DVec3::new(0.5 + number as f64, 0.7, 1.0 + 0.3 * number as f64);
        let sides = [DVec3::new(0.8, 0.0, tilt), DVec3::new(0.0, 1.5, 0.2)];
        rectangle(&mut builder, origin, sides, leaf, 3.0);
    }
    let sides = [DVec3::X * 3.0, DVec3::new(0.0, 0.5, 2.0)];
    rectangle(&mut builder, DVec3::new(0.5, 2.8, 0.5), sides, pane, 1.0);
    finish(builder, Sides::Auto)
}

#[test]
fn radiance_is_the_same_everywhere_where_all_surfaces_keep_it() {
    let scene = even_room();
    let panes = scene.triangles.iter().skip(12);
    assert!(
        panes
            .clone()
            .all(|face| face.two_sided && !face.bounds_solid)
    );
    for direct in [Direct::Sampled, Direct::Linked] {
        let settings = SolveSettings {
            direct,
            ..SolveSettings::normal()
        };
        let (solver, _) = solve(&scene, settings);
        let snapshot = solver.snapshot();
        let (mesh, light) = (&snapshot.mesh, &snapshot.light);
        // Area-weighted means by material and side; single vertices of leaves are noisy.
        let mut sums: BTreeMap<(MaterialId, bool), (f32, f32)> = BTreeMap::new();
        for (index, vertices) in mesh.indices.iter().enumerate() {
            let vertices = vertices.map(|vertex| vertex as usize);
            let [a, b, c] = vertices.map(|vertex| mesh.positions[vertex]);
            let area = (b - a).cross(c - a).length();
            let radiance = vertices.map(|vertex| {
                let reflected = mesh.reflectance[vertex] * light.irradiance[vertex] / PI;
                (mesh.emission[vertex] + reflected).y
            });
            let material = scene.triangles[mesh.triangle_of[index] as usize].material;
            let sum = sums.entry((material, mesh.is_back[index])).or_default();
            sum.0 += radiance.into_iter().sum::<f32>() / 3.0 * area;
            sum.1 += area;
        }
        assert_eq!(
            sums.len(),
            5,
            "walls from inside, both sides of leaves and panes"
        );
        for (side, (sum, area)) in sums {
            assert_close(sum / area, 1.0, 0.01, format_args!("{direct:?} {side:?}"));
        }
    }
}

/// Solve, and compare with path tracing: the ratio of energies and the trimmed error are within these tolerances.
fn assert_agrees(scene: &Arc<Scene>, [energy, trimmed]: [f64; 2]) {
    let (solver, _) = solve(scene, SolveSettings::normal());
    let settings = PathSettings {
        point_count: 2000,
        samples_per_pass: 256,
        seed: 3,
    };
    let rays = Arc::new(RayTree::new(scene));
    let mut tracer = PathTracer::new(scene.clone(), rays, settings);
    assert!(tracer.pass(&|| false));
    let snapshot = solver.snapshot();
    let lookup = MeshLookup::new(scene, &snapshot.mesh);
    let points = tracer.result().points;
    let measured = lookup.radiance(&snapshot.light, &points);
    let error = measure_error(&measured, &points).unwrap();
    let ratio = error.energy_ratio.unwrap();
    assert!((ratio - 1.0).abs() < energy, "{error:?}");
    assert!(error.relative_rms_trimmed < trimmed, "{error:?}");
}

#[test]
fn light_among_leaves_agrees_with_path_tracing() {
    let mut builder = SceneBuilder::default();
    let wall = builder.push_material(Material::plain("wall", Vec3::splat(0.6), Vec3::ZERO));
    let lamp = builder.push_material(Material::plain("lamp", Vec3::ZERO, Vec3::splat(5.0)));
    let mut green = leaf(&mut builder);
    green.reflectance = Vec3::new(0.2, 0.6, 0.1);
    let green = builder.push_material(green);
    let mut red = glass(0.3, Vec3::new(1.0, 0.4, 0.3));
    red.reflectance = Vec3::splat(0.3);
    let red = builder.push_material(red);
    cuboid(&mut builder, DVec3::ZERO, DVec3::splat(4.0), true, wall);
    let lamp_sides = [DVec3::Y, DVec3::X];
    rectangle(
        &mut builder,
        DVec3::new(0.5, 1.5, 3.9),
        lamp_sides,
        lamp,
        1.0,
    );
    for number in 0..8 {
        let angle = f64::from(number);
        let origin = DVec3::new(
            0.4 + 0.25 * angle,
            1.0 + angle.sin(),
            1.5 + 0.5 * angle.cos(),
        );
        let sides = [
            DVec3::new(0.7 * angle.cos(), 0.7 * angle.sin(), 0.3),
            DVec3::new(-0.7 * angle.sin(), 0.7 * angle.cos(), 0.2),
        ];
        rectangle(&mut builder, origin, sides, green, 1.0);
    }
    rectangle(
        &mut builder,
        DVec3::new(2.9, 0.0, 0.0),
        [DVec3::Y * 4.0, DVec3::Z * 4.0],
        red,
        1.0,
    );
    assert_agrees(&finish(builder, Sides::Auto), [0.02, 0.05]);
}

/// Rays through both walls of a coloured box have tints that add to more than 1: they must not fill more than the whole
/// hemisphere.
#[test]
fn a_coloured_box_in_a_closed_room_takes_what_it_absorbs_and_no_more() {
    for filter in [Vec3::new(0.9, 0.4, 0.4), Vec3::new(1.0, 0.02, 0.02)] {
        let mut builder = SceneBuilder::default();
        let wall = builder.push_material(Material::plain("wall", Vec3::splat(0.6), Vec3::ZERO));
        let lamp = builder.push_material(Material::plain("lamp", Vec3::ZERO, Vec3::splat(5.0)));
        let coloured = builder.push_material(glass(0.0, filter));
        cuboid(&mut builder, DVec3::ZERO, DVec3::splat(4.0), true, wall);
        let lamp_sides = [DVec3::Y, DVec3::X];
        rectangle(
            &mut builder,
            DVec3::new(1.5, 1.5, 3.9),
            lamp_sides,
            lamp,
            1.0,
        );
        let low = DVec3::new(1.2, 1.2, 0.4);
        cuboid(&mut builder, low, low + 1.0, false, coloured);
        assert_agrees(&finish(builder, Sides::Auto), [0.02, 0.05]);
    }
}
