//! State of the window: the scene, the run, the view, the selection, the messages.

use std::sync::Arc;

use super::{
    camera::{Camera, CameraRig},
    clusters::ShownClusters,
    exposure::Follower,
    frame_time::FrameTimes,
    inspection::Inspections,
    lights::{History, Lights, Solo},
    loader::{LoadedScene, Loader},
    materials::Materials,
    messages::Messages,
    options::CameraRequest,
    panel_state::PanelState,
    pick::{ObjectLight, Pick, Probe},
    run::Run,
    session::Recent,
    sharpness::Sharpness,
    stage::Staged,
    truth::Truth,
    view::{ViewMode, ViewSettings},
};
use crate::{
    hierarchy::NodeId,
    scene::{Environment, Lighting, Scene, SceneOptions, Sky, SkySource, SunSource},
    solver::{SolveSettings, StepReport, Subject},
    worker::RunOptions,
};

/// The picked point and what was looked up for it.
pub struct Selection {
    /// The point.
    pub pick: Pick,
    /// Light at the point, once it was looked up.
    pub probe: Option<Probe>,
    /// Light over the object.
    pub object_light: ObjectLight,
    /// Index of the object.
    pub object: Option<usize>,
}

/// The whole state of the window.
#[derive(Default)]
pub struct State {
    /// The scene that is shown.
    pub loaded: Option<Arc<LoadedScene>>,
    /// The scene that is being read.
    pub loading: Option<Loader>,
    /// The run.
    pub run: Run,
    /// The reference that light is measured by.
    pub truth: Truth,
    /// Settings in force.
    pub settings: SolveSettings,
    /// Limits in force.
    pub options: RunOptions,
    /// Cameras that were kept for this scene.
    pub bookmarks: Vec<Camera>,
    /// How scenes are read.
    pub scene_options: SceneOptions,
    /// Whether they are read again when their files change.
    pub watches_files: bool,
    /// The light that they have beside their own.
    pub lighting: Lighting,
    /// Its lights and materials, as they were changed.
    pub materials: Materials,
    /// Where one light is shown alone.
    pub solo: Option<Solo>,
    /// How they were before and after changes.
    pub history: History,
    /// How the light is shown.
    pub view: ViewSettings,
    /// The view mode before the key for normals was pressed.
    pub mode_before_normals: ViewMode,
    /// The automatic exposure.
    pub exposure: Follower,
    /// From where.
    pub rig: CameraRig,
    /// The picked point.
    pub selection: Option<Selection>,
    /// The selected cluster.
    pub cluster: Option<usize>,
    /// The shown clusters.
    pub shown_clusters: ShownClusters,
    /// The picture that is ready to be drawn.
    pub staged: Option<Arc<Staged>>,
    /// Inspections of the selection.
    pub inspections: Inspections,
    /// Times of frames.
    pub frame_times: FrameTimes,
    /// Ends of the false colours in use.
    pub false_color_range: [f32; 2],
    /// Messages to the user.
    pub messages: Messages,
    /// Scenes opened before.
    pub recent: Recent,
    /// State of the panels.
    pub panels: PanelState,
    /// The graphics adapter, for the statistics.
    pub adapter_name: String,
    /// Size of the viewport in pixels.
    pub viewport_size: [u32; 2],
    /// How far the traced picture of the view is; `None` where there is none.
    pub sharpness: Option<Sharpness>,
}

impl State {
    /// Width over height of the viewport.
    pub fn aspect(&self) -> f32 {
        let [width, height] = self.viewport_size;
        width.max(1) as f32 / height.max(1) as f32
    }

    /// Show the whole scene from the present direction.
    pub fn frame_all(&mut self) {
        let aspect = self.aspect();
        if let Some(loaded) = &self.loaded {
            self.rig.target.frame_box(loaded.min, loaded.max, aspect);
        }
    }

    /// Lights and materials as they are now.
    pub fn lights(&self) -> Lights {
        Lights {
            materials: self.materials.clone(),
            lighting: self.lighting.clone(),
            solo: self.solo.clone(),
        }
    }

    /// Whether there are a sky and a sun, switched on or off.
    pub fn has_outside(&self) -> [bool; 2] {
        let Some(loaded) = &self.loaded else {
            return [false; 2];
        };
        let Environment { sky, sun, .. } = &*loaded.own_environment;
        let has_sky = match &self.lighting.sky {
            Some(sky) => *sky != SkySource::Dark,
            // Where nothing emits there is one by default.
            None => !matches!(sky, Sky::Dark) || loaded.emitter_count == 0,
        };
        let has_sun = match &self.lighting.sun {
            Some(sun) => *sun != SunSource::Dark,
            None => sun.is_some(),
        };
        [has_sky, has_sun]
    }

