use std::sync::Arc;

use super::*;
use crate::{
    scene::{builtin::furnace, test_shapes::one_sided},
    solver::{Keep, SolveSettings, Solver},
};

/// A solved furnace, whose rays are shot though nothing occludes.
fn solved() -> Solver {
    let scene = Arc::new(one_sided(furnace(0.5, 1.0, 2)));
    let settings = SolveSettings {
        keep: Keep::ALL,
        tolerance: 1e-5,
        ..SolveSettings::draft()
    };
    let mut solver = Solver::new(scene, settings, None, &Cancel::default()).unwrap();
    while !solver.step(&Cancel::default()).unwrap().is_final {}
    solver
}

/// Gather with the linked light of the leaves times a factor.
fn gathered(solver: &Solver, factor: f32) -> GatherFactors {
    let hierarchy = solver.hierarchy();
    let leaves: Vec<LeafLight> = solver
        .leaves
        .iter()
        .map(|leaf| LeafLight {
            corners: leaf.corners.map(|light| light * factor),
            centre: leaf.centre * factor,
            ..*leaf
        })
        .collect();
    let gather = FinalGather {
        surfaces: solver.surfaces(),
        leaves: &leaves,
        squares: &[],
        coverage: &solver.coverage,
        rays: &solver.rays,
        limits: Limits::new(solver.settings(), hierarchy, 1.0, u64::MAX),
        converged_change: 1e-4,
        cancel: &Cancel::default(),
    };
    gather.run().unwrap()
}

#[test]
fn a_room_of_constant_radiosity_does_not_change() {
    let solver = solved();
    let found = gathered(&solver, 1.0);
    assert!(found.ray_count > 0);
    for factor in found.factors {
        assert!(
            (factor - Vec4::ONE).truncate().abs().max_element() < 5e-3,
            "{factor}"
        );
    }
}

#[test]
fn wrong_linked_light_is_corrected() {
    let solver = solved();
    for error in [0.5, 2.0] {
        let found = gathered(&solver, error);
        let mean = found.factors.iter().map(|factor| factor.x).sum::<f32>();
        let mean = mean / found.factors.len() as f32;
        assert!((mean * error - 1.0).abs() < 0.1, "{mean} for {error}");
    }
}
