//! glTF files that break readers: each with the sentence that it must give, and what it may not read.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use serde_json::{Value, json};
use tempfile::TempDir;
use vecrad::scene::{ReadError, Scene, SceneOptions, WarningKind, read_scene};

use super::{
    glb::{Glb, HALVES, SQUARE, container, png},
    read, said,
};

/// A square that is all right.
fn square() -> Glb {
    let mut glb = Glb::new();
    glb.square(json!({ "name": "m" }), 0.0);
    glb
}

/// A changed square beside one that is all right.
fn beside(change: impl FnOnce(&mut Glb)) -> Glb {
    let mut glb = square();
    change(&mut glb);
    let mesh = glb.mesh(&SQUARE, &HALVES, &json!({}));
    glb.root(json!({ "mesh": mesh, "name": "good", "translation": [0, 0, 5] }));
    glb
}

fn try_read(name: &str, bytes: &[u8]) -> Result<Scene, ReadError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    read_scene(&path, &SceneOptions::default())
}

/// A folder in a folder with secrets, and the path of the scene in it.
fn scene_folder(files: &[(&str, &[u8])]) -> (TempDir, PathBuf) {
    let outer = tempfile::tempdir().unwrap();
    let folder = outer.path().join("scene");
    fs::create_dir(&folder).unwrap();
    for (name, content) in files {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, content).unwrap();
    }
    (outer, folder.join("scene.gltf"))
}

/// The square with its buffer in a file of its own, named by a URI.
fn with_buffer_at(uri: &str) -> (Vec<u8>, Vec<u8>) {
    let glb = square();
    let mut json = glb.json.clone();
    json["buffers"] = json!([{ "byteLength": glb.binary.len(), "uri": uri }]);
    (json.to_string().into_bytes(), glb.binary)
}

#[test]
fn files_that_are_no_scene_get_one_sentence() {
    let whole = square().bytes();
    let mut first = whole.clone();
    first[4] = 1;
    let mut required = square();
    required.json["extensionsRequired"] = json!([
        "KHR_draco_mesh_compression",
        "KHR_texture_basisu",
        "KHR_materials_unlit"
    ]);
    let mut nothing = square();
    nothing.json["scenes"] = json!([{ "nodes": [] }]);
    let mut lines = square();
    lines.json["meshes"][0]["primitives"][0]["mode"] = json!(1);
    let mut scene = square();
    scene.json["scene"] = json!(3);
    let mut cut = square();
    cut.binary.truncate(20);
    for (bytes, sentence) in [
        (
            whole[..whole.len() - 1].to_vec(),
            "the GLB file ends early; copy or export it again: ",
        ),
        (
            whole[..9].to_vec(),
            "the GLB file ends early; copy or export it again: ",
        ),
        (
            first,
            "this is glTF 1, and only 2.0 is read; export the scene as glTF 2.0: ",
        ),
        (
            b"{}".to_vec(),
            "this JSON is not glTF, as it names no version; open a glTF or OBJ file: ",
        ),
        (
            b"{ \"asset\": ".to_vec(),
            "the JSON of the glTF file cannot be read (EOF while parsing a value at line 1 column 11); export the scene again: ",
        ),
        (
            br#"{"asset":{"version":"1.0"}}"#.to_vec(),
            "this is glTF 1.0, and only 2.0 is read; export the scene as glTF 2.0: ",
        ),
        (
            container(b"{\"asset\":{\"version\":\"2.0\"},\"nodes\":[7]}", b""),
            "the JSON of the glTF file cannot be read (",
        ),
        (
            required.bytes(),
            "the glTF file needs 'KHR_draco_mesh_compression', 'KHR_texture_basisu', which vecrad does not have; export it without compression and such extensions: ",
        ),
        (
            nothing.bytes(),
            "the glTF file shows no surface; export a scene with meshes: ",
        ),
        (
            lines.bytes(),
            "the glTF file shows no surface; export a scene with meshes: ",
        ),
        (
            scene.bytes(),
            "scene 3 is to be shown, but the file has 1; export it again: ",
        ),
        (
            cut.bytes(),
            "no surface of the glTF file can be used, as a buffer inside the file ends early; export it again, with all files that belong to it: ",
        ),
        (
            b"\x89PNG\r\n\x1a\n\0\0".to_vec(),
            "this is neither glTF nor OBJ text; export the scene as one of these: ",
        ),
    ] {
        let error = try_read("any.name", &bytes).unwrap_err().to_string();
        assert!(error.starts_with(sentence), "{error}\n{sentence}");
        assert!(
            !error.contains(char::is_control) && error.ends_with("any.name"),
            "{error}"
        );
    }
}

