//! Pictures of a snapshot: surfaces and lines into a linear target, then one tone-mapping pass to display colours; beside
//! them the small pictures of luminance that automatic exposure is taken from.
//!
//! The same code draws the window's viewport, screenshots and headless pictures. Buffers are uploaded only when the
//! `Arc` they come from changes, so that a still picture costs nothing.

mod cutout;
mod detail;
mod gloss;
mod line_pass;
mod mesh_pass;
mod meter;
mod readback;
mod sky_pass;
mod target;
mod tonemap_pass;
mod uniforms;
mod uploads;

use std::sync::{Arc, OnceLock};

use glam::{Vec3, Vec4};

pub use cutout::{Cutout, CutoutTarget};
pub use meter::{Metered, Metering};
pub use readback::ReadError;
pub use target::Target;
pub use uploads::{Source, Uploads};

use super::{
    camera::Camera,
    first_look::Interior,
    view::{ViewMode, ViewSettings},
};
use crate::{
    picture::GlossLight,
    scene::{Scene, Sky, SkyPicture},
    solver::{DisplayMesh, VertexLight},
};
use detail::DetailSet;
use line_pass::LinePass;
use mesh_pass::MeshPass;
use meter::MeterTarget;
use sky_pass::SkyPass;
use tonemap_pass::TonemapPass;
use uniforms::ViewUniforms;

/// Format of the linear picture where the adapter can draw into it.
const LINEAR_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
/// Format of the display picture, already sRGB-encoded: the GL fallback has no views of another format.
const DISPLAY_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Why a picture cannot be drawn.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RenderError {
    /// A buffer of the mesh is larger than the adapter takes.
    #[error(
        "the mesh needs a buffer of {needed_mib} MiB and this graphics adapter takes {limit_mib}; raise the smallest element area, or the mesh tolerance, and restart"
    )]
    MeshTooLarge {
        /// Size of the largest buffer.
        needed_mib: u64,
        /// The limit of the adapter.
        limit_mib: u64,
    },
    /// The picture has more pixels on a side than the adapter takes.
    #[error(
        "a picture of {width} × {height} pixels is too large for this graphics adapter, which takes {limit} on a side"
    )]
    PictureTooLarge {
        /// Width asked for.
        width: u32,
        /// Height asked for.
        height: u32,
        /// The limit of the adapter, for a side.
        limit: u32,
    },
}

/// A device, and what pictures may assume of it. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Gpu {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// Name, kind and backend of the adapter, for people.
    pub adapter_name: String,
    /// Samples a pixel.
    pub sample_count: u32,
    /// Samples a pixel where time does not matter.
    pub most_samples: u32,
    /// Whether shaders can read the samples of a pixel.
    pub has_readable_samples: bool,
    /// Format of the linear picture.
    pub linear_format: wgpu::TextureFormat,
    /// Largest buffer to make, in bytes; at most what the adapter takes.
    pub max_buffer_size: u64,
    /// The first error of a device without a window; the window listens to its device by itself.
    pub complaint: Arc<OnceLock<String>>,
}

impl Gpu {
    /// Capabilities of an adapter's device.
    pub fn new(adapter: &wgpu::Adapter, device: wgpu::Device, queue: wgpu::Queue) -> Self {
        let about = adapter.get_info();
        let features = adapter.get_texture_format_features(LINEAR_FORMAT);
        let drawable = features
            .allowed_usages
            .contains(wgpu::TextureUsages::RENDER_ATTACHMENT);
        let multisampled = features.flags.sample_count_supported(4)
            && features
                .flags
                .contains(wgpu::TextureFormatFeatureFlags::MULTISAMPLE_RESOLVE);
        let most_samples = if multisampled && drawable { 4 } else { 1 };
        // GL reads samples from version 3.1 on, which also brought these.
        let downlevel = adapter.get_downlevel_capabilities().flags;
        // A processor that plays adapter takes twice as long for four samples.
        let is_slow = about.device_type == wgpu::DeviceType::Cpu;
        Self {
            max_buffer_size: device.limits().max_buffer_size,
            complaint: Arc::default(),
            device,
            queue,
            adapter_name: format!(
                "{} ({:?}, {})",
                about.name, about.device_type, about.backend
            ),
            sample_count: if is_slow { 1 } else { most_samples },
            most_samples,
            has_readable_samples: about.backend != wgpu::Backend::Gl
                || downlevel.contains(wgpu::DownlevelFlags::COMPUTE_SHADERS),
            linear_format: if drawable {
                LINEAR_FORMAT
            } else {
                DISPLAY_FORMAT
            },
        }
    }

