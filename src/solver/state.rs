//! The state of a solve, and its steps.

use std::sync::Arc;

use glam::Vec4;

use super::{
    Cancel, Note, Phase, PhaseObserver, Snapshot, SolveSettings, StepReport,
    coverage::{self, CoverageMap},
    direct::{self, DirectFields, Surfaces, Surroundings},
    estimate::ErrorEstimator,
    iteration::{self, Iteration, LinkedLight},
    limits::{Limits, shadow_samples},
    places,
    plan::Plan,
    refine::Refining,
    relighting::Relighting,
    schedule::{is_coarse, threshold_scale},
    shown::{self, View},
    textures::Painted,
    vertices::{self, LeafLight},
};
use crate::{
    geometry::RayTree,
    hierarchy::{Hierarchy, SheetSides},
    scene::{ActiveMaterials, Appearance, Scene},
};

/// A solve in progress.
///
/// Between two calls, `linked` and `direct` have light for every element and every sampled vertex of `hierarchy`, the
/// source tables match that light, and `snapshot` is that of the last whole step. After a cancelled call the light may
/// be out of date; the next call updates it.
pub struct Solver {
    // What is solved, and how.
    pub(super) scene: Arc<Scene>,
    pub(super) settings: SolveSettings,
    pub(super) plan: Plan,
    pub(super) memory_limit: Option<u64>,
    /// Occludes nothing in a clear scene.
    pub(super) rays: Arc<RayTree>,
    // The mesh and its light.
    pub(super) hierarchy: Hierarchy,
    /// Light straight from emitters and from outside, as far as it is sampled.
    pub(super) direct: DirectFields,
    pub(super) linked: LinkedLight,
    /// Coverage of the hemisphere of each cell by lit surfaces.
    pub(super) coverage: CoverageMap,
    /// Linked light of the leaves when they gathered last.
    pub(super) leaves: Vec<LeafLight>,
    /// Factor of the linked light by vertex, from the final gather; empty for 1.
    pub(super) vertex_factors: Vec<Vec4>,
    /// Mean irradiance (luminance), to which the thresholds of the last step relate.
    pub(super) mean_irradiance: f32,
    // Progress.
    pub(super) step: u32,
    pub(super) ray_count: u64,
    /// Whether the memory limit prevented finer links or elements in the last step.
    pub(super) is_full: bool,
    pub(super) relighting: Relighting,
    /// Points and rays that estimate the error of a step; `None` before the first.
    pub(super) estimator: Option<ErrorEstimator>,
    pub(super) snapshot: Snapshot,
}

impl Solver {
    /// Prepare a solve: plan, hierarchy, ray tree, first mesh. `memory_limit` bounds its memory in bytes.
    /// Returns `None` when cancelled.
    pub fn new(
        scene: Arc<Scene>,
        settings: SolveSettings,
        memory_limit: Option<u64>,
        cancel: &Cancel,
    ) -> Option<Self> {
        Self::with_rays(scene, None, settings, memory_limit, None, cancel)
    }

    /// As [`Self::new`], with the scene's ray tree if there is one already, and lit with these appearances instead of
    /// the scene's. The plan holds for both, so that lamps that are off may be switched on.
    pub fn with_rays(
        scene: Arc<Scene>,
        mut rays: Option<Arc<RayTree>>,
        settings: SolveSettings,
        memory_limit: Option<u64>,
        wished: Option<&[Appearance]>,
        cancel: &Cancel,
    ) -> Option<Self> {
        cancel.proceed()?;
        let is_cancelled = || cancel.is_cancelled();
        // The parts that the scene does not need.
        let active = wished.map_or_else(ActiveMaterials::default, |wished| {
            scene.active_materials(&scene.allowed(wished))
        });
        let sheets = SheetSides::of(&scene, &mut rays);
        cancel.proceed()?;
        let (mut plan, tree) =
            Plan::make(&scene, sheets.as_ref(), &settings, active, &is_cancelled)?;
        // Hierarchy and ray tree. Both take about the same time, and neither uses all processors.
        let (hierarchy, rays) = rayon::join(
            || Hierarchy::of_tree(&scene, tree, settings.crease_degrees, &is_cancelled),
            || match rays {
                _ if plan.is_clear => Arc::new(RayTree::clear()),
                Some(rays) => rays,
                None => Arc::new(RayTree::new(&scene)),
            },
        );
        let mut hierarchy = hierarchy?;
        hierarchy.diffuse_specular(&scene, |triangle| rays.follows(triangle));
        cancel.proceed()?;
        let ray_count = plan.probe_outside(&scene, &hierarchy, &rays, &settings);
        cancel.proceed()?;
        let mut solver = Self {
            direct: DirectFields::default(),
            linked: LinkedLight::default(),
            coverage: CoverageMap::default(),
            leaves: Vec::new(),
            vertex_factors: Vec::new(),
            mean_irradiance: 0.0,
            step: 0,
            ray_count,
            is_full: false,
            relighting: Relighting::new(&scene),
            estimator: None,
            snapshot: Snapshot::default(),
            scene,
            settings,
            plan,
            memory_limit,
            rays,
            hierarchy,
        };
        // A first picture before the first link.
        solver.first_light(cancel)?;
        solver.show(0, cancel)?;
        if let Some(wished) = wished {
            solver.relight(wished, cancel)?;
        }
        Some(solver)
    }

