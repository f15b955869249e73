//! What a solve shows of itself: a display mesh with light at its vertices and the cluster tree.
//!
//! Parts that did not change between two snapshots are shared, so that a reader can tell by pointer what to upload.

use std::sync::Arc;

use glam::Vec3;

use super::omitted::Omitted;
use crate::scene::Appearance;

/// The crack-free mesh of the current elements. Two-sided triangles appear once per side.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DisplayMesh {
    /// Vertex positions in frame units.
    pub positions: Vec<Vec3>,
    /// Unit normals, towards the lit side.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, or empty where the scene has no textures.
    pub texcoords: Vec<glam::Vec2>,
    /// Reflectance at the vertex, mean of the elements about it (textures averaged over each).
    pub reflectance: Vec<Vec3>,
    /// Emitted radiance at the vertex, likewise.
    pub emission: Vec<Vec3>,
    /// What each material multiplies its textures by, or empty where that is as the scene says.
    pub appearances: Vec<Appearance>,
    /// Triangles, counter-clockwise from the lit side.
    pub indices: Vec<[u32; 3]>,
    /// The scene's triangle under each display triangle.
    pub triangle_of: Vec<u32>,
    /// Whether each display triangle is the back of a two-sided one.
    pub is_back: Vec<bool>,
    /// The element under each display triangle, as a node of the hierarchy.
    pub element_of: Vec<u32>,
    /// The last vertices repeat these, with the texture coordinates of the other side of a seam.
    pub repeated: Vec<u32>,
}

/// Light at the vertices of a [`DisplayMesh`], linear RGB; all finite and not negative.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VertexLight {
    /// Total irradiance, W/m².
    pub irradiance: Vec<Vec3>,
    /// The part that comes straight from emitters, W/m².
    pub direct: Vec<Vec3>,
    /// Estimated error of the irradiance (luminance), W/m².
    pub uncertainty: Vec<f32>,
}

/// One node of the tree, for display.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClusterBox {
    /// Lower corner in frame units.
    pub min: Vec3,
    /// Upper corner in frame units.
    pub max: Vec3,
    /// Depth; the root has 0.
    pub level: u32,
    /// Index of the parent in the list, `u32::MAX` for the root.
    pub parent: u32,
    /// Number of patches below it.
    pub patch_count: u32,
    /// Sum of the patch areas, square frame units.
    pub area: f32,
    /// Luminance of the power that leaves it, over links and over samples, frame units.
    pub power: f32,
    /// 1 − |Σ S| / Σ |S| : 0 when all normals agree, 1 when they cancel.
    pub direction_spread: f32,
    /// Links that this node receives over.
    pub link_count: u32,
    /// Links by which this node sends to others, or to itself.
    pub source_count: u32,
    /// Sum of the estimated errors of the links that it receives over (luminance irradiance).
    pub error: f32,
    /// Luminance of the power along the box normals, +x −x +y −y +z −z.
    pub face_power: [f32; 6],
}

/// The state after a step.
#[derive(Clone, Debug, Default)]
pub struct Snapshot {
    /// Number of the step, from 1; before that 0, when the light is that of sampled emitters alone.
    pub step: u32,
    /// The mesh; the same `Arc` as before where elements did not change.
    pub mesh: Arc<DisplayMesh>,
    /// Light at its vertices.
    pub light: Arc<VertexLight>,
    /// The cluster tree, children after parents; patches and elements left out.
    pub clusters: Arc<Vec<ClusterBox>>,
    /// What the scene does not need and was left out.
    pub omitted: Arc<Vec<Omitted>>,
}

impl Snapshot {
    /// Whether there is light to show: after a step, or before the first where light was sampled.
    pub fn is_lit(&self) -> bool {
        self.step > 0
            || self
                .light
                .irradiance
                .iter()
                .any(|light| *light != Vec3::ZERO)
    }

    /// Bytes held.
    pub(crate) fn memory_bytes(&self) -> usize {
        let (mesh, light) = (&self.mesh, &self.light);
        size_of_val(mesh.positions.as_slice())
            + size_of_val(mesh.normals.as_slice())
            + size_of_val(mesh.texcoords.as_slice())
            + size_of_val(mesh.reflectance.as_slice())
            + size_of_val(mesh.emission.as_slice())
            + size_of_val(mesh.indices.as_slice())
            + size_of_val(mesh.triangle_of.as_slice())
            + size_of_val(mesh.is_back.as_slice())
            + size_of_val(mesh.element_of.as_slice())
            + size_of_val(mesh.repeated.as_slice())
            + size_of_val(light.irradiance.as_slice())
            + size_of_val(light.direct.as_slice())
            + size_of_val(light.uncertainty.as_slice())
            + size_of_val(self.clusters.as_slice())
    }
}
