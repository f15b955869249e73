//! Direct light of all kinds that is sampled: one field each for the emitters, the sky and the sun.
//!
//! Direct light is linear in its sources. Each kind has shadow rays, noise and shadow borders of its own, so that a sky
//! or a sun that most places do not see takes no rays from the lamps of a room.

use std::{collections::HashMap, sync::Arc};

use glam::Vec4;

use super::{
    field::DirectField,
    lights::{LightKind, Lights},
    samples::DirectLight,
    scale::Surroundings,
};
use crate::{
    geometry::RayTree,
    hierarchy::{Channels as _, Hierarchy},
    scene::Scene,
    solver::{
        Cancel, Direct, SolveSettings,
        coverage::SkyShares,
        limits::Limits,
        places::{OffsetPlaces, Receiver},
        sums::area_total,
    },
};

/// The fields of direct light of a scene, those over mirrors last; none if nothing is sampled.
#[derive(Default)]
pub(crate) struct DirectFields {
    fields: Vec<DirectField>,
    /// The kind that is lit, if others are turned off.
    only: Option<LightKind>,
    /// To which errors are relative.
    surroundings: Surroundings,
    /// Stands for the offset places where nothing is sampled.
    no_offsets: OffsetPlaces,
}

/// Direct light at points apart from the mesh, by index and field.
#[derive(Default)]
pub(crate) struct PointLight(HashMap<usize, Vec<DirectLight>>);

impl PointLight {
    /// Memory in bytes.
    pub(crate) fn memory_bytes(&self) -> usize {
        let lights = self.0.values().map(|lights| size_of_val(lights.as_slice()));
        self.0.capacity() * size_of::<(usize, Vec<DirectLight>)>() + lights.sum::<usize>()
    }
}

impl DirectFields {
    /// The fields before any sample. Emission that is linked has none; the sky and the sun are then read from
    /// directional tables, as the clusters are. Without `sees_outside` they have none either.
    pub(crate) fn new(
        scene: &Scene,
        hierarchy: &Hierarchy,
        settings: &SolveSettings,
        sees_outside: bool,
        rays: &RayTree,
    ) -> Self {
        let reading = match settings.direct {
            Direct::Linked => settings.method.reading(),
            Direct::Sampled => None,
        };
        let emitters = Lights::of_emitters(scene, hierarchy, settings.direct);
        let environment = &scene.environment;
        let outside = sees_outside.then(|| {
            let sun = environment.sun.as_ref();
            let sun = sun.and_then(|sun| Lights::of_sun(sun, reading));
            [Lights::of_sky(&environment.sky, reading), sun]
        });
        let outside = outside.into_iter().flatten().flatten();
        let mut lights: Vec<Lights> = emitters.into_iter().chain(outside).collect();
        let in_image = |image| lights.iter().map(move |lights| lights.in_image(image));
        let mirrored: Vec<Lights> = rays.images().iter().flat_map(in_image).collect();
        lights.extend(mirrored);
        Self {
            fields: lights.into_iter().map(DirectField::new).collect(),
            only: None,
            surroundings: Surroundings::default(),
            no_offsets: OffsetPlaces::default(),
        }
    }

    /// Make errors relative to the light of these surroundings from now on.
    pub(crate) fn set_surroundings(&mut self, surroundings: Surroundings) {
        self.surroundings = surroundings;
    }

    /// Turn all light off that is not of this kind; for `None`, turn all on.
    pub(crate) fn light_only(&mut self, kind: Option<LightKind>) {
        self.only = kind;
    }

    /// Whether there is light of a kind.
    pub(crate) fn has(&self, kind: LightKind) -> bool {
        self.fields.iter().any(|field| field.lights.kind() == kind)
    }

    /// The fields that are turned on.
    fn lit(&self) -> impl Iterator<Item = &DirectField> {
        let is_lit =
            |field: &&DirectField| self.only.is_none_or(|kind| field.lights.kind() == kind);
        self.fields.iter().filter(is_lit)
    }

    /// All fields.
    pub(super) fn all_mut(&mut self) -> impl Iterator<Item = &mut DirectField> {
        self.fields.iter_mut()
    }

    /// Whether nothing is sampled.
    pub(crate) fn is_empty(&self) -> bool {
        self.fields.is_empty()
    }

    /// The field of the emitters.
    pub(crate) fn emitters(&self) -> Option<&DirectField> {
        self.fields.iter().find(|field| !field.lights.is_outside())
    }

