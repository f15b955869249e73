//! The stability suite without its slow cases: every group, each case by the same code as `vecrad report`.

use vecrad::{
    experiments::stability::{Case, Group, Outcome, stability_cases, stability_markdown},
    solver::Cancel,
};

/// Try the quick cases of a group, and fail with a table of those that do not hold.
fn assert_holds(group: Group) {
    let is_meant = |case: &Case| case.group == group && case.is_quick;
    let outcomes: Vec<Outcome> = stability_cases()
        .iter()
        .filter(|case| is_meant(case))
        .map(|case| case.run(&Cancel::default()))
        .collect();
    assert!(!outcomes.is_empty());
    let failed: Vec<Outcome> = outcomes.into_iter().filter(|o| !o.holds()).collect();
    assert!(failed.is_empty(), "{}", stability_markdown(&failed));
}

#[test]
fn stiff_cases_hold() {
    assert_holds(Group::Stiff);
}

#[test]
fn overestimates_are_held_and_named() {
    assert_holds(Group::Overestimate);
}

#[test]
fn copies_of_any_scale_agree() {
    assert_holds(Group::Scale);
}

#[test]
fn extreme_shapes_hold() {
    assert_holds(Group::Geometry);
}

#[test]
fn extreme_settings_hold() {
    assert_holds(Group::Settings);
}

#[test]
fn a_cancelled_case_stops_and_does_not_hold() {
    let cancel = Cancel::default();
    cancel.cancel();
    let cases = stability_cases();
    let outcome = cases[0].run(&cancel);
    assert!(!outcome.holds());
    assert!(outcome.failure.unwrap().contains("stopped"));
}
