//! Actions of the user: keys, menus, buttons and panels all end here.

use std::path::PathBuf;

use super::{camera::AxisView, loader::SceneSource, materials::Materials, view::ViewMode};
use crate::{
    scene::{Lighting, Sides, UpAxis},
    solver::{Lamp, SolveSettings},
    worker::RunOptions,
};

/// One action, carried out by the window after the panels are drawn.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Ask for a file.
    OpenDialog,
    /// Read a scene.
    Load(SceneSource),
    /// Read the present scene again, keeping camera and settings.
    Reload,
    /// Read the present scene again whenever its files are written, or no longer.
    ToggleWatch,
    /// Run, rest or go on, whichever comes next.
    PauseContinue,
    /// End the run.
    Stop,
    /// Trace the reference, rest, or go on.
    TraceReference,
    /// Forget the errors of earlier runs.
    ForgetRuns,
    /// Ask where the table of errors is to go.
    TableDialog,
    /// Write the table of errors as CSV.
    SaveTable(PathBuf),
    /// Light the scene from the beginning.
    Reset,
    /// Put settings in force.
    Settings(SolveSettings),
    /// Put limits in force.
    Options(RunOptions),
    /// Light the scene with other lights and materials.
    Relight(Materials),
    /// Light the scene from another sky and sun.
    Light(Lighting),
    /// One light alone; or, where it is that already, all lights that were on before.
    Solo(Lamp),
    /// Left drags move the sun, or again the camera.
    ToggleSunDrag,
    /// Lights and materials as before the last change.
    Undo,
    /// Lights and materials as before that was undone.
    Redo,
    /// Read the scene again with other sidedness.
    Sides(Sides),
    /// Show something else.
    Mode(ViewMode),
    /// Show normals, or again what was shown before.
    ToggleNormals,
    /// Brighter or darker, in EV.
    ExposureBy(f32),
    /// Multiply all emission by this.
    EmissionScale(f32),
    /// Let the exposure follow the light.
    AutoExposure,
    /// The other tone map.
    ToggleToneMap,
    /// Element edges on or off.
    ToggleEdges,
    /// Cluster boxes on or off.
    ToggleClusters,
    /// Links of what is selected on or off.
    ToggleLinks,
    /// Larger or smaller cluster boxes.
    ClusterLevelBy(i32),
    /// Backs of one-sided faces on or off.
    ToggleBacks,
    /// The view at rest sharpened to a traced picture, or not.
    ToggleTraced,
    /// Show gloss where light at vertices is drawn, or not.
    ToggleGloss,
    /// Walls before the inside of a room drawn, or not.
    ToggleSeeThrough,
    /// The view that the scene opened with.
    FirstLook,
    /// Show the whole scene.
    FrameAll,
    /// Show the selected object or cluster.
    FrameSelected,
    /// Look along an axis.
    LookFrom(AxisView),
    /// Keep the camera as a bookmark.
    AddBookmark,
    /// The camera of a bookmark.
    GoTo(usize),
    /// Forget a bookmark.
    RemoveBookmark(usize),
    /// Copy the camera as flags of the command line.
    CopyCamera,
    /// Ask the system for the text that was copied last.
    RequestPaste,
    /// The camera that a text describes by such flags.
    PasteCamera(String),
    /// Parallel or central projection.
    ToggleProjection,
    /// Which axis is up.
    Up(UpAxis),
    /// Select nothing.
    ClearSelection,
    /// Select a cluster.
    SelectCluster(usize),
    /// Save the window as a picture.
    ScreenshotWithWindow,
    /// Save the viewport as a picture.
    Screenshot,
    /// Ask for size and place of a picture.
    PictureDialog,
    /// Save a picture of a size in pixels.
    SavePicture {
        /// Where to; the ending names the format.
        path: PathBuf,
        /// Width and height.
        size: [u32; 2],
        /// Whether the background is omitted.
        is_transparent: bool,
    },
    /// Ask where the lit mesh is to go.
    MeshDialog,
    /// Write the lit mesh; the ending names the format.
    SaveMesh(PathBuf),
    /// Write lights and materials as an MTL file beside the scene.
    SaveMaterials,
    /// Write settings and camera beside the scene.
    SaveSidecar,
    /// Panels on or off.
    TogglePanels,
    /// Panels, their sizes and the size of text as at first.
    ResetLayout,
    /// Text and panels larger or smaller.
    Scale(Scale),
    /// Whole screen on or off.
    ToggleFullScreen,
    /// The key sheet on or off.
    ToggleHelp,
    /// Forget the list of recent files.
    ClearRecent,
    /// Close the window.
    Quit,
}

/// How large text and panels are to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// A step larger.
    Larger,
    /// A step smaller.
    Smaller,
    /// As at first.
    Whole,
}
