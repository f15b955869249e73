//! Direct light at any point, for pictures.

use std::{fmt::Debug, ops::Range};

use glam::Vec3;

use crate::{geometry::Shuffle, scene::TriangleId};

/// A point of a surface, as direct light sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LitPoint {
    /// Where shadow rays start, frame units.
    pub position: Vec3,
    /// Unit normal towards the light.
    pub normal: Vec3,
    /// The triangle that the point lies on.
    pub triangle: TriangleId,
    /// The irradiance that is believed to arrive there, W/m²: any, but noise is less where it is right.
    pub expected: Vec3,
}

/// The light straight from emitters and from outside, as far as the solve samples it.
pub trait DirectLights: Debug + Send + Sync {
    /// What computes it, for the points of one thread.
    fn sampler(&self) -> Box<dyn LightSampler + '_>;

    /// Whether the emission of surfaces is part of it. Else it is linked.
    fn has_emitters(&self) -> bool;
}

/// Computes direct light at points.
pub trait LightSampler {
    /// The light at a point by shadow rays of these numbers in a sequence to each kind of light.
    fn light(&mut self, point: &LitPoint, rays: Range<u32>, shuffle: Shuffle) -> SampledLight;
}

/// Direct light at a point by a few shadow rays.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SampledLight {
    /// Unoccluded irradiance of all kinds, W/m².
    pub unoccluded: Vec3,
    /// What shadows take of each kind.
    pub shadows: [Shadow; LIGHT_KINDS],
}

/// Kinds of light that have shadow rays of their own: emitters, the sky, the sun.
pub const LIGHT_KINDS: usize = 3;

/// What is missing of the direct light of one kind.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shadow {
    /// What is missing of the unoccluded irradiance, W/m²; without bias, so that it may be negative.
    pub missing: Vec3,
    /// Variance of its luminance, as far as the rays tell.
    pub variance: f32,
    /// How fast it changes, 0 where nothing was met: the inverse of the distance, in frame units, over which the point has
    /// to move until it sees another part of what blocks before all of the light.
    pub sharpness: f32,
}
