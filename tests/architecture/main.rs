//! The rooms of the house: each imports only rooms above it, no two files of a room import each other, directly or
//! through others, and outside crates stay where they belong.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod circles;

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use circles::{ModulePath, SiblingImports, circle, sibling_imports, upward};

/// From the top of the house to its foundation's users; a room may import those before it.
const ROOMS: [&str; 14] = [
    "scene",
    "geometry",
    "sampling",
    "hierarchy",
    "transport",
    "solver",
    "reference",
    "metrics",
    "experiments",
    "export",
    "picture",
    "lightmap",
    "worker",
    "viewer",
];

/// Modules whose children stand in an order: each imports only children that are named before it.
const ORDERED_CHILDREN: [(&str, &[&str]); 4] = [
    (
        "transport",
        &[
            "kernel",
            "sights",
            "link",
            "patch_sums",
            "arrival",
            "visibility",
            "tint",
            "oracle",
            "bounds",
            "validate",
            "refiner",
            "clear",
            "decide",
            "refine",
        ],
    ),
    (
        "solver",
        &[
            "cancel",
            "sums",
            "schedule",
            "omission",
            "settings",
            "limits",
            "textures",
            "output",
            "plan",
            "places",
            "coverage",
            "direct",
            "iteration",
            "vertices",
            "budget",
            "refine",
            "relighting",
            "estimate",
            "shown",
            "state",
            "next_step",
            "queries",
            "accuracy",
            "relight",
            "by_lamp",
        ],
    ),
    (
        "solver::direct",
        &[
            "emitter",
            "panel",
            "multipole",
            "light_tree",
            "tally",
            "control",
            "samples",
            "scale",
            "sky",
            "openings",
            "sky_guide",
            "sun",
            "lights",
            "shooting",
            "explore",
            "smooth",
            "field",
            "noise",
            "vertex_samples",
            "border",
            "interpolation",
            "before_walls",
            "fields",
            "first_light",
            "point_lights",
            "surfaces",
            "adapt",
            "light_parts",
        ],
    ),
    (
        "solver::iteration",
        &[
            "anderson",
            "light",
            "gather",
            "surroundings",
            "balance",
            "iterate",
        ],
    ),
];

/// Words that only some rooms may say.
const CONFINED: [(&str, &[&str]); 8] = [
    ("egui", &["viewer"]),
    ("eframe", &["viewer"]),
    ("rfd", &["viewer"]),
    ("wgpu", &["viewer"]),
    ("obvhs", &["geometry"]),
    ("tobj", &["scene"]),
    ("hw_skymodel", &["scene"]),
    ("clap", &["cli"]),
];

/// Words that the solver must not use: it is a value, without threads, channels, clocks or globals.
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
    let begins_tests = |(at, mark): &(usize, &str)| {
        let item = source[at + mark.len()..].lines().next().unwrap_or("");
        item.starts_with("mod ") || item.starts_with("pub") && item.contains(" mod ")
    };
    let tests = source.match_indices("#[cfg(test)]\n").find(begins_tests);
    let end = tests.map_or(source.len(), |(at, _)| at);
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
    module_of(path).swap_remove(0)
}

/// The module that a file below `src` is.
fn module_of(path: &Path) -> ModulePath {
    let mut module: ModulePath = path
        .with_extension("")
        .iter()
        .map(|name| name.to_string_lossy().into_owned())
        .collect();
    if module.last().is_some_and(|name| name == "mod") {
        module.pop();
    }
    module
}

/// All files of the program but tests that have a file of their own, by their path below `src`.
fn sources() -> BTreeMap<PathBuf, String> {
    fn collect(root: &Path, folder: &Path, found: &mut BTreeMap<PathBuf, String>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                collect(root, &path, found);
            } else if path.extension().is_some_and(|extension| extension == "rs")
                && !path.ends_with("tests.rs")
            {
                let source = fs::read_to_string(&path).unwrap();
                found.insert(path.strip_prefix(root).unwrap().to_owned(), source);
            }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut found = BTreeMap::new();
    collect(&root, &root, &mut found);
    found
}

/// Circles among the children of modules, and imports against their order, one sentence each.
fn tangles(imports: &SiblingImports, ordered: &[(&str, &[&str])]) -> Vec<String> {
    let mut found = Vec::new();
    for (module, imports) in imports {
        let name = module.join("::");
        if let Some(circle) = circle(imports) {
            found.push(format!("{name}: {} is a circle", circle.join(" → ")));
        }
        for (_, order) in ordered.iter().filter(|(ordered, _)| *ordered == name) {
            for (from, to) in upward(imports, order) {
                found.push(format!(
                    "{name}: {from} imports {to}, which stands below it"
                ));
            }
        }
    }
    found
}

