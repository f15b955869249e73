//! Groups of neighbouring places, for whose mean errors the error equation is solved.

use glam::Vec3;

/// Places of a group, at least. Fewer, and noise of the residuals returns from group to group; more, and errors of light that
/// differs within a group are spread over all of it.
const GROUP_PLACES: usize = 8;

/// Most rounds of the iteration. Fewer leave light in white rooms; more change nothing.
const MOST_ROUNDS: u32 = 200;

/// Largest change at which it ends, of the largest error.
const TOLERANCE: f32 = 1e-3;

/// The residual at a place, and how errors elsewhere reach it.
#[derive(Clone)]
pub(super) struct Residual {
    /// Irradiance stored less irradiance gathered, W/m².
    pub residual: Vec3,
    /// The factor of the error of each group, by channel.
    pub row: Vec<Vec3>,
    /// Its weight among others: the number of rays that it was measured by.
    pub weight: f32,
}

impl Residual {
    /// The error of the irradiance there if the groups have these errors, W/m².
    pub(super) fn explained_by(&self, errors: &[Vec3]) -> Vec3 {
        let received = self.row.iter().zip(errors);
        self.residual + received.map(|(factor, error)| factor * error).sum::<Vec3>()
    }

    /// The mean of several; `groups` is their number of groups.
    fn mean(residuals: &[Self], groups: usize) -> Self {
        let weight = residuals.iter().map(|residual| residual.weight).sum();
        let mut mean = Self {
            residual: Vec3::ZERO,
            row: vec![Vec3::ZERO; groups],
            weight,
        };
        for residual in residuals {
            let share = residual.share(weight);
            mean.residual += residual.residual * share;
            for (sum, factor) in mean.row.iter_mut().zip(&residual.row) {
                *sum += factor * share;
            }
        }
        mean
    }

    /// Its part of the weight of all.
    fn share(&self, all: f32) -> f32 {
        self.weight / all.max(f32::MIN_POSITIVE)
    }
}

/// The place in an order in which neighbours are beside each other: by patch, and within a patch along a Z-order curve over
/// these barycentric coordinates.
pub(super) fn order(patch: u32, barycentric: Vec3) -> u64 {
    let [x, y] = [barycentric.x, barycentric.y].map(|at| (at * f32::from(u16::MAX)) as u64);
    let curve = (0..16).fold(0, |curve, bit| {
        curve | (x >> bit & 1) << (2 * bit) | (y >> bit & 1) << (2 * bit + 1)
    });
    u64::from(patch) << 32 | curve
}

/// Consecutive places by [`order`].
pub(super) struct Groups {
    /// The first place of each, and one past the last.
    first_place: Vec<usize>,
    /// The order of the first place of each.
    first_order: Vec<u64>,
}

impl Groups {
    /// Groups of places that are sorted by this order.
    pub(super) fn new(orders: &[u64]) -> Self {
        let count = match orders.len() {
            0 => 0,
            places => (places / GROUP_PLACES).max(1),
        };
        let first = |group: usize| group * orders.len() / count.max(1);
        Self {
            first_place: (0..=count).map(first).collect(),
            first_order: (0..count).map(|group| orders[first(group)]).collect(),
        }
    }

    /// Number of groups.
    pub(super) fn count(&self) -> usize {
        self.first_order.len()
    }

    /// The group that a place belongs to.
    pub(super) fn of(&self, order: u64) -> usize {
        let after = self.first_order.partition_point(|&first| first <= order);
        after.saturating_sub(1)
    }

    /// Solve the error equation e = s + T e for the mean errors of the groups, from the residuals of all places.
    pub(super) fn solve(self, places: Vec<Residual>) -> Solution {
        let ends = self.first_place.windows(2);
        let means: Vec<Residual> = ends
            .map(|ends| Residual::mean(&places[ends[0]..ends[1]], self.count()))
            .collect();
        let begin = means.iter().map(|mean| mean.residual).collect();
        let errors = converged(begin, |errors| {
            let explained = means.iter().map(|mean| mean.explained_by(errors));
            explained.collect()
        });
        Solution {
            groups: self,
            places,
            means,
            errors,
        }
    }
}

/// The mean errors of groups, and what they follow from.
pub(super) struct Solution {
    groups: Groups,
    places: Vec<Residual>,
    means: Vec<Residual>,
    errors: Vec<Vec3>,
}

impl Solution {
    /// The mean error of the irradiance in each group, W/m².
    pub(super) fn errors(&self) -> &[Vec3] {
        &self.errors
    }

    /// By how much each place changes a quantity that depends on the errors of the groups by these derivatives: its
    /// influence, whose squares add to the variance. The place differs from its group by x − e, and the equation of the
    /// adjoint, z = a + Tᵀ z, tells what follows from that.
    pub(super) fn influences(&self, derivatives: &[Vec3]) -> Vec<f64> {
        let adjoint = converged(derivatives.to_vec(), |adjoint| {
            let mut next = derivatives.to_vec();
            for (mean, factor) in self.means.iter().zip(adjoint) {
                for (sum, row) in next.iter_mut().zip(&mean.row) {
                    *sum += row * factor;
                }
            }
            next
        });
        let mut influences = Vec::with_capacity(self.places.len());
        for (group, ends) in self.groups.first_place.windows(2).enumerate() {
            let places = &self.places[ends[0]..ends[1]];
            let count = places.len() as f32;
            let unbiased = (count / (count - 1.0).max(1.0)).sqrt();
            for place in places {
                let difference = place.explained_by(&self.errors) - self.errors[group];
                let share = place.share(self.means[group].weight) * unbiased;
                influences.push(f64::from(share * adjoint[group].dot(difference)));
            }
        }
        influences
    }
}

