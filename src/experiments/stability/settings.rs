//! Settings at their limits.

use std::f64::consts::PI;

use super::{
    Case, Claim, Finding, Group, Trouble,
    solve::{Lit, one_sided, solve, solve_within},
};
use crate::{
    reference::analytic::parallel_rectangles,
    scene::builtin::{plates, stability},
    solver::{Cancel, Direct, Oracle, SolveSettings},
};

pub(super) fn cases() -> Vec<Case> {
    vec![
        Case::new(Group::Settings, "one sample", |cancel| samples(1, cancel)),
        Case::new(Group::Settings, "4096 samples", |cancel| {
            samples(4096, cancel)
        })
        .slow(),
        Case::new(Group::Settings, "threshold 0 in 16 MiB", |cancel| {
            limited(16, cancel)
        }),
        Case::new(Group::Settings, "smallest area 0", no_smallest_area),
        Case::new(Group::Settings, "one thread and many", threads),
    ]
}

/// Light of plates over links, judged by so many samples.
fn samples(count: u32, cancel: &Cancel) -> Result<Finding, Trouble> {
    plate_factor(
        &SolveSettings {
            oracle: Oracle::Samples,
            samples: count,
            direct: Direct::Linked,
            ..SolveSettings::draft()
        },
        0.05,
        cancel,
    )
}

/// The form factor of two plates as a solve lights them.
fn plate_factor(
    settings: &SolveSettings,
    allowed: f64,
    cancel: &Cancel,
) -> Result<Finding, Trouble> {
    /// Radiance of the upper plate.
    const EMISSION: f64 = 3.0;
    let lit = solve(plates(1.0), &one_sided(), settings, cancel)?;
    let factor = lit.mean_irradiance("receiver").x / (PI * EMISSION);
    Ok(lit.finding(vec![Claim::near(
        "form factor",
        parallel_rectangles(1.0, 1.0, 1.0),
        factor,
        allowed,
    )]))
}

fn limited(mebibytes: u64, cancel: &Cancel) -> Result<Finding, Trouble> {
    let limit = mebibytes << 20;
    let settings = SolveSettings {
        epsilon: 0.0,
        min_area: 0.0,
        ..SolveSettings::normal()
    };
    let lit = solve_within(
        stability::furnished_room(),
        &one_sided(),
        &settings,
        Some(limit),
        cancel,
    )?;
    let most = lit.reports.iter().map(|report| report.memory_bytes).max();
    let is_full = lit.reports.last().is_some_and(|report| report.is_full);
    Ok(lit.finding(vec![
        Claim::at_most("bytes in use", limit as f64, most.unwrap_or(0) as f64),
        Claim::at_least("the limit is named", 1.0, f64::from(u8::from(is_full))),
        lit.balance(0.03),
    ]))
}

fn no_smallest_area(cancel: &Cancel) -> Result<Finding, Trouble> {
    let settings = SolveSettings {
        min_area: 0.0,
        ..SolveSettings::normal()
    };
    plate_factor(&settings, 0.005, cancel)
}

fn threads(cancel: &Cancel) -> Result<Finding, Trouble> {
    let lit = |threads: usize| -> Result<Lit, Trouble> {
        let solve = || {
            solve(
                stability::furnished_room(),
                &one_sided(),
                &SolveSettings::draft(),
                cancel,
            )
        };
        match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
            Ok(pool) => pool.install(solve),
            // The system gives no more threads: those that there are must do.
            Err(_) => solve(),
        }
    };
    let (one, many) = (lit(1)?, lit(7)?);
    let bits = |lit: &Lit| -> Vec<[u32; 3]> {
        let light = lit.snapshot.light.irradiance.iter();
        light
            .map(|light| light.to_array().map(f32::to_bits))
            .collect()
    };
    let (first, second) = (bits(&one), bits(&many));
    let differing = first.iter().zip(&second).filter(|(a, b)| a != b).count();
    let differing = differing + first.len().abs_diff(second.len());
    let mut finding = many.finding(vec![Claim::small(
        "vertices whose bits differ",
        differing as f64,
        0.0,
    )]);
    one.count_in(&mut finding);
    Ok(finding)
}
