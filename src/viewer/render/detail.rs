//! Textures on the adapter: one group for each material with a texture, with gloss, or through which light passes, and group 0
//! for all others.

use std::{collections::HashMap, ops::Range, sync::Arc};

use glam::Vec3;
use wgpu::util::DeviceExt as _;

use super::{
    Gpu,
    gloss::{GLOSS_VECTORS, gloss_vectors},
};
use crate::{
    scene::{Appearance, Cutout, CutoutId, Material, Scene, Texture, TextureId, Wrap, srgb_byte},
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

/// How a group is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Look {
    /// It hides what is behind it.
    Opaque,
    /// It hides that where it is not cut out.
    CutOut,
    /// It filters that where it is not cut out.
    Pane,
}

impl Look {
    fn of(material: &Material) -> Self {
        match material.cutout {
            _ if material.transmission() != Vec3::ZERO => Self::Pane,
            Some(_) => Self::CutOut,
            None => Self::Opaque,
        }
    }
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
    /// Those in use, by the places that they look at along a slant, and by how pictures go on beyond their edges.
    samplers: HashMap<(u16, [Wrap; 2]), wgpu::Sampler>,
    /// Stands for textures that materials do not have.
    white: wgpu::TextureView,
    plain: wgpu::BindGroup,
    scene: Option<Arc<Scene>>,
    /// Whether its textures are sampled along the slant.
    is_tame: bool,
    /// Its textures, those that were needed.
    views: Vec<Option<Uploaded>>,
    /// Its cut-outs, those that were needed.
    cutouts: Vec<Option<wgpu::TextureView>>,
    /// Factors of each material on its textures; empty where they are those of the scene.
    appearances: Vec<Appearance>,
    /// Number of the group of each material.
    group_of: Vec<usize>,
    /// Groups from 1 on.
    own: Vec<OwnGroup>,
}

/// The group of a material.
#[derive(Clone)]
struct OwnGroup {
    bindings: wgpu::BindGroup,
    look: Look,
    is_glossy: bool,
}

