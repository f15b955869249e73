//! Pictures that a material names: which are read, which are not, and that neither takes what it should not.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::{fs, path::Path, sync::Arc};

use common::solve;
use glam::{DVec3, Vec2, Vec3};
use vecrad::{
    scene::{
        Cutout, CutoutId, Material, Scene, SceneBuilder, SceneOptions, Texture, TextureId,
        TriangleId, WarningKind, Wrap, builtin, linear_from_srgb, read_scene, write_builtin,
        write_obj,
    },
    solver::{Cancel, Omitted, Snapshot, SolveSettings},
};

/// A triangle whose material names a picture.
fn read(folder: &Path, picture: &str) -> Scene {
    let obj = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3\n";
    fs::write(folder.join("scene.obj"), obj).unwrap();
    let mtl = format!("newmtl m\nKd 0.5 0.25 0.125\nmap_Kd {picture}\n");
    fs::write(folder.join("a.mtl"), mtl).unwrap();
    read_scene(&folder.join("scene.obj"), &SceneOptions::default()).unwrap()
}

/// The picture is not used, the plain colour is, and a warning at the material says why.
fn assert_refused(folder: &Path, picture: &str, why: &str) {
    let scene = read(folder, picture);
    assert!(scene.textures.is_empty(), "{picture}");
    let plain = Vec3::new(0.5, 0.25, 0.125);
    assert!(scene.surfaces[0].reflectance.abs_diff_eq(plain, 1e-6));
    let said = scene.warnings.iter();
    let said: Vec<_> = said
        .filter(|warning| warning.kind == WarningKind::TextureMissing)
        .map(ToString::to_string)
        .collect();
    assert_eq!(said.len(), 1, "{picture}: {said:?}");
    assert!(said[0].starts_with("a.mtl:1: texture '"), "{}", said[0]);
    assert!(said[0].contains(why), "{picture}: {}", said[0]);
    assert!(
        said[0].ends_with("; the plain colour is used"),
        "{}",
        said[0]
    );
}

fn save(path: &Path, side: u32) {
    let picture = image::RgbImage::from_pixel(side, side, image::Rgb([255, 0, 0]));
    picture.save(path).unwrap();
}

/// A PNG that promises so many pixels of four channels and has none.
fn png_header(width: u32, height: u32) -> Vec<u8> {
    let mut header = b"IHDR".to_vec();
    header.extend(width.to_be_bytes());
    header.extend(height.to_be_bytes());
    header.extend([8, 6, 0, 0, 0]);
    // CRC-32 of the chunk (ISO 3309), without which a reader stops before it believes the size.
    let check = header.iter().fold(u32::MAX, |check, &byte| {
        (0..8).fold(check ^ u32::from(byte), |check, _| {
            (check >> 1) ^ (0xedb8_8320 * (check & 1))
        })
    });
    let mut png = b"\x89PNG\r\n\x1a\n\0\0\0\x0d".to_vec();
    png.extend(header);
    png.extend((!check).to_be_bytes());
    png
}

/// A BMP of 24 bits that promises so many pixels and has none.
fn bmp_header(width: i32, height: i32) -> Vec<u8> {
    let mut bmp = b"BM\0\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0".to_vec();
    bmp.extend(width.to_le_bytes());
    bmp.extend(height.to_le_bytes());
    bmp.extend([1, 0, 24, 0]);
    bmp.extend([0; 24]);
    bmp
}

#[test]
fn pictures_beside_the_scene_are_read_whatever_their_ending() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::create_dir(folder.join("maps")).unwrap();
    save(&folder.join("one.png"), 1);
    save(&folder.join("maps/b c.bmp"), 3);
    fs::copy(folder.join("one.png"), folder.join("png.jpg")).unwrap();
    for picture in [
        "one.png",
        "maps/b c.bmp",
        "maps\\b c.bmp",
        "maps/../one.png",
        "C:\\Users\\me\\one.png",
        "png.jpg",
    ] {
        let scene = read(folder, picture);
        assert_eq!(
            scene.omitted_textures.constant_textures, 1,
            "{picture}: {:?}",
            scene.warnings
        );
        let red = Vec3::new(0.5, 0.0, 0.0);
        assert!(scene.surfaces[0].reflectance.abs_diff_eq(red, 1e-5));
    }
}

