//! The tests of a scene as a table, and their sum in a sentence.

use super::{Outcome, Verdict};
use crate::metrics::digits;

/// A Markdown table with a line for each test, and below it what is to be said of them.
pub fn check_markdown(outcomes: &[Outcome]) -> String {
    let mut text = String::from(
        "| test | expected | result | deviation | limit | time | verdict |\n\
         |---|---:|---:|---:|---:|---:|---|",
    );
    for outcome in outcomes {
        let claim = outcome.claim.as_ref();
        let cell = |text: Option<String>| text.unwrap_or_else(|| "–".to_owned());
        text += &format!(
            "\n| {} | {} | {} | {} | {} | {} s | {} |",
            outcome.law,
            cell(claim.map(|claim| figure(claim.expected))),
            cell(claim.map(|claim| figure(claim.found))),
            cell(claim.map(|claim| per_cent(claim.deviation))),
            cell(claim.map(|claim| per_cent(claim.allowed))),
            digits(outcome.seconds),
            match &outcome.verdict {
                Verdict::Holds => "holds".to_owned(),
                Verdict::Fails(_) => "fails".to_owned(),
                Verdict::NotApplicable(why) => format!("not applicable: {why}").replace('|', "\\|"),
                Verdict::Stopped => "stopped before the end".to_owned(),
            },
        );
    }
    text.push('\n');
    for outcome in outcomes
        .iter()
        .filter(|outcome| !outcome.remarks.is_empty())
    {
        text += &format!("\n{}: {}.", outcome.law, outcome.remarks.join("; "));
    }
    text + "\n"
}

/// How right the light is, in a sentence: the largest deviation of the tests that hold.
///
/// # Errors
/// A sentence that says what is wrong.
pub fn summary(outcomes: &[Outcome]) -> Result<String, String> {
    let failed: Vec<String> = outcomes
        .iter()
        .filter_map(|outcome| match &outcome.verdict {
            Verdict::Fails(why) => Some(format!("{}: {why}", outcome.law)),
            _ => None,
        })
        .collect();
    if !failed.is_empty() {
        return Err(format!("this file is not lit right: {}", failed.join("; ")));
    }
    let deviations = outcomes.iter().filter_map(|outcome| {
        let holds = outcome.verdict == Verdict::Holds;
        outcome.claim.as_ref().filter(|_| holds)
    });
    let largest = deviations.map(|claim| claim.deviation).reduce(f64::max);
    Ok(match largest {
        Some(largest) => format!("this file is lit right to {}", per_cent(largest)),
        None => "no test applies to this file".to_owned(),
    })
}

/// A share in per cent.
pub(super) fn per_cent(share: f64) -> String {
    match 100.0 * share {
        percent if percent.abs() < 9.95 => format!("{percent:.2} %"),
        percent => format!("{percent:.0} %"),
    }
}

/// Four digits and more, with a power of ten where there would be many zeros.
fn figure(value: f64) -> String {
    if value == 0.0 || (1e-2..1e5).contains(&value.abs()) {
        format!("{value:.4}")
    } else {
        format!("{value:.3e}")
    }
}
