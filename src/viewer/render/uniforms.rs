//! Parameters of the picture for every pass, in one uniform buffer. Twin of `View` in view.wgsl.

use std::num::NonZeroU64;

use glam::{Mat3, Vec3, Vec4};

use super::{super::theme, Picture};
use crate::{export::ToneMap, picture::GLOSS_LAMPS, scene::SkyPicture, viewer::view::ViewMode};

/// Floats of `View`: a matrix, eleven vectors, nine ramp colours, and lamps by place and radiance.
const FLOAT_COUNT: usize = 16 + 11 * 4 + 9 * 4 + 2 * GLOSS_LAMPS * 4;
const BYTE_COUNT: u64 = (FLOAT_COUNT * size_of::<f32>()) as u64;
/// Width of segments in points.
const LINE_POINTS: f32 = 2.5;
/// Number by which the shader knows surfaces without light; no view mode has it.
const PREVIEW_MODE: f32 = 255.0;
/// Opacity of element edges over light, and over the grey solid.
const EDGE_OPACITY: [f32; 2] = [0.45, 0.8];

/// The buffer and how passes see it.
pub(super) struct ViewUniforms {
    buffer: wgpu::Buffer,
    layout: wgpu::BindGroupLayout,
    bind_group: wgpu::BindGroup,
}

impl ViewUniforms {
    /// An empty buffer.
    pub(super) fn new(device: &wgpu::Device) -> Self {
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("view uniforms"),
            size: BYTE_COUNT,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("view"),
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
                ty: wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: false,
                    min_binding_size: NonZeroU64::new(BYTE_COUNT),
                },
                count: None,
            }],
        });
        let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("view"),
            layout: &layout,
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: buffer.as_entire_binding(),
            }],
        });
        Self {
            buffer,
            layout,
            bind_group,
        }
    }

    /// Layout of group 0 of every pass.
    pub(super) fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    /// Group 0 of every pass.
    pub(super) fn bind_group(&self) -> &wgpu::BindGroup {
        &self.bind_group
    }

    /// Upload the uniforms of a picture.
    pub(super) fn write(
        &self,
        queue: &wgpu::Queue,
        [width, height]: [u32; 2],
        picture: &Picture<'_>,
    ) {
        let (camera, view) = (picture.camera, picture.view);
        let aspect = width as f32 / height as f32;
        let flag = |on: bool| if on { 1.0 } else { 0.0 };
        let eye = camera.eye();
        let backward = camera.backward();
        // Light is scaled with its emission; false colours by their range, which is the same.
        let factor = view.light_factor().max(f32::MIN_POSITIVE);
        let [low, high] = picture.range.map(|end| end / factor);
        let is_solid = view.mode == ViewMode::Elements;
        let mut floats = Vec::with_capacity(FLOAT_COUNT);
        floats.extend(camera.clip_from_frame(aspect).to_cols_array());
        floats.extend([eye.x, eye.y, eye.z, flag(camera.orthographic)]);
        floats.extend([backward.x, backward.y, backward.z, flag(view.backs)]);
        let is_logarithmic = view.logarithmic && !view.mode.is_signed();
        floats.extend([low, high, flag(is_logarithmic), theme::BACK_LIGHTNESS]);
        let lacks_errors = view.mode.shows_errors() && picture.errors.is_none();
        let is_preview = (picture.is_unlit && view.mode.is_light()) || lacks_errors;
        floats.extend([
            if is_preview {
                PREVIEW_MODE
            } else {
                f32::from(view.mode.shader_number())
            },
            picture.light_factor(),
            flag(view.tone_map == ToneMap::None),
            flag(view.texture_detail),
        ]);
        floats.extend([
            width as f32,
            height as f32,
            LINE_POINTS * picture.pixels_per_point,
            EDGE_OPACITY[usize::from(is_solid)],
        ]);
        let room = picture.room_looked_into();
        let [min, max] = room.map_or([Vec3::ZERO; 2], |room| [room.min, room.max]);
        floats.extend([min.x, min.y, min.z, flag(room.is_some())]);
        floats.extend([max.x, max.y, max.z, 0.0]);
        let sky = picture.sky_picture();
        let turn = sky.map_or(Mat3::IDENTITY, SkyPicture::from_scene);
        let scale = sky.map_or(Vec3::ZERO, |sky| sky.scale * picture.light_factor());
        for vector in camera
            .rays(aspect)
            .map(|ray| turn * ray)
            .into_iter()
            .chain([scale])
        {
            floats.extend([vector.x, vector.y, vector.z, 0.0]);
        }
        for color in theme::ramp_stops(view.mode.is_signed()) {
            floats.extend([color.x, color.y, color.z, 1.0]);
        }
        let lamps = picture.gloss.map_or(&[][..], |gloss| &gloss.lamps);
        let lamp = |index: usize| lamps.get(index);
        for index in 0..GLOSS_LAMPS {
            let place = lamp(index).map_or(Vec4::ZERO, |lamp| lamp.place);
            floats.extend(place.to_array());
        }
        for index in 0..GLOSS_LAMPS {
            let radiance = lamp(index).map_or(Vec3::ZERO, |lamp| lamp.radiance);
            floats.extend(radiance.extend(0.0).to_array());
        }
        debug_assert_eq!(floats.len(), FLOAT_COUNT);
        queue.write_buffer(&self.buffer, 0, bytemuck::cast_slice(&floats));
    }
}
