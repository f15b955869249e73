//! What rays of the picture meet: points of surfaces with their colours and the light stored about them.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use crate::{
    geometry::{Hit, RayTree, barycentric},
    metrics::{MeshLookup, MeshPlace, SidePoint},
    sampling::{EmitterPoint, Emitters},
    scene::{Appearance, Scene, Specular, TriangleId},
    solver::{DirectLights, DisplayMesh, LitPoint, Snapshot, VertexLight},
};

/// A scene with light at the vertices of its mesh.
pub(super) struct LitScene<'a> {
    pub(super) scene: &'a Scene,
    pub(super) rays: &'a RayTree,
    pub(super) mesh: &'a DisplayMesh,
    pub(super) light: &'a VertexLight,
    /// Direct light at any point.
    pub(super) lights: Option<&'a dyn DirectLights>,
    pub(super) lookup: MeshLookup<'a>,
    /// Points of emitters, for what gloss shows of them.
    pub(super) emitters: Emitters,
}

/// A point of a surface, seen from its lit side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surface {
    pub(super) triangle: TriangleId,
    pub(super) position: Vec3,
    /// Where its rays start: on the smooth surface that the normals describe, not below it.
    pub(super) start: Vec3,
    /// Unit normal of the triangle, towards the viewer.
    pub(super) flat_normal: Vec3,
    /// Unit normal of the smooth surface, likewise.
    pub(super) normal: Vec3,
    pub(super) reflectance: Vec3,
    pub(super) emission: Vec3,
    /// What it sends in preferred directions, of what rays meet.
    pub(super) specular: Option<Specular>,
    /// Whether it is seen from the back of its triangle.
    pub(super) is_back: bool,
    /// Its place among the vertices; `None` where the mesh has none.
    pub(super) place: Option<MeshPlace>,
}

impl<'a> LitScene<'a> {
    /// A scene, all of its triangles, and its light.
    pub(super) fn new(scene: &'a Scene, rays: &'a RayTree, snapshot: &'a Snapshot) -> Self {
        Self {
            scene,
            rays,
            mesh: &snapshot.mesh,
            light: &snapshot.light,
            lights: snapshot.lights.as_deref(),
            lookup: MeshLookup::new(scene, &snapshot.mesh),
            emitters: Emitters::new(scene),
        }
    }
}

