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

use glam::Vec4;
use rayon::prelude::*;

use super::{
    anderson::Anderson,
    gather::{self, LinkedClusters},
    light::LinkedLight,
};
use crate::{
    hierarchy::Hierarchy,
    solver::{Cancel, SolveSettings, coverage::CoverageMap, direct::Surfaces, sums::area_total},
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

/// What an iteration needs beside the light.
#[derive(Clone, Copy)]
pub(crate) struct Iteration<'a> {
    /// What exchanges light.
    pub surfaces: Surfaces<'a>,
    /// What form factors are scaled to.
    pub coverage: &'a CoverageMap,
    /// How tables are read and irradiance is pushed.
    pub settings: &'a SolveSettings,
    /// To which part of the power the light must settle, as the tolerance of the settings is.
    pub tolerance: f32,
    /// Stops it.
    pub cancel: &'a Cancel,
}

/// How an iteration went.
#[derive(Clone, Debug, Default)]
pub(crate) struct Convergence {
    /// Sweeps that it took.
    pub sweeps: u32,
    /// What the last sweep changed, relative to the power that arrived.
    pub residual: f32,
    /// Largest ratio by which a sweep changed the distance of two lights; 0 where nothing tells it.
    pub contraction: f32,
    /// What had to be done to keep it stable, one sentence each.
    pub notes: Vec<String>,
}

/// What one sweep did to the light.
struct Sweep {
    /// Irradiance of all elements after it.
    image: Vec<Vec4>,
    /// Power that was sent, over links and from sampled emitters.
    sent: f64,
    /// Power that was reflected of what arrived.
    returned: f64,
    /// As `returned`, had the links not been scaled to the coverage.
    returned_unscaled: f64,
    /// Power that arrived, direct light included.
    arrived: f64,
    /// Sum of the changes of power.
    change: f64,
}

/// How the iteration ended.
enum Ending {
    /// It settled.
    Converged,
    /// It did not settle within the sweeps that it has.
    NotConverged,
    /// Each sweep made light.
    Growing,
}

/// Gather, push and pull until the light settles. Where it grows instead, rows are bounded, and light gets through as area
/// does; where even that does not help, the light from before stays. `None` when cancelled.
pub(crate) fn iterate(linked: &mut LinkedLight, iteration: Iteration<'_>) -> Option<Convergence> {
    let before = linked.irradiance.clone();
    let mut convergence = Convergence::default();
    for bounds_rows in [false, true] {
        match converge(linked, iteration, bounds_rows, &mut convergence)? {
            Ending::Converged => break,
            Ending::NotConverged => {
                convergence.notes.push(format!(
                    "the iteration has not converged after {} sweeps: the residual is {:.1e}",
                    convergence.sweeps, convergence.residual
                ));
                break;
            }
            Ending::Growing => {
                linked.irradiance.clone_from(&before);
                linked.pull(iteration.surfaces);
                linked.links.level(iteration.surfaces.hierarchy);
                convergence.notes.push(if bounds_rows {
                    "the light still grows: that of the last step stays".to_owned()
                } else {
                    "the light grows from sweep to sweep: form factors of each element are bounded by 1"
                        .to_owned()
                });
            }
        }
    }
    Some(convergence)
}