#[test]
fn broken_pictures_leave_the_plain_colour() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    save(&folder.join("whole.png"), 64);
    save(&folder.join("whole.bmp"), 64);
    for name in ["png", "bmp"] {
        let whole = fs::read(folder.join(format!("whole.{name}"))).unwrap();
        let cut = &whole[..whole.len() / 2];
        fs::write(folder.join(format!("cut.{name}")), cut).unwrap();
    }
    fs::write(folder.join("empty.png"), "").unwrap();
    fs::write(folder.join("words.png"), "these are words\n").unwrap();
    fs::write(
        folder.join("noise.jpg"),
        b"\xff\xd8\xff\xe0\0\x10JFIF noise",
    )
    .unwrap();
    fs::create_dir(folder.join("folder.png")).unwrap();
    assert_refused(folder, "missing.png", "was not found");
    assert_refused(folder, "folder.png", "was not found");
    for picture in [
        "cut.png",
        "cut.bmp",
        "empty.png",
        "words.png",
        "noise.jpg",
        "a.mtl",
    ] {
        assert_refused(folder, picture, "cannot be used: ");
    }
}

#[test]
fn pictures_that_promise_too_much_are_refused_before_memory_is_taken() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for (name, bytes) in [
        // A thousand million pixels: above the longest side.
        ("huge.png", png_header(100_000, 10_000)),
        ("most.png", png_header(u32::MAX >> 1, u32::MAX >> 1)),
        ("huge.bmp", bmp_header(30_000, 30_000)),
        // Just within the limits, but without a pixel.
        ("16k.png", png_header(16_384, 16_384)),
        ("16k.bmp", bmp_header(16_384, 16_384)),
        ("none.png", png_header(0, 7)),
    ] {
        fs::write(folder.join(name), bytes).unwrap();
        assert_refused(folder, name, "cannot be used: ");
    }
}

#[cfg(unix)]
#[test]
fn nothing_outside_the_folder_and_no_device_is_read() {
    use std::os::unix::fs::symlink;
    let outer = tempfile::tempdir().unwrap();
    let folder = outer.path().join("scene");
    fs::create_dir_all(folder.join("maps")).unwrap();
    save(&outer.path().join("secret.png"), 1);
    save(&folder.join("maps/inner.png"), 1);
    symlink("../secret.png", folder.join("link.png")).unwrap();
    symlink("..", folder.join("up")).unwrap();
    symlink("/dev/zero", folder.join("zero.png")).unwrap();
    symlink("loop.png", folder.join("loop.png")).unwrap();
    symlink("maps/inner.png", folder.join("good.png")).unwrap();
    let made = std::process::Command::new("mkfifo")
        .arg(folder.join("pipe.png"))
        .status();
    assert!(made.unwrap().success());
    let outside = "lies outside the folder of the OBJ file and was not read";
    let absolute = outer.path().join("secret.png");
    for picture in [
        "../secret.png",
        "maps/../../secret.png",
        "link.png",
        "up/secret.png",
        &absolute.to_string_lossy(),
    ] {
        assert_refused(&folder, picture, outside);
    }
    for picture in ["pipe.png", "zero.png", "loop.png"] {
        assert_refused(&folder, picture, "was not found");
    }
    assert_eq!(
        read(&folder, "good.png").omitted_textures.constant_textures,
        1
    );
    // The same holds for material files.
    let mtl = "newmtl m\nKd 0.1\n";
    fs::write(outer.path().join("secret.mtl"), mtl).unwrap();
    symlink("../secret.mtl", folder.join("link.mtl")).unwrap();
    let obj = "mtllib link.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n";
    fs::write(folder.join("scene.obj"), obj).unwrap();
    let scene = read_scene(&folder.join("scene.obj"), &SceneOptions::default()).unwrap();
    let said = scene.warnings[0].to_string();
    assert!(said.contains(outside), "{said}");
    assert_eq!(scene.surfaces[0].reflectance, Vec3::splat(0.5));
}

/// Two triangles of a textured square, with a line for each texture coordinate, and the corners of each in these.
fn read_square(folder: &Path, texcoords: &[[f64; 2]], faces: [[usize; 3]; 2]) -> Scene {
    let shade = |x: u32, y: u32| image::Rgb([255, 32 * x as u8, 32 * y as u8]);
    let picture = image::RgbImage::from_fn(8, 8, shade);
    picture.save(folder.join("a.png")).unwrap();
    fs::write(
        folder.join("a.mtl"),
        "newmtl m\nKd 0.5 0.5 0.5\nKe 1 1 1\nmap_Kd a.png\n",
    )
    .unwrap();
    let mut obj = "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n".to_owned();
    for [u, v] in texcoords {
        obj += &format!("vt {u} {v}\n");
    }
    for (corners, which) in [[1, 2, 3], [1, 3, 4]].into_iter().zip(faces) {
        let [a, b, c] = [0, 1, 2].map(|k| format!("{}/{}", corners[k], which[k]));
        obj += &format!("f {a} {b} {c}\n");
    }
    fs::write(folder.join("square.obj"), obj).unwrap();
    read_scene(&folder.join("square.obj"), &SceneOptions::default()).unwrap()
}

