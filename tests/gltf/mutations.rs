//! Generated glTF files, spoiled at random: whatever comes, there is a scene that keeps its promises or one sentence.
//!
//! Some seconds in the suite. For a long run: `VECRAD_FUZZ_CASES=100000 cargo test --release --test gltf mutations`.

use std::{fs, path::Path};

use serde_json::{Value, json};
use vecrad::scene::{SceneOptions, read_scene};

use super::{
    glb::{Glb, HALVES, SQUARE, container},
    spoiled::{Chance, assert_promises, assert_same, case_count, folder, spoil},
};

/// A file that is valid, with some of everything.
fn scene(chance: &mut Chance) -> Glb {
    let mut glb = Glb::new();
    let number = |chance: &mut Chance| chance.below(2001) as f64 / 100.0 - 10.0;
    let textures: Vec<usize> = (0..chance.below(3))
        .map(|_| {
            glb.picture(
                2,
                &[[chance.number() as u8, 7, 200, chance.number() as u8]; 2],
            )
        })
        .collect();
    for _ in 0..1 + chance.below(4) {
        let material = material(chance, &textures);
        let material = glb.push("materials", material);
        let corners: Vec<[f32; 3]> = (0..4 + chance.below(5))
            .map(|_| [(); 3].map(|()| number(chance) as f32))
            .collect();
        let indices: Vec<u32> = (0..3 + chance.below(12))
            .map(|_| chance.below(corners.len()) as u32)
            .collect();
        let flat = |chance: &mut Chance| [chance.below(100) as f32 / 50.0, 0.5];
        let texcoords: Vec<[f32; 2]> = corners.iter().map(|_| flat(chance)).collect();
        let mut attributes = json!({ "TEXCOORD_0": glb.floats(&texcoords) });
        if chance.below(3) == 0 {
            attributes["COLOR_0"] = json!(glb.floats(&vec![[0.5, 0.2, 0.1, 1.0]; corners.len()]));
        }
        if chance.below(3) == 0 {
            attributes["NORMAL"] = json!(glb.floats(&vec![[0.0, 0.0, 1.0]; corners.len()]));
        }
        let mode = chance.pick(&[4, 4, 5, 6, 1]);
        let more = json!({ "attributes": attributes, "material": material, "mode": mode });
        let mesh = glb.mesh(&corners, &indices, &more);
        let node = json!({
            "name": chance.pick(&["a", "b", ""]),
            "mesh": mesh,
            "translation": [number(chance), number(chance), 0],
            "rotation": [0, 0.6, 0, 0.8],
            "scale": [1, chance.pick(&[1, -1, 3]), 1],
        });
        let child = glb.push("nodes", node);
        glb.root(json!({ "children": [child], "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, number(chance),0,0,1] }));
    }
    let square = glb.mesh(&SQUARE, &HALVES, &json!({}));
    glb.root(json!({ "mesh": square }));
    for _ in 0..chance.below(3) {
        let light = json!({ "type": chance.pick(&["point", "spot", "directional"]), "intensity": number(chance).abs() });
        glb.light(
            light,
            json!({ "translation": [number(chance), number(chance), number(chance)] }),
        );
    }
    glb
}

fn material(chance: &mut Chance, textures: &[usize]) -> Value {
    let factor = chance.below(100) as f64 / 100.0;
    let mut material = json!({
        "name": chance.pick(&["m", "n", "lamp"]),
        "alphaMode": chance.pick(&["OPAQUE", "MASK", "BLEND"]),
        "doubleSided": chance.below(2) == 0,
        "emissiveFactor": [factor, 0, 1],
        "pbrMetallicRoughness": { "baseColorFactor": [factor, 0.5, 1, factor], "roughnessFactor": factor },
        "extensions": {},
    });
    if !textures.is_empty() {
        let info = json!({ "index": chance.pick(textures), "extensions": { "KHR_texture_transform": { "rotation": factor, "scale": [2, 3] } } });
        material["pbrMetallicRoughness"]
            [chance.pick(&["baseColorTexture", "metallicRoughnessTexture"])] = info.clone();
        material["emissiveTexture"] = info;
    }
    match chance.below(4) {
        0 => {
            material["extensions"]["KHR_materials_transmission"] =
                json!({ "transmissionFactor": factor });
        }
        1 => material["extensions"]["KHR_materials_unlit"] = json!({}),
        2 => {
            material["extensions"]["KHR_materials_emissive_strength"] =
                json!({ "emissiveStrength": 1e6 * factor });
        }
        _ => {}
    }
    material
}

/// Numbers that readers stumble over.
const NUMBERS: [&str; 16] = [
    "-1",
    "0",
    "1",
    "2",
    "3",
    "5",
    "1e39",
    "1e-320",
    "0.5",
    "4294967295",
    "4294967296",
    "18446744073709551615",
    "5123",
    "5126",
    "1e308",
    "null",
];

/// The JSON with one of its numbers replaced.
fn with_other_number(text: &str, chance: &mut Chance) -> String {
    let is_digit = |c: char| c.is_ascii_digit() || matches!(c, '-' | '.' | 'e' | '+');
    let starts: Vec<usize> = text
        .match_indices([':', ',', '['])
        .map(|(at, _)| at + 1)
        .filter(|&at| text[at..].starts_with(|c: char| c.is_ascii_digit() || c == '-'))
        .collect();
    let start = chance.pick(&starts);
    let end = text[start..]
        .find(|c| !is_digit(c))
        .map_or(text.len(), |length| start + length);
    format!(
        "{}{}{}",
        &text[..start],
        chance.pick(&NUMBERS),
        &text[end..]
    )
}

fn check(path: &Path, bytes: &[u8]) -> bool {
    fs::write(path, bytes).unwrap();
    let options = SceneOptions::default();
    match (read_scene(path, &options), read_scene(path, &options)) {
        (Ok(one), Ok(other)) => {
            // A lamp of a few bytes has 80 triangles and more.
            assert_promises(&one, 200 * bytes.len());
            assert_same(&one, &other);
            true
        }
        (Err(one), Err(other)) => {
            assert_eq!(one.to_string(), other.to_string());
            assert!(!one.to_string().contains(char::is_control), "{one}");
            false
        }
        (one, other) => panic!("read differently: {:?}, {:?}", one.err(), other.err()),
    }
}

#[test]
fn spoiled_files_are_scenes_or_sentences() {
    let (_folder, folder) = folder();
    let (mut scenes, count) = (0, case_count(2000));
    for case in 0..count {
        let mut chance = Chance::new(case);
        let glb = scene(&mut chance);
        let mut json = glb.json.clone();
        json["buffers"] = json!([{ "byteLength": glb.binary.len() }]);
        let (mut text, mut binary) = (json.to_string(), glb.binary.clone());
        let bytes = match chance.below(6) {
            // Any byte of the file.
            0 => {
                let mut bytes = container(text.as_bytes(), &binary);
                spoil(&mut bytes, &mut chance);
                bytes
            }
            // The buffer only.
            1 => {
                spoil(&mut binary, &mut chance);
                container(text.as_bytes(), &binary)
            }
            // The text only.
            2 => {
                let mut text = text.into_bytes();
                spoil(&mut text, &mut chance);
                container(&text, &binary)
            }
            // Numbers, of which each is likelier to be read than a broken word.
            _ => {
                for _ in 0..=chance.below(3) {
                    text = with_other_number(&text, &mut chance);
                }
                container(text.as_bytes(), &binary)
            }
        };
        let path = folder.join(chance.pick(&["scene.glb", "scene.gltf", "scene.obj"]));
        let outcome = std::panic::catch_unwind(|| check(&path, &bytes));
        let Ok(is_scene) = outcome else {
            panic!("case {case}:\n{}", bytes.escape_ascii());
        };
        scenes += u64::from(is_scene);
    }
    // Were nearly all refused at once, nothing would be tried.
    assert!(3 * scenes > count, "{scenes} of {count} were scenes");
    println!("{count} cases, {scenes} scenes");
}
