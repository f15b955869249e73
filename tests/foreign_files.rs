//! Files as other systems, other programs and hands write them: encodings, notations, names, paths, habits. What is meant is
//! read, and what cannot be is named once.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::{fs, path::Path};

use glam::Vec3;
use tempfile::TempDir;
use vecrad::scene::{
    Material, ReadError, Scene, SceneOptions, Specular, TriangleId, WarningKind, read_scene,
};

/// A square with texture coordinates.
const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";

/// Brown, as sRGB bytes and as reflectance.
const BROWN: [u8; 3] = [188, 137, 99];

fn brown() -> Vec3 {
    let linear = |code: u8| ((f32::from(code) / 255.0 + 0.055) / 1.055).powf(2.4);
    Vec3::from_array(BROWN.map(linear))
}

/// A folder with these text files and brown pictures.
fn folder(files: &[(&str, &str)], pictures: &[&str]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        fs::write(folder.path().join(name), text).unwrap();
    }
    for name in pictures {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        let picture = image::RgbImage::from_pixel(2, 2, image::Rgb(BROWN));
        picture.save(path).unwrap();
    }
    folder
}

fn try_read(folder: &Path) -> Result<Scene, ReadError> {
    read_scene(&folder.join("scene.obj"), &SceneOptions::default())
}

fn read(folder: &TempDir) -> Scene {
    try_read(folder.path()).unwrap()
}

/// All warnings but the one that there is no light.
fn said(scene: &Scene) -> Vec<String> {
    let warnings = scene.warnings.iter();
    let others = warnings.filter(|warning| warning.kind != WarningKind::NoEmitter);
    others.map(ToString::to_string).collect()
}

fn assert_near(found: Vec3, expected: Vec3, context: &str) {
    assert!(
        found.abs_diff_eq(expected, 1e-4),
        "{context}: {found} for {expected}"
    );
}

/// A square of material `m` that an MTL file of this text defines.
fn textured(mtl: &str, pictures: &[&str]) -> (TempDir, Scene) {
    let obj = format!("mtllib a.mtl\n{SQUARE}usemtl m\nf 1/1 2/2 3/3 4/4\n");
    let folder = folder(&[("scene.obj", &obj), ("a.mtl", mtl)], pictures);
    let scene = read(&folder);
    (folder, scene)
}

#[test]
fn utf16_is_read_and_told_once() {
    let obj = format!("mtllib a.mtl\r\n{SQUARE}usemtl 床\r\nf 1 2 3 4\r\n");
    let mtl = "newmtl 床\r\nKd 0.25 0.5 0.75\r\n";
    let encoded = |text: &str, mark: &str, bytes: fn(u16) -> [u8; 2]| -> Vec<u8> {
        let text = format!("{mark}{text}");
        text.encode_utf16().flat_map(bytes).collect()
    };
    for (mark, bytes) in [
        ("\u{feff}", u16::to_le_bytes as fn(u16) -> [u8; 2]),
        ("\u{feff}", u16::to_be_bytes),
        ("", u16::to_le_bytes),
    ] {
        let folder = folder(&[], &[]);
        fs::write(folder.path().join("scene.obj"), encoded(&obj, mark, bytes)).unwrap();
        fs::write(folder.path().join("a.mtl"), encoded(mtl, mark, bytes)).unwrap();
        let scene = read(&folder);
        assert_eq!(scene.triangles.len(), 2);
        assert_eq!(scene.materials[0].name, "床");
        assert_near(
            scene.surfaces[0].reflectance,
            Vec3::new(0.25, 0.5, 0.75),
            mark,
        );
        let expected = "scene.obj:1: the file is UTF-16, which many programs cannot read, and was decoded (2 times)";
        assert_eq!(said(&scene), [expected]);
    }
}