    /// The limits of a device: the defaults that every adapter has, and buffers as large as this one takes.
    pub fn device_descriptor(adapter: &wgpu::Adapter) -> wgpu::DeviceDescriptor<'static> {
        let offered = adapter.limits();
        let base = if adapter.get_info().backend == wgpu::Backend::Gl {
            wgpu::Limits::downlevel_webgl2_defaults()
        } else {
            wgpu::Limits::downlevel_defaults()
        };
        wgpu::DeviceDescriptor {
            label: Some("vecrad"),
            required_limits: wgpu::Limits {
                max_buffer_size: offered.max_buffer_size,
                max_texture_dimension_2d: offered.max_texture_dimension_2d,
                ..base
            },
            ..Default::default()
        }
    }

    /// Whether pixels have several samples, and shaders read them.
    fn reads_samples(&self) -> bool {
        self.sample_count > 1 && self.has_readable_samples
    }

    /// A buffer with these contents. Written through the queue: a buffer that is mapped to begin with cannot be had
    /// from a lost device.
    fn buffer(&self, label: &str, contents: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: contents.len() as u64,
            usage: usage | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        self.queue.write_buffer(&buffer, 0, contents);
        buffer
    }

    /// Largest picture on a side.
    pub fn max_picture_side(&self) -> u32 {
        self.device.limits().max_texture_dimension_2d
    }
}

/// One box of the overlay: lower corner, upper corner, display-linear colour.
pub type BoxInstance = [f32; 9];
/// One segment of the overlay: start, end, display-linear colour, 1 for an arrowhead.
pub type SegmentInstance = [f32; 10];

/// Lines over the surfaces; uploaded when an `Arc` changes.
#[derive(Clone, Debug, Default)]
pub struct Overlay {
    /// Thin boxes.
    pub boxes: Arc<Vec<BoxInstance>>,
    /// Ribbons and arrows.
    pub segments: Arc<Vec<SegmentInstance>>,
}

/// All that a picture shows.
pub struct Picture<'a> {
    /// Materials and textures.
    pub scene: &'a Arc<Scene>,
    /// The mesh.
    pub mesh: &'a Arc<DisplayMesh>,
    /// Its light.
    pub light: &'a Arc<VertexLight>,
    /// Errors at its vertices in per cent, for the modes that show them, where they are known.
    pub errors: Option<&'a Arc<Vec<f32>>>,
    /// What gloss reflects at its vertices, where that is known.
    pub gloss: Option<&'a Arc<GlossLight>>,
    /// From where.
    pub camera: &'a Camera,
    /// How.
    pub view: &'a ViewSettings,
    /// Whether there is no light yet: light modes then show the surfaces as they are.
    pub is_unlit: bool,
    /// Ends of the false colours.
    pub range: [f32; 2],
    /// The room, where the scene is one.
    pub interior: Option<Interior>,
    /// Lines on top.
    pub overlay: &'a Overlay,
    /// Display-linear colour behind everything.
    pub background: Vec3,
    /// Pixels a point, for the width of lines.
    pub pixels_per_point: f32,
}

impl<'a> Picture<'a> {
    /// The room that is looked into from outside, so that what stands before it is not drawn.
    fn room_looked_into(&self) -> Option<Interior> {
        let is_looked_into = |room: &Interior| room.is_looked_into(self.camera, self.view);
        self.interior.filter(is_looked_into)
    }

