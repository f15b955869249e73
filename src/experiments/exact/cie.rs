//! Analytical cases of CIE 171:2006, "Test cases to assess the accuracy of lighting computer programs".
//!
//! The values are computed by the closed forms that the standard names; the tests hold them to the digits of its tables.
//! Table 19 of the standard (case 5.7) is known to be wrong; its corrected values are used.

use std::f64::consts::PI;

use glam::DVec3;

use super::{Case, Expected, Figure, Group, Spot, closed::mean_irradiance};
use crate::{
    reference::analytic::point_to_polygon,
    scene::{
        SceneBuilder,
        builtin::exact::{
            SCREEN, SCREEN_HEIGHT, cie_room_with_lamp, cie_room_with_lit_floor,
            cie_room_with_screen, cie_room_with_skylight, cube_about_ball,
        },
    },
};

/// Radiance of the lamp of case 5.3.
const LAMP: f64 = 1000.0;

/// Radiosity of lit surfaces, so that irradiance comes in percent of it.
const PERCENT: f64 = 100.0;

/// Heights of the points of walls, at x = 2 and y = 0.
const WALL: [f64; 6] = [2.75, 2.25, 1.75, 1.25, 0.75, 0.25];

/// Distances of the points of floors and ceilings from that wall, at x = 2.
const AWAY: [f64; 5] = [0.25, 0.75, 1.25, 1.75, 2.25];

pub(super) fn cases() -> Vec<Case> {
    let middle = [[1.5, 1.5], [2.5, 1.5], [2.5, 2.5], [1.5, 2.5]];
    let opening = middle.map(|[x, y]| DVec3::new(x, y, 3.0));
    let floor = [[0.0, 0.0], [0.0, 4.0], [4.0, 4.0], [4.0, 0.0]];
    let floor = floor.map(|[x, y]| DVec3::new(x, y, 0.0));
    let walls = || WALL.into_iter().map(Point::wall);
    let floors = |count: usize| AWAY.into_iter().take(count).map(Point::floor);
    let ceilings = AWAY.into_iter().take(4).map(Point::ceiling);
    let mut cases = vec![
        case(
            "5.3, area lamp in the ceiling",
            "L · π times the factor of the lamp of 1 m² and L = 1000",
            cie_room_with_lamp(LAMP as f32),
            walls().chain(floors(4)),
            |point| LAMP * PI * point.factor(&opening),
        ),
        case(
            "5.6, reflection of a lit floor",
            "100 E / M, the factor of the floor",
            cie_room_with_lit_floor(PERCENT),
            WALL[..5]
                .iter()
                .rev()
                .copied()
                .map(Point::wall)
                .chain(ceilings),
            |point| PERCENT * point.factor(&floor),
        ),
        case(
            "5.7, reflection of a lit wall behind a screen",
            "100 E / M, the factor of what is seen of the wall; Table 19 of the standard is wrong",
            cie_room_with_screen(PERCENT),
            walls().chain(floors(5)),
            |point| PERCENT * point.factor(&seen_wall(point.spot.position)),
        ),
        Case {
            sky: (PERCENT / PI) as f32,
            ..case(
                "5.9, roof opening under a uniform sky",
                "sky component in percent: the factor of the opening of 1 m²",
                cie_room_with_skylight(),
                floors(4),
                |point| PERCENT * point.factor(&opening),
            )
        },
    ];
    cases.extend([0.2, 0.5, 0.8].map(reflections));
    cases
}

/// Case 5.8, with a ball in place of the point source.
fn reflections(reflectance: f32) -> Case {
    let scene = cube_about_ball(reflectance);
    let total = mean_irradiance(&scene, f64::from(reflectance));
    Case {
        group: Group::Cie171,
        name: format!("5.8, diffuse reflections in a cube of reflectance {reflectance}"),
        basis: "mean indirect E = ρ Φ / (A (1 − ρ))",
        sky: 0.0,
        expected: vec![Expected {
            name: "mean indirect E".to_owned(),
            figure: Figure::MeanIndirect,
            value: total * f64::from(reflectance),
        }],
        scene,
    }
}

/// A point that is measured.
#[derive(Clone, Copy)]
struct Point {
    on: &'static str,
    spot: Spot,
}

impl Point {
    fn new(on: &'static str, y: f64, z: f64, normal: DVec3) -> Self {
        let position = DVec3::new(2.0, y, z);
        let spot = Spot { position, normal };
        Self { on, spot }
    }

    fn wall(z: f64) -> Self {
        Self::new("wall", 0.0, z, DVec3::Y)
    }

    fn floor(y: f64) -> Self {
        Self::new("floor", y, 0.0, DVec3::Z)
    }

    fn ceiling(y: f64) -> Self {
        Self::new("ceiling", y, 3.0, -DVec3::Z)
    }

    /// View factor to a polygon that faces into the room.
    fn factor(&self, corners: &[DVec3]) -> f64 {
        point_to_polygon(self.spot.position, self.spot.normal, corners).abs()
    }

    fn name(&self) -> String {
        let DVec3 { x, y, z } = self.spot.position;
        format!("{} {x}, {y}, {z}", self.on)
    }
}

/// The part of the wall at y = 4 that a point at x = 2 sees over the screen.
fn seen_wall(point: DVec3) -> [DVec3; 4] {
    let least = SCREEN
        .map(|edge| point.z + (SCREEN_HEIGHT - point.z) * (4.0 - point.y) / (edge - point.y))
        .into_iter()
        .fold(0.0, f64::max)
        .min(3.0);
    [[0.0, least], [0.0, 3.0], [4.0, 3.0], [4.0, least]].map(|[x, z]| DVec3::new(x, 4.0, z))
}

fn case(
    name: &str,
    basis: &'static str,
    scene: SceneBuilder,
    points: impl Iterator<Item = Point>,
    irradiance: impl Fn(&Point) -> f64,
) -> Case {
    let expected = |point: Point| Expected {
        name: point.name(),
        figure: Figure::IrradianceAt(point.spot),
        value: irradiance(&point),
    };
    Case {
        group: Group::Cie171,
        name: name.to_owned(),
        basis,
        scene,
        sky: 0.0,
        expected: points.map(expected).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closed_forms_have_the_digits_of_the_standard() {
        let tables: [(&str, &[f64]); 3] = [
            (
                "5.3",
                &[
                    32.68, 75.19, 81.32, 69.06, 53.40, 40.00, 61.42, 79.26, 95.67, 105.78,
                ],
            ),
            (
                "5.6",
                &[
                    35.901, 27.992, 21.639, 16.716, 12.967, 26.795, 30.939, 33.976, 35.567,
                ],
            ),
            (
                "5.7",
                &[
                    16.071, 16.330, 15.399, 13.322, 10.317, 7.079, 3.382, 3.629, 3.013, 0.0, 0.0,
                ],
            ),
        ];
        let cases = cases();
        for (name, table) in tables {
            let case = cases.iter().find(|case| case.name.starts_with(name));
            let expected = &case.expect("it is there").expected;
            assert_eq!(expected.len(), table.len(), "{name}");
            for (known, printed) in expected.iter().zip(table) {
                // Half a unit of the last digit.
                let allowed = if name == "5.3" { 0.00501 } else { 0.000501 };
                assert!(
                    (known.value - printed).abs() < allowed,
                    "{name}, {}: {} for {printed}",
                    known.name,
                    known.value
                );
            }
        }
    }
}
