use std::sync::Arc;

use glam::{DVec3, Vec4};

use super::*;
use crate::{
    scene::{
        SceneOptions,
        builtin::find_builtin,
        test_shapes::{builder, cuboid, one_sided, rectangle},
    },
    solver::{SolveSettings, Solver, schedule::is_coarse},
};

#[test]
fn coarse_steps_shoot_a_share_of_the_rays_and_fine_ones_probe_the_same_cells_again() {
    let scene = find_builtin("room-1022").unwrap().builder();
    let scene = Arc::new(scene.finish(&SceneOptions::default()).unwrap());
    let cancel = Cancel::default();
    let mut solver = Solver::new(scene, SolveSettings::normal(), None, &cancel).unwrap();
    let cells = solver.hierarchy().mesh.elements.len();
    let mut probed = Vec::new();
    for threshold_scale in [16.0, 8.0, 4.0, 2.0, 1.0] {
        let before = solver.ray_count;
        solver
            .probe_coverage(is_coarse(threshold_scale), &cancel)
            .unwrap();
        assert!(solver.coverage.serve(is_coarse(threshold_scale)));
        assert_eq!(solver.coverage.count(), cells);
        probed.push(solver.ray_count - before);
        // Elements made by later divisions are not cells.
        let leaf = solver.hierarchy.mesh.leaves().next().unwrap();
        solver.hierarchy.mesh.divide(&[leaf as u32]);
    }
    let [rough, _, _, all, _] = probed[..] else {
        panic!("five steps");
    };
    assert!(rough > 0 && 3 * rough < all, "{probed:?}");
    assert_eq!(probed[1..3], [0, 0]);
    assert_eq!(probed[4], 0);
}

/// Area-weighted mean of the coverage over the patches of a scene, by the axis of their normal, and all coverages.
fn probed(scene: &Scene) -> ([f32; 3], Vec<HemisphereCoverage>) {
    let hierarchy = Hierarchy::new(scene, 30.0);
    let (rays, known) = (RayTree::new(scene), CoverageMap::default());
    let cancel = Cancel::default();
    let found = probe(scene, &hierarchy, &rays, &known, false, 1, &cancel).unwrap();
    assert!(found.within.is_empty() && found.ray_count > 0);
    let cells: Vec<HemisphereCoverage> = (0..hierarchy.patches.len())
        .map(|patch| found.coverage.of(&hierarchy, patch))
        .collect();
    let means = [0, 1, 2].map(|axis| {
        let patches = hierarchy.patches.iter().zip(&cells);
        let of_axis = patches.filter(|(patch, _)| patch.normal[axis].abs() > 0.9);
        let sums = of_axis.fold((0.0, 0.0), |(sum, area), (patch, cell)| {
            (sum + cell.share * patch.area, area + patch.area)
        });
        sums.0 / sums.1
    });
    (means, cells)
}

#[test]
fn all_cells_of_a_box_are_enclosed() {
    let (mut builder, wall, _) = builder();
    cuboid(
        &mut builder,
        [DVec3::ZERO, DVec3::ONE],
        true,
        |_| true,
        wall,
    );
    let (_, cells) = probed(&one_sided(builder));
    assert!(
        cells
            .iter()
            .all(|cell| *cell == HemisphereCoverage::ENCLOSED)
    );
}

#[test]
fn a_cube_without_lid_lacks_the_form_factor_of_the_lid() {
    let (mut builder, wall, _) = builder();
    cuboid(
        &mut builder,
        [DVec3::ZERO, DVec3::ONE],
        true,
        |side| side != 3,
        wall,
    );
    let (means, _) = probed(&one_sided(builder));
    // Opposite and adjacent unit squares.
    for (mean, lid) in means.into_iter().zip([0.200044, 0.199825, 0.200044]) {
        assert!((mean - (1.0 - lid)).abs() < 0.01, "{mean}");
    }
}

#[test]
fn a_single_face_sees_nothing() {
    let (mut builder, wall, _) = builder();
    rectangle(&mut builder, DVec3::ZERO, [DVec3::Z, DVec3::X], wall);
    let (means, _) = probed(&one_sided(builder));
    assert!(means[1] < 1e-2, "{means:?}");
}

#[test]
fn small_elements_under_a_box_count_as_inside_it_once_their_rays_tell_so() {
    const SIDE: usize = 24;
    let (mut faces, wall, lamp) = builder();
    let width = 4.0 / SIDE as f64;
    for cell in 0..SIDE * SIDE {
        let corner = DVec3::new((cell % SIDE) as f64, 0.0, (cell / SIDE) as f64) * width;
        rectangle(
            &mut faces,
            corner,
            [DVec3::Z * width, DVec3::X * width],
            wall,
        );
    }
    let ends = [DVec3::new(1.05, 0.0, 1.05), DVec3::new(2.55, 1.0, 2.55)];
    cuboid(&mut faces, ends, false, |_| true, wall);
    let edges = [DVec3::X, DVec3::Z];
    rectangle(&mut faces, DVec3::new(1.5, 3.0, 1.5), edges, lamp);
    let scene = Arc::new(one_sided(faces));
    let cancel = Cancel::default();
    let mut solver = Solver::new(scene.clone(), SolveSettings::draft(), None, &cancel).unwrap();
    solver.probe_coverage(false, &cancel).unwrap();
    let mut inside = 0;
    for leaf in solver.hierarchy.mesh.active_leaves() {
        let at = scene
            .frame
            .to_world(solver.hierarchy.mesh.elements[leaf].centroid);
        let is_under = at.y < 1e-3 && [at.x, at.z].iter().all(|at| (1.25..2.35).contains(at));
        if is_under {
            inside += 1;
            let coverage = solver.coverage.of(&solver.hierarchy, leaf);
            assert_eq!(coverage, HemisphereCoverage::INSIDE_SOLID, "{at}");
        }
    }
    assert!(inside > 30, "{inside}");
}

#[test]
fn tints_of_more_than_one_fill_no_more_than_a_hemisphere() {
    let all = Met {
        hits: 30.0,
        tinted: 40.0,
        blocked: 44.0,
        rays: 31.0,
        within: 0.0,
    };
    let coverage = all.coverage(all, 1);
    assert!(coverage.share > 0.9 && coverage.share < 1.0, "{coverage:?}");
    let factor = coverage.factor_for(Vec4::new(0.5, 0.5, 0.5, 0.8), (1.0, 0.8));
    assert!(factor.is_finite() && factor > 0.0, "{factor}");
    let mut pooled_coverage = Vec::new();
    pooled(&[all; 64], Met::default(), 1, &mut pooled_coverage);
    assert!(!pooled_coverage.contains(&HemisphereCoverage::ENCLOSED));
}
