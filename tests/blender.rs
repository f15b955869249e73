//! The add-on for Blender, in the `bpy` package, where a Python has it: the one that `VECRAD_BPY_PYTHON` names, or `python3`.

use std::{
    env,
    path::Path,
    process::{Command, Stdio},
};

#[test]
fn the_add_on_brings_light_back_to_blender() {
    let named = env::var_os("VECRAD_BPY_PYTHON");
    let python = named.clone().unwrap_or_else(|| "python3".into());
    let has_bpy = Command::new(&python)
        .args(["-c", "import bpy"])
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success());
    if !has_bpy {
        assert!(named.is_none(), "{} has no package bpy", python.display());
        eprintln!("skipped, no Python with the package bpy");
        return;
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/blender/addon.py");
    let status = Command::new(python)
        .arg(script)
        .arg(env!("CARGO_BIN_EXE_vecrad"))
        .status()
        .unwrap();
    assert!(status.success());
}
