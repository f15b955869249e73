//! The window: watch the light arrive, look inside the method, take the picture.

pub mod camera;
pub mod clusters;
pub mod light_range;
pub mod render;
pub mod theme;
pub mod view;
