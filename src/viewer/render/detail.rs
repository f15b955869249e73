//! Textures on the adapter: one group for each textured material, and group 0 for everything without a texture.

use std::{ops::Range, sync::Arc};

use glam::Vec3;
use wgpu::util::DeviceExt as _;

use super::Gpu;
use crate::{
    scene::{Appearance, Scene, Texture, TextureId, srgb_byte},
    solver::DisplayMesh,
};

/// Times that a texture may repeat over an edge however short, and over each unit of the frame.
const MOST_REPEATS: [f32; 2] = [2.0, 16.0];

/// Textures larger than this are shown smaller: light, not texture, is what is looked at.
const MAX_SIDE: u32 = 2048;

/// Which copies of a triangle the mesh has, in the order in which they are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum FaceCopy {
    /// The only one, of a one-sided triangle: from behind its back is seen, or nothing.
    Only,
    /// The front of a two-sided triangle.
    Front,
    /// Its back, which is the other copy turned around.
    Back,
}

/// A run of indices that are drawn alike.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct DrawRange {
    /// Which indices.
    pub(super) indices: Range<u32>,
    /// Which copies these triangles are.
    pub(super) copy: FaceCopy,
    /// Number of their group of textures.
    pub(super) group: usize,
}

/// The groups of a scene's materials. Cheap to clone.
#[derive(Clone)]
pub(super) struct DetailSet {
    layout: wgpu::BindGroupLayout,
    /// One that looks along the slant, and one that does not.
    slanted: wgpu::Sampler,
    upright: wgpu::Sampler,
    /// Stands for textures that materials do not have.
    white: wgpu::TextureView,
    plain: wgpu::BindGroup,
    scene: Option<Arc<Scene>>,
    /// Whether its textures are sampled along the slant.
    is_tame: bool,
    /// Its textures, those that were needed.
    views: Vec<Option<Uploaded>>,
    /// Factors of each material on its textures; empty where they are those of the scene.
    appearances: Vec<Appearance>,
    /// Number of the group of each material.
    group_of: Vec<usize>,
    /// Groups from 1 on.
    textured: Vec<wgpu::BindGroup>,
}

/// A texture on the adapter.
#[derive(Clone)]
struct Uploaded {
    view: wgpu::TextureView,
    /// Its factor: its brightest channel, where that is above 1.
    scale: f32,
}

/// Whether textures can be sampled by their slant: where they repeat without end over a sliver, software that does never
/// ends.
fn is_tame(scene: &Scene) -> bool {
    let [most, most_by_unit] = MOST_REPEATS;
    scene
        .triangle_ids()
        .zip(&scene.texcoords)
        .all(|(id, places)| {
            let corners = scene.corners(id);
            (0..3).all(|side| {
                let next = (side + 1) % 3;
                let repeats = places[side].distance(places[next]);
                repeats <= most.max(most_by_unit * corners[side].distance(corners[next]))
            })
        })
}

impl DetailSet {
    /// Only the plain group.
    pub(super) fn new(gpu: &Gpu) -> Self {
        let layout = layout(&gpu.device);
        let sampler = |anisotropy_clamp: u16| {
            gpu.device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("detail"),
                address_mode_u: wgpu::AddressMode::Repeat,
                address_mode_v: wgpu::AddressMode::Repeat,
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                mipmap_filter: wgpu::MipmapFilterMode::Linear,
                anisotropy_clamp,
                ..Default::default()
            })
        };
        let white = Texture {
            name: String::new(),
            width: 1,
            height: 1,
            pixels: vec![Vec3::ONE],
        };
        let white = upload(gpu, &white).view;
        let upright = sampler(1);
        let plain = bind_group(gpu, &layout, &upright, [&white, &white], [[0.0; 4]; 2]);
        Self {
            layout,
            // Floors are seen at a slant.
            slanted: sampler(16),
            upright,
            white,
            plain,
            scene: None,
            is_tame: true,
            views: Vec::new(),
            appearances: Vec::new(),
            group_of: Vec::new(),
            textured: Vec::new(),
        }
    }

    /// Layout of group 1 of the mesh pass.
    pub(super) fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    /// A group by its number.
    pub(super) fn bind_group(&self, number: usize) -> &wgpu::BindGroup {
        match number.checked_sub(1) {
            Some(index) => self.textured.get(index).unwrap_or(&self.plain),
            None => &self.plain,
        }
    }

    /// Upload the textures of another scene, and take other appearances of materials over.
    pub(super) fn prepare(&mut self, gpu: &Gpu, scene: &Arc<Scene>, appearances: &[Appearance]) {
        let is_current = |current: &Arc<Scene>| Arc::ptr_eq(current, scene);
        if !self.scene.as_ref().is_some_and(is_current) {
            self.scene = Some(scene.clone());
            self.is_tame = is_tame(scene);
            self.views = vec![None; scene.textures.len()];
        } else if self.appearances == appearances {
            return;
        }
        self.appearances = appearances.to_vec();
        self.textured.clear();
        self.group_of = vec![0; scene.materials.len()];
        let sampler = match self.is_tame {
            true => &self.slanted,
            false => &self.upright,
        };
        for (index, material) in scene.materials.iter().enumerate() {
            let textures = [material.reflectance_texture, material.emission_texture];
            if textures == [None, None] {
                continue;
            }
            let appearance = appearances.get(index).copied();
            let appearance = appearance.unwrap_or_else(|| Appearance::of(material));
            let colors = [appearance.reflectance, appearance.emission];
            let (mut views, mut factors) =
                ([self.white.clone(), self.white.clone()], [[0.0; 4]; 2]);
            for (kind, texture) in textures.into_iter().enumerate() {
                let Some(texture) = texture.map(TextureId::index) else {
                    continue;
                };
                let uploaded = self.views[texture]
                    .get_or_insert_with(|| upload(gpu, &scene.textures[texture]));
                let factor = (colors[kind] * uploaded.scale).extend(1.0);
                (views[kind], factors[kind]) = (uploaded.view.clone(), factor.to_array());
            }
            self.textured.push(bind_group(
                gpu,
                &self.layout,
                sampler,
                [&views[0], &views[1]],
                factors,
            ));
            self.group_of[index] = self.textured.len();
        }
    }

    /// The indices of a mesh, those that are drawn alike together, and where each run of them lies.
    pub(super) fn sort_for_drawing(
        &self,
        scene: &Scene,
        mesh: &DisplayMesh,
    ) -> (Vec<[u32; 3]>, Vec<DrawRange>) {
        let has_details = !self.textured.is_empty() && !mesh.texcoords.is_empty();
        let kind = |index: usize| {
            let triangle = &scene.triangles[mesh.triangle_of[index] as usize];
            let copy = match (mesh.is_back[index], triangle.two_sided) {
                (true, _) => FaceCopy::Back,
                (false, true) => FaceCopy::Front,
                (false, false) => FaceCopy::Only,
            };
            let group = match has_details {
                true => self.group_of[triangle.material.index()],
                false => 0,
            };
            (copy, group)
        };
        let kinds: Vec<(FaceCopy, usize)> = (0..mesh.indices.len()).map(kind).collect();
        let mut order: Vec<usize> = (0..mesh.indices.len()).collect();
        order.sort_by_key(|&index| kinds[index]);
        let mut ranges: Vec<DrawRange> = Vec::new();
        for (place, &index) in order.iter().enumerate() {
            let (start, end) = (3 * place as u32, 3 * place as u32 + 3);
            let (copy, group) = kinds[index];
            match ranges.last_mut() {
                Some(last) if (last.copy, last.group) == (copy, group) => last.indices.end = end,
                _ => ranges.push(DrawRange {
                    indices: start..end,
                    copy,
                    group,
                }),
            }
        }
        let indices = order.iter().map(|&index| mesh.indices[index]).collect();
        (indices, ranges)
    }
}

fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::FRAGMENT,
        ty,
        count: None,
    };
    let texture = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: true },
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("detail"),
        entries: &[
            entry(
                0,
                wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
            ),
            entry(1, texture),
            entry(2, texture),
            entry(
                3,
                wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
            ),
        ],
    })
}

fn bind_group(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    sampler: &wgpu::Sampler,
    [reflectance, emission]: [&wgpu::TextureView; 2],
    factors: [[f32; 4]; 2],
) -> wgpu::BindGroup {
    let uniform = gpu.buffer(
        "detail",
        bytemuck::cast_slice(&factors),
        wgpu::BufferUsages::UNIFORM,
    );
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("detail"),
        layout,
        entries: &[
            wgpu::BindGroupEntry {
                binding: 0,
                resource: uniform.as_entire_binding(),
            },
            wgpu::BindGroupEntry {
                binding: 1,
                resource: wgpu::BindingResource::TextureView(reflectance),
            },
            wgpu::BindGroupEntry {
                binding: 2,
                resource: wgpu::BindingResource::TextureView(emission),
            },
            wgpu::BindGroupEntry {
                binding: 3,
                resource: wgpu::BindingResource::Sampler(sampler),
            },
        ],
    })
}

/// A texture with all its smaller levels, sRGB-encoded.
fn upload(gpu: &Gpu, texture: &Texture) -> Uploaded {
    let channels = texture.pixels.iter().map(|pixel| pixel.max_element());
    let scale = channels.fold(1.0, f32::max);
    let mut level = (texture.width, texture.height, texture.pixels.clone());
    while level.0.max(level.1) > MAX_SIDE.min(gpu.max_picture_side()) {
        level = halved(&level);
    }
    let (width, height) = (level.0, level.1);
    let level_count = width.max(height).ilog2() + 1;
    let mut bytes = Vec::new();
    for index in 0..level_count {
        bytes.extend(level.2.iter().flat_map(|pixel| {
            let [r, g, b] = (pixel / scale).to_array().map(srgb_byte);
            [r, g, b, 255]
        }));
        if index + 1 < level_count {
            level = halved(&level);
        }
    }
    let made = gpu.device.create_texture_with_data(
        &gpu.queue,
        &wgpu::TextureDescriptor {
            label: Some(&texture.name),
            size: wgpu::Extent3d {
                width,
                height,
                depth_or_array_layers: 1,
            },
            mip_level_count: level_count,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba8UnormSrgb,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        },
        wgpu::util::TextureDataOrder::LayerMajor,
        &bytes,
    );
    Uploaded {
        view: made.create_view(&wgpu::TextureViewDescriptor::default()),
        scale,
    }
}

/// A picture of half the size, at least 1 × 1; an odd last row or column counts for its neighbour, too.
fn halved((width, height, pixels): &(u32, u32, Vec<Vec3>)) -> (u32, u32, Vec<Vec3>) {
    let (half_width, half_height) = ((width / 2).max(1), (height / 2).max(1));
    let pixel = |x: u32, y: u32| pixels[(y.min(height - 1) * width + x.min(width - 1)) as usize];
    let mut half = Vec::with_capacity((half_width * half_height) as usize);
    for y in 0..half_height {
        for x in 0..half_width {
            let (x, y) = (2 * x, 2 * y);
            half.push(
                0.25 * (pixel(x, y) + pixel(x + 1, y) + pixel(x, y + 1) + pixel(x + 1, y + 1)),
            );
        }
    }
    (half_width, half_height, half)
}