fn lit(scene: &Arc<Scene>) -> Snapshot {
    solve(scene, SolveSettings::draft()).0.snapshot()
}

/// Texture coordinates of a point of a triangle.
fn texcoord_at(scene: &Scene, triangle: TriangleId, point: Vec3) -> Vec2 {
    let [a, b, c] = scene.corners(triangle).map(Vec3::as_dvec3);
    let point = point.as_dvec3();
    let area = |a: DVec3, b: DVec3, c: DVec3| (b - a).cross(c - a);
    let whole = area(a, b, c);
    let share = |part: DVec3| (part.dot(whole) / whole.length_squared()) as f32;
    let uv = scene.texcoords[triangle.index()];
    uv[0] * share(area(point, b, c))
        + uv[1] * share(area(a, point, c))
        + uv[2] * share(area(a, b, point))
}

/// Every corner of every triangle of the display mesh shows what the scene says of that triangle there, and what is
/// shown twice is lit once.
fn assert_whole(scene: &Scene, shown: &Snapshot) {
    let (mesh, light) = (&shown.mesh, &shown.light);
    assert_eq!(mesh.texcoords.len(), mesh.positions.len());
    assert_eq!(light.irradiance.len(), mesh.positions.len());
    for (corners, &triangle) in mesh.indices.iter().zip(&mesh.triangle_of) {
        for &corner in corners {
            let told = mesh.texcoords[corner as usize];
            let wanted = texcoord_at(scene, TriangleId(triangle), mesh.positions[corner as usize]);
            assert!(
                told.abs_diff_eq(wanted, 2e-3),
                "triangle {triangle}: {told} instead of {wanted}"
            );
        }
    }
    let own = mesh.positions.len() - mesh.repeated.len();
    for (place, &repeated) in mesh.repeated.iter().enumerate() {
        let (one, other) = (own + place, repeated as usize);
        assert_eq!(mesh.positions[one], mesh.positions[other]);
        assert_eq!(mesh.normals[one], mesh.normals[other]);
        assert_eq!(mesh.reflectance[one], mesh.reflectance[other]);
        let expected = match mesh.covered.contains(&(one as u32)) {
            true => Vec3::ZERO,
            false => light.irradiance[other],
        };
        assert_eq!(light.irradiance[one], expected);
    }
}

#[test]
fn a_tiled_floor_comes_back_from_a_file_as_it_was_and_is_shown_whole() {
    let folder = tempfile::tempdir().unwrap();
    let options = SceneOptions::default();
    let path = write_builtin("tiled-room", folder.path()).unwrap();
    let read = Arc::new(read_scene(&path, &options).unwrap());
    let original = builtin::builtin("tiled-room", &options).unwrap().unwrap();
    assert_eq!(read.texcoords, original.texcoords);
    let shown = lit(&read);
    let (copies, covered) = (shown.mesh.repeated.len(), shown.mesh.covered.len());
    assert_eq!(
        copies, covered,
        "the floor has no seam but where it is covered"
    );
    assert_whole(&read, &shown);
}

#[test]
fn a_picture_that_is_cut_open_is_not_smeared_over_the_cut() {
    let folder = tempfile::tempdir().unwrap();
    // The diagonal is at u = 1 for one triangle and at u = 0 for the other.
    let texcoords = [
        [1.0, 0.0],
        [0.5, 0.0],
        [1.0, 1.0],
        [0.0, 0.0],
        [0.0, 1.0],
        [0.5, 1.0],
    ];
    let scene = Arc::new(read_square(
        folder.path(),
        &texcoords,
        [[1, 2, 3], [4, 5, 6]],
    ));
    let shown = lit(&scene);
    assert!(!shown.mesh.repeated.is_empty());
    assert_whole(&scene, &shown);
}

#[test]
fn coordinates_far_from_the_origin_keep_their_digits_and_their_neighbours() {
    let folder = tempfile::tempdir().unwrap();
    let (u, v) = (1e9 + 0.75, -3e6 + 0.125);
    let texcoords = [[u, v], [u + 0.5, v], [u + 0.5, v + 0.5], [u, v + 0.5]];
    let scene = Arc::new(read_square(
        folder.path(),
        &texcoords,
        [[1, 2, 3], [1, 3, 4]],
    ));
    let [one, other] = [scene.texcoords[0], scene.texcoords[1]];
    assert_eq!([one[0], one[2]], [other[0], other[1]], "they share an edge");
    assert_eq!(
        (one[2] - one[0], one[1] - one[0]),
        (Vec2::splat(0.5), Vec2::new(0.5, 0.0))
    );
    // Whole periods may be omitted, parts of one may not.
    assert_eq!(one[0] - one[0].floor(), Vec2::new(0.75, 0.125));
    assert!(lit(&scene).mesh.repeated.is_empty());
}

