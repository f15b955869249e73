//! Light of changed emitters and materials on the links that there are, against fresh solves and against itself.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::{f32::consts::PI, sync::Arc};

use common::{prepare, solve, step_to_end};
use glam::{DVec3, Vec3};
use vecrad::{
    geometry::area_vector,
    scene::{
        Appearance, Environment, Material, Scene, SceneBuilder, SceneOptions, Sides, Sky, Sun,
        builtin,
    },
    solver::{Cancel, Direct, Lamp, LampLight, Snapshot, SolveSettings, Solver, VertexLight},
};

/// Settings under which the iteration leaves next to nothing, in two steps.
fn settings() -> SolveSettings {
    SolveSettings {
        tolerance: 1e-6,
        max_steps: 2,
        ..SolveSettings::draft()
    }
}

fn one_sided() -> SceneOptions {
    SceneOptions::with_sides(Sides::One)
}

fn cornell() -> Arc<Scene> {
    Arc::new(builtin::builtin("cornell", &one_sided()).unwrap().unwrap())
}

/// A room of six walls with a warm lamp and a cold one under its ceiling, between which a board hangs.
fn two_lamps() -> Arc<Scene> {
    Arc::new(two_lamps_under(true))
}

/// That room, or all of it but the ceiling.
fn two_lamps_under(has_ceiling: bool) -> Scene {
    let mut builder = SceneBuilder::default();
    let mut paint = |name: &str, reflectance: [f32; 3], emission: [f32; 3]| {
        let [reflectance, emission] = [reflectance, emission].map(Vec3::from_array);
        builder.push_material(Material::plain(name, reflectance, emission))
    };
    let white = paint("white", [0.7, 0.7, 0.7], [0.0; 3]);
    let red = paint("red", [0.7, 0.2, 0.1], [0.0; 3]);
    let warm = paint("warm", [0.5, 0.5, 0.5], [30.0, 20.0, 10.0]);
    let cold = paint("cold", [0.5, 0.5, 0.5], [5.0, 10.0, 20.0]);
    let mut quad = |corners: [[f64; 3]; 4], material| {
        let [a, b, c, d] = corners.map(|corner| builder.push_position(DVec3::from_array(corner)));
        builder.push_triangle([a, b, c], material);
        builder.push_triangle([a, c, d], material);
    };
    let (x, y, z) = ([0.0, 4.0], [0.0, 2.5], [0.0, 3.0]);
    let at = |i: usize, j: usize, k: usize| [x[i], y[j], z[k]];
    quad([at(0, 0, 0), at(0, 0, 1), at(1, 0, 1), at(1, 0, 0)], white);
    if has_ceiling {
        quad([at(0, 1, 0), at(1, 1, 0), at(1, 1, 1), at(0, 1, 1)], white);
    }
    quad([at(0, 0, 0), at(1, 0, 0), at(1, 1, 0), at(0, 1, 0)], white);
    quad([at(0, 0, 1), at(0, 1, 1), at(1, 1, 1), at(1, 0, 1)], white);
    quad([at(0, 0, 0), at(0, 1, 0), at(0, 1, 1), at(0, 0, 1)], red);
    quad([at(1, 0, 0), at(1, 0, 1), at(1, 1, 1), at(1, 1, 0)], white);
    for (left, lamp) in [(0.6, warm), (3.0, cold)] {
        let right = left + 0.4;
        let corner = |x: f64, z: f64| [x, 2.4, z];
        let corners = [
            corner(left, 1.3),
            corner(right, 1.3),
            corner(right, 1.7),
            corner(left, 1.7),
        ];
        quad(corners, lamp);
    }
    let board = |y: f64, z: f64| [2.0, y, z];
    quad(
        [
            board(1.0, 0.5),
            board(2.4, 0.5),
            board(2.4, 2.5),
            board(1.0, 2.5),
        ],
        red,
    );
    quad(
        [
            board(1.0, 0.5),
            board(1.0, 2.5),
            board(2.4, 2.5),
            board(2.4, 0.5),
        ],
        red,
    );
    builder.finish(&one_sided()).unwrap()
}

fn solved(scene: &Arc<Scene>, settings: SolveSettings) -> Solver {
    solve(scene, settings).0
}

