//! Scenes: read, shown, read again; the file dialog.

use std::{sync::Arc, thread, time::Instant};

use eframe::egui;

use super::{
    super::{
        camera::Camera,
        exposure::Follower,
        lights::History,
        loader::{LoadedScene, Loader, SceneSource},
        materials::{Materials, SavedMaterial},
        messages::Severity,
        session,
        truth::Truth,
        view::ViewMode,
        watch::SceneWatch,
        wording,
    },
    App,
};
use crate::scene::{Lighting, SCENE_ENDINGS};

impl App {
    /// Begin to read a scene; the present one stays until it is there.
    pub(super) fn load(&mut self, source: SceneSource) {
        self.keeps_view = false;
        self.first = None;
        let (asked, of) = (self.asked_light.clone(), source.clone());
        self.start_loader(source, move || session::light(&of, &asked));
    }

    fn start_loader(
        &mut self,
        source: SceneSource,
        lighting: impl FnOnce() -> Lighting + Send + 'static,
    ) {
        self.state.messages.open_scene();
        let options = self.state.scene_options;
        match Loader::start(source, options, lighting, self.wake.clone()) {
            Ok(loader) => self.state.loading = Some(loader),
            Err(error) => self
                .state
                .messages
                .push(Severity::Error, format!("cannot start a thread: {error}")),
        }
    }

    /// Show a scene that was read, and begin to light it.
    pub(super) fn show(&mut self, loaded: LoadedScene) {
        self.state.panels.path = false;
        self.state.messages.show_scene();
        for warning in &loaded.scene.warnings {
            let text = wording::without_flags(&warning.to_string());
            self.state.messages.push(Severity::Warning, text);
        }
        if let Some(sentence) = loaded.scene.up_sentence() {
            let text = wording::without_flags(&sentence);
            self.state.messages.push(Severity::Note, text);
        }
        if let Some(path) = loaded.source.path() {
            self.state.recent.push(path);
        }
        let changed = if self.keeps_view {
            self.keep_view(&loaded)
        } else {
            self.state.exposure = Follower::default();
            self.open_view(&loaded)
        };
        self.keeps_view = true;
        self.title = Some(loaded.source.window_title());
        self.state.selection = None;
        self.state.cluster = None;
        self.state.inspections.close();
        self.forget_picture();
        self.state.run.last_change = None;
        self.worker.watch(None);
        self.state.truth = Truth::default();
        self.worker.start_with_rays(
            loaded.scene.clone(),
            loaded.rays.clone(),
            self.state.settings.clone(),
            self.state.options.clone(),
        );
        self.state.lighting = loaded.lighting.clone();
        self.state.materials = Materials::of(&loaded.scene);
        self.state.solo = None;
        self.state.history = History::default();
        self.state.loaded = Some(Arc::new(loaded));
        self.restore(&changed);
        self.watch_files();
        // The view of errors is nothing without a reference.
        if self.state.view.mode == ViewMode::Error {
            self.trace_reference();
        }
    }

    /// The camera of the scene before in the frame of this one. Returns the materials that are changed.
    fn keep_view(&mut self, loaded: &LoadedScene) -> Vec<SavedMaterial> {
        let Some(before) = &self.state.loaded else {
            return Vec::new();
        };
        let (from, to) = (&before.scene.frame, &loaded.scene.frame);
        if from != to {
            let place = |point| to.from_world(from.to_world(point));
            let moved = |camera: &Camera| {
                let [eye, pivot] = [camera.eye(), camera.pivot].map(place);
                Some(camera.placed(eye, pivot, camera.up)).filter(Camera::is_valid)
            };
            if let Some(camera) = moved(&self.state.rig.target) {
                self.state.rig.jump(camera);
            }
            self.state.bookmarks = self.state.bookmarks.iter().filter_map(moved).collect();
        }
        let mut lights = self.state.lights();
        lights.end_solo();
        lights.materials.changes(&[])
    }

    /// Nothing of the scene before is to be shown.
    fn forget_picture(&mut self) {
        self.stage.forget();
        self.stage.drop_later((
            self.state.run.snapshot.take(),
            self.state.staged.take(),
            self.state.loaded.take(),
        ));
        self.state.shown_clusters = Default::default();
    }

