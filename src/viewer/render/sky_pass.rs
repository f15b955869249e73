//! The picture of the sky behind everything.

use std::sync::Arc;

use super::{DEPTH_FORMAT, Gpu};
use crate::scene::Texture;

/// Most pixels of the picture on the adapter, at 16 bytes each. Fewer blur what is seen of it in a large window, more take
/// memory and time to upload.
const MOST_PIXELS: usize = 1 << 23;

/// The pipeline, and the picture that was drawn last.
pub(super) struct SkyPass {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::RenderPipeline,
    uploaded: Option<(Arc<Texture>, wgpu::BindGroup)>,
}

impl SkyPass {
    /// Build the pipeline.
    pub(super) fn new(gpu: &Gpu, view_layout: &wgpu::BindGroupLayout) -> Self {
        let device = &gpu.device;
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("sky"),
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::FRAGMENT,
                ty: wgpu::BindingType::Texture {
                    sample_type: wgpu::TextureSampleType::Float { filterable: false },
                    view_dimension: wgpu::TextureViewDimension::D2,
                    multisampled: false,
                },
                count: None,
            }],
        });
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("sky"),
            source: wgpu::ShaderSource::Wgsl(
                concat!(include_str!("view.wgsl"), include_str!("sky_pass.wgsl")).into(),
            ),
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("sky"),
            bind_group_layouts: &[Some(view_layout), Some(&layout)],
            immediate_size: 0,
        });
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("sky"),
            layout: Some(&pipeline_layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vs_main"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            // Drawn first, so that all else lies before it.
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH_FORMAT,
                depth_write_enabled: Some(false),
                depth_compare: Some(wgpu::CompareFunction::Always),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: wgpu::MultisampleState {
                count: gpu.sample_count,
                ..Default::default()
            },
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("fs_main"),
                compilation_options: Default::default(),
                targets: &[Some(gpu.linear_format.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        Self {
            layout,
            pipeline,
            uploaded: None,
        }
    }

    /// Upload a picture of the sky, if it is another one than before.
    pub(super) fn prepare(&mut self, gpu: &Gpu, picture: Option<&Arc<Texture>>) {
        let is_current = match (&self.uploaded, picture) {
            (Some((uploaded, _)), Some(picture)) => Arc::ptr_eq(uploaded, picture),
            (uploaded, picture) => uploaded.is_none() && picture.is_none(),
        };
        if !is_current {
            self.uploaded = picture.map(|picture| (picture.clone(), self.upload(gpu, picture)));
        }
    }

    /// Draw what was prepared; group 0 is set.
    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        if let Some((_, picture)) = &self.uploaded {
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(1, picture, &[]);
            pass.draw(0..3, 0..1);
        }
    }

    fn upload(&self, gpu: &Gpu, picture: &Arc<Texture>) -> wgpu::BindGroup {
        let mut most = MOST_PIXELS;
        let mut fitting = picture.clone();
        // Pictures need not be twice as wide as high.
        while fitting.pixels.len() > most
            || fitting.width.max(fitting.height) > gpu.max_picture_side()
        {
            most = most.min(fitting.pixels.len() / 4);
            fitting = Arc::new(Texture::clone(&fitting).reduced_to(most));
        }
        let size = wgpu::Extent3d {
            width: fitting.width,
            height: fitting.height,
            depth_or_array_layers: 1,
        };
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("sky"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let texels: Vec<[f32; 4]> = fitting
            .pixels
            .iter()
            .map(|pixel| pixel.extend(1.0).to_array())
            .collect();
        gpu.queue.write_texture(
            texture.as_image_copy(),
            bytemuck::cast_slice(&texels),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(fitting.width * size_of::<[f32; 4]>() as u32),
                rows_per_image: None,
            },
            size,
        );
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("sky"),
            layout: &self.layout,
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::TextureView(&view),
            }],
        })
    }
}
