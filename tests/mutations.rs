//! Generated files, spoiled at random: whatever comes, there is a scene that keeps its promises or one sentence.
//!
//! Some seconds in the suite. For a long run: `VECRAD_FUZZ_CASES=100000 cargo test --release --test mutations`.
//! Every failure names its case; the case alone makes the files.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod spoiled;

use std::{fmt::Write as _, fs, path::Path};

use spoiled::{Chance, assert_promises, assert_same, case_count, folder, spoil};
use vecrad::scene::{ReadError, SceneOptions, Warning, WarningKind, read_scene};

/// An OBJ file that is valid but for what a reader must bear anyway: names without a file, lines of other kinds.
fn obj(chance: &mut Chance) -> String {
    let mut text = String::from("mtllib a.mtl\n");
    let (mut positions, mut texcoords, mut normals) = (0, 0, 0);
    for _ in 0..4 + chance.below(4) {
        positions += 1;
        let [x, y, z] = [(); 3].map(|()| coordinate(chance));
        writeln!(text, "v {x} {y} {z}").unwrap();
    }
    for _ in 0..5 + chance.below(40) {
        match chance.below(16) {
            0..4 => {
                positions += 1;
                let [x, y, z] = [(); 3].map(|()| coordinate(chance));
                writeln!(text, "v {x} {y} {z}").unwrap();
            }
            4 => {
                texcoords += 1;
                let [u, v] = [(); 2].map(|()| coordinate(chance));
                writeln!(text, "vt {u} {v}").unwrap();
            }
            5 => {
                normals += 1;
                let [x, y, z] = [(); 3].map(|()| coordinate(chance));
                writeln!(text, "vn {x} {y} {z}").unwrap();
            }
            6 => writeln!(text, "o object {}", chance.below(3)).unwrap(),
            7 => writeln!(text, "g group{}", chance.below(3)).unwrap(),
            8 => writeln!(text, "usemtl {}", chance.pick(&["m", "n", "lamp", "none"])).unwrap(),
            9 => text += chance.pick(&["# a comment \\\n", "s 1\n", "l 1 2\n", "\n", " \t\n"]),
            _ => {
                text += "f";
                for _ in 0..3 + chance.below(5) {
                    text += chance.pick(&[" ", "  ", "\t", " ", " \\\n "]);
                    text += &corner(chance, [positions, texcoords, normals]);
                }
                text += chance.pick(&["\n", "\r\n", "\n", " # end\n"]);
            }
        }
    }
    text
}

fn coordinate(chance: &mut Chance) -> String {
    let value = chance.below(2001) as f64 / 100.0 - 10.0;
    match chance.below(8) {
        0 => format!("{value:e}"),
        1 => format!("{}", value.trunc()),
        _ => format!("{value}"),
    }
}

fn corner(chance: &mut Chance, [positions, texcoords, normals]: [usize; 3]) -> String {
    let mut index = |count: usize| match chance.below(3) {
        0 => format!("-{}", 1 + chance.below(count)),
        _ => format!("{}", 1 + chance.below(count)),
    };
    let position = index(positions);
    match (texcoords, normals) {
        (0, 0) => position,
        (0, normals) => format!("{position}//{}", index(normals)),
        (texcoords, 0) => format!("{position}/{}", index(texcoords)),
        _ => format!("{position}/{}/{}", index(texcoords), index(normals)),
    }
}

fn mtl(chance: &mut Chance) -> String {
    let mut text = String::new();
    for name in ["m", "n", "lamp"] {
        writeln!(text, "newmtl {name}").unwrap();
        for _ in 0..chance.below(6) {
            let number = chance.below(200) as f32 / 100.0;
            let picture = chance.pick(&[
                "one.png",
                "cut.png",
                "words.png",
                "folder.png",
                "none.png",
                "../up.png",
                "/etc/passwd",
                "-s 2 2 one.png",
                "-o 1e30 -clamp on one.png",
                "One.PNG -s 2 2 -foo # note",
                "C:\\maps\\one.png",
                "leaf.png",
            ]);
            match chance.below(11) {
                0 => writeln!(text, "Kd {number} 0.5 0.2").unwrap(),
                1 => writeln!(text, "Kd {number}").unwrap(),
                2 => writeln!(text, "Ke {number} 1e6 0").unwrap(),
                3 => writeln!(text, "map_Kd {picture}").unwrap(),
                4 => writeln!(text, "map_Ke {picture}").unwrap(),
                5 => writeln!(text, "d {number}\nillum 2").unwrap(),
                6 => writeln!(text, "Ks 1 1 1\nNs 10").unwrap(),
                7 => writeln!(text, "Ks {number} 0.3 0.1\nNs {number}\nillum 3").unwrap(),
                8 => writeln!(text, "Pr {number}\nPm {number}").unwrap(),
                9 => writeln!(text, "Ni {number}\nillum 7\nTf {number} 1 1").unwrap(),
                _ => writeln!(text, "Tr {number}").unwrap(),
            }
        }
    }
    text
}

