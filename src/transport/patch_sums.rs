//! Running sums over patches, to sample patches in proportion to a quantity.

use std::ops::Range;

use super::luminance;
use crate::hierarchy::{Channels as _, Hierarchy, Tables};

/// Running sums over the patches in tree order, to sample patches of a cluster in proportion to the quantity summed.
/// One entry more than there are patches.
#[derive(Clone, Debug)]
pub struct PatchSums(Vec<f64>);

impl PatchSums {
    /// Sums of the active areas of the patches, square frame units.
    pub fn of_area(hierarchy: &Hierarchy, tables: &Tables) -> Self {
        Self::of(hierarchy, |patch, area| {
            tables.elements[patch].active_share() * area
        })
    }

    /// Sums of the powers of the patches (luminance of the radiosity times area).
    pub fn of_power(hierarchy: &Hierarchy, tables: &Tables) -> Self {
        Self::of(hierarchy, |patch, area| {
            luminance(tables.elements[patch]).max(0.0) * area
        })
    }

    fn of(hierarchy: &Hierarchy, value: impl Fn(usize, f32) -> f32) -> Self {
        let mut sum = 0.0;
        let values = hierarchy.patches.iter().enumerate().map(|(index, patch)| {
            sum += f64::from(value(index, patch.area));
            sum
        });
        Self(std::iter::once(0.0).chain(values).collect())
    }

    /// The sum over a range of patches.
    pub(super) fn total(&self, patches: &Range<usize>) -> f64 {
        self.0[patches.end] - self.0[patches.start]
    }

    /// One patch of a range, for a uniform number `at` in 0…1.
    pub(super) fn choose(&self, patches: &Range<usize>, at: f32) -> usize {
        let sums = &self.0[patches.start..=patches.end];
        let target = sums[0] + f64::from(at) * self.total(patches);
        let above = sums.partition_point(|&sum| sum <= target);
        patches.start + above.clamp(1, patches.len()) - 1
    }

    /// Memory in bytes.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.0.as_slice())
    }
}
