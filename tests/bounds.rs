//! The interval of a link holds what brute force finds, and the sum over a receiver's links holds its error.

mod common;
mod truth_scenes;

use std::sync::Arc;

use common::solve;
use glam::{DVec3, Vec3, Vec4};
use vecrad::{
    geometry::{Random, RayTree, point_irradiance, triangle_point},
    hierarchy::{ElementId, Hierarchy, Kind, NodeId, Reading, Tables},
    reference::{MatrixSettings, solve_matrix},
    scene::{Material, Scene, SceneBuilder, SceneOptions, Sides, Specular},
    solver::{Direct, SolveSettings, Subject},
    transport::{Estimate, Judge, Judgement, Kernel, PairSampler, PatchSums, luminance},
};

/// Random triangles in a unit cube, gathered in clumps so that clusters differ, and a mirror that stands askew beside them.
fn clumps(seed: u64) -> Scene {
    let mut random = Random::new(seed, 0);
    let mut builder = SceneBuilder::default();
    let material = builder.push_material(Material::plain("", Vec3::splat(0.5), Vec3::ZERO));
    let mut point = |scale: f32, about: DVec3| {
        let [x, y, z] = [(); 3].map(|()| f64::from((random.uniform() - 0.5) * scale));
        about + DVec3::new(x, y, z)
    };
    for _ in 0..12 {
        let clump = point(1.0, DVec3::ZERO);
        for _ in 0..8 {
            let about = point(0.15, clump);
            let corners = [(); 3].map(|()| builder.push_position(point(0.1, about)));
            builder.push_triangle(corners, material);
        }
    }
    let mirror = builder.push_material(Material {
        specular: Some(Specular::Mirror {
            reflectance: Vec3::splat(0.5),
        }),
        ..Material::plain("mirror", Vec3::ZERO, Vec3::ZERO)
    });
    let corners = [[0.9, -1.0, -1.0], [0.7, 1.0, -1.0], [1.1, 0.0, 1.2]];
    let corners = corners.map(|corner| builder.push_position(DVec3::from_array(corner)));
    builder.push_triangle(corners, mirror);
    builder
        .finish(&SceneOptions::with_sides(Sides::Two))
        .expect("the triangles are usable")
}

/// Unoccluded irradiance (luminance) of a face, patch by patch in closed form.
fn brute_force(
    hierarchy: &Hierarchy,
    tables: &Tables,
    source: NodeId,
    point: Vec3,
    normal: Vec3,
) -> f32 {
    let range = match hierarchy.kind(source) {
        Kind::Cluster(index) => hierarchy.clusters[index].patches(),
        Kind::Element(index) => index..index + 1,
    };
    range
        .map(|patch| {
            luminance(tables.elements[patch])
                * point_irradiance(point, normal, hierarchy.mesh.corners(patch))
        })
        .sum()
}

#[test]
fn the_interval_of_a_link_holds_what_brute_force_finds() {
    for is_mirrored in [false, true] {
        let checked: usize = (0..6).map(|seed| checked_pairs(seed, is_mirrored)).sum();
        assert!(checked > 10_000, "only {checked} pairs were checked");
    }
}

