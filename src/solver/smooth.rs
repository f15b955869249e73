//! Shadow fractions smoothed over the mesh, as far as their own noise explains how neighbours differ.
//!
//! A few shadow rays leave a grain in penumbrae, which triangles draw out into streaks. Neighbouring vertices of a
//! smooth surface see nearly the same fraction of the light, so a vertex that is in doubt takes a mean with its
//! neighbours: they count fully while they differ by no more than noise, and less the further they are off. Vertices
//! whose rays all agree stay as they are, so nothing leaks into the light or the dark beside a penumbra.

use glam::Vec4;

use super::direct::DirectLight;
use crate::hierarchy::Hierarchy;

/// Rounds of averaging. None leaves visible grain, many widen narrow penumbrae and draw their borders as saw teeth.
const ROUNDS: u32 = 1;

/// Standard errors by which neighbours may differ before they count by half. Smaller leaves grain, larger blurs borders.
const HALF_DEVIATIONS: f32 = 3.0;

/// Weight of a vertex's own value; each neighbour that agrees has 2, since inner edges belong to two elements.
const OWN_WEIGHT: f32 = 2.0;

/// The visible fraction at one vertex.
#[derive(Clone, Copy, Default)]
struct Fraction {
    color: Vec4,
    /// Mean over the colours.
    mean: f32,
    /// Square of the standard error of the mean.
    variance: f32,
}

/// Visible fractions of the vertices, by colour; those of vertices without samples are 0.
pub(super) fn fractions(hierarchy: &Hierarchy, samples: &[Option<DirectLight>]) -> Vec<Vec4> {
    let mut fractions: Vec<Fraction> = samples
        .iter()
        .map(|sample| {
            sample.map_or(Fraction::default(), |light| {
                let color = light.fraction();
                Fraction {
                    color,
                    mean: color.truncate().element_sum() / 3.0,
                    variance: light.fraction_variance(),
                }
            })
        })
        .collect();
    let edges: Vec<[usize; 2]> = hierarchy
        .mesh
        .leaves()
        .flat_map(|leaf| hierarchy.mesh.elements[leaf].edges())
        .filter(|edge| {
            edge.iter()
                .all(|&vertex| samples.get(vertex).is_some_and(Option::is_some))
        })
        .filter(|edge| edge.iter().any(|&vertex| fractions[vertex].variance > 0.0))
        .collect();
    for _ in 0..ROUNDS {
        fractions = round(&fractions, &edges);
    }
    fractions
        .into_iter()
        .map(|fraction| fraction.color)
        .collect()
}

/// How much a neighbour counts whose value is off by a gap, 0…1: by half where that is so many standard errors, of which the
/// square is `variance`.
pub(super) fn agreement(gap: f32, variance: f32, half_deviations: f32) -> f32 {
    let noise = variance * half_deviations * half_deviations;
    noise / (noise + gap * gap).max(f32::MIN_POSITIVE)
}

/// One round of averaging. The variance stays that of the rays: it says how far neighbours may differ.
fn round(fractions: &[Fraction], edges: &[[usize; 2]]) -> Vec<Fraction> {
    let mut sums: Vec<(Vec4, f32)> = fractions
        .iter()
        .map(|fraction| (fraction.color * OWN_WEIGHT, OWN_WEIGHT))
        .collect();
    for &[a, b] in edges {
        let (one, other) = (fractions[a], fractions[b]);
        let gap = one.mean - other.mean;
        let weight = agreement(gap, one.variance + other.variance, HALF_DEVIATIONS);
        for (vertex, neighbour) in [(a, other), (b, one)] {
            if fractions[vertex].variance > 0.0 {
                sums[vertex].0 += neighbour.color * weight;
                sums[vertex].1 += weight;
            }
        }
    }
    fractions
        .iter()
        .zip(sums)
        .map(|(fraction, (sum, weight))| {
            let color = sum / weight;
            Fraction {
                color,
                mean: color.truncate().element_sum() / 3.0,
                ..*fraction
            }
        })
        .collect()
}
