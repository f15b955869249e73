//! What the window saves: pictures, and the sidecar of a scene.

use std::path::PathBuf;

use eframe::egui;

use super::{
    super::{
        saver,
        session::{self, Session},
        state::Severity,
    },
    App,
};

impl App {
    pub(super) fn scene_name(&self) -> String {
        self.state
            .loaded
            .as_ref()
            .map_or_else(|| "vecrad".to_owned(), |loaded| loaded.source.label())
    }

    pub(super) fn save_window(&mut self, ctx: &egui::Context) {
        let path = saver::free_path(&self.scene_name());
        let (sender, wake) = (self.notices.0.clone(), self.wake.clone());
        let pictures = self.pictures.clone();
        ctx.request_screenshot(move |seen| {
            let [width, height] = seen.size.map(|side| side as u32);
            let bytes: Vec<u8> = seen
                .pixels
                .iter()
                .flat_map(|pixel| pixel.to_array())
                .collect();
            if let Some(display) = image::RgbaImage::from_raw(width, height, bytes) {
                let saving = saver::Saving {
                    path,
                    shot: saver::Shot::Seen(display),
                };
                saving.start(sender, &pictures, wake);
            }
        });
    }

    pub(super) fn save_picture(&mut self, path: PathBuf, size: [u32; 2]) {
        let Some(viewport) = &mut self.viewport else {
            let text = "no picture can be drawn without a graphics adapter";
            self.state.messages.push(Severity::Error, text);
            return;
        };
        match viewport.picture(&self.state, size) {
            Ok(drawn) => {
                let saving = saver::Saving {
                    path,
                    shot: saver::Shot::Drawn(Box::new(drawn)),
                };
                saving.start(self.notices.0.clone(), &self.pictures, self.wake.clone());
            }
            Err(error) => self.state.messages.push(Severity::Error, error),
        }
    }

    pub(super) fn save_sidecar(&mut self) {
        let Some(loaded) = &self.state.loaded else {
            return;
        };
        let saved = Session {
            camera: Some(self.state.rig.target),
            view: self.state.view.clone(),
            settings: self.state.settings.clone(),
        };
        match session::save(&loaded.source, &saved, &loaded.scene.frame) {
            Ok(path) => self
                .state
                .messages
                .push(Severity::Note, format!("saved {}", path.display())),
            Err(error) => self.state.messages.push(Severity::Error, error),
        }
    }
}
