//! Links that overestimate light: the six-face value is up to 1.5 times the truth, so that coarse links in a bright closed scene
//! return more than is sent.

use std::f64::consts::PI;

use super::{
    Case, Claim, Finding, Group, Trouble,
    solve::{Lit, one_sided, solve},
};
use crate::{
    reference::analytic::furnace_radiosity,
    scene::{
        SceneBuilder,
        builtin::{sphere_furnace, stability},
    },
    solver::{Cancel, Direct, Method, Note, Push, SolveSettings},
};

pub(super) fn cases() -> Vec<Case> {
    let names = [(Method::SixFace, "six-face"), (Method::Bounded, "bounded")];
    let mut cases = Vec::new();
    for (method, name) in names {
        cases.push(Case::new(
            Group::Overestimate,
            format!("coarse links in a closed sphere, {name}"),
            move |cancel| closed(method, cancel),
        ));
        cases.push(Case::new(
            Group::Overestimate,
            format!("coarse links in a leaking sphere, {name}"),
            move |cancel| leaking(method, cancel),
        ));
    }
    cases
}

/// One step of coarse links, every vector pushed at once as the paper has it first.
fn coarse(builder: SceneBuilder, method: Method, cancel: &Cancel) -> Result<Lit, Trouble> {
    let settings = SolveSettings {
        method,
        push: Push::AtOnce,
        direct: Direct::Linked,
        epsilon: 0.05,
        max_steps: 1,
        tolerance: 1e-4,
        ..SolveSettings::normal()
    };
    solve(builder, &one_sided(), &settings, cancel)
}

/// 1 if the solve has such a note, else 0.
fn noted(lit: &Lit, is_such: impl Fn(&Note) -> bool) -> f64 {
    let mut notes = lit.reports.iter().flat_map(|report| &report.notes);
    f64::from(u8::from(notes.any(is_such)))
}

/// Whether a note names growth that the scaling to the coverage prevents.
fn is_scaled(note: &Note) -> bool {
    matches!(note, Note::CoarseLinks { .. })
}

/// Whether a note names growth for which the sums of form factors are bounded.
fn is_bounded(note: &Note) -> bool {
    *note == Note::GrowthBounded
}

fn row_sum(lit: &Lit) -> f64 {
    let last = lit.reports.last();
    last.map_or(f64::NAN, |report| f64::from(report.row_sum_mean))
}

fn closed(method: Method, cancel: &Cancel) -> Result<Finding, Trouble> {
    const REFLECTANCE: f32 = 0.98;
    let lit = coarse(sphere_furnace(REFLECTANCE, 1.0, 14), method, cancel)?;
    let expected = furnace_radiosity(PI, f64::from(REFLECTANCE));
    let irradiance = Claim::near("irradiance", expected, lit.mean_irradiance("wall").x, 0.01);
    // By themselves, the links return ρ times their row sum of what is sent.
    let gain = f64::from(REFLECTANCE) * row_sum(&lit);
    Ok(lit.finding(match method {
        Method::SixFace => vec![
            irradiance,
            Claim::at_least("gain of unscaled links", 1.05, gain),
            Claim::at_least("scaled growth is named", 1.0, noted(&lit, is_scaled)),
        ],
        _ => vec![
            irradiance,
            Claim::at_most("gain of unscaled links", 1.0, gain),
            Claim::small("growth is named", noted(&lit, is_scaled), 0.0),
        ],
    }))
}

fn leaking(method: Method, cancel: &Cancel) -> Result<Finding, Trouble> {
    const REFLECTANCE: f32 = 0.9999;
    let lit = coarse(stability::leaking_sphere(REFLECTANCE, 30), method, cancel)?;
    let found = lit.mean_irradiance("wall").x;
    // The power in a sphere without leaks.
    let ceiling = furnace_radiosity(PI, f64::from(REFLECTANCE));
    let irradiance = Claim::at_most("irradiance", ceiling, found);
    Ok(lit.finding(match method {
        Method::SixFace => vec![
            Claim::at_least("answered growth is named", 1.0, noted(&lit, is_bounded)),
            irradiance,
        ],
        _ => vec![
            irradiance,
            Claim::small("growth is named", noted(&lit, is_bounded), 0.0),
        ],
    }))
}
