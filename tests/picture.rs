//! Traced pictures against closed forms, the reference, and their promises.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::{f32::consts::PI, sync::Arc};

use common::{assert_close, finish, solve};
use glam::{DVec3, Vec2, Vec3};
use vecrad::{
    geometry::RayTree,
    picture::{Developed, Exposure, Lens, Subject, trace},
    reference::{BakePoint, bake},
    scene::{
        Environment, Face, Material, MaterialId, Scene, SceneBuilder, SceneOptions, Sides, Sky,
        Specular, Sun, Texture, TextureId, builtin, luminance,
    },
    solver::{Cancel, Snapshot, SolveSettings},
};

const SIZE: [u32; 2] = [64, 48];

/// A lens at a point that looks at another, with a width of the picture at the distance 1.
fn lens(eye: Vec3, target: Vec3, width: f32) -> Lens {
    let forward = (target - eye).normalize_or_zero();
    let right = forward.cross(Vec3::Y).normalize_or_zero();
    Lens {
        origin: eye,
        forward,
        right: right * (0.5 * width),
        up: right.cross(forward) * (0.5 * width * SIZE[1] as f32 / SIZE[0] as f32),
        is_parallel: false,
    }
}

/// The picture of a lit scene.
fn picture(scene: &Scene, snapshot: &Snapshot, lens: &Lens, samples: u32) -> Vec<Developed> {
    picture_unless(&Cancel::default(), scene, snapshot, lens, samples).unwrap()
}

/// The same; `None` when cancelled.
fn picture_unless(
    cancel: &Cancel,
    scene: &Scene,
    snapshot: &Snapshot,
    lens: &Lens,
    samples: u32,
) -> Option<Vec<Developed>> {
    let rays = RayTree::new(scene);
    let subject = Subject {
        scene,
        rays: &rays,
        snapshot,
        hidden: None,
        shows_backs: false,
        is_unlit: false,
    };
    let exposure = Exposure {
        size: SIZE,
        samples,
        seed: 1,
    };
    trace(&subject, lens, &exposure, cancel)
}

fn draft(scene: &Arc<Scene>) -> Snapshot {
    solve(scene, SolveSettings::draft()).0.snapshot()
}

fn pixel(picture: &[Developed], [x, y]: [u32; 2]) -> Developed {
    picture[(y * SIZE[0] + x) as usize]
}

/// A quadrilateral by its corners, with a texture across it.
fn quad(builder: &mut SceneBuilder, corners: [[f64; 3]; 4], material: MaterialId) {
    const PLACES: [Vec2; 4] = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    let corners = corners.map(|corner| builder.push_position(DVec3::from_array(corner)));
    for half in [[0, 1, 2], [0, 2, 3]] {
        builder.faces.push(Face {
            corners: half.map(|corner| corners[corner]),
            texcoords: Some(half.map(|corner| PLACES[corner])),
            normals: None,
            material,
            line: 0,
        });
    }
}

fn grey(builder: &mut SceneBuilder, reflectance: f32) -> MaterialId {
    builder.push_material(Material::plain("", Vec3::splat(reflectance), Vec3::ZERO))
}

/// A square in the plane y, with its middle on the axis, that faces up or down.
fn level(y: f64, half: f64, up: bool) -> [[f64; 3]; 4] {
    let [a, b] = [half, -half];
    let corners = [[b, y, a], [a, y, a], [a, y, b], [b, y, b]];
    if up {
        corners
    } else {
        [corners[3], corners[2], corners[1], corners[0]]
    }
}

/// A floor under a sun that stands 45° high over +X, and a black plate at the height 1 over it.
fn sundial(diameter_degrees: f32) -> Arc<Scene> {
    let mut builder = SceneBuilder::default();
    let (floor, plate) = (grey(&mut builder, 0.5), grey(&mut builder, 0.0));
    quad(&mut builder, level(0.0, 5.0, true), floor);
    quad(&mut builder, level(1.0, 0.5, false), plate);
    let scene = builder
        .finish(&SceneOptions::with_sides(Sides::Two))
        .unwrap();
    Arc::new(scene.in_environment(Environment {
        sky: Sky::Dark,
        sun: Some(Sun {
            direction: Vec3::new(1.0, 1.0, 0.0).normalize_or_zero(),
            irradiance: Vec3::splat(2.0),
            diameter: diameter_degrees.to_radians(),
        }),
        is_default: false,
    }))
}

/// The direction through the middle of a pixel.
fn through(lens: &Lens, [x, y]: [u32; 2]) -> Vec3 {
    let place = Vec2::new(
        2.0 * (x as f32 + 0.5) / SIZE[0] as f32 - 1.0,
        1.0 - 2.0 * (y as f32 + 0.5) / SIZE[1] as f32,
    );
    lens.forward + lens.right * place.x + lens.up * place.y
}