#[test]
fn the_program_tells_bad_files_from_wrong_usage() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cut.glb");
    fs::write(&path, &square().bytes()[..99]).unwrap();
    for command in ["solve", "check", "report"] {
        let mut program = Command::new(env!("CARGO_BIN_EXE_vecrad"));
        program.arg(command).arg(&path);
        if command == "report" {
            program.arg("--output").arg(folder.path());
        }
        let output = program.output().unwrap();
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{command}: {error}");
        assert_eq!(error.lines().count(), 1, "{command}: {error}");
        assert!(
            error.starts_with("error: the GLB file ends early"),
            "{command}: {error}"
        );
    }
    // Whatever its name: told by its content.
    let path = folder.path().join("scene.obj");
    fs::write(&path, square().bytes()).unwrap();
    let mut program = Command::new(env!("CARGO_BIN_EXE_vecrad"));
    let output = program
        .args(["solve", "--preset", "draft", "--report", "-"])
        .arg(&path)
        .output()
        .unwrap();
    assert_eq!(
        output.status.code(),
        Some(0),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

#[test]
fn parts_that_cannot_be_used_are_left_out_and_named() {
    type Change = fn(&mut Glb);
    let cases: [(Change, WarningKind, &str); 20] = [
        (
            |glb| glb.json["nodes"][0]["mesh"] = json!(9),
            WarningKind::FaceSkipped,
            "a mesh that does not exist is named",
        ),
        (
            |glb| glb.json["nodes"][0]["children"] = json!([0]),
            WarningKind::Unsupported,
            "a node was left out where it is named again",
        ),
        (
            |glb| glb.json["nodes"][0]["children"] = json!([4_000_000_000_u32]),
            WarningKind::Unsupported,
            "a node that does not exist is named",
        ),
        (
            |glb| part(glb)["attributes"]["POSITION"] = json!(99),
            WarningKind::FaceSkipped,
            "an accessor that does not exist is named",
        ),
        (
            |glb| part(glb)["attributes"] = json!({}),
            WarningKind::FaceSkipped,
            "it has no positions",
        ),
        (
            |glb| part(glb)["indices"] = json!(1_000_000),
            WarningKind::FaceSkipped,
            "an accessor that does not exist is named",
        ),
        (
            |glb| part(glb)["indices"] = json!(0),
            WarningKind::FaceSkipped,
            "an attribute has a number of components that it cannot have",
        ),
        (
            |glb| part(glb)["material"] = json!(7),
            WarningKind::FaceSkipped,
            "a material that does not exist is named",
        ),
        (
            |glb| glb.json["accessors"][1]["count"] = json!(1_000_000),
            WarningKind::FaceSkipped,
            "numbers lie beyond the end of their buffer view",
        ),
        (
            |glb| glb.json["accessors"][1]["count"] = json!(u64::MAX),
            WarningKind::FaceSkipped,
            "numbers lie beyond the end of their buffer view",
        ),
        (
            |glb| glb.json["accessors"][1]["byteOffset"] = json!(u64::MAX),
            WarningKind::FaceSkipped,
            "numbers lie beyond the end of their buffer view",
        ),
        (
            |glb| glb.json["accessors"][1]["componentType"] = json!(5124),
            WarningKind::FaceSkipped,
            "numbers have a type that glTF does not know",
        ),
        (
            |glb| glb.json["accessors"][1]["type"] = json!("MAT4"),
            WarningKind::FaceSkipped,
            "an attribute has a number of components that it cannot have",
        ),
        (
            |glb| glb.json["accessors"][1]["bufferView"] = json!(77),
            WarningKind::FaceSkipped,
            "a buffer view that does not exist is named",
        ),
        (
            |glb| glb.json["bufferViews"][1]["byteStride"] = json!(4),
            WarningKind::FaceSkipped,
            "numbers overlap: a byteStride is too small",
        ),
        (
            |glb| glb.json["bufferViews"][1]["byteLength"] = json!(u64::MAX),
            WarningKind::FaceSkipped,
            "a buffer inside the file ends early",
        ),
        (
            |glb| glb.json["bufferViews"][1]["buffer"] = json!(3),
            WarningKind::FaceSkipped,
            "a buffer that does not exist is named",
        ),
        (
            |glb| {
                let view = &glb.json["bufferViews"][2];
                let start = view["byteOffset"].as_u64().unwrap() as usize;
                glb.binary[start..start + 4].copy_from_slice(&u32::MAX.to_le_bytes());
            },
            WarningKind::FaceSkipped,
            "skipped a face: vertex index out of range",
        ),
        (
            |glb| {
                let view = &glb.json["bufferViews"][1];
                let start = view["byteOffset"].as_u64().unwrap() as usize;
                glb.binary[start..start + 4].copy_from_slice(&f32::NAN.to_le_bytes());
            },
            WarningKind::FaceSkipped,
            "skipped a face: a corner is not a finite number",
        ),
        (
            |glb| glb.json["nodes"][0]["scale"] = json!([0, 0, 0]),
            WarningKind::FaceSkipped,
            "skipped a face: no area",
        ),
    ];
    for (change, kind, sentence) in cases {
        let scene = read(&beside(change));
        assert!(scene.triangles.len() >= 2, "{sentence}");
        let found = scene
            .warnings
            .iter()
            .find(|warning| warning.message.contains(sentence));
        let found = found.unwrap_or_else(|| panic!("{sentence}:\n{}", said(&scene)));
        assert_eq!(found.kind, kind, "{found}");
    }
}

fn part(glb: &mut Glb) -> &mut Value {
    &mut glb.json["meshes"][0]["primitives"][0]
}

#[test]
fn small_files_do_not_fill_the_memory() {
    // Vertices and indices by the billion, without a byte of data.
    let mut glb = square();
    let claim = |kind: &str, component: u32| json!({ "componentType": component, "count": 4_000_000_000_u64, "type": kind });
    let positions = glb.push("accessors", claim("VEC3", 5126));
    let indices = glb.push("accessors", claim("SCALAR", 5125));
    for (part, sentence) in [
        (
            json!({ "attributes": { "POSITION": positions } }),
            "all of its positions are 0",
        ),
        (
            json!({ "attributes": { "POSITION": 0 }, "indices": indices }),
            "an attribute has a number of components that it cannot have",
        ),
        (
            json!({ "attributes": { "POSITION": 1 }, "indices": indices }),
            "there are too many triangles, vertices or parts (1333333335, at most 16777216); split the scene: ",
        ),
    ] {
        let mut glb = Glb {
            json: glb.json.clone(),
            binary: glb.binary.clone(),
        };
        let mesh = glb.push("meshes", json!({ "primitives": [part] }));
        glb.root(json!({ "mesh": mesh }));
        let told = match try_read("a.glb", &glb.bytes()) {
            Ok(scene) => said(&scene),
            Err(error) => error.to_string(),
        };
        assert!(told.contains(sentence), "{told}");
    }
    // A mesh of a million faces a thousand times, through nodes.
    let mut glb = Glb::new();
    let positions = glb.floats(&SQUARE);
    let strip = glb.push(
        "accessors",
        json!({ "componentType": 5125, "count": 1_000_000, "type": "SCALAR" }),
    );
    let part = json!({ "attributes": { "POSITION": positions }, "indices": strip });
    let mesh = glb.push("meshes", json!({ "primitives": [part] }));
    for _ in 0..1000 {
        glb.root(json!({ "mesh": mesh }));
    }
    let error = try_read("a.glb", &glb.bytes()).unwrap_err().to_string();
    assert!(
        error.starts_with("there are too many triangles, vertices or parts"),
        "{error}"
    );
    // Few of many vertices, again and again.
    let mut glb = square();
    let (place, value) = (glb.view(&[0; 4]), glb.view(&[0; 12]));
    let many = glb.push(
        "accessors",
        json!({
            "componentType": 5126, "count": 4_000_000_000_u64, "type": "VEC3",
            "sparse": {
                "count": 1,
                "indices": { "bufferView": place, "componentType": 5125 },
                "values": { "bufferView": value },
            },
        }),
    );
    let mesh = glb.mesh(&SQUARE, &HALVES, &json!({}));
    glb.json["meshes"][mesh]["primitives"][0]["attributes"]["POSITION"] = json!(many);
    for _ in 0..1000 {
        glb.root(json!({ "mesh": mesh }));
    }
    assert!(said(&read(&glb)).contains("skipped a face: no area (2000 times)"));
    let braces = format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{}{{}}]}}"#,
        "{},".repeat(5_000_000)
    );
    let error = try_read("a.gltf", braces.as_bytes())
        .unwrap_err()
        .to_string();
    assert!(error.contains("objects; split the scene"), "{error}");
    let deep = format!(
        r#"{{"asset":{{"version":"2.0"}},"extras":{}"#,
        "[".repeat(1_000_000)
    );
    assert!(try_read("a.gltf", deep.as_bytes()).is_err());
}

