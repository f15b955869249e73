//! Direct light as a field on the mesh: known at vertices, and at the centroids of elements where it varies.
//! Elements are divided where linear interpolation between their corners would miss it.

use glam::{Vec3, Vec4};

use super::{
    Cancel,
    direct::{DirectLight, Lights, Receiver},
    reconstruct::{INSET, project},
    smooth,
};
use crate::{geometry::RayTree, hierarchy::Hierarchy, transport::luminance};

/// No element is larger than this share of the scene's area: smaller shadows than such an element could be missed by
/// all its corners. Larger misses more, smaller costs vertices on empty walls.
const LARGEST_SHARE: f64 = 1.0 / 1000.0;

/// Share of the variation between the corners that counts as error even where the centroid agrees with their mean.
const SPREAD_SHARE: f32 = 0.15;

/// Where all corners of an element lie in shadow, its centroid is sampled if it could get more light than this many
/// times the tolerance. Smaller costs rays in the shade, larger loses light on narrow faces.
const HIDDEN_TOLERANCE: f32 = 4.0;

/// Share of the shadow rays that is shot first.
const PROBING_SHARE: f32 = 0.25;

/// Noise of a point, times the root of its share of the area, that is let be: this share of the tolerance. Larger leaves
/// blotches, which are taken for shadow borders and divided; smaller costs rays, as one over its square.
const NOISE_SHARE: f32 = 0.25;

/// Shadow rays of a point at most, in multiples of the usual number.
const MOST_SAMPLES: u32 = 16;

/// Rounds of division in one step at most.
const MOST_ROUNDS: u32 = 8;

/// When to divide.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Error of interpolation, times the root of the element's share of the area, relative to the mean.
    pub tolerance: f32,
    /// Children are not smaller, frame units.
    pub min_area: f32,
    /// Shadow rays per point.
    pub shadow_samples: u32,
    /// Seed of the rays.
    pub seed: u64,
    /// Elements that there may be.
    pub most_elements: u64,
}

impl Limits {
    /// Whether more rays should be shot from a point that stands for a part of the area, of which `weight` is the root.
    fn is_noisy(&self, light: &DirectLight, weight: f32, mean: f32) -> bool {
        light.tried < MOST_SAMPLES * self.shadow_samples
            && light.error() * weight > NOISE_SHARE * self.tolerance * mean
    }
}

/// Direct light on a mesh.
pub(super) struct DirectField {
    pub(super) lights: Lights,
    /// By vertex, where it was sampled; shorter than the vertices where some are new.
    pub(super) vertices: Vec<Option<DirectLight>>,
    /// By element, where it was needed.
    pub(super) centres: Vec<Option<DirectLight>>,
    /// Irradiance to show by vertex; shorter than the vertices where some are new.
    shown: Vec<Vec4>,
    /// Whether the number of elements kept the last adaptation from being finer.
    pub(super) is_full: bool,
}

/// Divide elements that are too large to be trusted with their corners. Returns whether all could be.
pub(super) fn divide_coarse(hierarchy: &mut Hierarchy, limits: Limits) -> bool {
    let largest = ((hierarchy.area * LARGEST_SHARE) as f32).max(4.0 * limits.min_area);
    loop {
        let elements = &hierarchy.mesh.elements;
        let wanted: Vec<u32> = hierarchy
            .mesh
            .leaves()
            .filter(|&leaf| elements[leaf].area_vector.length() > largest)
            .map(|leaf| leaf as u32)
            .collect();
        if !hierarchy.mesh.fits(&wanted, limits.most_elements) {
            return false;
        }
        if wanted.is_empty() || !hierarchy.mesh.divide(&wanted) {
            return true;
        }
    }
}

/// Root of an element's share of the area: what an error on it counts.
fn share_root(hierarchy: &Hierarchy, element: usize) -> f32 {
    let area = hierarchy.mesh.elements[element].area_vector.length();
    (area / hierarchy.area as f32).sqrt()
}

/// The centroid of an element, as a place to be lit.
pub(super) fn centre_of(hierarchy: &Hierarchy, element: usize) -> Receiver {
    let patch = hierarchy.patch_of(element);
    Receiver {
        point: hierarchy.mesh.elements[element].centroid,
        normal: patch.normal,
        triangle: patch.triangle,
    }
}

