//! Gather estimates at vertices, relative to the linked light, and their shrinkage towards it.
//!
//! Estimates from rays are noisy, and linked light has errors, so the displayed light lies between both. The estimate
//! is shrunk towards the linked light: the part of their difference that remains is the share of its square, over the
//! neighbourhood, that noise does not explain (James and Stein, "Estimation with quadratic loss", 1961). Where links
//! are right, nothing changes.

use glam::Vec4;

use crate::{
    hierarchy::{Channels as _, luminance},
    solver::places::agreement,
};

/// Difference at which neighbours are pooled with half weight, in standard errors of the difference. Smaller leaves
/// grain; larger blurs.
const HALF_DEVIATIONS: f32 = 2.0;

/// Radius in edges of the neighbourhood over which differences are compared with their noise. Smaller takes noise for
/// differences; larger extends corners to their surroundings.
const NEIGHBOURHOOD: u32 = 3;

/// Factor of the variance of the noise in the comparison. Smaller leaves noise; larger leaves errors of links.
const CAUTION: f32 = 2.0;

/// Largest ratio of the estimate to the linked light. Smaller leaves errors of links; larger makes bright spots where
/// the linked light is almost 0.
const MOST_RATIO: f32 = 4.0;

/// An estimate of the indirect irradiance of a vertex from cosine-weighted rays.
#[derive(Clone, Copy, Default)]
pub(super) struct GatherEstimate {
    /// The expected irradiance, if the radiosities counted are differences from the expected ones; else 0.
    expected: Vec4,
    /// Sum of the radiosities met.
    sum: Vec4,
    /// Sum of the squares of their luminances.
    squares: f32,
    /// Number of rays.
    pub rays: u32,
    /// Number of rays that met a back.
    pub backs: u32,
}

impl GatherEstimate {
    /// An estimate without rays of the difference from an expected irradiance.
    pub(super) fn beside(expected: Vec4) -> Self {
        Self {
            expected,
            ..Self::default()
        }
    }

    /// Count a ray that met this radiosity; `None` for a back.
    pub(super) fn count(&mut self, met: Option<Vec4>) {
        self.rays += 1;
        self.backs += u32::from(met.is_none());
        let met = met.unwrap_or_default();
        let seen = luminance(met);
        self.sum += met;
        self.squares += seen * seen;
    }

    /// The estimated irradiance, W/m².
    fn mean(&self) -> Vec4 {
        self.expected + self.sum / self.rays.max(1) as f32
    }

    /// Difference of the estimate to the linked irradiance (luminance), and the square of its standard error: as of
    /// independent rays and one more that differs by all of the linked light, so that a few rays that all meet dark
    /// surfaces are not certain. `variance` is the least variance of one ray, known from links.
    pub(super) fn gap(&self, linked: Vec4, variance: f32) -> (f32, f32) {
        let (count, linked) = (self.rays.max(1) as f32, luminance(linked));
        let difference = luminance(self.sum / count);
        let spread = (self.squares - count * difference * difference).max(count * variance);
        let gap = luminance(self.expected) + difference - linked;
        (gap, (spread + linked * linked) / (count * count))
    }

    /// Ratio of the estimate to the linked irradiance; `variance` as in [`Self::gap`].
    pub(super) fn over(&self, linked: Vec4, variance: f32) -> Ratio {
        let (_, variance) = self.gap(linked, variance);
        let rays = self.rays.max(1) as f32;
        let ratio = self.mean() / linked.max(Vec4::splat(f32::MIN_POSITIVE));
        let unit = luminance(linked).max(f32::MIN_POSITIVE).powi(-2);
        Ratio {
            color: ratio.clamp(Vec4::ZERO, Vec4::splat(MOST_RATIO)),
            // The ratio is bounded, and so is its variance.
            spread: (variance * rays * unit).min(MOST_RATIO * MOST_RATIO * rays),
            rays,
        }
    }
}

/// Ratio of an estimate to the linked irradiance, by colour.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ratio {
    color: Vec4,
    /// Variance of one ray.
    spread: f32,
    /// Effective number of rays.
    rays: f32,
}

impl Ratio {
    fn mean(&self) -> f32 {
        self.color.color().element_sum() / 3.0
    }

    /// Square of the standard error.
    fn variance(&self) -> f32 {
        self.spread / self.rays
    }
}

