//! Indirect light at vertices, gathered once more by rays where links are found to be wrong.
//!
//! A link knows of what stands between its ends only which part gets through, and it takes that part for the same all
//! over its receiver. In the corner between a floor and what stands on it that shows: light from beyond the object
//! leaks into the corner, however small the elements there are, and into closed rooms. So a few cosine-weighted rays from
//! each vertex probe at the radiosity of what they meet. Where vertices and their neighbours together find something else
//! than the links, many rays do. What rays met is remembered, so that it can be asked again once the light there has been
//! corrected, too: in a closed room that links light through its walls, nothing remains in the end. What is kept is a
//! factor by vertex, so that it holds for other lights on the same links, too.

use std::f32::consts::PI;

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::{
    gather_estimate::{GatherEstimate, factors},
    reconstruct::{LeafLight, VertexMeans},
};
use crate::{
    geometry::{Random, RayTree, barycentric, cosine_direction, low_discrepancy_2d},
    hierarchy::{Element, Hierarchy},
    solver::{
        Cancel,
        direct::Surfaces,
        iteration::Anderson,
        limits::Limits,
        places::{OffsetPlaces, Receiver, carry_over, vertex_share_roots},
    },
    transport::luminance,
};

/// Rays from each vertex. Fewer miss shallow corners, more cost time everywhere.
const MOST_PROBE_RAYS: u32 = 16;

/// Rays from all vertices, about: of large meshes fewer are shot from each. Fewer tell less than links do, more take longer
/// than all steps before.
const MOST_PROBE_RAYS_IN_ALL: usize = 1 << 21;

/// Rays from each vertex at least.
const LEAST_PROBE_RAYS: u32 = 2;

/// One of so many rays may meet a back. From a vertex that lies within something what rays find is dark, and would show
/// around it.
const RAYS_OF_BACK: u32 = 4;

/// Rays from a vertex in a corner at most. Fewer leave grain, more cost time there.
const MOST_GATHER_RAYS: u32 = 256;

/// Standard errors by which what a vertex and its neighbours find must differ from what links tell to be a corner.
/// Smaller gathers by chance, larger misses corners.
const DEVIATIONS: f32 = 1.5;

/// Part of the light that leaves a vertex that must be indirect for rays to probe at it: what a lamp reflects is not seen beside
/// what it emits.
const LEAST_INDIRECT: f32 = 0.1;

/// Times that all rays are asked again at most. Fewer leave light in closed white rooms, more change nothing that shows.
const MOST_ROUNDS: u32 = 64;

/// Rays are asked again until that changes no vertex by more than this part of the tolerance of sweeps, times the scene's
/// mean. Larger leaves light in closed rooms, where each round takes away what walls absorb; smaller takes time.
const CONVERGED_SHARE: f32 = 0.1;

/// Rounds that are remembered to accelerate them. Fewer take longer in white rooms, more gain nothing.
const DEPTH: usize = 3;

/// What a ray met.
#[derive(Clone, Copy)]
enum Met {
    /// Nothing that sends light.
    Nothing,
    /// The back of a one-sided surface.
    Back,
    /// A leaf, with the shares that its first two corners have in the light there.
    Leaf(u32, [f32; 2]),
}

/// What a leaf sends, from the light at its corners.
#[derive(Clone, Copy, Default)]
struct Sender {
    vertices: [u32; 3],
    reflectance: Vec4,
    emitted: Vec4,
}

impl Sender {
    /// Radiosity where the first two corners have these shares, of irradiance `received` at vertices and linear between
    /// them.
    fn radiosity(&self, [a, b]: [f32; 2], received: &[Vec4]) -> Vec4 {
        let [first, second, third] = self.vertices.map(|vertex| received[vertex as usize]);
        let irradiance = first * a + second * b + third * (1.0 - a - b);
        self.emitted + self.reflectance * irradiance
    }
}

/// A vertex that rays probe at.
struct VertexProbe {
    vertex: usize,
    place: Receiver,
    /// Linked irradiance.
    linked: Vec4,
    /// Luminance of all irradiance.
    all: f32,
    /// Root of the vertex's share of the area.
    weight: f32,
    /// Variance of the luminance that one ray meets, as links tell it; 0 where they carry no emission.
    variance: f32,
    met: Vec<Met>,
    found: GatherEstimate,
}

