//! Settings: everything that changes the result, each default defined once.

use serde::{Deserialize, Serialize};

use super::{omission::Keep, schedule::THRESHOLD_FACTOR};
use crate::hierarchy::Reading;

/// Representation of a cluster's directional power and area.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Second-order spherical harmonics clamped between the octant sum and the six faces.
    #[default]
    Bounded,
    /// Six power and six area vectors along the box normals (eqs 5–10 of the paper).
    SixFace,
    /// One vector per cluster (eq. 4; Willmott, Heckbert & Garland 1999).
    Single,
    /// The sum over all patches of the cluster (eq. 3; Smits 1994).
    Exact,
    /// A quarter of the area in every direction (Sillion 1995).
    Isotropic,
}

impl Method {
    /// How moments of clusters are read; `None` sums over their patches.
    pub(super) fn reading(self) -> Option<Reading> {
        match self {
            Self::Bounded => Some(Reading::Bounded),
            Self::SixFace => Some(Reading::SixFace),
            Self::Single => Some(Reading::Single),
            Self::Isotropic => Some(Reading::Isotropic),
            Self::Exact => None,
        }
    }
}

/// Estimate of the error of a link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Oracle {
    /// Bounds of the transfer over both nodes.
    #[default]
    Interval,
    /// Largest minus smallest transfer over p sample vectors (the paper's EstimateEnergy).
    Samples,
}

/// Computation of direct light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Direct {
    /// Shadow rays from every vertex, distributed over all emitters in proportion to their irradiance there. Old
    /// reports call it `auto`.
    #[default]
    #[serde(alias = "auto")]
    Sampled,
    /// Over links, as all other light (the paper's way).
    Linked,
}

/// How the irradiance of several links on one cluster reaches its faces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Push {
    /// Summed in the representation of the method and pushed once per sweep (the paper's second way).
    #[default]
    Combined,
    /// Every link's vector pushed to every face at once (the paper's first way); slow on large clusters.
    AtOnce,
}

/// Settings of a solve. The same settings, scene and seed give the same bits on any number of threads.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SolveSettings {
    /// Directional representation of clusters.
    pub method: Method,
    /// How links are judged.
    pub oracle: Oracle,
    /// How direct light is computed.
    pub direct: Direct,
    /// How irradiance is pushed down.
    pub push: Push,
    /// Link threshold of the last step: error of one link's irradiance, weighted by the square root of the receiver's
    /// share of the area, relative to the scene's mean. At least 0 (0 refines until another limit stops it).
    /// Smaller is more accurate and slower: the number of links grows about as 1/ε. Start at 0.005.
    pub epsilon: f32,
    /// Sample pairs p of a link in the `samples` oracle; 1…4096. Cost per link grows with p.
    pub samples: u32,
    /// Shadow rays per vertex, 1…1024; half as many in coarse steps. Where their noise exceeds a share of
    /// `mesh_tolerance`, up to 16 times as many are shot. Noise in penumbrae falls at least as one over the square root
    /// of their number.
    pub shadow_samples: u32,
    /// Smallest area of divided elements, as a fraction of the scene's area; at least 0.
    pub min_area: f32,
    /// Tolerance of the mesh: elements are divided where the error of linear interpolation exceeds it, relative to the
    /// scene's mean and weighted like `epsilon`; above 0.
    pub mesh_tolerance: f32,
    /// Largest angle between faces that are shaded smoothly across their edge, degrees; 0…180.
    pub crease_degrees: f32,
    /// Most steps; at least 1. The threshold falls geometrically to `epsilon` over this many, or over fewer where the
    /// first ones would refine nothing (see [`Self::step_count`]).
    pub max_steps: u32,
    /// Sweeps stop when the residual, and the step to the accelerated solution, are below this fraction of the total
    /// power; above 0.
    pub tolerance: f32,
    /// Error at which the solve ends, if one is asked for: the upper end of the interval of the trimmed RMS error (see
    /// [`EstimatedError`](super::EstimatedError)), above 0. Steps then go on beyond `max_steps` with thresholds below
    /// `epsilon`.
    pub error: Option<f32>,
    /// Seed of every random choice.
    pub seed: u64,
    /// Parts that are computed even where the scene does not need them.
    pub keep: Keep,
}

impl SolveSettings {
    /// Seconds to a first impression.
    pub const fn draft() -> Self {
        Self {
            epsilon: 0.03,
            shadow_samples: 16,
            mesh_tolerance: 0.006,
            min_area: 1e-5,
            max_steps: 3,
            ..Self::normal()
        }
    }

    /// The default: about 2 % error.
    pub const fn normal() -> Self {
        Self {
            method: Method::Bounded,
            oracle: Oracle::Interval,
            direct: Direct::Sampled,
            push: Push::Combined,
            epsilon: 0.005,
            samples: 4,
            shadow_samples: 32,
            min_area: 1e-6,
            mesh_tolerance: 0.001,
            crease_degrees: 30.0,
            max_steps: 5,
            tolerance: 1e-3,
            error: None,
            seed: 1,
            keep: Keep::NONE,
        }
    }

