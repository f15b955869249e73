//! A small room for textures: a tiled floor, a poster, a patterned light.

use glam::{DVec3, Vec2, Vec3};

use super::palette::{plain, push_texture, textured};
use super::pictures;
use super::shapes::{Facing, Side, cuboid, lattice_box, painted_cuboid};
use crate::scene::{Material, SceneBuilder};

const XS: [f64; 4] = [0.0, 1.1, 1.9, 3.0];
const YS: [f64; 3] = [0.0, 1.25, 2.5];
const ZS: [f64; 5] = [0.0, 1.2, 2.0, 2.8, 4.0];

pub(super) fn tiled_room() -> SceneBuilder {
    let mut builder = SceneBuilder::default();
    let wall = plain(&mut builder, "wall", [0.72, 0.7, 0.66]);
    let side_wall = plain(&mut builder, "side wall", [0.3, 0.42, 0.5]);
    let wood = plain(&mut builder, "wood", [0.5, 0.32, 0.18]);
    let tiles = pictures::stone_tiles(
        "tiles.png",
        Vec3::new(0.86, 0.8, 0.7),
        Vec3::new(0.5, 0.3, 0.24),
    );
    let floor = textured(&mut builder, "tiles", tiles);
    let poster = textured(&mut builder, "poster", pictures::landscape("poster.png"));
    let panel = push_texture(&mut builder, pictures::light_panel("panel.png"));
    let light = builder.push_material(Material {
        emission_texture: Some(panel),
        ..Material::plain("light", Vec3::splat(0.6), Vec3::splat(22.0))
    });

    lattice_box([&XS, &YS, &ZS], Facing::Inward, |side, centre| {
        let is_middle = (XS[1]..XS[2]).contains(&centre.x) && (ZS[2]..ZS[3]).contains(&centre.z);
        Some(match side {
            Side::Top if is_middle => light,
            Side::Bottom => floor,
            Side::Left | Side::Right => side_wall,
            _ => wall,
        })
    })
    .textured(floor, |p| Vec2::new(p.x as f32, p.z as f32) * 0.5)
    .textured(light, |p| {
        Vec2::new((p.x - XS[1]) as f32, (p.z - ZS[2]) as f32) / 0.8
    })
    .add_to(&mut builder, "room");
    let corner = DVec3::new(0.8, 0.9, 3.96);
    painted_cuboid(corner, DVec3::new(2.2, 1.95, 4.01), |side| {
        if side == Side::Near { poster } else { wood }
    })
    .textured(poster, |p| {
        Vec2::new((2.2 - p.x) as f32 / 1.4, (p.y - corner.y) as f32 / 1.05)
    })
    .add_to(&mut builder, "poster");
    let (low, high) = (DVec3::new(0.3, -0.005, 2.2), DVec3::new(0.9, 0.5, 2.9));
    cuboid(low, high, wood).add_to(&mut builder, "chest");
    builder
}
