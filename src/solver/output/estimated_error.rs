//! The estimated error of a step.

use glam::Vec3;
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

/// The error at one of the random points, of the luminance of the reflected radiance, relative to the root mean square of
/// the true light over all points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorPoint {
    /// Position in frame units.
    pub position: Vec3,
    /// Unit normal towards the lit side.
    pub normal: Vec3,
    /// The light shown there.
    pub light: f32,
    /// Its error by two estimates with independent noise; positive where it is too bright.
    pub errors: [f32; 2],
}

impl ErrorPoint {
    /// The mean of both estimates.
    pub fn error(&self) -> f32 {
        0.5 * (self.errors[0] + self.errors[1])
    }
}

impl EstimatedError {
    /// Whether the error is at most this, relative: the upper end of the interval of the trimmed one.
    pub fn is_within(&self, wanted: f32) -> bool {
        self.trimmed_high <= f64::from(wanted)
    }

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
        match self.trimmed_low > 0.0 {
            true => format!("{middle} % ({low}…{high})"),
            // It cannot be told from none.
            false => format!("below {high} %"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_told_with_their_interval() {
        let error = |low: f64| EstimatedError {
            trimmed_rms: 0.0123,
            trimmed_low: low,
            trimmed_high: 0.112,
            ..EstimatedError::default()
        };
        assert_eq!(error(0.004).text(), "1.2 % (0.4…11)");
        assert_eq!(error(0.0).text(), "below 11 %");
        assert!(error(0.0).is_within(0.12) && !error(0.0).is_within(0.1));
    }
}
