//! Texture coordinates on their way from a file to the faces of a scene.

use glam::{DVec2, Vec2};

/// Textures repeat, and far from the origin single precision has no digits left for the picture: faces are moved by so
/// many periods. Fewer, and the coordinates of neighbours are torn apart where nothing asks for it; many more, and the
/// digits are gone.
const NEAR_PERIODS: f64 = 256.0;

/// The texture coordinates of a face, moved next to the origin; nothing where they are not finite.
pub(super) fn near_origin(uv: [DVec2; 3]) -> Option<[Vec2; 3]> {
    let shift = (uv[0] / NEAR_PERIODS).round() * NEAR_PERIODS;
    let uv = uv.map(|uv| (uv - shift).as_vec2());
    uv.iter().all(|uv| uv.is_finite()).then_some(uv)
}
