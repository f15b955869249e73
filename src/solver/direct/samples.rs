//! Samples of direct light at a point: the visible fraction of the unoccluded light, and its standard error.

use glam::{Vec3, Vec4};

use super::{control::Control, tally::Tally};
use crate::{geometry::SphericalTriangle, hierarchy::luminance};

/// Shadow rays from a point to one target. The unoccluded light of the target is known, so only the ratios of their
/// weights count: otherwise a few rays of large weight would determine the fraction for all targets.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Bundle {
    /// The spherical triangle of the emitter, if its solid angle is large.
    pub(super) seen: Option<SphericalTriangle>,
    /// Rays tried.
    pub(crate) rays: u32,
    shot: u32,
    visible: u32,
    /// As [`DirectLight::worth`], of its rays.
    worth: f32,
    /// As [`DirectLight::control`], of its rays.
    control: Control,
    /// Weights of the rays shot.
    weight: f32,
    /// The same by colour, for colours of luminance 1.
    sent: Vec4,
    /// The same of the visible rays.
    arrived: Vec4,
}

impl Bundle {
    /// An empty bundle; `seen` is the spherical triangle of an emitter with a large solid angle.
    pub(super) fn towards(seen: Option<SphericalTriangle>) -> Self {
        Self {
            seen,
            ..Self::default()
        }
    }

    /// Count a ray; `passing` is what passes along it, by channel, 0…1. `worth` is its weight relative to a ray that follows
    /// the unoccluded light, of weight `weight`.
    pub(super) fn count(&mut self, weight: f32, worth: f32, color: Vec4, passing: Vec3) {
        self.weight += weight;
        self.sent += color * weight;
        self.shot += 1;
        self.control.count(weight, worth, passing);
        if passing != Vec3::ZERO {
            self.arrived += color * (weight * worth) * passing.extend(1.0);
            self.visible += 1;
            self.worth += worth * worth;
        }
    }
}

/// Direct light of a point, estimated by its shadow rays.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct DirectLight {
    /// Unoccluded irradiance, W/m²; before the first ray an expected value, 0 if there is none.
    pub(super) exact: Vec4,
    /// Weights of all rays, by colour.
    sent: Vec4,
    /// Weights of the visible rays, by colour.
    arrived: Vec4,
    /// Rays tried: those of weight 0 are not shot.
    pub tried: u32,
    /// Rays shot.
    pub shot: u32,
    /// Visible rays.
    visible: u32,
    /// As [`Tally::changes`].
    pub(super) changes: u32,
    /// Squares of the weights of the visible rays relative to rays that follow the unoccluded light, and the expected one of
    /// one more: weights differ where rays are guided, and noise grows with their second moment.
    worth: f32,
    /// Their weights.
    control: Control,
}

impl DirectLight {
    /// The light before the first ray, with an expected unoccluded irradiance, to which the error of the light of many
    /// emitters is then relative.
    pub(super) fn expected(exact: Vec4) -> Self {
        Self {
            exact,
            ..Self::default()
        }
    }

    /// The light that another point near this one got, until this one is sampled itself.
    pub(super) fn borrowed(self) -> Self {
        Self {
            exact: self.irradiance(),
            sent: Vec4::ONE,
            arrived: Vec4::ONE,
            ..Self::default()
        }
    }

    /// Expect a square of the weights of visible rays relative to rays that follow the unoccluded light.
    pub(super) fn expect_square(&mut self, square: f32) {
        if self.worth == 0.0 {
            self.worth = square;
        }
    }

    /// Root mean square weight of visible rays relative to rays that follow the unoccluded light: 1 unless rays are guided.
    fn scale(&self) -> f32 {
        match self.worth {
            0.0 => 1.0,
            worth => (worth / (self.visible + 1) as f32).sqrt(),
        }
    }

    /// Add a bundle of rays.
    pub(super) fn count(&mut self, bundle: &Bundle) {
        self.shot += bundle.shot;
        self.visible += bundle.visible;
        self.worth += bundle.worth;
        if bundle.weight > 0.0 {
            let by_ray = bundle.rays as f32 / bundle.weight;
            self.control.add(bundle.control, by_ray);
            self.sent += bundle.sent * by_ray;
            self.arrived += bundle.arrived * by_ray;
        }
    }

