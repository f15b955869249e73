//! Uploads of a scene to the adapter: mesh, light, textures, cluster boxes. Made again only where the `Arc` that a part
//! comes from is another, on whatever thread; copies share the buffers, so that one can be drawn from while the next is
//! being made.

use std::sync::Arc;

use super::{
    BoxInstance, Gpu, RenderError,
    detail::{DetailSet, DrawRange},
    line_pass::Instances,
};
use crate::{
    picture::GlossLight,
    scene::Scene,
    solver::{DisplayMesh, VertexLight},
    viewer::view::ViewMode,
};

/// The source of uploads.
pub struct Source<'a> {
    /// Materials and textures.
    pub scene: &'a Arc<Scene>,
    /// The mesh.
    pub mesh: &'a Arc<DisplayMesh>,
    /// Its light.
    pub light: &'a Arc<VertexLight>,
    /// Errors at its vertices in per cent, for the modes that show them, where they are known.
    pub errors: Option<&'a Arc<Vec<f32>>>,
    /// What gloss reflects at its vertices, where that is known.
    pub gloss: Option<&'a Arc<GlossLight>>,
    /// Which light is shown.
    pub mode: ViewMode,
    /// Whether edges are drawn.
    pub edges: bool,
    /// Cluster boxes.
    pub boxes: &'a Arc<Vec<BoxInstance>>,
}

/// Uploads to the adapter. Cheap to clone.
#[derive(Clone)]
pub struct Uploads {
    details: DetailSet,
    mesh: Option<MeshBuffers>,
    light: Option<(LightSource, wgpu::Buffer)>,
    gloss: Option<(Arc<GlossLight>, wgpu::Buffer)>,
    boxes: Instances<BoxInstance>,
}

impl Uploads {
    /// Nothing yet.
    pub(super) fn new(details: DetailSet) -> Self {
        Self {
            details,
            mesh: None,
            light: None,
            gloss: None,
            boxes: Instances::default(),
        }
    }

    /// Upload what changed.
    ///
    /// # Errors
    /// [`RenderError::MeshTooLarge`]; there is no mesh then.
    pub fn renew(&mut self, gpu: &Gpu, source: &Source<'_>) -> Result<(), RenderError> {
        self.boxes.prepare(gpu, "boxes", source.boxes);
        self.details
            .prepare(gpu, source.scene, &source.mesh.appearances);
        let is_current = |current: &MeshBuffers| Arc::ptr_eq(&current.source, source.mesh);
        if !self.mesh.as_ref().is_some_and(is_current) {
            // Nobody holds on to the old mesh here: two large ones may not fit.
            (self.mesh, self.light, self.gloss) = (None, None, None);
            if source.mesh.indices.is_empty() {
                return Ok(());
            }
            check_size(gpu, source.mesh)?;
            self.mesh = Some(MeshBuffers::new(gpu, source, &self.details));
        }
        let wanted = LightSource::of(source);
        let is_current = |(current, _): &(LightSource, wgpu::Buffer)| current.is_same(&wanted);
        if !self.light.as_ref().is_some_and(is_current) {
            let buffer = wanted.upload(gpu, source.mesh.positions.len());
            self.light = Some((wanted, buffer));
        }
        let is_current = |(current, _): &(Arc<GlossLight>, wgpu::Buffer)| {
            source
                .gloss
                .is_some_and(|wanted| Arc::ptr_eq(current, wanted))
        };
        if !self.gloss.as_ref().is_some_and(is_current) {
            self.gloss = source
                .gloss
                .and_then(|gloss| upload_gloss(gpu, source, gloss));
        }
        if let Some(mesh) = &mut self.mesh
            && source.mode.shows_edges(source.edges)
        {
            mesh.prepare_edges(gpu);
        }
        Ok(())
    }

    /// The mesh.
    pub(super) fn mesh(&self) -> Option<&MeshBuffers> {
        self.mesh.as_ref()
    }

    /// The light at its vertices.
    pub(super) fn light(&self) -> Option<&wgpu::Buffer> {
        self.light.as_ref().map(|(_, buffer)| buffer)
    }

    /// What gloss reflects at its vertices.
    pub(super) fn gloss(&self) -> Option<&wgpu::Buffer> {
        self.gloss.as_ref().map(|(_, buffer)| buffer)
    }

    /// The textures.
    pub(super) fn details(&self) -> &DetailSet {
        &self.details
    }

    /// The cluster boxes.
    pub(super) fn boxes(&self) -> &Instances<BoxInstance> {
        &self.boxes
    }
}

