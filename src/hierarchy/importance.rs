//! How much errors on each patch count against the whole scene.
//!
//! Error is summed in squares over area, relative to the mean over the scene. Two kinds of surface would drown the
//! rest: emitters, whose own light hides what they receive, however large they are (a sky of emitting triangles about a
//! room); and surfaces that are huge beside all others, of which only a part is looked at (see [`SizeClasses`]).

use glam::Vec3;

use super::{Patch, luminance};
use crate::scene::{Scene, SizeClasses};

/// Area of all emitters together that counts at most, relative to that of all others. Smaller, and what emitters receive
/// is coarse where nearly all surfaces emit; larger, and a sky of emitting faces takes the elements of what it lights.
const EMITTERS_SHARE: f64 = 10.0;

/// Emission that is above the mean by no more than this share is not told from the mean: where all emit alike, all count.
const SLACK: f64 = 1e-3;

/// Weights of patches.
pub struct Importance {
    /// By patch: how much an error of its irradiance shows, 0…1, as the square of a factor: 1 but for emitters, whose own
    /// light hides what they reflect.
    weights: Vec<f32>,
    /// By patch: the share of its area that counts in means over the scene, 0…1; 0 of emitters that are brighter than the mean.
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
        // The mean irradiance if all light arrives.
        let received = power / whole.max(f64::MIN_POSITIVE);
        // A patch that emits no more than that is seen by its reflected light, too.
        let emits = |patch: &Patch| emitted(patch) > (1.0 + SLACK) * received;
        let emitting: f64 = patches
            .iter()
            .filter(|patch| emits(patch))
            .map(|patch| f64::from(patch.area))
            .sum();
        let others = (whole - emitting).max(0.0);
        let least = (EMITTERS_SHARE * others / emitting.max(f64::MIN_POSITIVE)).min(1.0);
        let weight = |patch: &Patch| match emits(patch) {
            true => least * received / (received + emitted(patch)),
            false => 1.0,
        };
        let weights: Vec<f64> = patches.iter().map(weight).collect();
        let edges: Vec<f64> = patches
            .iter()
            .map(|patch| longest_edge_squared(scene.corners(patch.triangle)))
            .collect();
        let counts = |patch: &Patch| !emits(patch);
        let sized = patches.iter().zip(&edges);
        let faces = sized.clone().filter(|(patch, _)| counts(patch));
        let faces = faces.map(|(patch, &squared)| (squared, f64::from(patch.area)));
        let classes = SizeClasses::new(faces);
        let measure = |(patch, &squared): (&Patch, &f64)| match counts(patch) {
            true => classes.share(squared) as f32,
            false => 0.0,
        };
        Self {
            measures: sized.map(measure).collect(),
            weights: weights.into_iter().map(|weight| weight as f32).collect(),
            area: classes.area,
        }
    }

    /// How much an error of the irradiance of a patch shows, 0…1; 1 but for emitters.
    pub fn weight(&self, patch: usize) -> f32 {
        self.weights[patch]
    }

    /// The share of a patch's area that counts in means over the scene, 0…1.
    pub fn measure(&self, patch: usize) -> f32 {
        self.measures[patch]
    }

    /// Bytes in use.
    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(self.weights.as_slice()) + size_of_val(self.measures.as_slice())
    }
}

/// Square of the longest edge of a triangle, in square frame units.
pub fn longest_edge_squared([a, b, c]: [Vec3; 3]) -> f64 {
    let edges = [a - b, b - c, c - a].map(|edge| edge.as_dvec3().length_squared());
    edges.into_iter().fold(0.0, f64::max)
}
