//! The Cornell box: corners as measured by the Program of Computer Graphics, Cornell University, in millimetres.
//! The light is cut into the ceiling and the two blocks are welded into the floor, so that nothing overlaps.
//! Colours are the published spectra brought to linear RGB.

use glam::{DVec2, DVec3, Vec3};

use super::shapes::{Mesh, triangulated};
use crate::scene::{Material, MaterialId, SceneBuilder};

const CEILING: f64 = 548.8;
const DEPTH: f64 = 559.2;
/// The light in (x, z), counter-clockwise.
const LIGHT: [DVec2; 4] = [
    DVec2::new(213.0, 227.0),
    DVec2::new(343.0, 227.0),
    DVec2::new(343.0, 332.0),
    DVec2::new(213.0, 332.0),
];

/// A block that stands on the floor: its outline in (x, z), counter-clockwise, and its height.
struct Block {
    name: &'static str,
    outline: [DVec2; 4],
    height: f64,
}

const BLOCKS: [Block; 2] = [
    Block {
        name: "short block",
        outline: [
            DVec2::new(130.0, 65.0),
            DVec2::new(290.0, 114.0),
            DVec2::new(240.0, 272.0),
            DVec2::new(82.0, 225.0),
        ],
        height: 165.0,
    },
    Block {
        name: "tall block",
        outline: [
            DVec2::new(423.0, 247.0),
            DVec2::new(472.0, 406.0),
            DVec2::new(314.0, 456.0),
            DVec2::new(265.0, 296.0),
        ],
        height: 330.0,
    },
];

pub(super) fn cornell() -> SceneBuilder {
    room_with(&BLOCKS)
}

/// The Cornell box without its blocks, in which nothing casts a shadow.
pub fn empty_cornell() -> SceneBuilder {
    let mut builder = room_with(&[]);
    "empty-cornell".clone_into(&mut builder.source.name);
    builder
}

fn room_with(blocks: &[Block]) -> SceneBuilder {
    let mut builder = SceneBuilder::default();
    let mut paint = |name: &str, reflectance: [f32; 3], emission: [f32; 3]| {
        builder.push_material(Material::plain(
            name,
            Vec3::from_array(reflectance),
            Vec3::from_array(emission),
        ))
    };
    let white = paint("white", [0.725, 0.71, 0.68], [0.0; 3]);
    let red = paint("red", [0.63, 0.065, 0.05], [0.0; 3]);
    let green = paint("green", [0.14, 0.45, 0.091], [0.0; 3]);
    let light = paint("light", [0.78, 0.78, 0.78], [18.4, 15.6, 8.0]);

    floor(blocks, white).add_to(&mut builder, "floor");
    ceiling(white).add_to(&mut builder, "ceiling");
    plane(&LIGHT, &[], CEILING, false, light).add_to(&mut builder, "light");
    for (name, material, corners) in [
        (
            "back wall",
            white,
            [
                [549.6, 0.0, DEPTH],
                [0.0, 0.0, DEPTH],
                [0.0, CEILING, DEPTH],
                [556.0, CEILING, DEPTH],
            ],
        ),
        (
            "right wall",
            green,
            [
                [0.0, 0.0, DEPTH],
                [0.0, 0.0, 0.0],
                [0.0, CEILING, 0.0],
                [0.0, CEILING, DEPTH],
            ],
        ),
        (
            "left wall",
            red,
            [
                [552.8, 0.0, 0.0],
                [549.6, 0.0, DEPTH],
                [556.0, CEILING, DEPTH],
                [556.0, CEILING, 0.0],
            ],
        ),
    ] {
        let mut mesh = Mesh::default();
        let corners = corners.map(|corner| mesh.vertex(DVec3::from_array(corner)));
        mesh.quad(corners, material);
        mesh.add_to(&mut builder, name);
    }
    for block in blocks {
        block_mesh(block, white).add_to(&mut builder, block.name);
    }
    builder
}

/// The floor with a hole under each block.
fn floor(blocks: &[Block], material: MaterialId) -> Mesh {
    let outline = [(0.0, 0.0), (552.8, 0.0), (549.6, DEPTH), (0.0, DEPTH)];
    let mut corners: Vec<DVec2> = outline.map(DVec2::from).to_vec();
    let mut holes = Vec::new();
    for block in blocks {
        holes.push(corners.len() as u32);
        corners.extend(block.outline);
    }
    plane(&corners, &holes, 0.0, true, material)
}

/// The ceiling with a hole for the light.
fn ceiling(material: MaterialId) -> Mesh {
    let outline = [(0.0, 0.0), (556.0, 0.0), (556.0, DEPTH), (0.0, DEPTH)];
    let mut corners: Vec<DVec2> = outline.map(DVec2::from).to_vec();
    corners.extend(LIGHT);
    plane(&corners, &[4], CEILING, false, material)
}

/// A level polygon with holes, given in (x, z).
fn plane(corners: &[DVec2], holes: &[u32], y: f64, faces_up: bool, material: MaterialId) -> Mesh {
    let mut mesh = Mesh::default();
    for corner in corners {
        mesh.vertex(DVec3::new(corner.x, y, corner.y));
    }
    for [a, b, c] in triangulated(corners, holes) {
        // Counter-clockwise in (x, z) is clockwise seen from above.
        mesh.triangle(if faces_up { [c, b, a] } else { [a, b, c] }, material);
    }
    mesh
}

/// Top and sides; the floor has a hole in place of the bottom.
fn block_mesh(block: &Block, material: MaterialId) -> Mesh {
    let mut mesh = plane(&block.outline, &[], block.height, true, material);
    for corner in block.outline {
        mesh.vertex(DVec3::new(corner.x, 0.0, corner.y));
    }
    for i in 0..4 {
        let next = (i + 1) % 4;
        mesh.quad([i, next, next + 4, i + 4], material);
    }
    mesh
}
