//! Shapes at the limit.

use std::f64::consts::PI;

use super::{
    Case, Claim, Finding, Group, Trouble,
    solve::{energy_claim, error_claim, one_sided, sides_by_shape, solve},
    stiff::converging,
};
use crate::{
    reference::analytic::{furnace_radiosity, parallel_rectangles},
    scene::{
        SceneBuilder,
        builtin::{furnace, stability},
    },
    solver::{Cancel, Direct, SolveSettings},
};

pub(super) fn cases() -> Vec<Case> {
    let geometry = |name: &str, run: fn(&Cancel) -> Result<Finding, Trouble>| {
        Case::new(Group::Geometry, name, run)
    };
    vec![
        geometry("needles of aspect 1e6", needles),
        geometry("slivers", |cancel| {
            glowing(stability::sliver_furnace(0.5, 250), 0.5, cancel)
        })
        .slow(),
        geometry("zero-area faces", collapsed_faces),
        geometry("coincident duplicates", |cancel| {
            glowing(stability::doubled_furnace(0.9), 0.9, cancel)
        }),
        geometry("opposite twins", twins),
        geometry("touching and interpenetrating boxes", |cancel| {
            by_paths(
                stability::crossing_boxes(),
                &SolveSettings::normal(),
                HALF_INSIDE,
                cancel,
            )
        }),
        geometry("100000 triangles with one centroid", |cancel| {
            one_centroid(100_000, cancel)
        })
        .slow(),
        geometry("2000 triangles with one centroid", |cancel| {
            one_centroid(2_000, cancel)
        }),
        geometry("a single triangle", |cancel| {
            unlit(stability::one_triangle(), cancel)
        }),
        geometry("nothing but emitters", |cancel| {
            glowing(furnace(0.0, 1.0, 3), 0.0, cancel)
        }),
        geometry("an emitter in a closed box", boxed_lamp),
        geometry("a polygon of 10000 corners", |cancel| {
            glowing(stability::polygon_furnace(0.5, 10_000), 0.5, cancel)
        })
        .slow(),
        geometry("a polygon of 200 corners", |cancel| {
            glowing(stability::polygon_furnace(0.5, 200), 0.5, cancel)
        }),
        geometry("a sheet seen from both sides", sheet),
        geometry("a wall thinner than an element", thin_wall),
        geometry("10000 tiny emitters", |cancel| {
            by_paths(
                stability::many_lamps(10_000),
                &SolveSettings::normal(),
                0.03,
                cancel,
            )
        })
        .slow(),
        geometry("500 tiny emitters", |cancel| {
            by_paths(
                stability::many_lamps(500),
                &SolveSettings::draft(),
                0.03,
                cancel,
            )
        }),
    ]
}

/// Share of the light that boxes may lose which stand in each other: faces that are half inside a solid see less than half of
/// the room with one part and all of it with the other, and are scaled by the mean.
const HALF_INSIDE: f64 = 0.05;

/// Share of the light that may take a wrong way at a bounce over coarse links.
const LOST: f64 = 0.01;

/// A closed scene whose surfaces all emit radiance 1 and reflect alike.
fn glowing(builder: SceneBuilder, reflectance: f32, cancel: &Cancel) -> Result<Finding, Trouble> {
    let settings = SolveSettings {
        direct: Direct::Linked,
        epsilon: 0.3,
        max_steps: 1,
        ..converging()
    };
    // Light that bounces 1 / (1 − ρ) times on average.
    let allowed = LOST / (1.0 - f64::from(reflectance));
    let lit = solve(builder, &one_sided(), &settings, cancel)?;
    let expected = furnace_radiosity(PI, f64::from(reflectance));
    Ok(lit.finding(vec![
        Claim::near(
            "irradiance",
            expected,
            lit.mean_irradiance("wall").x,
            allowed,
        ),
        lit.balance(allowed),
    ]))
}

/// A scene that only path tracing knows; `allowed` is the share of its energy that may be missing or too much.
fn by_paths(
    builder: SceneBuilder,
    settings: &SolveSettings,
    allowed: f64,
    cancel: &Cancel,
) -> Result<Finding, Trouble> {
    let lit = solve(builder, &one_sided(), settings, cancel)?;
    let error = lit.against_paths(1000, 64, cancel)?;
    Ok(lit.finding(vec![energy_claim(&error, allowed), error_claim(&error)]))
}

