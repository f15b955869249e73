//! Binary PLY of the display mesh with light at its vertices.
//!
//! Per vertex: position in world units, normal, tone-mapped sRGB, linear radiance and irradiance. MeshLab, Blender and
//! CloudCompare show the bytes; tools that compute read the floats.

use std::{
    f32::consts::FRAC_1_PI,
    io::{self, Write},
};

use glam::Vec3;

use super::{ColorOptions, ToneMap};
use crate::{scene::Frame, solver::Snapshot};

/// Which axis of the file points up; stated in the header, coordinates are not turned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum UpAxis {
    /// +Y, as most OBJ files.
    #[default]
    Y,
    /// +Z.
    Z,
}

impl UpAxis {
    /// As on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Y => "+Y",
            Self::Z => "+Z",
        }
    }
}

/// What an exported file says beside the numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlyOptions {
    /// How the byte colours are made.
    pub color: ColorOptions,
    /// The scene's up axis.
    pub up: UpAxis,
    /// What all emission, and with it all light, is multiplied by.
    pub emission_scale: f32,
}

impl Default for PlyOptions {
    fn default() -> Self {
        Self {
            color: ColorOptions::default(),
            up: UpAxis::default(),
            emission_scale: 1.0,
        }
    }
}

/// Write the display mesh of a snapshot in world units.
///
/// # Errors
/// Those of `out`.
pub fn write_ply(
    out: &mut impl Write,
    snapshot: &Snapshot,
    frame: &Frame,
    options: &PlyOptions,
) -> io::Result<()> {
    let (mesh, light) = (&snapshot.mesh, &snapshot.light);
    out.write_all(header(mesh.positions.len(), mesh.indices.len(), options).as_bytes())?;
    for (index, &position) in mesh.positions.iter().enumerate() {
        let irradiance = light.irradiance.get(index).copied().unwrap_or_default();
        debug_assert!(irradiance.is_finite() && irradiance.min_element() >= 0.0);
        let irradiance = presentable(irradiance * options.emission_scale);
        let emission = mesh.emission[index] * options.emission_scale;
        let radiance = presentable(emission + mesh.reflectance[index] * irradiance * FRAC_1_PI);
        write_vector(out, frame.to_world(position).as_vec3())?;
        write_vector(out, mesh.normals[index])?;
        out.write_all(&options.color.encode(radiance))?;
        write_vector(out, radiance)?;
        write_vector(out, irradiance)?;
    }
    for corners in &mesh.indices {
        out.write_all(&[3])?;
        for corner in corners {
            out.write_all(&(*corner as i32).to_le_bytes())?;
        }
    }
    Ok(())
}

fn header(vertex_count: usize, face_count: usize, options: &PlyOptions) -> String {
    let tone_map = match options.color.tone_map {
        ToneMap::None => "none",
        ToneMap::Neutral => "Khronos PBR Neutral",
    };
    let floats = |names: &[&str]| -> String {
        names
            .iter()
            .map(|name| format!("property float {name}\n"))
            .collect()
    };
    format!(
        "ply\nformat binary_little_endian 1.0\n\
         comment vecrad {version}\n\
         comment exposure {exposure} EV, tone curve {tone_map}, colours sRGB\n\
         comment radiance linear W/(sr m^2), irradiance linear W/m^2, lengths in units of the scene\n\
         comment up axis {up}\n\
         element vertex {vertex_count}\n{geometry}\
         property uchar red\nproperty uchar green\nproperty uchar blue\n{light}\
         element face {face_count}\nproperty list uchar int vertex_indices\nend_header\n",
        version = env!("CARGO_PKG_VERSION"),
        exposure = options.color.exposure_ev,
        up = options.up.name(),
        geometry = floats(&["x", "y", "z", "nx", "ny", "nz"]),
        light = floats(&[
            "radiance_r",
            "radiance_g",
            "radiance_b",
            "irradiance_r",
            "irradiance_g",
            "irradiance_b",
        ]),
    )
}

/// Finite and not negative, whatever comes in.
fn presentable(light: Vec3) -> Vec3 {
    light.map(|x| if x > 0.0 { x.min(f32::MAX) } else { 0.0 })
}

fn write_vector(out: &mut impl Write, vector: Vec3) -> io::Result<()> {
    vector
        .to_array()
        .iter()
        .try_for_each(|x| out.write_all(&x.to_le_bytes()))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DVec3;

    use super::*;
    use crate::solver::{DisplayMesh, VertexLight};

    fn snapshot() -> Snapshot {
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
            irradiance: vec![Vec3::splat(std::f32::consts::PI); 3],
            direct: vec![Vec3::ZERO; 3],
            uncertainty: vec![0.0; 3],
        };
        Snapshot {
            step: 1,
            mesh: Arc::new(mesh),
            light: Arc::new(light),
            ..Snapshot::default()
        }
    }

    #[test]
    fn radiance_is_emission_plus_reflected_irradiance_over_pi_in_world_units() {
        let frame = Frame {
            centre: DVec3::new(10.0, 0.0, 0.0),
            scale: 2.0,
        };
        let mut bytes = Vec::new();
        write_ply(&mut bytes, &snapshot(), &frame, &PlyOptions::default()).unwrap();
        let end = b"end_header\n";
        let start = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
        let body = &bytes[start..];
        assert_eq!(body.len(), 3 * (12 * 4 + 3) + 13);
        let float = |at: usize| f32::from_le_bytes(body[at..at + 4].try_into().unwrap());
        let second = 51;
        assert_eq!(float(second), 10.5, "x in world units");
        assert!((float(27) - 0.5).abs() < 1e-6, "reflected only");
        assert!((float(second + 27) - 1.5).abs() < 1e-6, "emitted, too");
        assert!(
            (float(39) - std::f32::consts::PI).abs() < 1e-6,
            "irradiance"
        );
    }
}
