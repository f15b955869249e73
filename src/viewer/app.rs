//! The application: events in, panels and viewport drawn, actions carried out.

use std::{
    path::PathBuf,
    sync::{
        Arc,
        mpsc::{self, Receiver, Sender},
    },
    thread,
};

use eframe::egui;

use super::{
    action::Action,
    bindings::{self, Binding},
    clusters, light_range,
    loader::{LoadedScene, Loader, SceneSource},
    navigation::Picked,
    panels, pick, saver,
    saver::Notice,
    session::{self, Recent, Session},
    start::{self, CameraRequest, Faults, Options},
    state::{RunStatus, Selection, Severity, State},
    theme,
    viewport::{Viewport, viewport_ui},
};
use crate::worker::{Effect, Wake, WorkerHandle};

/// Where the list of recent files is kept.
const RECENT_KEY: &str = "recent";

/// The window's application.
pub struct App {
    /// What it knows. Public for tests.
    pub state: State,
    worker: WorkerHandle,
    viewport: Option<Viewport>,
    table: Vec<Binding>,
    wake: Wake,
    faults: Arc<Faults>,
    /// Files chosen in the dialog.
    chosen: (Sender<Option<PathBuf>>, Receiver<Option<PathBuf>>),
    dialog_is_open: bool,
    notices: (Sender<Notice>, Receiver<Notice>),
    /// Set from the command line for the first scene only.
    first: Option<Options>,
    /// A new title for the window.
    title: Option<String>,
    /// Camera and view stay as they are when the scene being read arrives.
    keeps_view: bool,
}

impl App {
    /// Start with what the command line asked for.
    ///
    /// # Errors
    /// When the system refuses a thread.
    pub fn new(
        cc: &eframe::CreationContext<'_>,
        options: Options,
        faults: Arc<Faults>,
    ) -> std::io::Result<Self> {
        theme::apply(&cc.egui_ctx);
        let ctx = cc.egui_ctx.clone();
        let wake: Wake = Arc::new(move || ctx.request_repaint());
        let viewport = cc.wgpu_render_state.as_ref().map(|render_state| {
            faults.watch(&render_state.device, wake.clone());
            Viewport::new(render_state)
        });
        let recent = cc
            .storage
            .and_then(|storage| storage.get_string(RECENT_KEY))
            .and_then(|text| toml::from_str::<Recent>(&text).ok())
            .unwrap_or_default();
        let state = State {
            settings: options.settings.clone(),
            options: options.run.clone(),
            scene_options: options.scene_options,
            view: options.view.clone(),
            recent,
            adapter_name: viewport
                .as_ref()
                .map(|viewport| viewport.adapter_name().to_owned())
                .unwrap_or_default(),
            ..State::default()
        };
        let mut app = Self {
            state,
            worker: WorkerHandle::spawn(wake.clone())?,
            viewport,
            table: bindings::bindings(),
            wake,
            faults,
            chosen: mpsc::channel(),
            dialog_is_open: false,
            notices: mpsc::channel(),
            first: None,
            title: None,
            keeps_view: false,
        };
        app.state.rig.target.up = options.camera.up;
        if let Some(source) = options.source.clone() {
            app.load(source);
            app.first = Some(options);
        }
        Ok(app)
    }

    /// Take note of everything that arrived since the last frame.
    fn drain(&mut self) {
        while let Ok(chosen) = self.chosen.1.try_recv() {
            self.dialog_is_open = false;
            match chosen {
                Some(path) => self.load(SceneSource::File(path)),
                // A dialog that fails cannot be told from one that was cancelled.
                None => self.state.messages.push(
                    Severity::Note,
                    "no file was chosen; if no dialog appeared, use File, Open by path",
                ),
            }
        }
        while let Ok((severity, text)) = self.notices.1.try_recv() {
            self.state.messages.push(severity, text);
        }
        for fault in self.faults.take() {
            self.state.messages.push(Severity::Error, fault);
        }
        if let Some(outcome) = self.state.loading.as_ref().and_then(Loader::poll) {
            self.state.loading = None;
            match outcome {
                Ok(loaded) => self.show(loaded),
                Err(error) => self.state.messages.push(Severity::Error, error),
            }
        }
        self.drain_worker();
    }