impl VertexProbe {
    /// Whether noise of what was found would show.
    fn is_noisy(&self, limits: Limits) -> bool {
        let (_, variance) = self.found.gap(self.linked, self.variance);
        limits.is_noise_visible(variance.sqrt(), self.all, self.weight)
    }
}

/// What a final gather needs.
#[derive(Clone, Copy)]
pub(crate) struct FinalGather<'a> {
    /// What rays meet, with its direct light.
    pub surfaces: Surfaces<'a>,
    /// What leaves found over links.
    pub leaves: &'a [LeafLight],
    /// The same for the square of the luminance, where links carry emission: a few rays do not find a small lamp, and only links
    /// tell how much it counts. Empty elsewhere.
    pub squares: &'a [LeafLight],
    /// What blocks.
    pub rays: &'a RayTree,
    /// Which noise shows.
    pub limits: Limits,
    /// Change of irradiance (luminance) of a vertex below which rays are not asked again.
    pub converged_change: f32,
    /// Stops it.
    pub cancel: &'a Cancel,
}

/// What a final gather finds.
pub(crate) struct GatherFactors {
    /// By vertex, what linked light is to be multiplied by; empty for 1.
    pub factors: Vec<Vec4>,
    /// Rays shot.
    pub ray_count: u64,
}

/// Change of irradiance of a vertex that is too small to ask rays again, for a tolerance of sweeps and the mean irradiance.
pub(crate) fn converged_change(tolerance: f32, mean_irradiance: f32) -> f32 {
    CONVERGED_SHARE * tolerance * mean_irradiance
}

