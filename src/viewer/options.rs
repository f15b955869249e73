//! Options with which the window is opened.

use glam::{DVec3, Vec3};

use super::{camera::Camera, loader::SceneSource, view::ViewRequest};
use crate::{
    scene::{Frame, Lighting, SceneOptions},
    solver::SolveSettings,
    worker::RunOptions,
};

/// Options of the window.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// The scene; none shows how to open one.
    pub source: Option<SceneSource>,
    /// How it is read.
    pub scene_options: SceneOptions,
    /// Whether it is read again when its files change.
    pub watches_files: bool,
    /// The light that it has beside its own.
    pub lighting: Lighting,
    /// Settings of the solve.
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
    /// The point it looks at.
    pub focal_point: Option<DVec3>,
    /// Vertical angle of view in degrees.
    pub view_angle_degrees: Option<f32>,
    /// The up direction; by default unchanged.
    pub up: Option<Vec3>,
}

impl CameraRequest {
    /// A camera with what was asked for put in.
    pub fn apply(&self, camera: Camera, frame: &Frame) -> Camera {
        let mut camera = camera;
        if let Some(up) = self.up.filter(|up| *up != camera.up) {
            camera = camera.placed(camera.eye(), camera.pivot, up);
        }
        if self.position.is_some() || self.focal_point.is_some() {
            let eye = self
                .position
                .map_or(camera.eye(), |point| frame.from_world(point));
            let target = self
                .focal_point
                .map_or(camera.pivot, |point| frame.from_world(point));
            camera = camera.placed(eye, target, camera.up);
        }
        if let Some(degrees) = self.view_angle_degrees {
            camera.fov_y_radians = degrees.clamp(1.0, 170.0).to_radians();
        }
        camera
    }
}
