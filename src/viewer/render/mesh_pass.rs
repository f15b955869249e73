//! The lit surfaces: one vertex buffer a quantity, so that a step uploads the light and nothing else.
//!
//! Of the two sides of a triangle, one is drawn in a pixel: a two-sided triangle has a copy for each, and a back is drawn
//! of one-sided ones only.
//! Panes come last: what is behind them is multiplied by what they let pass, and what they reflect is added. Gloss is added to
//! each surface where it is drawn.

use super::{
    DEPTH_FORMAT, Gpu,
    detail::{DetailSet, DrawRange, FaceCopy, Look},
    meter::METER_FORMAT,
    uploads::Uploads,
};
use crate::{
    picture::GlossVertex,
    viewer::{
        first_look::Interior,
        view::{ViewMode, ViewSettings},
    },
};

/// Pipelines of the surfaces.
pub(super) struct MeshPass {
    whole: Pipelines,
    /// The same without what stands before the room that is looked into. Of their own, since a fragment that may be
    /// discarded is tested for its depth only after it was shaded.
    cut: Pipelines,
}

/// Pipelines by what they draw.
struct Pipelines {
    front: wgpu::RenderPipeline,
    /// Fronts in the colour of backs.
    turned: wgpu::RenderPipeline,
    back: wgpu::RenderPipeline,
    edge: wgpu::RenderPipeline,
    cut_out: wgpu::RenderPipeline,
    cut_out_light: wgpu::RenderPipeline,
    filter: wgpu::RenderPipeline,
    pane: wgpu::RenderPipeline,
    gloss: wgpu::RenderPipeline,
    gloss_of_pane: wgpu::RenderPipeline,
    meter: wgpu::RenderPipeline,
    meter_cut_out: wgpu::RenderPipeline,
    meter_back: wgpu::RenderPipeline,
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
        let pipelines = |cuts| {
            let build = |kind| pipeline(gpu, &layout, &module, kind, cuts);
            Pipelines {
                front: build(Kind::Front),
                turned: build(Kind::Turned),
                back: build(Kind::Back),
                edge: build(Kind::Edge),
                cut_out: build(Kind::CutOut),
                cut_out_light: build(Kind::CutOutLight),
                filter: build(Kind::Filter),
                pane: build(Kind::Pane),
                gloss: build(Kind::Gloss),
                gloss_of_pane: build(Kind::GlossOfPane),
                meter: build(Kind::Meter),
                meter_cut_out: build(Kind::MeterCutOut),
                meter_back: build(Kind::MeterBack),
            }
        };
        Self {
            whole: pipelines(false),
            cut: pipelines(true),
        }
    }

    fn pipelines(&self, cuts: bool) -> &Pipelines {
        if cuts { &self.cut } else { &self.whole }
    }

    /// Draw what was uploaded, whole or without what stands before the room, with gloss or without; group 0 is set.
    pub(super) fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        uploads: &Uploads,
        view: &ViewSettings,
        cuts: bool,
        shows_gloss: bool,
    ) {
        let pipelines = self.pipelines(cuts);
        let shows_orientation = view.mode == ViewMode::FaceOrientation;
        let pipelines_of = |copy, look| match (shows_orientation, copy, look) {
            (true, FaceCopy::Back, _) => vec![&pipelines.turned],
            (true, _, _) | (_, _, Look::Opaque) => vec![&pipelines.front],
            // What is light is said last, of the samples that were drawn.
            (_, _, Look::Pane) if view.mode.is_light() => vec![&pipelines.filter, &pipelines.pane],
            (_, _, Look::Pane | Look::CutOut) => vec![&pipelines.cut_out, &pipelines.cut_out_light],
        };
        let back = (view.backs || shows_orientation).then_some(&pipelines.back);
        let gloss = shows_gloss.then_some(pipelines);
        draw_sides(pass, uploads, pipelines_of, back, gloss);
        if view.mode.shows_edges(view.edges)
            && let Some((edges, count)) = uploads.mesh().and_then(|mesh| mesh.edges.as_ref())
        {
            pass.set_pipeline(&pipelines.edge);
            pass.set_bind_group(1, uploads.details().bind_group(0), &[]);
            pass.set_index_buffer(edges.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..*count, 0, 0..1);
        }
    }

    /// Draw the luminance of what was uploaded, for metering; group 0 is set.
    pub(super) fn draw_meter(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        uploads: &Uploads,
        view: &ViewSettings,
        cuts: bool,
    ) {
        let pipelines = self.pipelines(cuts);
        let back = view.backs.then_some(&pipelines.meter_back);
        let pipelines_of = |_, look| match look {
            Look::Opaque => vec![&pipelines.meter],
            Look::CutOut => vec![&pipelines.meter_cut_out],
            // What is seen through them is metered.
            Look::Pane => Vec::new(),
        };
        draw_sides(pass, uploads, pipelines_of, back, None);
    }
}

