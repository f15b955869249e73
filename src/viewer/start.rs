//! Opening the window: options, the graphics device, and what can go wrong with it.

use std::sync::{
    Arc, Mutex, OnceLock, PoisonError,
    atomic::{AtomicBool, Ordering},
};

use eframe::{egui, egui_wgpu};
use glam::{DVec3, Vec3};

use super::{
    app::App, camera::Camera, fonts::SystemFonts, loader::SceneSource, render::Gpu,
    stderr::StderrCapture, view::ViewRequest,
};
use crate::{
    scene::{Frame, SceneOptions},
    solver::SolveSettings,
    worker::{RunOptions, Wake},
};

/// What the window opens with.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// The scene; none shows how to open one.
    pub source: Option<SceneSource>,
    /// How it is read.
    pub scene_options: SceneOptions,
    /// What is computed.
    pub settings: SolveSettings,
    /// Whether these settings go before those saved beside the scene.
    pub settings_are_asked_for: bool,
    /// Limits of the run.
    pub run: RunOptions,
    /// How it is shown.
    pub view: ViewRequest,
    /// From where.
    pub camera: CameraRequest,
}

/// A camera in world units, as far as it was asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CameraRequest {
    /// The eye.
    pub position: Option<DVec3>,
    /// What it looks at.
    pub focal_point: Option<DVec3>,
    /// Vertical angle of view in degrees.
    pub view_angle_degrees: Option<f32>,
    /// What is up; by default as it was.
    pub up: Option<Vec3>,
}

impl CameraRequest {
    /// A camera with what was asked for put in.
    pub fn apply(&self, camera: Camera, frame: &Frame) -> Camera {
        let mut camera = camera;
        if let Some(up) = self.up.filter(|up| *up != camera.up) {
            let (eye, pivot) = (camera.eye(), camera.pivot);
            camera = Camera {
                fov_y_radians: camera.fov_y_radians,
                orthographic: camera.orthographic,
                ..Camera::looking(eye, pivot, up)
            };
        }
        if self.position.is_some() || self.focal_point.is_some() {
            let eye = self
                .position
                .map_or(camera.eye(), |point| frame.from_world(point));
            let target = self
                .focal_point
                .map_or(camera.pivot, |point| frame.from_world(point));
            camera = Camera {
                fov_y_radians: camera.fov_y_radians,
                orthographic: camera.orthographic,
                ..Camera::looking(eye, target, camera.up)
            };
        }
        if let Some(degrees) = self.view_angle_degrees {
            camera.fov_y_radians = degrees.clamp(1.0, 170.0).to_radians();
        }
        camera
    }
}

/// Why there is no window, or no more.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ViewerError {
    /// Nothing can draw.
    #[error(
        "no graphics adapter can draw the window ({0}); try WGPU_BACKEND=gl, or install a Vulkan driver (on Debian: mesa-vulkan-drivers libvulkan1)"
    )]
    NoAdapter(String),
    /// There is no display.
    #[error(
        "no display was found ({0}); set DISPLAY or WAYLAND_DISPLAY, or light the scene without a window: vecrad solve SCENE.obj --export lit.ply"
    )]
    NoDisplay(String),
    /// The device went away.
    #[error("the graphics device was lost ({0}); start again, with WGPU_BACKEND=gl if it repeats")]
    DeviceLost(String),
    /// Anything else.
    #[error("the window failed: {0}")]
    Other(String),
}

/// Open the window and stay until it is closed.
///
/// # Errors
/// See [`ViewerError`].
pub fn run(options: Options) -> Result<(), ViewerError> {
    let faults = Arc::new(Faults::default());
    let source = options.source.as_ref();
    let title = source.map_or_else(|| "vecrad".to_owned(), title);
    let app_faults = faults.clone();
    let capture = StderrCapture::begin();
    let ended = eframe::run_native(
        "vecrad",
        native_options(&title),
        Box::new(move |cc| {
            cc.egui_ctx
                .add_font_provider(Arc::new(SystemFonts::default()));
            app_faults.listen_to_signals(cc.egui_ctx.clone());
            // The adapter has been found.
            drop(capture);
            Ok(Box::new(App::new(cc, options, app_faults)?))
        }),
    );
    if let Some(reason) = faults.lost.get() {
        return Err(ViewerError::DeviceLost(reason.clone()));
    }
    ended.map_err(|error| describe(&error))
}

/// Title of the window that shows a scene.
pub(super) fn title(source: &SceneSource) -> String {
    format!("{} – vecrad", source.label())
}

