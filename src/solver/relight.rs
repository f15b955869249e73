//! The light of changed emitters and materials, solved anew on the links that there are.
//!
//! Nothing is refined or divided, and no closure is probed again. Direct light is put together from parts (see
//! `light_parts`). Where all that emits changes alike and nothing else does, all light is scaled with it: from the light
//! that was solved last, so that what was switched off comes back as it was. Else the iteration begins from the light
//! before, and corners of elements take their share as they did in the light that was solved last, until
//! [`Solver::finish_relighting`] gathers for each of them: that takes several times as long as all sweeps together.
//! Links stay those that the light before asked for: a step that follows refines them for the new one.
//! What the plan left out stays out, also where a surface that is painted or begins to shine lights it: then the light is
//! wrong there, and [`Relit::needs_restart`] says that a new solve is needed.

use std::sync::Arc;

use glam::{DVec3, Vec3, Vec4};
use rayon::prelude::*;

use super::{
    Cancel, Relit, Solver, StepReport,
    direct::{LightParts, Shooting, common_ratio},
    iteration::CEILING_SLACK,
    vertices::LeafLight,
};
use crate::{
    hierarchy::luminance,
    scene::{Appearance, Scene},
};

/// Corners of elements are lit by at most this many times the mean of the element, where that is told by the light before.
/// Smaller flattens corners near what is bright, larger shows bright corners where an element was all but dark before.
const MOST_AT_CORNERS: f32 = 4.0;

/// Light that was solved when materials looked so.
struct Solved {
    appearances: Vec<Appearance>,
    linked: Vec<Vec4>,
    leaves: Vec<LeafLight>,
    /// Power emitted then, by colour.
    emitted: DVec3,
}

/// What relighting remembers.
pub(super) struct Relighting {
    /// How materials look, by material.
    pub(super) appearances: Vec<Appearance>,
    /// Direct light in parts, from the first relighting after a step on.
    parts: Option<LightParts>,
    /// The light that others are scaled from.
    solved: Option<Solved>,
    /// Whether all leaves have gathered the present light.
    is_solved: bool,
    /// Whether the last step came to its end, so that links and samples fit the mesh.
    is_whole: bool,
    /// The figures of the last step.
    last: StepReport,
}

impl Relighting {
    /// Materials look as the scene says.
    pub(super) fn new(scene: &Scene) -> Self {
        Self {
            appearances: scene.appearances(),
            parts: None,
            solved: None,
            is_solved: false,
            is_whole: false,
            last: StepReport::default(),
        }
    }

    /// A step changes links and samples.
    pub(super) fn begin_step(&mut self) {
        self.parts = None;
        self.solved = None;
        (self.is_solved, self.is_whole) = (false, false);
    }

    /// A step has come to its end.
    pub(super) fn end_step(&mut self, report: &StepReport) {
        (self.is_solved, self.is_whole) = (true, true);
        self.last = report.clone();
    }

    /// The figures of the last step, without notes.
    pub(super) fn last_report(&self) -> StepReport {
        StepReport {
            notes: Vec::new(),
            ..self.last.clone()
        }
    }

    /// Bytes held.
    pub(super) fn memory_bytes(&self) -> usize {
        let solved = self.solved.as_ref().map_or(0, |solved| {
            size_of_val(solved.linked.as_slice()) + size_of_val(solved.leaves.as_slice())
        });
        solved + self.parts.as_ref().map_or(0, LightParts::memory_bytes)
    }
}

impl Solver {
    /// How materials look, by material: as the scene says, or as was last wished.
    pub fn appearances(&self) -> &[Appearance] {
        &self.relighting.appearances
    }

