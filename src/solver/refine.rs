//! The refinement stage of a step: links, and elements for them, until their errors are below the threshold of the step.

use std::f32::consts::PI;

use glam::Vec3;
use rayon::prelude::*;

use super::{
    Cancel, Oracle, SolveSettings,
    budget::Budget,
    direct::{DirectField, Surfaces},
    iteration::LinkedLight,
    limits::Limits,
    plan::Plan,
    textures::Painted,
    vertices::LeafLight,
};
use crate::{
    geometry::RayTree,
    hierarchy::{Channels as _, Hierarchy, luminance},
    transport::{
        Estimate, Judge, LinkBudget, LinkStore, PairSampler, PatchSums, Refinement, Refiner,
    },
};

/// Where not even the links of the first step fit into memory, the threshold is raised by this factor, as often as
/// `MOST_RAISES`: then the root's exchange with itself is left.
const RAISE_FACTOR: f32 = 4.0;

/// Thresholds below this are raised to it first: a threshold of 0 would stay.
const LEAST_RAISED: f32 = 1e-4;

/// See [`RAISE_FACTOR`].
const MOST_RAISES: u32 = 16;

/// Refinement passes of one step at most: elements divided in one pass take their links over in the next.
const MOST_PASSES: u32 = 4;

/// Share of the mean irradiance that links are judged by even where their sources are dark. Smaller, and light is lost
/// wherever bright surfaces see dark ones; larger, and links are spent on what sends nothing.
const AMBIENT_SHARE: f32 = 0.1;

/// What refinement goes by.
#[derive(Clone, Copy)]
pub(super) struct Refining<'a> {
    pub settings: &'a SolveSettings,
    pub plan: &'a Plan,
    /// Limits of the step.
    pub limits: Limits,
    /// What blocks.
    pub rays: &'a RayTree,
    /// How textures look.
    pub painted: Painted<'a>,
    /// What leaves found over links in the last step.
    pub leaves: &'a [LeafLight],
    /// Mean irradiance (luminance), to which thresholds relate.
    pub mean_irradiance: f32,
    /// How many links and elements fit into memory.
    pub budget: Budget,
    pub cancel: &'a Cancel,
}

/// What came of refinement.
pub(super) struct Refined {
    /// The threshold that the links have.
    pub epsilon: f32,
    /// Rays shot.
    pub ray_count: u64,
    /// Whether memory kept links or elements from being finer.
    pub is_full: bool,
}

impl Refining<'_> {
    /// Bring the links to a threshold; source tables are up to date before and after. Where links do not fit into memory,
    /// those from before stay, and the first ones are made coarser. `None` when cancelled.
    pub(super) fn refine(
        &self,
        hierarchy: &mut Hierarchy,
        direct: &mut Option<DirectField>,
        linked: &mut LinkedLight,
        epsilon: f32,
    ) -> Option<Refined> {
        let mut refined = Refined {
            epsilon,
            ray_count: 0,
            is_full: false,
        };
        let (mut passes, mut raises) = (0, 0);
        let mut judged = None;
        while passes < MOST_PASSES {
            let is_first = linked.links.is_empty();
            let surfaces = Surfaces::new(hierarchy, direct);
            let found = self.pass(surfaces, linked, judged, refined.epsilon);
            self.cancel.proceed()?;
            // Where links do not fit, begin again with fewer, or leave those that there are.
            if !found.fits {
                refined.is_full = true;
                if !is_first || raises >= MOST_RAISES {
                    break;
                }
                raises += 1;
                refined.epsilon = (refined.epsilon * RAISE_FACTOR).max(LEAST_RAISED);
                continue;
            }
            passes += 1;
            // Where links did not fit, threads stopped at different places: their rays are not counted.
            if !self.plan.is_clear {
                refined.ray_count += found.ray_count;
            }
            let node_count = hierarchy.node_count();
            linked.links = LinkStore::from_runs(node_count, &found.runs, &found.links);
            judged = Some(node_count);
            // Divide the elements on which links err, as far as memory allows.
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
            if let Some(field) = direct {
                let (shot, _) = field.sample(self.rays, hierarchy, self.limits, self.cancel)?;
                refined.ray_count += shot;
            }
            linked.pull(Surfaces::new(hierarchy, direct));
        }
        Some(refined)
    }

    /// Judge all links and replace those that err too much; `judged` nodes were there when they were last judged by this
    /// threshold. Incomplete when cancelled.
    fn pass(
        &self,
        surfaces: Surfaces<'_>,
        linked: &LinkedLight,
        judged: Option<usize>,
        epsilon: f32,
    ) -> Refinement {
        let (hierarchy, settings) = (surfaces.hierarchy, self.settings);
        // How uneven sources are, where elements are divided for that.
        let spreads = match self.plan.follows_light {
            true => self.radiosity_spreads(surfaces, linked),
            false => Vec::new(),
        };
        // What points of clusters are chosen by.
        let areas = PatchSums::of_area(hierarchy, &linked.power);
        let powers = PatchSums::of_power(hierarchy, &linked.power);
        // The judge of pairs, and the walk over all of them.
        let refiner = Refiner {
            judge: Judge {
                kernel: linked.kernel(hierarchy, settings.method.reading()),
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
                },
            },
            links_of: |node| linked.links.of(node),
            judged,
            threshold: epsilon * self.mean_irradiance,
            min_area: self.limits.min_area,
            seed: settings.seed,
            cancelled: &|| self.cancel.is_cancelled(),
            budget: LinkBudget::new(self.budget.most_links(surfaces, linked)),
            is_by_patch: self.plan.is_by_patch,
            follows_light: self.plan.follows_light,
            spreads: &spreads,
        };
        refiner.refine(linked.links.is_empty())
    }

    /// By how much the radiosity of each leaf varies over it (half the range of its corners, luminance), as direct light is
    /// now and linked light was when it was last gathered, and by its textures. Of leaves divided since, the parts vary by
    /// half.
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
            let direct = surfaces.direct.map_or(0.0, |field| {
                let corners = elements[index].vertices;
                range(corners.map(|vertex| luminance(field.corner(vertex))))
            });
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

    /// By how much the radiosity of a leaf varies over it since its textures do (luminance).
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
        hierarchy::NodeId,
        scene::{
            SceneOptions,
            builtin::{empty_cornell, find_builtin},
        },
        solver::Solver,
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
    fn links_that_later_passes_leave_as_they_are_would_be_kept_if_they_were_judged_anew() {
        let cornell = find_builtin("cornell").unwrap().builder();
        for builder in [empty_cornell(), cornell] {
            let scene = Arc::new(builder.finish(&SceneOptions::default()).unwrap());
            let cancel = Cancel::default();
            let mut solver = Solver::new(scene, SolveSettings::draft(), None, &cancel).unwrap();
            solver.step(&cancel).unwrap();
            solver.step(&cancel).unwrap();
            // The links of another step, and what judging all of them anew by the same threshold makes of them.
            let surfaces = Surfaces::new(&solver.hierarchy, &solver.direct);
            solver.mean_irradiance = solver.linked.mean_irradiance(surfaces);
            let elements = solver.hierarchy.mesh.elements.len();
            solver.refine(1.0, &cancel);
            assert!(
                solver.hierarchy.mesh.elements.len() > elements,
                "there was a second pass"
            );
            let found = pairs(&solver);
            solver.refine(1.0, &cancel);
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
