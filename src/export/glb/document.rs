//! The description of a GLB, its JSON chunk.

use std::collections::BTreeMap;

use serde_json::{Map, Value, json};

use super::{
    super::{
        MeshOptions,
        mesh::{HARMONICS_MEANING, LitMesh},
    },
    ATTRIBUTE_BYTES, Content, Mesh,
    container::{
        ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER, TRIANGLE_BYTES, asset, bound, floats, from_node,
        indices, name_of, nodes,
    },
};
use crate::scene::Material;

/// Describe what follows in the file.
pub(super) fn document(content: &Content<'_>, lit: LitMesh<'_>, options: &MeshOptions) -> Value {
    let sizes = content.sizes();
    let names = content.meshes.iter().map(|mesh| mesh.name);
    let (nodes, root) = nodes(names, &lit.scene.frame, options.up);
    let used = used_materials(content);
    let materials: Vec<Value> = used
        .keys()
        .map(|&index| material(&lit.scene.materials[index]))
        .collect();
    let extras = extras(lit, options);
    let mut first_accessor = 0;
    let meshes: Vec<Value> = content
        .meshes
        .iter()
        .map(|mesh| {
            let primitives = primitives(mesh, &content.attributes, first_accessor, &used);
            first_accessor += content.attributes.len() + mesh.primitives.len();
            json!({ "name": name_of(mesh.name), "primitives": primitives, "extras": extras })
        })
        .collect();
    json!({
        "asset": asset(),
        "extensionsUsed": ["KHR_materials_unlit"],
        "scene": 0,
        "scenes": [{ "nodes": [root] }],
        "nodes": nodes,
        "meshes": meshes,
        "materials": materials,
        "accessors": accessors(content, lit),
        "bufferViews": [
            {
                "buffer": 0,
                "byteOffset": 0,
                "byteLength": sizes.vertices_length(),
                "byteStride": ATTRIBUTE_BYTES,
                "target": ARRAY_BUFFER,
            },
            {
                "buffer": 0,
                "byteOffset": sizes.vertices_length(),
                "byteLength": sizes.indices_length(),
                "target": ELEMENT_ARRAY_BUFFER,
            },
        ],
        "buffers": [{ "byteLength": sizes.buffer_length() }],
    })
}

/// What the values of vertices are.
fn extras(lit: LitMesh<'_>, options: &MeshOptions) -> Value {
    let mut extras = json!({
        "exposure_ev": options.color.exposure_ev,
        "emission_scale": options.emission_scale,
        "radiance": "linear, W/(sr m^2)",
        "irradiance": "linear, W/m^2",
    });
    if lit.harmonics.is_some() {
        extras["spherical_harmonics"] = json!(HARMONICS_MEANING);
    }
    if !lit.lamps.is_empty() {
        let names = lit.lamps.iter().map(|lamp| lit.lamp_name(lamp.lamp));
        extras["lamps"] = names.collect();
    }
    extras
}

/// Number in the file by material of the scene.
fn used_materials(content: &Content<'_>) -> BTreeMap<usize, usize> {
    let primitives = content.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let mut used: BTreeMap<usize, usize> = primitives
        .map(|primitive| (primitive.material, 0))
        .collect();
    for (number, place) in used.values_mut().enumerate() {
        *place = number;
    }
    used
}

/// An unlit material.
fn material(material: &Material) -> Value {
    let finish = material.finish();
    let mut described = json!({
        "doubleSided": false,
        "pbrMetallicRoughness": {
            "metallicFactor": finish.metalness,
            "roughnessFactor": finish.roughness,
        },
        "extensions": { "KHR_materials_unlit": {} },
    });
    if !material.name.is_empty() {
        described["name"] = json!(material.name);
    }
    described
}

/// The materials of an object, whose accessors begin at this one.
fn primitives(
    mesh: &Mesh<'_>,
    names: &[String],
    first_accessor: usize,
    used: &BTreeMap<usize, usize>,
) -> Vec<Value> {
    let attributes: Map<String, Value> = names
        .iter()
        .zip(first_accessor..)
        .map(|(name, accessor)| (name.clone(), json!(accessor)))
        .collect();
    let numbered = mesh.primitives.iter().zip(first_accessor + names.len()..);
    numbered
        .map(|(primitive, indices)| {
            json!({
                "attributes": attributes,
                "indices": indices,
                "material": used[&primitive.material],
            })
        })
        .collect()
}

/// For each object, one for each attribute, then the indices of each primitive.
fn accessors(content: &Content<'_>, lit: LitMesh<'_>) -> Vec<Value> {
    let sizes = content.sizes();
    let mut accessors = Vec::new();
    let (mut vertices, mut triangles) = (0, 0);
    for mesh in &content.meshes {
        let start = vertices * sizes.vertex_bytes();
        let count = mesh.vertices.len();
        let position = accessors.len();
        accessors.extend((0..sizes.attributes).map(|attribute| {
            floats(
                start + ATTRIBUTE_BYTES * count as u64 * attribute,
                count,
                "VEC3",
            )
        }));
        let places = mesh.vertices.iter().map(|&vertex| {
            let position = lit.snapshot.mesh.positions[vertex as usize];
            from_node(position, &lit.scene.frame)
        });
        bound(&mut accessors[position], places);
        for primitive in &mesh.primitives {
            let count = primitive.triangles.len();
            accessors.push(indices(triangles * TRIANGLE_BYTES, count));
            triangles += count as u64;
        }
        vertices += count as u64;
    }
    accessors
}
