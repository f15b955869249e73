//! Binary glTF 2.0 (GLB) of the display mesh with light at its vertices.
//!
//! Per vertex: position, normal, `COLOR_0`, `_RADIANCE` and `_IRRADIANCE`, all floats, and `_SH0` to `_SH3` where light by
//! direction is asked for. `COLOR_0` is exposed linear radiance cut off at 1, as the format demands, without a tone curve,
//! which is the viewer's to apply; the others keep the full range. Materials are unlit (`KHR_materials_unlit`): the light is in the colours already. There is one for each finish, which
//! carries its roughness and metalness for those who light the mesh themselves.
//!
//! Positions are world units from the node's place, so that single precision suffices far from the origin. glTF is Y-up: a
//! scene with +Z up stands under a turned root node, its numbers stay. Each side of a two-sided face has triangles of its
//! own, so that the material is one-sided always. Textures are omitted: vertices have their mean.

use std::{
    f64::consts::FRAC_1_SQRT_2,
    io::{self, Write},
};

use glam::Vec3;
use serde_json::{Value, json};

use super::{
    MeshOptions,
    mesh::{HARMONICS_MEANING, Light, LitMesh, write_vector},
};
use crate::{
    scene::{Finish, Frame, UpAxis},
    solver::DisplayMesh,
};

/// Attributes of a vertex, three floats each, in the order of the file; those of light by direction come last.
const ATTRIBUTES: [&str; 9] = [
    "POSITION",
    "NORMAL",
    "COLOR_0",
    "_RADIANCE",
    "_IRRADIANCE",
    "_SH0",
    "_SH1",
    "_SH2",
    "_SH3",
];

/// Number of attributes without light by direction.
const PLAIN_ATTRIBUTES: usize = 5;

const ATTRIBUTE_BYTES: u64 = 12;

/// Three indices of 32 bits.
const TRIANGLE_BYTES: u64 = 12;

/// Header of the file; length and kind of a chunk.
const HEADER_BYTES: u64 = 12;
const CHUNK_HEADER_BYTES: u64 = 8;

/// Numbers that the glTF specification gives to kinds of values and of buffers.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

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
    let (mesh, frame) = (&*lit.snapshot.mesh, lit.frame);
    let sizes = Sizes::of(lit);
    let parts = parts(mesh);
    let mut text = document(lit, &parts, options).to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let length = sizes
        .file_length(text.len() as u64)
        .map_err(|error| io::Error::new(io::ErrorKind::InvalidInput, error))?;
    out.write_all(b"glTF")?;
    write_numbers(out, &[2, length])?;
    write_numbers(out, &[text.len() as u32])?;
    out.write_all(b"JSON")?;
    out.write_all(&text)?;
    write_numbers(out, &[sizes.buffer_length() as u32])?;
    out.write_all(b"BIN\0")?;
    for (index, &position) in mesh.positions.iter().enumerate() {
        let light = Light::at(lit, index, options);
        write_vector(out, from_node(position, frame))?;
        write_vector(out, mesh.normals[index].normalize_or(Vec3::Y))?;
        write_vector(out, options.color.exposed(light.radiance).min(Vec3::ONE))?;
        write_vector(out, light.radiance)?;
        write_vector(out, light.irradiance)?;
        for coefficient in light.harmonics.into_iter().flatten() {
            write_vector(out, coefficient)?;
        }
    }
    let mut triangles = parts.iter().flat_map(|part| &part.triangles);
    triangles.try_for_each(|&triangle| write_numbers(out, &mesh.indices[triangle as usize]))
}

/// The triangles of one finish.
struct Part {
    finish: Finish,
    triangles: Vec<u32>,
}

/// The triangles by finish, in the order in which finishes come.
fn parts(mesh: &DisplayMesh) -> Vec<Part> {
    let mut parts: Vec<Part> = Vec::new();
    let mut of_material: Vec<Option<usize>> = vec![None; mesh.finishes.len().max(1)];
    for triangle in 0..mesh.indices.len() {
        let material = mesh.material_of.get(triangle).map_or(0, |&at| at as usize);
        let finish = mesh.finishes.get(material).copied().unwrap_or(Finish::MATT);
        let known = of_material.get_mut(material).and_then(|part| {
            if part.is_none() {
                *part = parts.iter().position(|part| part.finish == finish);
            }
            *part
        });
        let index = known.unwrap_or_else(|| {
            parts.push(Part {
                finish,
                triangles: Vec::new(),
            });
            parts.len() - 1
        });
        parts[index].triangles.push(triangle as u32);
    }
    parts
}

