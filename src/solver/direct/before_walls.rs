//! Vertices that lie slightly behind a wall.
//!
//! Objects often reach slightly into walls, to avoid gaps. Their vertices there get no light, which would darken the
//! elements about them. So where rays from such a vertex meet only backs, its light is evaluated at an offset place
//! further inside the element, before the wall.

use rayon::prelude::*;

use super::{field::DirectField, samples::DirectLight};
use crate::{
    geometry::RayTree,
    hierarchy::Hierarchy,
    solver::{
        Cancel,
        limits::Limits,
        places::{OffsetPlace, inset, is_behind_wall},
    },
    transport::luminance,
};

/// Shares of the way from a vertex to the centroid of an element at which an offset place is sought. Smaller, and
/// vertices stay behind walls; larger, and they get light of another place.
const INSETS: [f32; 3] = [0.2, 0.35, 0.5];

/// Largest light of a vertex that is probed, as a share of the largest of its element. Smaller misses vertices where a
/// ray slips through an edge; larger probes penumbrae.
const DARK_SHARE: f32 = 0.1;

impl DirectField {
    /// Find offset places for vertices behind walls, and sample there. A vertex is probed once in each element, if it
    /// is dark and the element is not. Returns the rays shot; `None` when cancelled.
    pub(super) fn offset_before_walls(
        &mut self,
        rays: &RayTree,
        hierarchy: &Hierarchy,
        limits: Limits,
        cancel: &Cancel,
    ) -> Option<u64> {
        let count = hierarchy.mesh.vertices.len();
        self.offsets.probed_at.resize(count, u32::MAX);
        // Seek an offset place for each dark vertex beside light.
        let found: Vec<(u32, u32, (Option<OffsetPlace>, u64))> = self
            .dark_beside_light(hierarchy)
            .into_par_iter()
            .map(|(vertex, leaf)| match cancel.is_cancelled() {
                true => (vertex, leaf, (None, 0)),
                false => {
                    let found = before_wall(rays, hierarchy, vertex, leaf as usize);
                    (vertex, leaf, found)
                }
            })
            .collect();
        cancel.proceed()?;
        // Store these places.
        let mut shot = 0;
        let mut is_new = vec![false; count];
        for (vertex, leaf, (offset, rays)) in found {
            shot += rays;
            self.offsets.probed_at[vertex as usize] = leaf;
            if let Some(offset) = offset {
                self.offsets.by_vertex.insert(vertex, offset);
                self.vertices[vertex as usize] = Some(DirectLight::default());
                is_new[vertex as usize] = true;
            }
        }
        if !is_new.contains(&true) {
            return Some(shot);
        }
        // Sample there.
        let all = 0..hierarchy.mesh.elements.len();
        let receivers = self.receivers(hierarchy, all, |vertex, _| is_new[vertex]);
        let (samples, seed) = (limits.shadow_samples, limits.seed);
        self.shoot(rays, &receivers, samples, seed, cancel);
        if cancel.is_cancelled() {
            self.forget(&receivers);
            return None;
        }
        Some(shot + self.shot(&receivers))
    }

    /// Dark vertices, each with the brightest element about it, unless it was probed there.
    fn dark_beside_light(&self, hierarchy: &Hierarchy) -> Vec<(u32, u32)> {
        let mesh = &hierarchy.mesh;
        let mut lightest: Vec<Option<(f32, u32)>> = vec![None; self.vertices.len()];
        for leaf in mesh.active_leaves() {
            let element = &mesh.elements[leaf];
            let corners = element.vertices.map(|vertex| vertex as usize);
            let lights = corners.map(|vertex| self.vertices[vertex].unwrap_or_default());
            let seen = lights.map(|light| luminance(light.irradiance()));
            let most = seen.into_iter().fold(0.0, f32::max);
            if most <= 0.0 || !element.is_outside_solids() {
                continue;
            }
            let is_dark = |&side: &usize| lights[side].shot > 0 && seen[side] <= DARK_SHARE * most;
            for side in (0..3).filter(is_dark) {
                let lightest = &mut lightest[corners[side]];
                if lightest.is_none_or(|(best, _)| most > best) {
                    *lightest = Some((most, leaf as u32));
                }
            }
        }
        let found = lightest.into_iter().enumerate();
        found
            .filter_map(|(vertex, found)| Some((vertex as u32, found?.1)))
            .filter(|&(vertex, leaf)| self.offsets.probed_at[vertex as usize] != leaf)
            .collect()
    }
}

/// The offset place of a vertex in an element, if the vertex lies behind a wall and a part of the element does not; and
/// the rays shot.
fn before_wall(
    rays: &RayTree,
    hierarchy: &Hierarchy,
    vertex: u32,
    leaf: usize,
) -> (Option<OffsetPlace>, u64) {
    let (at, mesh) = (hierarchy.mesh.position(vertex), &hierarchy.mesh);
    let element = &mesh.elements[leaf];
    let place = |inset: f32| at.lerp(element.centroid, inset);
    let usual = inset(element, mesh.corners(leaf));
    let (is_dark, mut ray_count) = is_behind_wall(rays, hierarchy, leaf, place(usual));
    if !is_dark {
        return (None, ray_count);
    }
    for inset in INSETS.into_iter().filter(|&further| further > usual) {
        let place = place(inset);
        let (is_behind, shot) = is_behind_wall(rays, hierarchy, leaf, place);
        ray_count += shot;
        if !is_behind {
            return (Some(OffsetPlace { place, inset }), ray_count);
        }
    }
    (None, ray_count)
}
