//! The same rooms as OBJ and as glTF, and meshes in every form.

use std::{fs, sync::Arc};

use glam::{DAffine3, DQuat, DVec3, Vec3};
use serde_json::{Value, json};
use vecrad::{
    export::{LitMesh, MeshFormat, MeshOptions},
    scene::{
        Scene, SceneOptions, Sides, Surface, TriangleId, UpAxis, builtin::find_builtin, read_scene,
        write_builtin,
    },
    solver::SolveSettings,
};

use super::{
    common::{assert_close, solve},
    glb::{Glb, HALVES, SQUARE},
    read, said,
};

/// A node with a transform, and its matrix.
fn placed(number: usize) -> (Value, DAffine3) {
    let angle = 0.7 * number as f64;
    let rotation = DQuat::from_axis_angle(DVec3::new(2.0, -1.0, 2.0) / 3.0, angle);
    let scale = match number % 3 {
        0 => DVec3::new(0.5, 2.0, -1.5),
        1 => DVec3::splat(3.0),
        _ => DVec3::new(-1.0, -0.25, -1.0),
    };
    let translation = DVec3::new(1.0, -2.0, 0.5) * number as f64;
    let matrix = DAffine3::from_scale_rotation_translation(scale, rotation, translation);
    let node = match number % 2 {
        0 => json!({
            "translation": translation.to_array(),
            "rotation": rotation.to_array(),
            "scale": scale.to_array(),
        }),
        _ => json!({ "matrix": glam::DMat4::from(matrix).to_cols_array() }),
    };
    (node, matrix)
}

/// A built-in scene as glTF: a mesh for each material, under nodes that are turned, scaled and mirrored.
fn as_gltf(name: &str) -> Glb {
    let builder = find_builtin(name).unwrap().builder();
    let mut glb = Glb::new();
    for (number, material) in builder.materials.iter().enumerate() {
        let [base, emission] = [material.reflectance, material.emission].map(|c| c.to_array());
        let strongest = material.emission.max_element().max(1.0);
        glb.push(
            "materials",
            json!({
                "name": material.name,
                "doubleSided": true,
                "pbrMetallicRoughness": {
                    "baseColorFactor": [base[0], base[1], base[2], 1.0],
                    "metallicFactor": 0,
                },
                "emissiveFactor": emission.map(|channel| channel / strongest),
                "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": strongest } },
            }),
        );
        let [(outer, of_outer), (inner, of_inner)] = [placed(number), placed(number + 1)];
        let to_local = (of_outer * of_inner).inverse();
        let is_mirrored = to_local.matrix3.determinant() < 0.0;
        let faces = builder
            .faces
            .iter()
            .filter(|face| face.material.index() == number);
        let mut corners = Vec::new();
        for face in faces {
            let [a, b, c] = face.corners;
            let order = if is_mirrored { [a, c, b] } else { [a, b, c] };
            corners.extend(order.map(|corner| {
                let local = to_local.transform_point3(builder.positions[corner as usize]);
                local.as_vec3().to_array()
            }));
        }
        if corners.is_empty() {
            continue;
        }
        let positions = glb.floats(&corners);
        let part = json!({ "attributes": { "POSITION": positions }, "material": number });
        let mesh = glb.push("meshes", json!({ "primitives": [part] }));
        let mut inner = inner;
        inner["mesh"] = json!(mesh);
        let inner = glb.push("nodes", inner);
        let mut outer = outer;
        outer["children"] = json!([inner]);
        glb.root(outer);
    }
    glb
}

/// How far the corners of one triangle are from those of another, whichever of them comes first.
fn distance(one: [DVec3; 3], other: [DVec3; 3]) -> f64 {
    let turned = (0..3).map(|turn| {
        let apart = |corner: usize| (one[corner] - other[(corner + turn) % 3]).length();
        apart(0).max(apart(1)).max(apart(2))
    });
    turned.fold(f64::INFINITY, f64::min)
}

/// What counts of a triangle, its corners in world units.
fn looks(scene: &Scene, id: TriangleId) -> ([DVec3; 3], &str, bool, Surface) {
    let corners = scene.corners(id).map(|corner| scene.frame.to_world(corner));
    let is_two_sided = scene.triangles[id.index()].two_sided;
    let name = scene.material(id).name.as_str();
    (corners, name, is_two_sided, scene.surfaces[id.index()])
}

