//! Small scenes with known light, made in the tests that need them.

#![allow(dead_code, reason = "each test uses some of it")]

use glam::{DVec3, Vec3};
use vecrad::scene::{Material, MaterialId, Scene, SceneBuilder, SceneOptions, Sides};

/// Collects rectangles in world coordinates.
#[derive(Default)]
pub(crate) struct Plates {
    builder: SceneBuilder,
}

impl Plates {
    /// Add a grey material.
    pub(crate) fn material(&mut self, reflectance: f32, emission: f32) -> MaterialId {
        let [reflectance, emission] = [reflectance, emission].map(Vec3::splat);
        self.builder
            .push_material(Material::plain("", reflectance, emission))
    }

    /// Add a black pane: all but the part `opacity` of the light passes.
    pub(crate) fn pane(&mut self, opacity: f32) -> MaterialId {
        self.builder.push_material(Material {
            opacity,
            ..Material::plain("", Vec3::ZERO, Vec3::ZERO)
        })
    }

    /// Add a rectangle of `2 n²` triangles; its front shows along `u × v`.
    pub(crate) fn rectangle(
        &mut self,
        origin: DVec3,
        u: DVec3,
        v: DVec3,
        n: u32,
        material: MaterialId,
    ) {
        let corner = |i: u32, j: u32| {
            origin + u * (f64::from(i) / f64::from(n)) + v * (f64::from(j) / f64::from(n))
        };
        for i in 0..n {
            for j in 0..n {
                let square = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
                    .map(|(i, j)| self.builder.push_position(corner(i, j)));
                let [a, b, c, d] = square;
                self.builder.push_triangle([a, b, c], material);
                self.builder.push_triangle([a, c, d], material);
            }
        }
    }

    /// Add a unit cube seen from inside, six walls in the order -x +x -y +y -z +z.
    pub(crate) fn room(&mut self, n: u32, materials: [MaterialId; 6]) {
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
        let walls = [
            (DVec3::ZERO, y, z),
            (x, z, y),
            (DVec3::ZERO, z, x),
            (y, x, z),
            (DVec3::ZERO, x, y),
            (z, y, x),
        ];
        for ((origin, u, v), material) in walls.into_iter().zip(materials) {
            self.rectangle(origin, u, v, n, material);
        }
    }

    /// The scene, with all faces of these sides.
    pub(crate) fn finish(self, sides: Sides) -> Scene {
        let options = SceneOptions::with_sides(sides);
        self.builder
            .finish(&options)
            .expect("the plates are usable")
    }
}

/// Whether to go on: tests are never cancelled.
pub(crate) fn never() -> bool {
    false
}
