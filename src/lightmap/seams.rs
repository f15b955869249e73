//! How well light fits where a surface goes on smoothly from one chart to another.

use glam::{Vec2, Vec3};

use super::sides::Neighbours;
use crate::scene::luminance;

/// Edges that are looked at, at most. Fewer miss seams; more take time and tell no more.
const MOST_EDGES: usize = 1 << 16;

/// Places of an edge that are compared, as parts of its length.
const PLACES: [f32; 5] = [0.1, 0.3, 0.5, 0.7, 0.9];

/// An edge by its ends in the picture, as seen from both charts, in texels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seam([[Vec2; 2]; 2]);

/// The smooth edges between charts.
pub(super) fn seams(corners: &[[Vec2; 3]], chart_of: &[u32], neighbours: &Neighbours) -> Vec<Seam> {
    let ends = |side: u32, edge: usize| {
        let corners = &corners[side as usize];
        [corners[edge], corners[(edge + 1) % 3]]
    };
    let mut seams = Vec::new();
    for side in 0..corners.len() as u32 {
        for (edge, other) in neighbours.about(side) {
            let is_seam = side < other && chart_of[side as usize] != chart_of[other as usize];
            let back = neighbours.about(other).find(|(_, back)| *back == side);
            if let (true, Some((other_edge, _))) = (is_seam, back) {
                let [to, from] = ends(other, other_edge);
                seams.push(Seam([ends(side, edge), [from, to]]));
            }
        }
    }
    seams
}

/// By how much the luminance of the light differs from one side of the seams to the other: root mean square, relative to that
/// of the light there. `None` where there are no seams.
pub(super) fn seam_error(seams: &[Seam], light: &[Vec3], width: u32) -> Option<f64> {
    let (mut apart, mut whole) = (0.0, 0.0);
    for Seam(charts) in seams
        .iter()
        .step_by(seams.len().div_ceil(MOST_EDGES).max(1))
    {
        for part in PLACES {
            let [one, other] = charts.map(|[from, to]| {
                let found = lookup(light, width, from.lerp(to, part));
                f64::from(luminance(found))
            });
            apart += (one - other).powi(2);
            whole += 0.5 * (one * one + other * other);
        }
    }
    (whole > 0.0).then(|| (apart / whole).sqrt())
}

/// What a bilinear lookup finds at a place in texels.
pub(super) fn lookup(light: &[Vec3], width: u32, place: Vec2) -> Vec3 {
    let last = (width - 1) as f32;
    let place = (place - 0.5).clamp(Vec2::ZERO, Vec2::splat(last));
    let first = place.floor();
    let part = place - first;
    let texel = |right: f32, down: f32| {
        let [column, row] = [first.x + right, first.y + down].map(|at| at.min(last) as usize);
        light[row * width as usize + column]
    };
    let top = texel(0.0, 0.0).lerp(texel(1.0, 0.0), part.x);
    let bottom = texel(0.0, 1.0).lerp(texel(1.0, 1.0), part.x);
    top.lerp(bottom, part.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lookup_between_texels_blends_four_of_them() {
        let light: Vec<Vec3> = (0..9).map(|at| Vec3::splat(at as f32)).collect();
        let at = |x: f32, y: f32| lookup(&light, 3, Vec2::new(x, y)).x;
        assert_eq!(at(1.5, 1.5), 4.0);
        assert_eq!(at(1.0, 1.0), 2.0);
        assert_eq!((at(0.0, 0.0), at(3.0, 3.0)), (0.0, 8.0));
    }

    #[test]
    fn the_error_of_a_seam_is_relative_to_its_light() {
        let light = [1.0, 1.1, 1.0, 1.1].map(Vec3::splat);
        let edge = |x: f32| [Vec2::new(x, 0.5), Vec2::new(x, 1.5)];
        let seams = [Seam([edge(0.5), edge(1.5)])];
        let error = seam_error(&seams, &light, 2).unwrap();
        assert!((error - 0.1 / 1.105_f64.sqrt()).abs() < 1e-6, "{error}");
        assert_eq!(seam_error(&[], &light, 2), None);
    }
}
