//! Suites of cases that hold or fail: each is tried in turn, and the files are written after each.

use std::time::Instant;

use anyhow::{Result, bail};

use super::session::Session;
use crate::solver::Cancel;

/// A case to try.
pub(super) trait Trial: Sync {
    /// What came of it.
    type Outcome: Send;

    /// Its name.
    fn name(&self) -> &str;

    /// Run it on the threads of the caller's pool.
    fn run(&self, cancel: &Cancel) -> Self::Outcome;

    /// Its outcome where it ended by a panic, after so many seconds.
    fn failed(&self, failure: String, seconds: f64) -> Self::Outcome;

    /// Whether an outcome is as it should be.
    fn holds(outcome: &Self::Outcome) -> bool;
}

/// Try every case, and `write` the outcomes after each.
///
/// # Errors
/// Those of `write`, and one that names the cases that failed.
pub(super) fn try_each<T: Trial>(
    session: &mut Session<'_>,
    cases: &[T],
    write: impl Fn(&Session<'_>, &[T::Outcome]) -> Result<()>,
) -> Result<()> {
    let mut outcomes = Vec::new();
    let mut failed = Vec::new();
    write(session, &outcomes)?;
    for (number, case) in cases.iter().enumerate() {
        if session.is_interrupted() {
            break;
        }
        session.say(format!(
            "case {} of {}: {}",
            number + 1,
            cases.len(),
            case.name()
        ));
        let begin = Instant::now();
        let outcome = session
            .watch(|cancel| case.run(cancel))
            .unwrap_or_else(|panic| case.failed(panic, begin.elapsed().as_secs_f64()));
        let holds = T::holds(&outcome);
        // A case that an interruption ended has not failed.
        if session.is_interrupted() && !holds {
            break;
        }
        if !holds {
            failed.push(case.name());
        }
        outcomes.push(outcome);
        write(session, &outcomes)?;
    }
    if !failed.is_empty() {
        session.tick();
        bail!(
            "{} of {} cases failed: {}",
            failed.len(),
            outcomes.len(),
            failed.join("; ")
        );
    }
    Ok(())
}
