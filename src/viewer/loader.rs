//! Scenes read on a thread of their own, so that the window never waits for a file.

use std::{
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicU8, Ordering},
        mpsc::{self, Receiver, TryRecvError},
    },
    thread,
    time::{Duration, Instant},
};

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::{
    camera::Camera,
    first_look::{Interior, first_look, shows_light},
};
use crate::{
    geometry::RayTree,
    scene::{
        self, Environment, FileView, Frame, Lighting, ReadProgress, Scene, SceneOptions, builtin,
    },
    worker::Wake,
};

/// Where a scene comes from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SceneSource {
    /// An OBJ or glTF file.
    File(PathBuf),
    /// A built-in scene.
    Builtin(String),
}

impl SceneSource {
    /// Its name in lists and titles.
    pub fn label(&self) -> String {
        match self {
            Self::File(path) => path
                .file_name()
                .unwrap_or(path.as_os_str())
                .to_string_lossy()
                .into_owned(),
            Self::Builtin(name) => name.clone(),
        }
    }

    /// Title of the window that shows it.
    pub fn window_title(&self) -> String {
        format!("{} – vecrad", self.label())
    }

    /// The file, where there is one.
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::File(path) => Some(path),
            Self::Builtin(_) => None,
        }
    }
}

/// A scene with what the window needs to show it.
#[derive(Clone)]
pub struct LoadedScene {
    /// Where it came from.
    pub source: SceneSource,
    /// The scene.
    pub scene: Arc<Scene>,
    /// The light that it has beside its own.
    pub lighting: Lighting,
    /// Sky and sun that it brings along, in its own units.
    pub own_environment: Arc<Environment>,
    /// For picking, and for the reference.
    pub rays: Arc<RayTree>,
    /// Lower corner of what matters, in frame units.
    pub min: Vec3,
    /// Upper corner of what matters, in frame units.
    pub max: Vec3,
    /// Whether light reaches what is seen first.
    pub is_lit: bool,
    /// The room, where it is one.
    pub interior: Option<Interior>,
    /// Triangles that emit.
    pub emitter_count: usize,
    /// Whether there are one-sided faces, whose backs can be shown or looked through.
    pub has_backs: bool,
    /// Whether all surfaces are grey and all light white, so that one channel is enough.
    pub is_grey: bool,
    /// The view to open with: the one that the scene brings along, or the one that sees most.
    pub viewpoint: Camera,
    /// The cameras of its file.
    pub own_views: Vec<Camera>,
}

impl LoadedScene {
    /// The same under another sky and sun.
    pub fn under(&self, lighting: &Lighting) -> Self {
        let mut scene = Scene::clone(&self.scene);
        scene.environment = self.own_environment.clone();
        let environment = lighting.environment(&scene);
        let scene = scene.in_environment(environment);
        Self {
            lighting: lighting.clone(),
            is_lit: self.is_lit || shows_light(&scene, &self.rays, &self.viewpoint),
            is_grey: is_grey(&scene),
            scene: Arc::new(scene),
            ..self.clone()
        }
    }
}

/// Stages of loading a scene, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// The file, its materials and textures.
    Reading,
    /// The tree that picking and the reference need.
    BuildingRayTree,
    /// Where to look from.
    ChoosingView,
}

/// Progress of loading a scene, set by the thread that reads it. Clones share it.
#[derive(Clone, Debug, Default)]
struct Tracker {
    phase: Arc<AtomicU8>,
    file: ReadProgress,
}

impl Tracker {
    fn enter(&self, phase: Phase) {
        self.phase.store(phase as u8, Ordering::Relaxed);
    }

    fn progress(&self, elapsed: Duration) -> LoadProgress {
        /// Parts of the bar at which the text has been read, and at which each later phase begins. Reading takes longest.
        const TEXT: f32 = 0.7;
        let share = self.file.share();
        let (share, doing) = match self.phase.load(Ordering::Relaxed) {
            phase if phase == Phase::BuildingRayTree as u8 => (0.85, "Building the ray tree"),
            phase if phase == Phase::ChoosingView as u8 => (0.95, "Choosing a view"),
            _ if share < 1.0 => (TEXT * share, "Reading"),
            _ => (TEXT, "Reading materials and textures"),
        };
        LoadProgress {
            share,
            doing,
            elapsed,
        }
    }
}

/// How far a scene is on its way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadProgress {
    /// The part that is done, 0…1.
    pub share: f32,
    /// The present stage.
    doing: &'static str,
    /// Since reading began.
    elapsed: Duration,
}

impl LoadProgress {
    /// The present stage and its progress, short.
    pub fn text(&self) -> String {
        let percent = (100.0 * self.share).floor();
        match self.elapsed.as_secs() {
            0 => format!("{}: {percent} %", self.doing),
            seconds => format!("{}: {percent} %, {seconds} s", self.doing),
        }
    }

    /// The same with the name of the scene.
    pub fn sentence(&self, name: &str) -> String {
        format!("{name}: {}", self.text())
    }
}

/// A scene on its way.
pub struct Loader {
    source: SceneSource,
    receiver: Receiver<Result<LoadedScene, String>>,
    tracker: Tracker,
    since: Instant,
}

