//! The program from outside: exit codes, sentences, files.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

const SCENE: &str = "plates";

fn vecrad(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_vecrad"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap()
}

fn error_of(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Wrong usage: exit code 2 and a sentence that says what is wrong.
fn assert_refused(output: &Output, sentence: &str, arguments: &[&str]) {
    assert_eq!(output.status.code(), Some(2), "{arguments:?}");
    assert!(error_of(output).contains(sentence), "{}", error_of(output));
}

fn solve(folder: &Path, more: &[&str]) -> Output {
    let start = ["solve", "--scene", SCENE, "--preset", "draft"];
    vecrad(folder, &[&start, more].concat())
}

#[test]
fn a_solve_writes_a_mesh_and_a_report() {
    let folder = tempfile::tempdir().unwrap();
    let output = solve(
        folder.path(),
        &["--export", "lit.ply", "--report", "out.json"],
    );
    assert_eq!(output.status.code(), Some(0), "{}", error_of(&output));
    assert!(output.stdout.is_empty(), "progress is for stderr");

    let ply = fs::read(folder.path().join("lit.ply")).unwrap();
    let end = b"end_header\n";
    let body = ply.windows(end.len()).position(|w| w == end).unwrap() + end.len();
    let header = String::from_utf8(ply[..body].to_vec()).unwrap();
    let count = |element: &str| -> usize {
        let line = header
            .lines()
            .find_map(|line| line.strip_prefix(&format!("element {element} ")));
        line.unwrap().parse().unwrap()
    };
    assert!(header.starts_with("ply\nformat binary_little_endian 1.0\n"));
    assert!(header.contains("property list uchar int vertex_indices"));
    assert_eq!(ply.len() - body, 51 * count("vertex") + 13 * count("face"));

    let report = fs::read(folder.path().join("out.json")).unwrap();
    let report: serde_json::Value = serde_json::from_slice(&report).unwrap();
    assert_eq!(report["scene"]["triangles"], 4);
    assert_eq!(report["stop_reason"], "converged");
    assert_eq!(report["settings"]["method"], "bounded");
    let steps = report["steps"].as_array().unwrap();
    assert!(!steps.is_empty());
    for key in [
        "elapsed_s",
        "epsilon",
        "links",
        "residual",
        "energy_balance",
    ] {
        assert!(steps[0][key].is_number(), "{key}");
    }
    let files = fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(files, 2, "nothing is left beside the outputs");
}

#[test]
fn a_dash_sends_the_report_to_standard_output() {
    let folder = tempfile::tempdir().unwrap();
    let output = solve(folder.path(), &["--report", "-", "--quiet"]);
    assert_eq!(output.status.code(), Some(0));
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["scene"]["name"], SCENE);
}

#[test]
fn a_reference_puts_an_error_into_every_step() {
    let folder = tempfile::tempdir().unwrap();
    let more = ["--report", "-", "--reference", "paths=16"];
    let output = solve(folder.path(), &more);
    assert_eq!(output.status.code(), Some(0), "{}", error_of(&output));
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    for step in report["steps"].as_array().unwrap() {
        assert!(step["error"]["relative_rms"].is_number(), "{step}");
        let phases = step["phases"].as_object().unwrap();
        assert!(
            phases.values().any(|seconds| seconds.as_f64() > Some(0.0)),
            "{step}"
        );
    }
}