/// Numbers of a group: `Detail` of mesh_pass.wgsl.
type Factors = [[f32; 4]; 3 + GLOSS_VECTORS];

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
        let white = Texture {
            name: String::new(),
            width: 1,
            height: 1,
            pixels: vec![Vec3::ONE],
            ..Texture::default()
        };
        let white = upload(gpu, &white).view;
        let sampler = sampler(gpu, 1, [Wrap::Repeat; 2]);
        let plain = bind_group(gpu, &layout, &sampler, [&white; 3], &Factors::default());
        Self {
            layout,
            samplers: HashMap::new(),
            white,
            plain,
            scene: None,
            is_tame: true,
            views: Vec::new(),
            cutouts: Vec::new(),
            appearances: Vec::new(),
            group_of: Vec::new(),
            own: Vec::new(),
        }
    }

    /// Layout of group 1 of the mesh pass.
    pub(super) fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    /// A group by its number.
    pub(super) fn bind_group(&self, number: usize) -> &wgpu::BindGroup {
        self.own(number).map_or(&self.plain, |own| &own.bindings)
    }

    /// How a group is drawn, by its number.
    pub(super) fn look(&self, number: usize) -> Look {
        self.own(number).map_or(Look::Opaque, |own| own.look)
    }

    /// Whether a group reflects light in preferred directions, by its number.
    pub(super) fn is_glossy(&self, number: usize) -> bool {
        self.own(number).is_some_and(|own| own.is_glossy)
    }

    fn own(&self, number: usize) -> Option<&OwnGroup> {
        self.own.get(number.checked_sub(1)?)
    }

    /// Upload the textures of another scene, and take other appearances of materials over.
    pub(super) fn prepare(&mut self, gpu: &Gpu, scene: &Arc<Scene>, appearances: &[Appearance]) {
        let is_current = |current: &Arc<Scene>| Arc::ptr_eq(current, scene);
        if !self.scene.as_ref().is_some_and(is_current) {
            self.scene = Some(scene.clone());
            self.is_tame = is_tame(scene);
            self.views = vec![None; scene.textures.len()];
            self.cutouts = vec![None; scene.cutouts.len()];
        } else if self.appearances == appearances {
            return;
        }
        self.appearances = appearances.to_vec();
        self.own.clear();
        self.group_of = vec![0; scene.materials.len()];
        // Floors are seen at a slant.
        let anisotropy = if self.is_tame { 16 } else { 1 };
        for (index, material) in scene.materials.iter().enumerate() {
            let textures = [material.reflectance_texture, material.emission_texture];
            let gloss = gloss_vectors(material);
            if !material.has_pictures() && !material.is_see_through() && gloss.is_none() {
                continue;
            }
            let appearance = appearances.get(index).copied();
            let appearance = appearance.unwrap_or_else(|| Appearance::of(material));
            let met = material.share_of_met();
            let colors = [appearance.reflectance * met, appearance.emission * met];
            let passing = material.transmission();
            let mut views = [(); 3].map(|()| self.white.clone());
            let mut factors = Factors::default();
            factors[2] = passing.extend(0.0).to_array();
            factors[3..].copy_from_slice(&gloss.unwrap_or_default());
            if let Some(cutout) = material.cutout.map(CutoutId::index) {
                let uploaded = self.cutouts[cutout]
                    .get_or_insert_with(|| upload_cutout(gpu, &scene.cutouts[cutout]));
                (views[2], factors[2]) = (uploaded.clone(), passing.extend(1.0).to_array());
            }
            for (kind, texture) in textures.into_iter().enumerate() {
                let Some(texture) = texture.map(TextureId::index) else {
                    continue;
                };
                let uploaded = self.views[texture]
                    .get_or_insert_with(|| upload(gpu, &scene.textures[texture]));
                let factor = (colors[kind] * uploaded.scale).extend(1.0);
                (views[kind], factors[kind]) = (uploaded.view.clone(), factor.to_array());
            }
            let wrap = scene.wrap_of(material);
            let sampler = self
                .samplers
                .entry((anisotropy, wrap))
                .or_insert_with(|| sampler(gpu, anisotropy, wrap));
            self.own.push(OwnGroup {
                bindings: bind_group(gpu, &self.layout, sampler, views.each_ref(), &factors),
                look: Look::of(material),
                is_glossy: gloss.is_some(),
            });
            self.group_of[index] = self.own.len();
        }
    }

    /// The indices of a mesh, those that are drawn alike together, and where each run of them lies.
    pub(super) fn sort_for_drawing(
        &self,
        scene: &Scene,
        mesh: &DisplayMesh,
    ) -> (Vec<[u32; 3]>, Vec<DrawRange>) {
        let has_texcoords = !mesh.texcoords.is_empty();
        let kind = |index: usize| {
            let triangle = &scene.triangles[mesh.triangle_of[index] as usize];
            let copy = match (mesh.is_back[index], triangle.two_sided) {
                (true, _) => FaceCopy::Back,
                (false, true) => FaceCopy::Front,
                (false, false) => FaceCopy::Only,
            };
            let material = triangle.material.index();
            let group = match has_texcoords || !scene.materials[material].has_pictures() {
                true => self.group_of.get(material).copied().unwrap_or(0),
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

/// A sampler that looks at so many places of a slanted pixel.
fn sampler(gpu: &Gpu, anisotropy_clamp: u16, wrap: [Wrap; 2]) -> wgpu::Sampler {
    let [address_mode_u, address_mode_v] = wrap.map(|wrap| match wrap {
        Wrap::Repeat => wgpu::AddressMode::Repeat,
        Wrap::Mirror => wgpu::AddressMode::MirrorRepeat,
        Wrap::Clamp => wgpu::AddressMode::ClampToEdge,
    });
    gpu.device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("detail"),
        address_mode_u,
        address_mode_v,
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        mipmap_filter: wgpu::MipmapFilterMode::Linear,
        anisotropy_clamp,
        ..Default::default()
    })
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
            entry(4, texture),
        ],
    })
}

