//! Numbers of gloss for the mesh pass.

use glam::Vec3;

use crate::scene::{Material, Specular};

/// Cosines of the angle to the eye, evenly from 0 to 1, for which moments of a lobe are known.
const COSINES: usize = 16;

/// Vectors of gloss in `Detail` of mesh_pass.wgsl.
pub(super) const GLOSS_VECTORS: usize = 1 + COSINES;

/// Those of a material; `None` where it is diffuse only.
pub(super) fn gloss_vectors(material: &Material) -> Option<[[f32; 4]; GLOSS_VECTORS]> {
    let specular = material.specular?;
    let color = match specular {
        Specular::Glass { .. } => Vec3::splat(1.0 - material.opacity),
        _ => specular.color() * material.share_of_met() * (1.0 - mean(material.transmission())),
    };
    let roughness = specular.roughness();
    let mut vectors = [color.extend(roughness * roughness).to_array(); GLOSS_VECTORS];
    for (index, vector) in vectors[1..].iter_mut().enumerate() {
        let moments = specular.moments(index as f32 / (COSINES - 1) as f32);
        let single = match specular {
            Specular::Glass { .. } => moments.albedo,
            _ => 1.0,
        };
        *vector = [moments.albedo, moments.along_normal, moments.across, single];
    }
    Some(vectors)
}

fn mean(color: Vec3) -> f32 {
    color.element_sum() / 3.0
}