/// Draw each triangle's side that faces the viewer: copies by the pipelines for them, backs of one-sided triangles by
/// `back` or not at all, and gloss by the pipelines for it, where they are given.
fn draw_sides<'p>(
    pass: &mut wgpu::RenderPass<'_>,
    uploads: &Uploads,
    pipelines_of: impl Fn(FaceCopy, Look) -> Vec<&'p wgpu::RenderPipeline>,
    back: Option<&wgpu::RenderPipeline>,
    gloss: Option<&Pipelines>,
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
    set_vertex_buffers(pass, buffers);
    pass.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint32);
    let draw = |pass: &mut wgpu::RenderPass<'_>, range: &DrawRange| {
        for pipeline in pipelines_of(range.copy, details.look(range.group)) {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(1, details.bind_group(range.group), &[]);
            pass.draw_indexed(range.indices.clone(), 0, 0..1);
        }
    };
    let is_pane = |range: &&DrawRange| details.look(range.group) == Look::Pane;
    for range in mesh.ranges.iter().filter(|range| !is_pane(range)) {
        draw(pass, range);
    }
    if let Some(back) = back {
        pass.set_pipeline(back);
        pass.set_bind_group(1, details.bind_group(0), &[]);
        let one_sided = mesh
            .ranges
            .iter()
            .filter(|range| range.copy == FaceCopy::Only);
        for range in one_sided {
            pass.draw_indexed(range.indices.clone(), 0, 0..1);
        }
    }
    if let Some(pipelines) = gloss {
        draw_gloss(pass, uploads, &pipelines.gloss, |look| look != Look::Pane);
        set_vertex_buffers(pass, buffers);
    }
    for range in mesh.ranges.iter().filter(is_pane) {
        draw(pass, range);
    }
    if let Some(pipelines) = gloss {
        draw_gloss(pass, uploads, &pipelines.gloss_of_pane, |look| {
            look == Look::Pane
        });
    }
}

fn set_vertex_buffers<const N: usize>(
    pass: &mut wgpu::RenderPass<'_>,
    buffers: [&wgpu::Buffer; N],
) {
    for (slot, buffer) in buffers.into_iter().enumerate() {
        pass.set_vertex_buffer(slot as u32, buffer.slice(..));
    }
}

/// Draw what glossy surfaces of some looks reflect in preferred directions; the index buffer is set.
fn draw_gloss(
    pass: &mut wgpu::RenderPass<'_>,
    uploads: &Uploads,
    pipeline: &wgpu::RenderPipeline,
    is_meant: impl Fn(Look) -> bool,
) {
    let (Some(mesh), Some(gloss)) = (uploads.mesh(), uploads.gloss()) else {
        return;
    };
    let details = uploads.details();
    set_vertex_buffers(pass, [&mesh.positions, &mesh.normals, gloss]);
    pass.set_pipeline(pipeline);
    for range in &mesh.ranges {
        if details.is_glossy(range.group) && is_meant(details.look(range.group)) {
            pass.set_bind_group(1, details.bind_group(range.group), &[]);
            pass.draw_indexed(range.indices.clone(), 0, 0..1);
        }
    }
}

