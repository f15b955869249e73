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
    time_s: f64,
    verdict: &'a str,
}

impl<'a> Row<'a> {
    /// All rows of a case: one for each figure, or one that says why there is none.
    pub fn of(outcome: &'a Outcome) -> Vec<Self> {
        let row = |claim: Option<&'a Claim>| Self {
            group: outcome.group,
            case: &outcome.case,
            quantity: claim.map_or("", |claim| &claim.quantity),
            expected: claim.map(|claim| claim.expected),
            found: claim.map(|claim| claim.found),
            deviation: claim.map(|claim| claim.deviation),
            allowed: claim.map(|claim| claim.allowed),
            time_s: outcome.seconds,
            verdict: match claim {
                Some(claim) => verdict(claim),
                None => outcome.failure.as_deref().unwrap_or(""),
            },
        };
        if outcome.claims.is_empty() {
            return vec![row(None)];
        }
        outcome
            .claims
            .iter()
            .map(|claim| row(Some(claim)))
            .collect()
    }
}

fn verdict(claim: &Claim) -> &'static str {
    if claim.holds() { "holds" } else { "fails" }
}

/// A Markdown table with a line for each figure, under one for its case.
pub fn exact_markdown(outcomes: &[Outcome]) -> String {
    let mut text = String::from(
        "| place | expected | result | deviation | verdict |\n\
         |---|---:|---:|---:|---|",
    );
    for outcome in outcomes {
        text += &format!(
            "\n| **{}**: {} | | | {} s | {} |",
            outcome.case,
            outcome.basis,
            digits(outcome.seconds),
            outcome.failure.as_deref().unwrap_or("").replace('|', "\\|"),
        );
        for claim in &outcome.claims {
            text += &format!(
                "\n| {} | {:.4} | {:.4} | {:.3} % | {} |",
                claim.quantity,
                claim.expected,
                claim.found,
                100.0 * claim.deviation,
                verdict(claim),
            );
        }
    }
    text + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_has_all_cells_and_every_figure_a_row() {
        let outcome = |failure: Option<&str>, claims: Vec<Claim>| Outcome {
            group: Group::Pairs,
            case: "x".to_owned(),
            basis: "F",
            claims,
            failure: failure.map(str::to_owned),
            seconds: 1.0,
        };
        let claims = vec![
            Claim::within("a", 1.0, 1.004, 1.0, 0.005),
            Claim::within("b", 0.0, 0.1, 1.0, 0.005),
        ];
        let outcomes = [
            outcome(None, claims),
            outcome(Some("stopped | early"), Vec::new()),
        ];
        let table = exact_markdown(&outcomes);
        let bars = |line: &str| line.replace("\\|", "").matches('|').count();
        assert!(table.lines().all(|line| bars(line) == 6), "{table}");
        assert!(
            table.contains("| a | 1.0000 | 1.0040 | 0.400 % | holds |"),
            "{table}"
        );
        let rows = outcomes.each_ref().map(Row::of);
        assert_eq!(rows.each_ref().map(Vec::len), [2, 1]);
        assert_eq!((rows[0][0].verdict, rows[0][1].verdict), ("holds", "fails"));
        assert_eq!(rows[1][0].verdict, "stopped | early");
    }
}