/// Names and counts of what is omitted.
fn omissions(scene: &Scene) -> Vec<(&'static str, u64)> {
    let omitted = Omitted::of(scene, &SolveSettings::draft(), &Cancel::default()).unwrap();
    omitted.iter().map(|left| (left.name, left.count)).collect()
}

#[test]
fn a_picture_of_one_colour_costs_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let color = image::Rgb([188u8, 99, 255]);
    let pixel = |name: &str, side| {
        let picture = image::RgbImage::from_pixel(side, side, color);
        picture.save(folder.join(name)).unwrap();
    };
    pixel("large.png", 300);
    pixel("small.png", 1);
    let mut spotted = image::RgbImage::from_pixel(64, 64, color);
    spotted.put_pixel(0, 63, image::Rgb([0, 0, 0]));
    spotted.save(folder.join("spotted.png")).unwrap();
    let [large, small, spotted] =
        ["large.png", "small.png", "spotted.png"].map(|picture| read(folder, picture));
    let linear = |byte: f32| ((byte / 255.0 + 0.055) / 1.055).powf(2.4);
    let expected = Vec3::new(0.5, 0.25, 0.125) * Vec3::new(188.0, 99.0, 255.0).map(linear);
    for scene in [&large, &small] {
        assert!(scene.textures.is_empty() && scene.texcoords.is_empty());
        assert!(scene.surfaces[0].reflectance.abs_diff_eq(expected, 1e-6));
        assert_eq!(
            scene.materials[0].reflectance,
            scene.surfaces[0].reflectance
        );
        assert!(omissions(scene).contains(&("constant-textures", 1)));
    }
    assert_eq!(large.surfaces, small.surfaces, "whatever the size");
    assert_eq!((spotted.textures.len(), spotted.texcoords.len()), (1, 1));
    assert!(
        omissions(&spotted)
            .iter()
            .all(|left| left.0 != "constant-textures")
    );
}

#[test]
fn pictures_that_no_face_shows_are_not_read() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("broken.png"), "no picture").unwrap();
    fs::write(
        folder.join("a.mtl"),
        "newmtl unused\nKd 0.5\nmap_Kd broken.png\nnewmtl flat\nKd 0.25\nKe 1\nmap_Kd broken.png\nmap_Ke missing.png\n",
    )
    .unwrap();
    let read = |rest: &str| {
        let path = folder.join("scene.obj");
        let obj = format!("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n{rest}\n");
        fs::write(&path, obj).unwrap();
        read_scene(&path, &SceneOptions::default()).unwrap()
    };
    // A material without faces, and one whose faces have no texture coordinates.
    let scene = read("usemtl unused\nusemtl flat\nf 1 2 3");
    let said = |scene: &Scene| {
        let warnings = scene.warnings.iter();
        let missing =
            |warning: &&vecrad::scene::Warning| warning.kind == WarningKind::TextureMissing;
        warnings.filter(missing).count()
    };
    assert_eq!(said(&scene), 0, "{:?}", scene.warnings);
    assert_eq!(scene.omitted_textures.unused_textures, 3);
    assert!(omissions(&scene).contains(&("unused-textures", 3)));
    assert_eq!(scene.surfaces[0].reflectance, Vec3::splat(0.25));
    // Once a face shows them, they are read.
    let scene = read("vt 0 0\nvt 1 0\nvt 0 1\nusemtl flat\nf 1/1 2/2 3/3");
    assert_eq!(said(&scene), 2, "{:?}", scene.warnings);
    assert_eq!(scene.omitted_textures.unused_textures, 0);
}