    fn drain_worker(&mut self) {
        for event in self.worker.events() {
            self.state.run.note(event);
        }
        let Some(latest) = self.worker.latest() else {
            return;
        };
        let is_known = self
            .state
            .run
            .snapshot
            .as_ref()
            .is_some_and(|held| Arc::ptr_eq(held, &latest));
        if !is_known {
            self.state.run.snapshot = Some(latest);
            self.follow_light();
        }
    }

    /// Let exposure and range follow the newest light.
    fn follow_light(&mut self) {
        let Some(snapshot) = &self.state.run.snapshot else {
            return;
        };
        if self.state.view.auto_exposure
            && let Some(exposure) = light_range::auto_exposure(snapshot)
        {
            self.state.view.exposure = exposure;
        }
        self.state.false_color_range = light_range::false_color_range(snapshot, &self.state.view);
        self.state
            .cluster_counts
            .update(&snapshot.clusters, self.state.view.clusters.level);
        self.look_up();
    }

    /// Look up the light at the picked point.
    fn look_up(&mut self) {
        let (Some(selection), Some(loaded), Some(snapshot)) = (
            &mut self.state.selection,
            &self.state.loaded,
            &self.state.run.snapshot,
        ) else {
            return;
        };
        let is_current = |held: &Arc<_>| Arc::ptr_eq(held, snapshot);
        if selection.of.as_ref().is_some_and(is_current) {
            return;
        }
        let triangle = selection.pick.triangle;
        selection.of = Some(snapshot.clone());
        selection.probe = pick::probe(snapshot, &selection.pick);
        selection.object = loaded
            .scene
            .objects
            .iter()
            .position(|object| object.start <= triangle && triangle < object.end);
        if let Some(object) = selection.object.map(|index| &loaded.scene.objects[index]) {
            selection.object_light = pick::object_light(snapshot, object.start, object.end);
        }
    }

    /// Begin to read a scene; the present one stays until it is there.
    fn load(&mut self, source: SceneSource) {
        self.keeps_view = false;
        self.first = None;
        self.start_loader(source);
    }

    fn start_loader(&mut self, source: SceneSource) {
        match Loader::start(source, self.state.scene_options, self.wake.clone()) {
            Ok(loader) => self.state.loading = Some(loader),
            Err(error) => self
                .state
                .messages
                .push(Severity::Error, format!("cannot start a thread: {error}")),
        }
    }

    /// Show a scene that was read, and begin to light it.
    fn show(&mut self, loaded: LoadedScene) {
        for warning in &loaded.scene.warnings {
            self.state
                .messages
                .push(Severity::Warning, warning.to_string());
        }
        if let Some(path) = loaded.source.path() {
            self.state.recent.push(path);
        }
        if !self.keeps_view {
            self.open_view(&loaded);
        }
        self.keeps_view = true;
        self.title = Some(start::title(&loaded.source));
        self.state.selection = None;
        self.state.cluster = None;
        self.state.run.snapshot = None;
        self.state.run.last_effect = None;
        self.worker.start(
            loaded.scene.clone(),
            self.state.settings.clone(),
            self.state.options.clone(),
        );
        self.state.loaded = Some(Arc::new(loaded));
    }

    /// Camera, view and settings that a scene opens with: its sidecar's, then the command line's.
    fn open_view(&mut self, loaded: &LoadedScene) {
        let frame = &loaded.scene.frame;
        let mut camera = loaded.viewpoint;
        if loaded.source.path().is_some() {
            // The axis chosen before holds for the next file, too; built-in scenes know theirs.
            let chosen = CameraRequest {
                up: self.state.rig.target.up,
                ..CameraRequest::default()
            };
            camera = chosen.apply(camera, frame);
        }
        match session::load(&loaded.source, frame) {
            Some(Ok(saved)) => {
                camera = saved.camera.unwrap_or(camera);
                if self.first.is_none() {
                    self.state.settings = saved.settings;
                }
                self.state.view = saved.view;
            }
            Some(Err(error)) => self.state.messages.push(Severity::Warning, error),
            None => {}
        }
        if let Some(first) = self.first.take() {
            camera = first.camera.apply(camera, frame);
            if let Some(exposure) = first.exposure {
                self.state.view.exposure = exposure;
                self.state.view.auto_exposure = false;
            }
        }
        self.state.rig.jump(camera);
    }

