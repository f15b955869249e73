//! Groups of neighbouring places, for whose mean errors the error equation is solved.

use glam::Vec3;

/// Places of a group. Fewer, and noise of the residuals returns from group to group; more, and errors of light that
/// differs within a group are spread over all of it.
const GROUP_PLACES: usize = 8;

/// Most rounds of the iteration. Fewer leave light in white rooms; more change nothing.
const MOST_ROUNDS: u32 = 200;

/// Largest change at which it ends, of the largest error.
const TOLERANCE: f32 = 1e-3;

/// The residual at a place, and how errors elsewhere reach it.
pub(super) struct Residual {
    /// Irradiance stored less irradiance gathered, W/m².
    pub residual: Vec3,
    /// The factor of the error of each group, by channel.
    pub row: Vec<Vec3>,
}

impl Residual {
    /// The error of the irradiance there if the groups have these errors, W/m².
    pub(super) fn explained_by(&self, errors: &[Vec3]) -> Vec3 {
        let received = self.row.iter().zip(errors);
        self.residual + received.map(|(factor, error)| factor * error).sum::<Vec3>()
    }

    /// The mean of several; `groups` is their number of groups.
    fn mean(residuals: &[Self], groups: usize) -> Self {
        let share = 1.0 / residuals.len().max(1) as f32;
        let mut mean = Self {
            residual: Vec3::ZERO,
            row: vec![Vec3::ZERO; groups],
        };
        for Self { residual, row } in residuals {
            mean.residual += residual * share;
            for (sum, factor) in mean.row.iter_mut().zip(row) {
                *sum += factor * share;
            }
        }
        mean
    }
}

/// Consecutive places by patch.
pub(super) struct Groups {
    /// The first place of each, and one past the last.
    first_place: Vec<usize>,
    /// The first patch of each.
    first_patch: Vec<u32>,
}

impl Groups {
    /// Groups of places by the patches that they lie on, in order; a patch is never divided.
    pub(super) fn new(patches: impl Iterator<Item = u32>) -> Self {
        let mut groups = Self {
            first_place: Vec::new(),
            first_patch: Vec::new(),
        };
        let (mut count, mut last) = (0, None);
        for patch in patches {
            let begun = groups.first_place.last();
            let is_full = begun.is_none_or(|&first| count - first >= GROUP_PLACES);
            if is_full && last != Some(patch) {
                groups.first_place.push(count);
                groups.first_patch.push(patch);
            }
            (count, last) = (count + 1, Some(patch));
        }
        groups.first_place.push(count);
        groups
    }

    /// Number of groups.
    pub(super) fn count(&self) -> usize {
        self.first_patch.len()
    }

    /// The group that a patch belongs to, the nearest for a patch without places.
    pub(super) fn of_patch(&self, patch: u32) -> usize {
        let after = self.first_patch.partition_point(|&first| first <= patch);
        after.saturating_sub(1)
    }

    /// The mean error of the irradiance in each group, from the residuals of all places: e = s + T e, W/m².
    pub(super) fn errors(&self, residuals: &[Residual]) -> Vec<Vec3> {
        let places = self.first_place.windows(2);
        let means: Vec<Residual> = places
            .map(|ends| Residual::mean(&residuals[ends[0]..ends[1]], self.count()))
            .collect();
        let mut errors: Vec<Vec3> = means.iter().map(|mean| mean.residual).collect();
        for _ in 0..MOST_ROUNDS {
            let next: Vec<Vec3> = means
                .iter()
                .map(|mean| mean.explained_by(&errors))
                .collect();
            let change = largest(next.iter().zip(&errors).map(|(a, b)| a - b));
            errors = next;
            if change <= TOLERANCE * largest(errors.iter().copied()) {
                break;
            }
        }
        errors
    }
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

    #[test]
    fn groups_are_full_and_divide_no_patch() {
        let patches = (0..40).map(|place| place / 12);
        let groups = Groups::new(patches);
        assert_eq!(groups.first_place, [0, 12, 24, 36, 40]);
        assert_eq!(
            [0, 1, 2, 3, 9].map(|patch| groups.of_patch(patch)),
            [0, 1, 2, 3, 3]
        );
        let none = Groups::new(std::iter::empty());
        assert_eq!((none.count(), none.of_patch(3)), (0, 0));
        assert!(none.errors(&[]).is_empty());
    }

    #[test]
    fn errors_solve_the_error_equation() {
        // Two groups that see each other: e = s + T e.
        let groups = Groups::new((0..16).map(|place| place / 8));
        let residual = |group: usize| {
            let mut row = vec![Vec3::ZERO; 2];
            row[1 - group] = Vec3::splat([0.8, 0.5][group]);
            Residual {
                residual: Vec3::splat([1.0, 2.0][group]),
                row,
            }
        };
        let residuals: Vec<Residual> = (0..16).map(|place| residual(place / 8)).collect();
        let errors = groups.errors(&residuals);
        // a = 1 + 0.8 b, b = 2 + 0.5 a.
        let (a, b) = (2.6 / 0.6, 2.5 / 0.6);
        assert!(
            (errors[0].x - a).abs() < 0.01 && (errors[1].x - b).abs() < 0.01,
            "{errors:?}"
        );
        assert!((residuals[0].explained_by(&errors).y - a).abs() < 0.01);
    }
}