    /// The sum of the light of several groups of emitters, the colours of each times a factor. Groups with a factor of
    /// 0 add only their tried rays.
    pub(super) fn mixed(parts: impl Iterator<Item = (Self, Vec4)>) -> Self {
        let mut mixed = Self::default();
        for (part, factor) in parts {
            let exact = part.exact * factor;
            mixed.tried += part.tried;
            if luminance(exact) <= 0.0 {
                continue;
            }
            mixed.exact += exact;
            // As rays of the new colours would count: each with a luminance of about 1.
            mixed.sent += exact;
            mixed.arrived += exact * part.fraction();
            mixed.shot += part.shot;
            mixed.visible += part.visible;
            mixed.changes += part.changes;
        }
        let total = luminance(mixed.exact);
        if total > 0.0 {
            // Without rays only the ratio of the weights counts.
            let by_ray = mixed.shot.max(1) as f32 / total;
            mixed.sent *= by_ray;
            mixed.arrived *= by_ray;
        }
        mixed
    }

    /// Set the fraction to 1 without a ray, in a clear scene.
    pub(super) fn arrive_whole(&mut self) {
        (self.sent, self.arrived) = (Vec4::ONE, Vec4::ONE);
    }

    /// Direct irradiance.
    pub(super) fn irradiance(&self) -> Vec4 {
        self.exact * self.fraction()
    }

    /// Direct irradiance from few rays without bias by colour: what is known to be visible of the unoccluded light, by colour,
    /// and the mean difference of the rays from that. The closer what is known, the less noise.
    pub(super) fn irradiance_near(&self, visible: Vec4, rays: u32) -> Vec4 {
        let by_ray = luminance(self.exact) / rays.max(1) as f32;
        let sent = self.sent * self.control.mean();
        self.exact * visible + (self.arrived - sent * visible) * by_ray
    }

    /// Unoccluded irradiance.
    pub(super) fn unoccluded(&self) -> Vec4 {
        self.exact
    }

    /// The visible fraction of the unoccluded irradiance, by colour, 0…1.
    pub(super) fn fraction(&self) -> Vec4 {
        let correction = self.control.correction(self.shot);
        let ratio = |arrived: f32, sent: f32| {
            if sent > 0.0 {
                (arrived / sent + correction).clamp(0.0, 1.0)
            } else {
                0.0
            }
        };
        Vec4::new(
            ratio(self.arrived.x, self.sent.x),
            ratio(self.arrived.y, self.sent.y),
            ratio(self.arrived.z, self.sent.z),
            0.0,
        )
    }

    /// Counts of its rays.
    pub(super) fn tally(&self) -> Tally {
        Tally {
            shot: self.shot,
            visible: self.visible,
            changes: self.changes,
            worth: self.scale() * self.shot as f32,
        }
    }

    /// Standard error of the luminance, estimated by the rays of its neighbours, unless its own are unlikely beside
    /// them. So whether more rays are shot does not depend on its own outcomes, which would bias the light: where few
    /// rays are visible, most points would stop after their first rays, and only points with visible rays would get
    /// more.
    pub(super) fn error_among(&self, neighbours: Tally) -> f32 {
        let own = self.tally();
        if neighbours.shot == 0 || !own.is_like(neighbours) {
            return self.error();
        }
        let variance = neighbours.variance(0.0) / self.shot.max(1) as f32;
        luminance(self.exact) * variance.sqrt()
    }

    /// Square of the standard error of the fraction; 0 if all rays have the same outcome.
    fn fraction_variance(&self) -> f32 {
        self.tally().variance(0.0) / self.shot.max(1) as f32
    }

    /// Standard error of the fraction, with half a hit and half a miss added, so that it is above 0 even if all rays
    /// have the same outcome.
    pub(super) fn fraction_doubt(&self) -> f32 {
        (self.tally().variance(1.0) / (self.shot as f32 + 1.0)).sqrt()
    }

    /// As [`Self::fraction_doubt`] for the luminance.
    pub(super) fn doubt(&self) -> f32 {
        luminance(self.exact) * self.fraction_doubt()
    }