impl Loader {
    /// Begin to read. What the scene has beside its own light is looked up on the thread.
    ///
    /// # Errors
    /// When the system refuses a thread.
    pub fn start(
        source: SceneSource,
        options: SceneOptions,
        lighting: impl FnOnce() -> Lighting + Send + 'static,
        wake: Wake,
    ) -> std::io::Result<Self> {
        let (sender, receiver) = mpsc::channel();
        let tracker = Tracker::default();
        let (wanted, tracked) = (source.clone(), tracker.clone());
        thread::Builder::new()
            .name("loader".to_owned())
            .spawn(move || {
                // Nobody listens when another scene was asked for meanwhile.
                let _ = sender.send(load(wanted, &options, lighting, &tracked));
                wake();
            })?;
        Ok(Self {
            source,
            receiver,
            tracker,
            since: Instant::now(),
        })
    }

    /// How far it is.
    pub fn progress(&self) -> LoadProgress {
        self.tracker.progress(self.since.elapsed())
    }

    /// The source that is being read.
    pub fn source(&self) -> &SceneSource {
        &self.source
    }

    /// The scene or one sentence, once it is there.
    pub fn poll(&self) -> Option<Result<LoadedScene, String>> {
        match self.receiver.try_recv() {
            Ok(outcome) => Some(outcome),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err(format!(
                "reading {} failed inside the program; please report this file",
                self.source.label()
            ))),
        }
    }
}

/// Read a scene and make it ready to show.
///
/// # Errors
/// One sentence for people.
fn load(
    source: SceneSource,
    options: &SceneOptions,
    lighting: impl FnOnce() -> Lighting,
    tracker: &Tracker,
) -> Result<LoadedScene, String> {
    tracker.enter(Phase::Reading);
    let (scene, viewpoint) = match &source {
        SceneSource::File(path) => {
            let scene = scene::read_scene_with_progress(path, options, &tracker.file);
            (scene.map_err(|error| error.to_string())?, None)
        }
        SceneSource::Builtin(name) => {
            let found = builtin::find_builtin(name)
                .ok_or_else(|| format!("there is no built-in scene named '{name}'"))?;
            let scene = found.scene(options).map_err(|error| error.to_string())?;
            let viewpoint = builtin_camera(found, &scene);
            (scene, Some(viewpoint))
        }
    };
    let own_environment = scene.environment.clone();
    let lighting = lighting();
    let scene = lighting.apply(scene);
    tracker.enter(Phase::BuildingRayTree);
    let rays = RayTree::new(&scene);
    tracker.enter(Phase::ChoosingView);
    let look = first_look(&scene, &rays);
    let own_views = file_cameras(&scene, &rays);
    let viewpoint = viewpoint
        .or(own_views.first().copied())
        .unwrap_or(look.camera);
    let [min, max] = look.bounds;
    let emits = |surface: &&scene::Surface| surface.emission != Vec3::ZERO;
    Ok(LoadedScene {
        lighting,
        own_environment,
        emitter_count: scene.surfaces.iter().filter(emits).count(),
        has_backs: scene.triangles.iter().any(|triangle| !triangle.two_sided),
        is_grey: is_grey(&scene),
        rays: Arc::new(rays),
        scene: Arc::new(scene),
        source,
        min,
        max,
        is_lit: look.is_lit,
        interior: look.interior,
        viewpoint,
        own_views,
    })
}

/// Whether nothing in a scene has a colour.
fn is_grey(scene: &Scene) -> bool {
    let is_grey = |color: Vec3| color.min_element() == color.max_element();
    let mut surfaces = scene.surfaces.iter();
    scene.textures.is_empty()
        && scene.environment.is_grey()
        && surfaces.all(|surface| is_grey(surface.reflectance) && is_grey(surface.emission))
}

/// The view that a built-in scene brings along.
pub fn builtin_camera(builtin: &builtin::Builtin, scene: &Scene) -> Camera {
    let eye = scene.frame.from_world(builtin.viewpoint.position);
    let target = scene.frame.from_world(builtin.viewpoint.target);
    Camera::looking(eye, target, scene.up.vector())
}

/// The views that a file brings along, each around the first thing that it sees.
pub fn file_cameras(scene: &Scene, rays: &RayTree) -> Vec<Camera> {
    let camera = |view: &FileView| {
        let eye = scene.frame.from_world(view.position);
        let direction = view.direction.as_vec3();
        let seen = rays.closest(eye, direction, None);
        let distance = seen.map_or(Frame::EXTENT as f32, |hit| hit.distance);
        Camera {
            fov_y_radians: view.fov_y_radians,
            ..Camera::looking(eye, eye + direction * distance, scene.up.vector())
        }
    };
    let cameras = scene.views.iter().map(camera);
    cameras.filter(Camera::is_valid).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_moves_from_phase_to_phase() {
        let tracker = Tracker::default();
        let at = |seconds| tracker.progress(Duration::from_secs(seconds));
        assert_eq!(at(0).text(), "Reading: 0 %");
        let mut shares = vec![at(0).share];
        for phase in [Phase::BuildingRayTree, Phase::ChoosingView] {
            tracker.enter(phase);
            shares.push(at(0).share);
        }
        assert!(shares.is_sorted_by(|a, b| a < b), "{shares:?}");
        assert_eq!(
            at(3).sentence("hall.obj"),
            "hall.obj: Choosing a view: 95 %, 3 s"
        );
    }
}
