//! Texture coordinates on their way from a file to the faces of a scene.

use glam::{DVec2, Vec2};

use super::Wrap;

/// Textures repeat, and far from the origin single precision has no digits left for the picture: faces are moved by so
/// many periods. Fewer, and the coordinates of neighbours are torn apart where nothing asks for it; many more, and the
/// digits are gone.
const NEAR_PERIODS: f64 = 256.0;

/// The texture coordinates of a face, moved next to the origin where what they show comes again there; nothing where they
/// are not finite.
pub(super) fn near_origin(uv: [DVec2; 3], [across, down]: [Wrap; 2]) -> Option<[Vec2; 3]> {
    // An even number of periods, so that what is mirrored is as it was.
    let moves = |wrap: Wrap| {
        if wrap == Wrap::Clamp {
            0.0
        } else {
            NEAR_PERIODS
        }
    };
    let moved = DVec2::new(moves(across), moves(down));
    let shift = (uv[0] / NEAR_PERIODS).round() * moved;
    let uv = uv.map(|uv| (uv - shift).as_vec2());
    uv.iter().all(|uv| uv.is_finite()).then_some(uv)
}
