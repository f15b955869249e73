use std::collections::HashSet;

use super::*;
use crate::scene::{
    Environment, Material, MaterialId, Sides, Sky, Sun,
    builtin::{furnace, plates},
};

/// Coarse, but to be right to 1 %.
fn settings() -> SolveSettings {
    SolveSettings {
        epsilon: 0.005,
        ..SolveSettings::draft()
    }
}

/// The tests of a scene under a light, one-sided; the solver's light is changed by `change`.
fn check(
    faces: SceneBuilder,
    environment: Option<Environment>,
    change: impl Fn(&Scene) -> f32 + Send + Sync + 'static,
) -> Check {
    let options = SceneOptions::with_sides(Sides::One);
    let scene = faces.clone().finish(&options).expect("it has faces");
    let scene = match environment {
        Some(environment) => scene.in_environment(environment),
        None => scene,
    };
    let subject = Subject {
        scene: Arc::new(scene),
        faces,
        options,
        lighting: Lighting::default(),
        settings: settings(),
        memory_limit: None,
    };
    let light = move |scene: &Arc<Scene>, cancel: &Cancel| {
        let mut lit = Lit::new(scene.clone(), &settings(), None, cancel)?;
        let mut light = (*lit.snapshot.light).clone();
        let factor = change(scene);
        light
            .irradiance
            .iter_mut()
            .for_each(|light| *light *= factor);
        lit.snapshot.light = Arc::new(light);
        Some(lit)
    };
    Check::lit_by(Box::new(light), subject, &Cancel::default()).expect("not cancelled")
}

fn outcomes(check: &Check) -> Vec<Outcome> {
    let laws = check.laws();
    laws.iter()
        .map(|law| check.run(law, &Cancel::default()))
        .collect()
}

/// Two plates that emit different colours, under sky and sun.
fn two_lamps() -> (SceneBuilder, Option<Environment>) {
    let mut faces = plates(1.0);
    let [red, blue] = [Vec3::new(3.0, 0.1, 0.0), Vec3::new(0.0, 0.5, 2.0)];
    faces.materials[0].emission = red;
    faces.materials[1] = Material::plain("blue", Vec3::splat(0.4), blue);
    let environment = Environment {
        sky: Sky::Uniform(Vec3::new(0.2, 0.3, 0.5)),
        sun: Some(Sun {
            direction: Sun::towards(30.0, 50.0, crate::scene::UpAxis::Y),
            irradiance: Vec3::ONE,
            diameter: 0.01,
        }),
        is_default: false,
    };
    (faces, Some(environment))
}

fn verdict_of<'a>(outcomes: &'a [Outcome], law: &str) -> &'a Verdict {
    let found = outcomes.iter().find(|outcome| outcome.law == law);
    &found.expect("it is tested").verdict
}

#[test]
fn right_light_obeys_all_laws_that_apply() {
    let closed = outcomes(&check(furnace(0.5, 0.5, 2), None, |_| 1.0));
    for outcome in &closed[..6] {
        assert_eq!(
            outcome.verdict,
            Verdict::Holds,
            "{}",
            check_markdown(&closed)
        );
    }
    let one = Verdict::NotApplicable("there is one lamp only".to_owned());
    assert_eq!(closed[6].verdict, one);
    assert!(
        summary(&closed)
            .expect("all hold")
            .starts_with("this file is lit right to 0.0")
    );

    let (faces, environment) = two_lamps();
    let open = outcomes(&check(faces, environment, |_| 1.0));
    assert_eq!(
        *verdict_of(&open, "lamps one by one"),
        Verdict::Holds,
        "{}",
        check_markdown(&open)
    );
    assert!(
        matches!(verdict_of(&open, "mean light"), Verdict::NotApplicable(why) if why.starts_with("open"))
    );
    let names: HashSet<&str> = open.iter().map(|outcome| outcome.law.as_str()).collect();
    assert_eq!(names.len(), open.len());
}

