//! What relighting remembers: the light of changed emitters and materials is found on the links that there are.
//!
//! Nothing is refined or divided, and no coverage is probed again. Direct light is put together from parts (see
//! `light_parts`). Where all that emits changes alike and nothing else does, all light is scaled with it: from the light
//! that was solved last, so that what was switched off comes back as it was. Else the iteration begins from the light
//! before, and corners of elements take their share as they did in the light that was solved last, until
//! [`Solver::finish_relighting`](super::Solver::finish_relighting) gathers for each of them: that takes several times as long as all sweeps together.
//! Links stay those that the light before asked for: a step that follows refines them for the new one.
//! What the plan left out stays out, also where a surface that is painted or begins to shine lights it: then the light is
//! wrong there, and [`Relit::needs_restart`](super::Relit::needs_restart) says that a new solve is needed.

use glam::{DVec3, Vec3, Vec4};
use rayon::prelude::*;

use super::{
    StepReport,
    direct::{DirectField, LightParts, Shooting, Surfaces, common_ratio},
    iteration::{CEILING_SLACK, LinkedLight},
    sums::area_total,
    vertices::LeafLight,
};
use crate::{
    hierarchy::{Channels as _, Hierarchy, luminance},
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

    /// The figures of the last step, as a beginning. Its threshold is that of links which were judged by other light, so
    /// it is never the last word.
    pub(super) fn unrefined_report(&self) -> StepReport {
        StepReport {
            sweeps: 0,
            is_final: false,
            is_full: false,
            ..self.last_report()
        }
    }

    /// What the solved light is to be multiplied by for other appearances, where that is all there is to do. Sees to it
    /// that the light which is multiplied is kept.
    pub(super) fn keep_solved(
        &mut self,
        appearances: &[Appearance],
        hierarchy: &Hierarchy,
        linked: &LinkedLight,
        leaves: &[LeafLight],
    ) -> Option<Vec3> {
        if self.solved.is_none() && self.is_solved {
            self.solved = Some(Solved {
                appearances: self.appearances.clone(),
                linked: linked.irradiance.clone(),
                leaves: leaves.to_vec(),
                emitted: emitted(hierarchy),
            });
        }
        factor_between(&self.solved.as_ref()?.appearances, appearances)
    }

    /// Bring direct light to other appearances. Returns the rays shot, or `None` when cancelled: the light has not changed
    /// then.
    pub(super) fn mix_direct(
        &mut self,
        field: &mut DirectField,
        shooting: Shooting<'_>,
        appearances: &[Appearance],
    ) -> Option<u64> {
        let mut shot = 0;
        if !self.is_whole {
            // A step that was cancelled may have left vertices without samples.
            let Shooting {
                hierarchy,
                rays,
                seed,
                cancel,
                ..
            } = shooting;
            shot += field.sample_vertices(rays, hierarchy, field.samples, seed, cancel)?;
        }
        let parts = self
            .parts
            .get_or_insert_with(|| LightParts::whole(field, shooting.scene, &self.appearances));
        shot += parts.mix(field, shooting, appearances)?;
        Some(shot)
    }

    /// The light that was solved last, multiplied by a factor: over links by element, and of the leaves.
    pub(super) fn scaled(&self, factor: Vec3) -> Option<(Vec<Vec4>, Vec<LeafLight>)> {
        Some(self.solved.as_ref()?.scaled(factor))
    }

    /// The leaves when their elements receive other light over links, where light was solved before.
    pub(super) fn leaves_under(&self, linked: &[Vec4]) -> Option<Vec<LeafLight>> {
        Some(self.solved.as_ref()?.leaves_under(linked))
    }

    /// Note whether all leaves have gathered the present light.
    pub(super) fn set_solved(&mut self, is_solved: bool) {
        self.is_solved = is_solved;
    }

    /// Note that all leaves have gathered the present light anew: nothing is scaled from the light before.
    pub(super) fn forget_solved(&mut self) {
        self.solved = None;
        self.is_solved = true;
    }

    /// Whether all leaves have gathered the present light.
    pub(super) fn is_solved(&self) -> bool {
        self.is_solved
    }

    /// Bytes held.
    pub(super) fn memory_bytes(&self) -> usize {
        let solved = self.solved.as_ref().map_or(0, |solved| {
            size_of_val(solved.linked.as_slice()) + size_of_val(solved.leaves.as_slice())
        });
        solved + self.parts.as_ref().map_or(0, LightParts::memory_bytes)
    }
}

impl Solved {
    /// All of it, multiplied by a factor.
    fn scaled(&self, factor: Vec3) -> (Vec<Vec4>, Vec<LeafLight>) {
        let factor_w = factor.extend(1.0);
        let of_luminance = {
            let scaled = |by: Vec3| luminance((self.emitted.as_vec3() * by).extend(0.0));
            let before = scaled(Vec3::ONE);
            if before > 0.0 {
                scaled(factor) / before
            } else {
                1.0
            }
        };
        let linked = self.linked.par_iter().with_min_len(4096);
        let leaves = self.leaves.par_iter().with_min_len(4096);
        (
            linked.map(|light| *light * factor_w).collect(),
            leaves
                .map(|leaf| LeafLight {
                    corners: leaf.corners.map(|light| light * factor_w),
                    centre: leaf.centre * factor_w,
                    error: leaf.error * of_luminance,
                    ..*leaf
                })
                .collect(),
        )
    }

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
                        .color()
                        .extend(light.form_factor_sum())
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

/// Begin with the light before, in proportion to what is emitted now; without any where that is more than there can be,
/// which would be taken for light that grows.
pub(super) fn begin_from(linked: &mut LinkedLight, surfaces: Surfaces<'_>, emitted_before: DVec3) {
    let ratio = emitted(surfaces.hierarchy) / emitted_before;
    let ratio = ratio.map(|x| if x.is_finite() { x } else { 0.0 }).as_vec3();
    let scale = |light: &mut Vec4| *light *= ratio.extend(1.0);
    linked.irradiance.iter_mut().for_each(scale);
    linked.pull(surfaces);
    let sent = area_total(surfaces.hierarchy, |leaf| linked.radiosity(surfaces, leaf))
        + surfaces.sampled_power();
    if sent > CEILING_SLACK * surfaces.most_power() {
        linked.irradiance.fill(Vec4::ZERO);
        linked.pull(surfaces);
    }
}

/// Emitted power by colour.
pub(super) fn emitted(hierarchy: &Hierarchy) -> DVec3 {
    let patches = &hierarchy.patches[hierarchy.active_patches()];
    patches
        .iter()
        .map(|patch| patch.emission.as_dvec3() * f64::from(patch.area))
        .sum()
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
