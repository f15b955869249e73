//! Points of surfaces by their world coordinates.

use super::Spot;
use crate::{
    geometry::barycentric_in_plane,
    reference::ReferencePoint,
    sampling::SurfacePoint,
    scene::{Frame, Scene, TriangleId},
};

/// How far a point may lie from its triangle, as a share of the extent of a scene: the rounding of single precision.
const NEAR: f32 = 1e-5;

/// Least cosine between the normal of a triangle and the one asked for.
const ALONG: f32 = 0.99;

/// The point of a one-sided surface at a spot; `None` where there is none.
pub(super) fn find(scene: &Scene, spot: Spot) -> Option<ReferencePoint> {
    let position = scene.frame.from_world(spot.position);
    let normal = spot.normal.as_vec3();
    let on = |triangle: TriangleId| {
        let front = scene.surfaces[triangle.index()]
            .area_vector
            .normalize_or_zero();
        let corners = scene.corners(triangle);
        let barycentric = barycentric_in_plane(position, corners);
        let is_here = front.dot(normal) > ALONG
            && (position - corners[0]).dot(front).abs() < NEAR * Frame::EXTENT as f32
            && barycentric.min_element() > -NEAR;
        is_here.then(|| {
            ReferencePoint::from(SurfacePoint {
                triangle,
                is_back: false,
                barycentric,
                position,
                normal: front,
                reflectance: scene.reflectance_at(triangle, barycentric),
                emission: scene.emission_at(triangle, barycentric),
            })
        })
    };
    scene.triangle_ids().find_map(on)
}
