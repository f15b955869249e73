//! Control variate of guided shadow rays.

use glam::Vec3;

use crate::hierarchy::luminance;

/// Sums over all rays of a point of their weights where rays are guided, and of those that they would have if all followed
/// the unoccluded light. Both have the same mean, so that their difference tells a part of the error of the visible fraction:
/// it is a control variate (Owen, "Monte Carlo theory, methods and examples", 8.9). Without it, the light of a point that
/// sees the whole sky, but is guided to the opening that others near it see, would be noise about what is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Control {
    /// Of weights without a guide.
    sent: f32,
    /// Of the weights.
    weights: f32,
    /// Of their squares.
    squares: f32,
    /// Of the weights, each times what passes along its ray.
    passing: f32,
    /// Of the squares, likewise.
    products: f32,
}

impl Control {
    /// Count a ray of a weight, which a guide changes by a factor.
    pub(super) fn count(&mut self, weight: f32, worth: f32, passing: Vec3) {
        let passing = luminance(passing.extend(0.0));
        self.sent += weight;
        let weight = weight * worth;
        self.weights += weight;
        self.squares += weight * weight;
        self.passing += weight * passing;
        self.products += weight * weight * passing;
    }

    /// Add other rays, their weights times a factor.
    pub(super) fn add(&mut self, other: Self, factor: f32) {
        self.sent += other.sent * factor;
        self.weights += other.weights * factor;
        self.squares += other.squares * factor * factor;
        self.passing += other.passing * factor;
        self.products += other.products * factor * factor;
    }

    /// Mean weight relative to that without a guide; 1 without rays.
    pub(super) fn mean(self) -> f32 {
        match self.sent > 0.0 {
            true => self.weights / self.sent,
            false => 1.0,
        }
    }

    /// What is to be added to the visible fraction that so many rays have found. 0 without a guide.
    pub(super) fn correction(self, shot: u32) -> f32 {
        let off = 1.0 - self.mean();
        let shot = shot as f32;
        let variance = shot * self.squares - self.weights * self.weights;
        if off == 0.0 || variance <= 0.0 {
            return 0.0;
        }
        let covariance = shot * self.products - self.passing * self.weights;
        (covariance / variance).clamp(0.0, 1.0) * off
    }
}
