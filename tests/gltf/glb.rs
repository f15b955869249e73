//! Small glTF files, put together in a test.

use std::path::Path;

use serde_json::{Value, json};

/// A file on its way: its JSON and its buffer.
pub(crate) struct Glb {
    pub(crate) json: Value,
    pub(crate) binary: Vec<u8>,
}

/// Corners of the unit square in the plane z = 0, counter-clockwise.
pub(crate) const SQUARE: [[f32; 3]; 4] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 1.0, 0.0],
];

/// The two triangles of a square.
pub(crate) const HALVES: [u32; 6] = [0, 1, 2, 0, 2, 3];

impl Glb {
    /// An empty scene.
    pub(crate) fn new() -> Self {
        let json = json!({
            "asset": { "version": "2.0" },
            "scene": 0,
            "scenes": [{ "nodes": [] }],
        });
        Self {
            json,
            binary: Vec::new(),
        }
    }

    /// Add something to a list of the root object; returns its index.
    pub(crate) fn push(&mut self, list: &str, value: Value) -> usize {
        if self.json.get(list).is_none() {
            self.json[list] = json!([]);
        }
        let list = self.json[list].as_array_mut().expect("a list");
        list.push(value);
        list.len() - 1
    }

    /// Add a view of bytes.
    pub(crate) fn view(&mut self, bytes: &[u8]) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let offset = self.binary.len();
        self.binary.extend(bytes);
        let view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() });
        self.push("bufferViews", view)
    }

    /// Add an accessor of floats.
    pub(crate) fn floats<const N: usize>(&mut self, values: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = values
            .as_flattened()
            .iter()
            .flat_map(|x| x.to_le_bytes())
            .collect();
        let view = self.view(&bytes);
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1];
        let accessor = json!({ "bufferView": view, "componentType": 5126, "count": values.len(), "type": kind });
        self.push("accessors", accessor)
    }

    /// Add an accessor of indices.
    pub(crate) fn indices(&mut self, values: &[u32]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
        let view = self.view(&bytes);
        let accessor = json!({ "bufferView": view, "componentType": 5125, "count": values.len(), "type": "SCALAR" });
        self.push("accessors", accessor)
    }

    /// Add a mesh of one part.
    pub(crate) fn mesh(&mut self, positions: &[[f32; 3]], indices: &[u32], more: &Value) -> usize {
        let (positions, indices) = (self.floats(positions), self.indices(indices));
        let mut part = json!({ "attributes": { "POSITION": positions }, "indices": indices });
        for (key, value) in more.as_object().into_iter().flatten() {
            match (key.as_str(), value.as_object()) {
                ("attributes", Some(more)) => {
                    for (name, accessor) in more {
                        part["attributes"][name] = accessor.clone();
                    }
                }
                _ => part[key] = value.clone(),
            }
        }
        self.push("meshes", json!({ "primitives": [part] }))
    }

    /// Add a node at the top of the scene.
    pub(crate) fn root(&mut self, node: Value) -> usize {
        let node = self.push("nodes", node);
        let roots = self.json["scenes"][0]["nodes"].as_array_mut();
        roots.expect("a list").push(json!(node));
        node
    }

    /// Add the unit square with a material, moved up by a height.
    pub(crate) fn square(&mut self, material: Value, height: f32) {
        let material = self.push("materials", material);
        let texcoords = self.floats(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        let more = json!({ "material": material, "attributes": { "TEXCOORD_0": texcoords } });
        let mesh = self.mesh(&SQUARE, &HALVES, &more);
        self.root(json!({ "mesh": mesh, "translation": [0, 0, height] }));
    }

    /// Add a picture of RGBA bytes; returns the index of its texture.
    pub(crate) fn picture(&mut self, width: u32, pixels: &[[u8; 4]]) -> usize {
        let png = png(width, pixels);
        let view = self.view(&png);
        let image = self.push(
            "images",
            json!({ "bufferView": view, "mimeType": "image/png" }),
        );
        self.push("textures", json!({ "source": image }))
    }

    /// Add a picture of two colours, one left and one right, large enough for means.
    pub(crate) fn halves(&mut self, [left, right]: [[u8; 4]; 2]) -> usize {
        let row = [[left; 32], [right; 32]].concat();
        self.picture(64, &row.repeat(64))
    }

    /// Add a light of a type at a node.
    pub(crate) fn light(&mut self, light: Value, mut node: Value) {
        let lights = &mut self.json["extensions"]["KHR_lights_punctual"]["lights"];
        if lights.is_null() {
            *lights = json!([]);
        }
        let lights = lights.as_array_mut().expect("a list");
        lights.push(light);
        node["extensions"] = json!({ "KHR_lights_punctual": { "light": lights.len() - 1 } });
        self.root(node);
    }

    /// The file as GLB.
    pub(crate) fn bytes(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"] = json!([{ "byteLength": self.binary.len() }]);
        container(json.to_string().as_bytes(), &self.binary)
    }

    /// Write `scene.glb`.
    pub(crate) fn write(&self, folder: &Path) -> std::path::PathBuf {
        let path = folder.join("scene.glb");
        std::fs::write(&path, self.bytes()).expect("a file can be written");
        path
    }
}

/// A PNG of RGBA bytes.
pub(crate) fn png(width: u32, pixels: &[[u8; 4]]) -> Vec<u8> {
    let height = pixels.len() as u32 / width;
    let picture = image::RgbaImage::from_raw(width, height, pixels.as_flattened().to_vec());
    let mut png = std::io::Cursor::new(Vec::new());
    let picture = picture.expect("as many pixels as the size says");
    picture
        .write_to(&mut png, image::ImageFormat::Png)
        .expect("memory");
    png.into_inner()
}

/// JSON and a buffer as GLB.
pub(crate) fn container(text: &[u8], binary: &[u8]) -> Vec<u8> {
    let padded = |bytes: &[u8], with: u8| {
        let mut bytes = bytes.to_vec();
        bytes.resize(bytes.len().next_multiple_of(4), with);
        bytes
    };
    let (text, binary) = (padded(text, b' '), padded(binary, 0));
    let length = 12 + 8 + text.len() + 8 + binary.len();
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((length as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &binary)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    bytes
}
