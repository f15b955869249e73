//! Picking under the cursor: the point, its element, its light, and the object around it.

use glam::{Vec2, Vec3};

use super::{camera::Camera, loader::LoadedScene, view::ViewSettings};
use crate::{
    geometry::{Hit, barycentric_in_plane},
    metrics::{ErrorMap, PooledError},
    scene::{TriangleId, luminance},
    solver::Snapshot,
};

/// A picked point. The light of it is looked up when it is shown, so that it stays current.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pick {
    /// Where, in frame units.
    pub point: Vec3,
    /// On what.
    pub triangle: TriangleId,
    /// Whether the back was met.
    pub is_back: bool,
}

/// The light at a picked point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Probe {
    /// The element, as a node of the hierarchy.
    pub element: u32,
    /// Interpolated irradiance in W/m².
    pub irradiance: Vec3,
    /// The part straight from emitters.
    pub direct: Vec3,
    /// Radiance that leaves, in W/(sr·m²).
    pub radiance: Vec3,
    /// The estimated error, where there is one: emitters have none.
    pub estimated_error: Option<PooledError>,
}

impl Probe {
    /// The same under emitters this many times as bright.
    pub fn scaled(self, factor: f32) -> Self {
        Self {
            irradiance: self.irradiance * factor,
            direct: self.direct * factor,
            radiance: self.radiance * factor,
            ..self
        }
    }
}

/// Luminance of the irradiance over an object.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ObjectLight {
    /// Smallest vertex value.
    pub min: f32,
    /// Mean over the area.
    pub mean: f32,
    /// Largest vertex value.
    pub max: f32,
    /// Area in square frame units.
    pub area: f32,
}

/// The nearest surface under a point of the picture; −1…1, y up.
/// One-sided faces seen from behind are looked through unless they are shown, and so is what stands before a room that is
/// looked into.
pub fn pick(
    loaded: &LoadedScene,
    camera: &Camera,
    ndc: Vec2,
    aspect: f32,
    view: &ViewSettings,
) -> Option<Pick> {
    /// Surfaces looked through at most; a picture with more backs before a front is a picture of nothing.
    const MOST_LAYERS: usize = 64;
    let (mut origin, direction) = camera.ray(ndc, aspect);
    let room = loaded.interior;
    let room = room.filter(|room| room.is_looked_into(camera, view));
    if let Some((room, entered)) =
        room.and_then(|room| Some((room, room.entered(origin, direction)?)))
    {
        // What stands before the room is looked through, but for its walls.
        let is_shown = |hit: &Hit| {
            let surface = loaded.scene.surfaces[hit.triangle.index()];
            let normal = surface.area_vector.normalize_or_zero();
            let point = origin + direction * hit.distance;
            normal.dot(direction) < 0.0 && room.is_wall(point, normal)
        };
        let nearest = loaded.rays.closest_shown(origin, direction, None);
        if !nearest.as_ref().is_some_and(is_shown) {
            origin += direction * entered;
        }
    }
    let mut from = None;
    for _ in 0..MOST_LAYERS {
        let hit = loaded.rays.closest_shown(origin, direction, from)?;
        let point = origin + direction * hit.distance;
        let is_back = loaded.scene.surfaces[hit.triangle.index()]
            .area_vector
            .dot(direction)
            > 0.0;
        if !is_back || view.backs || loaded.scene.triangles[hit.triangle.index()].two_sided {
            return Some(Pick {
                point,
                triangle: hit.triangle,
                is_back,
            });
        }
        (origin, from) = (point, Some(hit.triangle));
    }
    None
}

/// The light at a picked point, or `None` where the mesh does not show that side.
pub fn probe(snapshot: &Snapshot, pick: &Pick) -> Option<Probe> {
    let mesh = &snapshot.mesh;
    let mut best: Option<(usize, Vec3)> = None;
    for (index, triangle) in mesh.triangle_of.iter().enumerate() {
        if *triangle != pick.triangle.0 || mesh.is_back[index] != pick.is_back {
            continue;
        }
        let corners = mesh.indices[index].map(|corner| mesh.positions[corner as usize]);
        let weights = barycentric_in_plane(pick.point, corners);
        // The element that the point is deepest inside, so that rounding at an edge does no harm.
        if best.is_none_or(|(_, nearest)| weights.min_element() > nearest.min_element()) {
            best = Some((index, weights));
        }
    }
    let (index, weights) = best?;
    let weights = weights.max(Vec3::ZERO);
    let weights = weights / weights.element_sum().max(f32::MIN_POSITIVE);
    let corners = mesh.indices[index].map(|corner| corner as usize);
    let mix = |values: &[Vec3]| -> Vec3 {
        (0..3)
            .map(|corner| values[corners[corner]] * weights[corner])
            .sum()
    };
    let light = &snapshot.light;
    let irradiance = mix(&light.irradiance);
    let emission = mix(&mesh.emission);
    let map = ErrorMap::new(&snapshot.errors);
    let is_estimated = !map.is_empty() && emission == Vec3::ZERO;
    Some(Probe {
        element: mesh.element_of[index],
        irradiance,
        direct: mix(&light.direct),
        radiance: emission + mix(&mesh.reflectance) * irradiance / std::f32::consts::PI,
        estimated_error: is_estimated.then(|| map.at(pick.point, mix(&mesh.normals))),
    })
}

/// The light over a run of triangles.
pub fn object_light(snapshot: &Snapshot, start: TriangleId, end: TriangleId) -> ObjectLight {
    let mesh = &snapshot.mesh;
    let (mut min, mut max) = (f32::MAX, 0_f32);
    let (mut sum, mut area_sum) = (0_f64, 0_f64);
    for (corners, triangle) in mesh.indices.iter().zip(&mesh.triangle_of) {
        if *triangle < start.0 || *triangle >= end.0 {
            continue;
        }
        let [a, b, c] = corners.map(|corner| mesh.positions[corner as usize]);
        let area = f64::from(0.5 * (b - a).cross(c - a).length());
        let values = corners.map(|corner| luminance(snapshot.light.irradiance[corner as usize]));
        for value in values {
            min = min.min(value);
            max = max.max(value);
        }
        sum += area * f64::from(values.iter().sum::<f32>() / 3.0);
        area_sum += area;
    }
    if area_sum <= 0.0 {
        return ObjectLight::default();
    }
    ObjectLight {
        min,
        mean: (sum / area_sum) as f32,
        max,
        area: area_sum as f32,
    }
}

/// Box around a run of triangles, in frame units.
pub fn object_bounds(loaded: &LoadedScene, start: TriangleId, end: TriangleId) -> (Vec3, Vec3) {
    (start.0..end.0)
        .flat_map(|index| loaded.scene.corners(TriangleId(index)))
        .fold((Vec3::MAX, Vec3::MIN), |(min, max), corner| {
            (min.min(corner), max.max(corner))
        })
}
