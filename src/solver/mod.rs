//! The solve as a value: [`Solver::new`], [`Solver::step`], [`Solver::snapshot`].
//! No threads of its own, no channel, no clock, no global.
//!
//! A step lowers the threshold, divides elements where direct light bends, refines the links that exist, iterates
//! gathering and pushing until the light settles, and gathers once more for the vertices.

mod adapt;
mod anderson;
mod balance;
mod before_walls;
mod border;
mod budget;
mod clear;
mod closure;
mod contact;
mod cover;
mod direct;
mod display;
mod emitter;
mod final_gather;
mod gather;
mod gathered;
mod inspect;
mod inspection;
mod iterate;
mod light_parts;
mod light_tree;
mod multipole;
mod offset_places;
mod omission;
mod panel;
mod places;
mod plan;
mod prober;
mod reconstruct;
mod relight;
mod report;
mod seams;
mod settings;
mod smooth;
mod snapshot;
mod textures;

use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};

use glam::{Vec3, Vec4};

pub use inspection::{InspectedLink, Inspection, PathNode, Place, Subject};
pub use omission::{Keep, Omission};
pub use plan::LeftOut;
pub use relight::Relit;
pub use settings::{Direct, Method, Oracle, Push, SolveSettings};
pub use snapshot::{ClusterBox, DisplayMesh, Snapshot, StepReport, VertexLight};

use crate::{
    geometry::RayTree,
    hierarchy::{Hierarchy, Reading, SheetSides, Tables},
    scene::{ActiveMaterials, Appearance, Scene},
    transport::{
        Estimate, Judge, Kernel, LinkBudget, LinkStore, PairSampler, PatchSums, Refiner, luminance,
    },
};
use adapt::DirectField;
use closure::Closures;
use direct::Lights;
use offset_places::OffsetPlaces;
use plan::Plan;
use reconstruct::LeafLight;
use relight::Relighting;

/// A request to stop, seen by everything that runs long. Clones share one flag.
#[derive(Clone, Debug, Default)]
pub struct Cancel(Arc<AtomicBool>);

impl Cancel {
    /// Ask to stop.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether stopping was asked for.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// `None` where stopping was asked for.
    pub(super) fn proceed(&self) -> Option<()> {
        (!self.is_cancelled()).then_some(())
    }
}

/// Shadow rays before the first picture, about: of large meshes fewer are shot from each vertex, so that the picture
/// comes soon; the first step shoots the others.
const FIRST_RAYS: usize = 1 << 20;

/// The threshold falls by this factor from step to step. Larger, and steps come late; smaller, and judging old links
/// again costs more than the new ones.
const THRESHOLD_FACTOR: f32 = 2.0;

/// Steps whose thresholds are at least this many times the last one's are coarse: their links err by more than a few rays
/// do. Smaller, and the first pictures come later; larger, and they are rougher than their links.
const COARSE_THRESHOLD_SCALE: f32 = 4.0;

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

/// A solve in progress.
pub struct Solver {
    scene: Arc<Scene>,
    settings: SolveSettings,
    plan: Plan,
    memory_limit: Option<u64>,
    /// Blocks nothing where the plan says so.
    rays: Arc<RayTree>,
    hierarchy: Hierarchy,
    /// What links carry: reflected light, and emission where it is linked.
    power: Tables,
    links: LinkStore,
    direct: Option<DirectField>,
    /// Linked irradiance of every element, scaled so that form factors add to the closure; `w` is their raw sum.
    linked: Vec<Vec4>,
    /// By element, what its radiosity is multiplied by before links carry it (see [`balance`]); 1 without links.
    sending: Vec<f32>,
    /// Part of the view of each piece of surface that lit surfaces fill.
    closures: Closures,
    leaves: Vec<LeafLight>,
    /// By what linked light at each vertex is multiplied; empty for 1.
    gathered: Vec<Vec4>,
    mean_irradiance: f32,
    /// Whether the memory limit kept the last step from being finer.
    is_full: bool,
    step: u32,
    ray_count: u64,
    relighting: Relighting,
    snapshot: Snapshot,
}

impl Solver {
    /// Prepare a solve: plan, hierarchy, ray tree, first mesh. `memory_limit` in bytes bounds what it will hold.
    /// Returns `None` when cancelled on the way.
    pub fn new(
        scene: Arc<Scene>,
        settings: SolveSettings,
        memory_limit: Option<u64>,
        cancel: &Cancel,
    ) -> Option<Self> {
        Self::with_rays(scene, None, settings, memory_limit, None, cancel)
    }