/// The light that a mode shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Channel {
    Irradiance,
    Direct,
}

impl Channel {
    fn of(mode: ViewMode) -> Self {
        match mode {
            ViewMode::DirectOnly => Self::Direct,
            _ => Self::Irradiance,
        }
    }
}

/// The source of the buffer of light.
#[derive(Clone)]
enum LightSource {
    Light(Arc<VertexLight>, Channel),
    Errors(Arc<Vec<f32>>),
}

impl LightSource {
    fn of(source: &Source<'_>) -> Self {
        match (source.mode, source.errors) {
            (mode, Some(errors)) if mode.shows_errors() => Self::Errors(errors.clone()),
            (mode, _) => Self::Light(source.light.clone(), Channel::of(mode)),
        }
    }

    fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Light(a, shown), Self::Light(b, wanted)) => Arc::ptr_eq(a, b) && shown == wanted,
            (Self::Errors(a), Self::Errors(b)) => Arc::ptr_eq(a, b),
            _ => false,
        }
    }

    /// A buffer of it for so many vertices. A new one each time: the old one may still be drawn from.
    fn upload(&self, gpu: &Gpu, vertex_count: usize) -> wgpu::Buffer {
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("light"),
            size: 12 * vertex_count as u64,
            usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let gray = |values: &[f32]| -> Vec<[f32; 3]> { values.iter().map(|x| [*x; 3]).collect() };
        let grays;
        let bytes: &[u8] = match self {
            Self::Light(light, Channel::Irradiance) => bytemuck::cast_slice(&light.irradiance),
            Self::Light(light, Channel::Direct) => bytemuck::cast_slice(&light.direct),
            Self::Errors(errors) => {
                grays = gray(errors);
                bytemuck::cast_slice(&grays)
            }
        };
        let fitting = bytes.len().min(buffer.size() as usize);
        gpu.queue.write_buffer(&buffer, 0, &bytes[..fitting]);
        buffer
    }
}

/// A buffer of gloss; `None` where it is not of this mesh, or larger than the adapter takes.
fn upload_gloss(
    gpu: &Gpu,
    source: &Source<'_>,
    gloss: &Arc<GlossLight>,
) -> Option<(Arc<GlossLight>, wgpu::Buffer)> {
    let bytes: &[u8] = bytemuck::cast_slice(&gloss.vertices);
    let fits = gloss.vertices.len() == source.mesh.positions.len()
        && bytes.len() as u64 <= gpu.max_buffer_size;
    fits.then(|| {
        let buffer = gpu.buffer("gloss", bytes, wgpu::BufferUsages::VERTEX);
        (gloss.clone(), buffer)
    })
}

/// The mesh on the adapter.
#[derive(Clone)]
pub(super) struct MeshBuffers {
    source: Arc<DisplayMesh>,
    pub(super) positions: wgpu::Buffer,
    pub(super) normals: wgpu::Buffer,
    pub(super) texcoords: Option<wgpu::Buffer>,
    pub(super) reflectance: wgpu::Buffer,
    pub(super) emission: wgpu::Buffer,
    pub(super) indices: wgpu::Buffer,
    pub(super) ranges: Vec<DrawRange>,
    /// Made when edges are first shown.
    pub(super) edges: Option<(wgpu::Buffer, u32)>,
}

impl MeshBuffers {
    fn new(gpu: &Gpu, source: &Source<'_>, details: &DetailSet) -> Self {
        let mesh = source.mesh;
        let vertices = |label, bytes: &[u8]| gpu.buffer(label, bytes, wgpu::BufferUsages::VERTEX);
        let (indices, ranges) = details.sort_for_drawing(source.scene, mesh);
        Self {
            source: mesh.clone(),
            positions: vertices("positions", bytemuck::cast_slice(&mesh.positions)),
            normals: vertices("normals", bytemuck::cast_slice(&mesh.normals)),
            texcoords: (mesh.texcoords.len() == mesh.positions.len())
                .then(|| vertices("texture coordinates", bytemuck::cast_slice(&mesh.texcoords))),
            reflectance: vertices("reflectance", bytemuck::cast_slice(&mesh.reflectance)),
            emission: vertices("emission", bytemuck::cast_slice(&mesh.emission)),
            indices: gpu.buffer(
                "indices",
                bytemuck::cast_slice(&indices),
                wgpu::BufferUsages::INDEX,
            ),
            ranges,
            edges: None,
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
