//! Emitters, and the sampling of their points.

use std::f32::consts::PI;

use glam::{Vec2, Vec3, Vec4};

use crate::{
    geometry::{SphericalTriangle, triangle_point},
    hierarchy::Hierarchy,
    scene::{MaterialId, Scene, TriangleId},
    solver::places::Receiver,
};

/// An emitting patch, or a part of one whose texture varies.
#[derive(Clone, Copy, Debug)]
pub(super) struct Emitter {
    /// Indices into the points of the mesh, as the side that emits is wound.
    pub vertices: [u32; 3],
    pub corners: [Vec3; 3],
    pub normal: Vec3,
    pub area: f32,
    pub triangle: TriangleId,
    pub material: MaterialId,
    /// Mean of the emission texture over it, which multiplies the emission of the material.
    pub texture: Vec3,
    pub radiosity: Vec4,
}

impl Emitter {
    /// The emitter that is an element.
    pub(crate) fn new(scene: &Scene, hierarchy: &Hierarchy, element: usize) -> Self {
        let mesh = &hierarchy.mesh;
        let patch = hierarchy.patch_of(element);
        let at = &mesh.elements[element];
        Self {
            vertices: at
                .vertices
                .map(|vertex| mesh.vertices[vertex as usize].point),
            corners: mesh.corners(element),
            normal: patch.normal,
            area: at.area_vector.length(),
            triangle: patch.triangle,
            material: scene.triangles[patch.triangle.index()].material,
            texture: hierarchy.texture_means_of(scene, element).emission,
            radiosity: (hierarchy.emission_of(element) * PI).extend(0.0),
        }
    }

    /// A point of the emitter for a point of the unit square, and its weight at a receiver, up to a factor. `seen` is
    /// the spherical triangle of an emitter with a large solid angle: its directions are sampled uniformly; otherwise
    /// its points are.
    pub(super) fn aim(
        &self,
        receiver: &Receiver,
        seen: Option<&SphericalTriangle>,
        square: Vec2,
    ) -> (Vec3, f32) {
        if let Some(seen) = seen {
            let direction = seen.direction(square);
            let height = (self.corners[0] - receiver.point).dot(self.normal);
            let distance = height / direction.dot(self.normal);
            let cosine = direction.dot(receiver.normal);
            let is_met = distance.is_finite() && distance > 0.0;
            let weight = if is_met { cosine } else { 0.0 };
            return (receiver.point + direction * distance, weight);
        }
        let at = triangle_point(square);
        let [a, b, c] = self.corners;
        let point = a * at.x + b * at.y + c * at.z;
        let separation = point - receiver.point;
        let squared = separation.length_squared();
        let cosines =
            separation.dot(receiver.normal).max(0.0) * (-separation.dot(self.normal)).max(0.0);
        (point, cosines / (squared * squared))
    }
}
