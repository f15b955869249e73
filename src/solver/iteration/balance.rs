//! Balance: what an element sends over links adds up, as what it receives does.
//!
//! Form factors of a receiver are scaled so that they add to its coverage (see `coverage`). Form factors err most between
//! near surfaces, so scaling receivers alone shifts light: a sender that its neighbours see too large would lose light to all
//! others' scaling, and closed rooms came out up to 0.6 % too dark. Exchange is reciprocal, `A_i F_ij = A_j F_ji`, so
//! the same factors serve senders: with `d_i F_ij d_j`, rows and columns add to the coverage alike. This is the scaling of
//! a symmetric matrix to given sums (Sinkhorn and Knopp, "Concerning nonnegative matrices and doubly stochastic
//! matrices", 1967), relaxed so that it settles in few sweeps.
//!
//! What emits over links sends as it is: links from it are finer than those over which it receives, so its row says little
//! about its column (three lamps in a hall, all light linked: 0.95 of their power arrives, 0.91 with factors).
//!
//! Energy over that of path tracing at `normal`, before and after: `cornell` 0.9975, 1.0000; `room-8621` 0.9993, 1.0019;
//! `tiled-room` 0.9949, 1.0003; `room-42879` 0.9982, 1.0023, and after the first step 1.033, 1.029.

use std::f32::consts::PI;

use glam::Vec3;

use super::{
    gather::{self, LinkedClusters},
    light::LinkedLight,
};
use crate::solver::{Cancel, SolveSettings, coverage::CoverageMap, direct::Surfaces};

/// A sender's factor is at most this, and at least its inverse. Larger, and what coarse links get wrong by more is mirrored as
/// though it were reciprocal (first step of `cornell`: 6.7 % with 1.1, 7.0 % with 1.2, 18 % without a bound); smaller, and less
/// is balanced (`room-8621` before the last step: 1.0076 of the energy with 1.05). In the last steps anything from 1.1 does.
const MOST_FACTOR: f32 = 1.1;

/// Sweeps of one step. The logarithms of the factors err by at most 1/99 of what they did before (Chebyshev's polynomial of
/// that degree over 1…2); with 2 it is 1/17. Factors of one step are a start for the next.
const SWEEPS: u32 = 3;

/// Find by what leaves' radiosity is multiplied before links carry it, for the links that there are; source tables are up to
/// date before and after. `None` when cancelled.
pub(crate) fn balance(
    linked: &mut LinkedLight,
    surfaces: Surfaces<'_>,
    coverage: &CoverageMap,
    settings: &SolveSettings,
    cancel: &Cancel,
) -> Option<()> {
    let hierarchy = surfaces.hierarchy;
    let linked_clusters = LinkedClusters::new(hierarchy, &linked.links);
    let emits =
        |leaf: usize| !surfaces.is_sampled(leaf) && hierarchy.emission_of(leaf) != Vec3::ZERO;
    for sweep in 0..SWEEPS {
        // The sums of form factors under the present factors.
        let kernel = linked.kernel(hierarchy, settings.method.reading());
        let sums = gather::gather(
            kernel,
            &linked.links,
            &linked_clusters,
            settings.push,
            cancel,
        )?;
        // Move the factors towards what would make these sums right.
        let relaxation = relaxation(sweep);
        let next = |sending: &f32, factor: f32| {
            let next = sending.powf(1.0 - relaxation) * factor.powf(relaxation);
            next.clamp(1.0 / MOST_FACTOR, MOST_FACTOR)
        };
        let factors = coverage.factors(hierarchy, &sums);
        linked.sending = linked
            .sending
            .iter()
            .zip(factors)
            .enumerate()
            .map(|(leaf, (sending, factor))| match factor {
                Some(factor) if !emits(leaf) => next(sending, factor),
                _ => *sending,
            })
            .collect();
        linked.pull(surfaces);
        cancel.proceed()?;
    }
    Some(())
}

/// How far the logarithm of a factor moves in a sweep towards what would make its row right, were all others right: an
/// error of the whole is multiplied by -1 there, one of a single element by 0.
fn relaxation(sweep: u32) -> f32 {
    let angle = PI * (sweep as f32 + 0.5) / SWEEPS as f32;
    1.0 / (1.5 + 0.5 * angle.cos())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_of_any_extent_shrink_to_a_hundredth() {
        // What one sweep leaves of an error that a row repeats by `share`: 1 for all leaves alike, 0 for single ones.
        for share in (0..=100).map(|share| share as f32 / 100.0) {
            let left: f32 = (0..SWEEPS)
                .map(|sweep| 1.0 - relaxation(sweep) * (1.0 + share))
                .product();
            assert!(left.abs() < 1.02e-2, "{share}: {left}");
        }
    }
}
