//! Binary glTF 2.0 (GLB) of the display mesh with light at its vertices.
//!
//! Per vertex: position, normal, `COLOR_0`, `_RADIANCE` and `_IRRADIANCE`, all floats, `_SH0` to `_SH3` where light by
//! direction is asked for, and `_RADIANCE_0`, `_IRRADIANCE_0` and on where that of each lamp is. `COLOR_0` is exposed linear
//! radiance cut off at 1, as the format demands, without a tone curve, which is the viewer's to apply; the others keep the
//! full range. Each object of the scene is a mesh, each of its materials a primitive. Materials are unlit
//! (`KHR_materials_unlit`): the light is in the colours already; they carry roughness and metalness for those who light the
//! mesh themselves.
//!
//! Positions are world units from the node's place, so that single precision suffices far from the origin. glTF is Y-up: a
//! scene with +Z up stands under a turned root node, its numbers stay. Each side of a two-sided face has triangles of its
//! own, so that the material is one-sided always. Textures are omitted: vertices have their mean.

pub(crate) mod container;
mod document;

use std::io::{self, Write};

use glam::Vec3;

use super::{
    MeshOptions,
    mesh::{Light, LitMesh, write_vector},
    parts::by_object,
};
use crate::scene::ObjectName;
use container::{TRIANGLE_BYTES, file_length, from_node, text, write_head, write_numbers};
use document::document;

/// Attributes of every vertex of a mesh, three floats each, in the order of the file; those that are asked for follow.
const ATTRIBUTES: [&str; 5] = ["POSITION", "NORMAL", "COLOR_0", "_RADIANCE", "_IRRADIANCE"];

/// Those of light by direction.
const HARMONICS: [&str; 4] = ["_SH0", "_SH1", "_SH2", "_SH3"];

const ATTRIBUTE_BYTES: u64 = 12;

/// Why a mesh does not become a GLB.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
enum GlbError {
    /// The format knows no empty meshes.
    #[error("there is no surface to write")]
    Empty,
    /// Lengths and indices have 32 bits.
    #[error(
        "a GLB holds less than 4 GiB and 4,294,967,295 vertices, too few for {vertices} vertices and {triangles} triangles; write a PLY instead"
    )]
    TooLarge {
        /// Of the mesh.
        vertices: u64,
        /// Of the mesh.
        triangles: u64,
    },
}

/// Write a lit mesh.
///
/// # Errors
/// Those of `out`, and one sentence where the mesh is empty or does not fit.
pub(super) fn write_glb(
    out: &mut dyn Write,
    lit: LitMesh<'_>,
    options: &MeshOptions,
) -> io::Result<()> {
    let content = Content::of(lit, options.merge);
    let sizes = content.sizes();
    let refused = |error| io::Error::new(io::ErrorKind::InvalidInput, error);
    sizes.check().map_err(refused)?;
    let text = text(&document(&content, lit, options));
    let length = sizes.file_length(text.len() as u64).map_err(refused)?;
    write_head(out, length, &text, sizes.buffer_length())?;
    for mesh in &content.meshes {
        // One attribute behind the other: vertices with all of theirs together may be longer than the format allows.
        let mut blocks = vec![Vec::new(); content.attributes.len()];
        for &vertex in &mesh.vertices {
            let values = vertex_values(lit, vertex as usize, options);
            for (block, value) in blocks.iter_mut().zip(values) {
                write_vector(block, value)?;
            }
        }
        blocks.iter().try_for_each(|block| out.write_all(block))?;
    }
    let primitives = content.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let mut triangles = primitives.flat_map(|primitive| &primitive.triangles);
    triangles.try_for_each(|triangle| write_numbers(out, triangle))
}

/// The attributes of a vertex, in the order of [`Content::attributes`].
fn vertex_values<'a>(
    lit: LitMesh<'a>,
    vertex: usize,
    options: &'a MeshOptions,
) -> impl Iterator<Item = Vec3> + 'a {
    let mesh = &lit.snapshot.mesh;
    let light = Light::at(lit, vertex, options);
    let shown = [
        from_node(mesh.positions[vertex], &lit.scene.frame),
        mesh.normals[vertex].normalize_or(Vec3::Y),
        options.color.exposed(light.radiance).min(Vec3::ONE),
    ];
    shown.into_iter().chain(light.values(lit, vertex, options))
}