    /// Make the first mesh, with direct light from few rays.
    fn first_light(&mut self, cancel: &Cancel) -> Option<()> {
        // Divide elements by textures, and find the emitters.
        self.linked.extend(&self.hierarchy);
        let limits = self.limits(1.0);
        let painted = Painted {
            scene: &self.scene,
            appearances: &self.relighting.appearances,
        };
        painted.divide(&mut self.hierarchy, limits.min_area, limits.most_elements);
        self.linked.extend(&self.hierarchy);
        let sees_outside = self.plan.sees_outside;
        let (scene, rays) = (&self.scene, &self.rays);
        self.direct = DirectFields::new(scene, &self.hierarchy, &self.settings, sees_outside, rays);
        self.linked.show_images(rays);
        cancel.proceed()?;
        // Divide large elements and contact elements.
        let limits = self.limits(1.0);
        self.divide_coarse(limits);
        let limits = self.limits(1.0);
        let (scene, rays) = (&self.scene, &self.rays);
        let (shot, fits) =
            places::divide_contacts(scene, &mut self.hierarchy, rays, limits, cancel)?;
        self.ray_count += shot;
        self.is_full |= !fits;
        // A few shadow rays from each vertex.
        let count = shadow_samples(&self.settings, true);
        let (hierarchy, seed) = (&self.hierarchy, limits.seed);
        self.ray_count += self
            .direct
            .sample_vertices_first(rays, hierarchy, count, seed, cancel)?;
        self.extend_to_new_elements();
        self.pull();
        Some(())
    }

    /// One progressive step: lower the threshold, refine, gather, push and pull.
    /// Returns `None` when cancelled; the snapshot is then that of the last whole step.
    pub fn step(&mut self, cancel: &Cancel) -> Option<StepReport> {
        self.step_in_phases(cancel, &mut |_, _| ())
    }

    /// As [`Self::step`], and tell as each phase begins.
    pub fn step_in_phases(
        &mut self,
        cancel: &Cancel,
        begin: PhaseObserver<'_>,
    ) -> Option<StepReport> {
        let (step, step_count) = (self.next_step(), self.settings.step_count());
        let mut report = self.advance_to(step, step >= step_count, cancel, begin)?;
        let estimated = report.estimated_error.filter(|_| report.is_final);
        report.is_final = estimated.is_some_and(|error| self.ends_with(error, &mut report));
        if report.is_final {
            shown::note_diffused(&mut report);
        }
        self.relighting.end_step(&report);
        Some(report)
    }

