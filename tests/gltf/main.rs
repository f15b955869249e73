//! glTF files: the same scenes as OBJ, materials, lamps against closed forms, and files that break readers.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod archives;
#[path = "../common/mod.rs"]
mod common;
mod glb;
mod hazards;
mod lamps;
mod materials;
mod mutations;
mod rooms;
#[path = "../spoiled/mod.rs"]
mod spoiled;

use glb::Glb;
use vecrad::scene::{Scene, SceneOptions, read_scene};

/// The scene of a file.
fn read(glb: &Glb) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    read_scene(&glb.write(folder.path()), &SceneOptions::default()).unwrap()
}

/// What is said of a scene, a line each.
fn said(scene: &Scene) -> String {
    let all: Vec<String> = scene.warnings.iter().map(ToString::to_string).collect();
    all.join("\n")
}
