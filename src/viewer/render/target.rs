//! Targets of pictures: a linear picture with depth, and the display picture that is made of it.

use glam::Vec4;

use super::{DEPTH_FORMAT, DISPLAY_FORMAT, Gpu, RenderError};

/// Textures of one size.
pub struct Target {
    size: [u32; 2],
    linear: wgpu::Texture,
    linear_view: wgpu::TextureView,
    multisampled_view: Option<wgpu::TextureView>,
    /// Whether the tone mapping reads the samples.
    keeps_samples: bool,
    depth_view: wgpu::TextureView,
    display: wgpu::Texture,
    display_view: wgpu::TextureView,
}

impl Target {
    /// Textures of a size in pixels, at least 1 × 1.
    ///
    /// # Errors
    /// [`RenderError::PictureTooLarge`] for more than the adapter takes.
    pub fn new(gpu: &Gpu, [width, height]: [u32; 2]) -> Result<Self, RenderError> {
        let limit = gpu.max_picture_side();
        if width.max(height) > limit {
            return Err(RenderError::PictureTooLarge {
                width,
                height,
                limit,
            });
        }
        let size = [width.max(1), height.max(1)];
        let readable = wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_SRC;
        let drawn = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let linear = texture(gpu, "linear picture", size, gpu.linear_format, 1, readable);
        let display = texture(gpu, "display picture", size, DISPLAY_FORMAT, 1, readable);
        let samples = gpu.sample_count;
        let keeps_samples = gpu.reads_samples();
        let sampled = match keeps_samples {
            true => drawn | wgpu::TextureUsages::TEXTURE_BINDING,
            false => drawn,
        };
        let multisampled = (samples > 1)
            .then(|| texture(gpu, "samples", size, gpu.linear_format, samples, sampled));
        let depth = texture(gpu, "depth", size, DEPTH_FORMAT, samples, drawn);
        let whole = wgpu::TextureViewDescriptor::default();
        Ok(Self {
            size,
            keeps_samples,
            linear_view: linear.create_view(&whole),
            multisampled_view: multisampled.map(|texture| texture.create_view(&whole)),
            depth_view: depth.create_view(&whole),
            display_view: display.create_view(&whole),
            linear,
            display,
        })
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The display picture, for egui.
    pub fn display_view(&self) -> &wgpu::TextureView {
        &self.display_view
    }

    /// The display picture, for reading back.
    pub(super) fn display(&self) -> &wgpu::Texture {
        &self.display
    }

    /// The linear picture, for reading back.
    pub(super) fn linear(&self) -> &wgpu::Texture {
        &self.linear
    }

    /// The picture for tone mapping: its samples, where they are kept.
    pub(super) fn tone_mapped_view(&self) -> &wgpu::TextureView {
        let samples = self.multisampled_view.as_ref();
        let samples = samples.filter(|_| self.keeps_samples);
        samples.unwrap_or(&self.linear_view)
    }

    /// Begin drawing surfaces and lines over a background, whose alpha says whether it is light.
    pub(super) fn begin_linear<'e>(
        &self,
        encoder: &'e mut wgpu::CommandEncoder,
        background: Vec4,
    ) -> wgpu::RenderPass<'e> {
        let (view, resolve_target, store) = match &self.multisampled_view {
            Some(samples) if self.keeps_samples => {
                (samples, Some(&self.linear_view), wgpu::StoreOp::Store)
            }
            Some(samples) => (samples, Some(&self.linear_view), wgpu::StoreOp::Discard),
            None => (&self.linear_view, None, wgpu::StoreOp::Store),
        };
        let [r, g, b, a] = background.to_array().map(f64::from);
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("linear picture"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view,
                resolve_target,
                depth_slice: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a }),
                    store,
                },
            })],
            depth_stencil_attachment: Some(depth_attachment(&self.depth_view)),
            ..Default::default()
        })
    }

    /// Begin the tone mapping.
    pub(super) fn begin_display<'e>(
        &self,
        encoder: &'e mut wgpu::CommandEncoder,
    ) -> wgpu::RenderPass<'e> {
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("display picture"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.display_view,
                resolve_target: None,
                depth_slice: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..Default::default()
        })
    }
}

/// Depths that are needed only while a picture is drawn, infinitely far to begin with.
pub(super) fn depth_attachment(
    view: &wgpu::TextureView,
) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations {
            load: wgpu::LoadOp::Clear(0.0),
            store: wgpu::StoreOp::Discard,
        }),
        stencil_ops: None,
    }
}

pub(super) fn texture(
    gpu: &Gpu,
    label: &str,
    [width, height]: [u32; 2],
    format: wgpu::TextureFormat,
    sample_count: u32,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}