#[test]
fn a_solve_writes_glb_where_the_name_ends_so() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["--export", "lit.GLB", "--up", "+Z", "--exposure", "-1"];
    let output = solve(folder.path(), &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", error_of(&output));
    let glb = fs::read(folder.path().join("lit.GLB")).unwrap();
    let number = |at: usize| u32::from_le_bytes(glb[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!(
        (&glb[..4], number(4), number(8)),
        (&b"glTF"[..], 2, glb.len())
    );
    let text = &glb[20..20 + number(12)];
    let document: serde_json::Value = serde_json::from_slice(text).unwrap();
    assert_eq!(document["meshes"][0]["extras"]["exposure_ev"], -1.0);
    let root = document["scenes"][0]["nodes"][0].as_u64().unwrap() as usize;
    assert_eq!(document["nodes"][root]["children"][0], 0, "+Z is turned");
    assert!(document["nodes"][root]["rotation"].is_array());
    // Two one-sided plates of two triangles each at least.
    let count = |accessor: usize| document["accessors"][accessor]["count"].as_u64().unwrap();
    let (vertices, corners) = (count(0), count(5));
    assert!(corners >= 12 && vertices >= 8);
    let indices = &glb[glb.len() - 4 * corners as usize..];
    assert!(
        indices
            .chunks_exact(4)
            .all(|bytes| { u64::from(u32::from_le_bytes(bytes.try_into().unwrap())) < vertices })
    );
}

#[test]
fn an_error_that_is_asked_for_ends_the_run_and_wrong_ones_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let with = |error: &str, more: &[&str]| {
        let flags = [
            "solve", "--scene", "plates", "--report", "r.json", "--error",
        ];
        vecrad(folder.path(), &[&flags[..], &[error], more].concat())
    };
    for error in ["20%", "20"] {
        let output = with(error, &[]);
        assert_eq!(output.status.code(), Some(0), "{}", error_of(&output));
        let report = fs::read(folder.path().join("r.json")).unwrap();
        let report: serde_json::Value = serde_json::from_slice(&report).unwrap();
        let steps = report["steps"].as_array().unwrap();
        let estimated = &steps[steps.len() - 1]["estimated_error"];
        assert!(
            estimated["trimmed_high"].as_f64().unwrap() <= 0.2,
            "{estimated}"
        );
    }
    // Where it cannot be reached, the reason is told.
    let output = with("0.0001%", &[]);
    assert_eq!(output.status.code(), Some(4), "{}", error_of(&output));
    let told = error_of(&output);
    assert!(
        told.contains("note: an error of 0.0001 % is not reached: "),
        "{told}"
    );
    for (error, more) in [
        ("0", &[][..]),
        ("120%", &[]),
        ("little", &[]),
        ("5%", &["--preset", "draft"]),
    ] {
        let output = with(error, more);
        assert_eq!(
            output.status.code(),
            Some(2),
            "{error}: {}",
            error_of(&output)
        );
    }
}

#[test]
fn a_limit_ends_with_code_4_and_writes_what_there_is() {
    let folder = tempfile::tempdir().unwrap();
    let output = solve(
        folder.path(),
        &["--report", "out.json", "--time-limit", "0"],
    );
    assert_eq!(output.status.code(), Some(4), "{}", error_of(&output));
    let report = fs::read_to_string(folder.path().join("out.json")).unwrap();
    assert!(report.contains("\"time-limit\""));
}

#[test]
fn a_step_that_the_time_limit_interrupts_counts_in_the_times() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = [
        "solve",
        "--scene",
        "gallery",
        "--preset",
        "final",
        "--threads",
        "1",
        "--time-limit",
        "0.5",
        "--report",
        "-",
    ];
    let output = vecrad(folder.path(), &arguments);
    assert_eq!(output.status.code(), Some(4), "{}", error_of(&output));
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let totals = &report["totals"];
    let elapsed = totals["elapsed_s"].as_f64().unwrap();
    assert!(elapsed >= 0.5, "{totals}");
    let steps = report["steps"].as_array().unwrap();
    let done = steps
        .last()
        .map_or(&totals["prepare_s"], |last| &last["solve_s"]);
    let all = totals["solve_s"].as_f64().unwrap();
    let interrupted = totals["interrupted_s"].as_f64().unwrap_or(0.0);
    let difference = all - interrupted - done.as_f64().unwrap();
    assert!(difference.abs() < 1e-9, "{totals}");
}

