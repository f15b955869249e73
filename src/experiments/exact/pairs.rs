//! Two surfaces in black surroundings: squares and discs.

use std::f64::consts::PI;

use glam::DVec3;

use super::{Case, Expected, Figure, Group, Spot};
use crate::{
    reference::analytic::{
        coaxial_discs, parallel_rectangles, perpendicular_rectangles, point_to_parallel_disc,
        point_to_polygon,
    },
    scene::{
        SceneBuilder,
        builtin::{exact::discs, perpendicular_plates, plates},
    },
};

/// Radiosity of the emitter of a pair of plates.
const PLATES: f64 = 3.0 * PI;

/// Radii of receiving and emitting disc, whose distance is 1.
const RADII: [f64; 2] = [1.0, 0.5];

pub(super) fn cases() -> Vec<Case> {
    let square = |axis: DVec3, origin: DVec3| {
        [
            origin,
            origin + axis,
            origin + axis + DVec3::Z,
            origin + DVec3::Z,
        ]
    };
    let opposed = square(DVec3::X, DVec3::Y);
    let upright = square(DVec3::Y, DVec3::ZERO);
    let to = |corners: [DVec3; 4]| {
        move |x: f64, z: f64| {
            PLATES * point_to_polygon(DVec3::new(x, 0.0, z), DVec3::Y, &corners).abs()
        }
    };
    vec![
        case(
            "parallel squares",
            "Howell C-11; at points Lambert's polygon",
            plates(1.0),
            PLATES * parallel_rectangles(1.0, 1.0, 1.0),
            &[[0.5, 0.5], [0.25, 0.25], [0.5, 0.1], [0.1, 0.1]],
            to(opposed),
        ),
        case(
            "perpendicular squares",
            "Howell C-14; at points Lambert's polygon",
            perpendicular_plates(),
            PLATES * perpendicular_rectangles(1.0, 1.0, 1.0),
            &[
                [0.05, 0.5],
                [0.1, 0.5],
                [0.25, 0.5],
                [0.5, 0.5],
                [0.9, 0.5],
                [0.25, 0.1],
            ],
            to(upright),
        ),
        case(
            "coaxial discs",
            "Howell C-41; at points B-12",
            discs(RADII),
            PI * coaxial_discs(RADII[0], RADII[1], 1.0),
            &[
                [0.0, 0.0],
                [0.25, 0.0],
                [0.5, 0.0],
                [0.75, 0.0],
                [0.95, 0.0],
            ],
            |x, z| PI * point_to_parallel_disc(x.hypot(z), RADII[1], 1.0),
        ),
    ]
}

/// A case of a receiver in the plane y = 0, its mean and points of it by x and z.
fn case(
    name: &str,
    basis: &'static str,
    scene: SceneBuilder,
    mean: f64,
    points: &[[f64; 2]],
    irradiance: impl Fn(f64, f64) -> f64,
) -> Case {
    let mean = Expected {
        name: "mean E of the receiver".to_owned(),
        figure: Figure::MeanOf("receiver"),
        value: mean,
    };
    let at = |&[x, z]: &[f64; 2]| Expected {
        name: format!("receiver {x}, 0, {z}"),
        figure: Figure::IrradianceAt(Spot {
            position: DVec3::new(x, 0.0, z),
            normal: DVec3::Y,
        }),
        value: irradiance(x, z),
    };
    Case {
        group: Group::Pairs,
        name: name.to_owned(),
        basis,
        scene,
        sky: 0.0,
        expected: std::iter::once(mean).chain(points.iter().map(at)).collect(),
    }
}
