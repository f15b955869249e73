//! Direct light as a field on the mesh: known at vertices, and at the centroids of elements where it varies.
//! Elements are divided where linear interpolation between their corners would miss it.

use glam::{Vec3, Vec4};

use super::{
    Cancel,
    direct::{DirectLight, Lights, Receiver},
    reconstruct::INSET,
};
use crate::{geometry::RayTree, hierarchy::Hierarchy, transport::luminance};

/// No element is larger than this share of the scene's area: smaller shadows than such an element could be missed by
/// all its corners. Larger misses more, smaller costs vertices on empty walls.
const LARGEST_SHARE: f64 = 1.0 / 1000.0;

/// Share of the variation between the corners that counts as error even where the centroid agrees with their mean.
const SPREAD_SHARE: f32 = 0.15;

/// Share of the shadow rays that is shot first.
const PROBING_SHARE: f32 = 0.25;

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
}

/// Direct light on a mesh.
pub(super) struct DirectField {
    lights: Lights,
    /// By vertex; shorter than the vertices where some are new.
    vertices: Vec<DirectLight>,
    /// For vertices that only close an edge: the ends of that edge, whose mean they take.
    ends: Vec<Option<[u32; 2]>>,
    /// By element, where it was needed.
    centres: Vec<Option<DirectLight>>,
}

/// Divide elements that are too large to be trusted with their corners.
pub(super) fn divide_coarse(hierarchy: &mut Hierarchy, min_area: f32) {
    let largest = ((hierarchy.area * LARGEST_SHARE) as f32).max(4.0 * min_area);
    loop {
        let elements = &hierarchy.mesh.elements;
        let wanted: Vec<u32> = hierarchy
            .mesh
            .leaves()
            .filter(|&leaf| elements[leaf].area_vector.length() > largest)
            .map(|leaf| leaf as u32)
            .collect();
        if wanted.is_empty() || !hierarchy.mesh.divide(&wanted) {
            return;
        }
    }
}

impl DirectField {
    /// Nothing is known yet.
    pub(super) fn new(lights: Lights) -> Self {
        Self {
            lights,
            vertices: Vec::new(),
            ends: Vec::new(),
            centres: Vec::new(),
        }
    }

    /// Direct irradiance of a leaf: its corners' mean, or the rule of degree 2 with its centroid.
    pub(super) fn element(&self, hierarchy: &Hierarchy, element: usize) -> Vec4 {
        let known = |vertex: u32| {
            self.vertices
                .get(vertex as usize)
                .map_or(Vec4::ZERO, DirectLight::irradiance)
        };
        let [a, b, c] = hierarchy.mesh.elements[element].vertices.map(known);
        let corners = a + b + c;
        match self.centres.get(element).copied().flatten() {
            Some(centre) => centre.irradiance() * 0.75 + corners * (0.25 / 3.0),
            None => corners / 3.0,
        }
    }

    /// Direct irradiance at a vertex and its standard error (luminance).
    pub(super) fn vertex(&self, vertex: usize) -> (Vec4, f32) {
        let Some(light) = self.vertices.get(vertex) else {
            return (Vec4::ZERO, 0.0);
        };
        match self.ends[vertex] {
            Some([a, b]) => {
                // Ends were made before the vertices between them, so this descends.
                let ((a, a_error), (b, b_error)) =
                    (self.vertex(a as usize), self.vertex(b as usize));
                ((a + b) * 0.5, (a_error + b_error) * 0.5)
            }
            None => (light.irradiance(), light.error()),
        }
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
        for _ in 0..MOST_ROUNDS {
            ray_count += self.cover(rays, hierarchy, limits.shadow_samples, limits.seed, cancel)?;
            let mean = self.mean(hierarchy);
            ray_count += self.probe_centres(rays, hierarchy, limits, mean, cancel)?;
            let wanted = self.bent(hierarchy, limits, mean);
            if !hierarchy.mesh.divide(&wanted) {
                break;
            }
        }
        ray_count += self.cover(rays, hierarchy, limits.shadow_samples, limits.seed, cancel)?;
        Some(ray_count)
    }