    /// The fields of the emitters and of their images in mirrors, to be recoloured.
    pub(crate) fn emitters_mut(&mut self) -> impl Iterator<Item = &mut DirectField> {
        self.fields
            .iter_mut()
            .filter(|field| !field.lights.is_outside())
    }

    /// Direct irradiance of a leaf, W/m².
    pub(crate) fn element(&self, hierarchy: &Hierarchy, leaf: usize) -> Vec4 {
        self.sum(|field| field.element(hierarchy, leaf))
    }

    /// Direct irradiance at a vertex, W/m²; 0 if it was not sampled.
    pub(crate) fn corner(&self, vertex: u32) -> Vec4 {
        self.sum(|field| field.corner(vertex))
    }

    /// The sum over the fields; exactly the value of a single one.
    fn sum(&self, of: impl Fn(&DirectField) -> Vec4) -> Vec4 {
        self.lit().map(of).reduce(|a, b| a + b).unwrap_or_default()
    }

    /// Direct irradiance at each vertex for display, as [`DirectField::shown`]; `None` if nothing is sampled.
    pub(crate) fn shown(&self, hierarchy: &Hierarchy) -> Option<Vec<Vec4>> {
        let all = self.lit().map(|field| field.shown(hierarchy));
        all.reduce(|mut sum, other| {
            for (sum, light) in sum.iter_mut().zip(other) {
                *sum += light;
            }
            sum
        })
    }

    /// Largest irradiance from outside by channel, W/m²: light of surfaces is bounded by their radiosity.
    pub(crate) fn brightest_outside(&self) -> Vec4 {
        self.outside().map(|field| field.lights.brightest()).sum()
    }

    /// The lights of all fields.
    pub(super) fn lights(&self) -> impl Iterator<Item = &Arc<Lights>> {
        self.fields.iter().map(|field| &field.lights)
    }

    fn outside(&self) -> impl Iterator<Item = &DirectField> {
        self.lit().filter(|field| field.lights.is_outside())
    }

    /// Power that arrives from outside, summed over the colours.
    pub(crate) fn outside_power(&self, hierarchy: &Hierarchy) -> f64 {
        let power =
            |field: &DirectField| area_total(hierarchy, |leaf| field.element(hierarchy, leaf));
        self.outside().map(power).sum()
    }

    /// The parts of all hemispheres that the sky fills, if it is equally bright in all directions.
    pub(crate) fn sky_shares(&self, hierarchy: &Hierarchy) -> Option<SkyShares> {
        let even =
            |field: &DirectField| Some((field.lights.even_radiosity()?, field.shares(hierarchy)?));
        let (radiosity, [vertices, elements]) = self.fields.iter().find_map(even)?;
        Some(SkyShares {
            radiosity,
            vertices,
            elements,
        })
    }

    /// Irradiance from outside of a leaf, W/m².
    pub(crate) fn outside_irradiance(&self, hierarchy: &Hierarchy, leaf: usize) -> Vec4 {
        self.outside()
            .map(|field| field.element(hierarchy, leaf))
            .sum::<Vec4>()
            .color()
            .extend(0.0)
    }

    /// Whether the emission of a patch is sampled, and so not sent over links.
    pub(crate) fn is_sampled(&self, patch: usize) -> bool {
        self.emitters()
            .is_some_and(|field| field.lights.is_sampled(patch))
    }