impl DirectField {
    /// Nothing is known yet.
    pub(super) fn new(lights: Lights) -> Self {
        Self {
            lights,
            vertices: Vec::new(),
            centres: Vec::new(),
            shown: Vec::new(),
            is_full: false,
        }
    }

    /// Direct irradiance of a leaf: its corners' mean, or the rule of degree 2 with its centroid.
    pub(super) fn element(&self, hierarchy: &Hierarchy, element: usize) -> Vec4 {
        let [a, b, c] = hierarchy.mesh.elements[element]
            .vertices
            .map(|vertex| self.corner(vertex));
        let corners = a + b + c;
        match self.centres.get(element).copied().flatten() {
            Some(centre) => {
                self.lights.bounded(centre.irradiance()) * 0.75 + corners * (0.25 / 3.0)
            }
            None => corners / 3.0,
        }
    }

    /// Bring what is shown at vertices up to date with the samples.
    pub(super) fn smooth(&mut self, hierarchy: &Hierarchy) {
        let fractions = smooth::fractions(hierarchy, &self.vertices);
        let known = self.vertices.iter().zip(fractions);
        self.shown = known
            .map(|(light, fraction)| {
                let unoccluded = light.map_or(Vec4::ZERO, |light| light.unoccluded());
                self.lights.bounded(unoccluded * fraction)
            })
            .collect();
        let centres = hierarchy.mesh.leaves().filter_map(|leaf| {
            let centre = self.centres.get(leaf).copied().flatten()?;
            Some((leaf, self.lights.bounded(centre.irradiance())))
        });
        project(hierarchy, &mut self.shown, centres);
    }

    /// Direct irradiance to show at a vertex and its standard error (luminance). A vertex that only closes an edge takes the
    /// mean of its ends.
    pub(super) fn vertex(&self, hierarchy: &Hierarchy, vertex: u32) -> (Vec4, f32) {
        if let Some(light) = self.vertices.get(vertex as usize).copied().flatten() {
            let shown = self.shown.get(vertex as usize).copied();
            let shown = shown.unwrap_or_else(|| self.lights.bounded(light.irradiance()));
            return (shown, light.error());
        }
        match hierarchy.mesh.vertices[vertex as usize].ends {
            // Ends were made before the vertices between them, so this descends.
            Some(ends) => {
                let [(a, a_error), (b, b_error)] = ends.map(|end| self.vertex(hierarchy, end));
                ((a + b) * 0.5, (a_error + b_error) * 0.5)
            }
            None => (Vec4::ZERO, 0.0),
        }
    }

    /// Direct irradiance at a corner of a leaf.
    fn corner(&self, vertex: u32) -> Vec4 {
        self.vertices
            .get(vertex as usize)
            .copied()
            .flatten()
            .map_or(Vec4::ZERO, |light| self.lights.bounded(light.irradiance()))
    }

    /// Sample all vertices, and divide and sample until interpolation is good enough. Returns the rays shot.
    pub(super) fn adapt(
        &mut self,
        rays: &RayTree,
        hierarchy: &mut Hierarchy,
        limits: Limits,
        cancel: &Cancel,
    ) -> Option<u64> {
        let mut ray_count = 0;
        self.is_full = false;
        for _ in 0..MOST_ROUNDS {
            ray_count += self.cover(rays, hierarchy, limits.shadow_samples, limits.seed, cancel)?;
            let mean = self.mean(hierarchy);
            ray_count += self.settle(rays, hierarchy, limits, mean, cancel)?;
            ray_count += self.probe_centres(rays, hierarchy, limits, mean, cancel)?;
            let wanted = self.bent(hierarchy, limits, mean);
            self.is_full = !hierarchy.mesh.fits(&wanted, limits.most_elements);
            if self.is_full || !hierarchy.mesh.divide(&wanted) {
                break;
            }
        }
        ray_count += self.cover(rays, hierarchy, limits.shadow_samples, limits.seed, cancel)?;
        let mean = self.mean(hierarchy);
        ray_count += self.settle(rays, hierarchy, limits, mean, cancel)?;
        Some(ray_count)
    }

