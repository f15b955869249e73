//! The description of a GLB, its JSON chunk.

use std::{collections::BTreeMap, f64::consts::FRAC_1_SQRT_2};

use glam::Vec3;
use serde_json::{Map, Value, json};

use super::{
    super::{
        MeshOptions,
        mesh::{HARMONICS_MEANING, LitMesh},
    },
    ATTRIBUTE_BYTES, Content, Mesh, TRIANGLE_BYTES, from_node,
};
use crate::scene::{Frame, Material, ObjectName, UpAxis};

/// Numbers that the glTF specification gives to kinds of values and of buffers.
pub(super) const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// Describe what follows in the file.
pub(super) fn document(content: &Content<'_>, lit: LitMesh<'_>, options: &MeshOptions) -> Value {
    let sizes = content.sizes();
    let nodes = nodes(content, &lit.scene.frame, options.up);
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
        "asset": {
            "version": "2.0",
            "generator": concat!("vecrad ", env!("CARGO_PKG_VERSION")),
        },
        "extensionsUsed": ["KHR_materials_unlit"],
        "scene": 0,
        "scenes": [{ "nodes": [root(nodes.len(), options.up)] }],
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

/// What an object is called, with its group.
fn name_of(name: Option<&ObjectName>) -> String {
    let parts = name.map(|name| [&*name.object, &*name.group]);
    let named: Vec<&str> = parts
        .into_iter()
        .flatten()
        .filter(|part| !part.is_empty())
        .collect();
    match named[..] {
        [] => "lit mesh".to_owned(),
        _ => named.join("/"),
    }
}

/// The place of all objects, then one node for each; last the root that turns +Z up, where the scene needs one.
fn nodes(content: &Content<'_>, frame: &Frame, up: UpAxis) -> Vec<Value> {
    let children: Vec<usize> = (1..=content.meshes.len()).collect();
    let centre = frame.centre.to_array();
    let lit = json!({ "name": "lit scene", "children": children, "translation": centre });
    let objects = content.meshes.iter().enumerate();
    let objects = objects.map(|(index, mesh)| json!({ "name": name_of(mesh.name), "mesh": index }));
    let mut nodes: Vec<Value> = std::iter::once(lit).chain(objects).collect();
    if up == UpAxis::Z {
        // A quarter turn about X takes +Z to +Y.
        let rotation = [-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2];
        nodes.push(json!({ "name": "+Z is up", "rotation": rotation, "children": [0] }));
    }
    nodes
}

/// The node that holds all others.
fn root(count: usize, up: UpAxis) -> usize {
    match up {
        UpAxis::Y => 0,
        UpAxis::Z => count - 1,
    }
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
        let count = mesh.vertices.len() as u64;
        let position = accessors.len();
        accessors.extend((0..sizes.attributes).map(|attribute| {
            json!({
                "bufferView": 0,
                "byteOffset": start + ATTRIBUTE_BYTES * count * attribute,
                "componentType": FLOAT,
                "count": count,
                "type": "VEC3",
            })
        }));
        let [least, most] = bounds(mesh, lit);
        accessors[position]["min"] = json!(least.to_array().map(f64::from));
        accessors[position]["max"] = json!(most.to_array().map(f64::from));
        for primitive in &mesh.primitives {
            let count = primitive.triangles.len() as u64;
            accessors.push(json!({
                "bufferView": 1,
                "byteOffset": triangles * TRIANGLE_BYTES,
                "componentType": UNSIGNED_INT,
                "count": 3 * count,
                "type": "SCALAR",
            }));
            triangles += count;
        }
        vertices += count;
    }
    accessors
}

/// Least and largest coordinates of an object, from its node.
fn bounds(mesh: &Mesh<'_>, lit: LitMesh<'_>) -> [Vec3; 2] {
    let positions = &lit.snapshot.mesh.positions;
    let places = mesh
        .vertices
        .iter()
        .map(|&vertex| from_node(positions[vertex as usize], &lit.scene.frame));
    places.fold([Vec3::MAX, Vec3::MIN], |[least, most], place| {
        [least.min(place), most.max(place)]
    })
}
