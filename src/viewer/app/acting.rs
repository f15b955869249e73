//! Actions carried out.

use std::{sync::Arc, time::Instant};

use eframe::egui;

use super::{
    super::{
        action::{Action, Scale},
        bindings,
        camera::Camera,
        camera_text, clusters, focus,
        lights::Lights,
        materials::Materials,
        messages::Severity,
        navigation::Picked,
        panel_state::PanelState,
        pick,
        run::Change,
        run::RunStatus,
        session::Recent,
        state::{Selection, State},
        view::ViewMode,
    },
    App,
};
use crate::{scene::Lighting, worker::Effect};

impl App {
    /// Carry out what was asked for.
    pub fn perform(&mut self, ctx: &egui::Context, action: Action) {
        match action {
            Action::OpenDialog => self.open_dialog(),
            Action::Load(source) => self.load(source),
            Action::Reload => self.reload(),
            Action::ToggleWatch => {
                self.state.watches_files = !self.state.watches_files;
                self.watch_files();
            }
            Action::CopyCamera => {
                if let Some(loaded) = &self.state.loaded {
                    let camera = &self.state.rig.target;
                    ctx.copy_text(camera_text::to_flags(camera, &loaded.scene.frame));
                    let text = "the camera was copied as flags of the command line";
                    self.state.messages.push_lasting(Severity::Note, text);
                }
            }
            Action::RequestPaste => ctx.send_viewport_cmd(egui::ViewportCommand::RequestPaste),
            Action::PauseContinue => self.pause_or_continue(),
            Action::Stop => self.stop(),
            Action::Reset => self.begin_again(),
            Action::Settings(settings) => {
                self.state.settings = settings.clone();
                let effect = self.worker.change_settings(settings);
                let status = self.state.run.status.clone();
                self.state.run.last_change = Some(Change { effect, status });
                if effect == Effect::Restarts {
                    self.state.inspections.close();
                    self.state.cluster = None;
                }
            }
            Action::Options(options) => {
                self.state.options = options.clone();
                self.worker.change_options(options);
            }
            Action::Relight(materials) => {
                self.remember_lights();
                if materials.are_lamps() != self.state.materials.are_lamps() {
                    self.state.solo = None;
                }
                self.relight(materials);
            }
            Action::Light(lighting) => {
                self.remember_lights();
                let are_off = |lighting: &Lighting| [lighting.is_sky_off, lighting.is_sun_off];
                if are_off(&lighting) != are_off(&self.state.lighting) {
                    self.state.solo = None;
                }
                self.light(lighting);
            }
            Action::Solo(lamp) => {
                self.remember_lights();
                let mut lights = self.state.lights();
                lights.toggle_solo(lamp, self.state.has_outside());
                self.change_lights(lights);
            }
            Action::Undo | Action::Redo => {
                let now = self.state.lights();
                let history = &mut self.state.history;
                let other = match action {
                    Action::Undo => history.undo(now),
                    _ => history.redo(now),
                };
                if let Some(lights) = other {
                    self.change_lights(lights);
                }
            }
            Action::Sides(sides) => {
                self.state.scene_options.sides = sides;
                self.reload();
            }
            Action::TraceReference => self.trace_reference(),
            Action::Mode(ViewMode::Error) if !self.state.truth.exists() => {
                // The view of errors is nothing without a reference.
                self.trace_reference();
                self.change_view(&action);
            }
            Action::ForgetRuns => self.state.truth.forget_earlier(),
            Action::TableDialog => self.ask_for_table(),
            Action::SaveTable(path) => self.save_table(path),
            Action::FrameSelected => self.frame_selected(),
            Action::SelectCluster(index) => self.state.cluster = Some(index),
            Action::ClearSelection => self.clear_selection(),
            Action::ScreenshotWithWindow => self.save_window(ctx),
            Action::Screenshot => {
                let size = self.state.viewport_size;
                self.save_picture(self.free_picture_path(), size, false);
            }
            Action::PictureDialog => {
                let path = self.free_picture_path();
                self.state.panels.picture_text = path.display().to_string();
                self.state.panels.picture = true;
            }
            Action::SavePicture {
                path,
                size,
                is_transparent,
            } => self.save_picture(path, size, is_transparent),
            Action::MeshDialog => self.ask_for_mesh(),
            Action::SaveMesh(path) => self.save_mesh(path),
            Action::SaveMaterials => self.save_materials(),
            Action::SaveSidecar => self.save_sidecar(),
            Action::ToggleFullScreen => {
                let is_full = ctx.input(|input| input.viewport().fullscreen.unwrap_or(false));
                ctx.send_viewport_cmd(egui::ViewportCommand::Fullscreen(!is_full));
            }
            Action::ResetLayout => self.reset_layout(ctx),
            Action::Scale(Scale::Larger) => egui::gui_zoom::zoom_in(ctx),
            Action::Scale(Scale::Smaller) => egui::gui_zoom::zoom_out(ctx),
            Action::Scale(Scale::Whole) => ctx.set_zoom_factor(1.0),
            Action::ClearRecent => self.state.recent = Recent::default(),
            Action::Quit => ctx.send_viewport_cmd(egui::ViewportCommand::Close),
            other => self.change_view(&other),
        }
        ctx.request_repaint();
    }

