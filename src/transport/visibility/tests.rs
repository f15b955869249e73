use glam::DVec3;

use super::*;
use crate::{
    hierarchy::ElementId,
    scene::{
        Scene, SceneBuilder,
        builtin::plates,
        test_shapes::{builder, cuboid, one_sided, rectangle},
    },
};

/// Form factor between unit squares at distance 1.
const PLATES: f32 = 0.199825;

fn sampled<T>(scene: &Scene, rays: &RayTree, of: impl Fn(&PairSampler<'_>) -> T) -> T {
    let hierarchy = Hierarchy::new(scene, 30.0);
    let tables = Tables::new(&hierarchy, |_| Vec4::ONE);
    let areas = PatchSums::of_area(&hierarchy, &tables);
    let powers = PatchSums::of_power(&hierarchy, &tables);
    of(&PairSampler {
        hierarchy: &hierarchy,
        tables: &tables,
        areas: &areas,
        powers: &powers,
        rays,
        image: None,
    })
}

/// Nodes of the patches that face up and of those that face down.
fn up_and_down(hierarchy: &Hierarchy) -> [Vec<NodeId>; 2] {
    [1.0, -1.0].map(|sign| {
        let patches = 0..hierarchy.patches.len();
        let facing = patches.filter(|&patch| hierarchy.patches[patch].normal.y * sign > 0.9);
        facing
            .map(|patch| hierarchy.element_node(ElementId(patch as u32)))
            .collect()
    })
}

#[test]
fn an_unoccluded_pair_is_fully_visible() {
    let scene = one_sided(plates(1.0));
    for rays in [RayTree::clear(), RayTree::new(&scene)] {
        sampled(&scene, &rays, |sampler| {
            let [up, down] = up_and_down(sampler.hierarchy);
            for seed in 0..20 {
                let mut random = Random::new(seed, 0);
                let found = sampler.visibility(down[0], up[0], 8, &mut random);
                assert_eq!(found, (1.0, 1.0));
            }
        });
    }
}

#[test]
fn a_wall_between_two_plates_hides_one_from_the_other() {
    let mut builder = plates(1.0);
    let paint = builder.push_material(builder.materials[0].clone());
    let edges = [DVec3::Z * 3.0, DVec3::X * 3.0];
    rectangle(&mut builder, DVec3::new(-1.0, 0.5, -1.0), edges, paint);
    let scene = one_sided(builder);
    let rays = RayTree::new(&scene);
    sampled(&scene, &rays, |sampler| {
        let [up, down] = up_and_down(sampler.hierarchy);
        let lowest = |node: &&NodeId| sampler.hierarchy.centroid(**node).y;
        let floor = up.iter().min_by(|a, b| lowest(a).total_cmp(&lowest(b)));
        let mut random = Random::new(1, 0);
        let found = sampler.visibility(down[0], *floor.unwrap(), 8, &mut random);
        assert_eq!(found, (0.0, 0.0));
    });
}

#[test]
fn rays_and_exact_sums_find_the_form_factor_of_parallel_plates() {
    let scene = one_sided(plates(1.0));
    for rays in [RayTree::clear(), RayTree::new(&scene)] {
        let form_factor = sampled(&scene, &rays, |sampler| {
            let [up, down] = up_and_down(sampler.hierarchy);
            let mut random = Random::new(1, 0);
            let pairs = up
                .iter()
                .flat_map(|&to| down.iter().map(move |&from| (from, to)));
            let sum: f32 = pairs
                .map(|(from, to)| {
                    let estimates =
                        (0..500).map(|_| sampler.seen_fraction(from, to, 16, &mut random));
                    estimates.sum::<f32>() / 500.0
                })
                .sum();
            sum / up.len() as f32
        });
        assert!((form_factor - PLATES).abs() < 0.01, "{form_factor}");
    }
}

#[test]
fn a_box_sees_itself_inside_and_not_outside() {
    for (is_inward, expected) in [(true, 1.0), (false, 0.0)] {
        let (mut builder, wall, _): (SceneBuilder, _, _) = builder();
        cuboid(
            &mut builder,
            [DVec3::ZERO, DVec3::ONE],
            is_inward,
            |_| true,
            wall,
        );
        let scene = one_sided(builder);
        let rays = RayTree::new(&scene);
        let found = sampled(&scene, &rays, |sampler| {
            sampler.seen_fraction(Hierarchy::ROOT, Hierarchy::ROOT, 64, &mut Random::new(1, 0))
        });
        assert_eq!(found, expected);
    }
}
