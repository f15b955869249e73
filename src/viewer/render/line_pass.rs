//! Lines over the surfaces: boxes by the hundred thousand as instances, and segments as ribbons or arrows.

use std::sync::Arc;

use super::{BoxInstance, DEPTH_FORMAT, Gpu, SegmentInstance};

/// Vertices of a box: two ends for each of twelve edges.
const BOX_VERTICES: u32 = 24;
/// Vertices of a segment: two triangles of the ribbon, one of the arrowhead.
const SEGMENT_VERTICES: u32 = 9;

/// Pipelines, and the buffer of the segments.
pub(super) struct LinePass {
    box_pipeline: wgpu::RenderPipeline,
    segment_pipeline: wgpu::RenderPipeline,
    segments: Instances<SegmentInstance>,
}

impl LinePass {
    /// Build the pipelines.
    pub(super) fn new(gpu: &Gpu, view_layout: &wgpu::BindGroupLayout) -> Self {
        let module = gpu
            .device
            .create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some("lines"),
                source: wgpu::ShaderSource::Wgsl(
                    concat!(include_str!("view.wgsl"), include_str!("line_pass.wgsl")).into(),
                ),
            });
        let layout = gpu
            .device
            .create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some("lines"),
                bind_group_layouts: &[Some(view_layout)],
                immediate_size: 0,
            });
        let build = |label, entry_point, is_ribbon, stride: usize, attributes: &[_]| {
            pipeline(
                gpu,
                &layout,
                &module,
                label,
                entry_point,
                is_ribbon,
                wgpu::VertexBufferLayout {
                    array_stride: stride as u64,
                    step_mode: wgpu::VertexStepMode::Instance,
                    attributes,
                },
            )
        };
        let box_pipeline = build(
            "boxes",
            "vs_box",
            false,
            size_of::<BoxInstance>(),
            &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x3],
        );
        let segment_pipeline = build(
            "segments",
            "vs_segment",
            true,
            size_of::<SegmentInstance>(),
            &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x3, 3 => Float32],
        );
        Self {
            box_pipeline,
            segment_pipeline,
            segments: Instances::default(),
        }
    }

    /// Upload the segments, which are few, where they changed.
    pub(super) fn prepare(&mut self, gpu: &Gpu, segments: &Arc<Vec<SegmentInstance>>) {
        self.segments.prepare(gpu, "segments", segments);
    }

    /// Draw; group 0 is set.
    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>, boxes: &Instances<BoxInstance>) {
        pass.set_pipeline(&self.box_pipeline);
        boxes.draw(pass, BOX_VERTICES);
        pass.set_pipeline(&self.segment_pipeline);
        self.segments.draw(pass, SEGMENT_VERTICES);
    }
}

/// Instances as they were last uploaded.
#[derive(Clone)]
pub(super) struct Instances<T> {
    uploaded: Arc<Vec<T>>,
    buffer: Option<wgpu::Buffer>,
    count: u32,
}

impl<T> Default for Instances<T> {
    fn default() -> Self {
        Self {
            uploaded: Arc::default(),
            buffer: None,
            count: 0,
        }
    }
}

impl<T: bytemuck::NoUninit> Instances<T> {
    /// Upload others.
    pub(super) fn prepare(&mut self, gpu: &Gpu, label: &str, instances: &Arc<Vec<T>>) {
        if Arc::ptr_eq(&self.uploaded, instances) {
            return;
        }
        self.uploaded = instances.clone();
        // More than the adapter takes at once are omitted, the last first.
        let fitting = (gpu.max_buffer_size as usize / size_of::<T>()).min(instances.len());
        let shown = &instances[..fitting];
        self.count = shown.len() as u32;
        self.buffer = (!shown.is_empty()).then(|| {
            gpu.buffer(
                label,
                bytemuck::cast_slice(shown),
                wgpu::BufferUsages::VERTEX,
            )
        });
    }

    fn draw(&self, pass: &mut wgpu::RenderPass<'_>, vertex_count: u32) {
        if let Some(buffer) = &self.buffer {
            pass.set_vertex_buffer(0, buffer.slice(..));
            pass.draw(0..vertex_count, 0..self.count);
        }
    }
}

fn pipeline(
    gpu: &Gpu,
    layout: &wgpu::PipelineLayout,
    module: &wgpu::ShaderModule,
    label: &str,
    entry_point: &str,
    is_ribbon: bool,
    instances: wgpu::VertexBufferLayout<'_>,
) -> wgpu::RenderPipeline {
    gpu.device
        .create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(label),
            layout: Some(layout),
            vertex: wgpu::VertexState {
                module,
                entry_point: Some(entry_point),
                compilation_options: Default::default(),
                buffers: &[Some(instances)],
            },
            primitive: wgpu::PrimitiveState {
                topology: if is_ribbon {
                    wgpu::PrimitiveTopology::TriangleList
                } else {
                    wgpu::PrimitiveTopology::LineList
                },
                ..Default::default()
            },
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH_FORMAT,
                depth_write_enabled: Some(!is_ribbon),
                // The selection shows through everything.
                depth_compare: Some(if is_ribbon {
                    wgpu::CompareFunction::Always
                } else {
                    wgpu::CompareFunction::GreaterEqual
                }),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: wgpu::MultisampleState {
                count: gpu.sample_count,
                ..Default::default()
            },
            fragment: Some(wgpu::FragmentState {
                module,
                entry_point: Some("fs_main"),
                compilation_options: Default::default(),
                targets: &[Some(gpu.linear_format.into())],
            }),
            multiview_mask: None,
            cache: None,
        })
}