    /// Carry out what was asked for.
    pub fn perform(&mut self, ctx: &egui::Context, action: Action) {
        match action {
            Action::OpenDialog => self.open_dialog(),
            Action::Load(source) => self.load(source),
            Action::Reload => self.reload(),
            Action::PauseContinue => self.pause_or_continue(),
            Action::Stop => self.stop(),
            Action::Reset => {
                if self.state.loaded.is_some() {
                    self.worker.reset();
                }
            }
            Action::Settings(settings) => {
                self.state.settings = settings.clone();
                let effect = self.worker.change_settings(settings);
                self.state.run.last_effect = Some(effect);
                if effect == Effect::Restarts {
                    self.state.cluster = None;
                }
            }
            Action::Options(options) => {
                self.state.options = options.clone();
                self.worker.change_options(options);
            }
            Action::Sides(sides) => {
                self.state.scene_options.sides = sides;
                self.reload();
            }
            Action::FrameSelected => self.frame_selected(),
            Action::SelectCluster(index) => self.state.cluster = Some(index),
            Action::ClearSelection => self.clear_selection(),
            Action::ScreenshotWithWindow => self.save_window(ctx),
            Action::Screenshot => {
                let size = self.state.viewport_size;
                self.save_picture(saver::free_path(&self.scene_name()), size);
            }
            Action::PictureDialog => {
                let path = saver::free_path(&self.scene_name());
                self.state.panels.picture_text = path.display().to_string();
                self.state.panels.picture = true;
            }
            Action::SavePicture { path, size } => self.save_picture(path, size),
            Action::SaveSidecar => self.save_sidecar(),
            Action::ToggleFullScreen => {
                let is_full = ctx.input(|input| input.viewport().fullscreen.unwrap_or(false));
                ctx.send_viewport_cmd(egui::ViewportCommand::Fullscreen(!is_full));
            }
            Action::ClearRecent => self.state.recent = Recent::default(),
            Action::Quit => ctx.send_viewport_cmd(egui::ViewportCommand::Close),
            other => self.change_view(&other),
        }
        ctx.request_repaint();
    }

    /// Actions that change only how the scene is shown.
    fn change_view(&mut self, action: &Action) {
        let state = &mut self.state;
        match action {
            Action::Mode(mode) => state.view.mode = *mode,
            Action::ExposureBy(step) => {
                state.view.exposure += *step;
                state.view.auto_exposure = false;
            }
            Action::AutoExposure => state.view.auto_exposure = true,
            Action::ToggleToneMap => {
                use super::view::ToneMap;
                state.view.tone_map = match state.view.tone_map {
                    ToneMap::Neutral => ToneMap::None,
                    ToneMap::None => ToneMap::Neutral,
                };
            }
            Action::ToggleEdges => state.view.edges = !state.view.edges,
            Action::ToggleBacks => state.view.backs = !state.view.backs,
            Action::ToggleClusters => {
                state.view.clusters.shown = !state.view.clusters.shown;
            }
            Action::ClusterLevelBy(step) => {
                let deepest = state.cluster_counts.deepest;
                let level = &mut state.view.clusters.level;
                *level = level.saturating_add_signed(*step).min(deepest);
                state.view.clusters.shown = true;
            }
            Action::FrameAll => state.frame_all(),
            Action::LookFrom(view) => state.rig.target.look_from(*view),
            Action::ToggleProjection => {
                state.rig.target.orthographic = !state.rig.target.orthographic;
                state.rig.current.orthographic = state.rig.target.orthographic;
            }
            Action::Up(up) => {
                state.rig.target.up = *up;
                state.rig.current.up = *up;
            }
            Action::TogglePanels => state.panels.shown = !state.panels.shown,
            Action::ToggleHelp => state.panels.help = !state.panels.help,
            _ => {}
        }
        self.follow_light();
    }

