//! State of relighting: the light of changed emitters and materials is computed on the existing links.
//!
//! Nothing is refined or divided, and no coverage is probed again. Direct light is combined from parts (see
//! `light_parts`). If all emission changes by one factor and nothing else changes, all light is scaled from the light
//! that was solved last, so that a lamp that was off comes back exactly. Otherwise the iteration starts from the
//! present light, and the light within each element varies as it did in the light that was solved last, until
//! [`Solver::finish_relighting`](super::Solver::finish_relighting) gathers for each leaf, which takes several times as
//! long as all sweeps together. The links were refined for the light before; the next step refines them for the new
//! one. Omitted patches stay inactive, even where a surface that now reflects or emits would light them: the light is
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
    hierarchy::{Channels as _, Hierarchy},
    scene::{Appearance, Scene},
};

/// Most light at a corner, in multiples of the new mean of its element, where it is derived from the light before.
/// Smaller flattens corners near bright surfaces; larger makes bright corners where an element was almost dark before.
const MOST_AT_CORNERS: f32 = 4.0;

/// Light that was solved for some appearances.
struct Solved {
    appearances: Vec<Appearance>,
    linked: Vec<Vec4>,
    leaves: Vec<LeafLight>,
}

/// State of relighting.
pub(super) struct Relighting {
    /// Present appearance by material.
    pub(super) appearances: Vec<Appearance>,
    /// Direct light in parts, of each field of emitters; made by the first relighting after a step.
    parts: Vec<LightParts>,
    /// The light from which other light is scaled.
    solved: Option<Solved>,
    /// Whether all leaves have gathered the present light.
    is_solved: bool,
    /// Whether the last step was completed, so that links and samples match the mesh.
    is_whole: bool,
    /// The figures of the last step.
    last: StepReport,
}

impl Relighting {
    /// State for the appearances of the scene.
    pub(super) fn new(scene: &Scene) -> Self {
        Self {
            appearances: scene.appearances(),
            parts: Vec::new(),
            solved: None,
            is_solved: false,
            is_whole: false,
            last: StepReport::default(),
        }
    }

    /// Begin a step, which changes links and samples.
    pub(super) fn begin_step(&mut self) {
        self.parts.clear();
        self.solved = None;
        (self.is_solved, self.is_whole) = (false, false);
    }

    /// End a completed step.
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

    /// The figures of the last step, to be updated. The links were judged by other light, so the report is not final.
    pub(super) fn unrefined_report(&self) -> StepReport {
        StepReport {
            sweeps: 0,
            is_final: false,
            is_full: false,
            estimated_error: None,
            ..self.last_report()
        }
    }

    /// Factor of the solved light for other appearances, if all light changes by one factor; light from outside, if
    /// there is some, stays as it is. Stores the present light if it is solved and not stored yet.
    pub(super) fn keep_solved(
        &mut self,
        appearances: &[Appearance],
        has_outside: bool,
        linked: &LinkedLight,
        leaves: &[LeafLight],
    ) -> Option<Vec3> {
        if self.solved.is_none() && self.is_solved {
            self.solved = Some(Solved {
                appearances: self.appearances.clone(),
                linked: linked.irradiance.clone(),
                leaves: leaves.to_vec(),
            });
        }
        factor_between(&self.solved.as_ref()?.appearances, appearances, has_outside)
    }