    /// Double the rays of vertices whose noise counts for more than a share of the tolerance. Returns the rays shot.
    fn settle(
        &mut self,
        rays: &RayTree,
        hierarchy: &Hierarchy,
        limits: Limits,
        mean: f32,
        cancel: &Cancel,
    ) -> Option<u64> {
        let mut weights = vec![0.0f32; self.vertices.len()];
        for leaf in hierarchy.mesh.leaves() {
            let element = &hierarchy.mesh.elements[leaf];
            for &vertex in &element.vertices {
                weights[vertex as usize] += element.area_vector.length() / 3.0;
            }
        }
        let scale = 1.0 / (hierarchy.area as f32).sqrt();
        weights
            .iter_mut()
            .for_each(|weight| *weight = weight.sqrt() * scale);
        let receivers = self.receivers(hierarchy, |vertex, light| {
            light.is_some_and(|light| limits.is_noisy(&light, weights[vertex], mean))
        });
        let before = self.shot(&receivers);
        let weights: Vec<f32> = receivers
            .iter()
            .map(|&(vertex, _)| weights[vertex as usize])
            .collect();
        let mut known = self.known(&receivers);
        let places: Vec<Receiver> = receivers.iter().map(|&(_, receiver)| receiver).collect();
        let noisy =
            |index: usize, light: &DirectLight| limits.is_noisy(light, weights[index], mean);
        self.double(rays, &places, noisy, limits.seed, &mut known, cancel)?;
        self.learn(&receivers, known);
        Some(self.shot(&receivers) - before)
    }

    /// Double the rays of points for as long as they are too noisy.
    fn double(
        &self,
        rays: &RayTree,
        receivers: &[Receiver],
        is_noisy: impl Fn(usize, &DirectLight) -> bool,
        seed: u64,
        known: &mut [DirectLight],
        cancel: &Cancel,
    ) -> Option<()> {
        loop {
            let noisy: Vec<usize> = (0..known.len())
                .filter(|&index| is_noisy(index, &known[index]))
                .collect();
            if noisy.is_empty() {
                return Some(());
            }
            let places: Vec<Receiver> = noisy.iter().map(|&index| receivers[index]).collect();
            let mut lights: Vec<DirectLight> = noisy.iter().map(|&index| known[index]).collect();
            self.lights.shoot(
                rays,
                &places,
                |light| 2 * light.tried,
                seed,
                &mut lights,
                cancel,
            );
            cancel.proceed()?;
            for (index, light) in noisy.into_iter().zip(lights) {
                known[index] = light;
            }
        }
    }

    /// What is known of some vertices.
    fn known(&self, receivers: &[(u32, Receiver)]) -> Vec<DirectLight> {
        let known = |&(vertex, _): &(u32, Receiver)| self.vertices[vertex as usize];
        receivers
            .iter()
            .map(|receiver| known(receiver).unwrap_or_default())
            .collect()
    }

    /// What is now known of some vertices.
    fn learn(&mut self, receivers: &[(u32, Receiver)], known: Vec<DirectLight>) {
        for (&(vertex, _), light) in receivers.iter().zip(known) {
            self.vertices[vertex as usize] = Some(light);
        }
    }

    /// Rays shot from some vertices.
    fn shot(&self, receivers: &[(u32, Receiver)]) -> u64 {
        let shot = |&(vertex, _): &(u32, Receiver)| {
            self.vertices[vertex as usize].map_or(0, |light| u64::from(light.shot))
        };
        receivers.iter().map(shot).sum()
    }

