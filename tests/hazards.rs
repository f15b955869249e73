//! Files that break readers: each with the warning, the sentence and the scene that it must give.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod spoiled;

use std::path::{Path, PathBuf};

use spoiled::assert_promises;
use tempfile::TempDir;
use vecrad::scene::{
    ReadError, Scene, SceneOptions, Warning,
    WarningKind::{
        Encoding, FaceSkipped, LineSkipped, MaterialMissing, NoEmitter, SeeThrough, TextureMissing,
        Unsupported, ValueClamped,
    },
    read_scene,
};

const POINTS: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

fn write(files: &[(&str, &[u8])]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, content).unwrap();
    }
    let path = folder.path().join("scene.obj");
    (folder, path)
}

fn try_read(obj: impl AsRef<[u8]>, others: &[(&str, &[u8])]) -> Result<Scene, ReadError> {
    let mut files = vec![("scene.obj", obj.as_ref())];
    files.extend_from_slice(others);
    let (_folder, path) = write(&files);
    let scene = read_scene(&path, &SceneOptions::default())?;
    let bytes = files.iter().map(|(_, content)| content.len()).sum();
    assert_promises(&scene, bytes);
    Ok(scene)
}

fn read(obj: impl AsRef<[u8]>, others: &[(&str, &[u8])]) -> Scene {
    try_read(obj, others).unwrap()
}

/// Warnings but the one about the missing light.
fn warnings(scene: &Scene) -> Vec<&Warning> {
    let all = scene.warnings.iter();
    all.filter(|warning| warning.kind != NoEmitter).collect()
}

#[test]
fn hazards_of_the_obj_file_are_cured_with_a_warning() {
    let face = "f 1 2 3\n";
    for (text, kind, sentence) in [
        (
            format!("{POINTS}v nan 0 0\n{face}f 1 2 5"),
            FaceSkipped,
            "scene.obj:7: skipped a face: a corner is not a finite number",
        ),
        (
            format!("{POINTS}v inf 0 0\n{face}f 1 2 5"),
            FaceSkipped,
            "scene.obj:7: skipped a face: a corner is not a finite number",
        ),
        (
            format!("{POINTS}v 1e39 0 0\n{face}f 1 2 5"),
            LineSkipped,
            "scene.obj:5: vertex that is not a finite number; faces that use it are omitted",
        ),
        (
            format!("{POINTS}v 1.#QNAN 0 0\n{face}f 1 2 5"),
            LineSkipped,
            "scene.obj:5: vertex without three numbers; faces that use it are omitted",
        ),
        (
            format!("{POINTS}{face}f 1 2 5"),
            FaceSkipped,
            "scene.obj:6: skipped a face: vertex index out of range",
        ),
        (
            format!("{POINTS}{face}f 1 2 -5"),
            FaceSkipped,
            "scene.obj:6: skipped a face: vertex index out of range",
        ),
        (
            format!("{POINTS}{face}f 0 1 2"),
            FaceSkipped,
            "scene.obj:6: skipped a face: index 0 (indices count from 1)",
        ),
        (
            format!("{POINTS}{face}f 1 2 x"),
            FaceSkipped,
            "scene.obj:6: skipped a face: a corner is no vertex index",
        ),
        (
            format!("{POINTS}{face}f 1 2"),
            FaceSkipped,
            "scene.obj:6: skipped a face: fewer than three corners",
        ),
        (
            format!("{POINTS}{face}f 1 1 2"),
            FaceSkipped,
            "scene.obj:6: skipped a face: no area",
        ),
        (
            format!("{POINTS}{face}l 1 2\np 1"),
            Unsupported,
            "scene.obj:6: lines and points have no surface and were omitted (2 times)",
        ),
        (
            format!("{POINTS}{face}surf 0 1 0 1 1"),
            Unsupported,
            "scene.obj:6: free-form curves and surfaces (NURBS) were omitted; export them as polygons",
        ),
        (
            format!("{POINTS}vt x\n{face}"),
            LineSkipped,
            "scene.obj:5: texture coordinate that is not a number was ignored",
        ),
        (
            format!("{POINTS}vn 0 0\n{face}"),
            LineSkipped,
            "scene.obj:5: normal that is not a number was ignored",
        ),
        (
            format!("{POINTS}usemtl none\n{face}"),
            MaterialMissing,
            "scene.obj:5: no material file defines 'none'; grey is used instead",
        ),
        (
            format!("mtllib none.mtl\n{POINTS}{face}"),
            MaterialMissing,
            "scene.obj:1: material file 'none.mtl' was not found beside the OBJ file",
        ),
        (
            format!("{POINTS}\0\0\n{face}"),
            Encoding,
            "scene.obj:5: NUL bytes were read as spaces",
        ),
        (
            format!("{POINTS}nonsense\n{face}"),
            LineSkipped,
            "scene.obj:5: skipped a line that is no OBJ statement",
        ),
    ] {
        let scene = read(&text, &[]);
        assert_eq!(scene.triangles.len(), 1, "{text}");
        let found = warnings(&scene);
        assert!(
            found
                .iter()
                .any(|w| w.kind == kind && w.to_string() == sentence),
            "{text}: {found:?}"
        );
    }
}