/// A text with a byte-order mark and two bytes for each unit.
fn utf16(text: &str) -> Vec<u8> {
    let units = std::iter::once(0xfeff).chain(text.encode_utf16());
    units.flat_map(u16::to_le_bytes).collect()
}

/// Pictures that the material files name.
fn pictures(folder: &Path) {
    let one = image::RgbImage::from_pixel(1, 1, image::Rgb([200, 100, 0]));
    one.save(folder.join("one.png")).unwrap();
    let whole = fs::read(folder.join("one.png")).unwrap();
    let leaf = image::RgbaImage::from_fn(2, 1, |x, _| image::Rgba([200, 100, 0, 255 * x as u8]));
    leaf.save(folder.join("leaf.png")).unwrap();
    fs::write(folder.join("cut.png"), &whole[..whole.len() / 2]).unwrap();
    fs::write(folder.join("words.png"), "not a picture").unwrap();
    fs::create_dir(folder.join("folder.png")).unwrap();
}

fn line_count(text: &[u8]) -> usize {
    1 + text
        .iter()
        .filter(|byte| matches!(byte, b'\n' | b'\r'))
        .count()
}

/// Read what a case makes, and check it.
fn check(folder: &Path, obj: &[u8], mtl: &[u8]) -> bool {
    let path = folder.join("scene.obj");
    fs::write(&path, obj).unwrap();
    fs::write(folder.join("a.mtl"), mtl).unwrap();
    let options = SceneOptions::default();
    match (read_scene(&path, &options), read_scene(&path, &options)) {
        (Ok(one), Ok(other)) => {
            assert_promises(&one, obj.len());
            assert_same(&one, &other);
            let lines = |file: &str| line_count(if file == "a.mtl" { mtl } else { obj });
            for warning in &one.warnings {
                if let Some((file, line)) = &warning.place {
                    assert!((1..=lines(file)).contains(line), "{warning}");
                }
            }
            true
        }
        (Err(one), Err(other)) => {
            assert_eq!(one.to_string(), other.to_string());
            assert!(!one.to_string().contains(char::is_control), "{one}");
            assert!(!matches!(one, ReadError::Parser { .. }), "{one}");
            false
        }
        (one, other) => panic!("read differently: {:?}, {:?}", one.err(), other.err()),
    }
}

#[test]
fn spoiled_scenes_are_scenes_or_sentences() {
    let (_folder, folder) = folder();
    pictures(&folder);
    let (mut scenes, count) = (0, case_count(3000));
    for case in 0..count {
        let mut chance = Chance::new(case);
        let mut obj = obj(&mut chance).into_bytes();
        let mut mtl = mtl(&mut chance).into_bytes();
        for text in [&mut obj, &mut mtl] {
            if chance.below(16) == 0 {
                *text = utf16(&String::from_utf8_lossy(text));
            }
        }
        match chance.below(4) {
            0 => spoil(&mut mtl, &mut chance),
            1 => {
                spoil(&mut obj, &mut chance);
                spoil(&mut mtl, &mut chance);
            }
            _ => spoil(&mut obj, &mut chance),
        }
        let outcome = std::panic::catch_unwind(|| check(&folder, &obj, &mtl));
        let Ok(is_scene) = outcome else {
            panic!(
                "case {case}:\n{}\n---\n{}",
                obj.escape_ascii(),
                mtl.escape_ascii()
            );
        };
        scenes += u64::from(is_scene);
    }
    // Were nearly all refused at once, nothing would be tried.
    assert!(2 * scenes > count, "{scenes} of {count} were scenes");
    println!("{count} cases, {scenes} scenes");
}

