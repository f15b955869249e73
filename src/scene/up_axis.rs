//! The axis of a scene that points up.

use glam::Vec3;

/// Which axis of the scene points up. Coordinates are never turned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum UpAxis {
    /// +Y, as in most OBJ files.
    #[default]
    Y,
    /// +Z, as in Blender and in CAD programs.
    Z,
}

impl UpAxis {
    /// The axis as a unit vector.
    pub const fn vector(self) -> Vec3 {
        match self {
            Self::Y => Vec3::Y,
            Self::Z => Vec3::Z,
        }
    }

    /// As on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Y => "+Y",
            Self::Z => "+Z",
        }
    }
}