#[test]
fn pictures_go_on_beyond_their_edges_when_written_and_read_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.obj");
    let pixels = (0..6).map(|n| Vec3::new(0.1 * n as f32, 0.5, 0.1));
    for wrap in [
        [Wrap::Repeat; 2],
        [Wrap::Mirror; 2],
        [Wrap::Clamp; 2],
        [Wrap::Repeat, Wrap::Mirror],
        [Wrap::Mirror, Wrap::Repeat],
    ] {
        let mut cutout = Cutout::new("b.png", [3, 2], |column, row| column > row);
        cutout.wrap = wrap;
        let mut builder = SceneBuilder::default();
        builder.textures.push(Texture {
            name: "a.png".to_owned(),
            width: 3,
            height: 2,
            pixels: pixels.clone().collect(),
            wrap,
        });
        builder.cutouts.push(cutout);
        let material = builder.push_material(Material {
            emission_texture: Some(TextureId(0)),
            cutout: Some(CutoutId(0)),
            ..Material::plain("m", Vec3::ZERO, Vec3::ONE)
        });
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y].map(|corner| builder.push_position(corner));
        builder.push_triangle(corners, material);
        builder.faces[0].texcoords =
            Some([[-1.6, -1.7], [2.9, 0.3], [0.2, 2.6]].map(Vec2::from_array));
        let scene = builder.finish(&SceneOptions::default()).unwrap();
        write_obj(&scene, &path).unwrap();
        let again = read_scene(&path, &SceneOptions::default()).unwrap();
        for index in 0..200 {
            let [a, b] = [0.618 * index as f32, 0.755 * index as f32].map(f32::fract);
            let at = match a + b <= 1.0 {
                true => Vec3::new(a, b, 1.0 - a - b),
                false => Vec3::new(1.0 - a, 1.0 - b, a + b - 1.0),
            };
            let triangle = TriangleId(0);
            let [before, after] = [&scene, &again].map(|scene| {
                let (cutout, uv) = scene.see_through(triangle).unwrap().cutout.unwrap();
                let place = uv[0] * at.x + uv[1] * at.y + uv[2] * at.z;
                (scene.emission_at(triangle, at), cutout.has_at(place))
            });
            assert!((before.0 - after.0).abs().max_element() < 0.01, "{wrap:?}");
            assert_eq!(before.1, after.1, "{wrap:?} at {at}");
        }
    }
}

#[test]
fn colours_of_vertices_are_reflected_where_no_material_says_otherwise() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.obj");
    fs::write(folder.path().join("a.mtl"), "newmtl m\nKd 0.25 0.25 0.25\n").unwrap();
    let read = |colors: [&str; 4], faces: &str| {
        let places = ["0 0 0", "1 0 0", "1 1 0", "0 1 0"];
        let vertices = places.iter().zip(colors);
        let vertices: String = vertices
            .map(|(place, color)| format!("v {place} {color}\n"))
            .collect();
        fs::write(&path, format!("mtllib a.mtl\n{vertices}{faces}")).unwrap();
        let scene = read_scene(&path, &SceneOptions::default()).unwrap();
        let reflectances: Vec<Vec3> = scene.surfaces.iter().map(|s| s.reflectance).collect();
        let warnings: Vec<String> = scene.warnings.iter().map(ToString::to_string).collect();
        (reflectances, warnings.join("\n"))
    };
    let assert_near = |found: Vec3, [r, g, b]: [f32; 3]| {
        let difference = (found - Vec3::new(r, g, b)).abs().max_element();
        assert!(difference < 1e-3, "{found}");
    };
    let grey = linear_from_srgb(0.6);
    let triangles = "f 1 2 3\nf 1 3 4\n";
    // sRGB numbers of up to 1, or bytes.
    for colors in [
        ["0.6 0 0", "0.6 0 0", "0.6 0 0", "0.6 0.6 0"],
        ["153 0 0", "153 0 0", "153 0 0", "153 153 0"],
    ] {
        let (found, said) = read(colors, triangles);
        assert_near(found[0], [grey, 0.0, 0.0]);
        assert_near(found[1], [grey, grey / 3.0, 0.0]);
        assert!(!said.contains("colours"), "{said}");
    }
    // A vertex without a colour, or with one that is none, is white beside the others.
    let (found, _) = read(["0 0 0", "0 0 0", "", "0 0 nan"], triangles);
    assert_near(found[0], [1.0 / 3.0; 3]);
    assert_near(found[1], [2.0 / 3.0; 3]);
    // White everywhere says nothing, and the first vertex says whether there are colours.
    for (colors, is_told) in [(["1 1 1"; 4], false), (["", "1 0 0", "", "1 0 0"], true)] {
        let (found, said) = read(colors, triangles);
        assert_eq!(found, [Vec3::splat(0.5); 2]);
        assert_eq!(said.contains("vertex colours"), is_told, "{said}");
    }
    // A material counts more, and that is said.
    let (found, said) = read(["1 0 0"; 4], "f 1 2 3\nusemtl m\nf 1 3 4\n");
    assert_near(found[0], [0.98, 0.0, 0.0]);
    assert_eq!(found[1], Vec3::splat(0.25));
    assert!(
        said.contains("scene.obj:2: vertex colours are not used"),
        "{said}"
    );
}