fn native_options(title: &str) -> eframe::NativeOptions {
    let mut setup = egui_wgpu::WgpuSetupCreateNew::without_display_handle();
    setup.device_descriptor = Arc::new(Gpu::device_descriptor);
    eframe::NativeOptions {
        event_loop_builder: event_loop_builder(),
        viewport: egui::ViewportBuilder::default()
            .with_title(title)
            .with_app_id("vecrad")
            .with_icon(icon())
            .with_inner_size([1360.0, 860.0])
            .with_min_inner_size([720.0, 480.0])
            .with_drag_and_drop(true),
        wgpu_options: egui_wgpu::WgpuConfiguration {
            wgpu_setup: setup.into(),
            ..Default::default()
        },
        persist_window: true,
        // Our own looks for fonts.
        system_font_fallback: false,
        ..Default::default()
    }
}

/// Asks for X11 where the Wayland display that is named does not answer.
fn event_loop_builder() -> Option<eframe::EventLoopBuilderHook> {
    #[cfg(target_os = "linux")]
    if super::display_server::needs_x11(|name| std::env::var_os(name)) {
        use winit::platform::x11::EventLoopBuilderExtX11 as _;
        return Some(Box::new(|builder| {
            builder.with_x11();
        }));
    }
    None
}

/// The icon of the window: an empty one where the picture cannot be read.
fn icon() -> egui::IconData {
    let picture = include_bytes!("../../assets/vecrad.png");
    eframe::icon_data::from_png_bytes(picture).unwrap_or_default()
}

/// One sentence for what eframe says.
fn describe(error: &eframe::Error) -> ViewerError {
    let text = essence(&error.to_string());
    match error {
        eframe::Error::Wgpu(_) => ViewerError::NoAdapter(text),
        eframe::Error::Winit(_) | eframe::Error::WinitEventLoop(_) => ViewerError::NoDisplay(text),
        _ => ViewerError::Other(text),
    }
}

/// What an error says, without the places in other people's source that it names.
fn essence(text: &str) -> String {
    let text = text.replace('\n', " ");
    let said = match text.rsplit_once(".rs:") {
        Some((_, place)) => place.split_once(": ").map_or(place, |(_, said)| said),
        None => &text,
    };
    said.trim_start_matches("WGPU error: ")
        .trim_end_matches(": {}")
        .trim_end_matches('.')
        .to_owned()
}

/// What comes from outside the window, from whatever thread: complaints of the graphics device, signals of the system.
#[derive(Default)]
pub struct Faults {
    sentences: Mutex<Vec<String>>,
    lost: OnceLock<String>,
    must_close: AtomicBool,
}

impl Faults {
    /// Listen to a device, so that its errors become sentences and not the end of the program.
    pub fn watch(self: &Arc<Self>, device: &wgpu::Device, wake: Wake) {
        let (faults, waker) = (self.clone(), wake.clone());
        device.set_device_lost_callback(move |reason, text| {
            // Closing the window drops the device, too.
            if reason != wgpu::DeviceLostReason::Destroyed {
                let _ = faults.lost.set(text.replace('\n', " "));
                faults.must_close.store(true, Ordering::Relaxed);
                waker();
            }
        });
        let faults = self.clone();
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            faults.push(match error {
                wgpu::Error::OutOfMemory { .. } => {
                    "the graphics adapter is out of memory; close other programs, or raise the smallest element area and restart".to_owned()
                }
                other => format!("the graphics adapter refused: {}", first_line(&other.to_string())),
            });
            wake();
        }));
    }

    /// Close the window on Ctrl+C and when the system ends the program, so that what is being written is written; a
    /// second signal ends the program at once.
    fn listen_to_signals(self: &Arc<Self>, ctx: egui::Context) {
        let faults = self.clone();
        let listening = ctrlc::set_handler(move || {
            if faults.must_close.swap(true, Ordering::Relaxed) {
                std::process::exit(1);
            }
            ctx.request_repaint();
        });
        // Without, a signal ends the program as it would any other.
        drop(listening);
    }

    /// Whether the window is to close: the device is gone, or a signal came.
    pub fn must_close(&self) -> bool {
        self.must_close.load(Ordering::Relaxed)
    }

    /// Sentences since the last call.
    pub fn take(&self) -> Vec<String> {
        let mut held = self
            .sentences
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        std::mem::take(&mut *held)
    }

    fn push(&self, sentence: String) {
        self.sentences
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(sentence);
    }
}

fn first_line(text: &str) -> String {
    text.lines()
        .map(str::trim)
        .filter(|line| !line.is_empty())
        .take(3)
        .collect::<Vec<_>>()
        .join(": ")
}

#[cfg(test)]
mod tests {
    use super::essence;

    #[test]
    fn errors_are_short() {
        let long = "winit EventLoopError: os error at /a/b/mod.rs:765: DISPLAY is not set.";
        assert_eq!(essence(long), "DISPLAY is not set");
        let empty = "WGPU error: Failed to create surface for any enabled backend: {}";
        assert_eq!(
            essence(empty),
            "Failed to create surface for any enabled backend"
        );
    }
}