    /// Light the scene with materials that look so, one for each: see [`Scene::allowed`]. On the links, elements and
    /// closures that there are; a step that follows refines them. Returns `None` when cancelled on the way: to be asked
    /// for again before the next step.
    pub fn relight(&mut self, wished: &[Appearance], cancel: &Cancel) -> Option<Relit> {
        cancel.proceed()?;
        let appearances = self.scene.allowed(wished);
        let active = self.scene.active_materials(&appearances);
        let needs_restart = !self.plan.holds_for(&self.scene, &self.hierarchy, &active);
        let factor = self.keep_solved(&appearances);
        let shot = self.mix_direct(&appearances, cancel)?;
        self.ray_count += shot;
        let emitted_before = self.emitted();
        self.paint(appearances);
        let mut report = self.unrefined_report();
        match factor {
            Some(factor) => self.scale(factor),
            None => self.solve_again(emitted_before, &mut report, cancel)?,
        }
        self.fill(&mut report);
        self.color_snapshot();
        self.show(cancel)?;
        Some(Relit {
            report,
            is_rough: !self.relighting.is_solved && !self.links.is_empty(),
            needs_restart,
        })
    }

    /// Let each leaf gather the light that [`Self::relight`] has solved. Returns `None` when cancelled on the way.
    pub fn finish_relighting(&mut self, cancel: &Cancel) -> Option<StepReport> {
        self.gather_relit(cancel)?;
        let mut report = self.unrefined_report();
        self.fill(&mut report);
        self.show(cancel)?;
        Some(report)
    }

    /// The figures of the last step, as a beginning. Its threshold is that of links which were judged by other light, so
    /// it is never the last word.
    fn unrefined_report(&self) -> StepReport {
        StepReport {
            sweeps: 0,
            is_final: false,
            is_full: false,
            ..self.relighting.last_report()
        }
    }

    /// What the solved light is to be multiplied by for other appearances, where that is all there is to do. Sees to it
    /// that the light which is multiplied is kept.
    fn keep_solved(&mut self, appearances: &[Appearance]) -> Option<Vec3> {
        if self.relighting.solved.is_none() && self.relighting.is_solved {
            self.relighting.solved = Some(Solved {
                appearances: self.relighting.appearances.clone(),
                linked: self.linked.clone(),
                leaves: self.leaves.clone(),
                emitted: self.emitted(),
            });
        }
        let solved = self.relighting.solved.as_ref()?;
        factor_between(&solved.appearances, appearances)
    }

    /// Bring direct light to other appearances. Returns the rays shot, or `None` when cancelled: nothing has changed
    /// then.
    fn mix_direct(&mut self, appearances: &[Appearance], cancel: &Cancel) -> Option<u64> {
        let Some(field) = &mut self.direct else {
            return Some(0);
        };
        let mut shot = 0;
        if !self.relighting.is_whole {
            // A step that was cancelled may have left vertices without samples.
            let (count, seed) = (field.samples, self.settings.seed);
            shot += field.cover(&self.rays, &self.hierarchy, count, seed, cancel)?;
        }
        let now = &self.relighting.appearances;
        let mut parts = match self.relighting.parts.take() {
            Some(parts) => parts,
            None => LightParts::whole(field, &self.scene, now),
        };
        let shooting = Shooting {
            scene: &self.scene,
            hierarchy: &self.hierarchy,
            rays: &self.rays,
            seed: self.settings.seed,
            cancel,
        };
        shot += parts.mix(field, shooting, appearances)?;
        self.relighting.parts = Some(parts);
        Some(shot)
    }

    /// Give the patches the colours that their materials have now.
    fn paint(&mut self, appearances: Vec<Appearance>) {
        self.hierarchy.paint(&self.scene, &appearances);
        self.relighting.appearances = appearances;
    }

    /// Multiply the light that was solved last.
    fn scale(&mut self, factor: Vec3) {
        let Some(solved) = &self.relighting.solved else {
            return;
        };
        let factor_w = factor.extend(1.0);
        let of_luminance = {
            let scaled = |by: Vec3| luminance((solved.emitted.as_vec3() * by).extend(0.0));
            let before = scaled(Vec3::ONE);
            if before > 0.0 {
                scaled(factor) / before
            } else {
                1.0
            }
        };
        self.linked = solved
            .linked
            .par_iter()
            .with_min_len(4096)
            .map(|light| *light * factor_w)
            .collect();
        self.leaves = solved
            .leaves
            .par_iter()
            .with_min_len(4096)
            .map(|leaf| LeafLight {
                corners: leaf.corners.map(|light| light * factor_w),
                centre: leaf.centre * factor_w,
                error: leaf.error * of_luminance,
                ..*leaf
            })
            .collect();
        self.relighting.is_solved = true;
        self.pull();
    }

