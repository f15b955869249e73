//! Entry points of `Solver` on its existing links, without a step: changed emitters and materials (see `relighting`), and
//! an early final gather.

use std::sync::Arc;

use glam::Vec4;

use super::{
    Cancel, Direct, Relit, Solver, StepReport,
    direct::{Shooting, Surfaces},
    relighting,
    schedule::threshold_scale,
    shown,
    vertices::{self, FinalGather, LeafLight},
};
use crate::{hierarchy::Tables, scene::Appearance, transport::Kernel};

impl Solver {
    /// Make the last step again as if it were the last one of all, with a final gather: for when no further step is to come.
    /// Where none was cancelled since, its links and light are still there. The report is that of the last step. `None` when
    /// cancelled, or before the first step; the snapshot is then that of the last step.
    pub fn finish(&mut self, cancel: &Cancel) -> Option<StepReport> {
        if self.step == 0 {
            return None;
        }
        if !self.relighting.is_whole() {
            let mut report = self.advance_to(self.step, true, cancel, &mut |_, _| ())?;
            report.is_final = false;
            self.relighting.end_step(&report);
            return Some(report);
        }
        let scale = threshold_scale(self.step, self.settings.step_count());
        let found = self.final_gather(scale, cancel)?;
        let before = std::mem::replace(&mut self.vertex_factors, found);
        let mut report = self.relighting.last_report();
        self.fill(&mut report);
        if self.show(self.step, cancel).is_none() {
            self.vertex_factors = before;
            return None;
        }
        report.estimated_error = self.estimate_error(cancel);
        Some(report)
    }

    /// Light of the leaves, gathered over the links from these source tables.
    pub(super) fn gathered(&self, tables: &Tables, cancel: &Cancel) -> Option<Vec<LeafLight>> {
        let kernel = Kernel {
            hierarchy: &self.hierarchy,
            tables,
            reading: self.settings.method.reading(),
            image: None,
        };
        let (surfaces, links) = (self.surfaces(), &self.linked.links);
        let coverage = Some(&self.coverage);
        let mut leaves = vertices::gather_leaves(kernel, surfaces, links, coverage, cancel)?;
        for image in &self.linked.images {
            let kernel = Kernel {
                image: Some(&image.image),
                ..kernel
            };
            let seen = vertices::gather_leaves(kernel, surfaces, &image.links, None, cancel)?;
            vertices::add_mirrored(&mut leaves, &seen, image.image.reflectance());
        }
        Some(leaves)
    }

    /// Factors of the linked light by vertex, as precise as a step of this threshold scale needs them.
    pub(super) fn final_gather(
        &mut self,
        threshold_scale: f32,
        cancel: &Cancel,
    ) -> Option<Vec<Vec4>> {
        let tolerance = threshold_scale * self.settings.tolerance;
        let squares = match self.settings.direct {
            Direct::Linked => self.gathered(&self.linked.squares(&self.hierarchy), cancel)?,
            Direct::Sampled => Vec::new(),
        };
        let gather = FinalGather {
            surfaces: self.surfaces(),
            leaves: &self.leaves,
            squares: &squares,
            coverage: &self.coverage,
            rays: &self.rays,
            limits: self.limits(threshold_scale),
            converged_change: vertices::converged_change(tolerance, self.mean_irradiance),
            cancel,
        };
        let found = gather.run()?;
        self.ray_count += found.ray_count;
        Some(found.factors)
    }

    /// Light the scene with these appearances, one for each material (see
    /// [`Scene::allowed`](crate::scene::Scene::allowed)), on the existing links, elements and coverage; the next step
    /// refines them. Returns `None` when cancelled: it must then be called again before the next step.
    pub fn relight(&mut self, wished: &[Appearance], cancel: &Cancel) -> Option<Relit> {
        cancel.proceed()?;
        let appearances = self.scene.allowed(wished);
        let active = self.scene.active_materials(&appearances);
        let needs_restart = !self.plan.holds_for(&self.scene, &self.hierarchy, &active);
        // Store the present light before it changes. Light from outside stays as it is.
        let has_outside = self.direct.brightest_outside() != Vec4::ZERO;
        let factor =
            self.relighting
                .keep_solved(&appearances, has_outside, &self.linked, &self.leaves);
        // Direct light, with new rays where they are needed.
        let shooting = Shooting {
            scene: &self.scene,
            hierarchy: &self.hierarchy,
            rays: &self.rays,
            seed: self.settings.seed,
            cancel,
        };
        let fields = self.direct.emitters_mut();
        self.ray_count += self.relighting.mix_direct(fields, shooting, &appearances)?;
        if let Some(estimator) = &mut self.estimator {
            estimator.forget_direct_light();
        }
        // The new colours.
        let emitted_before = relighting::emitted(&self.hierarchy);
        self.hierarchy.paint(&self.scene, &appearances);
        self.relighting.appearances = appearances;
        // Light over links: scaled where all light changes by one factor, else iterated.
        let mut report = self.relighting.unrefined_report();
        match factor.and_then(|factor| self.relighting.scaled(factor)) {
            Some((irradiance, leaves)) => {
                (self.linked.irradiance, self.leaves) = (irradiance, leaves);
                self.relighting.set_solved(true);
                let surfaces = Surfaces::new(&self.hierarchy, &self.direct);
                self.linked.pull(surfaces);
            }
            None => {
                self.relighting.set_solved(false);
                let surfaces = Surfaces::new(&self.hierarchy, &self.direct);
                relighting::begin_from(&mut self.linked, surfaces, emitted_before);
                if !self.linked.links.is_empty() {
                    self.iterate(self.settings.tolerance, &mut report, cancel)?;
                    match self.relighting.leaves_under(&self.linked.irradiance) {
                        Some(leaves) => self.leaves = leaves,
                        None => self.gather_relit(cancel)?,
                    }
                }
            }
        }
        // Figures and picture.
        self.fill(&mut report);
        let mut mesh = self.snapshot.mesh.as_ref().clone();
        shown::color(&self.hierarchy, &self.relighting.appearances, &mut mesh);
        self.snapshot.mesh = Arc::new(mesh);
        self.show(self.step, cancel)?;
        Some(Relit {
            report,
            is_rough: !self.relighting.is_solved() && !self.linked.links.is_empty(),
            needs_restart,
        })
    }

    /// Gather the light that [`Self::relight`] has solved for each leaf. Returns `None` when cancelled.
    pub fn finish_relighting(&mut self, cancel: &Cancel) -> Option<StepReport> {
        self.gather_relit(cancel)?;
        let mut report = self.relighting.unrefined_report();
        self.fill(&mut report);
        self.show(self.step, cancel)?;
        Some(report)
    }

    fn gather_relit(&mut self, cancel: &Cancel) -> Option<()> {
        self.leaves = self.gathered(&self.linked.power, cancel)?;
        self.relighting.forget_solved();
        Some(())
    }
}
