//! Saving: pictures, the lit mesh, and the sidecar of a scene.

use std::path::PathBuf;

use eframe::egui;

use glam::Vec3;

use super::{
    super::{
        lights::Lights,
        material_file,
        messages::Severity,
        saver::{self, Content},
        session::{self, Session},
        view::ViewSettings,
    },
    App,
};
use crate::{
    export::{ColorOptions, MeshOptions},
    scene::UpAxis,
};

impl App {
    /// Where a picture goes unless another place is named.
    pub(super) fn free_picture_path(&self) -> PathBuf {
        let loaded = self.state.loaded.as_ref();
        saver::free_picture_path(loaded.map(|loaded| &loaded.source))
    }

    pub(super) fn save_window(&mut self, ctx: &egui::Context) {
        let path = self.free_picture_path();
        let (sender, wake) = (self.notices.0.clone(), self.wake.clone());
        let unfinished = self.unfinished.clone();
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
                    content: Content::Picture(saver::Shot::Seen(display)),
                };
                saving.start(sender, &unfinished, wake);
            }
        });
    }

    pub(super) fn save_picture(&mut self, path: PathBuf, size: [u32; 2], is_transparent: bool) {
        let Some(viewport) = &mut self.viewport else {
            let text = "no picture can be drawn without a graphics adapter";
            self.state.messages.push(Severity::Error, text);
            return;
        };
        match viewport.picture(&self.state, size, is_transparent) {
            Ok(drawn) => {
                let saving = saver::Saving {
                    path,
                    content: Content::Picture(saver::Shot::Drawn(Box::new(drawn))),
                };
                saving.start(self.notices.0.clone(), &self.unfinished, self.wake.clone());
            }
            Err(error) => self.state.messages.push(Severity::Error, error),
        }
    }

    /// Ask where the lit mesh is to go.
    pub(super) fn ask_for_mesh(&mut self) {
        if let Some(loaded) = &self.state.loaded {
            let path = saver::free_mesh_path(&loaded.source);
            self.state.panels.mesh_text = path.display().to_string();
            self.state.panels.mesh = true;
        }
    }

    pub(super) fn save_mesh(&mut self, path: PathBuf) {
        let snapshot = self.state.run.snapshot.as_ref();
        let (Some(loaded), Some(snapshot)) = (&self.state.loaded, snapshot) else {
            let text = "there is no light to export yet";
            self.state.messages.push(Severity::Error, text);
            return;
        };
        let has_harmonics = self.state.panels.mesh_has_harmonics;
        let lit_scene = has_harmonics.then(|| self.state.lit_scene()).flatten();
        let mesh = saver::LitMesh {
            snapshot: snapshot.clone(),
            scene: lit_scene.unwrap_or_else(|| loaded.scene.clone()),
            rays: loaded.rays.clone(),
            harmonics: has_harmonics.then_some(self.state.settings.seed),
            options: MeshOptions {
                merge: self.state.panels.mesh_merged,
                ..mesh_options(
                    &self.state.view,
                    self.state.rig.target.up,
                    loaded.scene.radiance_unit,
                )
            },
        };
        let saving = saver::Saving {
            path,
            content: Content::Mesh(mesh),
        };
        saving.start(self.notices.0.clone(), &self.unfinished, self.wake.clone());
    }

    /// Ask where the table of errors is to go.
    pub(super) fn ask_for_table(&mut self) {
        if let Some(loaded) = &self.state.loaded {
            let path = saver::free_table_path(&loaded.source);
            self.state.panels.table_text = path.display().to_string();
            self.state.panels.table = true;
        }
    }

    pub(super) fn save_table(&mut self, path: PathBuf) {
        let Some(loaded) = &self.state.loaded else {
            return;
        };
        let saving = saver::Saving {
            path,
            content: Content::Table(self.state.truth.comparison(&loaded.scene)),
        };
        saving.start(self.notices.0.clone(), &self.unfinished, self.wake.clone());
    }

    /// All lights, also while one is shown alone.
    fn lights_to_save(&self) -> Lights {
        let mut lights = self.state.lights();
        lights.end_solo();
        lights
    }

    pub(super) fn save_materials(&mut self) {
        let Some(loaded) = &self.state.loaded else {
            return;
        };
        let Lights {
            materials,
            lighting,
            ..
        } = self.lights_to_save();
        let changes = materials.changes(&lighting.lamps);
        let is_srgb = self.state.scene_options.mtl_color_is_srgb;
        let (severity, text) =
            match material_file::save(&loaded.source, &loaded.scene, &changes, is_srgb) {
                Ok(path) => (
                    Severity::Note,
                    format!(
                        "saved {}; the scene uses it once its mtllib line names it",
                        path.display()
                    ),
                ),
                Err(error) => (Severity::Error, error),
            };
        self.state.messages.push_lasting(severity, text);
    }

    pub(super) fn save_sidecar(&mut self) {
        let Some(loaded) = &self.state.loaded else {
            return;
        };
        let Lights {
            materials,
            lighting,
            ..
        } = self.lights_to_save();
        let saved = Session {
            camera: Some(self.state.rig.target),
            bookmarks: self.state.bookmarks.clone(),
            view: self.state.view.clone(),
            settings: self.state.settings.clone(),
            light: session::saved_light(&loaded.source, &lighting),
            materials: materials.changes(&lighting.lamps),
        };
        match session::save(&loaded.source, &saved, &loaded.scene.frame) {
            Ok(path) => self
                .state
                .messages
                .push_lasting(Severity::Note, format!("saved {}", path.display())),
            Err(error) => self.state.messages.push(Severity::Error, error),
        }
    }
}

/// A mesh that looks as the view does.
fn mesh_options(view: &ViewSettings, up: Vec3, radiance_unit: f32) -> MeshOptions {
    MeshOptions {
        color: ColorOptions {
            exposure_ev: view.exposure_factor().log2(),
            tone_map: view.tone_map,
        },
        up: if up == Vec3::Z { UpAxis::Z } else { UpAxis::Y },
        emission_scale: view.emission_scale,
        radiance_unit,
        merge: false,
    }
}