    /// Camera, view and settings that a scene opens with: its sidecar's, then the command line's.
    /// Returns the materials that its sidecar changes.
    fn open_view(&mut self, loaded: &LoadedScene) -> Vec<SavedMaterial> {
        let mut changed = Vec::new();
        self.state.bookmarks.clone_from(&loaded.own_views);
        let frame = &loaded.scene.frame;
        let mut camera = loaded.viewpoint;
        match session::load(&loaded.source, frame) {
            Some(Ok(saved)) => {
                camera = saved.camera.unwrap_or(camera);
                self.state.bookmarks = saved.bookmarks;
                let first = self.first.as_ref();
                if first.is_some_and(|first| first.settings_are_asked_for) {
                    let text = "the settings saved beside the scene were not used: the command line has its own";
                    self.state.messages.push(Severity::Note, text);
                } else {
                    self.state.settings = saved.settings;
                }
                self.state.view = saved.view;
                changed = saved.materials;
            }
            Some(Err(error)) => self.state.messages.push(Severity::Warning, error),
            None => {}
        }
        if let Some(first) = self.first.take() {
            let wanted = first.camera.apply(camera, frame);
            if wanted.is_valid() {
                camera = wanted;
            } else {
                let text =
                    "the camera of the command line is too far from the scene and was not used";
                self.state.messages.push(Severity::Warning, text);
            }
            self.state.view = first.view.apply(&self.state.view);
        }
        self.state.rig.jump(camera);
        changed
    }

    /// Change materials as they were saved.
    fn restore(&mut self, saved: &[SavedMaterial]) {
        let mut materials = self.state.materials.clone();
        let unknown = materials.restore(saved, &self.state.lighting.lamps);
        if !unknown.is_empty() {
            let text = format!(
                "the saved settings change materials that are not there: {}",
                unknown.join(", ")
            );
            self.state.messages.push(Severity::Warning, text);
        }
        if materials != self.state.materials {
            self.relight(materials);
        }
    }

    pub(super) fn reload(&mut self) {
        if let Some(source) = self
            .state
            .loaded
            .as_ref()
            .map(|loaded| loaded.source.clone())
        {
            self.keeps_view = true;
            let lighting = self.state.lighting.clone();
            self.start_loader(source, || lighting);
        }
    }

    /// Watch the files of the present scene, if that is asked for.
    pub(super) fn watch_files(&mut self) {
        self.watch = None;
        let loaded = self.state.loaded.as_ref();
        let files = loaded.map(|loaded| loaded.scene.files.as_slice());
        let files = files.filter(|files| self.state.watches_files && !files.is_empty());
        let Some(files) = files else { return };
        match SceneWatch::start(files, self.wake.clone()) {
            Ok(watch) => self.watch = Some(watch),
            Err(error) => {
                self.state.watches_files = false;
                self.state.messages.push(Severity::Warning, error);
            }
        }
    }

    /// Read the scene again where its files have changed.
    pub(super) fn follow_files(&mut self, ctx: &egui::Context) {
        let Some(watch) = &self.watch else { return };
        if watch.take() {
            self.reload();
        } else if let Some(wait) = watch.wait() {
            ctx.request_repaint_after(wait);
        }
    }

    pub(super) fn open_dialog(&mut self) {
        if self.dialog_since.is_some() {
            // It may hang without having been seen.
            self.state.panels.ask_for_path();
            return;
        }
        let (sender, wake) = (self.chosen.0.clone(), self.wake.clone());
        // On a thread of its own: the dialog of some desktops hangs.
        let spawned = thread::Builder::new()
            .name("dialog".to_owned())
            .spawn(move || {
                let file = rfd::FileDialog::new()
                    .set_title("Open a scene")
                    .add_filter("OBJ, glTF, ZIP", &SCENE_ENDINGS)
                    .pick_file();
                // Nobody listens once the window is closed.
                let _ = sender.send(file);
                wake();
            });
        self.dialog_since = spawned.is_ok().then(Instant::now);
    }
}
