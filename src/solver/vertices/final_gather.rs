//! Final gather: indirect light at vertices from rays, where the linked light is wrong.
//!
//! A link has one visibility for all of its receiver. In the corner between a floor and an object this is visible:
//! light from behind the object leaks into the corner, however small its elements are, and likewise into enclosed
//! rooms. So a few cosine-weighted rays from each vertex read the radiosity of the surfaces that they meet. Where
//! vertices and their neighbours together differ from the linked light, many rays are shot. The hits are stored, so
//! that their radiosity can be evaluated again after the light there has been corrected, too: in a dark enclosed room
//! into which links leak light, nothing remains in the end. The result is a factor by vertex, which also applies to
//! other light on the same links.

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::{
    gather_estimate::{GatherEstimate, factors},
    means::vertex_means,
    reconstruct::LeafLight,
};
use crate::{
    geometry::{Followed, Random, RayTree, barycentric, cosine_direction, low_discrepancy_2d},
    hierarchy::{Element, Hierarchy},
    solver::{
        Cancel,
        coverage::{Control, CoverageMap, HemisphereCoverage},
        direct::Surfaces,
        iteration::Anderson,
        limits::Limits,
        places::{LEAST_PART, Receiver, carry_over, emitted_as_irradiance, vertex_share_roots},
    },
    transport::luminance,
};

/// Rays from each vertex at first. Fewer miss shallow corners; more cost time everywhere.
const MOST_PROBE_RAYS: u32 = 16;

/// Approximate limit of the first rays from all vertices, for large meshes. Fewer are less precise than links; more
/// take longer than all steps before.
const MOST_PROBE_RAYS_IN_ALL: usize = 1 << 21;

/// Fewest rays from each vertex. Fewer find nothing; more take long for large meshes.
const LEAST_PROBE_RAYS: u32 = 2;

/// Fewest rays per ray that meets a back; vertices with more backs are inside an object, and have no estimate, since it
/// would darken their surroundings. Fewer leave dark spots; more exclude vertices near one-sided surfaces.
const RAYS_OF_BACK: u32 = 4;

/// Most rays from a vertex in a corner. Fewer leave grain; more cost time there.
const MOST_GATHER_RAYS: u32 = 256;

/// Difference from which the estimates of a vertex and its neighbours make a corner, in standard errors. Smaller shoots
/// many rays by chance; larger misses corners.
const DEVIATIONS: f32 = 1.5;

/// Most rounds of evaluation. Fewer leave light in enclosed white rooms; more change nothing visible.
const MOST_ROUNDS: u32 = 64;

/// Largest change of a vertex at which rounds end, in multiples of the tolerance of sweeps times the scene's mean.
/// Larger leaves light in enclosed rooms, where each round removes what walls absorb; smaller takes time.
const CONVERGED_SHARE: f32 = 0.1;

/// Rounds that acceleration remembers. Fewer take longer in white rooms; more gain nothing.
const DEPTH: usize = 3;

/// What a ray met.
#[derive(Clone, Copy)]
enum Met {
    /// Nothing, or an inactive surface.
    Nothing,
    /// The back of a one-sided surface.
    Back,
    /// A leaf, with the first two barycentric coordinates of the point.
    Leaf(u32, [f32; 2]),
}

/// A leaf as a source: its radiosity follows from the irradiance at its corners.
#[derive(Clone, Copy, Default)]
struct Sender {
    vertices: [u32; 3],
    reflectance: Vec4,
    emitted: Vec4,
}

impl Sender {
    /// Radiosity at these barycentric coordinates for the irradiance `received` at vertices, interpolated linearly.
    fn radiosity(&self, [a, b]: [f32; 2], received: &[Vec4]) -> Vec4 {
        let [first, second, third] = self.vertices.map(|vertex| received[vertex as usize]);
        let irradiance = first * a + second * b + third * (1.0 - a - b);
        self.emitted + self.reflectance * irradiance
    }
}

/// A vertex from which rays are shot.
struct VertexProbe {
    vertex: usize,
    place: Receiver,
    /// Linked irradiance.
    linked: Vec4,
    /// Luminance of the total irradiance.
    all: f32,
    /// Square root of the vertex's share of the area.
    weight: f32,
    /// Variance of the radiosity (luminance) that one ray meets, known from links; 0 where links carry no emission.
    variance: f32,
    /// Coverage, where an even sky gives it.
    coverage: Option<HemisphereCoverage>,
    met: Vec<Met>,
    /// The tints of these rays; empty where there is none.
    tints: Vec<Vec3>,
    found: GatherEstimate,
}

