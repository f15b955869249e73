//! Sums in an order that does not depend on the number of threads, and means over the area of the scene.

use glam::{DVec3, Vec4};
use rayon::prelude::*;

use crate::hierarchy::{Channels as _, Hierarchy, luminance};

/// Values that one task sums. It determines the order of summation, so it must not depend on the number of threads.
const CHUNK: usize = 4096;

/// Sum over indices in an order that does not depend on the number of threads.
pub(super) fn ordered_sum(count: usize, of: impl Fn(usize) -> DVec3 + Sync) -> DVec3 {
    let parts: Vec<DVec3> = (0..count.div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let end = ((chunk + 1) * CHUNK).min(count);
            (chunk * CHUNK..end).map(&of).sum()
        })
        .collect();
    parts.into_iter().sum()
}

/// Sum over leaves of area (square frame units) times a colour, in fixed order and in double precision.
pub(super) fn area_sum(hierarchy: &Hierarchy, of: impl Fn(usize) -> Vec4 + Sync) -> DVec3 {
    let elements = &hierarchy.mesh.elements;
    ordered_sum(elements.len(), |index| {
        if !elements[index].is_leaf() {
            return DVec3::ZERO;
        }
        let area = f64::from(elements[index].area_vector.length());
        of(index).color().as_dvec3() * area
    })
}

/// As [`area_sum`], summed over the colours.
pub(super) fn area_total(hierarchy: &Hierarchy, of: impl Fn(usize) -> Vec4 + Sync) -> f64 {
    area_sum(hierarchy, of).element_sum()
}

/// Mean of a colour over the scene, each leaf weighted by its importance (see [`crate::hierarchy::Importance`]).
pub(super) fn mean(hierarchy: &Hierarchy, of: impl Fn(usize) -> Vec4 + Sync) -> Vec4 {
    let importance = &hierarchy.importance;
    let elements = &hierarchy.mesh.elements;
    let measured = |leaf: usize| of(leaf) * importance.measure(elements[leaf].patch as usize);
    let sum = area_sum(hierarchy, measured) / importance.area.max(f64::MIN_POSITIVE);
    sum.as_vec3().extend(0.0)
}

/// Smallest lit part of the scene for which errors are relative to the mean; with less, they are relative to the root
/// mean square, since the mean would be that of the dark. Smaller, and a small lit part gets too many links and
/// elements; larger, and dark scenes with bright spots get too few.
const LEAST_LIT: f32 = 1.0 / 9.0;

/// Luminance to which errors of a quantity are relative: its mean over the scene, or, if it is concentrated on a small
/// part, the mean that it would have if that part were [`LEAST_LIT`] of the scene.
pub(super) fn scale(hierarchy: &Hierarchy, of: impl Fn(usize) -> Vec4 + Sync) -> f32 {
    let moments = mean(hierarchy, |leaf| {
        let value = luminance(of(leaf));
        Vec4::new(value, value * value, 0.0, 0.0)
    });
    moments.x.max((moments.y * LEAST_LIT).sqrt())
}
