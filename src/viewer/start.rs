//! Opening the window and its graphics device.

use std::sync::Arc;

use eframe::{egui, egui_wgpu};

use super::{
    app::App, faults::Faults, fonts::SystemFonts, loader::SceneSource, options::Options,
    render::Gpu, stderr::StderrCapture,
};

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
    let title = source.map_or_else(|| "vecrad".to_owned(), SceneSource::window_title);
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
    if let Some(reason) = faults.lost() {
        return Err(ViewerError::DeviceLost(reason.to_owned()));
    }
    ended.map_err(|error| describe(&error))
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
        // `SystemFonts` finds fonts.
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

/// One sentence for an error of eframe.
fn describe(error: &eframe::Error) -> ViewerError {
    let text = essence(&error.to_string());
    match error {
        eframe::Error::Wgpu(_) => ViewerError::NoAdapter(text),
        eframe::Error::Winit(_) | eframe::Error::WinitEventLoop(_) => ViewerError::NoDisplay(text),
        _ => ViewerError::Other(text),
    }
}

/// The text of an error, without the source locations that it names.
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