#[test]
fn any_number_of_steps_comes_to_an_end() {
    let folder = tempfile::tempdir().unwrap();
    for (scene, more) in [
        ("plates", &[][..]),
        ("perpendicular-plates", &["--epsilon", "0.05"]),
        ("furnace", &["--preset", "draft"]),
    ] {
        let start = ["solve", "--scene", scene, "--max-steps", "4294967295"];
        let arguments = [&start[..], &["--report", "-"], more].concat();
        let output = vecrad(folder.path(), &arguments);
        assert_eq!(output.status.code(), Some(0), "{}", error_of(&output));
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(report["stop_reason"], "converged");
        let steps = report["steps"].as_array().unwrap();
        assert!((5..12).contains(&steps.len()), "{scene}: {}", steps.len());
        assert!(steps.iter().all(|step| step["epsilon"].is_number()));
    }
}

#[test]
fn help_names_defaults_and_every_reference() {
    let folder = tempfile::tempdir().unwrap();
    let output = vecrad(folder.path(), &["solve", "--help"]);
    let text = String::from_utf8(output.stdout).unwrap();
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    for part in [
        "[default: 0.005, draft 0.03, final 0.002]",
        "[default: 5, draft 3, final 6]",
        "1 to 4096 [default: 4]",
        "radiosity matrix (matrix",
        "[default: none]",
        "[default: automatic, one for each core]",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
}

#[test]
fn a_misspelt_scene_gets_a_suggestion() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, suggestion) in [
        (&["solve", "--scene", "cornel"][..], "'cornell'"),
        (&["solve", "cornell"], "--scene cornell"),
        (
            &["report", "--scene", "galery", "--output", "out"],
            "'gallery'",
        ),
    ] {
        let output = vecrad(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(3), "{arguments:?}");
        let sentence = error_of(&output);
        assert!(sentence.contains(suggestion), "{sentence}");
    }
}

#[test]
fn wrong_usage_ends_with_code_2_and_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, sentence) in [
        (
            &["--export", "lit.fbx"][..],
            "must end in .ply, .glb or .obj",
        ),
        (&["--export", "missing/lit.ply"], "there is no such folder"),
        (&["--epsilon", "-1"], "at least 0"),
        (&["--threads", "0"], "--threads"),
        (&["--reference", "photons"], "expected paths"),
    ] {
        let output = solve(folder.path(), arguments);
        assert_refused(&output, sentence, arguments);
    }
}

#[test]
fn a_scene_that_cannot_be_read_ends_with_code_3() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in [
        &["solve", "missing.obj"][..],
        &["solve", "--scene", "nowhere"],
    ] {
        let output = vecrad(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(3), "{arguments:?}");
        assert!(error_of(&output).starts_with("error: "), "{arguments:?}");
    }
}

