//! Shadow rays from vertices: first a few from each, more where neighbours disagree, and more where the noise is too
//! large.

use std::{ops::Range, sync::Arc};

use glam::Vec4;

use super::{
    field::DirectField, samples::DirectLight, scale::Scale, sky_guide::SELDOM, tally::Tally,
};
use crate::{
    geometry::RayTree,
    hierarchy::{Hierarchy, luminance},
    solver::{
        Cancel,
        limits::Limits,
        places::{LEAST_PART, Receiver, emitted_as_irradiance, vertex_share_roots},
    },
};

/// Share of the shadow rays that is shot first, to find shadow borders. Smaller misses borders; larger costs rays in
/// even light.
const PROBING_SHARE: f32 = 0.25;

impl DirectLight {
    /// Whether it counts beside light that is emitted, given as the irradiance (luminance) that would be reflected so.
    fn counts_beside(&self, emitted: f32) -> bool {
        luminance(self.exact) > LEAST_PART * emitted || emitted <= 0.0
    }
}

impl DirectField {
    /// Sample the corners of leaves that have had fewer than `samples` rays. Returns the rays shot; `None` when
    /// cancelled.
    ///
    /// A share of the rays comes first. If those of all other vertices of the same elements have the same outcome,
    /// there is no shadow border, and they are enough, unless the vertex itself differs by more than chance. (A
    /// decision by its own rays would be biased: where a hundredth of the light arrives, only vertices with a visible
    /// ray would get more rays.)
    pub(crate) fn sample_vertices(
        &mut self,
        rays: &RayTree,
        hierarchy: &Hierarchy,
        samples: u32,
        seed: u64,
        cancel: &Cancel,
    ) -> Option<u64> {
        // All elements about a new vertex are new.
        let first = if samples > self.samples {
            0
        } else {
            self.sampled_elements
        };
        let elements = first..hierarchy.mesh.elements.len();
        if elements.is_empty() {
            return Some(0);
        }
        // The vertices that have had fewer rays; new ones get their expected light.
        self.vertices.resize(hierarchy.mesh.vertices.len(), None);
        let emitted = emitted_as_irradiance(hierarchy);
        let is_due = |vertex: usize, light: Option<DirectLight>| {
            light.is_none_or(|had| {
                had.tried == 0 || had.tried < samples && had.counts_beside(emitted[vertex])
            })
        };
        let receivers = self.receivers(hierarchy, elements.clone(), is_due);
        let before = self.shot(&receivers);
        for &(vertex, _) in &receivers {
            let vertex = vertex as usize;
            let ends = hierarchy.mesh.vertices[vertex].ends;
            let expected = match (self.vertices[vertex], ends) {
                (Some(light), _) if light.tried > 0 => continue,
                (Some(light), _) => light.exact,
                (None, Some([a, b])) => (self.unoccluded(a) + self.unoccluded(b)) * 0.5,
                (None, None) => Vec4::ZERO,
            };
            self.vertices[vertex] = Some(DirectLight::expected(expected));
        }
        // A share of the rays, and the others where these disagree.
        let probing = ((samples as f32 * PROBING_SHARE).ceil() as u32).clamp(1, samples);
        let explored = self.probe(rays, hierarchy, &receivers, probing, seed, cancel)?;
        let disputed = self.disputed(&self.neighbours(hierarchy, elements.clone()));
        let rest: Vec<(u32, Receiver)> = receivers
            .iter()
            .copied()
            .filter(|&(vertex, _)| {
                let counts = |light: DirectLight| light.counts_beside(emitted[vertex as usize]);
                disputed[vertex as usize] && self.vertices[vertex as usize].is_some_and(counts)
            })
            .collect();
        self.shoot(rays, &rest, samples, seed, cancel);
        if cancel.is_cancelled() {
            self.forget(&receivers);
            return None;
        }
        // All vertices are sampled.
        self.sampled_elements = elements.end;
        self.samples = self.samples.max(samples);
        Some(explored + self.shot(&receivers) - before)
    }

