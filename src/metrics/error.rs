//! Error of measured radiance against path-traced points, with the reference's own noise taken out.
//!
//! With x the luminance measured, r that of the reference and s its standard error, over n points:
//! `E[(x − r)²]` is the squared error of x plus s², so s² is subtracted. The surfaces that means over the points stand for are given
//! by [`SampledSurfaces`](crate::sampling::SampledSurfaces). Points that emit are omitted, since their own light would
//! dwarf the rest; where every point emits, all count.

use glam::Vec3;
use serde::Serialize;

use crate::{reference::ReferencePoint, scene::luminance};

/// Stands for the scale of a black reference, so that no figure divides by 0.
const SMALLEST_SCALE: f64 = 1e-300;

/// How far measured radiance is from the reference. "Relative" is relative to `reference_rms`. All luminance.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ErrorMeasures {
    /// Points that count.
    pub points: usize,
    /// Relative root mean square difference without the reference's noise: the figure to quote.
    pub relative_rms: f64,
    /// The same with the reference's noise still in it.
    pub relative_rms_noisy: f64,
    /// `relative_rms` without the worst 1 % of the points, which are mostly leaks under contact edges. Only points that
    /// differ by more than the reference's noise can explain are omitted.
    pub relative_rms_trimmed: f64,
    /// Mean measured over mean reference; 1 is right, absent where the reference is black.
    pub energy_ratio: Option<f64>,
    /// The same for red, green and blue.
    pub energy_ratio_rgb: [Option<f64>; 3],
    /// 95th percentile of the absolute difference, relative.
    pub p95: f64,
    /// 95th percentile of the difference over the reference at the same point (at least 0.001 `reference_rms`).
    pub p95_pointwise: f64,
    /// Median of the difference over the reference at the same point.
    pub median_pointwise: f64,
    /// Root mean square of the reference's standard error, relative: errors far below it cannot be measured.
    pub noise_floor: f64,
    /// Root mean square of the reference, W·sr⁻¹·m⁻².
    pub reference_rms: f64,
    /// Points without a measured value; they count as 0.
    pub unmatched: usize,
    /// Points whose measured value is not finite; they count as 0.
    pub nonfinite: usize,
}

/// Noise-corrected errors below this share of the reference's noise cannot be distinguished from 0. Trimming drops points whose
/// noise is large, so what is subtracted from the others is a little too much: by 0.3 of the noise where that is Gaussian
/// and even. A smaller share calls noise an error of 0; a larger one hides what longer references would confirm.
const RELIABLE_SHARE: f64 = 0.3;

/// The smallest error that is distinguishable from 0 under a reference with this noise; all relative.
pub fn smallest_error(noise_floor: f64) -> f64 {
    RELIABLE_SHARE * noise_floor
}

/// A noise-corrected error for people, in per cent, or that it lies below the noise. Both are relative.
pub fn error_text(error: f64, noise_floor: f64) -> String {
    if error < smallest_error(noise_floor) {
        format!("below noise ({})", per_cent(noise_floor))
    } else {
        per_cent(error)
    }
}

/// A share in per cent, with about two significant digits.
fn per_cent(share: f64) -> String {
    let value = 100.0 * share;
    let digits = match value {
        _ if value >= 10.0 || value <= 0.0 => 0,
        _ if value >= 1.0 => 1,
        _ if value >= 0.1 => 2,
        _ => 3,
    };
    format!("{value:.digits$} %")
}

/// Compare measured radiance, one entry per reference point, with the reference. `None` without points.
pub fn measure_error(
    measured: &[Option<Vec3>],
    reference: &[ReferencePoint],
) -> Option<ErrorMeasures> {
    let everything_emits = reference
        .iter()
        .all(|point| point.emission.max_element() > 0.0);
    let pairs: Vec<(Option<Vec3>, &ReferencePoint)> = measured
        .iter()
        .copied()
        .zip(reference)
        .filter(|(_, point)| everything_emits || point.emission.max_element() <= 0.0)
        .collect();
    if pairs.is_empty() {
        return None;
    }
    let samples: Vec<Sample> = pairs
        .iter()
        .map(|(value, point)| Sample::new(*value, point))
        .collect();
    let channel = |i: usize| {
        let [x, r] = [
            mean(pairs.iter().map(|(value, _)| f64::from(usable(*value)[i]))),
            mean(
                pairs
                    .iter()
                    .map(|(_, point)| f64::from(point.radiance()[i])),
            ),
        ];
        ratio(x, r)
    };
    let count_values = |test: &dyn Fn(Option<Vec3>) -> bool| {
        pairs.iter().filter(|(value, _)| test(*value)).count()
    };
    Some(ErrorMeasures {
        energy_ratio_rgb: [channel(0), channel(1), channel(2)],
        unmatched: count_values(&|value| value.is_none()),
        nonfinite: count_values(&|value| value.is_some_and(|value| !value.is_finite())),
        ..luminance_measures(&samples)
    })
}

