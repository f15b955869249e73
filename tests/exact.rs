//! The exact cases at the draft preset, whose figures may be off by 3 %: at the normal one they are `vecrad report --suite
//! exact`.

use vecrad::{
    experiments::exact::{Outcome, exact_cases, exact_markdown},
    solver::{Cancel, SolveSettings},
};

/// Cases that drafts miss: the penumbra of a long edge is coarser than the points that are asked for.
const MISSED: [&str; 1] = ["5.7"];

/// Cases that take too long for a test: most of the sky is tried in vain through a small opening.
const SLOW: [&str; 1] = ["5.9"];

#[test]
fn drafts_meet_closed_forms() {
    let is_of = |name: &str, numbers: &[&str]| numbers.iter().any(|start| name.starts_with(start));
    let outcomes: Vec<Outcome> = exact_cases()
        .iter()
        .filter(|case| !is_of(&case.name, &SLOW))
        .map(|case| case.run(&SolveSettings::draft(), &Cancel::default()))
        .collect();
    let odd = |outcome: &Outcome| outcome.holds() == is_of(&outcome.case, &MISSED);
    let odd: Vec<Outcome> = outcomes.into_iter().filter(odd).collect();
    assert!(odd.is_empty(), "{}", exact_markdown(&odd));
}
