//! What a case says of its light, and whether that holds.

use serde::Serialize;

/// A figure that must be met.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Claim {
    /// Its description, in a few words.
    pub quantity: String,
    /// The required value.
    pub expected: f64,
    /// The value found.
    pub found: f64,
    /// How far that is from what is expected; see the constructors.
    pub deviation: f64,
    /// How far it may be.
    pub allowed: f64,
}

impl Claim {
    /// A value that may be off by a share of what is expected.
    pub(super) fn near(
        quantity: impl Into<String>,
        expected: f64,
        found: f64,
        allowed: f64,
    ) -> Self {
        Self {
            quantity: quantity.into(),
            expected,
            found,
            deviation: (found / expected - 1.0).abs(),
            allowed,
        }
    }

    /// A value that may be off by a share of `scale`, which is above 0.
    pub(super) fn within(
        quantity: impl Into<String>,
        expected: f64,
        found: f64,
        scale: f64,
        allowed: f64,
    ) -> Self {
        Self {
            quantity: quantity.into(),
            expected,
            found,
            deviation: (found - expected).abs() / scale,
            allowed,
        }
    }

    /// A value that is best 0 and may be as large as `allowed`.
    pub(super) fn small(quantity: impl Into<String>, found: f64, allowed: f64) -> Self {
        Self {
            quantity: quantity.into(),
            expected: 0.0,
            found,
            deviation: found.abs(),
            allowed,
        }
    }

    /// A value that may not exceed a bound above 0.
    pub(super) fn at_most(quantity: impl Into<String>, bound: f64, found: f64) -> Self {
        Self {
            quantity: quantity.into(),
            expected: bound,
            found,
            // Written so that a NaN stays one.
            deviation: if found <= bound {
                0.0
            } else {
                found / bound - 1.0
            },
            allowed: 0.0,
        }
    }

    /// A value that may not fall below a bound above 0.
    pub(super) fn at_least(quantity: impl Into<String>, bound: f64, found: f64) -> Self {
        Self {
            quantity: quantity.into(),
            expected: bound,
            found,
            deviation: if found >= bound {
                0.0
            } else {
                1.0 - found / bound
            },
            allowed: 0.0,
        }
    }

    /// Whether it is met. NaN meets nothing.
    pub fn holds(&self) -> bool {
        self.deviation <= self.allowed
    }

    /// How much of what is allowed is used up.
    pub(super) fn strain(&self) -> f64 {
        match (self.holds(), self.allowed > 0.0) {
            (false, _) => f64::INFINITY,
            (true, true) => self.deviation / self.allowed,
            (true, false) => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_a_number_meets_no_claim() {
        let nan = f64::NAN;
        assert!(!Claim::near("x", 1.0, nan, 1e9).holds());
        assert!(!Claim::near("x", 0.0, 0.0, 1e9).holds());
        assert!(!Claim::within("x", 1.0, nan, 1.0, 1e9).holds());
        assert!(!Claim::small("x", nan, 1e9).holds());
        assert!(!Claim::at_most("x", 1.0, nan).holds());
        assert!(!Claim::at_least("x", 1.0, nan).holds());
        assert!(Claim::near("x", 2.0, 2.001, 1e-3).holds());
        assert!(Claim::within("x", 0.0, 0.1, 10.0, 0.02).holds());
        assert!(Claim::at_most("x", 1.0, 1.0).holds());
        assert!(!Claim::at_least("x", 1.0, 0.9).holds());
    }
}
