//! The refinement stage of a step: links, and elements for them, until their errors are below the threshold of the
//! step.

use std::f32::consts::PI;

use glam::Vec3;
use rayon::prelude::*;

use super::{
    Cancel, Direct, Oracle, SolveSettings,
    budget::Budget,
    direct::{DirectFields, Surfaces},
    iteration::LinkedLight,
    limits::Limits,
    plan::Plan,
    schedule::is_large,
    settings::FINEST_THRESHOLD,
    textures::Painted,
    vertices::LeafLight,
};
use crate::{
    geometry::{Image, Random, RayTree},
    hierarchy::{Channels as _, Hierarchy, NodeId, luminance},
    transport::{
        Estimate, Judge, Kernel, Link, LinkBudget, LinkStore, PairSampler, PatchSums, Refinement,
        Refiner,
    },
};

/// Factor by which the threshold is raised where the links of the first step do not fit into memory, up to
/// `MOST_RAISES` times: then only the root's exchange with itself remains. Smaller, and many passes are in vain;
/// larger, and links are coarser than memory requires.
const RAISE_FACTOR: f32 = 4.0;

/// See [`RAISE_FACTOR`].
const MOST_RAISES: u32 = 16;

/// Most refinement passes of one step: elements that one pass divides get their links in the next. Fewer, and links
/// stay coarse; more, and time goes into ever fewer elements.
const MOST_PASSES: u32 = 4;

/// Most links of an element for each bounce of the light, where rays of the final gather can do what finer links would: they
/// set right the last bounce, and the errors of all others add up. In clutter no link is sure of its visibility, and links
/// multiply far beyond what they gain: a carriage with poles and straps has 32 million at `normal` without a limit, in 3.4
/// times the time, for an error of 8 % instead of 11 %. Smaller, and light is lost between white walls, and 2 % of it in a
/// carriage at `draft`; larger, and clutter takes long.
const MOST_LINKS_OF_BOUNCE: f64 = 16.0;

/// Ambient radiosity by which links are judged, as a share of the mean irradiance. Smaller, and light is lost wherever
/// bright surfaces see dark ones; larger, and links are spent on dark sources.
const AMBIENT_SHARE: f32 = 0.1;

/// Input of the refinement stage.
#[derive(Clone, Copy)]
pub(super) struct Refining<'a> {
    pub settings: &'a SolveSettings,
    pub plan: &'a Plan,
    /// Limits of the step.
    pub limits: Limits,
    /// The occluders.
    pub rays: &'a RayTree,
    /// Textures and appearances.
    pub painted: Painted<'a>,
    /// Linked light of the leaves after the last step.
    pub leaves: &'a [LeafLight],
    /// Mean irradiance (luminance), to which thresholds relate.
    pub mean_irradiance: f32,
    /// The memory limit.
    pub budget: Budget,
    pub cancel: &'a Cancel,
}

/// Result of the refinement stage.
pub(super) struct Refined {
    /// The threshold that the links meet.
    pub epsilon: f32,
    /// Rays shot.
    pub ray_count: u64,
    /// Whether the memory limit prevented finer links or elements.
    pub is_full: bool,
    /// Whether links stay coarser than the threshold, since rays gain more than finer ones.
    pub is_limited: bool,
}