    /// Factor on light, exposure included.
    fn light_factor(&self) -> f32 {
        self.view.exposure_factor() * self.view.light_factor().max(f32::MIN_POSITIVE)
    }

    /// Whether gloss is added to surfaces.
    fn shows_gloss(&self) -> bool {
        self.view.shows_gloss() && !self.is_unlit
    }

    /// The sky where it is seen: one that was asked for, as radiance.
    fn sky(&self) -> &Sky {
        let environment = &self.scene.environment;
        match self.view.mode == ViewMode::Radiance && !environment.is_default {
            true => &environment.sky,
            false => &Sky::Dark,
        }
    }

    /// The picture of the sky where it is seen.
    fn sky_picture(&self) -> Option<&SkyPicture> {
        match self.sky() {
            Sky::Picture(picture) => Some(picture),
            Sky::Dark | Sky::Uniform(_) => None,
        }
    }

    /// What is seen where neither a surface nor a picture of the sky is: the light of a uniform sky, else the background.
    /// Alpha says whether it is light.
    fn backdrop(&self) -> Vec4 {
        match self.sky() {
            Sky::Uniform(radiance) => (*radiance * self.light_factor()).extend(1.0),
            Sky::Dark | Sky::Picture(_) => self.background.extend(0.0),
        }
    }

    /// The source of its uploads.
    fn source(&self) -> Source<'a> {
        Source {
            scene: self.scene,
            mesh: self.mesh,
            light: self.light,
            errors: self.errors,
            gloss: self.gloss,
            mode: self.view.mode,
            edges: self.view.edges,
            boxes: &self.overlay.boxes,
        }
    }
}

/// Draws pictures with one device.
pub struct Renderer {
    gpu: Gpu,
    uniforms: ViewUniforms,
    sky_pass: SkyPass,
    mesh_pass: MeshPass,
    line_pass: LinePass,
    tonemap_pass: TonemapPass,
    uploads: Uploads,
}

impl Renderer {
    /// Build the pipelines.
    pub fn new(gpu: Gpu) -> Self {
        let uniforms = ViewUniforms::new(&gpu.device);
        let details = DetailSet::new(&gpu);
        Self {
            sky_pass: SkyPass::new(&gpu, uniforms.layout()),
            mesh_pass: MeshPass::new(&gpu, uniforms.layout(), &details),
            line_pass: LinePass::new(&gpu, uniforms.layout()),
            tonemap_pass: TonemapPass::new(&gpu, uniforms.layout()),
            uploads: Uploads::new(details),
            uniforms,
            gpu,
        }
    }

    /// The device.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// The uploads of this renderer, as a start for another thread.
    pub fn uploads(&self) -> Uploads {
        self.uploads.clone()
    }

    /// Upload a picture and draw it into a target.
    ///
    /// # Errors
    /// [`RenderError::MeshTooLarge`]; the target then holds the background.
    pub fn render(&mut self, target: &Target, picture: &Picture<'_>) -> Result<(), RenderError> {
        self.renew(picture, |renderer, uploads| {
            renderer.draw(target, picture, uploads);
        })
    }

    /// Upload a picture, and draw it as an exposure meter sees it; `size` is that of the picture.
    ///
    /// # Errors
    /// [`RenderError::MeshTooLarge`].
    pub fn measure(
        &mut self,
        size: [u32; 2],
        picture: &Picture<'_>,
    ) -> Result<Metering, RenderError> {
        self.renew(picture, |renderer, uploads| {
            renderer.meter(size, picture, uploads)
        })
    }

    /// Upload a picture and draw it without its background.
    ///
    /// # Errors
    /// [`RenderError::MeshTooLarge`]; the target is then empty but for lines.
    pub fn render_cutout(
        &mut self,
        target: &CutoutTarget,
        picture: &Picture<'_>,
    ) -> Result<(), RenderError> {
        self.renew(picture, |renderer, uploads| {
            renderer.draw_cutout(target, picture, uploads);
        })
    }