#[test]
fn encodings_line_ends_and_continuations_read_as_plain_text() {
    let plain = format!("{POINTS}f 1 2 3\n");
    for text in [
        format!("\u{feff}{plain}"),
        plain.replace('\n', "\r\n"),
        plain.replace('\n', "\r"),
        plain.replace("f 1 2 3", "f 1 \\\n2 \\\n3"),
        plain.replace("f 1 2 3", "f -4/ -3// -2"),
        plain.replace("f 1 2 3", "f 1 2 3 # comment"),
    ] {
        let scene = read(&text, &[]);
        assert_eq!(scene.triangles.len(), 1, "{text:?}");
        assert!(
            warnings(&scene).is_empty(),
            "{text:?}: {:?}",
            scene.warnings
        );
    }
    let mut gbk = b"# \xb2\xc4\xd6\xca\no \xb0\xd7\n".to_vec();
    gbk.extend_from_slice(plain.as_bytes());
    assert_eq!(warnings(&read(&gbk, &[]))[0].kind, Encoding);
}

#[test]
fn polygons_keep_their_area() {
    let concave = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 1 0.5 0\nv 0 2 0\nf 1 2 3 4 5\n";
    let scene = read(concave, &[]);
    let area: f32 = scene
        .surfaces
        .iter()
        .map(|surface| surface.area_vector.z)
        .sum();
    // 4 minus the notch of base 2 and height 1.5, in a frame of 50 units a unit.
    assert!((area / 2500.0 - 2.5).abs() < 1e-4);
}

#[test]
fn face_of_800_000_indices_is_cut() {
    let mut text = POINTS.to_owned() + "f";
    for index in 0..800_000 {
        text += [" 1", " 2", " 3", " 4"][index % 4];
    }
    let scene = read(&text, &[]);
    assert!(
        warnings(&scene)
            .iter()
            .any(|w| w.message.contains("was cut as a fan"))
    );
}

#[test]
fn hazards_of_the_mtl_file_keep_the_other_materials() {
    let obj = format!("mtllib a.mtl b c.mtl\n{POINTS}usemtl one\nf 1 2 3\nusemtl two\nf 1 3 4\n");
    let mtl = b"newmtl one\nKd 0.5\nillum 2.0\nd 0.5\nmap_Kd ../../x.png\nmap_Ke gone.png\n";
    let scene = read(
        &obj,
        &[
            ("a.mtl", mtl),
            ("c.mtl", b"newmtl two\nKd 1.5\nKe -1 nan 3\n"),
        ],
    );
    assert_eq!(scene.materials[0].reflectance.to_array(), [0.5; 3]);
    assert_eq!(scene.materials[1].reflectance.to_array(), [0.98; 3]);
    assert_eq!(scene.materials[1].emission.to_array(), [0.0, 0.0, 3.0]);
    let kinds: Vec<_> = scene.warnings.iter().map(|warning| warning.kind).collect();
    for kind in [
        LineSkipped,
        SeeThrough,
        TextureMissing,
        ValueClamped,
        MaterialMissing,
    ] {
        assert!(kinds.contains(&kind), "{kind:?}: {:?}", scene.warnings);
    }
}

#[test]
fn what_is_no_scene_is_one_sentence() {
    let png = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x01";
    for (content, sentence) in [
        (&b""[..], "the file is empty; export the scene again: "),
        (b" \n\n", "the file is empty; export the scene again: "),
        (
            png,
            "this is neither glTF nor OBJ text; export the scene as one of these: ",
        ),
        (
            b"v 0 0 0\n",
            "there are no usable faces (no face is defined in scene.obj); export the surfaces as polygons: ",
        ),
        (
            b"v 0 0 0\nf 1 2 3\n",
            "there are no usable faces (scene.obj:2: skipped a face: vertex index out of range); export the surfaces as polygons: ",
        ),
    ] {
        let error = try_read(content, &[]).unwrap_err().to_string();
        assert!(
            error.starts_with(sentence) && error.ends_with("scene.obj"),
            "{error}"
        );
    }
    let folder = tempfile::tempdir().unwrap();
    let options = SceneOptions::default();
    assert!(matches!(
        read_scene(folder.path(), &options),
        Err(ReadError::Folder { .. })
    ));
    let none = Path::new("/nowhere/none.obj");
    assert!(matches!(
        read_scene(none, &options),
        Err(ReadError::NotFound { .. })
    ));
}
