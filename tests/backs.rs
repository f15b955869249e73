//! Backs of faces: of the two sides of a face, and of two faces on one plane, one is drawn in a pixel.

#![cfg(feature = "viewer")]

mod display_scenes;
mod pictures;

use std::sync::Arc;

use glam::{DVec3, Vec3};
use image::RgbaImage;
use pictures::{assert_near, unless_no_adapter};
use vecrad::{
    export::ToneMap,
    scene::{Material, Scene, SceneBuilder, SceneOptions, Sides},
    solver::{DisplayMesh, Snapshot, VertexLight},
    viewer::{
        camera::Camera,
        headless::{self, Subject},
        view::{ViewMode, ViewSettings},
    },
};

const SIZE: [u32; 2] = [160, 160];

/// Corners of a sheet that is slanted, so that depths are rounded.
const SHEET: [[f64; 2]; 4] = [[-1.0, -0.9], [1.0, -1.1], [0.9, 1.0], [-1.1, 0.9]];

/// A scene of faces over the corners of the sheet.
fn scene(faces: &[[usize; 3]], sides: Sides) -> Arc<Scene> {
    let mut builder = SceneBuilder::default();
    let material = builder.push_material(Material::plain("sheet", Vec3::splat(0.7), Vec3::ZERO));
    let corners = SHEET.map(|[x, y]| builder.push_position(DVec3::new(x, y, 0.37 * x - 0.21 * y)));
    for face in faces {
        builder.push_triangle(face.map(|corner| corners[corner]), material);
    }
    Arc::new(
        builder
            .finish(&SceneOptions::with_sides(sides))
            .expect("a sheet"),
    )
}

fn snapshot(mesh: DisplayMesh) -> Snapshot {
    let light = vec![Vec3::splat(2.0); mesh.positions.len()];
    Snapshot {
        step: 1,
        light: Arc::new(VertexLight {
            direct: light.clone(),
            irradiance: light,
        }),
        mesh: Arc::new(mesh),
        ..Snapshot::default()
    }
}

/// The display mesh of a two-sided sheet, whose back was cut along the other diagonal than its front.
fn two_sided(scene: &Scene) -> DisplayMesh {
    let mut mesh = display_scenes::own_triangles(scene);
    let [a, b, c] = [0, 1, 2].map(|index| mesh.positions[index]);
    let d = mesh.positions[5];
    let normal = -mesh.normals[0];
    for triangle in [[a, d, b], [b, d, c]] {
        let first = mesh.positions.len() as u32;
        for corner in triangle {
            mesh.positions.push(corner);
            mesh.normals.push(normal);
            mesh.reflectance.push(Vec3::splat(0.7));
            mesh.emission.push(Vec3::ZERO);
        }
        mesh.indices.push([first, first + 1, first + 2]);
        mesh.triangle_of.push(0);
        mesh.is_back.push(true);
        mesh.element_of.push(0);
    }
    mesh
}

/// The sheet from the front or from behind, or `None` on a machine that cannot draw.
fn draw(
    scene: &Arc<Scene>,
    snapshot: &Snapshot,
    mode: ViewMode,
    backs: bool,
    from_z: f32,
) -> Option<RgbaImage> {
    let subject = Subject {
        scene,
        snapshot,
        errors: None,
        interior: None,
        is_dark: false,
    };
    let camera = Camera::looking(Vec3::new(20.0, 10.0, from_z), Vec3::ZERO, Vec3::Y);
    let view = ViewSettings {
        mode,
        backs,
        auto_exposure: false,
        tone_map: ToneMap::None,
        ..ViewSettings::default()
    };
    let drawn = unless_no_adapter(headless::picture(subject, &camera, &view, SIZE))?;
    Some(drawn.display)
}

/// The pixels that the sheet covers, well away from its edges.
fn inside(picture: &RgbaImage) -> Vec<[i32; 3]> {
    let around = 50..110;
    let pixels = picture.enumerate_pixels();
    pixels
        .filter(|(x, y, _)| around.contains(x) && around.contains(y))
        .map(|(.., pixel)| [0, 1, 2].map(|channel| i32::from(pixel.0[channel])))
        .collect()
}

#[test]
fn a_two_sided_face_shows_one_copy_in_every_pixel() {
    let scene = scene(&[[0, 1, 2], [0, 2, 3]], Sides::Two);
    let snapshot = snapshot(two_sided(&scene));
    for from_z in [130.0, -130.0] {
        let is_front = from_z > 0.0;
        let mode = ViewMode::FaceOrientation;
        let Some(oriented) = draw(&scene, &snapshot, mode, false, from_z) else {
            return;
        };
        let is_right = |[red, _, blue]: &[i32; 3]| (blue > red) == is_front;
        let wrong = inside(&oriented)
            .iter()
            .filter(|pixel| !is_right(pixel))
            .count();
        assert_eq!(wrong, 0, "pixels of the other copy, from {from_z}");
        // Backs are those of one-sided faces: here there are none.
        let lit = draw(&scene, &snapshot, ViewMode::Radiance, false, from_z).expect("drawn before");
        let with_backs = draw(&scene, &snapshot, ViewMode::Radiance, true, from_z);
        assert!(lit == with_backs.expect("drawn before"), "from {from_z}");
        assert!(inside(&lit).iter().all(|pixel| pixel[0] > 100));
    }
}

#[test]
fn of_two_faces_back_to_back_the_one_that_looks_here_is_seen() {
    // Cut along different diagonals, as a room whose backs were written as faces of their own.
    let scene = scene(&[[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]], Sides::One);
    let snapshot = snapshot(display_scenes::own_triangles(&scene));
    for from_z in [130.0, -130.0] {
        let Some(oriented) = draw(&scene, &snapshot, ViewMode::FaceOrientation, false, from_z)
        else {
            return;
        };
        let backs = inside(&oriented)
            .iter()
            .filter(|[red, _, blue]| red > blue)
            .count();
        assert_eq!(
            backs, 0,
            "both look at the viewer with their fronts, from {from_z}"
        );
        let lit = draw(&scene, &snapshot, ViewMode::Radiance, true, from_z).expect("drawn before");
        assert!(
            inside(&lit).iter().all(|pixel| pixel[0] > 100),
            "from {from_z}"
        );
    }
}

#[test]
fn the_back_of_a_one_sided_face_is_red_and_dark() {
    let scene = scene(&[[0, 1, 2], [0, 2, 3]], Sides::One);
    let snapshot = snapshot(display_scenes::own_triangles(&scene));
    let Some(oriented) = draw(&scene, &snapshot, ViewMode::FaceOrientation, false, -130.0) else {
        return;
    };
    assert!(inside(&oriented).iter().all(|[red, _, blue]| red > blue));
    let dark = draw(&scene, &snapshot, ViewMode::Radiance, true, -130.0).expect("drawn before");
    let through = draw(&scene, &snapshot, ViewMode::Radiance, false, -130.0).expect("drawn before");
    assert!(inside(&dark).iter().all(|pixel| pixel[0] < 80));
    let at = |picture: &RgbaImage, x, y| {
        let pixel = picture.get_pixel(x, y).0;
        [0, 1, 2].map(|channel| pixel[channel])
    };
    let background = at(&through, 1, 1);
    assert_near(at(&through, 80, 80), background, "looked through");
    assert_ne!(at(&dark, 80, 80), background);
}
