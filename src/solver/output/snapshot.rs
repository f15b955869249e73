//! The snapshot of a solve: a display mesh with light at its vertices, and the cluster tree.
//!
//! Parts that did not change between two snapshots are shared, so that a reader can compare pointers to find what
//! changed.

use std::sync::Arc;

use glam::Vec3;

use super::{direct_lights::DirectLights, estimated_error::ErrorPoint, omitted::Omitted};
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
    /// Appearance by material, which multiplies its textures; empty for that of the scene.
    pub appearances: Vec<Appearance>,
    /// Triangles, counter-clockwise from the lit side.
    pub indices: Vec<[u32; 3]>,
    /// The scene's triangle under each display triangle.
    pub triangle_of: Vec<u32>,
    /// Whether each display triangle is the back of a two-sided one.
    pub is_back: Vec<bool>,
    /// The element under each display triangle, as a node of the hierarchy.
    pub element_of: Vec<u32>,
    /// The last vertices are copies of these, with the texture coordinates of the other side of a seam, or for what is
    /// covered.
    pub repeated: Vec<u32>,
    /// Those of the copies, in order, of triangles that are covered, which no light reaches: they share no vertex with what
    /// is lit beside them.
    pub covered: Vec<u32>,
}

impl DisplayMesh {
    /// Number of vertices that are not copies.
    pub fn own_vertex_count(&self) -> usize {
        self.positions.len() - self.repeated.len()
    }

    /// The vertex of which a vertex is a copy, or itself.
    pub fn own_vertex(&self, vertex: u32) -> usize {
        let repetition = (vertex as usize).checked_sub(self.own_vertex_count());
        repetition.map_or(vertex, |place| self.repeated[place]) as usize
    }

    /// Give copies the light of their vertices, and those that are covered none.
    pub fn repeat_light<T: Copy + Default>(&self, values: &mut Vec<T>) {
        self.repeat(values);
        for &vertex in &self.covered {
            values[vertex as usize] = T::default();
        }
    }

    /// Whether a display triangle is covered.
    pub fn is_covered(&self, triangle: usize) -> bool {
        let [vertex, ..] = self.indices[triangle];
        self.covered.binary_search(&vertex).is_ok()
    }

    /// Give copies the values of their vertices.
    pub fn repeat<T: Copy>(&self, values: &mut Vec<T>) {
        values.truncate(self.own_vertex_count());
        for &vertex in &self.repeated {
            values.push(values[vertex as usize]);
        }
    }
}

/// Light at the vertices of a [`DisplayMesh`], linear RGB; all finite and not negative.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VertexLight {
    /// Total irradiance, W/m².
    pub irradiance: Vec<Vec3>,
    /// The direct part, from sampled emitters, W/m².
    pub direct: Vec<Vec3>,
}

/// One cluster, for display.
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
    /// Number of its patches.
    pub patch_count: u32,
    /// Sum of the patch areas, square frame units.
    pub area: f32,
    /// Luminance of the power that leaves it, over links and by sampled emission, W/m² times square frame units.
    pub power: f32,
    /// 1 − |Σ S| / Σ |S| : 0 when all normals agree, 1 when they cancel.
    pub direction_spread: f32,
    /// Number of links over which it receives.
    pub link_count: u32,
    /// Number of links over which it sends to others, or to itself.
    pub source_count: u32,
    /// Sum of the estimated errors of the links over which it receives (luminance of the irradiance).
    pub error: f32,
    /// Luminance of the power along the box normals, +x −x +y −y +z −z.
    pub face_power: [f32; 6],
}

/// The state after a step.
#[derive(Clone, Debug, Default)]
pub struct Snapshot {
    /// Number of the step, from 1; 0 before the first step, when there is direct light only.
    pub step: u32,
    /// The mesh; the same `Arc` as before if elements did not change.
    pub mesh: Arc<DisplayMesh>,
    /// Light at its vertices.
    pub light: Arc<VertexLight>,
    /// The clusters, parents before children, without patches and elements.
    pub clusters: Arc<Vec<ClusterBox>>,
    /// The parts that the scene does not need.
    pub omitted: Arc<Vec<Omitted>>,
    /// Direct light at any point, as far as it is sampled; `None` before there is any light.
    pub lights: Option<Arc<dyn DirectLights>>,
    /// The estimated error of its light at random points; none before the first step, and after a change of emitters and
    /// materials until the next.
    pub errors: Arc<Vec<ErrorPoint>>,
}

impl Snapshot {
    /// Whether there is light to display: after a step, or before the first if any direct light arrives.
    pub fn is_lit(&self) -> bool {
        self.step > 0
            || self
                .light
                .irradiance
                .iter()
                .any(|light| *light != Vec3::ZERO)
    }

    /// Memory in bytes.
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
            + size_of_val(mesh.covered.as_slice())
            + size_of_val(light.irradiance.as_slice())
            + size_of_val(light.direct.as_slice())
            + size_of_val(self.clusters.as_slice())
            + size_of_val(self.errors.as_slice())
    }
}