fn bind_group(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    sampler: &wgpu::Sampler,
    [reflectance, emission, cutout]: [&wgpu::TextureView; 3],
    factors: &Factors,
) -> wgpu::BindGroup {
    let uniform = gpu.buffer(
        "detail",
        bytemuck::cast_slice(factors),
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
            wgpu::BindGroupEntry {
                binding: 4,
                resource: wgpu::BindingResource::TextureView(cutout),
            },
        ],
    })
}

/// Width, height and pixels of a picture.
type Level = (u32, u32, Vec<Vec3>);

/// A cut-out with all its smaller levels. In each as large a part is above a half as in the whole, so that leaves do not
/// vanish in the distance (Castaño 2010).
fn upload_cutout(gpu: &Gpu, cutout: &Cutout) -> wgpu::TextureView {
    let places = (0..cutout.height).flat_map(|y| (0..cutout.width).map(move |x| (x, y)));
    let pixel = |(x, y)| Vec3::splat(f32::from(u8::from(cutout.has(x, y))));
    let whole = fitting(
        gpu,
        (cutout.width, cutout.height, places.map(pixel).collect()),
    );
    let count = whole.2.len();
    let share = whole.2.iter().map(|pixel| f64::from(pixel.x)).sum::<f64>() / count as f64;
    let format = wgpu::TextureFormat::R8Unorm;
    upload_levels(gpu, &cutout.name, whole, format, |pixels, bytes| {
        // The value that as many pixels are above becomes a half.
        let mut sorted: Vec<f32> = pixels.iter().map(|pixel| pixel.x).collect();
        sorted.sort_unstable_by(f32::total_cmp);
        let below = ((1.0 - share) * sorted.len() as f64) as usize;
        let limit = sorted[below.min(sorted.len() - 1)].clamp(1.0 / 255.0, 1.0);
        let scale = 0.5 / limit.min(0.5);
        let byte = |pixel: &Vec3| (255.0 * (pixel.x * scale).min(1.0)).round() as u8;
        bytes.extend(pixels.iter().map(byte));
    })
}

/// A texture with all its smaller levels, sRGB-encoded.
fn upload(gpu: &Gpu, texture: &Texture) -> Uploaded {
    let channels = texture.pixels.iter().map(|pixel| pixel.max_element());
    let scale = channels.fold(1.0, f32::max);
    let whole = fitting(gpu, (texture.width, texture.height, texture.pixels.clone()));
    let format = wgpu::TextureFormat::Rgba8UnormSrgb;
    let view = upload_levels(gpu, &texture.name, whole, format, |pixels, bytes| {
        bytes.extend(pixels.iter().flat_map(|pixel| {
            let [r, g, b] = (pixel / scale).to_array().map(srgb_byte);
            [r, g, b, 255]
        }));
    });
    Uploaded { view, scale }
}

/// A picture, halved until the adapter takes it.
fn fitting(gpu: &Gpu, mut level: Level) -> Level {
    while level.0.max(level.1) > MAX_SIDE.min(gpu.max_picture_side()) {
        level = halved(&level);
    }
    level
}

/// A picture with all its smaller levels, whose pixels `encode` appends as bytes of the format.
fn upload_levels(
    gpu: &Gpu,
    label: &str,
    mut level: Level,
    format: wgpu::TextureFormat,
    encode: impl Fn(&[Vec3], &mut Vec<u8>),
) -> wgpu::TextureView {
    let (width, height) = (level.0, level.1);
    let mip_level_count = width.max(height).ilog2() + 1;
    let mut bytes = Vec::new();
    for index in 0..mip_level_count {
        encode(&level.2, &mut bytes);
        if index + 1 < mip_level_count {
            level = halved(&level);
        }
    }
    let made = gpu.device.create_texture_with_data(
        &gpu.queue,
        &wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d {
                width,
                height,
                depth_or_array_layers: 1,
            },
            mip_level_count,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        },
        wgpu::util::TextureDataOrder::LayerMajor,
        &bytes,
    );
    made.create_view(&wgpu::TextureViewDescriptor::default())
}

/// A picture of half the size, at least 1 × 1; an odd last row or column counts for its neighbour, too.
fn halved((width, height, pixels): &Level) -> Level {
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