    /// The sun that shines, if there is one.
    pub fn sun(&self) -> Option<SunSource> {
        let loaded = self.loaded.as_ref()?;
        let scene = &loaded.scene;
        let sun = scene.environment.sun.as_ref()?;
        let own = || SunSource::of(sun, scene.up, scene.radiance_unit);
        Some(self.lighting.sun.unwrap_or_else(own))
    }

    /// Whether no light reaches what the scene shows first. The light that numerical errors let through is not exposed
    /// then: surfaces are shown instead, unless somebody sets the exposure.
    pub fn is_dark(&self) -> bool {
        let mut materials = 0..self.materials.now.len();
        let is_dark = self.loaded.as_ref().is_some_and(|loaded| !loaded.is_lit);
        is_dark
            && self.view.auto_exposure
            && self.view.mode.is_light()
            && !materials.any(|index| self.materials.is_lamp(index))
    }

    /// Go back to the view that the scene opened with, with the axis up that is up now.
    pub fn look_first(&mut self) {
        if let Some(loaded) = &self.loaded {
            let upright = CameraRequest {
                up: Some(self.rig.target.up),
                ..CameraRequest::default()
            };
            self.rig.target = upright.apply(loaded.viewpoint, &loaded.scene.frame);
        }
    }

    /// A cluster was guessed from boxes around the picked point; once the solver has said which ones really hold it, take
    /// the one of those.
    pub fn correct_cluster(&mut self) {
        let (Some(index), Some(inspection)) = (self.cluster, self.inspections.element()) else {
            return;
        };
        let over = |at: &usize| {
            let mut path = inspection.path.iter().map(|node| node.place.node.index());
            path.any(|node| node == *at)
        };
        if !over(&index) {
            let mut shown = self.shown_clusters.shown.iter().copied();
            self.cluster = shown.rfind(over).or(self.cluster);
        }
    }

    /// The subjects of inspection: the picked element, and the selected cluster.
    pub fn subjects(&self) -> Vec<Subject> {
        let element = self.selection.as_ref().and_then(|selection| {
            Some(Subject::Element {
                node: NodeId(selection.probe.as_ref()?.element),
                point: selection.pick.point,
            })
        });
        let cluster = self
            .cluster
            .map(|index| Subject::Cluster(NodeId(index as u32)));
        element.into_iter().chain(cluster).collect()
    }

    /// The scene as it is lit: with lights and materials as they are now.
    pub fn lit_scene(&self) -> Option<Arc<Scene>> {
        let scene = &self.loaded.as_ref()?.scene;
        Some(if self.materials.are_changed() {
            Arc::new(scene.relit(&self.materials.appearances(scene)))
        } else {
            scene.clone()
        })
    }

    /// Factor on light where it is shown as a number: see [`Scene::radiance_unit`].
    pub fn radiance_unit(&self) -> f32 {
        let loaded = self.loaded.as_ref();
        loaded.map_or(1.0, |loaded| loaded.scene.radiance_unit)
    }

    /// Whether nothing in the scene has a colour, so that one channel is enough.
    pub fn is_grey(&self) -> bool {
        let is_grey = self.loaded.as_ref().is_some_and(|loaded| loaded.is_grey);
        is_grey && (!self.materials.are_changed() || self.materials.are_grey())
    }

    /// Whether there are one-sided faces, whose backs can be shown.
    pub fn has_backs(&self) -> bool {
        self.loaded.as_ref().is_some_and(|loaded| loaded.has_backs)
    }

    /// Whether something sends light in preferred directions.
    pub fn has_gloss(&self) -> bool {
        let loaded = self.loaded.as_ref();
        loaded.is_some_and(|loaded| loaded.scene.has_specular())
    }

    /// Whether the scene is a room, whose walls can be looked through.
    pub fn has_interior(&self) -> bool {
        let loaded = self.loaded.as_ref();
        loaded.is_some_and(|loaded| loaded.interior.is_some())
    }

    /// Whether there are emitters; of no scene nobody knows.
    pub fn has_emitters(&self) -> bool {
        let loaded = self.loaded.as_ref();
        loaded.is_none_or(|loaded| loaded.emitter_count > 0)
    }

    /// The last report.
    pub fn report(&self) -> Option<&StepReport> {
        self.run.reports.last()
    }
}