/// Factors of the linked light by vertex, 0…[`MOST_RATIO`]; 1 without an estimate. Inner edges come twice in `edges`.
pub(crate) fn factors(mut ratios: Vec<Option<Ratio>>, edges: &[[usize; 2]]) -> Vec<Vec4> {
    let edges: Vec<[usize; 2]> = edges
        .iter()
        .copied()
        .filter(|edge| edge.iter().all(|&vertex| ratios[vertex].is_some()))
        .collect();
    pool(&mut ratios, &edges);
    let shrinkage_factors = shrinkage_factors(&ratios, &edges);
    let factor = |(ratio, trust): (Option<Ratio>, f32)| {
        ratio.map_or(Vec4::ONE, |ratio| Vec4::ONE.lerp(ratio.color, trust))
    };
    ratios
        .into_iter()
        .zip(shrinkage_factors)
        .map(factor)
        .collect()
}

/// Pool the ratios of neighbours as far as noise explains their differences.
fn pool(ratios: &mut [Option<Ratio>], edges: &[[usize; 2]]) {
    /// Weighted sums.
    #[derive(Clone, Copy, Default)]
    struct Sums {
        color: Vec4,
        spread: f32,
        weight: f32,
        /// Sum of the squares of weights over rays.
        squares: f32,
    }
    let mut sums = vec![Sums::default(); ratios.len()];
    let mut add = |vertex: usize, ratio: &Ratio, weight: f32, times: f32| {
        let sum = &mut sums[vertex];
        sum.color += ratio.color * weight;
        sum.spread += ratio.spread * weight;
        sum.weight += weight;
        sum.squares += times * weight * weight / ratio.rays;
    };
    for (vertex, ratio) in ratios.iter().enumerate() {
        if let Some(ratio) = ratio {
            add(vertex, ratio, ratio.rays, 1.0);
        }
    }
    for &[a, b] in edges {
        let (Some(one), Some(other)) = (ratios[a], ratios[b]) else {
            continue;
        };
        let gap = one.mean() - other.mean();
        let alike = agreement(gap, one.variance() + other.variance(), HALF_DEVIATIONS);
        // Inner edges come twice, so each counts half. Weights depend on the numbers of rays alone: rays that all met
        // dark surfaces have the least variance, so weights by variance would be biased towards the dark.
        add(a, &other, 0.5 * alike * other.rays, 2.0);
        add(b, &one, 0.5 * alike * one.rays, 2.0);
    }
    for (ratio, sum) in ratios.iter_mut().zip(sums) {
        if let Some(ratio) = ratio {
            *ratio = Ratio {
                color: sum.color / sum.weight,
                spread: sum.spread / sum.weight,
                rays: sum.weight * sum.weight / sum.squares,
            };
        }
    }
}