    /// Shoot the first rays from some vertices; where they see little of the sky, learn where it is seen, and begin again.
    /// Returns the rays that do not count as theirs; `None` when cancelled.
    pub(super) fn probe(
        &mut self,
        rays: &RayTree,
        hierarchy: &Hierarchy,
        receivers: &[(u32, Receiver)],
        samples: u32,
        seed: u64,
        cancel: &Cancel,
    ) -> Option<u64> {
        self.shoot(rays, receivers, samples, seed, cancel);
        if !self.lights.is_unexplored() {
            return Some(0);
        }
        let mut explored = self.explore(rays, hierarchy, receivers, seed, cancel)?;
        let guided = |(_, receiver): &&(u32, Receiver)| self.lights.is_guided(receiver);
        let guided: Vec<(u32, Receiver)> = receivers.iter().filter(guided).copied().collect();
        explored += self.shot(&guided);
        self.restart(&guided);
        self.shoot(rays, &guided, samples, seed, cancel);
        Some(explored)
    }

    /// Learn where the sky is seen from those of some vertices that see little of it, by their rays and those of their
    /// neighbours. Returns the rays shot; `None` when cancelled.
    fn explore(
        &mut self,
        rays: &RayTree,
        hierarchy: &Hierarchy,
        receivers: &[(u32, Receiver)],
        seed: u64,
        cancel: &Cancel,
    ) -> Option<u64> {
        let elements = 0..hierarchy.mesh.elements.len();
        let mut tallies = self.neighbours(hierarchy, elements);
        let sees_little = |&&(vertex, _): &&(u32, Receiver)| {
            let tally = &mut tallies[vertex as usize];
            *tally += self.tally(vertex);
            tally.shot > 0 && tally.fraction() < SELDOM
        };
        let seldom = receivers.iter().filter(sees_little);
        let seldom: Vec<Receiver> = seldom.map(|&(_, receiver)| receiver).collect();
        Arc::make_mut(&mut self.lights).explore(rays, &seldom, seed, cancel)
    }

    /// Double the rays of vertices whose noise exceeds its tolerance. Returns the rays shot; `None` when cancelled.
    pub(super) fn reduce_noise(
        &mut self,
        rays: &RayTree,
        hierarchy: &Hierarchy,
        limits: Limits,
        scale: Scale<'_>,
        cancel: &Cancel,
    ) -> Option<u64> {
        let (weights, emitted, means) = (
            vertex_share_roots(hierarchy),
            emitted_as_irradiance(hierarchy),
            scale.at_vertices(hierarchy),
        );
        let all = 0..hierarchy.mesh.elements.len();
        let neighbours = self.neighbours(hierarchy, all.clone());
        // Doubt counts by contrast only.
        let disputed = limits
            .contrast
            .is_finite()
            .then(|| self.disputed(&neighbours));
        let may_be_noisy = |vertex: usize, light: &DirectLight| {
            let (weight, mean) = (weights[vertex], means[vertex]);
            let is_disputed = || disputed.as_ref().is_some_and(|disputed| disputed[vertex]);
            light.counts_beside(emitted[vertex])
                && (limits.is_noisy(light, neighbours[vertex], weight, mean)
                    || is_disputed() && limits.is_doubtful(light, weight, mean))
        };
        let is_noisy = |vertex: usize, light: Option<DirectLight>| {
            light.is_some_and(|light| may_be_noisy(vertex, &light))
        };
        let mut known = self.vertices.iter().enumerate();
        if !known.any(|(vertex, light)| is_noisy(vertex, *light)) {
            return Some(0);
        }
        let receivers = self.receivers(hierarchy, all, is_noisy);
        let before = self.shot(&receivers);
        let mut known = self.known(&receivers);
        let places: Vec<Receiver> = receivers.iter().map(|&(_, receiver)| receiver).collect();
        let noisy =
            |index: usize, light: &DirectLight| may_be_noisy(receivers[index].0 as usize, light);
        self.double(rays, &places, noisy, limits.seed, &mut known, cancel)?;
        self.learn(&receivers, known);
        Some(self.shot(&receivers) - before)
    }

    /// Double the rays of points while they are too noisy; `None` when cancelled.
    pub(super) fn double(
        &self,
        rays: &RayTree,
        receivers: &[Receiver],
        is_noisy: impl Fn(usize, &DirectLight) -> bool + Sync,
        seed: u64,
        known: &mut [DirectLight],
        cancel: &Cancel,
    ) -> Option<()> {
        let wanted = |index: usize, light: &DirectLight| match is_noisy(index, light) {
            true => 2 * light.tried,
            false => light.tried,
        };
        self.lights
            .shoot(rays, receivers, wanted, seed, known, cancel);
        cancel.proceed()
    }

