//! The estimated error of a step.

use serde::Serialize;

/// How far the light shown is from the truth, estimated by rays at random points (see `solver::estimate`). All of
/// luminance of the reflected radiance, over the surfaces that reflect without emitting; intervals hold 95 %.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct EstimatedError {
    /// Root mean square error, relative to the root mean square of the true light.
    pub rms: f64,
    /// Lower end of its interval.
    pub rms_low: f64,
    /// Upper end of its interval.
    pub rms_high: f64,
    /// The same without the worst 1 % of the points.
    pub trimmed_rms: f64,
    /// Lower end of its interval.
    pub trimmed_low: f64,
    /// Upper end of its interval.
    pub trimmed_high: f64,
    /// Mean light over mean true light; 1 is right.
    pub energy: f64,
    /// Lower end of its interval.
    pub energy_low: f64,
    /// Upper end of its interval.
    pub energy_high: f64,
    /// Number of points.
    pub points: u64,
    /// Rays shot for it in all steps so far, beside those of the solve.
    pub rays: u64,
}

impl EstimatedError {
    /// The trimmed error and its interval in per cent, for people.
    pub fn text(&self) -> String {
        let per_cent = |share: f64| {
            let value = 100.0 * share;
            if value < 9.95 {
                format!("{value:.1}")
            } else {
                format!("{value:.0}")
            }
        };
        let [middle, low, high] =
            [self.trimmed_rms, self.trimmed_low, self.trimmed_high].map(per_cent);
        format!("{middle} % ({low}…{high})")
    }
}