#[test]
fn buffers_and_pictures_lie_inside_or_beside() {
    let picture = png(2, &[[90, 90, 90, 255], [0, 0, 0, 255]]);
    let base64 = |bytes: &[u8]| {
        let letters = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        let groups = bytes.chunks(3).flat_map(|group| {
            let value = group
                .iter()
                .fold(0_u32, |value, &byte| value << 8 | u32::from(byte))
                << (8 * (3 - group.len()));
            (0..=group.len())
                .map(move |at| char::from(letters[(value >> (18 - 6 * at)) as usize & 63]))
        });
        groups.collect::<String>()
    };
    let (_, binary) = with_buffer_at("");
    let inside = format!("data:application/octet-stream;base64,{}", base64(&binary));
    for (uri, file) in [
        ("a%20buffer.bin", "a buffer.bin"),
        ("maps/b.bin", "maps/b.bin"),
        ("maps\\b.bin", "maps/b.bin"),
        ("./B.BIN", "b.bin"),
        (&inside, "unused.bin"),
    ] {
        let (text, binary) = with_buffer_at(uri);
        let (_outer, path) = scene_folder(&[("scene.gltf", &text), (file, &binary)]);
        let scene = read_scene(&path, &SceneOptions::default()).unwrap();
        assert_eq!(scene.triangles.len(), 2, "{uri}");
        let is_listed = scene.files.iter().any(|known| known.ends_with(file));
        assert_eq!(is_listed, uri != inside, "{uri}: {:?}", scene.files);
    }
    let pictured = format!("data:image/png;base64,{}", base64(&picture));
    for uri in ["wood.png", pictured.as_str()] {
        let mut glb = square();
        let image = glb.push("images", json!({ "uri": uri }));
        let texture = glb.push("textures", json!({ "source": image }));
        glb.push("images", json!({ "uri": "unshown.png" }));
        glb.json["materials"][0]["pbrMetallicRoughness"] =
            json!({ "baseColorTexture": { "index": texture } });
        let (_outer, path) = scene_folder(&[
            ("scene.gltf", &glb.bytes()),
            ("wood.png", &picture),
            ("unshown.png", b""),
        ]);
        let scene = read_scene(&path, &SceneOptions::default()).unwrap();
        assert_eq!(scene.textures.len(), 1, "{uri}: {}", said(&scene));
        assert!(scene.files.iter().any(|file| file.ends_with("unshown.png")));
    }
}