    /// Standard error of the luminance.
    pub(super) fn error(&self) -> f32 {
        luminance(self.exact) * self.fraction_variance().sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{geometry::Random, solver::direct::tally::Outcomes};

    #[test]
    fn weights_of_rays_that_all_pass_do_not_make_noise_and_others_have_no_bias() {
        // Rays to the 1 % of the light that is visible, or everywhere, half of each; of a point that sees a part of it.
        let mut random = Random::new(3, 0);
        for (seen, tolerance) in [(1.0, 1e-5), (0.0, 0.0), (0.4, 0.02), (0.004, 0.0004)] {
            let (mut sum, count) = (0.0, 2000);
            for _ in 0..count {
                let (mut light, mut bundle) = (DirectLight::default(), Bundle::default());
                for _ in 0..16 {
                    bundle.rays += 1;
                    let is_guided = random.uniform() < 0.5;
                    let place = random.uniform() * if is_guided { 0.01 } else { 1.0 };
                    let density = 0.5 + if place < 0.01 { 50.0 } else { 0.0 };
                    let passes = f32::from(u8::from(place < seen));
                    bundle.count(1.0, 1.0 / density, Vec4::ONE, Vec3::splat(passes));
                }
                light.count(&bundle);
                sum += light.fraction().x;
                if seen == 1.0 {
                    assert!((light.fraction().x - 1.0).abs() < 1e-5);
                }
            }
            let mean = sum / count as f32;
            assert!((mean - seen).abs() <= tolerance, "{mean} for {seen}");
        }
    }

    /// Tally of successive outcomes.
    fn tally(outcomes: impl Iterator<Item = bool>) -> Tally {
        let (mut tally, mut changes) = (Tally::default(), Outcomes::default());
        for is_visible in outcomes {
            tally.shot += 1;
            tally.visible += u32::from(is_visible);
            changes.count(is_visible);
        }
        tally.changes = changes.changes();
        tally.worth = tally.shot as f32;
        tally
    }

    #[test]
    fn few_rays_have_no_bias_whatever_is_believed_visible() {
        // Half of the light is red and hidden, the other half is green and seen.
        let exact = Vec4::new(1.0, 2.0, 0.0, 0.0);
        let power = luminance(exact);
        let colors = [Vec4::new(1.0, 0.0, 0.0, 0.0), Vec4::new(0.0, 2.0, 0.0, 0.0)];
        for known in [0.0, 0.4, 1.0] {
            let mut mean = Vec4::ZERO;
            for (color, passing) in colors.into_iter().zip([Vec3::ZERO, Vec3::ONE]) {
                let mut bundle = Bundle {
                    rays: 1,
                    ..Bundle::default()
                };
                bundle.count(1.0, 1.0, color / luminance(color), passing);
                let mut light = DirectLight::expected(exact);
                light.count(&bundle);
                mean += light.irradiance_near(Vec4::splat(known), 1) * (luminance(color) / power);
            }
            assert!(mean.abs_diff_eq(colors[1], 1e-5), "{mean} for {known}");
        }
    }

    #[test]
    fn the_noise_of_rays_without_a_pattern_is_that_of_independent_ones() {
        let mut random = Random::new(1, 0);
        for part in [0.1, 0.5, 0.8] {
            let variance = tally((0..20_000).map(|_| random.uniform() < part)).variance(0.0);
            let expected = part * (1.0 - part);
            assert!(
                (variance / expected - 1.0).abs() < 0.05,
                "{variance} for {part}"
            );
        }
    }

    #[test]
    fn the_noise_within_strata_is_estimated_and_not_that_among_them() {
        const STRATA: u32 = 32;
        let mut random = Random::new(2, 0);
        let (mut error, mut estimate) = (0.0, 0.0);
        const TRIALS: u32 = 4000;
        for _ in 0..TRIALS {
            // A shadow over a random interval of the light.
            let ends = [0.1, 0.6].map(|end| end + 0.2 * random.uniform());
            let is_visible = |stratum: u32| {
                let at = (stratum as f32 + random.uniform()) / STRATA as f32;
                at < ends[0] || at > ends[1]
            };
            let tally = tally((0..STRATA).map(is_visible));
            let expected = 1.0 - (ends[1] - ends[0]);
            error += (tally.fraction() - expected).powi(2);
            estimate += tally.variance(0.0) / STRATA as f32;
        }
        // Independent rays err by seven times as much.
        let ratio = estimate / error;
        assert!((1.0..4.0).contains(&ratio), "{ratio}");
    }

    #[test]
    fn rays_that_alternate_are_no_noisier_than_independent_ones() {
        assert_eq!(tally((0..64).map(|ray| ray % 2 == 0)).variance(0.0), 0.25);
        assert_eq!(tally([true; 16].into_iter()).variance(0.0), 0.0);
        assert!(tally([true; 16].into_iter()).variance(1.0) > 0.0);
    }
}
