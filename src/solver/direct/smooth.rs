//! Visible fractions smoothed over the mesh, as far as their noise explains differences of neighbours.
//!
//! A few shadow rays leave grain in penumbrae, which triangles stretch into streaks. Neighbouring vertices of a smooth
//! surface have nearly the same visible fraction, so they exchange part of the difference: fully while it is below the
//! smaller standard error of both, and less the larger it is. The exchange conserves the sum, so that where few rays
//! are visible, the smoothed light has no bias.

use glam::Vec4;

use super::samples::DirectLight;
use crate::{
    hierarchy::{Channels as _, Hierarchy},
    solver::places::agreement,
};

/// Difference at which neighbours exchange half, in standard errors. Smaller leaves grain; larger blurs borders.
const HALF_DEVIATIONS: f32 = 3.0;

/// Weight of a vertex's own value; each neighbour that agrees has 2, since inner edges belong to two elements. Smaller
/// blurs borders; larger leaves grain.
const OWN_WEIGHT: f32 = 2.0;

/// The visible fraction at one vertex.
#[derive(Clone, Copy, Default)]
struct Fraction {
    color: Vec4,
    /// Mean over the colours.
    mean: f32,
    /// Square of the standard error of the mean; above 0 even if all rays have the same outcome.
    variance: f32,
    /// Whether some rays are visible and others are not.
    is_mixed: bool,
}

/// Smoothed visible fractions of the vertices, by colour; 0 for vertices without samples.
pub(super) fn fractions(hierarchy: &Hierarchy, samples: &[Option<DirectLight>]) -> Vec<Vec4> {
    let fractions: Vec<Fraction> = samples
        .iter()
        .map(|sample| {
            sample.map_or(Fraction::default(), |light| {
                let color = light.fraction();
                Fraction {
                    color,
                    mean: color.color().element_sum() / 3.0,
                    variance: light.fraction_doubt().powi(2),
                    is_mixed: light.tally().is_mixed(),
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
        .filter(|edge| edge.iter().any(|&vertex| fractions[vertex].is_mixed))
        .collect();
    exchanged(&fractions, &edges)
}

/// The fractions after one exchange, by colour. None leaves visible grain; several widen narrow penumbrae and draw their
/// borders as saw teeth.
fn exchanged(fractions: &[Fraction], edges: &[[usize; 2]]) -> Vec<Vec4> {
    let weight = |a: Fraction, b: Fraction| {
        let variance = 2.0 * a.variance.min(b.variance);
        agreement(a.mean - b.mean, variance, HALF_DEVIATIONS)
    };
    let mut weights = vec![OWN_WEIGHT; fractions.len()];
    for &[a, b] in edges {
        let weight = weight(fractions[a], fractions[b]);
        weights[a] += weight;
        weights[b] += weight;
    }
    let mut next: Vec<Vec4> = fractions.iter().map(|fraction| fraction.color).collect();
    for &[a, b] in edges {
        let (one, other) = (fractions[a], fractions[b]);
        let share = weight(one, other) / weights[a].max(weights[b]);
        let given = (one.color - other.color) * share;
        next[a] -= given;
        next[b] += given;
    }
    next
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fraction(mean: f32, rays: f32) -> Fraction {
        let doubtful = (mean * rays + 0.5) / (rays + 1.0);
        Fraction {
            color: Vec4::splat(mean),
            mean,
            variance: doubtful * (1.0 - doubtful) / (rays + 1.0),
            is_mixed: mean > 0.0 && mean < 1.0,
        }
    }

    #[test]
    fn smoothing_conserves_the_sum() {
        let fractions = [fraction(0.0, 8.0), fraction(0.125, 8.0), fraction(0.0, 8.0)];
        let smoothed = exchanged(&fractions, &[[0, 1], [1, 2]]);
        let sum: f32 = smoothed.iter().map(|color| color.x).sum();
        assert!((sum - 0.125).abs() < 1e-6);
        assert!(smoothed[0].x > 0.01 && smoothed[1].x < 0.1);
    }

    #[test]
    fn hardly_any_light_leaks_to_vertices_that_many_rays_found_dark() {
        let fractions = [fraction(0.0, 32.0), fraction(0.5, 32.0)];
        let smoothed = exchanged(&fractions, &[[0, 1]]);
        assert!(smoothed[0].x < 0.01, "{}", smoothed[0].x);
    }
}
