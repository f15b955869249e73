//! Lightmaps against closed forms, the light of vertices, and their promises.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::{f32::consts::PI, sync::Arc};

use common::{assert_close, finish, solve};
use glam::{DVec3, Vec2, Vec3};
use vecrad::{
    export::MeshOptions,
    geometry::{RayTree, point_irradiance},
    lightmap::{Lightmap, LightmapRequest, bake_lightmap},
    picture::TexelSource,
    scene::{
        Environment, Face, Material, MaterialId, Scene, SceneBuilder, SceneOptions, Sides, Sky,
        Texture, TextureId, TriangleId, builtin, luminance,
    },
    solver::{Cancel, Snapshot, SolveSettings},
};

fn draft(scene: &Arc<Scene>) -> Snapshot {
    solve(scene, SolveSettings::draft()).0.snapshot()
}

fn bake(scene: &Scene, snapshot: &Snapshot, texels_per_unit: Option<f64>) -> Lightmap {
    let rays = RayTree::new(scene);
    let request = LightmapRequest {
        source: TexelSource {
            scene,
            rays: &rays,
            snapshot,
            seed: 1,
        },
        texels_per_unit,
    };
    bake_lightmap(&request, &|_| {}, &Cancel::default()).unwrap()
}

/// A quadrilateral by its corners, with these places of a texture at them.
fn quad(
    builder: &mut SceneBuilder,
    corners: [[f64; 3]; 4],
    places: Option<[Vec2; 4]>,
    material: MaterialId,
) {
    let corners = corners.map(|corner| builder.push_position(DVec3::from_array(corner)));
    for half in [[0, 1, 2], [0, 2, 3]] {
        builder.faces.push(Face {
            corners: half.map(|corner| corners[corner]),
            texcoords: places.map(|places| half.map(|corner| places[corner])),
            normals: None,
            material,
            line: 0,
        });
    }
}

fn grey(builder: &mut SceneBuilder, reflectance: f32) -> MaterialId {
    builder.push_material(Material::plain(
        "grey",
        Vec3::splat(reflectance),
        Vec3::ZERO,
    ))
}

/// A rectangle in the plane y from x to x + width, with z of -1…1, that faces up or down.
fn level(y: f64, x: f64, width: f64, up: bool) -> [[f64; 3]; 4] {
    let end = x + width;
    let corners = [[x, y, 1.0], [end, y, 1.0], [end, y, -1.0], [x, y, -1.0]];
    if up {
        corners
    } else {
        [corners[3], corners[2], corners[1], corners[0]]
    }
}

/// Points of a triangle.
fn points() -> impl Iterator<Item = Vec3> {
    let steps = (0..=6).flat_map(|a| (0..=6 - a).map(move |b| [a, b]));
    steps.map(|[a, b]| {
        let [x, y] = [a as f32 / 6.0, b as f32 / 6.0];
        Vec3::new(x, y, 1.0 - x - y)
    })
}

fn at(scene: &Scene, triangle: TriangleId, barycentric: Vec3) -> Vec3 {
    let [a, b, c] = scene.corners(triangle);
    a * barycentric.x + b * barycentric.y + c * barycentric.z
}

#[test]
fn a_plane_under_an_even_sky_gets_pi_everywhere() {
    let mut builder = SceneBuilder::default();
    let floor = grey(&mut builder, 0.5);
    quad(&mut builder, level(0.0, 0.0, 3.0, true), None, floor);
    let scene = builder
        .finish(&SceneOptions::with_sides(Sides::One))
        .unwrap();
    let scene = Arc::new(scene.in_environment(Environment {
        sky: Sky::Uniform(Vec3::ONE),
        sun: None,
        is_default: false,
    }));
    let map = bake(&scene, &draft(&scene), Some(10.0));
    assert_eq!(map.facts().side, 64);
    assert_eq!(map.facts().charts, 1);
    // 31 by 21 texels, the outermost on the edges, and two about them on each side.
    assert_eq!(map.facts().texels, 31 * 21);
    let lit = map
        .irradiance()
        .iter()
        .filter(|light| **light != Vec3::ZERO);
    assert_eq!(lit.clone().count(), 35 * 25);
    for light in lit {
        assert_close(luminance(*light), PI, 1e-3, "texel");
    }
}