#[test]
fn files_that_cannot_be_lit_end_with_code_3_and_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("folder.obj")).unwrap();
    for (name, bytes) in [
        ("empty.obj", &b""[..]),
        ("points.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n"),
        ("picture.obj", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"),
        ("flat.obj", b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"),
        ("nan.obj", b"v nan 0 0\nv 1 0 0\nv 0 inf 0\nf 1 2 3\n"),
        (
            "range.obj",
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\nf -7 1 2\n",
        ),
    ] {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    let files = [
        "empty.obj",
        "points.obj",
        "picture.obj",
        "flat.obj",
        "nan.obj",
        "range.obj",
        "folder.obj",
    ];
    for name in files {
        let output = vecrad(folder.path(), &["solve", name, "--export", "lit.ply"]);
        let sentence = error_of(&output);
        assert_eq!(output.status.code(), Some(3), "{name}: {sentence}");
        assert!(sentence.contains(name), "{name}: {sentence}");
        assert!(!folder.path().join("lit.ply").exists(), "{name}");
    }
}

#[test]
fn curable_files_are_lit_with_warnings_on_standard_error() {
    let folder = tempfile::tempdir().unwrap();
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    let lamp = "newmtl lamp\nKd 0.5\nKe 1 1 1\nillum 2.0\nnewmtl bright\nKd 1.5 1.5 1.5\n";
    fs::write(folder.path().join("a.mtl"), lamp).unwrap();
    for (name, text, warning) in [
        (
            "bom.obj",
            format!("\u{feff}mtllib a.mtl\n{square}usemtl lamp\nf 1 2 3 4\n"),
            "",
        ),
        (
            "continued.obj",
            format!("mtllib a.mtl\r\n{square}usemtl lamp\r\nf 1 2 \\\r\n3 4\r\n"),
            "",
        ),
        (
            "bad-index.obj",
            format!("mtllib a.mtl\n{square}usemtl lamp\nf 1 2 3 4\nf 1 2 99\n"),
            "bad-index.obj:8",
        ),
        (
            "unknown.obj",
            format!("mtllib a.mtl\n{square}usemtl nothing\nf 1 2 3 4\n"),
            "nothing",
        ),
        (
            "no-mtl.obj",
            format!("mtllib gone.mtl\n{square}f 1 2 3 4\n"),
            "gone.mtl",
        ),
        (
            "clamped.obj",
            format!("mtllib a.mtl\n{square}usemtl bright\nf 1 2 3 4\n"),
            "0.98",
        ),
        (
            "dark.obj",
            format!("{square}f 1 2 3 4\n"),
            "nothing emits light",
        ),
    ] {
        fs::write(folder.path().join(name), text).unwrap();
        let output = vecrad(
            folder.path(),
            &["solve", name, "--export", "lit.ply", "--preset", "draft"],
        );
        let messages = error_of(&output);
        assert_eq!(output.status.code(), Some(0), "{name}: {messages}");
        assert!(messages.contains(warning), "{name}: {messages}");
        assert!(folder.path().join("lit.ply").exists(), "{name}");
    }
}

/// `vecrad report` with a plan of one run that takes a moment.
fn report(folder: &Path, more: &[&str]) -> Output {
    let few = [
        "report",
        "--output",
        "out",
        "--methods",
        "bounded",
        "--oracles",
        "interval",
        "--epsilons",
        "0.1",
        "--reference",
        "paths=16",
        "--max-spp",
        "4",
        "--preset",
        "draft",
    ];
    vecrad(folder, &[&few, more].concat())
}

#[test]
fn a_report_writes_tables_and_a_plot() {
    let folder = tempfile::tempdir().unwrap();
    let more = ["--scene", SCENE, "--baselines", "bake", "--repeats", "3"];
    let output = report(folder.path(), &more);
    assert_eq!(output.status.code(), Some(0), "{}", error_of(&output));
    assert!(output.stdout.is_empty(), "progress is for stderr");
    let out = folder.path().join("out");
    let mut names: Vec<String> = fs::read_dir(&out)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    let expected = [
        "plates.png",
        "plates.svg",
        "report.csv",
        "report.json",
        "report.md",
    ];
    assert_eq!(names, expected);

    let mut table = csv::Reader::from_path(out.join("report.csv")).unwrap();
    let header = table.headers().unwrap().clone();
    let column = |name: &str| header.iter().position(|found| found == name).unwrap();
    let (mut last, mut kinds) = (0.0, Vec::new());
    for row in table.records() {
        let row = row.unwrap();
        let number = |name: &str| row[column(name)].parse::<f64>().unwrap();
        if number("step") <= 1.0 {
            last = 0.0;
            kinds.push(row[column("runner")].to_owned());
        }
        assert!(number("time_s") > last, "time goes on: {row:?}");
        last = number("time_s");
        let error = number("error_trimmed");
        assert!(error.is_finite() && error >= 0.0, "{row:?}");
        assert!((number("repeats") - 3.0).abs() < 1e-9);
        assert_eq!(&row[column("is_cut_short")], "false", "{row:?}");
    }
    assert_eq!(kinds[0], "solver");
    assert!(kinds[1..].iter().all(|kind| kind == "bake") && kinds.len() > 1);

    let json = fs::read(out.join("report.json")).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    assert_eq!(json["scenes"][0]["scene"], SCENE);
    assert_eq!(json["repeats"], 3);
    assert_eq!(json["settings"]["epsilon"].as_f64().unwrap() as f32, 0.1);
    for key in ["version", "machine", "threads", "settings", "time_limit_s"] {
        assert!(!json[key].is_null(), "{key}");
    }
    assert_eq!(json["scenes"][0]["reference"]["samples"], 16);

    let text = fs::read_to_string(out.join("report.md")).unwrap();
    let rows: Vec<&str> = text.lines().filter(|line| line.starts_with('|')).collect();
    assert_eq!(rows.len(), 2 + kinds.len(), "{text}");
    let cells = rows[0].matches('|').count();
    assert!(rows.iter().all(|row| row.matches('|').count() == cells));
    assert!(text.contains("](plates.svg)"));
    let lights = &json["scenes"][0]["lights"];
    assert_eq!(lights["sources"][0], "surfaces", "{lights}");
    assert!(text.contains("Light: 2 emitting triangles."), "{text}");
}

#[test]
fn a_report_on_a_file_runs_jacobi_and_honours_its_time() {
    let folder = tempfile::tempdir().unwrap();
    let made = vecrad(folder.path(), &["scenes", "--write", "."]);
    assert_eq!(made.status.code(), Some(0), "{}", error_of(&made));
    let more = [
        "plates.obj",
        "--baselines",
        "jacobi",
        "--time-limit",
        "0.5",
        "--threads",
        "2",
        "--quiet",
    ];
    let output = report(folder.path(), &more);
    let code = output.status.code();
    // A machine that is busy may not finish the run in time.
    assert!(code == Some(0) || code == Some(4), "{}", error_of(&output));
    let json = fs::read(folder.path().join("out/report.json")).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    assert_eq!(json["threads"], 2);
    let runs = json["scenes"][0]["runs"].as_array().unwrap();
    for run in runs {
        let points = run["points"].as_array().unwrap();
        for point in points {
            assert!(
                point["error"]["relative_rms_trimmed"].is_number(),
                "{point}"
            );
        }
    }
    assert!(runs.iter().any(|run| run["runner"] == "jacobi"));
}

#[test]
fn a_report_cut_short_by_its_limit_ends_with_code_4_and_whole_files() {
    let folder = tempfile::tempdir().unwrap();
    let more = ["--scene", SCENE, "--time-limit", "0", "--baselines", "none"];
    let output = report(folder.path(), &more);
    assert_eq!(output.status.code(), Some(4), "{}", error_of(&output));
    let json = fs::read(folder.path().join("out/report.json")).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    assert_eq!(json["scenes"][0]["runs"][0]["is_cut_short"], true);
    let table = fs::read_to_string(folder.path().join("out/report.md")).unwrap();
    assert!(table.contains("| bounded † |"), "{table}");
    let plot = fs::read_to_string(folder.path().join("out/plates.svg")).unwrap();
    assert!(plot.contains("bounded (cut short)"));
}

#[test]
fn a_report_says_what_is_wrong_with_its_usage() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("taken"), "a file").unwrap();
    for (arguments, sentence) in [
        (&["report", "--scene", SCENE][..], "--output"),
        (&["report", "--output", "out"], "required"),
        (
            &[
                "report", "--scene", SCENE, "--suite", "paper", "--output", "out",
            ],
            "cannot be used with",
        ),
        (
            &["report", "--suite", "nothing", "--output", "out"],
            "cornell",
        ),
        (
            &["report", "--scene", SCENE, "--output", "taken"],
            "must be a folder",
        ),
        (
            &[
                "report",
                "--scene",
                SCENE,
                "--output",
                "out",
                "--reference",
                "matrix",
            ],
            "path tracing",
        ),
    ] {
        let output = vecrad(folder.path(), arguments);
        assert_refused(&output, sentence, arguments);
    }
}