#[test]
fn nothing_outside_the_folder_is_read() {
    let (_, secret) = with_buffer_at("");
    let check = |uri: &str, folder: &Path| {
        let (text, _) = with_buffer_at(uri);
        fs::write(folder.join("scene/scene.gltf"), text).unwrap();
        read_scene(&folder.join("scene/scene.gltf"), &SceneOptions::default())
    };
    let (outer, _) = scene_folder(&[]);
    let folder = outer.path();
    fs::write(folder.join("secret.bin"), &secret).unwrap();
    let absolute = folder.join("secret.bin").to_string_lossy().into_owned();
    #[cfg(unix)]
    std::os::unix::fs::symlink("../secret.bin", folder.join("scene/link.bin")).unwrap();
    let file_uri = format!("file://{absolute}");
    for uri in [
        "../secret.bin",
        "..%2Fsecret.bin",
        "%2e%2e/secret.bin",
        "..\\secret.bin",
        "x/../../secret.bin",
        "link.bin",
        absolute.as_str(),
        file_uri.as_str(),
    ] {
        let error = check(uri, folder).unwrap_err().to_string();
        let is_refused = error.contains("lies outside the folder of the scene and was not read")
            || error.contains("was not found beside the scene");
        assert!(is_refused, "{uri}: {error}");
    }
    let error = check("https://example.com/a.bin", folder)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("is on the network, from which nothing is read; save it beside the scene"),
        "{error}"
    );
    let error = check("none.bin", folder).unwrap_err().to_string();
    let expected = "no surface of the glTF file can be used, as buffer 'none.bin' was not found beside the scene; export it again, with all files that belong to it: ";
    assert!(error.starts_with(expected), "{error}");
}
