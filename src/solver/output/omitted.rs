//! Omissions of a solve, described for people.

use serde::Serialize;

/// One omitted part, described for people.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Omitted {
    /// Its name; that of an [`Omission`](crate::solver::Omission) if [`Keep`](crate::solver::Keep) can require the
    /// part.
    pub name: &'static str,
    /// The number of omitted things.
    pub count: u64,
    /// The omitted things, with their number.
    pub what: String,
    /// Why they are not needed.
    pub reason: String,
    /// How far the light may differ from that of a solve with them.
    pub bound: &'static str,
}

impl std::fmt::Display for Omitted {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            name,
            what,
            reason,
            bound,
            ..
        } = self;
        write!(out, "{name}: {what}, since {reason}; {bound}")
    }
}