#[test]
fn the_scaling_suite_fits_an_exponent_to_the_sizes_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let more = ["--suite", "scaling", "--sizes", "1000,2000"];
    let output = report(folder.path(), &more);
    assert_eq!(output.status.code(), Some(0), "{}", error_of(&output));
    let json = fs::read(folder.path().join("out/scaling.json")).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    let sizes = json["sizes"].as_array().unwrap();
    let triangles: Vec<u64> = sizes
        .iter()
        .map(|size| size["cost"]["triangles"].as_u64().unwrap())
        .collect();
    assert_eq!(triangles, [1000, 2000]);
    for size in sizes {
        assert!(
            size["cost"]["first_light_s"].as_f64().unwrap() > 0.0,
            "{size}"
        );
    }
    assert!(json["exponents"][0][1].is_number());
    for name in ["scaling.md", "scaling.csv", "scaling.svg", "scaling.png"] {
        assert!(folder.path().join("out").join(name).exists(), "{name}");
    }
}

#[test]
fn the_stability_suite_tells_what_holds_and_refuses_unknown_cases() {
    let folder = tempfile::tempdir().unwrap();
    let output = report(
        folder.path(),
        &["--suite", "stability", "--cases", "single triangle,black"],
    );
    assert_eq!(output.status.code(), Some(0), "{}", error_of(&output));
    let json = fs::read(folder.path().join("out/stability.json")).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    assert_eq!((&json["holds"], &json["fails"]), (&2.into(), &0.into()));
    let table = fs::read_to_string(folder.path().join("out/stability.md")).unwrap();
    assert!(
        table.contains("| a single triangle | largest irradiance | 0 | 0 |"),
        "{table}"
    );
    assert!(folder.path().join("out/stability.csv").exists());
    // A case that has no time does not hold.
    let output = report(
        folder.path(),
        &[
            "--suite",
            "stability",
            "--cases",
            "needles",
            "--time-limit",
            "0",
        ],
    );
    assert_eq!(output.status.code(), Some(1), "{}", error_of(&output));
    let sentence = error_of(&output);
    assert!(
        sentence.contains("1 of 1 cases failed: needles"),
        "{sentence}"
    );
    let output = report(
        folder.path(),
        &["--suite", "stability", "--cases", "unheard-of"],
    );
    assert_eq!(output.status.code(), Some(2), "{}", error_of(&output));
}

