//! What all GLB files have in common: the container, descriptions of the numbers in its buffer, and the nodes of a scene.

use std::{
    f64::consts::FRAC_1_SQRT_2,
    io::{self, Write},
};

use glam::Vec3;
use serde_json::{Value, json};

use crate::scene::{Frame, ObjectName, UpAxis};

/// Three indices of 32 bits.
pub(crate) const TRIANGLE_BYTES: u64 = 12;

/// Numbers that the glTF specification gives to kinds of values and of buffers.
pub(crate) const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
pub(crate) const ARRAY_BUFFER: u32 = 34962;
pub(crate) const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// Header of the file; length and kind of a chunk.
const HEADER_BYTES: u64 = 12;
const CHUNK_HEADER_BYTES: u64 = 8;

/// The description of a file as the bytes of its chunk.
pub(crate) fn text(document: &Value) -> Vec<u8> {
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    text
}

/// Bytes of a file with a description and a buffer of these lengths; `None` where that is 4 GiB or more, which the format
/// cannot say.
pub(crate) fn file_length(text: u64, buffer: u64) -> Option<u32> {
    u32::try_from(HEADER_BYTES + 2 * CHUNK_HEADER_BYTES + text + buffer).ok()
}

/// Everything before the buffer. `length` is that of the file; that of the buffer is a multiple of 4.
///
/// # Errors
/// Those of `out`.
pub(crate) fn write_head(
    out: &mut dyn Write,
    length: u32,
    text: &[u8],
    buffer: u64,
) -> io::Result<()> {
    out.write_all(b"glTF")?;
    write_numbers(out, &[2, length, text.len() as u32])?;
    out.write_all(b"JSON")?;
    out.write_all(text)?;
    write_numbers(out, &[buffer as u32])?;
    out.write_all(b"BIN\0")
}

/// Write whole numbers.
///
/// # Errors
/// Those of `out`.
pub(crate) fn write_numbers(out: &mut dyn Write, numbers: &[u32]) -> io::Result<()> {
    numbers
        .iter()
        .try_for_each(|number| out.write_all(&number.to_le_bytes()))
}

/// Who wrote the file.
pub(crate) fn asset() -> Value {
    json!({
        "version": "2.0",
        "generator": concat!("vecrad ", env!("CARGO_PKG_VERSION")),
    })
}

/// Floats of the first view of the buffer: an attribute of so many vertices, `kind` is `VEC2` or `VEC3`.
pub(crate) fn floats(offset: u64, count: usize, kind: &str) -> Value {
    json!({
        "bufferView": 0,
        "byteOffset": offset,
        "componentType": FLOAT,
        "count": count,
        "type": kind,
    })
}

/// The corners of so many triangles in the second view of the buffer.
pub(crate) fn indices(offset: u64, triangles: usize) -> Value {
    json!({
        "bufferView": 1,
        "byteOffset": offset,
        "componentType": UNSIGNED_INT,
        "count": 3 * triangles,
        "type": "SCALAR",
    })
}

/// Say the least and the largest coordinates of an accessor of positions.
pub(crate) fn bound(accessor: &mut Value, positions: impl Iterator<Item = Vec3>) {
    let [least, most] = positions.fold([Vec3::MAX, Vec3::MIN], |[least, most], place| {
        [least.min(place), most.max(place)]
    });
    accessor["min"] = json!(least.to_array().map(f64::from));
    accessor["max"] = json!(most.to_array().map(f64::from));
}

/// A position of the scene in world units from the place of its node, so that single precision suffices.
pub(crate) fn from_node(position: Vec3, frame: &Frame) -> Vec3 {
    let distance = (position.as_dvec3() / frame.scale).as_vec3();
    distance.clamp(Vec3::MIN, Vec3::MAX)
}

/// What an object is called, with its group.
pub(crate) fn name_of(name: Option<&ObjectName>) -> String {
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

/// The nodes of meshes with these names: the place of all, then one node for each; last the root that turns +Z up, where the
/// scene needs one. Also the number of the node that holds all others.
pub(crate) fn nodes<'a>(
    names: impl Iterator<Item = Option<&'a ObjectName>>,
    frame: &Frame,
    up: UpAxis,
) -> (Vec<Value>, usize) {
    let meshes = names
        .enumerate()
        .map(|(mesh, name)| json!({ "name": name_of(name), "mesh": mesh }));
    let mut nodes = vec![json!({ "name": "lit scene", "translation": frame.centre.to_array() })];
    nodes.extend(meshes);
    nodes[0]["children"] = (1..nodes.len()).collect();
    match up {
        UpAxis::Y => (nodes, 0),
        UpAxis::Z => {
            // A quarter turn about X takes +Z to +Y.
            let rotation = [-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2];
            nodes.push(json!({ "name": "+Z is up", "rotation": rotation, "children": [0] }));
            let root = nodes.len() - 1;
            (nodes, root)
        }
    }
}
