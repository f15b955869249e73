//! Texels about charts, which take the light of their neighbours.

use std::ops::{Add, Div};

use rayon::prelude::*;

/// Give texels without a value, up to so many away from one that has it, the mean of those about them.
pub(super) fn pad<T>(texels: &mut [Option<T>], width: usize, distance: u32)
where
    T: Copy + Send + Sync + Add<Output = T> + Div<f32, Output = T>,
{
    for _ in 0..distance {
        let known: &[Option<T>] = texels;
        let mean = |at: usize| -> Option<(usize, T)> {
            if known[at].is_some() {
                return None;
            }
            let (row, column) = (at / width, at % width);
            let rows = row.saturating_sub(1)..(row + 2).min(known.len() / width);
            let columns = column.saturating_sub(1)..(column + 2).min(width);
            let around = rows.flat_map(|row| &known[row * width..][columns.clone()]);
            let (mut sum, mut count) = (None::<T>, 0.0);
            for value in around.flatten() {
                sum = Some(sum.map_or(*value, |sum| sum + *value));
                count += 1.0;
            }
            sum.map(|sum| (at, sum / count))
        };
        let filled: Vec<(usize, T)> = (0..known.len()).into_par_iter().filter_map(mean).collect();
        for (at, value) in filled {
            texels[at] = Some(value);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_spread_as_far_as_asked_and_do_not_change() {
        let mut texels = vec![None; 64];
        (texels[0], texels[7]) = (Some(2.0_f32), Some(6.0));
        pad(&mut texels, 8, 2);
        let row = |row: usize| texels[8 * row..][..8].to_vec();
        let [low, high] = [Some(2.0), Some(6.0)];
        let expected = [low, low, low, None, None, high, high, high];
        for at in 0..3 {
            assert_eq!(row(at), expected, "{at}");
        }
        assert_eq!(row(3), [None; 8]);
    }
}
