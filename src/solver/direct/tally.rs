//! Counts of shadow rays, and the noise that they tell.

use std::ops::AddAssign;

/// Number of changes of the outcome between successive rays of one range.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Outcomes {
    /// Outcomes of the first and of the last ray so far.
    ends: Option<(bool, bool)>,
    changes: u32,
}

impl Outcomes {
    pub(super) fn count(&mut self, is_visible: bool) {
        let (first, last) = self.ends.unwrap_or((is_visible, is_visible));
        self.changes += u32::from(last != is_visible);
        self.ends = Some((first, is_visible));
    }

    /// The changes, with the first ray following the last one, so that there are as many pairs as rays.
    pub(super) fn changes(&self) -> u32 {
        self.changes
            + self
                .ends
                .map_or(0, |(first, last)| u32::from(first != last))
    }
}

/// Counts of the shadow rays of one or several points.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Tally {
    pub shot: u32,
    pub visible: u32,
    /// Pairs of rays to neighbouring strata with different outcomes; there are as many pairs as rays.
    pub changes: u32,
    /// Root mean square weight of a visible ray at each point relative to rays that follow the unoccluded light, summed over
    /// the rays.
    pub(super) worth: f32,
}

/// Difference of a point's rays from those of its neighbours that chance explains, in standard errors. Smaller takes
/// chance for a shadow border, which biases the light where few rays are visible; larger misses points that differ.
const LIKELY_DEVIATIONS: f32 = 3.0;

impl Tally {
    /// Whether some rays are visible and others are not.
    pub(super) fn is_mixed(self) -> bool {
        self.visible > 0 && self.visible < self.shot
    }

    /// Root mean square weight of a visible ray relative to rays that follow the unoccluded light: 1 unless rays are guided.
    fn scale(self) -> f32 {
        if self.shot > 0 {
            self.worth / self.shot as f32
        } else {
            1.0
        }
    }

    /// The visible fraction, 0 without rays; of guided rays an upper bound.
    pub(super) fn fraction(self) -> f32 {
        self.scale() * self.visible as f32 / self.shot.max(1) as f32
    }

    /// Variance of a ray within its stratum, 0…¼: half the mean square of the differences between neighbouring strata
    /// (the estimator of successive differences; Wolter, "Introduction to Variance Estimation", ch. 8), and at most
    /// that among all strata, since a sequence of low discrepancy alternates. `more` rays are added, half of them
    /// visible.
    pub(super) fn variance(self, more: f32) -> f32 {
        let shot = (self.shot as f32 + more).max(1.0);
        let fraction = (self.visible as f32 + 0.5 * more) / shot;
        let within = 0.5 * (self.changes as f32 + more) / shot;
        within.min(fraction * (1.0 - fraction)) * self.scale().powi(2)
    }

    /// Whether chance explains the difference of these rays from others, given the visible fraction of the others, with
    /// half a hit and half a miss added.
    pub(super) fn is_like(self, others: Self) -> bool {
        let (own, count) = (self.shot.max(1) as f32, others.shot as f32 + 1.0);
        let expected = others.scale() * (others.visible as f32 + 0.5) / count;
        let variance = |scale: f32, rays: f32| expected * (scale - expected).max(0.0) / rays;
        let variance = variance(self.scale(), own) + variance(others.scale(), count);
        let gap = self.fraction() - expected;
        self.shot == 0 || gap * gap <= LIKELY_DEVIATIONS * LIKELY_DEVIATIONS * variance
    }
}

impl AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        self.shot += other.shot;
        self.visible += other.visible;
        self.changes += other.changes;
        self.worth += other.worth;
    }
}
