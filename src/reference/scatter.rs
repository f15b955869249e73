//! How paths of the reference leave a surface: diffusely, or as its mirror, gloss or glass sends them.

use std::f32::consts::FRAC_1_PI;

use glam::{Vec2, Vec3};

use crate::{
    geometry::Random,
    scene::{
        Gloss, LobeValue, Material, Scene, Specular, TriangleId, luminance, reflected,
        reflected_by_pane, refracted,
    },
};

/// A reflection into a range of directions.
#[derive(Clone, Copy, Debug)]
pub(super) enum Scatter {
    /// About this unit normal, with a BSDF of 1.
    Diffuse(Vec3),
    /// Of the light that leaves towards `to`, with facets that reflect everything.
    Gloss { lobe: Gloss, normal: Vec3, to: Vec3 },
}

impl Scatter {
    /// What is reflected from a direction, and the density with which it is chosen.
    pub(super) fn toward(&self, direction: Vec3) -> LobeValue {
        match *self {
            Self::Diffuse(normal) => {
                let cosine = normal.dot(direction).max(0.0);
                LobeValue {
                    value: cosine,
                    density: cosine * FRAC_1_PI,
                }
            }
            Self::Gloss { lobe, normal, to } => lobe.value(normal, to, direction),
        }
    }

    /// A direction of gloss, and the value over the density there.
    pub(super) fn sample(&self, square: Vec2) -> Option<(Vec3, f32)> {
        match *self {
            Self::Diffuse(_) => None,
            Self::Gloss { lobe, normal, to } => lobe.sample(normal, to, square),
        }
    }
}

/// How a path goes on where something is not diffuse. Weights are by what the light is multiplied on the way back.
pub(super) enum Turn {
    /// Diffusely, which had this chance.
    Diffuse { chance: f32 },
    /// In one direction.
    Onward { direction: Vec3, weight: Vec3 },
    /// In a direction that is still to be chosen.
    Gloss { scatter: Scatter, weight: Vec3 },
}

/// Choose how a path goes on from a triangle that it came to in a direction; `None` where all is diffuse.
pub(super) fn turned(
    scene: &Scene,
    triangle: TriangleId,
    direction: Vec3,
    random: &mut Random,
) -> Option<Turn> {
    let material = scene.material(triangle);
    let specular = material.specular?;
    let area = scene.surfaces[triangle.index()].area_vector;
    let front = area.normalize_or(-direction);
    let is_back = front.dot(direction) > 0.0;
    let normal = if is_back { -front } else { front };
    if let Specular::Glass { index, is_thin } = specular {
        let opaque = material.opacity;
        if random.uniform() < opaque {
            return Some(Turn::Diffuse { chance: opaque });
        }
        let index = if is_back { 1.0 / index } else { index };
        return Some(glass(direction, normal, index, is_thin, material, random));
    }
    if is_back && !scene.triangles[triangle.index()].two_sided {
        return None;
    }
    let color = specular.color() * material.share_of_met();
    let [diffuse, special] = [material.reflectance * material.share_of_met(), color].map(luminance);
    let chance = if special > 0.0 {
        special / (special + diffuse)
    } else {
        0.0
    };
    if random.uniform() >= chance {
        return Some(Turn::Diffuse {
            chance: 1.0 - chance,
        });
    }
    let weight = color / chance;
    Some(match specular {
        Specular::Gloss { roughness, .. } => Turn::Gloss {
            scatter: Scatter::Gloss {
                lobe: Gloss::new(roughness),
                normal,
                to: -direction,
            },
            weight,
        },
        Specular::Mirror { .. } | Specular::Glass { .. } => Turn::Onward {
            direction: reflected(direction, normal),
            weight,
        },
    })
}

/// Through glass, or reflected by it. `index` is that behind the surface over that before it.
fn glass(
    direction: Vec3,
    normal: Vec3,
    index: f32,
    is_thin: bool,
    material: &Material,
    random: &mut Random,
) -> Turn {
    let (onward, part, scale) = if is_thin {
        let index = index.max(1.0 / index);
        (
            Some(direction),
            reflected_by_pane(-normal.dot(direction), index),
            1.0,
        )
    } else {
        // Radiance is larger where light is slower.
        let (onward, part) = refracted(direction, normal, index);
        (onward, part, 1.0 / (index * index))
    };
    match onward.filter(|_| random.uniform() >= part) {
        Some(direction) => Turn::Onward {
            direction,
            weight: material.filter * scale,
        },
        None => Turn::Onward {
            direction: reflected(direction, normal),
            weight: Vec3::ONE,
        },
    }
}
