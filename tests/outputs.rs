//! Outputs that would destroy each other or the scene, or cannot be made, are refused before the work.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

/// A floor with a picture on it under a lamp, and the picture of a material that no face shows.
fn write_scene(folder: &Path) {
    let obj = "mtllib s.mtl\n\
               v -1 0 -1\nv -1 0 1\nv 1 0 1\nv 1 0 -1\n\
               v -1 2 -1\nv 1 2 -1\nv 1 2 1\nv -1 2 1\n\
               vt 0 0\nvt 0 1\nvt 1 1\nvt 1 0\n\
               usemtl floor\nf 1/1 2/2 3/3 4/4\nusemtl lamp\nf 5 6 7 8\n";
    let mtl = "newmtl floor\nKd 0.8 0.8 0.8\nmap_Kd pictures/s.png\n\
               newmtl lamp\nKd 0.5 0.5 0.5\nKe 1 1 1\nmap_Kd unseen.png\n";
    fs::write(folder.join("s.obj"), obj).unwrap();
    fs::write(folder.join("s.mtl"), mtl).unwrap();
    fs::create_dir(folder.join("pictures")).unwrap();
    let picture =
        image::RgbImage::from_fn(4, 4, |x, y| image::Rgb([60 * x as u8, 60 * y as u8, 9]));
    for name in ["pictures/s.png", "unseen.png"] {
        picture.save(folder.join(name)).unwrap();
    }
}

fn vecrad(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_vecrad"))
        .args(arguments)
        .current_dir(folder)
        .env_remove("XDG_RUNTIME_DIR")
        .output()
        .unwrap()
}

fn assert_refused(folder: &Path, arguments: &[&str], code: i32, sentence: &str) {
    let output = vecrad(folder, arguments);
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {error}");
    let said = error.lines().last().unwrap_or_default();
    assert!(said.starts_with("error: "), "{arguments:?}: {error}");
    assert!(said.contains(sentence), "{arguments:?}: {error}");
}

#[test]
fn outputs_that_share_a_file_are_refused_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    write_scene(root);
    fs::create_dir(root.join("sub")).unwrap();
    let solve = ["solve", "s.obj"];
    let mut pairs = vec![
        ["--export", "x.ply", "--report", "x.ply"],
        ["--export", "x.ply", "--report", "./x.ply"],
        ["--export", "sub/../x.ply", "--report", "x.ply"],
    ];
    #[cfg(feature = "viewer")]
    pairs.push(["--screenshot", "x.png", "--report", "x.png"]);
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("x.ply", root.join("link.json")).unwrap();
        std::os::unix::fs::symlink("sub", root.join("other")).unwrap();
        pairs.push(["--export", "x.ply", "--report", "link.json"]);
        pairs.push(["--export", "sub/x.ply", "--report", "other/x.ply"]);
    }
    for pair in pairs {
        let arguments = [&solve[..], &pair].concat();
        assert_refused(root, &arguments, 2, "name the same file");
    }
    for name in ["x.ply", "x.png", "sub/x.ply"] {
        assert!(!root.join(name).exists(), "{name}");
    }
}

#[test]
fn light_by_direction_needs_a_mesh_to_go_with() {
    let folder = tempfile::tempdir().unwrap();
    write_scene(folder.path());
    let arguments = ["solve", "s.obj", "--export-sh", "--report", "r.json"];
    assert_refused(folder.path(), &arguments, 2, "add --export FILE");
    assert!(!folder.path().join("r.json").exists());
}