    /// Upload a picture, and draw with what was uploaded.
    fn renew<T>(
        &mut self,
        picture: &Picture<'_>,
        draw: impl FnOnce(&mut Self, &Uploads) -> T,
    ) -> Result<T, RenderError> {
        // Taken out, so that no buffer exists twice while the next is made.
        let empty = Uploads::new(self.uploads.details().clone());
        let mut uploads = std::mem::replace(&mut self.uploads, empty);
        let result = uploads.renew(&self.gpu, &picture.source());
        let drawn = draw(self, &uploads);
        self.uploads = uploads;
        result.map(|()| drawn)
    }

    /// Draw a picture of what was uploaded for it.
    pub fn draw(&mut self, target: &Target, picture: &Picture<'_>, uploads: &Uploads) {
        let sky = picture.sky_picture().map(|sky| &sky.picture);
        self.sky_pass.prepare(&self.gpu, sky);
        let mut encoder = self.begin(target.size(), picture);
        self.draw_linear(&mut encoder, target, None, picture, uploads);
        // Turn it into display colours.
        {
            let mut pass = target.begin_display(&mut encoder);
            pass.set_bind_group(0, self.uniforms.bind_group(), &[]);
            self.tonemap_pass.draw(&self.gpu, &mut pass, target);
        }
        self.gpu.queue.submit([encoder.finish()]);
    }

    /// Draw a picture of what was uploaded for it, without its background.
    pub fn draw_cutout(&mut self, target: &CutoutTarget, picture: &Picture<'_>, uploads: &Uploads) {
        let mut encoder = self.begin(target.over_nothing.size(), picture);
        for (target, background) in [
            (&target.over_nothing, Vec4::ZERO),
            (&target.over_light, Vec4::W),
        ] {
            self.draw_linear(&mut encoder, target, Some(background), picture, uploads);
        }
        {
            let mut pass = target.over_nothing.begin_display(&mut encoder);
            pass.set_bind_group(0, self.uniforms.bind_group(), &[]);
            self.tonemap_pass.draw_cutout(&self.gpu, &mut pass, target);
        }
        self.gpu.queue.submit([encoder.finish()]);
    }

    /// Draw a picture of what was uploaded for it as an exposure meter sees it; `size` is that of the picture.
    pub fn meter(&mut self, size: [u32; 2], picture: &Picture<'_>, uploads: &Uploads) -> Metering {
        let target = MeterTarget::new(&self.gpu, size);
        let mut encoder = self.begin(size, picture);
        {
            let mut pass = target.begin(&mut encoder);
            pass.set_bind_group(0, self.uniforms.bind_group(), &[]);
            let cuts = picture.room_looked_into().is_some();
            self.mesh_pass
                .draw_meter(&mut pass, uploads, picture.view, cuts);
        }
        self.gpu.queue.submit([encoder.finish()]);
        Metering::begin(&self.gpu, &target)
    }

    /// Hand over what changes with every picture.
    fn begin(&mut self, size: [u32; 2], picture: &Picture<'_>) -> wgpu::CommandEncoder {
        self.line_pass.prepare(&self.gpu, &picture.overlay.segments);
        self.uniforms.write(&self.gpu.queue, size, picture);
        self.gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor {
                label: Some("picture"),
            })
    }

    /// Draw surfaces and lines into the linear picture, over this background or the picture's own.
    fn draw_linear(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        target: &Target,
        background: Option<Vec4>,
        picture: &Picture<'_>,
        uploads: &Uploads,
    ) {
        let backdrop = background.unwrap_or_else(|| picture.backdrop());
        let mut pass = target.begin_linear(encoder, backdrop);
        pass.set_bind_group(0, self.uniforms.bind_group(), &[]);
        if background.is_none() {
            self.sky_pass.draw(&mut pass);
        }
        let cuts = picture.room_looked_into().is_some();
        let shows_gloss = picture.shows_gloss();
        self.mesh_pass
            .draw(&mut pass, uploads, picture.view, cuts, shows_gloss);
        self.line_pass.draw(&mut pass, uploads.boxes());
    }
}
