//! The exact cases at the draft preset, whose figures may be off by 3 %: the suite at the normal one is `vecrad report
//! --suite exact`.

use vecrad::{
    experiments::exact::{Outcome, exact_cases, exact_markdown},
    solver::{Cancel, SolveSettings},
};

#[test]
fn drafts_meet_closed_forms() {
    let outcomes: Vec<Outcome> = exact_cases()
        .iter()
        .map(|case| case.run(&SolveSettings::draft(), &Cancel::default()))
        .collect();
    let failed: Vec<Outcome> = outcomes.into_iter().filter(|o| !o.holds()).collect();
    assert!(failed.is_empty(), "{}", exact_markdown(&failed));
}
