//! Anderson acceleration of a fixed point `x = g(x)` over colours (Anderson 1965; Walker & Ni 2011).
//!
//! The next iterate is the combination of the last few whose residual `g(x) − x` would be smallest if `g` were linear.
//! Each colour channel has its own coefficients, since channels hardly depend on each other. Sums are in double
//! precision and in fixed order, so that the result is the same on any number of threads.

use std::collections::VecDeque;

use glam::{DVec3, Vec3, Vec4};
use rayon::prelude::*;

use crate::{hierarchy::Channels as _, solver::sums::ordered_sum};

/// Values that one task combines.
const CHUNK: usize = 4096;

/// Smallest squared share of a direction that is independent of the newer ones; other directions are omitted. Larger,
/// and slow modes are lost; smaller, and rounding of single precision is amplified.
const LEAST_NEW: f64 = 1e-10;

/// Smallest change of an iterate, as a share of all light, from which a contraction is measured. Smaller, and rounding
/// counts; larger, and fast iterations have none.
const LEAST_CHANGE: f64 = 1e-5;

/// Differences between the residuals of two successive iterates, and between their images.
struct Change {
    residual: Vec<Vec3>,
    image: Vec<Vec3>,
}

/// State of an accelerated iteration.
pub(crate) struct Anderson {
    depth: usize,
    changes: VecDeque<Change>,
    /// Residual and image of the last iterate.
    last: Option<(Vec<Vec3>, Vec<Vec3>)>,
}

impl Anderson {
    /// Before the first iterate; `depth` iterates are remembered. With 0 the iteration is not accelerated.
    pub(crate) fn new(depth: usize) -> Self {
        Self {
            depth,
            changes: VecDeque::with_capacity(depth),
            last: None,
        }
    }

    /// Largest memory in bytes for `count` values.
    pub(crate) const fn memory_bytes(depth: usize, count: usize) -> usize {
        2 * (depth + 1) * count * size_of::<Vec3>()
    }

    /// The next iterate from the present one and its image: finite, not negative, and with the image's fourth channel.
    /// `weights` are those of the sums of squares.
    pub(crate) fn next(&mut self, weights: &[f32], at: &[Vec4], image: &[Vec4]) -> Vec<Vec4> {
        let residual = map(image, at, |image, at| (image - at).color());
        let image_colors: Vec<Vec3> = image.par_iter().map(|image| image.color()).collect();
        if let Some((last_residual, last_image)) = &self.last
            && self.depth > 0
        {
            if self.changes.len() == self.depth {
                self.changes.pop_front();
            }
            self.changes.push_back(Change {
                residual: map(&residual, last_residual, |new, old| new - old),
                image: map(&image_colors, last_image, |new, old| new - old),
            });
        }
        let shares = self.shares(weights, &residual);
        self.last = Some((residual, image_colors));
        image
            .par_iter()
            .enumerate()
            .map(|(index, image)| {
                let mut color = image.color();
                for (change, share) in self.changes.iter().zip(&shares) {
                    color -= change.image[index] * *share;
                }
                let color = if color.is_finite() {
                    color.max(Vec3::ZERO)
                } else {
                    image.color()
                };
                color.extend(image.unit_response())
            })
            .collect()
    }

    /// Ratio of the distance between the last two images to that between the iterates: below 1 where the iteration
    /// contracts. `None` before the second iterate, or if iterates differ by rounding only.
    pub(super) fn contraction(&self, weights: &[f32]) -> Option<f32> {
        let change = self.changes.back()?;
        let (_, image) = self.last.as_ref()?;
        let sum = |of: &(dyn Fn(usize) -> Vec3 + Sync)| {
            ordered_sum(weights.len(), |index| {
                of(index).abs().as_dvec3() * f64::from(weights[index])
            })
            .element_sum()
        };
        let between_images = sum(&|index| change.image[index]);
        let between_iterates = sum(&|index| change.image[index] - change.residual[index]);
        let is_measurable = between_iterates > LEAST_CHANGE * sum(&|index| image[index]);
        is_measurable.then(|| (between_images / between_iterates) as f32)
    }

