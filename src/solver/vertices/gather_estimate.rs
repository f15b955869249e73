//! What rays find at vertices over what links tell there, and how far it is to be believed.
//!
//! Rays are noisy, and links are wrong in part, so the light that shows lies between both: it is moved towards what rays
//! found by the share of the square of their difference that noise does not explain, taken over the neighbourhood (the
//! rule of James and Stein). Where links are good, nothing changes.

use glam::Vec4;

use crate::{
    hierarchy::{Channels as _, luminance},
    solver::places::agreement,
};

/// Standard errors of their difference by which neighbours may differ to be pooled by half. Smaller leaves grain, larger
/// blurs.
const HALF_DEVIATIONS: f32 = 2.0;

/// Edges over which differences are compared with their noise. Fewer take noise for differences, more let one corner
/// speak for its surroundings.
const NEIGHBOURHOOD: u32 = 3;

/// What the square of noise is multiplied by before it is compared. Smaller shows noise, larger leaves errors of links.
const CAUTION: f32 = 2.0;

/// Largest ratio of what is found to what is linked: where links tell almost nothing, it tells nothing.
const MOST_RATIO: f32 = 4.0;

/// What rays from a vertex found.
#[derive(Clone, Copy, Default)]
pub(super) struct GatherEstimate {
    /// Sum of the radiosities met.
    sum: Vec4,
    /// Sum of the squares of their luminances.
    squares: f32,
    /// Rays shot.
    pub rays: u32,
    /// Rays that met the back of something.
    pub backs: u32,
}

impl GatherEstimate {
    /// Count a ray by the radiosity that it met: `None` for a back.
    pub(super) fn count(&mut self, met: Option<Vec4>) {
        self.rays += 1;
        self.backs += u32::from(met.is_none());
        let met = met.unwrap_or_default();
        let seen = luminance(met);
        self.sum += met;
        self.squares += seen * seen;
    }

    /// Irradiance.
    fn mean(&self) -> Vec4 {
        self.sum / self.rays.max(1) as f32
    }

    /// By how much more luminance was found than is linked, and the square of its standard error: as if the rays were
    /// independent and one more had been off by all that is linked, so that rays which all meet the dark prove nothing. Rays differ
    /// by no less than links know, which say what the `variance` of one is at least.
    pub(super) fn gap(&self, linked: Vec4, variance: f32) -> (f32, f32) {
        let (count, linked) = (self.rays.max(1) as f32, luminance(linked));
        let mean = luminance(self.mean());
        let spread = (self.squares - count * mean * mean).max(count * variance);
        (mean - linked, (spread + linked * linked) / (count * count))
    }

    /// What was found over what is linked.
    pub(super) fn over(&self, linked: Vec4, variance: f32) -> Ratio {
        let (_, variance) = self.gap(linked, variance);
        let rays = self.rays.max(1) as f32;
        let ratio = self.mean() / linked.max(Vec4::splat(f32::MIN_POSITIVE));
        let unit = luminance(linked).max(f32::MIN_POSITIVE).powi(-2);
        Ratio {
            color: ratio.clamp(Vec4::ZERO, Vec4::splat(MOST_RATIO)),
            // Rays that find more are beyond the largest ratio anyway.
            spread: (variance * rays * unit).min(MOST_RATIO * MOST_RATIO * rays),
            rays,
        }
    }
}

/// What rays find over what is linked.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ratio {
    color: Vec4,
    /// Variance of one ray.
    spread: f32,
    /// Rays, or as many as it is worth.
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

/// By what linked light at vertices is to be multiplied: 1 where nothing was found.
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

/// Take neighbours together, as far as noise explains how they differ.
fn pool(ratios: &mut [Option<Ratio>], edges: &[[usize; 2]]) {
    /// Sums over weights.
    #[derive(Clone, Copy, Default)]
    struct Sums {
        color: Vec4,
        spread: f32,
        weight: f32,
        /// Of the squares of weights over rays.
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
        // Inner edges come twice, so that each counts by half. Weights go by the numbers of rays alone: rays that all met
        // the dark differ least, so weights by variance would show everything too dark.
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

/// How far each ratio is to be trusted, 0…1.
fn shrinkage_factors(ratios: &[Option<Ratio>], edges: &[[usize; 2]]) -> Vec<f32> {
    // Squares of differences, and of their noise.
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

    /// What a vertex with linked light 1 finds where rays meet each of these luminances as often as the others.
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
    fn what_many_rays_find_is_believed() {
        for factor in factors_in_row(vec![ratio(&[0.3, 0.4, 0.5], 255); 8]) {
            assert!((factor - 0.4).abs() < 0.01, "{factor}");
        }
    }

    #[test]
    fn links_that_are_right_stay_as_they_are() {
        for rays in [16, 64, 256] {
            for factor in factors_in_row(vec![ratio(&[1.0], rays); 8]) {
                assert_eq!(factor, 1.0);
            }
        }
    }

    #[test]
    fn noise_is_not_shown() {
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

    /// Rays that meet the dark by chance differ little from each other: they must not count for more.
    #[test]
    fn what_few_rays_find_has_no_bias() {
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
    fn few_rays_that_all_meet_the_dark_leave_a_doubt() {
        let factors = [1, 16, 256].map(|rays| factors_in_row(vec![ratio(&[0.0], rays)])[0]);
        assert!(factors[0] == 1.0, "{factors:?}");
        assert!(factors.is_sorted_by(|a, b| a > b) && factors[2] < 0.02);
    }

    #[test]
    fn no_factor_is_beyond_bounds() {
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
