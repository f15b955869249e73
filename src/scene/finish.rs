//! How a material looks beside its diffuse colour, in the two numbers that real-time renderers know.

use super::{Material, Specular, luminance};

/// Roughness and metalness as glTF 2.0 has them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finish {
    /// Perceived roughness, 0…1: the square root of that of the lobe.
    pub roughness: f32,
    /// Part of the reflection that is metal, 0…1.
    pub metalness: f32,
}

impl Finish {
    /// Of what is diffuse only.
    pub const MATT: Self = Self {
        roughness: 1.0,
        metalness: 0.0,
    };
}

impl Material {
    /// How it looks beside its diffuse colour. Glass is smooth and no metal.
    pub fn finish(&self) -> Finish {
        let Some(specular) = self.specular else {
            return Finish::MATT;
        };
        let roughness = match specular {
            Specular::Gloss { roughness, .. } => roughness.sqrt(),
            Specular::Mirror { .. } | Specular::Glass { .. } => 0.0,
        };
        let [mirrored, diffuse] = [specular.color(), self.reflectance].map(luminance);
        let metalness = match specular {
            Specular::Glass { .. } => 0.0,
            _ => mirrored / (mirrored + diffuse).max(f32::MIN_POSITIVE),
        };
        Finish {
            roughness,
            metalness,
        }
    }
}