/// The light of a solve under other appearances; all of it presentable.
fn relit(solver: &mut Solver, appearances: &[Appearance]) -> Snapshot {
    let links = solver.links().len();
    let relit = solver.relight(appearances, &Cancel::default()).unwrap();
    if relit.is_rough {
        solver.finish_relighting(&Cancel::default()).unwrap();
    }
    assert_eq!(solver.links().len(), links, "links stay");
    assert!(
        !relit.report.is_final,
        "a further step has something to refine"
    );
    let snapshot = solver.snapshot();
    for light in [&snapshot.light.irradiance, &snapshot.light.direct] {
        assert_eq!(light.len(), snapshot.mesh.positions.len());
        assert!(
            light
                .iter()
                .all(|x| x.is_finite() && x.min_element() >= 0.0)
        );
    }
    snapshot
}

/// Radiance of the vertices: what is emitted and what is reflected.
fn radiance(snapshot: &Snapshot) -> Vec<Vec3> {
    let (mesh, light) = (&snapshot.mesh, &snapshot.light);
    (0..mesh.positions.len())
        .map(|index| mesh.emission[index] + mesh.reflectance[index] * light.irradiance[index] / PI)
        .collect()
}

/// Largest difference, relative to the mean of the second.
fn difference(found: &[Vec3], expected: &[Vec3]) -> f32 {
    assert_eq!(found.len(), expected.len());
    let sum: Vec3 = expected.iter().sum();
    let mean = sum.element_sum() / (3 * expected.len()) as f32;
    let most = found.iter().zip(expected);
    most.map(|(a, b)| (*a - *b).abs().max_element())
        .fold(0.0, f32::max)
        / mean
}

/// Root of the mean square of the difference, relative to that of the second.
fn relative_rms(found: &[Vec3], expected: &[Vec3]) -> f32 {
    let square = |of: &mut dyn Iterator<Item = Vec3>| of.map(|x| x.length_squared()).sum::<f32>();
    let between = square(&mut found.iter().zip(expected).map(|(a, b)| *a - *b));
    (between / square(&mut expected.iter().copied())).sqrt()
}

/// Mean irradiance over the display mesh, by area.
fn mean_irradiance(snapshot: &Snapshot) -> DVec3 {
    let (mesh, light) = (&snapshot.mesh, &snapshot.light);
    let (mut sum, mut whole) = (DVec3::ZERO, 0.0);
    for corners in &mesh.indices {
        let points = corners.map(|corner| mesh.positions[corner as usize]);
        let area = f64::from(area_vector(points).length());
        let values = corners.map(|corner| light.irradiance[corner as usize].as_dvec3());
        sum += values.into_iter().sum::<DVec3>() * (area / 3.0);
        whole += area;
    }
    sum / whole
}

/// Appearances of a scene with the emission of some materials multiplied.
fn with_emission(scene: &Scene, factor: impl Fn(&str) -> Vec3) -> Vec<Appearance> {
    let of = |material: &Material| Appearance {
        emission: material.emission * factor(&material.name),
        ..Appearance::of(material)
    };
    scene.materials.iter().map(of).collect()
}

/// Appearances of a scene with the reflectance of one material.
fn with_reflectance(scene: &Scene, name: &str, reflectance: Vec3) -> Vec<Appearance> {
    let mut appearances = scene.appearances();
    let named = scene.materials.iter().position(|m| m.name == name).unwrap();
    appearances[named].reflectance = reflectance;
    appearances
}

#[test]
fn light_is_in_proportion_to_all_emission() {
    for direct in [Direct::Sampled, Direct::Linked] {
        let scene = cornell();
        let mut solver = solved(
            &scene,
            SolveSettings {
                direct,
                ..settings()
            },
        );
        let rays = |solver: &mut Solver| {
            let report = solver.relight(&scene.appearances(), &Cancel::default());
            report.unwrap().report.shadow_rays
        };
        let shot = rays(&mut solver);
        let before = radiance(&solver.snapshot());
        for factor in [1e-3, 0.3, 2.0, 1e4] {
            let requested = with_emission(&scene, |_| Vec3::splat(factor));
            let found = radiance(&relit(&mut solver, &requested));
            let expected: Vec<Vec3> = before.iter().map(|light| *light * factor).collect();
            let error = difference(&found, &expected);
            assert!(error < 1e-4, "{direct:?}, factor {factor}: {error}");
        }
        assert_eq!(rays(&mut solver), shot, "nothing is shot to scale light");
    }
}

