//! The lit mesh as a file: what the formats share.

use std::{
    f32::consts::FRAC_1_PI,
    io::{self, Write},
};

use glam::Vec3;

use super::ColorOptions;
use crate::{scene::UpAxis, solver::Snapshot};

/// Options of an exported mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshOptions {
    /// How displayed colours are made.
    pub color: ColorOptions,
    /// The scene's up axis.
    pub up: UpAxis,
    /// Factor on all emission, and with it on all light.
    pub emission_scale: f32,
    /// Of the scene: see [`crate::scene::Scene::radiance_unit`].
    pub radiance_unit: f32,
}

impl Default for MeshOptions {
    fn default() -> Self {
        Self {
            color: ColorOptions::default(),
            up: UpAxis::default(),
            emission_scale: 1.0,
            radiance_unit: 1.0,
        }
    }
}

impl MeshOptions {
    /// Light of the scene as files have it: in watts, with the factor on all emission; finite and not negative.
    pub fn scaled(&self, light: Vec3) -> Vec3 {
        scaled(
            light,
            [self.emission_scale, self.radiance_unit].map(f64::from),
        )
    }
}

/// Light at a vertex of the display mesh, linear, finite and not negative.
pub(super) struct Light {
    /// Emitted and reflected, W·sr⁻¹·m⁻².
    pub(super) radiance: Vec3,
    /// Arriving, W·m⁻².
    pub(super) irradiance: Vec3,
}

impl Light {
    /// Light at the vertex of this index; dark where the snapshot knows none.
    pub(super) fn at(snapshot: &Snapshot, index: usize, options: &MeshOptions) -> Self {
        let mesh = &snapshot.mesh;
        let arriving = snapshot.light.irradiance.get(index).copied();
        let irradiance = presentable(arriving.unwrap_or_default());
        let radiance = mesh.emission[index] + mesh.reflectance[index] * irradiance * FRAC_1_PI;
        Self {
            radiance: options.scaled(radiance),
            irradiance: options.scaled(irradiance),
        }
    }
}

/// Finite and not negative, whatever comes in.
fn presentable(light: Vec3) -> Vec3 {
    light.map(|x| if x > 0.0 { x.min(f32::MAX) } else { 0.0 })
}

/// Light times two factors. Values above the range of single precision keep their colour.
fn scaled(light: Vec3, [first, second]: [f64; 2]) -> Vec3 {
    let scaled = presentable(light).as_dvec3() * first * second;
    let excess = scaled.max_element() / f64::from(f32::MAX);
    (scaled / excess.max(1.0)).as_vec3()
}

pub(super) fn write_vector(out: &mut dyn Write, vector: Vec3) -> io::Result<()> {
    out.write_all(&vector.to_array().map(f32::to_le_bytes).concat())
}

#[cfg(test)]
pub(super) mod tests {
    use std::{f32::consts::PI, sync::Arc};

    use super::*;
    use crate::solver::{DisplayMesh, VertexLight};

    /// One triangle that reflects half of an irradiance of π; its second corner emits 1.
    pub(in crate::export) fn triangle() -> Snapshot {
        let mesh = DisplayMesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            normals: vec![Vec3::Z; 3],
            reflectance: vec![Vec3::splat(0.5); 3],
            emission: vec![Vec3::ZERO, Vec3::ONE, Vec3::ZERO],
            indices: vec![[0, 1, 2]],
            triangle_of: vec![0],
            is_back: vec![false],
            element_of: vec![0],
            ..DisplayMesh::default()
        };
        let light = VertexLight {
            irradiance: vec![Vec3::splat(PI); 3],
            direct: vec![Vec3::ZERO; 3],
        };
        Snapshot {
            step: 1,
            mesh: Arc::new(mesh),
            light: Arc::new(light),
            ..Snapshot::default()
        }
    }

    #[test]
    fn light_is_scaled_with_the_emission_and_always_presentable() {
        let options = MeshOptions {
            emission_scale: 2.0,
            ..MeshOptions::default()
        };
        let light = Light::at(&triangle(), 1, &options);
        assert!((light.irradiance.x - 2.0 * PI).abs() < 1e-5);
        assert!((light.radiance.x - 3.0).abs() < 1e-5);
        for (value, expected) in [(f32::NAN, 0.0), (-1.0, 0.0), (f32::INFINITY, f32::MAX)] {
            assert_eq!(presentable(Vec3::splat(value)), Vec3::splat(expected));
        }
        let colour = scaled(Vec3::new(4.0, 2.0, 0.0), [1e25, 1e20]);
        assert_eq!(colour.x, f32::MAX);
        assert!((colour.y / colour.x - 0.5).abs() < 1e-6 && colour.z == 0.0);
    }
}