/// One iteration, with or without a bound on the sums of form factors.
fn converge(
    linked: &mut LinkedLight,
    iteration: Iteration<'_>,
    bounds_rows: bool,
    convergence: &mut Convergence,
) -> Option<Ending> {
    let Iteration {
        surfaces,
        tolerance,
        cancel,
        ..
    } = iteration;
    // What is the same in all sweeps.
    let hierarchy = surfaces.hierarchy;
    let weights = leaf_areas(hierarchy);
    let linked_clusters = LinkedClusters::new(hierarchy, &linked.links);
    let direct = surfaces.direct_of_leaves();
    let ceiling = CEILING_SLACK * surfaces.most_power();
    let mut acceleration = Anderson::new(DEPTH);
    let mut growing = 0;
    for _ in 0..MOST_SWEEPS {
        // Gather, and let the acceleration propose the next light.
        cancel.proceed()?;
        let sweep = sweep(linked, iteration, &linked_clusters, &direct, bounds_rows)?;
        convergence.sweeps += 1;
        cancel.proceed()?;
        let next = acceleration.next(&weights, &linked.irradiance, &sweep.image);
        cancel.proceed()?;
        // How far the light is from the solution.
        let step = power_between(hierarchy, &next, &linked.irradiance);
        let relative = |power: f64| power / sweep.arrived.max(f64::MIN_POSITIVE);
        let (residual, error) = (relative(sweep.change), relative(step));
        convergence.residual = residual as f32;
        if let Some(ratio) = acceleration.contraction(&weights) {
            convergence.contraction = convergence.contraction.max(ratio);
        }
        // Give up where sweeps make light.
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
        // Go on from the proposed light, or end with what was gathered.
        let is_converged = residual <= ROUNDING || residual.max(error) <= f64::from(tolerance);
        linked.irradiance = if is_converged { sweep.image } else { next };
        linked.pull(surfaces);
        if is_converged {
            note_unscaled_growth(convergence, sweep.returned_unscaled / sweep.sent);
            return Some(Ending::Converged);
        }
    }
    Some(Ending::NotConverged)
}

/// Gather once, and measure what came of it beside the direct light of the leaves; `None` when cancelled.
fn sweep(
    linked: &LinkedLight,
    iteration: Iteration<'_>,
    linked_clusters: &LinkedClusters,
    direct: &[Vec4],
    bounds_rows: bool,
) -> Option<Sweep> {
    let Iteration {
        surfaces,
        coverage,
        settings,
        tolerance: _,
        cancel,
    } = iteration;
    let hierarchy = surfaces.hierarchy;
    let kernel = linked.kernel(hierarchy, settings.method.reading());
    let mut image = gather::gather(
        kernel,
        &linked.links,
        linked_clusters,
        settings.push,
        cancel,
    )?;
    let returned = |image: &[Vec4]| {
        area_total(hierarchy, |leaf| {
            hierarchy.reflectance_of(leaf).extend(0.0) * (image[leaf] + direct[leaf])
        })
    };
    let returned_unscaled = returned(&image);
    coverage.scale(hierarchy, &linked.power, &mut image, bounds_rows);
    cancel.proceed()?;
    Some(Sweep {
        sent: area_total(hierarchy, |leaf| linked.radiosity(surfaces, leaf))
            + surfaces.sampled_power(),
        returned: returned(&image),
        returned_unscaled,
        arrived: area_total(hierarchy, |leaf| image[leaf] + direct[leaf]),
        change: power_between(hierarchy, &image, &linked.irradiance),
        image,
    })
}

fn power_between(hierarchy: &Hierarchy, a: &[Vec4], b: &[Vec4]) -> f64 {
    area_total(hierarchy, |leaf| (a[leaf] - b[leaf]).abs())
}

/// Areas of the leaves, 0 for other elements.
fn leaf_areas(hierarchy: &Hierarchy) -> Vec<f32> {
    let elements = hierarchy.mesh.elements.par_iter();
    elements
        .map(|element| {
            if element.is_leaf() {
                element.area_vector.length()
            } else {
                0.0
            }
        })
        .collect()
}

/// Say so where only the scaling to the coverage keeps the light from growing.
fn note_unscaled_growth(convergence: &mut Convergence, gain: f64) {
    if gain > 1.0 + UNSCALED_SLACK {
        convergence.notes.push(format!(
            "the links are too coarse to keep energy: by themselves they would return {gain:.2} times the light that \
             is sent, sweep after sweep; scaled to the coverage they do not"
        ));
    }
}

/// Bytes that an iteration needs beside what a solve holds: its memory, the light before and after, and the direct light.
pub(crate) const fn iteration_bytes(element_count: usize) -> usize {
    const VECTORS: usize = 4;
    Anderson::memory_bytes(DEPTH, element_count) + VECTORS * element_count * size_of::<Vec4>()
}
