//! What the panels hold open and half typed.

/// What the panels hold open and half typed.
#[derive(Clone, Debug)]
pub struct PanelState {
    /// Whether anything but the scene is shown.
    pub shown: bool,
    /// Whether the panel of the run and its settings is shown beside the scene.
    pub light: bool,
    /// Whether the panel of what is looked into is shown beside the scene.
    pub look: bool,
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
    /// Units a second when flying, in frame units.
    pub fly_speed: f32,
}

impl PanelState {
    /// Speeds that can be flown at.
    pub const FLY_SPEED_RANGE: std::ops::RangeInclusive<f32> = 0.05..=1000.0;

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
            help: false,
            picture: false,
            mesh: false,
            path: false,
            path_text: String::new(),
            path_error: None,
            path_is_asked: false,
            picture_text: String::new(),
            mesh_text: String::new(),
            picture_size: [1920, 1080],
            picture_is_transparent: false,
            table: false,
            table_text: String::new(),
            show_messages: false,
            fly_speed: 30.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
