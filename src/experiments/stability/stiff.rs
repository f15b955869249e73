//! Light that is absorbed slowly, or passes narrow openings.

use std::f64::consts::PI;

use super::{
    Case, Claim, Finding, Group, Trouble,
    solve::{error_claim, one_sided, solve},
};
use crate::{
    reference::analytic::furnace_radiosity,
    scene::builtin::{furnace, stability},
    solver::{Cancel, Note, SolveSettings, StepReport},
};

/// Settings under which light converges to a residual of 1e-4.
pub(super) fn converging() -> SolveSettings {
    SolveSettings {
        tolerance: 1e-4,
        ..SolveSettings::draft()
    }
}

/// Sweeps that white walls may take to a residual of 1e-4.
const MOST_SWEEPS: f64 = 40.0;

pub(super) fn cases() -> Vec<Case> {
    let mut cases: Vec<Case> = [
        (0.5, 1e-3),
        (0.9, 1e-3),
        (0.98, 1e-3),
        (0.999, 1e-2),
        (0.9999, 1e-2),
    ]
    .into_iter()
    .map(|(reflectance, allowed)| {
        Case::new(
            Group::Stiff,
            format!("furnace, reflectance {reflectance}"),
            move |cancel| closed_furnace(reflectance, allowed, cancel),
        )
    })
    .collect();
    cases.push(Case::new(Group::Stiff, "maze of 20 bounces", maze).slow());
    cases.push(Case::new(
        Group::Stiff,
        "white maze of 20 bounces",
        white_maze,
    ));
    cases.push(Case::new(Group::Stiff, "pin-hole between two rooms", pin_hole).slow());
    cases.push(Case::new(
        Group::Stiff,
        "white sphere in white sphere",
        spheres,
    ));
    cases
}

fn closed_furnace(reflectance: f32, allowed: f64, cancel: &Cancel) -> Result<Finding, Trouble> {
    let lit = solve(
        furnace(reflectance, 1.0, 4),
        &one_sided(),
        &converging(),
        cancel,
    )?;
    // B = E_m / (1 − ρ), and what arrives is B as well.
    let expected = furnace_radiosity(PI, f64::from(reflectance));
    let sweeps = lit.reports.iter().map(|report| report.sweeps).max();
    let residual = lit.reports.iter().map(|report| report.residual);
    Ok(lit.finding(vec![
        Claim::near(
            "irradiance",
            expected,
            lit.mean_irradiance("wall").x,
            allowed,
        ),
        lit.balance(allowed),
        Claim::at_most(
            "sweeps of a step",
            MOST_SWEEPS,
            f64::from(sweeps.unwrap_or(0)),
        ),
        Claim::at_most("residual", 1e-4, f64::from(residual.fold(0.0, f32::max))),
    ]))
}

/// Share of the light that may take a wrong way at a bounce, where it has to find a narrow one.
const LOST: f64 = 3e-3;

fn maze(cancel: &Cancel) -> Result<Finding, Trouble> {
    const REFLECTANCE: f32 = 0.9;
    let lit = solve(
        stability::maze(REFLECTANCE),
        &one_sided(),
        &SolveSettings::normal(),
        cancel,
    )?;
    let error = lit.against_paths(2000, 64, cancel)?;
    Ok(lit.finding(vec![
        lit.balance(LOST / (1.0 - f64::from(REFLECTANCE))),
        error_claim(&error),
    ]))
}

/// Light that bounces a thousand times before it is gone must stay bounded; where it has not converged, a note says so.
fn white_maze(cancel: &Cancel) -> Result<Finding, Trouble> {
    let settings = SolveSettings::draft();
    let lit = solve(stability::maze(0.999), &one_sided(), &settings, cancel)?;
    let is_named = |report: &StepReport| {
        // Coarse steps converge to a tolerance as coarse as their links.
        let tolerance = settings.tolerance * report.epsilon / settings.epsilon;
        let has_converged = report.residual <= tolerance;
        has_converged
            || report
                .notes
                .iter()
                .any(|note| matches!(note, Note::NotConverged { .. }))
    };
    let unnamed = lit.reports.iter().filter(|report| !is_named(report));
    Ok(lit.finding(vec![
        Claim::small(
            "unconverged steps without a note",
            unnamed.count() as f64,
            0.0,
        ),
        Claim::at_most("absorbed / emitted", 1.1, lit.absorbed_share()),
    ]))
}

/// Share of the light of a bright room that may be mistaken behind a narrow hole: five times the threshold to which links
/// are refined, relative to the mean.
const BLURRED: f64 = 0.01;

fn pin_hole(cancel: &Cancel) -> Result<Finding, Trouble> {
    const REFLECTANCE: f32 = 0.98;
    let lit = solve(
        stability::rooms_with_pin_hole(REFLECTANCE),
        &one_sided(),
        &SolveSettings::finest(),
        cancel,
    )?;
    // With walls of area W, a hole of area a and even light B in each room: what a room gains by emission and through the
    // hole is what its walls absorb. W (1 − ρ) B + ρ a (B − B') = W E_m, and the same with 0 for the second.
    let reflectance = f64::from(REFLECTANCE);
    let allowed = LOST / (1.0 - reflectance);
    let hole = stability::PIN_HOLE * stability::PIN_HOLE;
    let walls = 6.0 - hole;
    let (loss, passed) = (walls * (1.0 - reflectance), reflectance * hole);
    let share = passed / (loss + passed);
    let first = walls * PI / (loss + passed * (1.0 - share));
    // The irradiance H of B = E_m + ρ H.
    let arrives = |radiosity: f64, emitted: f64| (radiosity - emitted) / reflectance;
    Ok(lit.finding(vec![
        Claim::near(
            "irradiance in the bright room",
            arrives(first, PI),
            lit.mean_irradiance("first").x,
            allowed,
        ),
        // Its error is that of light from the bright room.
        Claim::small(
            "error behind the hole / irradiance in the bright room",
            (lit.mean_irradiance("second").x - arrives(share * first, 0.0)) / arrives(first, PI),
            BLURRED,
        ),
        lit.balance(allowed),
    ]))
}

/// Share by which light may be off where 98 % of it are reflected at each of fifty bounces: 0.03 % at a bounce make 1.6 %.
const SPHERES: f64 = 0.02;

fn spheres(cancel: &Cancel) -> Result<Finding, Trouble> {
    const REFLECTANCE: f32 = 0.98;
    let lit = solve(
        stability::nested_spheres(REFLECTANCE, 6),
        &one_sided(),
        &SolveSettings {
            tolerance: 1e-4,
            ..SolveSettings::normal()
        },
        cancel,
    )?;
    // The inner sphere sees the outer one only; the outer one sees the inner with F = (r / R)². So with what arrives
    // H and B = E_m + ρ H: H_inner = B_outer, H_outer = F B_inner + (1 − F) B_outer.
    let reflectance = f64::from(REFLECTANCE);
    let factor = stability::INNER_SPHERE * stability::INNER_SPHERE;
    // B_outer = ρ (F (E_m + ρ B_outer) + (1 − F) B_outer)
    let outer = reflectance * factor * PI
        / (1.0 - reflectance * (1.0 - factor) - reflectance * reflectance * factor);
    Ok(lit.finding(vec![
        Claim::near(
            "irradiance of the inner sphere",
            outer,
            lit.mean_irradiance("inner").x,
            SPHERES,
        ),
        Claim::near(
            "irradiance of the outer sphere",
            outer / reflectance,
            lit.mean_irradiance("outer").x,
            SPHERES,
        ),
        lit.balance(SPHERES),
    ]))
}