#[test]
fn a_room_is_the_same_as_obj_and_as_gltf() {
    for name in ["cornell", "plates"] {
        let folder = tempfile::tempdir().unwrap();
        let obj = write_builtin(name, folder.path()).unwrap();
        let obj = read_scene(&obj, &SceneOptions::default()).unwrap();
        let gltf = read(&as_gltf(name));
        assert_eq!(gltf.triangles.len(), obj.triangles.len(), "{name}");
        assert_close(gltf.frame.scale, obj.frame.scale, 1e-5, name);
        let extent = 100.0 / obj.frame.scale;
        for id in gltf.triangle_ids() {
            let found = looks(&gltf, id);
            let all = obj.triangle_ids().map(|id| looks(&obj, id));
            let apart = |other: &([DVec3; 3], &str, bool, Surface)| distance(found.0, other.0);
            let expected = all.min_by(|a, b| apart(a).total_cmp(&apart(b))).unwrap();
            assert!(apart(&expected) < 2e-6 * extent, "{name}: {found:?}");
            assert_eq!((found.1, found.2), (expected.1, expected.2), "{name}");
            let difference = found.3.reflectance - expected.3.reflectance;
            assert!(difference.abs().max_element() < 1e-6);
            let difference = found.3.emission - expected.3.emission;
            assert!(difference.abs().max_element() <= 1e-6 * expected.3.emission.max_element());
        }
        let said = said(&gltf);
        assert!(said.is_empty(), "{name}: {said}");
    }
}

#[test]
fn the_faces_of_a_room_of_bodies_are_the_same() {
    let room = find_builtin("room-1022").unwrap();
    let built = room.scene(&SceneOptions::default()).unwrap();
    let gltf = read(&as_gltf("room-1022"));
    assert_eq!(gltf.face_count, built.face_count);
    // Where faces cross, rounding decides into how many parts each is cut.
    for material in &built.materials {
        let area = |scene: &Scene| {
            let of_it = scene
                .triangle_ids()
                .filter(|&id| scene.material(id).name == material.name);
            let area: f32 = of_it
                .map(|id| scene.surfaces[id.index()].area_vector.length())
                .sum();
            area
        };
        assert_close(area(&gltf), area(&built), 1e-4, &material.name);
    }
}

#[test]
fn the_light_of_a_room_is_the_same_as_obj_and_as_gltf() {
    let folder = tempfile::tempdir().unwrap();
    let obj = write_builtin("cornell", folder.path()).unwrap();
    let obj = read_scene(&obj, &SceneOptions::default()).unwrap();
    let [gltf, obj] = [read(&as_gltf("cornell")), obj].map(|scene| {
        let scene = Arc::new(scene);
        let (solver, _) = solve(&scene, SolveSettings::draft());
        let snapshot = solver.snapshot();
        let light = &snapshot.light.irradiance;
        light.iter().map(|light| light.as_dvec3()).sum::<DVec3>() / light.len() as f64
    });
    for channel in 0..3 {
        assert_close(gltf[channel], obj[channel], 0.01, "mean irradiance");
    }
}

#[test]
fn strips_fans_and_lists_are_the_same_square() {
    let shapes: [(u32, &[u32]); 5] = [
        (4, &[0, 1, 2, 0, 2, 3]),
        (5, &[0, 1, 3, 2]),
        // Led on by triangles without area.
        (5, &[0, 0, 0, 1, 3, 2, 2]),
        (6, &[0, 1, 2, 3]),
        (6, &[2, 3, 0, 1]),
    ];
    for (mode, indices) in shapes {
        let mut glb = Glb::new();
        let mesh = glb.mesh(&SQUARE, indices, &json!({ "mode": mode }));
        glb.root(json!({ "mesh": mesh }));
        let scene = read(&glb);
        let area: Vec3 = scene
            .surfaces
            .iter()
            .map(|surface| surface.area_vector)
            .sum();
        let expected = Vec3::Z * (scene.frame.scale * scene.frame.scale) as f32;
        assert!(
            (area - expected).length() < 1e-3,
            "{mode} {indices:?}: {area}"
        );
        assert_eq!(scene.triangles.len(), 2, "{mode} {indices:?}");
    }
    let mut glb = Glb::new();
    for mode in [0, 1, 2, 3, 9] {
        let mesh = glb.mesh(&SQUARE, &HALVES, &json!({ "mode": mode }));
        glb.root(json!({ "mesh": mesh }));
    }
    let mesh = glb.mesh(&SQUARE, &HALVES, &json!({}));
    glb.root(json!({ "mesh": mesh }));
    let said = said(&read(&glb));
    assert!(
        said.contains("lines and points have no surface and were omitted (5 times)"),
        "{said}"
    );
}

