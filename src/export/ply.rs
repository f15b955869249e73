//! Binary PLY of the display mesh with light at its vertices.
//!
//! Per vertex: position in world units, normal, tone-mapped sRGB, linear radiance and irradiance. MeshLab, Blender and
//! CloudCompare show the bytes; tools that compute read the floats.

use std::io::{self, Write};

use super::{
    MeshOptions, ToneMap,
    mesh::{Light, write_vector},
};
use crate::{scene::Frame, solver::Snapshot};

/// Write the display mesh of a snapshot in world units.
///
/// # Errors
/// Those of `out`.
pub(super) fn write_ply(
    out: &mut dyn Write,
    snapshot: &Snapshot,
    frame: &Frame,
    options: &MeshOptions,
) -> io::Result<()> {
    let mesh = &snapshot.mesh;
    out.write_all(header(mesh.positions.len(), mesh.indices.len(), options).as_bytes())?;
    for (index, &position) in mesh.positions.iter().enumerate() {
        let light = Light::at(snapshot, index, options);
        write_vector(out, frame.to_world(position).as_vec3())?;
        write_vector(out, mesh.normals[index])?;
        out.write_all(&options.color.encode(light.radiance))?;
        write_vector(out, light.radiance)?;
        write_vector(out, light.irradiance)?;
    }
    for corners in &mesh.indices {
        out.write_all(&[3])?;
        for corner in corners {
            out.write_all(&(*corner as i32).to_le_bytes())?;
        }
    }
    Ok(())
}

fn header(vertex_count: usize, face_count: usize, options: &MeshOptions) -> String {
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

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::{super::mesh::tests::triangle, *};

    #[test]
    fn radiance_is_emission_plus_reflected_irradiance_over_pi_in_world_units() {
        let frame = Frame {
            centre: DVec3::new(10.0, 0.0, 0.0),
            scale: 2.0,
        };
        let mut bytes = Vec::new();
        write_ply(&mut bytes, &triangle(), &frame, &MeshOptions::default()).unwrap();
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
