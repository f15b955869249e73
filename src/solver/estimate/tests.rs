use super::*;
use crate::{
    scene::{
        builtin::{empty_cornell, furnace},
        test_shapes::one_sided,
    },
    solver::{Method, Solver},
};

/// The error of the light of a solve, changed by a factor for each vertex.
fn estimated(
    scene: Scene,
    settings: &SolveSettings,
    factor: impl Fn(Vec3) -> f32,
) -> EstimatedError {
    estimate(scene, settings, factor).figures
}

/// The same with the errors at the points.
fn estimate(scene: Scene, settings: &SolveSettings, factor: impl Fn(Vec3) -> f32) -> Estimate {
    let cancel = Cancel::default();
    let scene = Arc::new(scene);
    let mut solver = Solver::new(scene.clone(), settings.clone(), None, &cancel).unwrap();
    while !solver.step(&cancel).unwrap().is_final {}
    let mesh = &solver.hierarchy.mesh;
    let light = solver
        .snapshot
        .light
        .irradiance
        .iter()
        .take(mesh.vertices.len());
    let irradiance: Vec<Vec3> = light
        .enumerate()
        .map(|(vertex, light)| light * factor(mesh.position(vertex as u32)))
        .collect();
    let mut estimator = ErrorEstimator::new(&scene, &solver.hierarchy, &solver.rays, settings.seed);
    let shown = Shown {
        scene: &scene,
        settings,
        appearances: &solver.relighting.appearances,
        surfaces: solver.surfaces(),
        sees_outside: false,
        irradiance: &irradiance,
        solve_rays: 4_000_000,
        cancel: &cancel,
    };
    estimator.estimate(shown).unwrap()
}

#[test]
fn light_that_is_too_bright_everywhere_has_just_that_error() {
    // The residual alone is that of the direct light, a third to a half of it.
    for (scene, method) in [
        (one_sided(empty_cornell()), Method::Bounded),
        (one_sided(furnace(0.5, 1.0, 2)), Method::Exact),
    ] {
        let settings = SolveSettings {
            method,
            ..SolveSettings::normal()
        };
        let right = estimated(scene.clone(), &settings, |_| 1.0);
        assert!(right.trimmed_high < 0.03, "{right:?}");
        assert!((right.energy - 1.0).abs() < 0.01, "{right:?}");
        let wrong = estimated(scene, &settings, |_| 1.1);
        assert!((wrong.rms - 0.1).abs() < 0.012, "{wrong:?}");
        assert!((wrong.energy - 1.1).abs() < 0.01, "{wrong:?}");
        assert!(wrong.rms_low < 0.1 && wrong.rms_high > 0.095, "{wrong:?}");
    }
}

#[test]
fn light_that_is_too_bright_on_one_side_has_its_error_there() {
    // Surfaces that are a quarter too bright: a fifth of what they show is wrong.
    let is_wrong = |point: Vec3| point.x < -10.0;
    let factor = |point: Vec3| if is_wrong(point) { 1.25 } else { 1.0 };
    let scene = one_sided(empty_cornell());
    let found = estimate(scene, &SolveSettings::normal(), factor);
    let mean = |wrong: bool| {
        // Without the elements between both.
        let clear = |point: &&ErrorPoint| (point.position.x + 10.0).abs() > 8.0;
        let points = found.points.iter().filter(clear);
        let points = points.filter(|point| is_wrong(point.position) == wrong);
        let (error, light) = points.fold((0.0, 0.0), |(error, light), point| {
            (error + point.error(), light + point.light)
        });
        error / light
    };
    let (there, elsewhere) = (mean(true), mean(false));
    assert!((there - 0.2).abs() < 0.02, "{there}");
    assert!(elsewhere.abs() < 0.02, "{elsewhere}");
    // The light is relative to the root mean square of the true light.
    let squares = found.points.iter().map(|point| {
        let truth = point.light - point.error();
        truth * truth
    });
    let square = squares.sum::<f32>() / found.points.len() as f32;
    assert!((square - 1.0).abs() < 0.15, "{square}");
}

#[test]
fn error_that_cancels_out_shows_in_the_root_mean_square_only() {
    let wave = |point: Vec3| 1.0 + 0.2 * (point.element_sum() * 0.5).sin().signum();
    let error = estimated(one_sided(empty_cornell()), &SolveSettings::normal(), wave);
    assert!(error.rms > 0.1, "{error:?}");
    assert!((error.energy - 1.0).abs() < 0.05, "{error:?}");
    assert!(error.rms_low <= error.rms && error.rms <= error.rms_high);
    assert!(error.energy_low <= error.energy && error.energy <= error.energy_high);
}

#[test]
fn linked_emission_is_compared_with_sampled_emission() {
    let settings = SolveSettings {
        direct: Direct::Linked,
        ..SolveSettings::normal()
    };
    let error = estimated(one_sided(empty_cornell()), &settings, |_| 1.0);
    assert!((error.energy - 1.0).abs() < 0.03, "{error:?}");
    assert!(error.trimmed_rms < 0.08, "{error:?}");
}

#[test]
fn levels_are_nested_and_grow() {
    let scene = Arc::new(one_sided(empty_cornell()));
    let hierarchy = Hierarchy::new(&scene, 30.0);
    let rays = Arc::new(RayTree::new(&scene));
    let mut estimator = ErrorEstimator::new(&scene, &hierarchy, &rays, 1);
    let mut before: Vec<usize> = Vec::new();
    for (level, (count, _)) in LEVELS.into_iter().enumerate() {
        estimator.level = level;
        let chosen = estimator.chosen();
        let few = count - count / 8;
        assert!(
            (few..=count).contains(&chosen.len()),
            "{count}: {}",
            chosen.len()
        );
        assert!(before.iter().all(|point| chosen.contains(point)));
        before = chosen;
    }
}

#[test]
fn steps_advance_while_the_error_falls_within_two_of_them() {
    let scene = Arc::new(one_sided(empty_cornell()));
    let hierarchy = Hierarchy::new(&scene, 30.0);
    let rays = Arc::new(RayTree::new(&scene));
    let mut estimator = ErrorEstimator::new(&scene, &hierarchy, &rays, 1);
    let advances = [0.08, 0.07, 0.075, 0.06, 0.07].map(|trimmed_rms| {
        estimator.advances(EstimatedError {
            trimmed_rms,
            ..EstimatedError::default()
        })
    });
    assert_eq!(advances, [true, true, false, true, false]);
}

#[test]
fn no_set_of_rays_is_that_of_another() {
    let mut seeds: Vec<u64> = RAY_SEEDS
        .into_iter()
        .flatten()
        .chain([POINT_SEED])
        .collect();
    // Far apart: small changes of the seed do not lead from one to another.
    seeds.sort_unstable();
    assert!(seeds.windows(2).all(|pair| pair[1] - pair[0] > 1 << 32));
}

#[test]
fn memory_of_points_light_and_an_own_ray_tree_counts() {
    let scene = Arc::new(one_sided(empty_cornell()));
    let hierarchy = Hierarchy::new(&scene, 30.0);
    let (tree, clear) = (Arc::new(RayTree::new(&scene)), Arc::new(RayTree::clear()));
    let shared = ErrorEstimator::new(&scene, &hierarchy, &tree, 1);
    let own = ErrorEstimator::new(&scene, &hierarchy, &clear, 1);
    let difference = own.memory_bytes(&clear) - shared.memory_bytes(&tree);
    assert_eq!(difference, tree.memory_bytes());
    assert!(shared.memory_bytes(&tree) >= STORED_POINTS as usize * size_of::<Point>());
}