#[test]
fn numbers_in_other_notations_are_named_with_their_first_line() {
    let comma = "# a\nv 0,000 0,000 0\nv 1,5 0 0\nv 0 1 0\nf 1 2 3\n";
    let fortran = "v 0 0 0\nv 1.0D+00 0 0\nv 0 1.0d0 0\nf 1 2 3\n";
    for (text, expected) in [
        (
            comma,
            "line 2 has a decimal comma in a vertex, so no usable faces are left; export with decimal points: ",
        ),
        (
            fortran,
            "line 2 has a D exponent in a vertex, so no usable faces are left; export with E exponents: ",
        ),
    ] {
        let folder = folder(&[("scene.obj", text)], &[]);
        let error = try_read(folder.path()).unwrap_err().to_string();
        assert!(
            error.starts_with(expected) && error.ends_with("scene.obj"),
            "{error}"
        );
    }
    // Where other faces remain, it is a warning.
    let text = format!("{SQUARE}v 1,5 0 0\nv 2,5 0 0\nf 1 2 3 4\nf 1 2 5\nf 1 2 6\n");
    let folder = folder(&[("scene.obj", &text)], &[]);
    let expected = [
        "scene.obj:9: vertex with a decimal comma; faces that use it are omitted; export with decimal points (2 times)",
        "scene.obj:12: skipped a face: a corner is not a finite number (2 times)",
    ];
    assert_eq!(said(&read(&folder)), expected);
}

#[test]
fn names_match_whatever_space_or_comment_ends_them() {
    for (library, defined, used) in [
        ("a.mtl", "床　木　", "床　木　"),
        ("a.mtl", "lamp\u{a0}", "lamp"),
        ("a.mtl", "lamp", "lamp\u{2003}"),
        ("a.mtl", "\u{3000}", "\u{3000}"),
        ("a.mtl # materials", "lamp   # 60 W", "lamp"),
        ("a.mtl\u{3000}", "lamp", "lamp # 60 W"),
        ("\"a.mtl\"", "lamp #2", "lamp #2"),
        ("none.mtl a.mtl # two", "lamp\t# 60 W", "lamp # warm"),
    ] {
        let obj = format!("mtllib {library}\n{SQUARE}usemtl {used}\nf 1 2 3 4\n");
        let mtl = format!("newmtl other\nKd 0 0 0\nnewmtl {defined}\nKd 0.1 0.2 0.3\n");
        let folder = folder(&[("scene.obj", &obj), ("a.mtl", &mtl)], &[]);
        let scene = read(&folder);
        let expected = Vec3::new(0.1, 0.2, 0.3);
        assert_near(scene.surfaces[0].reflectance, expected, used);
        let missing = usize::from(library.starts_with("none"));
        assert_eq!(said(&scene).len(), missing, "{:?}", said(&scene));
    }
}

#[test]
fn a_material_of_several_spellings_is_one() {
    let obj = format!("mtllib a.mtl\n{SQUARE}usemtl a # one\nf 1 2 3\nusemtl a # two\nf 1 3 4\n");
    let files = [
        ("scene.obj", &*obj),
        ("a.mtl", "newmtl a\nKd 0.1 0.1 0.1\n"),
    ];
    let scene = read(&folder(&files, &[]));
    assert_eq!(scene.materials.len(), 1);
    assert_eq!(scene.triangles[0].material, scene.triangles[1].material);
}

#[test]
fn objects_lose_comments_but_keep_numbers() {
    let faces = "f 1 2 3\n";
    let obj = format!("{SQUARE}o chair # oak\n{faces}o Window #3\nf 1 3 4\n");
    let scene = read(&folder(&[("scene.obj", &obj)], &[]));
    let names = scene.objects.iter().map(|object| object.name.label());
    assert_eq!(names.collect::<Vec<_>>(), ["chair", "Window #3"]);
}

#[test]
fn textures_are_found_by_what_their_names_mean() {
    let files = [
        "textures/wood/floor.png",
        "my floor.png",
        "wood #2.png",
        "holz/Bodenbela\u{308}ge.png",
    ];
    for name in [
        "Textures/Wood/Floor.PNG",
        "C:\\Projects\\house\\textures\\wood\\floor.png",
        "/home/me/house/Textures/wood/floor.png",
        "\\\\server\\share\\Textures\\wood\\floor.png",
        "my floor.png -s 2 2 1",
        "-s 2 2 1 \"my floor.png\" -clamp off # oak",
        "-colorspace sRGB my floor.png",
        "my floor.png\t# oak",
        "wood #2.png",
        "-o 0.5 wood #2.png -bm 1",
        "holz/Bodenbel\u{e4}ge.png",
        "D:/HOLZ/BODENBEL\u{c4}GE.PNG\u{3000}",
    ] {
        let (_folder, scene) = textured(&format!("newmtl m\nKd 1 1 1\nmap_Kd {name}\n"), &files);
        let is_told = name.contains("colorspace");
        assert_eq!(
            said(&scene).len(),
            usize::from(is_told),
            "{:?}",
            said(&scene)
        );
        assert_near(scene.surfaces[0].reflectance, brown(), name);
    }
}

