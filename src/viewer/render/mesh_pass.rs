//! The lit surfaces: one vertex buffer a quantity, so that a step uploads the light and nothing else.

use std::sync::Arc;

use super::{
    DEPTH_FORMAT, Gpu, Picture, RenderError,
    detail::{DetailRange, DetailSet},
};
use crate::{
    solver::{DisplayMesh, VertexLight},
    viewer::view::{ViewMode, ViewSettings},
};

/// Pipelines, the mesh on the adapter, and what it was made from.
pub(super) struct MeshPass {
    front_pipeline: wgpu::RenderPipeline,
    back_pipeline: wgpu::RenderPipeline,
    edge_pipeline: wgpu::RenderPipeline,
    details: DetailSet,
    mesh: Option<MeshBuffers>,
}

/// The light that a mode shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Channel {
    Irradiance,
    Direct,
    Uncertainty,
}

impl Channel {
    fn of(mode: ViewMode) -> Self {
        match mode {
            ViewMode::DirectOnly => Self::Direct,
            ViewMode::Uncertainty => Self::Uncertainty,
            _ => Self::Irradiance,
        }
    }
}

/// What the buffer of light was filled from.
#[derive(Clone)]
enum LightSource {
    Light(Arc<VertexLight>, Channel),
    Errors(Arc<Vec<f32>>),
}

impl LightSource {
    fn of(picture: &Picture<'_>) -> Self {
        match (picture.view.mode, picture.errors) {
            (ViewMode::Error, Some(errors)) => Self::Errors(errors.clone()),
            (mode, _) => Self::Light(picture.light.clone(), Channel::of(mode)),
        }
    }

    fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Light(a, shown), Self::Light(b, wanted)) => Arc::ptr_eq(a, b) && shown == wanted,
            (Self::Errors(a), Self::Errors(b)) => Arc::ptr_eq(a, b),
            _ => false,
        }
    }

    fn upload(&self, gpu: &Gpu, buffer: &wgpu::Buffer) {
        let gray = |values: &[f32]| -> Vec<[f32; 3]> { values.iter().map(|x| [*x; 3]).collect() };
        let grays;
        let bytes: &[u8] = match self {
            Self::Light(light, Channel::Irradiance) => bytemuck::cast_slice(&light.irradiance),
            Self::Light(light, Channel::Direct) => bytemuck::cast_slice(&light.direct),
            Self::Light(light, Channel::Uncertainty) => {
                grays = gray(&light.uncertainty);
                bytemuck::cast_slice(&grays)
            }
            Self::Errors(errors) => {
                grays = gray(errors);
                bytemuck::cast_slice(&grays)
            }
        };
        let fitting = bytes.len().min(buffer.size() as usize);
        gpu.queue.write_buffer(buffer, 0, &bytes[..fitting]);
    }
}

struct MeshBuffers {
    source: Arc<DisplayMesh>,
    light_source: Option<LightSource>,
    positions: wgpu::Buffer,
    normals: wgpu::Buffer,
    texcoords: Option<wgpu::Buffer>,
    reflectance: wgpu::Buffer,
    emission: wgpu::Buffer,
    light: wgpu::Buffer,
    indices: wgpu::Buffer,
    ranges: Vec<DetailRange>,
    /// Made when edges are first shown.
    edges: Option<(wgpu::Buffer, u32)>,
}