    /// As [`Self::new`], with the scene's ray tree where there is one already, and for materials that look so, where not as
    /// the scene says. What one of both needs is not left out, so that what is switched off may be switched on.
    pub fn with_rays(
        scene: Arc<Scene>,
        rays: Option<Arc<RayTree>>,
        settings: SolveSettings,
        memory_limit: Option<u64>,
        wished: Option<&[Appearance]>,
        cancel: &Cancel,
    ) -> Option<Self> {
        cancel.proceed()?;
        let is_cancelled = || cancel.is_cancelled();
        let active = wished.map_or_else(ActiveMaterials::default, |wished| {
            scene.active_materials(&scene.allowed(wished))
        });
        let mut rays = rays;
        let sheets = SheetSides::of(&scene, &mut rays);
        cancel.proceed()?;
        let (plan, tree) = Plan::make(&scene, sheets.as_ref(), &settings, active, &is_cancelled)?;
        // Both take about as long, and neither keeps all processors busy.
        let (hierarchy, rays) = rayon::join(
            || {
                Hierarchy::of_tree(&scene, tree, settings.crease_degrees, &|| {
                    cancel.is_cancelled()
                })
            },
            || match rays {
                _ if plan.is_clear => Arc::new(RayTree::clear()),
                Some(rays) => rays,
                None => Arc::new(RayTree::new(&scene)),
            },
        );
        let hierarchy = hierarchy?;
        cancel.proceed()?;
        let mut solver = Self {
            closures: Closures::default(),
            power: Tables::default(),
            links: LinkStore::default(),
            direct: None,
            linked: vec![Vec4::ZERO; hierarchy.mesh.elements.len()],
            sending: vec![1.0; hierarchy.mesh.elements.len()],
            leaves: Vec::new(),
            gathered: Vec::new(),
            mean_irradiance: 0.0,
            is_full: false,
            step: 0,
            ray_count: 0,
            relighting: Relighting::new(&scene),
            snapshot: Snapshot::default(),
            scene,
            settings,
            plan,
            memory_limit,
            rays,
            hierarchy,
        };
        solver.divide_by_textures();
        let lights = Lights::new(&solver.scene, &solver.hierarchy, solver.settings.direct);
        solver.direct = (!lights.is_empty()).then(|| DirectField::new(lights));
        cancel.proceed()?;
        solver.first_light(cancel)?;
        solver.pull();
        solver.show(cancel)?;
        if let Some(wished) = wished {
            solver.relight(wished, cancel)?;
        }
        Some(solver)
    }

    /// Sample direct light on the first mesh, so that there is something to see before the first link.
    fn first_light(&mut self, cancel: &Cancel) -> Option<()> {
        let limits = self.direct_limits(1.0);
        self.divide_coarse(limits);
        self.divide_contacts(cancel)?;
        let most = (FIRST_RAYS / self.hierarchy.mesh.vertices.len().max(1)).max(1);
        let (count, seed) = (self.shadow_samples(true).min(most as u32), limits.seed);
        if let Some(field) = &mut self.direct {
            self.ray_count += field.cover(&self.rays, &self.hierarchy, count, seed, cancel)?;
        }
        self.extend_to_new_elements();
        Some(())
    }

    /// Probe closures, of the first mesh.
    fn probe_closures(&mut self, threshold_scale: f32, cancel: &Cancel) -> Option<()> {
        if self.closures.serve(is_coarse(threshold_scale)) {
            return Some(());
        }
        if let Some(closures) = self.closures_in_clear() {
            self.closures = closures;
            return Some(());
        }
        // In the clear the tree serves only this.
        let rays = match self.rays.is_clear() {
            true => Arc::new(RayTree::new(&self.scene)),
            false => self.rays.clone(),
        };
        let probed = prober::closures(
            &self.scene,
            &self.hierarchy,
            &rays,
            &self.closures,
            is_coarse(threshold_scale),
            self.settings.seed,
            cancel,
        )?;
        self.closures = probed.closures;
        self.ray_count += probed.ray_count;
        self.probe_within(&probed.within, cancel)
    }