    /// Do what keys ask for.
    pub(super) fn obey_keys(&mut self, ctx: &egui::Context) {
        if self.state.panels.asks_for_file() {
            // All other keys are the dialog's.
            if ctx.input(|input| input.key_pressed(egui::Key::Escape)) {
                self.state.panels.close_dialogs();
            }
            return;
        }
        // Escape takes the focus from a control, and does nothing else then.
        if self.had_focus {
            ctx.input_mut(|input| input.consume_key(egui::Modifiers::NONE, egui::Key::Escape));
        }
        let in_use = focus::keys_in_use(ctx);
        let pasted = ctx.input(|input| {
            let text = |event: &egui::Event| match event {
                egui::Event::Paste(text) => Some(text.clone()),
                _ => None,
            };
            input.events.iter().find_map(text)
        });
        if let Some(text) = pasted {
            self.perform(ctx, Action::PasteCamera(text));
        }
        for action in ctx.input_mut(|input| bindings::pressed(input, &self.table, in_use)) {
            // The key that stops closes what lies over the scene first.
            let stops = action == Action::Stop;
            if !(stops && (self.guide.close() || self.state.panels.close_dialogs())) {
                self.perform(ctx, action);
            }
        }
        self.want();
    }

    /// Actions that change only how the scene is shown.
    fn change_view(&mut self, action: &Action) {
        let state = &mut self.state;
        match action {
            Action::Mode(mode) => state.view.mode = *mode,
            Action::ToggleNormals => toggle_normals(state),
            Action::ExposureBy(step) => {
                state.view.exposure += *step;
                state.view.auto_exposure = false;
            }
            Action::EmissionScale(scale) => state.view.emission_scale = scale.max(0.0),
            Action::AutoExposure => state.view.auto_exposure = true,
            Action::ToggleToneMap => {
                use crate::export::ToneMap;
                state.view.tone_map = match state.view.tone_map {
                    ToneMap::Neutral => ToneMap::None,
                    ToneMap::None => ToneMap::Neutral,
                };
            }
            Action::ToggleEdges => state.view.edges = !state.view.edges,
            Action::ToggleBacks if state.has_backs() => state.view.backs = !state.view.backs,
            Action::ToggleTraced => state.view.traced = !state.view.traced,
            Action::ToggleGloss => state.view.gloss = !state.view.gloss,
            Action::ToggleBacks => {
                let text = "there are no backs to show: all faces are lit on both sides";
                state.messages.push(Severity::Note, text);
            }
            Action::ToggleClusters => {
                state.view.clusters.shown = !state.view.clusters.shown;
            }
            Action::ToggleLinks => state.view.links.shown = !state.view.links.shown,
            Action::ClusterLevelBy(step) => {
                if let Some(deepest) = state.shown_clusters.deepest {
                    state.view.clusters.go_down(*step, deepest);
                }
                state.view.clusters.shown = true;
            }
            Action::ToggleSunDrag if state.sun().is_some() => {
                state.panels.drags_sun = !state.panels.drags_sun;
            }
            Action::ToggleSunDrag => {
                let text = "there is no sun to drag; switch it on under “Lights and materials”";
                state.messages.push(Severity::Note, text);
            }
            Action::ToggleSeeThrough if state.has_interior() => {
                state.view.see_through = !state.view.see_through;
            }
            Action::ToggleSeeThrough => {
                let text = "there are no walls to see through: the scene is no room";
                state.messages.push(Severity::Note, text);
            }
            Action::FirstLook => state.look_first(),
            Action::FrameAll => state.frame_all(),
            Action::LookFrom(view) => state.rig.target.look_from(*view),
            Action::AddBookmark => {
                state.bookmarks.push(state.rig.target);
                let text = format!(
                    "bookmark {} is kept; saving the camera saves it, too",
                    state.bookmarks.len()
                );
                state.messages.push_lasting(Severity::Note, text);
            }
            Action::GoTo(index) => match state.bookmarks.get(*index) {
                Some(camera) => {
                    state.rig.target = *camera;
                    state.rig.current.orthographic = camera.orthographic;
                }
                None => {
                    let text = format!("there is no bookmark {}", index + 1);
                    state.messages.push(Severity::Note, text);
                }
            },
            Action::RemoveBookmark(index) if *index < state.bookmarks.len() => {
                state.bookmarks.remove(*index);
            }
            Action::PasteCamera(text) => paste_camera(state, text),
            Action::ToggleProjection => {
                state.rig.target.orthographic = !state.rig.target.orthographic;
                state.rig.current.orthographic = state.rig.target.orthographic;
            }
            Action::Up(up) => {
                // It holds for the next file, too.
                state.scene_options.up = Some(*up);
                state.rig.target.up = up.vector();
                state.rig.current.up = up.vector();
            }
            Action::TogglePanels => state.panels.shown = !state.panels.shown,
            Action::ToggleHelp => state.panels.help = !state.panels.help,
            _ => {}
        }
        self.follow_light();
    }

