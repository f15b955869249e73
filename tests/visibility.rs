//! Rays tell how much of a source's light gets through from how much of its area does.

use glam::{DVec3, Vec3};
use vecrad::{
    geometry::{Random, RayTree},
    hierarchy::{ElementId, Hierarchy, NodeId, Tables},
    scene::{Material, Scene, SceneBuilder, SceneOptions, Sides},
    transport::{PairSampler, PatchSums},
};

/// Two squares side by side, seen by a small face high above them; a sheet hides the right one from it.
fn half_hidden() -> Scene {
    let mut builder = SceneBuilder::default();
    let material = builder.push_material(Material::plain("", Vec3::splat(0.5), Vec3::ZERO));
    let mut square = |low: [f64; 2], high: [f64; 2], z: f64, looks_up: bool| {
        let middle = DVec3::new((low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0, z);
        let corners = [
            [low[0], low[1]],
            [high[0], low[1]],
            [high[0], high[1]],
            [low[0], high[1]],
        ]
        .map(|[x, y]| DVec3::new(x, y, z));
        for index in 0..4 {
            let (a, b) = (corners[index], corners[(index + 1) % 4]);
            let around = if looks_up {
                [a, b, middle]
            } else {
                [b, a, middle]
            };
            let vertices = around.map(|corner| builder.push_position(corner));
            builder.push_triangle(vertices, material);
        }
    };
    square([-2.0, -0.5], [-1.0, 0.5], 0.0, true);
    square([1.0, -0.5], [2.0, 0.5], 0.0, true);
    square([0.3, -1.0], [1.2, 1.0], 5.0, true);
    square([-0.05, -0.05], [0.05, 0.05], 10.0, false);
    builder
        .finish(&SceneOptions::with_sides(Sides::One))
        .expect("the squares are usable")
}

/// Visible parts of the light and of the area of both squares, whose radiosity is given by whether they are the left one:
/// the mean of some estimates by so many rays each.
fn visible(radiosity: impl Fn(bool) -> f32 + Sync, estimates: u32, rays_each: u32) -> (f32, f32) {
    let scene = half_hidden();
    let (rays, hierarchy) = (RayTree::new(&scene), Hierarchy::new(&scene, 30.0));
    let centroid = |element: usize| hierarchy.mesh.elements[element].centroid;
    let tables = Tables::new(&hierarchy, |leaf| {
        Vec3::splat(radiosity(centroid(leaf).x < 0.0)).extend(1.0)
    });
    let (bottom, top) = hierarchy.bounds(Hierarchy::ROOT);
    let lowest = |element: usize| centroid(element).z < bottom.lerp(top, 0.25).z;
    let source = (0..hierarchy.clusters.len())
        .find(|&index| {
            let mut patches = hierarchy.clusters[index].patches();
            patches.len() == 8 && patches.all(lowest)
        })
        .expect("both squares are a cluster");
    let receiver = (0..hierarchy.patches.len())
        .find(|&patch| hierarchy.patches[patch].normal.z < 0.0)
        .expect("one face looks down");
    let receiver = hierarchy.element_node(ElementId(receiver as u32));
    let (areas, powers) = (
        PatchSums::of_area(&hierarchy, &tables),
        PatchSums::of_power(&hierarchy, &tables),
    );
    let sampler = PairSampler {
        hierarchy: &hierarchy,
        tables: &tables,
        areas: &areas,
        powers: &powers,
        rays: &rays,
        image: None,
    };
    let source = NodeId(source as u32);
    let sums = (0..estimates).fold((0.0, 0.0), |(light, area), estimate| {
        let mut random = Random::new(1, u64::from(estimate));
        let found = sampler.visibility(source, receiver, rays_each, &mut random);
        (light + found.0, area + found.1)
    });
    (sums.0 / estimates as f32, sums.1 / estimates as f32)
}

#[test]
fn light_and_area_are_told_apart() {
    for (left, right, expected) in [
        (1.0, 1.0, 0.5),
        (1.0, 0.0, 1.0),
        (0.0, 1.0, 0.0),
        (3.0, 1.0, 0.75),
    ] {
        let (light, area) = visible(|is_left| if is_left { left } else { right }, 1, 4000);
        assert!(
            (light - expected).abs() < 0.03,
            "{left} {right}: light {light}"
        );
        assert!((area - 0.5).abs() < 0.03, "{left} {right}: area {area}");
    }
    // Where nothing shines there is no light to tell: the area stands for it.
    let (light, area) = visible(|_| 0.0, 1, 4000);
    assert!((area - 0.5).abs() < 0.03 && light == area, "{light} {area}");
}

#[test]
fn two_rays_are_right_on_average() {
    // The ratio of what two rays stand for would be 0.69 on average.
    let (light, area) = visible(|is_left| if is_left { 3.0 } else { 1.0 }, 4000, 2);
    assert!((light - 0.75).abs() < 0.025, "light {light}");
    assert!((area - 0.5).abs() < 0.025, "area {area}");
}

#[test]
fn rays_along_an_axis_meet_a_face_across_it_whatever_the_sign_of_zero() {
    let mut builder = SceneBuilder::default();
    let material = builder.push_material(Material::plain("", Vec3::splat(0.5), Vec3::ZERO));
    for axis in 0..3 {
        let [u, v] = [1, 2].map(|next| {
            let mut side = DVec3::ZERO;
            side[(axis + next) % 3] = 2.0;
            side
        });
        let mut corner = DVec3::ONE;
        for _ in 0..2 {
            let corners = [corner, corner - u, corner - u - v, corner - v];
            let corners = corners.map(|at| builder.push_position(at));
            let [a, b, c, d] = corners;
            builder.push_triangle([a, b, c], material);
            builder.push_triangle([a, c, d], material);
            corner[axis] = -1.0;
        }
    }
    let scene = builder
        .finish(&SceneOptions::with_sides(Sides::Two))
        .expect("the box is usable");
    let rays = RayTree::new(&scene);
    let half_extent = scene.corners(scene.triangle_ids().next().expect("a face"))[0]
        .abs()
        .max_element();
    let origin = half_extent * Vec3::new(0.1, 0.23, -0.37);
    for (axis, sign, zero) in (0..3).flat_map(|axis| {
        [1.0f32, -1.0]
            .into_iter()
            .flat_map(move |sign| [0.0f32, -0.0].map(|zero| (axis, sign, zero)))
    }) {
        let mut direction = Vec3::splat(zero);
        direction[axis] = sign;
        let hit = rays.closest(origin, direction, None);
        let expected = half_extent - sign * origin[axis];
        let distance = hit.expect("the box is closed").distance;
        assert!((distance / expected - 1.0).abs() < 1e-4, "{direction}");
        assert_eq!(
            rays.transmittance_outward(origin, direction, None),
            Vec3::ZERO
        );
    }
}