    /// The patches whose emission is sampled.
    pub(crate) fn sampled_patches(&self) -> impl Iterator<Item = usize> + '_ {
        self.emitters()
            .into_iter()
            .flat_map(|field| field.lights.sampled_patches())
    }

    /// Whether all light straight from emitters and from outside is sampled, and there is some.
    pub(super) fn are_all(&self, hierarchy: &Hierarchy) -> bool {
        let mut active = hierarchy.active_patches();
        let is_known = |index: usize| {
            hierarchy.patches[index].emission == glam::Vec3::ZERO || self.is_sampled(index)
        };
        !self.is_empty() && active.all(is_known)
    }

    /// Whether linear interpolation of the unoccluded light between the corners of an element errs by more than the
    /// tolerance.
    pub(super) fn has_interpolation_error(
        &self,
        hierarchy: &Hierarchy,
        element: usize,
        limits: Limits,
    ) -> bool {
        let errs = |field: &DirectField| {
            field
                .lights
                .has_interpolation_error(hierarchy, element, limits)
        };
        self.fields.iter().any(errs)
    }

    /// Offset places of vertices behind walls: those of the first field, since no light reaches such vertices.
    pub(crate) fn offsets(&self) -> &OffsetPlaces {
        self.fields
            .first()
            .map_or(&self.no_offsets, |field| &field.offsets)
    }

    /// As [`DirectField::adapt`]. Errors are relative to the mean of all light.
    pub(crate) fn adapt(
        &mut self,
        rays: &RayTree,
        hierarchy: &mut Hierarchy,
        limits: Limits,
        cancel: &Cancel,
    ) -> Option<(u64, bool)> {
        let (mut shot, mut fits) = (0, true);
        for index in 0..self.fields.len() {
            let others = self.mean_of_others(hierarchy, index);
            let (field, around) = (&mut self.fields[index], &self.surroundings);
            let found = field.adapt(rays, hierarchy, limits, others, around, cancel)?;
            (shot, fits) = (shot + found.0, fits && found.1);
        }
        // The elements that later fields divided.
        if self.fields.len() > 1 {
            shot += self.sample(rays, hierarchy, limits, cancel)?;
        }
        Some((shot, fits))
    }

    /// Sample all vertices until their noise is tolerated. Returns the rays shot; `None` when cancelled.
    pub(crate) fn sample(
        &mut self,
        rays: &RayTree,
        hierarchy: &Hierarchy,
        limits: Limits,
        cancel: &Cancel,
    ) -> Option<u64> {
        let mut shot = 0;
        for index in 0..self.fields.len() {
            let others = self.mean_of_others(hierarchy, index);
            let (field, around) = (&mut self.fields[index], &self.surroundings);
            let found = field.sample(rays, hierarchy, limits, others, around, cancel)?;
            shot += found.0;
        }
        Some(shot)
    }

    /// Mean luminance of all fields but one, as far as they are sampled.
    fn mean_of_others(&self, hierarchy: &Hierarchy, index: usize) -> f32 {
        let others = self
            .fields
            .iter()
            .enumerate()
            .filter(|&(other, _)| other != index);
        others.map(|(_, field)| field.mean(hierarchy)).sum()
    }

    /// Number of fields.
    pub(crate) fn count(&self) -> usize {
        self.fields.len()
    }

    /// Shoot shadow rays of each field from points, given with their index, until each has had `samples`. Returns the rays
    /// shot; `None` when cancelled, and all light is then forgotten.
    pub(crate) fn sample_points(
        &self,
        rays: &RayTree,
        points: impl Iterator<Item = (usize, Receiver)>,
        samples: u32,
        seed: u64,
        known: &mut PointLight,
        cancel: &Cancel,
    ) -> Option<u64> {
        let (indices, points): (Vec<usize>, Vec<Receiver>) = points.unzip();
        let mut shot = 0;
        for (number, field) in self.fields.iter().enumerate() {
            let before = |index: &usize| {
                let known = known.0.get(index).and_then(|known| known.get(number));
                known.copied().unwrap_or_default()
            };
            let mut lights: Vec<DirectLight> = indices.iter().map(before).collect();
            let count = |lights: &[DirectLight]| -> u64 {
                lights.iter().map(|light| u64::from(light.shot)).sum()
            };
            let had = count(&lights);
            let wanted = |_: usize, _: &DirectLight| samples;
            field
                .lights
                .shoot(rays, &points, wanted, seed, &mut lights, cancel);
            shot += count(&lights) - had;
            for (index, light) in indices.iter().zip(lights) {
                let known = known.0.entry(*index).or_default();
                known.resize(self.fields.len(), DirectLight::default());
                known[number] = light;
            }
        }
        if cancel.is_cancelled() {
            *known = PointLight::default();
            return None;
        }
        Some(shot)
    }

    /// Direct irradiance of a point that was sampled, W/m²; 0 for others.
    pub(crate) fn at_point(&self, known: &PointLight, index: usize) -> Vec4 {
        let Some(known) = known.0.get(&index) else {
            return Vec4::ZERO;
        };
        let fields = self.fields.iter().zip(known);
        fields
            .map(|(field, known)| field.lights.bounded(known.irradiance()))
            .sum()
    }

    /// Memory in bytes.
    pub(crate) fn memory_bytes(&self) -> usize {
        let fields = self.fields.iter().map(DirectField::memory_bytes);
        fields.sum::<usize>() + self.surroundings.memory_bytes()
    }
}