    fn reload(&mut self) {
        if let Some(source) = self
            .state
            .loaded
            .as_ref()
            .map(|loaded| loaded.source.clone())
        {
            self.keeps_view = true;
            self.start_loader(source);
        }
    }

    fn pause_or_continue(&mut self) {
        if self.state.run.status.is_busy() {
            self.worker.pause();
        } else if self.state.run.status.can_continue() {
            self.worker.resume();
        }
    }

    /// Stop what runs; with nothing running, select nothing.
    fn stop(&mut self) {
        if self.state.run.status.is_busy() || self.state.run.status == RunStatus::Paused {
            self.worker.stop();
        } else {
            self.clear_selection();
        }
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

    fn open_dialog(&mut self) {
        if self.dialog_is_open {
            return;
        }
        let (sender, wake) = (self.chosen.0.clone(), self.wake.clone());
        // On a thread of its own: the dialog of some desktops hangs.
        let spawned = thread::Builder::new()
            .name("dialog".to_owned())
            .spawn(move || {
                let file = rfd::FileDialog::new()
                    .set_title("Open a scene")
                    .add_filter("Wavefront OBJ", &["obj", "OBJ"])
                    .pick_file();
                // Nobody listens once the window is closed.
                let _ = sender.send(file);
                wake();
            });
        self.dialog_is_open = spawned.is_ok();
    }

    fn scene_name(&self) -> String {
        self.state
            .loaded
            .as_ref()
            .map_or_else(|| "vecrad".to_owned(), |loaded| loaded.source.label())
    }

    fn save_window(&mut self, ctx: &egui::Context) {
        let path = saver::free_path(&self.scene_name());
        let (sender, wake) = (self.notices.0.clone(), self.wake.clone());
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
                    display,
                    radiance: None,
                };
                saving.start(sender, wake);
            }
        });
    }

    fn save_picture(&mut self, path: PathBuf, size: [u32; 2]) {
        let Some(viewport) = &mut self.viewport else {
            let text = "no picture can be drawn without a graphics adapter";
            self.state.messages.push(Severity::Error, text);
            return;
        };
        match viewport.picture(&self.state, size) {
            Ok((display, radiance)) => {
                let saving = saver::Saving {
                    path,
                    display,
                    radiance,
                };
                saving.start(self.notices.0.clone(), self.wake.clone());
            }
            Err(error) => self.state.messages.push(Severity::Error, error),
        }
    }

    fn save_sidecar(&mut self) {
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

    /// Select what was clicked.
    fn select(&mut self, picked: Picked) {
        match picked {
            Picked::Nothing => self.clear_selection(),
            Picked::Surface(pick) => {
                self.state.selection = Some(Selection {
                    pick,
                    of: None,
                    probe: None,
                    object_light: Default::default(),
                    object: None,
                });
                if let Some(snapshot) = &self.state.run.snapshot
                    && self.state.view.clusters.shown
                {
                    let level = self.state.view.clusters.level;
                    self.state.cluster =
                        clusters::containing(&snapshot.clusters, pick.point, level);
                }
                self.look_up();
            }
        }
    }

    fn side_panels(&mut self, ui: &mut egui::Ui, actions: &mut Vec<Action>) {
        let state = &mut self.state;
        egui::Panel::left("light")
            .resizable(true)
            .default_size(320.0)
            .size_range(290.0..=480.0)
            .show(ui, |ui| {
                egui::ScrollArea::vertical()
                    .auto_shrink(false)
                    .show(ui, |ui| {
                        ui.add_space(4.0);
                        panels::row::section(ui, "Progress", true, |ui| {
                            panels::progress::progress_ui(ui, state, actions);
                        });
                        panels::row::section(ui, "Settings", true, |ui| {
                            panels::settings::settings_ui(ui, state, actions);
                        });
                    });
            });
        egui::Panel::right("look")
            .resizable(true)
            .default_size(300.0)
            .size_range(250.0..=520.0)
            .show(ui, |ui| {
                egui::ScrollArea::vertical()
                    .auto_shrink(false)
                    .show(ui, |ui| {
                        ui.add_space(4.0);
                        panels::row::section(ui, "Probe", true, |ui| {
                            panels::probe::probe_ui(ui, state, actions);
                        });
                        panels::row::section(ui, "Clusters", true, |ui| {
                            panels::clusters::clusters_ui(ui, state, actions);
                        });
                        panels::row::section(ui, "Convergence", true, |ui| {
                            panels::plot::plot_ui(ui, state);
                        });
                        panels::row::section(ui, "Statistics", false, |ui| {
                            panels::statistics::statistics_ui(ui, state);
                        });
                        messages_section(ui, state);
                    });
            });
    }
}