impl LitScene<'_> {
    /// The unit normal of a triangle, towards the side that a ray comes from, and whether that is the back.
    pub(super) fn side(&self, triangle: TriangleId, direction: Vec3) -> (Vec3, bool) {
        let area = self.scene.surfaces[triangle.index()].area_vector;
        let normal = area.normalize_or(-direction);
        let is_back = normal.dot(direction) > 0.0;
        (if is_back { -normal } else { normal }, is_back)
    }

    /// Whether a side of a triangle reflects and emits.
    pub(super) fn is_lit(&self, triangle: TriangleId, is_back: bool) -> bool {
        !is_back || self.scene.triangles[triangle.index()].two_sided
    }

    /// The surface that a ray meets; `None` at the back of a one-sided one that is no glass.
    pub(super) fn surface(&self, origin: Vec3, direction: Vec3, hit: Hit) -> Option<Surface> {
        let triangle = hit.triangle;
        let (flat_normal, is_back) = self.side(triangle, direction);
        let is_lit = self.is_lit(triangle, is_back);
        let position = origin + direction * hit.distance;
        (is_lit || self.scene.material(triangle).is_glass())
            .then(|| self.surface_at(triangle, is_back, flat_normal, position))
    }

    /// A point of a side of a triangle, which has this unit normal.
    pub(super) fn surface_at(
        &self,
        triangle: TriangleId,
        is_back: bool,
        flat_normal: Vec3,
        position: Vec3,
    ) -> Surface {
        let at = barycentric(position, self.scene.corners(triangle));
        let shown = if self.is_lit(triangle, is_back) {
            self.appearance(triangle)
        } else {
            Appearance {
                reflectance: Vec3::ZERO,
                emission: Vec3::ZERO,
            }
        };
        let place = self.lookup.place(&SidePoint {
            triangle,
            is_back,
            barycentric: at,
            position,
        });
        let (normal, start) = match place {
            Some(place) => self.smooth(position, flat_normal, &place),
            None => (flat_normal, position),
        };
        Surface {
            triangle,
            position,
            start,
            flat_normal,
            normal,
            reflectance: self.scene.reflected_at(triangle, shown.reflectance, at),
            emission: self.scene.emitted_at(triangle, shown.emission, at),
            specular: self.scene.material(triangle).specular,
            is_back,
            place,
        }
    }

    /// The present appearance of the material of a triangle.
    fn appearance(&self, triangle: TriangleId) -> Appearance {
        let material = self.scene.triangles[triangle.index()].material;
        let shown = self.mesh.appearances.get(material.index()).copied();
        shown.unwrap_or_else(|| Appearance::of(self.scene.material(triangle)))
    }

    /// Radiance that a point of an emitter sends, W·sr⁻¹·m⁻².
    pub(super) fn emitted(&self, point: &EmitterPoint) -> Vec3 {
        let emission = self.appearance(point.triangle).emission;
        self.scene
            .emitted_at(point.triangle, emission, point.barycentric)
    }

    /// What a surface reflects of light from all directions, in whatever directions, but for mirrors that rays follow.
    pub(super) fn reflectance(&self, surface: &Surface) -> Vec3 {
        if surface.specular.is_none() || self.rays.follows(surface.triangle) {
            return surface.reflectance;
        }
        let diffused = self.scene.material(surface.triangle).diffused_specular();
        (surface.reflectance + diffused).min(Vec3::splat(self.scene.max_reflectance))
    }

    /// The normal of the smooth surface, and the place on it: the point's projections onto the tangent planes of the
    /// vertices, interpolated where they lie outside (Hanika, "Hacking the Shadow Terminator", 2021).
    fn smooth(&self, position: Vec3, flat: Vec3, place: &MeshPlace) -> (Vec3, Vec3) {
        let normals = &self.mesh.normals;
        let corners = place.vertices.map(|vertex| vertex as usize);
        let is_flat = |corner: usize| normals[corner].dot(flat) > 1.0 - 1e-6;
        if corners.into_iter().all(is_flat) {
            return (flat, position);
        }
        let normal = place.interpolate(normals).normalize_or(flat);
        let mut outward = Vec3::ZERO;
        for (corner, weight) in corners.into_iter().zip(place.weights.to_array()) {
            let normal = normals[corner];
            let height = (position - self.mesh.positions[corner]).dot(normal);
            outward -= normal * (height.min(0.0) * weight);
        }
        (normal, position + outward)
    }

    /// Total and direct irradiance stored at a surface, W/m².
    pub(super) fn stored(&self, surface: &Surface) -> [Vec3; 2] {
        surface.place.map_or([Vec3::ZERO; 2], |place| {
            [&self.light.irradiance, &self.light.direct].map(|values| place.interpolate(values))
        })
    }

    /// The size of the element about a surface, frame units: nearer than that its interpolated light tells little.
    pub(super) fn element_size(&self, surface: &Surface) -> f32 {
        surface.place.map_or(0.0, |place| {
            let [a, b, c] = place.vertices.map(|at| self.mesh.positions[at as usize]);
            a.distance(b).max(b.distance(c)).max(c.distance(a))
        })
    }

    /// Radiance that a surface of this irradiance sends to other surfaces beside what is direct light there.
    pub(super) fn sent(&self, surface: &Surface, irradiance: Vec3) -> Vec3 {
        let emits = self.lights.is_none_or(|lights| !lights.has_emitters());
        let emission = if emits { surface.emission } else { Vec3::ZERO };
        emission + self.reflectance(surface) * irradiance * FRAC_1_PI
    }

    /// Radiance that a surface reflects of the light stored there, in whatever directions, as [`Self::reflectance`] says.
    pub(super) fn reflected(&self, surface: &Surface) -> Vec3 {
        self.reflectance(surface) * self.stored(surface)[0] * FRAC_1_PI
    }
}

impl Surface {
    /// The point as direct light sees it, where this irradiance is expected.
    pub(super) fn lit_point(&self, expected: Vec3) -> LitPoint {
        LitPoint {
            position: self.start,
            normal: self.normal,
            triangle: self.triangle,
            expected,
        }
    }
}