/// The place on the plane y = 0 of the file that a pixel shows the middle of.
fn on_floor(scene: &Scene, lens: &Lens, at: [u32; 2]) -> Vec2 {
    let direction = through(lens, at);
    let floor = scene.frame.from_world(DVec3::ZERO);
    let at = lens.origin + direction * ((floor.y - lens.origin.y) / direction.y);
    let at = scene.frame.to_world(at);
    Vec2::new(at.x as f32, at.z as f32)
}

#[test]
fn every_pixel_of_a_furnace_is_alike() {
    let scene = finish(builtin::furnace(0.5, 0.5, 4), Sides::One);
    let lens = lens(Vec3::ZERO, Vec3::new(1.0, 0.3, 0.7), 1.5);
    for pixel in picture(&scene, &draft(&scene), &lens, 16) {
        let found = luminance(pixel.radiance());
        assert!((found - 1.0).abs() < 0.015, "{found}");
    }
}

/// A furnace of radiance 1 with a cube in it.
fn furnace_about(specular: Specular, opacity: f32) -> Arc<Scene> {
    let mut builder = builtin::furnace(0.5, 0.5, 4);
    let cube = builder.push_material(Material {
        opacity,
        specular: Some(specular),
        ..Material::plain("cube", Vec3::ZERO, Vec3::ZERO)
    });
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let corner = |across: f64, up: f64| {
                let mut at = DVec3::splat(0.5);
                at[axis] += 0.15 * side;
                at[(axis + 1) % 3] += 0.15 * across * side;
                at[(axis + 2) % 3] += 0.15 * up;
                at.to_array()
            };
            let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
            quad(
                &mut builder,
                corners.map(|(across, up)| corner(across, up)),
                cube,
            );
        }
    }
    finish(builder, Sides::Auto)
}

#[test]
fn mirrors_gloss_and_glass_do_not_show_in_a_furnace() {
    let reflectance = Vec3::ONE;
    let glass = |is_thin| Specular::Glass {
        index: 1.5,
        is_thin,
    };
    for (specular, opacity, tolerance) in [
        (Specular::Mirror { reflectance }, 1.0, 0.02),
        (glass(true), 0.0, 0.02),
        (glass(false), 0.0, 0.03),
        // Facets that hide each other take some light.
        (
            Specular::Gloss {
                reflectance,
                roughness: 0.15,
            },
            1.0,
            0.06,
        ),
    ] {
        let scene = furnace_about(specular, opacity);
        let eye = scene.frame.from_world(DVec3::new(0.1, 0.8, 0.15));
        let lens = lens(eye, scene.frame.from_world(DVec3::splat(0.5)), 1.2);
        let picture = picture(&scene, &draft(&scene), &lens, 16);
        let light: Vec<f32> = picture
            .iter()
            .map(|pixel| luminance(pixel.radiance()))
            .collect();
        let mean = light.iter().sum::<f32>() / light.len() as f32;
        assert_close(mean, 1.0, tolerance, format_args!("{specular:?}"));
        let most = light.iter().copied().fold(0.0, f32::max);
        assert!(most < 1.2, "{specular:?}: a speck of {most}");
        // Rays that end between facing sides of glass are few.
        let dark = light.iter().filter(|light| **light < 0.7).count();
        assert!(dark < 30, "{specular:?}: {dark} dark pixels");
    }
}

#[test]
fn a_mirror_shows_what_it_faces() {
    // A floor of two colours before an upright mirror, seen over it.
    let mut builder = SceneBuilder::default();
    let (near, far) = (grey(&mut builder, 0.8), grey(&mut builder, 0.2));
    let mirror = builder.push_material(Material {
        specular: Some(Specular::Mirror {
            reflectance: Vec3::splat(0.5),
        }),
        ..Material::plain("mirror", Vec3::ZERO, Vec3::ZERO)
    });
    for (z, material) in [(0.0, near), (1.0, far)] {
        let corners = [
            [-2.0, 0.0, z + 1.0],
            [2.0, 0.0, z + 1.0],
            [2.0, 0.0, z],
            [-2.0, 0.0, z],
        ];
        quad(&mut builder, corners, material);
    }
    let corners = [
        [-2.0, 0.0, 0.0],
        [2.0, 0.0, 0.0],
        [2.0, 2.0, 0.0],
        [-2.0, 2.0, 0.0],
    ];
    quad(&mut builder, corners, mirror);
    let scene = builder
        .finish(&SceneOptions::with_sides(Sides::One))
        .unwrap();
    let scene = Arc::new(scene.in_environment(Environment::default_sky()));
    let snapshot = draft(&scene);
    let eye = scene.frame.from_world(DVec3::new(0.0, 1.5, 3.0));
    let at = |picture: &[Developed]| luminance(pixel(picture, [32, 24]).radiance());
    // Straight at the floor, and at its image.
    for z in [0.5, 1.5] {
        let look = |z: f64| {
            let target = scene.frame.from_world(DVec3::new(0.01, 0.0, z));
            at(&picture(&scene, &snapshot, &lens(eye, target, 0.02), 16))
        };
        let (floor, image) = (look(z), look(-z));
        assert_close(image, 0.5 * floor, 0.03, z);
    }
}

