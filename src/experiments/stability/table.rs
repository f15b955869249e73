//! The cases as tables.

use serde::Serialize;

use super::{Claim, Group, Outcome};
use crate::metrics::digits;

/// One figure of one case. Field names are the header of the table of figures.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row<'a> {
    group: Group,
    case: &'a str,
    quantity: &'a str,
    expected: Option<f64>,
    found: Option<f64>,
    deviation: Option<f64>,
    allowed: Option<f64>,
    steps: u32,
    sweeps: u32,
    time_s: f64,
    verdict: &'a str,
}

impl<'a> Row<'a> {
    /// All rows of a case: one for each claim, or one that says why there is none.
    pub fn of(outcome: &'a Outcome) -> Vec<Self> {
        let row = |claim: Option<&'a Claim>| Self {
            group: outcome.group,
            case: &outcome.case,
            quantity: claim.map_or("", |claim| &claim.quantity),
            expected: claim.map(|claim| claim.expected),
            found: claim.map(|claim| claim.found),
            deviation: claim.map(|claim| claim.deviation),
            allowed: claim.map(|claim| claim.allowed),
            steps: outcome.finding.steps,
            sweeps: outcome.finding.sweeps,
            time_s: outcome.seconds,
            verdict: verdict(outcome, claim.is_some_and(Claim::holds)),
        };
        if outcome.finding.claims.is_empty() {
            return vec![row(None)];
        }
        outcome
            .finding
            .claims
            .iter()
            .map(|claim| row(Some(claim)))
            .collect()
    }
}

fn verdict(outcome: &Outcome, holds: bool) -> &str {
    match (&outcome.failure, holds) {
        (Some(failure), _) => failure,
        (None, true) => "holds",
        (None, false) => "fails",
    }
}

/// A Markdown table with a line for each case, of the claim that comes nearest to failing.
pub fn stability_markdown(outcomes: &[Outcome]) -> String {
    let mut text = String::from(
        "| case | quantity | expected | result | deviation | allowed | steps | sweeps | time | verdict |\n\
         |---|---|---:|---:|---:|---:|---:|---:|---:|---|",
    );
    let mut group = None;
    for outcome in outcomes {
        if group.replace(outcome.group) != Some(outcome.group) {
            text += &format!("\n| **{}** | | | | | | | | | |", outcome.group.name());
        }
        let claim = outcome.decisive();
        let cell =
            |of: fn(&Claim) -> f64| claim.map_or("–".to_owned(), |claim| figure(of(claim)));
        text += &format!(
            "\n| {} | {} | {} | {} | {} | {} | {} | {} | {} s | {} |",
            outcome.case,
            claim.map_or("–", |claim| &claim.quantity),
            cell(|claim| claim.expected),
            cell(|claim| claim.found),
            cell(|claim| claim.deviation),
            cell(|claim| claim.allowed),
            outcome.finding.steps,
            outcome.finding.sweeps,
            digits(outcome.seconds),
            verdict(outcome, outcome.holds()).replace('|', "\\|"),
        );
    }
    text + "\n"
}

/// Five digits, with a power of ten where there would be many zeros.
fn figure(value: f64) -> String {
    if value == 0.0 || (1e-2..1e5).contains(&value.abs()) {
        let whole = format!("{value:.4}");
        return whole.trim_end_matches('0').trim_end_matches('.').to_owned();
    }
    format!("{value:.3e}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::stability::Finding;

    fn outcome(failure: Option<String>, claims: Vec<Claim>) -> Outcome {
        Outcome {
            group: Group::Scale,
            case: "x".to_owned(),
            finding: Finding {
                claims,
                ..Finding::default()
            },
            failure,
            seconds: 1.0,
        }
    }

    #[test]
    fn every_line_has_all_cells_and_every_claim_a_row() {
        let outcomes = [
            outcome(
                None,
                vec![
                    Claim::near("a", 1.0, 1.0, 0.1),
                    Claim::near("b", 1.0, 3.0, 0.1),
                ],
            ),
            outcome(Some("stopped | early".to_owned()), Vec::new()),
        ];
        let table = stability_markdown(&outcomes);
        let bars = |line: &str| line.replace("\\|", "").matches('|').count();
        assert!(table.lines().all(|line| bars(line) == 11), "{table}");
        assert!(table.contains("| x | b | 1 | 3 | 2 | 0.1 |"), "{table}");
        let rows = outcomes.each_ref().map(Row::of);
        assert_eq!(rows.each_ref().map(Vec::len), [2, 1]);
        assert_eq!((rows[0][0].verdict, rows[0][1].verdict), ("holds", "fails"));
        assert_eq!(rows[1][0].verdict, "stopped | early");
    }

    #[test]
    fn figures_are_short() {
        assert_eq!(figure(0.0), "0");
        assert_eq!(figure(7.283_185), "7.2832");
        assert_eq!(figure(31_415.926_5), "31415.9265");
        assert_eq!(figure(1.5e-7), "1.500e-7");
    }
}
