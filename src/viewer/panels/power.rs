//! Powers in the panels: in watts where the scene's unit of length is known to be the metre, else relative to
//! the power that leaves all surfaces of the scene.

use std::sync::Arc;

use crate::viewer::{figures::figure, loader::LoadedScene, state::State};

/// From powers in frame units to text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PowerScale {
    is_in_watts: bool,
    factor: f64,
}

impl PowerScale {
    /// That of the scene that is shown.
    pub fn of(state: &State) -> Self {
        let loaded = state.loaded.as_ref();
        let is_in_metres =
            |loaded: &&Arc<LoadedScene>| state.view.is_in_metres || loaded.scene.is_in_metres;
        match loaded.filter(is_in_metres) {
            Some(loaded) => Self {
                is_in_watts: true,
                factor: loaded.scene.frame.area_to_world(1.0)
                    * f64::from(state.view.emission_scale),
            },
            None => {
                let snapshot = state.run.snapshot.as_ref();
                let root = snapshot.and_then(|snapshot| snapshot.clusters.first());
                let whole = root.map_or(0.0, |root| f64::from(root.power));
                Self::relative_to(whole)
            }
        }
    }

    fn relative_to(whole: f64) -> Self {
        Self {
            is_in_watts: false,
            factor: if whole > 0.0 { 100.0 / whole } else { 0.0 },
        }
    }

    /// Name of the figures.
    pub fn name(&self) -> &'static str {
        if self.is_in_watts {
            "Power"
        } else {
            "Relative power"
        }
    }

    /// Explanation of the figures, for a hint.
    pub fn explanation(&self) -> &'static str {
        if self.is_in_watts {
            "Luminance of the power that leaves"
        } else {
            "Part of the power that leaves all surfaces. Watts need the unit of length, which OBJ files do not say: see \
             'Limits and scene'"
        }
    }

    /// The unit of the figures.
    pub fn unit(&self) -> &'static str {
        if self.is_in_watts { "W" } else { "%" }
    }

    /// A power in frame units as a figure.
    pub fn value(&self, power: f32) -> f64 {
        f64::from(power) * self.factor
    }

    /// A power in frame units with its unit.
    pub fn text(&self, power: f32) -> String {
        format!("{} {}", figure(self.value(power)), self.unit())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_are_relative_until_the_unit_is_known() {
        let scale = PowerScale::relative_to(8.0);
        assert_eq!(scale.text(2.0), "25.0 %");
        assert_eq!(scale.name(), "Relative power");
        assert_eq!(PowerScale::relative_to(0.0).text(2.0), "0 %");
        assert_eq!(PowerScale::of(&State::default()).unit(), "%");
    }
}