#[test]
fn a_floor_under_a_lamp_gets_its_form_factor() {
    let mut builder = SceneBuilder::default();
    let floor = grey(&mut builder, 0.0);
    let lamp = builder.push_material(Material::plain("lamp", Vec3::ZERO, Vec3::splat(2.0)));
    quad(&mut builder, level(0.0, 0.0, 3.0, true), None, floor);
    quad(&mut builder, level(0.7, 1.0, 1.0, false), None, lamp);
    let scene = finish(builder, Sides::One);
    let map = bake(&scene, &draft(&scene), Some(40.0));
    let lamps = [2, 3].map(|triangle| scene.corners(TriangleId(triangle)));
    for triangle in [0, 1].map(TriangleId) {
        for parts in points() {
            let place = at(&scene, triangle, parts);
            let exact = lamps.map(|corners| 2.0 * PI * point_irradiance(place, Vec3::Y, corners));
            let found = map.lookup(triangle, false, parts).unwrap();
            assert_close(found.x, exact.iter().sum::<f32>(), 0.01, place);
        }
    }
}

#[test]
fn every_texel_of_a_furnace_is_alike() {
    let scene = finish(builtin::sphere_furnace(0.5, 0.5, 3), Sides::One);
    let map = bake(&scene, &draft(&scene), None);
    let lit: Vec<f32> = map
        .irradiance()
        .iter()
        .filter(|light| **light != Vec3::ZERO)
        .map(|light| luminance(*light) / PI)
        .collect();
    assert!(lit.len() > map.facts().texels);
    for light in lit {
        assert!((light - 1.0).abs() < 0.02, "{light}");
    }
    assert!(map.facts().seam_error.unwrap() < 0.005);
}

#[test]
fn charts_that_meet_in_a_flat_seam_have_the_same_light_there() {
    let mut builder = SceneBuilder::default();
    let [one, other] = [0.2, 0.7].map(|reflectance| grey(&mut builder, reflectance));
    let lamp = builder.push_material(Material::plain("lamp", Vec3::ZERO, Vec3::ONE));
    quad(&mut builder, level(0.0, 0.0, 1.5, true), None, one);
    quad(&mut builder, level(0.0, 1.5, 1.5, true), None, other);
    quad(&mut builder, level(1.0, 1.0, 1.0, false), None, lamp);
    // Half of the lamp is hidden from most places.
    let blocker = [
        [1.5, 0.5, -0.5],
        [2.0, 0.5, -0.5],
        [2.0, 0.5, 0.5],
        [1.5, 0.5, 0.5],
    ];
    quad(&mut builder, blocker, None, one);
    let scene = finish(builder, Sides::Two);
    let map = bake(&scene, &draft(&scene), Some(60.0));
    let error = map.facts().seam_error.unwrap();
    assert!(error > 0.0 && error < 0.01, "{error}");
}

#[test]
fn light_is_that_of_the_vertices_where_these_tell_it() {
    let scene = finish(
        builtin::find_builtin("cornell").unwrap().builder(),
        Sides::One,
    );
    let snapshot = solve(&scene, SolveSettings::default()).0.snapshot();
    let map = bake(&scene, &snapshot, Some(0.3));
    let facts = map.facts();
    assert!(facts.beside_vertices < 0.03, "{}", facts.beside_vertices);
    // Between the corners, where neither shadow nor contact is near, it is the same within the noise.
    let (mut apart, mut whole) = (0.0, 0.0);
    for (display, corners) in snapshot.mesh.indices.iter().enumerate() {
        let middle = corners
            .map(|vertex| snapshot.light.irradiance[vertex as usize])
            .iter()
            .sum::<Vec3>()
            / 3.0;
        let place = corners
            .map(|vertex| snapshot.mesh.positions[vertex as usize])
            .iter()
            .sum::<Vec3>()
            / 3.0;
        let triangle = TriangleId(snapshot.mesh.triangle_of[display]);
        let parts = vecrad::geometry::barycentric(place, scene.corners(triangle));
        let is_back = snapshot.mesh.is_back[display];
        let found = map.lookup(triangle, is_back, parts).unwrap();
        apart += luminance(found - middle).powi(2);
        whole += luminance(middle).powi(2);
    }
    let error = (apart / whole).sqrt();
    assert!(error < 0.05, "{error}");
}

#[test]
fn the_same_seed_gives_the_same_bits_on_any_number_of_threads() {
    let scene = finish(
        builtin::find_builtin("cornell").unwrap().builder(),
        Sides::One,
    );
    let snapshot = draft(&scene);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| bake(&scene, &snapshot, Some(0.1)))
    };
    let [one, four] = [1, 4].map(on);
    assert_eq!(one.irradiance(), four.irradiance());
    assert_eq!(one.facts(), four.facts());
}