/// Luminances at one point.
struct Sample {
    measured: f64,
    reference: f64,
    error: f64,
}

impl Sample {
    fn new(measured: Option<Vec3>, point: &ReferencePoint) -> Self {
        Self {
            measured: f64::from(luminance(usable(measured))),
            reference: f64::from(luminance(point.radiance())),
            error: f64::from(point.standard_error),
        }
    }

    fn difference(&self) -> f64 {
        self.measured - self.reference
    }
}

/// All measures that need luminance only; `samples` is not empty.
fn luminance_measures(samples: &[Sample]) -> ErrorMeasures {
    let mean_of = |of: &dyn Fn(&Sample) -> f64| mean(samples.iter().map(of));
    let reference_rms = mean_of(&|s| s.reference.powi(2)).sqrt();
    let scale = if reference_rms > 0.0 {
        reference_rms
    } else {
        SMALLEST_SCALE
    };
    let relative = |value: f64| (value / scale).min(f64::MAX);
    let (square, noise) = (
        mean_of(&|s| s.difference().powi(2)),
        mean_of(&|s| s.error.powi(2)),
    );
    let pointwise: Vec<f64> = samples
        .iter()
        .map(|s| (s.difference().abs() / s.reference.max(1e-3 * scale)).min(f64::MAX))
        .collect();
    let differences: Vec<f64> = samples.iter().map(|s| s.difference().abs()).collect();
    ErrorMeasures {
        points: samples.len(),
        relative_rms: relative((square - noise).max(0.0).sqrt()),
        relative_rms_noisy: relative(square.sqrt()),
        relative_rms_trimmed: relative(trimmed_square(samples).max(0.0).sqrt()),
        energy_ratio: ratio(mean_of(&|s| s.measured), mean_of(&|s| s.reference)),
        p95: relative(percentile(differences, 0.95)),
        p95_pointwise: percentile(pointwise.clone(), 0.95),
        median_pointwise: percentile(pointwise, 0.5),
        noise_floor: relative(noise.sqrt()),
        reference_rms,
        ..ErrorMeasures::default()
    }
}

/// Standard errors of the reference by which a point must differ to be omitted. Smaller, and noise is trimmed away and
/// then subtracted once more; larger, and nothing can be trimmed under a noisy reference.
const OUTLIER_DEVIATIONS: f64 = 4.0;

/// Mean noise-corrected square without the worst 1 %.
fn trimmed_square(samples: &[Sample]) -> f64 {
    let corrected = |s: &Sample| s.difference().powi(2) - s.error.powi(2);
    let mut outliers: Vec<f64> = samples
        .iter()
        .filter(|s| s.difference().abs() > OUTLIER_DEVIATIONS * s.error)
        .map(corrected)
        .collect();
    outliers.sort_by(|a, b| b.total_cmp(a));
    let dropped = (samples.len() / 100).min(outliers.len());
    let sum: f64 = samples.iter().map(corrected).sum();
    let left = sum - outliers[..dropped].iter().sum::<f64>();
    left / (samples.len() - dropped).max(1) as f64
}

/// A measured value that can be summed.
fn usable(measured: Option<Vec3>) -> Vec3 {
    measured
        .filter(|value| value.is_finite())
        .unwrap_or(Vec3::ZERO)
}

/// Mean of at least one value.
fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    values.sum::<f64>() / count
}

fn ratio(measured: f64, reference: f64) -> Option<f64> {
    (reference > 0.0).then(|| (measured / reference).min(f64::MAX))
}

