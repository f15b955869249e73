//! Equations 1 to 15 of the paper, for clusters small enough to compute by hand.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::f32::consts::PI;

use common::assert_close;
use glam::{DVec3, Vec3, Vec4};
use vecrad::{
    hierarchy::{Hierarchy, NodeId, Reading, Tables},
    scene::{Material, SceneBuilder, SceneOptions, Sides},
    transport::Kernel,
};

/// A hierarchy of one right triangle with the given corner and legs, radiosity 1.
fn one_patch(corner: DVec3, legs: [DVec3; 2]) -> (Hierarchy, Tables) {
    let mut builder = SceneBuilder::default();
    let material = builder.push_material(Material::plain("grey", Vec3::splat(0.5), Vec3::ONE));
    let corners =
        [corner, corner + legs[0], corner + legs[1]].map(|point| builder.push_position(point));
    builder.push_triangle(corners, material);
    let scene = builder
        .finish(&SceneOptions::with_sides(Sides::One))
        .unwrap();
    let hierarchy = Hierarchy::new(&scene, 30.0);
    let tables = Tables::new(&hierarchy, |_| Vec4::ONE);
    (hierarchy, tables)
}

fn kernel<'a>(hierarchy: &'a Hierarchy, tables: &'a Tables, reading: Reading) -> Kernel<'a> {
    Kernel {
        hierarchy,
        tables,
        reading: Some(reading),
        image: None,
    }
}

#[test]
fn axis_aligned_clusters_of_one_patch_transfer_what_equation_1_says() {
    // Normals +x and −x, so that the six faces (eq. 11) are exact.
    let (source, sent) = one_patch(DVec3::ZERO, [DVec3::Y, DVec3::Z]);
    let (receiver, shown) = one_patch(DVec3::ZERO, [DVec3::Z, DVec3::Y]);
    let root = Hierarchy::ROOT;
    for separation in [
        Vec3::new(700.0, 0.0, 0.0),
        Vec3::new(500.0, 300.0, -200.0),
        Vec3::new(-500.0, 0.0, 0.0),
    ] {
        let unit = separation.normalize_or_zero();
        let squared = separation.length_squared();
        let power = kernel(&source, &sent, Reading::SixFace)
            .projected_power(root, unit)
            .x;
        let area = kernel(&receiver, &shown, Reading::SixFace)
            .projected_power(root, -unit)
            .w;
        let transferred = power * area / (PI * squared);
        let (from, to) = (
            source.patches[0].area_vector,
            receiver.patches[0].area_vector,
        );
        let exact = from.dot(separation).max(0.0) * (-to.dot(separation)).max(0.0)
            / (PI * squared * squared);
        assert!(
            (transferred - exact).abs() <= 1e-5 * exact,
            "{separation}: {transferred} {exact}"
        );
    }
}

#[test]
fn vector_irradiance_pushed_to_a_face_is_equation_12_per_area() {
    let (source, sent) = one_patch(DVec3::ZERO, [DVec3::Y, DVec3::Z]);
    let kernel = kernel(&source, &sent, Reading::SixFace);
    let point = source.centroid(Hierarchy::ROOT) + Vec3::new(900.0, 300.0, 100.0);
    let separation = point - source.centroid(Hierarchy::ROOT);
    let normal = Vec3::new(-0.8, -0.6, 0.0);
    let squared = separation.length_squared();
    let exact = source.patches[0].area_vector.dot(separation) * -normal.dot(separation)
        / (PI * squared * squared);
    for node in [Hierarchy::ROOT, NodeId(1)] {
        let found = kernel.vector_irradiance(node, point).on_face(normal).x;
        // At 900 units the cluster of 71 units saturates by its own form factor, about 0.001.
        assert_close(found, exact, 5e-3, format_args!("{node:?}"));
    }
}