#[test]
fn a_hard_shadow_ends_where_the_light_does() {
    let scene = sundial(0.0001);
    let eye = scene.frame.from_world(DVec3::new(0.0, 4.0, 6.0));
    let lens = lens(eye, scene.frame.from_world(DVec3::new(-1.0, 0.0, 0.0)), 0.6);
    let picture = picture(&scene, &draft(&scene), &lens, 16);
    let lit = 0.5 / PI * 2.0 * 0.5_f32.sqrt();
    let (mut in_light, mut in_shadow) = (0, 0);
    for at in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| [x, y])) {
        let place = on_floor(&scene, &lens, at);
        // At the height of the plate the rays are a quarter of their way from the floor.
        let above = place.lerp(Vec2::new(0.0, 6.0), 0.25);
        if above.abs().max_element() < 0.7 {
            continue;
        }
        // The shadow of the plate lies one unit beside it.
        let place = place + Vec2::X;
        let outside = place.abs().max_element() - 0.5;
        let found = luminance(pixel(&picture, at).surfaces);
        // Pixels are up to 0.15 wide.
        if outside > 0.2 {
            in_light += 1;
            assert_close(found, lit, 0.01, place);
        } else if outside < -0.2 {
            in_shadow += 1;
            assert!(found < 0.01 * lit, "{found} at {place}");
        }
    }
    assert!(in_light > 1000 && in_shadow > 30, "{in_light} {in_shadow}");
}

#[test]
fn a_penumbra_is_smooth_and_right() {
    // A sun of 20°: half a unit behind the edge of the plate it is hidden by the part of its disc beyond the edge.
    let scene = sundial(20.0);
    let eye = scene.frame.from_world(DVec3::new(-1.5, 6.0, 0.01));
    let lens = lens(eye, scene.frame.from_world(DVec3::new(-1.5, 0.0, 0.0)), 0.2);
    let picture = picture(&scene, &draft(&scene), &lens, 16);
    let lit = 0.5 / PI * 2.0 * 0.5_f32.sqrt();
    let (mut squares, mut count) = (0.0, 0);
    for at in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| [x, y])) {
        let place = on_floor(&scene, &lens, at);
        // Seen from there, the plate's far edge is at this elevation, and ends beyond the disc to both sides.
        let edge = (1.0 / (-0.5 - place.x)).atan().to_degrees();
        let above = ((45.0 - edge) / 10.0).clamp(-1.0, 1.0);
        if place.y.abs() > 0.2 {
            continue;
        }
        // The part of a disc on one side of a line, weighted evenly: the cosine differs little.
        let hidden = 0.5 - (above * (1.0 - above * above).sqrt() + above.asin()) / PI;
        let found = luminance(pixel(&picture, at).radiance()) / lit;
        squares += (found - (1.0 - hidden)).powi(2);
        count += 1;
    }
    let error = (squares / count as f32).sqrt();
    assert!(count > 300 && error < 0.03, "{error} of {count}");
}

#[test]
fn textures_show_in_detail() {
    let mut builder = SceneBuilder::default();
    builder.textures.push(Texture {
        name: String::new(),
        width: 64,
        height: 1,
        pixels: (0..64)
            .map(|x| if x < 32 { Vec3::X } else { Vec3::Y })
            .collect(),
        ..Texture::default()
    });
    let painted = builder.push_material(Material {
        reflectance_texture: Some(TextureId(0)),
        ..Material::plain("", Vec3::splat(0.8), Vec3::ZERO)
    });
    quad(&mut builder, level(0.0, 1.0, true), painted);
    let scene = builder.finish(&SceneOptions::default()).unwrap();
    let scene = Arc::new(scene.in_environment(Environment::default_sky()));
    let eye = scene.frame.from_world(DVec3::new(0.0, 3.0, 0.001));
    let lens = lens(eye, Vec3::ZERO, 0.5);
    let picture = picture(&scene, &draft(&scene), &lens, 16);
    for (x, expected) in [(20, Vec3::X), (44, Vec3::Y)] {
        let found = pixel(&picture, [x, 24]).radiance();
        assert!(found.abs_diff_eq(expected * 0.8, 0.02), "{found}");
    }
}