    /// Sample the vertices that are new. Returns the rays shot.
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
        let first = self.vertices.len();
        let count = hierarchy.mesh.vertices.len();
        if first == count {
            return Some(0);
        }
        self.vertices.resize(count, DirectLight::default());
        self.ends.resize(count, None);
        let receivers = vertex_receivers(hierarchy, first);
        let probing = ((samples as f32 * PROBING_SHARE).ceil() as u32).clamp(1, samples);
        self.shoot(rays, &receivers, 0..probing, seed, cancel);
        let disputed = self.disputed(hierarchy, first);
        let rest: Vec<(u32, Receiver)> = receivers
            .iter()
            .copied()
            .filter(|&(vertex, _)| disputed[vertex as usize - first])
            .collect();
        self.shoot(rays, &rest, probing..samples, seed, cancel);
        if cancel.is_cancelled() {
            self.vertices.truncate(first);
            self.ends.truncate(first);
            return None;
        }
        let mut is_known = vec![false; count - first];
        for &(vertex, _) in &receivers {
            is_known[vertex as usize - first] = true;
        }
        for index in first..count {
            if !is_known[index - first] {
                self.ends[index] = hierarchy.mesh.vertices[index].ends;
            }
        }
        Some(
            self.vertices[first..]
                .iter()
                .map(|light| u64::from(light.shot))
                .sum(),
        )
    }

    fn shoot(
        &mut self,
        rays: &RayTree,
        receivers: &[(u32, Receiver)],
        samples: std::ops::Range<u32>,
        seed: u64,
        cancel: &Cancel,
    ) {
        let places: Vec<Receiver> = receivers.iter().map(|&(_, receiver)| receiver).collect();
        let mut known: Vec<DirectLight> = receivers
            .iter()
            .map(|&(vertex, _)| self.vertices[vertex as usize])
            .collect();
        self.lights
            .shoot(rays, &places, samples, seed, &mut known, cancel);
        for (&(vertex, _), light) in receivers.iter().zip(known) {
            self.vertices[vertex as usize] = light;
        }
    }

    /// Which vertices from `first` on share an element with one whose rays had another outcome.
    fn disputed(&self, hierarchy: &Hierarchy, first: usize) -> Vec<bool> {
        let mut disputed = vec![false; self.vertices.len() - first];
        for leaf in hierarchy.mesh.leaves() {
            let corners = hierarchy.mesh.elements[leaf]
                .vertices
                .map(|vertex| vertex as usize);
            if corners.iter().all(|&vertex| vertex < first) {
                continue;
            }
            let [a, b, c] = corners.map(|vertex| &self.vertices[vertex]);
            if !(a.agrees_with(b) && b.agrees_with(c) && c.agrees_with(a)) {
                for vertex in corners.into_iter().filter(|&vertex| vertex >= first) {
                    disputed[vertex - first] = true;
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
        let values = corners.map(|vertex| luminance(self.vertices[vertex as usize].irradiance()));
        let range = values.iter().copied().fold(0.0, f32::max)
            - values.iter().copied().fold(f32::MAX, f32::min);
        let share = hierarchy.mesh.elements[element].area_vector.length() / hierarchy.area as f32;
        range * share.sqrt() / mean.max(f32::MIN_POSITIVE)
    }

    /// Sample the centroids of leaves whose corners differ. Returns the rays shot.
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
                    && self.spread(hierarchy, leaf, mean) > limits.tolerance
            })
            .collect();
        let receivers: Vec<Receiver> = unknown
            .iter()
            .map(|&leaf| {
                let patch = hierarchy.patch_of(leaf);
                let point = hierarchy.mesh.elements[leaf].centroid;
                Receiver {
                    point,
                    normal: patch.normal,
                    triangle: patch.triangle,
                }
            })
            .collect();
        let mut lights = vec![DirectLight::default(); receivers.len()];
        self.lights.shoot(
            rays,
            &receivers,
            0..limits.shadow_samples,
            limits.seed,
            &mut lights,
            cancel,
        );
        if cancel.is_cancelled() {
            return None;
        }
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
                let [a, b, c] = element
                    .vertices
                    .map(|vertex| self.vertices[vertex as usize].irradiance());
                let bend = luminance((centre.irradiance() - (a + b + c) / 3.0).abs());
                let weight = (area / hierarchy.area as f32).sqrt() / mean.max(f32::MIN_POSITIVE);
                bend * weight + SPREAD_SHARE * self.spread(hierarchy, leaf, mean) > limits.tolerance
            })
            .map(|leaf| leaf as u32)
            .collect()
    }

    /// Bytes held.
    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(self.vertices.as_slice()) + size_of_val(self.centres.as_slice())
    }
}

/// Where to sample each vertex from `first` on that is a corner of a leaf: a little inside the leaf whose normal is
/// nearest to the mean normal about the vertex.
fn vertex_receivers(hierarchy: &Hierarchy, first: usize) -> Vec<(u32, Receiver)> {
    let mesh = &hierarchy.mesh;
    let count = mesh.vertices.len().saturating_sub(first);
    let mut normals = vec![Vec3::ZERO; count];
    for leaf in mesh.leaves() {
        for &vertex in &mesh.elements[leaf].vertices {
            if vertex as usize >= first {
                normals[vertex as usize - first] += mesh.elements[leaf].area_vector;
            }
        }
    }
    let mut chosen: Vec<Option<(f32, u32)>> = vec![None; count];
    for leaf in mesh.leaves() {
        let normal = hierarchy.patch_of(leaf).normal;
        for &vertex in &mesh.elements[leaf].vertices {
            if vertex as usize >= first {
                let slot = vertex as usize - first;
                let likeness = normals[slot].dot(normal);
                if chosen[slot].is_none_or(|(best, _)| likeness > best) {
                    chosen[slot] = Some((likeness, leaf as u32));
                }
            }
        }
    }
    let receiver = |(slot, choice): (usize, Option<(f32, u32)>)| {
        let (_, leaf) = choice?;
        let vertex = (first + slot) as u32;
        let patch = hierarchy.patch_of(leaf as usize);
        let point = mesh
            .position(vertex)
            .lerp(mesh.elements[leaf as usize].centroid, INSET);
        let normal = normals[slot].try_normalize().unwrap_or(patch.normal);
        Some((
            vertex,
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
