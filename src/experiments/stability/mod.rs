//! Stiff and extreme cases with what is known of their light: does the solver stay finite, bounded and right?
//!
//! A [`Case`] lights a scene or several and compares a few figures with a closed form, an independent reference, or an
//! invariant such as the balance of energy. Besides, every step of every solve must keep what `solve` checks: all light
//! finite, not negative, and no more than the emitters can keep up.

mod overestimate;
mod scale;
mod settings;
mod shapes;
mod solve;
mod stiff;
mod table;

pub use table::{Row, stability_markdown};

use std::time::Instant;

use serde::Serialize;

use super::claim::Claim;
use crate::{scene::BuildError, solver::Cancel};

/// The subject of a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Group {
    /// Light that is absorbed slowly, or passes narrow openings.
    Stiff,
    /// Links that overestimate light.
    Overestimate,
    /// Very large, small, bright, dark and far.
    Scale,
    /// Shapes at the limit.
    Geometry,
    /// Settings at their limits.
    Settings,
}

impl Group {
    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stiff => "stiff",
            Self::Overestimate => "overestimate",
            Self::Scale => "scale",
            Self::Geometry => "geometry",
            Self::Settings => "settings",
        }
    }
}

/// The findings of a case.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Finding {
    /// All figures; at least one.
    pub claims: Vec<Claim>,
    /// Steps of all its solves.
    pub steps: u32,
    /// Sweeps of all its solves.
    pub sweeps: u32,
    /// Notes of the solver, each once.
    pub notes: Vec<String>,
}

/// Why a case found nothing.
#[derive(Debug, thiserror::Error)]
pub enum Trouble {
    /// It was told to stop.
    #[error("stopped before the end")]
    Stopped,
    /// Its scene cannot be lit.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// A step broke an invariant.
    #[error("step {step} of {scene}: {what}")]
    Broken {
        /// Name of the scene.
        scene: String,
        /// Number of the step.
        step: u32,
        /// The fault.
        what: String,
    },
}

type Run = dyn Fn(&Cancel) -> Result<Finding, Trouble> + Send + Sync;

/// A case to run.
pub struct Case {
    /// Its subject.
    pub group: Group,
    /// Its name; unique.
    pub name: String,
    /// Whether it takes no more than a second or two in a build without optimisation.
    pub is_quick: bool,
    run: Box<Run>,
}

impl Case {
    fn new(
        group: Group,
        name: impl Into<String>,
        run: impl Fn(&Cancel) -> Result<Finding, Trouble> + Send + Sync + 'static,
    ) -> Self {
        Self {
            group,
            name: name.into(),
            is_quick: true,
            run: Box::new(run),
        }
    }

    /// The same case, omitted where time is short.
    fn slow(self) -> Self {
        Self {
            is_quick: false,
            ..self
        }
    }

    /// Run it on the threads of the caller's pool.
    pub fn run(&self, cancel: &Cancel) -> Outcome {
        let begin = Instant::now();
        let (finding, failure) = match (self.run)(cancel) {
            Ok(finding) => (finding, None),
            Err(trouble) => (Finding::default(), Some(trouble.to_string())),
        };
        Outcome {
            group: self.group,
            case: self.name.clone(),
            finding,
            failure,
            seconds: begin.elapsed().as_secs_f64(),
        }
    }
}

/// The outcome of a case.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Its subject.
    pub group: Group,
    /// Its name.
    pub case: String,
    /// Its findings; without claims where it did not finish.
    pub finding: Finding,
    /// Why it did not finish.
    pub failure: Option<String>,
    /// Time that it took.
    pub seconds: f64,
}

impl Outcome {
    /// A case that ended by a panic.
    pub fn failed(case: &Case, failure: String, seconds: f64) -> Self {
        Self {
            group: case.group,
            case: case.name.clone(),
            finding: Finding::default(),
            failure: Some(failure),
            seconds,
        }
    }

    /// Whether it finished and all its claims hold.
    pub fn holds(&self) -> bool {
        self.failure.is_none()
            && !self.finding.claims.is_empty()
            && self.finding.claims.iter().all(Claim::holds)
    }

    /// The claim that comes nearest to failing, or fails.
    pub fn decisive(&self) -> Option<&Claim> {
        let claims = self.finding.claims.iter();
        claims.max_by(|a, b| a.strain().total_cmp(&b.strain()))
    }
}

/// All cases.
pub fn stability_cases() -> Vec<Case> {
    let mut cases = stiff::cases();
    cases.extend(overestimate::cases());
    cases.extend(scale::cases());
    cases.extend(shapes::cases());
    cases.extend(settings::cases());
    cases
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    #[test]
    fn names_are_unlike() {
        let cases = stability_cases();
        let names: HashSet<&str> = cases.iter().map(|case| case.name.as_str()).collect();
        assert_eq!(names.len(), cases.len());
    }

    #[test]
    fn the_claim_that_fails_decides() {
        let case = Case::new(Group::Stiff, "x", |_| {
            Ok(Finding {
                claims: vec![
                    Claim::near("fine", 1.0, 1.0, 0.1),
                    Claim::near("bad", 1.0, 2.0, 0.1),
                    Claim::near("close", 1.0, 1.09, 0.1),
                ],
                ..Finding::default()
            })
        });
        let outcome = case.run(&Cancel::default());
        assert!(!outcome.holds());
        assert_eq!(
            outcome.decisive().map(|claim| claim.quantity.as_str()),
            Some("bad")
        );
        let stopped = Case::new(Group::Stiff, "x", |_| Err(Trouble::Stopped));
        assert!(!stopped.run(&Cancel::default()).holds());
        let empty = Case::new(Group::Stiff, "x", |_| Ok(Finding::default()));
        assert!(!empty.run(&Cancel::default()).holds());
    }
}
