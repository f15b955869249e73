//! What a change of settings does to a run.

use crate::solver::{Oracle, SolveSettings};

/// What a change of settings does to a run, from the least to the most effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Effect {
    /// The settings are the same.
    Nothing,
    /// The light stays as accurate as required; a run continues, a finished one stays finished.
    Continues,
    /// The light stays, and a finished run resumes.
    Refines,
    /// The light does not fit the settings: the run starts over.
    Restarts,
}

/// What changing `old` to `new` does. Field by field:
///
/// * `method`, `oracle`, `direct`, `push`, `shadow_samples`, `crease_degrees`, `seed`, `keep`: restart, since links, samples or
///   vertices that exist were made by the old value;
/// * `samples`: restarts where the oracle uses it, else continues;
/// * `epsilon`, `min_area`, `mesh_tolerance`, `tolerance`: lower refines, higher continues;
/// * `max_steps`: more refines, fewer continues;
/// * `error`: refines, since steps go on or end by it.
pub fn effect_of_change(old: &SolveSettings, new: &SolveSettings) -> Effect {
    if old == new {
        return Effect::Nothing;
    }
    // Taken apart, so that no field can be forgotten.
    let SolveSettings {
        method,
        oracle,
        direct,
        push,
        epsilon,
        samples,
        shadow_samples,
        min_area,
        mesh_tolerance,
        crease_degrees,
        max_steps,
        tolerance,
        error,
        seed,
        keep,
    } = new;
    let restarts = old.method != *method
        || old.oracle != *oracle
        || old.direct != *direct
        || old.push != *push
        || old.shadow_samples != *shadow_samples
        || old.crease_degrees != *crease_degrees
        || old.seed != *seed
        || old.keep != *keep
        || (old.samples != *samples && *oracle == Oracle::Samples);
    let refines = *epsilon < old.epsilon
        || *min_area < old.min_area
        || *mesh_tolerance < old.mesh_tolerance
        || *tolerance < old.tolerance
        || *max_steps > old.max_steps
        || *error != old.error;
    if restarts {
        Effect::Restarts
    } else if refines {
        Effect::Refines
    } else {
        Effect::Continues
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::{Keep, Method};

    fn effect(change: impl Fn(&mut SolveSettings)) -> Effect {
        let old = SolveSettings::normal();
        let mut new = old.clone();
        change(&mut new);
        effect_of_change(&old, &new)
    }

    #[test]
    fn each_field_has_the_documented_effect() {
        assert_eq!(effect(|_| {}), Effect::Nothing);
        assert_eq!(effect(|s| s.method = Method::SixFace), Effect::Restarts);
        assert_eq!(effect(|s| s.seed += 1), Effect::Restarts);
        assert_eq!(effect(|s| s.keep = Keep::ALL), Effect::Restarts);
        assert_eq!(effect(|s| s.crease_degrees = 60.0), Effect::Restarts);
        assert_eq!(effect(|s| s.samples = 9), Effect::Continues);
        assert_eq!(effect(|s| s.epsilon *= 0.5), Effect::Refines);
        assert_eq!(effect(|s| s.epsilon *= 2.0), Effect::Continues);
        assert_eq!(effect(|s| s.max_steps += 1), Effect::Refines);
        assert_eq!(effect(|s| s.max_steps -= 1), Effect::Continues);
    }

    #[test]
    fn the_strongest_effect_of_several_wins() {
        let both = effect(|s| {
            s.epsilon *= 2.0;
            s.tolerance *= 0.1;
        });
        assert_eq!(both, Effect::Refines);
        let all = effect(|s| {
            s.epsilon *= 0.5;
            s.seed = 7;
        });
        assert_eq!(all, Effect::Restarts);
    }
}
