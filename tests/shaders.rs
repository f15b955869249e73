//! Every shader is valid: read and checked as the adapter would, without one.

#![cfg(feature = "viewer")]

use std::{fs, path::Path};

use naga::valid::{Capabilities, ValidationFlags, Validator};

#[test]
fn every_shader_is_valid() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/viewer/render");
    let shared = fs::read_to_string(folder.join("view.wgsl")).expect("the shared part is there");
    let mut failures = Vec::new();
    let mut checked = 0;
    for entry in fs::read_dir(&folder).expect("the folder is there") {
        let path = entry.expect("readable").path();
        let is_pass = path.extension().is_some_and(|ending| ending == "wgsl")
            && path.file_stem().is_some_and(|stem| stem != "view");
        if !is_pass {
            continue;
        }
        let own = fs::read_to_string(&path).expect("readable");
        let source = format!("{shared}{own}");
        checked += 1;
        match naga::front::wgsl::parse_str(&source) {
            Err(error) => failures.push(format!(
                "{}:\n{}",
                path.display(),
                error.emit_to_string(&source)
            )),
            Ok(module) => {
                // The least that any adapter has.
                let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
                if let Err(error) = validator.validate(&module) {
                    failures.push(format!("{}: {error:?}", path.display()));
                }
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
    assert_eq!(checked, 4, "sky, mesh, lines and tone map");
}