#[test]
fn two_lamps_together_are_the_sum_of_each() {
    let scene = two_lamps();
    let mut solver = solved(&scene, settings());
    let mut of = |requested: &[Appearance]| relit(&mut solver, requested).light.irradiance.clone();
    let only = |kept: &str| {
        let kept = kept.to_owned();
        with_emission(&scene, move |name| {
            Vec3::splat(f32::from(u8::from(name == kept)))
        })
    };
    let (warm, cold) = (of(&only("warm")), of(&only("cold")));
    let both = of(&scene.appearances());
    let sum: Vec<Vec3> = warm.iter().zip(&cold).map(|(a, b)| *a + *b).collect();
    // Clusters stand at their brightest place, which is elsewhere for each lamp: links differ by a part of their own
    // error, and vertices take the mean with neighbours by how noisy they are. Of a draft that is a few percent.
    let error = relative_rms(&sum, &both);
    assert!(error < 0.03, "{error}");
    let total = |light: &[Vec3]| -> Vec3 { light.iter().sum() };
    let ratio = total(&sum) / total(&both);
    assert!((ratio - 1.0).abs().max_element() < 5e-3, "{ratio}");
    // The shadow of the board is that of one lamp only: each side is lit by its own.
    assert!(difference(&warm, &both) > 0.3 && difference(&cold, &both) > 0.3);
}

#[test]
fn what_is_switched_off_and_on_again_is_as_before() {
    let scene = two_lamps();
    let mut solver = solved(&scene, settings());
    let before = radiance(&solver.snapshot());
    let dark = with_emission(&scene, |_| Vec3::ZERO);
    assert!(
        radiance(&relit(&mut solver, &dark))
            .iter()
            .all(|light| *light == Vec3::ZERO)
    );
    let error = difference(
        &radiance(&relit(&mut solver, &scene.appearances())),
        &before,
    );
    assert!(error < 1e-5, "all together: {error}");
    let half = with_emission(&scene, |name| {
        Vec3::splat(f32::from(u8::from(name != "warm")))
    });
    let both = radiance(&relit(&mut solver, &scene.appearances()));
    relit(&mut solver, &half);
    let lit = radiance(&relit(&mut solver, &scene.appearances()));
    relit(&mut solver, &half);
    let again = radiance(&relit(&mut solver, &scene.appearances()));
    // The second time nothing is shot; what remains is what the iteration leaves.
    let error = difference(&again, &lit);
    assert!(error < 1e-3, "one by one: {error}");
    // The first time each lamp is shot by itself: their noise is another.
    let error = difference(&lit, &both);
    assert!(error < 0.3, "shot again: {error}");
}

#[test]
fn relit_is_as_a_fresh_solve_within_the_error_of_either() {
    let scene = two_lamps();
    let changes = [
        with_emission(&scene, |name| match name {
            "warm" => Vec3::new(0.1, 0.5, 2.0),
            _ => Vec3::splat(3.0),
        }),
        with_reflectance(&scene, "white", Vec3::new(0.3, 0.5, 0.9)),
        with_reflectance(&scene, "red", Vec3::ZERO),
    ];
    let settings = SolveSettings::draft();
    for (index, requested) in changes.iter().enumerate() {
        let mut solver = solved(&scene, settings.clone());
        let found = mean_irradiance(&relit(&mut solver, requested));
        let fresh = solved(&Arc::new(scene.relit(requested)), settings.clone());
        let expected = mean_irradiance(&fresh.snapshot());
        let error = (found / expected - 1.0).abs().max_element();
        // The energy of a draft is within 3 %.
        assert!(error < 0.03, "change {index}: {found} for {expected}");
        // Going on refines: it stays a solve like any other.
        let report = solver.step(&Cancel::default()).unwrap();
        assert!(report.is_final, "the steps were used up before");
        let refined = mean_irradiance(&solver.snapshot());
        let error = (refined / expected - 1.0).abs().max_element();
        assert!(
            error < 0.03,
            "change {index} refined: {refined} for {expected}"
        );
    }
}

#[test]
fn reflectance_is_black_or_ends_at_the_clamp() {
    let scene = cornell();
    let mut solver = solved(&scene, settings());
    let of_all = |reflectance: Vec3| -> Vec<Appearance> {
        let of = |material: &Material| Appearance {
            reflectance,
            ..Appearance::of(material)
        };
        scene.materials.iter().map(of).collect()
    };
    let black = relit(&mut solver, &of_all(Vec3::ZERO));
    assert!(black.mesh.reflectance.iter().all(|x| *x == Vec3::ZERO));
    // Nothing is reflected, so that all light is direct.
    let most = difference(&black.light.irradiance, &black.light.direct);
    assert!(most < 1e-5, "{most}");
    let white = relit(&mut solver, &of_all(Vec3::splat(7.0)));
    let limit = scene.max_reflectance * (1.0 + 1e-5);
    assert!(
        white
            .mesh
            .reflectance
            .iter()
            .all(|x| x.max_element() <= limit)
    );
    assert!(mean_irradiance(&white).min_element() > mean_irradiance(&black).max_element());
    let broken = relit(&mut solver, &of_all(Vec3::NAN));
    assert!(broken.mesh.reflectance.iter().all(|x| *x == Vec3::ZERO));
}