#[test]
fn edges_are_covered_in_part() {
    let mut builder = SceneBuilder::default();
    let floor = grey(&mut builder, 0.5);
    quad(&mut builder, level(0.0, 1.0, true), floor);
    let scene = builder.finish(&SceneOptions::default()).unwrap();
    let scene = Arc::new(scene.in_environment(Environment::default_sky()));
    let eye = scene.frame.from_world(DVec3::new(0.3, 3.0, 0.001));
    let lens = lens(eye, scene.frame.from_world(DVec3::new(0.3, 0.0, 0.0)), 1.0);
    let picture = picture(&scene, &draft(&scene), &lens, 64);
    // A square of 2 units seen in a width of 3: the part of the picture that it covers.
    let covered: f32 = picture
        .iter()
        .map(|pixel| 1.0 - pixel.background_part)
        .sum();
    let expected = (2.0 / 3.0) * (2.0 / (3.0 * SIZE[1] as f32 / SIZE[0] as f32));
    assert_close(covered / picture.len() as f32, expected, 0.005, "covered");
    // The radiance is that of the covered part alone.
    for pixel in picture.iter().filter(|pixel| pixel.surface_part() > 0.0) {
        assert_close(luminance(pixel.surfaces), 0.5, 0.02, "radiance");
    }
}

#[test]
fn pictures_agree_with_path_tracing() {
    let scene = finish(
        builtin::find_builtin("cornell").unwrap().builder(),
        Sides::One,
    );
    let rays = RayTree::new(&scene);
    let eye = scene.frame.from_world(DVec3::new(278.0, 273.0, -800.0));
    let target = scene.frame.from_world(DVec3::new(180.0, 120.0, 280.0));
    let lens = lens(eye, target, 0.5);
    let snapshot = solve(&scene, SolveSettings::normal()).0.snapshot();
    let picture = picture(&scene, &snapshot, &lens, 16);
    // What the middles of pixels show, each as far from its edges as its neighbours.
    let mut points = Vec::new();
    let mut shown = Vec::new();
    for at in (2..SIZE[1] - 2)
        .step_by(3)
        .flat_map(|y| (2..SIZE[0] - 2).step_by(3).map(move |x| [x, y]))
    {
        let hit = |at: [u32; 2]| {
            let direction = through(&lens, at).normalize_or_zero();
            let hit = rays.closest(eye, direction, None)?;
            let normal = scene.surfaces[hit.triangle.index()]
                .area_vector
                .normalize_or_zero();
            (normal.dot(direction) < 0.0).then_some((hit, eye + direction * hit.distance, normal))
        };
        let [x, y] = at;
        let around = [
            [x - 1, y - 1],
            [x + 1, y - 1],
            [x - 1, y + 1],
            [x + 1, y + 1],
        ];
        let Some((met, position, normal)) = hit(at) else {
            continue;
        };
        let is_flat = around
            .iter()
            .all(|&at| hit(at).is_some_and(|(_, _, other)| other == normal));
        if is_flat && scene.surfaces[met.triangle.index()].emission == Vec3::ZERO {
            points.push(BakePoint {
                position,
                normal,
                triangle: met.triangle,
            });
            let reflectance = scene.surfaces[met.triangle.index()].reflectance;
            shown.push(luminance(
                pixel(&picture, at).surfaces / reflectance.max(Vec3::splat(1e-3)),
            ));
        }
    }
    let truth = bake(&scene, &rays, &points, 4096, 3, &|| false).unwrap();
    let truth: Vec<f32> = truth.iter().map(|light| luminance(*light) / PI).collect();
    let mean = truth.iter().sum::<f32>() / truth.len() as f32;
    let error = |(shown, truth): (&f32, &f32)| ((shown - truth) / mean).powi(2);
    let squares: f32 = shown.iter().zip(&truth).map(error).sum();
    let rms = (squares / shown.len() as f32).sqrt();
    assert!(shown.len() > 100 && rms < 0.02, "{rms} of {}", shown.len());
}

#[test]
fn pictures_are_the_same_on_any_number_of_threads() {
    let scene = sundial(5.0);
    let snapshot = draft(&scene);
    let eye = scene.frame.from_world(DVec3::new(0.0, 4.0, 6.0));
    let lens = lens(eye, Vec3::ZERO, 0.8);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build()
            .unwrap()
            .install(|| picture(&scene, &snapshot, &lens, 16))
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn a_cancelled_picture_is_none() {
    let scene = sundial(1.0);
    let snapshot = draft(&scene);
    let lens = lens(Vec3::Y * 100.0, Vec3::X, 1.0);
    let cancel = Cancel::default();
    cancel.cancel();
    assert!(picture_unless(&cancel, &scene, &snapshot, &lens, 16).is_none());
}
