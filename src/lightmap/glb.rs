//! Binary glTF 2.0 (GLB) of the scene's own triangles under its lightmap.
//!
//! A node and a mesh for each object, a primitive for each material of it. Materials keep their names and are unlit
//! (`KHR_materials_unlit`): their base colour is the lightmap, looked up at `TEXCOORD_1`, times the reflectance; where that
//! would not do, the texels hold radiance (see `meshes`). `TEXCOORD_0` are the file's own coordinates where it has textures;
//! without, it repeats `TEXCOORD_1`, since the format numbers them from 0. Positions count from the place of the nodes, and a
//! root turns +Z up, as in the GLB of light at vertices.

use std::io::{self, Write};

use glam::{Vec2, Vec3};
use serde_json::{Map, Value, json};

use super::{
    bake::Lightmap,
    images,
    meshes::{Alpha, Look, Looks, Part, Vertex, parts},
};
use crate::{
    export::{
        MeshOptions,
        glb_container::{
            ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER, TRIANGLE_BYTES, asset, bound, file_length, floats,
            from_node, indices, name_of, nodes, text, write_head, write_numbers,
        },
    },
    scene::Scene,
    solver::Snapshot,
};

/// Numbers that the glTF specification gives to kinds of lookups.
const LINEAR: u32 = 9729;
const CLAMP_TO_EDGE: u32 = 33071;

/// An attribute of vertices: its name, its type, and floats of it.
type Attribute = (&'static str, &'static str, u64);

/// Without and with coordinates of the file, in the order of the vertices in the file.
const PLAIN: &[Attribute] = &[
    ("POSITION", "VEC3", 3),
    ("NORMAL", "VEC3", 3),
    ("TEXCOORD_1", "VEC2", 2),
];
const TEXTURED: &[Attribute] = &[
    ("POSITION", "VEC3", 3),
    ("NORMAL", "VEC3", 3),
    ("TEXCOORD_1", "VEC2", 2),
    ("TEXCOORD_0", "VEC2", 2),
];

/// The lengths of a GLB have 32 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a GLB holds less than 4 GiB, too little for {triangles} triangles with their lightmap")]
struct TooLarge {
    triangles: u64,
}

impl Lightmap {
    /// Write the scene as a GLB that shows it.
    ///
    /// # Errors
    /// Those of `out`, and one sentence where it does not fit.
    pub fn write_glb(
        &self,
        out: &mut dyn Write,
        scene: &Scene,
        snapshot: &Snapshot,
        options: &MeshOptions,
    ) -> io::Result<()> {
        let Looks { looks, picture } = Looks::of(scene, snapshot, self, options);
        let has_alpha = looks.iter().any(|look| look.alpha == Alpha::CutOut);
        let picture = picture.into_iter();
        let mut picture = match has_alpha {
            true => images::transparent(picture, self.layout.side),
            false => images::display(picture.map(|value| value.truncate()), self.layout.side),
        }
        .map_err(io::Error::other)?;
        let picture_length = picture.len() as u64;
        picture.resize(picture.len().next_multiple_of(4), 0);
        let file = File {
            scene,
            map: self,
            options,
            looks,
            objects: parts(scene, self),
            attributes: match scene.texcoords.is_empty() {
                true => PLAIN,
                false => TEXTURED,
            },
            picture_length,
        };
        let (text, buffer) = (text(&file.document()), file.buffer_length());
        let length = file_length(text.len() as u64, buffer).ok_or_else(|| {
            let triangles = file.triangles();
            io::Error::new(io::ErrorKind::InvalidInput, TooLarge { triangles })
        })?;
        write_head(out, length, &text, buffer)?;
        for vertex in file.parts().flat_map(|part| &part.vertices) {
            file.write_vertex(out, vertex)?;
        }
        let mut triangles = file.parts().flat_map(|part| &part.indices);
        triangles.try_for_each(|corners| write_numbers(out, corners))?;
        out.write_all(&picture)
    }
}

/// What is written.
struct File<'a> {
    scene: &'a Scene,
    map: &'a Lightmap,
    options: &'a MeshOptions,
    looks: Vec<Look>,
    objects: Vec<Vec<Part>>,
    attributes: &'static [Attribute],
    picture_length: u64,
}

