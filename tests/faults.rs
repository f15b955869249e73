//! Faults while the program runs: full disks, folders that vanish, files that change, readers that leave, signals.
//! Whatever comes, outputs are whole or absent, nothing is left beside them, and there is a sentence.
//!
//! `VECRAD_KILLS=500 cargo test --release --test faults` sends more signals than the suite does.

#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::{
    fs,
    io::{BufRead as _, BufReader, Read as _},
    os::unix::fs::symlink,
    path::Path,
    process::{Child, ChildStderr, Command, Output, Stdio},
    thread::sleep,
    time::Duration,
};

fn vecrad(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vecrad"));
    // Files saved elsewhere are to be found here.
    let elsewhere = folder.join("elsewhere");
    fs::create_dir_all(&elsewhere).unwrap();
    command
        .args(arguments)
        .current_dir(folder)
        .env("TMPDIR", elsewhere)
        .stdin(Stdio::null());
    command
}

/// A program that runs, the rest of what it says, and its first line of progress.
fn begun(folder: &Path, arguments: &[&str]) -> (Child, BufReader<ChildStderr>, String) {
    let mut child = vecrad(folder, arguments)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap());
    let mut said = String::new();
    lines.read_line(&mut said).unwrap();
    (child, lines, said)
}

const SOLVE: [&str; 5] = ["solve", "--scene", "plates", "--preset", "draft"];

/// A scene that keeps the solver busy for a second or more.
const LONG: [&str; 3] = ["solve", "--scene", "cornell"];

fn sentence(output: &Output) -> String {
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!text.contains("panicked"), "{text}");
    text
}

/// Files in a folder, by name.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name != "elsewhere")
        .collect();
    names.sort();
    names
}

/// Vertices of a PLY whose body has the length that its header promises.
fn whole_ply(path: &Path) -> usize {
    let bytes = fs::read(path).unwrap();
    let end = b"end_header\n";
    let body = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
    let header = String::from_utf8_lossy(&bytes[..body]);
    let count = |element: &str| -> usize {
        let key = format!("element {element} ");
        let line = header.lines().find_map(|line| line.strip_prefix(&key));
        line.unwrap().parse().unwrap()
    };
    assert_eq!(
        bytes.len() - body,
        51 * count("vertex") + 13 * count("face")
    );
    count("vertex")
}

fn whole_json(path: &Path) {
    let bytes = fs::read(path).unwrap();
    let report: serde_json::Value = serde_json::from_slice(&bytes).unwrap();
    assert!(report["stop_reason"].is_string());
}

/// The only file that was saved elsewhere, if any was.
fn saved_elsewhere(folder: &Path) -> Option<std::path::PathBuf> {
    let elsewhere = folder.join("elsewhere");
    let found = names(&elsewhere);
    assert!(found.len() <= 1, "{found:?}");
    found.first().map(|name| elsewhere.join(name))
}

#[test]
fn a_full_disk_costs_one_output_and_not_the_others() {
    let folder = tempfile::tempdir().unwrap();
    symlink("/dev/full", folder.path().join("full.json")).unwrap();
    let outputs = ["--report", "full.json", "--export", "lit.ply"];
    let output = vecrad(folder.path(), &[&SOLVE[..], &outputs].concat())
        .output()
        .unwrap();
    let said = sentence(&output);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("cannot write full.json: No space"), "{said}");
    assert!(said.contains("instead"), "{said}");
    assert!(whole_ply(&folder.path().join("lit.ply")) > 0);
    whole_json(&saved_elsewhere(folder.path()).unwrap());
    assert_eq!(names(folder.path()), ["full.json", "lit.ply"]);
    assert!(fs::metadata("/dev/full").is_ok_and(|device| !device.is_file()));
}

#[test]
fn a_full_disk_that_is_standard_output_is_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let full = fs::OpenOptions::new()
        .write(true)
        .open("/dev/full")
        .unwrap();
    let output = vecrad(folder.path(), &[&SOLVE[..], &["--report", "-"]].concat())
        .stdout(full)
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", sentence(&output));
    assert!(sentence(&output).contains("cannot write to standard output"));
}

#[test]
fn a_folder_that_takes_no_files_is_refused_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    // Not even the superuser makes files here.
    let output = vecrad(
        folder.path(),
        &[&LONG[..], &["--report", "/proc/out.json"]].concat(),
    )
    .output()
    .unwrap();
    let said = sentence(&output);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(
        said.starts_with("error: cannot write to the folder /proc"),
        "{said}"
    );
}

#[test]
fn a_folder_that_vanishes_does_not_take_the_light_with_it() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    fs::create_dir(&out).unwrap();
    let arguments = [&LONG[..], &["--export", "out/lit.ply"]].concat();
    // Outputs were checked, nothing is written yet.
    let (mut child, mut lines, mut said) = begun(folder.path(), &arguments);
    fs::remove_dir_all(&out).unwrap();
    lines.read_to_string(&mut said).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(1), "{said}");
    assert!(said.contains("cannot write out/lit.ply"), "{said}");
    assert!(
        said.contains("instead") && !said.contains("panicked"),
        "{said}"
    );
    assert!(whole_ply(&saved_elsewhere(folder.path()).unwrap()) > 0);
    assert!(names(folder.path()).is_empty());
}