    /// One progressive step: lower the threshold, refine, gather, push and pull.
    /// Returns `None` when cancelled on the way; the light is then that of the last whole step.
    pub fn step(&mut self, cancel: &Cancel) -> Option<StepReport> {
        let mut report = StepReport {
            step: self.step + 1,
            ..StepReport::default()
        };
        let threshold_scale = self.threshold_scale_of(report.step);
        report.epsilon = self.settings.epsilon * threshold_scale;
        self.is_full = false;
        self.relighting.begin_step();
        self.probe_closures(threshold_scale, cancel)?;
        self.adapt_to_linked(threshold_scale);
        self.adapt_to_direct(threshold_scale, cancel)?;
        cancel.proceed()?;
        self.pull();
        cancel.proceed()?;
        self.estimate_mean();
        report.epsilon = self.refine(threshold_scale, cancel)?;
        self.probe_contacts(cancel)?;
        self.balance(cancel)?;
        // Links that are coarse err by more than light that has not quite settled.
        let tolerance = self.settings.tolerance * threshold_scale;
        self.iterate(&mut report, tolerance, cancel)?;
        self.gather_for_leaves(is_coarse(threshold_scale), cancel)?;
        cancel.proceed()?;
        self.gathered.clear();
        if self.is_full || report.step >= self.settings.step_count() {
            self.final_gather(1.0, cancel)?;
        }
        self.fill(&mut report);
        self.step = report.step;
        if self.show(cancel).is_none() {
            self.step -= 1;
            return None;
        }
        report.is_final = report.is_full || self.step >= self.settings.step_count();
        self.relighting.end_step(&report);
        Some(report)
    }

    /// Find the light at the vertices by the final gather, as the last step does, on the links that there are: where no further
    /// step can end in time. The report is that of the last step once more. `None` when cancelled on the way; the light is then
    /// that of the last step.
    pub fn finish(&mut self, cancel: &Cancel) -> Option<StepReport> {
        let before = std::mem::take(&mut self.gathered);
        let threshold_scale = self.threshold_scale_of(self.step);
        let found = self.final_gather(threshold_scale, cancel).and_then(|()| {
            let mut report = self.relighting.last_report();
            self.fill(&mut report);
            self.show(cancel)?;
            Some(report)
        });
        if found.is_none() {
            self.gathered = before;
        }
        found
    }

    /// By what the threshold of a step is above the last one's.
    fn threshold_scale_of(&self, step: u32) -> f32 {
        THRESHOLD_FACTOR.powi(self.settings.step_count().saturating_sub(step) as i32)
    }

    /// Let each leaf gather once more, for the vertices.
    fn gather_for_leaves(&mut self, is_coarse: bool, cancel: &Cancel) -> Option<()> {
        let (kernel, closures) = (self.kernel(), &self.closures);
        let none = OffsetPlaces::default();
        let offsets = self.direct.as_ref().map_or(&none, |field| &field.offsets);
        let links = &self.links;
        self.leaves =
            reconstruct::gather_leaves(kernel, links, closures, offsets, is_coarse, cancel)?;
        Some(())
    }

    /// The state as it stands. Cheap: parts are shared.
    pub fn snapshot(&self) -> Snapshot {
        self.snapshot.clone()
    }

    /// Go on under other settings; what is computed stays. Only for changes that do not call for a new start: the
    /// threshold, the tolerances, the smallest area and the number of steps.
    pub fn change_settings(&mut self, settings: SolveSettings) {
        self.settings = settings;
    }

    /// The scene being lit.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// The settings in force.
    pub fn settings(&self) -> &SolveSettings {
        &self.settings
    }

    /// The hierarchy, for tests and inspection.
    pub fn hierarchy(&self) -> &Hierarchy {
        &self.hierarchy
    }

    /// The links, for tests and inspection.
    pub fn links(&self) -> &LinkStore {
        &self.links
    }

    fn reading(&self) -> Option<Reading> {
        match self.settings.method {
            Method::Bounded => Some(Reading::Bounded),
            Method::SixFace => Some(Reading::SixFace),
            Method::Single => Some(Reading::Single),
            Method::Isotropic => Some(Reading::Isotropic),
            Method::Exact => None,
        }
    }