impl FinalGather<'_> {
    /// Find by what linked light at vertices is to be multiplied; `None` when cancelled. Where nothing blocks, links tell all.
    pub(crate) fn run(self) -> Option<GatherFactors> {
        if self.rays.is_clear() {
            return Some(GatherFactors {
                factors: Vec::new(),
                ray_count: 0,
            });
        }
        let hierarchy = self.surfaces.hierarchy;
        // Light at vertices as links and shadow rays tell it.
        let linked = VertexMeans::new(hierarchy, self.leaves, &[]).irradiance;
        let direct: Vec<Vec4> = match self.surfaces.direct {
            Some(field) => field
                .shown(hierarchy)
                .into_iter()
                .map(|(light, _)| light)
                .collect(),
            None => vec![Vec4::ZERO; linked.len()],
        };
        let received: Vec<Vec4> = linked.iter().zip(&direct).map(|(a, b)| a + b).collect();
        // A few rays from each vertex.
        let mut probes = self.probes(&linked);
        let probe_rays = MOST_PROBE_RAYS_IN_ALL / probes.len().max(1);
        let probe_rays = (probe_rays as u32).clamp(LEAST_PROBE_RAYS, MOST_PROBE_RAYS);
        let senders = self.senders();
        let mut ray_count = self.shoot(&mut probes, |_| probe_rays)?;
        evaluate(&mut probes, &senders, &received);
        probes.retain(|probe| probe.found.backs * RAYS_OF_BACK <= probe.found.rays);
        // Many where these differ from links.
        let edges = edges(hierarchy);
        let is_corner = in_corners(&edges, hierarchy.mesh.vertices.len(), &probes, self.limits);
        let mut most = probe_rays;
        while most < MOST_GATHER_RAYS {
            most *= 2;
            let more = |probe: &VertexProbe| match is_corner[probe.vertex]
                && probe.is_noisy(self.limits)
            {
                true => most,
                false => probe.found.rays,
            };
            ray_count += self.shoot(&mut probes, more)?;
            evaluate(&mut probes, &senders, &received);
        }
        // What they mean for the light, until that agrees with itself.
        let light = [&linked, &direct].map(Vec::as_slice);
        let factors = self.converged_factors(&mut probes, &senders, &edges, light)?;
        Some(GatherFactors { factors, ray_count })
    }

    /// Correct linked and direct light at the vertices by what rays found, ask them again, and so on until nothing changes.
    /// Returns factors by vertex.
    fn converged_factors(
        &self,
        probes: &mut [VertexProbe],
        senders: &[Sender],
        edges: &[[usize; 2]],
        [linked, direct]: [&[Vec4]; 2],
    ) -> Option<Vec<Vec4>> {
        let mesh = &self.surfaces.hierarchy.mesh;
        let is_known = |element: &Element, side| !element.is_inside_solid_at(side);
        let areas = mesh.areas_about_vertices();
        let mut received: Vec<Vec4> = linked.iter().zip(direct).map(|(a, b)| a + b).collect();
        let mut acceleration = Anderson::new(DEPTH);
        let mut round = 0;
        loop {
            self.cancel.proceed()?;
            let mut ratios = vec![None; mesh.vertices.len()];
            for probe in &*probes {
                ratios[probe.vertex] = Some(probe.found.over(probe.linked, probe.variance));
            }
            let mut factors = factors(ratios, edges);
            carry_over(mesh, is_known, &mut factors);
            let lights = linked.iter().zip(direct).zip(&factors);
            let corrected: Vec<Vec4> = lights.map(|((l, d), factor)| l * *factor + d).collect();
            let changes = corrected.iter().zip(&received);
            let change = changes
                .map(|(new, old)| luminance((new - old).abs()))
                .fold(0.0, f32::max);
            round += 1;
            if change <= self.converged_change || round >= MOST_ROUNDS {
                return Some(factors);
            }
            received = acceleration.next(&areas, &received, &corrected);
            evaluate(probes, senders, &received);
        }
    }

    /// The vertices at which enough light is indirect, by linked irradiance.
    fn probes(&self, linked: &[Vec4]) -> Vec<VertexProbe> {
        let Surfaces { hierarchy, direct } = self.surfaces;
        let mesh = &hierarchy.mesh;
        let weights = vertex_share_roots(hierarchy);
        let emitted = emitted_as_irradiance(hierarchy);
        let squares = VertexMeans::new(hierarchy, self.squares, &[]).irradiance;
        let probe = |(vertex, place): (u32, Receiver)| {
            let linked = linked[vertex as usize];
            let direct = match direct {
                Some(field) => field.corner(vertex),
                None => Vec4::ZERO,
            };
            let all = luminance(linked + direct);
            let leaving = all + emitted[vertex as usize];
            let square = luminance(squares[vertex as usize]);
            (luminance(linked) > LEAST_INDIRECT * leaving).then(|| VertexProbe {
                vertex: vertex as usize,
                place,
                linked,
                all,
                weight: weights[vertex as usize],
                variance: (square - luminance(linked).powi(2)).max(0.0),
                met: Vec::new(),
                found: GatherEstimate::default(),
            })
        };
        let all = vec![true; mesh.vertices.len()];
        let elements = 0..mesh.elements.len();
        let none = OffsetPlaces::default();
        let offsets = direct.map_or(&none, |field| &field.offsets);
        let places = offsets.vertex_places(hierarchy, elements, &all);
        places.into_iter().filter_map(probe).collect()
    }

    /// Shoot rays until each vertex has had as many as are wanted. Returns the rays shot; `None` when cancelled.
    fn shoot(
        &self,
        probes: &mut [VertexProbe],
        wanted: impl Fn(&VertexProbe) -> u32 + Sync,
    ) -> Option<u64> {
        let shot: Vec<u32> = probes
            .par_iter_mut()
            .with_min_len(16)
            .map(|probe| {
                if self.cancel.is_cancelled() {
                    return 0;
                }
                let mut random = Random::new(self.limits.seed, probe.vertex as u64);
                let shift = random.uniform_2d();
                let (before, rays) = (probe.met.len() as u32, wanted(probe));
                for index in before..rays {
                    let square = low_discrepancy_2d(index, shift);
                    let direction = cosine_direction(probe.place.normal, square);
                    probe.met.push(self.meet(&probe.place, direction));
                }
                rays - before
            })
            .collect();
        self.cancel.proceed()?;
        Some(shot.into_iter().map(u64::from).sum())
    }

    /// What a ray meets first.
    fn meet(&self, from: &Receiver, direction: Vec3) -> Met {
        let hit = self
            .rays
            .closest(from.point, direction, Some(from.triangle));
        let Some(hit) = hit else {
            return Met::Nothing;
        };
        let hierarchy = self.surfaces.hierarchy;
        let Some(patch) = hierarchy.side_met(hit.triangle, direction) else {
            return Met::Back;
        };
        if !hierarchy.active_patches().contains(&patch) {
            return Met::Nothing;
        }
        let point = from.point + direction * hit.distance;
        let Some(leaf) = hierarchy.mesh.leaf_at(patch, point) else {
            return Met::Back;
        };
        let [a, b, _] = barycentric(point, hierarchy.mesh.corners(leaf)).to_array();
        Met::Leaf(leaf as u32, [a, b])
    }

    /// What each element sends over links if it is a leaf.
    fn senders(&self) -> Vec<Sender> {
        let hierarchy = self.surfaces.hierarchy;
        let elements = &hierarchy.mesh.elements;
        let sender = |index: usize| Sender {
            vertices: elements[index].vertices,
            reflectance: hierarchy.reflectance_of(index).extend(0.0),
            emitted: self.surfaces.radiosity(index, Vec4::ZERO).with_w(0.0),
        };
        (0..elements.len())
            .into_par_iter()
            .map(|index| {
                let element = &elements[index];
                let sends = element.is_leaf() && !element.is_inside_solid();
                if sends {
                    sender(index)
                } else {
                    Sender::default()
                }
            })
            .collect()
    }
}

