//! What packages install beside the program: files that exist, and pages and completions made from the flags.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::{
    collections::BTreeSet,
    fs,
    path::Path,
    process::{Command, Output},
};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// Where `.ci/deb` puts what it generates.
const GENERATED: &str = "target/";

fn vecrad(arguments: &[&str]) -> Output {
    let program = env!("CARGO_BIN_EXE_vecrad");
    Command::new(program).args(arguments).output().unwrap()
}

#[test]
fn the_package_names_files_that_exist() {
    let manifest = fs::read_to_string(Path::new(ROOT).join("Cargo.toml")).unwrap();
    let manifest: toml::Table = manifest.parse().unwrap();
    let assets = manifest["package"]["metadata"]["deb"]["assets"].as_array();
    let sources = assets
        .unwrap()
        .iter()
        .map(|asset| asset[0].as_str().unwrap());
    let kept: Vec<&str> = sources
        .filter(|path| !path.starts_with(GENERATED))
        .collect();
    assert!(kept.len() >= 4, "{kept:?}");
    for path in kept {
        assert!(Path::new(ROOT).join(path).is_file(), "{path}");
    }
}

#[test]
fn each_command_has_a_manual_page_with_its_flags() {
    let folder = tempfile::tempdir().unwrap();
    let written = vecrad(&[
        "man",
        "--write",
        folder.path().join("man").to_str().unwrap(),
    ]);
    assert!(written.status.success(), "{written:?}");
    let names: BTreeSet<String> = fs::read_dir(folder.path().join("man"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    for name in [
        "vecrad.1",
        "vecrad-solve.1",
        "vecrad-report.1",
        "vecrad-check.1",
    ] {
        assert!(names.contains(name), "{name} in {names:?}");
    }
    let page = fs::read_to_string(folder.path().join("man/vecrad-solve.1")).unwrap();
    // Roff escapes hyphens.
    let page = page.replace("\\-", "-");
    for flag in ["--export", "--reference", "--sky", "--epsilon", "--merge"] {
        assert!(page.contains(flag), "{flag}");
    }
    let printed = vecrad(&["man"]);
    let printed = String::from_utf8(printed.stdout).unwrap();
    assert!(printed.contains(".TH vecrad 1"), "{printed}");
}

#[test]
fn shells_complete_commands_and_flags() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let printed = vecrad(&["completions", shell]);
        assert!(printed.status.success(), "{shell}");
        let script = String::from_utf8(printed.stdout).unwrap();
        for word in ["solve", "export-lamps", "time-limit"] {
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
    assert_eq!(vecrad(&["completions", "tcsh"]).status.code(), Some(2));
}

#[test]
fn a_page_that_cannot_be_written_is_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "").unwrap();
    let refused = vecrad(&["man", "--write", file.to_str().unwrap()]);
    assert_eq!(refused.status.code(), Some(1));
    let said = String::from_utf8(refused.stderr).unwrap();
    assert!(
        said.starts_with("error: cannot write to ") && said.lines().count() == 1,
        "{said}"
    );
}