    /// Iterate on the links that there are, from the light before.
    fn solve_again(
        &mut self,
        emitted_before: DVec3,
        report: &mut StepReport,
        cancel: &Cancel,
    ) -> Option<()> {
        self.relighting.is_solved = false;
        self.begin_from(emitted_before);
        if self.links.is_empty() {
            return Some(());
        }
        self.iterate(report, self.settings.tolerance, cancel)?;
        match &self.relighting.solved {
            Some(solved) => self.leaves = solved.leaves_under(&self.linked),
            None => self.gather_relit(cancel)?,
        }
        Some(())
    }

    fn gather_relit(&mut self, cancel: &Cancel) -> Option<()> {
        self.gather_for_leaves(false, cancel)?;
        self.relighting.solved = None;
        self.relighting.is_solved = true;
        Some(())
    }

    /// Begin with the light before, in proportion to what is emitted now; without any where that is more than there can
    /// be, which would be taken for light that grows.
    fn begin_from(&mut self, emitted_before: DVec3) {
        let ratio = self.emitted() / emitted_before;
        let ratio = ratio.map(|x| if x.is_finite() { x } else { 0.0 }).as_vec3();
        let scale = |light: &mut Vec4| *light *= ratio.extend(1.0);
        self.linked.iter_mut().for_each(scale);
        self.pull();
        let sent = self.leaf_sum(|leaf| self.radiosity(leaf)) + self.sampled_power();
        if sent > CEILING_SLACK * self.most_power() {
            self.linked.fill(Vec4::ZERO);
            self.pull();
        }
    }

    /// Emitted power by colour.
    fn emitted(&self) -> DVec3 {
        let patches = &self.hierarchy.patches[self.hierarchy.active_patches()];
        patches
            .iter()
            .map(|patch| patch.emission.as_dvec3() * f64::from(patch.area))
            .sum()
    }

    /// Show the colours that surfaces have now.
    fn color_snapshot(&mut self) {
        let mut mesh = self.snapshot.mesh.as_ref().clone();
        self.color(&mut mesh);
        self.snapshot.mesh = Arc::new(mesh);
    }
}

impl Solved {
    /// The leaves when their elements receive other light over links: within each it varies as before. Errors stay those
    /// of the links.
    fn leaves_under(&self, linked: &[Vec4]) -> Vec<LeafLight> {
        self.leaves
            .par_iter()
            .with_min_len(4096)
            .map(|leaf| {
                let (before, now) = (
                    self.linked[leaf.element as usize],
                    linked[leaf.element as usize],
                );
                let ratio = (now / before).map(|x| if x.is_finite() { x } else { 0.0 });
                let under = |light: Vec4| {
                    let varied = (light * ratio).min(now * MOST_AT_CORNERS);
                    let is_told = before.cmpgt(Vec4::ZERO);
                    Vec4::select(is_told, varied, now)
                        .truncate()
                        .extend(light.w)
                };
                LeafLight {
                    corners: leaf.corners.map(under),
                    centre: under(leaf.centre),
                    ..*leaf
                }
            })
            .collect()
    }
}

/// What all light changes by from some appearances to others, where it changes by the same everywhere.
fn factor_between(before: &[Appearance], after: &[Appearance]) -> Option<Vec3> {
    let reflect_alike = before
        .iter()
        .zip(after)
        .all(|(before, after)| before.reflectance == after.reflectance);
    let emissions = before
        .iter()
        .zip(after)
        .map(|(before, after)| (before.emission, after.emission));
    if reflect_alike {
        common_ratio(emissions)
    } else {
        None
    }
}