    fn kernel(&self) -> Kernel<'_> {
        Kernel {
            hierarchy: &self.hierarchy,
            tables: &self.power,
            reading: self.reading(),
        }
    }

    /// Direct irradiance of a leaf, by samples.
    fn direct_of(&self, element: usize) -> Vec4 {
        self.direct
            .as_ref()
            .map_or(Vec4::ZERO, |field| field.element(&self.hierarchy, element))
    }

    /// Radiosity of a leaf but for emission that is sampled, and in `w` 1: nothing where it lies within a solid.
    fn radiosity(&self, element: usize) -> Vec4 {
        self.radiosity_under(element, self.linked[element] + self.direct_of(element))
    }

    /// As [`Self::radiosity`] for this irradiance.
    fn radiosity_under(&self, element: usize, irradiance: Vec4) -> Vec4 {
        if self.hierarchy.mesh.elements[element].is_inside_solid() {
            return Vec4::ZERO;
        }
        let reflected = self.hierarchy.reflectance_of(element) * irradiance.truncate();
        let emitted = if self.is_sampled(element) {
            Vec3::ZERO
        } else {
            self.hierarchy.emission_of(element) * std::f32::consts::PI
        };
        (reflected + emitted).extend(1.0)
    }

    /// Whether the emission of an element is sampled, and so not sent over links.
    fn is_sampled(&self, element: usize) -> bool {
        let patch = self.hierarchy.mesh.elements[element].patch as usize;
        self.direct
            .as_ref()
            .is_some_and(|field| field.lights.is_sampled(patch))
    }

    /// Bring the source tables up to date with the irradiance of the leaves.
    fn pull(&mut self) {
        let mut power = std::mem::take(&mut self.power);
        power.pull(&self.hierarchy, |leaf| {
            self.radiosity(leaf) * self.sending[leaf]
        });
        self.power = power;
    }

    /// Make direct light known at all vertices, and divide elements where it bends.
    fn adapt_to_direct(&mut self, threshold_scale: f32, cancel: &Cancel) -> Option<()> {
        let limits = self.direct_limits(threshold_scale);
        self.is_full |= !self.divide_coarse(limits);
        if let Some(field) = &mut self.direct {
            self.ray_count += field.adapt(&self.rays, &mut self.hierarchy, limits, cancel)?;
            self.is_full |= field.is_full;
        }
        self.probe_contacts(cancel)?;
        self.extend_to_new_elements();
        Some(())
    }

    /// Divide elements that are too large to be trusted with their corners. Returns whether all could be.
    fn divide_coarse(&mut self, limits: adapt::Limits) -> bool {
        let lights = self.direct.as_ref().map(|field| &field.lights);
        let is_clear = self.plan.follows_light;
        adapt::divide_coarse(&mut self.hierarchy, lights, is_clear, limits)
    }

    /// Where nothing else divides them, divide elements over which the light of the last step bends.
    fn adapt_to_linked(&mut self, threshold_scale: f32) {
        if !self.plan.follows_light {
            return;
        }
        let (limits, mean) = (self.direct_limits(threshold_scale), self.mean_irradiance);
        let wanted = adapt::bent_under(&self.hierarchy, &self.leaves, limits, mean);
        let fits = self.hierarchy.mesh.fits(&wanted, limits.most_elements);
        self.is_full |= !fits;
        if fits {
            self.hierarchy.mesh.divide(&wanted);
            self.extend_to_new_elements();
        }
    }

    /// Shadow rays per vertex.
    fn shadow_samples(&self, is_coarse: bool) -> u32 {
        match is_coarse {
            true => self.settings.shadow_samples.div_ceil(2),
            false => self.settings.shadow_samples,
        }
    }

    fn direct_limits(&self, threshold_scale: f32) -> adapt::Limits {
        let tolerance = self.settings.mesh_tolerance * threshold_scale;
        adapt::Limits {
            tolerance,
            finest_tolerance: self.settings.mesh_tolerance,
            // Coarse steps are seen for a moment.
            contrast: match is_coarse(threshold_scale) {
                true => f32::INFINITY,
                false => border::CONTRAST_TOLERANCE * tolerance,
            },
            min_area: self.min_area(),
            shadow_samples: self.shadow_samples(is_coarse(threshold_scale)),
            seed: self.settings.seed,
            most_elements: self.most_elements(),
        }
    }

    /// Elements inherit the linked irradiance, and the factor of what they send, of the one that was divided, and have colours of their own.
    fn extend_to_new_elements(&mut self) {
        self.hierarchy
            .color_new_elements(&self.scene, &self.relighting.appearances);
        for index in self.linked.len()..self.hierarchy.mesh.elements.len() {
            let parent = self.hierarchy.mesh.elements[index].parent;
            self.linked.push(self.linked[parent as usize]);
            self.sending.push(self.sending[parent as usize]);
        }
    }

    /// Smallest element area that may be divided off, frame units.
    fn min_area(&self) -> f32 {
        (f64::from(self.settings.min_area) * self.hierarchy.importance.area) as f32
    }

    /// Mean irradiance (luminance), to which thresholds relate. Before any link it is guessed from the direct light.
    fn estimate_mean(&mut self) {
        let mut mean = gather::scale(&self.hierarchy, |leaf| {
            self.linked[leaf] + self.direct_of(leaf)
        });
        let is_dark = |light: &Vec4| light.truncate() == Vec3::ZERO;
        if self.linked.iter().all(is_dark) {
            let power = gather::area_sum(&self.hierarchy, |leaf| self.power.elements[leaf]);
            let power = power / self.hierarchy.importance.area.max(f64::MIN_POSITIVE);
            let brightest = self.power.brightest(&self.hierarchy, Hierarchy::ROOT);
            // Far surroundings send most of their light past the scene.
            mean += luminance(power.as_vec3().extend(0.0)).min(luminance(brightest));
        }
        self.mean_irradiance = mean;
    }

    /// Bring the links to the threshold of a scale; source tables are up to date before and after. Returns the threshold that
    /// they have: where links do not fit into memory, those from before stay, and the first ones are made coarser.
    fn refine(&mut self, threshold_scale: f32, cancel: &Cancel) -> Option<f32> {
        let limits = self.direct_limits(threshold_scale);
        let mut epsilon = self.settings.epsilon * threshold_scale;
        let (mut passes, mut raises) = (0, 0);
        let mut judged = None;
        while passes < MOST_PASSES {
            let is_first = self.links.is_empty();
            let most_links = self.most_links();
            let spreads = if self.plan.follows_light {
                self.radiosity_spreads()
            } else {
                Vec::new()
            };
            let refinement = {
                let areas = PatchSums::of_area(&self.hierarchy, &self.power);
                let powers = PatchSums::of_power(&self.hierarchy, &self.power);
                let sampler = PairSampler {
                    hierarchy: &self.hierarchy,
                    tables: &self.power,
                    areas: &areas,
                    powers: &powers,
                    rays: &self.rays,
                };
                let estimate = match self.settings.oracle {
                    Oracle::Interval => Estimate::Interval,
                    Oracle::Samples => Estimate::Samples(self.settings.samples),
                };
                let refiner = Refiner {
                    judge: Judge {
                        kernel: self.kernel(),
                        estimate,
                        ambient: AMBIENT_SHARE * self.mean_irradiance,
                        sampler,
                    },
                    links_of: |node| self.links.of(node),
                    judged,
                    threshold: epsilon * self.mean_irradiance,
                    min_area: self.min_area(),
                    seed: self.settings.seed,
                    cancelled: &|| cancel.is_cancelled(),
                    budget: LinkBudget::new(most_links),
                    is_by_patch: self.plan.is_by_patch,
                    follows_light: self.plan.follows_light,
                    spreads: &spreads,
                };
                refiner.refine(is_first)
            };
            if cancel.is_cancelled() {
                return None;
            }
            if !refinement.fits {
                self.is_full = true;
                if !is_first || raises >= MOST_RAISES {
                    break;
                }
                raises += 1;
                epsilon = (epsilon * RAISE_FACTOR).max(LEAST_RAISED);
                continue;
            }
            passes += 1;
            // Where links did not fit, threads stopped at different places: their rays are not counted.
            if !self.plan.is_clear {
                self.ray_count += refinement.ray_count;
            }
            self.links = LinkStore::from_runs(
                self.hierarchy.node_count(),
                &refinement.runs,
                &refinement.links,
            );
            let fits = self
                .hierarchy
                .mesh
                .fits(&refinement.wanted, self.most_elements());
            self.is_full |= !fits;
            judged = Some(self.hierarchy.node_count());
            if !fits || !self.hierarchy.mesh.divide(&refinement.wanted) {
                break;
            }
            self.extend_to_new_elements();
            if let Some(field) = &mut self.direct {
                let (shot, _) = field.sample(&self.rays, &self.hierarchy, limits, cancel)?;
                self.ray_count += shot;
            }
            self.pull();
        }
        Some(epsilon)
    }
}

/// Whether a step of this threshold scale is coarse.
fn is_coarse(threshold_scale: f32) -> bool {
    threshold_scale >= COARSE_THRESHOLD_SCALE
}

/// A colour that is safe to show: finite and not negative.
fn displayable(color: Vec4) -> Vec3 {
    color
        .truncate()
        .map(|x| if x.is_finite() { x.max(0.0) } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        hierarchy::NodeId,
        scene::{
            SceneOptions,
            builtin::{empty_cornell, find_builtin},
        },
    };

    /// Receivers and sources of all links, in order.
    fn pairs(solver: &Solver) -> Vec<(u32, u32)> {
        let receivers = 0..solver.hierarchy.node_count() as u32;
        let of = |receiver: u32| {
            let links = solver.links.of(NodeId(receiver)).iter();
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
            solver.estimate_mean();
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
