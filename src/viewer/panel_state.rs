//! State of the panels: open sections, unfinished text.

use eframe::egui::Rangef;

/// A panel beside the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The run and its settings, on the left.
    Light,
    /// The picked point, clusters, links, figures and messages, on the right.
    Look,
}

/// State of the panels: open sections, unfinished text.
#[derive(Clone, Debug)]
pub struct PanelState {
    /// Whether anything but the scene is shown.
    pub shown: bool,
    /// Whether the panel of the run and its settings is open.
    pub light: bool,
    /// Whether the panel of what is looked into is open.
    pub look: bool,
    /// The panel that is shown where both are open and there is room for one.
    pub first_side: Side,
    /// Whether the key sheet is open.
    pub help: bool,
    /// Whether the dialog for pictures is open.
    pub picture: bool,
    /// Whether the dialog for the lit mesh is open.
    pub mesh: bool,
    /// Whether the field for a path is open.
    pub path: bool,
    /// The typed path.
    pub path_text: String,
    /// Why the typed path could not be read.
    pub path_error: Option<String>,
    /// Whether the field for a path is to be typed into, over what it holds.
    pub path_is_asked: bool,
    /// The typed path of a picture.
    pub picture_text: String,
    /// The typed path of the lit mesh.
    pub mesh_text: String,
    /// Whether all objects of the lit mesh become one.
    pub mesh_merged: bool,
    /// Whether the lit mesh has light by direction.
    pub mesh_has_harmonics: bool,
    /// Size of a picture in pixels.
    pub picture_size: [u32; 2],
    /// Whether a picture has no background.
    pub picture_is_transparent: bool,
    /// Whether the dialog for the table of errors is open.
    pub table: bool,
    /// The typed path of the table of errors.
    pub table_text: String,
    /// Whether the messages are to be opened.
    pub show_messages: bool,
    /// Whether dragging in the view moves the sun.
    pub drags_sun: bool,
    /// Units a second when flying, in frame units.
    pub fly_speed: f32,
}

impl Side {
    /// Widths that a panel can be dragged to, in points. Narrower cuts its figures off, wider has nothing to show.
    pub fn width_range(self) -> Rangef {
        match self {
            Self::Light => Rangef::new(290.0, 480.0),
            Self::Look => Rangef::new(250.0, 520.0),
        }
    }

    /// Width that the panels have together in a window of this width, in points: the other half is the view's.
    pub fn room(window_width: f32) -> f32 {
        0.5 * window_width
    }
}

impl PanelState {
    /// Speeds that can be flown at.
    pub const FLY_SPEED_RANGE: std::ops::RangeInclusive<f32> = 0.05..=1000.0;

    /// The open panels that a window of this width in points has room for: the view keeps half of it.
    pub fn shown_sides(&self, window_width: f32) -> Vec<Side> {
        let open: Vec<Side> = [(Side::Light, self.light), (Side::Look, self.look)]
            .into_iter()
            .filter_map(|(side, is_open)| is_open.then_some(side))
            .collect();
        let needed: f32 = open.iter().map(|side| side.width_range().min).sum();
        if open.len() > 1 && needed > Side::room(window_width) {
            return vec![self.first_side];
        }
        open
    }

    /// Open a panel; where there is no room for both, the other one gives way.
    pub fn open_side(&mut self, side: Side) {
        *self.is_open(side) = true;
        self.first_side = side;
    }

    /// Close a panel, and with it one that gave way to it: closing is for seeing more of the scene.
    pub fn close_side(&mut self, side: Side, window_width: f32) {
        let shown = self.shown_sides(window_width);
        for closed in [Side::Light, Side::Look] {
            if closed == side || !shown.contains(&closed) {
                *self.is_open(closed) = false;
            }
        }
    }

    fn is_open(&mut self, side: Side) -> &mut bool {
        match side {
            Side::Light => &mut self.light,
            Side::Look => &mut self.look,
        }
    }

    /// Open the field for a path.
    pub fn ask_for_path(&mut self) {
        self.path = true;
        self.path_error = None;
        self.path_is_asked = true;
    }

    /// A scene could not be read: where its path was typed, it can be mended.
    pub fn refuse_path(&mut self, error: Option<String>) {
        if self.path {
            self.path_error = error;
            self.path_is_asked = true;
        }
    }

    /// Whether a dialog asks for a file.
    pub fn asks_for_file(&self) -> bool {
        self.picture || self.mesh || self.table || self.path
    }

    /// Close the key sheet and all dialogs; whether there was one.
    pub fn close_dialogs(&mut self) -> bool {
        let open = [
            &mut self.help,
            &mut self.picture,
            &mut self.mesh,
            &mut self.table,
            &mut self.path,
        ];
        open.into_iter()
            .fold(false, |any, open| std::mem::take(open) | any)
    }
}

impl Default for PanelState {
    fn default() -> Self {
        Self {
            shown: true,
            light: true,
            look: true,
            first_side: Side::Light,
            help: false,
            picture: false,
            mesh: false,
            path: false,
            path_text: String::new(),
            path_error: None,
            path_is_asked: false,
            picture_text: String::new(),
            mesh_text: String::new(),
            mesh_merged: false,
            mesh_has_harmonics: false,
            picture_size: [1920, 1080],
            picture_is_transparent: false,
            table: false,
            table_text: String::new(),
            show_messages: false,
            drags_sun: false,
            fly_speed: 30.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn in_a_narrow_window_the_panel_that_was_opened_last_stays() {
        let mut panels = PanelState::default();
        assert_eq!(panels.shown_sides(1280.0), [Side::Light, Side::Look]);
        assert_eq!(panels.shown_sides(800.0), [Side::Light]);
        panels.open_side(Side::Look);
        assert_eq!(panels.shown_sides(800.0), [Side::Look]);
        assert_eq!(panels.shown_sides(1280.0), [Side::Light, Side::Look]);
        panels.close_side(Side::Look, 1280.0);
        assert_eq!(panels.shown_sides(1280.0), [Side::Light]);
        panels.open_side(Side::Look);
        panels.close_side(Side::Look, 800.0);
        assert!(
            panels.shown_sides(800.0).is_empty(),
            "nothing takes its place"
        );
    }

    #[test]
    fn dialogs_are_closed_once() {
        let mut panels = PanelState {
            table: true,
            help: true,
            ..PanelState::default()
        };
        assert!(panels.asks_for_file());
        assert!(panels.close_dialogs());
        assert!(!panels.help && !panels.asks_for_file());
        assert!(!panels.close_dialogs());
        assert!(panels.light && panels.look, "panels stay");
    }
}
