//! OBJ of the display mesh with light at its vertices, and its materials in an MTL file beside it.
//!
//! Vertices are `v x y z r g b`: world units, and the displayed colour as sRGB numbers of 0…1, which Blender, MeshLab and
//! CloudCompare read. Objects, groups and materials are those of the scene, textures are written beside the MTL file. Each
//! side of a two-sided face has triangles of its own, since each has light of its own.

use std::io::{self, Write};

use glam::Vec3;

use super::{
    LitMesh, MeshOptions,
    mesh::Light,
    parts::{ObjectParts, Part, by_object},
};
use crate::scene::{MaterialLibrary, ObjectName, coordinates, write_name};

/// Write the display mesh of a snapshot.
///
/// # Errors
/// Those of `out`.
pub(super) fn write_obj(
    out: &mut dyn Write,
    lit: LitMesh<'_>,
    options: &MeshOptions,
    library: &MaterialLibrary,
) -> io::Result<()> {
    let (mesh, scene) = (&*lit.snapshot.mesh, lit.scene);
    let color = &options.color;
    writeln!(out, "# vecrad {}", env!("CARGO_PKG_VERSION"))?;
    writeln!(
        out,
        "# vertex colours: sRGB, exposure {} EV, tone curve {}",
        color.exposure_ev,
        color.tone_map.name()
    )?;
    writeln!(out, "# up axis {}", options.up.name())?;
    writeln!(out, "mtllib {}", library.name())?;
    for (index, &position) in mesh.positions.iter().enumerate() {
        let [x, y, z] = coordinates(&scene.frame, position);
        let radiance = Light::at(lit, index, options).radiance;
        let Vec3 { x: r, y: g, z: b } = color.displayed(radiance);
        writeln!(out, "v {x} {y} {z} {r:.5} {g:.5} {b:.5}")?;
    }
    for uv in &mesh.texcoords {
        writeln!(out, "vt {} {}", uv.x, uv.y)?;
    }
    for normal in &mesh.normals {
        let Vec3 { x, y, z } = normal.normalize_or(Vec3::Y);
        writeln!(out, "vn {x:.5} {y:.5} {z:.5}")?;
    }
    let has_texcoords = !mesh.texcoords.is_empty();
    let mut before: Option<&ObjectName> = None;
    let mut material = None;
    for ObjectParts { name, parts } in by_object(mesh, scene, options.merge) {
        if let Some(name) = name {
            write_name(out, name, before)?;
            before = Some(name);
        }
        for part in parts {
            if material != Some(part.material) {
                material = Some(part.material);
                writeln!(out, "usemtl {}", library.material_names()[part.material])?;
            }
            write_faces(out, &mesh.indices, &part, has_texcoords)?;
        }
    }
    Ok(())
}

fn write_faces(
    out: &mut dyn Write,
    indices: &[[u32; 3]],
    part: &Part,
    has_texcoords: bool,
) -> io::Result<()> {
    part.triangles.iter().try_for_each(|&triangle| {
        let [a, b, c] = indices[triangle as usize].map(|corner| corner + 1);
        match has_texcoords {
            true => writeln!(out, "f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}"),
            false => writeln!(out, "f {a}//{a} {b}//{b} {c}//{c}"),
        }
    })
}