#[test]
fn the_same_bits_on_any_number_of_threads() {
    let scene = two_lamps();
    let requested = [
        with_emission(&scene, |name| {
            Vec3::splat(if name == "warm" { 0.2 } else { 1.0 })
        }),
        with_reflectance(&scene, "white", Vec3::splat(0.4)),
    ];
    let light = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| {
            let mut solver = solved(&scene, settings());
            requested
                .each_ref()
                .map(|requested| relit(&mut solver, requested).light.irradiance.clone())
        })
    };
    assert_eq!(light(1), light(4));
}

#[test]
fn before_the_first_step_only_direct_light_changes() {
    let scene = cornell();
    let mut solver = prepare(&scene, settings());
    let before = radiance(&solver.snapshot());
    let found = radiance(&relit(
        &mut solver,
        &with_emission(&scene, |_| Vec3::splat(2.0)),
    ));
    let expected: Vec<Vec3> = before.iter().map(|light| *light * 2.0).collect();
    assert!(difference(&found, &expected) < 1e-5);
    step_to_end(&mut solver, |_, _| {});
    let mean = mean_irradiance(&solver.snapshot());
    let fresh = mean_irradiance(&solved(&scene, settings()).snapshot());
    assert!(
        (mean / fresh - 2.0).abs().max_element() < 0.02,
        "{mean} {fresh}"
    );
}

#[test]
fn what_is_cancelled_can_be_asked_again() {
    let scene = two_lamps();
    let mut solver = solved(&scene, settings());
    let requested = with_emission(&scene, |name| {
        Vec3::splat(if name == "warm" { 0.2 } else { 1.0 })
    });
    let cancelled = Cancel::default();
    cancelled.cancel();
    let before = solver.snapshot().light.clone();
    assert!(solver.relight(&requested, &cancelled).is_none());
    assert_eq!(*solver.snapshot().light, *before);
    let found = relit(&mut solver, &requested).light.irradiance.clone();
    let mut other = solved(&scene, settings());
    assert_eq!(found, relit(&mut other, &requested).light.irradiance);
}

#[test]
fn the_preview_is_nearly_the_refined_light() {
    let scene = two_lamps();
    let mut solver = solved(&scene, settings());
    for requested in [
        with_reflectance(&scene, "white", Vec3::splat(0.3)),
        with_emission(&scene, |name| {
            Vec3::splat(f32::from(u8::from(name == "warm")))
        }),
    ] {
        let relit = solver.relight(&requested, &Cancel::default()).unwrap();
        assert!(relit.is_rough);
        let rough = solver.snapshot();
        solver.finish_relighting(&Cancel::default()).unwrap();
        let fine = solver.snapshot();
        assert_eq!(rough.light.direct, fine.light.direct);
        let error = (mean_irradiance(&rough) / mean_irradiance(&fine) - 1.0).abs();
        assert!(error.max_element() < 0.01, "{error}");
        let error = difference(&rough.light.irradiance, &fine.light.irradiance);
        assert!(error < 0.3, "{error}");
    }
}

/// The light of each lamp, in the order in which lamps come; the solve is as it was.
fn by_lamp(solver: &mut Solver) -> Vec<LampLight> {
    let before = solver.snapshot();
    let parts = solver.light_by_lamp(&Cancel::default()).unwrap();
    let after = solver.snapshot();
    assert_eq!(before.light.irradiance, after.light.irradiance);
    assert_eq!(before.mesh, after.mesh);
    let vertices = before.mesh.positions.len();
    for part in &parts {
        assert!(part.irradiance.iter().all(|light| light.is_finite()));
        assert!(
            part.irradiance
                .iter()
                .all(|light| light.min_element() >= 0.0)
        );
        assert_eq!([part.irradiance.len(), part.emission.len()], [vertices; 2]);
    }
    for vertex in 0..vertices {
        let sum: Vec3 = parts.iter().map(|part| part.irradiance[vertex]).sum();
        let whole = before.light.irradiance[vertex];
        let error = (sum - whole).abs().max_element();
        assert!(error <= 1e-4 * whole.max_element(), "{sum} for {whole}");
        let sum: Vec3 = parts.iter().map(|part| part.emission[vertex]).sum();
        let whole = before.mesh.emission[vertex];
        assert!((sum - whole).abs().max_element() <= 1e-5 * whole.max_element());
    }
    parts
}