/// Compare with a scene whose faces come first in this one.
fn like(
    original: SceneBuilder,
    builder: SceneBuilder,
    allowed: f64,
    cancel: &Cancel,
) -> Result<Finding, Trouble> {
    let settings = SolveSettings::draft();
    let original = solve(original, &one_sided(), &settings, cancel)?;
    let other = solve(builder, &one_sided(), &settings, cancel)?;
    let mut finding = other.finding(vec![
        Claim::small(
            "difference from the scene without",
            original.difference(&other, 1.0),
            allowed,
        ),
        other.balance(0.03),
    ]);
    original.count_in(&mut finding);
    Ok(finding)
}

fn needles(cancel: &Cancel) -> Result<Finding, Trouble> {
    like(stability::needles(0), stability::needles(200), 0.03, cancel)
}

fn collapsed_faces(cancel: &Cancel) -> Result<Finding, Trouble> {
    let whole = stability::furnished_room();
    let collapsed = stability::with_collapsed_faces(whole.clone());
    like(whole, collapsed, 0.0, cancel)
}

fn twins(cancel: &Cancel) -> Result<Finding, Trouble> {
    let settings = SolveSettings::normal();
    let sheet = solve(
        stability::two_sided_sheet(),
        &sides_by_shape(),
        &settings,
        cancel,
    )?;
    let mut claims = Vec::new();
    let mut finding = Finding::default();
    for (name, options) in [("one-sided", one_sided()), ("by shape", sides_by_shape())] {
        let twins = solve(stability::twin_sheet(), &options, &settings, cancel)?;
        let (expected, found) = (
            sheet.mean_irradiance("cloth"),
            twins.mean_irradiance("cloth"),
        );
        claims.push(Claim::near(
            format!("irradiance, {name}"),
            expected.x,
            found.x,
            0.02,
        ));
        claims.push(twins.balance(0.03));
        twins.count_in(&mut finding);
    }
    finding.claims = claims;
    sheet.count_in(&mut finding);
    Ok(finding)
}

/// Share by which sums of single precision may be off.
const ROUNDING: f64 = 1e-5;

fn one_centroid(count: usize, cancel: &Cancel) -> Result<Finding, Trouble> {
    // Everything touches everything: links that are finer than the coarsest would be those of all pairs.
    let settings = SolveSettings {
        direct: Direct::Linked,
        epsilon: 100.0,
        max_steps: 1,
        ..SolveSettings::draft()
    };
    let lit = solve(
        stability::one_centroid(count),
        &sides_by_shape(),
        &settings,
        cancel,
    )?;
    Ok(lit.finding(vec![Claim::at_most(
        "absorbed / emitted",
        1.0 + ROUNDING,
        lit.absorbed_share(),
    )]))
}

fn unlit(builder: SceneBuilder, cancel: &Cancel) -> Result<Finding, Trouble> {
    let lit = solve(builder, &sides_by_shape(), &SolveSettings::normal(), cancel)?;
    let [_, most] = lit.extremes(stability::LAMP);
    Ok(lit.finding(vec![Claim::small("largest irradiance", most, 0.0)]))
}

fn boxed_lamp(cancel: &Cancel) -> Result<Finding, Trouble> {
    let lit = solve(
        stability::lamp_in_a_box(),
        &one_sided(),
        &SolveSettings::normal(),
        cancel,
    )?;
    let [_, outside] = lit.extremes(stability::WALL);
    Ok(lit.finding(vec![
        Claim::small(
            "largest irradiance outside / mean inside",
            outside / lit.mean_irradiance("inside").x,
            1e-3,
        ),
        lit.balance(0.02),
    ]))
}

fn sheet(cancel: &Cancel) -> Result<Finding, Trouble> {
    let lit = solve(
        stability::sheet_between_lamps(),
        &sides_by_shape(),
        &SolveSettings::normal(),
        cancel,
    )?;
    // Both sides: two squares of radiance 3 and 1 at distance 1.
    let factor = parallel_rectangles(1.0, 1.0, 1.0);
    let mean = lit.mean_irradiance("cloth").x;
    let [_, brightest] = lit.extremes("cloth");
    Ok(lit.finding(vec![
        Claim::near("mean of both sides", 2.0 * PI * factor, mean, 0.005),
        Claim::at_least("brightest side", 3.0 * PI * factor, brightest),
    ]))
}

fn thin_wall(cancel: &Cancel) -> Result<Finding, Trouble> {
    let lit = solve(
        stability::wall_between_rooms(),
        &one_sided(),
        &SolveSettings::normal(),
        cancel,
    )?;
    let [_, dark] = lit.extremes("dark");
    Ok(lit.finding(vec![
        Claim::small(
            "largest irradiance behind the wall / mean before it",
            dark / lit.mean_irradiance(stability::WALL).x,
            1e-3,
        ),
        lit.balance(0.02),
    ]))
}