impl Refining<'_> {
    /// Refine the links to a threshold; source tables are up to date before and after. Where the new links do not fit
    /// into memory, the present ones stay; the first ones are made coarser. `None` when cancelled.
    pub(super) fn refine(
        &self,
        hierarchy: &mut Hierarchy,
        direct: &mut DirectFields,
        linked: &mut LinkedLight,
        epsilon: f32,
    ) -> Option<Refined> {
        let mut refined = Refined {
            epsilon,
            ray_count: 0,
            is_full: false,
            is_limited: linked.is_limited(hierarchy.mesh.elements.len()),
        };
        let (mut passes, mut raises) = (0, 0);
        let mut judged = None;
        while passes < MOST_PASSES && !refined.is_limited {
            let is_first = linked.links.is_empty();
            let surfaces = Surfaces::new(hierarchy, direct);
            let (fitting, paying) = self.most_links(surfaces, linked);
            let most = fitting.min(paying);
            let found = self.pass(surfaces, linked, None, judged, (refined.epsilon, most));
            self.cancel.proceed()?;
            // Where finer links do not pay, leave the present ones.
            if !found.fits && paying <= fitting {
                linked.limit(hierarchy.mesh.elements.len());
                refined.is_limited = true;
                break;
            }
            // Where they do not fit, start again with fewer, or leave the present ones.
            if !found.fits {
                refined.is_full = true;
                if !is_first || raises >= MOST_RAISES {
                    break;
                }
                raises += 1;
                refined.epsilon = (refined.epsilon * RAISE_FACTOR).max(FINEST_THRESHOLD);
                continue;
            }
            passes += 1;
            // Rays of a pass that did not fit depend on the threads, so they are not counted.
            if !self.plan.is_clear {
                refined.ray_count += found.ray_count;
            }
            let node_count = hierarchy.node_count();
            linked.links = LinkStore::from_runs(node_count, &found.runs, &found.links);
            linked.threshold = refined.epsilon;
            judged = Some(node_count);
            // Divide the elements whose links err, if memory allows.
            let surfaces = Surfaces::new(hierarchy, direct);
            let most_elements = self.budget.most_elements(surfaces, linked);
            let fits = hierarchy.mesh.fits(&found.wanted, most_elements);
            refined.is_full |= !fits;
            if !fits || !hierarchy.mesh.divide(&found.wanted) {
                break;
            }
            // Light of the new elements.
            hierarchy.color_new_elements(self.painted.scene, self.painted.appearances);
            linked.extend(hierarchy);
            refined.ray_count += direct.sample(self.rays, hierarchy, self.limits, self.cancel)?;
            linked.pull(Surfaces::new(hierarchy, direct));
        }
        refined.epsilon = linked.threshold;
        self.refine_images(Surfaces::new(hierarchy, direct), linked, &mut refined)?;
        if self.rays.has_coloured_panes() {
            refined.ray_count += self.tint_links(hierarchy, linked)?;
        }
        Some(refined)
    }

    /// The numbers of links that fit into memory, and that pay.
    fn most_links(&self, surfaces: Surfaces<'_>, linked: &LinkedLight) -> (u64, u64) {
        let elements = surfaces.hierarchy.mesh.elements.len();
        // Rays tell nothing of small emitters, and nothing at all where there is no final gather; the first links are coarse.
        let are_needed = self.settings.direct == Direct::Linked || self.plan.is_clear;
        let paying = if are_needed || linked.links.is_empty() || !is_large(elements) {
            u64::MAX
        } else {
            let most = MOST_LINKS_OF_BOUNCE * linked.bounces(surfaces);
            (most * elements as f64) as u64
        };
        (self.budget.most_links(surfaces, linked), paying)
    }

    /// Refine the links over mirrors to the same threshold, without division of elements. Where they do not fit into memory,
    /// the present ones stay. `None` when cancelled.
    fn refine_images(
        &self,
        surfaces: Surfaces<'_>,
        linked: &mut LinkedLight,
        refined: &mut Refined,
    ) -> Option<()> {
        for number in 0..linked.images.len() {
            let image = linked.images[number].image.clone();
            // What mirrors take, they take of errors, too.
            let epsilon = refined.epsilon / image.reflectance().max_element();
            let seen = (&*image, &linked.images[number].links);
            let most = self.budget.most_links(surfaces, linked);
            let found = self.pass(surfaces, linked, Some(seen), None, (epsilon, most));
            self.cancel.proceed()?;
            if !found.fits {
                refined.is_full = true;
                continue;
            }
            refined.ray_count += found.ray_count;
            let node_count = surfaces.hierarchy.node_count();
            linked.images[number].links =
                LinkStore::from_runs(node_count, &found.runs, &found.links);
        }
        Some(())
    }

    /// Estimate what coloured panes make of the light of each link. Returns the rays shot; `None` when cancelled.
    fn tint_links(&self, hierarchy: &Hierarchy, linked: &mut LinkedLight) -> Option<u64> {
        let areas = PatchSums::of_area(hierarchy, &linked.power);
        let powers = PatchSums::of_power(hierarchy, &linked.power);
        let sampler = PairSampler {
            hierarchy,
            tables: &linked.power,
            areas: &areas,
            powers: &powers,
            rays: self.rays,
            image: None,
        };
        let links = &linked.links;
        let found: Vec<(Vec3, u32)> = (0..hierarchy.node_count() as u32)
            .into_par_iter()
            .flat_map_iter(|receiver| {
                let of_link = move |link: &Link| {
                    // Nothing passes, or all of every ray.
                    if [0.0, 1.0].contains(&link.light_factor()) || self.cancel.is_cancelled() {
                        return (Vec3::ONE, 0);
                    }
                    let pair = (u64::from(link.source.0) << 32) | u64::from(receiver);
                    let mut random = Random::new(self.settings.seed, pair);
                    sampler.tint(link.source, NodeId(receiver), &mut random)
                };
                links.of(NodeId(receiver)).iter().map(of_link)
            })
            .collect();
        self.cancel.proceed()?;
        let (tints, rays): (Vec<Vec3>, Vec<u32>) = found.into_iter().unzip();
        linked.links.tint(tints);
        Some(rays.into_iter().map(u64::from).sum())
    }

    /// Judge all links, or those from an image in mirrors, and replace those whose errors exceed the threshold. `judged` is
    /// the number of nodes when they were last judged by it. Incomplete when cancelled, and where links exceed `most`.
    fn pass(
        &self,
        surfaces: Surfaces<'_>,
        linked: &LinkedLight,
        seen: Option<(&Image, &LinkStore)>,
        judged: Option<usize>,
        (epsilon, most): (f32, u64),
    ) -> Refinement {
        let (hierarchy, settings) = (surfaces.hierarchy, self.settings);
        // Variation of the sources, where elements are divided by it.
        let spreads = match self.plan.follows_light {
            true => self.radiosity_spreads(surfaces, linked),
            false => Vec::new(),
        };
        // Sums by which points of clusters are sampled.
        let areas = PatchSums::of_area(hierarchy, &linked.power);
        let powers = PatchSums::of_power(hierarchy, &linked.power);
        // The judge of pairs, and the walk over all of them.
        let image = seen.map(|(image, _)| image);
        let links = seen.map_or(&linked.links, |(_, links)| links);
        let refiner = Refiner {
            judge: Judge {
                kernel: Kernel {
                    image,
                    ..linked.kernel(hierarchy, settings.method.reading())
                },
                estimate: match settings.oracle {
                    Oracle::Interval => Estimate::Interval,
                    Oracle::Samples => Estimate::Samples(settings.samples),
                },
                ambient: AMBIENT_SHARE * self.mean_irradiance,
                sampler: PairSampler {
                    hierarchy,
                    tables: &linked.power,
                    areas: &areas,
                    powers: &powers,
                    rays: self.rays,
                    image,
                },
            },
            links_of: |node| links.of(node),
            judged,
            threshold: epsilon * self.mean_irradiance,
            min_area: self.limits.min_area,
            seed: settings.seed,
            cancelled: &|| self.cancel.is_cancelled(),
            budget: LinkBudget::new(most),
            is_by_patch: self.plan.is_by_patch,
            follows_light: self.plan.follows_light,
            spreads: &spreads,
        };
        refiner.refine(links.is_empty())
    }

    /// By element, the variation of the radiosity of a leaf (half the range of its corners, luminance), from the
    /// present direct light, the linked light when it was last gathered, and the textures. A child of an element that
    /// was divided since varies by half as much.
    fn radiosity_spreads(&self, surfaces: Surfaces<'_>, linked: &LinkedLight) -> Vec<f32> {
        let hierarchy = surfaces.hierarchy;
        let elements = &hierarchy.mesh.elements;
        // Light over links.
        let mut gathered = vec![0.0; elements.len()];
        for light in self.leaves {
            gathered[light.element as usize] = range(light.corners.map(luminance));
        }
        for index in 0..elements.len() {
            for child in elements[index].children() {
                gathered[child] = f32::max(gathered[child], gathered[index] * 0.5);
            }
        }
        // With direct light and textures.
        let spread = |index: usize| {
            let corners = elements[index].vertices;
            let direct = range(corners.map(|vertex| luminance(surfaces.direct.corner(vertex))));
            let reflectance = luminance(hierarchy.reflectance_of(index).extend(0.0));
            0.5 * reflectance * (gathered[index] + direct)
                + self.texture_spread(surfaces, linked, index)
        };
        let all = elements.par_iter().enumerate();
        all.map(|(index, element)| {
            if element.is_leaf() {
                spread(index)
            } else {
                0.0
            }
        })
        .collect()
    }

    /// Variation of the radiosity of a leaf due to its textures (luminance).
    fn texture_spread(&self, surfaces: Surfaces<'_>, linked: &LinkedLight, leaf: usize) -> f32 {
        let Some(deviation) = self.painted.deviation(surfaces.hierarchy, leaf) else {
            return 0.0;
        };
        let reflected = deviation.reflectance * linked.total(surfaces, leaf).color();
        let emitted = match surfaces.is_sampled(leaf) {
            true => Vec3::ZERO,
            false => deviation.emission * PI,
        };
        luminance((reflected + emitted).extend(0.0))
    }
}

