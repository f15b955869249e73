//! Pictures without a window: the same passes on a device of their own.

use std::{path::Path, sync::Arc};

use glam::Vec3;
use image::{DynamicImage, Rgb32FImage, RgbaImage};

use super::{
    camera::Camera,
    cluster_lines, clusters, exposure,
    first_look::Interior,
    light_range,
    picture_file::{self, EncodeError},
    render::{
        Cutout, CutoutTarget, Gpu, Overlay, Picture, ReadError, RenderError, Renderer, Target,
    },
    stage::estimated_errors,
    theme,
    view::{ViewMode, ViewSettings},
};
use crate::{
    geometry::RayTree,
    picture::{GlossLight, gloss_at_vertices},
    scene::Scene,
    solver::{Cancel, Snapshot},
};

/// Why there is no headless picture.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum HeadlessError {
    /// Nothing can draw.
    #[error(
        "no graphics adapter was found ({0}); install a Vulkan driver (on Debian: mesa-vulkan-drivers libvulkan1), or try WGPU_BACKEND=gl"
    )]
    NoAdapter(String),
    /// Too large for the adapter.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// More than the adapter has memory for, or something else that it does not say in advance.
    #[error("this graphics adapter cannot hold the picture ({0}); choose a smaller --size")]
    Refused(String),
    /// It did not come back.
    #[error(transparent)]
    Read(#[from] ReadError),
}

/// A picture, as display colours and as radiance.
pub struct HeadlessPicture {
    /// Tone-mapped and sRGB-encoded.
    pub display: RgbaImage,
    /// Linear radiance; empty where the adapter cannot draw it.
    pub radiance: Option<Rgb32FImage>,
}

impl HeadlessPicture {
    /// The bytes of a file of this name; `.exr` takes the radiance, anything else the display colours.
    ///
    /// # Errors
    /// See [`EncodeError`].
    pub fn encode(self, path: &Path) -> Result<Vec<u8>, EncodeError> {
        let display = DynamicImage::from(self.display).into_rgb8();
        picture_file::encode(display.into(), self.radiance.map(DynamicImage::from), path)
    }
}

/// The subject of a picture: a scene under a snapshot's light.
#[derive(Clone, Copy)]
pub struct Subject<'a> {
    /// The scene.
    pub scene: &'a Arc<Scene>,
    /// Its mesh, light and clusters.
    pub snapshot: &'a Snapshot,
    /// Errors measured at its vertices, for the mode that shows them.
    pub errors: Option<&'a Arc<Vec<f32>>>,
    /// The room, where the scene is one.
    pub interior: Option<Interior>,
    /// Whether no light reaches what it shows first: under automatic exposure surfaces are shown instead.
    pub is_dark: bool,
}

impl Subject<'_> {
    /// Whether there is no light to show.
    pub(super) fn is_unlit(&self, view: &ViewSettings) -> bool {
        !self.snapshot.is_lit() || (self.is_dark && view.auto_exposure)
    }

    /// What gloss reflects, where that is shown.
    fn gloss(&self, view: &ViewSettings) -> Option<Arc<GlossLight>> {
        let (scene, snapshot) = (self.scene, self.snapshot);
        if !view.shows_gloss() || !scene.has_specular() || self.is_unlit(view) {
            return None;
        }
        let rays = RayTree::new(scene);
        gloss_at_vertices(scene, &rays, snapshot, &Cancel::default()).map(Arc::new)
    }
}

/// A device of one's own.
///
/// # Errors
/// [`HeadlessError::NoAdapter`].
pub fn open_gpu() -> Result<Gpu, HeadlessError> {
    let none = |error: &dyn std::fmt::Display| HeadlessError::NoAdapter(error.to_string());
    let instance =
        wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
    let options = wgpu::RequestAdapterOptions::default();
    let adapter =
        pollster::block_on(instance.request_adapter(&options)).map_err(|error| none(&error))?;
    let (device, queue) =
        pollster::block_on(adapter.request_device(&Gpu::device_descriptor(&adapter)))
            .map_err(|error| none(&error))?;
    let gpu = Gpu::new(&adapter, device, queue);
    // Unheard, a complaint would end the program.
    let complaint = gpu.complaint.clone();
    gpu.device
        .on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            let _ = complaint.set(error.to_string().replace('\n', " "));
        }));
    // Nobody waits for the next frame.
    let sample_count = gpu.most_samples;
    Ok(Gpu {
        sample_count,
        ..gpu
    })
}

