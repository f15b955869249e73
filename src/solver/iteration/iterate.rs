//! The iteration: light is gathered over the links until it converges.
//!
//! Sweeps of the first step to a residual of 1e-4, in furnaces and in white rooms:
//!
//! | scene | plain | Anderson 1 | 2 | 3 | 5 |
//! |---|---|---|---|---|---|
//! | furnace, reflectance 0.9 | 67 | 3 | 3 | 3 | 3 |
//! | furnace, 0.9999 | over 100 | 4 | 4 | 4 | 4 |
//! | `cornell` as it is | 13 | 10 | 8 | 7 | 7 |
//! | `cornell`, all 0.999 | 55 | 31 | 16 | 15 | 11 |
//! | `room-1022`, all 0.999 (worst of three steps) | over 100 | over 100 | 86 | 30 | 24 |
//!
//! Chebyshev's iteration over 0…reflectance took 7 and 16 sweeps in furnaces of 0.5 and 0.9 and diverged elsewhere: the
//! operator also has negative eigenvalues without a cheap bound. GMRES on differences did not converge in 60 sweeps
//! even at 0.5: its directions have both signs, for which bounded tables are not linear. Anderson's combinations stay
//! near physical light.

use glam::Vec4;
use rayon::prelude::*;

use super::{anderson::Anderson, gather::LinkedClusters, light::LinkedLight};
use crate::{
    hierarchy::Hierarchy,
    solver::{
        Cancel, Note, SolveSettings, coverage::CoverageMap, direct::Surfaces, sums::area_total,
    },
};

/// Iterates that acceleration remembers, with 24 bytes each for every element (see above). Smaller than 3, and white
/// rooms take many sweeps; larger than 5, and little is gained.
const DEPTH: usize = 4;

/// Most sweeps of one step. Fewer, and mazes of white walls stop early; more, and an iteration that does not converge
/// is given up late.
const MOST_SWEEPS: u32 = 100;

/// Residual below which the light counts as converged for any tolerance: that of single precision. Smaller is never
/// reached; larger ignores small tolerances.
const ROUNDING: f64 = 2e-7;

/// Relative excess of the returned over the sent power from which a sweep counts as growing. Smaller, and noise of
/// direct light and rounding count; larger, and growth is noticed late.
const GROWTH_SLACK: f64 = 1e-3;

/// Relative excess of the power that unscaled links return from which a note is made. Smaller, and noise of the
/// visibility counts; larger, and links that create energy stay unnoticed.
const UNSCALED_SLACK: f64 = 0.02;

/// Successive growing sweeps after which the light counts as growing. Fewer, and single sweeps of uneven light count;
/// more, and growth is noticed late.
const GROWING_SWEEPS: u32 = 5;

/// Factor by which the power may exceed the largest possible one. Smaller, and noise of direct light counts as growth;
/// larger, and growth is noticed late.
pub(crate) const CEILING_SLACK: f64 = 1.1;

/// Input of an iteration, beside the light.
#[derive(Clone, Copy)]
pub(crate) struct Iteration<'a> {
    /// The elements, with their direct light.
    pub surfaces: Surfaces<'a>,
    /// Coverage to which form factors are scaled.
    pub coverage: &'a CoverageMap,
    /// How tables are read and irradiance is pushed.
    pub settings: &'a SolveSettings,
    /// Residual at which the light counts as converged, relative to the total power.
    pub tolerance: f32,
    /// The request to stop.
    pub cancel: &'a Cancel,
}

/// Figures of an iteration.
#[derive(Clone, Debug, Default)]
pub(crate) struct Convergence {
    /// Number of sweeps.
    pub sweeps: u32,
    /// Change of power by the last sweep, relative to the power that arrived.
    pub residual: f32,
    /// Largest contraction (see [`Anderson::contraction`]); 0 if none was measured.
    pub contraction: f32,
    /// Measures to stay stable.
    pub notes: Vec<Note>,
}

/// Result of one sweep.
struct Sweep {
    /// Linked irradiance of all elements after it.
    image: Vec<Vec4>,
    /// Power that was sent, over links and from sampled emitters.
    sent: f64,
    /// The reflected part of the power that arrived.
    returned: f64,
    /// As `returned`, without scaling to the coverage.
    returned_unscaled: f64,
    /// Power that arrived, direct light included.
    arrived: f64,
    /// Sum of the absolute changes of power.
    change: f64,
}

/// How the iteration ended.
enum Ending {
    /// The light converged.
    Converged,
    /// The light did not converge within [`MOST_SWEEPS`].
    NotConverged,
    /// Sweeps created light.
    Growing,
}