/// Largest minus smallest.
fn range(corners: [f32; 3]) -> f32 {
    let [least, most] = [f32::min, f32::max].map(|of| corners.into_iter().fold(corners[0], of));
    most - least
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{
        scene::{
            SceneOptions,
            builtin::{empty_cornell, find_builtin},
        },
        solver::{Solver, StepReport},
    };

    /// Receivers and sources of all links, in order.
    fn pairs(solver: &Solver) -> Vec<(u32, u32)> {
        let receivers = 0..solver.hierarchy.node_count() as u32;
        let of = |receiver: u32| {
            let links = solver.linked.links.of(NodeId(receiver)).iter();
            links.map(move |link| (receiver, link.source.0))
        };
        let mut pairs: Vec<(u32, u32)> = receivers.flat_map(of).collect();
        pairs.sort_unstable();
        pairs
    }

    #[test]
    fn links_that_later_passes_skip_would_stay_if_they_were_judged_again() {
        let cornell = find_builtin("cornell").unwrap().builder();
        for builder in [empty_cornell(), cornell] {
            let scene = Arc::new(builder.finish(&SceneOptions::default()).unwrap());
            let cancel = Cancel::default();
            let mut solver = Solver::new(scene, SolveSettings::draft(), None, &cancel).unwrap();
            solver.step(&cancel).unwrap();
            solver.step(&cancel).unwrap();
            // The links of another step, and the links after judging all of them again by the same threshold.
            let surfaces = Surfaces::new(&solver.hierarchy, &solver.direct);
            solver.mean_irradiance = solver.linked.mean_irradiance(surfaces);
            let elements = solver.hierarchy.mesh.elements.len();
            solver.refine(1.0, &mut StepReport::default(), &cancel);
            assert!(
                solver.hierarchy.mesh.elements.len() > elements,
                "there was a second pass"
            );
            let found = pairs(&solver);
            solver.refine(1.0, &mut StepReport::default(), &cancel);
            let anew = pairs(&solver);
            let is_other = |pair: &&(u32, u32)| found.binary_search(pair).is_err();
            let changed = anew.iter().filter(is_other).count();
            assert!(
                changed * 100 < found.len(),
                "{}: {changed} of {}",
                solver.scene.name,
                found.len()
            );
        }
    }
}