#[test]
fn a_cancelled_lightmap_is_none() {
    let scene = finish(
        builtin::find_builtin("cornell").unwrap().builder(),
        Sides::One,
    );
    let snapshot = draft(&scene);
    let rays = RayTree::new(&scene);
    let cancel = Cancel::default();
    let request = LightmapRequest {
        source: TexelSource {
            scene: &scene,
            rays: &rays,
            snapshot: &snapshot,
            seed: 1,
        },
        texels_per_unit: None,
    };
    let told = |part: f32| {
        assert!((0.0..=1.0).contains(&part));
        cancel.cancel();
    };
    assert!(bake_lightmap(&request, &told, &cancel).is_err());
}

/// A floor under the sky whose texture coordinates are these at its corners.
fn painted(places: [Vec2; 4]) -> Arc<Scene> {
    let mut builder = SceneBuilder::default();
    builder.textures.push(Texture {
        name: "checks".to_owned(),
        width: 2,
        height: 2,
        pixels: vec![Vec3::ZERO, Vec3::ONE, Vec3::ONE, Vec3::ZERO],
        ..Texture::default()
    });
    let mut material = Material::plain("checks", Vec3::splat(0.5), Vec3::ZERO);
    material.reflectance_texture = Some(TextureId(0));
    let material = builder.push_material(material);
    quad(
        &mut builder,
        level(0.0, 0.0, 2.0, true),
        Some(places),
        material,
    );
    let scene = builder
        .finish(&SceneOptions::with_sides(Sides::One))
        .unwrap();
    Arc::new(scene.in_environment(Environment {
        sky: Sky::Uniform(Vec3::ONE),
        sun: None,
        is_default: false,
    }))
}

#[test]
fn coordinates_of_the_file_are_used_where_they_can_be() {
    let unit = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    let of = |places: [Vec2; 4]| {
        let scene = painted(places);
        let map = bake(&scene, &draft(&scene), Some(20.0));
        for triangle in [0, 1].map(TriangleId) {
            for parts in points() {
                let light = map.lookup(triangle, false, parts).unwrap();
                assert_close(light.x, PI, 1e-3, parts);
            }
        }
        map.facts().coordinates
    };
    assert_eq!(of(unit), "file");
    assert_eq!(of(unit.map(|place| 0.25 + 0.5 * place)), "file");
    for (change, factor) in [
        (0.5, 1.0),
        (0.0, 3.0),
        (0.0, 0.0),
        (f32::NAN, 1.0),
        (0.0, 1e30),
    ] {
        assert_eq!(of(unit.map(|place| factor * place + change)), "unwrapped");
    }
    // The halves lie over each other.
    assert_eq!(of([Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::X]), "unwrapped");
}

/// The two chunks of a GLB.
fn chunks(bytes: &[u8]) -> (serde_json::Value, &[u8]) {
    let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!((&bytes[..4], number(8)), (&b"glTF"[..], bytes.len()));
    let binary = 20 + number(12);
    let text = serde_json::from_slice(&bytes[20..binary]).unwrap();
    (text, &bytes[binary + 8..])
}

#[test]
fn the_mesh_shows_the_radiance_of_every_material() {
    let scene = painted([Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y]);
    let snapshot = draft(&scene);
    let map = bake(&scene, &snapshot, Some(30.0));
    let mut bytes = Vec::new();
    map.write_glb(&mut bytes, &scene, &snapshot, &MeshOptions::default())
        .unwrap();
    let (document, binary) = chunks(&bytes);
    let view = &document["bufferViews"][2];
    let number = |value: &serde_json::Value| value.as_u64().unwrap() as usize;
    let (start, length) = (number(&view["byteOffset"]), number(&view["byteLength"]));
    let picture = image::load_from_memory(&binary[start..start + length])
        .unwrap()
        .into_rgb8();
    assert_eq!(picture.width(), map.facts().side);
    // Half of what a white surface of radiance 1 sends, where the texture is white. Between the middles of its texels it is
    // blended, and a texel of the lightmap has the mean of a part of that: 188 and 0 are not quite reached.
    let bytes = picture.pixels().map(|pixel| pixel.0[0]);
    let [darkest, brightest] = [bytes.clone().min(), bytes.max()].map(Option::unwrap);
    assert!(darkest < 40, "{darkest}");
    assert!((183..=188).contains(&brightest), "{brightest}");
    let material = &document["materials"][0];
    assert_eq!(material["name"], "checks");
    assert!(material["extensions"]["KHR_materials_unlit"].is_object());
    let surface = &material["pbrMetallicRoughness"];
    assert_eq!(
        surface["baseColorFactor"],
        serde_json::json!([1.0, 1.0, 1.0, 1.0])
    );
    assert_eq!(surface["baseColorTexture"]["texCoord"], 1);
    let attributes = &document["meshes"][0]["primitives"][0]["attributes"];
    assert_ne!(attributes["TEXCOORD_0"], attributes["TEXCOORD_1"]);
    assert_eq!(document["accessors"][0]["count"], 4);
}