    /// Panels, their sizes and the size of text as at first.
    fn reset_layout(&mut self, ctx: &egui::Context) {
        let PanelState {
            shown, light, look, ..
        } = PanelState::default();
        let panels = &mut self.state.panels;
        (panels.shown, panels.light, panels.look) = (shown, light, look);
        ctx.set_zoom_factor(1.0);
        ctx.memory_mut(|memory| {
            memory.data.clear();
            memory.reset_areas();
        });
    }

    fn pause_or_continue(&mut self) {
        if self.state.run.status.is_busy() {
            // A task under way may take a moment to end.
            self.state.run.status = RunStatus::Pausing;
            self.worker.pause();
        } else if self.state.run.status.can_continue() {
            self.worker.resume();
        }
    }

    /// Stop what runs; with nothing running, select nothing.
    fn stop(&mut self) {
        let status = &mut self.state.run.status;
        if self.state.loading.take().is_some() {
            let text = "reading was cancelled";
            self.state.messages.push(Severity::Note, text);
        } else if status.can_stop() {
            *status = RunStatus::Stopping;
            self.worker.stop();
        } else {
            self.clear_selection();
        }
    }

    /// Trace the reference, rest, or go on.
    pub(super) fn trace_reference(&mut self) {
        let (Some(loaded), Some(scene)) = (&self.state.loaded, self.state.lit_scene()) else {
            return;
        };
        let (wake, seed) = (self.wake.clone(), self.state.settings.seed);
        let truth = &mut self.state.truth;
        if truth.exists() && truth.progress.failed.is_none() {
            truth.toggle();
            return;
        }
        // Light of a run before the present one would be measured as the present one's.
        let run = &self.state.run;
        let shown = run.snapshot.as_ref().filter(|_| !run.reports.is_empty());
        match truth.start((scene, loaded.rays.clone()), seed, shown, wake) {
            Ok(watch) => self.worker.watch(Some(watch)),
            Err(error) => {
                let text = format!("cannot start a thread: {error}");
                self.state.messages.push(Severity::Error, text);
            }
        }
    }

    /// Light the scene from the beginning.
    pub(super) fn begin_again(&mut self) {
        if self.state.loaded.is_some() {
            self.state.inspections.close();
            self.state.run.last_change = None;
            self.worker.reset();
        }
    }

    /// Remember lights and materials before a change.
    fn remember_lights(&mut self) {
        let before = self.state.lights();
        self.state.history.note(before, Instant::now());
    }

    /// Change what is different.
    fn change_lights(&mut self, lights: Lights) {
        let Lights {
            materials,
            lighting,
            solo,
        } = lights;
        self.state.solo = solo;
        if lighting != self.state.lighting {
            self.light(lighting);
        }
        if materials != self.state.materials {
            self.relight(materials);
        }
    }

