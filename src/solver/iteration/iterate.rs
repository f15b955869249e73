//! The iteration: light gathered over the links that there are, until it settles.
//!
//! Compared on furnaces and on rooms painted white, to a residual of 1e-4, in sweeps of the first step:
//!
//! | scene | plain | Anderson 1 | 2 | 3 | 5 |
//! |---|---|---|---|---|---|
//! | furnace, reflectance 0.9 | 67 | 3 | 3 | 3 | 3 |
//! | furnace, 0.9999 | over 100 | 4 | 4 | 4 | 4 |
//! | `cornell` as it is | 13 | 10 | 8 | 7 | 7 |
//! | `cornell`, all 0.999 | 55 | 31 | 16 | 15 | 11 |
//! | `room-1022`, all 0.999 (worst of three steps) | over 100 | over 100 | 86 | 30 | 24 |
//!
//! Chebyshev's iteration over 0…reflectance took 7 and 16 sweeps in furnaces of 0.5 and 0.9 and diverged elsewhere:
//! the operator has eigenvalues below 0 too, and nothing cheap bounds them. GMRES on differences did not settle in 60
//! sweeps even at 0.5: its directions have both signs, and bounded tables do not answer those linearly. Anderson's
//! combinations stay near light that can be.

use std::f32::consts::PI;

use glam::Vec4;
use rayon::prelude::*;

use super::{
    anderson::Anderson,
    gather::{self, Holders},
};
use crate::solver::{
    Cancel, Solver, StepReport,
    sums::{area_sum, ordered_sum},
};

/// Iterates that acceleration remembers: 24 bytes each for every element. See above; below 3 white rooms take many
/// sweeps, above 5 little is gained.
const DEPTH: usize = 4;

/// Sweeps of one step at most. Fewer, and mazes of white walls stop early; more, and an iteration that does not settle
/// is given up late.
const MOST_SWEEPS: u32 = 100;

/// Residuals below this are rounding of single precision: sweeps cannot lower them.
const ROUNDING: f64 = 2e-7;

/// A sweep may return this share more light than was sent before it counts as growth: noise of direct light and
/// rounding. Surfaces that reflect less than all they get return less.
const GROWTH_SLACK: f64 = 1e-3;

/// Unscaled links may return this share more than is sent before it is worth a note: visibility is noisy.
const UNSCALED_SLACK: f64 = 0.02;

/// Sweeps in a row that must return more than was sent: of uneven light, single sweeps may.
const GROWING_SWEEPS: u32 = 5;

/// Factor by which all light may exceed what emitters can keep up, for the noise of direct light.
pub(crate) const CEILING_SLACK: f64 = 1.1;

/// What one sweep did to the light.
struct Sweep {
    /// Irradiance of all elements after it.
    image: Vec<Vec4>,
    /// Power that was sent, over links and from sampled emitters.
    sent: f64,
    /// Power that was reflected of what arrived.
    returned: f64,
    /// As `returned`, had the links not been scaled to the closure.
    returned_unscaled: f64,
    /// Power that arrived, direct light included.
    arrived: f64,
    /// Sum of the changes of power.
    change: f64,
}

/// How the iteration ended.
enum Ending {
    /// It settled.
    Settled,
    /// It did not settle within the sweeps that it has.
    Unsettled,
    /// Each sweep made light.
    Growing,
}

impl Solver {
    /// Gather, push and pull until the light settles to a tolerance, as that of the settings is. Where it grows instead, rows are bounded, and light gets through as
    /// area does; where even that does not help, the light from before stays.
    pub(crate) fn iterate(
        &mut self,
        report: &mut StepReport,
        tolerance: f32,
        cancel: &Cancel,
    ) -> Option<()> {
        let before = self.linked.clone();
        for bounds_rows in [false, true] {
            match self.settle(report, tolerance, bounds_rows, cancel)? {
                Ending::Settled => return Some(()),
                Ending::Unsettled => {
                    report.notes.push(format!(
                        "the iteration has not converged after {} sweeps: the residual is {:.1e}",
                        report.sweeps, report.residual
                    ));
                    return Some(());
                }
                Ending::Growing => {
                    self.linked.clone_from(&before);
                    self.pull();
                    self.links.level(&self.hierarchy);
                    report.notes.push(if bounds_rows {
                        "the light still grows: that of the last step stays".to_owned()
                    } else {
                        "the light grows from sweep to sweep: form factors of each element are bounded by 1"
                            .to_owned()
                    });
                }
            }
        }
        Some(())
    }