/// What the file holds, without the values of vertices.
struct Content<'a> {
    meshes: Vec<Mesh<'a>>,
    /// Names of the attributes of a vertex.
    attributes: Vec<String>,
}

/// One object.
struct Mesh<'a> {
    /// What it is called; `None` where all objects are one.
    name: Option<&'a ObjectName>,
    /// Indices into the vertices of the display mesh.
    vertices: Vec<u32>,
    primitives: Vec<Primitive>,
}

/// The triangles of one material.
struct Primitive {
    /// Index into the scene's materials.
    material: usize,
    /// Indices into the vertices of the object.
    triangles: Vec<[u32; 3]>,
}

impl<'a> Content<'a> {
    fn of(lit: LitMesh<'a>, merge: bool) -> Self {
        let mesh = &lit.snapshot.mesh;
        let mut place: Vec<Option<u32>> = vec![None; mesh.positions.len()];
        let meshes = by_object(mesh, lit.scene, merge).into_iter().map(|object| {
            let mut vertices = Vec::new();
            let mut numbered = |vertex: u32| {
                *place[vertex as usize].get_or_insert_with(|| {
                    vertices.push(vertex);
                    vertices.len() as u32 - 1
                })
            };
            let parts = object.parts.into_iter();
            let primitives = parts
                .map(|part| Primitive {
                    material: part.material,
                    triangles: part
                        .triangles
                        .iter()
                        .map(|&triangle| mesh.indices[triangle as usize].map(&mut numbered))
                        .collect(),
                })
                .collect();
            // Other objects number the vertices that they share anew.
            for &vertex in &vertices {
                place[vertex as usize] = None;
            }
            Mesh {
                name: object.name,
                vertices,
                primitives,
            }
        });
        let meshes = meshes.collect();
        let harmonics = lit.harmonics.map_or([].as_slice(), |_| &HARMONICS);
        let plain = ATTRIBUTES.iter().chain(harmonics);
        let of_lamps = (0..lit.lamps.len())
            .flat_map(|lamp| [format!("_RADIANCE_{lamp}"), format!("_IRRADIANCE_{lamp}")]);
        Self {
            meshes,
            attributes: plain
                .map(|name| (*name).to_owned())
                .chain(of_lamps)
                .collect(),
        }
    }

    fn sizes(&self) -> Sizes {
        let primitives = self.meshes.iter().flat_map(|mesh| &mesh.primitives);
        Sizes {
            vertices: self.meshes.iter().map(|it| it.vertices.len() as u64).sum(),
            triangles: primitives.map(|it| it.triangles.len() as u64).sum(),
            attributes: self.attributes.len() as u64,
        }
    }
}

/// How much there is to write.
#[derive(Clone, Copy, Debug)]
struct Sizes {
    vertices: u64,
    triangles: u64,
    /// Of a vertex.
    attributes: u64,
}

impl Sizes {
    fn vertex_bytes(self) -> u64 {
        self.attributes * ATTRIBUTE_BYTES
    }

    fn vertices_length(self) -> u64 {
        self.vertices * self.vertex_bytes()
    }

    fn indices_length(self) -> u64 {
        self.triangles * TRIANGLE_BYTES
    }

    /// Vertices, then indices: a multiple of 4, as chunks must be.
    fn buffer_length(self) -> u64 {
        self.vertices_length() + self.indices_length()
    }

    /// Whether there is something to write, and it may fit.
    fn check(self) -> Result<(), GlbError> {
        self.file_length(0).map(|_| ())
    }

    /// Bytes of the file with a description of this length. Where that has 32 bits, no index can be the one that is
    /// reserved: vertices take more than a byte each.
    fn file_length(self, text_length: u64) -> Result<u32, GlbError> {
        if self.vertices == 0 || self.triangles == 0 {
            return Err(GlbError::Empty);
        }
        file_length(text_length, self.buffer_length()).ok_or(GlbError::TooLarge {
            vertices: self.vertices,
            triangles: self.triangles,
        })
    }
}

#[cfg(test)]
mod tests;
