//! The light of one lamp.

use glam::Vec3;

/// A source of light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lamp {
    /// All surfaces of a material that emits, by its index.
    Material(usize),
    /// The sky.
    Sky,
    /// The sun.
    Sun,
}

/// The light of one lamp alone at the vertices of a [`DisplayMesh`](super::DisplayMesh), linear RGB; all finite and not
/// negative.
#[derive(Clone, Debug, PartialEq)]
pub struct LampLight {
    /// The lamp.
    pub lamp: Lamp,
    /// Irradiance, W/m².
    pub irradiance: Vec<Vec3>,
    /// Emitted radiance of the surfaces, in units of the scene; 0 beside the lamp.
    pub emission: Vec<Vec3>,
}