    /// The light of some vertices so far.
    fn known(&self, receivers: &[(u32, Receiver)]) -> Vec<DirectLight> {
        let known = |&(vertex, _): &(u32, Receiver)| self.vertices[vertex as usize];
        receivers
            .iter()
            .map(|receiver| known(receiver).unwrap_or_default())
            .collect()
    }

    /// Store the light of some vertices.
    fn learn(&mut self, receivers: &[(u32, Receiver)], known: Vec<DirectLight>) {
        for (&(vertex, _), light) in receivers.iter().zip(known) {
            self.vertices[vertex as usize] = Some(light);
        }
    }

    /// Discard the rays of some vertices.
    fn restart(&mut self, receivers: &[(u32, Receiver)]) {
        for &(vertex, _) in receivers {
            if let Some(light) = &mut self.vertices[vertex as usize] {
                *light = DirectLight::expected(light.exact);
            }
        }
    }

    /// Discard the light of some vertices, which are then sampled again.
    pub(super) fn forget(&mut self, receivers: &[(u32, Receiver)]) {
        for &(vertex, _) in receivers {
            self.vertices[vertex as usize] = None;
        }
        self.sampled_elements = 0;
    }

    /// Rays shot from some vertices.
    pub(super) fn shot(&self, receivers: &[(u32, Receiver)]) -> u64 {
        let shot = |&(vertex, _): &(u32, Receiver)| {
            self.vertices[vertex as usize].map_or(0, |light| u64::from(light.shot))
        };
        receivers.iter().map(shot).sum()
    }

    /// Shoot shadow rays from some vertices until each has had `wanted`. Incomplete when cancelled.
    pub(super) fn shoot(
        &mut self,
        rays: &RayTree,
        receivers: &[(u32, Receiver)],
        wanted: u32,
        seed: u64,
        cancel: &Cancel,
    ) {
        let places: Vec<Receiver> = receivers.iter().map(|&(_, receiver)| receiver).collect();
        let mut known = self.known(receivers);
        self.lights
            .shoot(rays, &places, |_, _| wanted, seed, &mut known, cancel);
        self.learn(receivers, known);
    }

    /// By vertex, the tally of the other corners of its leaves among these elements.
    fn neighbours(&self, hierarchy: &Hierarchy, elements: Range<usize>) -> Vec<Tally> {
        let mut neighbours = vec![Tally::default(); self.vertices.len()];
        for leaf in hierarchy.mesh.leaves_among(elements) {
            let corners = hierarchy.mesh.elements[leaf].vertices;
            for (side, vertex) in corners.into_iter().enumerate() {
                for other in [corners[(side + 1) % 3], corners[(side + 2) % 3]] {
                    neighbours[vertex as usize] += self.tally(other);
                }
            }
        }
        neighbours
    }

    /// The tally of a vertex.
    fn tally(&self, vertex: u32) -> Tally {
        let light = self.vertices[vertex as usize];
        light.map_or(Tally::default(), |light| light.tally())
    }

    /// The tally of the corners of an element.
    pub(super) fn tally_of_corners(&self, hierarchy: &Hierarchy, element: usize) -> Tally {
        let mut sum = Tally::default();
        for vertex in hierarchy.mesh.elements[element].vertices {
            sum += self.tally(vertex);
        }
        sum
    }

    /// By vertex, whether the rays of its neighbours had different outcomes, or another one than its own.
    fn disputed(&self, neighbours: &[Tally]) -> Vec<bool> {
        let is_disputed = |(vertex, others): (usize, &Tally)| {
            others.is_mixed() || others.shot > 0 && !self.tally(vertex as u32).is_like(*others)
        };
        neighbours.iter().enumerate().map(is_disputed).collect()
    }

    /// As [`crate::solver::places::OffsetPlaces::vertex_places`], for the vertices whose light so far is wanted.
    pub(super) fn receivers(
        &self,
        hierarchy: &Hierarchy,
        elements: Range<usize>,
        is_wanted: impl Fn(usize, Option<DirectLight>) -> bool,
    ) -> Vec<(u32, Receiver)> {
        let known = self.vertices.iter().enumerate();
        let is_wanted: Vec<bool> = known
            .map(|(vertex, light)| is_wanted(vertex, *light))
            .collect();
        self.offsets.vertex_places(hierarchy, elements, &is_wanted)
    }
}