#[test]
fn numbers_of_all_types_are_read() {
    // The square as normalised shorts, at a stride, with indices of a byte.
    let mut glb = Glb::new();
    let corners: Vec<u8> = SQUARE
        .iter()
        .flat_map(|corner| corner.map(|x| (x * 32_767.0) as i16).into_iter().chain([7]))
        .flat_map(i16::to_le_bytes)
        .collect();
    let view = glb.view(&corners);
    glb.json["bufferViews"][view]["byteStride"] = json!(8);
    let positions = json!({ "bufferView": view, "componentType": 5122, "normalized": true, "count": 4, "type": "VEC3" });
    let positions = glb.push("accessors", positions);
    let view = glb.view(&[9, 9, 0, 1, 2, 0, 2, 3]);
    let indices = json!({ "bufferView": view, "byteOffset": 2, "componentType": 5121, "count": 6, "type": "SCALAR" });
    let indices = glb.push("accessors", indices);
    let part = json!({ "attributes": { "POSITION": positions }, "indices": indices });
    let mesh = glb.push("meshes", json!({ "primitives": [part] }));
    glb.root(json!({ "mesh": mesh, "scale": [2, 2, 2] }));
    glb.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    let scene = read(&glb);
    assert_eq!(scene.triangles.len(), 2);
    assert!((scene.frame.scale - 50.0).abs() < 1e-6);
    // All zero but for two corners, which are listed.
    let mut glb = Glb::new();
    let places = glb.view(&[1, 0, 2, 0]);
    let values: Vec<u8> = [SQUARE[1], SQUARE[2]]
        .as_flattened()
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    let values = glb.view(&values);
    let positions = glb.push(
        "accessors",
        json!({
            "componentType": 5126, "count": 3, "type": "VEC3",
            "sparse": {
                "count": 2,
                "indices": { "bufferView": places, "componentType": 5123 },
                "values": { "bufferView": values },
            },
        }),
    );
    let part = json!({ "attributes": { "POSITION": positions } });
    let mesh = glb.push("meshes", json!({ "primitives": [part] }));
    glb.root(json!({ "mesh": mesh }));
    assert_eq!(read(&glb).triangles.len(), 1);
}

#[test]
fn instances_names_and_the_rest_pose() {
    let mut glb = Glb::new();
    let mesh = glb.mesh(&SQUARE, &HALVES, &json!({ "targets": [{ "POSITION": 0 }] }));
    glb.json["meshes"][mesh]["name"] = json!("square");
    for place in 0..3 {
        let name = if place == 1 { "middle" } else { "" };
        glb.root(
            json!({ "mesh": mesh, "name": name, "skin": 0, "translation": [2 * place, 0, 0] }),
        );
    }
    let scene = read(&glb);
    let objects = scene
        .objects
        .iter()
        .map(|o| (o.name.label(), o.start.0, o.end.0));
    assert_eq!(
        objects.collect::<Vec<_>>(),
        [("square", 0, 2), ("middle", 2, 4), ("square", 4, 6)]
    );
    let said = said(&scene);
    assert!(
        said.contains("in their rest pose: 'square', 'middle', 'square'"),
        "{said}"
    );
    assert_eq!(scene.up, UpAxis::Y);
}

#[test]
fn digits_are_kept_far_from_the_origin() {
    let mut glb = Glb::new();
    let mesh = glb.mesh(&SQUARE, &HALVES, &json!({}));
    glb.root(json!({ "mesh": mesh, "translation": [512_345.678_9, -5_400_000.125, 17.0], "scale": [0.1, 0.1, 0.1] }));
    let scene = read(&glb);
    let first =
        scene.frame.to_world(scene.positions[0]) - DVec3::new(512_345.678_9, -5_400_000.125, 17.0);
    assert!(first.length() < 1e-6, "{first}");
    assert!((scene.frame.scale - 1000.0).abs() < 1e-3);
}

#[test]
fn what_is_written_opens_again() {
    let folder = tempfile::tempdir().unwrap();
    let cornell = find_builtin("cornell").unwrap();
    let scene = Arc::new(
        cornell
            .scene(&SceneOptions::with_sides(Sides::One))
            .unwrap(),
    );
    let (solver, _) = solve(&scene, SolveSettings::draft());
    let snapshot = solver.snapshot();
    let path = folder.path().join("lit.glb");
    let mut bytes = Vec::new();
    let options = MeshOptions::default();
    let lit = LitMesh {
        snapshot: &snapshot,
        scene: &scene,
        harmonics: None,
        lamps: &[],
    };
    MeshFormat::Glb
        .write(&mut bytes, &path, lit, &options)
        .unwrap();
    fs::write(&path, bytes).unwrap();
    let again = read_scene(&path, &SceneOptions::default()).unwrap();
    assert!(again.face_count >= scene.face_count);
    let said = said(&again);
    for sentence in [
        "unlit materials have their light in their colours",
        "the means of their corners",
    ] {
        assert!(said.contains(sentence), "{said}");
    }
    let extent = |scene: &Scene| 100.0 / scene.frame.scale;
    assert_close(extent(&again), extent(&scene), 1e-4, "extent");
}
