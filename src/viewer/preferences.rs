//! Preferences of the user, for all scenes: view mode, tone map, speed, open panels.
//!
//! Theme, size of text, sizes of panels and open sections are kept by egui, the window's place by eframe. A sidecar
//! beside a scene and flags of the command line go before what is kept here.

use eframe::Storage;
use serde::{Deserialize, Serialize};

use super::{
    panel_state::PanelState,
    state::State,
    view::{ViewMode, ViewSettings},
};

use crate::export::ToneMap;

/// Where they are kept.
const KEY: &str = "preferences";

/// Stored as TOML. Missing values have their defaults.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Preferences {
    /// The view mode; never the measured error, whose reference does not outlive the window.
    pub mode: ViewMode,
    /// Tone map of the light modes.
    pub tone_map: ToneMap,
    /// Units a second when flying, in frame units.
    pub fly_speed: f32,
    /// Whether the panel of the run and its settings is open.
    pub light: bool,
    /// Whether the panel of what is looked into is open.
    pub look: bool,
    /// Whether pictures have no background.
    pub picture_is_transparent: bool,
    /// Whether exported meshes have light by direction.
    pub mesh_has_harmonics: bool,
}

impl Default for Preferences {
    fn default() -> Self {
        Self::from_parts(&ViewSettings::default(), &PanelState::default())
    }
}

impl Preferences {
    /// Those in force.
    pub fn of(state: &State) -> Self {
        Self::from_parts(&state.view, &state.panels)
    }

    fn from_parts(view: &ViewSettings, panels: &PanelState) -> Self {
        Self {
            mode: if view.mode == ViewMode::Error {
                ViewMode::default()
            } else {
                view.mode
            },
            tone_map: view.tone_map,
            fly_speed: panels.fly_speed,
            light: panels.light,
            look: panels.look,
            picture_is_transparent: panels.picture_is_transparent,
            mesh_has_harmonics: panels.mesh_has_harmonics,
        }
    }

    /// Those of the last window; the defaults where there are none, or where they cannot be used.
    pub fn load(storage: Option<&dyn Storage>) -> Self {
        storage
            .and_then(|storage| storage.get_string(KEY))
            .and_then(|text| toml::from_str(&text).ok())
            .filter(Self::is_valid)
            .unwrap_or_default()
    }

    /// Keep them for the next window.
    pub fn store(&self, storage: &mut dyn Storage) {
        if let Ok(text) = toml::to_string(self) {
            storage.set_string(KEY, text);
        }
    }

    /// The view that a window begins with.
    pub fn view(&self) -> ViewSettings {
        ViewSettings {
            mode: self.mode,
            tone_map: self.tone_map,
            ..ViewSettings::default()
        }
    }

    /// The panels that a window begins with.
    pub fn panels(&self) -> PanelState {
        PanelState {
            fly_speed: self.fly_speed,
            light: self.light,
            look: self.look,
            picture_is_transparent: self.picture_is_transparent,
            mesh_has_harmonics: self.mesh_has_harmonics,
            ..PanelState::default()
        }
    }

    fn is_valid(&self) -> bool {
        PanelState::FLY_SPEED_RANGE.contains(&self.fly_speed) && self.mode != ViewMode::Error
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;

    /// As a file would keep them.
    #[derive(Default)]
    struct Kept(HashMap<String, String>);

    impl Storage for Kept {
        fn get_string(&self, key: &str) -> Option<String> {
            self.0.get(key).cloned()
        }

        fn set_string(&mut self, key: &str, value: String) {
            self.0.insert(key.to_owned(), value);
        }

        fn remove_string(&mut self, key: &str) {
            self.0.remove(key);
        }

        fn flush(&mut self) {}
    }

    #[test]
    fn what_was_set_comes_back() {
        let mut kept = Kept::default();
        assert_eq!(Preferences::load(Some(&kept)), Preferences::default());
        let set = Preferences {
            mode: ViewMode::FalseIrradiance,
            tone_map: ToneMap::None,
            fly_speed: 7.5,
            light: false,
            look: true,
            picture_is_transparent: true,
            mesh_has_harmonics: true,
        };
        set.store(&mut kept);
        assert_eq!(Preferences::load(Some(&kept)), set);
        let state = State {
            view: set.view(),
            panels: set.panels(),
            ..State::default()
        };
        assert_eq!(Preferences::of(&state), set);
    }

    #[test]
    fn broken_text_is_passed_over() {
        for text in [
            "",
            "mode = 3",
            "mode = \"x-ray\"",
            "fly_speed = nan",
            "fly_speed = -1.0",
            "mode = \"error\"",
            "light = \"yes\"\u{0}",
            "[[[",
        ] {
            let kept = Kept(HashMap::from([(KEY.to_owned(), text.to_owned())]));
            assert_eq!(
                Preferences::load(Some(&kept)),
                Preferences::default(),
                "{text}"
            );
        }
    }

    #[test]
    fn the_measured_error_does_not_outlive_its_reference() {
        let mut state = State::default();
        state.view.mode = ViewMode::Error;
        assert_eq!(Preferences::of(&state).mode, ViewMode::Radiance);
    }
}
