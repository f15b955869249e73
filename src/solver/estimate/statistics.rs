//! Figures of an estimate from the errors at its points.

use glam::Vec3;

use super::samples::Stored;
use crate::{hierarchy::luminance, solver::EstimatedError};

/// Standard errors to either side that hold 95 %.
const DEVIATIONS: f64 = 1.96;

/// One in so many points is omitted by trimmed figures.
const TRIMMED_PART: usize = 100;

/// Standard errors by which a point must be wrong to be omitted: the product of two errors is large where their noise
/// agrees by chance. Smaller, and such points are omitted and the others are too small; larger, and nothing is.
const OUTLIER_DEVIATIONS: f64 = 4.0;

/// Least mean square of the true light over that of the light stored: noise of few points may leave nothing of it.
const SMALLEST_SHARE: f64 = 0.1;

/// Reflected light at a point, luminance; the common factor 1/π is left out.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Reflected {
    /// Which point.
    place: usize,
    stored: f64,
    /// Its error, by two independent estimates.
    errors: [f64; 2],
}

impl Reflected {
    /// From the light stored at the point of this number and two estimates of the error of its irradiance.
    pub(super) fn new(place: usize, stored: &Stored, errors: [Vec3; 2]) -> Self {
        Self {
            place,
            stored: stored_light(stored),
            errors: errors.map(|error| reflected(stored, error)),
        }
    }

    /// The light stored and both errors over a scale.
    pub(super) fn over(&self, scale: f64) -> [f32; 3] {
        let [first, second] = self.errors;
        [self.stored, first, second].map(|value| (value / scale) as f32)
    }

    fn error(&self) -> f64 {
        0.5 * (self.errors[0] + self.errors[1])
    }

    fn square(&self) -> f64 {
        self.errors[0] * self.errors[1]
    }
}

/// Luminance of the light that is reflected where light is stored; the common factor 1/π is left out.
pub(super) fn stored_light(stored: &Stored) -> f64 {
    reflected(stored, stored.irradiance)
}

fn reflected(stored: &Stored, irradiance: Vec3) -> f64 {
    f64::from(luminance((stored.reflectance * irradiance).extend(0.0)))
}

/// What the errors of the points follow from, beside their own rays.
pub(super) trait Influences {
    /// By how much a quantity is changed by what each point has in common with others, and the variance by other places.
    /// The derivatives of the quantity are those by both errors of each point.
    fn of(&self, derivatives: [Vec<f64>; 2]) -> (Vec<f64>, f64);
}

/// A mean and its standard error.
struct Mean {
    mean: f64,
    error: f64,
}

impl Mean {
    /// Of a value at each point, with its derivatives by both errors of the point.
    fn of(
        points: &[&Reflected],
        value: impl Fn(&Reflected) -> f64,
        derivatives: impl Fn(&Reflected) -> [f64; 2],
        influences: &dyn Influences,
    ) -> Self {
        let count = points.len().max(1) as f64;
        let mean = mean(points.iter().map(|point| value(point)));
        // Derivatives of the mean, in the order of the points.
        let place_count = points.iter().map(|point| point.place + 1).max();
        let mut of_mean = [(); 2].map(|()| vec![0.0; place_count.unwrap_or(0)]);
        for point in points {
            for (all, own) in of_mean.iter_mut().zip(derivatives(point)) {
                all[point.place] = own / count;
            }
        }
        let (common, elsewhere) = influences.of(of_mean);
        let mut influence = common;
        let unbiased = (count / (count - 1.0).max(1.0)).sqrt();
        for point in points {
            influence[point.place] += unbiased * (value(point) - mean) / count;
        }
        let variance = influence.iter().map(|one| one * one).sum::<f64>() + elsewhere;
        Self {
            mean,
            error: variance.sqrt(),
        }
    }

    /// The root of the mean and of both ends of its interval, over a scale. A square is not less than 0, so that noise which
    /// makes its mean so does not make the upper end small.
    fn roots(&self, scale: f64) -> [f64; 3] {
        let half = DEVIATIONS * self.error;
        [self.mean, self.mean - half, self.mean.max(0.0) + half]
            .map(|square| (square.max(0.0).sqrt() / scale).min(f64::MAX))
    }
}

fn mean(values: impl Iterator<Item = f64> + Clone) -> f64 {
    values.clone().sum::<f64>() / values.count().max(1) as f64
}

/// Root mean square of the true light, from the points with rays and the light stored at `all` points: that of the light
/// stored, and what its error changes. More than 0.
pub(super) fn true_rms(points: &[Reflected], all: &[f64]) -> f64 {
    let change = |point: &Reflected| point.square() - 2.0 * point.stored * point.error();
    let stored_square = mean(all.iter().map(|stored| stored * stored));
    let square = stored_square + mean(points.iter().map(change));
    let scale = square.max(SMALLEST_SHARE * stored_square).sqrt();
    scale.max(f64::MIN_POSITIVE)
}