/// The messages; they open by themselves when asked for.
fn messages_section(ui: &mut egui::Ui, state: &mut State) {
    let open = std::mem::take(&mut state.panels.show_messages).then_some(true);
    egui::CollapsingHeader::new(egui::RichText::new("Messages").strong())
        .id_salt("Messages")
        .open(open)
        .show_unindented(ui, |ui| panels::messages::messages_ui(ui, state));
}

impl eframe::App for App {
    fn logic(&mut self, ctx: &egui::Context, _frame: &mut eframe::Frame) {
        if self.faults.is_lost() {
            ctx.send_viewport_cmd(egui::ViewportCommand::Close);
        }
        self.drain();
        if let Some(title) = self.title.take() {
            ctx.send_viewport_cmd(egui::ViewportCommand::Title(title));
        }
    }

    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        let mut actions = Vec::new();
        if !ctx.egui_wants_keyboard_input() {
            actions.extend(ctx.input_mut(|input| bindings::pressed(input, &self.table)));
        }
        let dropped = ctx.input(|input| {
            let files = &input.raw.dropped_files;
            files.first().map(|file| file.path().to_owned())
        });
        if let Some(path) = dropped {
            actions.push(Action::Load(SceneSource::File(path)));
        }
        let before = self.state.view.clone();
        if self.state.panels.shown {
            egui::Panel::top("menu").show(ui, |ui| {
                panels::menu::menu_ui(ui, &mut self.state, &self.table, &mut actions);
            });
            egui::Panel::top("toolbar").show(ui, |ui| {
                ui.add_space(2.0);
                panels::toolbar::toolbar_ui(ui, &mut self.state, &mut actions);
                ui.add_space(2.0);
            });
            egui::Panel::bottom("status").show(ui, |ui| {
                panels::status::status_ui(ui, &mut self.state);
            });
            self.side_panels(ui, &mut actions);
        }
        let picked = egui::CentralPanel::no_frame()
            .show(ui, |ui| {
                let rect = ui.available_rect_before_wrap();
                let picked = viewport_ui(ui, self.viewport.as_mut(), &mut self.state);
                if self.state.loaded.is_none() && self.state.loading.is_none() {
                    panels::scene::empty_ui(ui, rect, &mut self.state, &mut actions);
                }
                panels::scene::waiting_ui(ui, rect, &self.state);
                panels::legend::legend_ui(ui, rect, &self.state);
                picked
            })
            .inner;
        panels::scene::path_window(&ctx, &mut self.state, &mut actions);
        panels::picture::picture_window(&ctx, &mut self.state, &mut actions);
        panels::help::help_window(&ctx, &mut self.state, &self.table);
        if self.state.view != before {
            self.follow_light();
            ctx.request_repaint();
        }
        if let Some(picked) = picked {
            self.select(picked);
            ctx.request_repaint();
        }
        for action in actions {
            self.perform(&ctx, action);
        }
    }

    fn save(&mut self, storage: &mut dyn eframe::Storage) {
        if let Ok(text) = toml::to_string(&self.state.recent) {
            storage.set_string(RECENT_KEY, text);
        }
    }
}