    /// The share of each remembered change to subtract, by channel: the least squares solution of
    /// `residual = Σ share · change of the residual`.
    fn shares(&self, weights: &[f32], residual: &[Vec3]) -> Vec<Vec3> {
        let count = self.changes.len();
        let mut matrix = vec![vec![DVec3::ZERO; count]; count];
        let mut right = vec![DVec3::ZERO; count];
        for (row, change) in self.changes.iter().enumerate() {
            for (column, other) in self.changes.iter().enumerate().take(row + 1) {
                let product = weighted_product(weights, &change.residual, &other.residual);
                matrix[row][column] = product;
                matrix[column][row] = product;
            }
            right[row] = weighted_product(weights, &change.residual, residual);
        }
        let mut shares = vec![Vec3::ZERO; count];
        for channel in 0..3 {
            let entry = |row: usize, column: usize| matrix[row][column][channel];
            let solution = solve(count, entry, |row| right[row][channel]);
            for (share, value) in shares.iter_mut().zip(solution) {
                share[channel] = value as f32;
            }
        }
        shares
    }
}

/// A function of two slices, element by element.
fn map<A: Copy + Sync, B: Copy + Sync>(
    first: &[A],
    second: &[B],
    of: impl Fn(A, B) -> Vec3 + Sync,
) -> Vec<Vec3> {
    first
        .par_iter()
        .zip(second)
        .with_min_len(CHUNK)
        .map(|(a, b)| of(*a, *b))
        .collect()
}

/// Σ weight · a · b, by channel.
fn weighted_product(weights: &[f32], first: &[Vec3], second: &[Vec3]) -> DVec3 {
    ordered_sum(weights.len(), |index| {
        first[index].as_dvec3() * second[index].as_dvec3() * f64::from(weights[index])
    })
}