/// All figures but the counts, likewise, relative to that root mean square.
pub(super) fn estimated(
    points: &[Reflected],
    all: &[f64],
    scale: f64,
    influences: &dyn Influences,
) -> EstimatedError {
    let mut kept: Vec<&Reflected> = points.iter().collect();
    let swapped = |point: &Reflected| [point.errors[1], point.errors[0]];
    let square = |points: &[&Reflected]| Mean::of(points, Reflected::square, swapped, influences);
    let [rms, rms_low, rms_high] = square(&kept).roots(scale);
    // Without the worst points, as far as noise does not explain them.
    let noise = |point: &Reflected| (0.5 * (point.errors[0] - point.errors[1])).powi(2);
    let noise = mean(points.iter().map(noise)).sqrt();
    kept.sort_by(|a, b| b.error().abs().total_cmp(&a.error().abs()));
    let is_outlier = |point: &&&Reflected| point.error().abs() > OUTLIER_DEVIATIONS * noise;
    let outliers = kept.iter().take_while(is_outlier).count();
    let trimmed = &kept[outliers.min(points.len() / TRIMMED_PART)..];
    let [trimmed_rms, trimmed_low, trimmed_high] = square(trimmed).roots(scale);
    // Energy.
    let stored = mean(all.iter().copied());
    let error = Mean::of(&kept, Reflected::error, |_| [0.5; 2], influences);
    let energy = |error: f64| {
        let truth = stored - error;
        if truth > 0.0 { stored / truth } else { 1.0 }
    };
    let half = DEVIATIONS * error.error;
    EstimatedError {
        rms,
        rms_low,
        rms_high,
        trimmed_rms,
        trimmed_low,
        trimmed_high,
        energy: energy(error.mean),
        energy_low: energy(error.mean - half),
        energy_high: energy(error.mean + half),
        points: 0,
        rays: 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Random;

    /// Points that have nothing in common.
    struct Independent;

    impl Influences for Independent {
        fn of(&self, [derivatives, _]: [Vec<f64>; 2]) -> (Vec<f64>, f64) {
            (vec![0.0; derivatives.len()], 0.0)
        }
    }

    /// Points of light 1 with an error, and noise of this deviation in both estimates.
    fn points(count: usize, noise: f64, error: impl Fn(usize) -> f64) -> Vec<Reflected> {
        let mut random = Random::new(3, 4);
        let mut uniform = || f64::from(random.uniform()) - 0.5;
        let mut point = |index: usize| Reflected {
            place: index,
            stored: 1.0 + error(index),
            errors: [(); 2].map(|()| error(index) + noise * 12f64.sqrt() * uniform()),
        };
        (0..count).map(&mut point).collect()
    }

    fn figures(points: &[Reflected]) -> EstimatedError {
        let all: Vec<f64> = points.iter().map(|point| point.stored).collect();
        estimated(points, &all, true_rms(points, &all), &Independent)
    }

    #[test]
    fn noise_is_not_taken_for_an_error() {
        let error = figures(&points(4000, 0.2, |_| 0.02));
        assert!(error.rms_low <= 0.02 && error.rms_high >= 0.02, "{error:?}");
        assert!(
            error.trimmed_low <= 0.02 && error.trimmed_high >= 0.02,
            "{error:?}"
        );
        assert!(
            error.energy_low <= 1.02 && error.energy_high >= 1.02,
            "{error:?}"
        );
        assert!(error.rms_high < 0.1);
    }

    #[test]
    fn the_worst_hundredth_is_omitted_where_noise_does_not_explain_it() {
        let error = figures(&points(
            1000,
            0.001,
            |point| if point < 10 { 5.0 } else { 0.02 },
        ));
        assert!((error.trimmed_rms - 0.02).abs() < 0.001, "{error:?}");
        assert!(error.rms > 0.4, "{error:?}");
    }

    #[test]
    fn a_mean_square_below_0_does_not_make_the_interval_narrow() {
        let [middle, low, high] = Mean {
            mean: -4.0,
            error: 1.0,
        }
        .roots(2.0);
        assert_eq!((middle, low), (0.0, 0.0));
        assert!((high - DEVIATIONS.sqrt() / 2.0).abs() < 1e-9, "{high}");
    }

    #[test]
    fn black_scenes_have_no_error() {
        let error = figures(&vec![Reflected::default(); 64]);
        assert_eq!(
            (error.rms, error.trimmed_high, error.energy),
            (0.0, 0.0, 1.0)
        );
        let error = estimated(&[], &[], true_rms(&[], &[]), &Independent);
        assert_eq!((error.rms_high, error.energy), (0.0, 1.0));
    }
}
