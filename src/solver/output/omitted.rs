//! What a solve left out, for people.

use serde::Serialize;

/// One thing that was left out, for people.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Omitted {
    /// What it is called; where it is the name of an [`Omission`](crate::solver::Omission), it can be kept.
    pub name: &'static str,
    /// How many of it.
    pub count: u64,
    /// What was left out.
    pub what: String,
    /// Why it is not needed.
    pub reason: String,
    /// How far the light may differ from that with it.
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
