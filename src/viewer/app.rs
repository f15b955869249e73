//! The application: events in, panels and viewport drawn, actions carried out.

mod acting;
mod dropping;
mod incoming;
mod saving;
mod scenes;

use std::{
    path::PathBuf,
    sync::{
        Arc,
        mpsc::{self, Receiver, Sender},
    },
    time::{Duration, Instant},
};

use eframe::egui;

use super::{
    action::Action,
    bindings::{self, Binding},
    faults::Faults,
    focus,
    glossing::Glossing,
    options::Options,
    panels,
    preferences::Preferences,
    saver::{Notice, Unfinished},
    session::Recent,
    stage::Stage,
    state::State,
    theme,
    viewport::{Viewport, viewport_ui},
    watch::SceneWatch,
};
use crate::scene::Lighting;
use crate::worker::{RunOptions, Wake, WorkerHandle};

/// When the next frame is drawn after something arrived. At once would draw two frames, and on a processor that plays
/// adapter each takes time from the solver.
const SOON: Duration = Duration::from_millis(1);

/// How often the progress of reading is shown anew. More often would take the processor from the reading.
const PROGRESS: Duration = Duration::from_millis(200);

/// Where the list of recent files is kept.
const RECENT_KEY: &str = "recent";

/// The window's application.
pub struct App {
    /// Its state. Public for tests.
    pub state: State,
    worker: WorkerHandle,
    stage: Stage,
    viewport: Option<Viewport>,
    table: Vec<Binding>,
    wake: Wake,
    faults: Arc<Faults>,
    /// Files chosen in the dialog.
    chosen: (Sender<Option<PathBuf>>, Receiver<Option<PathBuf>>),
    /// Tells when the files of the scene change, where that is asked for.
    watch: Option<SceneWatch>,
    guide: panels::guide::Guide,
    /// Since when the file dialog is open.
    dialog_since: Option<Instant>,
    glossing: Glossing,
    notices: (Sender<Notice>, Receiver<Notice>),
    unfinished: Unfinished,
    /// Set from the command line for the first scene only.
    first: Option<Options>,
    /// A new title for the window.
    title: Option<String>,
    /// Camera and view stay as they are when the scene being read arrives.
    keeps_view: bool,
    /// Light that the command line asked for; it goes before that of any sidecar.
    asked_light: Lighting,
    /// Whether a control had the keyboard focus at the end of the last frame.
    had_focus: bool,
    /// Size of the window in the last frame, points.
    size: egui::Vec2,
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
        // All keys are in one table.
        cc.egui_ctx
            .options_mut(|options| options.zoom_with_keyboard = false);
        let ctx = cc.egui_ctx.clone();
        let wake: Wake = Arc::new(move || ctx.request_repaint_after(SOON));
        let viewport = cc.wgpu_render_state.as_ref().map(|render_state| {
            faults.watch(&render_state.device, wake.clone());
            Viewport::new(render_state)
        });
        let adapter = viewport.as_ref().map(Viewport::adapter);
        let recent = cc
            .storage
            .and_then(|storage| storage.get_string(RECENT_KEY))
            .and_then(|text| toml::from_str::<Recent>(&text).ok())
            .unwrap_or_default();
        let preferences = Preferences::load(cc.storage);
        let state = State {
            settings: options.settings.clone(),
            options: RunOptions {
                gives_way: true,
                ..options.run.clone()
            },
            scene_options: options.scene_options,
            watches_files: options.watches_files,
            view: options.view.apply(&preferences.view()),
            panels: preferences.panels(),
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
            stage: Stage::spawn(adapter, wake.clone())?,
            viewport,
            table: bindings::bindings(),
            wake,
            faults,
            chosen: mpsc::channel(),
            watch: None,
            guide: panels::guide::Guide::default(),
            dialog_since: None,
            glossing: Glossing::default(),
            notices: mpsc::channel(),
            unfinished: Unfinished::default(),
            first: None,
            title: None,
            keeps_view: false,
            asked_light: options.lighting.clone(),
            had_focus: false,
            size: egui::Vec2::ZERO,
        };
        if let Some(source) = options.source.clone() {
            app.load(source);
            app.first = Some(options);
        }
        Ok(app)
    }
}

impl Drop for App {
    fn drop(&mut self) {
        // Files in progress are written, even when the window closes at once.
        self.unfinished.finish();
    }
}

impl eframe::App for App {
    fn logic(&mut self, ctx: &egui::Context, frame: &mut eframe::Frame) {
        if let Some(secs) = frame.info().cpu_usage {
            self.state.frame_times.push(secs);
        }
        if self.faults.must_close() {
            ctx.send_viewport_cmd(egui::ViewportCommand::Close);
        }
        self.drain();
        self.follow_files(ctx);
        if let Some(title) = self.title.take() {
            ctx.send_viewport_cmd(egui::ViewportCommand::Title(title));
        }
    }

    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        // Keys take effect in this frame already. They belong to fields and open menus first.
        if !focus::is_typing(&ctx) && !egui::Popup::is_any_open(&ctx) {
            self.obey_keys(&ctx);
        }
        self.take_dropped(&ctx);
        let mut actions: Vec<Action> = Vec::new();
        let before = self.state.view.clone();
        if self.state.panels.shown {
            egui::Panel::top("menu").show(ui, |ui| {
                panels::menu::menu_ui(
                    ui,
                    &mut self.state,
                    &mut self.guide,
                    &self.table,
                    &mut actions,
                );
            });
            egui::Panel::top("toolbar").show(ui, |ui| {
                ui.add_space(2.0);
                panels::toolbar::toolbar_ui(ui, &mut self.state, &mut actions);
                ui.add_space(2.0);
            });
            egui::Panel::bottom("status").show(ui, |ui| {
                panels::status::status_ui(ui, &mut self.state);
            });
            panels::sides::side_panels(ui, &mut self.state, &mut actions);
        }
        let picked = egui::CentralPanel::no_frame()
            .show(ui, |ui| {
                let rect = ui.available_rect_before_wrap();
                let picked = viewport_ui(ui, self.viewport.as_mut(), &mut self.state, &mut actions);
                if self.state.loaded.is_none() && self.state.loading.is_none() {
                    panels::scene::empty_ui(ui, rect, &mut self.state, &mut actions);
                }
                panels::scene::waiting_ui(ui, rect, &self.state);
                panels::dark::dark_ui(ui, rect, &self.state, &mut actions);
                panels::legend::legend_ui(ui, rect, &self.state);
                picked
            })
            .inner;
        panels::scene::path_window(&ctx, &mut self.state, &mut actions);
        panels::picture::picture_window(&ctx, &mut self.state, &mut actions);
        panels::mesh::mesh_window(&ctx, &mut self.state, &mut actions);
        panels::table::table_window(&ctx, &mut self.state.panels, &mut actions);
        panels::help::help_window(&ctx, &mut self.state, &self.table);
        self.guide.window(&ctx);
        dropping::hover_ui(&ctx);
        if self.state.loading.is_some() {
            ctx.request_repaint_after(PROGRESS);
        }
        // Bars that wrap take the height that they needed in the frame before.
        let size = ctx.content_rect().size();
        if size != self.size {
            self.size = size;
            ctx.request_repaint();
        }
        focus::ring_ui(&ctx);
        self.had_focus = focus::is_anywhere(&ctx);
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
        self.want();
        self.ask();
    }

    fn save(&mut self, storage: &mut dyn eframe::Storage) {
        if let Ok(text) = toml::to_string(&self.state.recent) {
            storage.set_string(RECENT_KEY, text);
        }
        Preferences::of(&self.state).store(storage);
    }
}