/// How much there is to write.
#[derive(Clone, Copy, Debug)]
struct Sizes {
    vertices: u64,
    triangles: u64,
    /// Of a vertex.
    attributes: usize,
}

impl Sizes {
    fn of(lit: LitMesh<'_>) -> Self {
        let mesh = &lit.snapshot.mesh;
        Self {
            vertices: mesh.positions.len() as u64,
            triangles: mesh.indices.len() as u64,
            attributes: match lit.harmonics {
                Some(_) => ATTRIBUTES.len(),
                None => PLAIN_ATTRIBUTES,
            },
        }
    }

    fn vertex_bytes(self) -> u64 {
        self.attributes as u64 * ATTRIBUTE_BYTES
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

    /// Bytes of the file with a description of this length. Where that has 32 bits, no index can be the one that is
    /// reserved: vertices take more than a byte each.
    fn file_length(self, text_length: u64) -> Result<u32, GlbError> {
        if self.vertices == 0 || self.triangles == 0 {
            return Err(GlbError::Empty);
        }
        let length = HEADER_BYTES + 2 * CHUNK_HEADER_BYTES + text_length + self.buffer_length();
        u32::try_from(length).map_err(|_| GlbError::TooLarge {
            vertices: self.vertices,
            triangles: self.triangles,
        })
    }
}

/// A position of the mesh in world units from the place of its node.
fn from_node(position: Vec3, frame: &Frame) -> Vec3 {
    let distance = (position.as_dvec3() / frame.scale).as_vec3();
    distance.clamp(Vec3::MIN, Vec3::MAX)
}

/// The JSON chunk.
fn document(lit: LitMesh<'_>, parts: &[Part], options: &MeshOptions) -> Value {
    let nodes = nodes(lit.frame, options.up);
    let sizes = Sizes::of(lit);
    let names = &ATTRIBUTES[..sizes.attributes];
    let primitives = (0..parts.len()).map(|part| primitive(names, part));
    let primitives: Vec<Value> = primitives.collect();
    let materials: Vec<Value> = parts.iter().map(|part| material(part.finish)).collect();
    let mut extras = json!({
        "exposure_ev": options.color.exposure_ev,
        "emission_scale": options.emission_scale,
        "radiance": "linear, W/(sr m^2)",
        "irradiance": "linear, W/m^2",
    });
    if lit.harmonics.is_some() {
        extras["spherical_harmonics"] = json!(HARMONICS_MEANING);
    }
    json!({
        "asset": {
            "version": "2.0",
            "generator": concat!("vecrad ", env!("CARGO_PKG_VERSION")),
        },
        "extensionsUsed": ["KHR_materials_unlit"],
        "scene": 0,
        "scenes": [{ "nodes": [nodes.len() - 1] }],
        "nodes": nodes,
        "meshes": [{
            "name": "lit mesh",
            "primitives": primitives,
            "extras": extras,
        }],
        "materials": materials,
        "accessors": accessors(lit, parts),
        "bufferViews": [
            {
                "buffer": 0,
                "byteOffset": 0,
                "byteLength": sizes.vertices_length(),
                "byteStride": sizes.vertex_bytes(),
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

/// The node of the mesh; behind it the root that turns +Z up, where the scene needs one.
fn nodes(frame: &Frame, up: UpAxis) -> Vec<Value> {
    let lit = json!({ "name": "lit scene", "mesh": 0, "translation": frame.centre.to_array() });
    match up {
        UpAxis::Y => vec![lit],
        UpAxis::Z => {
            // A quarter turn about X takes +Z to +Y.
            let rotation = [-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2];
            let root = json!({ "name": "+Z is up", "rotation": rotation, "children": [0] });
            vec![lit, root]
        }
    }
}

/// An unlit material of a finish.
fn material(finish: Finish) -> Value {
    let name = if finish == Finish::MATT {
        "lit"
    } else {
        "lit, glossy"
    };
    json!({
        "name": name,
        "doubleSided": false,
        "pbrMetallicRoughness": {
            "metallicFactor": finish.metalness,
            "roughnessFactor": finish.roughness,
        },
        "extensions": { "KHR_materials_unlit": {} },
    })
}

/// The triangles of a part, whose vertices have attributes of these names.
fn primitive(names: &[&str], part: usize) -> Value {
    let attributes: serde_json::Map<String, Value> = names
        .iter()
        .enumerate()
        .map(|(accessor, name)| ((*name).to_owned(), json!(accessor)))
        .collect();
    json!({ "attributes": attributes, "indices": names.len() + part, "material": part })
}

/// One for each attribute, then the indices of each part.
fn accessors(lit: LitMesh<'_>, parts: &[Part]) -> Vec<Value> {
    let sizes = Sizes::of(lit);
    let mut accessors: Vec<Value> = (0..sizes.attributes as u64)
        .map(|attribute| {
            json!({
                "bufferView": 0,
                "byteOffset": ATTRIBUTE_BYTES * attribute,
                "componentType": FLOAT,
                "count": sizes.vertices,
                "type": "VEC3",
            })
        })
        .collect();
    let mut least = Vec3::MAX;
    let mut most = Vec3::MIN;
    for &position in &lit.snapshot.mesh.positions {
        let place = from_node(position, lit.frame);
        least = least.min(place);
        most = most.max(place);
    }
    accessors[0]["min"] = json!(least.to_array().map(f64::from));
    accessors[0]["max"] = json!(most.to_array().map(f64::from));
    let mut before = 0;
    for part in parts {
        let count = part.triangles.len() as u64;
        accessors.push(json!({
            "bufferView": 1,
            "byteOffset": before * TRIANGLE_BYTES,
            "componentType": UNSIGNED_INT,
            "count": 3 * count,
            "type": "SCALAR",
        }));
        before += count;
    }
    accessors
}

fn write_numbers(out: &mut dyn Write, numbers: &[u32]) -> io::Result<()> {
    numbers
        .iter()
        .try_for_each(|number| out.write_all(&number.to_le_bytes()))
}

#[cfg(test)]
mod tests {
    use std::{f32::consts::PI, sync::Arc};

    use glam::{DQuat, DVec3};

    use super::{super::mesh::tests::triangle, *};
    use crate::{geometry::Harmonics, solver::Snapshot};

    const FAR: Frame = Frame {
        centre: DVec3::new(4.0e6, -1.0e7, 0.125),
        scale: 2.0,
    };

    /// The two chunks of a file, after its header and theirs were found right.
    fn chunks(bytes: &[u8]) -> (Value, Vec<u8>) {
        let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!(&bytes[..4], b"glTF");
        assert_eq!((number(4), number(8)), (2, bytes.len()));
        let (text_length, binary_at) = (number(12), 20 + number(12));
        assert_eq!((&bytes[16..20], text_length % 4), (&b"JSON"[..], 0));
        assert_eq!(&bytes[binary_at + 4..binary_at + 8], b"BIN\0");
        let binary = bytes[binary_at + 8..].to_vec();
        assert_eq!((number(binary_at), binary.len() % 4), (binary.len(), 0));
        let text = &bytes[20..binary_at];
        (serde_json::from_slice(text).unwrap(), binary)
    }

    fn glb(snapshot: &Snapshot, options: &MeshOptions) -> (Value, Vec<u8>) {
        glb_with(snapshot, options, None)
    }

    fn glb_with(
        snapshot: &Snapshot,
        options: &MeshOptions,
        harmonics: Option<&[Harmonics]>,
    ) -> (Value, Vec<u8>) {
        let mut bytes = Vec::new();
        let lit = LitMesh {
            snapshot,
            frame: &FAR,
            harmonics,
        };
        write_glb(&mut bytes, lit, options).unwrap();
        chunks(&bytes)
    }

    /// The values of an attribute, found as a reader finds them.
    fn attribute((document, binary): &(Value, Vec<u8>), name: &str) -> Vec<Vec3> {
        let at = &document["meshes"][0]["primitives"][0]["attributes"][name];
        let accessor = &document["accessors"][at.as_u64().unwrap() as usize];
        assert_eq!(accessor["componentType"], FLOAT);
        let number = |value: &Value| value.as_u64().unwrap() as usize;
        let view = &document["bufferViews"][number(&accessor["bufferView"])];
        let (stride, end) = (number(&view["byteStride"]), number(&view["byteLength"]));
        (0..number(&accessor["count"]))
            .map(|vertex| {
                let start = number(&accessor["byteOffset"]) + vertex * stride;
                assert!(start + 12 <= end);
                let float = |at: usize| f32::from_le_bytes(binary[at..at + 4].try_into().unwrap());
                Vec3::from_array([0, 4, 8].map(|offset| float(start + offset)))
            })
            .collect()
    }

    fn changed(change: impl FnOnce(&mut Snapshot)) -> Snapshot {
        let mut snapshot = triangle();
        change(&mut snapshot);
        snapshot
    }

    #[test]
    fn views_fill_the_buffer_and_indices_name_vertices() {
        let (document, binary) = glb(&triangle(), &MeshOptions::default());
        assert_eq!(document["buffers"][0]["byteLength"], binary.len());
        let mut next = 0;
        for view in document["bufferViews"].as_array().unwrap() {
            assert_eq!(view["byteOffset"], next);
            next += view["byteLength"].as_u64().unwrap();
        }
        assert_eq!(next, binary.len() as u64);
        let at = document["bufferViews"][1]["byteOffset"].as_u64().unwrap() as usize;
        let indices: Vec<u32> = binary[at..]
            .chunks_exact(4)
            .map(|bytes| u32::from_le_bytes(bytes.try_into().unwrap()))
            .collect();
        assert_eq!(indices, [0, 1, 2]);
        assert_eq!(document["accessors"][5]["count"], 3);
        assert_eq!(document["accessors"][0]["count"], 3);
    }

    #[test]
    fn each_finish_has_triangles_and_a_material_of_its_own() {
        let steel = Finish {
            roughness: 0.5,
            metalness: 1.0,
        };
        let snapshot = changed(|snapshot| {
            let mesh = Arc::make_mut(&mut snapshot.mesh);
            mesh.indices = vec![[0, 1, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
            mesh.finishes = vec![Finish::MATT, steel, Finish::MATT];
            mesh.material_of = vec![0, 1, 2, 1];
        });
        let (document, binary) = glb(&snapshot, &MeshOptions::default());
        let number = |value: &Value| value.as_u64().unwrap() as usize;
        let start = number(&document["bufferViews"][1]["byteOffset"]);
        let indices = |part: usize| -> Vec<u32> {
            let primitive = &document["meshes"][0]["primitives"][part];
            let accessor = &document["accessors"][number(&primitive["indices"])];
            let at = start + number(&accessor["byteOffset"]);
            let bytes = &binary[at..at + 4 * number(&accessor["count"])];
            let numbers = bytes.chunks_exact(4);
            numbers
                .map(|bytes| u32::from_le_bytes(bytes.try_into().unwrap()))
                .collect()
        };
        assert_eq!(indices(0), [0, 1, 2, 2, 0, 1]);
        assert_eq!(indices(1), [1, 2, 0, 2, 1, 0]);
        let material = &document["materials"][1]["pbrMetallicRoughness"];
        assert_eq!(
            (&material["roughnessFactor"], &material["metallicFactor"]),
            (&json!(0.5), &json!(1.0))
        );
        assert_eq!(document["materials"].as_array().unwrap().len(), 2);
    }

    #[test]
    fn positions_keep_their_digits_far_from_the_origin() {
        let third = Vec3::new(1.0 / 3.0, -1.0 / 3.0, 1.0 / 7.0);
        let snapshot = changed(|snapshot| Arc::make_mut(&mut snapshot.mesh).positions[2] = third);
        let file = glb(&snapshot, &MeshOptions::default());
        let places = attribute(&file, "POSITION");
        let node = &file.0["nodes"][0]["translation"];
        let node = DVec3::from_array([0, 1, 2].map(|axis| node[axis].as_f64().unwrap()));
        for (place, position) in places.iter().zip(&snapshot.mesh.positions) {
            // Half a unit at most is stored, rounded to 24 bits; the sum has 53.
            let error = (node + place.as_dvec3() - FAR.to_world(*position)).abs();
            assert!(error.max_element() < 1e-7, "{error}");
        }
        let bound =
            |name: &str, axis: usize| file.0["accessors"][0][name][axis].as_f64().unwrap() as f32;
        for axis in 0..3 {
            let along: Vec<f32> = places.iter().map(|place| place[axis]).collect();
            let least = along.iter().copied().fold(f32::MAX, f32::min);
            let most = along.iter().copied().fold(f32::MIN, f32::max);
            assert_eq!((bound("min", axis), bound("max", axis)), (least, most));
        }
    }

    #[test]
    fn colours_are_exposed_linear_and_cut_off_where_radiance_is_not() {
        let mut options = MeshOptions::default();
        options.color.exposure_ev = -1.0;
        let bright = changed(|snapshot| {
            Arc::make_mut(&mut snapshot.mesh).emission[1] = Vec3::new(100.0, 0.0, 0.0);
        });
        let file = glb(&bright, &options);
        let close = |a: Vec3, b: Vec3| assert!((a - b).abs().max_element() < 1e-5, "{a} {b}");
        let colors = attribute(&file, "COLOR_0");
        close(colors[0], Vec3::splat(0.25));
        close(colors[1], Vec3::new(1.0, 0.25, 0.25));
        close(attribute(&file, "_RADIANCE")[1], Vec3::new(100.5, 0.5, 0.5));
        close(attribute(&file, "_IRRADIANCE")[1], Vec3::splat(PI));
        let material = &file.0["materials"][0];
        assert!(material["extensions"]["KHR_materials_unlit"].is_object());
        assert_eq!(material["doubleSided"], false);
    }

    #[test]
    fn no_value_is_what_the_format_forbids() {
        let broken = changed(|snapshot| {
            Arc::make_mut(&mut snapshot.mesh).normals[0] = Vec3::ZERO;
            Arc::make_mut(&mut snapshot.light).irradiance = vec![
                Vec3::splat(f32::NAN),
                Vec3::splat(f32::INFINITY),
                Vec3::splat(-1.0),
            ];
        });
        let file = glb(&broken, &MeshOptions::default());
        for name in &ATTRIBUTES[..PLAIN_ATTRIBUTES] {
            assert!(attribute(&file, name).iter().all(|value| value.is_finite()));
        }
        let normals = attribute(&file, "NORMAL");
        assert!(normals.iter().all(|normal| normal.is_normalized()));
        let unit = Vec3::ZERO..=Vec3::ONE;
        for color in attribute(&file, "COLOR_0") {
            assert_eq!(color.clamp(*unit.start(), *unit.end()), color);
        }
    }

    #[test]
    fn light_by_direction_follows_where_it_is_asked_for() {
        let value = |vertex: usize, order: usize| Vec3::new(vertex as f32, -(order as f32), 0.5);
        let harmonics = [0, 1, 2].map(|vertex| Harmonics([0, 1, 2, 3].map(|k| value(vertex, k))));
        let options = MeshOptions {
            emission_scale: 2.0,
            ..MeshOptions::default()
        };
        let file = glb_with(&triangle(), &options, Some(&harmonics));
        for order in 0..4 {
            let found = attribute(&file, &format!("_SH{order}"));
            assert_eq!(found, [0, 1, 2].map(|vertex| 2.0 * value(vertex, order)));
        }
        let plain = glb(&triangle(), &options);
        assert_eq!(
            attribute(&file, "_RADIANCE"),
            attribute(&plain, "_RADIANCE")
        );
        let (primitive, mesh) = (&file.0["meshes"][0]["primitives"][0], &plain.0["meshes"][0]);
        let indices = primitive["indices"].as_u64().unwrap() as usize;
        assert_eq!(file.0["accessors"][indices]["count"], 3);
        assert!(file.0["meshes"][0]["extras"]["spherical_harmonics"].is_string());
        assert!(mesh["extras"]["spherical_harmonics"].is_null());
        assert!(mesh["primitives"][0]["attributes"]["_SH0"].is_null());
    }

    #[test]
    fn a_root_turns_z_up_and_the_numbers_stay() {
        let z_up = MeshOptions {
            up: UpAxis::Z,
            ..MeshOptions::default()
        };
        let (turned, plain) = (
            glb(&triangle(), &z_up),
            glb(&triangle(), &MeshOptions::default()),
        );
        assert_eq!(turned.1, plain.1);
        assert_eq!(plain.0["scenes"][0]["nodes"], json!([0]));
        let root = turned.0["scenes"][0]["nodes"][0].as_u64().unwrap() as usize;
        let root = &turned.0["nodes"][root];
        assert_eq!(root["children"], json!([0]));
        assert_eq!(turned.0["nodes"][0]["mesh"], 0);
        let rotation = [0, 1, 2, 3].map(|at| root["rotation"][at].as_f64().unwrap());
        let rotation = DQuat::from_array(rotation);
        assert!((rotation * DVec3::Z - DVec3::Y).length() < 1e-12);
    }

    #[test]
    fn what_does_not_fit_is_refused_in_one_sentence() {
        let sizes = |vertices, triangles| Sizes {
            vertices,
            triangles,
            attributes: PLAIN_ATTRIBUTES,
        };
        assert_eq!(sizes(3, 1).file_length(1000), Ok(28 + 1000 + 180 + 12));
        for (vertices, triangles) in [(1 << 27, 1), (3, 1 << 29), (1 << 32, 1)] {
            let error = sizes(vertices, triangles).file_length(1000).unwrap_err();
            assert!(error.to_string().contains("write a PLY instead"));
        }
        let mut bytes = Vec::new();
        let options = MeshOptions::default();
        let lit = LitMesh {
            snapshot: &Snapshot::default(),
            frame: &FAR,
            harmonics: None,
        };
        let empty = write_glb(&mut bytes, lit, &options).unwrap_err();
        assert_eq!(empty.to_string(), GlbError::Empty.to_string());
        assert!(bytes.is_empty());
    }
}
