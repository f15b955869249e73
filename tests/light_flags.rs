//! Flags of sky, sun and lamps, from outside the program: what the report says, sentences, exit codes.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

use serde_json::Value;
use tempfile::TempDir;

const SQUARE: &str = "mtllib a.mtl\nusemtl floor\nv 0 0 0\nv 0 0 1\nv 1 0 1\nv 1 0 0\nf 1 2 3 4\n";

fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.obj"), SQUARE).unwrap();
    fs::write(
        folder.path().join("a.mtl"),
        "newmtl floor\nKd 0.5 0.5 0.5\n",
    )
    .unwrap();
    let sky = image::ImageBuffer::from_pixel(8, 4, image::Rgb([1.0f32, 2.0, 3.0]));
    sky.save(folder.path().join("sky.hdr")).unwrap();
    folder
}

fn solve(folder: &Path, more: &[&str]) -> Output {
    let start = ["solve", "a.obj", "--preset", "draft", "-q", "--report", "-"];
    Command::new(env!("CARGO_BIN_EXE_vecrad"))
        .args([&start, more].concat())
        .current_dir(folder)
        .output()
        .unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// What the report says of the light, and what standard error says.
fn lights(folder: &Path, more: &[&str]) -> (Value, String) {
    let output = solve(folder, more);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{more:?}: {said}");
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    (report["lights"].clone(), said)
}

#[test]
fn the_report_says_what_gives_light() {
    let folder = folder();
    let lights = |more: &[&str]| lights(folder.path(), more);
    let (found, said) = lights(&[]);
    assert_eq!(found["sources"], serde_json::json!(["default sky"]));
    assert!(
        said.contains("uniform sky of radiance 1 lights the scene"),
        "{said}"
    );
    let (found, said) = lights(&["--sky", "none"]);
    assert_eq!(found["sources"], serde_json::json!([]));
    assert!(said.contains("the result is black"), "{said}");
    let (found, said) = lights(&["--sky", "3,2,1", "--sun", "90,30", "--sun-irradiance", "5"]);
    assert_eq!(found["sources"], serde_json::json!(["sky", "sun"]));
    assert_eq!(found["sky"]["radiance"], serde_json::json!([3.0, 2.0, 1.0]));
    let elevation = found["sun"]["elevation"].as_f64().unwrap();
    assert!(
        (elevation - 30.0).abs() < 1e-3 && said.is_empty(),
        "{found} {said}"
    );
    let (found, _) = lights(&["--sky", "sky.hdr", "--sky-scale", "2"]);
    assert_eq!(found["sky"]["name"], "sky.hdr");
    let (found, said) = lights(&["--emit", "floor=2"]);
    assert_eq!(found["sources"], serde_json::json!(["surfaces"]));
    assert!(
        found["emitting_triangles"] == 2 && said.is_empty(),
        "{said}"
    );
    let (_, said) = lights(&["--sun", "0,-20"]);
    assert!(said.contains("20.0° below the horizon"), "{said}");
}

#[test]
fn light_that_makes_no_sense_gets_one_sentence() {
    let folder = folder();
    fs::write(folder.path().join("broken.exr"), "no picture").unwrap();
    // Pictures are known by their content.
    fs::copy(folder.path().join("sky.hdr"), folder.path().join("sky.ply")).unwrap();
    for (more, code, sentence) in [
        (&["--emit", "flor=1"][..], 3, "did you mean 'floor'?"),
        (
            &["--sky", "gone.hdr"],
            3,
            "no such picture of the sky: gone.hdr",
        ),
        (
            &["--sky", "broken.exr"],
            3,
            "cannot read the picture of the sky",
        ),
        (&["--sky", "a.mtl"], 3, "cannot read the picture of the sky"),
        (&["--sky", "-1"], 2, "must be at least 0"),
        (
            &["--sky", "sky.ply", "--export", "sky.ply"],
            2,
            "--export would replace",
        ),
    ] {
        let output = solve(folder.path(), more);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{more:?}: {said}");
        assert!(said.contains(sentence), "{more:?}: {said}");
    }
    assert!(folder.path().join("sky.ply").exists());
}
