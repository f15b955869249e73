//! Scenes in ZIP archives.

use std::{fs, io::Write as _};

use flate2::{Compression, Crc, write::DeflateEncoder};
use serde_json::json;
use vecrad::scene::{ReadError, Scene, SceneOptions, read_scene};

use super::{
    glb::{Glb, png},
    said,
    spoiled::{Chance, assert_promises, case_count, folder, spoil},
};

const OBJ: &[u8] = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\nf 1 2 9\n";
const MTL: &[u8] = b"newmtl m\nKd 0.25 0.25 0.25\n";

/// An archive of files, deflated or stored.
fn zip(files: &[(&str, &[u8])], is_deflated: bool) -> Vec<u8> {
    let (mut archive, mut list) = (Vec::new(), Vec::new());
    for (name, content) in files {
        let mut sum = Crc::new();
        sum.update(content);
        let packed = match is_deflated {
            true => {
                let mut encoder = DeflateEncoder::new(Vec::new(), Compression::default());
                encoder.write_all(content).unwrap();
                encoder.finish().unwrap()
            }
            false => content.to_vec(),
        };
        let method = if is_deflated { 8_u16 } else { 0 };
        let mut common = vec![20, 0, 0, 0];
        common.extend(method.to_le_bytes());
        common.extend([0; 4]);
        for number in [sum.sum(), packed.len() as u32, content.len() as u32] {
            common.extend(number.to_le_bytes());
        }
        common.extend((name.len() as u16).to_le_bytes());
        common.extend([0; 2]);
        list.extend(b"PK\x01\x02\x14\0");
        list.extend(&common);
        list.extend([0; 10]);
        list.extend((archive.len() as u32).to_le_bytes());
        list.extend(name.as_bytes());
        archive.extend(b"PK\x03\x04");
        archive.extend(common);
        archive.extend(name.as_bytes());
        archive.extend(packed);
    }
    let start = archive.len() as u32;
    archive.extend(&list);
    archive.extend(b"PK\x05\x06\0\0\0\0");
    for _ in 0..2 {
        archive.extend((files.len() as u16).to_le_bytes());
    }
    for number in [list.len() as u32, start] {
        archive.extend(number.to_le_bytes());
    }
    archive.extend([0; 2]);
    archive
}

fn try_read(archive: &[u8]) -> Result<Scene, ReadError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hall.zip");
    fs::write(&path, archive).unwrap();
    let scene = read_scene(&path, &SceneOptions::default())?;
    assert_eq!((scene.name.as_str(), &scene.files), ("hall", &vec![path]));
    Ok(scene)
}

#[test]
fn a_scene_in_an_archive_opens_with_what_belongs_to_it() {
    for is_deflated in [true, false] {
        let files = [
            ("maps/", &b""[..]),
            ("hall/a.mtl", MTL),
            ("hall/x.obj", OBJ),
            ("__MACOSX/y.obj", b""),
        ];
        let scene = try_read(&zip(&files, is_deflated)).unwrap();
        assert_eq!(scene.surfaces[0].reflectance.x, 0.25);
        assert!(
            said(&scene).contains("x.obj:7: skipped a face: vertex index out of range"),
            "{}",
            said(&scene)
        );
    }
    let mut glb = Glb::new();
    let image = glb.push("images", json!({ "uri": "maps/a.png" }));
    let texture = glb.push("textures", json!({ "source": image }));
    glb.square(
        json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": texture } } }),
        0.0,
    );
    let picture = png(2, &[[90, 90, 90, 255], [0, 0, 0, 255]]);
    let scene = try_read(&zip(
        &[("a.glb", &glb.bytes()), ("maps\\a.png", &picture)],
        true,
    ))
    .unwrap();
    assert_eq!(scene.textures.len(), 1, "{}", said(&scene));
}

#[test]
fn archives_that_are_no_scene_get_one_sentence() {
    let whole = zip(&[("a.mtl", MTL), ("x.obj", OBJ)], true);
    let mut encrypted = whole.clone();
    let list = encrypted
        .windows(4)
        .position(|window| window == b"PK\x01\x02")
        .unwrap();
    encrypted[list + 8] |= 1;
    let mut changed = zip(&[("x.obj", OBJ)], false);
    changed[40] ^= 1;
    for (archive, sentence) in [
        (
            zip(&[("a.mtl", MTL)], true),
            "there is no OBJ or glTF file in the archive; pack one with the files that belong to it: ",
        ),
        (
            zip(&[("x.obj", OBJ), ("y.glb", b"")], true),
            "there are several scenes in the archive: 'x.obj', 'y.glb'; unpack it and open one of them: ",
        ),
        (
            whole[..whole.len() - 30].to_vec(),
            "the archive is damaged or has a form that is not known; ",
        ),
        (
            b"PK\x03\x04".to_vec(),
            "the archive is damaged or has a form that is not known; ",
        ),
        (
            changed,
            "the archive is damaged or has a form that is not known; ",
        ),
        (
            encrypted,
            "the archive is encrypted; unpack it and open the scene in it: ",
        ),
        (
            zip(&[("x.obj", b"")], true),
            "the file is empty; export the scene again: ",
        ),
        (
            zip(&[("x.obj", b"nothing")], true),
            "this is neither glTF nor OBJ text; ",
        ),
        (
            zip(
                &[
                    ("../x.obj", OBJ),
                    ("/y.obj", OBJ),
                    ("C:/z.obj", OBJ),
                    ("a/../../w.obj", OBJ),
                ],
                true,
            ),
            "there is no OBJ or glTF file in the archive; ",
        ),
    ] {
        let error = try_read(&archive).unwrap_err().to_string();
        assert!(
            error.starts_with(sentence) && error.ends_with("hall.zip"),
            "{error}"
        );
    }
}

#[test]
fn spoiled_archives_are_scenes_or_sentences() {
    let (_folder, folder) = folder();
    let path = folder.join("a.zip");
    let (mut scenes, count) = (0, case_count(500));
    for case in 0..count {
        let mut chance = Chance::new(case);
        let mut archive = zip(&[("a.mtl", MTL), ("x.obj", OBJ)], chance.below(2) == 0);
        spoil(&mut archive, &mut chance);
        fs::write(&path, &archive).unwrap();
        let read = std::panic::catch_unwind(|| read_scene(&path, &SceneOptions::default()));
        let Ok(read) = read else {
            panic!("case {case}:\n{}", archive.escape_ascii());
        };
        match read {
            Ok(scene) => {
                assert_promises(&scene, OBJ.len() + archive.len());
                scenes += 1;
            }
            Err(error) => assert!(!error.to_string().contains(char::is_control), "{error}"),
        }
    }
    println!("{count} cases, {scenes} scenes");
}