/// Try whether there is an adapter that takes a picture of this size in pixels; without its background it takes twice the
/// memory.
///
/// # Errors
/// See [`HeadlessError`].
pub fn check(size: [u32; 2], is_cutout: bool) -> Result<(), HeadlessError> {
    let gpu = open_gpu()?;
    if is_cutout {
        CutoutTarget::new(&gpu, size).map(drop)?;
    } else {
        Target::new(&gpu, size).map(drop)?;
    }
    match gpu.complaint.get() {
        None => Ok(()),
        Some(complaint) => Err(HeadlessError::Refused(complaint.clone())),
    }
}

/// Draw a snapshot at a size in pixels. Automatic exposure is taken from the pixels and ranges from the light, as in the
/// window.
///
/// # Errors
/// See [`HeadlessError`].
pub fn picture(
    subject: Subject<'_>,
    camera: &Camera,
    view: &ViewSettings,
    size: [u32; 2],
) -> Result<HeadlessPicture, HeadlessError> {
    let mut renderer = Renderer::new(open_gpu()?);
    let target = Target::new(renderer.gpu(), size)?;
    let view = exposed(&mut renderer, subject, camera, view, size)?;
    let exposure_factor = view.exposure_factor() / subject.scene.radiance_unit;
    let gloss = subject.gloss(&view);
    with_picture(subject, gloss.as_ref(), camera, &view, |picture| {
        renderer.render(&target, picture)
    })?;
    Ok(HeadlessPicture {
        display: target.read_display(renderer.gpu())?,
        radiance: target.read_linear(renderer.gpu(), exposure_factor).ok(),
    })
}

/// Draw a snapshot as [`picture`] does, without the background.
///
/// # Errors
/// See [`HeadlessError`].
pub fn cutout(
    subject: Subject<'_>,
    camera: &Camera,
    view: &ViewSettings,
    size: [u32; 2],
) -> Result<Cutout, HeadlessError> {
    let mut renderer = Renderer::new(open_gpu()?);
    let target = CutoutTarget::new(renderer.gpu(), size)?;
    let view = exposed(&mut renderer, subject, camera, view, size)?;
    let exposure_factor = view.exposure_factor() / subject.scene.radiance_unit;
    let gloss = subject.gloss(&view);
    with_picture(subject, gloss.as_ref(), camera, &view, |picture| {
        renderer.render_cutout(&target, picture)
    })?;
    Ok(target.read(renderer.gpu(), exposure_factor)?)
}

/// A view with the exposure that the picture asks for, where it is automatic.
fn exposed(
    renderer: &mut Renderer,
    subject: Subject<'_>,
    camera: &Camera,
    view: &ViewSettings,
    size: [u32; 2],
) -> Result<ViewSettings, HeadlessError> {
    let mut view = view.clone();
    if view.auto_exposure && view.mode.is_light() && !subject.is_unlit(&view) {
        let metering = with_picture(subject, None, camera, &view, |picture| {
            renderer.measure(size, picture)
        })?;
        let metered = metering.wait(renderer.gpu())?;
        view.exposure = exposure::of(&metered).unwrap_or(view.exposure);
    }
    Ok(view)
}

/// Describe the picture, and draw it.
fn with_picture<T>(
    subject: Subject<'_>,
    gloss: Option<&Arc<GlossLight>>,
    camera: &Camera,
    view: &ViewSettings,
    draw: impl FnOnce(&Picture<'_>) -> Result<T, RenderError>,
) -> Result<T, RenderError> {
    let Subject {
        scene,
        snapshot,
        errors,
        interior,
        ..
    } = subject;
    let estimated = (view.mode == ViewMode::EstimatedError)
        .then(|| estimated_errors(snapshot))
        .flatten();
    let errors = errors.or(estimated.as_ref());
    let shown = clusters::shown(&snapshot.clusters, &view.clusters);
    let boxes = cluster_lines::boxes(&snapshot.clusters, &shown, &view.clusters);
    let overlay = Overlay {
        boxes: Arc::new(boxes.instances),
        segments: Arc::default(),
    };
    draw(&Picture {
        scene,
        mesh: &snapshot.mesh,
        light: &snapshot.light,
        errors,
        gloss,
        camera,
        is_unlit: subject.is_unlit(view),
        range: light_range::false_color_range(
            snapshot,
            view,
            errors.map(|errors| errors.as_slice()),
        ),
        view,
        interior,
        overlay: &overlay,
        background: Vec3::splat(theme::PICTURE_BACKGROUND),
        pixels_per_point: 1.0,
    })
}