/// The value below which this share of at least one value lies, interpolated between neighbours.
fn percentile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let place = share * (values.len() - 1) as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(values.len() - 1);
    values[below] + (values[above] - values[below]) * place.fract()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::TriangleId;

    fn point(radiance: f32, emission: f32, standard_error: f32) -> ReferencePoint {
        ReferencePoint {
            triangle: TriangleId(0),
            is_back: false,
            barycentric: Vec3::X,
            position: Vec3::ZERO,
            normal: Vec3::Z,
            reflectance: Vec3::ONE,
            emission: Vec3::splat(emission),
            irradiance: Vec3::splat(radiance * std::f32::consts::PI),
            irradiance_error: 0.0,
            standard_error,
        }
    }

    fn values(values: &[f32]) -> Vec<Option<Vec3>> {
        values
            .iter()
            .map(|&value| Some(Vec3::splat(value)))
            .collect()
    }

    #[test]
    fn the_reference_has_no_error_against_itself() {
        let reference = [point(1.0, 0.0, 0.0), point(2.0, 0.0, 0.0)];
        let error = measure_error(&values(&[1.0, 2.0]), &reference).unwrap();
        assert!(error.relative_rms < 1e-6 && error.p95 < 1e-6);
        assert!((error.energy_ratio.unwrap() - 1.0).abs() < 1e-6);
        assert!((error.reference_rms - 2.5_f64.sqrt()).abs() < 1e-6);
    }

    #[test]
    fn noise_of_the_reference_is_subtracted() {
        // Differences of 0.5 everywhere, of which 0.3 is noise: √(0.25 − 0.09) = 0.4.
        let reference = [point(1.0, 0.0, 0.3), point(1.0, 0.0, 0.3)];
        let error = measure_error(&values(&[1.5, 0.5]), &reference).unwrap();
        assert!((error.relative_rms - 0.4).abs() < 1e-6, "{error:?}");
        assert!((error.relative_rms_noisy - 0.5).abs() < 1e-6);
        assert!((error.noise_floor - 0.3).abs() < 1e-6);
        assert!((error.relative_rms_trimmed - 0.4).abs() < 1e-6);
    }

    #[test]
    fn trimming_drops_the_worst_percent() {
        let reference = vec![point(1.0, 0.0, 0.0); 200];
        let mut measured = vec![1.0; 200];
        measured[7] = 100.0;
        let error = measure_error(&values(&measured), &reference).unwrap();
        assert!(error.relative_rms > 5.0 && error.relative_rms_trimmed < 1e-6);
    }

    #[test]
    fn emitters_are_omitted_unless_all_emit() {
        let reference = [point(1.0, 0.0, 0.0), point(1.0, 50.0, 0.0)];
        let error = measure_error(&values(&[1.0, 0.0]), &reference).unwrap();
        assert_eq!(error.points, 1);
        assert!(error.relative_rms < 1e-6);
        let error = measure_error(&values(&[0.0]), &reference[1..]).unwrap();
        assert_eq!(error.points, 1);
        assert!((error.relative_rms - 1.0).abs() < 1e-6);
    }

    #[test]
    fn bad_values_count_as_zero_and_are_named() {
        let reference = [point(1.0, 0.0, 0.0), point(1.0, 0.0, 0.0)];
        let error = measure_error(&[None, Some(Vec3::NAN)], &reference).unwrap();
        assert_eq!((error.unmatched, error.nonfinite), (1, 1));
        assert!((error.relative_rms - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_black_reference_gives_finite_figures() {
        let reference = [point(0.0, 0.0, 0.0)];
        let black = measure_error(&values(&[0.0]), &reference).unwrap();
        assert!(black.relative_rms <= 0.0 && black.energy_ratio.is_none());
        let bright = measure_error(&values(&[f32::MAX / 4.0]), &reference).unwrap();
        assert!(bright.relative_rms.is_finite() && bright.p95_pointwise.is_finite());
        assert!(measure_error(&[], &[]).is_none());
    }

    #[test]
    fn an_error_within_the_noise_is_not_told_as_none() {
        assert_eq!(error_text(0.0, 0.1), "below noise (10 %)");
        assert_eq!(error_text(0.029, 0.1), "below noise (10 %)");
        assert_eq!(error_text(0.031, 0.1), "3.1 %");
        assert_eq!(error_text(0.0, 0.0004), "below noise (0.040 %)");
        assert_eq!(error_text(0.0, 0.0), "0 %");
        assert_eq!(error_text(0.123, 0.002), "12 %");
    }

    #[test]
    fn percentile_interpolates_between_neighbours() {
        assert!((percentile(vec![4.0, 0.0, 1.0, 3.0, 2.0], 0.95) - 3.8).abs() < 1e-12);
        assert!((percentile(vec![7.0], 0.95) - 7.0).abs() < 1e-12);
    }
}