#[test]
fn files_of_the_scene_are_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    write_scene(root);
    fs::create_dir(root.join("out")).unwrap();
    // A plot is named after the scene, and one is where the scene's picture lies.
    let mut cases = vec![
        vec!["solve", "s.obj", "--report", "s.obj"],
        vec!["solve", "s.obj", "--report", "./s.mtl"],
        vec!["solve", "s.obj", "--report", "pictures/s.png"],
        vec!["solve", "s.obj", "--report", "unseen.png"],
        vec!["report", "s.obj", "--output", "pictures"],
    ];
    #[cfg(feature = "viewer")]
    cases.push(vec!["solve", "s.obj", "--screenshot", "pictures/s.png"]);
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("../s.obj", root.join("out/r.json")).unwrap();
        cases.push(vec!["solve", "s.obj", "--report", "out/r.json"]);
    }
    let names = ["s.obj", "s.mtl", "pictures/s.png", "unseen.png"];
    let before = names.map(|name| fs::read(root.join(name)).unwrap());
    for arguments in cases {
        assert_refused(root, &arguments, 2, "the scene is read from");
        let after = names.map(|name| fs::read(root.join(name)).unwrap());
        assert_eq!(before, after, "{arguments:?}");
    }
    assert!(!root.join("pictures/report.md").exists());
}

#[cfg(feature = "viewer")]
#[test]
fn a_picture_that_is_too_large_is_refused_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    write_scene(folder.path());
    for (name, size) in [
        ("a.png", "32768x32768"),
        ("a.png", "32768x1"),
        ("a.exr", "1x32768"),
    ] {
        let arguments = [
            "solve",
            "s.obj",
            "--report",
            "r.json",
            "--screenshot",
            name,
            "--size",
            size,
            "--quality",
            "vertex",
        ];
        // Without an adapter no picture can be had, which is known as early.
        assert_refused(folder.path(), &arguments, 5, "graphics adapter");
        assert!(!folder.path().join("r.json").exists(), "nothing was solved");
    }
}

#[cfg(feature = "viewer")]
#[test]
fn traced_pictures_are_refused_where_they_cannot_be_had() {
    let folder = tempfile::tempdir().unwrap();
    write_scene(folder.path());
    let cases: [(&[&str], &str); 2] = [
        (&["--size", "32768x32768"], "67108864 pixels"),
        (
            &["--quality", "traced", "--view", "irradiance"],
            "radiance alone",
        ),
    ];
    for (more, sentence) in cases {
        let start = ["solve", "s.obj", "--screenshot", "a.png"];
        let arguments: Vec<&str> = start.iter().chain(more).copied().collect();
        assert_refused(folder.path(), &arguments, 2, sentence);
    }
}

/// Neither an adapter nor a display is needed.
#[cfg(feature = "viewer")]
#[test]
fn a_traced_picture_needs_no_graphics_adapter() {
    let folder = tempfile::tempdir().unwrap();
    write_scene(folder.path());
    let output = Command::new(env!("CARGO_BIN_EXE_vecrad"))
        .args([
            "solve", "s.obj", "--preset", "draft", "--quiet", "--size", "32x32",
        ])
        .args(["--quality", "traced=4", "--screenshot", "a.exr"])
        .current_dir(folder.path())
        .env("VK_DRIVER_FILES", "none.json")
        .env("VK_ICD_FILENAMES", "none.json")
        .env("LIBGL_DRIVERS_PATH", "none")
        .env_remove("DISPLAY")
        .output()
        .unwrap();
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{error}");
    assert!(folder.path().join("a.exr").exists());
}

/// Messages of the loader of graphics drivers about displays that a picture does not need.
#[cfg(feature = "viewer")]
#[test]
fn a_picture_is_drawn_without_a_word_of_others() {
    let folder = tempfile::tempdir().unwrap();
    write_scene(folder.path());
    let arguments = [
        "solve",
        "s.obj",
        "--preset",
        "draft",
        "--screenshot",
        "a.png",
        "--size",
        "32x32",
        "--quiet",
    ];
    let output = vecrad(folder.path(), &arguments);
    let error = String::from_utf8_lossy(&output.stderr);
    if output.status.code() == Some(5) {
        assert_eq!(error.lines().count(), 1, "{error}");
        println!("no graphics adapter: {error}");
        return;
    }
    assert_eq!(output.status.code(), Some(0), "{error}");
    assert_eq!(error, "");
    assert!(folder.path().join("a.png").exists());
}
