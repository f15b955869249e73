//! Direct light in parts, which can be dimmed and coloured without new shadow rays.
//!
//! Direct light is linear in each emitter. As long as all sampled emitters change by one factor, their samples are
//! scaled. Otherwise each emitting material is sampled separately, and is a part of its own from then on.

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::{field::DirectField, lights::Lights, samples::DirectLight};
use crate::{
    geometry::RayTree,
    hierarchy::Hierarchy,
    scene::{Appearance, MaterialId, Scene},
    solver::{
        Cancel,
        places::{Receiver, centre_of},
    },
};

/// Most emitting materials that get parts of their own; with more, all are sampled again whenever their ratio changes.
/// More take memory, 64 bytes each for every vertex; fewer need new rays more often.
const MOST_PARTS: usize = 8;

/// Ratios that differ by less than this share are equal. Smaller, and rounding counts; larger, and small changes are
/// lost.
const SAME_RATIO: f32 = 1e-5;

/// Samples by vertex and by element, as in a [`DirectField`].
#[derive(Clone)]
struct Samples {
    vertices: Vec<Option<DirectLight>>,
    centres: Vec<Option<DirectLight>>,
}

/// The direct light of some materials.
struct Part {
    /// The materials, with the emission for which they were sampled.
    shot_as: Vec<(MaterialId, Vec3)>,
    samples: Samples,
}

/// Input of new shadow rays.
#[derive(Clone, Copy)]
pub(crate) struct Shooting<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) hierarchy: &'a Hierarchy,
    pub(crate) rays: &'a RayTree,
    pub(crate) seed: u64,
    pub(crate) cancel: &'a Cancel,
}

/// The parts of the direct light of a field.
pub(crate) struct LightParts(Vec<Part>);

impl LightParts {
    /// A field, sampled for these appearances, as one part.
    pub(crate) fn whole(field: &DirectField, scene: &Scene, appearances: &[Appearance]) -> Self {
        let emission = |material: MaterialId| (material, appearances[material.index()].emission);
        Self(vec![Part {
            shot_as: sampled_materials(&field.lights, scene)
                .into_iter()
                .map(emission)
                .collect(),
            samples: Samples {
                vertices: field.vertices.clone(),
                centres: field.centres.clone(),
            },
        }])
    }

    /// Change a field to the light for these appearances, with new shadow rays only if the parts do not determine it.
    /// Returns the rays shot; `None` when cancelled, with the field unchanged.
    pub(crate) fn mix(
        &mut self,
        field: &mut DirectField,
        shooting: Shooting<'_>,
        appearances: &[Appearance],
    ) -> Option<u64> {
        let mut shot = 0;
        if self.factors(appearances).is_none() {
            shot = self.shoot_anew(field, shooting, appearances)?;
        }
        let factors = self.factors(appearances)?;
        let mixed = self.mixed(&factors);
        let emission = |material: MaterialId| appearances[material.index()].emission;
        let lights = field.lights.repainted(|material| Some(emission(material)));
        field.recolor(lights, mixed.vertices, mixed.centres);
        Some(shot)
    }

    /// The factor of each part; `None` if one has none.
    fn factors(&self, appearances: &[Appearance]) -> Option<Vec<Vec4>> {
        let factor = |part: &Part| {
            let pairs = part.shot_as.iter();
            let pairs = pairs.map(|(of, shot_as)| (*shot_as, appearances[of.index()].emission));
            Some(common_ratio(pairs)?.extend(1.0))
        };
        self.0.iter().map(factor).collect()
    }

    /// The sum of the parts times their factors.
    fn mixed(&self, factors: &[Vec4]) -> Samples {
        let mix = |of: fn(&Samples) -> &[Option<DirectLight>]| {
            let count = self.0.first().map_or(0, |part| of(&part.samples).len());
            (0..count)
                .into_par_iter()
                .with_min_len(1024)
                .map(|index| {
                    let parts = self.0.iter().zip(factors);
                    let known = parts
                        .filter_map(|(part, factor)| Some((of(&part.samples)[index]?, *factor)));
                    let is_known = of(&self.0[0].samples)[index].is_some();
                    is_known.then(|| DirectLight::mixed(known))
                })
                .collect()
        };
        Samples {
            vertices: mix(|samples| &samples.vertices),
            centres: mix(|samples| &samples.centres),
        }
    }

    /// Sample each material separately, or all in their new colours if there are too many.
    fn shoot_anew(
        &mut self,
        field: &DirectField,
        shooting: Shooting<'_>,
        appearances: &[Appearance],
    ) -> Option<u64> {
        let materials = sampled_materials(&field.lights, shooting.scene);
        let (groups, shot_as) = if materials.len() > MOST_PARTS {
            (vec![materials], appearances.to_vec())
        } else {
            // A part sampled as white can take any colour later.
            let mut white = appearances.to_vec();
            for material in &materials {
                white[material.index()].emission = Vec3::ONE;
            }
            (materials.into_iter().map(|one| vec![one]).collect(), white)
        };
        let (mut parts, mut ray_count) = (Vec::new(), 0);
        for group in groups {
            let lights = field.lights.repainted(|material| {
                let is_member = group.contains(&material);
                is_member.then(|| shot_as[material.index()].emission)
            });
            let (samples, shot) = shoot_known(field, &lights, shooting)?;
            ray_count += shot;
            let emission = |material: MaterialId| (material, shot_as[material.index()].emission);
            parts.push(Part {
                shot_as: group.into_iter().map(emission).collect(),
                samples,
            });
        }
        self.0 = parts;
        Some(ray_count)
    }