impl VertexProbe {
    /// Whether noise of the estimate is visible.
    fn is_noisy(&self, limits: Limits) -> bool {
        let (_, variance) = self.found.gap(self.linked, self.variance);
        limits.is_noise_visible(variance.sqrt(), self.all, self.weight)
    }
}

/// Input of a final gather.
#[derive(Clone, Copy)]
pub(crate) struct FinalGather<'a> {
    /// The elements, with their direct light.
    pub surfaces: Surfaces<'a>,
    /// Linked light of the leaves.
    pub leaves: &'a [LeafLight],
    /// The same for the square of the luminance, if links carry emission: a few rays miss a small lamp, so that only
    /// links give their variance. Empty otherwise.
    pub squares: &'a [LeafLight],
    /// Coverage at the vertices, where an even sky gives it.
    pub coverage: &'a CoverageMap,
    /// The occluders.
    pub rays: &'a RayTree,
    /// The visibility of errors and noise.
    pub limits: Limits,
    /// Change of irradiance (luminance) of a vertex at which rounds end.
    pub converged_change: f32,
    /// The request to stop.
    pub cancel: &'a Cancel,
}

/// Result of a final gather.
pub(crate) struct GatherFactors {
    /// Factor of the linked light by vertex; empty for 1.
    pub factors: Vec<Vec4>,
    /// Rays shot.
    pub ray_count: u64,
}

/// Change of irradiance (luminance) of a vertex at which rounds end, for a tolerance of sweeps and a mean irradiance.
pub(crate) fn converged_change(tolerance: f32, mean_irradiance: f32) -> f32 {
    CONVERGED_SHARE * tolerance * mean_irradiance
}

