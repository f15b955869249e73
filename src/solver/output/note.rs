//! Notes of a step: measures that it took to stay stable, and limits that it met.

use std::fmt;

use serde::{Serialize, Serializer};

/// A measure to stay stable or within a limit. Displayed and serialised as one sentence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Note {
    /// The iteration did not converge.
    NotConverged {
        /// Sweeps of the step.
        sweeps: u32,
        /// Change of power by the last sweep, relative to the total power.
        residual: f32,
    },
    /// The light grew from sweep to sweep, so the sums of form factors are bounded by 1.
    GrowthBounded,
    /// The light grew in spite of that bound, so the light of the last step stays.
    GrowthUnbounded,
    /// Only the scaling to the hemisphere coverage prevents growth.
    CoarseLinks {
        /// Power that unscaled links would return in each sweep, relative to the power sent.
        gain: f64,
    },
    /// The memory limit prevented finer links or elements.
    MemoryLimit,
    /// Finer links would have taken longer than the rays that do as well.
    LinksLimited {
        /// The threshold that the present links meet.
        epsilon: f32,
    },
    /// What curved mirrors, gloss and glass reflect counts as diffuse.
    Diffused {
        /// Its part of the reflected power, 0…1.
        share: f64,
    },
    /// The error that was asked for is not reached, and further steps do not lead there.
    ErrorNotReached {
        /// The error that was asked for, relative.
        wanted: f32,
        /// What stands in the way.
        obstacle: Obstacle,
    },
}

/// What stands in the way of a smaller error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Obstacle {
    /// The memory limit.
    Memory,
    /// The estimate says that the error is small enough, but its interval is too wide.
    Noise,
    /// Finer links and elements no longer reduce the error.
    Mesh,
}

impl Note {
    /// Whether it tells what the result lacks, and not only how it was reached.
    pub fn limits_result(&self) -> bool {
        match self {
            Self::NotConverged { .. }
            | Self::GrowthUnbounded
            | Self::MemoryLimit
            | Self::Diffused { .. }
            | Self::ErrorNotReached { .. } => true,
            Self::GrowthBounded | Self::CoarseLinks { .. } | Self::LinksLimited { .. } => false,
        }
    }
}

impl fmt::Display for Note {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotConverged { sweeps, residual } => write!(
                out,
                "the iteration has not converged after {sweeps} sweeps: the residual is {residual:.1e}"
            ),
            Self::GrowthBounded => out.write_str(
                "the light grows from sweep to sweep: the sum of form factors of each element is bounded by 1",
            ),
            Self::GrowthUnbounded => out.write_str(
                "the light still grows from sweep to sweep: the light of the last step stays",
            ),
            Self::CoarseLinks { gain } => write!(
                out,
                "the links are too coarse to conserve energy: unscaled, they would return {gain:.2} times the light \
                 that is sent in each sweep; scaled to the hemisphere coverage, they do not"
            ),
            Self::ErrorNotReached { wanted, obstacle } => write!(
                out,
                "an error of {} % is not reached: {}",
                100.0 * wanted,
                match obstacle {
                    Obstacle::Memory => "the memory limit allows no finer links and elements",
                    Obstacle::Noise =>
                        "the estimated error is that small, but its interval is not, and no more rays are shot for it",
                    Obstacle::Mesh => "finer links and elements no longer reduce the error",
                }
            ),
            Self::Diffused { share } => write!(
                out,
                "{:.1} % of the reflected light comes from gloss, curved mirrors and glass: it lights other surfaces as if it were diffuse",
                100.0 * share
            ),
            Self::LinksLimited { epsilon } => write!(
                out,
                "the links keep a threshold of {epsilon}: finer ones would take longer than the rays of the final gather, \
                 which do as well"
            ),
            Self::MemoryLimit => {
                out.write_str("the memory limit is reached; refinement stops here with what fits")
            }
        }
    }
}

impl Serialize for Note {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notes_are_serialised_as_sentences() {
        let note = Note::NotConverged {
            sweeps: 100,
            residual: 0.0125,
        };
        let text = serde_json::to_string(&[note, Note::MemoryLimit]).unwrap();
        assert_eq!(
            text,
            "[\"the iteration has not converged after 100 sweeps: the residual is 1.3e-2\",\
             \"the memory limit is reached; refinement stops here with what fits\"]"
        );
    }
}