/// The findings of [`tangles`] among made-up files.
fn tangles_of(files: &[(&str, &str)], ordered: &[(&str, &[&str])]) -> Vec<String> {
    let files = files
        .iter()
        .map(|(path, source)| (module_of(Path::new(path)), (*source).to_owned()));
    tangles(&sibling_imports(&files.collect()), ordered)
}

#[test]
fn every_file_keeps_to_the_order_of_the_rooms() {
    let found: Vec<String> = sources()
        .iter()
        .flat_map(|(path, source)| {
            violations(&room_of(path), source)
                .into_iter()
                .map(|violation| format!("{}: {violation}", path.display()))
        })
        .collect();
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn no_files_of_a_room_import_each_other_in_a_circle() {
    let modules = sources()
        .into_iter()
        .map(|(path, source)| (module_of(&path), source));
    let modules: BTreeMap<ModulePath, String> = modules.collect();
    let imports = sibling_imports(&modules);
    assert!(imports.len() > 10, "the parser finds imports");
    let found = tangles(&imports, &ORDERED_CHILDREN);
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn an_order_names_all_children_of_its_module() {
    for (name, order) in ORDERED_CHILDREN {
        let parent: ModulePath = name.split("::").map(str::to_owned).collect();
        let paths = sources().into_keys().map(|path| module_of(&path));
        let mut children: Vec<String> = paths
            .filter(|module| module.len() > parent.len() && module.starts_with(&parent))
            .map(|module| module[parent.len()].clone())
            .collect();
        children.dedup();
        let mut order = order.to_vec();
        order.sort_unstable();
        assert_eq!(children, order, "{name}");
    }
}

#[test]
fn a_circle_is_found_in_every_spelling() {
    for source in [
        "use super::b::B;",
        "use super::{b::{self, B}, c::C};",
        "pub(super) use crate::room::b::B;",
        "use crate::{\n    room::{B, C},\n    scene::Scene,\n};",
        "fn f() { super::b::g(); }",
        "fn f() -> u32 {\n    let x = 1;\n    crate::room::b::X + x\n}",
    ] {
        let files = [
            ("room/mod.rs", "mod a;\nmod b;\nmod c;\npub use b::B;"),
            ("room/a.rs", source),
            ("room/b.rs", "use super::c::C;"),
            ("room/c.rs", "use super::a::A;\npub struct C;"),
            ("scene/mod.rs", ""),
        ];
        let found = tangles_of(&files, &[]);
        assert_eq!(found, ["room: a → b → c → a is a circle"], "{source}");
        assert!(tangles_of(&files[..3], &[]).is_empty(), "{source}");
    }
}

#[test]
fn circles_are_found_among_folders_and_within_them() {
    let files = [
        ("room/mod.rs", ""),
        ("room/inner/mod.rs", ""),
        ("room/inner/a.rs", "use super::b::B;"),
        ("room/inner/b.rs", "use super::a::A;"),
        ("room/inner/c.rs", "use super::super::other::O;"),
        ("room/other.rs", "use super::inner::c::C;"),
    ];
    assert_eq!(tangles_of(&files, &[]).len(), 2);
}

#[test]
fn parents_and_children_may_import_each_other() {
    let files = [
        ("room/mod.rs", "mod a;\nuse a::A;\npub struct R(A);"),
        ("room/a.rs", "use super::R;"),
    ];
    assert!(tangles_of(&files, &[]).is_empty());
}

#[test]
fn an_import_against_the_order_of_a_room_is_found() {
    let files = [
        ("room/mod.rs", ""),
        ("room/a.rs", "use super::b::B;"),
        ("room/b.rs", ""),
    ];
    let ordered = |order: &'static [&'static str]| [("room", order)];
    assert!(tangles_of(&files, &ordered(&["b", "a"])).is_empty());
    assert!(tangles_of(&files, &ordered(&["b"])).is_empty());
    assert_eq!(tangles_of(&files, &ordered(&["a", "b"])).len(), 1);
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
    for module in ["mod tests", "pub(super) mod tests"] {
        let source = format!(
            "// use crate::worker::Event;\n#[cfg(test)]\n{module} {{\n    use crate::worker::Event;\n}}\n"
        );
        assert!(violations("scene", &source).is_empty());
    }
}
