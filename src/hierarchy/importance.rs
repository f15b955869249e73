//! How much errors on each patch count against the whole scene.
//!
//! Error is summed in squares over area, relative to the mean over the scene. Two kinds of surface would drown the
//! rest: emitters, whose own light hides what they receive, however large they are (a sky of emitting triangles about a
//! room); and surfaces that are huge beside all others, of which only a part is looked at (see [`SizeClasses`]).

use glam::Vec3;

use super::{Patch, luminance};
use crate::scene::{Scene, SizeClasses};

/// Weights of patches.
pub struct Importance {
    /// By patch: how much an error of its irradiance shows, 0…1, as the square of a factor: what it reflects beside what it
    /// emits. The largest is 1.
    weights: Vec<f32>,
    /// By patch: the share of its area that counts in means over the scene, 0…1.
    measures: Vec<f32>,
    /// Sum of what counts, in square frame units.
    pub area: f64,
}

impl Importance {
    /// Of the patches of a scene.
    pub(super) fn new(scene: &Scene, patches: &[Patch]) -> Self {
        let emitted =
            |patch: &Patch| f64::from(luminance(patch.emission.extend(0.0))) * std::f64::consts::PI;
        let whole: f64 = patches.iter().map(|patch| f64::from(patch.area)).sum();
        let power: f64 = patches
            .iter()
            .map(|patch| emitted(patch) * f64::from(patch.area))
            .sum();
        // The mean irradiance if all light arrives, and is reflected as by white.
        let received = power / whole.max(f64::MIN_POSITIVE);
        let weight = |patch: &Patch| match emitted(patch) {
            emitted if emitted > 0.0 => received / (received + emitted),
            _ => 1.0,
        };
        let most = patches.iter().map(weight).fold(0.0, f64::max);
        let weights: Vec<f64> = patches
            .iter()
            .map(|patch| weight(patch) / most.max(f64::MIN_POSITIVE))
            .collect();
        let edges: Vec<f64> = patches
            .iter()
            .map(|patch| longest_edge_squared(scene.corners(patch.triangle)))
            .collect();
        let faces = patches.iter().zip(&weights).zip(&edges);
        let classes = SizeClasses::new(
            faces.map(|((patch, weight), &squared)| (squared, weight * f64::from(patch.area))),
        );
        let measures = weights.iter().zip(&edges);
        Self {
            measures: measures
                .map(|(weight, &squared)| (weight * classes.share(squared)) as f32)
                .collect(),
            weights: weights.into_iter().map(|weight| weight as f32).collect(),
            area: classes.area,
        }
    }

    /// See [`Self::weights`].
    pub fn weight(&self, patch: usize) -> f32 {
        self.weights[patch]
    }

    /// See [`Self::measures`].
    pub fn measure(&self, patch: usize) -> f32 {
        self.measures[patch]
    }

    /// Bytes held.
    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(self.weights.as_slice()) + size_of_val(self.measures.as_slice())
    }
}

/// Square of the longest edge of a triangle, in square frame units.
pub fn longest_edge_squared([a, b, c]: [Vec3; 3]) -> f64 {
    let edges = [a - b, b - c, c - a].map(|edge| edge.as_dvec3().length_squared());
    edges.into_iter().fold(0.0, f64::max)
}