/// Solve symmetric equations by elimination. Unknowns that depend on others are omitted and get 0; all get 0 if a
/// number is not finite.
fn solve(
    count: usize,
    entry: impl Fn(usize, usize) -> f64,
    right: impl Fn(usize) -> f64,
) -> Vec<f64> {
    // Newest first, so that old directions are omitted; scaled to a unit diagonal.
    let order: Vec<usize> = (0..count).rev().collect();
    let scale: Vec<f64> = order.iter().map(|&i| entry(i, i).max(0.0).sqrt()).collect();
    let scaled = |value: f64, by: f64| if by > 0.0 { value / by } else { 0.0 };
    // The matrix, augmented by the right side.
    let mut rows: Vec<Vec<f64>> = (0..count)
        .map(|i| {
            (0..count)
                .map(|j| scaled(entry(order[i], order[j]), scale[i] * scale[j]))
                .chain([scaled(right(order[i]), scale[i])])
                .collect()
        })
        .collect();
    // Eliminate the entries below the diagonal.
    let mut used = vec![false; count];
    for pivot in 0..count {
        used[pivot] = rows[pivot][pivot] > LEAST_NEW;
        if !used[pivot] {
            continue;
        }
        let pivot_row = rows[pivot].clone();
        for row in rows.iter_mut().skip(pivot + 1) {
            let factor = row[pivot] / pivot_row[pivot];
            for (value, &of_pivot) in row.iter_mut().zip(&pivot_row) {
                *value -= factor * of_pivot;
            }
        }
    }
    // Solve from the last row up.
    let mut solution = vec![0.0; count];
    for pivot in (0..count).rev().filter(|&pivot| used[pivot]) {
        let known: f64 = (pivot + 1..count)
            .map(|column| rows[pivot][column] * solution[column])
            .sum();
        solution[pivot] = (rows[pivot][count] - known) / rows[pivot][pivot];
    }
    // Restore order and scale.
    let mut shares = vec![0.0; count];
    for (position, &index) in order.iter().enumerate() {
        shares[index] = scaled(solution[position], scale[position]);
    }
    if shares.iter().all(|share| share.is_finite()) {
        shares
    } else {
        vec![0.0; count]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Random;

    /// Sweeps until `x = matrix · x + 1` is solved to the tolerance, and the largest error.
    fn sweeps(matrix: &[Vec<f32>], expected: &[f32], depth: usize) -> (u32, f32) {
        let count = matrix.len();
        let weights = vec![1.0; count];
        let mut at = vec![Vec4::ZERO; count];
        let mut anderson = Anderson::new(depth);
        for sweep in 1..10_000 {
            let image: Vec<Vec4> = matrix
                .iter()
                .map(|row| {
                    let sum: Vec4 = row.iter().zip(&at).map(|(k, x)| *x * *k).sum();
                    sum + Vec4::ONE
                })
                .collect();
            let error = at
                .iter()
                .zip(expected)
                .map(|(x, e)| (x.color() / *e - 1.0).abs().max_element())
                .fold(0.0, f32::max);
            if error < 1e-3 {
                return (sweep, error);
            }
            at = anderson.next(&weights, &at, &image);
            assert!(at.iter().all(|x| x.is_finite() && x.min_element() >= 0.0));
        }
        panic!("no end");
    }

    /// An enclosure: rows add to `reflectance`, so that the solution is 1 / (1 − reflectance) everywhere.
    fn enclosure(reflectance: f32, seed: u64) -> (Vec<Vec<f32>>, Vec<f32>) {
        let mut random = Random::new(seed, 0);
        let matrix = (0..40)
            .map(|_| {
                let row: Vec<f32> = (0..40).map(|_| random.uniform()).collect();
                let sum: f32 = row.iter().sum();
                row.iter().map(|x| x * reflectance / sum).collect()
            })
            .collect();
        (matrix, vec![1.0 / (1.0 - reflectance); 40])
    }

    #[test]
    fn white_walls_take_few_sweeps() {
        for seed in 0..20 {
            let (matrix, expected) = enclosure(0.999, seed);
            let (plain, _) = sweeps(&matrix, &expected, 0);
            let (accelerated, _) = sweeps(&matrix, &expected, 3);
            assert!(plain > 5000, "seed {seed}: {plain}");
            assert!(accelerated <= 6, "seed {seed}: {accelerated}");
        }
    }

    #[test]
    fn a_chain_of_rooms_takes_few_sweeps() {
        // Light passes from room to room: there are several slow modes.
        let count = 12;
        let mut matrix = vec![vec![0.0; count]; count];
        for room in 0..count {
            matrix[room][room] = 0.88;
            if room > 0 {
                matrix[room][room - 1] = 0.05;
            }
            if room + 1 < count {
                matrix[room][room + 1] = 0.05;
            }
        }
        let mut expected = vec![0.0f32; count];
        for _ in 0..5000 {
            expected = (0..count)
                .map(|i| 1.0 + (0..count).map(|j| matrix[i][j] * expected[j]).sum::<f32>())
                .collect();
        }
        let (plain, _) = sweeps(&matrix, &expected, 0);
        let (accelerated, _) = sweeps(&matrix, &expected, 3);
        assert!(3 * accelerated < plain, "{accelerated} of {plain}");
    }

    #[test]
    fn dependent_directions_are_omitted() {
        let matrix = [[4.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 0.0]];
        let right = [2.0, 1.0, 0.0];
        let found = solve(3, |i, j| matrix[i][j], |i| right[i]);
        let residual = (2.0 * found[0] + found[1] - 1.0).abs();
        assert!(residual < 1e-12 && found.contains(&0.0), "{found:?}");
        let none = solve(2, |_, _| f64::NAN, |_| 1.0);
        assert_eq!(none, [0.0, 0.0]);
    }
}