/// Check pairs of a scene, as they are or as a mirror shows them. Returns how many exchange light.
fn checked_pairs(seed: u64, is_mirrored: bool) -> usize {
    let mut checked = 0;
    let scene = clumps(seed);
    let (rays, hierarchy) = (RayTree::new(&scene), Hierarchy::new(&scene, 30.0));
    let image = rays.mirrors().expect("there is one").images()[0].clone();
    let image = is_mirrored.then_some(&*image);
    let seen_at = |point: Vec3| image.map_or(point, |image| image.place(point));
    let source_of = |point: Vec3| image.map_or(point, |image| image.source_of(point));
    let turned = |normal: Vec3| image.map_or(normal, |image| image.source_direction(normal));
    let mut random = Random::new(seed, 1);
    let radiosities: Vec<f32> = hierarchy.patches.iter().map(|_| random.uniform()).collect();
    let tables = Tables::new(&hierarchy, |leaf| {
        (Vec3::splat(radiosities[leaf].powi(4))).extend(1.0)
    });
    let areas = PatchSums::of_area(&hierarchy, &tables);
    let powers = PatchSums::of_power(&hierarchy, &tables);
    let kernel = Kernel {
        hierarchy: &hierarchy,
        tables: &tables,
        reading: Some(Reading::Bounded),
        image,
    };
    let judge = Judge {
        ambient: 0.0,
        kernel,
        estimate: Estimate::Interval,
        sampler: PairSampler {
            hierarchy: &hierarchy,
            tables: &tables,
            areas: &areas,
            powers: &powers,
            rays: &rays,
            image,
        },
    };
    for _ in 0..20_000 {
        let [source, receiver] =
            [(); 2].map(|()| NodeId(random.below(hierarchy.node_count() as u32)));
        let Judgement::Transfer { bound, .. } = judge.judge(source, receiver, &mut random) else {
            continue;
        };
        let reach = hierarchy.radius(source) + hierarchy.radius(receiver);
        let distance = seen_at(hierarchy.centroid(source)).distance(hierarchy.centroid(receiver));
        if distance <= reach {
            continue;
        }
        let patch = match hierarchy.kind(receiver) {
            Kind::Cluster(index) => {
                let range = hierarchy.clusters[index].patches();
                range.start + random.below(range.len() as u32) as usize
            }
            Kind::Element(index) => index,
        };
        let place = triangle_point(random.uniform_2d());
        let [a, b, c] = hierarchy.mesh.corners(patch);
        let point = a * place.x + b * place.y + c * place.z;
        let normal = hierarchy.patches[patch].normal;
        let pushed: Vec4 = kernel
            .vector_irradiance(source, hierarchy.centroid(receiver))
            .on_face(normal);
        let (point, facing) = (source_of(point), turned(normal));
        let truth = brute_force(&hierarchy, &tables, source, point, facing);
        let difference = (luminance(pushed) - truth).abs();
        assert!(
            difference <= bound * 1.001 + 1e-6,
            "seed {seed}, {source:?} to {receiver:?}: off by {difference}, bound {bound}"
        );
        checked += 1;
    }
    checked
}

/// Of the walls of the room.
const LARGEST_REFLECTANCE: f32 = 0.7;

#[test]
fn the_bound_of_a_receiver_holds_its_error_against_the_full_matrix() {
    let mut plates = truth_scenes::Plates::default();
    let walls: Vec<_> = (0..6)
        .map(|wall| {
            plates.material(
                LARGEST_REFLECTANCE - 0.1 * wall as f32,
                f32::from(wall == 3),
            )
        })
        .collect();
    plates.room(3, walls.try_into().expect("there are six"));
    let scene = Arc::new(plates.finish(Sides::One));
    let truth = solve_matrix(
        &scene,
        &RayTree::new(&scene),
        &MatrixSettings::default(),
        &truth_scenes::never,
    )
    .expect("the matrix is small");
    let settings = SolveSettings {
        direct: Direct::Linked,
        epsilon: 0.05,
        max_steps: 2,
        ..SolveSettings::draft()
    };
    let solver = solve(&scene, settings).0;
    let (snapshot, hierarchy) = (solver.snapshot(), solver.hierarchy());
    // The bound is that of one bounce; what sources are wrong by is reflected on.
    let most = |values: &[f32]| values.iter().copied().fold(0.0, f32::max);
    let bound_of = |leaf: usize| {
        let subject = Subject::Element {
            node: hierarchy.element_node(ElementId(leaf as u32)),
            point: hierarchy.mesh.elements[leaf].centroid,
        };
        solver.inspect(&subject).expect("it exists").error_bound
    };
    let bounds: Vec<f32> = hierarchy.mesh.active_leaves().map(bound_of).collect();
    let bound = most(&bounds) / (1.0 - LARGEST_REFLECTANCE);
    let mut sums = vec![(0.0f32, 0.0f32); scene.triangles.len()];
    for (corners, &triangle) in snapshot.mesh.indices.iter().zip(&snapshot.mesh.triangle_of) {
        let [a, b, c] = corners.map(|vertex| snapshot.mesh.positions[vertex as usize]);
        let area = (b - a).cross(c - a).length();
        let mean = corners.map(|vertex| snapshot.light.irradiance[vertex as usize]);
        let sum = &mut sums[triangle as usize];
        sum.0 += area * luminance(((mean[0] + mean[1] + mean[2]) / 3.0).extend(0.0));
        sum.1 += area;
    }
    let errors: Vec<f32> = truth
        .patches
        .iter()
        .zip(sums)
        .map(|(patch, (sum, area))| (sum / area - luminance(patch.irradiance.extend(0.0))).abs())
        .collect();
    assert!(most(&errors) <= bound, "{} above {bound}", most(&errors));
    assert!(most(&errors) > 0.0, "links so coarse cannot be exact");
}