impl FinalGather<'_> {
    /// Find the factors of the linked light; `None` when cancelled. In a clear scene they are 1.
    pub(crate) fn run(self) -> Option<GatherFactors> {
        if self.rays.is_clear() {
            return Some(GatherFactors {
                factors: Vec::new(),
                ray_count: 0,
            });
        }
        let hierarchy = self.surfaces.hierarchy;
        // Light at vertices from links and from shadow rays.
        let linked = vertex_means(hierarchy, self.leaves, &[]);
        let direct = self.surfaces.direct.shown(hierarchy);
        let direct = direct.unwrap_or_else(|| vec![Vec4::ZERO; linked.len()]);
        let received: Vec<Vec4> = linked.iter().zip(&direct).map(|(a, b)| a + b).collect();
        // A few rays from each vertex.
        let mut probes = self.probes(&linked);
        let probe_rays = MOST_PROBE_RAYS_IN_ALL / probes.len().max(1);
        let probe_rays = (probe_rays as u32).clamp(LEAST_PROBE_RAYS, MOST_PROBE_RAYS);
        let senders = self.senders();
        let mut ray_count = self.shoot(&mut probes, |_| probe_rays)?;
        evaluate(&mut probes, &senders, &received);
        probes.retain(|probe| probe.found.backs * RAYS_OF_BACK <= probe.found.rays);
        // Many where these differ from the linked light.
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
        // The factors for which the light is consistent.
        let light = [&linked, &direct].map(Vec::as_slice);
        let factors = self.converged_factors(&mut probes, &senders, &edges, light)?;
        Some(GatherFactors { factors, ray_count })
    }

    /// Correct the linked light at the vertices by the estimates and evaluate the rays again, until the light
    /// converges. Returns factors by vertex.
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

    /// The vertices at which enough light is indirect, given the linked irradiance.
    fn probes(&self, linked: &[Vec4]) -> Vec<VertexProbe> {
        let Surfaces {
            hierarchy, direct, ..
        } = self.surfaces;
        let mesh = &hierarchy.mesh;
        let weights = vertex_share_roots(hierarchy);
        let emitted = emitted_as_irradiance(hierarchy);
        let squares = vertex_means(hierarchy, self.squares, &[]);
        let probe = |(vertex, place): (u32, Receiver)| {
            let linked = linked[vertex as usize];
            let all = luminance(linked + direct.corner(vertex));
            let leaving = all + emitted[vertex as usize];
            let square = luminance(squares[vertex as usize]);
            (luminance(linked) > LEAST_PART * leaving).then(|| VertexProbe {
                vertex: vertex as usize,
                place,
                linked,
                all,
                weight: weights[vertex as usize],
                variance: (square - luminance(linked).powi(2)).max(0.0),
                coverage: self.coverage.at_vertex(vertex),
                met: Vec::new(),
                tints: Vec::new(),
                found: GatherEstimate::default(),
            })
        };
        let all = vec![true; mesh.vertices.len()];
        let elements = 0..mesh.elements.len();
        let places = direct.offsets().vertex_places(hierarchy, elements, &all);
        places.into_iter().filter_map(probe).collect()
    }

    /// Shoot rays until each vertex has had the wanted number. Returns the rays shot; `None` when cancelled.
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
                    let (met, tint) = self.meet(&probe.place, direction);
                    probe.met.push(met);
                    probe.tints.extend(tint);
                }
                rays - before
            })
            .collect();
        self.cancel.proceed()?;
        Some(shot.into_iter().map(u64::from).sum())
    }

    /// What a ray meets over the mirrors on its way, and its tint where there may be one.
    fn meet(&self, from: &Receiver, direction: Vec3) -> (Met, Option<Vec3>) {
        let end = self
            .rays
            .followed(from.point, direction, Some(from.triangle));
        (self.met(&end), self.rays.has_tints().then_some(end.tint))
    }

    /// What a ray met by the triangle that it hit.
    fn met(&self, end: &Followed) -> Met {
        let Followed { hit, direction, .. } = *end;
        let Some(hit) = hit else {
            return Met::Nothing;
        };
        let hierarchy = self.surfaces.hierarchy;
        let Some(patch) = hierarchy.side_met(hit.triangle, direction) else {
            // Through a pane one gets behind it.
            return match self.rays.is_see_through(hit.triangle) {
                true => Met::Nothing,
                false => Met::Back,
            };
        };
        if !hierarchy.active_patches().contains(&patch) {
            return Met::Nothing;
        }
        let point = end.origin + direction * hit.distance;
        let Some(leaf) = hierarchy.mesh.leaf_at(patch, point) else {
            return Met::Back;
        };
        let [a, b, _] = barycentric(point, hierarchy.mesh.corners(leaf)).to_array();
        Met::Leaf(leaf as u32, [a, b])
    }

    /// All leaves outside solids as sources, by element.
    fn senders(&self) -> Vec<Sender> {
        let hierarchy = self.surfaces.hierarchy;
        let elements = &hierarchy.mesh.elements;
        let sender = |index: usize| {
            // Of what rays meet, where some pass.
            let met = 1.0 / hierarchy.opacity_of(index).max(f32::MIN_POSITIVE);
            Sender {
                vertices: elements[index].vertices,
                reflectance: (hierarchy.reflectance_of(index) * met).extend(0.0),
                emitted: self.surfaces.radiosity(index, Vec4::ZERO).with_w(0.0) * met,
            }
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

/// Evaluate the estimates from the hits of all rays, for the irradiance `received` at vertices.
fn evaluate(probes: &mut [VertexProbe], senders: &[Sender], received: &[Vec4]) {
    let radiosity = |met: &Met| match *met {
        Met::Nothing => Some(Vec4::ZERO),
        Met::Back => None,
        Met::Leaf(leaf, shares) => Some(senders[leaf as usize].radiosity(shares, received)),
    };
    probes.par_iter_mut().with_min_len(64).for_each(|probe| {
        let control = probe.coverage.map_or_else(Control::default, |coverage| {
            coverage.control(probe.linked, probe.met.len() as u32)
        });
        probe.found = GatherEstimate::beside(control.irradiance);
        for (ray, met) in probe.met.iter().enumerate() {
            let tint = probe.tints.get(ray).copied().unwrap_or(Vec3::ONE);
            let expected = match met {
                Met::Leaf(..) => control.radiosity * (tint.element_sum() / 3.0),
                Met::Nothing | Met::Back => Vec4::ZERO,
            };
            let met = radiosity(met).map(|radiosity| radiosity * tint.extend(1.0) - expected);
            probe.found.count(met);
        }
    });
}

/// The edges of leaves, as pairs of vertices; inner edges come twice.
fn edges(hierarchy: &Hierarchy) -> Vec<[usize; 2]> {
    let mesh = &hierarchy.mesh;
    let of = |leaf: usize| mesh.elements[leaf].edges();
    mesh.active_leaves().flat_map(of).collect()
}

/// Whether the estimates of a vertex and its neighbours differ from the linked light, or those of a neighbour do; by
/// vertex.
fn in_corners(
    edges: &[[usize; 2]],
    vertex_count: usize,
    probes: &[VertexProbe],
    limits: Limits,
) -> Vec<bool> {
    // The difference, its variance, and the number of vertices.
    let mut own = vec![(0.0f32, 0.0f32, 0.0f32); vertex_count];
    for probe in probes {
        let (gap, variance) = probe.found.gap(probe.linked, probe.variance);
        own[probe.vertex] = (gap, variance, 1.0);
    }
    let mut pooled = own.clone();
    for &[vertex, next] in edges {
        // An inner edge comes once from each end, so each neighbour is added once, except at borders.
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

#[cfg(test)]
mod tests;
