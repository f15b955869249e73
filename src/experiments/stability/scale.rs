//! Very large, small, bright, dark and far: copies must agree with the original.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use super::{
    Case, Claim, Finding, Group, Trouble,
    solve::{energy_claim, error_claim, one_sided, sides_by_shape, solve},
    stiff::converging,
};
use crate::{
    reference::analytic::furnace_radiosity,
    scene::{
        SceneBuilder,
        builtin::stability::{self, furnished_room, moved, relit, two_lamps},
    },
    solver::{Cancel, SolveSettings},
};

/// How far a copy may be from its original.
const AGREEMENT: f64 = 1e-3;

pub(super) fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for factor in [1e-6, 1e-3, 1e3, 1e6] {
        cases.push(Case::new(
            Group::Scale,
            format!("room scaled by {factor:e}"),
            move |cancel| copy(moved(furnished_room(), factor, DVec3::ZERO), 1.0, cancel),
        ));
    }
    for shift in [DVec3::splat(1e6), DVec3::new(-1e6, 0.0, 0.0)] {
        cases.push(Case::new(
            Group::Scale,
            format!("room shifted by {:e} {:e} {:e}", shift.x, shift.y, shift.z),
            move |cancel| copy(moved(furnished_room(), 1.0, shift), 1.0, cancel),
        ));
    }
    for factor in [1e-36, 1e-12, 1e-6, 1e6, 1e12, 1e36] {
        cases.push(Case::new(
            Group::Scale,
            format!("emission scaled by {factor:e}"),
            move |cancel| copy(relit(furnished_room(), factor), f64::from(factor), cancel),
        ));
    }
    cases.push(Case::new(
        Group::Scale,
        "lamps of 1e-12 and 1e12 in one room",
        lamps,
    ));
    cases.push(Case::new(Group::Scale, "lamp of 1 mm over terrain of 1 km", terrain).slow());
    cases.push(Case::new(Group::Scale, "black surfaces", black));
    cases.push(Case::new(
        Group::Scale,
        "one channel reflects nothing",
        channels,
    ));
    cases
}

fn copy(builder: SceneBuilder, factor: f64, cancel: &Cancel) -> Result<Finding, Trouble> {
    let settings = SolveSettings::draft();
    let original = solve(furnished_room(), &one_sided(), &settings, cancel)?;
    let copy = solve(builder, &one_sided(), &settings, cancel)?;
    let difference = original.difference(&copy, factor);
    let mut finding = copy.finding(vec![Claim::small(
        "difference from the original",
        difference,
        AGREEMENT,
    )]);
    original.count_in(&mut finding);
    Ok(finding)
}

fn lamps(cancel: &Cancel) -> Result<Finding, Trouble> {
    let settings = SolveSettings::draft();
    let bright = solve(two_lamps(1e12, 0.0), &one_sided(), &settings, cancel)?;
    let both = solve(two_lamps(1e12, 1e-12), &one_sided(), &settings, cancel)?;
    let mut finding = both.finding(vec![
        Claim::small(
            "difference from the bright lamp alone",
            bright.difference(&both, 1.0),
            AGREEMENT,
        ),
        both.balance(0.02),
    ]);
    bright.count_in(&mut finding);
    Ok(finding)
}

fn terrain(cancel: &Cancel) -> Result<Finding, Trouble> {
    let lit = solve(
        stability::terrain_with_lamp(),
        &sides_by_shape(),
        &SolveSettings::normal(),
        cancel,
    )?;
    let error = lit.against_paths(4000, 64, cancel)?;
    Ok(lit.finding(vec![energy_claim(&error, 0.02), error_claim(&error)]))
}

fn black(cancel: &Cancel) -> Result<Finding, Trouble> {
    let lit = solve(
        stability::black_room(),
        &one_sided(),
        &SolveSettings::draft(),
        cancel,
    )?;
    let light = &lit.snapshot.light;
    let reflected = light.irradiance.iter().zip(&light.direct);
    let reflected = reflected.map(|(all, direct)| (*all - *direct).abs().max_element());
    Ok(lit.finding(vec![
        Claim::small(
            "reflected light",
            f64::from(reflected.fold(0.0, f32::max)),
            0.0,
        ),
        lit.balance(0.01),
    ]))
}

fn channels(cancel: &Cancel) -> Result<Finding, Trouble> {
    let reflectance = Vec3::new(0.5, 0.0, 0.9);
    let lit = solve(
        stability::colored_furnace(reflectance),
        &one_sided(),
        &converging(),
        cancel,
    )?;
    let found = lit.mean_irradiance("wall");
    let claims = ["red", "green", "blue"]
        .iter()
        .enumerate()
        .map(|(channel, name)| {
            let expected = furnace_radiosity(PI, f64::from(reflectance[channel]));
            Claim::near(
                format!("irradiance, {name}"),
                expected,
                found[channel],
                1e-3,
            )
        });
    Ok(lit.finding(claims.collect()))
}
