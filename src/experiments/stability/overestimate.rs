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
    solver::{Cancel, Direct, Method, Push, SolveSettings},
};

/// Part of the note that names growth that scaling to the coverage bounds.
const SCALED_NOTE: &str = "keep energy";

/// Part of the note that names growth which bounded rows answer.
const ANSWERED: &str = "the light grows";

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

/// 1 where a note of the solve holds this, else 0.
fn noted(lit: &Lit, part: &str) -> f64 {
    let mut notes = lit.reports.iter().flat_map(|report| &report.notes);
    f64::from(u8::from(notes.any(|note| note.contains(part))))
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
            Claim::at_least("scaled growth is named", 1.0, noted(&lit, SCALED_NOTE)),
        ],
        _ => vec![
            irradiance,
            Claim::at_most("gain of unscaled links", 1.0, gain),
            Claim::small("growth is named", noted(&lit, SCALED_NOTE), 0.0),
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
            Claim::at_least("answered growth is named", 1.0, noted(&lit, ANSWERED)),
            irradiance,
        ],
        _ => vec![
            irradiance,
            Claim::small("growth is named", noted(&lit, ANSWERED), 0.0),
        ],
    }))
}