    /// Sample the corners of leaves that were not sampled yet. Returns the rays shot.
    ///
    /// A share of the rays comes first. Where they agree with those of all vertices of the same elements there is no
    /// shadow border, and they are enough. (To trust a vertex's own rays alone would be biased: where a twentieth of
    /// the light arrives, most vertices would see none.)
    pub(super) fn cover(
        &mut self,
        rays: &RayTree,
        hierarchy: &Hierarchy,
        samples: u32,
        seed: u64,
        cancel: &Cancel,
    ) -> Option<u64> {
        self.vertices.resize(hierarchy.mesh.vertices.len(), None);
        let receivers = self.receivers(hierarchy, |_, light| light.is_none());
        for &(vertex, _) in &receivers {
            self.vertices[vertex as usize] = Some(DirectLight::default());
        }
        let probing = ((samples as f32 * PROBING_SHARE).ceil() as u32).clamp(1, samples);
        self.shoot(rays, &receivers, |_| probing, seed, cancel);
        let disputed = self.disputed(hierarchy);
        let rest: Vec<(u32, Receiver)> = receivers
            .iter()
            .copied()
            .filter(|&(vertex, _)| disputed[vertex as usize])
            .collect();
        self.shoot(rays, &rest, |_| samples, seed, cancel);
        if cancel.is_cancelled() {
            for &(vertex, _) in &receivers {
                self.vertices[vertex as usize] = None;
            }
            return None;
        }
        Some(self.shot(&receivers))
    }

    fn shoot(
        &mut self,
        rays: &RayTree,
        receivers: &[(u32, Receiver)],
        wanted: impl Fn(&DirectLight) -> u32 + Sync,
        seed: u64,
        cancel: &Cancel,
    ) {
        let places: Vec<Receiver> = receivers.iter().map(|&(_, receiver)| receiver).collect();
        let mut known = self.known(receivers);
        self.lights
            .shoot(rays, &places, wanted, seed, &mut known, cancel);
        self.learn(receivers, known);
    }

    /// Which vertices share an element with one whose rays had another outcome.
    fn disputed(&self, hierarchy: &Hierarchy) -> Vec<bool> {
        let mut disputed = vec![false; self.vertices.len()];
        for leaf in hierarchy.mesh.leaves() {
            let corners = hierarchy.mesh.elements[leaf]
                .vertices
                .map(|vertex| vertex as usize);
            let [a, b, c] = corners.map(|vertex| self.vertices[vertex].unwrap_or_default());
            if !(a.agrees_with(&b) && b.agrees_with(&c) && c.agrees_with(&a)) {
                for vertex in corners {
                    disputed[vertex] = true;
                }
            }
        }
        disputed
    }

    fn mean(&self, hierarchy: &Hierarchy) -> f32 {
        let sum = super::gather::area_sum(hierarchy, |leaf| self.element(hierarchy, leaf));
        luminance(
            (sum / hierarchy.area.max(f64::MIN_POSITIVE))
                .as_vec3()
                .extend(0.0),
        )
    }

    /// How much the luminance of the corners varies, times the weight of the element, relative to the mean.
    fn spread(&self, hierarchy: &Hierarchy, element: usize, mean: f32) -> f32 {
        let corners = hierarchy.mesh.elements[element].vertices;
        let values = corners.map(|vertex| luminance(self.corner(vertex)));
        let range = values.iter().copied().fold(0.0, f32::max)
            - values.iter().copied().fold(f32::MAX, f32::min);
        range * share_root(hierarchy, element) / mean.max(f32::MIN_POSITIVE)
    }

    /// The light that an element would get if nothing stood before it, as `spread` counts, where none of it reaches the
    /// corners: rings and bands lie with all their corners under the edges of their neighbours.
    fn hidden(&self, hierarchy: &Hierarchy, element: usize, mean: f32) -> f32 {
        let lights = hierarchy.mesh.elements[element]
            .vertices
            .map(|vertex| self.vertices[vertex as usize].unwrap_or_default());
        if lights.iter().any(|light| light.fraction() != Vec4::ZERO) {
            return 0.0;
        }
        let most = lights
            .iter()
            .map(|light| luminance(light.unoccluded()))
            .fold(0.0, f32::max);
        most * share_root(hierarchy, element) / mean.max(f32::MIN_POSITIVE)
    }