/// The primitives of a pipeline.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// Fronts, as the mode shows them.
    Front,
    /// Fronts, as backs are shown.
    Turned,
    /// Backs.
    Back,
    /// Edges of both sides.
    Edge,
    /// Colours of what is left of a cut-out, in the samples that it covers.
    CutOut,
    /// Whether they are light.
    CutOutLight,
    /// What panes let pass.
    Filter,
    /// What panes reflect and emit.
    Pane,
    /// What surfaces that were drawn reflect in preferred directions.
    Gloss,
    /// The same of panes, which hide nothing.
    GlossOfPane,
    /// Luminance of fronts.
    Meter,
    /// The same of what is left of a cut-out.
    MeterCutOut,
    /// Backs, which are not metered, but hide what is behind them.
    MeterBack,
}

/// Backs lie a little behind their triangle: where the front of another one lies on the same plane, cut another way, it
/// is seen. With less, rounding of depths decides; with more, backs sink behind what stands close to them. Depth is
/// reversed, so that smaller is farther.
const BACK_BIAS: wgpu::DepthBiasState = wgpu::DepthBiasState {
    constant: -16,
    slope_scale: -1.0,
    clamp: 0.0,
};

fn pipeline(
    gpu: &Gpu,
    layout: &wgpu::PipelineLayout,
    module: &wgpu::ShaderModule,
    kind: Kind,
    cuts: bool,
) -> wgpu::RenderPipeline {
    use wgpu::{BlendComponent, BlendFactor, BlendOperation, PrimitiveTopology};
    let (label, vertex, fragment) = match kind {
        Kind::Front => ("mesh fronts", "vs_main", "fs_main"),
        Kind::Turned => ("mesh turned", "vs_main", "fs_back"),
        Kind::Back => ("mesh backs", "vs_main", "fs_back"),
        Kind::Edge => ("mesh edges", "vs_edge", "fs_edge"),
        Kind::CutOut => ("mesh cut-outs", "vs_main", "fs_cut_out"),
        Kind::CutOutLight => ("mesh light of cut-outs", "vs_main", "fs_main"),
        Kind::Filter => ("mesh filters", "vs_main", "fs_filter"),
        Kind::Pane => ("mesh panes", "vs_main", "fs_pane"),
        Kind::Gloss => ("mesh gloss", "vs_gloss", "fs_gloss"),
        Kind::GlossOfPane => ("mesh gloss of panes", "vs_gloss", "fs_gloss"),
        Kind::MeterCutOut => ("mesh meter cut-outs", "vs_main", "fs_meter_cut_out"),
        Kind::Meter => ("mesh meter", "vs_main", "fs_meter"),
        Kind::MeterBack => ("mesh meter backs", "vs_main", "fs_meter_back"),
    };
    let is_back = matches!(kind, Kind::Back | Kind::MeterBack);
    let is_meter = matches!(kind, Kind::Meter | Kind::MeterCutOut | Kind::MeterBack);
    let sample_count = if is_meter { 1 } else { gpu.sample_count };
    let attributes = [
        wgpu::vertex_attr_array![0 => Float32x3],
        wgpu::vertex_attr_array![1 => Float32x3],
        wgpu::vertex_attr_array![2 => Float32x2],
        wgpu::vertex_attr_array![3 => Float32x3],
        wgpu::vertex_attr_array![4 => Float32x3],
        wgpu::vertex_attr_array![5 => Float32x3],
    ];
    let gloss = wgpu::vertex_attr_array![
        2 => Float32x4, 3 => Float32x4, 4 => Float32x4, 5 => Float32x4
    ];
    let layouts = attributes.each_ref().map(|attribute| {
        Some(wgpu::VertexBufferLayout {
            array_stride: attribute[0].format.size(),
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: attribute,
        })
    });
    let [positions, normals, ..] = layouts.clone();
    let gloss_layouts = [
        positions,
        normals,
        Some(wgpu::VertexBufferLayout {
            array_stride: size_of::<GlossVertex>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &gloss,
        }),
    ];
    let is_gloss = matches!(kind, Kind::Gloss | Kind::GlossOfPane);
    let add = |src_factor, dst_factor| BlendComponent {
        src_factor,
        dst_factor,
        operation: BlendOperation::Add,
    };
    // Alpha says whether a pixel is light.
    let keep = add(BlendFactor::Zero, BlendFactor::One);
    let blend = match kind {
        // Edges darken light and leave it light.
        Kind::Edge => Some((
            add(BlendFactor::SrcAlpha, BlendFactor::OneMinusSrcAlpha),
            keep,
        )),
        Kind::Filter => Some((add(BlendFactor::Zero, BlendFactor::Src), keep)),
        Kind::Gloss | Kind::GlossOfPane => Some((add(BlendFactor::One, BlendFactor::One), keep)),
        Kind::Pane => Some((
            add(BlendFactor::One, BlendFactor::One),
            add(BlendFactor::One, BlendFactor::OneMinusSrcAlpha),
        )),
        _ => None,
    };
    let blend = blend.map(|(color, alpha)| wgpu::BlendState { color, alpha });
    let hides = !matches!(
        kind,
        Kind::Edge
            | Kind::CutOutLight
            | Kind::Filter
            | Kind::Pane
            | Kind::Gloss
            | Kind::GlossOfPane
    );
    gpu.device
        .create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(label),
            layout: Some(layout),
            vertex: wgpu::VertexState {
                module,
                entry_point: Some(vertex),
                compilation_options: Default::default(),
                buffers: match kind {
                    Kind::Edge => &layouts[..2],
                    _ if is_gloss => &gloss_layouts,
                    _ => &layouts,
                },
            },
            primitive: wgpu::PrimitiveState {
                topology: if kind == Kind::Edge {
                    PrimitiveTopology::LineList
                } else {
                    PrimitiveTopology::TriangleList
                },
                cull_mode: match kind {
                    Kind::Edge => None,
                    _ if is_back => Some(wgpu::Face::Front),
                    _ => Some(wgpu::Face::Back),
                },
                ..Default::default()
            },
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH_FORMAT,
                depth_write_enabled: Some(hides),
                depth_compare: Some(match kind {
                    Kind::CutOutLight | Kind::Gloss => wgpu::CompareFunction::Equal,
                    _ => wgpu::CompareFunction::Greater,
                }),
                stencil: Default::default(),
                bias: if is_back {
                    BACK_BIAS
                } else {
                    Default::default()
                },
            }),
            multisample: wgpu::MultisampleState {
                count: sample_count,
                alpha_to_coverage_enabled: kind == Kind::CutOut && sample_count > 1,
                ..Default::default()
            },
            fragment: Some(wgpu::FragmentState {
                module,
                entry_point: Some(fragment),
                compilation_options: wgpu::PipelineCompilationOptions {
                    constants: &[
                        ("CUTS", f64::from(u8::from(cuts))),
                        ("WALL", f64::from(Interior::WALL)),
                    ],
                    ..Default::default()
                },
                targets: &[Some(wgpu::ColorTargetState {
                    format: if is_meter {
                        METER_FORMAT
                    } else {
                        gpu.linear_format
                    },
                    blend,
                    write_mask: match kind {
                        Kind::CutOut => wgpu::ColorWrites::COLOR,
                        Kind::CutOutLight => wgpu::ColorWrites::ALPHA,
                        _ => wgpu::ColorWrites::ALL,
                    },
                })],
            }),
            multiview_mask: None,
            cache: None,
        })
}