/// James–Stein factor of each ratio's difference from 1, 0…1: 0 where noise explains it.
fn shrinkage_factors(ratios: &[Option<Ratio>], edges: &[[usize; 2]]) -> Vec<f32> {
    // Squared differences, and their variances.
    let square = |ratio: &Option<Ratio>| {
        ratio.map_or((0.0, 0.0), |ratio| {
            let gap = ratio.mean() - 1.0;
            (gap * gap, ratio.variance())
        })
    };
    let mut squares: Vec<(f32, f32)> = ratios.iter().map(square).collect();
    for _ in 0..NEIGHBOURHOOD {
        let own = |&(gap, noise): &(f32, f32)| (2.0 * gap, 2.0 * noise, 2.0);
        let mut sums: Vec<(f32, f32, f32)> = squares.iter().map(own).collect();
        for &[a, b] in edges {
            for (to, from) in [(a, b), (b, a)] {
                let sum = &mut sums[to];
                *sum = (
                    sum.0 + squares[from].0,
                    sum.1 + squares[from].1,
                    sum.2 + 1.0,
                );
            }
        }
        let mean = |(gap, noise, weight): (f32, f32, f32)| (gap / weight, noise / weight);
        squares = sums.into_iter().map(mean).collect();
    }
    let trust = |(gap, noise): (f32, f32)| {
        (1.0 - CAUTION * noise / gap.max(f32::MIN_POSITIVE)).clamp(0.0, 1.0)
    };
    squares.into_iter().map(trust).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Random;
    use glam::Vec3;

    /// Ratio at a vertex with linked light 1 whose rays meet these luminances in turn.
    fn ratio(met: &[f32], rays: u32) -> Ratio {
        ratio_over(Vec3::ONE.extend(0.0), met, rays)
    }

    fn ratio_over(linked: Vec4, met: &[f32], rays: u32) -> Ratio {
        let mut found = GatherEstimate::default();
        for ray in 0..rays {
            let seen = met[ray as usize % met.len()];
            found.count(Some(Vec3::splat(seen).extend(0.0)));
        }
        found.over(linked, 0.0)
    }

    /// Factors of vertices in a row, each joined with the next twice as over inner edges.
    fn factors_in_row(ratios: Vec<Ratio>) -> Vec<f32> {
        let ends = (1..ratios.len()).flat_map(|next| [[next - 1, next]; 2]);
        let factors = factors(
            ratios.into_iter().map(Some).collect(),
            &ends.collect::<Vec<_>>(),
        );
        factors.into_iter().map(|factor| factor.x).collect()
    }

    #[test]
    fn estimates_from_many_rays_are_hardly_shrunk() {
        for factor in factors_in_row(vec![ratio(&[0.3, 0.4, 0.5], 255); 8]) {
            assert!((factor - 0.4).abs() < 0.01, "{factor}");
        }
    }

    #[test]
    fn linked_light_that_is_right_stays() {
        for rays in [16, 64, 256] {
            for factor in factors_in_row(vec![ratio(&[1.0], rays); 8]) {
                assert_eq!(factor, 1.0);
            }
        }
    }

    #[test]
    fn noise_is_shrunk() {
        let mut random = Random::new(3, 0);
        let noisy = |_| {
            let met: Vec<f32> = (0..16).map(|_| 2.0 * random.uniform()).collect();
            ratio(&met, 16)
        };
        let ratios: Vec<Ratio> = (0..4000).map(noisy).collect();
        let noise = rms(ratios.iter().map(|ratio| ratio.color.x));
        let shown = rms(factors_in_row(ratios).into_iter());
        assert!(noise > 0.12 && shown < 0.2 * noise, "{shown} of {noise}");
    }

    /// Root of the mean square of the difference from 1.
    fn rms(values: impl ExactSizeIterator<Item = f32>) -> f32 {
        let count = values.len() as f32;
        (values.map(|value| (value - 1.0).powi(2)).sum::<f32>() / count).sqrt()
    }

    /// Rays that all meet dark surfaces by chance have little variance: they must not get more weight.
    #[test]
    fn pooled_estimates_from_few_rays_have_no_bias() {
        let mut random = Random::new(5, 0);
        let rare = |_| {
            let met = [(); 16].map(|()| if random.uniform() < 0.1 { 5.0 } else { 0.0 });
            ratio(&met, 16)
        };
        let mut ratios: Vec<Option<Ratio>> = (0..20_000).map(rare).map(Some).collect();
        let mean = |ratios: &[Option<Ratio>]| {
            let sum: f32 = ratios.iter().flatten().map(Ratio::mean).sum();
            sum / ratios.len() as f32
        };
        let before = mean(&ratios);
        let ends: Vec<[usize; 2]> = (1..ratios.len()).map(|next| [next - 1, next]).collect();
        pool(&mut ratios, &ends);
        let after = mean(&ratios);
        assert!(
            (after / before - 1.0).abs() < 0.02,
            "{before} became {after}"
        );
    }

    #[test]
    fn few_rays_that_all_meet_dark_surfaces_are_not_certain() {
        let factors = [1, 16, 256].map(|rays| factors_in_row(vec![ratio(&[0.0], rays)])[0]);
        assert!(factors[0] == 1.0, "{factors:?}");
        assert!(factors.is_sorted_by(|a, b| a > b) && factors[2] < 0.02);
    }

    #[test]
    fn factors_are_bounded() {
        for met in [0.0, 1e-30, 1.0, 1e30] {
            for linked in [0.0, 1e-30, 1e30] {
                let linked = Vec3::splat(linked).extend(0.0);
                let ratio = ratio_over(linked, &[met], 256);
                for factor in factors_in_row(vec![ratio; 3]) {
                    let is_bounded = (0.0..=MOST_RATIO).contains(&factor);
                    assert!(is_bounded, "{factor} for {met} over {linked}");
                }
            }
        }
    }
}