#[test]
fn exact_suites_list_every_figure_and_refuse_cases_of_others() {
    let folder = tempfile::tempdir().unwrap();
    let output = report(folder.path(), &["--suite", "cie171", "--cases", "5.6"]);
    assert_eq!(output.status.code(), Some(0), "{}", error_of(&output));
    let json = fs::read(folder.path().join("out/cie171.json")).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    assert_eq!((&json["holds"], &json["fails"]), (&9.into(), &0.into()));
    let table = fs::read_to_string(folder.path().join("out/cie171.md")).unwrap();
    assert!(table.contains("| wall 2, 0, 0.75 | 35.9"), "{table}");
    let csv = fs::read_to_string(folder.path().join("out/cie171.csv")).unwrap();
    assert_eq!(csv.lines().count(), 10);
    // Discs are exact, too, but not of the standard.
    let output = report(folder.path(), &["--suite", "cie171", "--cases", "discs"]);
    assert_eq!(output.status.code(), Some(2), "{}", error_of(&output));
    // A draft is too coarse for the penumbra of this case.
    let flags = ["--suite", "exact", "--cases", "5.7"];
    let output = report(folder.path(), &flags);
    assert_eq!(output.status.code(), Some(1), "{}", error_of(&output));
    let sentence = error_of(&output);
    assert!(sentence.contains("1 of 1 cases failed"), "{sentence}");
}

#[test]
fn the_plan_suite_compares_what_is_kept_and_refuses_unknown_scenes() {
    let folder = tempfile::tempdir().unwrap();
    let output = report(
        folder.path(),
        &["--suite", "plan", "--cases", "perpendicular"],
    );
    assert_eq!(output.status.code(), Some(0), "{}", error_of(&output));
    let json = fs::read(folder.path().join("out/plan.json")).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    let runs = json["scenes"][0]["runs"].as_array().unwrap();
    assert_eq!(runs[0]["kept"], "nothing");
    assert!(runs.iter().all(|run| run["rounds"] == 3), "{json}");
    let table = fs::read_to_string(folder.path().join("out/plan.md")).unwrap();
    assert!(table.contains("| perpendicular-plates | all |"), "{table}");
    let csv = fs::read_to_string(folder.path().join("out/plan.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + runs.len());
    let output = report(folder.path(), &["--suite", "plan", "--cases", "unheard-of"]);
    assert_eq!(output.status.code(), Some(2), "{}", error_of(&output));
}