    /// One iteration, with or without a bound on the sums of form factors.
    fn settle(
        &mut self,
        report: &mut StepReport,
        tolerance: f32,
        bounds_rows: bool,
        cancel: &Cancel,
    ) -> Option<Ending> {
        let weights = self.leaf_shares();
        let holders = Holders::new(&self.hierarchy, &self.links);
        let direct = self.direct_of_leaves();
        let ceiling = CEILING_SLACK * self.most_power();
        let mut acceleration = Anderson::new(DEPTH);
        let mut growing = 0;
        for _ in 0..MOST_SWEEPS {
            cancel.proceed()?;
            let sweep = self.sweep(&holders, &direct, bounds_rows, cancel)?;
            report.sweeps += 1;
            cancel.proceed()?;
            let next = acceleration.next(&weights, &self.linked, &sweep.image);
            cancel.proceed()?;
            let step = self.power_between(&next, &self.linked);
            let relative = |power: f64| power / sweep.arrived.max(f64::MIN_POSITIVE);
            let (residual, error) = (relative(sweep.change), relative(step));
            report.residual = residual as f32;
            if let Some(ratio) = acceleration.contraction(&weights) {
                report.contraction = report.contraction.max(ratio);
            }
            growing = if sweep.returned > sweep.sent * (1.0 + GROWTH_SLACK) {
                growing + 1
            } else {
                0
            };
            let is_bounded = sweep.sent <= ceiling && sweep.returned.is_finite();
            // Where rows are bounded, no place can get more than the brightest sends: only in sum it may, for a while.
            if (growing >= GROWING_SWEEPS && !bounds_rows) || !is_bounded {
                return Some(Ending::Growing);
            }
            let is_settled = residual <= ROUNDING || residual.max(error) <= f64::from(tolerance);
            self.linked = if is_settled { sweep.image } else { next };
            self.pull();
            if is_settled {
                note_unscaled_growth(report, sweep.returned_unscaled / sweep.sent);
                return Some(Ending::Settled);
            }
        }
        Some(Ending::Unsettled)
    }

    /// Gather once, and measure what came of it beside the direct light; `None` when cancelled.
    fn sweep(
        &self,
        holders: &Holders,
        direct: &[Vec4],
        bounds_rows: bool,
        cancel: &Cancel,
    ) -> Option<Sweep> {
        let push = self.settings.push;
        let mut image = gather::gather(self.kernel(), &self.links, holders, push, cancel)?;
        let returned = |image: &[Vec4]| {
            self.leaf_sum(|leaf| {
                self.hierarchy.reflectance_of(leaf).extend(0.0) * (image[leaf] + direct[leaf])
            })
        };
        let returned_unscaled = returned(&image);
        self.scale_to_closure(&mut image, bounds_rows);
        cancel.proceed()?;
        Some(Sweep {
            sent: self.leaf_sum(|leaf| self.radiosity(leaf)) + self.sampled_power(),
            returned: returned(&image),
            returned_unscaled,
            arrived: self.leaf_sum(|leaf| image[leaf] + direct[leaf]),
            change: self.power_between(&image, &self.linked),
            image,
        })
    }

    fn power_between(&self, a: &[Vec4], b: &[Vec4]) -> f64 {
        self.leaf_sum(|leaf| (a[leaf] - b[leaf]).abs())
    }

    pub(crate) fn leaf_sum(&self, of: impl Fn(usize) -> Vec4 + Sync) -> f64 {
        area_sum(&self.hierarchy, of).element_sum()
    }

    /// Direct irradiance of the leaves, 0 for other elements: the same in every sweep.
    fn direct_of_leaves(&self) -> Vec<Vec4> {
        let elements = self.hierarchy.mesh.elements.par_iter().enumerate();
        elements
            .map(|(index, element)| {
                if element.is_leaf() {
                    self.direct_of(index)
                } else {
                    Vec4::ZERO
                }
            })
            .collect()
    }

    /// Areas of the leaves, 0 for other elements.
    fn leaf_shares(&self) -> Vec<f32> {
        self.hierarchy
            .mesh
            .elements
            .par_iter()
            .map(|element| {
                if element.is_leaf() {
                    element.area_vector.length()
                } else {
                    0.0
                }
            })
            .collect()
    }

    /// Power of the emitters that no link carries.
    pub(crate) fn sampled_power(&self) -> f64 {
        let Some(field) = &self.direct else {
            return 0.0;
        };
        let of_patch = |index: usize| {
            let patch = &self.hierarchy.patches[index];
            f64::from((patch.emission * PI).element_sum()) * f64::from(patch.area)
        };
        field.lights.sampled_patches().map(of_patch).sum()
    }

    /// No more power than this can be under way: what is emitted, if everything reflected as the brightest surface does.
    pub(crate) fn most_power(&self) -> f64 {
        let patches = &self.hierarchy.patches;
        let brightest = self.hierarchy.largest_reflectance();
        let emitted = ordered_sum(patches.len(), |index| {
            patches[index].emission.as_dvec3() * f64::from(patches[index].area)
        });
        let absorbed = 1.0 - f64::from(brightest);
        if absorbed > 0.0 {
            f64::from(PI) * emitted.element_sum() / absorbed
        } else {
            f64::INFINITY
        }
    }
}

/// Say so where only the scaling to the closure keeps the light from growing.
fn note_unscaled_growth(report: &mut StepReport, gain: f64) {
    if gain > 1.0 + UNSCALED_SLACK {
        report.notes.push(format!(
            "the links are too coarse to keep energy: by themselves they would return {gain:.2} times the light that \
             is sent, sweep after sweep; scaled to the closure they do not"
        ));
    }
}

impl Solver {
    /// Bytes that an iteration needs beside what the solver holds: its memory, the light before and after, and the direct
    /// light.
    pub(crate) const fn iteration_bytes(element_count: usize) -> usize {
        const VECTORS: usize = 4;
        Anderson::memory_bytes(DEPTH, element_count) + VECTORS * element_count * size_of::<Vec4>()
    }
}