    /// Refine to a step and exchange light, with the final gather where it is the last, or full, or the error is reached; the
    /// report says in `is_final` whether it was. `None` when cancelled.
    pub(super) fn advance_to(
        &mut self,
        step: u32,
        mut is_last: bool,
        cancel: &Cancel,
        begin: PhaseObserver<'_>,
    ) -> Option<StepReport> {
        let step_count = self.settings.step_count();
        let mut report = StepReport {
            step,
            ..StepReport::default()
        };
        let threshold_scale = threshold_scale(report.step, step_count);
        let is_coarse = is_coarse(threshold_scale);
        self.is_full = false;
        self.relighting.begin_step();
        begin(Phase::Coverage, self.ray_count);
        // Coverage of the hemisphere of each cell of the first mesh by lit surfaces.
        self.probe_coverage(is_coarse, cancel)?;
        begin(Phase::Direct, self.ray_count);
        // Divide elements where interpolation errs: of the linked light of the last step, and of direct light.
        self.adapt_to_linked(threshold_scale);
        self.adapt_to_direct(threshold_scale, cancel)?;
        cancel.proceed()?;
        begin(Phase::Refine, self.ray_count);
        // Source tables of the present light, and the mean that errors are relative to.
        self.pull();
        cancel.proceed()?;
        self.mean_irradiance = self.linked.mean_irradiance(self.surfaces());
        // Links whose errors are below the threshold.
        self.refine(threshold_scale, &mut report, cancel)?;
        self.probe_contacts(cancel)?;
        begin(Phase::Iterate, self.ray_count);
        // Factors of the senders, so that sent light adds up as received light does.
        self.balance(cancel)?;
        // Exchange light over the links until it converges; coarse links need a coarse tolerance only.
        let tolerance = self.settings.tolerance * threshold_scale;
        self.iterate(tolerance, &mut report, cancel)?;
        begin(Phase::Gather, self.ray_count);
        // Light at the corners of each leaf, from its links.
        self.leaves = self.gathered(&self.linked.power, cancel)?;
        cancel.proceed()?;
        // Where the error is small enough, this step is the last.
        self.vertex_factors.clear();
        is_last |= self.is_full;
        let mut estimated = None;
        if self.settings.error.is_some() && !is_last {
            let coarse = self.show_and_estimate(report.step, cancel, begin)?;
            is_last = self.is_error_reached(coarse);
            estimated = Some(coarse).filter(|_| !is_last);
        }
        // In the last step, factors of the linked light from rays at the vertices; in others, what errors of direct light
        // are relative to in the next.
        if is_last {
            begin(Phase::FinalGather, self.ray_count);
            self.vertex_factors = self.final_gather(threshold_scale.min(1.0), cancel)?;
        } else {
            self.look_around(cancel)?;
        }
        // Figures and picture.
        begin(Phase::Display, self.ray_count);
        self.fill(&mut report);
        report.error_bound = self.error_bound();
        let estimated = match estimated {
            Some(estimated) => estimated,
            None => self.show_and_estimate(report.step, cancel, begin)?,
        };
        report.estimated_error = Some(estimated);
        self.step = report.step;
        report.is_final = is_last;
        Some(report)
    }

