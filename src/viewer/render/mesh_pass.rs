//! The lit surfaces: one vertex buffer a quantity, so that a step uploads the light and nothing else.

use super::{DEPTH_FORMAT, Gpu, detail::DetailSet, uploads::Uploads};
use crate::viewer::view::{ViewMode, ViewSettings};

/// Pipelines of the surfaces.
pub(super) struct MeshPass {
    front_pipeline: wgpu::RenderPipeline,
    back_pipeline: wgpu::RenderPipeline,
    edge_pipeline: wgpu::RenderPipeline,
}

impl MeshPass {
    /// Build the pipelines.
    pub(super) fn new(gpu: &Gpu, view_layout: &wgpu::BindGroupLayout, details: &DetailSet) -> Self {
        let module = gpu
            .device
            .create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some("mesh"),
                source: wgpu::ShaderSource::Wgsl(
                    concat!(include_str!("view.wgsl"), include_str!("mesh_pass.wgsl")).into(),
                ),
            });
        let layout = gpu
            .device
            .create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some("mesh"),
                bind_group_layouts: &[Some(view_layout), Some(details.layout())],
                immediate_size: 0,
            });
        let build = |kind| pipeline(gpu, &layout, &module, kind);
        Self {
            front_pipeline: build(Kind::Front),
            back_pipeline: build(Kind::Back),
            edge_pipeline: build(Kind::Edge),
        }
    }

    /// Draw what was uploaded; group 0 is set.
    pub(super) fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        uploads: &Uploads,
        view: &ViewSettings,
    ) {
        let (Some(mesh), Some(light)) = (uploads.mesh(), uploads.light()) else {
            return;
        };
        let details = uploads.details();
        let buffers = [
            &mesh.positions,
            &mesh.normals,
            // Nobody looks at texture coordinates where there are none: any numbers will do.
            mesh.texcoords.as_ref().unwrap_or(&mesh.positions),
            &mesh.reflectance,
            &mesh.emission,
            light,
        ];
        for (slot, buffer) in buffers.into_iter().enumerate() {
            pass.set_vertex_buffer(slot as u32, buffer.slice(..));
        }
        pass.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.set_pipeline(&self.front_pipeline);
        for (range, detail) in &mesh.ranges {
            pass.set_bind_group(1, details.bind_group(*detail), &[]);
            pass.draw_indexed(range.clone(), 0, 0..1);
        }
        if view.backs || view.mode == ViewMode::FaceOrientation {
            pass.set_pipeline(&self.back_pipeline);
            pass.set_bind_group(1, details.bind_group(0), &[]);
            let whole = mesh.ranges.last().map_or(0, |(range, _)| range.end);
            pass.draw_indexed(0..whole, 0, 0..1);
        }
        if let (true, Some((edges, count))) = (shows_edges(view.mode, view.edges), &mesh.edges) {
            pass.set_pipeline(&self.edge_pipeline);
            pass.set_bind_group(1, details.bind_group(0), &[]);
            pass.set_index_buffer(edges.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..*count, 0, 0..1);
        }
    }
}

/// Whether edges are drawn over the light, or in its place.
pub(super) fn shows_edges(mode: ViewMode, edges: bool) -> bool {
    edges || mode == ViewMode::Elements
}

/// What a pipeline draws.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Front,
    Back,
    Edge,
}

fn pipeline(
    gpu: &Gpu,
    layout: &wgpu::PipelineLayout,
    module: &wgpu::ShaderModule,
    kind: Kind,
) -> wgpu::RenderPipeline {
    use wgpu::{BlendComponent, BlendFactor, BlendOperation, PrimitiveTopology};
    let (label, vertex, fragment) = match kind {
        Kind::Front => ("mesh fronts", "vs_main", "fs_main"),
        Kind::Back => ("mesh backs", "vs_main", "fs_back"),
        Kind::Edge => ("mesh edges", "vs_edge", "fs_edge"),
    };
    let attributes = [
        wgpu::vertex_attr_array![0 => Float32x3],
        wgpu::vertex_attr_array![1 => Float32x3],
        wgpu::vertex_attr_array![2 => Float32x2],
        wgpu::vertex_attr_array![3 => Float32x3],
        wgpu::vertex_attr_array![4 => Float32x3],
        wgpu::vertex_attr_array![5 => Float32x3],
    ];
    let layouts = attributes.each_ref().map(|attribute| {
        Some(wgpu::VertexBufferLayout {
            array_stride: attribute[0].format.size(),
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: attribute,
        })
    });
    // Edges darken light and leave it light: alpha says which of the two a pixel is.
    let blend = (kind == Kind::Edge).then_some(wgpu::BlendState {
        color: BlendComponent {
            src_factor: BlendFactor::SrcAlpha,
            dst_factor: BlendFactor::OneMinusSrcAlpha,
            operation: BlendOperation::Add,
        },
        alpha: BlendComponent {
            src_factor: BlendFactor::Zero,
            dst_factor: BlendFactor::One,
            operation: BlendOperation::Add,
        },
    });
    gpu.device
        .create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(label),
            layout: Some(layout),
            vertex: wgpu::VertexState {
                module,
                entry_point: Some(vertex),
                compilation_options: Default::default(),
                buffers: if kind == Kind::Edge {
                    &layouts[..2]
                } else {
                    &layouts
                },
            },
            primitive: wgpu::PrimitiveState {
                topology: if kind == Kind::Edge {
                    PrimitiveTopology::LineList
                } else {
                    PrimitiveTopology::TriangleList
                },
                cull_mode: match kind {
                    Kind::Front => Some(wgpu::Face::Back),
                    Kind::Back => Some(wgpu::Face::Front),
                    Kind::Edge => None,
                },
                ..Default::default()
            },
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH_FORMAT,
                depth_write_enabled: Some(kind != Kind::Edge),
                // Backs come after fronts: where both lie on one plane, as on two-sided faces, the front stays.
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: wgpu::MultisampleState {
                count: gpu.sample_count,
                ..Default::default()
            },
            fragment: Some(wgpu::FragmentState {
                module,
                entry_point: Some(fragment),
                compilation_options: Default::default(),
                targets: &[Some(wgpu::ColorTargetState {
                    format: gpu.linear_format,
                    blend,
                    write_mask: wgpu::ColorWrites::ALL,
                })],
            }),
            multiview_mask: None,
            cache: None,
        })
}
