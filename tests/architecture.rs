//! The rooms of the house: each imports only rooms above it, and outside crates stay where they belong.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::{fs, path::Path};

/// From the top of the house to its foundation's users; a room may import those before it.
const ROOMS: [&str; 11] = [
    "scene",
    "geometry",
    "hierarchy",
    "transport",
    "solver",
    "reference",
    "metrics",
    "experiments",
    "export",
    "worker",
    "viewer",
];

/// Words that only some rooms may say.
const CONFINED: [(&str, &[&str]); 7] = [
    ("egui", &["viewer"]),
    ("eframe", &["viewer"]),
    ("rfd", &["viewer"]),
    ("wgpu", &["viewer"]),
    ("obvhs", &["geometry"]),
    ("tobj", &["scene"]),
    ("clap", &["cli"]),
];

/// What the solver must not say: it is a value, without threads, channels, clocks or globals.
const FORBIDDEN_IN_SOLVER: [&str; 9] = [
    "thread",
    "mpsc",
    "Instant",
    "SystemTime",
    "OnceLock",
    "LazyLock",
    "Mutex",
    "RwLock",
    "thread_local",
];

/// Everything wrong with one file of `room`, one sentence each.
fn violations(room: &str, source: &str) -> Vec<String> {
    let code = code_of(source);
    let words: Vec<&str> = code
        .split(|c: char| !c.is_alphanumeric() && c != '_')
        .filter(|word| !word.is_empty())
        .collect();
    let mut found = Vec::new();
    for imported in imported_rooms(&code) {
        if rank(&imported) > rank(room) {
            found.push(format!("{room} imports {imported}, which stands below it"));
        }
    }
    for (word, rooms) in CONFINED {
        if words.contains(&word) && !rooms.contains(&room) {
            found.push(format!("{room} uses {word}, which belongs to {rooms:?}"));
        }
    }
    if room == "solver" {
        for word in FORBIDDEN_IN_SOLVER {
            if words.contains(&word) {
                found.push(format!("solver mentions {word}"));
            }
        }
        if code.contains("static mut") {
            found.push("solver holds a global".to_owned());
        }
    }
    // The window talks to the worker; the solver's settings and snapshots are for it, the solver is not.
    if room == "viewer" && words.contains(&"Solver") {
        found.push("viewer names the solver".to_owned());
    }
    // The truth must not share transport code, else an error in it would hide.
    let shared = ["hierarchy", "transport", "solver"];
    if room == "reference" {
        for imported in imported_rooms(&code) {
            if shared.contains(&imported.as_str()) {
                found.push(format!("reference imports {imported}"));
            }
        }
    }
    found
}

/// Position in the order of the rooms; the command line and the program come last.
fn rank(room: &str) -> usize {
    ROOMS
        .iter()
        .position(|known| *known == room)
        .unwrap_or(ROOMS.len())
}

/// The source without comments and without its tests, which stand last.
fn code_of(source: &str) -> String {
    let end = source.find("#[cfg(test)]\nmod ").unwrap_or(source.len());
    source[..end]
        .lines()
        .map(|line| line.split("//").next().unwrap_or(""))
        .collect::<Vec<_>>()
        .join("\n")
}

/// Rooms named after `crate::` or `vecrad::`, alone or in braces.
fn imported_rooms(code: &str) -> Vec<String> {
    let mut rooms = Vec::new();
    for (at, root) in code
        .match_indices("crate::")
        .chain(code.match_indices("vecrad::"))
    {
        let path = &code[at + root.len()..];
        if let Some(group) = path.strip_prefix('{') {
            rooms.extend(heads_of_group(group));
        } else {
            rooms.push(head(path));
        }
    }
    rooms.retain(|room| ROOMS.contains(&room.as_str()) || room == "cli");
    rooms
}

/// The first name of each path in a group whose opening brace is already read.
fn heads_of_group(group: &str) -> Vec<String> {
    let (mut depth, mut start, mut heads) = (0_usize, 0, Vec::new());
    for (at, character) in group.char_indices() {
        match character {
            '{' => depth += 1,
            '}' if depth == 0 => {
                heads.push(head(&group[start..at]));
                return heads;
            }
            '}' => depth -= 1,
            ',' if depth == 0 => {
                heads.push(head(&group[start..at]));
                start = at + 1;
            }
            _ => {}
        }
    }
    heads
}

fn head(path: &str) -> String {
    path.trim_start()
        .chars()
        .take_while(|c| c.is_alphanumeric() || *c == '_')
        .collect()
}

/// The room of a file below `src`.
fn room_of(path: &Path) -> String {
    let first = path.iter().next().unwrap_or_default().to_string_lossy();
    first.trim_end_matches(".rs").to_owned()
}

fn check(folder: &Path, below: &Path, found: &mut Vec<String>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let inside = below.join(path.file_name().unwrap());
        if path.is_dir() {
            check(&path, &inside, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let source = fs::read_to_string(&path).unwrap();
            let room = room_of(&inside);
            found.extend(
                violations(&room, &source)
                    .into_iter()
                    .map(|violation| format!("{}: {violation}", inside.display())),
            );
        }
    }
}

#[test]
fn every_file_keeps_to_the_order_of_the_rooms() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut found = Vec::new();
    check(&source, Path::new(""), &mut found);
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn an_arrow_back_is_found_in_every_spelling() {
    for source in [
        "use crate::worker::Event;",
        "use crate::{scene::Scene, worker::{Event, Slot}};",
        "use crate::{\n    scene::{Scene, Warning},\n    worker::Event,\n};",
        "fn f() { crate::worker::g(); }",
        "use vecrad::worker::Event;",
    ] {
        assert_eq!(violations("solver", source).len(), 1, "{source}");
        assert!(violations("viewer", source).is_empty(), "{source}");
    }
}

#[test]
fn a_crate_or_a_clock_out_of_its_room_is_found() {
    assert_eq!(violations("solver", "use egui::Ui;").len(), 1);
    assert!(violations("viewer", "use egui::Ui;").is_empty());
    assert_eq!(violations("scene", "use obvhs::cwbvh::CwBvh;").len(), 1);
    assert_eq!(violations("solver", "use std::time::Instant;").len(), 1);
    assert_eq!(violations("solver", "static mut COUNT: u32 = 0;").len(), 1);
    assert_eq!(violations("viewer", "use crate::solver::Solver;").len(), 1);
    assert_eq!(
        violations("reference", "use crate::solver::Cancel;").len(),
        1
    );
}

#[test]
fn comments_and_tests_are_not_code() {
    let source = "// use crate::worker::Event;\n#[cfg(test)]\nmod tests {\n    use crate::worker::Event;\n}\n";
    assert!(violations("scene", source).is_empty());
}
