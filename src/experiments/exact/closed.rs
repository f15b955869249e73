//! Closed scenes, in which light is the same everywhere or known on average.

use std::f64::consts::PI;

use glam::DVec3;

use super::{Case, Expected, Figure, Group, Spot};
use crate::{
    reference::analytic::sphere_irradiance,
    scene::{
        Material, SceneBuilder,
        builtin::{
            Builtin,
            exact::{concentric_spheres, even_court, patterned_sphere, with_one_reflectance},
            find_builtin,
        },
    },
};

/// Rows of triangles of spheres. Fewer, and light between flat neighbours, which is none, is missed in the closed form:
/// facets see no part of their own, a share of 1 / (20 · rows²) of the sphere.
const FREQUENCY: u32 = 12;

/// Reflectance of the scenes with one.
const ONE: f32 = 0.6;

pub(super) fn cases() -> Vec<Case> {
    let mut cases = vec![patterned(), spheres(), even()];
    cases.extend(find_builtin("room-1022").map(one_reflectance));
    cases
}

fn one_reflectance(room: &Builtin) -> Case {
    let scene = with_one_reflectance(room.builder(), ONE);
    let irradiance = mean_irradiance(&scene, f64::from(ONE));
    Case {
        group: Group::Closed,
        name: format!("one reflectance, {}", room.name),
        basis: "mean E = Φ / (A (1 − ρ))",
        scene,
        sky: 0.0,
        expected: vec![mean(Figure::MeanOfAll, "all surfaces", irradiance)],
    }
}

fn patterned() -> Case {
    let scene = patterned_sphere(FREQUENCY);
    let reflected = mean_of(&scene, |material| f64::from(material.reflectance.x));
    let irradiance = sphere_irradiance(emitted(&scene), reflected);
    Case {
        group: Group::Closed,
        name: "sphere with a pattern".to_owned(),
        basis: "E = (Σ M A / A) / (1 − Σ ρ A / A) everywhere",
        sky: 0.0,
        expected: ["cap", "belt", "rest"]
            .map(|name| mean(Figure::MeanOf(name), name, irradiance))
            .into(),
        scene,
    }
}

fn spheres() -> Case {
    // With M = 1 for the ball: B₁ = 1 + ½ B₂, B₂ = 0.8 (¼ B₁ + ¾ B₂), so that B₁ = 4/3 and B₂ = 2/3.
    let (inner, outer) = (2.0 / 3.0, (2.0 / 3.0) / 0.8);
    Case {
        group: Group::Closed,
        name: "concentric spheres".to_owned(),
        basis: "radii 1 : 2, reflectances 0.5 and 0.8, M = 1 inside: radiosities 4/3 and 2/3",
        scene: concentric_spheres(FREQUENCY),
        sky: 0.0,
        expected: vec![
            mean(Figure::MeanOf("inner"), "inner sphere", inner),
            mean(Figure::MeanOf("outer"), "outer sphere", outer),
        ],
    }
}

fn even() -> Case {
    let points = [
        ("floor", [0.3, 0.3, 0.0], DVec3::Z),
        ("floor under the block", [0.8, 1.2, 0.0], DVec3::Z),
        ("wall", [2.0, 1.2, 0.7], -DVec3::X),
        ("wall beside the block", [0.8, 2.0, 0.7], -DVec3::Y),
        ("wall under the sky", [1.5, 0.0, 1.9], DVec3::Y),
        ("corner", [1.99, 0.01, 0.0], DVec3::Z),
        ("block", [0.5, 1.2, 0.7], -DVec3::X),
        ("under the block", [0.8, 1.2, 0.4], -DVec3::Z),
        ("on the block", [0.8, 1.2, 1.0], DVec3::Z),
    ];
    let at = |(on, position, normal): (&str, [f64; 3], DVec3)| {
        let [x, y, z] = position;
        Expected {
            name: format!("L of {on} {x}, {y}, {z}"),
            figure: Figure::RadianceAt(Spot {
                position: position.into(),
                normal,
            }),
            value: 1.0,
        }
    };
    Case {
        group: Group::Closed,
        name: "constant radiance".to_owned(),
        basis: "surfaces of emission 1 − ρ under a sky of radiance 1: L = 1 everywhere",
        scene: even_court(),
        sky: 1.0,
        expected: points.into_iter().map(at).collect(),
    }
}

fn mean(figure: Figure, of: &str, value: f64) -> Expected {
    Expected {
        name: format!("mean E of {of}"),
        figure,
        value,
    }
}

/// Mean irradiance of a closed scene of one reflectance below 1: `Φ / (A (1 − ρ))`.
pub(super) fn mean_irradiance(scene: &SceneBuilder, reflectance: f64) -> f64 {
    emitted(scene) / (1.0 - reflectance)
}

/// Emitted power per area.
fn emitted(scene: &SceneBuilder) -> f64 {
    mean_of(scene, |material| PI * f64::from(material.emission.x))
}

/// Area-weighted mean of a quantity of materials.
fn mean_of(scene: &SceneBuilder, quantity: impl Fn(&Material) -> f64) -> f64 {
    let (mut sum, mut whole) = (0.0, 0.0);
    for face in &scene.faces {
        let [a, b, c] = face.corners.map(|corner| scene.positions[corner as usize]);
        let area = 0.5 * (b - a).cross(c - a).length();
        sum += area * quantity(&scene.materials[face.material.index()]);
        whole += area;
    }
    sum / whole
}