/// Mean irradiance of one lamp over the display mesh, by area.
fn mean_of(part: &LampLight, snapshot: &Snapshot) -> DVec3 {
    let alone = VertexLight {
        irradiance: part.irradiance.clone(),
        ..VertexLight::default()
    };
    mean_irradiance(&Snapshot {
        light: Arc::new(alone),
        ..snapshot.clone()
    })
}

#[test]
fn each_lamp_has_the_light_of_a_solve_under_it_alone() {
    let scene = two_lamps();
    for direct in [Direct::Sampled, Direct::Linked] {
        let settings = SolveSettings {
            direct,
            ..settings()
        };
        let mut solver = solved(&scene, settings.clone());
        let parts = by_lamp(&mut solver);
        assert_eq!(parts.len(), 2);
        for (part, name) in parts.iter().zip(["warm", "cold"]) {
            let Lamp::Material(material) = part.lamp else {
                panic!("{:?}", part.lamp);
            };
            assert_eq!(scene.materials[material].name, name);
            let only = with_emission(&scene, |other| {
                Vec3::splat(f32::from(u8::from(other == name)))
            });
            let alone = solved(&Arc::new(scene.relit(&only)), settings.clone());
            let expected = mean_irradiance(&alone.snapshot());
            let found = mean_of(part, &solver.snapshot());
            let error = (found / expected - 1.0).abs().max_element();
            assert!(error < 0.03, "{direct:?}, {name}: {found} for {expected}");
        }
        // A step after it is one as ever.
        solver.step(&Cancel::default()).unwrap();
    }
}

#[test]
fn sky_and_sun_are_lamps_beside_those_of_the_scene() {
    let [sky, sun] = [Vec3::new(0.2, 0.3, 0.5), Vec3::new(9.0, 8.0, 7.0)];
    let under = |sky: Vec3, sun: Option<Vec3>| {
        let sun = sun.map(|irradiance| Sun {
            direction: Vec3::new(0.3, 1.0, 0.2).normalize_or_zero(),
            irradiance,
            diameter: 0.01,
        });
        Environment {
            sky: Sky::Uniform(sky),
            sun,
            ..Environment::default()
        }
    };
    let open = two_lamps_under(false);
    let dark = open.relit(&with_emission(&open, |_| Vec3::ZERO));
    let scene = Arc::new(open.in_environment(under(sky, Some(sun))));
    let mut solver = solved(&scene, settings());
    let parts = by_lamp(&mut solver);
    let lamps: Vec<Lamp> = parts.iter().map(|part| part.lamp).collect();
    assert!(matches!(
        lamps[..],
        [Lamp::Material(_), Lamp::Material(_), Lamp::Sky, Lamp::Sun]
    ));
    for (part, environment) in [
        (&parts[2], under(sky, None)),
        (&parts[3], under(Vec3::ZERO, Some(sun))),
    ] {
        let alone = solved(
            &Arc::new(dark.clone().in_environment(environment)),
            settings(),
        );
        let expected = mean_irradiance(&alone.snapshot());
        let found = mean_of(part, &solver.snapshot());
        let error = (found / expected - 1.0).abs().max_element();
        assert!(error < 0.03, "{:?}: {found} for {expected}", part.lamp);
        assert!(part.emission.iter().all(|emission| *emission == Vec3::ZERO));
    }
}

#[test]
fn a_single_lamp_has_all_light_and_cancelling_leaves_the_solve() {
    let scene = cornell();
    let mut solver = solved(&scene, settings());
    let parts = by_lamp(&mut solver);
    assert_eq!(parts[0].irradiance, solver.snapshot().light.irradiance);
    let scene = two_lamps();
    let mut solver = solved(&scene, settings());
    let before = solver.snapshot();
    let cancel = Cancel::default();
    cancel.cancel();
    assert!(solver.light_by_lamp(&cancel).is_none());
    assert_eq!(before.light.irradiance, solver.snapshot().light.irradiance);
    let [warm, cold] = &by_lamp(&mut solver)[..] else {
        panic!("two lamps");
    };
    assert!(difference(&warm.irradiance, &cold.irradiance) > 0.3);
}