impl MeshPass {
    /// Build the pipelines.
    pub(super) fn new(gpu: &Gpu, view_layout: &wgpu::BindGroupLayout) -> Self {
        let details = DetailSet::new(gpu);
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
            details,
            mesh: None,
        }
    }

    /// Upload what changed since the last picture.
    pub(super) fn prepare(&mut self, gpu: &Gpu, picture: &Picture<'_>) -> Result<(), RenderError> {
        self.details.prepare(gpu, picture.scene);
        let is_current = |held: &MeshBuffers| Arc::ptr_eq(&held.source, picture.mesh);
        if !self.mesh.as_ref().is_some_and(is_current) {
            // The old mesh goes first: two large ones may not fit.
            self.mesh = None;
            if picture.mesh.indices.is_empty() {
                return Ok(());
            }
            check_size(gpu, picture.mesh)?;
            self.mesh = Some(MeshBuffers::new(gpu, picture, &self.details));
        }
        if let Some(mesh) = &mut self.mesh {
            mesh.prepare_light(gpu, LightSource::of(picture));
            if shows_edges(picture.view) {
                mesh.prepare_edges(gpu);
            }
        }
        Ok(())
    }

    /// Draw; group 0 is set.
    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>, view: &ViewSettings) {
        let Some(mesh) = &self.mesh else { return };
        let buffers = [
            &mesh.positions,
            &mesh.normals,
            // Nobody looks at texture coordinates where there are none: any numbers will do.
            mesh.texcoords.as_ref().unwrap_or(&mesh.positions),
            &mesh.reflectance,
            &mesh.emission,
            &mesh.light,
        ];
        for (slot, buffer) in buffers.into_iter().enumerate() {
            pass.set_vertex_buffer(slot as u32, buffer.slice(..));
        }
        pass.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.set_pipeline(&self.front_pipeline);
        for (range, detail) in &mesh.ranges {
            pass.set_bind_group(1, self.details.bind_group(*detail), &[]);
            pass.draw_indexed(range.clone(), 0, 0..1);
        }
        if view.backs || view.mode == ViewMode::FaceOrientation {
            pass.set_pipeline(&self.back_pipeline);
            pass.set_bind_group(1, self.details.bind_group(0), &[]);
            let whole = mesh.ranges.last().map_or(0, |(range, _)| range.end);
            pass.draw_indexed(0..whole, 0, 0..1);
        }
        if let (true, Some((edges, count))) = (shows_edges(view), &mesh.edges) {
            pass.set_pipeline(&self.edge_pipeline);
            pass.set_bind_group(1, self.details.bind_group(0), &[]);
            pass.set_index_buffer(edges.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..*count, 0, 0..1);
        }
    }
}

fn shows_edges(view: &ViewSettings) -> bool {
    view.edges || view.mode == ViewMode::Elements
}

/// Whether the largest buffers fit: twelve bytes a vertex, twelve a triangle.
fn check_size(gpu: &Gpu, mesh: &DisplayMesh) -> Result<(), RenderError> {
    const MIB: u64 = 1 << 20;
    let needed = 12 * mesh.positions.len().max(mesh.indices.len()) as u64;
    let limit = gpu.max_buffer_size;
    if needed > limit {
        return Err(RenderError::MeshTooLarge {
            needed_mib: needed.div_ceil(MIB),
            limit_mib: limit / MIB,
        });
    }
    Ok(())
}

impl MeshBuffers {
    fn new(gpu: &Gpu, picture: &Picture<'_>, details: &DetailSet) -> Self {
        let mesh = picture.mesh;
        let vertices = |label, bytes: &[u8]| gpu.buffer(label, bytes, wgpu::BufferUsages::VERTEX);
        let (indices, ranges) = details.sort_by_detail(picture.scene, mesh);
        Self {
            source: mesh.clone(),
            light_source: None,
            positions: vertices("positions", bytemuck::cast_slice(&mesh.positions)),
            normals: vertices("normals", bytemuck::cast_slice(&mesh.normals)),
            texcoords: (mesh.texcoords.len() == mesh.positions.len())
                .then(|| vertices("texture coordinates", bytemuck::cast_slice(&mesh.texcoords))),
            reflectance: vertices("reflectance", bytemuck::cast_slice(&mesh.reflectance)),
            emission: vertices("emission", bytemuck::cast_slice(&mesh.emission)),
            light: gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("light"),
                size: 12 * mesh.positions.len() as u64,
                usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            indices: gpu.buffer(
                "indices",
                bytemuck::cast_slice(&indices),
                wgpu::BufferUsages::INDEX,
            ),
            ranges,
            edges: None,
        }
    }

    fn prepare_light(&mut self, gpu: &Gpu, source: LightSource) {
        let is_current = |held: &LightSource| held.is_same(&source);
        if !self.light_source.as_ref().is_some_and(is_current) {
            source.upload(gpu, &self.light);
            self.light_source = Some(source);
        }
    }

    fn prepare_edges(&mut self, gpu: &Gpu) {
        if self.edges.is_some() {
            return;
        }
        // An edge that two triangles share runs forth in one and back in the other: it is drawn twice, which costs
        // less than finding out.
        let limit = gpu.max_buffer_size as usize / (6 * size_of::<u32>());
        let edges: Vec<u32> = self
            .source
            .indices
            .iter()
            .take(limit)
            .flat_map(|&[a, b, c]| [a, b, b, c, c, a])
            .collect();
        let bytes = bytemuck::cast_slice(&edges);
        let usage = wgpu::BufferUsages::INDEX;
        self.edges = Some((gpu.buffer("edges", bytes, usage), edges.len() as u32));
    }
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