#[test]
fn light_that_is_five_per_cent_too_bright_is_not_right() {
    let closed = outcomes(&check(furnace(0.5, 0.5, 2), None, |_| 1.05));
    for law in ["constant radiance", "mean light"] {
        let Verdict::Fails(why) = verdict_of(&closed, law) else {
            panic!("{law}: {}", check_markdown(&closed));
        };
        assert!(
            why.contains("off by 5.0") && why.contains("more than 2.1"),
            "{why}"
        );
    }
    let sentence = summary(&closed).expect_err("two fail");
    assert!(
        sentence.starts_with("this file is not lit right: constant radiance: "),
        "{sentence}"
    );
    // Copies of a wrong light are right; wrong copies are not.
    assert_eq!(*verdict_of(&closed, "copy: mirrored"), Verdict::Holds);
    let own = |scene: &Scene| if scene.frame.scale > 1e3 { 1.05 } else { 1.0 };
    let copies = outcomes(&check(furnace(0.5, 0.5, 2), None, own));
    let fails = |law: &str| matches!(verdict_of(&copies, law), Verdict::Fails(_));
    assert!(fails("copy: a thousandth as large") && !fails("copy: mirrored"));
    // One lamp too bright.
    let sunny = |scene: &Scene| {
        let (sky, sun) = (&scene.environment.sky, scene.environment.sun);
        if sun.is_some() && sky.is_dark() {
            1.2
        } else {
            1.0
        }
    };
    let (faces, environment) = two_lamps();
    let lamps = outcomes(&check(faces, environment, sunny));
    assert!(matches!(
        verdict_of(&lamps, "lamps one by one"),
        Verdict::Fails(_)
    ));
}

#[test]
fn light_that_is_no_number_is_not_right() {
    let lost = outcomes(&check(furnace(0.5, 0.5, 2), None, |_| f32::NAN));
    assert!(matches!(
        verdict_of(&lost, "constant radiance"),
        Verdict::Fails(_)
    ));
    assert!(matches!(verdict_of(&lost, "mean light"), Verdict::Fails(_)));
}

#[test]
fn what_only_sees_backs_is_not_judged_by_constant_radiance() {
    // A cube that faces outward, seen from a plate within.
    let mut faces = furnace(0.5, 0.5, 1);
    for face in &mut faces.faces {
        face.corners.swap(1, 2);
    }
    let grey = MaterialId(0);
    let within = [[0.3, 0.3, 0.5], [0.7, 0.3, 0.5], [0.3, 0.7, 0.5]];
    let within = within.map(|corner| faces.push_position(corner.into()));
    faces.push_triangle(within, grey);
    let check = check(faces, None, |_| 1.0);
    let even = check.run(&Law::EvenLight, &Cancel::default());
    assert_eq!(even.verdict, Verdict::Holds, "{even:?}");
    assert!(even.remarks[1].contains("see black backs"), "{even:?}");
}

#[test]
fn a_cancelled_test_is_stopped_and_darkness_tells_nothing() {
    let dark = check(furnace(0.5, 0.0, 1), None, |_| 1.0);
    let cancel = Cancel::default();
    cancel.cancel();
    assert!(dark.run(&Law::EvenLight, &cancel).is_stopped());
    let outcomes = outcomes(&dark);
    let nothing = |why: &str| Verdict::NotApplicable(why.to_owned());
    assert_eq!(
        outcomes[2].verdict,
        nothing("no light falls on its surfaces")
    );
    assert_eq!(outcomes[6].verdict, nothing("there is no light"));
    // All of it emits in the test of the mean.
    assert_eq!(outcomes[1].verdict, Verdict::Holds);
    let bars = |line: &str| line.matches('|').count();
    let table = check_markdown(&outcomes);
    assert!(table.lines().take(9).all(|line| bars(line) == 8), "{table}");
}
