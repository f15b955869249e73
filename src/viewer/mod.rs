//! The window: watch the light arrive, look inside the method, take the picture.
//!
//! [`run()`] opens it. [`app`] drains the loader and the worker, [`panels`] turn state into widgets and clicks into
//! [`action`]s, [`viewport`] shows what [`render`] draws. Nothing here calls the solver: the worker does.

pub mod action;
pub mod app;
pub mod bindings;
pub mod camera;
pub mod camera_text;
pub mod cluster_lines;
pub mod clusters;
#[cfg(target_os = "linux")]
mod display_server;
pub mod exposure;
pub mod faults;
pub mod figures;
pub mod first_look;
pub mod focus;
pub mod fonts;
pub mod frame_time;
mod glossing;
pub mod headless;
pub mod inspection;
pub mod light_range;
pub mod lights;
mod line_cache;
pub mod links;
pub mod loader;
pub mod material_file;
pub mod materials;
pub mod messages;
pub mod navigation;
pub mod options;
pub mod overlay;
pub mod panel_state;
pub mod panels;
pub mod pick;
pub mod picture_file;
pub mod preferences;
pub mod render;
pub mod run;
pub mod saved_light;
pub mod saver;
pub mod session;
pub mod sharpening;
pub mod sharpness;
pub mod stage;
pub mod start;
pub mod state;
pub mod stderr;
pub mod theme;
pub mod traced;
pub mod truth;
pub mod view;
pub mod viewport;
mod watch;
pub mod wording;

pub use options::{CameraRequest, Options};
pub use start::{ViewerError, run};
