//! Files as their readers see them.

use std::{f32::consts::PI, sync::Arc};

use glam::{DQuat, DVec3};

use serde_json::{Value, json};

use super::{
    super::mesh::tests::{named_scene, scene_in, triangle},
    container::FLOAT,
    *,
};
use crate::{
    geometry::Harmonics,
    scene::{Frame, Scene, Specular, UpAxis},
    solver::{Lamp, LampLight, Snapshot},
};

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

fn glb_of(lit: LitMesh<'_>, options: &MeshOptions) -> (Value, Vec<u8>) {
    let mut bytes = Vec::new();
    write_glb(&mut bytes, lit, options).unwrap();
    chunks(&bytes)
}

fn glb_with(
    snapshot: &Snapshot,
    options: &MeshOptions,
    harmonics: Option<&[Harmonics]>,
) -> (Value, Vec<u8>) {
    let lit = LitMesh {
        snapshot,
        scene: &scene_in(FAR),
        harmonics,
        lamps: &[],
    };
    glb_of(lit, options)
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

/// The indices of a primitive of a mesh.
fn indices((document, binary): &(Value, Vec<u8>), mesh: usize, primitive: usize) -> Vec<u32> {
    let number = |value: &Value| value.as_u64().unwrap() as usize;
    let start = number(&document["bufferViews"][1]["byteOffset"]);
    let primitive = &document["meshes"][mesh]["primitives"][primitive];
    let accessor = &document["accessors"][number(&primitive["indices"])];
    let at = start + number(&accessor["byteOffset"]);
    let bytes = &binary[at..at + 4 * number(&accessor["count"])];
    let numbers = bytes.chunks_exact(4);
    numbers
        .map(|bytes| u32::from_le_bytes(bytes.try_into().unwrap()))
        .collect()
}

/// Four triangles of two objects and two materials, the second of which is of brushed steel.
fn two_objects() -> (Snapshot, Scene) {
    let mut scene = named_scene(&[("a", 0), ("b", 1), ("a", 1), ("a", 0)]);
    scene.materials[1].specular = Some(Specular::Gloss {
        reflectance: Vec3::splat(0.5),
        roughness: 0.25,
    });
    let snapshot = changed(|snapshot| {
        let mesh = Arc::make_mut(&mut snapshot.mesh);
        mesh.indices = vec![[0, 1, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
        mesh.triangle_of = vec![0, 1, 2, 3];
    });
    (snapshot, scene)
}

#[test]
fn objects_are_meshes_and_their_materials_primitives() {
    let (snapshot, scene) = two_objects();
    let lit = LitMesh {
        snapshot: &snapshot,
        scene: &scene,
        harmonics: None,
        lamps: &[],
    };
    let file = glb_of(lit, &MeshOptions::default());
    let names = |document: &Value| -> Vec<String> {
        let meshes = document["meshes"].as_array().unwrap().iter();
        let name = |mesh: &Value| mesh["name"].as_str().unwrap().to_owned();
        meshes.map(name).collect()
    };
    assert_eq!(names(&file.0), ["a", "b"]);
    // Vertices are numbered by object, in the order in which they come.
    assert_eq!(indices(&file, 0, 0), [0, 1, 2, 2, 1, 0]);
    assert_eq!(indices(&file, 0, 1), [2, 0, 1]);
    assert_eq!(indices(&file, 1, 0), [0, 1, 2]);
    assert_eq!(file.0["nodes"][0]["children"], json!([1, 2]));
    assert_eq!(file.0["nodes"][2]["name"], "b");
    assert_eq!(file.0["materials"].as_array().unwrap().len(), 2);
    assert_eq!(file.0["materials"][1]["name"], "material 1");
    let merged = glb_of(
        lit,
        &MeshOptions {
            merge: true,
            ..MeshOptions::default()
        },
    );
    assert_eq!(names(&merged.0), ["lit mesh"]);
    assert_eq!(indices(&merged, 0, 0), [0, 1, 2, 2, 1, 0]);
    assert_eq!(indices(&merged, 0, 1), [1, 2, 0, 2, 0, 1]);
    let finish = &merged.0["materials"][1]["pbrMetallicRoughness"];
    assert!(finish["roughnessFactor"].as_f64().unwrap() < 1.0);
    assert_eq!(
        merged.0["materials"][0]["pbrMetallicRoughness"]["roughnessFactor"],
        1.0
    );
}

#[test]
fn the_light_of_each_lamp_follows_with_its_name() {
    let lamp = |lamp: Lamp, irradiance: f32| LampLight {
        lamp,
        irradiance: vec![Vec3::splat(irradiance); 3],
        emission: vec![Vec3::splat(0.25); 3],
    };
    let lamps = [lamp(Lamp::Material(0), 1.0), lamp(Lamp::Sun, 2.0)];
    let lit = LitMesh {
        snapshot: &triangle(),
        scene: &scene_in(FAR),
        harmonics: None,
        lamps: &lamps,
    };
    let file = glb_of(lit, &MeshOptions::default());
    assert_eq!(attribute(&file, "_IRRADIANCE_0"), [Vec3::ONE; 3]);
    assert_eq!(attribute(&file, "_IRRADIANCE_1"), [Vec3::splat(2.0); 3]);
    let radiance = attribute(&file, "_RADIANCE_1")[0].x;
    assert!((radiance - 0.25 - 1.0 / PI).abs() < 1e-6, "{radiance}");
    let named = &file.0["meshes"][0]["extras"]["lamps"];
    assert_eq!(*named, json!(["material 0", "sun"]));
    // The format has no place for more than 252 bytes of a vertex together.
    let many = vec![lamp(Lamp::Sky, 3.0); 40];
    let file = glb_of(
        LitMesh {
            lamps: &many,
            ..lit
        },
        &MeshOptions::default(),
    );
    assert!(file.0["bufferViews"][0]["byteStride"].as_u64().unwrap() <= 252);
    assert_eq!(attribute(&file, "_IRRADIANCE_39"), [Vec3::splat(3.0); 3]);
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
    for name in ATTRIBUTES {
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
    assert_eq!(turned.0["nodes"][1]["mesh"], 0);
    let rotation = [0, 1, 2, 3].map(|at| root["rotation"][at].as_f64().unwrap());
    let rotation = DQuat::from_array(rotation);
    assert!((rotation * DVec3::Z - DVec3::Y).length() < 1e-12);
}

#[test]
fn what_does_not_fit_is_refused_in_one_sentence() {
    let sizes = |vertices, triangles| Sizes {
        vertices,
        triangles,
        attributes: ATTRIBUTES.len() as u64,
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
        scene: &scene_in(FAR),
        harmonics: None,
        lamps: &[],
    };
    let empty = write_glb(&mut bytes, lit, &options).unwrap_err();
    assert_eq!(empty.to_string(), GlbError::Empty.to_string());
    assert!(bytes.is_empty());
}
