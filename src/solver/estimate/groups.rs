//! Groups of neighbouring points, for whose mean errors the error equation is solved.

use glam::Vec3;

/// Points of a group. Fewer, and noise of the residuals returns from group to group; more, and errors of light that
/// differs within a group are spread over all of it.
const GROUP_POINTS: usize = 8;

/// Most rounds of the iteration. Fewer leave light in white rooms; more change nothing.
const MOST_ROUNDS: u32 = 200;

/// Largest change at which it ends, of the largest error.
const TOLERANCE: f32 = 1e-3;

/// Light that the rays of a point met.
pub(super) struct Gather {
    /// Irradiance, W/m².
    pub irradiance: Vec3,
    /// The factor of the irradiance of each group of points, by channel.
    pub row: Vec<Vec3>,
}

/// Consecutive points by patch.
pub(super) struct Groups {
    /// The first point of each, and one past the last.
    first_point: Vec<usize>,
    /// The first patch of each.
    first_patch: Vec<u32>,
}

impl Groups {
    /// Groups of points by the patches that they lie on, in order; a patch is never divided.
    pub(super) fn new(patches: &[Option<u32>]) -> Self {
        let (mut first_point, mut first_patch) = (Vec::new(), Vec::new());
        for (point, patch) in patches.iter().enumerate() {
            let Some(patch) = *patch else {
                continue;
            };
            let is_first = first_point
                .last()
                .is_none_or(|&first| point - first >= GROUP_POINTS);
            let is_new = point == 0 || patches[point - 1] != Some(patch);
            if is_first && is_new {
                first_point.push(point);
                first_patch.push(patch);
            }
        }
        first_point.push(patches.len());
        Self {
            first_point,
            first_patch,
        }
    }

    /// Number of groups.
    pub(super) fn count(&self) -> usize {
        self.first_patch.len()
    }

    /// The group that a patch belongs to, the nearest for a patch without points.
    pub(super) fn of_patch(&self, patch: u32) -> usize {
        let after = self.first_patch.partition_point(|&first| first <= patch);
        after.saturating_sub(1)
    }

    /// The error of the irradiance at each point, from the residuals: e = s + T e, W/m².
    pub(super) fn errors(&self, gathers: &[Gather], residuals: &[Vec3]) -> Vec<Vec3> {
        // Means over groups.
        let mean = |group: usize| {
            let points = self.first_point[group]..self.first_point[group + 1];
            let number = points.len().max(1) as f32;
            let residual = residuals[points.clone()].iter().sum::<Vec3>() / number;
            let mut row = vec![Vec3::ZERO; self.count()];
            for gather in &gathers[points] {
                for (sum, factor) in row.iter_mut().zip(&gather.row) {
                    *sum += factor / number;
                }
            }
            (residual, row)
        };
        let groups: Vec<(Vec3, Vec<Vec3>)> = (0..self.count()).map(mean).collect();
        let mut errors: Vec<Vec3> = groups.iter().map(|(residual, _)| *residual).collect();
        for _ in 0..MOST_ROUNDS {
            let next: Vec<Vec3> = groups
                .iter()
                .map(|(residual, row)| residual + received(row, &errors))
                .collect();
            let change = largest(next.iter().zip(&errors).map(|(a, b)| a - b));
            errors = next;
            if change <= TOLERANCE * largest(errors.iter().copied()) {
                break;
            }
        }
        // At each point.
        residuals
            .iter()
            .zip(gathers)
            .map(|(residual, gather)| residual + received(&gather.row, &errors))
            .collect()
    }
}

/// What arrives of the errors of all groups.
fn received(row: &[Vec3], errors: &[Vec3]) -> Vec3 {
    row.iter()
        .zip(errors)
        .map(|(factor, error)| factor * error)
        .sum()
}

/// Largest absolute value of any channel.
fn largest(values: impl Iterator<Item = Vec3>) -> f32 {
    values
        .map(|value| value.abs().max_element())
        .fold(0.0, f32::max)
}
