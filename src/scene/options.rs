//! How a scene is read.

use super::{UpAxis, ranges::DEFAULT_MAX_REFLECTANCE};

/// Which sides of a triangle reflect and emit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Sides {
    /// Faces of a consistently wound closed shell are one-sided, all others two-sided.
    #[default]
    Auto,
    /// All one-sided: counter-clockwise is the front.
    One,
    /// All two-sided.
    Two,
}

/// Options of reading a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneOptions {
    /// Sidedness of faces.
    pub sides: Sides,
    /// Reflectance above this is clamped, per channel; in 0…1. Near 1 light never dies and errors grow without bound.
    pub max_reflectance: f32,
    /// Whether `Kd` and `Ke` in the MTL file are sRGB-encoded. Textures of 8 bits always are.
    pub mtl_color_is_srgb: bool,
    /// Whether nothing lets light pass, whatever the materials say.
    pub is_opaque: bool,
    /// Whether nothing mirrors, glosses or refracts, whatever the materials say.
    pub is_matt: bool,
    /// The axis that points up; `None` recognises it.
    pub up: Option<UpAxis>,
}

impl Default for SceneOptions {
    fn default() -> Self {
        Self {
            sides: Sides::Auto,
            max_reflectance: DEFAULT_MAX_REFLECTANCE,
            mtl_color_is_srgb: false,
            is_opaque: false,
            is_matt: false,
            up: None,
        }
    }
}

impl SceneOptions {
    /// The default, with these sides.
    pub fn with_sides(sides: Sides) -> Self {
        Self {
            sides,
            ..Self::default()
        }
    }

    /// The largest reflectance, within 0…1.
    pub(super) fn reflectance_limit(&self) -> f32 {
        self.max_reflectance.clamp(0.0, 1.0)
    }
}