impl File<'_> {
    fn parts(&self) -> impl Iterator<Item = &Part> {
        self.objects.iter().flatten()
    }

    fn triangles(&self) -> u64 {
        self.parts().map(|part| part.indices.len() as u64).sum()
    }

    fn vertex_bytes(&self) -> u64 {
        self.attributes.iter().map(|(.., floats)| 4 * floats).sum()
    }

    fn vertices_length(&self) -> u64 {
        let vertices = self.parts().map(|part| part.vertices.len() as u64);
        vertices.sum::<u64>() * self.vertex_bytes()
    }

    fn indices_length(&self) -> u64 {
        self.triangles() * TRIANGLE_BYTES
    }

    /// Vertices, indices, then the picture, filled up to a multiple of 4.
    fn buffer_length(&self) -> u64 {
        self.vertices_length() + self.indices_length() + self.picture_length.next_multiple_of(4)
    }

    fn write_vertex(&self, out: &mut dyn Write, vertex: &Vertex) -> io::Result<()> {
        let Vertex {
            normal, own, place, ..
        } = *vertex;
        let position = self.position(vertex);
        let own: &[Vec2] = if self.attributes.len() > PLAIN.len() {
            &[own]
        } else {
            &[]
        };
        let floats = [position, normal]
            .into_iter()
            .flat_map(|value| value.to_array());
        let coordinates = [&[place], own].concat();
        let coordinates = coordinates.into_iter().flat_map(|at| at.to_array());
        let bytes: Vec<u8> = floats
            .chain(coordinates)
            .flat_map(f32::to_le_bytes)
            .collect();
        out.write_all(&bytes)
    }

    /// The JSON chunk.
    fn document(&self) -> Value {
        let (meshes, accessors) = self.meshes();
        let names = self.scene.objects.iter().map(|object| Some(&object.name));
        let (nodes, root) = nodes(names, &self.scene.frame, self.options.up);
        let materials = self.scene.materials.iter().zip(&self.looks);
        let materials: Vec<Value> = materials
            .map(|(known, look)| material(&known.name, look))
            .collect();
        let [vertices, indices] = [self.vertices_length(), self.indices_length()];
        json!({
            "asset": asset(),
            "extensionsUsed": ["KHR_materials_unlit"],
            "scene": 0,
            "scenes": [{
                "nodes": [root],
                "extras": {
                    "exposure_ev": self.options.color.exposure_ev,
                    "emission_scale": self.options.emission_scale,
                    "texels_per_unit": self.map.facts().texels_per_unit,
                },
            }],
            "nodes": nodes,
            "meshes": meshes,
            "materials": materials,
            "textures": [{ "source": 0, "sampler": 0 }],
            "samplers": [{
                "magFilter": LINEAR,
                "minFilter": LINEAR,
                "wrapS": CLAMP_TO_EDGE,
                "wrapT": CLAMP_TO_EDGE,
            }],
            "images": [{ "name": "lightmap", "mimeType": "image/png", "bufferView": 2 }],
            "accessors": accessors,
            "bufferViews": [
                {
                    "buffer": 0,
                    "byteOffset": 0,
                    "byteLength": vertices,
                    "byteStride": self.vertex_bytes(),
                    "target": ARRAY_BUFFER,
                },
                {
                    "buffer": 0,
                    "byteOffset": vertices,
                    "byteLength": indices,
                    "target": ELEMENT_ARRAY_BUFFER,
                },
                {
                    "buffer": 0,
                    "byteOffset": vertices + indices,
                    "byteLength": self.picture_length,
                },
            ],
            "buffers": [{ "byteLength": self.buffer_length() }],
        })
    }

    /// Meshes, and the accessors of their primitives.
    fn meshes(&self) -> (Vec<Value>, Vec<Value>) {
        let (mut meshes, mut accessors) = (Vec::new(), Vec::new());
        let (mut vertices, mut triangles) = (0, 0);
        for (object, parts) in self.scene.objects.iter().zip(&self.objects) {
            let mut primitives = Vec::new();
            for part in parts {
                let mut attributes = Map::new();
                let mut offset = vertices * self.vertex_bytes();
                for (attribute, kind, count) in self.attributes {
                    attributes.insert((*attribute).to_owned(), json!(accessors.len()));
                    accessors.push(floats(offset, part.vertices.len(), kind));
                    offset += 4 * count;
                }
                let places = attributes["TEXCOORD_1"].clone();
                attributes.entry("TEXCOORD_0").or_insert(places);
                let position = accessors.len() - self.attributes.len();
                let places = part.vertices.iter();
                bound(
                    &mut accessors[position],
                    places.map(|vertex| self.position(vertex)),
                );
                primitives.push(json!({
                    "attributes": attributes,
                    "indices": accessors.len(),
                    "material": part.material,
                }));
                accessors.push(indices(triangles * TRIANGLE_BYTES, part.indices.len()));
                vertices += part.vertices.len() as u64;
                triangles += part.indices.len() as u64;
            }
            let name = name_of(Some(&object.name));
            meshes.push(json!({ "name": name, "primitives": primitives }));
        }
        (meshes, accessors)
    }

    /// Of a vertex, from the place of its node.
    fn position(&self, vertex: &Vertex) -> Vec3 {
        from_node(
            self.scene.positions[vertex.point as usize],
            &self.scene.frame,
        )
    }
}

/// An unlit material.
fn material(known: &str, look: &Look) -> Value {
    let factor = look
        .factor
        .to_array()
        .map(|channel| f64::from(channel.clamp(0.0, 1.0)));
    let mut material = json!({
        "doubleSided": false,
        "alphaMode": match look.alpha {
            Alpha::Opaque => "OPAQUE",
            Alpha::CutOut => "MASK",
            Alpha::Blended => "BLEND",
        },
        "pbrMetallicRoughness": {
            "baseColorFactor": factor,
            "baseColorTexture": { "index": 0, "texCoord": 1 },
            "metallicFactor": 0,
            "roughnessFactor": 1,
        },
        "extensions": { "KHR_materials_unlit": {} },
        "extras": { "texels": if look.is_baked { "radiance" } else { "irradiance / pi" } },
    });
    if !known.is_empty() {
        material["name"] = json!(known);
    }
    material
}