    /// Light the scene from another sky and sun: from the beginning, with the same geometry and the same rays.
    fn light(&mut self, lighting: Lighting) {
        let Some(loaded) = &self.state.loaded else {
            return;
        };
        let loaded = loaded.under(&lighting);
        self.state.lighting = lighting;
        self.state.inspections.close();
        self.state.run.last_change = None;
        self.worker.watch(None);
        self.state.truth.forget_reference();
        if self.state.view.mode == ViewMode::Error {
            self.state.view.mode = ViewMode::default();
        }
        self.worker.start_with_rays(
            loaded.scene.clone(),
            loaded.rays.clone(),
            self.state.settings.clone(),
            self.state.options.clone(),
        );
        if self.state.materials.are_changed() {
            let appearances = self.state.materials.appearances(&loaded.scene);
            self.worker.relight(appearances.into());
        }
        self.state.loaded = Some(Arc::new(loaded));
    }

    /// Light the scene with other lights and materials. A reference was traced with those before.
    pub(super) fn relight(&mut self, materials: Materials) {
        let Some(loaded) = &self.state.loaded else {
            return;
        };
        let appearances = materials.appearances(&loaded.scene);
        self.state.materials = materials;
        if self.state.truth.exists() {
            self.worker.watch(None);
            self.state.truth.forget_reference();
            let text =
                "the reference was traced for other lights and materials; trace it again for these";
            self.state.messages.push(Severity::Note, text);
        }
        if self.state.view.mode == ViewMode::Error {
            self.state.view.mode = ViewMode::default();
        }
        self.worker.relight(appearances.into());
    }

    fn clear_selection(&mut self) {
        self.state.selection = None;
        self.state.cluster = None;
    }

    fn frame_selected(&mut self) {
        let aspect = self.state.aspect();
        let Some(loaded) = &self.state.loaded else {
            return;
        };
        let cluster = self.state.cluster.and_then(|index| {
            let snapshot = self.state.run.snapshot.as_ref()?;
            let cluster = snapshot.clusters.get(index)?;
            Some((cluster.min, cluster.max))
        });
        let object = || {
            let selection = self.state.selection.as_ref()?;
            let object = &loaded.scene.objects[selection.object?];
            Some(pick::object_bounds(loaded, object.start, object.end))
        };
        if let Some((min, max)) = cluster.or_else(object) {
            self.state.rig.target.frame_box(min, max, aspect);
        } else {
            self.state.frame_all();
        }
    }

    /// Select what was clicked.
    pub(super) fn select(&mut self, picked: Picked) {
        match picked {
            Picked::Nothing => self.clear_selection(),
            Picked::Surface(pick) => {
                let object = self.state.loaded.as_ref().and_then(|loaded| {
                    loaded.scene.objects.iter().position(|object| {
                        object.start <= pick.triangle && pick.triangle < object.end
                    })
                });
                self.state.selection = Some(Selection {
                    pick,
                    probe: None,
                    object_light: Default::default(),
                    object,
                });
                if let Some(snapshot) = &self.state.run.snapshot
                    && self.state.view.clusters.shown
                {
                    let shown = &self.state.shown_clusters.shown;
                    self.state.cluster =
                        clusters::containing(&snapshot.clusters, shown, pick.point);
                }
            }
        }
    }
}

/// Show normals, or again what was shown before.
fn toggle_normals(state: &mut State) {
    let mode = &mut state.view.mode;
    if *mode == ViewMode::Normals {
        *mode = state.mode_before_normals;
    } else {
        state.mode_before_normals = std::mem::replace(mode, ViewMode::Normals);
    }
}

/// Take the camera from flags in a text.
fn paste_camera(state: &mut State, text: &str) {
    let Some(loaded) = &state.loaded else { return };
    let request = camera_text::from_flags(text);
    let camera = request.map(|request| request.apply(state.rig.target, &loaded.scene.frame));
    match camera.filter(Camera::is_valid) {
        Some(camera) => state.rig.target = camera,
        None => {
            let text = "what was pasted is no camera: copy flags such as --camera-position 1,2,3";
            state.messages.push(Severity::Note, text);
        }
    }
}
