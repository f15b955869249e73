//! Rectangles and boxes for unit tests.

use glam::{DVec3, Vec3};

use super::{Material, MaterialId, Scene, SceneBuilder, SceneOptions, Sides};

/// A builder with one material of reflectance ½ that emits nothing, and one that is black and emits a radiance of 1.
pub(crate) fn builder() -> (SceneBuilder, MaterialId, MaterialId) {
    let mut builder = SceneBuilder::default();
    let wall = builder.push_material(Material::plain("wall", Vec3::splat(0.5), Vec3::ZERO));
    let lamp = builder.push_material(Material::plain("lamp", Vec3::ZERO, Vec3::ONE));
    (builder, wall, lamp)
}

/// Add a rectangle from a corner along two edges; its front is where these turn counter-clockwise.
pub(crate) fn rectangle(
    builder: &mut SceneBuilder,
    corner: DVec3,
    [first, second]: [DVec3; 2],
    paint: MaterialId,
) {
    let corners = [
        corner,
        corner + first,
        corner + first + second,
        corner + second,
    ];
    let [a, b, c, d] = corners.map(|corner| builder.push_position(corner));
    builder.push_triangle([a, b, c], paint);
    builder.push_triangle([a, c, d], paint);
}

/// Add sides of a box, lit inside or outside: by axis the lower and the upper one, as far as `has_side` says.
pub(crate) fn cuboid(
    builder: &mut SceneBuilder,
    [low, high]: [DVec3; 2],
    is_inward: bool,
    has_side: impl Fn(usize) -> bool,
    paint: MaterialId,
) {
    for side in (0..6).filter(|&side| has_side(side)) {
        let (axis, is_upper) = (side / 2, side % 2 == 1);
        let [u, v] =
            [(axis + 1) % 3, (axis + 2) % 3].map(|other| DVec3::AXES[other] * (high - low)[other]);
        let corner = match is_upper {
            true => low + DVec3::AXES[axis] * (high - low)[axis],
            false => low,
        };
        // Counter-clockwise from outside, the upper side goes along u, then v.
        let edges = match is_upper != is_inward {
            true => [u, v],
            false => [v, u],
        };
        rectangle(builder, corner, edges, paint);
    }
}

/// The scene with the fronts lit.
pub(crate) fn one_sided(builder: SceneBuilder) -> Scene {
    let options = SceneOptions::with_sides(Sides::One);
    builder.finish(&options).expect("the faces are usable")
}