/// Lines that are wrong in one way, and what is said of them.
const FAULTS: [(&str, WarningKind, &str); 13] = [
    ("f 0 1 2", WarningKind::FaceSkipped, "index 0"),
    ("f 1 2", WarningKind::FaceSkipped, "fewer than three"),
    ("f 1 2 x", WarningKind::FaceSkipped, "no vertex index"),
    ("f 1 2 999", WarningKind::FaceSkipped, "out of range"),
    ("f 1 1 2", WarningKind::FaceSkipped, "no area"),
    ("vt x", WarningKind::LineSkipped, "texture coordinate"),
    ("vn 1 nan 0", WarningKind::LineSkipped, "normal"),
    ("vt 0,5 1", WarningKind::LineSkipped, "decimal comma"),
    ("vn 0 1.0D+00 0", WarningKind::LineSkipped, "D exponent"),
    ("f 1 3 2 4", WarningKind::Orientation, "cross each other"),
    ("nonsense", WarningKind::LineSkipped, "no OBJ statement"),
    ("usemtl", WarningKind::LineSkipped, "without a name"),
    ("p 1", WarningKind::Unsupported, "lines and points"),
];

#[test]
fn a_planted_fault_is_named_with_its_line() {
    let (_folder, folder) = folder();
    for case in 0..case_count(600) {
        let mut chance = Chance::new(case);
        let mut lines: Vec<String> = ["v 0 0 0", "v 1 0 0", "v 1 1 0", "v 0 1 0"]
            .map(str::to_owned)
            .into();
        for _ in 0..chance.below(30) {
            lines.push(
                (chance.pick(&[
                    "f 1 2 3",
                    "f -4 -3 -2 -1",
                    "o a",
                    "g b",
                    "# note",
                    "",
                    "s 1",
                ]))
                .to_owned(),
            );
        }
        lines.push("f 1 2 3".to_owned());
        let (fault, kind, sentence) = chance.pick(&FAULTS);
        let at = 4 + chance.below(lines.len() - 3);
        lines.insert(at, fault.to_owned());
        let text = lines.join(chance.pick(&["\n", "\r\n", "\r"]));
        fs::write(folder.join("scene.obj"), &text).unwrap();
        let scene = read_scene(&folder.join("scene.obj"), &SceneOptions::default()).unwrap();
        let said = scene.warnings.iter();
        // Faces are drawn at random, so some are the same.
        let is_planted = |warning: &&Warning| {
            let is_repeated = ["lies on another", "lay on another"]
                .iter()
                .any(|said| warning.message.contains(said));
            warning.kind != WarningKind::NoEmitter && !is_repeated
        };
        let said: Vec<_> = said.filter(is_planted).collect();
        let [warning] = said[..] else {
            panic!("case {case}: {said:?}\n{text}");
        };
        let place = Some(("scene.obj".to_owned(), at + 1));
        assert_eq!(warning.place, place, "case {case}: {warning}\n{text}");
        assert_eq!((warning.kind, warning.count), (kind, 1), "case {case}");
        assert!(warning.message.contains(sentence), "case {case}: {warning}");
    }
}

#[test]
fn a_planted_fault_of_a_material_is_named_with_its_line() {
    let (_folder, folder) = folder();
    let obj = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n";
    fs::write(folder.join("scene.obj"), obj).unwrap();
    for case in 0..case_count(300) {
        let mut chance = Chance::new(case);
        let mut lines = vec!["newmtl m"];
        for _ in 0..chance.below(20) {
            lines.push(chance.pick(&["Kd 0.5 0.5 0.5", "Ke 1 1 1", "# note", "", "Ns 3", "d 1"]));
        }
        let fault = chance.pick(&["Kd x 0 0", "Ke 1 2", "d", "illum 2.0", "map_Kd", "Tr x"]);
        let at = 1 + chance.below(lines.len());
        lines.insert(at, fault);
        fs::write(folder.join("a.mtl"), lines.join("\n")).unwrap();
        let scene = read_scene(&folder.join("scene.obj"), &SceneOptions::default()).unwrap();
        let mut said = scene.warnings.iter();
        let warning = said.find(|warning| warning.kind == WarningKind::LineSkipped);
        let warning = warning.unwrap_or_else(|| panic!("case {case}: {fault}"));
        let place = Some(("a.mtl".to_owned(), at + 1));
        assert_eq!(warning.place, place, "case {case}: {warning}");
    }
}

#[cfg(feature = "viewer")]
mod sidecar {
    use std::path::Path;

