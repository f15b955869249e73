//! One pass from the linear picture to display colours; from its samples, where they can be read.

use super::{CutoutTarget, DISPLAY_FORMAT, Gpu, Target};

/// The pipelines.
pub(super) struct TonemapPass {
    /// Over a background.
    opaque: Pass,
    /// Without one: from the picture over nothing and the one over light.
    cutout: Pass,
}

/// A pipeline, and the places of its pictures among what the shader reads.
struct Pass {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::RenderPipeline,
    bindings: &'static [u32],
}

impl TonemapPass {
    /// Build the pipelines.
    pub(super) fn new(gpu: &Gpu, view_layout: &wgpu::BindGroupLayout) -> Self {
        let source = concat!(include_str!("view.wgsl"), include_str!("tonemap_pass.wgsl"));
        let module = gpu
            .device
            .create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some("tone map"),
                source: wgpu::ShaderSource::Wgsl(source.into()),
            });
        let pass =
            |bindings, entry_point| Pass::new(gpu, view_layout, &module, bindings, entry_point);
        match gpu.reads_samples() {
            true => Self {
                opaque: pass(&[1], "fs_samples"),
                cutout: pass(&[1, 3], "fs_cutout_samples"),
            },
            false => Self {
                opaque: pass(&[0], "fs_main"),
                cutout: pass(&[0, 2], "fs_cutout"),
            },
        }
    }

    /// Draw the display picture of a target; group 0 is set.
    pub(super) fn draw(&self, gpu: &Gpu, pass: &mut wgpu::RenderPass<'_>, target: &Target) {
        self.opaque.draw(gpu, pass, &[target.tone_mapped_view()]);
    }

    /// Draw the display picture without a background; group 0 is set.
    pub(super) fn draw_cutout(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::RenderPass<'_>,
        target: &CutoutTarget,
    ) {
        let pictures = [&target.over_nothing, &target.over_light].map(Target::tone_mapped_view);
        self.cutout.draw(gpu, pass, &pictures);
    }
}

impl Pass {
    fn new(
        gpu: &Gpu,
        view_layout: &wgpu::BindGroupLayout,
        module: &wgpu::ShaderModule,
        bindings: &'static [u32],
        entry_point: &str,
    ) -> Self {
        let device = &gpu.device;
        let entry = |&binding: &u32| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty: wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Float { filterable: false },
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: gpu.reads_samples(),
            },
            count: None,
        };
        let entries: Vec<_> = bindings.iter().map(entry).collect();
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("tone map"),
            entries: &entries,
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("tone map"),
            bind_group_layouts: &[Some(view_layout), Some(&layout)],
            immediate_size: 0,
        });
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("tone map"),
            layout: Some(&pipeline_layout),
            vertex: wgpu::VertexState {
                module,
                entry_point: Some("vs_main"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module,
                entry_point: Some(entry_point),
                compilation_options: Default::default(),
                targets: &[Some(DISPLAY_FORMAT.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        Self {
            layout,
            pipeline,
            bindings,
        }
    }

    fn draw(&self, gpu: &Gpu, pass: &mut wgpu::RenderPass<'_>, pictures: &[&wgpu::TextureView]) {
        let entry = |(&binding, &picture): (&u32, &_)| wgpu::BindGroupEntry {
            binding,
            resource: wgpu::BindingResource::TextureView(picture),
        };
        let entries: Vec<_> = self.bindings.iter().zip(pictures).map(entry).collect();
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("tone map"),
            layout: &self.layout,
            entries: &entries,
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(1, &group, &[]);
        pass.draw(0..3, 0..1);
    }
}