    pub(super) fn surfaces(&self) -> Surfaces<'_> {
        Surfaces::new(&self.hierarchy, &self.direct)
    }

    pub(super) fn pull(&mut self) {
        let surfaces = Surfaces::new(&self.hierarchy, &self.direct);
        self.linked.pull(surfaces);
    }

    /// Give new elements colours of their own, and the light of the element that was divided.
    fn extend_to_new_elements(&mut self) {
        self.hierarchy
            .color_new_elements(&self.scene, &self.relighting.appearances);
        self.linked.extend(&self.hierarchy);
    }

    /// Probe the coverage of the cells of the first mesh, unless the known coverage is precise enough.
    pub(super) fn probe_coverage(&mut self, is_coarse: bool, cancel: &Cancel) -> Option<()> {
        if self.coverage.serve(is_coarse) {
            return Some(());
        }
        if let Some(coverage) = CoverageMap::without_rays(&self.plan, &self.hierarchy) {
            self.coverage = coverage;
            return Some(());
        }
        let (scene, rays, seed) = (&self.scene, &self.rays, self.settings.seed);
        let known = &self.coverage;
        let probed = coverage::probe(scene, &self.hierarchy, rays, known, is_coarse, seed, cancel)?;
        self.coverage = probed.coverage;
        self.ray_count += probed.ray_count;
        // Cells that rays found inside solids.
        let within = &probed.within;
        self.ray_count += places::probe_within(scene, &mut self.hierarchy, rays, within, cancel)?;
        self.coverage.exclude_inside_solids(&self.hierarchy, within);
        Some(())
    }

    /// Find how bright the surroundings of all elements are.
    fn look_around(&mut self, cancel: &Cancel) -> Option<()> {
        // Without shadows direct light is exact.
        if self.plan.is_clear || self.direct.is_empty() {
            return Some(());
        }
        let seen = iteration::surroundings(&self.linked, self.surfaces(), &self.settings, cancel)?;
        self.direct.set_surroundings(Surroundings::new(seen));
        Some(())
    }

    /// Divide elements by the interpolation error of the linked light of the last step, where no link divides them.
    fn adapt_to_linked(&mut self, threshold_scale: f32) {
        if self.plan.follows_light {
            let (limits, mean) = (self.limits(threshold_scale), self.mean_irradiance);
            let (hierarchy, leaves) = (&mut self.hierarchy, &self.leaves);
            self.is_full |=
                !vertices::divide_by_interpolation_error(hierarchy, leaves, limits, mean);
            self.extend_to_new_elements();
        }
    }

    /// Sample direct light at all vertices, and divide elements by its interpolation error.
    fn adapt_to_direct(&mut self, threshold_scale: f32, cancel: &Cancel) -> Option<()> {
        let limits = self.limits(threshold_scale);
        self.is_full |= !self.divide_coarse(limits);
        let (rays, hierarchy) = (&self.rays, &mut self.hierarchy);
        let (shot, fits) = self.direct.adapt(rays, hierarchy, limits, cancel)?;
        self.ray_count += shot;
        self.is_full |= !fits;
        self.probe_contacts(cancel)?;
        self.extend_to_new_elements();
        Some(())
    }

    /// Divide elements that are too large to be sampled at their corners only. Returns whether memory allowed it.
    fn divide_coarse(&mut self, limits: Limits) -> bool {
        let is_clear = self.plan.follows_light;
        direct::divide_coarse(&mut self.hierarchy, &self.direct, is_clear, limits)
    }

    /// Find which corners and centroids of new elements lie inside solids.
    fn probe_contacts(&mut self, cancel: &Cancel) -> Option<()> {
        let limits = self.limits(1.0);
        let (scene, rays) = (&self.scene, &self.rays);
        self.ray_count += places::probe_contacts(scene, &mut self.hierarchy, rays, limits, cancel)?;
        Some(())
    }

    /// Refine the links to the threshold of a step. The report gets the threshold that they meet.
    pub(super) fn refine(
        &mut self,
        threshold_scale: f32,
        report: &mut StepReport,
        cancel: &Cancel,
    ) -> Option<()> {
        let refining = Refining {
            settings: &self.settings,
            plan: &self.plan,
            limits: self.limits(threshold_scale),
            rays: &self.rays,
            painted: Painted {
                scene: &self.scene,
                appearances: &self.relighting.appearances,
            },
            leaves: &self.leaves,
            mean_irradiance: self.mean_irradiance,
            budget: self.budget(),
            cancel,
        };
        let epsilon = self.settings.epsilon * threshold_scale;
        let refined = refining.refine(
            &mut self.hierarchy,
            &mut self.direct,
            &mut self.linked,
            epsilon,
        )?;
        self.ray_count += refined.ray_count;
        self.is_full |= refined.is_full;
        report.epsilon = refined.epsilon;
        if refined.is_limited {
            let epsilon = refined.epsilon;
            report.notes.push(Note::LinksLimited { epsilon });
        }
        Some(())
    }

    /// Complete the coverage by what the sky fills, and find the factors of the senders.
    fn balance(&mut self, cancel: &Cancel) -> Option<()> {
        let sky = self.direct.sky_shares(&self.hierarchy);
        self.coverage.complete(&self.hierarchy, sky.as_ref());
        let surfaces = Surfaces::new(&self.hierarchy, &self.direct);
        let (coverage, settings) = (&self.coverage, &self.settings);
        iteration::balance(&mut self.linked, surfaces, coverage, settings, cancel)
    }

    /// Exchange light over the links until it converges to a tolerance, relative to the total power.
    pub(super) fn iterate(
        &mut self,
        tolerance: f32,
        report: &mut StepReport,
        cancel: &Cancel,
    ) -> Option<()> {
        let iteration = Iteration {
            surfaces: Surfaces::new(&self.hierarchy, &self.direct),
            coverage: &self.coverage,
            settings: &self.settings,
            tolerance,
            cancel,
        };
        let convergence = iteration::iterate(&mut self.linked, iteration)?;
        report.sweeps += convergence.sweeps;
        report.residual = convergence.residual;
        report.contraction = report.contraction.max(convergence.contraction);
        report.notes.extend(convergence.notes);
        Some(())
    }

    /// Fill in the figures of the present state.
    pub(super) fn fill(&self, report: &mut StepReport) {
        let (surfaces, budget) = (self.surfaces(), self.budget());
        shown::fill(report, surfaces, &self.linked, &self.leaves);
        report.shadow_rays = self.ray_count;
        report.memory_bytes = budget.used_bytes(surfaces, &self.linked);
        if self.is_full || budget.is_exceeded(surfaces, &self.linked) {
            shown::note_full(report);
        }
    }

    /// Renew the snapshot after a step. When cancelled it is unchanged.
    pub(super) fn show(&mut self, step: u32, cancel: &Cancel) -> Option<()> {
        cancel.proceed()?;
        let triangles = shown::changed_triangles(&mut self.hierarchy, &self.snapshot.mesh);
        cancel.proceed()?;
        let view = View {
            scene: &self.scene,
            appearances: &self.relighting.appearances,
            surfaces: self.surfaces(),
            linked: &self.linked,
            leaves: &self.leaves,
            factors: &self.vertex_factors,
            omitted: &self.plan.omitted,
            step,
        };
        self.snapshot = view.show(triangles, &self.snapshot, cancel)?;
        self.snapshot.lights = Some(self.direct.shared(&self.rays));
        Some(())
    }
}