    use glam::{DVec3, Vec3};
    use vecrad::{
        scene::{Frame, Lighting, SkySource, SunSource},
        solver::SolveSettings,
        viewer::{
            camera::Camera,
            saved_light::SavedLight,
            session::{Session, from_toml, to_toml},
            view::ViewSettings,
        },
    };

    use super::spoiled::{Chance, case_count, spoil};

    #[test]
    fn spoiled_sidecars_are_settings_in_range_or_sentences() {
        let frame = Frame {
            centre: DVec3::new(10.0, 0.0, -3.0),
            scale: 7.0,
        };
        let lighting = Lighting {
            sky: Some(SkySource::Hosek {
                turbidity: 2.0,
                scale: Vec3::ONE,
            }),
            sun: Some(SunSource::Disc {
                azimuth: 90.0,
                elevation: 30.0,
                irradiance: Vec3::splat(10.0),
                diameter: 0.53,
            }),
            ..Lighting::default()
        };
        let session = Session {
            bookmarks: Vec::new(),
            camera: Some(Camera::looking(
                Vec3::new(90.0, 20.0, 3.0),
                Vec3::X,
                Vec3::Y,
            )),
            view: ViewSettings {
                fixed_range: Some([0.5, 20.0]),
                ..ViewSettings::default()
            },
            settings: SolveSettings::finest(),
            light: SavedLight::of(&lighting, Path::new("")),
            materials: Vec::new(),
        };
        let text = to_toml(&session, &frame).unwrap();
        let (mut used, count) = (0, case_count(4000));
        for case in 0..count {
            let mut chance = Chance::new(case);
            let mut bytes = text.clone().into_bytes();
            // One number of the many replaced is likelier to be read than several.
            match chance.below(4) {
                0 => spoil(&mut bytes, &mut chance),
                _ => bytes = with_other_number(&text, &mut chance).into_bytes(),
            }
            // Text that is not UTF-8 is refused before.
            let Ok(text) = String::from_utf8(bytes) else {
                continue;
            };
            let outcome = std::panic::catch_unwind(|| from_toml(&text, &frame));
            match outcome.unwrap_or_else(|_| panic!("case {case}:\n{text}")) {
                Ok(session) => {
                    used += 1;
                    assert_eq!(session.settings.check(), Ok(()), "case {case}:\n{text}");
                    assert_eq!(session.view.check(), Ok(()), "case {case}:\n{text}");
                    assert_eq!(session.light.check(), Ok(()), "case {case}:\n{text}");
                    let valid = session.camera.is_none_or(|camera| camera.is_valid());
                    assert!(valid, "case {case}:\n{text}");
                    assert!(session.view.exposure_factor().is_finite(), "case {case}");
                }
                Err(error) => assert!(
                    !error.is_empty() && !error.contains(char::is_control),
                    "case {case}: {error:?}"
                ),
            }
        }
        assert!(10 * used > count, "{used} of {count} were used");
        println!("{count} cases, {used} used");
    }

    /// The text with the value of one line replaced, mostly by one of its own type.
    fn with_other_number(text: &str, chance: &mut Chance) -> String {
        let keys: Vec<usize> = text.match_indices(" = ").map(|(at, _)| at + 3).collect();
        let start = chance.pick(&keys);
        let end = text[start..]
            .find('\n')
            .map_or(text.len(), |length| start + length);
        let floats = [
            "nan", "-inf", "inf", "-1.0", "0.0", "1e39", "-1e-320", "1e308", "0.7", "12.5", "1e-9",
        ];
        let integers = [
            "-1",
            "0",
            "1",
            "77",
            "4096",
            "4294967295",
            "4294967296",
            "9223372036854775807",
            "-9223372036854775808",
        ];
        let others = [
            "true",
            "false",
            "\"\"",
            "[]",
            "[nan, 1.0, 2.0]",
            "[1e300, 0.0, 0.0]",
            "[0.0, 0.0, 0.0]",
            "{}",
            "1979-05-27",
            "0x7f",
        ];
        let old = &text[start..end];
        let value = if old.parse::<i64>().is_ok() && chance.below(8) > 0 {
            chance.pick(&integers)
        } else if old.parse::<f64>().is_ok() && chance.below(8) > 0 {
            chance.pick(&floats)
        } else {
            chance.pick(&others)
        };
        format!("{}{value}{}", &text[..start], &text[end..])
    }
}