    /// Memory in bytes.
    pub(crate) fn memory_bytes(&self) -> usize {
        let bytes = |part: &Part| {
            size_of_val(part.samples.vertices.as_slice())
                + size_of_val(part.samples.centres.as_slice())
        };
        self.0.iter().map(bytes).sum()
    }
}

/// Ratio of the second to the first colour, if it is the same for all pairs. Pairs of 0 have any ratio; it is 1 if all
/// pairs are 0.
pub(crate) fn common_ratio(pairs: impl Iterator<Item = (Vec3, Vec3)>) -> Option<Vec3> {
    let mut common: [Option<f32>; 3] = [None; 3];
    for (before, after) in pairs {
        for (channel, common) in common.iter_mut().enumerate() {
            let (before, after) = (before[channel], after[channel]);
            if before <= 0.0 && after <= 0.0 {
                continue;
            }
            let ratio = after / before;
            if !ratio.is_finite() {
                return None;
            }
            let known = *common.get_or_insert(ratio);
            if (ratio - known).abs() > SAME_RATIO * known.max(ratio) {
                return None;
            }
        }
    }
    Some(Vec3::from_array(common.map(|ratio| ratio.unwrap_or(1.0))))
}

/// The materials of sampled emitters.
fn sampled_materials(lights: &Lights, scene: &Scene) -> Vec<MaterialId> {
    let mut materials: Vec<MaterialId> = lights
        .triangles()
        .map(|triangle| scene.triangles[triangle.index()].material)
        .collect();
    materials.sort_unstable();
    materials.dedup();
    materials
}

/// Samples of other lights at the places of a field, with as many shadow rays from each; and the rays shot. `None` when
/// cancelled.
fn shoot_known(
    field: &DirectField,
    lights: &Lights,
    shooting: Shooting<'_>,
) -> Option<(Samples, u64)> {
    let hierarchy = shooting.hierarchy;
    let mut samples = Samples {
        vertices: vec![None; field.vertices.len()],
        centres: vec![None; field.centres.len()],
    };
    let elements = 0..hierarchy.mesh.elements.len();
    let corners = field.receivers(hierarchy, elements, |_, light| light.is_some());
    let corners = corners
        .into_iter()
        .map(|(vertex, receiver)| (vertex as usize, receiver))
        .collect();
    let is_known = |&leaf: &usize| field.centres.get(leaf).is_some_and(Option::is_some);
    let leaves = hierarchy.mesh.leaves().filter(is_known);
    let centres = leaves.map(|leaf| (leaf, centre_of(hierarchy, leaf)));
    let mut shot = shoot_like(
        &field.vertices,
        corners,
        lights,
        shooting,
        &mut samples.vertices,
    )?;
    shot += shoot_like(
        &field.centres,
        centres.collect(),
        lights,
        shooting,
        &mut samples.centres,
    )?;
    Some((samples, shot))
}

/// Sample places with as many shadow rays as before. Returns the rays shot; `None` when cancelled.
fn shoot_like(
    before: &[Option<DirectLight>],
    mut places: Vec<(usize, Receiver)>,
    lights: &Lights,
    shooting: Shooting<'_>,
    found: &mut [Option<DirectLight>],
) -> Option<u64> {
    let tried = |index: usize| before[index].map_or(0, |light| light.tried);
    places.sort_by_key(|&(index, _)| tried(index));
    let mut shot = 0;
    for alike in places.chunk_by(|a, b| tried(a.0) == tried(b.0)) {
        let count = tried(alike[0].0);
        let receivers: Vec<Receiver> = alike.iter().map(|&(_, receiver)| receiver).collect();
        let mut known = vec![DirectLight::default(); receivers.len()];
        let (rays, seed) = (shooting.rays, shooting.seed);
        lights.shoot(
            rays,
            &receivers,
            |_, _| count,
            seed,
            &mut known,
            shooting.cancel,
        );
        shooting.cancel.proceed()?;
        for (&(index, _), light) in alike.iter().zip(known) {
            shot += u64::from(light.shot);
            found[index] = Some(light);
        }
    }
    Some(shot)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ratio(pairs: &[([f32; 3], [f32; 3])]) -> Option<Vec3> {
        let colors = pairs
            .iter()
            .map(|&(before, after)| (Vec3::from_array(before), Vec3::from_array(after)));
        common_ratio(colors)
    }

    #[test]
    fn lights_that_change_alike_have_a_ratio() {
        let alike = [
            ([1.0, 2.0, 0.0], [2.0, 1.0, 0.0]),
            ([3.0, 4.0, 0.0], [6.0, 2.0, 0.0]),
        ];
        assert_eq!(ratio(&alike), Some(Vec3::new(2.0, 0.5, 1.0)));
        assert_eq!(ratio(&[]), Some(Vec3::ONE));
        assert_eq!(ratio(&[([1.0; 3], [0.0; 3])]), Some(Vec3::ZERO));
    }

    #[test]
    fn lights_that_change_unlike_or_come_from_nothing_have_none() {
        let unlike = [([1.0; 3], [1.0; 3]), ([1.0; 3], [0.0; 3])];
        assert_eq!(ratio(&unlike), None);
        assert_eq!(ratio(&[([1.0, 0.0, 1.0], [1.0; 3])]), None);
    }
}