#[test]
fn a_scene_that_changes_while_it_is_read_is_read_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.obj");
    let square = |x: usize| format!("v {x} 0 0\nv {x} 0 1\nv {x} 1 1\nv {x} 1 0\nf -4 -3 -2 -1\n");
    let text: String = (0..30_000).map(square).collect();
    let solve = [
        "solve",
        "scene.obj",
        "--time-limit",
        "0",
        "--report",
        "out.json",
    ];
    for round in 0..6_u64 {
        fs::write(&path, &text).unwrap();
        let child = vecrad(folder.path(), &solve)
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        sleep(Duration::from_millis(7 * round));
        let file = fs::OpenOptions::new().append(true).open(&path).unwrap();
        match round % 3 {
            0 => file.set_len(text.len() as u64 / 3).unwrap(),
            1 => fs::write(&path, square(0)).unwrap(),
            _ => fs::remove_file(&path).unwrap(),
        }
        let output = child.wait_with_output().unwrap();
        let said = sentence(&output);
        match output.status.code() {
            Some(4) => whole_json(&folder.path().join("out.json")),
            code => assert_eq!(code, Some(3), "{said}"),
        }
    }
}

#[test]
fn a_reader_that_leaves_ends_nothing_but_its_own_output() {
    let folder = tempfile::tempdir().unwrap();
    let outputs = ["--report", "-", "--export", "lit.ply"];
    let mut child = vecrad(folder.path(), &[&SOLVE[..], &outputs].concat())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut first = [0; 10];
    let mut stdout = child.stdout.take().unwrap();
    stdout.read_exact(&mut first).unwrap();
    drop(stdout);
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", sentence(&output));
    assert!(whole_ply(&folder.path().join("lit.ply")) > 0);
}

#[test]
fn progress_and_warnings_that_nobody_reads_stop_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let dark = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nnonsense\n";
    fs::write(folder.path().join("dark.obj"), dark).unwrap();
    for (arguments, code) in [
        (&["solve", "dark.obj", "--export", "lit.ply"][..], 0),
        (&["solve", "missing.obj"], 3),
        (&["scenes"], 0),
    ] {
        let mut child = vecrad(folder.path(), arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop((child.stderr.take(), child.stdout.take()));
        assert_eq!(child.wait().unwrap().code(), Some(code), "{arguments:?}");
    }
    whole_ply(&folder.path().join("lit.ply"));
}

fn send(signal: &str, child: &Child) {
    let id = child.id().to_string();
    // It may have ended already.
    let _ = Command::new("kill")
        .args([signal, &id])
        .stderr(Stdio::null())
        .status()
        .unwrap();
}

#[test]
fn signals_at_any_moment_leave_outputs_whole_or_absent() {
    use std::os::unix::process::ExitStatusExt as _;
    let kills = std::env::var("VECRAD_KILLS");
    let kills: u64 = kills.map_or(18, |count| count.parse().unwrap());
    let mut outcomes = std::collections::BTreeMap::new();
    for round in 0..kills {
        let folder = tempfile::tempdir().unwrap();
        let outputs = ["--export", "lit.ply", "--report", "out.json"];
        let preset = ["--preset", "draft"];
        let child = vecrad(folder.path(), &[&LONG[..], &preset, &outputs].concat())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        // Dense at the start, where there is much to set up, and up to and past the end.
        let part = (round as f64 + 0.5) / kills as f64;
        sleep(Duration::from_secs_f64(3.0 * part * part));
        let signal = ["-TERM", "-INT", "-HUP"][round as usize % 3];
        send(signal, &child);
        let output = child.wait_with_output().unwrap();
        let said = sentence(&output);
        let lit = folder.path().join("lit.ply");
        match output.status.code() {
            Some(0 | 4) => {
                assert!(whole_ply(&lit) > 0, "{said}");
                whole_json(&folder.path().join("out.json"));
            }
            Some(1) => assert!(!lit.exists() && said.contains("error: "), "{said}"),
            // Before it began to listen.
            code => {
                assert!(code.is_none() && output.status.signal().is_some(), "{said}");
                assert!(names(folder.path()).is_empty());
            }
        }
        let expected = ["lit.ply", "out.json"];
        let unexpected = names(folder.path())
            .into_iter()
            .find(|name| !expected.contains(&name.as_str()));
        assert_eq!(unexpected, None);
        assert_eq!(saved_elsewhere(folder.path()), None);
        *outcomes.entry(output.status.code()).or_insert(0) += 1;
    }
    println!("{kills} signals, exit codes {outcomes:?}");
}

#[test]
fn a_signal_ends_a_long_preparation() {
    let folder = tempfile::tempdir().unwrap();
    let large = ["solve", "--scene", "room-1m", "--preset", "draft"];
    let outputs = ["--export", "lit.ply", "--report", "out.json"];
    // The scene was read, and clusters and ray tree take many times as long.
    let (mut child, mut lines, mut said) = begun(folder.path(), &[&large[..], &outputs].concat());
    assert!(said.starts_with("preparing"), "{said}");
    send("-TERM", &child);
    lines.read_to_string(&mut said).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(1), "{said}");
    assert!(said.contains("before there was any light"), "{said}");
    assert_eq!(names(folder.path()), ["out.json"]);
    whole_json(&folder.path().join("out.json"));
}

#[test]
fn pipes_and_devices_are_no_scenes() {
    let folder = tempfile::tempdir().unwrap();
    let made = Command::new("mkfifo")
        .arg(folder.path().join("pipe.obj"))
        .status();
    assert!(made.unwrap().success());
    for name in ["pipe.obj", "/dev/zero", "/dev/null"] {
        let output = vecrad(folder.path(), &["solve", name]).output().unwrap();
        assert_eq!(output.status.code(), Some(3), "{name}");
        assert!(sentence(&output).contains("a pipe or a device"), "{name}");
    }
}
