//! A room for mirrors, gloss and glass: a mirror as one wall, a polished floor, a sphere of glass, a pot of metal with leaves.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3, Vec2, Vec3};

use super::palette::{glowing, plain, push_texture};
use super::pictures;
use super::shapes::{Facing, Mesh, Side, cuboid, geodesic_sphere, lathe, lattice_box};
use crate::scene::{Cutout, CutoutId, Material, MaterialId, SceneBuilder, Specular};

const XS: [f64; 4] = [0.0, 1.3, 2.3, 3.6];
const YS: [f64; 3] = [0.0, 1.3, 2.6];
const ZS: [f64; 5] = [0.0, 1.4, 2.2, 3.0, 4.2];

/// Where the plant stands.
const PLANT: DVec3 = DVec3::new(2.75, 0.0, 3.3);

/// Leaves of the plant.
const LEAVES: usize = 14;

pub(super) fn glossy() -> SceneBuilder {
    let mut builder = SceneBuilder::default();
    let wall = plain(&mut builder, "wall", [0.7, 0.68, 0.64]);
    let red = plain(&mut builder, "red wall", [0.55, 0.16, 0.12]);
    let wood = plain(&mut builder, "wood", [0.5, 0.32, 0.18]);
    let light = glowing(&mut builder, "light", [16.0, 14.5, 12.0]);
    let mut specular = |name: &str, reflectance: f32, specular: Specular| {
        builder.push_material(Material {
            specular: Some(specular),
            ..Material::plain(name, Vec3::splat(reflectance), Vec3::ZERO)
        })
    };
    let mirror = specular(
        "mirror",
        0.0,
        Specular::Mirror {
            reflectance: Vec3::ONE,
        },
    );
    let metal = specular(
        "brass",
        0.0,
        Specular::Gloss {
            reflectance: Vec3::new(1.0, 0.78, 0.4),
            roughness: 0.2,
        },
    );
    let floor = polished_tiles(&mut builder);
    let glass = builder.push_material(Material {
        opacity: 0.0,
        specular: Some(Specular::Glass {
            index: 1.5,
            is_thin: false,
        }),
        ..Material::plain("glass", Vec3::ZERO, Vec3::ZERO)
    });
    let leaf = leaf_material(&mut builder);

    lattice_box([&XS, &YS, &ZS], Facing::Inward, |side, centre| {
        let is_middle = (XS[1]..XS[2]).contains(&centre.x) && (ZS[2]..ZS[3]).contains(&centre.z);
        Some(match side {
            Side::Top if is_middle => light,
            Side::Bottom => floor,
            Side::Left => mirror,
            Side::Right => red,
            _ => wall,
        })
    })
    .textured(floor, |p| Vec2::new(p.x as f32, p.z as f32) * 0.5)
    .add_to(&mut builder, "room");
    let (low, high) = (DVec3::new(0.9, -0.005, 2.5), DVec3::new(1.7, 0.45, 3.3));
    cuboid(low, high, wood).add_to(&mut builder, "chest");
    let centre = DVec3::new(1.3, 0.455 + 0.32, 2.9);
    geodesic_sphere(20, glass)
        .moved(|p| centre + p * 0.32)
        .add_to(&mut builder, "sphere");
    let profile = [
        (0.13, 0.0),
        (0.17, 0.1),
        (0.19, 0.22),
        (0.18, 0.34),
        (0.15, 0.34),
        (0.15, 0.3),
    ];
    let profile = profile.map(glam::DVec2::from);
    lathe(&profile, 40, metal, |_, _| 1.0)
        .moved(|p| PLANT + p - DVec3::Y * 0.005)
        .add_to(&mut builder, "pot");
    leaves(leaf).add_to(&mut builder, "leaves");
    builder
}

/// Tiles under a thin polish.
fn polished_tiles(builder: &mut SceneBuilder) -> MaterialId {
    let tiles = pictures::stone_tiles(
        "floor.png",
        Vec3::new(0.82, 0.78, 0.72),
        Vec3::new(0.36, 0.32, 0.34),
    );
    let texture = push_texture(builder, tiles);
    builder.push_material(Material {
        reflectance_texture: Some(texture),
        specular: Some(Specular::Gloss {
            reflectance: Vec3::splat(0.2),
            roughness: 0.06,
        }),
        ..Material::plain("polished tiles", Vec3::splat(0.75), Vec3::ZERO)
    })
}

/// Leaves cut out of cards.
fn leaf_material(builder: &mut SceneBuilder) -> MaterialId {
    let cutout = Cutout::new("leaf.png", [64, 128], |column, row| {
        let across = (column as f32 + 0.5) / 32.0 - 1.0;
        let along = (row as f32 + 0.5) / 128.0;
        across.abs() < (along * std::f32::consts::PI).sin().powf(0.8) * (1.1 - 0.5 * along)
    });
    builder.cutouts.push(cutout);
    builder.push_material(Material {
        cutout: Some(CutoutId(builder.cutouts.len() as u32 - 1)),
        ..Material::plain("leaf", Vec3::new(0.16, 0.42, 0.1), Vec3::ZERO)
    })
}

/// Cards about the plant, each bent once.
fn leaves(material: MaterialId) -> Mesh {
    let mut all = Mesh::default();
    for number in 0..LEAVES {
        let turn = DQuat::from_rotation_y(number as f64 * TAU * 0.382);
        let height = number as f64 / LEAVES as f64;
        let (reach, rise) = (0.55 - 0.2 * height, 0.12 + 0.5 * height);
        let middle = DVec3::new(0.45 * reach, rise, 0.0);
        let end = DVec3::new(reach, 0.75 * rise, 0.0);
        let mut leaf = Mesh::default();
        let stations = [(DVec3::ZERO, 0.0), (middle, 0.5), (end, 1.0)];
        for (at, _) in stations {
            for side in [-0.07, 0.07] {
                let at = at + DVec3::new(0.02, 0.0, side);
                leaf.vertex(PLANT + DVec3::Y * 0.3 + turn * at);
            }
        }
        leaf.quad([0, 1, 3, 2], material);
        leaf.quad([2, 3, 5, 4], material);
        let along = |corner: u32| stations[corner as usize / 2].1 as f32;
        for face in &mut leaf.faces {
            let uv = |corner: u32| Vec2::new((corner % 2) as f32, along(corner));
            face.texcoords = Some(face.corners.map(uv));
        }
        all.append(leaf);
    }
    all
}
