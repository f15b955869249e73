//! Materials of glTF files, a table of each kind.

use glam::Vec3;
use serde_json::{Value, json};
use vecrad::scene::{
    Material, Scene, SceneOptions, Specular, TriangleId, linear_from_srgb, read_scene,
};

use super::{
    glb::{Glb, HALVES, SQUARE},
    read, said,
};

/// The material of the only square of a scene.
fn material(stated: Value) -> (Material, Scene) {
    let mut glb = Glb::new();
    glb.square(stated, 0.0);
    let scene = read(&glb);
    (scene.material(TriangleId(0)).clone(), scene)
}

fn assert_near(found: Vec3, expected: impl Into<Vec3>, what: &Value) {
    let expected = expected.into();
    assert!(
        (found - expected).abs().max_element() < 1e-6,
        "{what}: {found} for {expected}"
    );
}

#[test]
fn colours_and_emission() {
    for (stated, reflectance, emission) in [
        (
            json!({ "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.25, 0.1, 1], "metallicFactor": 0 } }),
            [0.5, 0.25, 0.1],
            [0.0; 3],
        ),
        // Rough metal is diffuse.
        (
            json!({ "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.25, 0.1, 1] } }),
            [0.5, 0.25, 0.1],
            [0.0; 3],
        ),
        (
            json!({ "emissiveFactor": [1, 0.5, 0] }),
            [0.98; 3],
            [1.0, 0.5, 0.0],
        ),
        (
            json!({
                "emissiveFactor": [1, 0.5, 0],
                "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 30 } },
            }),
            [0.98; 3],
            [30.0, 15.0, 0.0],
        ),
        (
            json!({
                "pbrMetallicRoughness": { "baseColorFactor": [0.2, 0.2, 0.2, 1], "roughnessFactor": 0 },
                "extensions": { "KHR_materials_unlit": {} },
            }),
            [0.2; 3],
            [0.0; 3],
        ),
        (
            json!({
                "extensions": { "KHR_materials_pbrSpecularGlossiness": {
                    "diffuseFactor": [0.4, 0.2, 0.2, 1], "specularFactor": [0.1, 0.2, 0.5], "glossinessFactor": 0.05,
                } },
            }),
            [0.2, 0.1, 0.1],
            [0.0; 3],
        ),
    ] {
        let (material, scene) = material(stated.clone());
        assert_near(material.reflectance, reflectance, &stated);
        assert_near(material.emission * scene.radiance_unit, emission, &stated);
        assert_eq!(material.specular, None, "{stated}");
    }
    // Where no material is stated.
    let mut glb = Glb::new();
    let mesh = glb.mesh(&SQUARE, &HALVES, &json!({}));
    glb.root(json!({ "mesh": mesh }));
    assert_eq!(read(&glb).surfaces[0].reflectance, Vec3::splat(0.5));
}

#[test]
fn metal_gloss_and_glass() {
    let painted = |metal: f32, roughness: f32| {
        json!({ "pbrMetallicRoughness": {
            "baseColorFactor": [0.6, 0.4, 0.2, 1], "metallicFactor": metal, "roughnessFactor": roughness,
        } })
    };
    let base = Vec3::new(0.6, 0.4, 0.2);
    let gloss = |reflectance: Vec3, roughness: f32| Specular::Gloss {
        reflectance,
        roughness,
    };
    for (metal, roughness, diffuse, specular) in [
        (0.0, 0.5, base, gloss(Vec3::splat(0.04), 0.25)),
        (1.0, 0.5, Vec3::ZERO, gloss(base, 0.25)),
        (1.0, 0.0, Vec3::ZERO, Specular::Mirror { reflectance: base }),
        (
            0.5,
            0.5,
            base * 0.5,
            gloss(Vec3::splat(0.04).lerp(base, 0.5), 0.25),
        ),
    ] {
        let stated = painted(metal, roughness);
        let (material, _) = material(stated.clone());
        assert_near(material.reflectance, diffuse, &stated);
        let found = material.specular.unwrap();
        assert_near(found.color(), specular.color(), &stated);
        match (found, specular) {
            (Specular::Gloss { roughness: a, .. }, Specular::Gloss { roughness: b, .. }) => {
                assert!((a - b).abs() < 1e-6);
            }
            _ => assert_eq!(found, specular),
        }
    }
    let mut index = painted(0.0, 0.5);
    index["extensions"] = json!({ "KHR_materials_ior": { "ior": 2.0 } });
    assert_near(
        material(index.clone()).0.specular.unwrap().color(),
        Vec3::splat(1.0 / 9.0),
        &index,
    );
    for (volume, is_thin) in [
        (json!({}), true),
        (json!({ "thicknessFactor": 0.1 }), false),
    ] {
        let (glass, _) = material(json!({
            "pbrMetallicRoughness": { "baseColorFactor": [0.9, 1, 0.9, 1], "metallicFactor": 0, "roughnessFactor": 0 },
            "extensions": {
                "KHR_materials_transmission": { "transmissionFactor": 0.75 },
                "KHR_materials_ior": { "ior": 1.4 },
                "KHR_materials_volume": volume,
            },
        }));
        assert_eq!(
            glass.specular,
            Some(Specular::Glass {
                index: 1.4,
                is_thin
            })
        );
        assert_eq!(
            (glass.opacity, glass.filter),
            (0.25, Vec3::new(0.9, 1.0, 0.9))
        );
    }
}

#[test]
fn means_of_roughness_and_metal_are_taken_from_textures() {
    let mut glb = Glb::new();
    let texture = glb.picture(2, &[[0, 255, 0, 255], [0, 153, 255, 255]]);
    glb.square(
        json!({ "name": "steel", "pbrMetallicRoughness": {
            "baseColorFactor": [0.5, 0.5, 0.5, 1], "roughnessFactor": 0.5,
            "metallicRoughnessTexture": { "index": texture },
        } }),
        0.0,
    );
    let scene = read(&glb);
    let material = scene.material(TriangleId(0));
    let Some(Specular::Gloss {
        roughness,
        reflectance,
    }) = material.specular
    else {
        panic!("{material:?}");
    };
    assert!(
        (roughness - 0.16).abs() < 1e-3 && (reflectance.x - 0.27).abs() < 1e-3,
        "{material:?}"
    );
    assert!((material.reflectance.x - 0.25).abs() < 1e-3);
    let said = said(&scene);
    assert!(
        said.contains("taken by their means in these materials: 'steel'"),
        "{said}"
    );
}

#[test]
fn textures_multiply_colours() {
    let mut glb = Glb::new();
    let texture = glb.halves([[255; 4], [0, 0, 0, 255]]);
    let info = json!({ "index": texture, "extensions": {
        // Only the left half.
        "KHR_texture_transform": { "offset": [0.125, 0], "scale": [0.25, 1] },
    } });
    let stated = |info: &Value| {
        json!({
            "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.5, 0.25, 1], "baseColorTexture": info },
            "emissiveFactor": [1, 1, 1],
            "emissiveTexture": info,
            "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 8 } },
        })
    };
    glb.square(stated(&info), 0.0);
    glb.square(stated(&json!({ "index": texture })), 1.0);
    let scene = read(&glb);
    let [left, whole] = [0, 2].map(|first: usize| {
        let [a, b] = [first, first + 1].map(|at| &scene.surfaces[at]);
        [
            (a.reflectance + b.reflectance) * 0.5,
            (a.emission + b.emission) * 0.5,
        ]
    });
    assert!(
        (left[0] - Vec3::new(0.5, 0.5, 0.25)).abs().max_element() < 1e-4,
        "{left:?}"
    );
    assert!((left[1] - 8.0).abs().max_element() < 1e-3, "{left:?}");
    assert!(
        (whole[0] - Vec3::new(0.25, 0.25, 0.125))
            .abs()
            .max_element()
            < 5e-3,
        "{whole:?}"
    );
    assert!((whole[1] - 4.0).abs().max_element() < 0.08, "{whole:?}");
}

#[test]
fn bytes_are_srgb_and_v_points_down() {
    let mut glb = Glb::new();
    // Top row grey, bottom row black; the square shows only its lower half, then only its upper one.
    let texture = glb.picture(
        1,
        &[
            [188, 188, 188, 255],
            [188, 188, 188, 255],
            [0, 0, 0, 255],
            [0, 0, 0, 255],
        ],
    );
    for (offset, expected) in [(0.3, linear_from_srgb(188.0 / 255.0)), (0.7, 0.0)] {
        let info = json!({ "index": texture, "extensions": {
            "KHR_texture_transform": { "offset": [0, offset], "scale": [1, 0.001] },
        } });
        glb.square(
            json!({ "pbrMetallicRoughness": { "baseColorTexture": info } }),
            offset as f32,
        );
        let scene = read(&glb);
        let last = scene.surfaces.last().unwrap().reflectance;
        assert!(
            (last - expected).abs().max_element() < 1e-4,
            "{offset}: {last}"
        );
    }
}

#[test]
fn alpha_is_ignored_cuts_or_veils() {
    let half = [[255, 255, 255, 102], [255, 255, 255, 153]];
    let veil = [[255, 255, 255, 51], [255, 255, 255, 102]];
    for (mode, cutoff, factor, pixels, opacity) in [
        ("OPAQUE", None, 0.5, half, 1.0),
        ("MASK", None, 1.0, half, 0.5),
        ("MASK", Some(0.3), 1.0, half, 1.0),
        ("MASK", Some(0.25), 0.5, half, 0.5),
        ("MASK", Some(0.9), 1.0, half, 0.0),
        ("MASK", None, 0.4, half, 0.0),
        ("BLEND", None, 1.0, half, 0.5),
        ("BLEND", None, 0.5, half, 0.25),
        ("BLEND", None, 1.0, veil, 0.3),
        ("BLEND", None, 0.5, veil, 0.15),
    ] {
        let mut glb = Glb::new();
        let texture = glb.halves(pixels);
        let mut stated = json!({
            "alphaMode": mode,
            "doubleSided": true,
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.5, 0.5, 0.5, factor],
                "baseColorTexture": { "index": texture },
            },
        });
        if let Some(cutoff) = cutoff {
            stated["alphaCutoff"] = json!(cutoff);
        }
        glb.square(stated, 0.0);
        glb.square(json!({}), 1.0);
        let scene = read(&glb);
        let found = 0.5 * (scene.surfaces[0].opacity + scene.surfaces[1].opacity);
        assert!(
            (found - opacity).abs() < 0.01,
            "{mode} {cutoff:?} {factor}: {found}"
        );
        let of_white = 0.5 * (scene.surfaces[0].reflectance.x + scene.surfaces[1].reflectance.x);
        assert!(
            (of_white - 0.5 * opacity).abs() < 0.01,
            "{mode} {cutoff:?} {factor}: {of_white}"
        );
        let is_told = said(&scene).contains("transparent materials: 'material 0'");
        assert_eq!(is_told, opacity < 1.0, "{mode} {cutoff:?} {factor}");
    }
    let mut glb = Glb::new();
    glb.square(json!({ "alphaMode": "BLEND", "pbrMetallicRoughness": { "baseColorFactor": [1, 1, 1, 0.25] } }), 0.0);
    let folder = tempfile::tempdir().unwrap();
    let options = SceneOptions {
        is_opaque: true,
        ..SceneOptions::default()
    };
    let scene = read_scene(&glb.write(folder.path()), &options).unwrap();
    assert_eq!(scene.surfaces[0].opacity, 1.0);
    let scene = read(&glb);
    assert_eq!(
        (scene.surfaces[0].opacity, scene.triangles[0].two_sided),
        (0.25, true)
    );
}

#[test]
fn sides_are_those_of_the_material() {
    for (is_double, expected) in [(false, false), (true, true)] {
        let (_, scene) = material(json!({ "doubleSided": is_double }));
        assert_eq!(scene.triangles[0].two_sided, expected);
    }
}

#[test]
fn vertex_colours_are_those_of_faces() {
    let mut glb = Glb::new();
    // The first triangle is red and the second one blue; the third runs from black to white.
    let corners = [
        [SQUARE[0], SQUARE[1], SQUARE[2]].as_slice(),
        &[SQUARE[0], SQUARE[2], SQUARE[3]],
        &[[5.0, 0.0, 0.0], [6.0, 0.0, 0.0], [5.0, 1.0, 0.0]],
    ]
    .concat();
    let colors = [
        [[1.0, 0.0, 0.0, 1.0]; 3],
        [[0.0, 0.0, 1.0, 1.0]; 3],
        [
            [0.0, 0.0, 0.0, 1.0],
            [0.6, 0.6, 0.6, 1.0],
            [0.9, 0.9, 0.9, 1.0],
        ],
    ];
    let colors = glb.floats(colors.as_flattened());
    let material = glb.push(
        "materials",
        json!({ "pbrMetallicRoughness": { "baseColorFactor": [0.5, 1, 0.8, 1] } }),
    );
    let more = json!({ "attributes": { "COLOR_0": colors }, "material": material });
    let mesh = glb.mesh(&corners, &[0, 1, 2, 3, 4, 5, 6, 7, 8], &more);
    glb.root(json!({ "mesh": mesh, "name": "flag" }));
    let scene = read(&glb);
    for (surface, expected) in
        scene
            .surfaces
            .iter()
            .zip([[0.5, 0.0, 0.0], [0.0, 0.0, 0.8], [0.25, 0.5, 0.4]])
    {
        let difference = surface.reflectance - Vec3::from_array(expected);
        assert!(
            difference.abs().max_element() < 1e-3,
            "{:?}",
            surface.reflectance
        );
    }
    let told = said(&scene);
    assert!(
        told.contains("the means of their corners, on these meshes: 'flag'"),
        "{told}"
    );
    // White ones change nothing, and beside textures they are left out.
    for (color, is_told) in [([1.0; 3], false), ([0.5; 3], true)] {
        let mut glb = Glb::new();
        let texture = glb.picture(2, &[[90, 90, 90, 255], [0, 0, 0, 255]]);
        let colors = glb.floats(&[color; 4]);
        glb.square(
            json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": texture } } }),
            0.0,
        );
        glb.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(colors);
        let told = said(&read(&glb));
        assert_eq!(
            told.contains("vertex colours of meshes with textures were left out"),
            is_told,
            "{told}"
        );
    }
}

#[test]
fn textures_go_on_beyond_their_edges_as_samplers_say() {
    // Half grey and half black, on a square that shows three times the width of the picture.
    let (grey, black) = ([188, 188, 188, 255], [0, 0, 0, 255]);
    let row = [[grey; 16], [black; 16]].concat();
    for (wraps, expected) in [
        (json!({}), 0.5),
        (json!({ "wrapS": 10_497 }), 0.5),
        (json!({ "wrapS": 33_648 }), 0.5),
        (json!({ "wrapT": 33_071 }), 0.5),
        (json!({ "wrapS": 33_071, "wrapT": 33_648 }), 1.0 / 6.0),
    ] {
        let mut glb = Glb::new();
        let texture = glb.picture(32, &row);
        let sampler = glb.push("samplers", wraps.clone());
        glb.json["textures"][texture]["sampler"] = json!(sampler);
        let transform = json!({ "KHR_texture_transform": { "scale": [3, 1] } });
        let scaled = json!({ "index": texture, "extensions": transform });
        glb.square(
            json!({ "pbrMetallicRoughness": { "baseColorTexture": scaled } }),
            0.0,
        );
        let scene = read(&glb);
        let found: f32 = scene
            .surfaces
            .iter()
            .map(|surface| surface.reflectance.x)
            .sum();
        let found = found / scene.surfaces.len() as f32 / linear_from_srgb(188.0 / 255.0);
        assert!((found - expected).abs() < 0.03, "{found} for {wraps}");
    }
}

#[test]
fn what_cannot_be_held_is_said() {
    let mut glb = Glb::new();
    let texture = glb.picture(2, &[[90, 90, 90, 255], [0, 0, 0, 255]]);
    let broken = glb.push("images", json!({ "uri": "data:image/png;base64,AAAA" }));
    let broken = glb.push("textures", json!({ "source": broken }));
    let webp = glb.push("textures", json!({}));
    let scaled =
        json!({ "index": texture, "extensions": { "KHR_texture_transform": { "scale": [2, 2] } } });
    glb.square(
        json!({ "name": "a", "pbrMetallicRoughness": { "baseColorTexture": scaled } }),
        0.0,
    );
    glb.square(
        json!({
            "name": "b",
            "pbrMetallicRoughness": { "baseColorTexture": { "index": texture } },
            "emissiveFactor": [1, 1, 1],
            "emissiveTexture": { "index": texture, "texCoord": 1 },
        }),
        1.0,
    );
    glb.square(
        json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": broken } } }),
        2.0,
    );
    glb.square(
        json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": webp } } }),
        3.0,
    );
    glb.square(
        json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 99 } } }),
        4.0,
    );
    let other_set = json!({ "index": texture, "texCoord": 5 });
    glb.square(
        json!({ "name": "f", "pbrMetallicRoughness": { "baseColorTexture": other_set } }),
        5.0,
    );
    glb.json["extensionsUsed"] = json!([
        "KHR_materials_clearcoat",
        "KHR_texture_transform",
        "EXT_x\u{1b}"
    ]);
    let scene = read(&glb);
    let said = said(&scene);
    for sentence in [
        "extensions that are not followed: 'KHR_materials_clearcoat', 'EXT_x\u{fffd}'",
        "so its mean is used for these materials: 'b'",
        "texture 'picture 1' cannot be used:",
        "texture '2' has no picture in PNG or JPEG",
        "texture '99' has no picture in PNG or JPEG",
        "without the texture coordinates of their textures",
    ] {
        assert!(said.contains(sentence), "{sentence}:\n{said}");
    }
    // The mean of the emissive texture, and of the one without coordinates.
    let mean = 0.5 * linear_from_srgb(90.0 / 255.0);
    let of = |name: &str| {
        scene
            .materials
            .iter()
            .find(|material| material.name == name)
            .unwrap()
    };
    assert!((of("b").emission.x - mean).abs() < 1e-4);
    assert!((of("f").reflectance.x - mean).abs() < 1e-4);
}
