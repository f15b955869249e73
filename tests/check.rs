//! `vecrad check` from outside: what it says of right files, of wrong ones, and how it ends.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

fn check(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_vecrad"))
        .arg("check")
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A cube that faces inward, its ceiling a lamp, far from the origin.
const CUBE: &str = "\
mtllib cube.mtl
v 5000 0 0
v 5001 0 0
v 5001 1 0
v 5000 1 0
v 5000 0 1
v 5001 0 1
v 5001 1 1
v 5000 1 1
usemtl wall
f 1 2 3 4
f 8 7 6 5
f 5 6 2 1
f 6 7 3 2
f 8 5 1 4
usemtl lamp
f 7 8 4 3
";

#[test]
fn a_built_in_scene_passes_and_says_how_right_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let flags = [
        "--scene", "cornell", "--preset", "draft", "--report", "out.json", "-q",
    ];
    let output = check(folder.path(), &flags);
    let (said, error) = (text(&output.stdout), text(&output.stderr));
    assert_eq!(output.status.code(), Some(0), "{said}{error}");
    assert!(said.contains("| constant radiance | 3.1416 |"), "{said}");
    assert!(said.contains("| mean light | – | – |") && said.contains("not applicable: open"));
    let last = said.lines().last().unwrap();
    assert!(
        last.starts_with("this file is lit right to ") && last.ends_with(" %"),
        "{last}"
    );
    let json = fs::read(folder.path().join("out.json")).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    let tests = json["tests"].as_array().unwrap();
    assert_eq!(tests.len(), 7);
    assert_eq!(tests[0]["verdict"], "holds");
    assert_eq!(tests[1]["verdict"], "not_applicable");
    assert!(tests[0]["deviations"]["worst_material"]["name"].is_string());
    assert_eq!(json["stopped_early"], false);
    assert_eq!(json["summary"].as_str().unwrap(), last);
}

#[test]
fn a_closed_file_has_the_mean_light_that_is_known() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("cube.obj"), CUBE).unwrap();
    let materials = "newmtl wall\nKd 0.7 0.5 0.2\nnewmtl lamp\nKd 0.1 0.1 0.1\nKe 4 4 4\n";
    fs::write(folder.path().join("cube.mtl"), materials).unwrap();
    let flags = ["cube.obj", "--preset", "draft", "--report", "-", "-q"];
    let output = check(folder.path(), &flags);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    // Standard output is the report alone.
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let mean = &json["tests"][1];
    assert_eq!(mean["verdict"], "holds", "{mean}");
    // A sixth of the surface emits: 4 π / 6 / (1 − 0.5).
    let expected = mean["claim"]["expected"].as_f64().unwrap();
    assert!(
        (expected / (4.0 * std::f64::consts::PI / 3.0) - 1.0).abs() < 1e-5,
        "{expected}"
    );
}

#[test]
fn convex_bodies_and_lone_sheets_are_lit_by_the_sky_around_them() {
    let folder = tempfile::tempdir().unwrap();
    let outward = |line: &str| match line.strip_prefix("f ") {
        Some(corners) => format!(
            "f {}\n",
            corners.split(' ').rev().collect::<Vec<_>>().join(" ")
        ),
        None => format!("{line}\n"),
    };
    let body: String = CUBE.lines().skip(1).map(outward).collect();
    fs::write(folder.path().join("body.obj"), body).unwrap();
    let sheet = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    fs::write(folder.path().join("sheet.obj"), sheet).unwrap();
    for name in ["body.obj", "sheet.obj"] {
        let output = check(folder.path(), &[name, "--preset", "draft", "-q"]);
        let said = text(&output.stdout);
        assert_eq!(
            output.status.code(),
            Some(0),
            "{name}: {said}{}",
            text(&output.stderr)
        );
        assert!(
            said.contains("| constant radiance | 3.1416 | 3.14"),
            "{name}: {said}"
        );
    }
}

#[test]
fn light_outside_its_limit_ends_with_code_1_and_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    // The interpolation of light between vertices is not as right as that.
    let flags = ["--scene", "plates", "--error", "0.05%", "-q"];
    let output = check(folder.path(), &flags);
    assert_eq!(output.status.code(), Some(1));
    let sentence = text(&output.stderr);
    assert!(
        sentence.starts_with("error: this file is not lit right: constant radiance: "),
        "{sentence}"
    );
    assert_eq!(sentence.lines().count(), 1, "{sentence}");
    assert!(text(&output.stdout).contains("| fails |"));
}

#[test]
fn a_limit_ends_with_code_4() {
    let folder = tempfile::tempdir().unwrap();
    let flags = ["--scene", "gallery", "--time-limit", "1.5", "-q"];
    let output = check(folder.path(), &flags);
    let error = text(&output.stderr);
    match output.status.code() {
        // Prepared, but not done.
        Some(4) => assert!(text(&output.stdout).ends_with("stopped before the last test\n")),
        // Not even prepared.
        code => assert!(
            code == Some(1) && error.contains("stopped before the first test"),
            "{error}"
        ),
    }
}

#[test]
fn what_cannot_be_read_or_written_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(
        folder.path().join("points.obj"),
        "v 0 0 0\nv 1 0 0\nv 0 1 0\n",
    )
    .unwrap();
    fs::write(folder.path().join("cube.obj"), CUBE).unwrap();
    for (flags, code) in [
        (&["points.obj"][..], 3),
        (&["missing.obj"], 3),
        (&["--scene", "cornel"], 3),
        (&["cube.obj", "--report", "cube.obj"], 2),
        (&["cube.obj", "--report", "nowhere/out.json"], 2),
        (&[], 2),
    ] {
        let output = check(folder.path(), flags);
        assert_eq!(
            output.status.code(),
            Some(code),
            "{flags:?}: {}",
            text(&output.stderr)
        );
        assert!(text(&output.stderr).starts_with("error: "), "{flags:?}");
        assert!(output.stdout.is_empty(), "{flags:?}");
    }
}