    /// Steps until the estimated error is this small, relative; above 0. The first one has coarse links, since the final
    /// gather makes them as good as finer ones where anything casts a shadow (5 % on `room-1022`: 0.24 s instead of 1.36).
    pub const fn towards(error: f32) -> Self {
        Self {
            epsilon: 0.12,
            mesh_tolerance: 0.006,
            max_steps: 1,
            error: Some(error),
            ..Self::normal()
        }
    }

    /// For a final bake: about 1 % error.
    pub const fn finest() -> Self {
        Self {
            epsilon: 0.002,
            shadow_samples: 64,
            mesh_tolerance: 0.0004,
            min_area: 1e-7,
            max_steps: 6,
            tolerance: 1e-4,
            ..Self::normal()
        }
    }
}

/// Largest threshold of a step: hardly any link has an error as large as the scene's mean irradiance, so a step with a
/// larger threshold would refine nothing. Smaller, and the first picture of a fine solve comes late; larger, and
/// nothing changes in some steps. The presets start at 0.06 to 0.12.
const COARSEST_THRESHOLD: f32 = 1.0;

/// Smallest threshold by which steps are counted, and to which one is raised where links do not fit into memory: halving
/// `COARSEST_THRESHOLD` never reaches 0, and no factor raises 0. Smaller, and a threshold of 0 takes more steps; larger,
/// and small thresholds are reached by one large decrease.
pub(super) const FINEST_THRESHOLD: f32 = 1e-4;

impl SolveSettings {
    /// Number of steps of a solve: `max_steps`, or as many as lead from `COARSEST_THRESHOLD` to `epsilon` if these are
    /// fewer.
    pub fn step_count(&self) -> u32 {
        let span = COARSEST_THRESHOLD / self.epsilon.max(FINEST_THRESHOLD);
        let halvings = span.log(THRESHOLD_FACTOR).ceil().max(0.0) as u32;
        self.max_steps.min(halvings + 1)
    }

    /// Check that all settings are in their ranges.
    ///
    /// # Errors
    /// Names the first setting out of its range, as one sentence.
    pub fn check(&self) -> Result<(), String> {
        let sentence = |name: &str, value: &dyn std::fmt::Display, range: &str| {
            Err(format!("{name} is {value}, but must be {range}"))
        };
        // Any value of the first ones is valid.
        let Self {
            method: _,
            oracle: _,
            direct: _,
            push: _,
            seed: _,
            keep: _,
            epsilon,
            samples,
            shadow_samples,
            min_area,
            mesh_tolerance,
            crease_degrees,
            max_steps,
            tolerance,
            error,
        } = self;
        // A NaN is out of every range.
        for (name, value) in [("epsilon", *epsilon), ("min_area", *min_area)] {
            if !(0.0..=f32::MAX).contains(&value) {
                return sentence(name, &value, "a number of at least 0");
            }
        }
        for (name, value) in [
            ("mesh_tolerance", *mesh_tolerance),
            ("tolerance", *tolerance),
            ("error", error.unwrap_or(1.0)),
        ] {
            if !(f32::MIN_POSITIVE..=f32::MAX).contains(&value) {
                return sentence(name, &value, "a number above 0");
            }
        }
        if !(0.0..=180.0).contains(crease_degrees) {
            let range = "within 0 and 180";
            return sentence("crease_degrees", crease_degrees, range);
        }
        for (name, value, most) in [
            ("samples", *samples, 4096),
            ("shadow_samples", *shadow_samples, 1024),
            ("max_steps", *max_steps, u32::MAX),
        ] {
            if !(1..=most).contains(&value) {
                return sentence(name, &value, &format!("within 1 and {most}"));
            }
        }
        Ok(())
    }
}

impl Default for SolveSettings {
    fn default() -> Self {
        Self::normal()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_as_many_as_requested_without_those_that_refine_nothing() {
        for preset in [
            SolveSettings::draft(),
            SolveSettings::normal(),
            SolveSettings::finest(),
        ] {
            assert_eq!(preset.step_count(), preset.max_steps);
        }
        let endless = |epsilon| SolveSettings {
            epsilon,
            max_steps: u32::MAX,
            ..SolveSettings::normal()
        };
        // 1, 1/2, … 1/256 < 0.005.
        assert_eq!(endless(0.005).step_count(), 9);
        assert_eq!(endless(0.5).step_count(), 2);
        assert_eq!(endless(7.0).step_count(), 1);
        for epsilon in [0.0, 1e-30, 1e-4] {
            assert_eq!(endless(epsilon).step_count(), 15, "{epsilon}");
        }
    }

    #[test]
    fn presets_are_in_range_and_numbers_out_of_it_are_named() {
        for preset in [
            SolveSettings::draft(),
            SolveSettings::normal(),
            SolveSettings::finest(),
        ] {
            assert_eq!(preset.check(), Ok(()));
        }
        for (settings, name) in [
            (
                SolveSettings {
                    epsilon: f32::NAN,
                    ..SolveSettings::normal()
                },
                "epsilon is NaN",
            ),
            (
                SolveSettings {
                    tolerance: 0.0,
                    ..SolveSettings::normal()
                },
                "tolerance is 0",
            ),
            (
                SolveSettings {
                    samples: 5000,
                    ..SolveSettings::normal()
                },
                "samples is 5000, but must be within 1 and 4096",
            ),
        ] {
            let sentence = settings.check().unwrap_err();
            assert!(sentence.starts_with(name), "{sentence}");
        }
    }
}