#[test]
fn a_texture_that_is_nowhere_is_named_without_its_options() {
    let mtl = "newmtl m\nKd 0.5 0.5 0.5\nmap_Kd none.png -s 2 2 1 # oak\n";
    let (_folder, scene) = textured(mtl, &[]);
    let expected = "a.mtl:1: texture 'none.png' was not found; the plain colour is used";
    assert_eq!(said(&scene), [expected]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_name_that_fits_several_files_finds_none() {
    let mtl = "newmtl m\nKd 0.5 0.5 0.5\nmap_Kd FLOOR.png\n";
    let (_folder, scene) = textured(mtl, &["floor.png", "Floor.png"]);
    let expected = "a.mtl:1: texture 'FLOOR.png' fits several files that differ in letter case, so none was read; the plain colour is used";
    assert_eq!(said(&scene), [expected]);
}

#[test]
fn black_beside_a_picture_means_the_picture_alone() {
    for colors in ["Kd 0 0 0\nKe 0 0 0", "Kd 0\nKe 0", "", "Kd 1 1 1\nKe 1 1 1"] {
        let mtl = format!("newmtl m\n{colors}\nmap_Kd floor.png\nmap_Ke floor.png\n");
        let (_folder, scene) = textured(&mtl, &["floor.png"]);
        assert_near(scene.surfaces[0].reflectance, brown(), colors);
        assert_near(scene.surfaces[0].emission, brown(), colors);
        assert!(said(&scene).is_empty(), "{:?}", said(&scene));
    }
    let (_folder, scene) = textured("newmtl m\nKd 0 0 0\nKe 0 0 0\n", &[]);
    assert_eq!(scene.surfaces[0].reflectance, Vec3::ZERO);
    assert_eq!(scene.surfaces[0].emission, Vec3::ZERO);
}

#[test]
fn transparency_and_gloss_are_told_once_and_for_which_materials() {
    let materials = [
        ("Glass", "d 0.3"),
        ("Wall", "illum 4\nd 1"),
        ("Floor", "illum 4\nTf 1 1 1"),
        ("Pane", "Tr 0.9"),
        ("Unused", "d 0.1"),
        ("Plain", "illum 2\nd 1\nTr 0"),
        ("Coat", "Pc 0.5\nmap_Bump a.png"),
        ("Bottle", "illum 7\nNi 1.5"),
    ];
    let mut obj = format!("mtllib a.mtl\n{SQUARE}");
    let mut mtl = String::new();
    for (number, (name, statements)) in (5..).step_by(3).zip(materials) {
        mtl += &format!("newmtl {name}\nKd 0.5\n{statements}\n");
        if name != "Unused" {
            obj += &format!("v 0 0 {number}\nv 1 0 {number}\nv 0 1 {number}\n");
            obj += &format!("usemtl {name}\nf -3 -2 -1\n");
        }
    }
    let scene = read(&folder(&[("scene.obj", &obj), ("a.mtl", &mtl)], &[]));
    let expected = [
        "a.mtl:1: transparent materials: 'Glass' (d 0.3), 'Pane' (Tr 0.9), 'Bottle' (illum 7)",
        "a.mtl:23: gloss and relief of these kinds are not computed: 'Coat' (Pc, map_Bump)",
    ];
    assert_eq!(said(&scene), expected);
    for (name, opacity) in [("Glass", 0.3), ("Wall", 1.0), ("Pane", 0.1)] {
        let is_meant = |id: &TriangleId| scene.material(*id).name == name;
        let triangle = scene.triangle_ids().find(is_meant).unwrap();
        let surface = scene.surfaces[triangle.index()];
        assert!((surface.opacity - opacity).abs() < 1e-6, "{name}");
        assert!(
            (surface.reflectance.x - 0.5 * opacity).abs() < 1e-6,
            "{name}"
        );
    }
}

#[test]
fn specular_materials_reflect_at_most_all_light_and_survive_their_file() {
    let mtl = "newmtl bright\nKd 0.8 0.4 0.2\nKs 0.5 0.1 0.1\nNs 98\nillum 2\n\
        newmtl mirror\nKd 0.1\nKs 0.9\nillum 3\n\
        newmtl pane\nKd 0.2\nNi 1.5\nd 0.25\nillum 4\n\
        newmtl steel\nKd 0.6 0.5 0.4\nPm 1\nPr 0.5\n\
        newmtl ball\nKd 0\nNi 1.33\nTf 1 0.5 1\nillum 7\n";
    let mut obj = format!("mtllib a.mtl\n{SQUARE}");
    for (number, name) in (5..).zip(["bright", "mirror", "pane", "steel", "ball"]) {
        obj += &format!("v 0 0 {number}\nv 1 0 {number}\nv 0 1 {number}\n");
        obj += &format!("usemtl {name}\nf -3 -2 -1\n");
    }
    let folder = folder(&[("scene.obj", &obj), ("a.mtl", mtl)], &[]);
    let scene = read(&folder);
    let named = |scene: &Scene, name: &str| {
        let mut all = scene.materials.iter();
        all.find(|material| material.name == name).unwrap().clone()
    };
    // Scaled by the channel that reflects most.
    let bright = named(&scene, "bright");
    assert_near(bright.reflectance, Vec3::new(0.8, 0.4, 0.2) / 1.3, "Kd");
    let specular = bright.specular.unwrap();
    assert_near(specular.color(), Vec3::new(0.5, 0.1, 0.1) / 1.3, "Ks");
    let scaled = "Kd and Ks) that add to more than 1 were scaled to 1";
    assert!(said(&scene).iter().any(|said| said.contains(scaled)));
    let roughness = match specular {
        Specular::Gloss { roughness, .. } => roughness,
        other => panic!("{other:?}"),
    };
    assert!((roughness - 0.02_f32.sqrt()).abs() < 1e-6);
    // A pane passes what it neither reflects nor has of colour.
    let pane = named(&scene, "pane");
    let passed = 0.75 * pane.specular.unwrap().mean_transmittance();
    assert_near(pane.transmission(), Vec3::splat(passed), "pane");
    assert_near(named(&scene, "steel").reflectance, Vec3::ZERO, "steel");
    assert!(named(&scene, "ball").transmission().y < 0.5);
    // Written and read again.
    let path = folder.path().join("again.obj");
    vecrad::scene::write_obj(&scene, &path).unwrap();
    let again = read_scene(&path, &SceneOptions::default()).unwrap();
    for before in scene
        .materials
        .iter()
        .filter(|material| material.specular.is_some())
    {
        let after = named(&again, &before.name);
        assert_near(after.reflectance, before.reflectance, &before.name);
        assert_near(after.transmission(), before.transmission(), &before.name);
        let text = |material: &Material| format!("{:.3?}", material.specular);
        assert_eq!(text(&after), text(before), "{}", before.name);
    }
    // Matt, as without those statements.
    let options = SceneOptions {
        is_matt: true,
        ..SceneOptions::default()
    };
    let matt = read_scene(&folder.path().join("scene.obj"), &options).unwrap();
    assert!(!matt.has_specular());
    assert_near(
        named(&matt, "bright").reflectance,
        Vec3::new(0.8, 0.4, 0.2),
        "matt",
    );
    assert_eq!(named(&matt, "ball").opacity, 1.0);
}

/// The opacity of each material of an MTL file, all of which faces show, and what is said of them.
fn opacities(mtl: &str, options: &SceneOptions) -> (Vec<f32>, Vec<String>) {
    let mut obj = format!("mtllib a.mtl\n{SQUARE}");
    for (line, number) in mtl
        .lines()
        .filter(|line| line.starts_with("newmtl"))
        .zip(5..)
    {
        let name = line.trim_start_matches("newmtl ");
        obj += &format!("v 0 0 {number}\nv 1 0 {number}\nv 0 1 {number}\n");
        obj += &format!("usemtl {name}\nf -3/1 -2/2 -1/3\n");
    }
    let folder = folder(&[("scene.obj", &obj), ("a.mtl", mtl)], &["floor.png"]);
    let scene = read_scene(&folder.path().join("scene.obj"), options).unwrap();
    let opacities = scene.surfaces.iter().map(|surface| surface.opacity);
    (opacities.collect(), said(&scene))
}

#[test]
fn what_exporters_write_by_habit_is_no_glass() {
    let options = SceneOptions::default();
    // Invisible by the file, but most are.
    let (found, said) = opacities(
        "newmtl a\nd 0\nnewmtl b\nTr 1\nnewmtl c\nd 0.25\n",
        &options,
    );
    assert_eq!(found, [1.0, 1.0, 0.25]);
    let expected = [
        "a.mtl:5: transparent materials: 'c' (d 0.25)",
        "a.mtl:1: treated as solid: 'a' (d 0, as most materials), 'b' (Tr 1, as most materials)",
    ];
    assert_eq!(said, expected);
    // One of several, and one with a picture.
    let mtl = "newmtl a\nd 0\nnewmtl b\nd 0\nmap_Kd floor.png\nnewmtl c\nnewmtl d\n";
    let (found, said) = opacities(mtl, &options);
    assert_eq!(found, [0.0, 1.0, 1.0, 1.0]);
    assert_eq!(
        said[1],
        "a.mtl:3: treated as solid: 'b' (d 0 beside a picture)"
    );
    let opaque = SceneOptions {
        is_opaque: true,
        ..options
    };
    let (found, said) = opacities("newmtl a\nd 0.5\n", &opaque);
    assert_eq!(found, [1.0]);
    assert_eq!(
        said,
        ["a.mtl:1: treated as solid: 'a' (d 0.5, by --opaque)"]
    );
}

#[test]
fn alpha_of_a_picture_counts_as_transparency_and_hidden_colours_do_not() {
    let folder = folder(
        &[
            (
                "a.mtl",
                "newmtl Leaf\nKd 1 1 1\nmap_Kd leaf.png\nmap_Ke leaf.png\n",
            ),
            (
                "scene.obj",
                &format!("mtllib a.mtl\n{SQUARE}usemtl Leaf\nf 1/1 2/2 3/3 4/4\n"),
            ),
        ],
        &[],
    );
    // A brown column among hidden white ones.
    let leaf = image::RgbaImage::from_fn(8, 8, |x, _| match x {
        3 => image::Rgba([BROWN[0], BROWN[1], BROWN[2], 255]),
        _ => image::Rgba([255, 255, 255, 0]),
    });
    leaf.save(folder.path().join("leaf.png")).unwrap();
    let scene = read(&folder);
    let expected = "a.mtl:1: transparent materials: 'Leaf' (cut out by alpha of map_Kd)";
    assert_eq!(said(&scene), [expected]);
    for surface in &scene.surfaces {
        assert_near(
            surface.reflectance / surface.opacity,
            brown(),
            "reflectance",
        );
    }
    let opacity: f32 = scene.surfaces.iter().map(|s| s.opacity * 0.5).sum();
    assert!((opacity - 1.0 / 8.0).abs() < 0.01, "{opacity}");
    // One column of eight emits; triangles are half of the square each.
    let emission: Vec3 = scene.surfaces.iter().map(|s| s.emission * 0.5).sum();
    assert!(emission.abs_diff_eq(brown() / 8.0, 0.01), "{emission}");
}

#[test]
fn white_beside_a_brown_picture_is_no_clamped_reflectance() {
    let (_folder, scene) = textured("newmtl m\nKd 1 1 1\nmap_Kd floor.png\n", &["floor.png"]);
    assert!(said(&scene).is_empty(), "{:?}", said(&scene));
    assert_near(scene.surfaces[0].reflectance, brown(), "as it is");
    let (_folder, scene) = textured("newmtl m\nKd 1 1 1\n", &[]);
    assert_eq!(said(&scene).len(), 1);
    assert_eq!(scene.surfaces[0].reflectance, Vec3::splat(0.98));
}

#[test]
fn a_face_that_crosses_itself_is_named_with_its_line() {
    let obj = format!("{SQUARE}f 1 2 3 4\nf 1/1 3/3 2/2 4/4\n");
    let scene = read(&folder(&[("scene.obj", &obj)], &[]));
    let said = said(&scene);
    let crossing: Vec<_> = said.iter().filter(|said| said.contains("cross")).collect();
    let expected = "scene.obj:10: the edges of a face cross each other, so it is unclear what it covers; put its corners in order";
    assert_eq!(crossing, [expected]);
}
