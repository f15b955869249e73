use glam::DVec3;

use super::*;
use crate::{
    geometry::point_irradiance,
    scene::{
        Scene,
        builtin::plates,
        test_shapes::{builder, one_sided, rectangle},
    },
    solver::{Direct, SolveSettings, direct::lights::Lights},
};

/// The hierarchy of a scene with its direct light after adaption, for a tolerance.
fn adapted(scene: &Scene, rays: &RayTree, tolerance: f32) -> (Hierarchy, DirectField, f32) {
    let mut hierarchy = Hierarchy::new(scene, 30.0);
    let settings = SolveSettings {
        mesh_tolerance: tolerance,
        ..SolveSettings::normal()
    };
    let limits = Limits::new(&settings, &hierarchy, 1.0, u64::MAX);
    let mut field =
        DirectField::new(Lights::of_emitters(scene, &hierarchy, Direct::Sampled).unwrap());
    let cancel = Cancel::default();
    let found = field.adapt(
        rays,
        &mut hierarchy,
        limits,
        0.0,
        &Surroundings::default(),
        &cancel,
    );
    assert!(found.is_some_and(|(_, fits)| fits));
    let mean = field.mean(&hierarchy);
    (hierarchy, field, mean)
}

/// Irradiance (red) of all emitting patches at a point of a leaf, without occlusion.
fn exact(hierarchy: &Hierarchy, leaf: usize, point: glam::Vec3) -> f32 {
    let normal = hierarchy.patch_of(leaf).normal;
    let emitters =
        (0..hierarchy.patches.len()).filter(|&patch| hierarchy.patches[patch].emission.x > 0.0);
    emitters
        .map(|patch| {
            let part = point_irradiance(point, normal, hierarchy.mesh.corners(patch));
            std::f32::consts::PI * hierarchy.patches[patch].emission.x * part
        })
        .sum()
}

fn receiving(hierarchy: &Hierarchy) -> Vec<usize> {
    let receives = |leaf: &usize| hierarchy.patch_of(*leaf).emission.x == 0.0;
    hierarchy.mesh.active_leaves().filter(receives).collect()
}

#[test]
fn the_interpolation_error_under_a_lamp_is_tolerated() {
    const TOLERANCE: f32 = 2e-3;
    let scene = one_sided(plates(0.5));
    for rays in [RayTree::clear(), RayTree::new(&scene)] {
        let (hierarchy, field, mean) = adapted(&scene, &rays, TOLERANCE);
        let leaves = receiving(&hierarchy);
        assert!(leaves.len() > 20, "{}", leaves.len());
        for leaf in leaves {
            let element = &hierarchy.mesh.elements[leaf];
            let corners = element.vertices.map(|vertex| field.corner(vertex).x);
            let centre = exact(&hierarchy, leaf, element.centroid);
            let error = (centre - corners.iter().sum::<f32>() / 3.0).abs();
            assert!(error * share_root(&hierarchy, leaf) <= 1.1 * TOLERANCE * mean);
        }
    }
}

#[test]
fn the_field_under_a_lamp_is_exact_at_corners() {
    let scene = one_sided(plates(0.5));
    let mut hierarchy = Hierarchy::new(&scene, 30.0);
    for _ in 0..3 {
        let leaves: Vec<u32> = hierarchy.mesh.leaves().map(|leaf| leaf as u32).collect();
        hierarchy.mesh.divide(&leaves);
    }
    let elements = 0..hierarchy.mesh.elements.len();
    for rays in [RayTree::clear(), RayTree::new(&scene)] {
        let mut field =
            DirectField::new(Lights::of_emitters(&scene, &hierarchy, Direct::Sampled).unwrap());
        let cancel = Cancel::default();
        let shot = field.sample_vertices(&rays, &hierarchy, 8, 1, &cancel);
        assert_eq!(shot == Some(0), rays.is_clear());
        let places = field.receivers(&hierarchy, elements.clone(), |_, _| true);
        let receiving = receiving(&hierarchy);
        let mut checked = 0;
        for (vertex, receiver) in places {
            let about = |leaf: &&usize| hierarchy.mesh.elements[**leaf].vertices.contains(&vertex);
            if let Some(&leaf) = receiving.iter().find(about) {
                let expected = exact(&hierarchy, leaf, receiver.point);
                let found = field.corner(vertex).x;
                assert!((found / expected - 1.0).abs() < 1e-4, "{found} {expected}");
                checked += 1;
            }
        }
        assert!(checked > 20, "{checked}");
    }
}

#[test]
fn a_smaller_tolerance_makes_more_elements() {
    let scene = one_sided(plates(0.5));
    let rays = RayTree::clear();
    let counts = [2e-2, 2e-3, 2e-4].map(|tolerance| {
        let (hierarchy, ..) = adapted(&scene, &rays, tolerance);
        hierarchy.mesh.elements.len()
    });
    assert!(counts.is_sorted_by(|a, b| a < b), "{counts:?}");
}

#[test]
fn what_a_wall_hides_is_dark_and_the_border_of_its_shadow_is_divided() {
    let (mut builder, wall, lamp) = builder();
    rectangle(
        &mut builder,
        DVec3::ZERO,
        [DVec3::Z * 4.0, DVec3::X * 4.0],
        wall,
    );
    // A small lamp over the middle, and a sheet over half of the floor.
    let corner = DVec3::new(1.95, 2.0, 1.95);
    rectangle(&mut builder, corner, [DVec3::X * 0.1, DVec3::Z * 0.1], lamp);
    let corner = DVec3::new(2.0, 1.0, -4.0);
    rectangle(
        &mut builder,
        corner,
        [DVec3::Z * 12.0, DVec3::X * 12.0],
        wall,
    );
    let scene = one_sided(builder);
    let rays = RayTree::new(&scene);
    let (hierarchy, field, _) = adapted(&scene, &rays, 2e-3);
    let mut counts = [0, 0];
    for leaf in receiving(&hierarchy) {
        for vertex in hierarchy.mesh.elements[leaf].vertices {
            let at = scene.frame.to_world(hierarchy.mesh.position(vertex));
            // The penumbra of a lamp of 0.1 behind an edge half-way is as wide.
            if at.y.abs() > 1e-3 || (at.x - 2.0).abs() < 0.11 {
                continue;
            }
            let is_lit = at.x < 2.0;
            assert_eq!(field.corner(vertex).x > 0.0, is_lit, "{at}");
            counts[usize::from(is_lit)] += 1;
        }
    }
    assert!(counts.iter().all(|&count| count > 10), "{counts:?}");
    // Elements at the border are smaller than elsewhere.
    let mean_area = |is_border: bool| {
        let leaves = receiving(&hierarchy).into_iter().filter(|&leaf| {
            let at = scene.frame.to_world(hierarchy.mesh.elements[leaf].centroid);
            at.y.abs() < 1e-3 && ((at.x - 2.0).abs() < 0.05) == is_border
        });
        let areas: Vec<f32> = leaves
            .map(|leaf| hierarchy.mesh.elements[leaf].area_vector.length())
            .collect();
        areas.iter().sum::<f32>() / areas.len() as f32
    };
    assert!(mean_area(true) < 0.5 * mean_area(false));
}