/// Gather, push and pull until the light converges. If it grows instead, it is iterated again with sums of form factors
/// bounded by 1 and the visibility of the area for all light; if it still grows, the light from before stays. `None`
/// when cancelled.
pub(crate) fn iterate(linked: &mut LinkedLight, iteration: Iteration<'_>) -> Option<Convergence> {
    let before = linked.irradiance.clone();
    let mut convergence = Convergence::default();
    for bounds_rows in [false, true] {
        match converge(linked, iteration, bounds_rows, &mut convergence)? {
            Ending::Converged => break,
            Ending::NotConverged => {
                convergence.notes.push(Note::NotConverged {
                    sweeps: convergence.sweeps,
                    residual: convergence.residual,
                });
                break;
            }
            Ending::Growing => {
                linked.irradiance.clone_from(&before);
                linked.pull(iteration.surfaces);
                linked.links.level(iteration.surfaces.hierarchy);
                for image in &mut linked.images {
                    image.links.level(iteration.surfaces.hierarchy);
                }
                convergence.notes.push(match bounds_rows {
                    false => Note::GrowthBounded,
                    true => Note::GrowthUnbounded,
                });
            }
        }
    }
    Some(convergence)
}

/// One iteration, with or without a bound of the sums of form factors.
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
    // The same in all sweeps.
    let direct = surfaces.direct_of_leaves();
    let surfaces = surfaces.knowing(&direct);
    let iteration = Iteration {
        surfaces,
        ..iteration
    };
    let hierarchy = surfaces.hierarchy;
    let weights = leaf_areas(hierarchy);
    let linked_clusters = LinkedClusters::new(hierarchy, &linked.links);
    let clusters_of_images = linked.clusters_of_images(hierarchy);
    let powers = surfaces.powers();
    let ceiling = CEILING_SLACK * powers.most;
    let mut acceleration = Anderson::new(DEPTH);
    let mut growing = 0;
    for _ in 0..MOST_SWEEPS {
        // Gather, and find the accelerated light.
        cancel.proceed()?;
        let sweep = sweep(
            linked,
            iteration,
            (&linked_clusters, &clusters_of_images),
            powers.sampled,
            bounds_rows,
        )?;
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
        // Stop where sweeps create light.
        growing = if sweep.returned > sweep.sent * (1.0 + GROWTH_SLACK) {
            growing + 1
        } else {
            0
        };
        let is_bounded = sweep.sent <= ceiling && sweep.returned.is_finite();
        // With bounded sums no irradiance exceeds the largest radiosity: only the total power may grow, for a while.
        if (growing >= GROWING_SWEEPS && !bounds_rows) || !is_bounded {
            return Some(Ending::Growing);
        }
        // Continue with the accelerated light, or end with the gathered light.
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

/// Gather once, and measure the result together with the direct light and the power that is sampled;
/// `None` when cancelled.
fn sweep(
    linked: &LinkedLight,
    iteration: Iteration<'_>,
    (linked_clusters, clusters_of_images): (&LinkedClusters, &[LinkedClusters]),
    sampled: f64,
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
    let mut image = linked.gather(hierarchy, &linked.power, linked_clusters, settings, cancel)?;
    let returned = |image: &[Vec4]| {
        area_total(hierarchy, |leaf| {
            hierarchy.reflectance_of(leaf).extend(0.0) * (image[leaf] + surfaces.direct(leaf))
        })
    };
    let returned_unscaled = returned(&image);
    coverage.scale(hierarchy, &linked.power, &mut image, bounds_rows);
    linked.add_images(hierarchy, clusters_of_images, settings, cancel, &mut image)?;
    cancel.proceed()?;
    Some(Sweep {
        sent: area_total(hierarchy, |leaf| linked.radiosity(surfaces, leaf)) + sampled,
        returned: returned(&image),
        returned_unscaled,
        arrived: area_total(hierarchy, |leaf| image[leaf] + surfaces.direct(leaf)),
        change: power_between(hierarchy, &image, &linked.irradiance),
        image,
    })
}

/// Sum of the absolute differences of two irradiances, times area.
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

/// Add a note if only the scaling to the coverage prevents growth.
fn note_unscaled_growth(convergence: &mut Convergence, gain: f64) {
    if gain > 1.0 + UNSCALED_SLACK {
        convergence.notes.push(Note::CoarseLinks { gain });
    }
}

/// Memory of an iteration in bytes, beside that of the solve: acceleration, light before and after, and direct light.
pub(crate) const fn iteration_bytes(element_count: usize) -> usize {
    const VECTORS: usize = 4;
    Anderson::memory_bytes(DEPTH, element_count) + VECTORS * element_count * size_of::<Vec4>()
}