    /// Sample the centroids of leaves whose corners differ, or may all be dark by chance. Returns the rays shot.
    fn probe_centres(
        &mut self,
        rays: &RayTree,
        hierarchy: &Hierarchy,
        limits: Limits,
        mean: f32,
        cancel: &Cancel,
    ) -> Option<u64> {
        self.centres.resize(hierarchy.mesh.elements.len(), None);
        let unknown: Vec<usize> = hierarchy
            .mesh
            .leaves()
            .filter(|&leaf| {
                self.centres[leaf].is_none()
                    && (self.spread(hierarchy, leaf, mean) > limits.tolerance
                        || self.hidden(hierarchy, leaf, mean) > HIDDEN_TOLERANCE * limits.tolerance)
            })
            .collect();
        let receivers: Vec<Receiver> = unknown
            .iter()
            .map(|&leaf| centre_of(hierarchy, leaf))
            .collect();
        let mut lights = vec![DirectLight::default(); receivers.len()];
        let samples = limits.shadow_samples;
        self.lights.shoot(
            rays,
            &receivers,
            |_| samples,
            limits.seed,
            &mut lights,
            cancel,
        );
        cancel.proceed()?;
        let noisy = |index: usize, light: &DirectLight| {
            limits.is_noisy(light, share_root(hierarchy, unknown[index]), mean)
        };
        self.double(rays, &receivers, noisy, limits.seed, &mut lights, cancel)?;
        let mut ray_count = 0;
        for (leaf, light) in unknown.into_iter().zip(lights) {
            ray_count += u64::from(light.shot);
            self.centres[leaf] = Some(light);
        }
        Some(ray_count)
    }

    /// Leaves whose corners do not tell what lies between.
    fn bent(&self, hierarchy: &Hierarchy, limits: Limits, mean: f32) -> Vec<u32> {
        let mesh = &hierarchy.mesh;
        mesh.leaves()
            .filter(|&leaf| {
                let element = &mesh.elements[leaf];
                let area = element.area_vector.length();
                let Some(centre) = self.centres.get(leaf).copied().flatten() else {
                    return false;
                };
                if area * 0.25 < limits.min_area {
                    return false;
                }
                let [a, b, c] = element.vertices.map(|vertex| self.corner(vertex));
                let bend = luminance((centre.irradiance() - (a + b + c) / 3.0).abs());
                let weight = share_root(hierarchy, leaf) / mean.max(f32::MIN_POSITIVE);
                bend * weight + SPREAD_SHARE * self.spread(hierarchy, leaf, mean) > limits.tolerance
            })
            .map(|leaf| leaf as u32)
            .collect()
    }

    /// Bytes held.
    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(self.vertices.as_slice())
            + size_of_val(self.centres.as_slice())
            + size_of_val(self.shown.as_slice())
    }
}

impl DirectField {
    /// Where to sample each corner of a leaf that is wanted: a little inside the leaf whose normal is nearest to the mean
    /// normal about the vertex.
    pub(super) fn receivers(
        &self,
        hierarchy: &Hierarchy,
        is_wanted: impl Fn(usize, Option<DirectLight>) -> bool,
    ) -> Vec<(u32, Receiver)> {
        let mesh = &hierarchy.mesh;
        let mut normals = vec![Vec3::ZERO; mesh.vertices.len()];
        for leaf in mesh.leaves() {
            for &vertex in &mesh.elements[leaf].vertices {
                normals[vertex as usize] += mesh.elements[leaf].area_vector;
            }
        }
        let mut chosen: Vec<Option<(f32, u32)>> = vec![None; mesh.vertices.len()];
        for leaf in mesh.leaves() {
            let normal = hierarchy.patch_of(leaf).normal;
            for vertex in mesh.elements[leaf].vertices.map(|vertex| vertex as usize) {
                let likeness = normals[vertex].dot(normal);
                let is_best = chosen[vertex].is_none_or(|(best, _)| likeness > best);
                if is_best && is_wanted(vertex, self.vertices[vertex]) {
                    chosen[vertex] = Some((likeness, leaf as u32));
                }
            }
        }
        let receiver = |(vertex, choice): (usize, Option<(f32, u32)>)| {
            let (_, leaf) = choice?;
            let patch = hierarchy.patch_of(leaf as usize);
            let centroid = mesh.elements[leaf as usize].centroid;
            let point = mesh.position(vertex as u32).lerp(centroid, INSET);
            let normal = normals[vertex].try_normalize().unwrap_or(patch.normal);
            Some((
                vertex as u32,
                Receiver {
                    point,
                    normal,
                    triangle: patch.triangle,
                },
            ))
        };
        chosen
            .into_iter()
            .enumerate()
            .filter_map(receiver)
            .collect()
    }
}