    /// Change the direct light of fields to other appearances. Returns the rays shot; `None` when cancelled, with the light
    /// of some unchanged.
    pub(super) fn mix_direct<'a>(
        &mut self,
        fields: impl Iterator<Item = &'a mut DirectField>,
        shooting: Shooting<'_>,
        appearances: &[Appearance],
    ) -> Option<u64> {
        let mut shot = 0;
        for (number, field) in fields.enumerate() {
            if !self.is_whole {
                // After a cancelled step, vertices may be without samples.
                let Shooting {
                    hierarchy,
                    rays,
                    seed,
                    cancel,
                    ..
                } = shooting;
                shot += field.sample_vertices(rays, hierarchy, field.samples, seed, cancel)?;
            }
            if self.parts.len() <= number {
                let whole = LightParts::whole(field, shooting.scene, &self.appearances);
                self.parts.push(whole);
            }
            shot += self.parts[number].mix(field, shooting, appearances)?;
        }
        Some(shot)
    }

    /// The solved light times a factor: over links by element, and of the leaves.
    pub(super) fn scaled(&self, factor: Vec3) -> Option<(Vec<Vec4>, Vec<LeafLight>)> {
        Some(self.solved.as_ref()?.scaled(factor))
    }

    /// Light of the leaves for other light over links; `None` if no light is stored.
    pub(super) fn leaves_under(&self, linked: &[Vec4]) -> Option<Vec<LeafLight>> {
        Some(self.solved.as_ref()?.leaves_under(linked))
    }

    /// Whether the last step was completed, so that links and samples match the mesh.
    pub(super) fn is_whole(&self) -> bool {
        self.is_whole
    }

    /// Set whether all leaves have gathered the present light.
    pub(super) fn set_solved(&mut self, is_solved: bool) {
        self.is_solved = is_solved;
    }

    /// Discard the stored light after all leaves have gathered the present light.
    pub(super) fn forget_solved(&mut self) {
        self.solved = None;
        self.is_solved = true;
    }

    /// Forget all light: none that comes is to be derived from it.
    pub(super) fn forget_light(&mut self) {
        self.solved = None;
        self.is_solved = false;
    }

    /// Whether all leaves have gathered the present light.
    pub(super) fn is_solved(&self) -> bool {
        self.is_solved
    }

    /// Memory in bytes.
    pub(super) fn memory_bytes(&self) -> usize {
        let solved = self.solved.as_ref().map_or(0, |solved| {
            size_of_val(solved.linked.as_slice()) + size_of_val(solved.leaves.as_slice())
        });
        let parts = self.parts.iter().map(LightParts::memory_bytes);
        solved + parts.sum::<usize>()
    }
}

impl Solved {
    /// This light times a factor.
    fn scaled(&self, factor: Vec3) -> (Vec<Vec4>, Vec<LeafLight>) {
        let factor_w = factor.extend(1.0);
        let linked = self.linked.par_iter().with_min_len(4096);
        let leaves = self.leaves.par_iter().with_min_len(4096);
        (
            linked.map(|light| *light * factor_w).collect(),
            leaves
                .map(|leaf| LeafLight {
                    corners: leaf.corners.map(|light| light * factor_w),
                    centre: leaf.centre * factor_w,
                    ..*leaf
                })
                .collect(),
        )
    }

    /// Light of the leaves for other light over links: within each leaf it varies as in the stored light. Errors are
    /// unchanged.
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

/// Start the iteration from the present light, in proportion to the emitted power; from no light where that exceeds the
/// largest possible power, which the iteration would take for growth.
pub(super) fn begin_from(linked: &mut LinkedLight, surfaces: Surfaces<'_>, emitted_before: DVec3) {
    let ratio = emitted(surfaces.hierarchy) / emitted_before;
    let ratio = ratio.map(|x| if x.is_finite() { x } else { 0.0 }).as_vec3();
    let scale = |light: &mut Vec4| *light *= ratio.extend(1.0);
    linked.irradiance.iter_mut().for_each(scale);
    linked.pull(surfaces);
    let powers = surfaces.powers();
    let sent = area_total(surfaces.hierarchy, |leaf| linked.radiosity(surfaces, leaf));
    if sent + powers.sampled > CEILING_SLACK * powers.most {
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

/// Factor by which all light changes from some appearances to others, if there is one.
fn factor_between(before: &[Appearance], after: &[Appearance], has_outside: bool) -> Option<Vec3> {
    let reflect_alike = before
        .iter()
        .zip(after)
        .all(|(before, after)| before.reflectance == after.reflectance);
    let emissions = before
        .iter()
        .zip(after)
        .map(|(before, after)| (before.emission, after.emission))
        .chain(has_outside.then_some((Vec3::ONE, Vec3::ONE)));
    if reflect_alike {
        common_ratio(emissions)
    } else {
        None
    }
}