/// By vertex, the irradiance (luminance) of which the elements about it would reflect as much light as they emit.
fn emitted_as_irradiance(hierarchy: &Hierarchy) -> Vec<f32> {
    let mesh = &hierarchy.mesh;
    let power = |leaf: usize, radiosity: Vec3| {
        mesh.elements[leaf].area_vector.length() * luminance(radiosity.extend(0.0))
    };
    let emitted = mesh.sums_about_vertices(|leaf| power(leaf, hierarchy.emission_of(leaf) * PI));
    let reflected = mesh.sums_about_vertices(|leaf| power(leaf, hierarchy.reflectance_of(leaf)));
    let ratios = emitted.into_iter().zip(reflected);
    ratios
        .map(|(emitted, reflected)| emitted / reflected.max(f32::MIN_POSITIVE))
        .collect()
}

/// Count the radiosity of what rays met, of irradiance `received` at vertices.
fn evaluate(probes: &mut [VertexProbe], senders: &[Sender], received: &[Vec4]) {
    let radiosity = |met: &Met| match *met {
        Met::Nothing => Some(Vec4::ZERO),
        Met::Back => None,
        Met::Leaf(leaf, shares) => Some(senders[leaf as usize].radiosity(shares, received)),
    };
    probes.par_iter_mut().with_min_len(64).for_each(|probe| {
        probe.found = GatherEstimate::default();
        for met in &probe.met {
            probe.found.count(radiosity(met));
        }
    });
}

/// Vertices at the ends of the edges of leaves; inner edges come twice.
fn edges(hierarchy: &Hierarchy) -> Vec<[usize; 2]> {
    let mesh = &hierarchy.mesh;
    let of = |leaf: usize| mesh.elements[leaf].edges();
    mesh.active_leaves().flat_map(of).collect()
}

/// Vertices that find something else than links tell, together with their neighbours, and these neighbours.
fn in_corners(
    edges: &[[usize; 2]],
    vertex_count: usize,
    probes: &[VertexProbe],
    limits: Limits,
) -> Vec<bool> {
    // Gap, its variance, and how many.
    let mut own = vec![(0.0f32, 0.0f32, 0.0f32); vertex_count];
    for probe in probes {
        let (gap, variance) = probe.found.gap(probe.linked, probe.variance);
        own[probe.vertex] = (gap, variance, 1.0);
    }
    let mut pooled = own.clone();
    for &[vertex, next] in edges {
        // An inner edge comes once from each end, so each neighbour is taken once, but at borders.
        let (sum, next) = (&mut pooled[vertex], own[next]);
        *sum = (sum.0 + next.0, sum.1 + next.1, sum.2 + next.2);
    }
    let mut differs = vec![false; vertex_count];
    for probe in probes {
        let (gap, variance, number) = pooled[probe.vertex];
        let is_visible = limits.is_visible(gap.abs() / number.max(1.0), probe.all, probe.weight);
        differs[probe.vertex] = is_visible && gap * gap > DEVIATIONS * DEVIATIONS * variance;
    }
    let mut wanted = differs.clone();
    for &[a, b] in edges {
        wanted[a] |= differs[b];
        wanted[b] |= differs[a];
    }
    wanted
}