/// What an iteration converges to.
fn converged(begin: Vec<Vec3>, next: impl Fn(&[Vec3]) -> Vec<Vec3>) -> Vec<Vec3> {
    let mut values = begin;
    for _ in 0..MOST_ROUNDS {
        let following = next(&values);
        let change = largest(following.iter().zip(&values).map(|(a, b)| a - b));
        values = following;
        if change <= TOLERANCE * largest(values.iter().copied()) {
            break;
        }
    }
    values
}

/// Largest absolute value of any channel.
fn largest(values: impl Iterator<Item = Vec3>) -> f32 {
    values
        .map(|value| value.abs().max_element())
        .fold(0.0, f32::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Random;

    #[test]
    fn neighbours_are_in_one_group() {
        // On two patches, 40 places along a side and 20 near a corner.
        let along = (0..40).map(|place| order(0, Vec3::new(place as f32 / 39.0, 0.0, 0.0)));
        let corner = (0..20).map(|place| order(1, Vec3::splat(place as f32 / 1000.0)));
        let mut orders: Vec<u64> = along.chain(corner).collect();
        assert!(orders.is_sorted());
        orders.sort_unstable();
        let groups = Groups::new(&orders);
        assert_eq!(groups.count(), 7);
        let sizes = groups.first_place.windows(2).map(|ends| ends[1] - ends[0]);
        assert!(
            sizes.clone().all(|size| (8..=9).contains(&size)),
            "{sizes:?}"
        );
        for (group, ends) in groups.first_place.windows(2).enumerate() {
            let places = &orders[ends[0]..ends[1]];
            assert!(places.iter().all(|&place| groups.of(place) == group));
        }
        // Beyond all places, the last one is the nearest.
        assert_eq!(groups.of(order(7, Vec3::ZERO)), 6);
        let none = Groups::new(&[]);
        assert_eq!((none.count(), none.of(3)), (0, 0));
        assert!(none.solve(Vec::new()).errors().is_empty());
    }

    #[test]
    fn z_order_keeps_quarters_together() {
        let of = |x, y| order(0, Vec3::new(x, y, 0.0));
        let quarter = [of(0.1, 0.1), of(0.4, 0.1), of(0.1, 0.4), of(0.4, 0.4)];
        let others = [of(0.6, 0.1), of(0.1, 0.6), of(0.9, 0.0), of(0.0, 0.9)];
        assert!(quarter.iter().max() < others.iter().min());
        assert!(of(1.0, 0.0) < order(1, Vec3::ZERO));
    }

    #[test]
    fn errors_solve_the_error_equation() {
        // Two groups that see each other: e = s + T e.
        let groups = Groups::new(&[0, 1].map(|patch| [patch << 32; 8]).concat());
        let residual = |group: usize| {
            let mut row = vec![Vec3::ZERO; 2];
            row[1 - group] = Vec3::splat([0.8, 0.5][group]);
            Residual {
                residual: Vec3::splat([1.0, 2.0][group]),
                row,
                weight: 1.0,
            }
        };
        let residuals = (0..16).map(|place| residual(place / 8)).collect();
        let solution = groups.solve(residuals);
        let errors = solution.errors();
        // a = 1 + 0.8 b, b = 2 + 0.5 a.
        let (a, b) = (2.6 / 0.6, 2.5 / 0.6);
        assert!(
            (errors[0].x - a).abs() < 0.01 && (errors[1].x - b).abs() < 0.01,
            "{errors:?}"
        );
        assert!((solution.places[0].explained_by(errors).y - a).abs() < 0.01);
    }

    #[test]
    fn influences_tell_the_noise_of_what_follows_from_the_errors() {
        // One group that sees itself by a half, so its error is twice its mean residual.
        let solve = |seed: u64| {
            let mut random = Random::new(seed, 3);
            let place = |_| Residual {
                residual: Vec3::splat(1.0 + 0.4 * (random.uniform() - 0.5)),
                row: vec![Vec3::splat(0.5)],
                weight: 1.0,
            };
            let places = (0..8).map(place).collect();
            Groups::new(&[0; 8]).solve(places)
        };
        // The standard deviation of a mean of 8 such residuals, twice; three channels count thrice.
        let truth = 3.0 * 2.0 * 0.4 / (12f64 * 8.0).sqrt();
        let noise = |seed| {
            let influences = solve(seed).influences(&[Vec3::ONE]);
            influences.iter().map(|one| one * one).sum::<f64>().sqrt()
        };
        let mean = (0..200).map(noise).sum::<f64>() / 200.0;
        assert!((mean / truth - 1.0).abs() < 0.1, "{mean} of {truth}");
    }
}
